# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which object of a document is the assembly when nobody says, and what lies beside it.

In this order: FreeCAD's own ``Assembly::AssemblyObject``, Assembly4's part of ``Type`` "Assembly", an
Assembly3 container, the one top-level part that holds components, and else the document itself, with all that
lies at its root: of several equals none is taken because it came first. Folders of Assembly4 beside the model
(``Parts``, ``Source_shapes``) hold spares and are no roots.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from silo.bom.document import DocumentRoot, derived, first_of, label_of, object_name, own, same_document
from silo.bom.errors import InputError, SeveralAssembliesError
from silo.bom.walk.kinds import (
    COMPONENTS,
    INLINE,
    REPEATERS,
    Kind,
    Survey,
    consumed,
    elements,
    is_assembly3,
    is_named_assembly,
    kind_of,
    left_out_by,
    survey_of,
)
from silo.bom.walk.notes import Notes
from silo.bom.walk.roles import SHOWING, Reader, Reading
from silo.bom.walk.targets import Inspect, is_assembly_link
from silo.bom.walk.tree import COPIES, Contents, Lost, Role, Tree, climbed, is_switched_on

# What to do where a document holds several assemblies. The window says it in words of its own.
NAME_ONE = "Name the one that is meant (--assembly NAME)."

# The rank of a part that holds no components; what it holds makes it likelier.
_HOLDS_NOTHING = 4
# What may show components of other files, standard parts or declared ones.
_SHOWING = SHOWING | {Kind.LOCAL, Kind.FOREIGN, Kind.CONTAINER}
_LOOSE = COMPONENTS | REPEATERS | {Kind.LINK_GROUP, Kind.FOREIGN, Kind.STANDARD}
_BESIDE = COMPONENTS | REPEATERS | {Kind.LINK_GROUP, Kind.STANDARD, Kind.CONTAINER, Kind.LOCAL, Kind.FOREIGN}

Whole = Callable[[Any], Any]
_CONTAINERS = frozenset({Kind.CONTAINER, Kind.LINK_GROUP, Kind.ASSEMBLY_LINK})
_FOLDERS = frozenset({Kind.FOLDER})
# An Assembly3 container with further properties may be taken for an array or a foreign part.
_RANKED = frozenset({Kind.CONTAINER, Kind.DRAFT_ARRAY, Kind.FOREIGN})
_LOCAL = frozenset({Kind.LOCAL})
_SPARES = ("Parts", "Source_shapes")


class _Lying:
    """Where the objects of a document lie: name → the containers and folders that list it.

    Looked at once for a survey that is kept. The survey keeps the tables and not this object, which refers to
    the survey: in a circle both would wait for the collector.
    """

    def __init__(self, survey: Survey) -> None:
        self.survey = survey
        kept = vars(survey)
        if "lying" not in kept:
            kept["lying"] = (*_holders(survey), dict[str, bool]())
        self._holders: dict[str, tuple[Any, Kind]]
        self._above: dict[str, tuple[str, ...]]
        self._inner: dict[str, bool]
        self._holders, self._above, self._inner = kept["lying"]

    def around(self, name: str) -> Iterator[tuple[Any, Kind]]:
        """All containers and folders around an object, at any distance, the nearest first."""
        return (self._holders[upper] for upper in climbed(name, lambda one: self._above.get(one, ())))

    def is_inner(self, name: str) -> bool:
        """True for what lies in a container, also through folders, and for the copies that one made."""
        if name not in self._inner:
            self._inner[name] = any(kind in _CONTAINERS for _, kind in self.around(name))
        return self._inner[name]

    def is_spare(self, obj: Any) -> bool:
        """True for what a folder keeps for later; of visible standard parts only Assembly4's folders do."""
        around = {object_name(one).rstrip("0123456789") for one, _ in self.around(object_name(obj))}
        bought = kind_of(obj) is Kind.STANDARD and self.is_visible(obj)
        return bool(around.intersection(_SPARES) if bought else around)

    def is_visible(self, obj: Any) -> bool:
        """True for what is visible itself and lies in visible containers."""
        return all(
            is_switched_on(one) for one in (obj, *(outer for outer, _ in self.around(object_name(obj))))
        )

    def loose(self, kinds: frozenset[Kind]) -> list[Any]:
        """The objects of these kinds that lie in no container."""
        return [obj for obj, _ in self.survey.of(kinds) if not self.is_inner(object_name(obj))]


