# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is known about FreeCAD files, kept in one SQLite file until a file says something else.

The index is a memory of answers. An answer is a value computed from files; with it stands its trail: every
file that was read for it, by content, and every path of a link that was followed, with where it led. An
answer is given again only where all of its trail is true today. So whatever happens to the vault or to the
index, the worst is that something is computed once more.

The rules of this module:

* a file is unchanged where size, inode, time of modification and time of change are those of the look that
  read it, and both times lie well before that look: a file system's clock has ticks, and two changes in one
  tick look like one. Else its content is compared;
* content is the packed ``Document.xml`` with the container's directory, which has a checksum of every entry;
* a row has a checksum; a row that fails it is not there;
* code that reads otherwise asks under another name (``ENGINE``), so an update never meets old answers;
* a database that is damaged is made again (:mod:`silo.vault.index`). Where nothing can be written the
  answers live in memory. Nothing here makes a run fail.

The SQLite file of the index, which several processes may use, and which may be lost at any time.

A database that is damaged or of another format is made again; one that cannot be written is left alone.
Nothing here makes a run fail.

Answers about files, and the trail of each: all that it depends on.
"""

from __future__ import annotations

import json
import logging
import os
import sqlite3
import stat
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache
from hashlib import blake2b, sha256
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple
from zlib import crc32

import silo.bom
import silo.fcstd
from silo.bom.errors import InputError
from silo.fcstd.container import FileState
from silo.fcstd.contents import Content, FileContents
from silo.fcstd.errors import FcstdError
from silo.fcstd.facts import FileFacts, Remembered
from silo.fcstd.library import Library
from silo.locator import FoundFile, Locator, NotFound
from silo.platform import cache_folder, hold_lock, remove_patiently

log = logging.getLogger("silo.vault")

_APPLICATION = 0x51107A11  # marks our databases (SQLite's application_id)
_MAGIC = b"SQLite format 3\0"
_BUSY_S = 10.0
_VARIABLES = 250  # of one statement; SQLite takes at least 999

_TABLES = """
CREATE TABLE files (path TEXT PRIMARY KEY, seen TEXT NOT NULL, mark INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE facts (path TEXT PRIMARY KEY, facts TEXT NOT NULL, mark BLOB NOT NULL);
CREATE TABLE answers (
    path TEXT NOT NULL, question TEXT NOT NULL, answer TEXT NOT NULL, trail TEXT NOT NULL,
    made_at REAL NOT NULL, mark INTEGER NOT NULL, PRIMARY KEY (path, question)
);
CREATE TABLE told (vault TEXT, sentence BLOB, PRIMARY KEY (vault, sentence)) WITHOUT ROWID;
CREATE TABLE places (vault TEXT, uuid TEXT, path TEXT, PRIMARY KEY (vault, uuid, path)) WITHOUT ROWID;
"""


class IndexDatabase:
    """A database at a path; None for one of this process alone.

    given
        the user named this path: a file that is no index of ours is not touched (InputError).
    trouble
        why nothing is kept, "" where all is well.
    writes
        False once writing failed.
    """

    def __init__(self, path: Path | None, given: bool) -> None:
        self.path = path
        self.trouble = ""
        self.writes = True
        self._guard: BinaryIO | None = None
        self._database = _empty()
        if path is not None:
            try:
                self._open(path, given)
            except InputError:
                self.close()
                raise

    def close(self) -> None:
        """Let others rebuild the database."""
        self._database.close()
        if self._guard is not None:
            self._guard.close()

    def select(self, statement: str, *values: str) -> list[Any]:
        """Return the rows; [] if the database fails."""
        try:
            return self._database.execute(statement, values).fetchall()
        except sqlite3.Error as error:
            self._give_up(error)
            return []

    def select_in(self, statement: str, paths: Sequence[str], *values: str) -> Iterator[Any]:
        """Yield rows whose path is one of these; ``statement`` ends with ``IN``."""
        for at in range(0, len(paths), _VARIABLES):
            group = paths[at : at + _VARIABLES]
            marks = ",".join("?" * len(group))
            yield from self.select(f"{statement} ({marks})", *values, *group)

    def write(self, *changes: tuple[str, Sequence[tuple[Any, ...]]]) -> bool:
        """Carry out statements, each for its rows, all or nothing. Returns True if that succeeded."""
        if not self.writes:
            return False
        try:
            self._database.execute("BEGIN IMMEDIATE")
            try:
                for statement, rows in changes:
                    self._database.executemany(statement, rows)
                self._database.execute("COMMIT")
            except BaseException:
                if self._database.in_transaction:
                    self._database.execute("ROLLBACK")
                raise
        except sqlite3.Error as error:
            self._give_up(error)
            return False
        return True

    def _open(self, path: Path, given: bool) -> None:
        try:
            if given and not _may_replace(path):
                raise InputError(
                    f"{path} is not an index of silo-mod, so it is left as it is. Name another file."
                )
            path.parent.mkdir(parents=True, exist_ok=True)
            for attempt in range(2):
                self._guard = hold_lock(f"{path}.lock", shared=True)
                if self._guard is None:
                    self.trouble = f"the index {path} is being made again by another process"
                    return
                try:
                    database = _connected(path)
                    self._database.close()
                    self._database = database
                    return
                except _Unusable as error:
                    log.info("%s: %s; it is made again", path, error)
                    self._guard.close()
                    if attempt or not _removed(path):
                        self.trouble = f"the index {path} cannot be used ({error})"
                        return
        except (OSError, sqlite3.Error) as error:
            self._give_up(error)

    def _give_up(self, error: sqlite3.Error | OSError) -> None:
        """Stop writing to a database that fails; read from it as long as that works."""
        if not self.trouble:
            self.trouble = f"the index {self.path} cannot be used ({error}); nothing is lost but time"
            log.warning("%s", self.trouble)
        self.writes = False
        if isinstance(error, sqlite3.DatabaseError) and not isinstance(error, sqlite3.OperationalError):
            self._database.close()
            self._database = _empty()
            if self._guard is not None and self.path is not None:
                self._guard.close()
                self._guard = None
                _removed(self.path)


def _empty() -> sqlite3.Connection:
    """Make a database for this process alone; SQLite moves it to the disk if it grows large."""
    database = sqlite3.connect("", isolation_level=None)
    database.executescript(_TABLES)
    return database


class _Unusable(Exception):
    """The file is no database that this code can use."""


def _connected(path: Path) -> sqlite3.Connection:
    """Open a database of our format, or make it. Raises _Unusable, sqlite3.OperationalError (locked, full, no
    right).
    """
    database = sqlite3.connect(path, timeout=_BUSY_S, isolation_level=None)
    try:
        database.execute("PRAGMA synchronous = NORMAL")
        database.execute("BEGIN IMMEDIATE")
        (application,) = database.execute("PRAGMA application_id").fetchone()
        (version,) = database.execute("PRAGMA user_version").fetchone()
        (tables,) = database.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if (application, version) == (0, 0) and not tables:
            for statement in _TABLES.split(";"):
                database.execute(statement)
            database.execute(f"PRAGMA application_id = {_APPLICATION}")
            database.execute(f"PRAGMA user_version = {FORMAT}")
        elif (application, version) != (_APPLICATION, FORMAT):
            raise _Unusable(f"it has format {version}, wanted is {FORMAT}")
        database.execute("COMMIT")
        return database
    except sqlite3.OperationalError:
        database.close()
        raise
    except sqlite3.DatabaseError as error:
        database.close()
        raise _Unusable(str(error)) from error
    except _Unusable:
        database.close()
        raise


def _removed(path: Path) -> bool:
    """Delete a database that nobody has open; returns True if it is gone."""
    guard = hold_lock(f"{path}.lock")
    if guard is None:
        return False
    with guard:
        for name in (path, f"{path}-journal", f"{path}-wal", f"{path}-shm"):
            remove_patiently(name)
    return True


def _may_replace(path: Path) -> bool:
    """Return True if the path is free, or holds a database of ours, even if it is damaged behind its head."""
    try:
        with path.open("rb") as file:
            head = file.read(72)
    except FileNotFoundError:
        return True
    ours = head.startswith(_MAGIC) and head[68:72] == _APPLICATION.to_bytes(4, "big")
    return ours or not head


FORMAT = 5
_ENCODER = json.JSONEncoder(separators=(",", ":"))
_SETTLED_NS = 2_500_000_000  # FAT has ticks of 2 s, the coarsest in use


@cache
def engine() -> str:
    """Return a name for the code that reads documents; it changes with that code."""
    digest = sha256(f"{FORMAT}".encode())
    for package in (silo.bom, silo.fcstd):
        for folder in package.__path__:
            for file in sorted(Path(folder).rglob("*.py")):
                digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


class SeenFile(NamedTuple):
    """A file at the time of a look. ``content`` begins with "!" for a file that could not be read."""

    content: str
    inode: int
    size: int
    modified_ns: int
    changed_ns: int
    read_ns: int

    @classmethod
    def of(cls, content: Content | Remembered) -> SeenFile:
        """Make the record of a file that was read."""
        state = content.state
        return cls(
            content.digest,
            state.inode,
            state.size,
            state.modified_ns,
            content.changed_ns,
            content.read_ns,
        )

    @classmethod
    def unread(cls, error: FcstdError) -> SeenFile | None:
        """Make the record of a file that could not be read, with its state, so that any change counts. None
        if it has no state.
        """
        state = error.state
        if not isinstance(state, FileState):
            return None
        content = f"!{state.inode}:{state.size}:{state.modified_ns}:{error.reason}"
        return cls(content, state.inode, state.size, state.modified_ns, 0, 0)

    def text(self) -> str:
        """Write it as a key for the index."""
        return f"{self.inode} {self.size} {self.modified_ns} {self.changed_ns} {self.read_ns} {self.content}"

    @classmethod
    def from_text(cls, text: str) -> SeenFile:
        """Read what :meth:`text` wrote."""
        *numbers, content = text.split(" ", 5)
        return cls(content, *map(int, numbers))

    def still(self, status: os.stat_result) -> bool:
        """Return True if the file certainly has not changed since."""
        then = (self.inode, self.size, self.modified_ns, self.changed_ns)
        now = (status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)
        return then == now and max(self.modified_ns, self.changed_ns) + _SETTLED_NS < self.read_ns


class StoredAnswer(NamedTuple):
    """An answer with its trail; it travels between processes and machines.

    answer
        JSON.
    trail
        JSON: [{path: content}, [[folders in which links' paths begin, {recorded path: where it leads}], …]].
        Left out are links that lead straight to one of the files: they do as long as it lies there. Only the
        content where nothing was read but the very file that was asked about.
    seen
        path → the file when it was read; empty where the answer comes from the index.
    lasting
        False where the answer must not be kept: a file was being written, or its state is not known.
    """

    answer: str
    trail: str
    seen: Mapping[str, SeenFile] = {}
    lasting: bool = True

    @classmethod
    def found_in(cls, library: Library, answer: Any) -> StoredAnswer:
        """Make the record of an answer and of the files read for it; the session did nothing else."""
        seen: dict[str, SeenFile] = {}
        lasting = True
        for path, document in library.documents.items():
            if not isinstance(document, FcstdError):
                seen[path] = SeenFile.of(document.content)
            elif (unread := SeenFile.unread(document)) is not None:
                seen[path] = unread
            else:
                lasting = False
        led: dict[tuple[str, ...], dict[str, str]] = {}
        for (folders, recorded), location in library.lookups.items():
            if (
                isinstance(location, FoundFile)
                and location.real in seen
                and location.is_straight(recorded, folders[0])
            ):
                continue
            led.setdefault(folders, {})[recorded] = led_to(location)
        if len(seen) == 1 and not led:
            return cls(json_of(answer), next(iter(seen.values())).content, seen, lasting)
        files = {path: file.content for path, file in seen.items()}
        return cls(json_of(answer), json_of([files, list(led.items())]), seen, lasting)

    @property
    def is_of_one_file(self) -> bool:
        """Return True if only the file in question was read, and no link was followed."""
        return not self.trail.startswith("[")

    @property
    def links(self) -> frozenset[str]:
        """Return the files to which links lead, counted or not; for a missing file the recorded path."""
        if self.is_of_one_file:
            return frozenset()
        files, lookups = json.loads(self.trail)
        link_paths = frozenset(
            _target(to) or os.path.normpath(os.path.join(folders[-1], recorded))
            for folders, led in lookups
            for recorded, to in led.items()
        )
        return link_paths.union(files) - {next(iter(files), "")}


def led_to(location: FoundFile | NotFound) -> str:
    if isinstance(location, NotFound):
        return f"!{location.code}:{location.detail}"
    if location.opened == location.real and not location.respelt:
        return location.real
    return f"{location.opened}\0{location.real}\0{location.respelt}"


def _target(led: str) -> str | None:
    return None if led.startswith("!") else (led.split("\0") * 2)[1]


def json_of(value: Any) -> str:
    # Escaped: a file's name need not be valid Unicode, and SQLite takes nothing else.
    return _ENCODER.encode(value)


_KEPT_S = 30 * 24 * 3600.0
_SAVED_EACH = 500
_ANSWERS = "SELECT path, answer, trail, mark FROM answers"


def default_path() -> Path:
    """Return the path of the user's index."""
    return cache_folder() / "documents.sqlite3"


def _mark(*texts: str) -> int:
    return crc32("\0".join(texts).encode("utf-8", "surrogateescape"))


def _facts_mark(path: str, facts: str) -> bytes:
    """Return a mark of the code that made the facts, since those of other code must never be used."""
    text = f"{engine()}\0{path}\0{facts}"
    return blake2b(text.encode("utf-8", "surrogateescape"), digest_size=16).digest()


class Index:
    """The memory, for one run: a file that was looked at once is not looked at again. For one thread.

    path
        the database, which several processes may use; None keeps nothing beyond this object's life.
    contents
        reads the files whose state says too little.
    given
        the user named this path: a file that is no index of ours is not touched (InputError).
    """

    def __init__(
        self, path: Path | None = None, *, given: bool = False, contents: FileContents | None = None
    ) -> None:
        self.contents = contents or FileContents()
        self._database = IndexDatabase(path, given)
        self._now: dict[str, SeenFile | None] = {}
        self._led: dict[tuple[tuple[str, ...], str], str] = {}
        self._locator = Locator()
        self._unsaved: dict[tuple[str, str], StoredAnswer] = {}
        self._facts: dict[str, str] = {}
        self._files: dict[str, SeenFile] = {}
        self._rows: dict[str, tuple[str, int]] = {}
        self._expected = ""

    @property
    def trouble(self) -> str:
        """Say why nothing is kept; "" if all is well."""
        return self._database.trouble

    def __enter__(self) -> Index:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Save, and let others rebuild the database."""
        self.save()
        self._database.close()

    # --- answers ----------------------------------------------------------------------------------------

    def recall(self, path: str, question: str) -> StoredAnswer | None:
        """Return the kept answer to a question about a file; None if the file must be read (again)."""
        return next(self.recall_all([(path, question)]))

    def recall_all(self, asked: Sequence[tuple[str, str]]) -> Iterator[StoredAnswer | None]:
        """Yield the kept answers to several questions, in their order."""
        rows: dict[tuple[str, str], tuple[str, str, int]] = {}
        for question in dict.fromkeys(question for _, question in asked):
            paths = [_text(path) for path, wanted in asked if wanted == question]
            answers = self._database.select_in(f"{_ANSWERS} WHERE question = ? AND path IN", paths, question)
            rows |= {(path, question): row for path, *row in answers}
        for path, question in asked:
            stored_answer = self._unsaved.get((path, question))
            if stored_answer is None and (row := rows.get((_text(path), question))) is not None:
                answer, trail, mark = row
                if mark == _mark(path, question, answer, trail):
                    stored_answer = StoredAnswer(answer, trail)
            yield stored_answer if stored_answer is not None and self._holds(path, stored_answer) else None

    def _holds(self, path: str, answer: StoredAnswer) -> bool:
        if answer.is_of_one_file:
            return self.content(path) == answer.trail
        files, lookups = json.loads(answer.trail)
        for file, content in files.items():
            if self.content(file) != content:
                return False
        for folders, led in lookups:
            start = tuple(folders)
            for recorded, to in led.items():
                if self._leads(start, recorded) != to:
                    return False
        return True

    def remember(self, path: str, question: str, answer: StoredAnswer) -> None:
        """Keep an answer; the next :meth:`save` writes it to disk."""
        if not answer.lasting:
            return
        for file, seen in answer.seen.items():
            self._note(file, seen)
        self._unsaved[path, question] = StoredAnswer(answer.answer, answer.trail)
        if len(self._unsaved) >= _SAVED_EACH:
            self.save()

    def _note(self, file: str, seen: SeenFile) -> None:
        before = self._now.get(file)
        if before is None or before.content != seen.content:
            self._now[file] = seen
            if not seen.content.startswith("!"):
                self._files[file] = seen

    def remember_facts(self, path: str, facts: str) -> None:
        """Keep the facts of a file as it was read."""
        file_facts = FileFacts(*json.loads(facts))
        _, inode, size, modified_ns = file_facts.state
        self._note(
            path,
            SeenFile(file_facts.digest, inode, size, modified_ns, file_facts.changed_ns, file_facts.read_ns),
        )
        self._facts[path] = facts
        if len(self._facts) >= _SAVED_EACH:
            self.save()

    def facts(self, paths: Sequence[str]) -> dict[str, str]:
        """Return the facts of those of these files that have not changed since."""
        facts_by_path = {path: self._facts[path] for path in paths if path in self._facts}
        rows = {
            path: (facts, mark)
            for path, facts, mark in self._database.select_in(
                "SELECT path, facts, mark FROM facts WHERE path IN",
                [_text(path) for path in paths if path not in facts_by_path],
            )
        }
        for path in paths:
            facts, mark = rows.get(_text(path), ("", b""))
            if facts and mark == _facts_mark(path, facts):
                facts_by_path[path] = facts
        return {
            path: text for path, text in facts_by_path.items() if text.startswith(f'["{self.content(path)}"')
        }

    def content(self, path: str) -> str | None:
        """Return the content that is at a path without symlinks now, as the trails name it; None if it is
        unknown.
        """
        if path not in self._now:
            self._now[path] = self._look(path)
        seen = self._now[path]
        return seen.content if seen is not None else None

    def _look(self, path: str) -> SeenFile | None:
        try:
            status = os.lstat(path)
        except (OSError, ValueError):
            return None
        if stat.S_ISLNK(status.st_mode) or not self._locator.lies_straight(path):
            return None  # the file has another path by now
        file = self._known_file(path)
        if file is not None and file.still(status):
            return file
        try:
            seen = SeenFile.of(self.contents.read(path))
        except FcstdError as error:
            return SeenFile.unread(error)
        self._files[path] = seen
        return seen

    def _leads(self, folders: tuple[str, ...], recorded: str) -> str:
        """Find where a link leads now."""
        key = (folders, recorded)
        if (now := self._led.get(key)) is None:
            now = self._led[key] = led_to(self._locator.find(recorded, folders))
        return now

    def untouched(self, path: str) -> bool:
        """Return True if a file has not changed since this run first looked at it. From any thread."""
        seen = self._now.get(path)
        try:
            status = os.stat(path)
        except OSError:
            return False
        now = (status.st_ino, status.st_size, status.st_mtime_ns)
        return seen is not None and now == (seen.inode, seen.size, seen.modified_ns)

    # --- where items were -------------------------------------------------------------------------------

    def places(self, vault: str) -> dict[str, set[str]]:
        """Return identity → the files that carried it when the vault was last read."""
        files: dict[str, set[str]] = {}
        rows = self._database.select("SELECT uuid, path FROM places WHERE vault = ?", _text(vault))
        for uuid, path in rows:
            files.setdefault(uuid, set()).add(os.fsdecode(path))
        return files

    def keep_places(self, vault: str, places: Iterable[tuple[str, str]]) -> None:
        """Replace what is known of a vault."""
        rows = [(_text(vault), uuid, os.fsencode(path)) for uuid, path in set(places)]
        self._database.write(
            ("DELETE FROM places WHERE vault = ?", [(_text(vault),)]),
            ("INSERT OR REPLACE INTO places VALUES (?, ?, ?)", rows),
        )

    def told(self, vault: str) -> frozenset[str] | None:
        """Return the sentences of the last report about the vault; None if there was none."""
        rows = self._database.select("SELECT sentence FROM told WHERE vault = ?", _text(vault))
        return frozenset(os.fsdecode(sentence) for (sentence,) in rows) - {""} if rows else None

    def keep_told(self, vault: str, sentences: Iterable[str]) -> None:
        """Remember the sentences of this run's report."""
        rows = [(_text(vault), os.fsencode(sentence)) for sentence in {"", *sentences}]
        self._database.write(
            ("DELETE FROM told WHERE vault = ?", [(_text(vault),)]), ("INSERT INTO told VALUES (?, ?)", rows)
        )

    def forget(self, folder: str, but: Collection[str]) -> None:
        """Forget all files of a folder but these, and what older code has recorded."""
        rows = self._database.select("SELECT path FROM files WHERE path >= ? AND path < ?", *_below(folder))
        kept = {path for path in but if path.isascii()} | {_text(path) for path in but if not path.isascii()}
        gone = [path for (path,) in rows if path not in kept]
        self._database.write(
            ("DELETE FROM files WHERE path = ?", [(path,) for path in gone]),
            ("DELETE FROM facts WHERE path = ?", [(path,) for path in gone]),
            ("DELETE FROM answers WHERE path = ?", [(path,) for path in gone]),
            (
                "DELETE FROM answers WHERE made_at < ? AND substr(question, 1, 16) <> ?",
                [(time.time() - _KEPT_S, engine())],
            ),
        )

    # --- the database -----------------------------------------------------------------------------------

    def save(self) -> None:
        """Write what is not yet on disk, all or nothing."""
        if not self._database.writes or not (self._unsaved or self._files or self._facts):
            return
        now = time.time()
        files = [
            (_text(path), text, _mark(path, text))
            for path, text in ((path, seen.text()) for path, seen in self._files.items())
        ]
        answers = [
            (
                _text(path),
                question,
                answer.answer,
                answer.trail,
                now,
                _mark(path, question, answer.answer, answer.trail),
            )
            for (path, question), answer in self._unsaved.items()
        ]
        facts = [(_text(path), text, _facts_mark(path, text)) for path, text in self._facts.items()]
        if self._database.write(
            ("INSERT OR REPLACE INTO files VALUES (?, ?, ?)", files),
            ("INSERT OR REPLACE INTO facts VALUES (?, ?, ?)", facts),
            ("INSERT OR REPLACE INTO answers VALUES (?, ?, ?, ?, ?, ?)", answers),
        ):
            self._files.clear()
            self._facts.clear()
            self._unsaved.clear()

    def _known_file(self, path: str) -> SeenFile | None:
        if path in self._files:
            return self._files[path]
        row = self._rows.get(path)
        if row is None and not self._all_below(path):
            rows = self._database.select("SELECT path, seen, mark FROM files WHERE path = ?", _text(path))
            row = rows[0][1:] if rows else None
        return SeenFile.from_text(row[0]) if row is not None and row[1] == _mark(path, row[0]) else None

    def expect(self, folder: str) -> None:
        """Load what is known of all files below a folder, since most will be asked for."""
        self._expected = os.path.join(folder, "")
        rows = self._database.select(
            "SELECT path, seen, mark FROM files WHERE path >= ? AND path < ?", *_below(folder)
        )
        self._rows = {path: (seen, mark) for path, seen, mark in rows}

    def _all_below(self, path: str) -> bool:
        return bool(self._expected) and path.startswith(self._expected) and path == _text(path)


def _below(folder: str) -> tuple[str, str]:
    """Return two texts between which the database sorts the paths below a folder."""
    begin = _text(os.path.join(folder, ""))
    return begin, begin[:-1] + chr(ord(os.sep) + 1)


def _text(path: str) -> str:
    # SQLite takes valid Unicode only. Two names may become one here; the marks tell their rows apart.
    if path.isascii():
        return path
    return path.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
