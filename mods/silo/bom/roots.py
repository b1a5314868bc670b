# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which object of a document is the assembly, when nobody says.

In this order: FreeCAD's own ``Assembly::AssemblyObject``, Assembly4's part of ``Type`` "Assembly", an
Assembly3 container, any top-level part that holds links, and at last the document itself where links lie in
no container. An Assembly4 ``Parts`` folder beside the model holds spares and is no root.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from silo.bom.document import derived, label_of, object_name, own, same_document
from silo.bom.errors import InputError
from silo.bom.walk.kinds import COMPONENTS, INLINE, Kind, flattened, is_assembly3, kind_of, no_component
from silo.bom.walk.targets import Inspect, first_of, is_assembly_link, is_excluded, is_link, resolve_target

# What to do where a document holds several assemblies. The window says it in words of its own.
NAME_ONE = "Name the one that is meant (--assembly NAME)."

_CONTAINERS = frozenset({Kind.CONTAINER, Kind.LINK_GROUP, Kind.ASSEMBLY_LINK})
_FOLDERS = frozenset({Kind.FOLDER})


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


def _members_of(objects: Iterable[Any], kinds: frozenset[Kind]) -> set[str]:
    """Names of the objects that lie in some container of these kinds, or are copies such a container made."""
    names: set[str] = set()
    for obj in objects:
        if kind_of(obj) in kinds:
            for property_name in ("Group", "ElementList"):
                names.update(object_name(member) for member in own(obj, property_name) or ())
    return names


def _rank(obj: Any) -> int | None:
    if derived(obj, "Assembly::AssemblyObject"):
        return 0
    if is_assembly3(obj):
        return 1
    if not derived(obj, "App::Part") or is_assembly_link(obj):
        return None
    if own(obj, "Type") == "Assembly":
        return 1
    return 2 if _holds_components(obj) else 3


def _holds_components(obj: Any) -> bool:
    return any(kind in COMPONENTS for _, _, kind in flattened(obj, id))


def find_assemblies(document: Any) -> list[Any]:
    """The top-level containers of a document, the likeliest assembly first (document order within a rank)."""
    return [obj for _, obj in _candidates(document)]


def _candidates(document: Any) -> list[tuple[tuple[int, bool], Any]]:
    objects = list(getattr(document, "Objects", ()) or ())
    inner = _members_of(objects, _CONTAINERS)
    in_folders = _members_of(objects, _FOLDERS)
    found = []
    for obj in objects:
        name = object_name(obj)
        if name in inner or (rank := _rank(obj)) is None:
            continue
        # People sort assemblies into folders too; a plain part in a folder is a spare.
        if name not in in_folders or rank < 2:
            found.append(((rank, name in in_folders), obj))
    return sorted(found, key=lambda candidate: candidate[0])


def choose_assembly(document: Any, name: str | None = None) -> Any:
    """The assembly of a document.

    name
        ``Name`` or ``Label`` of the wanted one, where a document holds several.

    Raises InputError where there is no such object, or where several are equally likely.
    """
    if name is not None:
        return _named(document, name)
    found = _candidates(document)
    best = [obj for standing, obj in found if standing == found[0][0]]
    if best and found[0][0][0] < 3:
        likely = [obj for obj in best if _holds_components(obj)] or best
        if len(likely) > 1:
            raise InputError(f"{_file(document)} holds {len(likely)} assemblies: {_told(likely)}. {NAME_ONE}")
        return likely[0]
    loose = _loose_links(document)
    if loose or not best:
        return DocumentRoot(document, loose)
    return best[0]


def _file(document: Any) -> str:
    return getattr(document, "FileName", "") or getattr(document, "Label", "") or "The document"


def _told(containers: Iterable[Any]) -> str:
    return ", ".join(f"{object_name(obj)} ({label_of(obj)})" for obj in containers) or "none"


def _named(document: Any, name: str) -> Any:
    containers = [obj for obj in getattr(document, "Objects", ()) or () if kind_of(obj) in INLINE]
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


def _loose_links(document: Any) -> list[Any]:
    objects = list(getattr(document, "Objects", ()) or ())
    inner = _members_of(objects, _CONTAINERS)
    wanted = (*COMPONENTS, Kind.LINK_GROUP, Kind.DRAFT_ARRAY, Kind.FOREIGN)
    return [obj for obj in objects if object_name(obj) not in inner and kind_of(obj) in wanted]


def links_beside(top: Any, inspect: Inspect | None = None) -> list[Any]:
    """Links to components of other files that lie in the document of ``top``, but in no container at all.

    They are not counted, and nobody may have noticed. What lies in folders are spares; links that other links
    or arrays of the document show are their sources.
    """
    objects = list(getattr(getattr(top, "Document", None), "Objects", ()) or ())
    if not objects or isinstance(top, DocumentRoot) or is_assembly3(top):
        return []
    inside = _members_of(objects, _CONTAINERS | _FOLDERS)
    loose = [obj for obj in objects if object_name(obj) not in inside and kind_of(obj) in COMPONENTS]
    if not loose:
        return []
    sources = {id(first_of(getattr(obj, "LinkedObject", None))) for obj in objects if is_link(obj)}
    sources |= {id(first_of(own(obj, "Base"))) for obj in objects if kind_of(obj) is Kind.DRAFT_ARRAY}
    return [obj for obj in loose if id(obj) not in sources and _counts(obj, inspect)]


def _counts(link: Any, inspect: Inspect | None) -> bool:
    if own(link, "Suppressed") is True or is_excluded(link):
        return False
    target = resolve_target(link, inspect)
    return (
        target.obj is not None
        and not (target.element or target.excluded or no_component(target.obj))
        and not same_document(target.obj.Document, link.Document)
    )
