# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOM preview as rows: the assembly against the server, level by level (as ``silo-mod diff``)."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from silo.bom.compare.bom_diff import BomDiff
from silo.bom.entry import BomEntry
from silo.bom.findings import Finding, FindingCode, HiddenStanding, Severity
from silo.bom.items.naming import display_name, own_part_name, with_values
from silo.bom.view.folders import shorten
from silo.bom.walk.document import relative
from silo.workbench.preview.comparison import Compared, Preview
from silo.workbench.words import MOST_TIP, counted, plain, quantity, spoken, translate

if TYPE_CHECKING:
    from silo.bom.key import Key


# Letters of a cell; its tool tip has the rest.
MOST_CELL = 300


class RowKind(StrEnum):
    """What a row says."""

    ADDED = "added"
    CHANGED = "changed"
    CONFLICT = "conflict"
    UNREFERENCED = "unreferenced"
    MANUAL = "manual"
    UNCHANGED = "unchanged"
    UNREGISTERED = "unregistered"
    MISSING = "missing"
    NOT_COUNTED = "not counted"
    HIDDEN = "hidden"
    HIDDEN_PIECES = "hidden pieces"
    OWN = "own"
    GROUP = "group"


@dataclass(frozen=True)
class PreviewRow:
    """One row of the table.

    cad, silo
        quantities per one parent, as text; "" where that side has none.
    document, objects
        the instances in the CAD model, to select them.
    assembly, parts
        the assembly in that document, and what the row counts in it, to say why so many.
    """

    kind: RowKind
    number: str = ""
    name: str = ""
    cad: str = ""
    silo: str = ""
    note: str = ""
    document: str = ""
    objects: tuple[str, ...] = ()
    assembly: str = ""
    parts: tuple[Key, ...] = ()
    children: tuple[PreviewRow, ...] = ()

    def __post_init__(self) -> None:
        for text, most in (("number", MOST_CELL), ("name", MOST_CELL), ("note", MOST_TIP)):
            object.__setattr__(self, text, plain(getattr(self, text), most))


# Nested assemblies share their lines: some dozen small files can stand for more rows than memory holds.
MOST_ROWS = 3000


def rows(preview: Preview, most: int = MOST_ROWS) -> tuple[PreviewRow, ...]:
    """Make the table: the lines of the assembly, then what is left out and why.

    most
        the most rows of sub-assemblies; each sub-assembly gets its share, and one row sums up the rest.
    """
    by_key = {compared.resolved.assembly.key: compared for compared in preview.compared}
    base = os.path.dirname(preview.snapshot.path)
    room = most // 2
    table = [*_assembly_rows(preview.top, by_key, preview.names, frozenset(), room)]
    unresolved = preview.top.resolved.unresolved
    share = _share(room, unresolved)
    unregistered = tuple(
        _unregistered_row(entry, preview, tuple(_below(entry, by_key, preview.names, frozenset(), share)))
        for entry in unresolved
    )
    if unregistered:
        title = translate("Silo", "Without a part number: left out until registered")
        table.append(_group(title, unregistered))
    head = preview.top.resolved.assembly
    own = tuple(_own_row(line, head) for line in head.own[:most])
    if own:
        table.append(_group(translate("Silo", "Modelled in this file: no items yet, never sent"), own))
    left_out = tuple(
        _finding_row(f, preview, base)
        for f in sorted(
            (f for f in preview.top.resolved.findings if f.code not in _ELSEWHERE),
            key=lambda f: _ORDER[f.severity],
        )
    )
    if left_out:
        title = translate("Silo", "Not counted, or counted with a remark")
        table.append(_group(title, left_out))
    return tuple(table)


def _group(title: str, children: tuple[PreviewRow, ...]) -> PreviewRow:
    return PreviewRow(RowKind.GROUP, name=f"{title} ({len(children)})", children=children)


Known = Mapping[tuple[str, str], Compared]

Keys = frozenset[tuple[str, str]]


def _share(room: int, entries: Sequence[BomEntry]) -> int:
    return room // max(1, sum(entry.is_assembly for entry in entries))


