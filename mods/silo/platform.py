# SPDX-License-Identifier: LGPL-2.1-or-later
"""What differs between Windows, macOS and Linux, asked here and nowhere else. Standard library only.

Where a difference shows in what Python offers (a module, a constant, an error's number), that is asked
instead of the platform's name, so that tests can put either in its place.
"""

from __future__ import annotations

import ctypes
import errno
import importlib
import os
import re
import signal
import socket
import stat
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, BinaryIO, Protocol

NAME = sys.platform
WINDOWS = os.name == "nt"
# Modes say who may read a file; on Windows access lists do, which a mode does not show.
MODES_COUNT = os.name == "posix"

# Another program has the file open: a virus scanner, an indexer, a colleague. ERROR_ACCESS_DENIED,
# ERROR_SHARING_VIOLATION, ERROR_LOCK_VIOLATION of Windows; POSIX has no such error.
_IN_USE = (5, 32, 33)
_IGNORE_MERGE_ERRORS = 0x2  # ReplaceFileW: a right that cannot be copied is no reason to fail
_CANNOT_MERGE = 1175  # ERROR_UNABLE_TO_REMOVE_REPLACED
_COPYFILE_ACL, _COPYFILE_XATTR = 1, 4  # copyfile.h of macOS
_LOCKED_BYTE = 1 << 30
_WAITS_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)


# Windows opens a device under each of these names, in any folder and with any ending.
_DEVICE = re.compile(
    r"(?:CON|PRN|AUX|NUL|CLOCK\$|CONIN\$|CONOUT\$|(?:COM|LPT)[0-9¹²³])\s*(?:[.:].*)?\Z", re.I
)


def is_device_name(name: str) -> bool:
    """True where Windows takes this name of a file for a device; asked on every platform, as files travel."""
    return _DEVICE.match(name) is not None


def no_device_name(name: str) -> str:
    """``name``, or what a file of that name is called where nobody may call it so."""
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
    """Do something to a file that another program may have open for a moment; some 3 s at most.

    Only Windows refuses that, and only its errors are waited for. Raises OSError as ``act`` does.
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
    """Give a copy the owner, modes, access list and tags of its source, as far as the system allows it.

    library
        stands for the C library of macOS; None where this is no macOS. Windows keeps them in :func:`swap`.
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

    On Windows the file keeps the access list, streams and attributes that it had: ``merge`` stands for the
    call that does it there, and returns an error number of Windows or 0.
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
    """Put the names in a folder on disk: a rename is there only with its folder. Raises OSError.

    Some shares and FUSE disks cannot do that for a folder: there is nothing more to be done, and no failure.
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
    """True where another process holds a lock on a file; None where this cannot be known.

    Asking takes the lock for a moment. Must not be asked of a file that this process has locked: closing it
    gives that lock up.
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
    """Lock a file, which is made where there is none, for as long as the result stays open.

    shared
        with others that share it. Windows has no such lock, and needs none where it guards an open file:
        nobody can delete that.

    None where another process holds the lock. It ends with the process, however that ends. Raises OSError.
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
    """Limit this process as far as the platform can, each limit by itself; no core files.

    memory, cpu_s
        bytes of address space and seconds of processor time; 0 for no limit.

    Returns the names of the limits that could not be set: Windows has none, macOS refuses one of memory.
    """
    found = resources or _resources()
    wanted = {"core": 0, **({"memory": memory} if memory else {}), **({"cpu": cpu_s} if cpu_s else {})}
    if found is None:
        return tuple(wanted)
    which = {"core": found.RLIMIT_CORE, "memory": found.RLIMIT_AS, "cpu": found.RLIMIT_CPU}
    refused = []
    for name, most in wanted.items():
        try:
            found.setrlimit(which[name], (most, most + 5 if name == "cpu" else most))
        except (ValueError, OSError):
            refused.append(name)
    return tuple(refused)


def allow_many_files(resources: Resources | None = None) -> None:
    """Raise the limit of open files to what the machine allows: each listener of a server is one."""
    found = resources or _resources()
    if found is None:
        return
    with suppress(OSError, ValueError):  # macOS names no limit as the limit, and then refuses it
        _, hard = found.getrlimit(found.RLIMIT_NOFILE)
        found.setrlimit(found.RLIMIT_NOFILE, (hard, hard))


def child_options(*, group: bool = False, offered: object = subprocess) -> dict[str, Any]:
    """Options of ``subprocess`` for a child that nobody sees: no console window opens on Windows.

    group
        the child and its own children can be ended together, by :func:`end`.
    offered
        has the flags of this platform.
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


def how_it_ended(code: int) -> str:
    """The exit code of a child in words: ``signal SIGSEGV``, ``exit code 3``."""
    if code >= 0:
        return f"exit code {code}"
    known = {int(number): number.name for number in signal.Signals}
    return f"signal {known.get(-code, -code)}"


def python_beside(prefix: str) -> list[str]:
    """Where a Python interpreter lies below its prefix."""
    names = ("python.exe", "bin/python.exe") if WINDOWS else ("bin/python3", "bin/python")
    return [os.path.join(prefix, *name.split("/")) for name in names]


# --- network --------------------------------------------------------------------------------------------


class SocketOptions(Protocol):
    """A socket, as far as its options go."""

    def setsockopt(self, level: int, option: int, value: int, /) -> None: ...


def own_the_port(sock: SocketOptions, constants: Any = socket) -> None:
    """Let no second server listen on the same port, and this one start again at once after its end.

    On Windows SO_REUSEADDR means that two may share the port; there the exclusive use is asked for.
    """
    exclusive = getattr(constants, "SO_EXCLUSIVEADDRUSE", None)
    option = constants.SO_REUSEADDR if exclusive is None else exclusive
    sock.setsockopt(socket.SOL_SOCKET, option, 1)


# Worker processes share one listening socket, which Windows does not hand to the event loop of a child.
WORKERS_CAN_SHARE_A_SOCKET = not WINDOWS
