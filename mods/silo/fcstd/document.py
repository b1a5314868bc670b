# SPDX-License-Identifier: LGPL-2.1-or-later
"""A document as FreeCAD's Python shows it, read from the file."""

from __future__ import annotations

import hashlib
import os
import re
from collections import deque
from collections.abc import Collection, Iterable, Mapping
from functools import cached_property
from struct import Struct
from typing import TYPE_CHECKING, Any, cast

from silo.bom.findings import FindingCode
from silo.bom.message import message
from silo.bom.walk.document import LinkProblem as Problem
from silo.bom.walk.kinds import Kind
from silo.fcstd.container import ContainerFile, Inflater, ZipEntry
from silo.fcstd.errors import FcstdError
from silo.fcstd.objects import FcstdObject
from silo.fcstd.old_view import visible_in
from silo.fcstd.properties import Properties, table_of
from silo.fcstd.survey import FileSurvey
from silo.fcstd.type_tree import ancestors
from silo.fcstd.values import ABSENT, Ref, Vector
from silo.fcstd.xmltext import XmlText
from silo.locator import FoundFile

if TYPE_CHECKING:
    from silo.fcstd.contents import Content
    from silo.fcstd.facts import Remembered
    from silo.fcstd.library import Library


# Objects of these types are read together with the rest of their file, for a walker looks at what they hold.
_CONTAINERS = frozenset({"App::Part", "App::LinkGroup", "App::DocumentObjectGroup"})
_GEOMETRY = frozenset({Kind.LOCAL, Kind.NOTHING, Kind.FOLDER})
# What a target is and which item it is: without these a link to it would only be guessed at.
_SAID_OF_ITSELF = ("SiloItemId", "SiloUUID", "Type")
_BREP_TEXT = (b"CASCADE Topology", b"DBRep_DrawableShape")
# The type of a shape stands alone in its line (BRepTools_ShapeSet).
_SOLID = re.compile(rb"^So\s*$", re.MULTILINE)
_VIEW = b"GuiDocument.xml"
_MANY_OBJECTS = 20_000
# Of so many objects a large document keeps what it has read. One with a long list, such as the assembly,
# costs too much to be read twice.
_READ_AT_MOST, _SHORT = 4096, 1 << 14
_SIZE = Struct("<I")
_DOUBLES, _FLOATS = Struct("<3d"), Struct("<3f")


