# SPDX-License-Identifier: LGPL-2.1-or-later
"""``--via freecad``: let FreeCAD itself open the files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from silo.bom.errors import SiloError
from silo.bom.model import Extraction
from silo.freecad_run import run_freecad


def extract_with_freecad(
    tops: Sequence[str], assembly: str | None = None
) -> Iterator[tuple[str, Extraction | SiloError]]:
    """The BOM of each file, or why there is none; in order, as FreeCAD finishes them."""
    return run_freecad(tops, assembly)
