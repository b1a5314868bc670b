# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which object of a document is the assembly, when nobody says.

In this order: FreeCAD's own ``Assembly::AssemblyObject``, Assembly4's part of ``Type`` "Assembly", an
Assembly3 container, any top-level part that holds links, and at last the document itself where links lie in
no container. An Assembly4 ``Parts`` folder beside the model holds spares and is no root.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence, Set
from typing import Any

from silo.bom.document import derived, label_of, object_name, own, same_document
from silo.bom.errors import InputError
from silo.bom.walk.arrays import left_out_by
from silo.bom.walk.consumed import consumed
from silo.bom.walk.contents import Reader
from silo.bom.walk.counts import Lost
from silo.bom.walk.kinds import (
    COMPONENTS,
    INLINE,
    REPEATERS,
    Kind,
    Survey,
    flattened,
    is_assembly3,
    is_named_assembly,
    kind_of,
    sources,
    survey_of,
)
from silo.bom.walk.notes import Notes
from silo.bom.walk.targets import first_of, is_assembly_link

# What to do where a document holds several assemblies. The window says it in words of its own.
NAME_ONE = "Name the one that is meant (--assembly NAME)."

# The rank of a part that holds no components; what it holds makes it likelier.
_HOLDS_NOTHING = 4
# What may show components of other files, standard parts or declared ones.
_SHOWING = COMPONENTS | REPEATERS | {Kind.ELEMENT, Kind.LOCAL, Kind.FOREIGN, Kind.CONTAINER}
_LOOSE = COMPONENTS | REPEATERS | {Kind.LINK_GROUP, Kind.FOREIGN, Kind.STANDARD}
_HARDWARE = REPEATERS | {Kind.LINK, Kind.LINK_GROUP, Kind.STANDARD}
_BESIDE = COMPONENTS | REPEATERS | {Kind.LINK_GROUP, Kind.STANDARD, Kind.CONTAINER, Kind.LOCAL, Kind.FOREIGN}

Whole = Callable[[Any], Any]
_CONTAINERS = frozenset({Kind.CONTAINER, Kind.LINK_GROUP, Kind.ASSEMBLY_LINK})
_FOLDERS = frozenset({Kind.FOLDER})
# An Assembly3 container with further properties may be taken for an array or a foreign part.
_RANKED = frozenset({Kind.CONTAINER, Kind.DRAFT_ARRAY, Kind.FOREIGN})
_LOCAL = frozenset({Kind.LOCAL})


class DocumentRoot:
    """The document itself as a container, for links that lie in no assembly and no part."""

    is_document_root = True

    def __init__(self, document: Any, group: Sequence[Any]) -> None:
        self.Document = document
        self.Name = ""
        self.Label = getattr(document, "Label", "") or getattr(document, "FileName", "")
        self.Group = tuple(group)

    def isDerivedFrom(self, _type_name: str, /) -> bool:
        return False


def _members_of(survey: Survey, kinds: Set[Kind]) -> set[str]:
    """Names of the objects that lie in some container of these kinds, or are copies such a container made.

    Also through folders: a part lists what lies in its folders, a link group does not.
    """
    objects = survey.of(kinds | _FOLDERS)
    held = {
        object_name(obj): [
            object_name(one) for name in ("Group", "ElementList") for one in own(obj, name) or ()
        ]
        for obj, _ in objects
    }
    folders = {object_name(obj) for obj, kind in objects if kind is Kind.FOLDER}
    names: set[str] = set()
    further = [object_name(obj) for obj, kind in objects if kind in kinds]
    while further:
        inside = [name for name in held[further.pop()] if name not in names]
        names.update(inside)
        further += [name for name in inside if name in folders]
    return names


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
    for _, obj, kind in flattened(container, id):
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


def _is_far(target: Any, container: Any) -> bool:
    """True for a component of another file, also for one that is missing there."""
    return isinstance(target, Lost) or not same_document(target.Document, container.Document)


def find_assemblies(document: Any) -> list[Any]:
    """The top-level containers of a document, the likeliest assembly first (document order within a rank)."""
    return [obj for _, obj in _candidates(survey_of(document))]


def _candidates(survey: Survey) -> list[tuple[tuple[int, bool], Any]]:
    objects = survey.of(_RANKED)
    if not objects:
        return []
    inner = _members_of(survey, _CONTAINERS)
    in_folders = _members_of(survey, _FOLDERS)
    reader = silent_reader()
    found = []
    for obj, _ in objects:
        name = object_name(obj)
        if name in inner or (rank := _rank(obj, reader)) is None:
            continue
        # People sort assemblies into folders too; a plain part in a folder is a spare.
        if name not in in_folders or rank < 2:
            found.append(((rank, name in in_folders), obj))
    return sorted(found, key=lambda candidate: candidate[0])


def silent_reader(*, hardware: bool = True, declare: Set[str] = frozenset()) -> Reader:
    """For a look at documents whose findings nobody needs twice.

    declare
        names of objects that are taken as declared.
    """

    def path_of(obj: Any) -> str:
        return getattr(getattr(obj, "Document", None), "FileName", "") or ""

    return Reader(
        Notes(path_of), lambda obj: (path_of(obj), object_name(obj)), None, hardware=hardware, declare=declare
    )


def choose_assembly(document: Any, name: str | None = None) -> Any:
    """The assembly of a document.

    name
        ``Name`` or ``Label`` of the wanted one, where a document holds several.

    Raises InputError where there is no such object, or where several are equally likely.
    """
    if name is not None:
        return _named(document, name)
    survey = survey_of(document)
    found = _candidates(survey)
    likely = _likely(found)
    if len(likely) > 1:
        raise InputError(f"{_file(document)} holds {len(likely)} assemblies: {_told(likely)}. {NAME_ONE}")
    return likely[0] if likely else _root_or_part(document, survey, found)


