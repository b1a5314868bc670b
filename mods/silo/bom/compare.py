# SPDX-License-Identifier: LGPL-2.1-or-later
"""CAD against server: what is new, gone, changed, equal, owned by people, or in conflict (spec bom-sync
§4).

The rules of this module:

* a line is found by its part number; the numbers come from the server and compare as they are;
* quantities compare as numbers: 12, 12.0 and "12" are equal;
* CAD counts pieces: a line in another unit belongs to people, and no number in it is CAD's;
* a server line without ``source`` counts as ``assembly``;
* a ``manual`` line (or one of a source that we do not know), and one that is no component (``alternate``,
  ``reference``), belongs to people: it is listed apart, never as removed or changed;
* a component that exists as a manual line of the same quantity is there already (``unchanged``); with another
  quantity it is a conflict, for a person to decide;
* a line of a component whose file is missing is not compared (``kept``): nobody knows how many there are.

The merge rules (spec bom-sync §4, "Merge Rules"), once, for the server, the fakes and the tests.

=====================================  ===============================================================
added                                  a new line, ``source`` assembly
quantity changed (assembly line)       takes the assembly's quantity
removed (assembly line, no component)  stays; flagged unreferenced, unflagged when it is referenced again
unchanged                              nothing
kept (its component is missing now)    nothing
manual                                 never touched; another quantity than the assembly's is a conflict
=====================================  ===============================================================

Nothing is ever deleted by a merge. :func:`would_undo` says when a file or a BOM is refused because it would
undo a colleague's newer file.

Two states of the same assemblies, compared line by line: what a change of files means in parts. Pure.

A component is the same in both states where its identity is the same, or, where one of them has no identity
of its own, where file and object are the same. An identity that several components of one state share (a
copied file) proves nothing; then file and object decide.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar
from urllib.parse import quote

from silo.bom.errors import MissingRevisionError
from silo.bom.model import BomChange, BomDiff, BomEntry, QuantityChange
from silo.bom.numbers import counts_pieces, exact_sum, plain
from silo.bom.resolve import display_name

# Two quantities closer than this, relatively, are one: lengths pass through databases as floats.
RELATIVE_TOLERANCE = 1e-9

# (file, object) of a component; the file relative to the assembly's, as a merge names it.
Component = tuple[str, str]


@dataclass(frozen=True, slots=True)
class _Line:
    part_number: str
    quantity: float | None
    unit: str = ""


def as_number(value: object) -> float | None:
    """Read a quantity as a number: int, float, Decimal or a numeral; None if it is none."""
    if value is None or isinstance(value, bool):
        return None
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def same_quantity(a: object, b: object) -> bool:
    """Return True if both are the same number, or if neither is one."""
    x, y = as_number(a), as_number(b)
    if x is None or y is None:
        return x is y
    return math.isclose(x, y, rel_tol=RELATIVE_TOLERANCE, abs_tol=1e-12)


def says_the_same(cad_quantity: object, quantity: object, unit: str | None) -> bool:
    """Return True if a line has as many pieces as CAD."""
    return counts_pieces(unit) and same_quantity(cad_quantity, quantity)


def _local(entry: Any) -> _Line | None:
    if isinstance(entry, Mapping):
        number = entry.get("child_part_number") or entry.get("part_number")
        quantity = as_number(entry.get("quantity"))
    else:  # a BomEntry, or any other value with these two names
        number, quantity = entry.part_number, as_number(entry.quantity)
    return _Line(number, quantity or 0.0) if number else None


def _summed(lines: Iterable[_Line]) -> dict[str, float | None]:
    total: dict[str, float | None] = {}
    for line in lines:
        if line.part_number in total:
            both = exact_sum((total[line.part_number] or 0.0, line.quantity or 0.0))
            total[line.part_number] = float(both)
        else:
            total[line.part_number] = line.quantity
    return {number: plain(quantity) for number, quantity in total.items()}


def local_quantities(entries: Iterable[BomEntry | Mapping[str, Any]]) -> dict[str, float | None]:
    """Sum the assembly's direct children by part number; entries without a number are left out."""
    return _summed(line for entry in entries if (line := _local(entry)) is not None)


