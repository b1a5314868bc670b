# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD's mark of unsaved edits, and whether a document that has it was really edited.

FreeCAD's main thread only.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from typing import Any

from silo.workbench.freecad import host
from silo.workbench.freecad.edits import EditWatch


def is_modified(doc: Any) -> bool:
    """Return True if the document has edits that are not on disk."""
    if not host.has_gui():
        return bool(doc.isTouched()) if hasattr(doc, "isTouched") else False
    view = host.view_of(doc)
    return bool(view is not None and view.Modified)


@cache
def watch_edits() -> EditWatch:
    """Watch edits from now on, for :func:`is_edited`."""
    watch = EditWatch()
    watch.begin([doc for doc in host.documents() if not is_modified(doc)])
    host.add_document_observer(watch)
    return watch


def is_edited(doc: Any, until: float) -> bool:
    """Return True if a modified document differs from its file; False if it was only recomputed.

    until
        the time (``time.thread_time``) after which nothing more is compared; the rest counts as edited.
    """
    return watch_edits().is_edited(doc, until)


def mark_modified(name: str) -> None:
    """Mark the document of this name as one with edits that are not on disk."""
    for doc in (document for document in host.documents() if document.Name == name):
        if host.version() < (0, 21):
            for obj in doc.Objects[:1]:
                obj.touch()  # 0.20 takes no mark, and marks a document for this
        elif (view := host.view_of(doc)) is not None:
            view.Modified = True


@contextmanager
def others_unmarked(doc: Any = None) -> Iterator[None]:
    """Keep other documents unmarked while this one is changed and saved; None: all of them.

    FreeCAD marks each document that links to a saved one, because it keeps the time of saving of that (0.20
    does so whatever we do), and each document that shows an axis cross, because the size of the cross
    changes. They were not edited.
    """
    clean = [other for other in host.documents() if other != doc and not is_modified(other)]
    if not host.has_gui():
        yield
    elif host.version() >= (0, 21):
        yield
        for other in clean:
            if is_modified(other):
                host.view_of(other).Modified = False
    else:
        with ExitStack() as stack:
            for other in clean:
                for obj in other.Objects:
                    if obj.TypeId in ("App::Origin", "App::Line", "App::Plane"):
                        stack.enter_context(_unmarking(obj.ViewObject, "Size"))
            yield


@contextmanager
def _unmarking(owner: Any, name: str) -> Iterator[None]:
    """Keep a change of this property from marking the document as edited."""
    if name not in owner.PropertiesList:
        yield
        return
    owner.setPropertyStatus(name, "NoModify")
    try:
        yield
    finally:
        owner.setPropertyStatus(name, "-NoModify")
