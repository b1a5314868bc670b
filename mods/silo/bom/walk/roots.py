# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which object of a document is the assembly if none is named, and what lies beside it.

In this order: FreeCAD's own ``Assembly::AssemblyObject``, Assembly4's part of ``Type`` "Assembly", an
Assembly3 container, the one top-level part that holds components, and else the document itself, with all that
lies at its root: of several equals none is taken because it came first. Folders of Assembly4 beside the model
(``Parts``, ``Source_shapes``) hold spares and are no roots.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from silo.bom.errors import InputError, SeveralAssembliesError
from silo.bom.message import message
from silo.bom.walk.arrays import elements, left_out_by
from silo.bom.walk.contents import Contents, Lost, ObjectRole
from silo.bom.walk.document import DocumentRoot, derived, first_of, label_of, object_name, own, same_document
from silo.bom.walk.facts import Files
from silo.bom.walk.kinds import (
    COMPONENTS,
    INLINE,
    REPEATERS,
    Kind,
    is_assembly3,
    is_named_assembly,
    kind_of,
    members,
)
from silo.bom.walk.operands import Consumers
from silo.bom.walk.roles import SHOWING, Reader, Reading
from silo.bom.walk.seen import has_view
from silo.bom.walk.survey import Survey, survey_of
from silo.bom.walk.targets import Inspect, is_assembly_link
from silo.bom.walk.tree import COPIES, climbed, is_switched_on

# What to do if a document holds several assemblies. The window says it in its own words.
NAME_ONE = message("Name the right assembly (--assembly NAME).")

# The rank of a part that holds no components; what it holds makes it likelier.
_HOLDS_NOTHING = 4
# What may show components of other files, standard parts or declared ones.
_SHOWING = SHOWING | {Kind.LOCAL, Kind.FOREIGN, Kind.CONTAINER}
_LOOSE = COMPONENTS | REPEATERS | {Kind.LINK_GROUP, Kind.FOREIGN, Kind.STANDARD}
_BESIDE = COMPONENTS | REPEATERS | {Kind.LINK_GROUP, Kind.STANDARD, Kind.CONTAINER, Kind.LOCAL, Kind.FOREIGN}

Whole = Callable[[Any], Any]
_CONTAINERS = frozenset({Kind.CONTAINER, Kind.LINK_GROUP, Kind.ASSEMBLY_LINK})
# An Assembly3 container with further properties may be taken for an array or a foreign part.
_RANKED = frozenset({Kind.CONTAINER, Kind.DRAFT_ARRAY, Kind.FOREIGN})
_LOCAL = frozenset({Kind.LOCAL})
_SPARES = ("Parts", "Source_shapes")


def as_it_is(document: Any) -> Any:
    """Return a document that is open with all its objects."""
    return document


class _Lying:
    """Where the objects of a document lie: name → the containers and folders that list it.

    Looked at once for a survey that is kept. The survey keeps the tables and not this object, which refers to
    the survey: in a circle both would wait for the collector.
    """

    def __init__(self, document: Any, survey: Survey) -> None:
        self.document, self.survey = document, survey
        kept = vars(survey)
        if "lying" not in kept:
            kept["lying"] = (*_holders(survey), dict[str, bool]())
        self._holders: dict[str, tuple[Any, Kind]]
        self._above: dict[str, tuple[str, ...]]
        self._inner: dict[str, bool]
        self._holders, self._above, self._inner = kept["lying"]

    def around(self, name: str) -> Iterator[tuple[Any, Kind]]:
        """Return all containers and folders around an object, at any distance, the nearest first."""
        return (self._holders[upper] for upper in climbed(name, lambda label: self._above.get(label, ())))

    def is_inner(self, name: str) -> bool:
        """Return True for an object in a container, directly or through folders, and for the copies that a
        container made.
        """
        if name not in self._inner:
            self._inner[name] = any(kind in _CONTAINERS for _, kind in self.around(name))
        return self._inner[name]

    def is_spare(self, obj: Any) -> bool:
        """Return True if a folder keeps the object for later; for visible standard parts, only Assembly4's
        folders do.
        """
        around = {object_name(member).rstrip("0123456789") for member, _ in self.around(object_name(obj))}
        bought = kind_of(obj) is Kind.STANDARD and self.is_visible(obj)
        return bool(around.intersection(_SPARES) if bought else around)

    def is_visible(self, obj: Any) -> bool:
        """Return True if the object is visible and lies in visible containers."""
        return all(
            is_switched_on(member) for member in (obj, *(outer for outer, _ in self.around(object_name(obj))))
        )

    def consumers(self) -> Consumers[str]:
        """Return who consumes the objects of the document."""
        kept = vars(self.survey)
        if "consumers" not in kept:
            document = self.document
            features = [obj for obj, _ in self.survey.of(_LOCAL)]
            kept["consumers"] = Consumers(features, object_name, lambda: has_view(document))
        eaten: Consumers[str] = kept["consumers"]
        return eaten

    def is_eaten(self, obj: Any) -> bool:
        """Return True if a feature consumes an object."""
        return self.consumers().of(object_name(obj), lambda: self.is_visible(obj)) is not None

    def loose(self, kinds: frozenset[Kind]) -> list[Any]:
        """Return the objects of these kinds that lie in no container."""
        return [obj for obj, _ in self.survey.of(kinds) if not self.is_inner(object_name(obj))]


