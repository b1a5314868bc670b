# SPDX-License-Identifier: LGPL-2.1-or-later
"""The box of one commit of this FreeCAD that was sent. Pure."""

from __future__ import annotations

import os
import time

from silo.api.merging import unusual
from silo.bom.entry import BomEntry, walk_entries
from silo.bom.findings import Finding, FindingCode, Severity
from silo.bom.items.naming import display_name
from silo.bom.view.folders import shorten
from silo.bom_sync.activity_text import (
    draft_text,
    headline,
    summary_texts,
    unregistered_text,
)
from silo.bom_sync.resolved import Resolved
from silo.bom_sync.steps import Status
from silo.outbox.report import Sent
from silo.workbench.activity.badges import badges
from silo.workbench.activity.box import (
    Action,
    Do,
    EntryBatch,
    EntryLine,
    PaneEntry,
    not_in_silo_key,
    revision_key,
    shortened,
)
from silo.workbench.activity.links import Page, view_actions
from silo.workbench.tone import Tone
from silo.workbench.words import counted, filled, plain, quantity, spoken, translate


def of_sent(sent: Sent, page: Page, now: float | None = None) -> PaneEntry:
    """Make the box of one commit."""
    lines = (*_revision_lines(sent), *_status_lines(sent), *_resolved_lines(sent), *_product_lines(sent))
    tone = max((line.tone for line in lines), key=_WEIGHT.__getitem__, default=Tone.GOOD)
    url = (sent.result.resolve_url if sent.result is not None else "") or sent.page
    return PaneEntry(
        key=f"sync:{sent.sync_id}" if sent.sync_id else f"commit:{sent.part_number}:{now}",
        also=(
            not_in_silo_key(sent.entry.path),
            *((revision_key(sent.part_number, sent.revision),) if sent.revision else ()),
        ),
        title=_title(sent),
        when=time.time() if now is None else now,
        tone=tone if tone in (Tone.WARNING, Tone.ERROR) else Tone.GOOD,
        badges=_badges(sent),
        lines=lines,
        actions=view_actions(url, page),
        rank=1,
        icon="silo-bom" if sent.status in (Status.MERGED, Status.BLOCKED) else "silo-commit",
        part_of=_batch_of(sent, tone),
        document=sent.resolved.assembly.doc_path if sent.resolved is not None else "",
    )


def _batch_of(sent: Sent, tone: Tone) -> EntryBatch | None:
    """Return the batch to which a commit belongs if it has nothing that a user must see; otherwise None."""
    quiet = tone not in (Tone.WARNING, Tone.ERROR)
    return EntryBatch.COMMITTED if quiet and sent.status not in (Status.MERGED, Status.BLOCKED) else None


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
    if sent.conflict:
        lines.append(EntryLine(spoken(sent.conflict), Tone.ERROR))
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
    """Return what a user can do about missing components; only these may be left out of a BOM."""
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
    """Return what a user can do about a finding: see the objects, or decide about a copied identity."""
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