def is_manual(line: Mapping[str, Any]) -> bool:
    """Return True if a line belongs to people: no component, not counted in pieces, or not from an assembly.

    A line with an unknown source belongs to somebody; an assembly may only change what assemblies wrote.
    """
    from_cad = (line.get("source") or "assembly") == "assembly" and counts_pieces(line.get("unit"))
    return not is_component(line) or not from_cad


def is_component(line: Mapping[str, Any]) -> bool:
    """Return True if a line counts parts; ``alternate`` and ``reference`` lines do not."""
    return (line.get("rel_type") or "component") == "component"


def diff_bom(
    local_entries: Iterable[BomEntry | Mapping[str, Any]],
    remote_entries: Iterable[Mapping[str, Any]],
    missing: Iterable[Component] = (),
) -> BomDiff:
    """Compare the assembly's direct children with the server's lines of the same parent.

    local_entries
        resolved entries (or mappings with ``child_part_number`` and ``quantity``); entries without a part
        number are not compared. Several with one number are summed.
    remote_entries
        mappings with ``child_part_number``, ``quantity``, ``source`` and optionally ``rel_type``, and
        ``components``: what the line stood for in the last sync.
    missing
        components whose file or object is missing now, as the last sync named them.
    """
    remote_entries = list(remote_entries)
    local = local_quantities(local_entries)
    gone = lines_of_missing(remote_entries, missing, local)
    kept = [line for line in remote_entries if line["child_part_number"] in gone]
    remote_entries = [line for line in remote_entries if line["child_part_number"] not in gone]
    local = {number: quantity for number, quantity in local.items() if number not in gone}
    assembly_lines: list[_Line] = []
    manual_lines: list[_Line] = []
    manual_components: list[_Line] = []
    for remote in remote_entries:
        unit = remote.get("unit") or ""
        unit = "" if counts_pieces(unit) else unit
        line = _Line(remote["child_part_number"], as_number(remote.get("quantity")), unit)
        if is_manual(remote):
            manual_lines.append(line)
            if is_component(remote):
                manual_components.append(line)
        else:
            assembly_lines.append(line)
    units = {line.part_number: line.unit for line in manual_components}
    diff = _compare(local, _summed(assembly_lines), _summed(manual_lines), _summed(manual_components), units)
    lines = _summed(_Line(other["child_part_number"], as_number(other.get("quantity"))) for other in kept)
    return replace(diff, kept=tuple(BomChange(number, quantity) for number, quantity in lines.items()))


def lines_of_missing(
    lines: Iterable[Mapping[str, Any]], missing: Iterable[Component], local: Container[str] = ()
) -> frozenset[str]:
    """Return the part numbers of the lines that stand for missing components.

    They are the lines that stood for such a component in the last sync. If a missing component stood for no
    line (the server does not keep that, or the lines are of an old version), any line that the assembly does
    not have now may be its line, so all lines without known components stay.

    local
        the part numbers that the assembly has now.
    """
    gone = {(file, name) for file, name in missing}
    if not gone:
        return frozenset()
    components_by_number: dict[str, set[tuple[Any, Any]]] = {}
    owned = set()
    for line in lines:
        number = line["child_part_number"]
        parts = {
            (component.get("file"), component.get("object")) for component in line.get("components") or ()
        }
        components_by_number.setdefault(number, set()).update(parts)
        if not is_manual(line):
            owned.add(number)
    numbers = {number for number, components in components_by_number.items() if components & gone}
    if gone.difference(*components_by_number.values()):
        numbers |= {number for number in owned if not components_by_number[number] and number not in local}
    return frozenset(numbers)


def _compare(
    local: Mapping[str, float | None],
    assembly: Mapping[str, float | None],
    manual: Mapping[str, float | None],
    manual_components: Mapping[str, float | None],
    units: Mapping[str, str],
) -> BomDiff:
    added: list[BomChange] = []
    changed: list[QuantityChange] = []
    unchanged: list[BomChange] = []
    conflicts: list[QuantityChange] = []
    for number, wanted in local.items():
        if wanted is None:
            continue
        in_manual = number in manual_components
        agreed = in_manual and says_the_same(wanted, manual_components[number], units[number])
        if in_manual and not agreed:
            conflicts.append(QuantityChange(number, wanted, manual_components[number], units[number]))
        if number in assembly:
            if same_quantity(wanted, assembly[number]):
                unchanged.append(BomChange(number, wanted))
            else:
                changed.append(QuantityChange(number, wanted, assembly[number]))
        elif not in_manual:
            added.append(BomChange(number, wanted))
        elif agreed:
            unchanged.append(BomChange(number, wanted))
    return BomDiff(
        added=tuple(added),
        removed=tuple(BomChange(n, q) for n, q in assembly.items() if n not in local),
        quantity_changed=tuple(changed),
        unchanged=tuple(unchanged),
        manual=tuple(BomChange(n, q) for n, q in manual.items()),
        conflicts=tuple(conflicts),
    )


