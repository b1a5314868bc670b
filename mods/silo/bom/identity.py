# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a component's Silo identity is written, and what it means to find one twice.

Read in this order (the real Silo writes ``SiloItemId`` on objects, the spec ``SiloUUID`` on documents):

1. the object's own ``SiloItemId``, then its own ``SiloUUID``;
2. ``Meta["SiloUUID/<object Name>"]`` of its document: one file may give several parts, and FreeCAD 0.20 has
   no document properties but keeps ``Meta``;
3. the document's ``SiloUUID`` property;
4. ``Meta["SiloUUID"]`` of its document.

Part numbers are never parsed, and never taken from labels.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from silo.bom.document import document_property, object_name, own
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.model import BomEntry

META_KEY = "SiloUUID"


def meta_key(obj_name: str = "") -> str:
    """The key in ``Meta`` for the whole document, or for one of its objects."""
    return f"{META_KEY}/{obj_name}" if obj_name else META_KEY


def _text(value: object) -> str | None:
    return value.strip() or None if isinstance(value, str) else None


def identity_of(obj: object) -> str | None:
    """The Silo UUID of a component (the real part or assembly, not a link to it); None while unregistered."""
    return own_identity(obj) or document_identity(getattr(obj, "Document", None))


def own_identity(obj: object) -> str | None:
    """The identity that is written for this very object, not for its document."""
    for name in ("SiloItemId", "SiloUUID"):
        if found := _text(own(obj, name)):
            return found
    name = object_name(obj)
    return _text(_meta(getattr(obj, "Document", None)).get(meta_key(name))) if name else None


def document_identity(doc: object) -> str | None:
    """The identity that is written for a whole document."""
    if doc is None:
        return None
    return _text(document_property(doc, "SiloUUID")) or _text(_meta(doc).get(META_KEY))


def _meta(doc: object) -> Mapping[str, str]:
    meta = getattr(doc, "Meta", None)
    return meta if isinstance(meta, Mapping) else {}


def walk_entries(entries: Iterable[BomEntry]) -> Iterator[BomEntry]:
    """Every distinct component below, each once, parents before children.

    What lies below is looked at for each distinct value of a component: where a walk was cut (a ring, too
    deep), one component may have fewer children in one place than in another.
    """
    yielded: set[tuple[str, str]] = set()
    seen: dict[int, BomEntry] = {}  # nested assemblies share their values; kept, so that ids stay theirs
    stack = list(reversed(tuple(entries)))
    while stack:
        entry = stack.pop()
        if id(entry) in seen:
            continue
        seen[id(entry)] = entry
        if entry.key not in yielded:
            yielded.add(entry.key)
            yield entry
        stack.extend(reversed(entry.children))


def identity_findings(entries: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """One UUID in two files ("copied identity"), or on two parts of one file ("shared identity")."""
    users: dict[str, dict[tuple[str, str], BomEntry]] = {}
    for entry in sorted(walk_entries(entries), key=lambda entry: entry.key):
        if entry.silo_uuid:
            users.setdefault(entry.silo_uuid.lower(), {})[entry.key] = entry
    findings = []
    for uuid, components in users.items():
        if len(components) < 2:
            continue
        where = tuple(Place(path, obj) for path, obj in components)
        files = list(dict.fromkeys(path for path, _ in components))
        if len(files) > 1:
            code = FindingCode.COPIED_IDENTITY
            message = (
                f"{len(files)} files carry the same Silo identity {uuid}: {', '.join(files)}. "
                "Is it the same part, or is one of them a new part that needs its own number?"
            )
        else:
            code = FindingCode.SHARED_IDENTITY
            names = ", ".join(entry.label for entry in components.values())
            message = (
                f"{len(components)} components of {files[0]} share the Silo identity {uuid}: {names}. "
                "They will count as one item; register them apart if they are different parts."
            )
        findings.append(Finding(code, Severity.WARNING, message, where))
    return tuple(findings)
