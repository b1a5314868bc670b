# SPDX-License-Identifier: LGPL-2.1-or-later
"""Saving a live document.

No edit is lost and nothing is half written: what FreeCAD would silently not do is an error here. FreeCAD's
main thread only.
"""

from __future__ import annotations

import os
import shutil
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

from silo.bom.message import message
from silo.platform.stamp import stamp_of
from silo.workbench.freecad import host
from silo.workbench.freecad.damage import DAMAGED, damage
from silo.workbench.freecad.lost import refuse_loss
from silo.workbench.freecad.modified import is_modified, others_unmarked


def save(doc: Any, *, mark_parents: bool = False) -> None:
    """Save a document to its file; :class:`DocumentError` unless the file was really written.

    mark_parents
        let FreeCAD mark the documents that link to this one; the caller saves them as well.
    """
    from silo.bom.errors import DocumentError

    path = doc.FileName
    if not path:
        raise DocumentError(doc.Label, message("it has never been saved; save it under a name first"))
    if host.is_partial(doc):
        raise DocumentError(path, message("FreeCAD has loaded it only in part and cannot save it"))
    if not is_writable(path):
        raise DocumentError(path, message("the file is read-only"))
    if (damaged := damage(path)) is not None:
        raise DocumentError(path, message("{reason}; {damaged}", reason=damaged.reason, damaged=DAMAGED))
    refuse_loss(doc)
    before = stamp_of(path)
    try:
        with nullcontext() if mark_parents else others_unmarked(doc):
            _save(doc)
    except (OSError, RuntimeError) as problem:
        raise DocumentError(
            path, message("FreeCAD could not save it: {problem}", problem=problem)
        ) from problem
    if stamp_of(path) == before:
        raise DocumentError(path, message("FreeCAD did not write the file; its report view says why"))


def _save(doc: Any) -> None:
    view = host.view_of(doc) if host.has_gui() else None
    if view is None:
        doc.save()
    elif host.version() >= (0, 21):
        doc.save()
        view.Modified = False
    elif not view.Modified:
        doc.save()
    else:
        # In 0.20 only FreeCAD's own save takes the mark of unsaved edits away.
        from silo.workbench.gui.save_in_view import save_in_view

        save_in_view(doc)


def save_copy(doc: Any, path: Path) -> None:
    """Write a document, with its unsaved edits, to another file. DocumentError unless that was written.

    A document that FreeCAD has loaded only in part cannot be written; its file is copied.
    """
    from silo.bom.errors import DocumentError

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if host.is_partial(doc):
            shutil.copy2(doc.FileName, path)
        else:
            doc.saveCopy(str(path))
    except (OSError, RuntimeError) as problem:
        raise DocumentError(
            str(path), message("no copy could be kept: {problem}", problem=problem)
        ) from problem
    if not path.is_file():
        raise DocumentError(str(path), message("FreeCAD wrote no copy; its report view says why"))


def save_marked(doc: Any) -> None:
    """Save a document that FreeCAD marked because something below it was saved, if that is possible."""
    from silo.bom.errors import DocumentError

    if is_modified(doc) and not host.is_partial(doc):
        # If it cannot be saved, FreeCAD's mark is right.
        with suppress(DocumentError):
            save(doc, mark_parents=True)


def is_writable(path: str) -> bool:
    """Return True if the file may be replaced; a file marked read-only may not."""
    folder = os.path.dirname(path) or "."
    if not os.path.exists(path):
        return os.access(folder, os.W_OK)
    marked = not os.stat(path).st_mode & 0o222
    return os.access(path, os.W_OK) and os.access(folder, os.W_OK) and not marked
