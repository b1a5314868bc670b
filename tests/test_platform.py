# SPDX-License-Identifier: LGPL-2.1-or-later
"""What differs between platforms, each difference put in place by hand: Linux runs all of them."""

from __future__ import annotations

import ast
import os
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from silo.platform.file_swap import copy_rights, patiently, swap
from silo.platform.limits import limit_this_process
from silo.platform.locks import is_locked, shows_locks
from silo.platform.processes import child_options, end, how_it_ended
from silo.platform.sockets import own_the_port

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
    """For some seconds."""
    act = Refusals(5, InUse())
    patiently(act, wait=act.waited.append)
    assert len(act.waited) == 5
    assert act.waited == sorted(act.waited)
    act = Refusals(1000, InUse())
    with pytest.raises(PermissionError):
        patiently(act, wait=act.waited.append)
    assert 2 < sum(act.waited) < 5
    for error in (PermissionError("no right"), FileNotFoundError("gone"), OSError("full")):
        act = Refusals(1, error)
        with pytest.raises(type(error)):
            patiently(act, wait=act.waited.append)
        assert act.waited == [], "what no waiting mends is raised at once"


def test_no_child_opens_a_console_window_on_windows() -> None:
    windows = SimpleNamespace(CREATE_NO_WINDOW=0x08000000, CREATE_NEW_PROCESS_GROUP=0x200)
    assert child_options(offered=windows) == {"creationflags": 0x08000000}
    assert child_options(offered=windows, group=True) == {"creationflags": 0x08000200}
    assert child_options(offered=SimpleNamespace()) == {}
    assert child_options(offered=SimpleNamespace(), group=True) == {"start_new_session": True}


def test_every_child_is_started_with_these_options() -> None:
    calls = [
        (path, node)
        for path in MODS.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
        and re.fullmatch(r"subprocess\.(run|Popen|call|check_\w+)", ast.unparse(node.func))
    ]
    assert len(calls) >= 5
    bare = [
        f"{path}:{node.lineno}"
        for path, node in calls
        if not any(word.arg is None and "child_options(" in ast.unparse(word.value) for word in node.keywords)
    ]
    assert not bare


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


@pytest.mark.usefixtures("needs_limits")
def test_the_limits_hold_where_they_can_be_set() -> None:
    """In a process of its own: allocating more than the limit fails."""
    code = (
        "from silo.platform.limits import limit_this_process as limit\n"
        "assert limit(memory=300 << 20, cpu_s=100) == ()\n"
        "try: bytearray(400 << 20)\nexcept MemoryError: print('refused')"
    )
    if sys.platform != "linux":
        pytest.skip("only Linux limits the address space")
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


@pytest.mark.usefixtures("needs_locks")
def test_a_lock_of_another_process_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "x.lock"
    path.touch()
    assert is_locked(str(path)) is False
    assert is_locked(str(tmp_path / "none")) is False
    holder = (
        "import fcntl, sys\nfile = open(sys.argv[1], 'r+b')\nfcntl.lockf(file, fcntl.LOCK_EX)\n"
        "print('held', flush=True)\nsys.stdin.read()"
    )
    command = [sys.executable, "-c", holder, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        assert is_locked(str(path)) is True
        process.communicate()
    assert is_locked(str(path)) is False


@pytest.mark.usefixtures("needs_signals")
def test_a_child_ends_with_its_own_children() -> None:
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
    assert how_it_ended(process.returncode) == "was ended (SIGKILL)"
    end(process)


def test_words_for_exit_codes() -> None:
    assert how_it_ended(3) == "ended with exit code 3"
    assert how_it_ended(-signal.SIGTERM) == "was ended (SIGTERM)"
    assert how_it_ended(-250) == "was ended (250)"
    assert how_it_ended(128 + signal.SIGSEGV) == how_it_ended(-signal.SIGSEGV) == "crashed (SIGSEGV)"
    assert how_it_ended(0xC0000005) == "crashed (0xC0000005)"


# --- one module asks --------------------------------------------------------------------------------------

ASKED_THERE = MODS / "silo" / "platform"
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
        if path.parent != ASKED_THERE and (words := asks_for_the_platform(path.read_text("utf-8")))
    }
    assert asking == {}, "ask silo.platform instead, or add the question there"


def test_files_are_replaced_and_removed_patiently() -> None:
    """On Windows another program may have a file open for a moment, so nobody asks only once."""
    hasty = re.compile(r"\.unlink\(|os\.(?:replace|rename|remove|unlink)\(")
    # The lock's own file is held by us, and waits for nobody.
    there = {*ASKED_THERE.glob("*.py"), MODS / "silo" / "folder_lock.py"}
    found = [
        f"{path.relative_to(MODS)}:{number}: {line.strip()}"
        for path in MODS.rglob("*.py")
        if path not in there
        for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1)
        if hasty.search(line)
    ]
    assert found == [], "use silo.platform: replace_patiently, remove_patiently, replacing"


@pytest.mark.parametrize(
    "text", ["import fcntl", "from sys import platform", "import os\nx = os.name", "from resource import *"]
)
def test_the_check_sees_each_way_to_ask(text: str) -> None:
    assert asks_for_the_platform(text)


