# SPDX-License-Identifier: LGPL-2.1-or-later
"""The unreferenced lines that a server was sent before.

A server that does not show which lines are unreferenced gets each of them once.
"""

from __future__ import annotations

from dataclasses import replace

from silo.bom.compare.merge import MergePlan
from silo.bom_sync.memory import Memory
from silo.bom_sync.resolved import Resolved
from silo.platform.user_folders import cache_folder


def reported_lines() -> Memory:
    """Open the memory of reported lines: server → part number of an assembly → its unreferenced lines."""
    return Memory(cache_folder() / "unreferenced.json")


def is_reported(resolved: Resolved, plan: MergePlan, server: str) -> bool:
    """Return True if all that the merge would report was reported to the server before."""
    if not server or resolved.assembly.silo_uuid in resolved.last_syncs or replace(plan, flag=()).news:
        return False
    reported = reported_lines().known(server).get(resolved.assembly.part_number or "", "")
    return bool(plan.flag) and set(plan.flag) <= set(reported.split("\n"))


def remember_reported(resolved: Resolved, plan: MergePlan, server: str) -> None:
    """Remember which unreferenced lines a merge has reported to a server that does not show them."""
    if plan.flag and server and resolved.assembly.silo_uuid not in resolved.last_syncs:
        reported_lines().remember(server, {resolved.assembly.part_number or "": "\n".join(plan.flag)})
