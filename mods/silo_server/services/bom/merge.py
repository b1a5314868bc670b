# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge of an assembly into its BOM (spec bom-sync §5): check, plan, apply, announce; one transaction.

The rules are those of :mod:`silo.bom.compare.merge`; here is what a server adds: who may change which row is
enforced on the stored rows, a ``sync_id`` gives the same answer again, a version mismatch is refused, a
person's decision on a conflict is remembered until the assembly says something else.

A merge's request, answer and event, in exactly the spec's JSON (bom-sync §5).

The request is read by hand and not by a model, because a bad quantity and an unknown part number are reported
together, each with the index of its entry, in the one 400.

The last sync of each assembly: when, from which file, what it left out, and what each line is in CAD.

One row per assembly, written by the merge in its own transaction. An incomplete BOM must never look like a
complete one, and an assembly that was never synced must not look like a part.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Any

from sqlalchemy import delete, insert, select, update

from silo.bom.compare.answer import answer_of, summary
from silo.bom.compare.merge import MergePlan, plan_merge
from silo.bom.compare.owner import is_manual
from silo.bom.errors import RejectedError
from silo.bom.model import BomDiff, QuantityChange
from silo.bom.quantities import LARGEST_QUANTITY, as_decimal, plain
from silo.bom.report import Reason, in_words, remembered
from silo.bom.resolve import character_problem
from silo_server import events
from silo_server.db.engine import (
    KeptAnswer,
    KeyedRequest,
    Tx,
    earlier_answer,
    insert_rows,
    keep_answer,
    one_of,
)
from silo_server.db.tables import bom_conflicts, bom_last_syncs, items
from silo_server.errors import TooLargeError
from silo_server.fields import from_row, names_of
from silo_server.services.bom.history import state_at
from silo_server.services.bom.lines import (
    ChangeKind,
    ChangeNote,
    LineRecord,
    apply_changes,
    check_no_cycle,
    check_version,
    lines_of,
    locked_parent,
    new_line_id,
)
from silo_server.services.items import get_item
from silo_server.services.releases import draft_of
from silo_server.services.revisions import check_document
from silo_server.times import spec_time, wire_time
from silo_server.user_json import dumps
from silo_server.values import Item, Line, LineState

# An event goes to every listener: beyond this many unchanged lines it only says how many there are.
EVENT_UNCHANGED_LINES = 500


@dataclass(frozen=True, slots=True)
class OrderEntry:
    """One direct child as asked for; ``key`` is its case-folded number."""

    index: int
    part_number: str
    quantity: float
    components: Sequence[Mapping[str, str]] = ()

    @property
    def key(self) -> str:
        return self.part_number.casefold()


@dataclass(frozen=True, slots=True)
class MergeOrder:
    """A merge request. ``problems`` are (index, text) of the entries that are unusable in themselves."""

    entries: Sequence[OrderEntry]
    problems: Sequence[tuple[int, str]] = ()
    sync_id: str | None = None
    dry_run: bool = False
    document_file: str | None = None
    document_folder: str | None = None
    document_sha256: str | None = None
    document_revision: int | None = None
    left_out: Sequence[Mapping[str, Any]] = ()

    @property
    def missing(self) -> list[tuple[str, str]]:
        """List (file, object) of the components that the assembly has lost."""
        return [
            (part.get("file", ""), part.get("object", ""))
            for part in self.left_out
            if part["reason"] == Reason.MISSING
        ]


def read_merge_order(body: Any, max_entries: int) -> MergeOrder:
    """Read the order from a decoded JSON body; RejectedError if the body as a whole is unusable.

    Unknown keys are ignored. Whatever ``source`` says, the entries are an assembly's.
    """
    if not isinstance(body, Mapping) or not isinstance(body.get("entries"), list):
        raise RejectedError('body: wanted {"entries": [{"child_part_number": …, "quantity": …}, …]}')
    if len(body["entries"]) > max_entries:
        raise TooLargeError(f"entries: this server takes at most {max_entries}, got {len(body['entries'])}")
    sync_id, dry_run = body.get("sync_id"), body.get("dry_run")
    if sync_id is not None and (
        problem := text_problem(sync_id, 128) if sync_id else "wanted a text, got none"
    ):
        raise RejectedError(f"sync_id: {problem}")
    if dry_run is not None and not isinstance(dry_run, bool):
        raise RejectedError("dry_run: wanted true or false")
    document = _document(body.get("document"))
    entries: list[OrderEntry] = []
    problems: list[tuple[int, str]] = []
    for index, raw in enumerate(body["entries"]):
        entry, problem = _entry(index, raw)
        if entry is not None:
            entries.append(entry)
        if problem is not None:
            problems.append((index, problem))
    if not problems:
        problems = _sums_too_large(entries)
    left_out = _left_out(body.get("left_out"), max_entries)
    return MergeOrder(entries, problems, sync_id, bool(dry_run), *document, left_out)


