# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an object in an assembly is: a component, a container, local geometry, or neither.

``container.Group`` is flattened through plain folders and also lists joints, sheets and boolean operands
(measured); so the type decides, never the mere presence of an attribute, which links forward.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from enum import Enum, auto
from functools import lru_cache
from typing import Any

from silo.bom.message import message
from silo.bom.walk.document import derived, first_of, own, property_names
from silo.bom.walk.imported import is_sketch
from silo.bom.walk.standard import fastener_type, is_tool


class Kind(Enum):
    """The role of an object in a BOM."""

    LINK = auto()  # a component, ElementCount times
    ASSEMBLY_LINK = auto()  # one instance of an assembly; its own Group holds copies
    LINK_GROUP = auto()  # a bundle of links: its ElementList counts
    CONTAINER = auto()  # an inline part or assembly: what it holds counts in the parent
    FOLDER = auto()  # a plain folder: its content is flattened into the parent's Group already
    ELEMENT = auto()  # one element of a link array that was put into a group
    DRAFT_ARRAY = auto()  # Count instances of Base
    COMPOUND = auto()  # shows its Links, which do not count themselves
    COPY = auto()  # a clone or a mirror image: shows its originals once more
    STANDARD = auto()  # a standard part of the Fasteners workbench
    FOREIGN = auto()  # a part of another add-on, with its shape inside and no link
    LOCAL = auto()  # geometry modelled in this very file
    NOTHING = auto()  # joints, sheets, sketches, datums, variables

    # Each exists once. Enum's own hash is written in Python, and a walk needs it thousands of times.
    __hash__ = object.__hash__


COMPONENTS = frozenset({Kind.LINK, Kind.ASSEMBLY_LINK})

INLINE = frozenset({Kind.LINK_GROUP, Kind.CONTAINER, Kind.FOLDER})

# Objects that show others of the same file, maybe several times.
REPEATERS = frozenset({Kind.DRAFT_ARRAY, Kind.COMPOUND, Kind.COPY})

_NO_FOLDERS = (
    "Assembly::JointGroup",
    "Assembly::BomGroup",
    "Assembly::ViewGroup",
    "Assembly::SnapshotGroup",
    "Assembly::SimulationGroup",
)

_ASSEMBLY3 = ("BuildShape", "Freeze", "Group")

# What a Python object is, by properties that no other kind has together; the first that fits.
_MARKS = (
    # Draft arrays without links have no count before FreeCAD 1.0, those along paths and points have no type.
    *((Kind.DRAFT_ARRAY, ("Base", mark)) for mark in ("Count", "ArrayType", "PathObject", "PointObject")),
    (Kind.FOREIGN, ("sourceFile", "a2p_Version")),
    (Kind.FOREIGN, ("sourceFile", "timeLastImport")),
    (Kind.CONTAINER, _ASSEMBLY3),
    (Kind.COPY, ("Objects", "Fuse")),  # a Draft clone
    (Kind.COPY, ("Objects", "Scale")),
)

_ASKED_FOR = {name for _, names in _MARKS for name in names}

_NO_GEOMETRY = (
    *("Part::Part2DObject", "Part::Datum", "PartDesign::SubShapeBinder", "PartDesign::ShapeBinder"),
    *("App::DatumElement", "Part::Vertex", "Part::Line", "Part::Plane", "Part::Circle", "Part::Ellipse"),
    *("Part::Section", "Part::Polygon", "Part::RegularPolygon", "Part::Helix", "Part::Spiral"),
)

_GEOMETRY = ("Part::Feature", "Mesh::Feature", "Points::Feature")

# What a link may point at without meaning a component, in words for people. (A binder has a shape.)
_NO_COMPONENTS = {
    "Spreadsheet::Sheet": message("a spreadsheet"),
    "App::VarSet": message("a set of variables"),
    "Part::Part2DObject": message("a sketch"),
    "Part::Datum": message("a datum"),
    "App::DatumElement": message("a datum"),
    "App::LocalCoordinateSystem": message("a coordinate system"),
    "App::OriginFeature": message("a datum"),
    "App::Origin": message("an origin"),
    "App::MaterialObject": message("a material"),
    "App::TextDocument": message("a text"),
    "App::Annotation": message("a note"),
    "App::AnnotationLabel": message("a note"),
    "App::ImagePlane": message("a picture"),
    "Image::ImagePlane": message("a picture"),
    "TechDraw::DrawPage": message("a drawing"),
    **dict.fromkeys(_NO_FOLDERS, message("a group of joints or views")),
}


def has_own(obj: object, *names: str) -> bool:
    """Return True if the object itself (not a link's target) has all these properties."""
    listed: Sequence[str] | None = getattr(obj, "PropertiesList", None)
    return all(name in listed if listed is not None else hasattr(obj, name) for name in names)


def kind_of(obj: object) -> Kind:
    """Return the kind of an object, as a member of a container."""
    ancestry = getattr(obj, "ancestry", None)
    if isinstance(ancestry, frozenset):
        kind = kind_by_type(ancestry)
    else:
        kind = _kind_by_type(lambda name: derived(obj, name))
    if kind is not None:
        return kind
    if derived(obj, "Part::FeaturePython"):
        return _python_kind(obj)
    return _standard_kind(obj) or _geometry(lambda name: derived(obj, name))