def _holders(survey: Survey) -> tuple[dict[str, tuple[Any, Kind]], dict[str, tuple[str, ...]]]:
    """The containers and folders of a document by name; and what lists an object, by the object's name."""
    holders: dict[str, tuple[Any, Kind]] = {}
    above: dict[str, tuple[str, ...]] = {}
    for obj, kind in survey.of(_CONTAINERS | _FOLDERS):
        listed = [one for name in ("Group", "ElementList") for one in own(obj, name) or ()]
        if kind is Kind.CONTAINER and is_assembly3(obj):
            listed += [one for group in listed for one in own(group, "Group") or ()]
        holders[name := object_name(obj)] = (obj, kind)
        alone = (name,)  # one tuple for all that lie in this holder only
        for one in map(object_name, listed):
            above[one] = (*above[one], name) if one in above else alone
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
    """2 for components of other files, 1 for standard or declared parts only, 0 for neither."""
    hardware, shows_others = False, False
    for obj, kind in Tree(container, id_of, lambda _obj, _kind: False).members.values():
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


def id_of(obj: Any) -> tuple[str, str]:
    """What identifies an object within its document."""
    return ("", object_name(obj))


def _is_far(target: Any, container: Any) -> bool:
    """True for a component of another file, also for one that is missing there."""
    return isinstance(target, Lost) or not same_document(target.Document, container.Document)


def find_assemblies(document: Any) -> list[Any]:
    """The top-level containers of a document, the likeliest assembly first (document order within a rank)."""
    return [obj for _, obj in _candidates(_Lying(survey_of(document)))]


_Candidates = list[tuple[tuple[int, bool], Any]]


def _candidates(lying: _Lying) -> _Candidates:
    reader = silent_reader()
    found = []
    for obj in lying.loose(_RANKED):
        if (rank := _rank(obj, reader)) is None:
            continue
        # People sort assemblies into folders too; a plain part in a folder is a spare.
        in_folder = any(lying.around(object_name(obj)))
        if not in_folder or rank < 2:
            found.append(((rank, in_folder), obj))
    return sorted(found, key=lambda candidate: candidate[0])


def silent_reader(
    *, hardware: bool = True, counts_beside: bool = False, inspect: Inspect | None = None
) -> Reader:
    """For a look at documents whose findings nobody needs twice."""

    def path_of(obj: Any) -> str:
        return getattr(getattr(obj, "Document", None), "FileName", "") or ""

    def key(obj: Any) -> tuple[str, str]:
        return (path_of(obj), object_name(obj))

    silent = Reader(Notes(path_of), key, inspect, hardware=hardware)
    if not counts_beside:
        return silent
    return Reader(
        Notes(path_of), key, inspect, beside=lambda top: loose_hardware(top, silent), hardware=hardware
    )


def choose_assembly(document: Any, name: str | None = None) -> Any:
    """The assembly of a document.

    name
        ``Name`` or ``Label`` of the wanted one, where a document holds several.

    Raises InputError where there is no such object, or where several are equally likely.
    """
    if name is not None:
        return _named(document, name)
    lying = _Lying(survey_of(document))
    found = _candidates(lying)
    likely = _likely(found)
    if len(likely) > 1 and found[0][0][0] < 2:
        told = f"{_file(document)} holds {len(likely)} assemblies: {_told(likely)}. {NAME_ONE}"
        raise SeveralAssembliesError(told, document.FileName, list(map(object_name, likely)))
    return likely[0] if len(likely) == 1 else _root_or_part(document, lying, found)


