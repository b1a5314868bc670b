# SPDX-License-Identifier: LGPL-2.1-or-later
"""The report of ``silo-mod register``: what was registered, what was left out and why, what is modelled."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from silo.bom.message import joined, message
from silo.bom.walk.document import relative
from silo.cli.json_output import print_json
from silo.cli.proposals import proposed_again
from silo.cli.terminal import console, plain

if TYPE_CHECKING:
    from silo.bom.items.proposal import Proposal
    from silo.registering.items import Registration
    from silo.registering.modelled import Modelled


_MOST_MODELLED = 40


def article_json(article: Modelled, base: str) -> Mapping[str, Any]:
    """Return an article that is modelled in the file, as JSON values."""
    return {
        "doc_path": relative(article.entry.doc_path, base),
        "objects": list(article.objects),
        "label": article.entry.label,
        "quantity": article.entry.quantity,
        "alike": article.alike,
        "source": relative(article.source, base),
    }


def articles_text(args: argparse.Namespace, articles: Sequence[Modelled], base: str) -> list[str]:
    """Write the section about what is modelled in the file, line by line."""
    lines: list[str] = [message("Modelled in this file, not counted:")]
    most = _MOST_MODELLED if sys.stdout.isatty() else len(articles)
    for article in articles[:most]:
        copies = (
            message(", {count} copies of one {alike}", count=len(article.objects), alike=article.alike)
            if len(article.objects) > 1
            else ""
        )
        source = (
            message(", imported from {base}", base=plain(relative(article.source, base)))
            if article.source
            else ""
        )
        label = plain(article.entry.label)
        what = f"  {article.entry.quantity} × {label} ({article.entry.object_name}"
        lines.append(joined("", (what, copies, source, ")")))
    if len(articles) > most:
        lines.append(message("  and {count} more; --json has them all", count=len(articles) - most))
    first = proposed_again(args, "--yes", "--declare", articles[0].entry.object_name)
    lines.append(message("Declare what is a part, such as the first: {first}", first=first))
    return lines


def proposal_json(
    proposal: Proposal, base: str, result: Registration | None = None, note: str = ""
) -> Mapping[str, Any]:
    row: dict[str, Any] = {
        "doc_path": relative(proposal.entry.doc_path, base),
        "object": proposal.entry.object_name,
        "standard": proposal.entry.standard,
        "name": proposal.name,
        "item_type": proposal.item_type,
        "category": proposal.category,
        "guess": proposal.is_guess,
        "note": note,
    }
    if result is not None and result.error is None:
        row |= {"part_number": result.part_number, "silo_uuid": result.item_id, "found": result.found}
    if result is not None and result.error is not None:
        from silo.batch import error_json

        row |= {"error": error_json(result.error)}
    return row


def registrations(
    args: argparse.Namespace,
    base: str,
    done: Sequence[Registration],
    left: Sequence[tuple[Proposal, str]],
    articles: Sequence[Modelled],
) -> None:
    """Show each registration; ``left``: proposals that were not registered, and why."""
    if args.json:
        print_json(
            {
                "registered": [proposal_json(r.proposal, base, r) for r in done if r.error is None],
                "failed": [proposal_json(r.proposal, base, r) for r in done if r.error is not None],
                "unregistered": [proposal_json(proposal, base, note=why) for proposal, why in left],
                "modelled": [article_json(article, base) for article in articles],
            }
        )
        return
    out = console()
    if not done and not left:
        out.print(message("Every component has its part number already."))
    for result in done:
        name = plain(result.proposal.name)
        if result.error is None:
            guess = message(" (the category is a guess)") if result.proposal.is_guess else ""
            note = message(" (the item was there already)") if result.found else ""
            out.print(
                message(
                    "✓ {part_number}  {name}{guess}{note}",
                    part_number=result.part_number,
                    name=name,
                    guess=guess,
                    note=note,
                ),
                markup=False,
            )
        else:
            out.print(
                message("✗ {name}: {error}", name=name, error=plain(str(result.error))),
                style="red",
                markup=False,
            )
    for proposal, why in left:
        where = proposal.entry.standard or relative(proposal.entry.doc_path, base)
        reason = message(" ({why})", why=plain(why)) if why else ""
        text = message(
            "⚠ {where}: unregistered, left out of the BOM{reason}", where=plain(where), reason=reason
        )
        out.print(text, style="yellow", markup=False)
    if any(proposal.entry.silo_uuid and not proposal.entry.is_standard for proposal, _ in left):
        adopt = proposed_again(args, "--adopt")
        out.print(
            message("Are these parts of another server? {adopt} takes them over.", adopt=adopt), markup=False
        )
    if args.yes and any(why for _, why in left):
        out.print(
            message(
                "Is it the same part? --duplicates join takes the item, --duplicates new makes "
                "another; --plan asks for each."
            )
        )
    for line in articles_text(args, articles, base) if articles else ():
        out.print(line, markup=False, highlight=False)
