# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a commit saves, in which order, and what it leaves alone and why. GUI thread, but no widgets.

A plan lists the document and everything below it that has unsaved edits, leaves before parents (spec,
design decision 3). Nothing is lost: a document that FreeCAD cannot save whole is reported, never written.

A document as it was at one moment: what the worker needs to know of it, and nothing that is alive.

Taken in the GUI thread in milliseconds; from then on the document may change, be closed, or FreeCAD may die.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from silo.bom.errors import DocumentError, SeveralAssembliesError, SiloError
from silo.bom.links import extract, file_bom
from silo.bom.model import Extraction, held_items, sole_identity
from silo.bom.report import to_plain
from silo.bom.roots import NAME_ONE
from silo.outbox.entry import new_key
from silo.platform import Stamp, one_path, stamp_of
from silo.workbench.commit.opened import Base
from silo.workbench.words import plain, translate


@dataclass(frozen=True)
class Snapshot:
    """A document at commit time.

    path
        real path of its file.
    identity
        Silo UUID of the item that the file belongs to; None while unregistered.
    extraction
        the BOM, for an assembly; None for a part.
    problem
        why there is no BOM though there might be one ("several assemblies").
    several
        several items are in it, and it is none of them: its file is a document of its own.
    """

    path: str
    label: str
    identity: str | None = None
    extraction: Extraction | None = None
    problem: str = field(default="", compare=False)
    several: bool = field(default=False, compare=False)

    @property
    def is_assembly(self) -> bool:
        """Return True if there is a BOM to sync."""
        return self.extraction is not None

    def is_as(self, other: Snapshot) -> bool:
        """Return True if both are the same state: the same item, and the same BOM with everything below
        it.
        """
        mine, its = (snapshot.extraction and to_plain(snapshot.extraction) for snapshot in (self, other))
        return (self.path, self.identity, mine) == (other.path, other.identity, its)


Walk = Callable[[Any], Extraction]


def take(doc: Any, *, assembly: Any = None, walk: Walk = extract) -> Snapshot:
    """Take a snapshot of an open document.

    assembly
        the container in which a person works, if it is known; it decides if the document holds several.
    walk
        returns the BOM of a container (:func:`silo.workbench.freecad.live.extract_object`).
    """
    path = one_path(doc.FileName) if doc.FileName else ""
    label = str(getattr(doc, "Label", "") or os.path.basename(path))
    try:
        sha256, extraction = file_bom(doc, assembly, walk)
    except SeveralAssembliesError as error:
        here = translate("Silo", "Make the right assembly active: double-click it in the tree.")
        return Snapshot(path, label, sole_identity(doc), problem=str(error).replace(NAME_ONE, here))
    several = not sha256 and len({identity for identity, _ in held_items(doc)}) > 1
    return Snapshot(path, label, sha256, extraction, several=several)


# Seconds of the GUI thread; what has not been compared with its file by then counts as edited.
MOST_S = 0.08


class Documents(Protocol):
    """What a commit needs of FreeCAD; :class:`silo.workbench.live_desk.LiveDocuments` has it."""

    def linked(self, doc: Any, /) -> Iterable[Any]: ...

    def is_partial(self, doc: Any, /) -> bool: ...

    def is_modified(self, doc: Any, /) -> bool: ...

    def is_edited(self, doc: Any, until: float, /) -> bool: ...

    def is_writable(self, path: str, /) -> bool: ...

    def lost_objects(self, doc: Any, /) -> list[str]: ...

    def is_damaged(self, doc: Any, /) -> bool: ...

    def save(self, doc: Any, /) -> None: ...

    def base(self, doc: Any, /) -> Base: ...


