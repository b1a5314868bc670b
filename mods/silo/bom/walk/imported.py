# SPDX-License-Identifier: LGPL-2.1-or-later
"""What A2plus imports: a copy of a shape, the file that it came from, and which part of the file it is.

A file may hold several parts; ``sourcePart`` then has the label of the one that was imported. Without it the
whole file was imported. A sketch is imported to place others by it, and is no part.
"""

from __future__ import annotations

from typing import Any

from silo.bom.walk.document import derived, label_of, own


def is_sketch(imported: Any) -> bool:
    """Return True if A2plus imported a sketch."""
    return bool(own(imported, "objectType") == "a2pSketch")


def source_of(imported: Any) -> tuple[str, str]:
    """Return the file that an object was imported from, and the label of the part in it; "" for none."""
    file, part = own(imported, "sourceFile"), own(imported, "sourcePart")
    is_file = isinstance(file, str) and file.lower().endswith(".fcstd")
    return file.replace("\\", "/") if is_file else "", part if isinstance(part, str) else ""


def named_part(document: Any, label: str) -> Any:
    """Return the object with a label, of a feature its Body; None if the file has none or several."""
    found = [obj for obj in document.Objects if label_of(obj) == label] if label else []
    if len(found) != 1:
        return None
    bodies = (obj for obj in document.Objects if derived(obj, "PartDesign::Body"))
    return next((body for body in bodies if found[0] in (own(body, "Group") or ())), found[0])
