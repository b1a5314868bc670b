# SPDX-License-Identifier: LGPL-2.1-or-later
"""A merge request (spec bom-sync §5), and the report of a BOM that is held, read from decoded JSON.

It is read by hand and not by a model, because a bad quantity and an unknown part number are reported
together, each with the index of its entry, in the one 400.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from silo.bom.errors import RejectedError
from silo.bom.left_out import Reason
from silo.bom.message import joined, message
from silo.bom.quantities import LARGEST_QUANTITY, quantity_of
from silo_server.errors import TooLargeError
from silo_server.services.field_checks import quantity_problem, sha256_or_none, shortened, text_problem

LONGEST_FIND_NUMBER = 32


@dataclass(frozen=True, slots=True)
class MergeRequestEntry:
    """One direct child as requested; ``key`` is its case-folded number.

    find_number
        what CAD proposes for a new line.
    """

    index: int
    part_number: str
    quantity: Decimal
    components: Sequence[Mapping[str, str]] = ()
    find_number: str | None = None

    @property
    def key(self) -> str:
        return self.part_number.casefold()


@dataclass(frozen=True, slots=True)
class MergeRequestIn:
    """A merge request. ``problems`` are (index, text) of the entries that are unusable in themselves."""

    entries: Sequence[MergeRequestEntry]
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


def read_merge_request(body: Any, max_entries: int) -> MergeRequestIn:
    """Read the request from a decoded JSON body; RejectedError if the body as a whole is unusable.

    Unknown keys are ignored. Whatever ``source`` says, the entries are an assembly's.
    """
    if not isinstance(body, Mapping) or not isinstance(body.get("entries"), list):
        raise RejectedError('body: wanted {"entries": [{"child_part_number": …, "quantity": …}, …]}')
    if len(body["entries"]) > max_entries:
        raise TooLargeError(
            message(
                "entries: this server takes at most {most}, got {entries}",
                most=max_entries,
                entries=len(body["entries"]),
            )
        )
    sync_id, dry_run = body.get("sync_id"), body.get("dry_run")
    if sync_id is not None and (
        problem := text_problem(sync_id, 128) if sync_id else message("wanted a text, got none")
    ):
        raise RejectedError(message("sync_id: {problem}", problem=problem))
    if dry_run is not None and not isinstance(dry_run, bool):
        raise RejectedError(message("dry_run: wanted true or false"))
    document = _document(body.get("document"))
    entries: list[MergeRequestEntry] = []
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
    return MergeRequestIn(entries, problems, sync_id, bool(dry_run), *document, left_out)


def read_held_report(body: Any, max_entries: int) -> tuple[list[dict[str, Any]], str | None, str | None]:
    """Read what a client says of a BOM that it cannot send: what holds it, its file, its project's folder."""
    if not isinstance(body, Mapping) or not isinstance(body.get("left_out"), list) or not body["left_out"]:
        raise RejectedError('body: wanted {"left_out": [{"reason": …, "name": …}, …]}, at least one of them')
    file, folder, _sha256, _revision = _document(body.get("document"))
    return _left_out(body["left_out"], max_entries), file, folder


def _sums_too_large(entries: Sequence[MergeRequestEntry]) -> list[tuple[int, str]]:
    """Find children whose sum over several entries exceeds the limit of one entry."""
    sums: dict[str, Decimal] = {}
    problems: list[tuple[int, str]] = []
    for entry in entries:
        sums[entry.key] = sums.get(entry.key, Decimal(0)) + entry.quantity
        if sums[entry.key] > LARGEST_QUANTITY:
            text = message(
                "entries[{index}].quantity: all entries of {part_number} add up to over 1e9",
                index=entry.index,
                part_number=repr(entry.part_number),
            )
            problems.append((entry.index, text))
    return problems


