# SPDX-License-Identifier: LGPL-2.1-or-later
"""Settings for all tests."""

from __future__ import annotations

import gc
import importlib.util
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hunting import LONG, examples
from hypothesis import HealthCheck, settings
from sharing import scheduler
from warm_reader import warm_reader

from silo.bom_sync.memory import Memory

# Time is measured in benchmarks; a test on a busy machine is not wrong for being slow. The examples are the
# same in each run, so that no landing fails by chance; SILO_LONG=1 hunts with new ones, and more of them.
settings.register_profile(
    "unhurried",
    deadline=None,
    derandomize=not LONG,
    max_examples=examples(30),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("unhurried")


# What a person has set for herself is no matter here: her server, her terminal, her proxy for loopback.
for name in ("SILO_API_URL", "SILO_API_TOKEN", "COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR"):
    os.environ.pop(name, None)
os.environ["SILO_LANGUAGE"] = "en"  # that of the machine is no matter
# Nothing of the user's own data is read or written.
_DATA = tempfile.TemporaryDirectory(prefix="silo-data-")
os.environ["XDG_DATA_HOME"] = _DATA.name
for name in ("no_proxy", "NO_PROXY"):
    os.environ[name] = ",".join(filter(None, (os.environ.get(name), "127.0.0.1,localhost,::1")))

# A password costs a server 0.2 s of processor, because people guess passwords. Tests would take minutes more.
os.environ["SILO_PASSWORD_MEMORY"] = "12"

# A tenth of the time went into looking for garbage: tests make many objects, and hardly any are garbage.
gc.set_threshold(100_000, 50, 100)

# A shell that runs tests in the background ignores Ctrl-C for them; their programs would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """``-n 2 --dist loadscope`` keeps tests together by what they share, and not by their files."""
    return scheduler(config, log) if config.getoption("dist") == "loadscope" else None


@pytest.fixture(autouse=True)
def _nothing_told(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """No test knows what another one told a server at the same address about unreferenced lines."""
    monkeypatch.setattr(
        "silo.bom_sync.reported_lines.reported_lines",
        cache(lambda: Memory(tmp_path_factory.mktemp("told") / "told.json")),
    )


@pytest.fixture(scope="session")
def _warm_reader() -> Iterator[str]:
    """A process that loads the geometry kernel once for all the children that read."""
    if sys.platform != "linux" or not _importable("OCP"):
        yield ""
        return
    with warm_reader() as name:
        yield name


@pytest.fixture
def warm(_warm_reader: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Children that read geometry do not load the kernel anew."""
    if _warm_reader:
        monkeypatch.setenv("SILO_WARM_READER", _warm_reader)


def _needs(what: str, there: bool) -> None:
    if not there:
        pytest.skip(f"needs {what}, which this system does not have; NOT tested here")


def _importable(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ValueError:  # hidden by the simulation of Windows
        return False


@pytest.fixture(scope="session")
def needs_symlinks(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Windows makes links for administrators and developers only."""
    folder = tmp_path_factory.mktemp("links")
    try:
        (folder / "link").symlink_to(folder)
    except OSError:
        _needs("symlinks", False)


@pytest.fixture(scope="session")
def needs_modes() -> None:
    """Modes that say who may read, write or start a file."""
    _needs("POSIX modes", os.name == "posix" and hasattr(os, "fchmod"))


@pytest.fixture(scope="session")
def needs_user_without_rights() -> None:
    """An administrator may read and write anything."""
    _needs("a user who is no administrator", hasattr(os, "geteuid") and os.geteuid() != 0)


@pytest.fixture(scope="session")
def needs_signals() -> None:
    """``kill -9``, ``SIGSTOP``, process groups."""
    _needs("POSIX signals", hasattr(os, "killpg"))


@pytest.fixture(scope="session")
def needs_limits() -> None:
    """Limits of a process, from ``resource``."""
    _needs("POSIX limits", _importable("resource"))


@pytest.fixture(scope="session")
def needs_locks() -> None:
    """File locks of POSIX, from ``fcntl``."""
    _needs("POSIX locks", _importable("fcntl"))


@pytest.fixture(scope="session")
def needs_pty() -> None:
    """A terminal that a test can type at."""
    _needs("a pseudo-terminal", _importable("pty") and hasattr(os, "openpty"))


@pytest.fixture(scope="session")
def needs_pipes(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Named pipes in a folder."""
    try:
        os.mkfifo(tmp_path_factory.mktemp("pipes") / "pipe")
    except (OSError, AttributeError):
        _needs("named pipes", False)


@pytest.fixture(scope="session")
def needs_case(tmp_path_factory: pytest.TempPathFactory) -> None:
    """A disk on which two names may differ in case only."""
    folder = tmp_path_factory.mktemp("case")
    (folder / "a").touch()
    _needs("a disk that distinguishes upper and lower case", not (folder / "A").exists())


@pytest.fixture(scope="session")
def needs_git() -> None:
    """The program, for tests that make a repository."""
    _needs("git", shutil.which("git") is not None)


@pytest.fixture(scope="session")
def needs_dev_full() -> None:
    """A device that is always full."""
    _needs("/dev/full", Path("/dev/full").exists())