def text_problem(value: Any, longest: int) -> str | None:
    """Say what is wrong with a text of at most ``longest`` characters; None if nothing is."""
    if not isinstance(value, str) or len(value) > longest:
        return f"wanted a text of at most {longest} characters, got {_shortened(value)}"
    return character_problem(value)


def sha256_or_none(name: str, value: Any) -> str | None:
    """Read a SHA-256 in lower-case hex digits, or None; RejectedError with the field for anything else."""
    if value is None:
        return None
    if isinstance(value, str) and re.fullmatch("[0-9A-Fa-f]{64}", value):
        return value.lower()
    raise RejectedError(f"{name}: wanted 64 hexadecimal digits")


def quantity_problem(value: Any) -> str | None:
    """Say what is wrong with a quantity; None if nothing is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"wanted a number, got {_shortened(value)}"
    # A huge integer has no float; comparing it is safe, converting it is not.
    if not 0 < value <= LARGEST_QUANTITY or not math.isfinite(value):
        return f"wanted a number above 0 and at most 1e9, got {_shortened(value)}"
    return None


def _sums_too_large(entries: Sequence[OrderEntry]) -> list[tuple[int, str]]:
    """Find children whose sum over several entries exceeds the limit of one entry."""
    sums: dict[str, Decimal] = {}
    problems = []
    for entry in entries:
        sums[entry.key] = sums.get(entry.key, Decimal(0)) + as_decimal(entry.quantity)
        if sums[entry.key] > LARGEST_QUANTITY:
            text = f"entries[{entry.index}].quantity: all entries of {entry.part_number!r} add up to over 1e9"
            problems.append((entry.index, text))
    return problems


def _entry(index: int, raw: Any) -> tuple[OrderEntry | None, str | None]:
    if not isinstance(raw, Mapping):
        return None, f"entries[{index}]: wanted an object, got {_shortened(raw)}"
    name, quantity = raw.get("child_part_number"), raw.get("quantity")
    problem = quantity_problem(quantity)
    text = None if problem is None else f"entries[{index}].quantity: {problem}"
    wrong = text_problem(name, 200) or (None if str(name).strip() else "wanted a part number, got none")
    if wrong:
        missing = f"entries[{index}].child_part_number: {wrong}"
        return None, missing if text is None else f"{missing}; {text}"
    # An entry with a bad quantity is still looked up, so that an unknown number is reported as well.
    components, wrong = _components(index, raw.get("components"))
    entry = OrderEntry(index, str(name).strip(), 1.0 if text else float(quantity or 0), components)
    return entry, "; ".join(filter(None, (text, wrong))) or None


def _components(index: int, raw: Any) -> tuple[Sequence[Mapping[str, str]], str | None]:
    if raw is None:
        return (), None
    where = f"entries[{index}].components"
    if not isinstance(raw, list) or not all(isinstance(component, Mapping) for component in raw):
        return (), f'{where}: wanted [{{"file": …, "object": …}}, …], got {_shortened(raw)}'
    for component in raw:
        if wrong := text_problem(component.get("file"), 4096) or text_problem(
            component.get("object", ""), 1024
        ):
            return (), f"{where}: {wrong}"
    return [{"file": component["file"], "object": component.get("object", "")} for component in raw], None


_LEFT_OUT_TEXTS = {"reason": 32, "name": 1024, "file": 4096, "object": 1024, "message": 4096}


def _left_out(raw: Any, most: int) -> list[dict[str, Any]]:
    if raw is None:
        return []
    if not isinstance(raw, list) or len(raw) > most:
        raise RejectedError(f"left_out: wanted a list of at most {most} objects, got {_shortened(raw)}")
    return [_left_out_part(index, part) for index, part in enumerate(raw)]


def _left_out_part(index: int, raw: Any) -> dict[str, Any]:
    if not isinstance(raw, Mapping) or not raw.get("reason"):
        raise RejectedError(f'left_out[{index}]: wanted {{"reason": …, "name": …, …}}, got {_shortened(raw)}')
    part: dict[str, Any] = {}
    for name, longest in _LEFT_OUT_TEXTS.items():
        value = raw.get(name, "")
        if problem := text_problem(value, longest):
            raise RejectedError(f"left_out[{index}].{name}: {problem}")
        if value:
            part[name] = value
    quantity = raw.get("quantity", 0)
    if isinstance(quantity, bool) or quantity != 0:
        if problem := quantity_problem(quantity):
            raise RejectedError(f"left_out[{index}].quantity: {problem}")
        part["quantity"] = quantity
    return part


def _document(raw: Any) -> tuple[str | None, str | None, str | None, int | None]:
    if raw is None:
        return None, None, None, None
    if not isinstance(raw, Mapping):
        raise RejectedError('document: wanted {"file": …, "sha256": …, "revision": …}')
    file, folder, revision = raw.get("file"), raw.get("folder"), raw.get("revision")
    if problem := text_problem(file, 4096):
        raise RejectedError(f"document.file: {problem}")
    if folder is not None and (problem := text_problem(folder, 1024)):
        raise RejectedError(f"document.folder: {problem}")
    sha256 = sha256_or_none("document.sha256", raw.get("sha256"))
    if isinstance(revision, float) and revision.is_integer():
        revision = int(revision)  # 2.0 is a whole number in JSON
    if revision is not None and not (type(revision) is int and 0 <= revision < 2**31):
        raise RejectedError("document.revision: wanted a whole number")
    return file, folder, sha256, revision


def _shortened(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…"


def event_of(tx: Tx, parent: Item, diff: BomDiff, answer: Mapping[str, Any]) -> dict[str, Any]:
    """Make the spec's event; it has ``warnings`` only if there is a conflict, which the diff lacks."""
    diff_json = dict(answer["diff"])
    if len(diff_json["unchanged"]) > EVENT_UNCHANGED_LINES:
        diff_json["unchanged_count"] = len(diff_json["unchanged"])
        diff_json["unchanged"] = []
    event: dict[str, Any] = {
        "type": "bom_merge",
        "item": parent.part_number,
        "user": tx.actor.username,
        "timestamp": spec_time(tx.stamp),
        "summary": summary(diff),
        "diff": diff_json,
        "resolve_url": answer["resolve_url"],
    }
    if "sync_id" in answer:
        event["sync_id"] = answer["sync_id"]
    if "left_out" in answer:
        event["left_out"] = answer["left_out"][:EVENT_UNCHANGED_LINES]
    if diff.conflicts:
        event["warnings"] = answer["warnings"]
    return event


