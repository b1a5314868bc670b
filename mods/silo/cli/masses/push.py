# SPDX-License-Identifier: LGPL-2.1-or-later
"""``--push``: masses written into the properties of the server's items."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from silo.bom.errors import Exit, counted
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
        set_step("writing masses")
        done = push(client, plan)
    written = counted(len(done.written), "item")
    _say(f"Silo: {written} written, {len(done.unchanged)} had these numbers already.")
    if done.by_hand:
        _say(f"Typed by hand or weighed, so it stays: {', '.join(done.by_hand)}")
    if done.unknown:
        _say(f"Unknown to the server: {', '.join(done.unknown)}")
    for number, error in done.failed:
        _say(f"Not written: {number}: {error}")
    _tell_skipped(plan)
    return Exit.REMOTE if done.failed else Exit.UNDONE if done.unknown else Exit.DONE


def _tell_plan(plan: PushPlan) -> None:
    from silo.inertia.push import describe

    _say(f"Would write {counted(len(plan.items), 'item')} ({plan.comment}):")
    for item in plan.items:
        _say(f"  {describe(item)}")
    _tell_skipped(plan)


def _tell_skipped(plan: PushPlan) -> None:
    for skipped in plan.skipped:
        _say(f"Not written: {skipped.name}: {skipped.reason}")


def _say(text: str) -> None:
    # Standard output may be JSON; what a push did is for people.
    from silo.cli.terminal import plain

    print(plain(text), file=sys.stderr)
