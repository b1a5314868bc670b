# SPDX-License-Identifier: LGPL-2.1-or-later
"""A document as FreeCAD's Python shows it, read from the file."""

from __future__ import annotations

import hashlib
import os
import re
from collections import deque
from collections.abc import Collection, Mapping, Set
from functools import cached_property
from struct import Struct
from typing import TYPE_CHECKING, Any, cast

from silo.bom.document import LinkProblem
from silo.bom.findings import FindingCode
from silo.bom.walk.kinds import Kind, Survey, kind_by_type, kind_of
from silo.fcstd.container import ContainerFile, Entry, Inflater
from silo.fcstd.limits import FcstdError
from silo.fcstd.locate import Found
from silo.fcstd.objects import FcstdObject, ancestors, is_listed
from silo.fcstd.properties import Properties, table_of
from silo.fcstd.values import ABSENT, LocalList, Ref, Vector
from silo.fcstd.xmltext import XmlText

if TYPE_CHECKING:
    from silo.fcstd.facts import Remembered
    from silo.fcstd.library import Content, Library

# Objects of these types are read together with the rest of their file, for a walker looks at what they hold.
_CONTAINERS = frozenset({"App::Part", "App::LinkGroup", "App::DocumentObjectGroup"})
_GEOMETRY = frozenset({Kind.LOCAL, Kind.NOTHING, Kind.FOLDER})
# What a target is and which item it is: without these a link to it would only be guessed at.
_SAID_OF_ITSELF = ("SiloItemId", "SiloUUID", "Type")
_BREP_TEXT = (b"CASCADE Topology", b"DBRep_DrawableShape")
_MANY_OBJECTS = 20_000
# Of so many objects a large document keeps what it has read. One with a long list, such as the assembly,
# costs too much to be read twice.
_READ_AT_MOST, _SHORT = 4096, 1 << 14
_SIZE = Struct("<I")
_DOUBLES, _FLOATS = Struct("<3d"), Struct("<3f")


class FileSurvey(Survey):
    """Objects by kind, most of them known by their type alone."""

    def __init__(self, document: FcstdDocument, xml: XmlText) -> None:
        self._document, self._xml = document, xml
        types = xml.head.types
        self._types = set(types.values())
        known = {kind: kind_by_type(ancestors(kind)) if is_listed(kind) else None for kind in self._types}
        self._kinds = {
            name: kind or kind_of(document.object_of(name, types[name]))
            for name, kind in zip(types, map(known.__getitem__, types.values()), strict=True)
        }
        self._there = set(self._kinds.values())
        self._groups: list[tuple[Kind, tuple[str, ...]]] | None = None

    def of(self, kinds: Set[Kind], but: Set[str] = frozenset()) -> list[tuple[Any, Kind]]:
        if self._there.isdisjoint(kinds):
            return []
        types, make = self._xml.head.types, self._document.object_of
        return [
            (make(name, types[name]), kind)
            for name, kind in self._kinds.items()
            if kind in kinds and name not in but
        ]

    def grouped(self, kinds: Set[Kind]) -> set[str]:
        if self._groups is None:
            types, make = self._xml.head.types, self._document.object_of
            found = [
                (kind, make(name, types[name]).properties.value("Group"))
                for name in self._xml.mentioning("Group")
                if (kind := self._kinds.get(name)) is not None
            ]
            self._groups = [(kind, group.names) for kind, group in found if isinstance(group, LocalList)]
        return {name for kind, names in self._groups if kind in kinds for name in names}

    def only(self, kinds: Set[Kind]) -> bool:
        """True where there are no objects but of these kinds."""
        return self._there <= kinds

    def has_python(self) -> bool:
        return any(type_id.endswith("FeaturePython") for type_id in self._types)


