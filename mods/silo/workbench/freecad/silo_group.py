# SPDX-License-Identifier: LGPL-2.1-or-later
"""Part number and state of each component in FreeCAD's property editor, as the group "Silo".

The properties are shown only: they are read only, are not written into the file, touch nothing and mark no
document. GUI thread.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from silo.workbench.freecad import host, saving
from silo.workbench.freecad.edits import SHOWN_NUMBER, SHOWN_STATE
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.bom.model import BomEntry

# Nobody looks at more of them, and each takes some microseconds.
MOST = 2000
# FreeCAD's numbers for "asks for no recompute" and "not written into the file" (App::PropertyType).
_OUTPUT, _NO_PERSIST = 8, 32


def show(path: str, entries: Iterable[BomEntry]) -> None:
    """Show the number and the state of the components of a document, where it is open."""
    doc = host.find_document(path)
    if doc is None:
        return
    with saving.others_unmarked():
        _show(doc, entries)


def _show(doc: Any, entries: Iterable[BomEntry]) -> None:
    left = MOST
    for entry in entries:
        state = (
            translate("Silo", "in Silo")
            if entry.part_number
            else translate("Silo", "not registered: left out of the BOM")
        )
        for name in entry.instances[:left]:
            obj = doc.getObject(name)
            if obj is not None:
                _put(obj, SHOWN_NUMBER, entry.part_number or "", translate("Silo", "Part number in Silo"))
                _put(obj, SHOWN_STATE, state, translate("Silo", "What Silo knows of this component"))
        left = max(0, left - len(entry.instances))


def _put(obj: Any, name: str, value: str, tip: str) -> None:
    if name not in obj.PropertiesList:
        obj.addProperty("App::PropertyString", name, "Silo", tip, _OUTPUT | _NO_PERSIST, True)
    if obj.getPropertyByName(name) == value:
        return
    obj.setPropertyStatus(name, "NoModify")
    setattr(obj, name, value)