def _lying_in(document: Any) -> _Lying:
    return _Lying(document, survey_of(document))


def _holders(survey: Survey) -> tuple[dict[str, tuple[Any, Kind]], dict[str, tuple[str, ...]]]:
    """Return the containers and folders of a document by name, and the names of those that list an object, by
    its name.
    """
    holders: dict[str, tuple[Any, Kind]] = {}
    above: dict[str, tuple[str, ...]] = {}
    for obj, kind in survey.of(_CONTAINERS | {Kind.FOLDER}):
        listed = [member for name in ("Group", "ElementList") for member in own(obj, name) or ()]
        if kind is Kind.CONTAINER and is_assembly3(obj):
            listed += [member for group in listed for member in own(group, "Group") or ()]
        holders[name := object_name(obj)] = (obj, kind)
        alone = (name,)  # one tuple for all that lie in this holder only
        for inner in map(object_name, listed):
            above[inner] = (*above[inner], name) if inner in above else alone
    return holders, above


def _rank(obj: Any, reader: Reader) -> int | None:
    if derived(obj, "Assembly::AssemblyObject"):
        return 0
    if is_assembly3(obj):
        return 1
    if not derived(obj, "App::Part") or is_assembly_link(obj):
        return None
    if own(obj, "Type") == "Assembly":
        return 1
    return _HOLDS_NOTHING - _holds(obj, reader)


def _holds(container: Any, reader: Reader) -> int:
    """Return 2 if a container holds components of other files, 1 if only standard or declared parts, 0 if
    neither.
    """
    hardware, shows_others = False, False
    for obj in climbed(
        container, lambda member: members(member) if member is container or _is_walked(member) else ()
    ):
        kind = kind_of(obj)
        if kind in COMPONENTS:
            target = first_of(getattr(obj, "LinkedObject", None))
            # A broken link stands for a component as well.
            if target is None or not same_document(target.Document, container.Document):
                return 2
        hardware = hardware or (kind is Kind.STANDARD and not left_out_by(obj))
        shows_others = shows_others or kind in _SHOWING
    if not shows_others:
        return 1 if hardware else 0
    brought = reader.contents(container).counts
    far = any(_is_far(count.target, container) for count in brought)
    return 2 if far else 1 if brought else 0


def _is_walked(obj: Any) -> bool:
    return kind_of(obj) in INLINE and not object_name(obj).startswith(COPIES)


def _is_far(target: Any, container: Any) -> bool:
    """Return True for a component of another file, even if that is missing."""
    return isinstance(target, Lost) or not same_document(target.Document, container.Document)


def find_assemblies(document: Any) -> list[Any]:
    """Return the top-level containers of a document, the likeliest assembly first (equal ones in document
    order).
    """
    return [obj for _, obj in _candidates(_lying_in(document))]


_Candidates = list[tuple[tuple[int, bool], Any]]


def _candidates(lying: _Lying) -> _Candidates:
    reader = silent_reader()
    candidates = []
    for obj in lying.loose(_RANKED):
        if (rank := _rank(obj, reader)) is None:
            continue
        # People sort assemblies into folders too; a plain part in a folder is a spare.
        in_folder = any(lying.around(object_name(obj)))
        if not in_folder or rank < 2:
            candidates.append(((rank, in_folder), obj))
    return sorted(candidates, key=lambda candidate: candidate[0])


def silent_reader(
    files: Files | None = None,
    *,
    hardware: bool = True,
    counts_beside: bool = False,
    inspect: Inspect | None = None,
    whole: Whole = as_it_is,
) -> Reader:
    """Return a reader that records no findings.

    counts_beside
        visible standard parts beside a file's only assembly count with it.
    """
    files = files or Files()
    silent = Reader(inspect, files, hardware=hardware)
    if not counts_beside:
        return silent
    return Reader(inspect, files, beside=lambda top: loose_hardware(top, silent, whole), hardware=hardware)


