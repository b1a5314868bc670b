# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which documents have no edits since we saved them, where FreeCAD itself cannot tell.

In FreeCAD 0.20 the mark of unsaved edits goes away by its own save command only, and that command cannot save
a document that has no window (it saves another one instead; measured). Such documents are saved without the
command and remembered here, until one of FreeCAD's notices says that they changed.
"""

from __future__ import annotations

from typing import Any


class SavedMarks:
    """A document observer. ``names`` are the documents that are as they were saved."""

    def __init__(self) -> None:
        self.names: set[str] = set()

    def saved(self, doc: Any) -> None:
        """A document has just been saved."""
        self.names.add(doc.Name)

    def is_clean(self, doc: Any) -> bool:
        """True where nothing changed since."""
        return doc.Name in self.names

    def _touched(self, doc: Any) -> None:
        self.names.discard(doc.Name)

    # FreeCAD calls these; an exception in them would only be printed.

    def slotChangedDocument(self, doc: Any, _property: str) -> None:
        """A property of the document."""
        self._touched(doc)

    def slotDeletedDocument(self, doc: Any) -> None:
        """Another one may get its name."""
        self._touched(doc)

    def slotChangedObject(self, obj: Any, _property: str) -> None:
        """A property of an object."""
        self._touched(obj.Document)

    def slotCreatedObject(self, obj: Any) -> None:
        """A new object."""
        self._touched(obj.Document)

    def slotDeletedObject(self, obj: Any) -> None:
        """An object less."""
        self._touched(obj.Document)