_Candidates = list[tuple[tuple[int, bool], Any]]


def _likely(found: _Candidates) -> list[Any]:
    """The containers that may be the assembly: real assemblies, and parts that hold components."""
    if not found or found[0][0][0] > _HOLDS_NOTHING - 2:
        return []
    reader = silent_reader()
    best = [obj for standing, obj in found if standing == found[0][0]]
    return [obj for obj in best if _holds(obj, reader) == 2] or best


def _root_or_part(document: Any, survey: Survey, found: _Candidates) -> Any:
    """The one part of a file that has nothing else to count, or the document itself."""
    best = [obj for standing, obj in found if standing == found[0][0]]
    loose = _loose(survey, _LOOSE)
    holds_hardware = bool(found) and found[0][0][0] < _HOLDS_NOTHING
    if best and not loose and (len(best) == 1 or not holds_hardware):
        return best[0]
    parts = best if holds_hardware else []
    if not loose and not parts:
        # A file with one body is that part; of several, each may be declared.
        bodies = _loose_local(survey)
        loose = bodies if len(bodies) > 1 else []
    return DocumentRoot(document, [*parts, *loose])


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


def _loose(survey: Survey, kinds: Set[Kind]) -> list[Any]:
    """The objects of these kinds that lie in no container."""
    if not survey.of(kinds):
        return []
    return [obj for obj, _ in survey.of(kinds, _members_of(survey, _CONTAINERS))]


def _loose_local(survey: Survey) -> list[Any]:
    """The geometry that lies in no container, no Body and no feature."""
    inner = _members_of(survey, _CONTAINERS) | survey.grouped(_LOCAL)
    loose = [obj for obj, _ in survey.of(_LOCAL, inner)]
    if len(loose) > 1:  # to ask every feature costs more than all the rest
        eaten = consumed([obj for obj, _ in survey.of(_LOCAL)], object_name)
        loose = [obj for obj in loose if object_name(obj) not in eaten]
    return loose


def as_it_is(document: Any) -> Any:
    """A document that is there with all its objects."""
    return document


def _spares(survey: Survey) -> set[str]:
    """Names of what lies in Assembly4's folder ``Parts``."""
    folders = [obj for obj, _ in survey.of(_FOLDERS) if object_name(obj) == "Parts"]
    return {
        object_name(one)
        for obj in folders
        for name in ("Group", "ElementList")
        for one in own(obj, name) or ()
    }


def _sources_of(survey: Survey) -> set[str]:
    """Names of the objects that links, arrays and compounds of the document show."""
    names = set()
    for obj, kind in survey.of(COMPONENTS | {Kind.DRAFT_ARRAY, Kind.COMPOUND}):
        shown = [first_of(getattr(obj, "LinkedObject", None))] if kind in COMPONENTS else sources(obj)
        names |= {
            object_name(one) for one in shown if one is not None and same_document(one.Document, obj.Document)
        }
    return names


def loose_hardware(container: Any, reader: Reader, whole: Whole = as_it_is) -> list[Any]:
    """Standard parts beside an assembly, which can only belong to it: it is the one assembly of its file.

    Single ones, arrays, compounds and links of them, also in folders. What other objects of the document
    show are sources, and what lies in Assembly4's folder ``Parts`` are spares.
    """
    if isinstance(container, DocumentRoot) or getattr(container, "is_document_root", False):
        return []
    survey = survey_of(whole(container.Document))
    if not survey.has_python():
        return []
    loose = _loose(survey, _HARDWARE)
    if not loose:
        return []
    aside = _spares(survey) | _sources_of(survey)
    aside.update(consumed([obj for obj, _ in survey.of(_LOCAL)], object_name))
    loose = [obj for obj in loose if object_name(obj) not in aside and _is_hardware(obj, reader)]
    if not loose:
        return []
    likely = _likely(_candidates(survey))
    is_the_one = len(likely) == 1 and object_name(likely[0]) == object_name(container)
    return loose if is_the_one else []


def _is_hardware(obj: Any, reader: Reader) -> bool:
    brought = reader.brings(obj)
    return bool(brought) and all(
        kind_of(one) is Kind.STANDARD and same_document(one.Document, obj.Document) for one in brought
    )


def beside(top: Any, reader: Reader) -> list[Any]:
    """What lies in the document of ``top``, but in no container, and holds components.

    It is not counted, and nobody may have noticed. What lies in folders are spares; what other objects of the
    document show are their sources; another assembly has a BOM of its own.
    """
    if isinstance(top, DocumentRoot) or is_assembly3(top):
        return []
    survey = survey_of(getattr(top, "Document", None))
    inside = _members_of(survey, _CONTAINERS | _FOLDERS) | {object_name(top)}
    loose = [obj for obj, _ in survey.of(_BESIDE, inside) if not is_named_assembly(obj)]
    if not loose:
        return []
    shown = _sources_of(survey)
    counted = {object_name(obj) for obj in loose_hardware(top, reader)}
    return [
        obj
        for obj in loose
        if object_name(obj) not in shown | counted
        and not _holds_object(obj, top)
        and not left_out_by(obj)
        and reader.brings(obj)
    ]


def _holds_object(container: Any, obj: Any) -> bool:
    """True where the chosen assembly lies in this container, which then is not beside it."""
    wanted = object_name(obj)
    return kind_of(container) in INLINE and any(
        name == wanted for name, _, _ in flattened(container, object_name)
    )