@dataclass(frozen=True)
class MergePlan:
    """What a merge will write: the diff, and which unreferenced flags it sets and clears (part numbers).

    ``tell`` names lines of people whose quantity in the assembly the server does not know yet: a new
    conflict, a changed one, or one that is over. No line is written for them, but the server must ask a
    person, or stop asking.
    """

    diff: BomDiff
    flag: tuple[str, ...] = ()
    unflag: tuple[str, ...] = ()
    tell: tuple[str, ...] = ()

    @property
    def writes(self) -> bool:
        """Return True if applying the plan changes a line on the server."""
        return bool(self.diff.added or self.diff.quantity_changed or self.flag or self.unflag)

    @property
    def news(self) -> bool:
        """Return True if the server learns anything from this merge; if not, it need not be sent."""
        return self.writes or bool(self.tell)


def plan_merge(
    entries: Iterable[BomEntry | Mapping[str, Any]],
    lines: Iterable[Mapping[str, Any]],
    missing: Iterable[Component] = (),
) -> MergePlan:
    """Plan a merge of the assembly's direct children into the parent's lines; changes nothing itself.

    entries
        as in :func:`silo.bom.compare.diff_bom`.
    lines
        the server's lines; ``unreferenced_since`` (any true value) marks those flagged before.
        ``assembly_told`` says if the server knows the assembly's quantity for a line that people own,
        ``assembly_quantity`` which it is. A server that has neither gets no merge that only reports
        conflicts.
    missing
        as in :func:`silo.bom.compare.diff_bom`: the lines of these components stay as they are.
    """
    local, line_known = list(entries), list(lines)
    diff = diff_bom(local, line_known, missing)
    kept = {change.part_number for change in diff.kept}
    line_known = [line for line in line_known if line["child_part_number"] not in kept]
    flagged = {
        line["child_part_number"]
        for line in line_known
        if line.get("unreferenced_since") and not is_manual(line)
    }
    gone = [change.part_number for change in diff.removed]
    return MergePlan(
        diff=diff,
        flag=tuple(number for number in gone if number not in flagged),
        unflag=tuple(sorted(flagged.difference(gone))),
        tell=_untold(diff, local_quantities(local), line_known),
    )


def _untold(
    diff: BomDiff, local: Mapping[str, float | None], lines: Iterable[Mapping[str, Any]]
) -> tuple[str, ...]:
    in_conflict = {change.part_number for change in diff.conflicts}
    untold = []
    for line in lines:
        number, components = line["child_part_number"], line.get("assembly_told")
        if components is None or not is_manual(line) or not is_component(line):
            continue
        # An override of a line that the assembly once owned is in conflict too if the assembly drops it.
        now = local.get(number, 0.0)
        dropped = number not in local and bool(line.get("override"))
        changed = components and not same_quantity(line.get("assembly_quantity"), now)
        if changed or (not components and (number in in_conflict or dropped)):
            untold.append(number)
    return tuple(untold)


def apply_merge(lines: Sequence[Mapping[str, Any]], plan: MergePlan, when: str) -> list[dict[str, Any]]:
    """Apply a merge to copies of the lines: what people wrote on a line stays, and no line is deleted.

    ``lines`` has at most one assembly line per number, as the key of every server demands. ``when`` is the
    time stamp written on newly unreferenced lines.
    """
    quantities = {change.part_number: change.local_quantity for change in plan.diff.quantity_changed}
    flag, unflag = set(plan.flag), set(plan.unflag)
    merged: list[dict[str, Any]] = []
    for line in lines:
        after = dict(line)
        number = line["child_part_number"]
        if not is_manual(line):
            if number in quantities:
                after["quantity"] = quantities[number]
            if number in flag:
                after["unreferenced_since"] = when
            if number in unflag:
                after["unreferenced_since"] = None
        merged.append(after)
    merged.extend(
        {
            "child_part_number": change.part_number,
            "quantity": change.quantity,
            "source": "assembly",
            "unreferenced_since": None,
        }
        for change in plan.diff.added
    )
    return merged


