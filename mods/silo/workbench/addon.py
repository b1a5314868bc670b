# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on while FreeCAD runs: what the commands and the pane's buttons ask for. Work is done elsewhere."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

from silo.bom.message import message
from silo.platform.spelling import one_path
from silo.workbench.freecad import host
from silo.workbench.gui import qt
from silo.workbench.pane.dock import ActivityDock
from silo.workbench.settings.preferences import GROUP, Preferences
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    from silo.outbox.report import Sent
    from silo.workbench.buttons import Buttons
    from silo.workbench.colleagues.announced import Newer
    from silo.workbench.commit.flow import CommitFlow
    from silo.workbench.documents.opened import Opened
    from silo.workbench.freecad.hooks import CommitHook
    from silo.workbench.freecad.silo_group import SiloGroup
    from silo.workbench.live_desk import LiveDesk
    from silo.workbench.preview.flow import PreviewFlow
    from silo.workbench.register.flow import RegisterFlow
    from silo.workbench.revisions.flow import RevisionFlow
    from silo.workbench.revisions.project import ProjectFlow
    from silo.workbench.session.session import Session
    from silo.workbench.session.state import PaneState


# FreeCAD's window comes first; no server is asked before it is open.
BEGIN_AFTER_MS = 1500
# What waits is looked at this often; each thing has its own, growing pause besides.
TICK_MS = 20_000
# Events may come by the hundred: the pane is drawn at most this often.
DRAW_MS = 60
# The project view looks at its files this long after a commit arrived.
REFRESH_MS = 1500
# What a commit needs and that a worker may import.
WITHOUT_WIDGETS = ("freecad.live", "live_desk", "commit.flow")