def _likely(found: _Candidates) -> list[Any]:
    """The containers that may be the assembly: real assemblies, and parts that hold components."""
    if not found or found[0][0][0] > _HOLDS_NOTHING - 2:
        return []
    reader = silent_reader()
    best = [obj for standing, obj in found if standing == found[0][0]]
    return [obj for obj in best if _holds(obj, reader) == 2] or best


def _root_or_part(document: Any, lying: _Lying, found: _Candidates) -> Any:
    """The one part of a file that has nothing else to count, or the document with all that lies in it."""
    best = [obj for standing, obj in found if standing == found[0][0]]
    loose = lying.loose(_LOOSE)
    bodies = _loose_bodies(lying)
    is_plain = bool(found) and found[0][0][0] == _HOLDS_NOTHING
    if len(best) == 1 and not loose and not (bodies and is_plain):
        return best[0]
    return DocumentRoot(document, [*(obj for _, obj in found), *loose, *bodies])


def _file(document: Any) -> str:
    return getattr(document, "FileName", "") or getattr(document, "Label", "") or "The document"


def _told(containers: Iterable[Any]) -> str:
    return ", ".join(f"{object_name(obj)} ({label_of(obj)})" for obj in containers) or "none"


def _named(document: Any, name: str) -> Any:
    containers = [obj for obj, _ in survey_of(document).of(INLINE)]
    for attribute in ("Name", "Label"):
        matching = [obj for obj in containers if getattr(obj, attribute, None) == name]
        if len(matching) == 1:
            return matching[0]
        if matching:
            raise InputError(
                f"{_file(document)} holds {len(matching)} assemblies labelled {name!r}; give the name of the "
                f"one that is meant instead: {_told(matching)}."
            )
    raise InputError(f"{_file(document)} has no assembly named {name!r}; it has: {_told(containers)}.")


def _loose_bodies(lying: _Lying) -> list[Any]:
    """The geometry that lies in no container, no Body and no feature; of that the visible, where any is."""
    loose = lying.loose(_LOCAL)
    if len(loose) > 1:  # to ask every feature costs more than all the rest
        inner = lying.survey.grouped(_LOCAL)
        loose = [obj for obj in loose if object_name(obj) not in inner]
    if len(loose) > 1:
        eaten = consumed([obj for obj, _ in lying.survey.of(_LOCAL)], object_name)
        loose = [obj for obj in loose if object_name(obj) not in eaten]
    return [obj for obj in loose if lying.is_visible(obj)] or loose


def as_it_is(document: Any) -> Any:
    """A document that is there with all its objects."""
    return document


def loose_hardware(container: Any, reader: Reader, whole: Whole = as_it_is) -> list[Any]:
    """Visible standard parts beside an assembly, which can only belong to it: it is the one of its file.

    What other objects of the document show are sources, what a feature consumes are operands, and what lies
    in Assembly4's folders are spares.
    """
    if getattr(container, "is_document_root", False):
        return []
    survey = survey_of(whole(container.Document))
    if not survey.has_python():
        return []
    lying = _Lying(survey)
    visible = [obj for obj in lying.loose(frozenset({Kind.STANDARD})) if lying.is_visible(obj)]
    roles = _roles_beside(container, reader, lying, visible, {}) if visible else ()
    if not (loose := [obj for obj, role in roles if role is Role.LOOSE]):
        return []
    likely = _likely(_candidates(lying))
    return loose if list(map(object_name, likely)) == [object_name(container)] else []


