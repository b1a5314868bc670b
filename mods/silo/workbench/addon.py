# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on while FreeCAD runs: what the commands and the pane's buttons ask for. Work is done elsewhere."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

from silo.workbench.commit.opened import Opened
from silo.workbench.freecad import host
from silo.workbench.gui import qt
from silo.workbench.pane.dock import ActivityDock
from silo.workbench.settings.preferences import GROUP, Preferences
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    from silo.outbox.send import Sent
    from silo.workbench.buttons import Buttons
    from silo.workbench.commit.flow import CommitFlow
    from silo.workbench.freecad.edits import CommitHook
    from silo.workbench.freecad.live_desk import LiveDesk, SiloGroup
    from silo.workbench.preview.flow import PreviewFlow
    from silo.workbench.register.flow import RegisterFlow
    from silo.workbench.revisions.flow import RevisionFlow
    from silo.workbench.session.session import Newer, Session, Shown

# FreeCAD's window comes first; a server is not talked to before it stands.
BEGIN_AFTER_MS = 1500
# What waits is looked at this often; each thing has its own, growing pause besides.
TICK_MS = 20_000
# Events may come by the hundred: the pane is drawn at most this often.
DRAW_MS = 60
# What a commit needs and that a worker may import.
WITHOUT_WIDGETS = ("freecad.live", "freecad.live_desk", "commit.flow")