def summary(diff: BomDiff) -> str:
    """Write the sentence of the spec's event: ``BOM updated: 1 added, 1 quantity changed, 1
    unreferenced``.
    """
    parts = [
        f"{len(diff.added)} added",
        f"{len(diff.quantity_changed)} quantity changed",
        f"{len(diff.removed)} unreferenced",
    ]
    if diff.conflicts:
        parts.append(f"{len(diff.conflicts)} in conflict")
    words = ", ".join(parts)
    return f"BOM updated: {words}"


def resolve_url(part_number: str) -> str:
    """Return the page where a person decides about what a merge left open."""
    return f"/items/{quote(part_number, safe='')}/bom"


def answer_of(
    diff: BomDiff, part_number: str, sync_id: str | None = None, left_out: Sequence[Mapping[str, Any]] = ()
) -> dict[str, Any]:
    """Make the answer to a merge (spec §5), with ``sync_id`` and ``left_out`` only if they are not empty."""

    def lines(changes: Iterable[BomChange]) -> list[dict[str, Any]]:
        return [
            {"part_number": bom_change.part_number, "quantity": plain(bom_change.quantity)}
            for bom_change in changes
        ]

    unreferenced = [
        {
            "type": "unreferenced",
            "part_number": change.part_number,
            "message": "Present in server BOM but not in assembly",
        }
        for change in diff.removed
    ]
    answer: dict[str, Any] = {
        "status": "merged",
        "diff": {
            "added": lines(diff.added),
            "removed": lines(diff.removed),
            "quantity_changed": [
                {
                    "part_number": change.part_number,
                    "old_quantity": plain(change.remote_quantity),
                    "new_quantity": plain(change.local_quantity),
                }
                for change in diff.quantity_changed
            ],
            "unchanged": lines(diff.unchanged),
        },
        "warnings": unreferenced + [conflict_warning(change) for change in diff.conflicts],
        "resolve_url": resolve_url(part_number),
    }
    kept_answer = {"sync_id": sync_id, "left_out": [dict(part) for part in left_out]}
    return answer | {name: value for name, value in kept_answer.items() if value}


def conflict_warning(change: QuantityChange) -> dict[str, Any]:
    """Make the warning about a line whose quantity a person set, and which differs from the assembly's."""
    cad, ours = plain(change.local_quantity), plain(change.remote_quantity)
    kept = change.on_server(str(ours))
    return {
        "type": "conflict",
        "part_number": change.part_number,
        "message": f"The assembly has {cad}, Silo has {kept} (set by a person); a person decides",
        "assembly_quantity": cad,
        "server_quantity": ours,
    }


class FileRevision(Protocol):
    """A revision with a file."""

    @property
    def revision_number(self) -> int: ...

    @property
    def file_checksum(self) -> str | None: ...


def would_undo(newest: FileRevision | None, base: int | None, sha256: str | None) -> bool:
    """Return True if a file that was made from revision ``base`` would undo the newest one.

    newest
        the item's newest revision with a file; if that file has this ``sha256``, nothing is undone.
    base
        None if it is not known what the file was made from.
    """
    if base is None or newest is None:
        return False
    return newest.revision_number > base and newest.file_checksum != sha256


def base_of(revision: int | None, sha256: str | None, same: int | None) -> int | None:
    """Return the revision that a merge's document is, or was made from; None if it is not known.

    revision, sha256
        from the request: a revision, and the SHA-256 of its file. Without a revision, ``sha256`` is that of
        the document, which is no revision if it was edited.
    same
        the newest revision whose file has this ``sha256``; None if none has.

    Raises :class:`MissingRevisionError` for a revision that the server does not have: the server was restored
    from a backup, and another file may have the number by now.
    """
    if revision is None:
        return same
    if sha256 and same is None:
        raise MissingRevisionError(
            f"revision {revision} with the SHA-256 {sha256[:12]}… is not on this server, so its BOM was not "
            "merged. The server may have been restored from a backup: send the file again, then its BOM"
        )
    return revision


