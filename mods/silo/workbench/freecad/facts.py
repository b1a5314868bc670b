# SPDX-License-Identifier: LGPL-2.1-or-later
"""What differs between an open document and its file, by content: a recompute is not an edit.

FreeCAD marks a document as modified for anything that is assigned, also where the new value is the old one: a
recompute of a project marks all its files. Here the value that a property had in the file is remembered when
it is first changed, and compared when somebody asks. Where anything is in doubt, it is an edit.

The end of a commit that is not ours: a fork's ``Origin_Commit``, or an origin's ``commitDocument``.

Nothing is replaced. A menu, a toolbar or a shortcut runs the command through its QAction, which signals us
afterwards; a macro runs it without one, but then the document is saved, which an observer sees, or the origin
is asked, whose method calls us. All of these only note the document; a moment later its BOM is synced, once.

Live documents through a cache: each fact is asked of FreeCAD once, and what an object lacks costs nothing.

A walk asks some forty attributes of each link. Most are ones that a link has not, and FreeCAD then looks for
them at the link's target and fails with an exception: 1000 links took 0.5 s that way, all of it in the GUI
thread. Here an object's own ``PropertiesList`` is read once and answers for what is not there; so a link's
attributes are never its target's either (facts §1.1). One :class:`FactCache` serves one walk only.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from typing import Any, Protocol

from silo.bom.document import LinkProblem
from silo.bom.findings import FindingCode

# Two points are the same if they are within FreeCAD's own tolerance, relative to the shape.
SAME = 1e-7

_ABSENT = object()
# FreeCAD writes these by itself.
_OWN = frozenset(("LastModifiedDate", "LastModifiedBy", "_LinkTouched", "_ChildCache", "TipName"))
# Shown in the property editor, and not written into the file (:mod:`silo.workbench.freecad.live_desk`).
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
            yield "it had edits before anybody looked"
            return
        yield from edits.made | edits.gone
        for (obj, name), old in edits.before.items():
            if until is not None and time.thread_time() > until:
                yield "there was no time to compare the rest"
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


# Commands of the Kindred workbench that upload a revision (silo-contract §3.3).
FOREIGN = ("Origin_Commit", "Silo_Commit", "Silo_Save")
WAIT_MS = 400


class HookHost(Protocol):
    """What hooking needs of FreeCAD; :mod:`silo.workbench.freecad.host` has it."""

    def command_actions(self, name: str, /) -> list[Any]: ...

    def active_document(self) -> Any: ...

    def documents(self) -> list[Any]: ...

    def origin_of(self, doc: Any, /) -> Any: ...

    def add_document_observer(self, observer: Any, /) -> None: ...


class CommitHook:
    """Notes documents that somebody else commits, and hands each over once.

    ended
        gets a document whose commit has ended.
    has_identity
        True for a document that belongs to Silo: only such a one is synced after a mere save.
    later
        runs a function after some milliseconds.
    """

    def __init__(
        self,
        host: HookHost,
        *,
        ended: Callable[[Any], None],
        has_identity: Callable[[Any], bool],
        later: Callable[[int, Callable[[], None]], None],
    ) -> None:
        self._host, self._ended, self._has_identity, self._later = host, ended, has_identity, later
        self._names: list[str] = []
        self._connected: list[Any] = []
        # Name of the document → True if its commit was seen, False if only its saving was seen.
        self._noted: dict[str, bool] = {}
        self._waiting = False

    def watch(self, name: str) -> None:
        """Notice from now on when this command ends."""
        if not self._names:
            self._host.add_document_observer(self)
        if name not in self._names:
            self._names.append(name)

    def connect(self, _workbench: str = "") -> None:
        """Connect to the commands' QActions; FreeCAD makes them when a workbench shows the command."""
        for name in self._names:
            for action in self._host.command_actions(name):
                if action not in self._connected:
                    self._connected.append(action)
                    action.triggered.connect(self._triggered)
        self._wrap_origin()

    def _triggered(self, *_arguments: Any) -> None:
        doc = self._host.active_document()
        if doc is not None:
            self.note(doc)

    # FreeCAD calls these; an exception in them would only be printed.

    def slotFinishSaveDocument(self, doc: Any, filename: str) -> None:
        """Note that a document is completely on the disk."""
        # "Save a copy" names another file than the document's own.
        from silo.platform import one_path  # late: FreeCAD's start waits for this module

        if doc.FileName and one_path(filename) == one_path(doc.FileName):
            self.note(doc, committed=False)

    def slotActivateDocument(self, _doc: Any) -> None:
        """Look again when a person changes to another document."""
        # The document is not the active one yet while FreeCAD reports it.
        self._later(0, self._wrap_origin)

    def _wrap_origin(self) -> None:
        doc = self._host.active_document()
        origin = self._host.origin_of(doc) if doc is not None else None
        commit = getattr(origin, "commitDocument", None)
        if origin is None or not callable(commit) or getattr(commit, "tells_silo", False):
            return

        def commit_document(*arguments: Any) -> Any:
            result = commit(*arguments)
            if result is not False and arguments:
                self.note(arguments[0])
            return result

        commit_document.tells_silo = True  # type: ignore[attr-defined]
        try:
            origin.commitDocument = commit_document
        except (AttributeError, TypeError):
            # An origin written in C++ takes no attributes; its command's QAction signals us.
            return

    def note(self, doc: Any, *, committed: bool = True) -> None:
        """Note that a commit of this document has ended, or that it was only saved."""
        self._noted[doc.Name] = committed or self._noted.get(doc.Name, False)
        if not self._waiting:
            self._waiting = True
            self._later(WAIT_MS, self._flush)

    def _flush(self) -> None:
        self._waiting = False
        noted, self._noted = self._noted, {}
        for doc in self._host.documents():
            if doc.Name in noted and (noted[doc.Name] or self._has_identity(doc)):
                self._ended(doc)


