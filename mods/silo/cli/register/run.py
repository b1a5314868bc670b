# SPDX-License-Identifier: LGPL-2.1-or-later
"""A run of ``silo-mod register``, from the components on offer to the report."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo import caption, spoken
from silo.bom.errors import ConflictError, Exit, counted
from silo.bom.items.proposal import Proposal
from silo.bom.message import message
from silo.cli.progress import set_step
from silo.cli.proposals import proposed_again
from silo.cli.register.questions import Dialog
from silo.cli.terminal import plain
from silo.registering.candidate import Candidate, CandidateFiles
from silo.registering.closed_files import carry_out_on_disk, is_own
from silo.registering.items import Ask, Registration, unclear
from silo.registering.offer import Offer
from silo.registering.request import RegistrationRequest
from silo.registering.table import TableRow, doubts, requests_of, write_table

if TYPE_CHECKING:
    from silo.api.client import SiloClient


def warn_of_rules(categories: Mapping[str, str]) -> None:
    """Report a mistake in the site's rules on standard error; it only costs proposals."""
    from silo.bom_sync.activity_text import rules_text
    from silo.cli.terminal import plain

    if problem := getattr(categories, "problem", ""):
        print(f"silo-mod: {plain(rules_text(problem))}", file=sys.stderr)


class RegisterProgress:
    """A long run says where it is; Ctrl-C ends it."""

    def progress(self, detail: str = "", fraction: float | None = None) -> None:
        if fraction is None:
            print(f"silo-mod: {plain(detail)}", file=sys.stderr)
        elif fraction:
            set_step(f"{detail}, {fraction:.0%}")

    def check(self) -> None:
        return


class RegisterRun:
    """One registration, from requests to the report."""

    def __init__(
        self, args: argparse.Namespace, client: SiloClient, schema: str, found: Offer, base: str
    ) -> None:
        self.args, self.client, self.schema, self.found, self.base = args, client, schema, found, base
        self.done: list[Registration] = []

    def as_asked(self, rows: Sequence[TableRow], unused: frozenset[str]) -> int:
        """Register with a table, with --yes, or with the answers of a user."""
        if self.args.plan:
            return self.write_plan(unused)
        if self.args.apply:
            planned = requests_of(rows, self.found, self.base, self.client, self.args.apply)
            return self.register(planned.requests, planned.unlisted, already=planned.done)
        if self.args.yes or self.args.adopt:
            return self.register(*self.all_but_duplicates(unused))
        counted = (candidate for candidate in self.found.candidates if candidate.article is None)
        offered = [candidate for candidate in counted if candidate.entry.doc_path not in unused]
        return self.register(*Dialog(offered, self.found, self.client, self.base, is_own).ask())

    def write_plan(self, unused: frozenset[str]) -> int:
        """Write the table of all components, and register nothing."""
        from silo.platform.whole_files import replacing

        earlier = CandidateFiles()

        def wanted(candidate: Candidate) -> bool:
            earlier.add(candidate)
            doubtful = bool(doubts(candidate, earlier)) and not is_own(candidate)
            return not doubtful and candidate.article is None and candidate.entry.doc_path not in unused

        table = write_table(self.found, wanted, self.base)
        if self.args.plan == "-":
            sys.stdout.write(table.decode("utf-8-sig", "surrogateescape"))
            return Exit.DONE
        with replacing(Path(self.args.plan)) as file:
            file.write(table)
        count = sum(not component.decided for component in self.found.candidates)
        print(
            message(
                "{plan}: {count}. Edit it, then: {command}",
                plan=self.args.plan,
                count=counted(count, "row"),
                command=proposed_again(self.args, "--apply", Path(self.args.plan)),
            ),
            file=sys.stderr,
        )
        return Exit.DONE

    def all_but_duplicates(self, unused: frozenset[str]) -> tuple[list[RegistrationRequest], list[Candidate]]:
        """Divide the components into requests and those to leave; ``--duplicates`` decides about components
        that seem to be items already.
        """
        requests, left = [], []
        earlier = CandidateFiles()
        for candidate in self.found.candidates:
            if candidate.article is not None or candidate.same_as or candidate.entry.doc_path in unused:
                continue
            earlier.add(candidate)
            doubts_here, is_foreign = doubts(candidate, earlier), candidate.foreign and not is_own(candidate)
            doubtful = len(doubts_here) > candidate.foreign and not is_own(candidate)
            if is_foreign != self.args.adopt:
                left.append(candidate)
            elif not doubtful or self.args.duplicates == "new":
                requests.append(RegistrationRequest.of(candidate))
            elif self.args.duplicates == "join" and len(candidate.similar) == 1:
                requests.append(replace(RegistrationRequest.of(candidate), existing=candidate.similar[0]))
            else:
                left.append(candidate)
        if unused:
            files = counted(len(unused), "file")
            words = message(
                "{files} that no assembly uses: left alone (name the file, or use --plan)", files=files
            )
            print(words, file=sys.stderr)
        return requests, left

    def register(
        self, requests: Sequence[RegistrationRequest], left: Sequence[Candidate], *, already: int = 0
    ) -> int:
        """Register the requests; the result is reported even if Ctrl-C ends it."""
        try:
            done = carry_out_on_disk(
                requests,
                self.client,
                schema=self.schema,
                ask=_asker(self.args.unclear),
                even_if_open=self.args.even_if_open,
                done=self.done,
                control=RegisterProgress(),
            )
        finally:
            self._report(left, already)
        return Exit.UNDONE if left or any(registration.error for registration in done) else Exit.DONE

    def _report(self, left: Sequence[Candidate], already: int) -> None:
        articles = [
            candidate.article
            for candidate in self.found.candidates
            if candidate.article is not None and not candidate.decided
        ]
        declared = {registration.proposal.entry.key for registration in self.done}
        from silo.cli.register.report import registrations

        contents = CandidateFiles()
        for candidate in self.found.candidates:
            contents.add(candidate)
        registrations(
            self.args,
            self.base,
            self.done,
            [(candidate.proposal, "; ".join(doubts(candidate, contents))) for candidate in left],
            [article for article in articles if article.entry.key not in declared],
        )
        if already and not self.args.json:
            print(
                spoken(
                    message("{already} of the table's components had their number already.", already=already)
                )
            )


def _asker(how: str) -> Ask:
    """Make the function that decides, as ``--unclear`` says, which of several matching items a component
    gets.
    """

    def ask(proposal: Proposal, matches: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
        if how == "new":
            return None
        if how == "take" and len(matches) == 1:
            return matches[0]
        if how == "take" or not sys.stdin.isatty():
            try:
                return unclear(proposal, matches)
            except ConflictError as error:
                raise ConflictError(
                    message("{error}: --unclear take, or --unclear new", error=error)
                ) from None
        print(
            message("{name}: is it one of these items? A copy of it is not.", name=proposal.name),
            file=sys.stderr,
        )
        for number, item in enumerate(matches, start=1):
            print(f"  {number}  {item['part_number']}  {item.get('created_at') or ''}", file=sys.stderr)
        set_step("")
        answer = input(caption("which one is it? [number, n = make a new item] ")).strip()
        if answer.isdecimal() and 1 <= int(answer) <= len(matches):
            return matches[int(answer) - 1]
        return None if answer.lower() == "n" else unclear(proposal, matches)

    return ask