def choose_assembly(document: Any, name: str | None = None) -> Any:
    """Choose the assembly of a document.

    name
        ``Name`` or ``Label`` of the wanted assembly, if a document holds several.

    Raises InputError if there is no such object, or if several are equally likely.
    """
    if name is not None:
        return _named(document, name)
    lying = _lying_in(document)
    candidates = _candidates(lying)
    likely = _likely(candidates)
    if len(likely) > 1 and candidates[0][0][0] < 2:
        text = message(
            "{document} holds {count} assemblies: {likely}. {name_one}",
            document=_file(document),
            count=len(likely),
            likely=_names_of(likely),
            name_one=NAME_ONE,
        )
        raise SeveralAssembliesError(text, document.FileName, list(map(object_name, likely)))
    return likely[0] if len(likely) == 1 else _root_or_part(document, lying, candidates)


def _likely(candidates: _Candidates) -> list[Any]:
    """Return the containers that may be the assembly: real assemblies, or parts that hold components."""
    if not candidates or candidates[0][0][0] > _HOLDS_NOTHING - 2:
        return []
    reader = silent_reader()
    best = [obj for standing, obj in candidates if standing == candidates[0][0]]
    return [obj for obj in best if len(best) > 1 and _holds(obj, reader) == 2] or best


def _root_or_part(document: Any, lying: _Lying, candidates: _Candidates) -> Any:
    """Return the one part of a file with nothing else to count; otherwise the document with all that lies in
    it.
    """
    best = [obj for standing, obj in candidates if standing == candidates[0][0]]
    loose = lying.loose(_LOOSE)
    bodies = _loose_bodies(lying)
    is_plain = bool(candidates) and candidates[0][0][0] == _HOLDS_NOTHING
    if len(best) == 1 and not loose and not (bodies and is_plain):
        return best[0]
    return DocumentRoot(document, [*(obj for _, obj in candidates), *loose, *bodies])


def _file(document: Any) -> str:
    return getattr(document, "FileName", "") or getattr(document, "Label", "") or message("The document")


def _names_of(containers: Iterable[Any]) -> str:
    return ", ".join(f"{object_name(obj)} ({label_of(obj)})" for obj in containers) or "none"


def _named(document: Any, name: str) -> Any:
    containers = [obj for obj, _ in survey_of(document).of(INLINE)]
    for attribute in ("Name", "Label"):
        matching = [obj for obj in containers if getattr(obj, attribute, None) == name]
        if len(matching) == 1:
            return matching[0]
        if matching:
            raise InputError(
                message(
                    "{document} holds {count} assemblies labelled {name}; give the name of the right "
                    "assembly instead: {matching}.",
                    document=_file(document),
                    count=len(matching),
                    name=repr(name),
                    matching=_names_of(matching),
                )
            )
    raise InputError(
        message(
            "{document} has no assembly named {name}; it has: {containers}.",
            document=_file(document),
            name=repr(name),
            containers=_names_of(containers),
        )
    )


def _loose_bodies(lying: _Lying) -> list[Any]:
    """Return the geometry in no container, Body or feature."""
    loose = lying.loose(_LOCAL)
    if len(loose) > 1:  # to ask every feature costs more than all the rest
        inner = lying.survey.grouped(_LOCAL)
        loose = [obj for obj in loose if object_name(obj) not in inner]
    if len(loose) > 1:
        loose = [obj for obj in loose if not lying.is_eaten(obj)]
    return loose


def loose_hardware(container: Any, reader: Reader, whole: Whole = as_it_is) -> list[Any]:
    """Return the visible standard parts beside an assembly; they belong to it, if it is the only assembly of
    its file.

    Parts that other objects of the document show are sources, parts that a feature consumes are operands, and
    parts in Assembly4's folders are spares; none of these are returned.
    """
    if getattr(container, "is_document_root", False):
        return []
    document = whole(container.Document)
    survey = survey_of(document)
    if not survey.has_python():
        return []
    lying = _Lying(document, survey)
    visible = [obj for obj in lying.loose(frozenset({Kind.STANDARD})) if lying.is_visible(obj)]
    roles = _roles_beside(container, reader, lying, visible, {}) if visible else ()
    if not (loose := [obj for obj, role in roles if role is ObjectRole.LOOSE]):
        return []
    likely = _likely(_candidates(lying))
    return loose if list(map(object_name, likely)) == [object_name(container)] else []


