# SPDX-License-Identifier: LGPL-2.1-or-later
"""A document as it was at one moment: what the worker needs to know of it, and nothing that is alive.

Taken in the GUI thread in milliseconds; from then on the document may change, be closed, or FreeCAD may die.
A snapshot goes through JSON and back unchanged, so it can wait on disk.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from silo.bom.document import document_property, own
from silo.bom.errors import InputError, SiloError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.identity import META_KEY, identity_of
from silo.bom.links import extract
from silo.bom.model import BomEntry, Extraction
from silo.bom.roots import choose_assembly
from silo.workbench.words import plain, translate

FORMAT = 1


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


Walk = Callable[[Any], Extraction]


def take(doc: Any, *, assembly: Any = None, walk: Walk = extract) -> Snapshot:
    """Take a snapshot of an open document.

    assembly
        the container that a person works in, where that is known; used where the document holds several.
    walk
        gives the BOM of a container (:func:`silo.workbench.live.extract_object`).
    """
    path = os.path.realpath(doc.FileName) if doc.FileName else ""
    label = str(getattr(doc, "Label", "") or os.path.basename(path))
    try:
        container = _choose(doc, assembly)
    except InputError as error:
        return Snapshot(path, label, part_identity(doc), problem=str(error))
    extraction = walk(container)
    head = extraction.assembly
    if not (extraction.entries or extraction.blocked or _is_assembly_object(container)):
        return Snapshot(path, label, part_identity(doc), problem=_several(doc, label))
    return Snapshot(path, label, head.silo_uuid or part_identity(doc), _with_identity(extraction, doc))


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


# --- JSON ------------------------------------------------------------------------------------------------


def to_json(snapshot: Snapshot) -> dict[str, Any]:
    """Plain data. Entries that several parents share are written once."""
    data: dict[str, Any] = {
        "format": FORMAT,
        "path": snapshot.path,
        "label": snapshot.label,
        "identity": snapshot.identity,
        "problem": snapshot.problem,
    }
    if snapshot.extraction is not None:
        data["bom"] = _extraction_json(snapshot.extraction)
    return data


def from_json(data: Mapping[str, Any]) -> Snapshot:
    """What :func:`to_json` wrote; :class:`InputError` where it is something else."""
    try:
        if data["format"] != FORMAT:
            raise InputError(f"a snapshot of format {data['format']}; this silo-mod reads {FORMAT}")
        bom = data.get("bom")
        return Snapshot(
            path=data["path"],
            label=data["label"],
            identity=data["identity"],
            extraction=_extraction(bom) if bom is not None else None,
            problem=data["problem"],
        )
    except SiloError:
        raise
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise InputError(f"this snapshot cannot be read ({type(error).__name__}: {error})") from error


def _extraction_json(extraction: Extraction) -> dict[str, Any]:
    nodes: list[dict[str, Any]] = []
    numbers: dict[int, int] = {}

    def number(entry: BomEntry) -> int:
        if id(entry) not in numbers:
            children = [number(child) for child in entry.children]
            numbers[id(entry)] = len(nodes)
            nodes.append(_node(entry, children))
        return numbers[id(entry)]

    return {
        "assembly": number(extraction.assembly),
        "entries": [number(entry) for entry in extraction.entries],
        "nodes": nodes,
        "findings": [
            [f.code.value, f.severity.value, f.message, [[p.doc_path, p.obj] for p in f.where]]
            for f in extraction.findings
        ],
    }


_PLAIN = (
    "doc_path",
    "silo_uuid",
    "quantity",
    "level",
    "consolidation_warning",
    "object_name",
    "label",
    "is_assembly",
    "individual_links",
    "link_objects",
    "document_label",
)


def _node(entry: BomEntry, children: list[int]) -> dict[str, Any]:
    node = {name: getattr(entry, name) for name in _PLAIN}
    return node | {"instances": list(entry.instances), "children": children}


def _extraction(data: Mapping[str, Any]) -> Extraction:
    entries: list[BomEntry] = []
    for node in data["nodes"]:
        # A node only names nodes before it, so a broken file cannot send us round in a ring.
        children = tuple(entries[i] for i in _before(node["children"], len(entries)))
        plain = {name: node[name] for name in _PLAIN}
        entries.append(BomEntry(**plain, instances=tuple(node["instances"]), children=children))
    return Extraction(
        assembly=entries[data["assembly"]],
        entries=tuple(entries[i] for i in data["entries"]),
        findings=tuple(
            Finding(FindingCode(code), Severity(severity), message, tuple(Place(*place) for place in where))
            for code, severity, message, where in data["findings"]
        ),
    )


def _before(numbers: list[int], count: int) -> Iterator[int]:
    for number in numbers:
        if not 0 <= number < count:
            raise ValueError(f"node {count} names node {number}")
        yield number
