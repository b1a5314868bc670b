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
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any
from uuid import uuid4

from silo.bom.entry import Extraction
from silo.bom.message import message
from silo.checksums import seen_as
from silo.platform.stamp import Stamp


class State(StrEnum):
    """How an entry stands; the picture above has the ways between them."""

    KEEPING = "keeping"  # its row is on disk, the copy of its file is not yet
    WAITING = "waiting"  # will be sent
    HELD = "held"  # the user decides: retry, send elsewhere, save a copy, discard


def new_key() -> str:
    """Make a key for a commit."""
    return str(uuid4())


ASKED, SAME_PART = "asked", message("same part")

UNKNOWN = "unknown"
"""The origin of a file before anybody has looked."""


@dataclass(frozen=True)
class CommitFields:
    """What stands in the row of a commit as the commit gives it.

    path, label
        the document, and its name for users.
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
        the contents that the file was made from, by their SHA-256, the nearest first, with blanks between
        them (:meth:`silo.outbox.store.Store.origins`); :data:`UNKNOWN`, or "": a newer revision of
        a colleague is not looked for (a file that has only just got its item).
    on_top_of
        the newest revision that the user saw and sends this one on top of (:func:`on_top`).
    document
        what is in a file that a project sends (:class:`InFile` as JSON); "" for the file of one item.
    renamed
        its file has another name than the item's: :data:`ASKED` whether it is the same part, or the user's
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
class Commit(CommitFields):
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
class Entry(CommitFields):
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
        the colleague's revision that it would undo, for the user to look at: its fields; empty where there is
        none.
    place, links
        where the file is in its project, and JSON of what it links to; "" where it could not be read.
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


def on_top(comment: str, newer: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a commit that is sent on top of a newer revision that the user saw."""
    number = newer["revision_number"]
    if not newer.get("set_back"):  # a server that was set back has nothing of a colleague
        who = message(" by {newer}", newer=newer["created_by"]) if newer.get("created_by") else ""
        comment = f"{comment} (on top of revision {number}{who}, which is not in it)".strip()
    return {"on_top_of": seen_as(number, newer.get("file_checksum")), "comment": comment}
