# `make demo` and `make test` do all their own set-up; nothing else is needed but python3 (>= 3.11) with venv.
PYTHON ?= python3
VENV ?= .venv
# How many processes share the tests; 0 for none. Twice as many as processors, for tests also wait: for servers, disks
# and windows. Not more than eight, for each takes some 400 MB, and a container may be shown more processors than it
# has.
WORKERS ?= $(shell n=$$(getconf _NPROCESSORS_ONLN || echo 2); echo $$((n < 4 ? 2 * n : 8)))
# The queue and the databases write through to the disk, thousands of times: in memory that takes no time. Only where
# /dev/shm has room for all tests, as much memory again is free for the tests themselves, and programs may be started
# there.
MEMORY := $(shell df -Pk /dev/shm 2>/dev/null | awk '$$6 == "/dev/shm" && $$4 > 6000000 {print "/dev/shm"}')
MEMORY := $(shell awk '$$1 == "MemAvailable:" && $$2 > 12000000 {print "$(MEMORY)"}' /proc/meminfo 2>/dev/null)
ifneq ($(MEMORY),)
IN_MEMORY := $(shell probe=$$(mktemp $(MEMORY)/silo-XXXXXX) && echo exit >$$probe && chmod 700 $$probe && \
    $$probe && echo TMPDIR=$(MEMORY); rm -f $$probe)
endif
# The order of the tests is shuffled, by one seed, so that no landing fails by chance: `make test SEED=7` hunts.
SEED ?= 20261128
SPREAD = -n $(WORKERS) --durations=60 --durations-min=2
SHUFFLED = --randomly-seed=$(SEED)
# Compiled files are kept, whatever the machine's settings; else each process of each run compiles all tests anew.
export PYTHONDONTWRITEBYTECODE :=
BIN := $(VENV)/bin
DEV := $(VENV)/.installed-dev
SERVER := $(VENV)/.installed-server

.PHONY: help demo test mutants test-postgres test-machine test-windows-files test-other-disk check translations release setup docs clean

help:
	@echo "make demo   set up and sync a real assembly with the embedded server (DEMO=--keep leaves it running)"
	@echo "make test   set up and run the tests"
	@echo "make test-postgres  the contract of the server over PostgreSQL, whole"
	@echo "make test-machine  the tests that need FreeCAD or Chromium on the machine"
	@echo "make test-windows-files  the tests with the file semantics of Windows, simulated"
	@echo "make test-other-disk  the tests on a disk that does not distinguish upper and lower case (Linux, FUSE)"
	@echo "make mutants  plant a mutant of each rule that keeps data (scripts/mutants.toml); each has to die"
	@echo "make docs   the site of the documentation, in build/site"
	@echo "make release  build, try and list what would be published, in dist/; tags and publishes nothing"
	@echo "make check  ruff, mypy, import directions, plain English"
	@echo "make translations  bring the files for translators up to date (LANGUAGE=de begins one)"

setup: $(DEV)

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "silo-mod needs Python 3.11 or newer, this is " + sys.version)'
	$(PYTHON) -m venv $(VENV)

# The demo needs the server only; the tests need everything.
$(SERVER): pyproject.toml package.xml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --editable '.[server]'
	@touch $@

$(DEV): pyproject.toml package.xml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	@! command -v c++ >/dev/null || $(BIN)/python -m pip install --quiet --editable '.[simplify]'
	@scripts/kernel-libraries.sh $(BIN)/python
	@touch $(SERVER) $@

demo: $(SERVER)
	$(BIN)/silo-mod demo $(DEMO)

test: setup
	$(IN_MEMORY) $(BIN)/python -m pytest $(SPREAD) $(SHUFFLED) --dist worksteal -m "not freecad and not browser" --ignore=tests/browser

# `make test` runs each test over one database, and over both if they might differ; here is the rest.
test-postgres: setup
	$(IN_MEMORY) SILO_POSTGRES=1 $(BIN)/python -m pytest $(SPREAD) $(SHUFFLED) --dist worksteal -k postgres tests/contract

# Where files are replaced, removed and locked: all but a few of the places that do so are reached from one of these.
# PostgreSQL's test library is POSIX only.
ON_WINDOWS = $(addprefix tests/,api/test_config.py api/test_files.py contract/test_files.py fcstd/test_relink.py \
	fcstd/test_stamp.py outbox/test_send.py outbox/test_store.py vault/test_git.py vault/test_index.py \
	vault/test_pull.py workbench/commit workbench/register/test_flow.py workbench/documents workbench/revisions workbench/session \
	$(addprefix cli/test_,bom_diff.py commands.py login.py night_job.py project.py register.py) \
	$(addprefix inertia/,geometry/test_cache.py output/test_files.py) registering/test_carry_out.py \
	$(addprefix server/test_,backup.py file_store.py housekeeping.py) \
	$(addprefix test_,addon_install.py batch.py durable.py folders.py open_in_freecad.py platform.py))
test-windows-files: setup
	$(IN_MEMORY) PYTHONPATH=tests/support $(BIN)/python -m pytest -p windows_files $(SPREAD) $(SHUFFLED) --dist worksteal \
		-k "not postgres" -m "not freecad and not browser" $(ON_WINDOWS)

# Where files are found by their names, on a mounted disk that finds a name in any case and normal form.
BY_NAME = $(addprefix tests/,fcstd/test_links.py fcstd/test_relink.py fcstd/test_stamp.py fcstd/test_suggest.py \
	vault/test_git.py vault/test_index.py vault/test_pull.py workbench/commit workbench/documents workbench/register \
	workbench/revisions $(addprefix cli/test_,bom_diff.py night_job.py project.py) \
	$(addprefix test_,batch.py open_in_freecad.py spelling.py))
test-other-disk: setup
	$(IN_MEMORY) PYTHONPATH=tests/support $(BIN)/python -m pytest -p other_disk_tests $(SPREAD) $(SHUFFLED) --dist worksteal \
		-k "not postgres" -m "not freecad and not browser" $(BY_NAME)

# Only the files with such tests: to collect all others takes each process ten seconds.
# In the order of their files: the windows of one FreeCAD tell a story, which takes minutes.
ON_MACHINE = $(shell grep -rlE --include='test_*.py' 'mark\.(freecad|browser)' tests)
test-machine: setup
	$(IN_MEMORY) $(BIN)/python -m pytest $(SPREAD) -p no:randomly --dist loadscope -m "freecad or browser" tests/browser $(ON_MACHINE)

mutants: setup
	$(IN_MEMORY) $(BIN)/python scripts/mutants.py

translations: setup
	$(BIN)/python scripts/translations.py $(LANGUAGE)

# Builds what would be published, tries it, and leaves it in dist/ with its bill of materials; publishes and tags nothing.
release: setup
	$(BIN)/python scripts/release.py version
	rm -rf dist && mkdir dist
	DIST=dist scripts/wheel_checks.sh $(BIN)/python newest

docs: setup
	$(BIN)/python -m pip install --quiet 'mkdocs-material>=9.5,<10'
	$(BIN)/mkdocs build

check: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python scripts/english.py
	$(BIN)/codespell

clean:
	rm -rf $(VENV) build dist *.egg-info
