# SPDX-License-Identifier: LGPL-2.1-or-later
"""The files of components: how they stand, and the identities in them. GUI thread."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from silo.freecads.open_documents import open_in_others
from silo.registering.candidate import Candidate, ComponentState, OpenedFile
from silo.workbench.documents.order import leaves_first
from silo.workbench.freecad import host, identities, saving
from silo.workbench.freecad.lost import lost_objects, refuse_loss
from silo.workbench.freecad.modified import is_modified
from silo.workbench.freecad.opening import open_fully


def look_at(paths: Iterable[str]) -> dict[str, OpenedFile]:
    """Find out how the files of components stand. GUI thread; the worker reads the contents from the disk."""
    documents = host.documents_by_path()
    own = next((str(doc.TransientDir) for doc in documents.values()), "")
    elsewhere = open_in_others(own)
    seen = {}
    for path in dict.fromkeys(paths):
        seen[path] = _look_at(path, documents)
        spelt = documents[path].FileName if path in documents else ""
        if seen[path].state.usable and elsewhere.has(path, spelt):
            seen[path] = replace(seen[path], state=ComponentState.ELSEWHERE)
    return seen


def _look_at(path: str, states: Mapping[str, Any]) -> OpenedFile:
    if not path:
        return OpenedFile(ComponentState.UNNAMED)
    if not os.path.isfile(path):
        return OpenedFile(ComponentState.MISSING)
    if not saving.is_writable(path):
        return OpenedFile(ComponentState.READ_ONLY)
    doc = states.get(path)
    if doc is None:
        return OpenedFile(ComponentState.READY)
    if lost_objects(doc):
        return OpenedFile(ComponentState.LOST)
    saved_at = str(getattr(doc, "LastModifiedDate", "") or "")
    if not is_modified(doc):
        return OpenedFile(ComponentState.READY, saved_at)
    return OpenedFile(ComponentState.PARTIAL if host.is_partial(doc) else ComponentState.EDITED, saved_at)


def write_identity(candidate: Candidate, identity: str) -> None:
    """Write an identity into a component's document and save it. GUI thread."""
    entry = candidate.entry
    doc = open_fully(entry.doc_path)
    refuse_loss(doc)
    for name in _objects(candidate):
        identities.write_identity(doc, name, identity, whole_document=not candidate.shares_file)
    saving.save(doc, mark_parents=True)


def remove_identity(candidate: Candidate, *, no_part: bool = False) -> None:
    """Take the identity from a component's file, and save it. GUI thread.

    no_part
        also mark it as no part; otherwise such a mark is removed too.
    """
    doc = open_fully(candidate.entry.doc_path)
    refuse_loss(doc)
    for name in _objects(candidate):
        identities.remove_identity(doc, name, no_part=no_part, whole_document=not candidate.shares_file)
    saving.save(doc, mark_parents=True)


def restore_identity(candidate: Candidate) -> None:
    """Give a component's file the identity that it had before it was registered, or none, and save it."""
    if candidate.entry.silo_uuid:
        write_identity(candidate, candidate.entry.silo_uuid)
    else:
        remove_identity(candidate)


def _objects(candidate: Candidate) -> tuple[str, ...]:
    article = candidate.article
    return article.objects if article is not None else (candidate.entry.object_name,)


def unedited() -> list[Any]:
    """Return the documents without unsaved edits, each after those to which it links."""
    clean = {doc.Name: doc for doc in host.documents() if doc.FileName and not is_modified(doc)}
    ordered: dict[str, Any] = {}
    for doc in clean.values():
        ordered.update((below.Name, below) for below in leaves_first(doc) if below.Name in clean)
    return list(ordered.values())
