# SPDX-License-Identifier: LGPL-2.1-or-later
"""Opens the document of a file whole, without losing edits. FreeCAD's main thread only."""

from __future__ import annotations

from typing import Any

from silo.bom.message import message
from silo.workbench.freecad import host
from silo.workbench.freecad.modified import is_modified


def open_fully(path: str) -> Any:
    """Open the document of a file with all its objects, or complete it if it is open in part.

    FreeCAD completes a partly loaded document by closing and reading it again, so unsaved edits in it would
    be lost. In this case, and if the file cannot be read, it raises :class:`DocumentError`.
    """
    from silo.bom.errors import DocumentError

    document = host.find_document(path)
    if document is not None and not host.is_partial(document):
        return document
    if document is not None and is_modified(document):
        raise DocumentError(
            path,
            message(
                "FreeCAD has loaded it only in part and it has unsaved edits, which opening it would lose"
            ),
        )
    with host.same_active_document():
        try:
            return host.open_document(document.FileName if document is not None else path)
        except (OSError, RuntimeError) as problem:
            raise DocumentError(
                path, message("FreeCAD cannot open it: {problem}", problem=problem)
            ) from problem