def _assembly_rows(
    compared: Compared, lines: Known, names: Mapping[str, str], above: Keys, room: int
) -> Iterator[PreviewRow]:
    """Yield the assembly's own lines in its own order, then those that only the server has.

    room
        how many rows may be below them.
    """
    states = _states(compared.diff)
    share = _share(room, compared.resolved.entries)
    above = above | {compared.resolved.assembly.key}
    for entry in compared.resolved.entries:
        kind, silo, note = states.get(entry.part_number or "", (RowKind.UNCHANGED, "", ""))
        if (own := lines.get(entry.key)) is not None and entry.is_assembly and entry.part_number:
            note = "; ".join(filter(None, (note, _own_words(own))))
        if values := entry.counted_variants:
            words = translate("Silo", "with variants: {values}", values="; ".join(values))
            note = "; ".join(filter(None, (note, words)))
        if entry.missing:
            file = relative(entry.doc_path, os.path.dirname(compared.resolved.assembly.doc_path))
            file += f"#{entry.object_name}" if entry.object_name else ""
            kind, note = RowKind.MISSING, translate("Silo", "missing: {file}", file=file)
        yield PreviewRow(
            kind,
            number=entry.part_number or "",
            name=with_values(entry.name, entry.variant)
            if entry.name
            else (display_name(entry) if entry.missing else ""),
            cad=quantity(entry.quantity),
            silo=silo,
            note=note,
            **_counted(entry, compared.resolved.assembly),
            children=tuple(_below(entry, lines, names, above, share)),
        )
    local = {entry.part_number for entry in compared.resolved.entries}
    for kind, changes in (
        (RowKind.UNREFERENCED, compared.diff.removed),
        (RowKind.MISSING, compared.diff.kept),
        (RowKind.MANUAL, compared.diff.manual),
    ):
        for change in changes:
            if change.part_number not in local:
                number, amount = change.part_number, quantity(change.quantity)
                name = names.get(number, "")
                yield PreviewRow(kind, number=number, name=name, silo=amount, note=_notes()[kind])


def _below(
    entry: BomEntry, lines: Known, names: Mapping[str, str], above: Keys, room: int
) -> Iterator[PreviewRow]:
    """Yield the lines of a sub-assembly; none if it is above itself (a finding reports the loop)."""
    compared = lines.get(entry.key) if entry.is_assembly and entry.key not in above else None
    if compared is None:
        return
    left = room - len(compared.resolved.entries) - len(compared.diff.removed) - len(compared.diff.manual)
    if left < 0:
        yield PreviewRow(RowKind.GROUP, name=translate("Silo", "… more rows than can be shown here"))
    else:
        yield from _assembly_rows(compared, lines, names, above, left)


def _states(diff: BomDiff) -> dict[str, tuple[RowKind, str, str]]:
    """Return part number → kind, the server's quantity, and what a sync does."""
    notes = _notes()
    states: dict[str, tuple[RowKind, str, str]] = {}
    for line in diff.unchanged:
        states[line.part_number] = (RowKind.UNCHANGED, quantity(line.quantity), "")
    for line in diff.added:
        states[line.part_number] = (RowKind.ADDED, "", notes[RowKind.ADDED])
    for change in diff.quantity_changed:
        states[change.part_number] = (
            RowKind.CHANGED,
            quantity(change.remote_quantity),
            notes[RowKind.CHANGED],
        )
    for change in diff.conflicts:
        kept = change.on_server(quantity(change.remote_quantity))
        states[change.part_number] = (RowKind.CONFLICT, kept, notes[RowKind.CONFLICT])
    for line in diff.kept:
        states[line.part_number] = (RowKind.MISSING, quantity(line.quantity), notes[RowKind.MISSING])
    return states


def _notes() -> dict[RowKind, str]:
    return {
        RowKind.ADDED: translate("Silo", "new in the assembly: will be added"),
        RowKind.CHANGED: translate("Silo", "will take the assembly's quantity"),
        RowKind.CONFLICT: translate(
            "Silo", "manual line in Silo with another quantity: a reviewer decides there"
        ),
        RowKind.UNREFERENCED: translate("Silo", "not in the assembly: kept, marked unreferenced"),
        RowKind.MANUAL: translate("Silo", "manual line: not touched"),
        RowKind.MISSING: translate("Silo", "its file is missing: the line stays as it is"),
    }


def _own_words(compared: Compared) -> str:
    """Say if the BOM of a sub-assembly is in Silo."""
    if compared.is_new:
        return translate("Silo", "its own BOM is not in Silo yet")
    return translate("Silo", "its own BOM differs from Silo") if compared.to_send else ""


def _unregistered_row(entry: BomEntry, preview: Preview, children: tuple[PreviewRow, ...]) -> PreviewRow:
    head = preview.top.resolved.assembly
    return PreviewRow(
        RowKind.UNREGISTERED,
        name=display_name(entry),
        cad=quantity(entry.quantity),
        note=relative(entry.doc_path, os.path.dirname(preview.snapshot.path)),
        children=children,
        **(_counted(entry, head) if entry.level == head.level + 1 else {}),
    )