class AddOn:
    """One per FreeCAD. Made at start, so everything that costs time is made when it is first needed."""

    def __init__(self) -> None:
        self.preferences = Preferences(host.parameters(GROUP))
        self.dock = ActivityDock(host.main_window(), lambda action: self.buttons.act(action))
        self.relay = qt.Relay(self._bug)
        # From the start: what a document was made from is known only when it is opened.
        self.opened = Opened(lambda: self.session.outbox)
        host.add_document_observer(self.opened)
        self._hook: CommitHook | None = None
        self._drawn: Shown | None = None
        self._present: tuple[Any, tuple[str, ...]] = (None, ())
        self._window: Any = None
        self._timer: Any = None
        self._watch: Any = None

    # -- the session ------------------------------------------------------------------------------------

    def begin(self) -> None:
        """Continue when the window stands."""
        from silo.workbench.freecad import saving

        saving.watch_edits()
        qt.later(BEGIN_AFTER_MS, self._begin)

    def _begin(self) -> None:
        self.session.begin(live=self.preferences.flag("LiveActivity"))
        self.opened.begin(self.session.look)
        # The first commit is to be as quick as the others: what it needs is imported while nobody waits. Only
        # what has no widgets comes from the worker, for the classes of those are made in the GUI thread.
        self.session.aside(
            "Getting ready",
            lambda _control: [import_module(f"silo.workbench.{name}") for name in WITHOUT_WIDGETS],
            done=lambda _modules: self._prepared(),
            failed=self._bug,
        )
        self._timer = qt.QtCore.QTimer()
        self._timer.timeout.connect(self.session.tick)
        self._timer.start(TICK_MS)
        qt.QtCore.QCoreApplication.instance().aboutToQuit.connect(self._end)
        from silo.workbench.gui.widgets import CloseWatch

        self._watch = CloseWatch(host.main_window(), self._closing)
        self._find_foreign_commit()

    def _prepared(self) -> None:
        self._ask_team()
        self._guard_newer_files()

    def _ask_team(self) -> None:
        """Say so if the team works with another FreeCAD."""
        from silo.workbench.pane.entries import of_team

        def told(wanted: str) -> None:
            if (entry := of_team(wanted, host.version())) is not None:
                self.session.add(entry)

        self.session.ask(
            translate("Silo", "Looking at the server"),
            lambda client, _control: client.ready().freecad,
            done=told,
            failed=lambda _error: None,  # whatever else is asked says it
        )

    def _guard_newer_files(self) -> None:
        from silo.workbench.freecad.live_desk import LossGuard
        from silo.workbench.gui.widgets import confirm

        def ask(title: str, text: str) -> bool:
            yes, no = translate("Silo", "Save over it"), translate("Silo", "Keep the newer file")
            return confirm(host.main_window(), title, text, yes, no)

        host.add_document_observer(LossGuard(lambda: self.session.outbox, self.session.add, ask))

    def _closing(self) -> None:
        """FreeCAD's window is asked to close: what was committed is saved and held before its documents
        go."""
        if "commits" in vars(self):
            self.commits.finish()

    def _end(self) -> None:
        from silo.workbench.gui.widgets import wait_for_disk

        self.session.close(wait_for_disk)

    # Each is made when it is first needed, and so are its imports.

    @cached_property
    def session(self) -> Session:
        """What works beside the GUI thread."""
        from silo.workbench.session.session import Listener, Session
        from silo.workbench.settings.server import Keyring, read_known

        listener = Listener(shown=self._shown, console=host.warning, sent=self._sent, bug=self._bug)
        return Session(self.relay.post, read_known(self.preferences), Keyring(), listener=listener)

    @cached_property
    def buttons(self) -> Buttons:
        """What the buttons of the pane do."""
        from silo.workbench.buttons import Buttons

        return Buttons(self)

    @cached_property
    def desk(self) -> LiveDesk:
        """FreeCAD as the flows see it."""
        from silo.workbench.freecad.live_desk import LiveDesk

        return LiveDesk(self.opened, lambda: self.preferences.flag("CountHardware"))

    @cached_property
    def commits(self) -> CommitFlow:
        """The commit flow."""
        from silo.workbench.commit.flow import CommitFlow

        return CommitFlow(
            self.session,
            self.preferences,
            self.desk,
            register=self.buttons.register,
            choose=lambda *wanted: self.revisions.choose(*wanted),
        )

    @cached_property
    def revisions(self) -> RevisionFlow:
        """Getting files from Silo."""
        from silo.workbench.revisions.flow import RevisionFlow

        return RevisionFlow(self.session, self.desk)

    @cached_property
    def previews(self) -> PreviewFlow:
        """The previews."""
        from silo.workbench.preview.flow import PreviewFlow

        return PreviewFlow(
            self.session,
            self.commits,
            self.desk,
            register=self.buttons.register,
            show=self.buttons.show_objects,
            view=self.buttons.open_page,
            known=self.group.know,
        )

    @cached_property
    def group(self) -> SiloGroup:
        """What the property editor shows of components."""
        from silo.workbench.freecad.live_desk import SiloGroup

        return SiloGroup()

    @cached_property
    def registrations(self) -> RegisterFlow:
        """The registering dialogs."""
        from silo.workbench.register.flow import RegisterFlow

        return RegisterFlow(self.session, self.preferences, self.commits, self.desk)

    def settings_changed(self) -> None:
        """The preference page was saved."""
        from silo.workbench.settings.server import read_known

        host.save_parameters()
        self.session.settings_changed(
            read_known(self.preferences), live=self.preferences.flag("LiveActivity")
        )
        self._ask_team()

    def _shown(self, shown: Shown) -> None:
        waits = self._drawn is None
        self._drawn = shown
        if waits:
            qt.later(DRAW_MS, self._draw)

    def _draw(self) -> None:
        shown, self._drawn = self._drawn, None
        if shown is not None:
            presence = self._presence(shown.newer) if shown.newer else ()
            self.dock.update_shown(replace(shown, presence=presence))

    def _presence(self, colleagues: Mapping[str, Newer]) -> tuple[str, ...]:
        """What colleagues committed of the documents that are open, since they were opened."""
        docs = [(doc, self.opened.of(doc).since) for doc in host.documents() if doc.FileName]
        # To find the item of each document takes a while where there are hundreds.
        asked = (colleagues, [(doc.Name, since) for doc, since in docs])
        if asked != self._present[0]:
            from silo.workbench.pane.waiting import presence_text

            found = []
            for doc, since in docs:
                newer = self.session.newer_than(self.desk.identity(doc) or "", since)
                if newer is not None:
                    found.append(presence_text(newer, str(doc.Label)))
            self._present = (asked, tuple(found))
        return self._present[1]

    def _sent(self, sent: Sent) -> None:
        """A commit of this FreeCAD arrived."""
        path = sent.entry.path
        if sent.resolved is not None:
            self.group.know(path, sent.resolved.entries)
        if "previews" in vars(self):
            self.previews.again(path)
        left = len(sent.resolved.unresolved) if sent.resolved is not None else 0
        if left and self.preferences.flag("AskRegister") and self.commits.was_asked_for(sent.entry.key):
            self.buttons.register(path)

    def _bug(self, error: BaseException) -> None:
        host.error(plain(f"[Silo] unexpected problem: {type(error).__name__}: {error}", 500))
        import traceback

        host.log("".join(traceback.format_exception(error)))

    # -- commands ---------------------------------------------------------------------------------------

    def has_document(self) -> bool:
        """True where there is something to commit."""
        return host.active_document() is not None

    def shown_everywhere(self) -> bool:
        """True where Commit belongs in every workbench's File menu."""
        return self.preferences.flag("ShowEverywhere")

    def preference_page(self) -> type:
        """What FreeCAD makes the preference page with; it wants a class, and calls it when the page opens."""
        addon = self

        class Page:
            def __new__(cls, _parent: object = None) -> Any:
                from silo.workbench.settings.page import PreferencePage

                return PreferencePage(addon.preferences, addon.session, addon.settings_changed)

        return Page

    def hook_commit(self, name: str) -> None:
        """Sync the BOM after this command, which is not ours."""
        if self._hook is None:
            from silo.workbench.freecad.edits import CommitHook

            self._hook = CommitHook(
                host,
                ended=lambda doc: self.commits.sync_only(doc, by_fork=True),
                has_identity=self.commits.has_identity,
                later=qt.later,
            )
            host.main_window().workbenchActivated.connect(self._hook.connect)
        self._hook.watch(name)

    def _find_foreign_commit(self) -> None:
        """The Kindred workbench has further commands that upload a revision; connect to what is there."""
        from silo.workbench.commands import COMMIT, commands
        from silo.workbench.freecad.edits import FOREIGN

        ours = commands(self)[COMMIT].text
        for name in FOREIGN:
            told = host.command_info(name).get("menuText")
            if told is not None and told != ours:
                self.hook_commit(name)
        if self._hook is not None:
            self._hook.connect()

    def commit(self) -> None:
        """Commit the active document."""
        doc = host.active_document()
        if doc is None:
            return
        self.dock.show_and_raise()
        self.commits.start(doc)

    def preview(self) -> None:
        """Compare the active assembly with the server."""
        doc = host.active_document()
        if doc is not None:
            self.previews.start(doc)

    def register(self) -> None:
        """Give part numbers to components."""
        doc = host.active_document()
        if doc is not None:
            self.registrations.start(doc)

    def mass(self) -> None:
        """Show the masses of the active assembly."""
        doc = host.active_document()
        if doc is not None:
            from silo.workbench.mass.flow import MassFlow

            MassFlow(self.preferences.flag("CountHardware")).start(doc)

    def open_from_silo(self) -> None:
        """Find an item and open its file."""
        from silo.files import Project
        from silo.workbench.revisions.dialog import OpenDialog

        active = host.active_document()
        several = [active, *host.documents()] if active is not None else host.documents()
        found = (Project.of(doc.FileName) for doc in several if doc.FileName)
        # The root of a project is marked, and never guessed from where a document lies.
        folder = next((project.root for project in found if project is not None), "")
        self._window = OpenDialog(self.revisions, host.main_window(), folder)
        self._window.show()

    def history(self) -> None:
        """The revisions of the active document."""
        from silo.workbench.revisions.dialog import HistoryDialog

        doc = host.active_document()
        if doc is None:
            return
        identity = self.desk.identity(doc)
        if not doc.FileName or not identity:
            name = plain(os.path.basename(doc.FileName) or doc.Label, 80)
            text = translate("Silo", "{name} has no Silo part number yet. Register it first.")
            self.desk.warn(translate("Silo", "History"), text.replace("{name}", name))
            return
        self._window = HistoryDialog(self.revisions, host.main_window(), doc.FileName)
        self._window.show()
        self.revisions.history(identity, self.opened.of(doc), self._window.fill, self._window.fail)

    def show_activity(self) -> None:
        """Show the pane."""
        self.dock.show_and_raise()

    def show_settings(self) -> None:
        """Open the preferences."""
        host.gui().showPreferences("Silo", 0)

    def show_help(self) -> None:
        """Show the add-on's page of the documentation."""
        from silo.workbench.gui.installing import HelpWindow

        HelpWindow(host.main_window()).show()