@dataclass(frozen=True, slots=True)
class LastSync:
    """What is known of an assembly's last sync. ``at`` None: it was never synced.

    left_out
        what the assembly holds and the BOM does not: the fields of :class:`silo.bom.report.LeftOut`.
    refused_at
        when the server refused a later merge, None if it did not; ``refusal`` says why.
    """

    at: str | None = None
    username: str = ""
    document_file: str | None = None
    left_out: Sequence[Mapping[str, Any]] = ()
    refused_at: str | None = None
    refusal: str = ""
    components: Mapping[int, Sequence[Mapping[str, str]]] = field(default_factory=dict)
    folder: str = ""

    @property
    def gaps(self) -> list[dict[str, Any]]:
        """List everything that is not in the BOM, including a refused merge."""
        gaps = [dict(part) for part in self.left_out]
        if self.refused_at:
            gaps.append({"reason": Reason.REFUSED.value, "message": self.refusal})
        return gaps

    @property
    def words(self) -> str:
        """Count the gaps in words: ``2 missing, 1 unregistered``; "" if there are none."""
        return in_words(self.gaps)

    def to_wire(self) -> dict[str, Any]:
        """Return the last sync as the API sends it."""
        return {"at": wire_time(self.at), "left_out": self.gaps}


NEVER = LastSync()


def last_sync(tx: Tx, parent: Item) -> LastSync:
    """Return the last sync of one assembly; :data:`NEVER` if there was none."""
    return last_syncs(tx, [parent.id]).get(parent.id, NEVER)


def last_syncs(tx: Tx, parent_ids: Collection[int]) -> dict[int, LastSync]:
    """Read the last syncs of these assemblies; those that were never synced (nor refused) are absent."""
    rows = tx.conn.execute(select(bom_last_syncs).where(one_of(tx, bom_last_syncs.c.parent_id, parent_ids)))
    return {row.parent_id: _read(row) for row in rows}


