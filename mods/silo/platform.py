# SPDX-License-Identifier: LGPL-2.1-or-later
"""What differs between Windows, macOS and Linux, asked here and nowhere else. Standard library only.

Where a difference shows in what Python offers (a module, a constant, an error's number), that is asked
instead of the platform's name, so that tests can put either in its place.

The user's folders for configuration, data and caches, by the platform's own rules.

Client and server ask here, so that what one wrote the other finds. The add-on inside FreeCAD may only need
three packages, so the few lines of ``platformdirs`` that matter are here: the XDG base directories,
``~/Library`` on macOS, ``%APPDATA%`` and ``%LOCALAPPDATA%`` on Windows. ``SILO_HOME`` names one folder for
all of them, on every platform. Standard library only.

Files that are replaced whole or not at all, or are for their owner only. Standard library only.

One path per file: without symlinks, each name as its folder lists it. Standard library only.

Windows and macOS find ``Part.FCStd`` under ``part.fcstd`` too, and macOS finds a name in any Unicode normal
form. Two spellings are one file there, and must be one component and one item. Such a disk is recognised by
asking it, not by the platform: Linux mounts such disks, and macOS can have case-sensitive ones.
"""

from __future__ import annotations

import ctypes
import errno
import importlib
import json
import os
import re
import signal
import socket
import stat
import string
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unicodedata
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, Protocol

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor


__all__ = [
    "Stamp",
    "private_file",
    "private_folder",
    "read_memory",
    "remove_patiently",
    "replace_patiently",
    "replacing",
    "stamp_of",
    "sync_folder",
    "write_memory",
]


NAME = sys.platform
WINDOWS = os.name == "nt"
# Modes say who may read a file; on Windows access lists do, which a mode does not show.
MODES_COUNT = os.name == "posix"

# Another program has the file open: a virus scanner, an indexer, a colleague. ERROR_ACCESS_DENIED,
# ERROR_SHARING_VIOLATION, ERROR_LOCK_VIOLATION of Windows; POSIX has no such error.
_IN_USE = (5, 32, 33)
_IGNORE_MERGE_ERRORS = 0x2  # ReplaceFileW: do not fail if a right cannot be copied
_CANNOT_MERGE = 1175  # ERROR_UNABLE_TO_REMOVE_REPLACED
_COPYFILE_ACL, _COPYFILE_XATTR = 1, 4  # copyfile.h of macOS
_LOCKED_BYTE = 1 << 30
_WAITS_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)


# Windows opens a device under each of these names, in any folder and with any ending.
_DEVICE = re.compile(
    r"(?:CON|PRN|AUX|NUL|CLOCK\$|CONIN\$|CONOUT\$|(?:COM|LPT)[0-9¹²³])\s*(?:[.:].*)?\Z", re.I
)


def is_device_name(name: str) -> bool:
    """Return True if Windows takes this file name for a device. Ask on every platform, since files move
    between them.
    """
    return _DEVICE.match(name) is not None


def no_device_name(name: str) -> str:
    """Return ``name``, with a mark in front if Windows does not allow it."""
    return "_" * is_device_name(name) + name


class Resources(Protocol):
    """The part of the module ``resource`` that is used; Windows has no such module."""

    RLIMIT_AS: int
    RLIMIT_CORE: int
    RLIMIT_CPU: int
    RLIMIT_NOFILE: int

    def getrlimit(self, which: int, /) -> tuple[int, int]: ...

    def setrlimit(self, which: int, limits: tuple[int, int], /) -> None: ...


def _resources() -> Resources | None:
    try:
        import resource
    except ImportError:
        return None
    return resource


# --- files ----------------------------------------------------------------------------------------------


def patiently(act: Callable[[], None], *, wait: Callable[[float], None] = time.sleep) -> None:
    """Do something to a file that another program may have open for a moment; tries for about 3 s.

    Only Windows refuses this, so it waits only after errors of Windows. Raises OSError as ``act`` does.
    """
    for seconds in _WAITS_S:
        try:
            act()
            return
        except OSError as error:
            if getattr(error, "winerror", None) not in _IN_USE:
                raise
        wait(seconds)
    act()