@lru_cache(maxsize=4096)
def kind_by_type(ancestry: frozenset[str]) -> Kind | None:
    """Return the kind of an object whose type is derived from these; None if its properties decide."""
    return _kind_by_type(ancestry.__contains__)


def _kind_by_type(is_a: Callable[[str], bool]) -> Kind | None:
    if is_a("App::Link"):
        return Kind.LINK
    if is_a("Assembly::AssemblyLink"):
        return Kind.ASSEMBLY_LINK
    if is_a("App::LinkGroup"):
        return Kind.LINK_GROUP
    if is_a("App::Part"):  # also Assembly::AssemblyObject
        return Kind.CONTAINER
    if is_a("App::DocumentObjectGroup"):
        return Kind.NOTHING if any(map(is_a, _NO_FOLDERS)) else Kind.FOLDER
    if is_a("Part::FeaturePython"):
        return None
    if any(map(is_a, _NO_GEOMETRY)):
        return Kind.NOTHING
    if is_a("Part::Compound"):
        return Kind.COMPOUND
    if is_a("Part::Mirroring"):
        return Kind.COPY
    if is_a("App::LinkElement"):
        return Kind.ELEMENT
    return None if is_a("PartDesign::FeaturePython") else _geometry(is_a)


def _geometry(is_a: Callable[[str], bool]) -> Kind:
    return Kind.LOCAL if any(map(is_a, _GEOMETRY)) else Kind.NOTHING


def _python_kind(obj: object) -> Kind:
    names = property_names(obj)
    if names is None:
        names = tuple(name for name in _ASKED_FOR if hasattr(obj, name))
    kind = _kind_by_names(names)
    if kind is Kind.FOREIGN and is_sketch(obj):
        return Kind.NOTHING
    return kind or _standard_kind(obj) or Kind.LOCAL


@lru_cache(maxsize=1024)
def _kind_by_names(names: frozenset[str] | tuple[str, ...]) -> Kind | None:
    """Return the kind of a Python object with these properties; None if they do not identify it."""
    has = frozenset(names).issuperset
    return next((kind for kind, marks in _MARKS if has(marks)), None)


def _standard_kind(obj: object) -> Kind | None:
    kind = fastener_type(obj)
    if not kind:
        return None
    return Kind.NOTHING if is_tool(kind) else Kind.STANDARD


def sources(repeater: object) -> list[Any]:
    """Return the objects that an array, a compound or a copy shows."""
    # A mirror image has a Base too: the point that its plane goes through.
    names = ("Source",) if derived(repeater, "Part::Mirroring") else ("Base", "Links", "Objects", "Source")
    for name in names:
        if (value := own(repeater, name)) is not None:
            several = value if isinstance(value, list) or name in ("Links", "Objects") else (value,)
            return [source for member in several if (source := first_of(member)) is not None]
    return []


def has_solid(obj: object) -> bool:
    """Return True if the shape of an object holds a solid, or if that is not known; a wire of Draft has
    none.
    """
    ask = getattr(obj, "has_solid", None)
    answer = ask() if callable(ask) else None
    return not has_own(obj, "Points") if answer is None else bool(answer)


def is_assembly3(obj: object) -> bool:
    """Return True for a container of Assembly3: ``Group`` = [constraints, elements, parts]; only its parts
    are components.
    """
    return derived(obj, "Part::FeaturePython") and has_own(obj, *_ASSEMBLY3)


def no_component(obj: object) -> str:
    """Return what a link's target is if it is no component ("a spreadsheet"); "" if it may be one."""
    if derived(obj, "PartDesign::Body") or derived(obj, "App::Part"):  # most are, so no long list for them
        return ""
    if derived(obj, "Part::Feature") and not (
        derived(obj, "Part::Part2DObject") or derived(obj, "Part::Datum")
    ):
        return ""
    if derived(obj, "App::FeaturePython") and (has_own(obj, "JointType") or has_own(obj, "ObjectToGround")):
        return message("a joint")
    return next((words for name, words in _NO_COMPONENTS.items() if derived(obj, name)), "")


def members(container: object) -> Iterable[Any]:
    """Return the objects in a container, in document order."""
    if derived(container, "App::LinkGroup"):
        return getattr(container, "ElementList", None) or ()
    group: Sequence[Any] = getattr(container, "Group", None) or ()
    if is_assembly3(container):
        # A fourth group holds the relations that its command "Go to relation" makes.
        return next((getattr(parts, "Group", None) or () for parts in (*group[2:3], *group[-1:])), ())
    return group


def is_container(obj: object) -> bool:
    """Return True if an object (the real one, not a link) may hold components."""
    if derived(obj, "App::Part") or derived(obj, "App::LinkGroup") or is_assembly3(obj):
        return True
    if derived(obj, "Part::Feature") and kind_of(obj) in REPEATERS:
        return True
    # A Body keeps its features to itself; anything else with members may hold links.
    return not derived(obj, "Part::Feature") and bool(own(obj, "Group"))


def is_named_assembly(obj: object) -> bool:
    """Return True if an object says that it is an assembly, whatever it holds."""
    if derived(obj, "Assembly::AssemblyObject") or is_assembly3(obj):
        return True
    return derived(obj, "App::Part") and own(obj, "Type") == "Assembly"