Key = tuple[str, str]
T = TypeVar("T")


def _first(*states: T | None) -> T:
    """Return the first state that is not None; one of them never is."""
    return next(state for state in states if state is not None)


@dataclass(frozen=True, slots=True)
class ComparedAssembly:
    """An assembly and its lines, quantities per one assembly. Paths are relative to the compared folder."""

    head: BomEntry
    lines: tuple[BomEntry, ...] = ()


@dataclass(frozen=True, slots=True)
class LineChange:
    """One line of an assembly. ``old`` is None for a new line, ``new`` for one that is gone."""

    old: BomEntry | None
    new: BomEntry | None

    @property
    def entry(self) -> BomEntry:
        """Return the component as it is now; if it is removed, as it was."""
        return _first(self.new, self.old)

    @property
    def kind(self) -> str:
        """Return ``added``, ``removed``, ``quantity_changed`` or ``moved`` (same part, other file or
        object).
        """
        if self.old is None:
            return "added"
        if self.new is None:
            return "removed"
        return "moved" if self.old.quantity == self.new.quantity else "quantity_changed"


@dataclass(frozen=True, slots=True)
class AssemblyChange:
    """What became of one assembly. ``old`` is None for a new one, ``new`` for one that is gone."""

    old: ComparedAssembly | None
    new: ComparedAssembly | None
    lines: tuple[LineChange, ...] = ()

    @property
    def head(self) -> BomEntry:
        """Return the assembly as it is now; if it is removed, as it was."""
        return _first(self.new, self.old).head

    @property
    def kind(self) -> str:
        """Return ``added``, ``removed``, ``changed``, or ``moved`` if only its file or object is another."""
        if self.old is None:
            return "added"
        if self.new is None:
            return "removed"
        return "changed" if self.lines else "moved"


def compare_assemblies(
    old: Sequence[ComparedAssembly], new: Sequence[ComparedAssembly]
) -> tuple[AssemblyChange, ...]:
    """Return every assembly whose lines or place differ, in the order of the new state; removed ones come
    last.
    """
    match = _Match(old, new)
    before = {match.of_old(assembly.head): assembly for assembly in old}
    changes = []
    for assembly in new:
        earlier = before.pop(assembly.head.key, None)
        lines = match.lines(earlier.lines if earlier else (), assembly.lines)
        if earlier is None or lines or earlier.head.key != assembly.head.key:
            changes.append(AssemblyChange(earlier, assembly, lines))
    gone = [
        AssemblyChange(compared_assembly, None, match.lines(compared_assembly.lines, ()))
        for compared_assembly in before.values()
    ]
    return (*changes, *gone)


@dataclass(frozen=True, slots=True)
class ThreeLines:
    """A line in three states of an assembly: as two people opened it, as one left it, as the other did.

    None where the state has no such line.
    """

    base: BomEntry | None
    theirs: BomEntry | None
    mine: BomEntry | None

    @property
    def entry(self) -> BomEntry:
        """Return the component as I have it; if I do not, as they have it, or as the base has it."""
        return _first(self.mine, self.theirs, self.base)

    @property
    def quantities(self) -> tuple[float, float, float]:
        """Return the quantities in (base, theirs, mine); 0 means no line."""
        base, theirs, mine = (entry.quantity if entry else 0 for entry in (self.base, self.theirs, self.mine))
        return base, theirs, mine

    @property
    def by_them(self) -> bool:
        """Return True if they changed the quantity."""
        return self.quantities[1] != self.quantities[0]

    @property
    def by_me(self) -> bool:
        """Return True if I changed the quantity."""
        return self.quantities[2] != self.quantities[0]

    @property
    def undoes(self) -> bool:
        """Return True if mine, in place of theirs, would undo their change."""
        return self.by_them and self.quantities[1] != self.quantities[2]


