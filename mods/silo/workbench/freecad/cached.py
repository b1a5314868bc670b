# SPDX-License-Identifier: LGPL-2.1-or-later
"""Live documents through a cache: each fact is asked of FreeCAD once, and what an object lacks costs nothing.

A walk asks some forty attributes of each link. Most are ones that a link has not, and FreeCAD then looks for
them at the link's target and fails with an exception: 1000 links took 0.5 s that way, all of it in the GUI
thread. Here an object's own ``PropertiesList`` is read once and answers for what is not there; so a link's
attributes are never its target's either (facts §1.1). One :class:`FactCache` serves one walk only.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from typing import Any

from silo.bom.findings import FindingCode
from silo.bom.walk.document import LinkProblem

# Attributes of an object that are no properties, and that a walk may ask for.
_PLAIN = frozenset(
    ("State", "ID", "dumpPropertyContent", "getLinkedObject", "isValid", "getTypeIdOfProperty")
)


class FactCache:
    """Makes the views of one walk; the same object always has the same view.

    is_object
        True for a FreeCAD document object.
    imported
        gives the part in a file that A2plus imported into a document: (path of the document, the file, the
        label of the part in it).
    has_window
        True if the FreeCAD has a window, in which unsaved documents are seen.
    """

    def __init__(
        self,
        is_object: Callable[[Any], bool],
        imported: Callable[[str, str, str], Any] = lambda _owner, file, _part: LinkProblem(
            FindingCode.BROKEN_LINK, file
        ),
        has_window: bool = False,
    ) -> None:
        self.has_window = has_window
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
    """A document object as :class:`silo.bom.walk.document.ObjectLike` has it; ``real`` is FreeCAD's."""

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

    def has_solid(self) -> bool | None:
        """Return True if the shape holds a solid; None if the object has no shape of its own."""
        shape = getattr(self.real, "Shape", None) if "Shape" in self.PropertiesList else None
        return None if shape is None else bool(getattr(shape, "Solids", ()))

    def __repr__(self) -> str:
        return f"<{self.TypeId} {self.Name}>"


class CachedDocument:
    """A document as :class:`silo.bom.walk.document.DocumentLike` has it."""

    def __init__(self, real: Any, cache: FactCache) -> None:
        self.real = real
        self._cache = cache
        self.Name: str = real.Name
        self.Label: str = real.Label
        self.FileName: str = real.FileName
        self._meta: dict[str, str] | None = None
        self._has_view: bool | None = None
        self._objects: list[CachedObject] | None = None

    @property
    def ProgramVersion(self) -> str:
        """Return the FreeCAD that saved the document; "" while it is unsaved."""
        return self.real.getProgramVersion() or ""

    @property
    def has_view(self) -> bool:
        """Return True if a FreeCAD with a window saved the document, or has it open and unsaved."""
        if self._has_view is None:
            self._has_view = _has_view(self.FileName) if self.FileName else self._cache.has_window
        return self._has_view

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

    def imported(self, file: str, part: str = "") -> Any:
        """Return the part that A2plus imported from a file; it is read from that file, since FreeCAD does not
        open it.
        """
        return self._cache.imported(self.FileName, file, part)

    def getPropertyByName(self, name: str) -> Any:
        """Return a property of the document; AttributeError if there is none, as in FreeCAD."""
        return self.real.getPropertyByName(name)


def _has_view(path: str) -> bool:
    """Return True if a FreeCAD with a window saved a file."""
    try:
        with zipfile.ZipFile(path) as file:
            return "GuiDocument.xml" in file.namelist()
    except (OSError, zipfile.BadZipFile):
        return False
