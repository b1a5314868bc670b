# SPDX-License-Identifier: LGPL-2.1-or-later
"""How the result of a sync looks on a terminal: a line for each assembly, the box of the Activity pane."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.panel import Panel
from rich.text import Text

from silo import caption, spoken
from silo.bom.items.naming import display_name
from silo.bom.message import message
from silo.bom.walk.document import relative
from silo.cli.terminal import plain

if TYPE_CHECKING:
    from silo.bom_sync.activity_text import ActivityText
    from silo.bom_sync.steps import Outcome


_STATUS = {
    "merged": ("✓", "green"),
    "unchanged": ("✓", "green"),
    "dry_run": ("·", "cyan"),
    "blocked": ("✗", "red"),
    "unregistered": ("⚠", "yellow"),
    "failed": ("✗", "red"),
}


def outcome_text(outcome: Outcome, base: str) -> Text:
    """Write which assembly it was, what became of it, and its file relative to ``base``."""
    from silo.api.merging import unusual
    from silo.batch import STATUS_WORDS
    from silo.bom_sync.activity_text import draft_text

    mark, style = _STATUS[outcome.status]
    head = outcome.assembly
    who = " ".join(filter(None, (head.part_number, head.name))) or display_name(head)
    text = Text().append(f"{mark} ", style).append(plain(who), "bold")
    text.append(f": {spoken(STATUS_WORDS[outcome.status])}")
    if outcome.error is not None:
        text.append(f": {plain(spoken(str(outcome.error)))}")
    text.append(message("  {base}", base=plain(relative(head.doc_path, base))), "dim")
    if draft := draft_text(outcome.result):
        text.append(f"\n  {plain(spoken(draft))}", "dim")
    for sentence in unusual(outcome.result):
        text.append(f"\n  ⚠ {plain(spoken(sentence))}", "yellow")
    return text


def activity_box(activity: ActivityText) -> Panel:
    """Draw the Activity pane's box (spec §6)."""
    body = Text()
    body.append(f"📋 {plain(spoken(activity.headline))}\n", "bold")
    body.append(plain(spoken(activity.counts)))
    if activity.resolve_url:
        body.append(
            spoken(message("\n[View in Silo →] {resolve_url}", resolve_url=plain(activity.resolve_url))),
            "cyan",
        )
    if activity.unregistered:
        body.append(f"\n{plain(spoken(activity.unregistered))}\n", "yellow")
        body.append(caption("[Register Parts...]"), "cyan")
    return Panel(body, title=spoken("Database Activity"), title_align="left", expand=False, padding=(0, 1))
