# SPDX-License-Identifier: LGPL-2.1-or-later
"""What differs between an open document and its file, by content: a recompute is not an edit.

FreeCAD marks a document as modified for anything that is assigned, also where the new value is the old one: a
recompute of a project marks all its files. Here the value that a property had in the file is remembered when
it is first changed, and compared when somebody asks. Where anything is in doubt, it is an edit.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from typing import Any

from silo.bom.message import message

# Two points are the same if they are within FreeCAD's own tolerance, relative to the shape.
SAME = 1e-7

_ABSENT = object()

# FreeCAD writes these by itself.
_OWN = frozenset(("LastModifiedDate", "LastModifiedBy", "_LinkTouched", "_ChildCache", "TipName"))

# Shown in the property editor, and not written into the file (:mod:`silo.workbench.freecad.silo_group`).
SHOWN_NUMBER, SHOWN_STATE = "SiloNumber", "SiloState"

_SHOWN = (SHOWN_NUMBER, SHOWN_STATE)

# Their values are the live thing itself, which is the same before and after.
_ALIVE = ("Spreadsheet::PropertySheet", "Mesh::PropertyMeshKernel", "Points::PropertyPointKernel")


class _Edits:
    """Of one document since it was opened or saved. ``before``: (object, property) → the file's value."""

    def __init__(self) -> None:
        self.before: dict[tuple[str, str], Any] = {}
        self.made: set[str] = set()
        self.gone: set[str] = set()


class EditWatch:
    """A document observer, there from FreeCAD's start. An exception in it would only be printed."""

    def __init__(self) -> None:
        self._docs: dict[str, _Edits] = {}

    def begin(self, unmodified: list[Any]) -> None:
        """Begin with the open documents; their earlier edits stay unknown."""
        for doc in unmodified:
            self._docs.setdefault(doc.Name, _Edits())

    # -- FreeCAD calls these ----------------------------------------------------------------------------

    def slotCreatedDocument(self, doc: Any) -> None:
        """Watch a new document, or one that is being opened."""
        self._docs[doc.Name] = _Edits()

    def slotDeletedDocument(self, doc: Any) -> None:
        """Forget the document; FreeCAD may reuse its name."""
        self._docs.pop(doc.Name, None)

    def slotFinishSaveDocument(self, doc: Any, filename: str) -> None:
        """Note that the file now has all edits; "Save a copy" writes another file."""
        if doc.Name in self._docs and os.path.realpath(filename) == os.path.realpath(doc.FileName):
            self._docs[doc.Name] = _Edits()

    def slotBeforeChangeObject(self, obj: Any, name: str) -> None:
        """Note the present value of a property that is about to change."""
        # An object that is being deleted has no name any more.
        if name not in _OWN and obj.Name:
            self._remember(obj.Document, obj.Name, name, obj)

    def slotBeforeChangeDocument(self, doc: Any, name: str) -> None:
        """Note the present value of a property of the document itself."""
        if name not in _OWN:
            self._remember(doc, "", name, doc)

    def slotAppendDynamicProperty(self, owner: Any, name: str) -> None:
        """Note that an object or the document has a property that the file lacks. A view's document has no
        name.
        """
        doc = getattr(owner, "Document", owner)
        edits = self._docs.get(getattr(doc, "Name", ""))
        if edits is not None and not doc.Restoring and name not in _SHOWN:
            edits.before.setdefault((owner.Name if doc is not owner else "", name), _ABSENT)

    def slotRemoveDynamicProperty(self, owner: Any, name: str) -> None:
        """Note a removed property that the file has, unless it was added since."""
        doc = getattr(owner, "Document", owner)
        if hasattr(doc, "Name"):
            self._remember(doc, owner.Name if doc is not owner else "", name, owner)

    def slotCreatedObject(self, obj: Any) -> None:
        """Note a new object; an array makes its elements again."""
        edits = self._docs.get(obj.Document.Name)
        if edits is None or obj.Document.Restoring:
            return
        if obj.TypeId == "App::LinkElement" and obj.Name in edits.gone:
            edits.gone.discard(obj.Name)
        else:
            edits.made.add(obj.Name)

    def slotDeletedObject(self, obj: Any) -> None:
        """Note a deleted object."""
        edits = self._docs.get(obj.Document.Name)
        if edits is None:
            return
        if obj.Name in edits.made:
            edits.made.discard(obj.Name)
        else:
            edits.gone.add(obj.Name)

    def _remember(self, doc: Any, obj: str, name: str, owner: Any) -> None:
        edits = self._docs.get(doc.Name)
        if edits is None or (obj, name) in edits.before or name in _SHOWN:
            return
        if doc.Restoring:
            # What came before it is part of opening the file, too: its label.
            edits.before.clear()
            return
        edits.before[obj, name] = _value(owner, name)

    # -- the question -----------------------------------------------------------------------------------

    def is_edited(self, doc: Any, until: float | None = None) -> bool:
        """Return True if the document differs from its file.

        until
            the time (``time.thread_time``) after which nothing more is compared.
        """
        return next(self.differences(doc, until), None) is not None

    def differences(self, doc: Any, until: float | None = None) -> Iterator[str]:
        """Yield the differences that were found, such as "Pad.Length"."""
        edits = self._docs.get(doc.Name)
        if edits is None:
            yield message("it had edits before anybody looked")
            return
        yield from edits.made | edits.gone
        for (obj, name), old in edits.before.items():
            if until is not None and time.thread_time() > until:
                yield message("there was no time to compare the rest")
                return
            owner = doc.getObject(obj) if obj else doc
            if owner is not None and _differs(owner, name, old):
                yield f"{obj}.{name}"