def _read(row: Any) -> LastSync:
    return from_row(
        LastSync,
        row,
        left_out=json.loads(row.left_out),
        refusal=row.refusal or "",
        components={int(child): by_child for child, by_child in json.loads(row.components).items()},
        folder=row.folder or "",
    )


def remember(
    tx: Tx,
    parent: Item,
    order: MergeOrder,
    children: Mapping[str, int],
    before: LastSync,
    kept: Sequence[str],
) -> None:
    """Write down a merge. ``children``: part number → item id; ``kept``: the lines of missing components."""
    ids = {number.casefold(): str(child) for number, child in children.items()}
    entries = [
        {"child_part_number": ids[entry.key], "components": entry.components} for entry in order.entries
    ]
    by_child = {str(child): list(components) for child, components in before.components.items()}
    components = remembered(by_child, entries, [str(children[number]) for number in kept])
    tx.conn.execute(delete(bom_last_syncs).where(bom_last_syncs.c.parent_id == parent.id))
    row = {
        "at": tx.stamp,
        "document_file": order.document_file,
        "folder": order.document_folder or before.folder or None,
        "left_out": dumps([dict(part) for part in order.left_out]),
        "components": dumps(components),
    }
    _insert(tx, parent, row)


def remember_refusal(tx: Tx, parent: Item, message: str) -> None:
    """Write down that a merge was refused; the last good merge stays known. No event announces it."""
    written = {"refused_at": tx.stamp, "refusal": message}
    updated = tx.conn.execute(
        update(bom_last_syncs).where(bom_last_syncs.c.parent_id == parent.id).values(**written)
    )
    if not updated.rowcount:
        _insert(tx, parent, {"left_out": "[]", "components": "{}", **written})
    tx.touched.add(parent.uuid)


def _insert(tx: Tx, parent: Item, row: Mapping[str, Any]) -> None:
    who = {"parent_id": parent.id, "username": tx.actor.username}
    tx.conn.execute(insert(bom_last_syncs).values(**who, **row))


def in_sentences(gaps: Sequence[Mapping[str, Any]]) -> list[str]:
    """Describe what was left out, each gap in a sentence."""
    return [_sentence(gap) for gap in gaps]


def _sentence(gap: Mapping[str, Any]) -> str:
    name, count = gap.get("name") or gap.get("object") or "", gap.get("quantity")
    who = f"{count} × {name}" if count else str(name)
    where = f" ({gap['file']})" if gap.get("file") else ""
    texts = {
        Reason.MISSING: f"{who}{where}: the file is missing or cannot be read",
        Reason.UNREGISTERED: f"{who}{where}: no part number yet",
        Reason.BROKEN: str(gap.get("message", "")),
        Reason.REFUSED: f"a later sync was refused: {gap.get('message', '')}",
    }
    return texts.get(gap["reason"], f"{gap['reason']}: {who}{where} {gap.get('message', '')}").rstrip()


@dataclass(frozen=True, slots=True)
class MergeOutcome:
    """The answer's JSON text, and the BOM's version."""

    answer: str
    version: int


@dataclass(frozen=True, slots=True)
class _Prepared:
    parent: Item
    lines: Sequence[Line]
    child_ids: Mapping[str, int]
    plan: MergePlan
    accepted: Mapping[int, float]
    conflicts: Sequence[QuantityChange]  # all of them, accepted ones too
    before: LastSync


def preview_merge(tx: Tx, part_number: str, order: MergeOrder, expected: int | None) -> MergeOutcome:
    """Return the answer that :func:`merge_bom` would give, without changing anything."""
    parent = get_item(tx, part_number)
    check_version(parent, expected)
    prepared = _prepare(tx, parent, order)
    answer = answer_of(prepared.plan.diff, parent.part_number, order.sync_id, order.left_out)
    return MergeOutcome(dumps(answer), parent.bom_version)


