# SPDX-License-Identifier: LGPL-2.1-or-later
"""The client's questions about BOMs (spec bom-sync §5, silo-contract §1.5)."""

from __future__ import annotations

import json
from typing import Any

from pydantic import ValidationError

from silo.api.bodies import LineBody, body
from silo.api.caller import LISTS, Caller, Params
from silo.api.replies import Reply, complaint
from silo.api.transport import Cancel
from silo.api.wire import (
    BomLine,
    FlatLine,
    MergeDiff,
    MergeEntry,
    MergeRequest,
    MergeResult,
    MergeWarning,
    QuantityLine,
    WhereUsedLine,
)
from silo.bom.diff import same_quantity
from silo.bom.errors import NotFoundError, RouteMissingError, ServerFaultError, SiloError

UNCLEAR = "answer_not_understood"
"""The warning of a merge whose answer was not understood, and that the BOM shows all the same."""


class BomCalls(Caller):
    """Reading and merging BOMs."""

    def get_bom(self, part_number: str, /) -> list[BomLine]:
        """The BOM lines directly below an item."""
        reply = self._get(f"the BOM of {part_number}", *_bom(part_number))
        return reply.models(BomLine, *LISTS)

    def get_bom_version(self, part_number: str, /) -> str | None:
        """The version of the BOM as it is now, for ``if_match``; None where the server keeps none."""
        return self._get(f"the BOM of {part_number}", *_bom(part_number)).version()

    def get_bom_expanded(self, part_number: str, /, depth: int | None = None) -> list[BomLine]:
        """All lines below an item, ``depth`` levels or as many as the server gives.

        Each line says its own ``depth``. Raises :class:`silo.bom.errors.ConflictError` for a ring.
        """
        params: Params = {} if depth is None else {"depth": depth}
        subject = f"the whole BOM of {part_number}"
        reply = self._get(subject, *_bom(part_number), "expanded", params=params)
        return reply.models(BomLine, "expanded_bom", *LISTS)

    def get_bom_flat(self, part_number: str, /) -> list[FlatLine]:
        """The parts below an item with their total quantities."""
        reply = self._get(f"the flat BOM of {part_number}", *_bom(part_number), "flat")
        return reply.models(FlatLine, "flat_bom", *LISTS)

    def where_used(self, part_number: str, /) -> list[WhereUsedLine]:
        """The parents that have this item on their BOM; all of them, from however many pages."""
        found: list[WhereUsedLine] = []
        while True:
            params: Params = {"offset": len(found)} if found else {}
            subject = f"the uses of {part_number}"
            reply = self._get(subject, *_bom(part_number), "where-used", params=params)
            page = reply.models(WhereUsedLine, "where_used", "parents", *LISTS)
            found.extend(page)
            total = reply.headers.get("X-Total-Count", "")
            if not page or not (total.isascii() and total.isdigit()) or len(found) >= int(total):
                return found

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

        With a ``sync_id`` the request is repeated when the way breaks: the server gives its first answer.

        Raises :class:`NotFoundError` for an unknown assembly but :class:`RouteMissingError` for a server
        without merge, :class:`RejectedError` with all bad entries, :class:`CycleError`,
        :class:`ServerFaultError` for an answer that reports a failure or that the BOM does not bear out,
        :class:`VersionConflictError` for ``if_match``, :class:`ReadOnlyError`.
        """
        headers = {} if if_match is None else {"If-Match": '"{}"'.format(str(if_match).strip('"'))}
        try:
            reply = self._change(
                "POST",
                f"the BOM of {part_number}",
                *_bom(part_number),
                "merge",
                body=request,
                headers=headers,
                repeatable=bool(request.sync_id or request.dry_run),
                cancelled=cancelled,
                # Without "dry_run" it would be a merge.
                extensions=() if request.dry_run else ("source", "sync_id", "document"),
            )
        except NotFoundError as error:
            raise self._what_is_missing(part_number, error) from error
        result = merge_result(reply)
        return result if result is not None else self._read_back(part_number, request)

    def _read_back(self, part_number: str, request: MergeRequest) -> MergeResult:
        """The result of a merge whose answer says neither success nor failure, as the BOM shows it."""
        sent = f"{self._address.host}: the BOM of {part_number} was sent, but the answer was not understood"
        if request.dry_run:
            raise ServerFaultError(f"{sent}; nothing was to be changed")
        try:
            lines = {line.child_part_number.casefold(): line for line in self.get_bom(part_number)}
        except SiloError as error:
            raise ServerFaultError(f"{sent}, and the BOM cannot be read back ({error})") from error
        wrong = [entry for entry in request.entries if not _shows(lines.get(_key(entry)), entry)]
        if wrong:
            names = ", ".join(entry.child_part_number for entry in wrong[:5])
            more = f" and {len(wrong) - 5} more" if len(wrong) > 5 else ""
            raise ServerFaultError(f"{sent}, and its BOM does not show {names}{more} as in the assembly")
        told = [lines[_key(entry)] for entry in request.entries]
        return MergeResult(
            diff=MergeDiff(
                unchanged=[
                    QuantityLine(part_number=line.child_part_number, quantity=line.quantity) for line in told
                ]
            ),
            warnings=[
                MergeWarning(
                    type=UNCLEAR, part_number=part_number, message=f"{sent}; the BOM shows all of its lines"
                )
            ],
            sync_id=request.sync_id,
        )

    def add_bom_line(self, part_number: str, child: str, /, **values: Any) -> BomLine:
        """Add a line by hand (``source`` manual): ``quantity``, ``unit``, ``notes``, ``find_number``, …

        The fields are those of :class:`silo.api.bodies.LineBody`. A merge never touches such a line.
        """
        line = body(LineBody, {"quantity": 1, **values, "child_part_number": child}, "a BOM line")
        reply = self._change("POST", f"{child} on the BOM of {part_number}", *_bom(part_number), body=line)
        return reply.model(BomLine)

    def update_bom_line(self, part_number: str, child: str, /, **changes: Any) -> BomLine:
        """Change a line by hand; the fields are those of :class:`silo.api.bodies.LineBody`."""
        line = body(LineBody, changes, "a BOM line")
        subject = f"{child} on the BOM of {part_number}"
        return self._change("PUT", subject, *_bom(part_number), child, body=line).model(BomLine)

    def remove_bom_line(self, part_number: str, child: str, /) -> None:
        """Remove a line: what a person decides, a merge never does."""
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


def merge_result(reply: Reply) -> MergeResult | None:
    """The answer to a merge, read strictly: only what says what it did counts as success.

    None: neither success nor failure can be read from it. Raises :class:`ServerFaultError` for an answer
    that is a failure by its own words, whatever its status.
    """
    if reply.is_html:
        return None
    said = complaint(reply)
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
            f"{': ' + said.text if said.text else ''}"
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


def _key(entry: MergeEntry) -> str:
    return entry.child_part_number.casefold()


def _shows(line: BomLine | None, entry: MergeEntry) -> bool:
    # A line that a person owns may have another quantity: a merge leaves it.
    return line is not None and (line.source == "manual" or same_quantity(line.quantity, entry.quantity))


def _bom(part_number: str) -> tuple[str, str, str]:
    return ("items", part_number, "bom")
