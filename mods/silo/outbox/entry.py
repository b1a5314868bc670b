# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit on its way to Silo: what it is, and the states that it passes.

::

             stage              finish                 file sent, then BOM merged
    commit ────────▶ KEEPING ──────────▶ WAITING ──────────────────────────────────▶ gone
                     │  ▲ a disk error    │  ▲ ▲ a passing failure: it stays,        ▲
                     │  ╰─ stays, tried   │  │ ╰ with its reason and a pause         │
                     │     again          │  │                                       │
                     │ no copy was made   │  │ retry, or send to another address     │
                     ▼                    ▼  │                                       │
                    HELD ◀──────── refused, damaged, or a question ────── discard ───╯

An entry is one row from its first moment to its last; file and BOM of one commit share it. It counts from the
moment that ``stage`` returns. ``key`` names it forever: it is the idempotency key of the file and the
``sync_id`` of the BOM, so that sending twice does no harm. Standard library only.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from uuid import uuid4

from silo.api.pause import Pause
from silo.bom.entry import Extraction
from silo.bom.errors import Translate, duration, english
from silo.checksums import seen_as
from silo.platform import Stamp


class State(StrEnum):
    """How an entry stands; the picture above has the ways between them."""

    KEEPING = "keeping"  # its row is on disk, the copy of its file is not yet
    WAITING = "waiting"  # will be sent
    HELD = "held"  # a person decides: retry, send elsewhere, save a copy, discard


def new_key() -> str:
    """Make a key for a commit."""
    return str(uuid4())


ASKED, SAME_PART = "asked", "same part"

UNKNOWN = "unknown"
"""The origin of a file whose origin is not known."""


@dataclass(frozen=True)
class Said:
    """What stands in the row of a commit as the commit gives it.

    path, label
        the document, and how people call it.
    taken_at
        seconds since 1970, UTC.
    identity, part_number
        the item by its Silo UUID, or by its number where that is known; one of them is needed.
    sha256
        of its file; "" while the copy is being made. Of the document, whose file is committed already, where
        only the BOM goes.
    allow_missing
        sync the BOM although links are broken.
    remark
        why there is no BOM though there might be one; shown when the file has arrived.
    origin
        SHA-256 of the committed file that this one was made from, :data:`UNKNOWN`, or "": nobody asks whether
        a colleague's newer revision is there (a file that has only just got its item).
    on_top_of
        the newest revision that a person saw and sends this one on top of (:func:`on_top`).
    document
        what is in a file that a project sends (:class:`InFile` as JSON); "" for the file of one item.
    renamed
        its file has another name than the item's: :data:`ASKED` whether it is the same part, or a person's
        word that it is :data:`SAME_PART`.
    """

    path: str
    taken_at: float
    label: str = ""
    identity: str = ""
    part_number: str = ""
    key: str = field(default_factory=new_key)
    comment: str = ""
    sha256: str = ""
    allow_missing: bool = False
    remark: str = ""
    origin: str = ""
    on_top_of: str = ""
    document: str = ""
    renamed: str = ""


@dataclass(frozen=True)
class Commit(Said):
    """What is to be sent.

    file
        what to copy: the document, or a second name of it (:meth:`Store.hold`); None where only the BOM goes.
    stamp
        of the document at the commit, where it is copied itself: what is written into it later is no part of
        the commit.
    extraction
        the BOM as it was at the commit; compared with the server's and merged when it is sent.
    request
        instead of that, a merge request as JSON, sent as it is.
    """

    file: Path | None = None
    stamp: Stamp | None = None
    extraction: Extraction | None = None
    request: str = ""


@dataclass(frozen=True)
class InFile:
    """What is in the file of a commit.

    items
        (identity, object) of each item in it, the main part first.
    own
        the commit's identity is the UUID of the document: it holds several items or none. Else its item's.
    user
        the identity of the assembly that needs it: a Silo that knows no documents keeps a file without items
        as an attachment of that.
    """

    items: tuple[tuple[str, str], ...] = ()
    own: bool = False
    user: str = ""

    def to_json(self) -> str:
        """Write it as text, for :attr:`Commit.document`."""
        return json.dumps([[list(item) for item in self.items], self.own, self.user])

    @classmethod
    def of(cls, text: str) -> InFile:
        """Read what :meth:`to_json` wrote; nothing for ""."""
        items, own, user = json.loads(text) if text else ((), False, "")
        return cls(tuple((str(identity), str(name)) for identity, name in items), bool(own), str(user))