def is_edited(documents: Documents, doc: Any) -> bool:
    """Return True if a document differs from its file; False if FreeCAD only marked it."""
    return documents.is_modified(doc) and documents.is_edited(doc, time.thread_time() + MOST_S)


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
        the colleague's revision that a person saw and commits this on top of; empty where there is none.
    is_new
        the file has only just got its item, at a person's word: nobody's newer revision is looked for.
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
        """Return the rows that are committed unless a person decides otherwise."""
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
    return f"{name}: {top.note}"


def leaves_first(top: Any) -> Iterable[Any]:
    """Return a document and all documents to which it links, each once, after those to which it links itself.

    Documents that link to each other in a ring are in the order in which they are found.
    """
    sort = getattr(top, "getDependentDocuments", None)
    if sort is None:
        return _walked(top)
    try:
        # One look at all links; ``OutList`` takes one for each document: seconds in large assemblies.
        return list(sort(True))
    except RuntimeError:
        return _walked(top)


def _walked(top: Any) -> Iterator[Any]:
    seen: set[str] = set()
    stack: list[tuple[Any, Iterator[Any]]] = []

    def enter(doc: Any) -> None:
        seen.add(doc.Name)
        stack.append((doc, iter(tuple(getattr(doc, "OutList", ()) or ()))))

    enter(top)
    while stack:
        doc, below = stack[-1]
        following = next((d for d in below if d.Name not in seen), None)
        if following is not None:
            enter(following)
        else:
            stack.pop()
            yield doc


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


@dataclass(frozen=True)
class CommittedDocument:
    """One document of a commit is done, as far as the GUI thread is concerned.

    base
        what the document was made from.
    held
        the saved file's content under a second name; None where that is not possible.
    stamp
        of the saved file.
    error
        why there is nothing to send.
    """

    row: DocumentRow
    snapshot: Snapshot | None = None
    key: str = ""
    held: Path | None = None
    stamp: Stamp | None = None
    error: SiloError | None = None
    base: Base | None = None


class Keeping(Protocol):
    """What is needed of :class:`silo.outbox.store.Store`."""

    def hold(self, path: str, key: str, /) -> Path | None: ...

    def keep_aside(self, path: str, /) -> Path | None: ...


def take_each(
    rows: Iterable[DocumentRow], documents: Documents, take: Callable[[Any], Snapshot], outbox: Keeping
) -> Iterator[CommittedDocument]:
    """Save one document after another and take snapshots; one failure does not stop the others. GUI
    thread.
    """
    for row in rows:
        try:
            taken = _take(row, documents, take, outbox)
        except SiloError as error:
            taken = CommittedDocument(row, error=error)
        except ReferenceError:
            text = translate("Silo", "It was closed before it was saved: open it and commit it again.")
            taken = CommittedDocument(row, error=SiloError(text))
        except Exception as error:  # noqa: BLE001  # one document's trouble is not that of the others
            taken = CommittedDocument(
                row, error=SiloError(f"unexpected problem ({type(error).__name__}: {error})")
            )
        yield taken


def _take(
    row: DocumentRow, documents: Documents, take: Callable[[Any], Snapshot], outbox: Keeping
) -> CommittedDocument:
    base = documents.base(row.document)
    if one_path(row.document.FileName) != row.path:
        text = "it was saved under another name since this commit was asked for; commit it again"
        raise DocumentError(row.path, text)
    # What somebody else has written is no file of ours: ours is written again, at a person's word. What
    # was edited while documents before it were saved goes along: the BOM is that of the file.
    if row.state is not DocumentState.SAVED or base.replaced or is_edited(documents, row.document):
        if base.replaced and not row.replaced:
            text = "somebody has written it since this commit was asked for; nothing was saved over it. "
            raise DocumentError(row.path, text + "Commit it again, and choose which one counts")
        if base.replaced:
            outbox.keep_aside(row.path)
        documents.save(row.document)
    stamp = stamp_of(row.path)
    snapshot, key = take(row.document), new_key()
    held = outbox.hold(row.path, key) if snapshot.identity else None
    return CommittedDocument(row, snapshot, key, held, stamp, base=base)
