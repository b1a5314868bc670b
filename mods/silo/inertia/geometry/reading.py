# SPDX-License-Identifier: LGPL-2.1-or-later
"""The result of a reader: an assembly, and the files on which it depends."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from silo.inertia.assembly import Assembly


@dataclass(frozen=True, eq=False)
class GeometryReading:
    """What a reader found, and what it depended on besides the file's own bytes.

    others
        files that were read as well (split assemblies, linked documents).
    missing
        product names for which no file was found.
    absent
        files that were named and are not there.
    kept
        what the process that read may keep until it ends: freeing it takes long.
    """

    assembly: Assembly
    others: tuple[Path, ...] = ()
    missing: tuple[str, ...] = ()
    absent: tuple[Path, ...] = ()
    kept: object = None
