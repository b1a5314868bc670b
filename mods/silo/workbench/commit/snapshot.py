# SPDX-License-Identifier: LGPL-2.1-or-later
"""A document as it was at one moment: what the worker needs to know of it, and nothing that is alive.

Taken in the GUI thread in milliseconds; from then on the document may change, be closed, or FreeCAD may die.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from silo.bom.document import document_property, own
from silo.bom.errors import InputError
from silo.bom.identity import META_KEY, identity_of
from silo.bom.links import extract
from silo.bom.model import Extraction
from silo.bom.report import to_plain
from silo.bom.roots import NAME_ONE, choose_assembly
from silo.spelling import one_path
from silo.workbench.words import plain, translate


@dataclass(frozen=True)
class Snapshot:
    """A document at commit time.

    path
        real path of its file.
    identity
        Silo UUID of the item that the file belongs to; None while unregistered.
    extraction
        the BOM, for an assembly; None for a part.
    problem
        why there is no BOM though there might be one ("several assemblies").
    """

    path: str
    label: str
    identity: str | None = None
    extraction: Extraction | None = None
    problem: str = field(default="", compare=False)

    @property
    def is_assembly(self) -> bool:
        """True where there is a BOM to sync."""
        return self.extraction is not None

    def is_as(self, other: Snapshot) -> bool:
        """True where both are of one state: the same item, and the same BOM with all below it."""
        mine, its = (one.extraction and to_plain(one.extraction) for one in (self, other))
        return (self.path, self.identity, mine) == (other.path, other.identity, its)


Walk = Callable[[Any], Extraction]


def take(doc: Any, *, assembly: Any = None, walk: Walk = extract) -> Snapshot:
    """Take a snapshot of an open document.

    assembly
        the container that a person works in, where that is known; used where the document holds several.
    walk
        gives the BOM of a container (:func:`silo.workbench.freecad.live.extract_object`).
    """
    path = one_path(doc.FileName) if doc.FileName else ""
    label = str(getattr(doc, "Label", "") or os.path.basename(path))
    try:
        container = _choose(doc, assembly)
    except InputError as error:
        here = translate("Silo", "Make the one that is meant active: double-click it in the tree.")
        return Snapshot(path, label, part_identity(doc), problem=str(error).replace(NAME_ONE, here))
    extraction = walk(container)
    head = extraction.assembly
    if not (extraction.entries or extraction.blocked or _is_assembly_object(container)):
        return Snapshot(path, label, part_identity(doc), problem=_several(doc, label))
    return Snapshot(path, label, head.silo_uuid or part_identity(doc), _with_identity(extraction, doc))


def identity(doc: Any, assembly: Any = None) -> str | None:
    """The item that an open document belongs to, as :func:`take` finds it; None while unregistered."""
    try:
        container = _choose(doc, assembly)
    except InputError:
        return part_identity(doc)
    return identity_of(container) or part_identity(doc)


def is_registered(doc: Any, assembly: Any = None) -> bool:
    """True where :func:`identity` finds an item; in most documents without looking for the assembly."""
    return bool(part_identity(doc) or identity(doc, assembly))


def _choose(doc: Any, hint: Any) -> Any:
    try:
        return choose_assembly(doc)
    except InputError:
        if hint is None:
            raise
        return hint


def _with_identity(extraction: Extraction, doc: Any) -> Extraction:
    if extraction.assembly.silo_uuid:
        return extraction
    return replace(extraction, assembly=replace(extraction.assembly, silo_uuid=part_identity(doc)))


def _is_assembly_object(container: Any) -> bool:
    return bool(container.isDerivedFrom("Assembly::AssemblyObject")) or own(container, "Type") == "Assembly"


def part_identity(doc: Any) -> str | None:
    """The identity of a file that is no assembly: the document's own, else that of its only marked object."""
    found = document_property(doc, "SiloUUID") or (getattr(doc, "Meta", None) or {}).get(META_KEY)
    if isinstance(found, str) and found.strip():
        return found.strip()
    marked = _marked(doc)
    return next(iter(marked)) if len(marked) == 1 else None


def _marked(doc: Any) -> set[str]:
    """The identities on the objects of a document."""
    return {
        identity
        for obj in getattr(doc, "Objects", ()) or ()
        if (own(obj, "SiloItemId") or own(obj, "SiloUUID")) and (identity := identity_of(obj))
    }


def _several(doc: Any, label: str) -> str:
    """Why a document has no identity of its own although its parts have; "" where that is not so."""
    count = len(_marked(doc))
    if count < 2 or part_identity(doc):
        return ""
    text = translate(
        "Silo", "{name} holds {n} registered parts, so its file is no single item's and stays here."
    )
    return text.replace("{name}", plain(label, 80)).replace("{n}", str(count))