def merge_bom(tx: Tx, part_number: str, order: MergeOrder, expected: int | None) -> MergeOutcome:
    """Merge the assembly's direct children into the BOM.

    Raises NotFoundError (parent), RejectedError (all bad entries at once), CycleError, VersionConflictError,
    ConflictError (the ``sync_id`` was used for something else), NewerRevisionError (the document is not the
    item's newest file), MissingRevisionError (its file is not here).
    """
    parent = locked_parent(tx, part_number)
    entries = [(entry.key, entry.quantity, entry.components) for entry in order.entries]
    document = (getattr(order, name) for name in names_of(MergeOrder) if name.startswith("document"))
    request = KeyedRequest.of(f"merge {parent.id}", order.sync_id, entries, order.left_out, *document)
    if earlier := earlier_answer(tx, request):
        whole = earlier.text if earlier.change_id is None else _rebuilt(tx, parent, earlier)
        return MergeOutcome(whole, earlier.version)
    check_version(parent, expected)
    prepared = _prepare(tx, parent, order)
    changes = _line_changes(tx, prepared)
    change_id, version = apply_changes(
        tx,
        parent,
        changes,
        ChangeNote(
            kind=ChangeKind.MERGE,
            summary=summary(prepared.plan.diff),
            document_file=order.document_file,
            document_sha256=order.document_sha256,
            document_revision=order.document_revision,
            sync_id=order.sync_id,
        ),
    )
    _remember_conflicts(tx, prepared)
    kept = [change.part_number for change in prepared.plan.diff.kept]
    remember(tx, parent, order, prepared.child_ids, prepared.before, kept)
    answer = answer_of(prepared.plan.diff, parent.part_number, order.sync_id, order.left_out)
    if (draft := draft_of(tx, parent)) is not None:
        answer["draft"] = draft
    text = dumps(answer)
    if request is not None:
        shorter = _without_unchanged(prepared, changes, answer)
        kept_change = change_id if shorter and len(shorter) < len(text) else None
        keep_answer(
            tx, request, KeptAnswer(shorter if shorter and kept_change else text, version, kept_change)
        )
    events.bom_merged(tx, parent, event_of(tx, parent, prepared.plan.diff, answer))
    return MergeOutcome(text, version)


def _prepare(tx: Tx, parent: Item, order: MergeOrder) -> _Prepared:
    check_document(tx, parent, order.document_revision, order.document_sha256)
    lines = lines_of(tx, parent)
    child_ids, names = _children(tx, order, lines)
    entries: list[dict[str, Any]] = [
        {"child_part_number": names[entry.key], "quantity": entry.quantity} for entry in order.entries
    ]
    before = last_sync(tx, parent)
    lines_before = [
        {**_as_mapping(line), "components": before.components.get(line.child_id, ())} for line in lines
    ]
    plan = plan_merge(entries, lines_before, order.missing)
    kept = {change.part_number for change in plan.diff.kept}
    check_no_cycle(tx, parent, [child_ids[change.part_number] for change in plan.diff.added])
    accepted = {
        row.child_id: row.cad_quantity
        for row in tx.conn.execute(
            select(bom_conflicts.c.child_id, bom_conflicts.c.cad_quantity).where(
                bom_conflicts.c.parent_id == parent.id, bom_conflicts.c.accepted
            )
        )
    }
    conflicts = [
        *plan.diff.conflicts,
        *_overrides_gone(lines, kept.union(e["child_part_number"] for e in entries)),
    ]
    open_ones = tuple(c for c in conflicts if accepted.get(child_ids[c.part_number]) != c.local_quantity)
    plan = replace(plan, diff=replace(plan.diff, conflicts=open_ones))
    return _Prepared(parent, lines, child_ids, plan, accepted, conflicts, before)


def _children(tx: Tx, order: MergeOrder, lines: Sequence[Line]) -> tuple[dict[str, int], dict[str, str]]:
    """Find (part number → item id, key → part number) of each child; RejectedError lists all bad entries."""
    child_ids = {line.child_part_number: line.child_id for line in lines}
    names = {line.child_part_number.casefold(): line.child_part_number for line in lines}
    asked = {entry.key for entry in order.entries if entry.key not in names}
    archived: set[str] = set()
    query = select(items.c.id, items.c.part_number, items.c.part_number_key, items.c.archived_at)
    for row in tx.conn.execute(query.where(one_of(tx, items.c.part_number_key, asked))):
        if row.archived_at:
            archived.add(row.part_number_key)
            continue
        child_ids[row.part_number] = row.id
        names[row.part_number_key] = row.part_number
    problems = list(order.problems)
    for entry in order.entries:
        if entry.key not in names:
            name = f"entries[{entry.index}].child_part_number: {entry.part_number!r}"
            gone = entry.key in archived
            problem = f"{name} is archived" if gone else f"{name} does not exist on this server"
            problems.append((entry.index, problem))
    if problems:
        texts = [text for _, text in sorted(problems, key=lambda problem: problem[0])]
        raise RejectedError(
            f"{len(texts)} of the entries cannot be merged, so nothing was changed: {texts[0]}"
            + (f" (and {len(texts) - 1} more)" if len(texts) > 1 else ""),
            texts,
        )
    return child_ids, names


