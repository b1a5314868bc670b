# SPDX-License-Identifier: LGPL-2.1-or-later
"""From what happened to what the pane shows: commits of this FreeCAD, and events of the server. Pure."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from datetime import datetime
from typing import Any

from silo.api.merging import unusual
from silo.api.sse import MERGE, RESET, ServerEvent
from silo.api.wire import MergeDiff, MergeEvent, MergeWarning
from silo.bom.document import saved_by
from silo.bom.errors import SiloError
from silo.bom.findings import Finding, FindingCode, Severity
from silo.bom.items.naming import display_name
from silo.bom.model import BomEntry, walk_entries
from silo.bom.report import shorten
from silo.bom_sync import (
    MergeCount,
    Resolved,
    Status,
    count_texts,
    draft_text,
    headline,
    no_changes,
    summary_texts,
    unregistered_text,
)
from silo.outbox.send import Sent
from silo.workbench.pane.activity import (
    Action,
    Do,
    EntryBatch,
    EntryLine,
    PaneEntry,
    Tone,
    not_in_silo_key,
    shortened,
)
from silo.workbench.session.session import Newer
from silo.workbench.words import counted, filled, plain, quantity, translate

# Makes an absolute address of a page such as `resolve_url`; raises SiloError for another server's.
Page = Callable[[str], str]


def of_sent(sent: Sent, page: Page, now: float | None = None) -> PaneEntry:
    """Make the box of one commit."""
    lines = (*_revision_lines(sent), *_status_lines(sent), *_resolved_lines(sent), *_product_lines(sent))
    tone = max((line.tone for line in lines), key=_WEIGHT.__getitem__, default=Tone.GOOD)
    url = (sent.result.resolve_url if sent.result is not None else "") or sent.page
    return PaneEntry(
        key=f"sync:{sent.sync_id}" if sent.sync_id else f"commit:{sent.part_number}:{now}",
        also=(
            not_in_silo_key(sent.entry.path),
            *((_revision_key(sent.part_number, sent.revision),) if sent.revision else ()),
        ),
        title=_title(sent),
        when=time.time() if now is None else now,
        tone=tone if tone in (Tone.WARNING, Tone.ERROR) else Tone.GOOD,
        badges=_badges(sent),
        lines=lines,
        actions=_view(url, page),
        rank=1,
        icon="silo-bom" if sent.status in (Status.MERGED, Status.BLOCKED) else "silo-commit",
        part_of=_batch_of(sent, tone),
        document=sent.resolved.assembly.doc_path if sent.resolved is not None else "",
    )


def own_box(key: str, title: str, *lines: str, tone: Tone, icon: str = "silo-commit") -> PaneEntry:
    """Make a box of something that happens here and now; its lines have its tone."""
    made = tuple(EntryLine(text, tone) for text in lines)
    return PaneEntry(key, title, time.time(), tone, lines=made, rank=1, icon=icon)


def of_team(wanted: str, here: tuple[int, int]) -> PaneEntry | None:
    """Make the box that says that the team works with another FreeCAD; None if it does not, or if the server
    does not say.

    wanted
        the team's version, such as "1.0".
    """
    team = saved_by(wanted)
    if not team or team == here:
        return None
    if here > team:
        text = translate(
            "Silo",
            "A file that is saved here may hold objects that the FreeCAD of your colleagues does not know "
            "and does not load.",
        )
    else:
        text = translate(
            "Silo",
            "Files of your colleagues may hold objects that this FreeCAD does not know. You are asked before "
            "a save removes such objects from a file.",
        )
    shown = translate(
        "Silo", "Your team works with FreeCAD {team}; this is {here}", team=wanted, here="{}.{}".format(*here)
    )
    return own_box("team-freecad", shown, text, tone=Tone.WARNING)


def _batch_of(sent: Sent, tone: Tone) -> EntryBatch | None:
    """Return the batch to which a commit belongs if it has nothing that a person must see; otherwise None."""
    quiet = tone not in (Tone.WARNING, Tone.ERROR)
    return EntryBatch.COMMITTED if quiet and sent.status not in (Status.MERGED, Status.BLOCKED) else None


_JUST_NOW_S = 120.0

_WEIGHT = {
    Tone.QUIET: 0,
    Tone.PLAIN: 1,
    Tone.GOOD: 2,
    Tone.CHANGED: 3,
    Tone.WARNING: 4,
    Tone.ERROR: 5,
}


def _title(sent: Sent) -> str:
    item = " ".join(filter(None, (sent.number, _name(sent))))
    if sent.status is Status.MERGED:
        return headline(item, translate)
    if sent.status is Status.BLOCKED:
        return translate("Silo", "BOM not synced: {number}", number=item)
    return translate("Silo", "Committed: {number}", number=item)


def _name(sent: Sent) -> str:
    if sent.resolved is not None and sent.resolved.assembly.name:
        return sent.resolved.assembly.name
    return sent.entry.label


def _badges(sent: Sent) -> tuple[EntryLine, ...]:
    if sent.result is not None:
        return badges(sent.result.diff, sent.result.warnings)
    if sent.status is Status.UNCHANGED:
        return (EntryLine(translate("Silo", "BOM unchanged"), Tone.QUIET),)
    return ()


def badges(diff: MergeDiff, warnings: Iterable[MergeWarning] = ()) -> tuple[EntryLine, ...]:
    """Write the counts of a merge as the spec's box has them, without those that are zero."""
    texts = count_texts(diff, warnings, translate)
    if not texts:
        return (EntryLine(no_changes(translate), Tone.QUIET),)
    return tuple(EntryLine(text, _TONES[kind]) for kind, text in texts.items())