def compare_three(
    base: ComparedAssembly | None, theirs: ComparedAssembly, mine: ComparedAssembly
) -> tuple[ThreeLines, ...]:
    """Return every line of an assembly that one of two people changed; first those whose change would be
    undone.

    Without ``base``, returns every line in which the two differ; who changed it is then not known.
    """
    common = base or ComparedAssembly(mine.head)
    to_theirs, to_mine = _Match([common], [theirs]), _Match([common], [mine])
    across = _Match([theirs], [mine])
    left_theirs = {entry.key: entry for entry in theirs.lines}
    left_mine = {entry.key: entry for entry in mine.lines}
    rows = []
    for entry in common.lines:
        other = left_theirs.pop(to_theirs.of_old(entry), None)
        rows.append(ThreeLines(entry, other, left_mine.pop(to_mine.of_old(entry), None)))
    for entry in left_theirs.values():
        rows.append(ThreeLines(None, entry, left_mine.pop(across.of_old(entry), None)))
    rows += [ThreeLines(None, None, entry) for entry in left_mine.values()]
    if base is None:
        return tuple(row for row in rows if row.quantities[1] != row.quantities[2])
    changed = [row for row in rows if row.by_them or row.by_me]
    return tuple(sorted(changed, key=lambda row: not row.undoes))


class _Match:
    """Which component of the old state is which of the new one."""

    def __init__(self, old: Sequence[ComparedAssembly], new: Sequence[ComparedAssembly]) -> None:
        was, now = _components(old), _components(new)
        by_id_old, by_id_new = _by_identity(was), _by_identity(now)
        self._new_key: dict[Key, Key] = {}
        taken = set()
        for uuid, key in by_id_old.items():
            if uuid in by_id_new:
                self._new_key[key] = by_id_new[uuid]
                taken.add(by_id_new[uuid])
        for key, entry in was.items():
            if key in self._new_key or key not in now or key in taken:
                continue
            # Two identities that differ are two parts, though the second took the first one's place.
            unlike = entry.silo_uuid in by_id_old and now[key].silo_uuid in by_id_new
            if not unlike:
                self._new_key[key] = key

    def of_old(self, entry: BomEntry) -> Key:
        """Return the new key of an old component; a key that no new component has if the old one is gone."""
        return self._new_key.get(entry.key, ("\0gone", "\0".join(entry.key)))

    def lines(self, old: Iterable[BomEntry], new: Iterable[BomEntry]) -> tuple[LineChange, ...]:
        """Return the lines that differ between two states of one assembly."""
        before = {self.of_old(entry): entry for entry in old}
        changes = []
        for entry in new:
            bom_entry = before.pop(entry.key, None)
            if bom_entry is None or bom_entry.quantity != entry.quantity or bom_entry.key != entry.key:
                changes.append(LineChange(bom_entry, entry))
        return (*changes, *(LineChange(entry, None) for entry in before.values()))


def _components(assemblies: Iterable[ComparedAssembly]) -> dict[Key, BomEntry]:
    return {entry.key: entry for assembly in assemblies for entry in (assembly.head, *assembly.lines)}


def _by_identity(components: Mapping[Key, BomEntry]) -> dict[str, Key]:
    times = Counter(entry.silo_uuid for entry in components.values())
    return {
        entry.silo_uuid: key
        for key, entry in components.items()
        if entry.silo_uuid is not None and times[entry.silo_uuid] == 1
    }


# --- for machines ---------------------------------------------------------------------------------------


def changes_json(changes: Iterable[AssemblyChange]) -> list[dict[str, Any]]:
    """Return the comparison as JSON values."""
    return [
        {
            **_entry(change.head),
            "change": change.kind,
            "moved_from": _moved(
                change.old.head if change.old else None, change.new.head if change.new else None
            ),
            "lines": [
                {
                    **_entry(line.entry),
                    "change": line.kind,
                    "old_quantity": line.old.quantity if line.old else None,
                    "new_quantity": line.new.quantity if line.new else None,
                    "moved_from": _moved(line.old, line.new),
                }
                for line in change.lines
            ],
        }
        for change in changes
    ]


def _entry(entry: BomEntry) -> dict[str, Any]:
    return {
        "doc_path": entry.doc_path,
        "object": entry.object_name,
        "name": display_name(entry),
        "silo_uuid": entry.silo_uuid,
        "missing": entry.missing,
    }


def _moved(old: BomEntry | None, new: BomEntry | None) -> dict[str, str] | None:
    if old is None or new is None or old.key == new.key:
        return None
    return {"doc_path": old.doc_path, "object": old.object_name}
