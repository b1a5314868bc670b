# SPDX-License-Identifier: LGPL-2.1-or-later
"""Saves the documents of a commit, one after another, and takes their snapshots. GUI thread."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from silo.bom.errors import DocumentError, SiloError
from silo.bom.message import message
from silo.outbox.entry import new_key
from silo.platform.spelling import one_path
from silo.platform.stamp import Stamp, stamp_of
from silo.workbench.commit.plan import DocumentRow, DocumentState
from silo.workbench.desk import Documents, is_edited
from silo.workbench.documents.opened import DocumentOrigin
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.words import translate


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
    base: DocumentOrigin | None = None


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
                row,
                error=SiloError(
                    message("unexpected problem ({name}: {error})", name=type(error).__name__, error=error)
                ),
            )
        yield taken


def _take(
    row: DocumentRow, documents: Documents, take: Callable[[Any], Snapshot], outbox: Keeping
) -> CommittedDocument:
    base = documents.base(row.document)
    if one_path(row.document.FileName) != row.path:
        text = message("it was saved under another name since this commit was asked for; commit it again")
        raise DocumentError(row.path, text)
    # What somebody else has written is no file of ours: ours is written again, at a user's word. What
    # was edited while documents before it were saved goes along: the BOM is that of the file.
    if row.state is not DocumentState.SAVED or base.replaced or is_edited(documents, row.document):
        if base.replaced and not row.replaced:
            text = message(
                "somebody has written it since this commit was asked for; nothing was saved over it. "
            )
            raise DocumentError(row.path, text + message("Commit it again, and choose which one counts"))
        if base.replaced:
            outbox.keep_aside(row.path)
        documents.save(row.document)
    stamp = stamp_of(row.path)
    snapshot, key = take(row.document), new_key()
    held = outbox.hold(row.path, key) if snapshot.identity else None
    return CommittedDocument(row, snapshot, key, held, stamp, base=base)