_TONES = {
    MergeCount.ADDED: Tone.GOOD,
    MergeCount.CHANGED: Tone.CHANGED,
    MergeCount.UNREFERENCED: Tone.WARNING,
    MergeCount.IN_CONFLICT: Tone.WARNING,
}


def _revision_lines(sent: Sent) -> tuple[EntryLine, ...]:
    if sent.revision is not None:
        text = translate("Silo", "Revision {n} uploaded", n=sent.revision)
        comment = plain(sent.entry.comment, 120)
        return (EntryLine(f"{text}: {comment}" if comment else text, Tone.PLAIN),)
    if sent.entry.has_file:
        return (EntryLine(translate("Silo", "The file is in Silo already"), Tone.QUIET),)
    return ()


def _status_lines(sent: Sent) -> tuple[EntryLine, ...]:
    lines = []
    if sent.entry.remark:
        lines.append(EntryLine(sent.entry.remark, Tone.WARNING))
    if draft := draft_text(sent.result or sent.uploaded, translate):
        lines.append(EntryLine(draft, Tone.PLAIN))
    lines += [EntryLine(plain(message, 300), Tone.WARNING) for message in unusual(sent.result)]
    removed = len(sent.result.diff.removed) if sent.result is not None else 0
    if sent.status is Status.UNCHANGED and sent.plan is not None:
        removed = len(sent.plan.diff.removed)
    if removed:
        sentence = translate(
            "Silo", "{n} item in the Silo BOM is not referenced by components in this assembly."
        )
        many = translate(
            "Silo", "{n} items in the Silo BOM are not referenced by components in this assembly."
        )
        lines.append(EntryLine(counted(removed, sentence, many), Tone.WARNING))
    missing = sum(entry.missing for entry in sent.resolved.entries) if sent.resolved is not None else 0
    if missing:
        sentence = translate("Silo", "Incomplete: {n} component is missing; its known line stays as it is.")
        many = translate(
            "Silo", "Incomplete: {n} components are missing; their known lines stay as they are."
        )
        lines.append(EntryLine(counted(missing, sentence, many), Tone.WARNING))
    if sent.status is Status.BLOCKED:
        text = translate("Silo", "The file is in Silo. The BOM waits until these are mended:")
        lines.append(EntryLine(text, Tone.ERROR, _blocked_actions(sent.entry.path, missing)))
    return tuple(lines)


def _blocked_actions(path: str, missing: int) -> tuple[Action, ...]:
    """Return what a person can do about missing components; only these may be left out of a BOM."""
    if not missing:
        return ()
    singular, many = translate("Silo", "Sync without it"), translate("Silo", "Sync without them")
    return (
        Action(Do.MEND, translate("Silo", "Relink…"), document=path),
        Action(Do.SYNC_WITHOUT, counted(missing, singular, many), document=path),
    )


def _resolved_lines(sent: Sent) -> tuple[EntryLine, ...]:
    resolved = sent.resolved
    if resolved is None:
        return ()
    base = os.path.dirname(resolved.assembly.doc_path)
    rest = (Action(Do.PREVIEW, translate("Silo", "Show all…"), document=resolved.assembly.doc_path),)
    return (
        *shortened(tuple(_finding_lines(resolved, base)), MOST_FINDINGS, rest),
        *shortened(tuple(_conflict_lines(sent, resolved)), MOST_CONFLICTS, rest),
        *unregistered_lines(resolved),
    )


def _product_lines(sent: Sent) -> tuple[EntryLine, ...]:
    """Write what is open in the sub-assemblies, and what the product weighs and costs, as the server
    has it.
    """
    if sent.summary is None:
        return ()
    own = f"{sent.number}: "  # what is open in its own BOM is shown already
    value_lines, values = summary_texts(sent.summary, translate)
    below = translate("Silo", "Open in {bom}")
    lines = tuple(
        EntryLine(below.replace("{bom}", line), Tone.WARNING)
        for line in value_lines
        if not line.startswith(own)
    )
    return (*shortened(lines, MOST_OPEN), *((EntryLine(" · ".join(values), Tone.QUIET),) if values else ()))


