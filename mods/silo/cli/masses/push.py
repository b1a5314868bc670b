# SPDX-License-Identifier: LGPL-2.1-or-later
"""``--push``: masses written into the properties of the server's items."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from silo.bom.errors import Exit, counted
from silo.bom.message import message
from silo.cli.connection import client_of
from silo.cli.progress import set_step

if TYPE_CHECKING:
    from silo.inertia.push import PushPlan
    from silo.inertia.report import InertiaReport


def push_report(
    args: argparse.Namespace, report: InertiaReport, part_numbers: Mapping[str, str] | None = None
) -> int:
    """Write the masses to the server, or show the plan; returns 1 if an item is unknown there."""
    from silo.inertia.push import plan_push, push

    plan = plan_push(report, part_numbers, args.item)
    if args.dry_run:
        _tell_plan(plan)
        return Exit.DONE
    with client_of(args) as client:
        set_step(message("writing masses"))
        done = push(client, plan)
    written = counted(len(done.written), "item")
    _say(
        message(
            "Silo: {written} written, {count} had these numbers already.",
            written=written,
            count=len(done.unchanged),
        )
    )
    if done.by_hand:
        _say(message("Typed by hand or weighed, so it stays: {by_hand}", by_hand=", ".join(done.by_hand)))
    if done.unknown:
        _say(message("Unknown to the server: {unknown}", unknown=", ".join(done.unknown)))
    for number, error in done.failed:
        _say(message("Not written: {number}: {error}", number=number, error=error))
    _tell_skipped(plan)
    return Exit.REMOTE if done.failed else Exit.UNDONE if done.unknown else Exit.DONE


def _tell_plan(plan: PushPlan) -> None:
    from silo.inertia.push import describe

    _say(
        message(
            "Would write {plan} ({comment}):", plan=counted(len(plan.items), "item"), comment=plan.comment
        )
    )
    for item in plan.items:
        _say(message("  {item}", item=describe(item)))
    _tell_skipped(plan)


def _tell_skipped(plan: PushPlan) -> None:
    for skipped in plan.skipped:
        _say(message("Not written: {name}: {reason}", name=skipped.name, reason=skipped.reason))


def _say(text: str) -> None:
    # Standard output may be JSON; what a push did is for people.
    from silo.cli.terminal import plain

    print(plain(text), file=sys.stderr)