class FcstdDocument:
    """One FCStd file. ``FileName`` is absolute and without symlinks.

    Document properties (``Company``, ``Id``, ``Comment``, own ones of FreeCAD >= 0.21) are
    attributes.
    """

    FileName: str

    def __init__(self, library: Library, found: Found, content: Content | Remembered) -> None:
        self.FileName = found.real
        self._library, self._found = library, found
        self.content, self.state = content, content.state
        if content.known is None:
            self.__dict__["_xml"] = content.xml  # a cached property takes a lock
        self._table: Properties | None = None
        self._objects: dict[str, FcstdObject] = {}
        self._read: deque[FcstdObject] = deque()
        self._targets: dict[tuple[str, str], FcstdObject | LinkProblem] = {}
        self.values: dict[bytes, Any] = {}

    @cached_property
    def _xml(self) -> XmlText:
        return self.content.xml

    @cached_property
    def Label(self) -> str:
        """The file's name without its ending; FreeCAD ignores the saved label (``Document::Restore``)."""
        return os.path.splitext(os.path.basename(self.FileName))[0]

    @cached_property
    def Name(self) -> str:
        """The internal name that FreeCAD would give: the file's, in ASCII letters, digits and ``_``."""
        name = re.sub(r"[^A-Za-z0-9_]", "_", self.Label)
        return f"_{name}" if name[:1].isdigit() else name or "Unnamed"

    @cached_property
    def ProgramVersion(self) -> str:
        """The FreeCAD that wrote the file, such as ``1.0R39319 (Git)``."""
        return self._xml.attribute("ProgramVersion")

    @cached_property
    def Uid(self) -> str:
        """FreeCAD's id of the document; a copy of the file has the same."""
        return self._text("Uid")

    @cached_property
    def LastModifiedDate(self) -> str:
        """When FreeCAD saved it, as it says (UTC, seconds); links record it as their ``stamp``."""
        return self._text("LastModifiedDate")

    @property
    def Meta(self) -> Mapping[str, str]:
        """Free texts by key, empty where the file has none."""
        value = self.__dict__.get("_meta")
        if value is None:
            value = self._value("Meta")
            value = self.__dict__["_meta"] = value if isinstance(value, dict) else {}
        return cast("Mapping[str, str]", value)

    @cached_property
    def Objects(self) -> tuple[FcstdObject, ...]:
        """All objects, in document order."""
        self.complete()
        return self.members(self._xml.head.types)

    @cached_property
    def survey(self) -> FileSurvey:
        """The objects by what they are; only those that somebody asks for are made."""
        self.complete()
        return FileSurvey(self, self._xml)

    @property
    def PropertiesList(self) -> tuple[str, ...]:
        """The names of the document's own properties, as far as the file holds them."""
        return self.properties.names

    def getObject(self, name: str) -> FcstdObject | None:
        """The object of this ``Name`` (never a label), None where there is none."""
        known = self._objects.get(name)
        if known is None and (kind := self._type_of(name)) is not None:
            known = self.object_of(name, kind)
        return known

    def _type_of(self, name: str) -> str | None:
        known = self.content.known
        kind = known.type_of(name) if known is not None else None
        return kind or self._xml.head.types.get(name)

    def getPropertyByName(self, name: str) -> Any:
        """A document property. AttributeError where there is none, or none with a plain value."""
        value = self.Label if name == "Label" else self._value(name)
        if value is ABSENT:
            raise AttributeError(f"the document {self.FileName} has no readable property {name!r}")
        return value

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        value = self.__dict__[name] = self.getPropertyByName(name)
        return value

    def __repr__(self) -> str:
        return f"<document {self.FileName}>"

    def linked(self) -> set[str]:
        """The recorded paths of linked files, about, where it holds more than geometry."""
        return set() if self.survey.only(_GEOMETRY) else self._xml.linked()

    # For the objects of this document and the session; a walker has no use for what follows.

    @cached_property
    def is_large(self) -> bool:
        """True where memory counts more than time."""
        return self.content.known is None and len(self._xml.head.types) > _MANY_OBJECTS

    def was_read(self, obj: FcstdObject, size: int) -> None:
        """Note that an object was read. A large document unloads the one that was read longest ago."""
        if self.is_large and size <= _SHORT:
            self._read.append(obj)
            if len(self._read) > _READ_AT_MOST:
                self._read.popleft().unload()

    def complete(self) -> None:
        """Read the file to its end and check it. Raises DocumentError."""
        self._xml.complete()

    @cached_property
    def folders(self) -> tuple[str, ...]:
        """Where the paths of links begin: the folder as the file was opened, then the one without
        symlinks."""
        found = self._found
        return tuple(dict.fromkeys((os.path.dirname(found.opened), os.path.dirname(found.real))))

    def check(self, target: FcstdObject) -> None:
        """Make sure that what a walker asks of a link's target can be read. Raises DocumentError."""
        known = self.content.known
        if known is not None and target.Name in known.sound:
            return
        # Facts are those of a file that was read to its end.
        if known is None and not _CONTAINERS.isdisjoint(ancestors(target.TypeId)):
            self._xml.complete()
        numbers = target.properties.numbers
        for name in _SAID_OF_ITSELF:
            if name in numbers:
                getattr(target, name, None)
        _ = target.Label, self.Meta, self._value("SiloUUID")
        if known is not None:
            known.sound.add(target.Name)

    @property
    def properties(self) -> Properties:
        """The property table of the document itself."""
        if self._table is None:
            known = self.content.known
            if known is None:
                self._table = Properties(self._xml, self._xml.head.properties, "")
            else:
                self._table = known.document
        return self._table

    def properties_of(self, obj: FcstdObject) -> Properties:
        """The property table of an object of this document."""
        known = self.content.known
        table = known.table(obj.Name) if known is not None else None
        return table or table_of(self._xml, obj.Name, obj.TypeId)

    def members(self, names: Collection[str]) -> tuple[FcstdObject, ...]:
        """The objects of these names, without those that are not there."""
        types = self._xml.head.types
        if len(names) > _MANY_OBJECTS:  # no second copy of each name
            listed = {name: name for name in types}
            names = [listed[name] for name in names if name in listed]
        return tuple(self.object_of(name, types[name]) for name in names if name in types)

    def resolve(self, ref: Ref) -> FcstdObject | None:
        """The object that a link means, None where it is unset or broken."""
        if not ref.file and (local := self._objects.get(ref.name)) is not None:
            return local
        found = self._target(ref)
        return found if isinstance(found, FcstdObject) else None

    def problem_of(self, ref: Ref) -> LinkProblem | None:
        """Why ``resolve`` gives None."""
        found = self._target(ref)
        return found if isinstance(found, LinkProblem) else None

    def vectors(self, entry_name: str) -> tuple[Vector, ...]:
        """A list of vectors from its side entry (``PropertyVectorList::RestoreDocFile``)."""
        if not entry_name:
            return ()
        entry = self._entries.get(entry_name.encode())
        if entry is None:
            raise FcstdError(self.FileName, f"its {entry_name} is missing")
        if entry.size <= _SIZE.size:  # an empty list; there is one for every link
            return ()
        data = self._side_entry(entry)
        # Files of FileVersion 0 have single precision (src/App/PropertyGeo.cpp).
        form = _DOUBLES if self._xml.attribute("FileVersion", "0") != "0" else _FLOATS
        (count,) = _SIZE.unpack_from(data)
        if len(data) != _SIZE.size + count * form.size:
            raise FcstdError(self.FileName, f"its {entry_name} is damaged (its length is wrong)")
        return tuple(Vector(*numbers) for numbers in form.iter_unpack(data[_SIZE.size :]))

    def shape_key(self, entry_name: str) -> str:
        """A hash of a shape from its side entry, the same wherever the shape is placed; "" without one.

        The text form has all placements in a list of their own (``BRepTools_ShapeSet``).
        """
        entry = self._entries.get(entry_name.encode()) if entry_name else None
        if entry is None or entry.size > self._xml.limits.side_entry:
            return ""
        data = self._side_entry(entry)
        begin = data.find(b"Curve2ds") if data.lstrip().startswith(_BREP_TEXT) else 0
        # The last line says where the shape is placed.
        body = data[begin:].rstrip().rpartition(b"\n")[0] if begin > 0 else data
        return hashlib.sha256(body).hexdigest()

    @cached_property
    def _entries(self) -> dict[bytes, Entry]:
        try:
            return {entry.name: entry for entry in self.content.directory.entries()}
        except ValueError as error:
            raise FcstdError(self.FileName, str(error)) from error

    def _value(self, name: str) -> Any:
        value = self.properties.value(name)
        return value if isinstance(value, str | int | float | dict | tuple) else ABSENT

    def _text(self, name: str) -> str:
        value = self._value(name)
        return value if isinstance(value, str) else ""

    def object_of(self, name: str, kind: str) -> FcstdObject:
        """The object of this name and type."""
        known = self._objects.get(name)
        if known is None:
            known = self._objects[name] = FcstdObject(self, name, kind)
        return known

    def _target(self, ref: Ref) -> FcstdObject | LinkProblem:
        key = (ref.file, ref.name)
        known = self._targets.get(key)
        if known is None:
            known = self._targets[key] = self._find_target(ref)
        return known

    def _find_target(self, ref: Ref) -> FcstdObject | LinkProblem:
        if not ref.name:
            code = FindingCode.MISSING_OBJECT if ref.file else FindingCode.UNSET_LINK
            return LinkProblem(code, ref.file)
        if ref.file:
            return self._library.follow(self, ref)
        found = self.getObject(ref.name)
        return found or LinkProblem(FindingCode.MISSING_OBJECT, "", ref.name)

    def _side_entry(self, entry: Entry) -> bytes:
        limits = self._xml.limits
        with ContainerFile(self.FileName, limits) as container:
            if container.state != self.state:
                raise FcstdError(self.FileName, "it was changed while it was being read; read it again")
            packed = container.packed(entry, limits.packed)
            return Inflater(self.FileName, entry, packed, limits.side_entry, limits).rest()
