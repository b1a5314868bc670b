# SPDX-License-Identifier: LGPL-2.1-or-later
"""Part number and state of the selected components in FreeCAD's property editor, as the group "Silo".

The properties are shown only: they are read only, are not written into the file, touch nothing and mark no
document. FreeCAD measures the whole assembly for its axis cross after each change of a member, so an object
gets them when it is selected, which is when the property editor shows it. GUI thread.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from silo.workbench.freecad import host
from silo.workbench.freecad.edits import SHOWN_NUMBER, SHOWN_STATE
from silo.workbench.freecad.modified import others_unmarked
from silo.workbench.gui import qt
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.bom.entry import BomEntry


# For more objects, the property editor shows only what they have in common.
MOST = 20

# FreeCAD's numbers for "asks for no recompute" and "not written into the file" (App::PropertyType).
_OUTPUT, _NO_PERSIST = 8, 32


class SiloGroup:
    """A selection observer. It keeps part number and state of each component: document → its file, and
    object → both. A click costs no look at the disk, which may be a slow network's."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[str, dict[str, tuple[str, str]]]] = {}
        self._is_due = False
        host.add_selection_observer(self)

    def know(self, path: str, entries: Iterable[BomEntry]) -> None:
        """Take over what Silo knows of the components of a document, if it is open."""
        doc = host.find_document(path)
        if doc is None:
            return
        open_now = {document.Name for document in host.documents()}
        self._known = {name: states for name, states in self._known.items() if name in open_now}
        in_silo = translate("Silo", "in Silo")
        left_out = translate("Silo", "not registered: left out of the BOM")
        components = {
            name: (entry.part_number or "", in_silo if entry.part_number else left_out)
            for entry in entries
            for name in entry.instances
        }
        self._known[doc.Name] = str(doc.FileName), components
        self.addSelection()

    # FreeCAD calls these once for each object; the selection is then looked at once.

    def addSelection(self, *_what: Any) -> None:
        """Note that something else is selected."""
        if not self._is_due:
            self._is_due = True
            qt.later(0, self._show)

    setSelection = addSelection

    def _show(self) -> None:
        self._is_due = False
        wanted = []
        for doc, name in host.selected():
            file, components = self._known.get(doc.Name, ("", {}))
            if name in components and doc.FileName == file:  # another document may have its name by now
                wanted.append((doc.getObject(name), components[name]))
        outdated = [
            (obj, texts) for obj, texts in wanted[:MOST] if obj is not None and not _is_shown(obj, *texts)
        ]
        if outdated:
            with others_unmarked():
                for obj, (number, state) in outdated:
                    _put(obj, SHOWN_NUMBER, number, translate("Silo", "Part number in Silo"))
                    _put(obj, SHOWN_STATE, state, translate("Silo", "Silo's data of this component"))


def _is_shown(obj: Any, number: str, state: str) -> bool:
    # A link without them would answer with those of its part.
    if SHOWN_STATE not in obj.PropertiesList:
        return False
    return (number, state) == (obj.getPropertyByName(SHOWN_NUMBER), obj.getPropertyByName(SHOWN_STATE))


def _put(obj: Any, name: str, value: str, tip: str) -> None:
    if name not in obj.PropertiesList:
        obj.addProperty("App::PropertyString", name, "Silo", tip, _OUTPUT | _NO_PERSIST, True)
    if obj.getPropertyByName(name) == value:
        return
    obj.setPropertyStatus(name, "NoModify")
    setattr(obj, name, value)