# What a test uses that not every system has, and the fixture of tests/conftest.py that says so.
_NEEDED = {
    "symlink_to": "needs_symlinks",
    "mkfifo": "needs_pipes",
    "killpg": "needs_signals",
    "SIGSTOP": "needs_signals",
    "setrlimit": "needs_limits",
    "openpty": "needs_pty",
    "lockf": "needs_locks",
}
_POSIX_MODULES = {"fcntl", "resource", "pty", "termios", "pwd", "grp"}
TESTS = Path(__file__).parent


def unsaid(text: str) -> list[str]:
    """Tests that use what not every system has without a fixture that says so; imports at the top too."""
    tree = ast.parse(text)
    found = [
        f"line {node.lineno} imports {alias.name}"
        for node in tree.body
        if isinstance(node, ast.Import)
        for alias in node.names
        if alias.name in _POSIX_MODULES
    ]
    everywhere = {w.value for n in tree.body if isinstance(n, ast.Assign) for w in _words(n)}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            said = everywhere | {w.value for d in node.decorator_list for w in _words(d)}
            used = {_NEEDED.get(n.attr, "") for n in ast.walk(node) if isinstance(n, ast.Attribute)}
            found += [f"{node.name} lacks {need}" for need in sorted(used - said - {""})]
    return found


def _words(node: ast.AST) -> list[ast.Constant]:
    return [one for one in ast.walk(node) if isinstance(one, ast.Constant)]


def test_tests_say_what_they_need_of_the_system() -> None:
    """FreeCAD's and the browser's tests run where those are, which is Linux."""
    found = {
        str(path.relative_to(TESTS)): missing
        for path in TESTS.rglob("*.py")
        if path.parts[len(TESTS.parts)] not in ("freecad", "browser", "support")
        and path != Path(__file__)
        and (missing := unsaid(path.read_text("utf-8")))
    }
    assert found == {}


@pytest.mark.parametrize(
    "text",
    [
        "import pty",
        "def test_x(tmp_path):\n    tmp_path.symlink_to('b')",
        "@usefixtures('needs_modes')\ndef test_x():\n    os.mkfifo('a')",
    ],
)
def test_the_check_sees_what_is_not_said(text: str) -> None:
    assert unsaid(text)


def test_a_file_keeps_its_rights_and_tags_on_macos(tmp_path: Path) -> None:
    """Python has no access lists and no extended attributes there; the C library copies them."""
    old, new = tmp_path / "old", tmp_path / "new"
    old.touch()
    new.touch()
    calls: list[tuple[object, ...]] = []
    copy_rights(str(old), str(new), library=SimpleNamespace(copyfile=lambda *words: calls.append(words)))
    assert calls == [(os.fsencode(old), os.fsencode(new), None, 1 | 4)]


def test_a_file_keeps_its_rights_and_streams_on_windows(tmp_path: Path) -> None:
    """A call of Windows puts the new content below the old name; where a share cannot, it is replaced."""
    old, new = tmp_path / "old", tmp_path / "new"
    for code, content in ((0, "old"), (1175, "new")):
        old.write_text("old")
        new.write_text("new")
        calls: list[tuple[str, ...]] = []

        def merge(*words: str, code: int = code, calls: list[tuple[str, ...]] = calls) -> int:
            calls.append(words)
            return code

        patiently(lambda merge=merge: swap(str(new), str(old), merge=merge))
        assert set(calls) == {(str(new), str(old))}
        assert old.read_text() == content


def test_a_file_that_is_open_elsewhere_is_waited_for_on_windows(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    answers = [32, 5, 0]
    waited: list[float] = []
    patiently(lambda: swap(str(new), str(old), merge=lambda *_: answers.pop(0)), wait=waited.append)
    assert (answers, len(waited)) == ([], 2)


def test_disks_that_keep_locks_to_themselves(tmp_path: Path) -> None:
    """By the kind of disk that the path is on, as Linux lists it; elsewhere, and in doubt, locks are seen."""
    mounts = tmp_path / "mounts"
    here = os.path.realpath(tmp_path)
    mounts.write_text(
        "21 1 8:1 / / rw,relatime shared:1 - ext4 /dev/sda1 rw\n"
        f"22 21 0:40 / {here}/far\\040away rw - fuse.sshfs me@there: rw\n"
        f"23 22 0:41 / {here}/far\\040away/disk rw shared:2 - nfs4 there:/disk rw\n"
        f"24 21 0:42 / {here}/stick rw - fuseblk /dev/sdb1 rw\n"
    )
    names = (
        "far away/a.lock",
        "far away/disk/a.lock",
        "far away",
        "stick/a.lock",
        "far awayer/a.lock",
        "a.lock",
    )
    seen = [shows_locks(os.path.join(here, name), str(mounts)) for name in names]
    assert seen == [False, True, False, True, True, True]
    assert shows_locks(here, str(tmp_path / "no such list"))
    mounts.write_text("odd\n")
    assert shows_locks(here, str(mounts))
