# SPDX-License-Identifier: LGPL-2.1-or-later
"""The import of a table into a BOM: first what would happen, row by row; then, if nothing is wrong, all.

Rows add manual lines or change lines that are there (by the rules of a user's edit). A file with levels
changes the BOMs of its sub-assemblies too, in one transaction; an assembly that stands in it several times
must have the same rows each time. Lines that the file does not name stay as they are, unless the user
removes them. Our own exports, imported again, change nothing. Unknown parts are made on the way, and rows
of one part added up, if the user allows that.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Any

from sqlalchemy import select

from silo.api.wire import LineTexts
from silo.bom.errors import InputError, RejectedError
from silo.bom.headers import Heading, designators
from silo.bom.message import message
from silo.bom.numbers import whole_number
from silo.bom.quantities import exact_sum
from silo.bom.units import stored_unit
from silo.tables.bom_rows import BOM, BomRow, BomRows, bom_rows
from silo.tables.sheet import Layout
from silo_server.db.rows import one_of
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.services.bom.change import (
    ChangeNote,
    apply_changes,
    check_version,
    locked_parent,
    new_line_id,
)
from silo_server.services.bom.cycles import check_no_cycle, find_rings
from silo_server.services.bom.import_parts import IdentifiedRow, identified, new_item
from silo_server.services.bom.import_plan import NOTHING, Allowed, ImportPlan, ImportRow, MissingLine
from silo_server.services.bom.line_edit import check_state, edited_state, means_the_same_unit
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.bom.lines import lines_of_many
from silo_server.services.import_file import read_import
from silo_server.services.import_log import Done, log_import
from silo_server.services.items import by_ids, create_item, get_item
from silo_server.services.scheme import scheme_of
from silo_server.values import Item, Line, LineState

_LEFT_OUT_ABOVE = message("stands below a row that is left out")


def read_bom(data: bytes, max_rows: int, layout: Layout | None = None) -> BomRows:
    """Read the rows of a file. RejectedError if this is no BOM, TooLargeError above ``max_rows``."""
    sheet = read_import(data, BOM, max_rows, layout)
    try:
        return bom_rows(sheet, layout.mark if layout else None)
    except InputError as error:
        raise RejectedError(str(error), list(error.problems)) from None


@dataclass
class _File:
    """The rows of a file and their assemblies; the parents and lines that Silo has of them."""

    product: Item
    parts: list[IdentifiedRow]
    parents: list[int | None]
    ids: Mapping[str, tuple[int, bool]]
    assemblies: Mapping[str, Item] = field(default_factory=dict)
    lines: Mapping[int, list[Line]] = field(default_factory=dict)

    def assembly_key(self, index: int) -> str:
        """Return the key of the part in whose BOM a row is."""
        above = self.parents[index]
        return self.product.part_number.casefold() if above is None else self.parts[above].key

    def depth(self, index: int) -> int:
        depth, above = 0, self.parents[index]
        while above is not None:
            depth, above = depth + 1, self.parents[above]
        return depth


def plan_import(tx: Tx, part_number: str, read: BomRows, allowed: Allowed = NOTHING) -> ImportPlan:
    """Plan an import of the rows of :func:`read_bom`, row by row; change nothing."""
    product = get_item(tx, part_number)
    if allowed.category:
        scheme_of(tx).category(allowed.category)
    file = _file_of(tx, product, read)
    added = _add_up(file) if allowed.add_up else {}
    rings = _rings(tx, file)
    in_file = _file_rings(file)
    rows: list[ImportRow] = []
    seen: dict[tuple[int | None, str, str], int] = {}
    first: dict[tuple[str, str, str], int] = {}
    made: set[str] = set()
    for index, part in enumerate(file.parts):
        row = _plan_row(file, index, allowed, added, rows, made)
        if row.status not in ("error", "skip"):
            rel_type = row.after.rel_type if row.after else ""
            own = (file.parents[index], part.key, rel_type)
            anywhere = (file.assembly_key(index), part.key, rel_type)
            if own in seen:
                problem = message("{part} stands here twice", part=row.part_number or row.name)
                row = replace(
                    row, status="error", problems=(problem,), could="add_up", before=None, after=None
                )
            elif anywhere in first:
                row = _again(row, rows[first[anywhere]])
            seen.setdefault(own, index)
            first.setdefault(anywhere, index)
            ring = in_file.get(index) or rings.get((file.assembly_key(index), row.child_id or 0))
            if ring and row.status in ("add", "error"):
                row = replace(row, status="error", problems=(ring,), could="", before=None, after=None)
        if row.problems and allowed.leave_out:
            row = replace(row, status="skip", problems=(), could="", new=None, why="; ".join(row.problems))
        if row.new is not None:
            made.add(part.key)
        rows.append(row)
    missing = _missing(file, rows)
    return ImportPlan(rows, read.unused, read.notes, missing, allowed.remove)


def _file_of(tx: Tx, product: Item, read: BomRows) -> _File:
    parts = identified(tx, read.rows)
    parents = [row.parent for row in read.rows]
    tops = [index for index, above in enumerate(parents) if above is None and not read.rows[index].left_out]
    root = tops[0] if len(tops) == 1 and any(above == tops[0] for above in parents) else None
    if root is not None and parts[root].key == product.part_number.casefold():
        # The file begins with the product itself: its lines are the rows below.
        parts[root] = parts[root].with_row(
            replace(read.rows[root], left_out=message("the product itself"), problems=())
        )
        parents = [None if above == root else above for above in parents]
    keys = {part.part_number.casefold() for part in parts} - {""}
    query = select(items.c.id, items.c.part_number_key, items.c.archived_at)
    ids = {
        row.part_number_key: (row.id, row.archived_at is not None)
        for row in tx.conn.execute(query.where(one_of(tx, items.c.part_number_key, keys)))
    }
    file = _File(product, parts, parents, ids)
    above_keys = {file.assembly_key(index) for index in range(len(parts))}
    known = by_ids(tx, [ids[key][0] for key in above_keys if key in ids])
    file.assemblies = {item.part_number.casefold(): item for item in (*known.values(), product)}
    file.lines = lines_of_many(tx, [item.id for item in file.assemblies.values()])
    return file


def _plan_row(
    file: _File,
    index: int,
    allowed: Allowed,
    added: Mapping[int, int],
    earlier: Sequence[ImportRow],
    made: set[str],
) -> ImportRow:
    part, row, above = file.parts[index], file.parts[index].of, file.parents[index]
    assembly = file.assemblies.get(file.assembly_key(index))
    parent = assembly.part_number if assembly else ("" if above is None else file.parts[above].part_number)
    base = ImportRow(
        row.line,
        part.part_number,
        "skip",
        name=part.unknown,
        parent=parent,
        depth=file.depth(index),
        above=above,
    )
    if row.left_out:
        return replace(base, why=row.left_out)
    if index in added:
        words = message("added to row {row}", row=file.parts[added[index]].of.line)
        return replace(base, name=words, why=words)
    if above is not None and earlier[above].why and file.parts[above].of.left_out != "the product itself":
        return replace(base, why=_LEFT_OUT_ABOVE)
    problems = list(row.problems)
    changes = _changes(row, problems)
    lines = {} if assembly is None else _by_part(file.lines.get(assembly.id, ()))
    line = lines.get((part.part_number.casefold(), changes.get("rel_type", "component")))
    child = file.ids.get(part.part_number.casefold()) if part.part_number else None
    new, could = None, ""
    if part.several:
        problems.append(message("Part number: {several}", several=part.several))
    elif not part.key:
        problems.append(message("Part number: is empty"))
    elif child is None and part.key not in made and allowed.category:
        new = new_item(part, allowed.category, problems)
    elif child is None and part.key not in made:
        problems.append(
            message(
                "Part number: {part} does not exist on this server",
                part=repr(part.part_number or part.unknown),
            )
        )
        could = "make"
    elif child is not None and child[1] and line is None:
        problems.append(message("Part number: {part_number} is archived", part_number=repr(part.part_number)))
    before = line.state if line else None
    after = None
    if not problems:
        after = _after(line, changes)
        try:
            check_state(after)
        except RejectedError as error:
            problems.extend(error.problems)
    if not problems and row.doubt and after != before and not allowed.quantities:
        problems.append(message("{doubt}; correct one of them, or let the quantity count", doubt=row.doubt))
        could = "quantities"
    if problems:
        return replace(
            base, status="error", problems=tuple(problems), could=could if len(problems) == 1 else ""
        )
    status = "add" if before is None else "same" if after == before else "change"
    child_id = child[0] if child else None
    return replace(base, status=status, before=before, after=after, child_id=child_id, line=line, new=new)


def _after(line: Line | None, changes: dict[str, Any]) -> LineState:
    if line is None:
        return LineState(**{"source": "manual", **changes, "unit": stored_unit(changes.get("unit"))})
    new = {name: value for name, value in changes.items() if not _as_written(line, name, value)}
    return edited_state(line.state, new, line.child_unit)


def _by_part(lines: Iterable[Line]) -> dict[tuple[str, str], Line]:
    return {(line.child_part_number.casefold(), line.state.rel_type): line for line in lines}


def _again(row: ImportRow, before: ImportRow) -> ImportRow:
    """Judge a row of an assembly that stands in the file once more: it must say the same."""
    if row.after == before.after:
        return replace(row, status="skip", why=message("the same as row {row}", row=before.row), new=None)
    problem = message(
        "{parent} has this part in row {row} too, with other values; an assembly has one BOM",
        parent=row.parent,
        row=before.row,
    )
    return replace(row, status="error", problems=(problem,), before=None, after=None, new=None)


def _missing(file: _File, rows: Sequence[ImportRow]) -> list[MissingLine]:
    """List the lines that the file does not have, of the product and of each assembly with rows in the
    file.
    """
    named: dict[str, set[str]] = {file.product.part_number.casefold(): set()}
    for index in range(len(rows)):
        if file.parts[index].of.left_out != "the product itself":
            named.setdefault(file.assembly_key(index), set()).add(file.parts[index].part_number.casefold())
    missing = []
    for key, children in named.items():
        assembly = file.assemblies.get(key)
        for line in file.lines.get(assembly.id, ()) if assembly else ():
            if line.child_part_number.casefold() not in children:
                missing.append(MissingLine(assembly.part_number if assembly else "", line))
    return missing


def _rings(tx: Tx, file: _File) -> dict[tuple[str, int], str]:
    """Find the rows that would close a ring with what Silo has: (assembly, child) → why."""
    wanted: dict[str, set[int]] = {}
    for index, part in enumerate(file.parts):
        if part.part_number.casefold() in file.ids:
            wanted.setdefault(file.assembly_key(index), set()).add(file.ids[part.part_number.casefold()][0])
    found = {}
    for key, children in wanted.items():
        assembly = file.assemblies.get(key)
        if assembly is None:
            continue
        there = {line.child_id for line in file.lines.get(assembly.id, ())}
        for child, ring in find_rings(tx, assembly, children - there).items():
            found[key, child] = _in_a_ring(assembly.part_number, ring)
    return found


def _file_rings(file: _File) -> dict[int, str]:
    """Find the rows that stand below themselves, by the file alone."""
    edges: dict[str, set[str]] = {}
    for index, part in enumerate(file.parts):
        if part.key and not part.of.left_out:
            edges.setdefault(file.assembly_key(index), set()).add(part.key)

    def reaches(start: str, wanted: str) -> bool:
        seen, queue = {start}, [start]
        while queue:
            for below in edges.get(queue.pop(), ()):
                if below == wanted:
                    return True
                if below not in seen:
                    seen.add(below)
                    queue.append(below)
        return False

    found: dict[int, str] = {}
    parents = edges.keys()
    for index, part in enumerate(file.parts):
        key = file.assembly_key(index)
        if part.key in parents and part.key != key and not part.of.left_out and reaches(part.key, key):
            found[index] = message(
                "Part number: {part} contains its own assembly in this file",
                part=part.part_number or part.unknown,
            )
    return found


def _in_a_ring(assembly: str, ring: Sequence[str]) -> str:
    if len(ring) <= 2:
        return message(
            "Part number: {assembly} is the assembly itself, which cannot be a part of itself",
            assembly=assembly,
        )
    return message(
        "Part number: {part} contains {assembly} itself ({path})",
        part=ring[1],
        assembly=assembly,
        path=" → ".join(ring),
    )


# Rows that differ in one of these are not added up.
_BESIDE = ("rel_type", "unit", "child_revision")


def _add_up(file: _File) -> dict[int, int]:
    """Add the quantities of all rows of a part to its first row; return the index of the first for each
    other.
    """
    first: dict[tuple[Any, ...], int] = {}
    added: dict[int, int] = {}
    above = set(file.parents)
    for index, part in enumerate(file.parts):
        row = part.of
        if row.left_out or row.problems or row.quantity is None or not part.key:
            continue
        key = (file.parents[index], part.key, *(row.texts.get(name, "") for name in _BESIDE))
        whole = first.setdefault(key, index)
        if whole == index or index in above:
            continue
        added[index] = whole
        into = file.parts[whole].of
        texts = dict(into.texts)
        for name, between in (("reference_designators", " "), ("notes", "; ")):
            both = dict.fromkeys(filter(None, (into.texts.get(name), row.texts.get(name))))
            if both:
                texts[name] = between.join(both)
        quantity = exact_sum((into.quantity or Decimal(0), row.quantity))
        doubt = into.doubt or row.doubt
        file.parts[whole] = file.parts[whole].with_row(
            replace(into, texts=texts, quantity=quantity, doubt=doubt)
        )
    return added


def _as_written(line: Line, name: str, value: Any) -> bool:
    """Compare a value of a file with the line's; a file drops spaces at the ends, and splits designators.

    Another spelling of the line's unit, or the unit that it has without a word, is no change.
    """
    value_before = getattr(line.state, name)
    if name == "unit" and means_the_same_unit(line.state, value, line.child_unit):
        return True
    if name == "reference_designators":
        return bool(designators(" ".join(value_before)) == value)
    return isinstance(value_before, str) and value_before.strip() == (value or "")


def _changes(row: BomRow, problems: list[str]) -> dict[str, Any]:
    changes: dict[str, Any] = {} if row.quantity is None else {"quantity": row.quantity}
    for name in LineTexts.model_fields:
        if name in row.texts:
            changes[name] = row.texts[name] or None
    if kind := row.texts.get(Heading.TYPE):
        changes["rel_type"] = kind.lower()
    if Heading.REFERENCE_DESIGNATORS in row.texts:
        changes["reference_designators"] = designators(row.texts[Heading.REFERENCE_DESIGNATORS])
    if Heading.REVISION in row.texts:
        revision = row.texts[Heading.REVISION]
        changes["child_revision"] = whole_number(revision, 6)
        if revision and changes["child_revision"] is None:
            problems.append(
                message("Revision: wanted a whole number, got {revision}", revision=repr(revision[:40]))
            )
    return changes


def apply_import(
    tx: Tx,
    part_number: str,
    read: BomRows,
    file_name: str | None,
    expected: int | None,
    allowed: Allowed = NOTHING,
) -> tuple[ImportPlan, Done, int]:
    """Import the rows of :func:`read_bom`, all BOMs in one transaction.

    Returns (the plan, what was done of it, the version of the product's BOM).
    RejectedError lists every problem, and then nothing was changed.
    """
    product = locked_parent(tx, part_number)
    check_version(product, expected)
    numbers = {
        row.texts.get("part_number", "")
        for row in read.rows
        if any(row.parent is not None for row in read.rows)
    }
    for item in _assemblies_to_lock(tx, numbers, product):
        locked_parent(tx, item)
    plan = plan_import(tx, part_number, read, allowed)
    if plan.problems:
        raise RejectedError(
            message(
                "{n} problems in the file, so nothing was imported: {problem}",
                n=len(plan.problems),
                problem=plan.problems[0],
            ),
            plan.problems,
        )
    made = {index: create_item(tx, row.new)[0] for index, row in enumerate(plan.rows) if row.new}
    by_key = {
        plan.rows[index].part_number.casefold() or f"\n{plan.rows[index].name}".casefold(): item
        for index, item in made.items()
    }
    records: dict[str, list[LineRecord]] = {}
    for index, row in enumerate(plan.rows):
        key = row.part_number.casefold() or f"\n{row.name}".casefold()
        child = made.get(index) or by_key.get(key)
        child_id = child.id if child else row.child_id
        above = plan.rows[row.above] if row.above is not None else None
        parent = row.parent
        if above is not None and not parent:
            parent = by_key[f"\n{above.name}".casefold()].part_number
        if row.status == "add" and child_id is not None:
            records.setdefault(parent, []).append(LineRecord(new_line_id(), child_id, None, row.after))
        elif row.status == "change" and row.line is not None:
            line = row.line
            records.setdefault(parent, []).append(
                LineRecord(line.id, line.child_id, row.before, row.after, line.position)
            )
    for missing in plan.missing if plan.removes else ():
        line = missing.line
        records.setdefault(missing.parent, []).append(
            LineRecord(line.id, line.child_id, line.state, None, line.position)
        )
    records.setdefault(product.part_number, [])
    done, version = Done(made=[item.id for item in made.values()]), product.bom_version
    for parent, own in records.items():
        assembly = product if parent == product.part_number else get_item(tx, parent, lock=True)
        check_no_cycle(tx, assembly, [record.child_id for record in own if record.before is None])
        change, after = apply_changes(tx, assembly, own, _note(own, file_name))
        done.boms += [(assembly.id, change)] if change else []
        if assembly.id == product.id:
            version = after
    log_import(tx, "bom", file_name or "", done)
    return plan, done, version


def _note(records: Sequence[LineRecord], file_name: str | None) -> ChangeNote:
    added = sum(record.before is None for record in records)
    removed = sum(record.after is None for record in records)
    words = message(
        "imported: {added} added, {removed} changed", added=added, removed=len(records) - added - removed
    )
    words += message(", {removed} removed", removed=removed) if removed else ""
    return ChangeNote(kind=ChangeKind.IMPORT, summary=words, document_file=file_name)


def _assemblies_to_lock(tx: Tx, numbers: set[str], product: Item) -> list[str]:
    """List the other items of a file with levels, in the order in which all imports lock them."""
    keys = {number.casefold() for number in numbers} - {"", product.part_number.casefold()}
    query = select(items.c.part_number).where(
        one_of(tx, items.c.part_number_key, keys), items.c.archived_at.is_(None)
    )
    return list(tx.conn.scalars(query.order_by(items.c.id)))