@dataclass(frozen=True, kw_only=True)
class Entry(Said):
    """A row of the outbox.

    server
        the server that it is meant for, in :func:`silo.api.address.canonical` form; "" until it is first
        tried.
    file_left, bom_left
        what is still to be sent.
    file_name, copy, size
        of its file.
    base_revision
        the server's latest revision before the first attempt; None before that.
    revision
        the revision that the file became.
    newer
        the colleague's revision that it would undo, for a person to look at: its fields; empty where there is
        none.
    place, links
        where the file is in its project, and JSON of what it links to; "" where nobody could look.
    stamp
        of its file at the commit, as JSON; "" where it was not looked at.
    superseded
        a newer file or BOM of the same item has arrived, so that this one would undo it.
    """

    id: int
    server: str
    state: State
    file_left: bool
    file_name: str
    copy: str
    size: int
    bom_left: bool
    reason: str
    base_revision: int | None
    revision: int | None
    newer: Mapping[str, Any]
    place: str
    links: str
    stamp: str
    superseded: bool

    @property
    def item(self) -> str:
        """Return the key of the item by which entries are ordered: those of one item go one after another."""
        return (self.identity or self.part_number).casefold()

    @property
    def keys(self) -> set[str]:
        """Return all names of the entry's item, case-folded."""
        return {self.item, self.part_number.casefold()} - {""}

    @property
    def has_file(self) -> bool:
        """Return True if a file belongs to the commit, sent or not."""
        return bool(self.copy)

    def is_away(self, here: str) -> bool:
        """Return True if the entry is meant for another server than the one in use; ``here`` may be ""."""
        return bool(here) and self.server not in ("", here)


VERSION = 8
TABLES = """
CREATE TABLE entry (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    key TEXT NOT NULL UNIQUE,
    server TEXT NOT NULL DEFAULT '',
    state TEXT NOT NULL CHECK (state IN ('keeping', 'waiting', 'held')),
    path TEXT NOT NULL,
    label TEXT NOT NULL DEFAULT '',
    identity TEXT NOT NULL DEFAULT '',
    part_number TEXT NOT NULL DEFAULT '',
    taken_at REAL NOT NULL,
    comment TEXT NOT NULL DEFAULT '',
    file_left INTEGER NOT NULL DEFAULT 0,
    file_name TEXT NOT NULL DEFAULT '',
    copy TEXT NOT NULL DEFAULT '',
    sha256 TEXT NOT NULL DEFAULT '',
    size INTEGER NOT NULL DEFAULT 0,
    stamp TEXT NOT NULL DEFAULT '',        -- JSON; of the file at the commit
    bom_left INTEGER NOT NULL DEFAULT 0,
    allow_missing INTEGER NOT NULL DEFAULT 0,
    remark TEXT NOT NULL DEFAULT '',
    reason TEXT NOT NULL DEFAULT '',
    base_revision INTEGER,
    revision INTEGER,
    origin TEXT NOT NULL DEFAULT '',
    on_top_of TEXT NOT NULL DEFAULT '',    -- number and SHA-256
    newer TEXT NOT NULL DEFAULT '',        -- JSON; "" where there is none
    place TEXT NOT NULL DEFAULT '',
    links TEXT NOT NULL DEFAULT '',        -- JSON; "" where nobody looked
    renamed TEXT NOT NULL DEFAULT '',      -- '', 'asked', 'same part'
    document TEXT NOT NULL DEFAULT '',     -- JSON; "" for the file of one item
    extraction TEXT NOT NULL DEFAULT '',   -- JSON; "" where there is none
    request TEXT NOT NULL DEFAULT ''       -- JSON; written before it is sent, and then sent again unchanged
);
CREATE TABLE sent (
    server TEXT NOT NULL,
    item TEXT NOT NULL COLLATE NOCASE,     -- a part number or an identity
    kind TEXT NOT NULL CHECK (kind IN ('file', 'bom')),
    entry_id INTEGER NOT NULL,             -- the newest entry that arrived
    PRIMARY KEY (server, item, kind)
);
CREATE TABLE pause (
    server TEXT NOT NULL,
    item TEXT NOT NULL DEFAULT '',         -- '': of the whole server
    until REAL NOT NULL,
    reason TEXT NOT NULL,
    code TEXT NOT NULL,
    failures INTEGER NOT NULL,
    told INTEGER NOT NULL,
    PRIMARY KEY (server, item)
);
CREATE TABLE derived (
    sha256 TEXT PRIMARY KEY,               -- a file that was saved, and not committed
    origin TEXT NOT NULL,                  -- the committed file that it was made from
    at REAL NOT NULL
);
CREATE TABLE known (
    server TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    item TEXT NOT NULL COLLATE NOCASE,     -- its identity
    revision INTEGER NOT NULL,
    PRIMARY KEY (server, sha256, item)
);
"""

