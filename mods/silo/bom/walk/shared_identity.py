# SPDX-License-Identifier: LGPL-2.1-or-later
"""Identities that several components carry: copied with a file, or shared within one."""

from __future__ import annotations

from collections.abc import Iterable

from silo.bom.entry import BomEntry, walk_entries
from silo.bom.findings import Finding, FindingCode, Place
from silo.bom.message import Message


def identity_findings(entries: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """Find one UUID in two files ("copied identity"), or on two parts of one file ("shared identity")."""
    users: dict[str, dict[tuple[str, str], BomEntry]] = {}
    for entry in sorted(walk_entries(entries), key=lambda entry: entry.key):
        if entry.silo_uuid and not (entry.variant and not entry.is_own_item):
            users.setdefault(entry.silo_uuid.lower(), {})[entry.key] = entry
    findings = []
    for uuid, components in users.items():
        if len(components) < 2:
            continue
        where = tuple(Place(*(entry.copy if entry.variant else key)) for key, entry in components.items())
        if len({place.doc_path for place in where}) > 1:
            findings.append(copied_identity(uuid, where))
            continue
        code, names = FindingCode.SHARED_IDENTITY, [entry.label for entry in components.values()]
        values = {"count": len(names), "file": where[0].doc_path, "identity": uuid, "names": ", ".join(names)}
        findings.append(Finding(code, code.severity, Message(code.sentence, values), where))
    return tuple(findings)


def copied_identity(uuid: str, where: tuple[Place, ...]) -> Finding:
    """Make the finding that several files carry one identity."""
    code, files = FindingCode.COPIED_IDENTITY, list(dict.fromkeys(place.doc_path for place in where))
    values = {"count": len(files), "identity": uuid, "names": ", ".join(files)}
    return Finding(code, code.severity, Message(code.sentence, values), where)