class AddOn:
    """One per FreeCAD. Made before its window stands, so what costs time is made when it is first needed.

    opened
        what each document was made from, observed since FreeCAD's start.
    """

    def __init__(self, opened: Opened) -> None:
        self.preferences = Preferences(host.parameters(GROUP))
        self.dock = ActivityDock(host.main_window(), lambda action: self.buttons.act(action))
        self.relay = qt.Relay(self._bug)
        self.opened = opened
        self._hook: CommitHook | None = None
        self._drawn: PaneState | None = None
        self._present: tuple[Any, tuple[str, ...]] = (None, ())
        self._window: Any = None
        self._refreshing = False
        self._signs: Any = None
        self._asked: frozenset[tuple[str, str]] = frozenset()
        self._timer: Any = None
        self._watch: Any = None

    # -- the session ------------------------------------------------------------------------------------

    def begin(self) -> None:
        """Continue the start after the window has opened."""
        from silo.workbench.freecad.modified import watch_edits

        watch_edits()
        qt.later(BEGIN_AFTER_MS, self._begin)

    def _begin(self) -> None:
        self.session.begin(live=self.preferences.flag("LiveActivity"))
        self.opened.begin(self.session.look)
        # The first commit should be as quick as the others: its modules are imported before. Only
        # what has no widgets comes from the worker, for the classes of those are made in the GUI thread.
        self.session.aside(
            message("Getting ready"),
            lambda _control: [import_module(f"silo.workbench.{name}") for name in WITHOUT_WIDGETS],
            done=lambda _modules: self._prepared(),
            failed=self._bug,
        )
        self._timer = qt.QtCore.QTimer()
        self._timer.timeout.connect(self.session.tick)
        self._timer.start(TICK_MS)
        qt.QtCore.QCoreApplication.instance().aboutToQuit.connect(self._end)
        from silo.workbench.gui.closing import CloseWatch

        self._watch = CloseWatch(host.main_window(), self._closing)
        from silo.workbench.revisions.dock import ProjectDock

        self.project = ProjectDock(host.main_window(), lambda: self.projects)
        self._find_foreign_commit()

    def _prepared(self) -> None:
        self._ask_team()
        self._guard_newer_files()

    def _ask_team(self) -> None:
        """Ask the server with which FreeCAD the team works, and say so if it is another one."""
        from silo.workbench.activity.team import of_team

        def told(wanted: str) -> None:
            if (entry := of_team(wanted, host.version())) is not None:
                self.session.add(entry)

        self.session.ask(
            translate("Silo", "Looking at the server"),
            lambda client, _control: client.ready().freecad,
            done=told,
            failed=lambda _error: None,  # any other request reports it
        )

    def _guard_newer_files(self) -> None:
        from silo.workbench.freecad.loss_guard import LossGuard
        from silo.workbench.gui.widgets import confirm

        def ask(title: str, text: str) -> bool:
            yes, no = translate("Silo", "Save over it"), translate("Silo", "Keep the newer file")
            return confirm(host.main_window(), title, text, yes, no)

        host.add_document_observer(LossGuard(lambda: self.session.outbox, self.session.add, ask))

    def _closing(self) -> None:
        """Save and hold what was committed, before FreeCAD's window closes its documents."""
        if "commits" in vars(self):
            self.commits.finish()

    def _end(self) -> None:
        from silo.workbench.gui.closing import wait_for_disk

        self.session.close(wait_for_disk)

    # Each is made when it is first needed, and so are its imports.

    @cached_property
    def session(self) -> Session:
        """Make the session, which does the work beside the GUI thread."""
        from silo.workbench.session.session import Session
        from silo.workbench.session.state import Listener
        from silo.workbench.settings.keyring import Keyring
        from silo.workbench.settings.server import read_known

        def drawing() -> list[str]:
            from silo.workbench.freecad.drawer import command

            return command()

        listener = Listener(shown=self._show_state, console=host.warning, sent=self._sent, bug=self._bug)
        preferences = read_known(self.preferences)
        return Session(self.relay.post, preferences, Keyring(), listener=listener, drawing=drawing)

    @cached_property
    def buttons(self) -> Buttons:
        """Make the object that does what the buttons of the pane say."""
        from silo.workbench.buttons import Buttons

        return Buttons(self)

    @cached_property
    def desk(self) -> LiveDesk:
        """Make the desk: FreeCAD as the flows see it."""
        from silo.workbench.live_desk import LiveDesk

        return LiveDesk(self.opened, lambda: self.preferences.flag("CountHardware"))

    @cached_property
    def commits(self) -> CommitFlow:
        """Make the commit flow."""
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
        """Make the flow that gets files from Silo."""
        from silo.workbench.revisions.flow import RevisionFlow

        return RevisionFlow(self.session, self.desk)

    @cached_property
    def projects(self) -> ProjectFlow:
        """Make the flow of the project view."""
        from silo.workbench.revisions.project import ProjectFlow

        return ProjectFlow(self.session, self.preferences, self.commits, self.desk, self.revisions)

    @cached_property
    def previews(self) -> PreviewFlow:
        """Make the flow of the previews."""
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
        """Make the observer that shows Silo's facts about components in the property editor."""
        from silo.workbench.freecad.silo_group import SiloGroup

        return SiloGroup()

    @cached_property
    def registrations(self) -> RegisterFlow:
        """Make the flow of the Register Parts dialogs."""
        from silo.workbench.register.flow import RegisterFlow

        return RegisterFlow(self.session, self.preferences, self.commits, self.desk)

    def settings_changed(self) -> None:
        """Use the settings of the saved preference page."""
        from silo.workbench.settings.server import read_known

        host.save_parameters()
        self.session.settings_changed(
            read_known(self.preferences), live=self.preferences.flag("LiveActivity")
        )
        self._ask_team()

    def _show_state(self, shown: PaneState) -> None:
        waits = self._drawn is None
        self._drawn = shown
        if waits:
            qt.later(DRAW_MS, self._draw)

    def _draw(self) -> None:
        shown, self._drawn = self._drawn, None
        if shown is not None:
            presence = self._presence(shown.newer) if shown.newer else ()
            self.dock.update_shown(replace(shown, presence=presence))
            self._draw_signs(shown)
            questions = shown.questions()
            if questions - self._asked:
                self.dock.show_and_raise()
            self._asked = questions

    def _draw_signs(self, shown: PaneState) -> None:
        """Draw the signs in status bar and tree that something needs an answer."""
        if self._signs is None:
            from silo.workbench.gui.tree_sign import TreeSign
            from silo.workbench.pane.status_sign import StatusSign

            window = host.main_window()
            self._signs = StatusSign(window, self.dock.show_and_raise), TreeSign(window)
        status, tree = self._signs
        status.draw(shown)
        held = {held.path: held.sentence for held in shown.held}
        docs = [*host.documents()]
        paths = {str(doc.Label): one_path(doc.FileName) for doc in docs if held and doc.FileName}
        why = {label: held[path] for label, path in paths.items() if path in held}
        tree.draw(why, {str(doc.Label) for doc in docs})

    def _presence(self, colleagues: Mapping[str, Newer]) -> tuple[str, ...]:
        """Say which open documents colleagues have committed since they were opened."""
        docs = [(doc, self.opened.of(doc).since) for doc in host.documents() if doc.FileName]
        # Finding the item of each document takes a while if there are hundreds.
        asked = (colleagues, [(doc.Name, since) for doc, since in docs])
        if asked != self._present[0]:
            from silo.workbench.pane.banner import presence_text

            texts = []
            for doc, since in docs:
                newer = self.session.newer_than(self.desk.identity(doc) or "", since)
                if newer is not None:
                    texts.append(presence_text(newer, str(doc.Label)))
            self._present = (asked, tuple(texts))
        return self._present[1]

    def _sent(self, sent: Sent) -> None:
        """React to a commit of this FreeCAD that arrived: refresh what shows it, and offer to register
        parts.
        """
        path = sent.entry.path
        if sent.resolved is not None:
            self.group.know(path, sent.resolved.entries)
        if "previews" in vars(self):
            self.previews.again(path)
        self._refresh_project()
        lacking = len(sent.resolved.unresolved) if sent.resolved is not None else 0
        if lacking and self.preferences.flag("AskRegister") and self.commits.was_asked_for(sent.entry.key):
            self.buttons.register(path)

    def _refresh_project(self) -> None:
        """Refresh the project view once for all commits that arrive together."""
        if not self._refreshing:
            self._refreshing = True
            qt.later(REFRESH_MS, self._refresh_now)

    def _refresh_now(self) -> None:
        self._refreshing = False
        self.project.refresh()

    def _bug(self, error: BaseException) -> None:
        host.error(
            plain(
                message("[Silo] unexpected problem: {name}: {error}", name=type(error).__name__, error=error),
                500,
            )
        )
        import traceback

        host.log("".join(traceback.format_exception(error)))

    # -- commands ---------------------------------------------------------------------------------------

    def has_document(self) -> bool:
        """Return True if a document is active, so that there is something to commit."""
        return host.active_document() is not None

    def shown_everywhere(self) -> bool:
        """Return True if Commit belongs in every workbench's File menu."""
        return self.preferences.flag("ShowEverywhere")

    def preference_page(self) -> Any:
        """Make the preference page of our own settings."""
        from silo.workbench.settings.page import PreferencePage

        return PreferencePage(self.preferences, self.session, self.settings_changed)

    def hook_commit(self, name: str) -> None:
        """Sync the BOM after this command, which is not ours."""
        if self._hook is None:
            from silo.workbench.freecad.hooks import CommitHook

            self._hook = CommitHook(
                host,
                ended=lambda doc: self.commits.sync_only(doc, by_fork=True),
                has_identity=self.commits.has_identity,
                later=qt.later,
            )
            host.main_window().workbenchActivated.connect(self._hook.connect)
        self._hook.watch(name)

    def _find_foreign_commit(self) -> None:
        """Connect to the commands of the Kindred workbench that upload a revision."""
        from silo.workbench.commands import COMMIT, commands
        from silo.workbench.freecad.hooks import FOREIGN

        ours = commands(self)[COMMIT].text
        for name in FOREIGN:
            title = host.command_info(name).get("menuText")
            if title is not None and title != ours:
                self.hook_commit(name)
        if self._hook is not None:
            self._hook.connect()

    def commit(self) -> None:
        """Commit the active document."""
        if self.has_document():
            self.dock.show_and_raise()
            self.commits.start(host.active_document())

    def preview(self) -> None:
        """Compare the active assembly with the server."""
        if self.has_document():
            self.previews.start(host.active_document())

    def register(self) -> None:
        """Show the components of the active document that have no part number."""
        if self.has_document():
            self.registrations.start(host.active_document())

    def mass(self) -> None:
        """Show the masses of the active assembly."""
        if self.has_document():
            from silo.workbench.mass.flow import MassFlow

            MassFlow(self.preferences.flag("CountHardware")).start(host.active_document())

    def open_from_silo(self) -> None:
        """Find an item and open its file."""
        from silo.workbench.revisions.dialog import OpenDialog

        folder = next(iter(self.projects.roots()), "")
        self._window = OpenDialog(self.revisions, host.main_window(), folder)
        self._window.show()

    def show_project(self) -> None:
        """Show the project view, up to date."""
        self.project.show_and_raise()
        self.project.refresh()

    def history(self) -> None:
        """Show the revisions of the active document."""
        from silo.workbench.revisions.dialog import HistoryDialog

        doc = host.active_document()
        if doc is None:
            return
        identity = self.desk.identity(doc)
        if not doc.FileName or not identity:
            name = plain(os.path.basename(doc.FileName) or doc.Label, 80)
            self.desk.warn(
                translate("Silo", "History"),
                translate("Silo", "{name} has no Silo part number yet. Register it first.", name=name),
            )
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
        from silo.workbench.settings.help import HelpWindow

        HelpWindow(host.main_window()).show()