def _roles_beside(
    top: Any, reader: Reader, lying: _Lying, objects: Iterable[Any], known: Mapping[str, Role | None]
) -> Iterator[tuple[Any, Role]]:
    """The role of each of some objects that lie in no container, for the assembly ``top``."""
    survey = lying.survey
    shown = {name for _, name in Reading(reader, top).shown_by(survey.of(SHOWING))}
    eaten = consumed([obj for obj, _ in survey.of(_LOCAL)], object_name)
    for obj in objects:
        name = object_name(obj)
        if name in eaten:
            role = Role.OPERAND
        elif name in shown or (
            not lying.is_visible(obj)  # a visible array shows its elements once more
            and any(known.get(object_name(one)) is Role.COMPONENT for one in elements(obj))
        ):
            role = Role.SOURCE
        elif left_out_by(obj):
            role = Role.LEFT_OUT
        elif lying.is_spare(obj):
            role = Role.SPARE
        else:
            role = Role.LOOSE
        yield obj, role


def beside(top: Any, fates: Mapping[str, Role | None]) -> list[Any]:
    """What lies in the document of ``top``, but in no container and no folder, and holds components.

    It is not counted, and nobody may have noticed. Another assembly has a BOM of its own.
    """
    if isinstance(top, DocumentRoot):
        return []
    return [
        obj
        for name, role in fates.items()
        if role is Role.LOOSE and not is_named_assembly(obj := top.Document.getObject(name))
    ]


def seen_beside(top: Any, reader: Reader) -> list[Any]:
    """What FreeCAD shows of the document of ``top``, but no part of it: geometry too, which holds no
    component."""
    lying = _Lying(survey_of(top.Document))
    mine = {object_name(top), *(object_name(obj) for obj, _ in lying.around(object_name(top)))}
    loose = [
        obj
        for obj in (*lying.loose(_LOOSE | {Kind.CONTAINER}), *_loose_bodies(lying))
        if lying.is_visible(obj)
    ]
    roles = _roles_beside(top, reader, lying, loose, {})
    return [obj for obj, role in roles if role is Role.LOOSE and object_name(obj) not in mine]


def fates(top: Any, contents: Contents, reader: Reader) -> dict[str, Role | None]:
    """The role of each object with a shape, a link or a fastener's properties, for the assembly ``top``.

    None breaks the law: a container of the assembly holds the object, and the count does not know it.

    reader
        for a look at what lies beside the assembly.
    """
    survey = survey_of(getattr(top, "Document", None))
    found: dict[str, Role | None] = {name: role for (_, name), role in contents.roles.items()}
    found[object_name(top)] = Role.HOLDER
    if not (left := list(survey.of(_BESIDE | {Kind.ELEMENT}, found.keys()))):
        return found
    lying = _Lying(survey)
    grouped = survey.grouped(_LOCAL)
    outside = {object_name(obj) for obj, _ in lying.around(object_name(top))}
    beside = []
    for obj, kind in left:
        name = object_name(obj)
        if name in outside:  # it holds the assembly
            found[name] = Role.CONSTRUCTION
        elif name.startswith(COPIES) or kind is Kind.ELEMENT or name in grouped:
            found[name] = Role.INSIDE
        elif lying.is_inner(name):
            found[name] = _inside(lying, name, found)
        else:
            beside.append(obj)
    for obj, role in _roles_beside(top, reader, lying, beside, found) if beside else ():
        is_nothing = role is Role.LOOSE and not reader.brings(obj)
        found[object_name(obj)] = Role.CONSTRUCTION if is_nothing else role
    return found


def _inside(lying: _Lying, name: str, known: Mapping[str, Role | None]) -> Role | None:
    """The role of what lies in a container and is no member of the assembly."""
    around = list(lying.around(name))
    if any(is_assembly3(obj) for obj, _ in around):  # its elements and constraints
        return Role.CONSTRUCTION
    if any(kind is Kind.ASSEMBLY_LINK or object_name(obj).startswith(COPIES) for obj, kind in around):
        return Role.INSIDE
    outer = [known.get(object_name(obj), Role.LOOSE) for obj, kind in around if kind is not Kind.FOLDER]
    return None if all(role is Role.HOLDER for role in outer) else Role.INSIDE