# All columns but those that may be large.
_COLUMNS = ", ".join(field.name for field in fields(Entry) if field.name != "superseded")
SELECT = f"""SELECT {_COLUMNS}, EXISTS (
    SELECT 1 FROM sent s WHERE s.server = e.server AND s.item IN (e.identity, e.part_number) AND s.item <> ''
    AND s.entry_id > e.id AND (s.kind = 'file' AND e.file_left OR s.kind = 'bom' AND e.bom_left)
) AS superseded FROM entry e"""  # noqa: S608

_FLAGS = ("file_left", "bom_left", "allow_missing", "superseded")


def entry_of(row: sqlite3.Row) -> Entry:
    """Make an entry from a row of :data:`SELECT`."""
    values = dict(row)
    values["state"] = State(values["state"])
    values["newer"] = json.loads(values["newer"]) if values["newer"] else {}
    return Entry(**values | {name: bool(values[name]) for name in _FLAGS})


def on_top(comment: str, newer: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a commit that a person sends on top of a newer revision that they saw."""
    number = newer["revision_number"]
    if not newer.get("set_back"):  # a server that was set back has nothing of a colleague
        who = f" by {newer['created_by']}" if newer.get("created_by") else ""
        comment = f"{comment} (on top of revision {number}{who}, which is not in it)".strip()
    return {"on_top_of": seen_as(number, newer.get("file_checksum")), "comment": comment}


@dataclass(frozen=True)
class Words:
    """How an entry stands, in words: its state, and why. ``urgent``: a person decides."""

    state: str
    reason: str
    urgent: bool


def words(entry: Entry, here: str, *, is_paused: bool, translate: Translate = english) -> Words:
    """Say in words how an entry stands, for the pane and the command line. ``here``: the address in use, ""
    for none.
    """
    reason, urgent = entry.reason, entry.state is State.HELD or entry.is_away(here)
    if entry.is_away(here):
        meant = translate("Silo", "It is meant for {there}, which is not the server in use.")
        reason = "\n".join(filter(None, (meant.replace("{there}", host_of(entry.server)), reason)))
        state = translate("Silo", "for another server")
    elif entry.superseded:
        state = translate("Silo", "out of date")
        reason = translate("Silo", "A newer commit of it has arrived since; this one would undo it.")
    elif entry.state is State.HELD:
        state = translate("Silo", "held for your choice")
    elif entry.state is State.KEEPING:
        state = translate("Silo", "being copied")
        reason = reason or translate("Silo", "Its file is being copied.")
    elif is_paused:
        state = translate("Silo", "paused")
    else:
        state = translate("Silo", "tried again later") if reason else translate("Silo", "waiting")
    return Words(state, reason, urgent)


def parts(entry: Entry, translate: Translate = english) -> str:
    """Say which part of an entry is not in Silo yet."""
    if entry.file_left and entry.bom_left:
        return translate("Silo", "file and BOM")
    return translate("Silo", "BOM") if entry.bom_left else translate("Silo", "file")


def pause_text(pause: Pause, server: str, now: float, translate: Translate = english) -> str:
    """Say why nothing is sent to a server now, and until when."""
    text = translate("Silo", "Nothing is sent to {host} before you retry: {reason}")
    if not math.isinf(left := pause.left(now)):
        text = translate("Silo", "Nothing is sent to {host} for {time}: {reason}")
    for name, value in (("host", host_of(server)), ("time", duration(left)), ("reason", pause.reason)):
        text = text.replace(f"{{{name}}}", value)
    return text


def host_of(address: str) -> str:
    """Return the host of an address, for people."""
    return urlsplit(address).netloc or address
