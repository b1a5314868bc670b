# SPDX-License-Identifier: LGPL-2.1-or-later
"""How the files of components stand, and identities in them. GUI thread."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from silo.bom.errors import DocumentError
from silo.open_in_freecad import open_in_others
from silo.registering.offer import Candidate, Seen, State
from silo.workbench.commit.plan import leaves_first
from silo.workbench.freecad import host, live, saving


def look_at(paths: Iterable[str]) -> dict[str, Seen]:
    """How the files of components stand. GUI thread; what needs the disk's content is left to the worker."""
    known = host.documents_by_path()
    own = next((str(doc.TransientDir) for doc in known.values()), "")
    elsewhere = open_in_others(own)
    seen = {}
    for path in dict.fromkeys(paths):
        seen[path] = _look_at(path, known)
        spelt = known[path].FileName if path in known else ""
        if seen[path].state.usable and elsewhere.has(path, spelt):
            seen[path] = replace(seen[path], state=State.ELSEWHERE)
    return seen


def _look_at(path: str, known: Mapping[str, Any]) -> Seen:
    if not path:
        return Seen(State.UNNAMED)
    if not os.path.isfile(path):
        return Seen(State.MISSING)
    if not saving.is_writable(path):
        return Seen(State.READ_ONLY)
    doc = known.get(path)
    if doc is None:
        return Seen(State.READY)
    if live.lost_assemblies(doc):
        return Seen(State.LOST)
    saved_at = str(getattr(doc, "LastModifiedDate", "") or "")
    if not saving.is_modified(doc):
        return Seen(State.READY, saved_at)
    return Seen(State.PARTIAL if host.is_partial(doc) else State.EDITED, saved_at)


def write_identity(candidate: Candidate, identity: str) -> None:
    """Write an identity into a component's document and save it. GUI thread."""
    entry = candidate.entry
    doc = saving.open_fully(entry.doc_path)
    if live.lost_assemblies(doc):
        raise DocumentError(entry.doc_path, "made by a newer FreeCAD; saving it here would destroy it")
    whole = not candidate.shares_file
    for name in candidate.article.objects if candidate.article is not None else (entry.object_name,):
        saving.write_identity(doc, name, identity, whole_document=whole)
    saving.save(doc, mark_parents=True)


def remove_identity(candidate: Candidate) -> None:
    """Take the identity from what is modelled in an assembly's own file, and save it. GUI thread."""
    doc = saving.open_fully(candidate.entry.doc_path)
    if live.lost_assemblies(doc):
        raise DocumentError(doc.FileName, "made by a newer FreeCAD; saving it here would destroy it")
    for name in candidate.article.objects if candidate.article is not None else ():
        saving.remove_identity(doc, name)
    saving.save(doc, mark_parents=True)


def unedited() -> list[Any]:
    """The documents without unsaved edits, each after those that it links to."""
    clean = {doc.Name: doc for doc in host.documents() if doc.FileName and not saving.is_modified(doc)}
    ordered: dict[str, Any] = {}
    for doc in clean.values():
        ordered.update((below.Name, below) for below in leaves_first(doc) if below.Name in clean)
    return list(ordered.values())


def save_marked(doc: Any) -> None:
    """Save a document that was unedited, and that FreeCAD marked because something below it was saved."""
    if live.lost_assemblies(doc):
        return
    saving.save_marked(doc)
