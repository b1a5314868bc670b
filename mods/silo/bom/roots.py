# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which object of a document is the assembly, when nobody says.

In this order: FreeCAD's own ``Assembly::AssemblyObject``, Assembly4's part of ``Type`` "Assembly", an
Assembly3 container, any top-level part that holds links, and at last the document itself where links lie in
no container. An Assembly4 ``Parts`` folder beside the model holds spares and is no root.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from silo.bom.document import derived, label_of, object_name, own
from silo.bom.errors import InputError
from silo.bom.kinds import Kind, is_assembly3, kind_of, members
from silo.bom.targets import is_assembly_link


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


def _claimed(objects: Iterable[Any]) -> set[str]:
    """Names of the objects that lie in some container of the document, or are copies a container made."""
    names: set[str] = set()
    for obj in objects:
        kind = kind_of(obj)
        if kind in (Kind.CONTAINER, Kind.LINK_GROUP, Kind.ASSEMBLY_LINK) or derived(
            obj, "App::DocumentObjectGroup"
        ):
            names.update(object_name(member) for member in own(obj, "Group") or ())
            names.update(object_name(member) for member in own(obj, "ElementList") or ())
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
    wanted = (Kind.LINK, Kind.ASSEMBLY_LINK, Kind.LINK_GROUP, Kind.DRAFT_ARRAY)
    return any(
        kind in wanted or (kind is Kind.CONTAINER and _holds_components(member))
        for member in members(obj)
        for kind in (kind_of(member),)
    )


def find_assemblies(document: Any) -> list[Any]:
    """The top-level containers of a document, the likeliest assembly first (document order within a rank)."""
    objects = list(getattr(document, "Objects", ()) or ())
    claimed = _claimed(objects)
    ranked = [
        (rank, obj) for obj in objects if object_name(obj) not in claimed and (rank := _rank(obj)) is not None
    ]
    return [obj for _, obj in sorted(ranked, key=lambda pair: pair[0])]


def choose_assembly(document: Any, name: str | None = None) -> Any:
    """The assembly of a document.

    name
        ``Name`` or ``Label`` of the wanted one, where a document holds several.

    Raises InputError where there is no such object, or where several are equally likely.
    """
    if name is not None:
        return _named(document, name)
    found = find_assemblies(document)
    loose = _loose_links(document)
    best = [obj for obj in found if _rank(obj) == _rank(found[0])] if found else []
    if best and _rank(best[0]) in (0, 1, 2):
        likely = [obj for obj in best if _holds_components(obj)] or best
        if len(likely) > 1:
            names = ", ".join(f"{object_name(obj)} ({label_of(obj)})" for obj in likely)
            raise InputError(
                f"{_file(document)} holds {len(likely)} assemblies: {names}. Name the one that is meant "
                "(--assembly NAME)."
            )
        return likely[0]
    if loose:
        return DocumentRoot(document, loose)
    if best:
        return best[0]
    return DocumentRoot(document, ())


def _file(document: Any) -> str:
    return getattr(document, "FileName", "") or getattr(document, "Label", "") or "The document"


def _named(document: Any, name: str) -> Any:
    containers = [obj for obj in getattr(document, "Objects", ()) or () if kind_of(obj) is Kind.CONTAINER]
    for attribute in ("Name", "Label"):
        matching = [obj for obj in containers if getattr(obj, attribute, None) == name]
        if len(matching) == 1:
            return matching[0]
    known = ", ".join(object_name(obj) for obj in containers) or "none"
    raise InputError(f"{_file(document)} has no assembly named {name!r}; it has: {known}.")


def _loose_links(document: Any) -> list[Any]:
    objects = list(getattr(document, "Objects", ()) or ())
    claimed = _claimed(obj for obj in objects if kind_of(obj) is not Kind.FOLDER)
    wanted = (Kind.LINK, Kind.ASSEMBLY_LINK, Kind.LINK_GROUP, Kind.DRAFT_ARRAY, Kind.FOREIGN)
    return [obj for obj in objects if object_name(obj) not in claimed and kind_of(obj) in wanted]