def copy_rights(source: str, copy: str, *, library: Any = None) -> None:
    """Copy owner, modes, access list and tags of a file to its copy, as far as the system allows it.

    library
        replaces the C library of macOS; None: use it on macOS only. On Windows, :func:`swap` keeps the
        rights.
    """
    status = os.stat(source)
    with suppress(OSError, AttributeError):  # only an administrator may give files away
        os.chown(copy, status.st_uid, status.st_gid)
    with suppress(OSError):  # FAT and some shares have no modes to keep
        os.chmod(copy, stat.S_IMODE(status.st_mode))
    library = library or (ctypes.CDLL("/usr/lib/libSystem.dylib") if NAME == "darwin" else None)
    if library is not None:
        # copyfile(3); Python offers neither access lists nor Finder tags there.
        library.copyfile(os.fsencode(source), os.fsencode(copy), None, _COPYFILE_ACL | _COPYFILE_XATTR)
    elif hasattr(os, "listxattr"):  # Linux keeps access lists there too
        names: list[str] = []
        with suppress(OSError):  # FUSE and CIFS may have no extended attributes
            names = os.listxattr(source)
        for name in names:
            with suppress(OSError):  # some belong to the system
                os.setxattr(copy, name, os.getxattr(source, name))


def swap(source: str, target: str, *, merge: Callable[[str, str], int] | None = None) -> None:
    """Put a new file in the place of an old one. Raises OSError.

    On Windows the file keeps the access list, streams and attributes that it had: ``merge`` replaces the call
    that does this, and returns an error number of Windows or 0.
    """
    merge = merge or (_replace_file if WINDOWS else None)
    code = merge(source, target) if merge is not None else _CANNOT_MERGE
    if code in _IN_USE:
        raise InUseError(code, target)
    if code:  # shares of other systems cannot merge the two
        os.replace(source, target)


def _replace_file(source: str, target: str) -> int:
    windows: Any = ctypes  # its loader is known to type checkers on Windows only
    kernel = windows.WinDLL("kernel32", use_last_error=True)
    done = kernel.ReplaceFileW(target, source, None, _IGNORE_MERGE_ERRORS, None, None)
    return 0 if done else int(windows.get_last_error())


class InUseError(PermissionError):
    """Another program has the file open; :func:`patiently` waits for it."""

    def __init__(self, code: int, path: str) -> None:
        super().__init__(errno.EACCES, "another program has it open", path)
        self.winerror = code


def sync_folder(folder: str | os.PathLike[str]) -> None:
    """Put the names in a folder on disk, since a rename is on disk only with its folder. Raises OSError.

    Some shares and FUSE disks cannot do that for a folder. That is no error, since nothing more can be done.
    """
    if WINDOWS:  # it neither needs nor allows that
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.ENOSYS, errno.EBADF):
            raise
    finally:
        os.close(handle)


def is_locked(path: str) -> bool | None:
    """Return True if another process holds a lock on a file; None if this is unknown.

    It takes the lock for a moment. Do not call it for a file that this process has locked: closing the file
    would end that lock.
    """
    try:
        with open(path, "r+b") as file:
            try:
                import fcntl
            except ImportError:
                return _is_locked_on_windows(file.fileno())
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def hold_lock(path: str | os.PathLike[str], *, shared: bool = False) -> BinaryIO | None:
    """Lock a file, and make it if it does not exist, for as long as the result stays open.

    shared
        others may hold the lock too, if they share it. Windows has no such lock, and needs none to guard an
        open file, which cannot be deleted there.

    Returns None if another process holds the lock. The lock ends with its process, however that ends. Raises
    OSError.
    """
    file = open(path, "a+b")  # noqa: SIM115
    try:
        try:
            import fcntl
        except ImportError:
            if not shared:
                modes: Any = importlib.import_module("msvcrt")
                file.seek(_LOCKED_BYTE)  # locks of Windows keep others from reading
                modes.locking(file.fileno(), modes.LK_NBLCK, 1)
            return file
        if not NAME.startswith("linux"):
            fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            return file
        # The kind of lock that servers of NFS and SMB take for their clients: flock(2) does not see those. Of
        # one byte where nothing is read: a lock keeps readers of SMB out.
        kind = fcntl.F_RDLCK if shared else fcntl.F_WRLCK
        wanted = struct.pack("@hhqqi4x", kind, os.SEEK_SET, _LOCKED_BYTE, 1, 0)
        fcntl.fcntl(file, fcntl.F_OFD_SETLK, wanted)
        return file
    except OSError as error:
        file.close()
        if isinstance(error, BlockingIOError | PermissionError) or error.errno in (
            errno.EDEADLK,
            errno.EACCES,
        ):
            return None
        raise


