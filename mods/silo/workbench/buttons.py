# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the buttons of the pane do: each action goes to the flow that it belongs to. GUI thread."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from silo.workbench.freecad import host
from silo.workbench.gui import qt
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    from collections.abc import Callable

    from silo.workbench.addon import AddOn
    from silo.workbench.pane.activity import Action, Do


class Buttons:
    """One per FreeCAD."""

    def __init__(self, addon: AddOn) -> None:
        self._addon = addon

    def act(self, action: Action) -> None:
        """Do what a button of the pane asks for."""
        self._actions()[action.do](action)

    def _actions(self) -> dict[Do, Callable[[Action], object]]:
        from silo.workbench.pane.activity import Do

        addon = self._addon
        return {
            Do.VIEW: lambda action: self.open_page(action.target),
            Do.SHOW: lambda action: self.show_objects(action.document, action.objects),
            Do.RETRY: self._retry,
            Do.OPEN_THEIRS: self._choose,
            Do.TAKE_THEIRS: self._choose,
            Do.SEND_HERE: lambda action: addon.session.send_here(map(int, action.target.split(","))),
            Do.SAVE_COPY: self._save_copy,
            Do.DISCARD: lambda action: addon.session.discard(int(action.target)),
            Do.DETAILS: self._details,
            Do.STOP: lambda _action: addon.session.cancel(),
            Do.PREVIEW: lambda action: self._with_document(action.document, addon.previews.start),
            Do.MEND: lambda action: self._with_document(
                action.document, lambda doc: addon.previews.start(doc, mend=True)
            ),
            Do.SYNC_WITHOUT: lambda action: self._with_document(
                action.document, lambda doc: addon.commits.sync_only(doc, allow_missing=True)
            ),
            Do.SAME: self._same_part,
            Do.REGISTER: lambda action: self.register(action.document),
            Do.DECIDE: lambda action: self.register(action.document),
            Do.SETTINGS: lambda _action: addon.show_settings(),
        }

    def _retry(self, action: Action) -> None:
        if action.target:
            self._addon.session.retry(int(action.target))
        else:
            self._addon.session.retry_all()

    def _choose(self, action: Action) -> None:
        """What to do about the colleague's revision for which a commit is held."""
        from silo.workbench.commit.flow import Choice, of_held
        from silo.workbench.pane.activity import Do

        session, entry_id = self._addon.session, int(action.target)
        held = next((entry for entry in session.shown.waiting if entry.id == entry_id), None)
        if held is None:
            return
        if action.do is Do.OPEN_THEIRS:
            self._addon.revisions.choose(held.path, of_held(held), Choice.OPEN)
        else:
            self._addon.revisions.choose(
                held.path, of_held(held), Choice.TAKE, taken=lambda: session.discard(entry_id, keep=True)
            )

    def _details(self, action: Action) -> None:
        """All lines of the BOM difference for which a commit is held."""
        from silo.workbench.commit.flow import line_texts
        from silo.workbench.gui import widgets

        theirs = self._addon.session.shown.theirs.get(int(action.target))
        if theirs is not None:
            widgets.read(host.main_window(), theirs.headline, line_texts(theirs))

    def _same_part(self, action: Action) -> None:
        """These files are one part on purpose; the BOM is synced without the question."""
        commits = self._addon.commits
        commits.accept(action.target, action.objects)
        doc = host.find_document(action.document)
        if doc is not None:
            commits.sync_only(doc)

    def _save_copy(self, action: Action) -> None:
        """Ask where to, and write the file of something that waits."""
        target = qt.ask_where_to_save(host.main_window(), translate("Silo", "Save a copy"), action.document)
        if target:
            self._addon.session.save_copy(int(action.target), Path(target))

    def register(self, path: str) -> None:
        """Give part numbers to the components of this document, where it is open."""
        self._with_document(path, self._addon.registrations.start)

    def _with_document(self, path: str, call: Callable[[object], object]) -> None:
        doc = host.find_document(path)
        if doc is None:
            # The report view is often hidden.
            qt.tell_at_pointer(translate("Silo", "This document is not open any more."))
            host.warning(translate("Silo", "[Silo] This document is not open: ") + plain(path))
        else:
            call(doc)

    def open_page(self, url: str) -> None:
        """Open a page of the server in use; where no browser opens, the address is on the clipboard."""
        from silo.api.config import ServerAddress
        from silo.bom.errors import SiloError

        try:
            # A box may be older than the settings.
            page = ServerAddress.parse(self._addon.session.shown.server.url).web(url)
        except SiloError:
            text = translate("Silo", "[Silo] Not opened, for it is not on the Silo server in use: ")
            host.warning(text + plain(url, 300))
            return
        if not qt.open_url(page):
            qt.copy(page)
            qt.tell_at_pointer(translate("Silo", "No browser could be opened. The address was copied."))
            text = translate("Silo", "[Silo] No browser could be opened; the address was copied: ")
            host.message(text + page)

    def show_objects(self, path: str, names: tuple[str, ...]) -> None:
        """Select objects of a document in the 3D view and the tree."""
        self._with_document(path, lambda doc: _select(doc, names))


def _select(doc: object, names: tuple[str, ...]) -> None:
    found = host.select(doc, names)
    if not found:
        host.warning(translate("Silo", "[Silo] These objects are not in the document any more."))
    elif found > host.MOST_SELECTED:
        text = translate("Silo", "[Silo] The first {n} of {all} objects are selected.")
        host.message(text.replace("{n}", str(host.MOST_SELECTED)).replace("{all}", str(found)))
