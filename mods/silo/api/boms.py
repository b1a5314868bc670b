# SPDX-License-Identifier: LGPL-2.1-or-later
"""The client's questions about BOMs (spec bom-sync §5, silo-contract §1.5).

Merging on servers of every age: the answer read strictly, else the BOM read back, else line by line.

A server without merge (the real Silo's first phase) gets the same plan as single calls: added lines are
added, changed quantities changed, nothing is removed and no line of a person is touched. That is not one
step: what breaks off half-way continues with the next run, which plans from the lines as they are then.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

from pydantic import ValidationError

from silo.api.policy import Reply, complaint
from silo.api.transport import Caller, Cancel, body, stop_if
from silo.api.wire import (
    Answer,
    BomLine,
    LineTexts,
    MergeDiff,
    MergeEntry,
    MergeRequest,
    MergeResult,
    MergeWarning,
    OrderList,
    ProductChanges,
    ProductSummary,
    Quantity,
    QuantityLine,
)
from silo.bom.compare.answer import answer_of, conflict_warning
from silo.bom.compare.merge import plan_merge
from silo.bom.compare.owner import is_manual
from silo.bom.errors import (
    ConflictError,
    CycleError,
    MissingRevisionError,
    NewerRevisionError,
    NotFoundError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
    VersionConflictError,
    listed,
)
from silo.bom.model import BomDiff, QuantityChange
from silo.bom.quantities import same_quantity, says_the_same

UNCLEAR = "answer_not_understood"
"""The warning of a merge whose answer was not understood, and that the BOM shows anyway."""

NOT_ATOMIC = "not_atomic"
"""The warning of a merge that was made of single calls."""


def unusual(result: MergeResult | None) -> list[str]:
    """List, in sentences, what a person must know about a merge that was not a usual one."""
    warnings = result.warnings if result is not None else ()
    return [warning.message for warning in warnings if warning.type in (UNCLEAR, NOT_ATOMIC)]


def merge_result(reply: Reply) -> MergeResult | None:
    """Read the answer to a merge strictly: only an answer that states what was done counts as success.

    None: neither success nor failure can be read from it. Raises :class:`ServerFaultError` for an answer that
    reports a failure, whatever its status.
    """
    if reply.is_html:
        return None
    failure = complaint(reply)
    try:
        data = json.loads(reply.content)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict):
        return None
    word = str(data.get("status") or "").casefold()
    if data.get("error") or data.get("success") is False or data.get("ok") is False or word in _FAILED:
        raise ServerFaultError(
            f"{reply.where.asked}: the server answered {reply.status} but reports a failure"
            f"{': ' + failure.text if failure.text else ''}"
        )
    diff = data.get("diff")
    if not isinstance(diff, dict) or not _LISTS.intersection(diff) or (word and word not in _DONE):
        return None
    try:
        return MergeResult.model_validate(data)
    except ValidationError:
        return None


_DONE = {"merged", "ok", "success", "done", "unchanged", "no_changes", "dry_run", "preview"}
_FAILED = {"error", "failed", "failure", "rejected", "rolled_back", "aborted"}
_LISTS = {"added", "removed", "quantity_changed", "unchanged"}


def result_of(diff: BomDiff, part_number: str, request: MergeRequest) -> MergeResult:
    """Make the answer of spec §5 for a planned merge."""
    left_out = [part.model_dump() for part in request.left_out or ()]
    return MergeResult.model_validate(answer_of(diff, part_number, request.sync_id, left_out))


def read_back(api: BomCalls, part_number: str, request: MergeRequest, host: str) -> MergeResult:
    """Read the BOM again after a merge whose answer says neither success nor failure, and make the result
    from it. Raises :class:`ServerFaultError` if the BOM does not show the merge.
    """
    sent = f"{host}: the BOM of {part_number} was sent, but the answer was not understood"
    if request.dry_run:
        raise ServerFaultError(f"{sent}; nothing was to be changed")
    try:
        lines = {line.child_part_number.casefold(): line for line in api.get_bom(part_number)}
    except SiloError as error:
        raise ServerFaultError(f"{sent}, and the BOM cannot be read back ({error})") from error
    wrong = [entry for entry in request.entries if not _shows(lines.get(_key(entry)), entry)]
    if wrong:
        names = listed([entry.child_part_number for entry in wrong])
        raise ServerFaultError(f"{sent}, and its BOM does not show {names} as in the assembly")
    lines_of = [lines[_key(entry)] for entry in request.entries]
    shown = [QuantityLine(part_number=line.child_part_number, quantity=line.quantity) for line in lines_of]
    return MergeResult(
        diff=MergeDiff(unchanged=shown),
        warnings=[
            MergeWarning(
                type=UNCLEAR, part_number=part_number, message=f"{sent}; the BOM shows all of its lines"
            )
        ],
        sync_id=request.sync_id,
    )


def without_manual(
    api: BomCalls, part_number: str, request: MergeRequest, merge: Callable[[MergeRequest], MergeResult]
) -> MergeResult | None:
    """Merge all children but those that people own; None if people own none. For a server that answers 409.

    The children of people are reported as conflicts if the quantities differ.
    """
    manual = {line.child_part_number.casefold(): line for line in api.get_bom(part_number) if is_manual(line)}
    manual_entries = [entry for entry in request.entries if _key(entry) in manual]
    if not manual_entries:
        return None
    others = [entry for entry in request.entries if _key(entry) not in manual]
    result = merge(request.model_copy(update={"entries": others}))
    marked = {warning.part_number.casefold() for warning in result.warnings if warning.type == "conflict"}
    warnings = [
        MergeWarning.model_validate(
            conflict_warning(
                QuantityChange(entry.child_part_number, entry.quantity, line.quantity, line.unit or "")
            )
        )
        for entry in manual_entries
        if not says_the_same(entry.quantity, (line := manual[_key(entry)]).quantity, line.unit)
        and _key(entry) not in marked
    ]
    return result.model_copy(update={"warnings": [*result.warnings, *warnings]})


def merge_by_lines(
    api: BomCalls, part_number: str, request: MergeRequest, host: str, *, cancelled: Cancel | None = None
) -> MergeResult:
    """Merge with one call for each line. Raises :class:`RejectedError` with all children that were refused.

    Raises :class:`RouteMissingError` if the server has no calls for single lines either.
    """
    lines = api.get_bom(part_number)
    plan = plan_merge([entry.model_dump() for entry in request.entries], lines)
    result = result_of(plan.diff, part_number, request)
    if request.dry_run:
        return result
    refused: list[str] = []
    for change in plan.diff.added:
        stop_if(cancelled)
        values = {"quantity": change.quantity, "rel_type": "component", "source": "assembly"}
        add = partial(api.add_bom_line, part_number, change.part_number, **values)
        _try(refused, change.part_number, add)
    for changed in plan.diff.quantity_changed:
        stop_if(cancelled)
        number, quantity = changed.part_number, changed.local_quantity
        _try(refused, number, partial(api.update_bom_line, part_number, number, quantity=quantity))
    written = len(plan.diff.added) + len(plan.diff.quantity_changed) - len(refused)
    if refused:
        raise RejectedError(
            f"{host} has no merge; of the BOM of {part_number}, {written} lines were written one by one and "
            f"{len(refused)} were refused: {'; '.join(refused[:5])}",
            refused,
        )
    text = f"{host} has no merge: {written} lines were written one by one, not in one step"
    warning = MergeWarning(type=NOT_ATOMIC, part_number=part_number, message=text)
    return result.model_copy(update={"warnings": [*result.warnings, warning]} if written else {})


def _try(refused: list[str], child: str, call: Callable[[], object]) -> None:
    """Collect an error that concerns this line alone; any other error ends the run, and the next run
    continues there.
    """
    try:
        call()
    except (CycleError, RouteMissingError):
        raise
    except (RejectedError, NotFoundError, ConflictError) as error:
        refused.append(f"{child}: {error}")


def _key(entry: MergeEntry) -> str:
    return entry.child_part_number.casefold()


def _shows(line: BomLine | None, entry: MergeEntry) -> bool:
    # A line that a person owns may have another quantity: a merge leaves it.
    return line is not None and (is_manual(line) or same_quantity(line.quantity, entry.quantity))


class BomsAnswer(Answer):
    """The answer of ``POST /api/items/boms``: the lines of each known item, by its number as asked for."""

    boms: dict[str, list[BomLine]]


class LineBody(LineTexts):
    """``POST …/bom`` and ``PUT …/bom/{child}``: a line as a person writes it.

    ``source`` is for a merge by single calls, on a server that has no other.
    """

    child_part_number: str | None = None
    quantity: Quantity | None = None
    rel_type: str | None = None
    reference_designators: list[str] | None = None
    child_revision: int | None = None
    metadata: dict[str, Any] | None = None
    source: str | None = None


class BomCalls(Caller):
    """Reading and merging BOMs."""

    def get_bom(self, part_number: str, /) -> list[BomLine]:
        """Return the BOM lines directly below an item."""
        pages = self._all(BomLine, f"the BOM of {part_number}", *_bom(part_number))
        return _checked(part_number, [line for page, _ in pages for line in page])

    def get_boms(
        self, part_numbers: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, list[BomLine]]:
        """Return the BOM lines directly below each of these items; unknown items are left out.

        Sends one request per 1000 items if the server offers that, else one for each.
        """

        def batch(some: Sequence[str]) -> dict[str, list[BomLine]]:
            where = (f"the BOMs of {len(some)} items", "items", "boms")
            reply = self._ask(*where, part_numbers=list(some), cancelled=cancelled)
            boms = reply.model(BomsAnswer).boms
            return {number: _checked(number, lines) for number, lines in boms.items()}

        def single(part_number: str) -> list[BomLine] | None:
            try:
                return self.get_bom(part_number)
            except RouteMissingError:
                raise
            except NotFoundError:
                return None

        return self._many("boms", part_numbers, batch, single, cancelled)

    def get_summary(self, part_number: str, /) -> ProductSummary | None:
        """Return the summary that the server keeps of a product over all levels; None if it keeps none.

        Raises :class:`BusyError` while the server sums up a very large product.
        """
        try:
            reply = self._get(f"the summary of {part_number}", *_bom(part_number), "summary")
        except RouteMissingError:
            return None
        return reply.model(ProductSummary)

    def get_changes(self, part_number: str, since: str, until: str = "", /) -> ProductChanges:
        """Return what changed in a product over all levels between two points: days, times, ``r3`` or
        released revisions; ``until`` "" means now. Raises :class:`RouteMissingError` if the server compares
        nothing.
        """
        query = {"from": since, **({"to": until} if until else {})}
        where = (f"what changed in {part_number}", *_bom(part_number), "changes")
        return self._get(*where, params=query).model(ProductChanges)

    def get_order(self, part_number: str, /, **asked: str | int) -> OrderList:
        """Return what to order for a number of ``pieces``. Options: ``spares``, a ``release``, only the
        ``rest``.

        Raises :class:`RouteMissingError` from a server without order lists.
        """
        where = (f"the order list of {part_number}", "items", part_number, "order")
        return self._get(*where, params=asked).model(OrderList)

    def get_order_table(self, part_number: str, end: str, /, **asked: str | int) -> bytes:
        """Return the order list as a file, ``csv`` or ``xlsx``: the parts of a ``kind``, or of a
        ``supplier``.
        """
        where = (f"the order list of {part_number}", "items", part_number, f"order.{end}")
        return self._get(*where, params=asked).content

    def get_bom_version(self, part_number: str, /) -> str | None:
        """Return the present version of the BOM, for ``if_match``; None if the server keeps none."""
        return self._get(f"the BOM of {part_number}", *_bom(part_number)).version()

    def merge_bom(
        self,
        part_number: str,
        request: MergeRequest,
        /,
        *,
        if_match: int | str | None = None,
        cancelled: Cancel | None = None,
    ) -> MergeResult:
        """Merge an assembly's direct children into its BOM (spec §5).

        With a ``sync_id`` the request is repeated if the connection breaks; the server then repeats its first
        answer.

        A server without merge gets the plan as single calls (:mod:`silo.api.boms`). A server that refuses
        lines of people gets only the others.

        Raises :class:`NotFoundError` for an unknown assembly but :class:`RouteMissingError` for a server that
        knows neither merge nor single lines, :class:`RejectedError` with all bad entries,
        :class:`CycleError`, :class:`ServerFaultError` for an answer that reports a failure or that the BOM
        contradicts, :class:`VersionConflictError` for ``if_match``, :class:`NewerRevisionError` and
        :class:`MissingRevisionError` for a ``document`` that is not the newest file or not there,
        :class:`ReadOnlyError`.
        """
        once = partial(self._merge_once, part_number, if_match=if_match, cancelled=cancelled)
        host = self._address.host
        try:
            reply = once(request)
        except RouteMissingError as missing:
            if if_match is not None:
                raise  # Single calls cannot promise that nobody changed the BOM meanwhile.
            try:
                return merge_by_lines(self, part_number, request, host, cancelled=cancelled)
            except NotFoundError:
                raise missing from None  # It has no single lines either.
        except CycleError:
            raise
        except ConflictError as error:
            decided = VersionConflictError, NewerRevisionError, MissingRevisionError
            if isinstance(error, decided) or request.dry_run:
                raise
            rest = without_manual(self, part_number, request, lambda r: self._result(part_number, r, once(r)))
            if rest is None:
                raise
            return rest
        return self._result(part_number, request, reply)

    def _result(self, part_number: str, request: MergeRequest, reply: Reply) -> MergeResult:
        result = merge_result(reply)
        return result if result is not None else read_back(self, part_number, request, self._address.host)

    def _merge_once(
        self,
        part_number: str,
        request: MergeRequest,
        *,
        if_match: int | str | None,
        cancelled: Cancel | None,
    ) -> Reply:
        headers = {} if if_match is None else {"If-Match": '"{}"'.format(str(if_match).strip('"'))}
        try:
            return self._change(
                "POST",
                f"the BOM of {part_number}",
                *_bom(part_number),
                "merge",
                body=request,
                headers=headers,
                repeatable=bool(request.sync_id or request.dry_run),
                cancelled=cancelled,
                # Without "dry_run" it would be a merge.
                extensions=()
                if request.dry_run
                else ("source", "sync_id", "document", "left_out", "components"),
            )
        except NotFoundError as error:
            raise self._what_is_missing(part_number, error) from error

    def add_bom_line(self, part_number: str, child: str, /, **values: Any) -> BomLine:
        """Add a line by hand (``source`` manual): ``quantity``, ``unit``, ``notes``, ``find_number``, …

        The fields are those of :class:`LineBody`. A merge never touches such a line.
        """
        line = body(LineBody, {"quantity": 1, **values, "child_part_number": child}, "a BOM line")
        reply = self._change(
            "POST",
            f"{child} on the BOM of {part_number}",
            *_bom(part_number),
            body=line,
            extensions=("source", *LineTexts.model_fields.keys() - {"unit"}),
        )
        return reply.model(BomLine)

    def update_bom_line(self, part_number: str, child: str, /, **changes: Any) -> BomLine:
        """Change a line by hand; the fields are those of :class:`LineBody`."""
        line = body(LineBody, changes, "a BOM line")
        subject = f"{child} on the BOM of {part_number}"
        return self._change("PUT", subject, *_bom(part_number), child, body=line).model(BomLine)

    def remove_bom_line(self, part_number: str, child: str, /) -> None:
        """Remove a line. A person decides this; a merge never removes one."""
        self._delete(f"{child} on the BOM of {part_number}", *_bom(part_number), child)

    def _what_is_missing(self, part_number: str, error: NotFoundError) -> NotFoundError:
        # The status alone does not say whether assembly or route is unknown; the item's own address does.
        host = self._address.host
        try:
            self._get(f"item {part_number}", "items", part_number)
        except NotFoundError:
            return NotFoundError(f"{host} has no item {part_number}; register the assembly first ({error})")
        return RouteMissingError(
            f"{host} knows {part_number} but not how to merge a BOM; it needs a newer Silo ({error})"
        )


def _checked(part_number: str, lines: list[BomLine]) -> list[BomLine]:
    """Return the lines. Raises :class:`ServerFaultError` if they belong to another item."""
    for line in lines:
        if line.parent_part_number and line.parent_part_number.casefold() != part_number.strip().casefold():
            raise ServerFaultError(
                f"the BOM of {part_number}: the server answered with the BOM of {line.parent_part_number}"
            )
    return lines


def _bom(part_number: str) -> tuple[str, str, str]:
    return ("items", part_number, "bom")
