# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register --declare``, ``--undeclare``, ``--not-a-part``: parts modelled in an assembly file."""

from __future__ import annotations

import argparse
import os
from dataclasses import replace

from silo import spoken
from silo.bom.errors import DocumentError, Exit, InputError
from silo.bom.items.proposal import propose
from silo.cli.connection import client_of
from silo.cli.json_output import print_json
from silo.cli.register.run import RegisterRun, warn_of_rules
from silo.freecads.open_documents import open_in_any
from silo.registering.candidate import Candidate, ComponentState
from silo.registering.closed_files import OPEN
from silo.registering.modelled import chosen, modelled
from silo.registering.offer import Offer
from silo.registering.request import RegistrationRequest


def declare(args: argparse.Namespace) -> int:
    """Give an identity to what is modelled in the file; returns 1 if that failed."""
    articles = modelled(args.top, args.assembly)
    wanted = chosen(articles, args.declare, apart=args.apart)
    for part in wanted:
        if part.decided:
            what = "no part, as somebody said" if part.no_part else "a component already"
            raise InputError(f"{part.entry.label} is {what}; --undeclare takes that back")
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
        part for part in modelled(args.top, args.assembly) if (not part.no_part if no_part else part.decided)
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
        print(spoken(f"No part of any BOM: {', '.join(taken)} (SiloBomExclude)."))
    else:
        text = f"Undecided again: {', '.join(taken)}. The next sync flags a line of it as unreferenced."
        print(spoken(text))
    return Exit.DONE
