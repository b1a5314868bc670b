# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is known about FreeCAD files, kept in one SQLite file until a file says something else.

The index is a memory of answers. An answer is a value computed from files; with it stands its trail: every
file that was read for it, by content, and every path of a link that was followed, with where it led. An
answer is given again only where all of its trail is true today. So whatever happens to the vault or to the
index, the worst is that something is computed once more.

The rules of this module:

* content is the packed ``Document.xml`` with the container's directory, which has a checksum of every entry;
* a row has a checksum; a row that fails it is not there;
* code that reads otherwise asks under another name (:func:`engine`), so an update never meets old answers;
* where nothing can be written the answers live in memory. Nothing here makes a run fail.
"""

from __future__ import annotations

import json
import os
import stat
import time
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import cache
from hashlib import blake2b, sha256
from pathlib import Path
from zlib import crc32

import silo.bom
import silo.fcstd
from silo.fcstd.contents import FileContents
from silo.fcstd.errors import FcstdError
from silo.fcstd.facts import FileFacts
from silo.locator import Locator
from silo.platform.user_folders import cache_folder
from silo.vault.answers import SeenFile, StoredAnswer, led_to
from silo.vault.database import FORMAT, IndexDatabase


@cache
def engine() -> str:
    """Return a name for the code that reads documents; it changes with that code."""
    digest = sha256(f"{FORMAT}".encode())
    for package in (silo.bom, silo.fcstd):
        for folder in package.__path__:
            for file in sorted(Path(folder).rglob("*.py")):
                digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


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
