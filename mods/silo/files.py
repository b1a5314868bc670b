# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD files on disk: which are meant, their content's hash, and whose turn a folder is. Standard library
only.

A :class:`Locator` leads from the path that a link records to a file on disk. FreeCAD records paths relative
to the folder of the owning file as it was opened, always with ``/``, and joins them as text: ``..`` takes
one name away, symlinks are not followed first (``src/App/PropertyLinks.cpp``, observed with FreeCAD 0.20 and
1.0). We do the same, and try the folder where the owning file really lies after that; FreeCAD 1.1 goes from
there alone. Only if both ways lead to a file do the versions differ.
"""

from __future__ import annotations

import errno
import getpass
import glob
import hashlib
import json
import os
import re
import socket
import time
from codecs import BOM_UTF8
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, fields
from itertools import chain
from pathlib import Path
from typing import BinaryIO, NamedTuple

from silo.bom.errors import ConfigError, DocumentError, InputError
from silo.bom.findings import FindingCode
from silo.platform import (
    Spelling,
    Spelt,
    cache_folder,
    folded,
    hold_lock,
    is_device_name,
    one_path,
    read_memory,
    replacing,
    shows_locks,
)

IGNORE_FILE = ".siloignore"

Check = Callable[[str], bool | None]


def documents_in(tops: Iterable[str]) -> list[str]:
    """List the files that are meant, each once: a folder stands for all FCStd files below it.

    Left out are backups, hidden files and folders, recycle bins, and what a ``.siloignore`` in the folder or
    below it names (in the syntax of ``.gitignore``). A folder that cannot be listed is in the result itself,
    so that the reader of the files reports it. A pattern (``*.FCStd``) stands for the files that match it,
    since the shells of Windows pass patterns on unchanged. InputError names everything that is missing.
    """
    meant = list(chain.from_iterable(map(_documents_of, tops)))
    must_exist(*meant)
    spelling = Spelling()
    once: dict[str, str] = {}
    for top in meant:
        real = spelling.real(top)  # a file may be named in several ways
        if not os.path.isdir(top):
            once.setdefault(real, top)
            continue
        begin = len(os.path.join(top, ""))
        for path in sorted(_below(top)):
            once.setdefault(os.path.join(real, path[begin:]), path)
    return list(once.values())


def must_exist(*paths: str) -> None:
    """Raise InputError that names all missing files and folders, before anything is done."""
    lost = [path for path in paths if not os.path.exists(path)]
    if len(lost) == 1:
        raise InputError(f"{_quoted(lost[0])}: there is no such file or folder")
    if lost:
        raise InputError(f"{len(lost)} of {len(paths)} files are not there; nothing was done", lost)


def _quoted(path: str) -> str:
    return path if path.strip() else repr(path)


# What file systems and file managers keep beside the files of people: what was deleted, and older states.
_NOT_OURS = ("#recycle", "#snapshot", "$recycle.bin", "@recycle", "@recently-snapshot", "~snapshot")


def _below(folder: str, rules: tuple[tuple[int, Check], ...] = (), inner: str = "") -> Iterator[str]:
    """Yield the FCStd files below a folder. A folder that cannot be listed is yielded itself, so that reading
    it fails.

    rules
        for each folder above: the position in ``inner`` at which paths below it begin, and its patterns.
    inner
        the folder as seen from the first one; "" or ending in ``/``.
    """
    try:
        with os.scandir(folder) as listing:
            entries = sorted(listing, key=lambda entry: entry.name)
    except OSError:
        yield folder
        return
    own = os.path.join(folder, IGNORE_FILE)
    if os.path.isfile(own):
        rules = (*rules, (len(inner), _patterns(own)))
    for entry in entries:
        if entry.name.startswith(".") or entry.name.lower() in _NOT_OURS:
            continue
        if entry.is_dir(follow_symlinks=False):
            name = f"{inner}{entry.name}/"
            if not _ignored(name, rules):
                yield from _below(entry.path, rules, name)
        elif entry.name.lower().endswith(".fcstd") and not _ignored(inner + entry.name, rules):
            path = entry.path
            # A link to nothing is reported.
            if entry.is_file(follow_symlinks=False) or os.path.isfile(path) or not os.path.exists(path):
                yield path


def _ignored(name: str, rules: Sequence[tuple[int, Check]]) -> bool:
    """Decide as git does: the last matching pattern of the innermost file counts."""
    for begin, check in reversed(rules):
        if (decided := check(name[begin:])) is not None:
            return decided
    return False


def _patterns(path: str) -> Check:
    """Read a file of patterns as a function of a name: True: leave it out, False: keep it, None: no pattern
    matches.
    """
    try:
        from pathspec import GitIgnoreSpec
    except ImportError as error:  # inside FreeCAD
        raise ConfigError(
            f"{path} is there, but the Python package pathspec, which reads it, is not"
        ) from error
    try:
        # Names need not be valid Unicode, and a pattern with a form feed is one pattern.
        text = os.fsdecode(Path(path).read_bytes().removeprefix(BOM_UTF8))
        lines = [line.removesuffix("\r") for line in text.split("\n")]
        spec = GitIgnoreSpec.from_lines(lines)
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}") from error
    return lambda name: spec.check_file(name).include


def _documents_of(top: str) -> list[str]:
    if glob.has_magic(top) and not os.path.lexists(top):
        return sorted(glob.glob(top)) or [top]
    return [top]


PROJECT_FILE = ".silo-project.json"
_PATIENCE_S = 10.0
_TRIES = 100  # of a lock whose file was deleted by its last holder


@dataclass(frozen=True)
class ProjectEntry:
    """What a project remembers of a file, by its path relative to the root, with ``/``.

    document
        the UUID of the file in Silo: that of its item, or its own.
    sha256
        the content that is in Silo or on its way there; "" before the first commit.
    uid
        FreeCAD's UUID of the document. A copy has it too, so it shows a new name only if the old one is gone.
    """

    document: str
    sha256: str = ""
    uid: str = ""


@dataclass(frozen=True)
class Project:
    """A project folder. The file :data:`PROJECT_FILE` marks its root and remembers its files; who shares or
    copies the folder shares that too."""

    root: str

    @classmethod
    def of(cls, path: Path | str) -> Project | None:
        """Find the project of a file or folder; None if no folder above it is a project."""
        folder = one_path(os.fspath(path))
        while True:
            if os.path.isfile(os.path.join(folder, PROJECT_FILE)):
                return cls(folder)
            above = os.path.dirname(folder)
            if above == folder:
                return None
            folder = above

    def place(self, path: str) -> str | None:
        """Return the path of a file relative to the root, with ``/``; None if it is outside."""
        real = one_path(path)
        inside = real.startswith(os.path.join(self.root, ""))
        return os.path.relpath(real, self.root).replace(os.sep, "/") if inside else None

    def path(self, place: str) -> str:
        """Return the path of a file in the project."""
        return os.path.join(self.root, *place.split("/"))

    def files(self) -> dict[str, ProjectEntry]:
        """Read what is remembered of each file, by its place."""
        files_noted = read_memory(Path(self.root, PROJECT_FILE)).get("files")
        names = {values.name for values in fields(ProjectEntry)}
        return {
            str(place): ProjectEntry(**{key: str(value) for key, value in values.items() if key in names})
            for place, values in (files_noted.items() if isinstance(files_noted, dict) else ())
            if isinstance(values, dict) and values.get("document")
        }

    def note(self, noted: Mapping[str, ProjectEntry | None]) -> None:
        """Remember these files; None forgets one. Raises DocumentError if the folder cannot be written."""
        try:
            with folder_lock(self.root, f"{PROJECT_FILE}.lock", "written", _PATIENCE_S):
                files = {place: asdict(kept) for place, kept in self.files().items() if place not in noted}
                files |= {place: asdict(kept) for place, kept in noted.items() if kept is not None}
                with replacing(Path(self.root, PROJECT_FILE), mode=0o644) as out:
                    out.write(json.dumps({"files": files}, indent=1, sort_keys=True).encode())
        except OSError as error:
            raise DocumentError(
                os.path.join(self.root, PROJECT_FILE), f"cannot be written ({error.strerror or error})"
            ) from error


@contextmanager
def folder_lock(
    folder: str,
    name: str,
    doing: str,
    patience: float = 0.0,
    tell: Callable[[str], object] = lambda _text: None,
) -> Iterator[str]:
    """Hold a folder alone; yields why other computers do not see that, "" if they do.

    The lock is a file in the folder, if its disk supports locks, otherwise in the user's cache. It ends with
    its process, however that ends; a file that a killed process left holds no lock.

    name, doing
        the lock's file; what is done to the folder ("synced"), for the message to another process.
    tell
        gets that message after 5 seconds, then each minute.

    Raises InputError with the name of the holder, after ``patience`` seconds.
    """
    path, problem = os.path.join(one_path(folder), name), ""
    try:
        held = _held(path, folder, doing, patience, tell)
        with suppress(OSError):
            os.chmod(path, 0o666)  # the next one may be another user
        if not shows_locks(path):
            problem = "its disk shows locks to this computer alone"
    except FileNotFoundError:  # no such folder: nobody else is in it
        yield problem
        return
    except OSError as error:
        problem = error.strerror or str(error)
        inner = cache_folder() / "locks" / f"{hashlib.sha256(os.fsencode(path)).hexdigest()[:32]}.lock"
        try:
            inner.parent.mkdir(parents=True, exist_ok=True)
            path = str(inner)
            held = _held(path, folder, doing, patience, tell)
        except OSError:  # nowhere to lock at all
            yield problem
            return
    with held:
        held.truncate(0)
        held.write(f"{_who()} since {time.strftime('%Y-%m-%d %H:%M:%S')}\n".encode())
        held.flush()
        with suppress(OSError):  # NFS keeps it here otherwise
            os.fsync(held.fileno())
        try:
            yield problem
        finally:
            removed = _remove(path)  # before the lock ends: see _held
    if not removed:  # Windows deletes no file that is open
        _remove(path)


def _remove(path: str) -> bool:
    """Remove a file. Returns False if it stays; it holds no lock then, so nobody waits for it."""
    try:
        os.unlink(path)
    except FileNotFoundError:
        pass
    except OSError:
        return False
    return True


def _who() -> str:
    try:
        user = getpass.getuser()
    except (OSError, KeyError):  # a container without a user of this number
        user = "an unnamed user"
    return f"process {os.getpid()} of {user} on {socket.gethostname()}"


def _held(path: str, folder: str, doing: str, patience: float, tell: Callable[[str], object]) -> BinaryIO:
    """Lock the file and return it. Raises InputError if another process has it, OSError if it cannot be
    locked.
    """
    if os.path.islink(path):  # somebody else's file may be behind it
        raise OSError(errno.ELOOP, f"{path} is a symbolic link")
    now, deleted = time.monotonic(), 0
    until, due = now + patience, now + 5
    while deleted < _TRIES:
        if (held := hold_lock(path)) is not None:
            # Its last holder may have deleted the file while we waited for the lock.
            with suppress(OSError):
                if os.path.samestat(os.fstat(held.fileno()), os.lstat(path)):
                    return held
            held.close()
            deleted += 1
        elif (now := time.monotonic()) >= min(until, due):
            try:
                who = Path(path).read_text(encoding="utf-8", errors="replace").strip()
            except OSError:  # the holder has just ended
                who = ""
            text = f"{folder} is being {doing} by {who or 'another process'}. Wait for it, or stop it."
            if now >= until:
                raise InputError(text)
            tell(text)
            due = now + 60
        time.sleep(0.02 if patience else 0)
    raise OSError(errno.ESTALE, "its disk returns a different file each time")


def job_text(env: Mapping[str, str]) -> str | None:
    """Read the arguments of a job inside FreeCAD from the file that ``SILO_ARGS_FILE`` names, else from
    ``SILO_ARGS``.

    An environment variable ends at 32 767 characters on Windows, and at 128 KiB on Linux. Raises OSError.
    """
    if name := env.get("SILO_ARGS_FILE"):
        return Path(name).read_text(encoding="utf-8")
    return env.get("SILO_ARGS")


def check_writable(*paths: str | None) -> None:
    """Raise InputError for a file that cannot be written, before a long run."""
    for path in filter(None, paths):
        folder = os.path.dirname(path) or "."
        if not os.path.isdir(folder):
            raise InputError(f"{path} cannot be written: there is no folder {folder}")
        if os.path.isdir(path) or not os.access(path if os.path.exists(path) else folder, os.W_OK):
            raise InputError(f"{path} cannot be written: it is a folder, or may not be changed")


def content_hash(path: Path | str) -> str:
    """Hash a file's content with SHA-256, in hexadecimal. Raises OSError."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sha256_of(path: str) -> str:
    """Hash a document that must be readable; DocumentError if it is not."""
    try:
        return content_hash(path)
    except OSError as error:
        raise DocumentError(path, error.strerror or str(error)) from error


