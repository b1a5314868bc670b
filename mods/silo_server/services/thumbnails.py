# SPDX-License-Identifier: LGPL-2.1-or-later
"""The picture in an untrusted FCStd file, and the size of a PNG.

Nothing is read that could fill the memory: neither a huge picture nor a huge directory of the zip.
"""

from __future__ import annotations

import lzma
import os
import struct
import zipfile
import zlib
from pathlib import Path

THUMBNAIL = "thumbnails/Thumbnail.png"

MAX_THUMBNAIL = 1024 * 1024

# A zip's directory is read whole, and takes eight times its size in memory. FreeCAD writes some 100 bytes for
# each object.
MAX_DIRECTORY = 4 * 1024 * 1024

END_MARK = b"PK\x05\x06"

END_SIZE = 22

PNG = b"\x89PNG\r\n\x1a\n"

PNG_HEAD, PNG_END = b"\0\0\0\rIHDR", b"\0\0\0\0IEND\xaeB`\x82"

# Width and height in a PNG. Without a 3D view FreeCAD saves its icon, smaller than any picture that it takes.
ICON = (64).to_bytes(4) * 2


def read_thumbnail(path: Path) -> bytes | None:
    """Read the picture in an untrusted FCStd file; None if there is none, or only FreeCAD's icon."""
    try:
        if _directory_size(path) > MAX_DIRECTORY:
            return None
        with zipfile.ZipFile(path) as archive, archive.open(THUMBNAIL) as entry:
            data = entry.read(MAX_THUMBNAIL + 1)
    except (
        zipfile.BadZipFile,
        KeyError,
        OSError,
        RuntimeError,
        EOFError,
        zlib.error,
        lzma.LZMAError,
        ValueError,
    ):
        return None
    return data if data.startswith(PNG) and data[16:24] != ICON and len(data) <= MAX_THUMBNAIL else None


def png_size(picture: bytes) -> tuple[int, int] | None:
    """Read width and height of a PNG [pixels]; None if it is no PNG, or its parts do not fill it."""
    if not picture.startswith(PNG + PNG_HEAD) or not picture.endswith(PNG_END):
        return None
    place = len(PNG)
    while place < len(picture) - len(PNG_END):
        place += 12 + struct.unpack_from(">I", picture, place)[0]
    width, height = struct.unpack_from(">II", picture, 16)
    return (width, height) if place == len(picture) - len(PNG_END) and width and height else None


def _directory_size(path: Path) -> int:
    """Read the size of a zip's directory [bytes]; a huge number for ZIP64, 0 if this is no zip."""
    with path.open("rb") as source:
        length = source.seek(0, os.SEEK_END)
        source.seek(max(0, length - END_SIZE - 0xFFFF))
        tail = source.read()
    place = tail.rfind(END_MARK)
    if place < 0 or len(tail) - place < END_SIZE:
        return 0
    size: int = struct.unpack_from("<I", tail, place + 12)[0]
    return size
