# SPDX-License-Identifier: LGPL-2.1-or-later
"""How much an FCStd file may ask of us.

Everything is counted on what was really read, not on what the file claims.
"""

from __future__ import annotations

from dataclasses import dataclass

_MB = 1024 * 1024


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds for hostile or broken input; a file beyond one of them is refused with a plain sentence.

    document_xml
        bytes of an unpacked ``Document.xml``. FreeCAD writes some 5 kB per link; this is room for 50 000.
    packed
        bytes of it in the file.
    ratio, ratio_from
        unpacked : packed, looked at once ``ratio_from`` bytes are unpacked. Deflate reaches 1032; the most
        regular assembly (1000 equal links, written by FreeCAD 0.20) has 44.
    entries
        files in the container; FreeCAD writes some per object.
    objects
        objects in one document.
    depth
        nesting of XML elements; FreeCAD's own are less than 12 deep.
    side_entry
        bytes of another unpacked entry (the scales of a link array).
    documents
        files opened in one session.
    resident
        bytes of unpacked XML kept in memory by one session; beyond it the files that were not used for
        longest are unpacked again when needed. One text that is longer than this does not count.
    """

    document_xml: int = 256 * _MB
    packed: int = 64 * _MB
    ratio: int = 300
    ratio_from: int = 4 * _MB
    entries: int = 65_535
    objects: int = 1_000_000
    depth: int = 64
    side_entry: int = 32 * _MB
    documents: int = 20_000
    resident: int = 48 * _MB


# For a file that FreeCAD has opened: whatever its size, FreeCAD had the memory for it.
ANY_SIZE = Limits(1 << 32, 1 << 32, 2000, entries=1 << 30, objects=1 << 30, side_entry=1 << 32)
