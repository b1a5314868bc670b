# SPDX-License-Identifier: LGPL-2.1-or-later
"""A guard over saving: nothing of a newer FreeCAD's file is lost without a question. GUI thread."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.errors import SiloError
from silo.bom.walk.document import saved_by
from silo.outbox.store import KEPT_ASIDE_DAYS
from silo.platform.whole_files import replacing
from silo.workbench.activity.box import PaneEntry, own_box
from silo.workbench.freecad import host
from silo.workbench.freecad.lost import lost_objects
from silo.workbench.freecad.modified import mark_modified
from silo.workbench.gui import qt
from silo.workbench.tone import Tone
from silo.workbench.words import filled, plain, translate

if TYPE_CHECKING:
    from silo.outbox.store import Store


class LossGuard:
    """A document observer: nothing of a newer FreeCAD's file is lost without a question.

    A save in FreeCAD cannot be stopped. So the newer file is kept before it, and if the user says so it is
    put back after it; then the document has edits that are not on disk, and what was saved is kept aside.

    outbox
        gives the store, which keeps copies.
    add
        shows a box in the pane.
    ask
        True where the person wants to save over the newer file: title and text.
    """

    def __init__(
        self, outbox: Callable[[], Store], add: Callable[[PaneEntry], None], ask: Callable[[str, str], bool]
    ) -> None:
        self._outbox, self._add, self._ask = outbox, add, ask
        self._put_back: dict[str, Path] = {}
        for doc in host.documents():
            self._opened(doc.Name)

    # FreeCAD calls these; an exception in them would only be printed.

    def slotChangedDocument(self, doc: Any, prop: str) -> None:
        """Look at the file: FreeCAD sets its name before it reads it, and later knows what it could not
        load.
        """
        if prop == "FileName" and doc.FileName:
            name = doc.Name
            qt.later(0, lambda: self._opened(name))

    def _opened(self, name: str) -> None:
        doc = next((document for document in host.documents() if document.Name == name), None)
        if doc is not None and (lost := lost_objects(doc)):
            text = translate(
                "Silo", "This FreeCAD {here} does not know these objects, nor load them: {lost}."
            )
            advice = translate("Silo", "Saving the file here would remove them from it: change it there.")
            self._tell(doc, _words(text, doc, lost), advice)

    def slotStartSaveDocument(self, doc: Any, filename: str) -> None:
        """Look at the file before it is replaced."""
        if os.path.realpath(filename) != os.path.realpath(doc.FileName or ""):
            return
        if not (lost := lost_objects(doc)):
            return
        try:
            kept = self._outbox().keep_aside(doc.FileName)
        except SiloError as error:
            kept = None
            self._tell(doc, str(error))
        question = translate(
            "Silo",
            "{name} was saved by FreeCAD {there}. This FreeCAD {here} does not know, and would remove from "
            "the file: {lost}.",
        )
        if kept is None or self._ask(translate("Silo", "Newer file"), _words(question, doc, lost)):
            text = translate("Silo", "Saved over the newer file, without {lost}.")
            where = translate("Silo", "The newer file is kept for {n} days at {path}")
            self._tell(doc, _words(text, doc, lost), *([_kept_words(where, kept)] if kept else []))
        else:
            self._put_back[doc.Name] = kept

    def slotFinishSaveDocument(self, doc: Any, _filename: str) -> None:
        """Put the newer file back, if the person wants to keep it."""
        if (newer := self._put_back.pop(doc.Name, None)) is None:
            return
        path, name = doc.FileName, doc.Name
        mine = self._outbox().keep_aside(path)
        with newer.open("rb") as read, replacing(path, mode=0o644) as write:
            shutil.copyfileobj(read, write)
        where = translate("Silo", "What you saved is kept for {n} days at {path}")
        self._tell(
            doc, translate("Silo", "The newer file was kept."), *([_kept_words(where, mine)] if mine else [])
        )
        qt.later(0, lambda: mark_modified(name))  # FreeCAD takes the mark away after this

    def _tell(self, doc: Any, *lines: str) -> None:
        title = translate("Silo", "Made by a newer FreeCAD: {name}", name=os.path.basename(doc.FileName))
        self._add(own_box(f"newer-freecad:{doc.FileName}", title, *lines, tone=Tone.WARNING))


def _words(text: str, doc: Any, lost: list[str]) -> str:
    here = "{}.{}".format(*host.version())
    by = ".".join(map(str, saved_by(doc.getProgramVersion()))) or "?"
    name = os.path.basename(doc.FileName)
    return filled(text, name=name, here=here, there=by, lost=plain(", ".join(lost), 300))


def _kept_words(text: str, path: Path) -> str:
    return filled(text, n=KEPT_ASIDE_DAYS, path=path)