def _own_row(line: BomEntry, head: BomEntry) -> PreviewRow:
    return PreviewRow(
        RowKind.OWN, name=own_part_name(line), cad=quantity(line.quantity), **_counted(line, head)
    )


def _counted(entry: BomEntry, head: BomEntry) -> dict[str, Any]:
    """Return the fields of a row for an entry of the model, directly below an assembly."""
    return {
        "document": head.doc_path,
        "objects": entry.instances,
        "assembly": head.object_name,
        "parts": (entry.key, *entry.also),
    }


# Shown as separate rows.
_ELSEWHERE = (FindingCode.UNREGISTERED,)

_SEVERITY_SIGNS = {Severity.ERROR: "✗", Severity.WARNING: "⚠", Severity.INFO: "·"}

# Rows of hidden objects below one sentence, which names them all.
MOST_HIDDEN = 200

_ORDER = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.INFO: 2}


def _finding_row(finding: Finding, preview: Preview, base: str) -> PreviewRow:
    top = preview.snapshot.path
    if finding.code is FindingCode.HIDDEN:
        return _hidden_row(finding, base)
    mine = tuple(place.obj for place in finding.where if place.doc_path == top and place.obj)
    return PreviewRow(
        RowKind.NOT_COUNTED,
        number=_SEVERITY_SIGNS[finding.severity],
        note=spoken(shorten(finding.message, base)),
        document=top if mine else "",
        objects=mine,
    )


def _hidden_row(finding: Finding, base: str) -> PreviewRow:
    """Make a row for what is hidden in an assembly, with a row for each object, to say if it counts.

    The first row stands for the bodies that do not count: the question.
    """
    document = finding.where[0].doc_path if finding.where else ""
    words = {
        HiddenStanding.COUNTS: translate("Silo", "hidden, counts"),
        HiddenStanding.NOT_COUNTED: translate("Silo", "hidden, does not count"),
        HiddenStanding.REFERENCE: translate("Silo", "hidden, only a reference: does not count"),
    }
    children = tuple(
        PreviewRow(
            RowKind.HIDDEN,
            name=place.label or place.obj,
            note=words.get(HiddenStanding(place.standing), "") if place.standing else "",
            document=place.doc_path,
            objects=(place.obj,),
        )
        for place in finding.where[:MOST_HIDDEN]
    )
    return PreviewRow(
        RowKind.HIDDEN_PIECES,
        number=_SEVERITY_SIGNS[finding.severity],
        note=spoken(shorten(finding.message, base)),
        document=document,
        objects=tuple(place.obj for place in finding.where if place.standing == HiddenStanding.NOT_COUNTED),
        children=children,
    )


def summary(preview: Preview) -> str:
    """Write the line above the table."""
    diff = preview.top.diff
    parts = (
        (len(diff.added), translate("Silo", "{n} to add")),
        (len(diff.quantity_changed), translate("Silo", "{n} with another quantity")),
        (len(diff.removed), translate("Silo", "{n} unreferenced")),
        (len(diff.conflicts), translate("Silo", "{n} in conflict")),
        (len(preview.top.resolved.unresolved), translate("Silo", "{n} without a part number")),
        (sum(entry.missing for entry in preview.top.resolved.entries), translate("Silo", "{n} missing")),
    )
    texts = [text.replace("{n}", str(count)) for count, text in parts if count]
    new = sum(compared.is_new for compared in preview.compared[:-1])
    below = [
        counted(count, singular, many)
        for count, singular, many in (
            (
                new,
                translate("Silo", "{n} sub-assembly is not in Silo yet"),
                translate("Silo", "{n} sub-assemblies are not in Silo yet"),
            ),
            (
                preview.to_send_below - new,
                translate("Silo", "{n} sub-assembly differs from Silo"),
                translate("Silo", "{n} sub-assemblies differ from Silo"),
            ),
        )
        if count
    ]
    agreeing = len(diff.unchanged)
    if texts:
        own = ", ".join(texts)
    elif below:
        own = counted(agreeing, translate("Silo", "{n} line agrees"), translate("Silo", "{n} lines agree"))
    else:
        own = translate("Silo", "Nothing to sync: all {n} lines agree with Silo.", n=agreeing)
    return "; ".join((own, *below))
