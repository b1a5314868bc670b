# SPDX-License-Identifier: LGPL-2.1-or-later
"""Carry out registration requests: items on the server, identities in the files.

How an identity gets into a file is the caller's: FreeCAD writes into open documents, the command line into
files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.errors import SiloError
from silo.bom.items.proposal import Proposal
from silo.bom.model import BomEntry
from silo.registering.candidate import Candidate
from silo.registering.control import RegisterControl
from silo.registering.items import Registration, RegistrationApi, register, register_standard, unclear
from silo.registering.journal import Journal, component_key
from silo.registering.learnt import Learnt, LearntChoice
from silo.registering.modelled import Modelled, source_identity
from silo.registering.request import Order

# Writes an identity into the component's document and saves it: (candidate, identity).
Write = Callable[[Candidate, str], None]

# Raises DocumentError if that could not be done, before anything is made on the server.
Check = Callable[[Candidate], None]

# Which of the items that fit an interrupted run made: one of them, or None for a new item.
AskOrder = Callable[[Order, Proposal, Sequence[Mapping[str, Any]]], Mapping[str, Any] | None]


def seen_before(order: Order, proposal: Proposal, matches: Sequence[Mapping[str, Any]]) -> None:
    """Allow a new item if the person saw all these items in the dialog and took none of them. Raises
    ConflictError otherwise.
    """
    shown = {similar.item_id for similar in order.candidate.similar}
    if not all(str(item["id"]) in shown for item in matches):
        unclear(proposal, matches)


def carry_out(
    orders: Sequence[Order],
    api: RegistrationApi,
    journal: Journal,
    write: Write,
    *,
    schema: str,
    control: RegisterControl,
    done: Callable[[Order, Registration], object],
    check: Check = lambda _candidate: None,
    ask: AskOrder = seen_before,
) -> None:
    """Register one component after another; ``done`` is called with each result. Worker.

    One item's failure does not stop the rest. An error that concerns all items does: a token that is not
    accepted, a server that is gone or busy (:mod:`silo.api.policy`).
    """
    from silo.api.policy import ends_run

    gone: SiloError | None = None
    run = _OrderRun(api, journal, write, schema, check, ask, control)
    learnt = []
    for number, order in enumerate(orders):
        control.check()
        control.progress(order.name, number / len(orders))
        result = Registration(order.proposal, error=gone) if gone is not None else run.one(order)
        gone = result.error if result.error is not None and ends_run(result.error, api) else None
        done(order, result)
        if result.error is None and order.teaches:
            choice = LearntChoice((), order.category, order.sourcing, order.supplier)
            learnt.append((order.candidate.entry, order.candidate.proposal.name, choice))
    if learnt:
        Learnt().learn(learnt)


def take_back(
    done: Sequence[tuple[Order, Registration]],
    api: RegistrationApi,
    journal: Journal,
    restore: Callable[[Candidate], None],
    *,
    control: RegisterControl,
    back: Callable[[Order, SiloError | None], object],
) -> None:
    """Undo registrations, the last one first: files as they were before, and new items archived. Worker.

    restore
        gives a component's file the identity that it had before, or none.
    back
        called with each order, and with the error that kept it from being undone.

    The items of standard parts stay, because other projects have them too. Items with identities of another
    server, which the files had before, stay as well.
    """
    for number, (order, result) in enumerate(reversed(done)):
        control.check()
        control.progress(order.name, number / len(done))
        candidate = order.candidate
        if candidate.entry.is_standard or candidate.foreign:
            continue
        error = None
        try:
            restore(candidate)
            journal.forget(component_key(candidate.entry))
            for part_number in (result.part_number or "").split(", ") if not result.found else ():
                api.archive_item(part_number)
        except SiloError as problem:
            error = problem
        back(order, error)


@dataclass(frozen=True)
class _OrderRun:
    api: RegistrationApi
    journal: Journal
    write: Write
    schema: str
    check: Check
    ask: AskOrder
    control: RegisterControl

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
            ask=lambda proposal, matches: self.ask(order, proposal, matches),
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
        """Give all objects of an article one identity: that of the file from which it was imported, or of a
        new item.

        An error of one copy leaves the others as they are.
        """
        done = []
        for modelled in article.apart() if order.apart else (article,):
            entry: BomEntry = replace(modelled.entry, silo_uuid=None)
            name = f"{order.name} {entry.object_name}" if order.apart else order.name
            proposal = replace(order.proposal, entry=entry, name=name)
            candidate = replace(order.candidate, article=modelled, proposal=proposal)
            result = self._as_imported(candidate, modelled) or self._register(order, candidate)
            if result.error is not None:
                return replace(result, proposal=order.proposal)
            done.append(result)
        numbers = ", ".join(str(result.part_number) for result in done)
        return replace(done[0], proposal=order.proposal, part_number=numbers)

    def _as_imported(self, candidate: Candidate, article: Modelled) -> Registration | None:
        """Register with the identity of the file from which A2plus imported it; None if Silo has no such
        item.
        """
        try:
            identity = source_identity(article)
            item = self.api.get_item_by_uuid(identity) if identity else None
        except SiloError as error:
            return Registration(candidate.proposal, error=error)
        return None if item is None else self._join(candidate, str(item["part_number"]), str(item["id"]))