class FcstdDocument:
    """One FCStd file. ``FileName`` is absolute and without symlinks.

    Document properties (``Company``, ``Id``, ``Comment``, own ones of FreeCAD >= 0.21) are
    attributes.
    """

    FileName: str

    def __init__(self, library: Library, found: FoundFile, content: Content | Remembered) -> None:
        self.FileName = found.real
        self._library, self._found = library, found
        self.content, self.state = content, content.state
        if content.known is None:
            self.__dict__["_xml"] = content.xml  # a cached property takes a lock
        self._table: Properties | None = None
        self._objects: dict[str, FcstdObject] = {}
        self._read: deque[FcstdObject] = deque()
        self._targets: dict[tuple[str, str], FcstdObject | Problem] = {}
        self.values: dict[bytes, Any] = {}

    @cached_property
    def _xml(self) -> XmlText:
        return self.content.xml

    @cached_property
    def Label(self) -> str:
        """Return the file's name without its ending; FreeCAD ignores the saved label
        (``Document::Restore``).
        """
        return os.path.splitext(os.path.basename(self.FileName))[0]

    @cached_property
    def Name(self) -> str:
        """Return the internal name that FreeCAD would give: the file's, in ASCII letters, digits and
        ``_``.
        """
        name = re.sub(r"[^A-Za-z0-9_]", "_", self.Label)
        return f"_{name}" if name[:1].isdigit() else name or "Unnamed"

    @cached_property
    def ProgramVersion(self) -> str:
        """Return the FreeCAD that wrote the file, such as ``1.0R39319 (Git)``."""
        return self._xml.attribute("ProgramVersion")

    @cached_property
    def Uid(self) -> str:
        """Return FreeCAD's id of the document; copies of the file have the same one."""
        return self._text("Uid")

    @property
    def Meta(self) -> Mapping[str, str]:
        """Return the document's free texts by key; {} if the file has none."""
        value = self.__dict__.get("_meta")
        if value is None:
            value = self._value("Meta")
            value = self.__dict__["_meta"] = value if isinstance(value, dict) else {}
        return cast("Mapping[str, str]", value)

    @cached_property
    def Objects(self) -> tuple[FcstdObject, ...]:
        """Return all objects, in document order."""
        self.complete()
        return self.members(self._xml.head.types)

    @cached_property
    def survey(self) -> FileSurvey:
        """Return the objects by their kinds; an object is made only if it is asked for."""
        self.complete()
        return FileSurvey(self, self._xml)

    @property
    def PropertiesList(self) -> tuple[str, ...]:
        """Return the names of the document's own properties that the file holds."""
        return self.properties.names

    def getObject(self, name: str) -> FcstdObject | None:
        """Return the object of this ``Name`` (never a label); None if there is none."""
        fcstd_object = self._objects.get(name)
        if fcstd_object is None and (kind := self._type_of(name)) is not None:
            fcstd_object = self.object_of(name, kind)
        return fcstd_object

    def _type_of(self, name: str) -> str | None:
        remembered = self.content.known
        kind = remembered.type_of(name) if remembered is not None else None
        return kind or self._xml.head.types.get(name)

    def getPropertyByName(self, name: str) -> Any:
        """Return a document property. AttributeError if there is none, or none with a plain value."""
        value = self.Label if name == "Label" else self._value(name)
        if value is ABSENT:
            raise AttributeError(
                message(
                    "the document {filename} has no readable property {name}",
                    filename=self.FileName,
                    name=repr(name),
                )
            )
        return value

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        value = self.__dict__[name] = self.getPropertyByName(name)
        return value

    def __repr__(self) -> str:
        return f"<document {self.FileName}>"

    def linked(self) -> set[str]:
        """Return roughly the recorded paths of linked files; none if the file holds only geometry."""
        return set() if self.survey.only(_GEOMETRY) else self._xml.linked()

    def mentioning(self, name: str) -> Iterable[str]:
        """Return the names of objects that may mention a name."""
        return self._xml.mentioning(name)

    # For the objects of this document and the session; a walker has no use for what follows.

    @cached_property
    def is_large(self) -> bool:
        """Return True if the file is so large that memory counts more than time."""
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
        """Return the folders at which the paths of links begin: that of the path as opened, and that without
        symlinks.
        """
        location = self._found
        return tuple(dict.fromkeys((os.path.dirname(location.opened), os.path.dirname(location.real))))

    def check(self, target: FcstdObject) -> None:
        """Make sure that everything that a walker asks of a link's target can be read. Raises
        DocumentError.
        """
        remembered = self.content.known
        if remembered is not None and target.Name in remembered.sound:
            return
        # Facts are those of a file that was read to its end.
        if remembered is None and not _CONTAINERS.isdisjoint(ancestors(target.TypeId)):
            self._xml.complete()
        numbers = target.properties.numbers
        for name in _SAID_OF_ITSELF:
            if name in numbers:
                getattr(target, name, None)
        _ = target.Label, self.Meta, self._value("SiloUUID")
        if remembered is not None:
            remembered.sound.add(target.Name)

    @property
    def properties(self) -> Properties:
        """Return the property table of the document itself."""
        if self._table is None:
            remembered = self.content.known
            if remembered is None:
                self._table = Properties(self._xml, self._xml.head.properties, "")
            else:
                self._table = remembered.document
        return self._table

    def properties_of(self, obj: FcstdObject) -> Properties:
        """Return the property table of an object of this document."""
        remembered = self.content.known
        table = remembered.table(obj.Name) if remembered is not None else None
        return table or table_of(self._xml, obj.Name, obj.TypeId)

    def members(self, names: Collection[str]) -> tuple[FcstdObject, ...]:
        """Return the objects of these names; names without an object are skipped."""
        types = self._xml.head.types
        if len(names) > _MANY_OBJECTS:  # no second copy of each name
            listed = {name: name for name in types}
            names = [listed[name] for name in names if name in listed]
        return tuple(self.object_of(name, types[name]) for name in names if name in types)

    def resolve(self, ref: Ref) -> FcstdObject | None:
        """Return the object to which a link leads; None if the link is unset or broken."""
        if not ref.file and (local := self._objects.get(ref.name)) is not None:
            return local
        target = self._target(ref)
        return target if isinstance(target, FcstdObject) else None

    def problem_of(self, ref: Ref) -> Problem | None:
        """Return why ``resolve`` gives None; None if it does not."""
        problem = self._target(ref)
        return problem if isinstance(problem, Problem) else None

    def imported(self, file: str, part: str = "") -> Any:
        """Return the part that A2plus imported from a file, or a LinkProblem that says why there is none."""
        return self._library.imported(self, file, part)

    def vectors(self, entry_name: str) -> tuple[Vector, ...]:
        """Read a list of vectors from its side entry (``PropertyVectorList::RestoreDocFile``)."""
        if not entry_name:
            return ()
        entry = self._entries.get(entry_name.encode())
        if entry is None:
            raise FcstdError(self.FileName, message("its {entry_name} is missing", entry_name=entry_name))
        if entry.size <= _SIZE.size:  # an empty list; there is one for every link
            return ()
        data = self._side_entry(entry)
        # Files of FileVersion 0 have single precision (src/App/PropertyGeo.cpp).
        form = _DOUBLES if self._xml.attribute("FileVersion", "0") != "0" else _FLOATS
        (count,) = _SIZE.unpack_from(data)
        if len(data) != _SIZE.size + count * form.size:
            raise FcstdError(
                self.FileName,
                message("its {entry_name} is damaged (its length is wrong)", entry_name=entry_name),
            )
        return tuple(Vector(*numbers) for numbers in form.iter_unpack(data[_SIZE.size :]))

    def shape_key(self, entry_name: str) -> str:
        """Hash a shape from its side entry, so that its placement does not matter; "" if there is no shape.

        The text form has all placements in a separate list (``BRepTools_ShapeSet``).
        """
        entry = self._entries.get(entry_name.encode()) if entry_name else None
        if entry is None or entry.size > self._xml.limits.side_entry:
            return ""
        data = self._side_entry(entry)
        begin = data.find(b"Curve2ds") if data.lstrip().startswith(_BREP_TEXT) else 0
        # The last line says where the shape is placed.
        body = data[begin:].rstrip().rpartition(b"\n")[0] if begin > 0 else data
        return hashlib.sha256(body).hexdigest()

    def has_solid(self, entry_name: str) -> bool | None:
        """Return True if a shape in a side entry holds a solid; None if that cannot be read."""
        entry = self._entries.get(entry_name.encode()) if entry_name else None
        if entry is None or entry.size > self._xml.limits.side_entry:
            return None
        data = self._side_entry(entry)
        return _SOLID.search(data) is not None if data.lstrip().startswith(_BREP_TEXT) else None

    @cached_property
    def has_view(self) -> bool:
        """Return True if a FreeCAD with a window saved the file."""
        try:
            return any(self.content.directory.entries(_VIEW))
        except ValueError as error:
            raise FcstdError(self.FileName, str(error)) from error

    @cached_property
    def old_view(self) -> Mapping[str, bool]:
        """Return which objects the view shows, for a file that says it nowhere else; {} if it has no view, or
        a damaged one.
        """
        entry = self._entries.get(_VIEW)
        if entry is None or entry.size > self._xml.limits.side_entry:
            return {}
        try:
            return visible_in(self._side_entry(entry))
        except FcstdError:  # FreeCAD opens the file without its view
            return {}

    @cached_property
    def _entries(self) -> dict[bytes, ZipEntry]:
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
        """Return the object of this name and type; makes it if it is not there yet."""
        found = self._objects.get(name)
        if found is None:
            found = self._objects[name] = FcstdObject(self, name, kind)
        return found

    def _target(self, ref: Ref) -> FcstdObject | Problem:
        key = (ref.file, ref.name)
        target = self._targets.get(key)
        if target is None:
            target = self._targets[key] = self._find_target(ref)
        return target

    def _find_target(self, ref: Ref) -> FcstdObject | Problem:
        if not ref.name:
            code = FindingCode.MISSING_OBJECT if ref.file else FindingCode.UNSET_LINK
            return Problem(code, ref.file)
        if ref.file:
            return self._library.follow(self, ref)
        fcstd_object = self.getObject(ref.name)
        return fcstd_object or Problem(FindingCode.MISSING_OBJECT, "", ref.name)

    def _side_entry(self, entry: ZipEntry) -> bytes:
        limits = self._xml.limits
        with ContainerFile(self.FileName, limits) as container:
            if container.state != self.state:
                raise FcstdError(
                    self.FileName, message("it was changed while it was being read; read it again")
                )
            packed = container.packed(entry, limits.packed)
            return Inflater(self.FileName, entry, packed, limits.side_entry, limits).rest()
