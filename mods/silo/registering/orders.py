# SPDX-License-Identifier: LGPL-2.1-or-later
"""Carry out what a person ordered: items on the server, identities in the files.

How an identity gets into a file is the caller's: FreeCAD writes into open documents, the command line into
files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.errors import SiloError
from silo.bom.model import BomEntry
from silo.bom.resolve import Proposal, proposed_category
from silo.registering.items import Registration, RegistrationApi, register, register_standard, unclear
from silo.registering.journal import Journal
from silo.registering.modelled import Modelled, source_identity
from silo.registering.offer import Candidate, Control, Similar


@dataclass(frozen=True)
class Order:
    """A row that is to be registered, as the person left it.

    existing
        item to join instead of making a new one.
    apart
        of equal copies that are modelled in the file, each gets an item of its own.
    """

    candidate: Candidate
    name: str
    item_type: str
    category: str
    existing: Similar | None = None
    apart: bool = False

    @classmethod
    def of(cls, candidate: Candidate) -> Order:
        """A row as it was proposed."""
        proposal = candidate.proposal
        return cls(candidate, proposal.name, proposal.item_type, proposal.category)

    @property
    def proposal(self) -> Proposal:
        return replace(
            self.candidate.proposal, name=self.name, item_type=self.item_type, category=self.category
        )

    def retyped(self, item_type: str, categories: Mapping[str, str]) -> Order:
        """With another type; the category follows where it is still one that was proposed.

        categories
            code → description, as the schema has them.
        """

        def proposed(kind: str) -> str:
            entry = replace(self.candidate.entry, is_assembly=kind == "assembly")
            return proposed_category(entry, self.name, categories).code

        follows = self.category in (self.candidate.proposal.category, proposed(self.item_type))
        return replace(self, item_type=item_type, category=proposed(item_type) if follows else self.category)


# Writes an identity into the component's document and saves it: (candidate, identity).
Write = Callable[[Candidate, str], None]
# Raises DocumentError where that could not be done, before anything is made on the server.
Check = Callable[[Candidate], None]
# Which of the items that fit an interrupted run made: one of them, or None for a new item.
Ask = Callable[[Order, Proposal, Sequence[Mapping[str, Any]]], Mapping[str, Any] | None]


def seen_before(order: Order, proposal: Proposal, found: Sequence[Mapping[str, Any]]) -> None:
    """None (make a new item) where the person saw these items in the dialog and took none of them."""
    shown = {similar.item_id for similar in order.candidate.similar}
    if not all(str(item["id"]) in shown for item in found):
        unclear(proposal, found)


def carry_out(
    orders: Sequence[Order],
    api: RegistrationApi,
    journal: Journal,
    write: Write,
    *,
    schema: str,
    control: Control,
    done: Callable[[Order, Registration], object],
    check: Check = lambda _candidate: None,
    ask: Ask = seen_before,
) -> None:
    """Register one after another; ``done`` is called with each result. Worker.

    One item's failure does not stop the rest. An error that concerns all of them does: a token that is not
    accepted, a server that is gone or busy (:mod:`silo.api.policy`).
    """
    from silo.api.policy import ends_run

    gone: SiloError | None = None
    run = _Run(api, journal, write, schema, check, ask, control)
    for number, order in enumerate(orders):
        control.check()
        control.progress(order.name, number / len(orders))
        result = Registration(order.proposal, error=gone) if gone is not None else run.one(order)
        gone = result.error if result.error is not None and ends_run(result.error, api) else None
        done(order, result)


@dataclass(frozen=True)
class _Run:
    api: RegistrationApi
    journal: Journal
    write: Write
    schema: str
    check: Check
    ask: Ask
    control: Control

    def one(self, order: Order) -> Registration:
        candidate = replace(order.candidate, proposal=order.proposal)
        if candidate.entry.is_standard:
            return register_standard(order.proposal, self.api, schema=self.schema)
        if order.existing is not None:
            return self._join(candidate, order.existing.part_number, order.existing.item_id)
        if candidate.article is not None:
            return self._declare(order, candidate.article)
        return self._register(order, candidate)

    def _register(self, order: Order, candidate: Candidate) -> Registration:
        return register(
            candidate.proposal,
            self.api,
            self.journal,
            lambda entry, identity: self.write(
                replace(candidate, proposal=replace(candidate.proposal, entry=entry)), identity
            ),
            schema=self.schema,
            properties={"file_sha256": candidate.sha256} if candidate.sha256 else None,
            check=lambda _entry: self.check(candidate),
            ask=lambda proposal, found: self.ask(order, proposal, found),
            copy=bool(candidate.same_as),
            tell=self.control.progress,
        )

    def _join(self, candidate: Candidate, number: str, item_id: str) -> Registration:
        try:
            self.check(candidate)
            self.write(candidate, item_id)
        except SiloError as error:
            return Registration(candidate.proposal, error=error)
        return Registration(candidate.proposal, part_number=number, item_id=item_id, found=True)

    def _declare(self, order: Order, article: Modelled) -> Registration:
        """Give all objects of an article one identity: of the file it was imported from, else of a new item.

        An error of one copy leaves the others as they are.
        """
        done = []
        for one in article.apart() if order.apart else (article,):
            entry: BomEntry = replace(one.entry, silo_uuid=None)
            name = f"{order.name} {entry.object_name}" if order.apart else order.name
            proposal = replace(order.proposal, entry=entry, name=name)
            candidate = replace(order.candidate, article=one, proposal=proposal)
            result = self._as_imported(candidate, one) or self._register(order, candidate)
            if result.error is not None:
                return replace(result, proposal=order.proposal)
            done.append(result)
        numbers = ", ".join(str(result.part_number) for result in done)
        return replace(done[0], proposal=order.proposal, part_number=numbers)

    def _as_imported(self, candidate: Candidate, article: Modelled) -> Registration | None:
        """With the identity of the file that A2plus imported it from; None where Silo has no such item."""
        try:
            known = source_identity(article)
            item = self.api.get_item_by_uuid(known) if known else None
        except SiloError as error:
            return Registration(candidate.proposal, error=error)
        return None if item is None else self._join(candidate, str(item["part_number"]), str(item["id"]))