def _entry(index: int, raw: Any) -> tuple[MergeRequestEntry | None, str | None]:
    if not isinstance(raw, Mapping):
        return None, message("entries[{index}]: wanted an object, got {got}", index=index, got=shortened(raw))
    name, quantity = raw.get("child_part_number"), raw.get("quantity")
    problem = quantity_problem(quantity)
    text = (
        None
        if problem is None
        else message("entries[{index}].quantity: {problem}", index=index, problem=problem)
    )
    wrong = text_problem(name, 200) or (
        None if str(name).strip() else message("wanted a part number, got none")
    )
    if wrong:
        missing = message("entries[{index}].child_part_number: {problem}", index=index, problem=wrong)
        return None, missing if text is None else joined("; ", (missing, text))
    # An entry with a bad quantity is still looked up, so that an unknown number is reported as well.
    components, wrong = _components(index, raw.get("components"))
    proposed = raw.get("find_number")
    refused = None if proposed is None else text_problem(proposed, LONGEST_FIND_NUMBER)
    wrong_number = refused and message(
        "entries[{index}].find_number: {problem}", index=index, problem=refused
    )
    amount = quantity_of(1 if text else quantity or 0)
    number = None if refused or proposed is None else proposed.strip() or None
    entry = MergeRequestEntry(index, str(name).strip(), amount, components, number)
    return entry, joined("; ", wrong_texts) if (
        wrong_texts := list(filter(None, (text, wrong, wrong_number)))
    ) else None


def _components(index: int, raw: Any) -> tuple[Sequence[Mapping[str, str]], str | None]:
    if raw is None:
        return (), None
    where = f"entries[{index}].components"
    if not isinstance(raw, list) or not all(isinstance(component, Mapping) for component in raw):
        return (), f'{where}: wanted [{{"file": …, "object": …}}, …], got {shortened(raw)}'
    for component in raw:
        if wrong := text_problem(component.get("file"), 4096) or text_problem(
            component.get("object", ""), 1024
        ):
            return (), message("{entry}: {problem}", entry=where, problem=wrong)
    return [{"file": component["file"], "object": component.get("object", "")} for component in raw], None


_LEFT_OUT_TEXTS = {"reason": 32, "name": 1024, "file": 4096, "object": 1024, "message": 4096}


def _left_out(raw: Any, most: int) -> list[dict[str, Any]]:
    if raw is None:
        return []
    if not isinstance(raw, list) or len(raw) > most:
        raise RejectedError(
            message(
                "left_out: wanted a list of at most {most} objects, got {got}", most=most, got=shortened(raw)
            )
        )
    return [_left_out_part(index, part) for index, part in enumerate(raw)]


def _left_out_part(index: int, raw: Any) -> dict[str, Any]:
    if not isinstance(raw, Mapping) or not raw.get("reason"):
        raise RejectedError(f'left_out[{index}]: wanted {{"reason": …, "name": …, …}}, got {shortened(raw)}')
    part: dict[str, Any] = {}
    for name, longest in _LEFT_OUT_TEXTS.items():
        value = raw.get(name, "")
        if problem := text_problem(value, longest):
            raise RejectedError(
                message("left_out[{index}].{name}: {problem}", index=index, name=name, problem=problem)
            )
        if value:
            part[name] = value
    quantity = raw.get("quantity", 0)
    if isinstance(quantity, bool) or quantity != 0:
        if problem := quantity_problem(quantity):
            raise RejectedError(
                message("left_out[{index}].quantity: {problem}", index=index, problem=problem)
            )
        part["quantity"] = quantity
    return part


def _document(raw: Any) -> tuple[str | None, str | None, str | None, int | None]:
    if raw is None:
        return None, None, None, None
    if not isinstance(raw, Mapping):
        raise RejectedError('document: wanted {"file": …, "sha256": …, "revision": …}')
    file, folder, revision = raw.get("file"), raw.get("folder"), raw.get("revision")
    if problem := text_problem(file, 4096):
        raise RejectedError(message("document.file: {problem}", problem=problem))
    if folder is not None and (problem := text_problem(folder, 1024)):
        raise RejectedError(message("document.folder: {problem}", problem=problem))
    sha256 = sha256_or_none("document.sha256", raw.get("sha256"))
    if isinstance(revision, float) and revision.is_integer():
        revision = int(revision)  # 2.0 is a whole number in JSON
    if revision is not None and not (type(revision) is int and 0 <= revision < 2**31):
        raise RejectedError(message("document.revision: wanted a whole number"))
    return file, folder, sha256, revision