def bare_checksum(checksum: str | None) -> str:
    """Return a server's SHA-256 in lower-case hex; "" if it gives none."""
    return (checksum or "").lower().removeprefix("sha256:")


def seen_as(number: int, checksum: str | None) -> str:
    """Return a name for the file of a revision that a person saw. It includes the file's hash, if the server
    knows that, because a restored server gives the same number to another file.
    """
    return f"{number} {bare_checksum(checksum)}".strip()


def shipped() -> Path:
    """Return the folder with the example and the add-on's own files: the checkout, or the wheel's copy
    of it.
    """
    wheel = Path(__file__).parent / "shipped"
    return wheel if wheel.is_dir() else Path(__file__).resolve().parents[2]


_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://")
_STREAM = re.compile(r"\.fcstd:", re.I)
_LONGEST, _DEEPEST = 4096, 128
_FOLDER_AT_MOST = 50_000


class FoundFile(NamedTuple):
    """A file. ``opened`` is the path as FreeCAD would open it, ``real`` has no symlinks in it."""

    opened: str
    real: str
    respelt: bool = False

    def is_straight(self, recorded: str, folder: str) -> bool:
        """Return True if the path itself leads to the file, so that the link finds it as long as it stays
        there.
        """
        return self.real == os.path.normpath(os.path.join(folder, recorded))


