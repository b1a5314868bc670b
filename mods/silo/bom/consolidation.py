# SPDX-License-Identifier: LGPL-2.1-or-later
"""The hint that a link array could replace several single links to one part (spec bom-sync §6)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from silo.bom.entry import BomEntry, walk_entries
from silo.bom.errors import counted, listed
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.items.naming import display_name
from silo.bom.message import Message, message


def consolidation_message(entry: BomEntry) -> str:
    """Write the spec's console warning (§6), with the count of individual links."""
    who = entry.part_number or display_name(entry) or entry.object_name or entry.doc_path
    count = entry.individual_links
    if count:
        what = counted(count, "individual link")
        what += message(" beside a link array") if count == 1 else ""
    else:
        what = (
            message("{link_objects} link arrays", link_objects=entry.link_objects)
            if entry.link_objects > 1
            else message("several links")
        )
    return _hint(Message(FindingCode.CONSOLIDATION.sentence, {"who": who, "what": what}))


def _hint(hints: str) -> Message:
    return message(
        "[Silo BOM] {hints}. {advice}", hints=hints, advice=Message(FindingCode.CONSOLIDATION.tail)
    )


def one_hint_each(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Replace the consolidation warnings for the parts of a BOM by one warning for the BOM."""
    hints: dict[object, list[Finding]] = {}
    for finding in findings:
        hints.setdefault(
            finding.where[1:] if finding.code is FindingCode.CONSOLIDATION else id(finding), []
        ).append(finding)
    return tuple(of[0] if len(of) == 1 else _several_hints(of) for of in hints.values())


def _several_hints(hints: Sequence[Finding]) -> Finding:
    each = [hint.message.values["hints"] for hint in hints if isinstance(hint.message, Message)]
    return replace(hints[0], message=_hint(listed(each)))


def consolidation_findings(entries: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """Make the consolidation warnings of a tree: once for each assembly, those of the top first.

    ``where`` names the component and, below the top, the assembly that links it several times.
    """
    direct = tuple(entries)
    levels = [((), direct), *(((assembly,), assembly.children) for assembly in walk_entries(direct))]
    return tuple(
        Finding(
            FindingCode.CONSOLIDATION,
            Severity.WARNING,
            consolidation_message(entry),
            tuple(Place(part.doc_path, part.object_name) for part in (entry, *above)),
        )
        for above, group in levels
        for entry in group
        if entry.consolidation_warning
    )