# Even if there are many of one kind, the box has room for the other kinds and their buttons.
MOST_FINDINGS, MOST_CONFLICTS, MOST_OPEN = 6, 4, 4

# Reported elsewhere in the box, or only in the preview.
_NOT_HERE = (FindingCode.UNREGISTERED, FindingCode.CONSOLIDATION)


def _finding_lines(resolved: Resolved, base: str) -> list[EntryLine]:
    lines = []
    order = {Severity.ERROR: 0, Severity.WARNING: 1}
    findings = [f for f in resolved.findings if f.severity in order and f.code not in _NOT_HERE]
    for finding in sorted(findings, key=lambda f: order[f.severity]):
        tone = Tone.ERROR if finding.severity is Severity.ERROR else Tone.WARNING
        lines.append(EntryLine(shorten(finding.message, base), tone, finding_actions(finding, resolved)))
    return lines


def finding_actions(finding: Finding, resolved: Resolved) -> tuple[Action, ...]:
    """Return what a person can do about a finding: see the objects, or decide about a copied identity."""
    top = resolved.assembly.doc_path
    if finding.code is FindingCode.COPIED_IDENTITY:
        files = tuple(dict.fromkeys(place.doc_path for place in finding.where))
        return (
            Action(Do.SAME, translate("Silo", "Same part"), _identity_at(finding, resolved), top, files),
            Action(Do.DECIDE, translate("Silo", "New part…"), document=top),
        )
    names = tuple(place.obj for place in finding.where if place.doc_path == top and place.obj)
    return (Action(Do.SHOW, translate("Silo", "Show"), document=top, objects=names),) if names else ()


def _identity_at(finding: Finding, resolved: Resolved) -> str:
    """Return the identity that the files of a finding share."""
    places = {(place.doc_path, place.obj) for place in finding.where}
    entries = walk_entries((resolved.assembly, *resolved.entries))
    return next((e.silo_uuid for e in entries if e.key in places and e.silo_uuid), "")


def _conflict_lines(sent: Sent, resolved: Resolved) -> list[EntryLine]:
    if sent.plan is None:
        return []
    text = translate("Silo", "{number}: the assembly has {cad}, a manual line in Silo says {silo}")
    entries = {entry.part_number: entry for entry in resolved.entries}
    lines = []
    for change in sent.plan.diff.conflicts:
        conflict_text = filled(
            text,
            number=change.part_number,
            cad=quantity(change.local_quantity),
            silo=change.on_server(quantity(change.remote_quantity)),
        )
        lines.append(EntryLine(conflict_text, Tone.WARNING, _show(entries.get(change.part_number), resolved)))
    return lines


def _show(entry: BomEntry | None, resolved: Resolved) -> tuple[Action, ...]:
    if entry is None or not entry.instances:
        return ()
    text = translate("Silo", "Show")
    return (Action(Do.SHOW, text, document=resolved.assembly.doc_path, objects=entry.instances),)


def unregistered_lines(resolved: Resolved) -> tuple[EntryLine, ...]:
    """Write ``⚠ 2 components have no Silo part number [Register Parts…]``, and their names."""
    count = len(resolved.unresolved)
    if not count:
        return ()
    register = Action(Do.REGISTER, translate("Silo", "Register Parts…"), document=resolved.assembly.doc_path)
    names = ", ".join(plain(display_name(entry), 40) for entry in resolved.unresolved[:5])
    more = ", …" if count > 5 else ""
    return (
        EntryLine(unregistered_text(count, translate), Tone.WARNING, (register,)),
        EntryLine(f"{names}{more}", Tone.QUIET),
    )


# --- events of the server --------------------------------------------------------------------------------


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
        actions=_view(f"/items/{number}", page),
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
        actions=_view(merge.resolve_url or f"/items/{merge.item}/bom", page),
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
        return text, _revision_key(number, revision)
    words = {
        "item.created": translate("Silo", "New item: {number}"),
        "item.deleted": translate("Silo", "Archived: {number}"),
    }
    return words.get(kind, "").replace("{number}", number), ""


def _revision_key(number: str, revision: int) -> str:
    return f"revision:{number}:{revision}"


def _text(data: dict[str, Any], *names: str) -> str:
    return next((plain(value) for name in names if isinstance(value := data.get(name), str) and value), "")


def _view(path: str, page: Page) -> tuple[Action, ...]:
    try:
        url = page(path)
    except SiloError:
        # Another server's page: a message must not lead people away from the server of the settings.
        return ()
    return (Action(Do.VIEW, translate("Silo", "View in Silo →"), target=url),)
