# SPDX-License-Identifier: LGPL-2.1-or-later
"""Objects of a newer FreeCAD's file that this FreeCAD could not load, and would destroy by saving."""

from __future__ import annotations

import os
from typing import Any

from silo.bom.message import message
from silo.workbench.freecad import host

# File → its state, and the name, label and type of each object of a type that this FreeCAD does not know.
_UNKNOWN: dict[str, tuple[object, dict[str, tuple[str, str]]]] = {}


def lost_objects(doc: Any) -> list[str]:
    """List the objects of a document's file that this FreeCAD could not load: "LCS (App::Point)".

    FreeCAD drops objects of types that it does not know, and says so only in the report view; saving the
    document then destroys them in the file. Only the version that saved the file is checked first, since
    reading each file takes too long.
    """
    if not doc.FileName or _is_ours(doc.getProgramVersion()):
        return []
    return [
        message("{label} ({kind})", label=label, kind=kind)
        for name, (label, kind) in _of_unknown_types(doc).items()
        if doc.getObject(name) is None
    ]


def refuse_loss(doc: Any) -> None:
    """Raise DocumentError for a document whose saving would destroy objects of a newer FreeCAD."""
    from silo.bom.errors import DocumentError

    if lost := lost_objects(doc):
        text = message("made by a newer FreeCAD; saving it here would destroy {lost}", lost=", ".join(lost))
        raise DocumentError(
            doc.FileName, message("{text}. Open and change it in the newer FreeCAD", text=text)
        )


def _is_ours(program: str) -> bool:
    from silo.bom.walk.document import saved_by  # late: FreeCAD's start waits for this module

    by = saved_by(program)
    return bool(by) and by[:2] <= host.version()


def _of_unknown_types(doc: Any) -> dict[str, tuple[str, str]]:
    from silo.bom.errors import DocumentError
    from silo.fcstd import Library
    from silo.fcstd.container import FileStat
    from silo.fcstd.limits import ANY_SIZE

    path = doc.FileName
    try:
        state = FileStat.of(os.stat(path))
        if (types_unknown := _UNKNOWN.get(path)) is not None and types_unknown[0] == state:
            return types_unknown[1]
        with Library(limits=ANY_SIZE) as library:
            document = library.open(path)
            types = frozenset(() if _is_ours(document.ProgramVersion) else doc.supportedTypes())
            objects = [obj for obj in document.Objects if types and obj.TypeId not in types]
            unknown = {
                obj.Name: (obj.Label, obj.TypeId) for obj in objects if not _is_made_again(obj, objects)
            }
    except (OSError, DocumentError):
        return {}
    _UNKNOWN[path] = state, unknown
    return unknown


def _is_made_again(obj: Any, unknown: list[Any]) -> bool:
    """Return True for the point of an origin to which nothing else refers: FreeCAD 1.1 makes it again if it
    is missing.

    Each origin of 1.1 has such a point, and so each file with a body.
    """
    if obj.TypeId != "App::Point":
        return False
    # A coordinate system that is lost as well is named itself.
    lost = {other.Name for other in unknown}
    others = [obj.Document.getObject(name) for name in obj.Document.mentioning(obj.Name) if name not in lost]
    return all(other.TypeId == "App::Origin" for other in others)