def _roles_beside(
    top: Any, reader: Reader, lying: _Lying, objects: Iterable[Any], roles: Mapping[str, ObjectRole | None]
) -> Iterator[tuple[Any, ObjectRole]]:
    """Yield the role that each of these objects, which lie in no container, has for the assembly ``top``."""
    survey = lying.survey
    shown = {name for _, name in Reading(reader, top).shown_by(survey.of(SHOWING))}
    for obj in objects:
        name = object_name(obj)
        if lying.is_eaten(obj):
            role = ObjectRole.OPERAND
        elif name in shown or (
            not lying.is_visible(obj)  # a visible array shows its elements once more
            and any(roles.get(object_name(element)) is ObjectRole.COMPONENT for element in elements(obj))
        ):
            role = ObjectRole.SOURCE
        elif left_out_by(obj):
            role = ObjectRole.LEFT_OUT
        elif lying.is_spare(obj):
            role = ObjectRole.SPARE
        else:
            role = ObjectRole.LOOSE
        yield obj, role


def beside(top: Any, fates: Mapping[str, ObjectRole | None]) -> list[Any]:
    """Return the objects in the document of ``top`` that lie in no container or folder and hold components.

    They are not counted, and that may not have been noticed. Another assembly has its own BOM.
    """
    if isinstance(top, DocumentRoot):
        return []
    return [
        obj
        for name, role in fates.items()
        if role is ObjectRole.LOOSE and not is_named_assembly(obj := top.Document.getObject(name))
    ]


def seen_beside(top: Any, reader: Reader) -> list[Any]:
    """Return what FreeCAD shows of the document of ``top`` beside it: also geometry, which holds no
    component.
    """
    lying = _lying_in(top.Document)
    mine = {object_name(top), *(object_name(obj) for obj, _ in lying.around(object_name(top)))}
    loose = [
        obj
        for obj in (*lying.loose(_LOOSE | {Kind.CONTAINER}), *_loose_bodies(lying))
        if lying.is_visible(obj)
    ]
    roles = _roles_beside(top, reader, lying, loose, {})
    return [obj for obj, role in roles if role is ObjectRole.LOOSE and object_name(obj) not in mine]


def fates(top: Any, contents: Contents, reader: Reader) -> dict[str, ObjectRole | None]:
    """Find the role of each object with a shape, a link or a fastener's properties, for the assembly ``top``.

    None breaks the law: a container of the assembly holds the object, and the count does not know it.

    reader
        for a look at what lies beside the assembly.
    """
    survey = survey_of(getattr(top, "Document", None))
    roles: dict[str, ObjectRole | None] = {name: role for (_, name), role in contents.roles.items()}
    roles[object_name(top)] = ObjectRole.HOLDER
    if not (others := list(survey.of(_BESIDE | {Kind.ELEMENT}, roles.keys()))):
        return roles
    lying = _Lying(top.Document, survey)
    grouped = survey.grouped(_LOCAL)
    outside = {object_name(obj) for obj, _ in lying.around(object_name(top))}
    beside = []
    for obj, kind in others:
        name = object_name(obj)
        if name in outside:  # it holds the assembly
            roles[name] = ObjectRole.CONSTRUCTION
        elif name.startswith(COPIES) or kind is Kind.ELEMENT or name in grouped:
            roles[name] = ObjectRole.INSIDE
        elif lying.is_inner(name):
            roles[name] = _inside(lying, name, roles)
        else:
            beside.append(obj)
    for obj, role in _roles_beside(top, reader, lying, beside, roles) if beside else ():
        is_nothing = role is ObjectRole.LOOSE and not reader.brings(obj)
        roles[object_name(obj)] = ObjectRole.CONSTRUCTION if is_nothing else role
    return roles


def _inside(lying: _Lying, name: str, roles: Mapping[str, ObjectRole | None]) -> ObjectRole | None:
    """Return the role of an object that lies in a container and is no member of the assembly."""
    around = list(lying.around(name))
    if any(is_assembly3(obj) for obj, _ in around):  # its elements and constraints
        return ObjectRole.CONSTRUCTION
    if any(kind is Kind.ASSEMBLY_LINK or object_name(obj).startswith(COPIES) for obj, kind in around):
        return ObjectRole.INSIDE
    outer = [roles.get(object_name(obj), ObjectRole.LOOSE) for obj, kind in around if kind is not Kind.FOLDER]
    return None if all(role is ObjectRole.HOLDER for role in outer) else ObjectRole.INSIDE