def _as_mapping(line: Line) -> dict[str, Any]:
    state = line.state
    return {
        "child_part_number": line.child_part_number,
        "quantity": state.quantity,
        "source": state.source,
        "unit": state.unit,
        "rel_type": state.rel_type,
        "unreferenced_since": state.unreferenced_since,
    }


def _overrides_gone(lines: Sequence[Line], numbers: set[str]) -> list[QuantityChange]:
    # A person changed a quantity of a CAD line; now the assembly no longer has it. The line is theirs, so it
    # stays, but silence would leave a part in the BOM that nobody needs.
    return [
        QuantityChange(line.child_part_number, 0.0, line.state.quantity, line.state.unit or "")
        for line in lines
        if line.state.override and line.child_part_number not in numbers
    ]


def _line_changes(tx: Tx, prepared: _Prepared) -> list[LineRecord]:
    plan = prepared.plan
    changes = [
        LineRecord(
            new_line_id(),
            prepared.child_ids[added.part_number],
            None,
            LineState(float(added.quantity or 0.0), "assembly"),
        )
        for added in plan.diff.added
    ]
    quantities = {c.part_number: c.local_quantity for c in plan.diff.quantity_changed}
    flag, unflag = set(plan.flag), set(plan.unflag)
    touched = flag | unflag | quantities.keys()
    for line in prepared.lines:
        name, before = line.child_part_number, line.state
        # Ownership is enforced here, on the stored row, whatever the plan says.
        if name not in touched or is_manual(_as_mapping(line)):
            continue
        since = tx.stamp if name in flag else None if name in unflag else before.unreferenced_since
        after = replace(before, quantity=quantities.get(name, before.quantity), unreferenced_since=since)
        changes.append(LineRecord(line.id, line.child_id, before, after, line.position))
    return changes


def _remember_conflicts(tx: Tx, prepared: _Prepared) -> None:
    ours = bom_conflicts.c.parent_id == prepared.parent.id
    before = {row.child_id: row for row in tx.conn.execute(select(bom_conflicts).where(ours))}
    tx.conn.execute(delete(bom_conflicts).where(ours))
    rows = []
    for conflict in prepared.conflicts:
        child_id = prepared.child_ids[conflict.part_number]
        row_before = before.get(child_id)
        same = row_before is not None and row_before.cad_quantity == float(conflict.local_quantity)
        rows.append(
            {
                "parent_id": prepared.parent.id,
                "child_id": child_id,
                "cad_quantity": float(conflict.local_quantity),
                "since": row_before.since if row_before is not None and same else tx.stamp,
                "accepted": prepared.accepted.get(child_id) == conflict.local_quantity,
            }
        )
    insert_rows(tx, bom_conflicts, rows)


def _without_unchanged(
    prepared: _Prepared, changes: Sequence[LineRecord], answer: Mapping[str, Any]
) -> str | None:
    """Write the answer without its unchanged lines, which the history has; None if the history lacks them.

    Most of an answer says what is as it was; stored in full, a vault's nightly syncs would be gigabytes.
    """
    unchanged = answer["diff"]["unchanged"]
    places = {pair["part_number"]: place for place, pair in enumerate(unchanged)}
    lines = [line for line in prepared.lines if line.state.rel_type == "component"]
    same = [line for line in lines if line.child_part_number in places]
    order = sorted(range(len(same)), key=lambda n: places[same[n].child_part_number])
    if [_pair(same[n].child_part_number, same[n].state) for n in order] != unchanged:
        return None
    others = {line.id for line in lines} | {change.line_id for change in changes}
    kept = {**answer, "diff": {**answer["diff"], "unchanged": []}}
    stored: dict[str, Any] = {"answer": kept, "others": sorted(others - {line.id for line in same})}
    if order != sorted(order):
        stored["order"] = order
    return dumps(stored)


def _rebuilt(tx: Tx, parent: Item, earlier: KeptAnswer) -> str:
    kept = json.loads(earlier.text)
    others = set(kept["others"])
    same = [
        _pair(line.child.part_number, line.state)
        for line in state_at(tx, parent, earlier.change_id or 0)
        if line.state.rel_type == "component" and line.line_id not in others
    ]
    kept["answer"]["diff"]["unchanged"] = [same[n] for n in kept.get("order", range(len(same)))]
    return dumps(kept["answer"])


def _pair(part_number: str, state: LineState) -> dict[str, Any]:
    return {"part_number": part_number, "quantity": plain(state.quantity)}
