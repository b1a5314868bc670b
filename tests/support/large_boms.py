# SPDX-License-Identifier: LGPL-2.1-or-later
"""Large BOMs for looking at the pages: written straight into a database, the same each time."""

from __future__ import annotations

import io
import random
import struct
import zipfile
import zlib
from typing import Any

from server_testing import Api

from silo_server.db.database import Database
from silo_server.services.bom.change import ChangeNote, apply_changes, new_line_id
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.items import NewItem, create_item, get_item
from silo_server.settings import Settings
from silo_server.values import LineState

WORDS = ("Hex screw", "Flange", "Bearing", "Shaft", "Bracket", "Spacer", "Gear", "Plate", "Washer", "Seal")
SUPPLIERS = ("Nordic Bearings", "Bolt & Co", "Steel Service", "Drive Systems")


def write_boms(url: str, *, lines: int = 1000, deep: int = 10_000, levels: int = 18) -> tuple[str, str]:
    """Part numbers of a BOM with so many ``lines``, and of a tree with ``deep`` rows on ``levels`` levels."""
    db = Database(Settings(database_url=url))
    try:
        with db.write() as tx:
            dice = random.Random(12)
            parts = [_part(tx, dice, n) for n in range(lines)]
            wide = _assembly(tx, "WIDE-1", f"Machine with {lines} lines")
            _fill(tx, wide, parts, dice)
            # A chain of assemblies, each with its share of the parts and the next one.
            chain = [_assembly(tx, f"DEEP-{level:02}", f"Module of level {level}") for level in range(levels)]
            share = deep // levels - 1
            for level in reversed(range(levels)):
                below = chain[level + 1 : level + 2]
                count = share if level < levels - 1 else deep - (levels - 1) * (share + 1)
                _fill(tx, chain[level], [*below, *dice.sample(parts, count)], dice)
        return wide, chain[0]
    finally:
        db.close()


def upload_pictures(api: Api, count: int) -> None:
    """So many items with a picture each, under the name "Pictured"."""
    for n in range(count):
        number = api.item(f"PIC-{n:03}", name=f"Pictured part {n}")
        body, headers = form_file(f"part{n}.FCStd", fcstd_with_picture(n))
        assert api.call("POST", f"/api/items/{number}/file", body=body, headers=headers).status == 201


def form_file(name: str, content: bytes) -> tuple[bytes, dict[str, str]]:
    """A form with a file."""
    from server_testing import form_body

    return form_body({"file": (name, content)})


def fcstd_with_picture(seed: int) -> bytes:
    """The smallest FCStd file with a thumbnail of 128 × 128, another for each seed."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("Document.xml", "<Document SchemaVersion='4' ProgramVersion='1.0'></Document>")
        archive.writestr("thumbnails/Thumbnail.png", _png(seed))
    return out.getvalue()


def _png(seed: int, size: int = 128) -> bytes:
    dice = random.Random(seed)
    color = bytes(dice.randrange(60, 220) for _ in range(3))
    rows = b"".join(
        b"\0" + b"".join(color if (x // 16 + y // 16) % 2 else b"\xff\xff\xff" for x in range(size))
        for y in range(size)
    )

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )


def _part(tx: Any, dice: random.Random, n: int) -> str:
    word = dice.choice(WORDS)
    properties = {"mass_kg": round(dice.uniform(0.002, 4), 4), "supplier": dice.choice(SUPPLIERS)}
    if n % 7:
        properties |= {"standard_cost": round(dice.uniform(0.05, 90), 2), "currency": "EUR"}
    new = NewItem(
        part_number=f"P-{n:05}", name=f"{word} {dice.randrange(3, 60)} × {n}", properties=properties
    )
    return create_item(tx, new)[0].part_number


def _assembly(tx: Any, number: str, name: str) -> str:
    return create_item(tx, NewItem(part_number=number, name=name, item_type="assembly"))[0].part_number


def _fill(tx: Any, parent: str, children: list[str], dice: random.Random) -> None:
    changes = [
        LineRecord(
            new_line_id(),
            get_item(tx, child).id,
            None,
            LineState(1.0 if child.startswith("DEEP") else float(dice.randrange(1, 9)), "assembly"),
        )
        for child in children
    ]
    note = ChangeNote(kind=ChangeKind.IMPORT, summary="made")
    apply_changes(tx, get_item(tx, parent, lock=True), changes, note)
