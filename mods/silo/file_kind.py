# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a file is: a model that FreeCAD opens, or an attachment of a kind.

* The content decides whether a file is a model; a name is believed only where no content is at hand.
* A PDF is the drawing of a part, whose data sheet or certificate it is a user says.
* A huge file costs as much memory as a small one.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import IO

from silo.bom.message import message

MODEL = "model"
ATTACHMENT_KINDS = ("drawing", "step", "data_sheet", "picture", "certificate", "other")
"""Kinds of what lies beside a model, in the order in which they are shown."""

KIND_WORDS = {kind: kind.replace("_", " ") for kind in ATTACHMENT_KINDS} | {"step": message("STEP file")}

_MODEL_NAMES = (".fcstd", ".kc")
_BY_NAME = {
    ".pdf": "drawing", ".dxf": "drawing", ".dwg": "drawing",
    ".step": "step", ".stp": "step", ".stpz": "step", ".p21": "step",
    ".png": "picture", ".jpg": "picture", ".jpeg": "picture", ".gif": "picture", ".webp": "picture",
    ".bmp": "picture", ".tif": "picture", ".tiff": "picture", ".svg": "picture",
}  # fmt: skip
_BY_START = (
    (re.compile(rb"%PDF-"), "drawing"),
    (re.compile(rb"AC10\d\d"), "drawing"),
    (re.compile(rb"AutoCAD Binary DXF"), "drawing"),
    (re.compile(rb"\A(?: {0,3}999\r?\n[^\n]*\n)* {0,3}0\r?\nSECTION\r?\n"), "drawing"),
    (re.compile(rb"\A\s*+ISO-10303-21\s*;"), "step"),
    (re.compile(rb"\x89PNG\r\n\x1a\n|\xff\xd8\xff|GIF8[79]a|II\*\0|MM\0\*"), "picture"),
    (re.compile(rb"BM.{4}\0\0\0\0|RIFF.{4}WEBP", re.DOTALL), "picture"),
    (re.compile(rb"\A\s*+<(?:svg[\s>]|.*<svg[\s>])", re.DOTALL), "picture"),
)
_HEAD = 4096
_DOCUMENT = b"Document.xml"
# An entry of a zip's directory with this name; its last four bytes before the name place the entry.
_LISTED = re.compile(rb"PK\x01\x02.{24}\x0c\x00.{12}(.{4})Document\.xml", re.DOTALL)
_LISTED_SIZE = 46 + len(_DOCUMENT)
_WINDOW = 1 << 20


def kind_of(path: Path | str, name: str = "") -> str:
    """Return ``model`` or one of :data:`ATTACHMENT_KINDS`; ``name`` helps where the content does not.

    Raises OSError.
    """
    with open(path, "rb") as file:
        if _is_model(file):
            return MODEL
        file.seek(0)
        head = file.read(_HEAD)
    for start, kind in _BY_START:
        if start.match(head):
            return kind
    named = kind_by_name(name)
    return named if named in ATTACHMENT_KINDS else "other"


def is_model(path: Path | str) -> bool:
    """Report whether the content is a FreeCAD document, as FCStd and ``.kc`` are. Raises OSError."""
    with open(path, "rb") as file:
        return _is_model(file)


def kind_by_name(name: str) -> str:
    """Return the kind that the end of a name promises; "" if it promises none."""
    end = PurePosixPath(name.replace("\\", "/")).suffix.lower()
    return MODEL if end in _MODEL_NAMES else _BY_NAME.get(end, "")


def _is_model(file: IO[bytes]) -> bool:
    return any(_is_document(file, place) for place in _places(file))


def _places(file: IO[bytes]) -> Iterator[int]:
    """Yield where an entry ``Document.xml`` of a zip may begin: at the start, as FreeCAD writes it, or where
    the directory at the end says."""
    if file.read(4) != b"PK\x03\x04":
        return
    yield 0
    size = file.seek(0, 2)
    file.seek(max(0, size - 22 - 0xFFFF))
    tail = file.read()
    end = tail.rfind(b"PK\x05\x06")
    if end < 0 or len(tail) - end < 22:
        return
    begin = int.from_bytes(tail[end + 16 : end + 20], "little")
    # A zip of more than 4 GiB says the place elsewhere: all of it is searched.
    place = begin if begin < size else 0
    rest = b""
    file.seek(place)
    while window := file.read(_WINDOW):
        place = file.tell()
        for found in _LISTED.finditer(rest + window):
            yield int.from_bytes(found[1], "little")
        rest = (rest + window)[-_LISTED_SIZE + 1 :]
        file.seek(place)


def _is_document(file: IO[bytes], place: int) -> bool:
    """Report whether the entry of a zip that begins here is a ``Document.xml`` of FreeCAD."""
    file.seek(place)
    head = file.read(30)
    if len(head) < 30 or head[:4] != b"PK\x03\x04":
        return False
    names, more = (int.from_bytes(head[at : at + 2], "little") for at in (26, 28))
    if file.read(names) != _DOCUMENT:
        return False
    file.read(more)
    begin = file.read(_HEAD)
    if int.from_bytes(head[8:10], "little") == 8:
        try:
            begin = zlib.decompressobj(-15).decompress(begin, _HEAD)
        except zlib.error:
            return False
    return re.search(rb"<Document[\s/>]", begin) is not None