def shows_locks(path: str, mounts: str = "/proc/self/mountinfo") -> bool:
    """Return True if other computers that share the disk see a lock on it. FUSE and shared folders of virtual
    machines do not pass locks on, and report no error.

    mounts
        the system's list of what is mounted where (proc(5)); systems without that share locks.
    """
    kinds = {"/": ""}
    with (
        suppress(OSError, ValueError, IndexError),
        open(mounts, encoding="utf-8", errors="surrogateescape") as file,
    ):
        for line in file:
            words = line.split()
            place = re.sub(r"\\(\d{3})", lambda match: chr(int(match[1], 8)), words[4])
            kinds[place] = words[words.index("-") + 1]
    real = os.path.realpath(path)
    place = max((kind for kind in kinds if kind == "/" or f"{real}/".startswith(f"{kind}/")), key=len)
    return not (kinds[place].startswith("fuse.") or kinds[place] in ("9p", "vboxsf", "virtiofs"))


def _is_locked_on_windows(descriptor: int) -> bool | None:
    try:
        import msvcrt
    except ImportError:
        return None
    modes: Any = msvcrt  # its functions are known to type checkers on Windows only
    try:
        modes.locking(descriptor, modes.LK_NBLCK, 1)
    except OSError:
        return True
    modes.locking(descriptor, modes.LK_UNLCK, 1)
    return False


# --- processes ------------------------------------------------------------------------------------------


def limit_this_process(
    *, memory: int = 0, cpu_s: int = 0, resources: Resources | None = None
) -> tuple[str, ...]:
    """Limit this process as far as the platform can, each limit separately; no core files.

    memory, cpu_s
        bytes of address space and seconds of processor time; 0 for no limit.

    Returns the names of the limits that could not be set: Windows has no limits, and macOS refuses that of
    memory.
    """
    system = resources or _resources()
    wanted = {"core": 0, **({"memory": memory} if memory else {}), **({"cpu": cpu_s} if cpu_s else {})}
    if system is None:
        return tuple(wanted)
    which = {"core": system.RLIMIT_CORE, "memory": system.RLIMIT_AS, "cpu": system.RLIMIT_CPU}
    refused = []
    for name, most in wanted.items():
        try:
            system.setrlimit(which[name], (most, most + 5 if name == "cpu" else most))
        except (ValueError, OSError):
            refused.append(name)
    return tuple(refused)


def allow_many_files() -> None:
    """Raise the limit of open files to what the machine allows, since each listener of a server needs one."""
    system = _resources()
    if system is None:
        return
    with suppress(OSError, ValueError):  # macOS names no limit as the limit, and then refuses it
        _, hard = system.getrlimit(system.RLIMIT_NOFILE)
        system.setrlimit(system.RLIMIT_NOFILE, (hard, hard))


def child_options(*, group: bool = False, offered: object = subprocess) -> dict[str, Any]:
    """Return options of ``subprocess`` for a child without a window: Windows then opens no console.

    group
        the child and its own children can be ended together, by :func:`end`.
    offered
        a module that has the flags of this platform.
    """
    if flags := getattr(offered, "CREATE_NO_WINDOW", 0):
        return {"creationflags": flags | (getattr(offered, "CREATE_NEW_PROCESS_GROUP", 0) if group else 0)}
    return {"start_new_session": True} if group else {}


