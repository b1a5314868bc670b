# SPDX-License-Identifier: LGPL-2.1-or-later
"""A document object as FreeCAD's Python shows it, read from the file.

Differences to a live object, on purpose: nothing is forwarded to a link's target, nothing can be written,
lists are tuples, and a link without a target says why (``LinkProblem``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.walk.document import LinkProblem as Problem
from silo.fcstd.properties import Properties
from silo.fcstd.type_tree import ancestors, is_listed
from silo.fcstd.values import ABSENT, LocalList, Ref, RefList, ShapeFile, SideEntry, Style, Vector

if TYPE_CHECKING:
    from silo.fcstd.document import FcstdDocument

# Equal properties of a document are written in equal bytes (1000 links have one ElementCount), so values are
# remembered by their bytes; long ones seldom repeat.
_REMEMBER_AT_MOST = 1024

# FreeCAD's own properties have one kind; of another kind (a damaged file) FreeCAD ignores them too.
_KINDS: dict[str, type] = {
    "ElementCount": int,
    "ElementList": LocalList,
    "Group": LocalList,
    "LinkCopyOnChangeSource": Ref,
    "LinkedObject": Ref,
    "ScaleList": SideEntry,
    "ScaleVector": Vector,
    "VisibilityList": tuple,
}

_VISIBILITY = "Visibility"
_ALIKE = frozenset({"ElementCount", "LinkCopyOnChange", "Scale", "ScaleVector", "Visibility"})


@cache
def _answer_of(ancestry: frozenset[str]) -> Callable[[str], bool]:
    """Return one bound method for all objects of a type, of which a file may have hundreds of thousands."""
    return ancestry.__contains__


class FcstdObject:
    """One object of a document. Properties are attributes, under FreeCAD's names.

    There is one ``FcstdObject`` per object of a document, so ``is``, ``==`` and ``hash`` distinguish objects.
    Reading a property may raise DocumentError where the file turns out to be damaged.
    """

    # What an object has before it is read; the rest is in its dictionary, which a large document takes back.
    __slots__ = ("Document", "Name", "TypeId", "__dict__", "__weakref__", "ancestry", "isDerivedFrom")

    Name: str
    TypeId: str
    ancestry: frozenset[str]
    """The type and all that it is derived from."""
    isDerivedFrom: Callable[[str], bool]
    """As FreeCAD: the type of the object itself, never of a link's target; False for unknown names."""
    Document: FcstdDocument
    properties: Properties
    """The table of what the file holds, for those that want to see more than values."""
    PropertiesList: tuple[str, ...]
    """The names of the properties that the file holds (FreeCAD lists its transient ones as well)."""

    def __init__(self, document: FcstdDocument, name: str, type_id: str) -> None:
        self.Document = document
        self.Name = name
        self.TypeId = type_id
        self.ancestry = ancestors(type_id)
        if not is_listed(type_id) and self._looks_like_a_link():
            self.ancestry = ancestors("App::Link") | {type_id}
        # A walker asks this most often, so the set itself answers.
        self.isDerivedFrom = _answer_of(self.ancestry)

    def _looks_like_a_link(self) -> bool:
        """Return True if the object has the properties of a link array, as a type that a later FreeCAD added
        may have.
        """
        try:
            self._load()
        except DocumentError:  # a caller that asks for a property of it gets the error
            return False
        numbers = self.properties.numbers
        return "LinkedObject" in numbers and "ElementCount" in numbers

    @cached_property
    def Label(self) -> str:
        """Return what people call the object; its ``Name`` if the file has no label."""
        label = self.properties.value("Label")
        return label if isinstance(label, str) else self.Name

    @property
    def LinkProblem(self) -> Problem | None:
        """Return why ``LinkedObject`` is None; if it is not None, why the original of a changed copy is.

        None for a link that has its target, and for an object without these properties.
        """
        return self._problem_of("LinkedObject") or self._problem_of("LinkCopyOnChangeSource")

    def _problem_of(self, name: str) -> Problem | None:
        ref = self.properties.value(name)
        # Most links have no original; only their target is reported as missing if it was never set.
        if not isinstance(ref, Ref) or (name != "LinkedObject" and not ref.name):
            return None
        return self.Document.problem_of(ref)

    def getPropertyByName(self, name: str) -> Any:
        """Return the value of a property. AttributeError if there is none, or none that is plain."""
        if name not in self.properties.numbers:  # a plain attribute, such as Name, is no property
            raise AttributeError(
                message(
                    "{typeid} {obj} has no property {property}",
                    typeid=self.TypeId,
                    obj=self.Name,
                    property=repr(name),
                )
            )
        return getattr(self, name)

    def __getattr__(self, name: str) -> Any:
        mine = self.__dict__
        if "properties" not in mine:
            self._load()
            if name in mine:
                return mine[name]
        properties: Properties = mine["properties"]
        if name not in properties.numbers:
            if name == _VISIBILITY and (shown := self.Document.old_view.get(self.Name)) is not None:
                mine[name] = shown
                return shown
            raise AttributeError(name)
        # The file does not change while it is open, so the next access need not call this.
        piece = properties.piece(name)
        value = mine[name] = self._value(name, piece)
        if len(piece) > _REMEMBER_AT_MOST and self.Document.is_large:
            properties.kept.pop(name, None)
        return value

    def own_property(self, name: str, default: Any) -> Any:
        """Return the value of a property; the default if there is none or it is not plain."""
        mine = self.__dict__
        if "properties" not in mine:
            self._load()
        if name in mine:
            return mine[name]
        has_it = name in mine["properties"].numbers or name == _VISIBILITY
        return getattr(self, name, default) if has_it else default

    def unload(self) -> None:
        """Forget what was read of the object; it is read again when it is needed."""
        del self.__dict__

    def shape_key(self) -> str:
        """Return a text that is equal for equal shapes, wherever they are placed; "" if the object has no
        shape.
        """
        value = self.properties.value("Shape") if "Shape" in self.properties.numbers else None
        return self.Document.shape_key(value.name) if isinstance(value, ShapeFile) else ""

    def has_solid(self) -> bool | None:
        """Return True if the stored shape holds a solid; None if it has no shape that can be read."""
        value = self.properties.value("Shape") if "Shape" in self.properties.numbers else None
        return self.Document.has_solid(value.name) if isinstance(value, ShapeFile) else None

    def getTypeIdOfProperty(self, name: str) -> str:
        """Return the type of a property, such as ``App::PropertyLength``; "" if there is none."""
        return self.properties.type_of(name) if name in self.properties.numbers else ""

    def _load(self) -> None:
        mine = self.__dict__
        properties = mine["properties"] = self.Document.properties_of(self)
        mine["PropertiesList"] = properties.names
        mine.update(properties.texts)
        values = self.Document.values
        for name, piece in properties.kept.items():
            if piece in values:
                mine[name] = values[piece]
            elif name in _ALIKE:  # most links have the same, and find it here
                with suppress(DocumentError):
                    getattr(self, name, None)
        self.Document.was_read(self, properties.size)

    def __repr__(self) -> str:
        return message(
            "<{typeid} {name} of {filename}>",
            typeid=self.TypeId,
            name=self.Name,
            filename=self.Document.FileName,
        )

    def _value(self, name: str, piece: bytes) -> Any:
        values = self.Document.values
        if (value := values.get(piece, ABSENT)) is not ABSENT:
            return value
        raw = self.properties.value(name)
        if raw is ABSENT or not isinstance(raw, _KINDS.get(name, object)):
            raise AttributeError(
                message(
                    "{property}: {typeid} {obj} has no such property with a plain value",
                    property=name,
                    typeid=self.TypeId,
                    obj=self.Name,
                )
            )
        value = self._resolved(raw)
        if len(piece) <= _REMEMBER_AT_MOST:
            values[piece] = value
        return value

    def _resolved(self, value: Any) -> Any:
        if isinstance(value, Ref):
            return _with_subs(self.Document.resolve(value), value)
        if isinstance(value, LocalList):
            return self.Document.members(value.names)
        if isinstance(value, RefList):
            return tuple(self._members(value.refs))
        if isinstance(value, SideEntry):
            return self.Document.vectors(value.name)
        return value

    def _members(self, refs: Iterable[Ref]) -> Iterator[Any]:
        for ref in refs:
            if (target := self.Document.resolve(ref)) is not None:
                yield _with_subs(target, ref)


def _with_subs(target: FcstdObject | None, ref: Ref) -> Any:
    if target is None or ref.style is Style.PLAIN:
        return target
    if ref.style is Style.MEMBER:
        return (target, ref.subs)
    if ref.style is Style.PAIR:
        return (target, list(ref.subs))
    if not ref.subs:
        return target
    return (target, ref.subs[0] if len(ref.subs) == 1 else list(ref.subs))
