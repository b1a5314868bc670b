# `make demo` and `make test` do all their own set-up; nothing else is needed but python3 (>= 3.11) with venv.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.silo-mod-installed

.PHONY: help demo test test-machine check setup docs clean

help:
	@echo "make demo   set up and sync a real assembly with the embedded server"
	@echo "make test   set up and run the tests"
	@echo "make test-machine  the tests that need FreeCAD or Chromium on the machine"
	@echo "make check  ruff, mypy, import directions"

setup: $(STAMP)

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "silo-mod needs Python 3.11 or newer, this is " + sys.version)'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	@touch $@

demo: setup
	$(BIN)/silo-mod demo

test: setup
	$(BIN)/python -m pytest -m "not freecad and not browser"

test-machine: setup
	$(BIN)/python -m pytest -m "freecad or browser"

check: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

clean:
	rm -rf $(VENV) build dist *.egg-info
