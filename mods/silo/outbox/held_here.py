# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM that could not be sent although its file was: this computer remembers it until it goes out.

It is no commit: nothing of it is kept for sending, for the file on disk is what goes. Standard library only.
"""

from __future__ import annotations

import json
import sqlite3
from dataclasses import dataclass

from silo.bom.message import from_json, message


@dataclass(frozen=True)
class HeldHere:
    """A BOM that is held.

    server, identity
        of its assembly: the server's canonical address, and the item's UUID.
    path, label
        its file, and its name for users.
    why
        what holds it: a message.
    since
        seconds since 1970, UTC.
    """

    server: str
    identity: str
    part_number: str
    path: str
    label: str
    why: str
    since: float

    @property
    def sentence(self) -> str:
        """Say that it is held, and why."""
        name = self.part_number or self.label
        return message("The BOM of {number} is held here: {why}", number=name, why=self.why)


def held_row(row: sqlite3.Row) -> HeldHere:
    """Read a row; a message keeps its template."""
    values = dict(row)
    return HeldHere(**values | {"why": from_json(_json(values["why"])) or values["why"]})


def _json(text: str) -> object:
    try:
        return json.loads(text)
    except ValueError:
        return text
