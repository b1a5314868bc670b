# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register --declare``, ``--undeclare``, ``--not-a-part``: parts modelled in an assembly file; and
``--count-hidden``, ``--reference``: if a hidden object counts.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Sequence
from dataclasses import replace

from silo import spoken
from silo.bom.errors import DocumentError, Exit, InputError
from silo.bom.findings import Place
from silo.bom.items.proposal import propose
from silo.bom.message import message
from silo.cli.connection import client_of
from silo.cli.json_output import print_json
from silo.cli.register.run import RegisterRun, warn_of_rules
from silo.freecads.open_documents import open_in_any
from silo.registering.candidate import Candidate, ComponentState
from silo.registering.closed_files import OPEN
from silo.registering.hidden import hidden_in
from silo.registering.modelled import chosen, modelled
from silo.registering.offer import Offer
from silo.registering.request import RegistrationRequest


def declare(args: argparse.Namespace) -> int:
    """Give an identity to what is modelled in the file; returns 1 if that failed."""
    articles = modelled(args.top, args.assembly)
    wanted = chosen(articles, args.declare, apart=args.apart)
    for part in wanted:
        if part.decided:
            what = message("no part, as somebody said") if part.no_part else message("a component already")
            raise InputError(
                message("{label} is {what}; --undeclare takes that back", label=part.entry.label, what=what)
            )
    with client_of(args) as client:
        schema = client.find_schema(args.schema)
        categories = client.categories(schema)
        warn_of_rules(categories)
        own_offer = Offer(
            tuple(
                Candidate(
                    propose(part.entry, categories, shares_file=True), ComponentState.READY, article=part
                )
                for part in (*wanted, *(article for article in articles if article not in wanted))
            ),
            categories,
        )
        requests = [RegistrationRequest.of(part) for part in own_offer.candidates[: len(wanted)]]
        if args.category:
            requests = [replace(part, category=args.category) for part in requests]
        base = os.path.dirname(os.path.realpath(args.top))
        return RegisterRun(args, client, schema, own_offer, base).register(requests, ())


def undeclare(args: argparse.Namespace) -> int:
    """Take identities and marks out of the file; an object that is no part gets its mark."""
    from silo.fcstd import unstamp

    no_part = bool(args.not_a_part)
    articles = [
        part
        for part in modelled(args.top, args.assembly)
        if (not (part.no_part or part.variant_of) if no_part else part.decided)
    ]
    path = articles[0].entry.doc_path if articles else os.path.realpath(args.top)
    wanted = chosen(articles, args.not_a_part or args.undeclare)
    if not args.even_if_open and open_in_any().has_file(path):
        raise DocumentError(path, OPEN)
    names = [name for part in wanted for name in part.objects]
    taken = [name for name in names if unstamp(path, name, no_part=no_part)]
    if args.json:
        print_json({"undeclared": taken})
    elif no_part:
        print(spoken(message("No part of any BOM: {taken} (SiloBomExclude).", taken=", ".join(taken))))
    else:
        text = message(
            "Undecided again: {taken}. The next sync flags a line of it as unreferenced.",
            taken=", ".join(taken),
        )
        print(spoken(text))
    return Exit.DONE


def decide_hidden(args: argparse.Namespace) -> int:
    """Keep in the file which hidden objects count, and which are only references."""
    from silo.fcstd import answer

    asked = hidden_in(args.top, args.assembly)
    wanted = {True: _chosen(asked, args.count_hidden), False: _chosen(asked, args.reference)}
    if both := {place.obj for place in wanted[True]} & {place.obj for place in wanted[False]}:
        raise InputError(
            message("{both}: give --count-hidden or --reference, not both", both=", ".join(sorted(both)))
        )
    path = os.path.realpath(args.top)
    if not args.even_if_open and open_in_any().has_file(path):
        raise DocumentError(path, OPEN)
    changed = {
        counts: [place for place in places if answer(path, place.obj, counts=counts)]
        for counts, places in wanted.items()
    }
    if args.json:
        print_json(
            {
                "counted": [place.obj for place in changed[True]],
                "references": [place.obj for place in changed[False]],
            }
        )
        return Exit.DONE
    for counts, places in changed.items():
        names = ", ".join(place.label or place.obj for place in places)
        if places and counts:
            print(spoken(message("Counts, whatever the view shows: {names}.", names=names)))
        elif places:
            print(spoken(message("Reference, counts nowhere: {names}.", names=names)))
    if not any(changed.values()):
        print(spoken("Nothing to do: the file says so already."))
    return Exit.DONE


def _chosen(places: Sequence[Place], names: Iterable[str]) -> list[Place]:
    """Return the hidden objects with these names or labels. InputError for a name that none has."""
    found: dict[str, Place] = {}
    for name in names:
        fitting = [place for place in places if place.obj == name] or [
            place for place in places if place.label == name
        ]
        if len(fitting) != 1:
            listed = ", ".join(place.obj for place in places) or "nothing"
            what = "nothing" if not fitting else f"{len(fitting)} objects"
            raise InputError(f"{name!r} means {what} that is hidden in this assembly; there is: {listed}")
        found[fitting[0].obj] = fitting[0]
    return list(found.values())
