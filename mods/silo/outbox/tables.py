# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tables of the outbox, and an entry from its row. Standard library only."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import fields

from silo.outbox.entry import Entry, State

VERSION = 9

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
    links TEXT NOT NULL DEFAULT '',        -- JSON; "" where it was not read
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
    sha256 TEXT PRIMARY KEY,               -- a file that FreeCAD saved
    origin TEXT NOT NULL,                  -- what FreeCAD had read or written before
    at REAL NOT NULL
);
CREATE TABLE held_bom (
    server TEXT NOT NULL,
    identity TEXT NOT NULL COLLATE NOCASE, -- of the assembly
    part_number TEXT NOT NULL,
    path TEXT NOT NULL,
    label TEXT NOT NULL,
    why TEXT NOT NULL,                     -- JSON of a message
    since REAL NOT NULL,
    PRIMARY KEY (server, identity)
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