def end(process: subprocess.Popen[Any]) -> None:
    """End a child that was started with ``child_options(group=True)``, and wait for it."""
    if process.poll() is None:
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
        process.wait()


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def workers(count: int, begin: Callable[..., None], *arguments: Any) -> ProcessPoolExecutor:
    """Start a pool of worker processes. They leave Ctrl-C to this process, and none outlives it.

    ``begin`` is called in each of them, with the arguments.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_all_start_methods, get_context

    # Never by fork: a library may have threads that hold locks.
    context = get_context("forkserver" if "forkserver" in get_all_start_methods() else "spawn")
    return ProcessPoolExecutor(count, context, initializer=_begin_worker, initargs=(begin, arguments))


def _begin_worker(begin: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    from multiprocessing import parent_process

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (parent := parent_process()) is not None:

        def watch() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()
    begin(*arguments)


def end_workers(pool: ProcessPoolExecutor) -> None:
    """End a pool at once, whatever its processes do; from 3.14 on Python can do this itself."""
    for process in list(pool._processes.values()):
        process.kill()
    pool.shutdown(wait=True, cancel_futures=True)


_CRASHES = {"SIGSEGV", "SIGABRT", "SIGILL", "SIGBUS", "SIGFPE"}


def how_it_ended(code: int) -> str:
    """Describe the exit code of a child, such as ``crashed (SIGSEGV)`` or ``ended with exit code 3``.

    A shell that started the child adds 128 to the signal; Windows has codes from 0xC0000000 on for crashes.
    """
    names = {int(number): number.name for number in signal.Signals}
    name = names.get(code - 128 if code > 128 else -code, str(-code) if code < 0 else "")
    if code >= 0xC0000000:
        return f"crashed (0x{code:08X})"
    if name:
        return f"{'crashed' if name in _CRASHES else 'was ended'} ({name})"
    return f"ended with exit code {code}"


def python_beside(prefix: str) -> list[str]:
    """Return the paths at which a Python interpreter may be below its prefix."""
    names = ("python.exe", "bin/python.exe") if WINDOWS else ("bin/python3", "bin/python")
    return [os.path.join(prefix, *name.split("/")) for name in names]


# --- network --------------------------------------------------------------------------------------------


def own_the_port(sock: socket.socket, constants: Any = socket) -> None:
    """Make sure that no second server can listen on the same port, and that this one can start again right
    after its end.

    On Windows, SO_REUSEADDR lets two programs share the port; so exclusive use is requested there.
    """
    exclusive = getattr(constants, "SO_EXCLUSIVEADDRUSE", None)
    option = constants.SO_REUSEADDR if exclusive is None else exclusive
    sock.setsockopt(socket.SOL_SOCKET, option, 1)


# Worker processes share one listening socket, which Windows does not hand to the event loop of a child.
WORKERS_CAN_SHARE_A_SOCKET = not WINDOWS


_FOLDER = "silo-mod"
_LOCAL, _ROAMING = ("LOCALAPPDATA", "AppData/Local"), ("APPDATA", "AppData/Roaming")


def _folder(
    env: Mapping[str, str], platform: str, xdg: str, unix: str, mac: str, windows: tuple[str, str]
) -> Path:
    if os.path.isabs(whole := env.get("SILO_HOME", "")):
        return Path(whole) / xdg[len("XDG_") : -len("_HOME")].lower()
    home = Path(env.get("HOME") or Path.home())
    if platform == "win32":
        variable, default = windows
        return Path(env.get(variable) or Path.home() / default) / _FOLDER
    # XDG says that a relative path is to be ignored.
    chosen = env.get(xdg, "")
    if chosen and os.path.isabs(chosen):
        return Path(chosen) / _FOLDER
    return home / (mac if platform == "darwin" else unix) / _FOLDER


def config_folder(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Path:
    """Return the folder of the configuration (it is not created here)."""
    return _folder(env, platform, "XDG_CONFIG_HOME", ".config", "Library/Application Support", _ROAMING)


def data_folder(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Path:
    """Return the folder of data that must not be lost: the outbox, the journal of registrations, the embedded
    database.

    On Windows it is not in the roaming profile, because a database that is copied between machines while it
    is open soon breaks.
    """
    return _folder(env, platform, "XDG_DATA_HOME", ".local/share", "Library/Application Support", _LOCAL)


def cache_folder(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Path:
    """Return the folder of data that can be made again."""
    return _folder(env, platform, "XDG_CACHE_HOME", ".cache", "Library/Caches", _LOCAL)


def scratch_folder(prefix: str, parent: Path | str | None = None) -> tempfile.TemporaryDirectory[str]:
    """Make a temporary folder, as a context manager of its path; below ``parent``, or where the system has
    them.

    A file in it that another program still has open (Windows) stays, and is no error.
    """
    return tempfile.TemporaryDirectory(prefix=prefix, dir=parent, ignore_cleanup_errors=True)


Stamp = tuple[int, int, int]
"""What changes when a file is written: its time in ns, its size, its number on the disk."""


@contextmanager
def replacing(path: Path | str, *, mode: int | None = None) -> Iterator[BinaryIO]:
    """Write the new content of a file: at any moment ``path`` has all of the old content or all of the new.

    The new file can be read by its owner only, unless ``mode`` says otherwise. If writing fails or the block
    raises, the old content stays, and no other file remains beside it. A pipe or a device, such as /dev/null,
    is written into and never replaced. Raises OSError.
    """
    target = Path(path)
    if _is_special(target):
        with open(target, "wb") as file:
            yield file
        return
    # Beside the target, so that the rename at the end stays within one file system.
    handle, temporary = tempfile.mkstemp(prefix=f".{target.name[:50]}.", suffix=".part", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if mode is not None:
            os.chmod(temporary, mode)
        replace_patiently(temporary, target)
    except BaseException:
        with suppress(OSError):  # the first error is the one to report
            remove_patiently(temporary)
        raise
    sync_folder(target.parent)


def _is_special(path: Path) -> bool:
    """Return True for a pipe, a device or a socket: what is there, and is neither a file nor a folder."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def read_memory(path: Path) -> dict[str, Any]:
    """Read a small JSON file; {} if it is missing, damaged, or no JSON object.

    For files whose loss costs only a repeated question.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def write_memory(path: Path, content: Mapping[str, Any]) -> OSError | None:
    """Write what :func:`read_memory` reads, for its owner only. Returns the error if that fails."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(json.dumps(content, indent=1, sort_keys=True).encode())
    except OSError as error:
        return error
    return None