# Attributes of an object that are no properties, and that a walk may ask for.
_PLAIN = frozenset(("State", "ID", "dumpPropertyContent", "getLinkedObject", "isValid"))


class FactCache:
    """Makes the views of one walk; the same object always has the same view.

    is_object
        True for a FreeCAD document object.
    imported
        gives the part in a file that A2plus imported into a document: (path of the document, the file).
    """

    def __init__(
        self,
        is_object: Callable[[Any], bool],
        imported: Callable[[str, str], Any] = lambda _owner, file: LinkProblem(FindingCode.BROKEN_LINK, file),
    ) -> None:
        self._is_object = is_object
        self.imported = imported
        self._objects: dict[Any, CachedObject] = {}
        self._documents: dict[str, CachedDocument] = {}
        # FreeCAD's answer depends on the type alone.
        self.derived: dict[tuple[str, str], bool] = {}

    def object(self, real: Any) -> CachedObject:
        """Return the view of an object."""
        cached_object = self._objects.get(real)
        if cached_object is None:
            cached_object = self._objects[real] = CachedObject(real, self)
        return cached_object

    def document(self, real: Any) -> CachedDocument:
        """Return the view of a document."""
        name = real.Name
        cached_document = self._documents.get(name)
        if cached_document is None:
            cached_document = self._documents[name] = CachedDocument(real, self)
        return cached_document

    def value(self, value: Any) -> Any:
        """Replace objects in a value by their views, also in lists and in pairs of object and sub-name."""
        if self._is_object(value):
            return self.object(value)
        if isinstance(value, list):
            return [self.value(member) for member in value]
        if isinstance(value, tuple):
            return tuple(self.value(member) for member in value)
        return value


class CachedObject:
    """A document object as :class:`silo.bom.document.ObjectLike` has it; ``real`` is FreeCAD's."""

    def __init__(self, real: Any, cache: FactCache) -> None:
        fields = self.__dict__
        fields["real"] = real
        fields["_cache"] = cache
        fields["Name"] = real.Name
        fields["TypeId"] = real.TypeId
        fields["PropertiesList"] = frozenset(real.PropertiesList)

    def __getattr__(self, name: str) -> Any:
        # Only asked for what is not in __dict__ yet.
        if name in self.PropertiesList:
            value = self._cache.value(getattr(self.real, name))
        elif name == "Document":
            value = self._cache.document(self.real.Document)
        elif name in _PLAIN:
            value = getattr(self.real, name)
        else:
            raise AttributeError(name)
        self.__dict__[name] = value
        return value

    def isDerivedFrom(self, type_name: str, /) -> bool:
        """Return FreeCAD's answer, which is remembered for each type."""
        key = (self.TypeId, type_name)
        answer: bool | None = self._cache.derived.get(key)
        if answer is None:
            answer = self._cache.derived[key] = bool(self.real.isDerivedFrom(type_name))
        return answer

    def __repr__(self) -> str:
        return f"<{self.TypeId} {self.Name}>"


class CachedDocument:
    """A document as :class:`silo.bom.document.DocumentLike` has it."""

    def __init__(self, real: Any, cache: FactCache) -> None:
        self.real = real
        self._cache = cache
        self.Name: str = real.Name
        self.Label: str = real.Label
        self.FileName: str = real.FileName
        self._meta: dict[str, str] | None = None
        self._objects: list[CachedObject] | None = None

    @property
    def ProgramVersion(self) -> str:
        """Return the FreeCAD that saved the document; "" while it is unsaved."""
        return self.real.getProgramVersion() or ""

    @property
    def Meta(self) -> dict[str, str]:
        """Return the document's own notes."""
        if self._meta is None:
            self._meta = dict(self.real.Meta)
        return self._meta

    @property
    def Objects(self) -> list[CachedObject]:
        """Return all objects, in document order."""
        if self._objects is None:
            self._objects = [self._cache.object(obj) for obj in self.real.Objects]
        return self._objects

    def getObject(self, name: str) -> CachedObject | None:
        """Return an object by its ``Name``."""
        obj = self.real.getObject(name)
        return self._cache.object(obj) if obj is not None else None

    def imported(self, file: str) -> Any:
        """Return the part that A2plus imported from a file; it is read from that file, since FreeCAD does not
        open it.
        """
        return self._cache.imported(self.FileName, file)

    def getPropertyByName(self, name: str) -> Any:
        """Return a property of the document; AttributeError if there is none, as in FreeCAD."""
        return self.real.getPropertyByName(name)
