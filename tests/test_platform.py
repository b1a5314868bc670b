# SPDX-License-Identifier: LGPL-2.1-or-later
"""What differs between platforms, each difference put in place by hand: Linux runs all of them."""

from __future__ import annotations

import ast
import ntpath
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from silo.bom.report import relative
from silo.platform import (
    child_options,
    end,
    how_it_ended,
    is_locked,
    limit_this_process,
    own_the_port,
    patiently,
)

MODS = Path(__file__).resolve().parents[1] / "mods"


class InUse(PermissionError):
    """As Windows says that somebody has the file open."""

    winerror = 32


class Refusals:
    """Fails some times, then works."""

    def __init__(self, times: int, error: OSError) -> None:
        self.left, self.error, self.waited = times, error, list[float]()

    def __call__(self) -> None:
        if self.left:
            self.left -= 1
            raise self.error


def test_a_file_that_a_virus_scanner_has_open_is_waited_for() -> None:
    act = Refusals(5, InUse())
    patiently(act, wait=act.waited.append)
    assert len(act.waited) == 5
    assert act.waited == sorted(act.waited)


def test_patience_ends() -> None:
    act = Refusals(1000, InUse())
    with pytest.raises(PermissionError):
        patiently(act, wait=act.waited.append)
    assert 2 < sum(act.waited) < 5


@pytest.mark.parametrize("error", [PermissionError("no right"), FileNotFoundError("gone"), OSError("full")])
def test_what_no_waiting_mends_is_raised_at_once(error: OSError) -> None:
    act = Refusals(1, error)
    with pytest.raises(type(error)):
        patiently(act, wait=act.waited.append)
    assert act.waited == []


class MacOS:
    """``resource`` of macOS: no limit of memory can be set there."""

    RLIMIT_AS, RLIMIT_CORE, RLIMIT_CPU, RLIMIT_NOFILE = range(4)

    def __init__(self) -> None:
        self.set: dict[int, tuple[int, int]] = {}

    def getrlimit(self, which: int) -> tuple[int, int]:
        return (256, 2**63 - 1)

    def setrlimit(self, which: int, limits: tuple[int, int]) -> None:
        if which == self.RLIMIT_AS:
            raise ValueError("current limit exceeds maximum limit")
        self.set[which] = limits


def test_a_limit_that_macos_refuses_does_not_take_the_others_with_it() -> None:
    macos = MacOS()
    assert limit_this_process(memory=1 << 30, cpu_s=60, resources=macos) == ("memory",)
    assert macos.set == {macos.RLIMIT_CORE: (0, 0), macos.RLIMIT_CPU: (60, 65)}


def test_the_limits_hold_where_they_can_be_set() -> None:
    """In a process of its own: allocating more than the limit fails."""
    code = (
        "from silo.platform import limit_this_process as limit\n"
        "assert limit(memory=300 << 20, cpu_s=100) == ()\n"
        "try: bytearray(400 << 20)\nexcept MemoryError: print('refused')"
    )
    if sys.platform != "linux":
        pytest.skip("address space is limited on Linux")
    env = {**os.environ, "PYTHONPATH": str(MODS)}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "refused"


def test_on_windows_the_port_is_taken_for_ourselves() -> None:
    """There SO_REUSEADDR lets a second server listen on the same port."""
    told: list[tuple[int, int, int]] = []
    sock = SimpleNamespace(setsockopt=lambda *words: told.append(words))
    own_the_port(sock, SimpleNamespace(SO_REUSEADDR=4, SO_EXCLUSIVEADDRUSE=-5))
    own_the_port(sock, SimpleNamespace(SO_REUSEADDR=4))
    assert told == [(socket.SOL_SOCKET, -5, 1), (socket.SOL_SOCKET, 4, 1)]


def test_a_lock_of_another_process_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "x.lock"
    path.touch()
    assert is_locked(str(path)) is False
    assert is_locked(str(tmp_path / "none")) is False
    holder = (
        "import fcntl, sys\nfile = open(sys.argv[1], 'r+b')\nfcntl.lockf(file, fcntl.LOCK_EX)\n"
        "print('held', flush=True)\nsys.stdin.read()"
    )
    pytest.importorskip("fcntl")
    command = [sys.executable, "-c", holder, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        assert is_locked(str(path)) is True
        process.communicate()
    assert is_locked(str(path)) is False


def test_a_child_ends_with_its_own_children() -> None:
    if not hasattr(os, "killpg"):
        pytest.skip("process groups of POSIX")
    inner = "import time; print('up', flush=True); time.sleep(600)"
    outer = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {inner!r}])"
    process = subprocess.Popen(
        [sys.executable, "-c", outer], stdout=subprocess.PIPE, **child_options(group=True)
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"up\n"
    end(process)
    # The pipe closes only when the grandchild is gone too.
    assert process.stdout.read() == b""
    process.stdout.close()
    assert how_it_ended(process.returncode) == "signal SIGKILL"
    end(process)


def test_words_for_exit_codes() -> None:
    assert how_it_ended(3) == "exit code 3"
    assert how_it_ended(-signal.SIGTERM) == "signal SIGTERM"
    assert how_it_ended(-250) == "signal 250"


def test_a_file_on_another_drive_keeps_its_whole_path() -> None:
    assert relative(r"D:\parts\x.step", r"C:\vault", ntpath) == "D:/parts/x.step"
    assert relative(r"C:\vault\parts\x.step", r"C:\vault", ntpath) == "parts/x.step"


# --- one module asks --------------------------------------------------------------------------------------

ASKED_THERE = MODS / "silo" / "platform.py"
_MODULES = {"fcntl", "msvcrt", "resource", "winreg", "platform"}
_NAMES = {("sys", "platform"), ("os", "name"), ("os", "uname"), ("sys", "getwindowsversion")}


def asks_for_the_platform(text: str) -> list[str]:
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names if alias.name in _MODULES]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            if node.module in _MODULES:
                found.append(node.module)
            found += [f"{node.module}.{a.name}" for a in node.names if (node.module, a.name) in _NAMES]
        elif (
            isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and (node.value.id, node.attr) in _NAMES
        ):
            found.append(f"{node.value.id}.{node.attr}")
    return found


def test_no_other_module_asks_for_the_platform() -> None:
    asking = {
        str(path.relative_to(MODS)): words
        for path in MODS.rglob("*.py")
        if path != ASKED_THERE and (words := asks_for_the_platform(path.read_text("utf-8")))
    }
    assert asking == {}, "ask silo.platform instead, or add the question there"


@pytest.mark.parametrize(
    "text", ["import fcntl", "from sys import platform", "import os\nx = os.name", "from resource import *"]
)
def test_the_check_sees_each_way_to_ask(text: str) -> None:
    assert asks_for_the_platform(text)
