# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was found out about FreeCAD files, kept in one SQLite file until a file says something else.

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
* a database that is damaged is made anew (:mod:`silo.vault.database`). Where nothing can be written the
  answers live in memory. Nothing here makes a run fail.
"""

from __future__ import annotations

import json
import os
import stat
import time
from collections.abc import Collection, Iterable, Iterator, Sequence
from hashlib import blake2b
from pathlib import Path
from zlib import crc32

from silo.fcstd.facts import Facts
from silo.fcstd.library import Contents
from silo.fcstd.limits import FcstdError
from silo.fcstd.locate import Locator
from silo.folders import cache_folder
from silo.vault.answers import Known, Seen, engine, led_to
from silo.vault.database import Database

_KEPT_S = 30 * 24 * 3600.0
_SAVED_EACH = 500
_ANSWERS = "SELECT path, answer, trail, mark FROM answers"


def default_path() -> Path:
    """The user's index."""
    return cache_folder() / "documents.sqlite3"


def _mark(*texts: str) -> int:
    return crc32("\0".join(texts).encode("utf-8", "surrogateescape"))


def _facts_mark(path: str, facts: str) -> bytes:
    """Also tells what other code has found out, which must never be taken."""
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
        self, path: Path | None = None, *, given: bool = False, contents: Contents | None = None
    ) -> None:
        self.contents = contents or Contents()
        self._database = Database(path, given)
        self._now: dict[str, Seen | None] = {}
        self._led: dict[tuple[tuple[str, ...], str], str] = {}
        self._locator = Locator()
        self._unsaved: dict[tuple[str, str], Known] = {}
        self._facts: dict[str, str] = {}
        self._files: dict[str, Seen] = {}
        self._rows: dict[str, tuple[str, int]] = {}
        self._expected = ""

    @property
    def trouble(self) -> str:
        """Why nothing is kept; "" where all is well."""
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

    def recall(self, path: str, question: str) -> Known | None:
        """The answer to a question about a file; None where it must be found out (again)."""
        return next(self.recall_all([(path, question)]))

    def recall_all(self, asked: Sequence[tuple[str, str]]) -> Iterator[Known | None]:
        """The same for several questions, in their order."""
        rows: dict[tuple[str, str], tuple[str, str, int]] = {}
        for question in dict.fromkeys(question for _, question in asked):
            paths = [_text(path) for path, one in asked if one == question]
            found = self._database.select_in(f"{_ANSWERS} WHERE question = ? AND path IN", paths, question)
            rows |= {(path, question): row for path, *row in found}
        for path, question in asked:
            known = self._unsaved.get((path, question))
            if known is None and (row := rows.get((_text(path), question))) is not None:
                answer, trail, mark = row
                if mark == _mark(path, question, answer, trail):
                    known = Known(answer, trail)
            yield known if known is not None and self._holds(path, known) else None

    def _holds(self, path: str, known: Known) -> bool:
        if known.is_of_one_file:
            return self.content(path) == known.trail
        files, lookups = json.loads(known.trail)
        for file, content in files.items():
            if self.content(file) != content:
                return False
        for folders, led in lookups:
            start = tuple(folders)
            for recorded, to in led.items():
                if self._leads(start, recorded) != to:
                    return False
        return True

    def remember(self, path: str, question: str, known: Known) -> None:
        """Keep an answer; on disk with the next :meth:`save`."""
        if not known.lasting:
            return
        for file, seen in known.seen.items():
            self._note(file, seen)
        self._unsaved[path, question] = Known(known.answer, known.trail)
        if len(self._unsaved) >= _SAVED_EACH:
            self.save()

    def _note(self, file: str, seen: Seen) -> None:
        before = self._now.get(file)
        if before is None or before.content != seen.content:
            self._now[file] = seen
            if not seen.content.startswith("!"):
                self._files[file] = seen

    def remember_facts(self, path: str, facts: str) -> None:
        """Keep the facts of a file as it was read."""
        known = Facts(*json.loads(facts))
        _, inode, size, modified_ns = known.state
        self._note(path, Seen(known.digest, inode, size, modified_ns, known.changed_ns, known.read_ns))
        self._facts[path] = facts
        if len(self._facts) >= _SAVED_EACH:
            self.save()

    def facts(self, paths: Sequence[str]) -> dict[str, str]:
        """The facts of these files, of those that are what they were then."""
        found = {path: self._facts[path] for path in paths if path in self._facts}
        rows = {
            path: (facts, mark)
            for path, facts, mark in self._database.select_in(
                "SELECT path, facts, mark FROM facts WHERE path IN",
                [_text(path) for path in paths if path not in found],
            )
        }
        for path in paths:
            facts, mark = rows.get(_text(path), ("", b""))
            if facts and mark == _facts_mark(path, facts):
                found[path] = facts
        return {path: text for path, text in found.items() if text.startswith(f'["{self.content(path)}"')}

    def content(self, path: str) -> str | None:
        """What lies at a path without symlinks now, as the trails name it; None where nobody can say."""
        if path not in self._now:
            self._now[path] = self._look(path)
        seen = self._now[path]
        return seen.content if seen is not None else None

    def _look(self, path: str) -> Seen | None:
        try:
            status = os.lstat(path)
        except (OSError, ValueError):
            return None
        if stat.S_ISLNK(status.st_mode) or not self._locator.lies_straight(path):
            return None  # the file has another path by now
        known = self._known_file(path)
        if known is not None and known.still(status):
            return known
        try:
            seen = Seen.of(self.contents.read(path))
        except FcstdError as error:
            return Seen.unread(error)
        self._files[path] = seen
        return seen

    def _leads(self, folders: tuple[str, ...], recorded: str) -> str:
        """Where a link leads now."""
        key = (folders, recorded)
        if (now := self._led.get(key)) is None:
            now = self._led[key] = led_to(self._locator.find(recorded, folders))
        return now

    def untouched(self, path: str) -> bool:
        """True where a file is still in the state in which this run found it. From any thread."""
        seen = self._now.get(path)
        try:
            status = os.stat(path)
        except OSError:
            return False
        now = (status.st_ino, status.st_size, status.st_mtime_ns)
        return seen is not None and now == (seen.inode, seen.size, seen.modified_ns)

    # --- where items were -------------------------------------------------------------------------------

    def places(self, vault: str) -> dict[str, set[str]]:
        """Identity → files that carried it when the vault was last read."""
        found: dict[str, set[str]] = {}
        rows = self._database.select("SELECT uuid, path FROM places WHERE vault = ?", _text(vault))
        for uuid, path in rows:
            found.setdefault(uuid, set()).add(os.fsdecode(path))
        return found

    def keep_places(self, vault: str, places: Iterable[tuple[str, str]]) -> None:
        """Replace what is known of a vault."""
        rows = [(_text(vault), uuid, os.fsencode(path)) for uuid, path in set(places)]
        self._database.write(
            ("DELETE FROM places WHERE vault = ?", [(_text(vault),)]),
            ("INSERT OR REPLACE INTO places VALUES (?, ?, ?)", rows),
        )

    def forget(self, folder: str, but: Collection[str]) -> None:
        """Forget the files of a folder but these, and what older code has found out."""
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
            (_text(path), question, one.answer, one.trail, now, _mark(path, question, one.answer, one.trail))
            for (path, question), one in self._unsaved.items()
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

    def _known_file(self, path: str) -> Seen | None:
        if path in self._files:
            return self._files[path]
        row = self._rows.get(path)
        if row is None and not self._all_below(path):
            found = self._database.select("SELECT path, seen, mark FROM files WHERE path = ?", _text(path))
            row = found[0][1:] if found else None
        return Seen.from_text(row[0]) if row is not None and row[1] == _mark(path, row[0]) else None

    def expect(self, folder: str) -> None:
        """Load what is known of all files below a folder, since most will be asked for."""
        self._expected = os.path.join(folder, "")
        found = self._database.select(
            "SELECT path, seen, mark FROM files WHERE path >= ? AND path < ?", *_below(folder)
        )
        self._rows = {path: (seen, mark) for path, seen, mark in found}

    def _all_below(self, path: str) -> bool:
        return bool(self._expected) and path.startswith(self._expected) and path == _text(path)


def _below(folder: str) -> tuple[str, str]:
    """Between these lie the paths below a folder, in the order of the database."""
    begin = _text(os.path.join(folder, ""))
    return begin, begin[:-1] + chr(ord(os.sep) + 1)


def _text(path: str) -> str:
    # SQLite takes valid Unicode only. Two names may become one here; the marks tell their rows apart.
    if path.isascii():
        return path
    return path.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
