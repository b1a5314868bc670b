# SPDX-License-Identifier: LGPL-2.1-or-later
"""The boxes of the server's events. Pure."""

from __future__ import annotations

import time
from datetime import datetime
from typing import Any

from silo.api.sse import MERGE, RESET, ServerEvent
from silo.api.wire import MergeEvent
from silo.bom.items.part_address import part_page
from silo.bom_sync.activity_text import headline
from silo.workbench.activity.badges import badges
from silo.workbench.activity.box import EntryBatch, EntryLine, PaneEntry, revision_key
from silo.workbench.activity.links import Page, view_actions
from silo.workbench.colleagues.announced import Newer
from silo.workbench.tone import Tone
from silo.workbench.words import plain, translate

_JUST_NOW_S = 120.0


def of_event(event: ServerEvent, page: Page, now: float | None = None) -> PaneEntry | None:
    """Make the box of one event; None for events that people need not see."""
    when = time.time() if now is None else now
    if event.merge is not None:
        return of_merge(event.merge, page, when, event.id)
    if event.type == RESET:
        return of_gap(when)
    data = event.data if isinstance(event.data, dict) else {}
    number = event.item or ""
    title, key = _event_words(event.type, number, data)
    if not title or not number:
        return None
    return PaneEntry(
        key=key or f"event:{event.id}:{event.type}:{number}",
        title=title,
        when=when,
        who=_text(data, "user", "created_by"),
        lines=tuple(EntryLine(text) for text in (_text(data, "comment", "description", "name"),) if text),
        actions=view_actions(part_page(number), page),
        icon="silo-commit" if event.type == "revision.created" else "silo-register",
        part_of={"revision.created": EntryBatch.REVISED, "item.created": EntryBatch.CREATED}.get(event.type),
    )


def commit_of_event(event: ServerEvent) -> tuple[str, Newer] | None:
    """Read the identity and the commit that an event announces; None for any other event, and for a change of
    properties.
    """
    data = event.data if isinstance(event.data, dict) else {}
    revision, identity = data.get("revision_number"), data.get("id")
    if event.type != "revision.created" or not isinstance(revision, int) or not isinstance(identity, str):
        return None
    if "file_name" in data and not data["file_name"]:
        return None
    who = _text(data, "user", "created_by")
    return identity.lower(), Newer(plain(event.item or ""), revision, who, time.monotonic())


def of_gap(when: float) -> PaneEntry:
    """Make the box that says that events are missing: the server lost its log, or counts again."""
    text = translate("Silo", "The server no longer has the events since then. See its own activity page.")
    return PaneEntry(
        key="gap",
        title=translate("Silo", "Some activity may be missing"),
        when=when,
        lines=(EntryLine(text, Tone.QUIET),),
        icon="silo-activity",
    )


def of_merge(merge: MergeEvent, page: Page, when: float, event_id: str | None = None) -> PaneEntry:
    """Make the box of a merge that the server announced (spec §5, SSE Event)."""
    lines = badges(merge.diff, merge.warnings)
    return PaneEntry(
        key=f"sync:{merge.sync_id}" if merge.sync_id else f"event:{event_id}:{MERGE}",
        title=headline(merge.item, translate),
        when=_moment(merge.timestamp, when),
        tone=Tone.WARNING if any(badge.tone is Tone.WARNING for badge in lines) else Tone.PLAIN,
        who=merge.user,
        badges=lines,
        actions=view_actions(merge.resolve_url or part_page(merge.item, "bom"), page),
        icon="silo-bom",
    )


def _moment(moment: datetime | None, now: float) -> float:
    """Return when an event happened: for an old event by the server's time, for a recent one now.

    Servers send whole seconds, and their clocks are a little off: for recent events, the order of arrival is
    more exact.
    """
    stamp = moment.timestamp() if moment is not None else now
    return stamp if abs(stamp - now) > _JUST_NOW_S else now


def _event_words(kind: str, number: str, data: dict[str, Any]) -> tuple[str, str]:
    """Return the title and the key of an event; the key of a revision is that of our own upload of it."""
    revision = data.get("revision_number", data.get("revision"))
    if kind == "revision.created" and isinstance(revision, int):
        if revision == 1 and _text(data, "comment") in ("", "created"):
            return "", ""  # Each new item has it, and the new item is shown already.
        text = translate("Silo", "Revision {n} of {number}", n=revision, number=number)
        return text, revision_key(number, revision)
    words = {
        "item.created": translate("Silo", "New item: {number}"),
        "item.deleted": translate("Silo", "Archived: {number}"),
    }
    return words.get(kind, "").replace("{number}", number), ""


def _text(data: dict[str, Any], *names: str) -> str:
    return next((plain(value) for name in names if isinstance(value := data.get(name), str) and value), "")
