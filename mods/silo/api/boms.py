# SPDX-License-Identifier: LGPL-2.1-or-later
"""The client's questions about BOMs (spec bom-sync §5, silo-contract §1.5)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

from silo.api.caller import Caller, body
from silo.api.merging import merge_by_lines, merge_result, read_back, without_manual
from silo.api.replies import Reply
from silo.api.transport import Cancel
from silo.api.wire import (
    Answer,
    BomLine,
    HeldBom,
    HeldReport,
    LineTexts,
    MergeRequest,
    MergeResult,
    OrderList,
    ProductChanges,
    ProductSummary,
    Quantity,
)
from silo.bom.errors import (
    ConflictError,
    CycleError,
    MissingRevisionError,
    NewerRevisionError,
    NotFoundError,
    RouteMissingError,
    ServerFaultError,
    VersionConflictError,
)
from silo.bom.message import message


class BomsAnswer(Answer):
    """The answer of ``POST /api/items/boms``: the lines of each known item, by its number as asked for."""

    boms: dict[str, list[BomLine]]


class LineBody(LineTexts):
    """``POST …/bom`` and ``PUT …/bom/{child}``: a line as a user writes it.

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
        pages = self._all(
            BomLine, message("the BOM of {part_number}", part_number=part_number), *_bom(part_number)
        )
        return _checked(part_number, [line for page, _ in pages for line in page])

    def get_boms(
        self, part_numbers: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, list[BomLine]]:
        """Return the BOM lines directly below each of these items; unknown items are left out.

        Sends one request per 1000 items if the server offers that, else one for each.
        """

        def batch(some: Sequence[str]) -> dict[str, list[BomLine]]:
            where = (message("the BOMs of {count} items", count=len(some)), "items", "boms")
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
            reply = self._get(
                message("the summary of {part_number}", part_number=part_number),
                *_bom(part_number),
                "summary",
            )
        except RouteMissingError:
            return None
        return reply.model(ProductSummary)

    def get_changes(self, part_number: str, since: str, until: str = "", /) -> ProductChanges:
        """Return what changed in a product over all levels between two points: days, times, ``r3`` or
        released revisions; ``until`` "" means now. Raises :class:`RouteMissingError` if the server compares
        nothing.
        """
        query = {"from": since, **({"to": until} if until else {})}
        where = (
            message("what changed in {part_number}", part_number=part_number),
            *_bom(part_number),
            "changes",
        )
        return self._get(*where, params=query).model(ProductChanges)

    def get_order(self, part_number: str, /, **asked: str | int) -> OrderList:
        """Return what to order for a number of ``pieces``. Options: ``spares``, a ``release``, only the
        ``rest``.

        Raises :class:`RouteMissingError` from a server without order lists.
        """
        where = (
            message("the order list of {part_number}", part_number=part_number),
            "items",
            part_number,
            "order",
        )
        return self._get(*where, params=asked).model(OrderList)

    def get_order_table(self, part_number: str, end: str, /, **asked: str | int) -> bytes:
        """Return the order list as a file, ``csv`` or ``xlsx``: the parts of a ``kind``, or of a
        ``supplier``.
        """
        where = (
            message("the order list of {part_number}", part_number=part_number),
            "items",
            part_number,
            f"order.{end}",
        )
        return self._get(*where, params=asked).content

    def get_bom_version(self, part_number: str, /) -> str | None:
        """Return the present version of the BOM, for ``if_match``; None if the server keeps none."""
        return self._get(
            message("the BOM of {part_number}", part_number=part_number), *_bom(part_number)
        ).version()

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

        A server without merge gets the plan as single calls (:mod:`silo.api.merging`). A server that refuses
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
                raise  # Single calls cannot promise that the BOM was not changed meanwhile.
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
                message("the BOM of {part_number}", part_number=part_number),
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

    def hold_bom(
        self, part_number: str, report: HeldReport, /, *, cancelled: Cancel | None = None
    ) -> HeldBom:
        """Report that the BOM of an assembly cannot be sent, and why; the next merge takes it back.

        Raises :class:`NotFoundError` for an unknown assembly and from a server that takes no such report.
        """
        subject = f"the held BOM of {part_number}"
        where = (*_bom(part_number), "held")
        reply = self._change("POST", subject, *where, body=report, repeatable=True, cancelled=cancelled)
        return reply.model(HeldBom)

    def add_bom_line(self, part_number: str, child: str, /, **values: Any) -> BomLine:
        """Add a line by hand (``source`` manual): ``quantity``, ``unit``, ``notes``, ``find_number``, …

        The fields are those of :class:`LineBody`. A merge never touches such a line.
        """
        line = body(LineBody, {"quantity": 1, **values, "child_part_number": child}, message("a BOM line"))
        reply = self._change(
            "POST",
            message("{child} on the BOM of {part_number}", child=child, part_number=part_number),
            *_bom(part_number),
            body=line,
            extensions=("source", *LineTexts.model_fields.keys() - {"unit"}),
        )
        return reply.model(BomLine)

    def update_bom_line(self, part_number: str, child: str, /, **changes: Any) -> BomLine:
        """Change a line by hand; the fields are those of :class:`LineBody`."""
        line = body(LineBody, changes, message("a BOM line"))
        subject = message("{child} on the BOM of {part_number}", child=child, part_number=part_number)
        return self._change("PUT", subject, *_bom(part_number), child, body=line).model(BomLine)

    def remove_bom_line(self, part_number: str, child: str, /) -> None:
        """Remove a line. A user decides this; a merge never removes one."""
        self._delete(
            message("{child} on the BOM of {part_number}", child=child, part_number=part_number),
            *_bom(part_number),
            child,
        )

    def _what_is_missing(self, part_number: str, error: NotFoundError) -> NotFoundError:
        # The status alone does not say whether assembly or route is unknown; the item's own address does.
        host = self._address.host
        try:
            self._get(message("item {part_number}", part_number=part_number), "items", part_number)
        except NotFoundError:
            return NotFoundError(
                message(
                    "{host} has no item {part_number}; register the assembly first ({error})",
                    host=host,
                    part_number=part_number,
                    error=error,
                )
            )
        return RouteMissingError(
            message(
                "{host} knows {part_number} but not how to merge a BOM; it needs a newer Silo ({error})",
                host=host,
                part_number=part_number,
                error=error,
            )
        )


def _checked(part_number: str, lines: list[BomLine]) -> list[BomLine]:
    """Return the lines. Raises :class:`ServerFaultError` if they belong to another item."""
    for line in lines:
        if line.parent_part_number and line.parent_part_number.casefold() != part_number.strip().casefold():
            raise ServerFaultError(
                message(
                    "the BOM of {part_number}: the server answered with the BOM of {parent_part_number}",
                    part_number=part_number,
                    parent_part_number=line.parent_part_number,
                )
            )
    return lines


def _bom(part_number: str) -> tuple[str, str, str]:
    return ("items", part_number, "bom")