def replace_patiently(source: Path | str, target: Path | str) -> None:
    """Replace a file; on Windows wait for a program that has the target open. Raises OSError."""
    patiently(lambda: os.replace(source, target))


def remove_patiently(path: Path | str) -> None:
    """Delete a file; on Windows wait for a program that has it open. No file is fine. Raises OSError."""
    patiently(lambda: Path(path).unlink(missing_ok=True))


def private_folder(path: Path | str) -> None:
    """Make a folder that only its owner can read, or close an existing one to others. Raises OSError."""
    os.makedirs(path, mode=0o700, exist_ok=True)
    _close_to_others(path)


def private_file(path: Path | str) -> None:
    """Make a file that only its owner can read, or close an existing one to others. Raises OSError."""
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    _close_to_others(path)


def stamp_of(path: Path | str | int) -> Stamp | None:
    """Return the stamp of a file, given by its path or its descriptor; None if there is no file."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return (status.st_mtime_ns, status.st_size, status.st_ino)


def _close_to_others(path: Path | str) -> None:
    mode = stat.S_IMODE(os.stat(path).st_mode)
    if mode & 0o077:
        with suppress(OSError):  # another user's, who has opened it to us
            os.chmod(path, mode & ~0o077)


_LISTED_AT_MOST = 50_000
# Disks differ in what is another case of ß or µ, never of A to Z.
_OTHER_CASE = str.maketrans(string.ascii_letters, string.ascii_letters.swapcase())


class Spelt(NamedTuple):
    """A path. ``plain`` is its real path in the spelling asked for, ``path`` in that of the folders."""

    path: str
    plain: str
    there: bool


class Spelling:
    """Finds the one path of a file; remembers folders for one session."""

    def __init__(self) -> None:
        self._folders: dict[str, tuple[str, str]] = {}
        self._canonical: dict[str, str] = {}
        self._exact: set[str] = set()  # folders that find a name only in its own spelling
        self._listings: dict[str, dict[str, list[tuple[str, int]]]] = {}

    def real(self, path: str) -> str:
        """Return ``os.path.realpath`` with each name as its folder lists it; also for paths where
        nothing is.
        """
        return self.look(os.path.abspath(path)).path

    def look(self, path: str) -> Spelt:
        """Do the same for an absolute path; also return the path before respelling, and if anything is
        there.
        """
        folder, name = os.path.split(path)
        if not name:
            real = os.path.realpath(path)
            return Spelt(self._as_listed(real), real, os.path.lexists(real))
        if folder not in self._folders:
            plain = os.path.realpath(folder)
            self._folders[folder] = plain, self._as_listed(plain)
        plain, real_folder = self._folders[folder]
        candidate = os.path.join(real_folder, name)
        try:
            status = os.lstat(candidate)
        except (OSError, ValueError):
            return Spelt(candidate, os.path.join(plain, name), False)
        if stat.S_ISLNK(status.st_mode):
            target = os.path.realpath(candidate)
            return Spelt(self._as_listed(target), target, os.path.lexists(target))
        listed = self._listed(real_folder, name, status)
        return Spelt(os.path.join(real_folder, listed), os.path.join(plain, name), True)

    def is_plain(self, path: str) -> bool:
        """Return True if this path, which exists and is no symlink, is its own only spelling."""
        folder, _, name = path.rpartition(os.sep)
        if name.isascii() and folder in self._exact and self._folders.get(folder) == (folder, folder):
            return True
        return self.look(path).path == path

    def _as_listed(self, real: str) -> str:
        """Spell each name in a path without symlinks as its folder lists it."""
        text = self._canonical.get(real)
        if text is None:
            folder, name = os.path.split(real)
            if not name or folder == real:
                text = real
            else:
                parent = self._as_listed(folder)
                try:
                    name = self._listed(parent, name, os.lstat(os.path.join(parent, name)))
                except (OSError, ValueError):
                    pass  # nothing is there, so nothing lists it
                text = os.path.join(parent, name)
            self._canonical[real] = text
        return text

    def _listed(self, folder: str, name: str, status: os.stat_result) -> str:
        if name.isascii() and folder in self._exact:
            return name
        cases = (name.translate(_OTHER_CASE), name.swapcase())
        spellings = {*cases, *(unicodedata.normalize(form, name) for form in ("NFC", "NFD"))} - {name}
        # Not compared by number: some network disks number each spelling of a file otherwise, or its entry in
        # a listing, and a disk may still answer with the number of a file that was deleted a moment ago.
        if not any(os.path.lexists(os.path.join(folder, other)) for other in spellings):
            if name.isascii() and spellings:
                self._exact.add(folder)
            return name
        listed = self._listing(folder).get(folded(name), [])
        if not listed or any(other == name for other, _ in listed):  # both may be files of their own
            return name
        # Windows distinguishes normal forms, so several may be there: the number decides where it can.
        return next((other for other, number in listed if number == status.st_ino), listed[0][0])

    def _listing(self, folder: str) -> dict[str, list[tuple[str, int]]]:
        """List names and inode numbers of a folder's entries, by :func:`folded` name."""
        listing = self._listings.get(folder)
        if listing is None:
            listing = self._listings[folder] = {}
            try:
                with os.scandir(folder) as entries:
                    for _, item in zip(range(_LISTED_AT_MOST), entries, strict=False):
                        listing.setdefault(folded(item.name), []).append((item.name, item.inode()))
            except OSError:
                pass  # a folder that cannot be listed shows nothing; names stay as they were given
        return listing


def one_path(path: str) -> str:
    """Do what :meth:`Spelling.real` does, for a single path."""
    return Spelling().real(path)


def folded(name: str) -> str:
    """Return a text that is equal for names that differ only in case or normal form."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFD", name).casefold())