def _differs(owner: Any, name: str, old: Any) -> bool:
    if name not in owner.PropertiesList:
        return old is not _ABSENT
    if old is _ABSENT:
        return "Transient" not in owner.getTypeOfProperty(name)
    try:
        return not same(old, _value(owner, name)) and "Transient" not in owner.getTypeOfProperty(name)
    except Exception:  # noqa: BLE001  # whatever FreeCAD's values raise: what cannot be compared is an edit
        return True


def _value(owner: Any, name: str) -> Any:
    # By name: a value that is handed out as an attribute counts as changed whenever it is used.
    try:
        if owner.getTypeIdOfProperty(name) in _ALIVE:
            return bytes(owner.dumpPropertyContent(name))
        return owner.getPropertyByName(name)
    except Exception:  # noqa: BLE001  # a property that cannot be read now; see `same`
        return _ABSENT


def same(old: Any, new: Any) -> bool:
    """Return True if two values of a property are the same in a file."""
    if old is new:
        return old is not _ABSENT
    if type(old) is not type(new):
        return False
    if isinstance(old, (list, tuple)):
        return len(old) == len(new) and all(map(same, old, new))
    if isinstance(old, float) and isinstance(new, float):
        return abs(old - new) <= SAME * max(1.0, abs(old))
    if hasattr(old, "countElement"):
        return _same_shape(old, new)
    if hasattr(old, "Content") and not hasattr(old, "InList"):
        # Geometry and constraints of a sketch; an object has one too, but a link to another is an edit.
        return bool(old.Content == new.Content)
    if hasattr(old, "Rotation") and hasattr(old, "isSame"):
        return bool(old.isSame(new, SAME))
    if hasattr(old, "distanceToPoint"):
        return bool(old.distanceToPoint(new) <= SAME * max(1.0, old.Length))
    if hasattr(old, "PhysicalProperties"):
        return bool(old.UUID == new.UUID and old.PhysicalProperties == new.PhysicalProperties)
    return bool(old == new)


def _same_shape(old: Any, new: Any) -> bool:
    """Return True if two shapes are at the same place and have the same corners; a recompute makes all shapes
    again.
    """
    if old.isNull() or new.isNull():
        return bool(old.isNull() and new.isNull())
    if old.isSame(new):
        return True
    if old.ShapeType != new.ShapeType:
        return False
    for kind in ("Face", "Edge", "Vertex"):
        if old.countElement(kind) != new.countElement(kind):
            return False
    box, other = old.BoundBox, new.BoundBox
    near = SAME * max(1.0, box.DiagonalLength)
    sides = ("XMin", "XMax", "YMin", "YMax", "ZMin", "ZMax")
    # The box of a curved shape depends on whether it was drawn before, by about the fineness of the drawing.
    far = 0.02 * max(1.0, box.DiagonalLength)
    if any(abs(getattr(box, side) - getattr(other, side)) > far for side in sides):
        return False
    pairs = zip(old.Vertexes, new.Vertexes, strict=True)
    return all(shape.Point.distanceToPoint(two.Point) <= near for shape, two in pairs)
