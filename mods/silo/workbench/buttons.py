# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the buttons of the pane do: each action goes to the flow that it belongs to. GUI thread."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from silo.workbench.freecad import host
from silo.workbench.gui import qt
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    from collections.abc import Callable

    from silo.outbox.entry import Entry
    from silo.workbench.activity.box import Action, Do
    from silo.workbench.addon import AddOn


class Buttons:
    """One per FreeCAD."""

    def __init__(self, addon: AddOn) -> None:
        self._addon = addon

    def act(self, action: Action) -> None:
        """Do what a button of the pane asks for."""
        self._actions()[action.do](action)

    def _actions(self) -> dict[Do, Callable[[Action], object]]:
        from silo.workbench.activity.box import Do

        addon = self._addon
        return {
            Do.VIEW: lambda action: self.open_page(action.target),
            Do.SHOW: lambda action: self.show_objects(action.document, action.objects),
            Do.RETRY: self._retry,
            Do.OPEN_THEIRS: self._choose,
            Do.TAKE_THEIRS: self._choose,
            Do.COMPARE: self._compare,
            Do.SEND_HERE: lambda action: addon.session.send_here(map(int, action.target.split(","))),
            Do.SAVE_COPY: self._save_copy,
            Do.DISCARD: lambda action: addon.session.discard(int(action.target)),
            Do.DETAILS: self._details,
            Do.STOP: lambda _action: addon.session.cancel(),
            Do.PREVIEW: lambda action: self._with_document(action.document, addon.previews.start),
            Do.MEND: lambda action: self._with_opened(
                action.document, lambda doc: addon.previews.start(doc, mend=True)
            ),
            Do.SYNC_WITHOUT: lambda action: self._with_opened(
                action.document, lambda doc: addon.commits.sync_only(doc, allow_missing=True)
            ),
            Do.SAME: self._same_part,
            Do.REGISTER: lambda action: self.register(action.document),
            Do.DECIDE: lambda action: self.register(action.document),
            Do.SETTINGS: lambda _action: addon.show_settings(),
            Do.INSTALL: lambda _action: _install(),
        }

    def _retry(self, action: Action) -> None:
        if action.target:
            self._addon.session.retry(int(action.target))
        else:
            self._addon.session.retry_all()

    def _choose(self, action: Action) -> None:
        """Ask what to do about the colleague's revision for which a commit is held."""
        from silo.workbench.activity.box import Do
        from silo.workbench.colleagues.theirs import Choice, of_held

        choose, discard = self._addon.revisions.choose, self._addon.session.discard
        for held in self._held(action):
            if action.do is Do.OPEN_THEIRS:
                choose(held.path, of_held(held), Choice.OPEN)
            else:
                taken = partial(discard, held.id, keep=True)
                choose(held.path, of_held(held), Choice.TAKE, taken=taken)

    def _held(self, action: Action) -> list[Entry]:
        """Return the entry of the outbox that an action means; none if it is gone."""
        return [entry for entry in self._addon.session.shown.waiting if str(entry.id) == action.target]

    def _compare(self, action: Action) -> None:
        """Show the colleague's revision as a ghost beside the document whose commit is held."""
        from silo.workbench.colleagues.theirs import of_held

        for held in self._held(action):
            self._addon.revisions.compare(
                held.path,
                held.part_number,
                of_held(held).revision,
                qt.tell_at_pointer,
                self._addon.session.problem,
            )

    def _details(self, action: Action) -> None:
        """Show all lines of the BOM difference for which a commit is held."""
        from silo.workbench.colleagues.theirs import line_texts
        from silo.workbench.gui import widgets

        theirs = self._addon.session.shown.theirs.get(int(action.target))
        if theirs is not None:
            widgets.read(host.main_window(), theirs.headline, line_texts(theirs))

    def _same_part(self, action: Action) -> None:
        """Accept that these files are one part on purpose; the BOM is synced without the question."""
        commits = self._addon.commits
        commits.accept(action.target, action.objects)
        doc = host.find_document(action.document)
        if doc is not None:
            commits.sync_only(doc)

    def _save_copy(self, action: Action) -> None:
        """Ask for a place, and write the file of an entry that waits there."""
        target = qt.ask_where_to_save(host.main_window(), translate("Silo", "Save a copy"), action.document)
        if target:
            self._addon.session.save_copy(int(action.target), Path(target))

    def register(self, path: str) -> None:
        """Show the components of this document that have no part number, if it is open."""
        self._with_document(path, self._addon.registrations.start)

    def _with_document(self, path: str, call: Callable[[object], object]) -> None:
        doc = host.find_document(path)
        if doc is None:
            # The report view is often hidden.
            qt.tell_at_pointer(translate("Silo", "This document is not open any more."))
            host.warning(translate("Silo", "[Silo] This document is not open: ") + plain(path))
        else:
            call(doc)

    def _with_opened(self, path: str, call: Callable[[object], object]) -> None:
        """Do it with this document, which is opened if it is not."""
        from silo.bom.errors import SiloError

        if host.find_document(path) is None and os.path.isfile(path):
            try:
                self._addon.desk.open(path)
            except SiloError as error:
                self._addon.session.problem(error)
                return
        self._with_document(path, call)

    def open_page(self, url: str) -> None:
        """Open a page of the server in use; if no browser opens, put the address on the clipboard."""
        from silo.api.address import ServerAddress
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
        self._with_document(path, lambda doc: _told(self._addon.desk.light(doc, names)))


def _install() -> None:
    from silo import FREECAD_PACKAGES, OPTIONAL_PACKAGES
    from silo.workbench.settings.install import show_install

    show_install((*FREECAD_PACKAGES, *OPTIONAL_PACKAGES))


def _told(count: int) -> None:
    if not count:
        host.warning(translate("Silo", "[Silo] These objects are not in the document any more."))
    elif count > host.MOST_SELECTED:
        host.message(
            translate(
                "Silo", "[Silo] The first {n} of {all} objects are selected.", n=host.MOST_SELECTED, all=count
            )
        )
