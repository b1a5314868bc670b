# SPDX-License-Identifier: LGPL-2.1-or-later
"""A disk as Windows and macOS have it: names are kept as written, and found in any case and normal form.

A small FUSE file system over a real folder, run as a process of its own:

    python tests/support/other_disk.py FOLDER MOUNT_POINT [each-spelling] [by-letter]

It stays in the foreground until it is unmounted. Needs ``mfusepy``, libfuse and the right to mount.
"""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

import pytest

from silo.platform.spelling import folded

try:
    import mfusepy as fuse
except (ImportError, OSError, AttributeError) as error:  # no such package, or no libfuse on this machine
    fuse, _WHY = None, str(error)


def _cannot(reason: str) -> NoReturn:
    if os.environ.get("SILO_REQUIRE_FUSE"):
        pytest.fail(reason)
    pytest.skip(reason)


@contextmanager
def other_disk(folder: Path, *options: str) -> Iterator[Path]:
    """Such a disk, mounted below ``folder``. Skips the test where none can be mounted.

    With ``each-spelling`` each spelling of a name has an inode number of its own, as some network disks do.
    With ``by-letter`` a letter is equal to one other letter at most, as on Windows: ß is not SS.
    """
    if fuse is None:
        _cannot(f"needs FUSE: {_WHY}")
    umount = shutil.which("fusermount3") or shutil.which("fusermount")
    if umount is None or not os.access("/dev/fuse", os.R_OK | os.W_OK):
        _cannot("needs FUSE: no fusermount, or no right to use /dev/fuse")
    root, mount = folder / "disk", folder / "mounted"
    root.mkdir()
    mount.mkdir()
    command = [sys.executable, __file__, str(root), str(mount), *options]
    path = os.pathsep.join(filter(None, sys.path))
    # Its complaints go to a file: nobody reads a pipe, and a full one would stop it.
    with (
        tempfile.TemporaryFile() as told,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=told, env={**os.environ, "PYTHONPATH": path}
        ) as process,
    ):
        assert process.stdout is not None
        if process.stdout.readline() != b"mounted\n":
            process.kill()
            told.seek(0)
            _cannot(f"needs the right to mount: {told.read().decode(errors='replace')[-300:]}")
        try:
            yield mount
        finally:
            subprocess.run([umount, "-u", "-z", str(mount)], check=True, capture_output=True)
            # It ends with the last program that has a file there open; the disk is not waited for longer.
            with suppress(subprocess.TimeoutExpired):
                process.wait(timeout=30)
            process.kill()


class OtherDisk(fuse.Operations if fuse else object):  # type: ignore[misc]
    """Passes everything on to ``root``, each name in the spelling that is really there."""

    use_ns = True

    def __init__(self, root: str, fold: Callable[[str], str] = folded) -> None:
        self.root, self.fold = os.path.realpath(root), fold

    def _real(self, path: str) -> str:
        real = self.root
        for name in filter(None, path.split("/")):
            known = os.path.join(real, name)
            if not os.path.lexists(known):
                try:
                    listed = os.listdir(real)
                except OSError:
                    listed = []
                known = next(
                    (os.path.join(real, n) for n in listed if self.fold(n) == self.fold(name)), known
                )
            real = known
        return real

    def init(self, path: str) -> None:
        print("mounted", flush=True)

    def getattr(self, path: str, fh: int | None = None) -> dict[str, Any]:
        status = os.lstat(self._real(path))
        times = {f"st_{kind}time": getattr(status, f"st_{kind}time_ns") for kind in "acm"}
        names = ("st_gid", "st_ino", "st_mode", "st_nlink", "st_size", "st_uid")
        return times | {name: getattr(status, name) for name in names}

    def readdir(self, path: str, fh: int) -> Iterator[tuple[str, dict[str, int], int]]:
        # An entry without an inode is one that was deleted.
        real = self._real(path)
        for name in (".", "..", *os.listdir(real)):
            status = os.lstat(os.path.join(real, name))
            yield name, {"st_ino": status.st_ino, "st_mode": status.st_mode}, 0

    def access(self, path: str, mode: int) -> int:
        if not os.access(self._real(path), mode):
            raise OSError(errno.EACCES, path)
        return 0

    def create(self, path: str, mode: int, fi: Any = None) -> int:
        return os.open(self._real(path), os.O_RDWR | os.O_CREAT, mode)

    def open(self, path: str, flags: int) -> int:
        return os.open(self._real(path), flags)

    def read(self, path: str, size: int, offset: int, fh: int) -> bytes:
        return os.pread(fh, size, offset)

    def write(self, path: str, data: bytes, offset: int, fh: int) -> int:
        return os.pwrite(fh, data, offset)

    def truncate(self, path: str, length: int, fh: int | None = None) -> int:
        os.truncate(self._real(path), length)
        return 0

    def flush(self, path: str, fh: int) -> int:
        return 0

    def fsync(self, path: str, datasync: bool, fh: int) -> int:
        os.fsync(fh)
        return 0

    def release(self, path: str, fh: int) -> int:
        os.close(fh)
        return 0

    def mkdir(self, path: str, mode: int) -> int:
        os.mkdir(self._real(path), mode)
        return 0

    def rmdir(self, path: str) -> int:
        os.rmdir(self._real(path))
        return 0

    def unlink(self, path: str) -> int:
        os.unlink(self._real(path))
        return 0

    def rename(self, old: str, new: str) -> int:
        source, target = self._real(old), self._real(new)
        os.rename(source, target)
        # Renaming to another spelling of the same name changes the spelling.
        wanted = os.path.join(os.path.dirname(target), os.path.basename(new))
        if source == target:
            os.rename(source, wanted)
        return 0

    def symlink(self, target: str, source: str) -> int:
        os.symlink(source, self._real(target))
        return 0

    def link(self, target: str, source: str) -> int:
        if os.path.lexists(self._real(target)):
            raise OSError(errno.EEXIST, target)
        os.link(self._real(source), self._real(target))
        return 0

    def readlink(self, path: str) -> str:
        return os.readlink(self._real(path))

    def chmod(self, path: str, mode: int) -> int:
        os.chmod(self._real(path), mode)
        return 0

    def chown(self, path: str, uid: int, gid: int) -> int:
        os.chown(self._real(path), uid, gid)
        return 0

    def utimens(self, path: str, times: tuple[int, int] | None = None) -> int:
        os.utime(self._real(path), ns=times)
        return 0

    def statfs(self, path: str) -> dict[str, Any]:
        found = os.statvfs(self._real(path))
        names = ("f_bavail", "f_bfree", "f_blocks", "f_bsize", "f_favail", "f_ffree", "f_files", "f_frsize")
        return {name: getattr(found, name) for name in (*names, "f_namemax")}


def by_letter(name: str) -> str:
    """Equal for names that differ in the case of letters only."""
    return "".join(upper if len(upper := c.upper()) == 1 else c for c in name)


if __name__ == "__main__":
    # nothreads: one request at a time, as the look-up and what follows it belong together.
    # use_ino: an inode is the file's own, whatever it is called; else each spelling has one.
    own = "each-spelling" not in sys.argv[3:]
    disk = OtherDisk(sys.argv[1], by_letter if "by-letter" in sys.argv[3:] else folded)
    fuse.FUSE(disk, sys.argv[2], foreground=True, nothreads=True, use_ino=own, fsname="other")
