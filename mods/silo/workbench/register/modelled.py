# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is modelled in the assembly's own file: rows of the Register Parts dialog, and orders. Worker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from silo.bom.declare import Modelled
from silo.bom.errors import SiloError
from silo.bom.model import Extraction
from silo.bom.naming import propose
from silo.declaring import declare, modelled
from silo.registration import Journal, Registration, RegistrationApi
from silo.workbench.register.on_disk import changed_since
from silo.workbench.register.registering import Candidate, Order, Seen, State, Write, seen_before

# What a single file may offer.
MOST_MODELLED = 200


def modelled_candidates(
    extraction: Extraction, seen: Mapping[str, Seen], categories: Mapping[str, str]
) -> list[Candidate]:
    """What the saved file of the assembly holds that could be declared, or is; those come last."""
    top = extraction.assembly
    look = seen.get(top.doc_path, Seen(State.MISSING))
    try:
        articles = modelled(top.doc_path, top.object_name or None) if look.state.usable else []
    except SiloError:  # the walk has said what is wrong with the file
        return []
    if look.saved_at and changed_since(top, look.saved_at):
        look = Seen(State.NEWER)
    return [
        Candidate(propose(one.entry, categories, shares_file=True), look.state, article=one)
        for one in articles[:MOST_MODELLED]
    ]


def declare_article(
    order: Order, article: Modelled, api: RegistrationApi, journal: Journal, write: Write, schema: str
) -> Registration:
    """Make what is modelled in the file a component; an error of one copy leaves the others as they are."""
    done = []
    for one in article.apart() if order.apart else (article,):
        entry = replace(one.entry, silo_uuid=None)
        name = f"{order.name} {entry.object_name}" if order.apart else order.name
        proposal = replace(order.proposal, entry=entry, name=name)
        candidate = replace(order.candidate, article=one, proposal=proposal)

        def stamp(identity: str, candidate: Candidate = candidate) -> None:
            write(candidate, identity)

        result = declare(
            one,
            proposal,
            api,
            journal,
            schema=schema,
            ask=lambda of, found: seen_before(order, of, found),
            write=stamp,
        )
        if result.error is not None:
            return replace(result, proposal=order.proposal)
        done.append(result)
    numbers = ", ".join(str(result.part_number) for result in done)
    return replace(done[0], proposal=order.proposal, part_number=numbers)
