# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an object in an assembly is: a component, a container, local geometry, or neither.

``container.Group`` is flattened through plain folders and also lists joints, sheets and boolean operands
(measured); so the type decides, never the mere presence of an attribute, which links forward.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import lru_cache
from typing import Any, TypeVar

from silo.bom.document import derived, first_of, object_name, own, property_names
from silo.bom.standard import fastener_type, is_tool, millimetres

T = TypeVar("T", bound=Hashable)


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
    *("Part::Polygon", "Part::RegularPolygon", "Part::Helix", "Part::Spiral"),
)
_GEOMETRY = ("Part::Feature", "Mesh::Feature", "Points::Feature")
# What a link may point at without meaning a component, in words for people. (A binder has a shape.)
_NO_COMPONENTS = {
    "Spreadsheet::Sheet": "a spreadsheet",
    "App::VarSet": "a set of variables",
    "Part::Part2DObject": "a sketch",
    "Part::Datum": "a datum",
    "App::DatumElement": "a datum",
    "App::LocalCoordinateSystem": "a coordinate system",
    "App::OriginFeature": "a datum",
    "App::Origin": "an origin",
    "App::MaterialObject": "a material",
    "App::TextDocument": "a text",
    "App::Annotation": "a note",
    "App::AnnotationLabel": "a note",
    "App::ImagePlane": "a picture",
    "Image::ImagePlane": "a picture",
    "TechDraw::DrawPage": "a drawing",
    **dict.fromkeys(_NO_FOLDERS, "a group of joints or views"),
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
    return _kind_by_names(names) or _standard_kind(obj) or Kind.LOCAL


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
        return "a joint"
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


_JOINED = ("Reference1", "Reference2", "ObjectToGround", "Part1", "Part2")


def held_by_joints(holders: Iterable[Any]) -> set[str]:
    """Return the names of the objects that joints or constraints in these containers hold, each at its own
    place.

    FreeCAD's joints name a part, or the assembly and a path to a part. Assembly3's constraints lead through
    elements; if there are any, all parts are held. Assembly4's links say so (:func:`is_attached`).
    """
    names = set[str]()
    for holder in holders:
        if is_assembly3(holder) and any(own(member, "Group") for member in list(holder.Group)[:1]):
            names.update(map(object_name, members(holder)))
        for joint in own(holder, "Group") or () if derived(holder, "Assembly::JointGroup") else ():
            for value in (own(joint, name) for name in _JOINED):
                target, subs = value if isinstance(value, tuple) else (value, ())
                names.update(() if target is None else (object_name(target),))
                names.update(step for sub in subs for step in str(sub).split(".")[:-1])
    return names


def is_attached(link: object) -> bool:
    """Return True for a link that Assembly4 holds at its own place."""
    return bool(own(link, "AttachedTo"))


# --- how many an array shows ---


def left_out_by(obj: Any) -> str:
    """Return the object's own property that leaves it out of every BOM; "" if none does."""
    if own(obj, "Suppressed") is True:
        return "Suppressed"
    return "SiloBomExclude" if own(obj, "SiloBomExclude") is True else ""


def is_array(link: object) -> bool:
    """Return True for a link array, even one with a single element."""
    count = own(link, "ElementCount", 0)
    return isinstance(count, int) and count > 0


def elements(link: object) -> tuple[Any, ...]:
    """Return the element objects of a link array; () if it only has a count."""
    return tuple(own(link, "ElementList") or ()) if is_array(link) else ()


def array_count(link: object) -> int:
    """Count the instances of a link object: 1, or the elements of its array that are not excluded one
    by one.
    """
    if not is_array(link):
        return 1
    count: int = own(link, "ElementCount")
    return max(0, count - sum(map(bool, map(left_out_by, elements(link)))))


def draft_count(array: object) -> int | None:
    """Count the instances of a Draft array; None if neither its count nor its pattern gives the number."""
    count = own(array, "Count")
    if isinstance(count, int) and count > 0:
        return count
    pattern = {"ortho": _ortho, "polar": _polar, "circular": _circular}
    kind = own(array, "ArrayType")
    return pattern[kind](array) if isinstance(kind, str) and kind in pattern else None


def _whole(array: object, name: str) -> int | None:
    value = own(array, name)
    return value if isinstance(value, int) and not isinstance(value, bool) else None


def _ortho(array: object) -> int | None:
    numbers = [_whole(array, name) for name in ("NumberX", "NumberY", "NumberZ")]
    if any(number is None for number in numbers):
        return None
    x, y, z = (max(0, number or 0) for number in numbers)
    # Draft draws the original even if the first number is 0.
    return x * max(1, y) * max(1, z) if x else 1


def _polar(array: object) -> int | None:
    number = _whole(array, "NumberPolar")
    return None if number is None else max(1, number)


def _circular(array: object) -> int | None:
    rings, symmetry = _whole(array, "NumberCircles"), _whole(array, "Symmetry")
    radial, tangential = (millimetres(own(array, name)) for name in ("RadialDistance", "TangentialDistance"))
    if rings is None or radial is None or not tangential or tangential < 0:
        return None
    total, step = 1, max(1, symmetry or 1)
    for ring in range(1, min(rings, 10_000)):
        places = math.floor(2 * ring * radial * math.pi / tangential)
        total += math.floor(places / step) * step
    return total


# --- what a feature consumes ---

_OPERANDS = ("Base", "Tool", "Shapes", "Source", "Sections", "Spine", "Profile", "BaseFeature", "Faces")
_BY_PYTHON = ("Tool", "Subtractions", "Sources", "Bodies", "Shape1", "Shape2", "baseObject")


def consumed(objects: Iterable[Any], key: Callable[[Any], T]) -> dict[T, Any]:
    """Map the key of each object that these features (of kind LOCAL) consume to the feature."""
    eaten: dict[T, Any] = {}
    for feature in _features(objects):
        for operand in _operands(feature):
            eaten.setdefault(key(operand), feature)
    return eaten


def _features(objects: Iterable[Any]) -> Iterator[Any]:
    for obj in objects:
        yield obj
        if derived(obj, "PartDesign::Body"):
            yield from own(obj, "Group") or ()


def _operands(feature: Any) -> Iterator[Any]:
    if derived(feature, "Part::FeaturePython"):
        names: tuple[str, ...] = _BY_PYTHON
        # Fragments, slices and filters of compounds; objects that only draw others have neither.
        if own(feature, "Tool") is not None or own(feature, "FilterType") is not None:
            names = (*names, "Base")
        if own(feature, "Mode") is not None or own(feature, "Tolerance") is not None:
            names = (*names, "Objects")
    elif derived(feature, "PartDesign::Boolean"):
        names = (*_OPERANDS, "Group")
    else:
        names = _OPERANDS
    for name in names:
        value = own(feature, name)
        for member in value if isinstance(value, list | tuple) else (value,):
            operand = member[0] if isinstance(member, tuple) and member else member
            if hasattr(operand, "Document"):
                yield operand


# --- a whole document ---


class Survey:
    """The objects of a document by what they are, each looked at once.

    A document that knows more of its objects without making them has a ``survey`` of its own.
    """

    def __init__(self, document: Any) -> None:
        self._objects = [(obj, kind_of(obj)) for obj in getattr(document, "Objects", None) or ()]

    def of(self, kinds: Set[Kind], but: Set[str] = frozenset()) -> list[tuple[Any, Kind]]:
        """Return the objects of these kinds in document order, but not those with the names in ``but``."""
        return [(obj, kind) for obj, kind in self._objects if kind in kinds and object_name(obj) not in but]

    def grouped(self, kinds: Set[Kind]) -> set[str]:
        """Return the names of the objects in the ``Group`` of an object of these kinds."""
        return {object_name(member) for obj, _ in self.of(kinds) for member in own(obj, "Group") or ()}

    def has_python(self) -> bool:
        """Return True if the document has an object of a Python type, as standard parts are."""
        return any(getattr(obj, "TypeId", "").endswith("FeaturePython") for obj, _ in self._objects)


def survey_of(document: Any) -> Survey:
    """Return the survey of a document; its own if it has one."""
    survey = getattr(document, "survey", None)
    return survey if isinstance(survey, Survey) else Survey(document)


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


# --- an assembly as values: roles, the tree, what each object brings, and through what ---

Key = tuple[str, str]
KeyOf = Callable[[Any], Key]
# What one instance of an object brings: the components, and how many of each.
CountedObjects = dict[Key, tuple[Any, int]]

# FreeCAD keeps the changed copies of copy-on-change links in a hidden group of this name.
COPIES = "CopyOnChangeGroup"


class ObjectRole(Enum):
    """The one fate of an object, for the assembly that was chosen."""

    COMPONENT = "component"  # counts with what it brings
    HOLDER = "holder"  # a container of the assembly: what lies in it counts
    SOURCE = "source"  # shown only through others
    OPERAND = "operand"  # consumed by a feature
    SPARE = "spare"  # kept in a folder for later
    INSIDE = "inside"  # part of another component
    CONSTRUCTION = "construction"  # brings nothing
    LEFT_OUT = "left out"  # suppressed or excluded, itself or with what holds it
    LOOSE = "loose"  # beside the assembly


@dataclass(frozen=True, slots=True)
class Lost:
    """What a broken link stands for: a component that nobody can look at.

    ``file`` and ``name`` as the link records them, the file in full. ``label`` is for people.
    """

    file: str
    name: str
    label: str

    @property
    def key(self) -> Key:
        """Return the key that the component would have if it were there."""
        return (self.file, self.name)


@dataclass(slots=True, eq=False)
class Contribution:
    """What one object brings, and through what.

    key
        of the object in its document.
    below
        what it shows within its own file, and how often each time that it is shown itself.
    tree
        of a container that something else shows: where in it ``below`` lies.
    """

    key: Key
    obj: Any
    kind: Kind
    worth: CountedObjects
    below: tuple[tuple[Contribution, int], ...] = ()
    tree: Tree | None = None


@dataclass(frozen=True, slots=True)
class Count:
    """Instances of one component that one object of the tree stands for.

    shown
        that object, with what it shows.
    key
        what identifies the component within ``shown.worth``.
    link, array
        True if the object is itself an ``App::Link`` to a component of another file, and if that is an array.
    beside
        True if it lies beside the assembly, in the document itself.
    """

    shown: Contribution
    key: Key
    quantity: int
    link: bool = False
    array: bool = False
    beside: bool = False

    @property
    def target(self) -> Any:
        """Return the component: a document object, or :class:`Lost`."""
        return self.shown.worth[self.key][0]


@dataclass(slots=True)
class Contents:
    """One assembly as it stands in its file.

    own
        what it shows of its own file that is no item yet.
    roles
        of every object that lies in it, or that it shows.
    holds_components
        True also if its components are all broken, suppressed or excluded.
    is_part
        True for a document that is the one part which lies in it.
    hidden
        geometry of this file that is hidden beside what is shown, and not counted.
    """

    counts: list[Count] = field(default_factory=list)
    own: list[Count] = field(default_factory=list)
    roles: dict[Key, ObjectRole] = field(default_factory=dict)
    holds_components: bool = False
    is_part: bool = False
    hidden: list[Any] = field(default_factory=list)
    tree: Tree | None = None

    def is_assembly(self, container: Any) -> bool:
        """Return True if the parts of its own file that it shows are parts of an assembly; the bodies of a
        part are not.
        """
        if self.is_part:
            return False
        if self.holds_components or is_named_assembly(container):
            return True
        if getattr(container, "is_document_root", False):
            return True
        return any(count.shown.kind in COMPONENTS for count in self.own)


def add(total: CountedObjects, more: CountedObjects, times: int = 1) -> None:
    """Add what several objects bring, each so many times."""
    for key, (target, count) in more.items():
        before = total.get(key)
        if times:
            total[key] = (target, count * times) if before is None else (before[0], before[1] + count * times)


def climbed(start: T, above: Callable[[T], Iterable[T]]) -> Iterator[T]:
    """Yield everything above ``start``, at any distance, each once, the nearest first."""
    seen, further = {start}, [start]
    for key in further:
        for upper in above(key):
            if upper not in seen:
                seen.add(upper)
                further.append(upper)
                yield upper


def is_switched_on(obj: Any) -> bool:
    """Return True if the object's own ``Visibility`` hides neither it nor its contents.

    A plain folder hides nothing: FreeCAD's window hides each object in it, and each object remembers that.
    """
    return own(obj, "Visibility") is not False or kind_of(obj) is Kind.FOLDER


class Tree:
    """All that lies in a container at any depth within its own file, each object once.

    holders
        the containers that an object lies in: one, or each of the link groups that show it. FreeCAD lists
        what lies in a folder in the part around the folder as well; the innermost is meant.
    """

    def __init__(self, container: Any, key: KeyOf, closed: Callable[[Any, Kind], bool]) -> None:
        self.top = key(container)
        self.members: dict[Key, tuple[Any, Kind]] = {}
        self.holders: dict[Key, tuple[Key, ...]] = {}
        self._times: dict[Key, int] = {self.top: 1}
        self._visible: dict[Key, bool] = {self.top: True}
        self._in_top = (self.top,)
        several = []
        way = [(self._in_top, iter(members(container)))]
        open_now = {self.top}
        while way:
            holder, rest = way[-1]
            obj = next(rest, None)
            if obj is None:
                open_now.discard(way.pop()[0][0])
                continue
            name = key(obj)
            if (outers := self.holders.get(name)) is not None:
                if holder[0] not in outers and name not in open_now:
                    self.holders[name] = outers + holder
                    several.append(name)
                continue
            kind = kind_of(obj)
            if name in open_now or (kind is Kind.LINK_GROUP and object_name(obj).startswith(COPIES)):
                continue
            self.members[name] = (obj, kind)
            self.holders[name] = holder
            if kind in INLINE and not closed(obj, kind):
                open_now.add(name)
                way.append(((name,), iter(members(obj))))
        for name in several:
            self.holders[name] = self._innermost(self.holders[name])

    def _innermost(self, holders: tuple[Key, ...]) -> tuple[Key, ...]:
        groups = tuple(
            holder for holder in holders if holder != self.top and self.members[holder][1] is Kind.LINK_GROUP
        )
        if groups or len(holders) < 2:
            return groups or holders
        around = {upper for holder in holders for upper in self.above(holder)}
        return (min([holder for holder in holders if holder not in around] or holders),)

    def above(self, name: Key) -> list[Key]:
        """Return the containers around a member, the innermost first; only the first of several link
        groups.
        """
        if self.holders.get(name) == self._in_top:  # as most are
            return [self.top]
        return list(climbed(name, lambda key: self.holders.get(key, ())[:1]))

    def around(self, name: Key) -> list[Key]:
        """Return the containers around a member, without the top."""
        if self.holders.get(name) == self._in_top:
            return []
        return [key for key in self.above(name) if key != self.top]

    def times(self, name: Key) -> int:
        """Return how often the container shows a member; 0 if it, or a container around it, is left out."""
        return self._climbed(name, self._times, lambda obj, above: 0 if left_out_by(obj) else sum(above))

    def visible(self, name: Key) -> bool:
        """Return True if a member is visible and lies in visible containers."""
        return self._climbed(name, self._visible, lambda obj, above: is_switched_on(obj) and any(above))

    def _climbed(self, name: Key, reached: dict[Key, T], of: Callable[[Any, list[T]], T]) -> T:
        """Find a fact of a member that follows from the member and the containers around it, without
        recursion.
        """
        if name not in reached and self.holders[name] == self._in_top:
            reached[name] = of(self.members[name][0], [reached[self.top]])
        way = [name] if name not in reached else []
        while way:
            holders = self.holders[way[-1]] if way[-1] not in reached else ()
            if unknown := [holder for holder in holders if holder not in reached and holder not in way]:
                way.append(unknown[0])
            else:
                last = way.pop()
                if last not in reached:
                    above = [reached[holder] for holder in holders if holder in reached]
                    reached[last] = of(self.members[last][0], above)
        return reached[name]

    def paths(self, name: Key) -> Iterator[tuple[Any, ...]]:
        """Yield the containers around a member, outermost first, once for each way to it."""
        for holder in self.holders[name]:
            if holder == self.top:
                yield ()
                continue
            obj = self.members[holder][0]
            if not left_out_by(obj):
                for upper in self.paths(holder):
                    yield (*upper, obj)


# --- the way to a component ---


def chains(count: Count, tree: Tree | None) -> Iterator[tuple[tuple[Any, int], ...]]:
    """Yield each way from the assembly to the component: the objects on it, and how often each shows the next
    one.
    """
    starts: Iterable[tuple[Any, ...]] = [()]
    if tree is not None and not count.beside:
        starts = tree.paths(count.shown.key)
    for holders in starts:
        for rest in _below(count.shown, count.key):
            yield (*((holder, 1) for holder in holders), *rest)


def _below(node: Contribution, wanted: Key) -> Iterator[tuple[tuple[Any, int], ...]]:
    within = [(inner, times) for inner, times in node.below if wanted in inner.worth]
    if not within or (node.kind is Kind.ASSEMBLY_LINK and wanted == next(iter(node.worth))):
        yield ((node.obj, node.worth[wanted][1]),)
        return
    for inner, times in within:
        paths = node.tree.paths(inner.key) if node.tree is not None else [()]
        for holders in paths:
            for rest in _below(inner, wanted):
                shown = 1 if node.tree is not None else times
                yield ((node.obj, shown), *((holder, 1) for holder in holders), *rest)
