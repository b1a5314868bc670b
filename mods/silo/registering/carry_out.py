# SPDX-License-Identifier: LGPL-2.1-or-later
"""Carry out registration requests: items on the server, identities in the files.

How an identity gets into a file is the caller's: FreeCAD writes into open documents, the command line into
files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.entry import BomEntry
from silo.bom.errors import SiloError
from silo.bom.items.proposal import Proposal
from silo.registering.candidate import Candidate
from silo.registering.control import RegisterControl
from silo.registering.items import Registration, RegistrationApi, register, register_standard, unclear
from silo.registering.journal import Journal, component_key
from silo.registering.learnt import Learnt, LearntChoice
from silo.registering.modelled import Modelled, source_identity
from silo.registering.request import RegistrationRequest

# Writes an identity into the component's document and saves it: (candidate, identity).
Write = Callable[[Candidate, str], None]

# Raises DocumentError if that could not be done, before anything is made on the server.
Check = Callable[[Candidate], None]

# Which of the items that fit an interrupted run made: one of them, or None for a new item.
AskForRequest = Callable[
    [RegistrationRequest, Proposal, Sequence[Mapping[str, Any]]], Mapping[str, Any] | None
]


def seen_before(
    request: RegistrationRequest, proposal: Proposal, matches: Sequence[Mapping[str, Any]]
) -> None:
    """Allow a new item if the user saw all these items in the dialog and took none of them. Raises
    ConflictError otherwise.
    """
    shown = {similar.item_id for similar in request.candidate.similar}
    if not all(str(item["id"]) in shown for item in matches):
        unclear(proposal, matches)


def carry_out(
    requests: Sequence[RegistrationRequest],
    api: RegistrationApi,
    journal: Journal,
    write: Write,
    *,
    schema: str,
    control: RegisterControl,
    done: Callable[[RegistrationRequest, Registration], object],
    check: Check = lambda _candidate: None,
    ask: AskForRequest = seen_before,
) -> None:
    """Register one component after another; ``done`` is called with each result. Worker.

    One item's failure does not stop the rest. An error that concerns all items does: a token that is not
    accepted, a server that is gone or busy (:mod:`silo.api.policy`).
    """
    from silo.api.policy import ends_run

    gone: SiloError | None = None
    run = _CarryOut(api, journal, write, schema, check, ask, control)
    learnt = []
    for number, request in enumerate(requests):
        control.check()
        control.progress(request.name, number / len(requests))
        result = Registration(request.proposal, error=gone) if gone is not None else run.one(request)
        gone = result.error if result.error is not None and ends_run(result.error, api) else None
        done(request, result)
        if result.error is None and request.teaches:
            choice = LearntChoice((), request.category, request.sourcing, request.supplier)
            learnt.append((request.candidate.entry, request.candidate.proposal.name, choice))
    if learnt:
        Learnt().learn(learnt)


def take_back(
    done: Sequence[tuple[RegistrationRequest, Registration]],
    api: RegistrationApi,
    journal: Journal,
    restore: Callable[[Candidate], None],
    *,
    control: RegisterControl,
    back: Callable[[RegistrationRequest, SiloError | None], object],
) -> None:
    """Undo registrations, the last one first: files as they were before, and new items archived. Worker.

    restore
        gives a component's file the identity that it had before, or none.
    back
        called with each request, and with the error that kept it from being undone.

    The items of standard parts stay, because other projects have them too. Items with identities of another
    server, which the files had before, stay as well.
    """
    for number, (request, result) in enumerate(reversed(done)):
        control.check()
        control.progress(request.name, number / len(done))
        candidate = request.candidate
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
        back(request, error)


@dataclass(frozen=True)
class _CarryOut:
    api: RegistrationApi
    journal: Journal
    write: Write
    schema: str
    check: Check
    ask: AskForRequest
    control: RegisterControl

    def one(self, request: RegistrationRequest) -> Registration:
        candidate = replace(request.candidate, proposal=request.proposal)
        if candidate.entry.is_standard:
            return register_standard(request.proposal, self.api, schema=self.schema)
        if request.existing is not None:
            return self._join(candidate, request.existing.part_number, request.existing.item_id)
        if candidate.article is not None:
            return self._declare(request, candidate.article)
        return self._register(request, candidate)

    def _register(self, request: RegistrationRequest, candidate: Candidate) -> Registration:
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
            ask=lambda proposal, matches: self.ask(request, proposal, matches),
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

    def _declare(self, request: RegistrationRequest, article: Modelled) -> Registration:
        """Give all objects of an article one identity: that of the file from which it was imported, or of a
        new item.

        An error of one copy leaves the others as they are.
        """
        done = []
        for modelled in article.apart() if request.apart else (article,):
            entry: BomEntry = replace(modelled.entry, silo_uuid=None)
            name = f"{request.name} {entry.object_name}" if request.apart else request.name
            proposal = replace(request.proposal, entry=entry, name=name)
            candidate = replace(request.candidate, article=modelled, proposal=proposal)
            result = self._as_imported(candidate, modelled) or self._register(request, candidate)
            if result.error is not None:
                return replace(result, proposal=request.proposal)
            done.append(result)
        numbers = ", ".join(str(result.part_number) for result in done)
        return replace(done[0], proposal=request.proposal, part_number=numbers)

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
