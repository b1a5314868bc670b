# SPDX-License-Identifier: LGPL-2.1-or-later
"""Documents and objects with FreeCAD's attribute names, for tests of whatever walks them.

Three kinds:

* :class:`Doc` and :class:`Obj`: what FreeCAD shows to Python, as plain attributes;
* :class:`ForwardingLink`: a link as FreeCAD makes it live, which shows its target's attributes as its own;
* :class:`BareDocument`, :class:`BareLink`, :class:`BareAssembly`, :class:`BarePart`: nothing but what the
  spec's listing touches.

All but the bare ones refuse to be written once they are made: a walker reads, it changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

ROOT = "App::DocumentObject"

# FreeCAD's hierarchy, as far as the tests need it: type → the type it is derived from.
PARENT = {
    "App::Annotation": ROOT,
    "App::DatumElement": "App::GeoFeature",
    "App::DocumentObjectGroup": ROOT,
    "App::FeaturePython": ROOT,
    "App::GeoFeature": ROOT,
    "App::Line": "App::OriginFeature",
    "App::Link": ROOT,
    "App::LinkElement": ROOT,
    "App::LinkGroup": ROOT,
    "App::LinkGroupPython": "App::LinkGroup",
    "App::LinkPython": "App::Link",
    "App::LocalCoordinateSystem": "App::GeoFeature",
    "App::Origin": ROOT,
    "App::OriginFeature": "App::GeoFeature",
    "App::Part": "App::GeoFeature",
    "App::TextDocument": ROOT,
    "App::VarSet": ROOT,
    "Assembly::AssemblyLink": "App::Part",
    "Assembly::AssemblyObject": "App::Part",
    "Assembly::BomGroup": "App::DocumentObjectGroup",
    "Assembly::BomObject": "Spreadsheet::Sheet",
    "Assembly::JointGroup": "App::DocumentObjectGroup",
    "Assembly::SimulationGroup": "App::DocumentObjectGroup",
    "Assembly::ViewGroup": "App::DocumentObjectGroup",
    "Mesh::Feature": "App::GeoFeature",
    "Part::Box": "Part::Feature",
    "Part::Cut": "Part::Feature",
    "Part::Datum": "Part::Feature",
    "Part::Feature": "App::GeoFeature",
    "Part::Compound": "Part::Feature",
    "Part::FeaturePython": "Part::Feature",
    "Part::LinkArray": "App::Link",
    "Part::LinkArrayLinear": "Part::LinkArray",
    "Part::LinkSpiral": "App::Link",
    "Part::Mirroring": "Part::Feature",
    "Part::MultiFuse": "Part::Feature",
    "Part::Part2DObject": "Part::Feature",
    "PartDesign::Body": "Part::Feature",
    "PartDesign::Boolean": "PartDesign::Feature",
    "PartDesign::CoordinateSystem": "Part::Datum",
    "PartDesign::Feature": "Part::Feature",
    "PartDesign::FeaturePython": "PartDesign::Feature",
    "PartDesign::Plane": "Part::Datum",
    "PartDesign::SubShapeBinder": "Part::Feature",
    "Sketcher::SketchObject": "Part::Part2DObject",
    "Spreadsheet::Sheet": ROOT,
    "TechDraw::DrawPage": ROOT,
}


# What FreeCAD gives each object of a type by itself.
DEFAULTS: dict[str, dict[str, Any]] = {
    "App::Link": {
        "LinkedObject": None,
        "ElementCount": 0,
        "ElementList": [],
        "Scale": 1.0,
        "ScaleVector": (1.0, 1.0, 1.0),
        "ScaleList": [],
        "LinkCopyOnChange": "Disabled",
        "LinkCopyOnChangeSource": None,
    },
    "App::LinkElement": {"LinkedObject": None, "LinkCopyOnChangeSource": None},
    "App::LinkGroup": {"ElementList": []},
    "App::DocumentObjectGroup": {"Group": []},
    "App::Part": {"Group": [], "Type": ""},
    "Assembly::AssemblyLink": {"LinkedObject": None, "Rigid": True},
    "Part::Mirroring": {"Source": None, "Base": (0.0, 0.0, 0.0), "Normal": (0.0, 0.0, 1.0)},
    "PartDesign::Body": {"Group": []},
}


def ancestors(type_id: str) -> Iterator[str]:
    """A type and what it is derived from."""
    current: str | None = type_id
    while current is not None:
        yield current
        current = PARENT.get(current)


class Doc:
    """A document. ``properties`` are those that ``addProperty`` made (FreeCAD >= 0.21)."""

    def __init__(
        self, path: str, *, label: str = "", meta: dict[str, str] | None = None, **properties: Any
    ) -> None:
        self.FileName = path
        self.Label = label or path.rsplit("/", 1)[-1].removesuffix(".FCStd")
        self.Name = self.Label
        self.Meta = meta or {}
        self.Objects: list[Any] = []
        self._properties = properties

    def getPropertyByName(self, name: str) -> Any:
        try:
            return self._properties[name]
        except KeyError:
            raise AttributeError(f"Document has no property {name!r}") from None

    def getObject(self, name: str) -> Any:
        return next((obj for obj in self.Objects if obj.Name == name), None)

    def add(self, type_id: str, name: str, **properties: Any) -> Obj:
        """A new object, in no container."""
        return Obj(self, type_id, name, **properties)

    def body(self, name: str = "Body", **properties: Any) -> Obj:
        """A part as PartDesign makes it."""
        return self.add("PartDesign::Body", name, **properties)

    def link(self, name: str, target: Any, **properties: Any) -> Obj:
        """An ``App::Link``; ``target`` may be a tuple (object, sub-name), or None."""
        return self.add("App::Link", name, LinkedObject=target, **properties)

    def array(self, name: str, target: Any, count: int, *, shown: bool = True, **properties: Any) -> Obj:
        """A link array, with an ``App::LinkElement`` per instance where its elements are shown."""
        elements = [
            self.add("App::LinkElement", f"{name}_i{index}", LinkedObject=target)
            for index in range(count if shown else 0)
        ]
        return self.link(name, target, ElementCount=count, ElementList=elements, **properties)

    def assembly_link(self, name: str, target: Any, copies: Iterable[Any] = (), **properties: Any) -> Obj:
        """An instance of an assembly, with the copies of its last recompute."""
        return self.add("Assembly::AssemblyLink", name, LinkedObject=target, Group=list(copies), **properties)

    def group(self, type_id: str, name: str, *members: Any, **properties: Any) -> Obj:
        """A container with a ``Group``."""
        return self.add(type_id, name, Group=list(members), **properties)

    def assembly(self, *members: Any, name: str = "Assembly", **properties: Any) -> Obj:
        """A FreeCAD 1.x assembly."""
        return self.group("Assembly::AssemblyObject", name, *members, **properties)

    def part(self, name: str, *members: Any, **properties: Any) -> Obj:
        """An ``App::Part``."""
        return self.group("App::Part", name, *members, **properties)

    def folder(self, name: str, *members: Any, **properties: Any) -> Obj:
        """A plain group of the tree."""
        return self.group("App::DocumentObjectGroup", name, *members, **properties)

    def screw(self, name: str, length: str = "16", **properties: Any) -> Obj:
        """A cap screw of the Fasteners workbench: ISO 4762 M4×``length``."""
        made_of = {"Type": "ISO4762", "Diameter": "M4", "Length": length, **properties}
        return self.add("Part::FeaturePython", name, **made_of)

    def link_group(self, name: str, *members: Any, **properties: Any) -> Obj:
        """An ``App::LinkGroup``."""
        return self.add("App::LinkGroup", name, ElementList=list(members), **properties)


class Obj:
    """A document object; its own properties are the keyword arguments and the defaults of its type."""

    def __init__(self, document: Doc, type_id: str, name: str, **properties: Any) -> None:
        own = {"Label": name}
        for parent in reversed(list(ancestors(type_id))):
            own.update(DEFAULTS.get(parent, {}))
        own.update(properties)
        fixed = {"Document": document, "Name": name, "TypeId": type_id, "PropertiesList": sorted(own)}
        self.__dict__.update(own, **fixed)
        document.Objects.append(self)

    def isDerivedFrom(self, type_name: str, /) -> bool:
        return type_name in ancestors(self.TypeId)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a walker tried to write {name} of {self.__dict__['Name']}")

    def __repr__(self) -> str:
        return f"<{self.TypeId} {self.Name} of {self.Document.FileName}>"


def edit(obj: Any, **properties: Any) -> Any:
    """Change a fake in a test, as a person would in FreeCAD; returns it."""
    fixed = {"Document", "Name", "TypeId", "PropertiesList"}
    obj.__dict__.update(properties)
    obj.__dict__["PropertiesList"] = sorted(set(obj.__dict__) - fixed)
    return obj


class ForwardingLink(Obj):
    """A live link: attributes that it has not itself are those of its target; ``PropertiesList`` is its own.

    ``hasattr(link, "Group")``, ``link.Type`` and ``link.SiloUUID`` say nothing about the link (facts §1.1).
    """

    def __init__(self, document: Doc, name: str, target: Any, **properties: Any) -> None:
        super().__init__(document, "App::Link", name, LinkedObject=target, **properties)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        target = self.__dict__["LinkedObject"]
        target = target[0] if isinstance(target, tuple) else target
        if target is None:
            raise AttributeError(name)
        return getattr(target, name)


class BareDocument:
    """A document with a file name and one look-up, and nothing else."""

    def __init__(self, path: str, silo_uuid: str | None = None) -> None:
        self.FileName = path
        self._uuid = silo_uuid

    def getPropertyByName(self, name: str) -> Any:
        if name == "SiloUUID" and self._uuid is not None:
            return self._uuid
        raise AttributeError(name)


class BarePart:
    """The target of a link: of it the listing only asks the document."""

    def __init__(self, document: BareDocument) -> None:
        self.Document = document


class BareAssembly:
    """A container: its members and its document."""

    def __init__(self, document: BareDocument, *members: Any) -> None:
        self.Document = document
        self.Group = list(members)


class BareLink:
    """A link: its type, its target, and an ``ElementCount`` only where it is given."""

    def __init__(self, target: Any, count: int | None = None) -> None:
        self.LinkedObject = target
        if count is not None:
            self.ElementCount = count

    def isDerivedFrom(self, type_name: str, /) -> bool:
        return type_name == "App::Link"


class BareThing:
    """Anything else in a Group: it is no link, and that is all it says."""

    def isDerivedFrom(self, _type_name: str, /) -> bool:
        return False