class NotFound(NamedTuple):
    """Why there is no file to open."""

    code: FindingCode
    detail: str = ""


@dataclass
class Locator:
    """Finds linked files, all below ``root`` where one is given; remembers folders for one session.

    remembers_files
        a file that was found is not looked for again.
    """

    root: str | None = None
    remembers_files: bool = False
    _files: dict[tuple[str, tuple[str, ...]], FoundFile] = field(default_factory=dict)
    _spelling: Spelling = field(default_factory=Spelling)
    _listings: dict[str, dict[str, list[str]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.root is not None:
            self.root = self._spelling.real(self.root)

    def real(self, path: str) -> str:
        """Return the one path of a file, without symlinks and spelt as its folders list it."""
        return self._spelling.look(path).path

    def inside(self, real_path: str) -> bool:
        """Return True if the file at a path without symlinks may be read."""
        root = self.root
        return root is None or real_path == root or real_path.startswith(os.path.join(root, ""))

    def find(self, recorded: str, folders: tuple[str, ...]) -> FoundFile | NotFound:
        """Find the file to which a link in a document in (one of) these folders leads."""
        if not self.remembers_files:
            return self._find(recorded, folders)
        found: FoundFile | NotFound | None = self._files.get((recorded, folders))
        if found is None:
            found = self._find(recorded, folders)
            if isinstance(found, FoundFile):
                self._files[recorded, folders] = found
        return found

    def learn(self, folders: tuple[str, ...], locations: Mapping[str, FoundFile]) -> None:
        """Remember where the paths of a document's links lead, as another session has just found."""
        for recorded, location in locations.items():
            self._files.setdefault((recorded, folders), location)

    def _find(self, recorded: str, folders: tuple[str, ...]) -> FoundFile | NotFound:
        if "://" in recorded and _URL.match(recorded):
            return NotFound(FindingCode.MISSING_FILE, "it is a web address; only files are read")
        if (refused := refusal(recorded)) is not None:
            return refused
        outside = False
        for path in _candidates(recorded, folders):
            spelt = self._spelling.look(path)
            if not self.inside(spelt.path):
                outside = True
            elif spelt.there:
                return FoundFile(path, spelt.path, respelt=_respelt_by_disk(recorded, spelt))
        if outside:
            return NotFound(FindingCode.OUTSIDE_ROOT)
        if recorded.count("/") > _DEEPEST:
            return NotFound(FindingCode.MISSING_FILE)
        return self._respelt(recorded, folders)

    def lies_straight(self, path: str) -> bool:
        """Return True if what is there has exactly this path: no folder is a symlink, and names are spelt as
        listed.
        """
        return self._spelling.is_plain(path)

    def _respelt(self, recorded: str, folders: tuple[str, ...]) -> FoundFile | NotFound:
        """Find the file that Windows or macOS would open (``part.FCStd`` for ``Part.FCStd``), if only one
        fits.
        """
        for path in _candidates(recorded, folders):
            matches = list(self._spellings(path))
            if len(matches) > 1:
                names = ", ".join(sorted(os.path.basename(match) for match in matches[:4]))
                return NotFound(
                    FindingCode.MISSING_FILE,
                    f"several files differ from it in case or Unicode form only: {names}",
                )
            if matches and self.inside(real := self.real(matches[0])):
                return FoundFile(matches[0], real, respelt=True)
        return NotFound(FindingCode.MISSING_FILE)

    def _spellings(self, path: str) -> Iterator[str]:
        folder, name = os.path.split(path)
        if not name or folder == path:
            return
        if os.path.isdir(folder):
            parents = [folder]
        else:
            parents = [p for p in self._spellings(folder) if os.path.isdir(p)][:2]
        for parent in parents:
            if self.inside(os.path.realpath(parent)):
                for match in self._listing(parent).get(folded(name), ()):
                    yield os.path.join(parent, match)

    def _listing(self, folder: str) -> dict[str, list[str]]:
        listing = self._listings.get(folder)
        if listing is None:
            listing = self._listings[folder] = {}
            try:
                with os.scandir(folder) as entries:
                    for _, item in zip(range(_FOLDER_AT_MOST), entries, strict=False):
                        listing.setdefault(folded(item.name), []).append(item.name)
            except OSError:
                pass  # a folder that cannot be listed shows nothing
        return listing


def refusal(recorded: str) -> NotFound | None:
    """Return why a recorded path is not even looked for; None if it may be.

    The rules are those of Windows, on which even a look can do harm. They are the same on every platform, so
    that a project reads the same everywhere.
    """
    if "\0" in recorded or len(recorded) > _LONGEST:
        return NotFound(FindingCode.MISSING_FILE, "its path cannot be one")
    path = recorded.replace("\\", "/")
    if path.startswith("//"):
        # The mere look would send the user's credentials to that host; //./ and //?/ name devices.
        return NotFound(FindingCode.OUTSIDE_ROOT, "it is on the network or a device, by an absolute path")
    for name in path.split("/"):
        if is_device_name(name):
            return NotFound(FindingCode.MISSING_FILE, f"{name} is a device on Windows, not a file")
        if _STREAM.search(name):
            return NotFound(FindingCode.MISSING_FILE, f"{name} names a stream within a file")
    return None


def _respelt_by_disk(recorded: str, spelt: Spelt) -> bool:
    """Return True if a disk that ignores case found a name of the link under another spelling.

    The user's spelling of the folders above does not concern the link.
    """
    if spelt.path == spelt.plain:
        return False
    own = len([name for name in recorded.replace("\\", "/").split("/") if name not in ("", ".", "..")])
    plain, listed = (Path(path).parts[-own:] for path in (spelt.plain, spelt.path))
    return plain != listed


def _candidates(recorded: str, folders: tuple[str, ...]) -> Iterator[str]:
    spellings = (recorded, recorded.replace("\\", "/")) if "\\" in recorded else (recorded,)
    for spelling in spellings:
        for folder in folders:
            yield os.path.normpath(os.path.join(folder, spelling))
