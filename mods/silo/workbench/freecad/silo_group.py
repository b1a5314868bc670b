# SPDX-License-Identifier: LGPL-2.1-or-later
"""Part number and state of each component in FreeCAD's property editor, as the group "Silo".

The properties are shown only: they are read only, are not written into the file, touch nothing and mark no
document. GUI thread.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable
from itertools import islice
from typing import TYPE_CHECKING, Any

from silo.workbench.freecad import host, saving
from silo.workbench.freecad.edits import SHOWN_NUMBER, SHOWN_STATE
from silo.workbench.gui import qt
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.bom.model import BomEntry

# Nobody looks at more of them. Each turn takes so many seconds of the window's time, and then pauses.
MOST, MOST_S, PAUSE_MS = 500, 0.005, 40
# FreeCAD's numbers for "asks for no recompute" and "not written into the file" (App::PropertyType).
_OUTPUT, _NO_PERSIST = 8, 32


# Path of a document → what is still to be shown in it.
_todo: dict[str, deque[tuple[str, str, str]]] = {}


def show(path: str, entries: Iterable[BomEntry]) -> None:
    """Show the number and the state of the components of a document, where it is open; some in each turn."""
    in_silo = translate("Silo", "in Silo")
    left_out = translate("Silo", "not registered: left out of the BOM")
    wanted = (
        (name, entry.part_number or "", in_silo if entry.part_number else left_out)
        for entry in entries
        for name in entry.instances
    )
    is_under_way = path in _todo
    _todo[path] = deque(islice(wanted, MOST))
    if not is_under_way:
        _turn(path)


def _turn(path: str) -> None:
    doc, todo = host.find_document(path), _todo[path]
    while doc is not None and todo and _is_shown(doc, *todo[0]):
        todo.popleft()
    if doc is None or not todo:
        del _todo[path]
        return
    # Each change makes FreeCAD measure the whole assembly for its axis cross: 1000 links take 2 s.
    until = time.thread_time() + MOST_S
    with saving.others_unmarked():
        while todo and time.thread_time() < until:
            name, number, state = todo.popleft()
            obj = doc.getObject(name)
            if obj is not None:
                _put(obj, SHOWN_NUMBER, number, translate("Silo", "Part number in Silo"))
                _put(obj, SHOWN_STATE, state, translate("Silo", "What Silo knows of this component"))
    qt.later(PAUSE_MS, lambda: _turn(path))


def _is_shown(doc: Any, name: str, number: str, state: str) -> bool:
    obj = doc.getObject(name)
    if obj is None:
        return True
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
