# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a commit saves, in which order, and what it leaves alone and why. GUI thread, but no widgets.

A plan lists the document and everything below it that has unsaved edits, leaves before parents (spec,
design decision 3). Nothing is lost: a document that FreeCAD cannot save whole is reported, never written.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from silo.bom.message import message
from silo.platform.spelling import one_path
from silo.workbench.desk import MOST_S, Documents
from silo.workbench.documents.order import leaves_first
from silo.workbench.words import plain, translate


class DocumentState(StrEnum):
    """How a document stands before a commit."""

    CHANGED = "changed"  # has edits; will be saved
    RECOMPUTED = "recomputed"  # marked by FreeCAD, but nothing differs from the file
    SAVED = "saved"  # nothing to save; the file is sent as it is
    UNNAMED = "unnamed"  # never saved: it has no file yet
    PARTIAL = "partial"  # has edits, but FreeCAD has loaded it only in part and cannot save it
    READ_ONLY = "read-only"  # has edits, but the file may not be written
    LOST = "lost"  # saving would destroy what this FreeCAD could not load
    DAMAGED = "damaged"  # the file is damaged: FreeCAD has what it could read of it


@dataclass(frozen=True)
class DocumentRow:
    """A document of the plan. ``document`` is alive and belongs in the GUI thread.

    replaced
        somebody else has written the file since the document was opened: saving it would undo that.
    on_top
        the colleague's revision that a user saw and commits this on top of; empty where there is none.
    is_new
        the file has only just got its item, at a user's word: no newer revision is looked for.
    lost
        the objects that saving it here would destroy.
    """

    document: Any
    path: str
    label: str
    state: DocumentState
    is_top: bool = False
    replaced: bool = False
    on_top: Mapping[str, Any] = field(default_factory=dict)
    is_new: bool = False
    lost: tuple[str, ...] = ()

    @property
    def can_commit(self) -> bool:
        """Return True if the file can be saved, if necessary, and sent."""
        return self.state in (DocumentState.CHANGED, DocumentState.RECOMPUTED, DocumentState.SAVED)

    @property
    def wanted(self) -> bool:
        """Return True if the row is checked at the beginning; a document that was only recomputed is as in
        Silo.
        """
        asked = self.is_top or self.state is not DocumentState.RECOMPUTED
        return self.can_commit and asked and not self.replaced

    @property
    def note(self) -> str:
        """Describe the state in words."""
        if self.replaced:
            return translate(
                "Silo",
                "another program changed the file since it was opened: reload it, or commit yours over it",
            )
        lost = plain(", ".join(self.lost), 300)
        return _words()[self.state].replace("{lost}", lost)


def _words() -> dict[DocumentState, str]:
    return {
        DocumentState.CHANGED: translate("Silo", "unsaved edits: will be saved"),
        DocumentState.RECOMPUTED: translate("Silo", "recomputed only: nothing differs from the file"),
        DocumentState.SAVED: translate("Silo", "saved already"),
        DocumentState.UNNAMED: translate("Silo", "has no file yet: save it under a name first"),
        DocumentState.PARTIAL: translate(
            "Silo",
            "FreeCAD has loaded it only in part and cannot save these edits: open the file itself and "
            "make them there",
        ),
        DocumentState.READ_ONLY: translate("Silo", "the file is read-only: these edits are not saved"),
        DocumentState.LOST: translate(
            "Silo",
            "made by a newer FreeCAD: saving it here would destroy {lost}, so it is not saved. Make these "
            "edits in the newer FreeCAD",
        ),
        DocumentState.DAMAGED: translate(
            "Silo",
            "the file is damaged, and FreeCAD has opened what it could read of it: fetch the file again, or "
            "check that nothing is missing and save it in FreeCAD yourself",
        ),
    }


@dataclass(frozen=True)
class CommitPlan:
    """The documents of a commit, leaves first, the one that was asked for last.

    unregistered
        the one that was asked for has no item in Silo yet.
    """

    rows: tuple[DocumentRow, ...]
    unregistered: bool = False

    @property
    def wanted(self) -> tuple[DocumentRow, ...]:
        """Return the rows that are committed unless a user decides otherwise."""
        return tuple(row for row in self.rows if row.wanted)

    @property
    def top(self) -> DocumentRow:
        """Return the document that the person works in."""
        return self.rows[-1]

    @property
    def is_simple(self) -> bool:
        """Return True if there is nothing to ask: one document that can be committed, and no changes in the
        others.
        """
        others = all(row.state is DocumentState.RECOMPUTED for row in self.rows[:-1])
        replaced = any(row.replaced for row in self.rows)
        return others and self.top.can_commit and not self.unregistered and not replaced


def plan(top: Any, documents: Documents, *, unregistered: bool = False) -> CommitPlan:
    """Plan the commit of a document."""
    until = time.thread_time() + MOST_S
    changed = {doc.Name for doc in documents.linked(top) if documents.is_modified(doc)} - {top.Name}
    rows = []
    # The order is only needed if there are several documents.
    for doc in leaves_first(top) if changed else (top,):
        is_top = doc is top or doc == top
        if is_top or doc.Name in changed:
            path = one_path(doc.FileName) if doc.FileName else ""
            state = _state(doc, documents, until)
            # Do not show documents that were only recomputed and cannot be saved anyway.
            if is_top or state is not DocumentState.SAVED:
                replaced = bool(path) and documents.base(doc).replaced
                lost = tuple(documents.lost_objects(doc)) if state is DocumentState.LOST else ()
                rows.append(DocumentRow(doc, path, str(doc.Label), state, is_top, replaced, lost=lost))
    return CommitPlan(tuple(rows), unregistered)


def refusal(plan: CommitPlan) -> str:
    """Say why the document itself cannot be committed; "" if it can."""
    top = plan.top
    if top.can_commit:
        return ""
    name = plain(os.path.basename(top.path) or top.label, 80)
    if top.state is DocumentState.UNNAMED:
        return translate("Silo", "{name} has no file yet. Save it under a name first.", name=name)
    return message("{name}: {note}", name=name, note=top.note)


def _state(doc: Any, documents: Documents, until: float) -> DocumentState:
    if not doc.FileName:
        return DocumentState.UNNAMED
    if documents.is_damaged(doc):
        return DocumentState.DAMAGED
    if not documents.is_modified(doc):
        return DocumentState.SAVED
    edited = documents.is_edited(doc, until)
    held = _held(doc, documents)
    if held is not None:
        return held if edited else DocumentState.SAVED
    return DocumentState.CHANGED if edited else DocumentState.RECOMPUTED


def _held(doc: Any, documents: Documents) -> DocumentState | None:
    """Return the state that keeps a document from being saved; None if it can be saved."""
    if documents.is_partial(doc):
        return DocumentState.PARTIAL
    if documents.lost_objects(doc):
        return DocumentState.LOST
    return None if documents.is_writable(doc.FileName) else DocumentState.READ_ONLY
