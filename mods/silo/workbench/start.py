# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD's start runs (``InitGui.py``): announce commands, dock, workbench and preference page.

Nothing here talks to a server or imports what talks to one; that begins when the window stands. The whole
add-on may cost FreeCAD's start 50 ms.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.workbench import words
from silo.workbench.commands import (
    ACTIVITY,
    BOM,
    COMMIT,
    HELP,
    HISTORY,
    INSTALL,
    MASS,
    OPEN,
    PROJECT,
    REGISTER,
    SETTINGS,
    Command,
    commands,
)
from silo.workbench.documents.opened import Opened
from silo.workbench.freecad import host
from silo.workbench.gui import qt
from silo.workbench.packages import missing_packages, packages_hint
from silo.workbench.save_menu import ByHand, Manipulator

if TYPE_CHECKING:
    from silo.workbench.addon import AddOn

# If FreeCAD, or a fork of it, has its own Origin_Commit, it is left alone and hooked; ours for
# committing by hand then has this name.
OWN_COMMIT = "Silo_Commit"
# The real Silo's workbench has a Silo_BOM and a Silo_Settings too. If a name is taken, ours is this.
FALLBACK = "SiloMod_{}"


PLACED = (COMMIT, BOM)


RESOURCES = Path(__file__).parent / "resources"
PREFERENCE_GROUP = "Silo"
LOADING_MS = 30

TOOLBAR = (COMMIT, BOM, REGISTER, ACTIVITY)
MENU = (COMMIT, PROJECT, OPEN, HISTORY, BOM, REGISTER, MASS, ACTIVITY, SETTINGS, HELP)

# Kept for FreeCAD's whole run: its C++ side holds no reference to what Python hands over.
_kept: list[Any] = []


def start() -> None:
    """Make the add-on known to FreeCAD, once. A problem here stops the add-on, but never FreeCAD."""
    if _kept:
        _report_copies()
        return
    _kept.append(start)
    words.use(host.translate)
    host.add_resources(RESOURCES)
    if missing := missing_packages():
        from silo.workbench.settings.install import InstallDock, stub_commands

        host.error(packages_hint(missing, host.packages_folder(), sys.version_info[:2]))
        host.gui().addWorkbench(silo_workbench(Names(stub_commands(missing)), [INSTALL], [INSTALL]))
        _kept.append(InstallDock(host.main_window(), missing))
        return
    late = Late()
    names = Names(commands(late))
    host.gui().addWorkbench(silo_workbench(names, TOOLBAR, MENU))
    host.gui().addPreferencePage(late.preference_page(), PREFERENCE_GROUP)
    _kept.append(late)
    # FreeCAD asks it first when the first workbench starts; all add-ons are loaded then.
    manipulator = Manipulator(lambda: names.of(PLACED), late.shown_everywhere)
    by_hand = not host.add_workbench_manipulator(manipulator)
    _kept.append(manipulator)
    qt.later(0, lambda: when_loaded(lambda: finish(late.addon, names, by_hand=by_hand)))


class Late:
    """The add-on, imported and made when FreeCAD has loaded all add-ons, or asks for it."""

    def __init__(self) -> None:
        self._addon: AddOn | None = None
        # From the start: what a document was made from is known only when it is opened.
        self._opened = Opened(lambda: self.addon.session.outbox)
        host.add_document_observer(self._opened)

    @property
    def addon(self) -> AddOn:
        """Return the add-on; it is made at the first use."""
        if self._addon is None:
            from silo.workbench.addon import AddOn

            self._addon = AddOn(self._opened)
        return self._addon

    def __getattr__(self, name: str) -> Callable[[], Any]:
        return lambda: getattr(self.addon, name)()

    def preference_page(self) -> type:
        """Make the class that FreeCAD calls for the preference page when the page opens."""
        late = self

        class Page:
            def __new__(cls, _parent: object = None) -> Any:
                return late.addon.preference_page()

        return Page


def _report_copies() -> None:
    """Report that FreeCAD starts the add-on from several folders; the first one works."""
    places = Path(host.user_data_folder(), "Mod").glob("*/mods/silo/workbench/start.py")
    folders = ", ".join(sorted(str(place.parents[3]) for place in places))
    text = words.translate(
        "Silo",
        "Silo is installed more than once: {folders}. Only {used} is used; remove the others.",
        folders=folders,
        used=Path(__file__).parents[3],
    )
    host.error(text)


class Names:
    """Our commands, and the names that they got.

    They are added once all add-ons are loaded: where another one has a command of the same name, both are
    there. FreeCAD 0.20 would replace the first of them, later ones would drop the second, both silently.
    """

    def __init__(self, known: dict[str, Command]) -> None:
        self._known = known
        self._got: dict[str, str] = {}
        self.foreign: list[str] = []

    def of(self, wanted: Sequence[str]) -> list[str]:
        """Return FreeCAD's names of these commands; adds all commands to FreeCAD the first time."""
        if not self._got:
            self._got = {name: self._add(name, command) for name, command in self._known.items()}
        return [self._got[name] for name in wanted]

    def _add(self, name: str, command: Command) -> str:
        own: tuple[str, ...] = (OWN_COMMIT,) if name == COMMIT else ()
        for candidate in (name, *own, FALLBACK.format(name.partition("_")[2])):
            if host.add_command(candidate, command):
                return candidate
            self.foreign.append(candidate)
            # FreeCAD looks for texts under the name that the command got.
            text, tip, more = (
                words.of_command(name, one) for one in (command.text, command.tip, command.help)
            )
            command = Command(text, tip, command.icon, command.run, command.keys, more, command.active)
        return name


def when_loaded(call: Callable[[], None]) -> None:
    """Call after all add-ons are loaded. A timer alone is not enough: the splash screen lets timers run."""
    if host.has_active_workbench():
        call()
    else:
        qt.later(LOADING_MS, lambda: when_loaded(call))


def finish(addon: AddOn, names: Names, *, by_hand: bool) -> None:
    """Finish the start once all add-ons are loaded: one of them may have its own ``Origin_Commit``."""
    placed = names.of(PLACED)
    for name in names.foreign:
        if name in (COMMIT, OWN_COMMIT):
            # FreeCAD, or a fork of it, commits by itself: its command stays, its end is hooked.
            addon.hook_commit(name)
    if by_hand:
        hand = ByHand(placed, addon.shown_everywhere)
        _kept.append(hand)
        host.main_window().workbenchActivated.connect(hand.put)
        # A reloaded workbench is not activated again, so it sends no signal.
        qt.later(0, hand.put)
    # Our own menus get the commands that are new; the toolbars of another workbench are not ours to reset.
    workbench = host.gui().activeWorkbench()
    if workbench.name() == "SiloModWorkbench":
        workbench.reloadActive()
    addon.begin()


def silo_workbench(names: Names, toolbar: Sequence[str], menu: Sequence[str]) -> Any:
    """Make the Silo workbench: a toolbar and a menu with all commands.

    FreeCAD knows a workbench by the name of its class; the real Silo's is called SiloWorkbench.
    """

    class SiloModWorkbench(host.gui().Workbench):  # type: ignore[misc]  # FreeCAD has no types
        MenuText = words.translate("Silo", "Silo")
        ToolTip = words.translate("Silo", "Keep the BOM of an assembly in step with Silo")
        Icon = str(RESOURCES / "icons/silo.svg")

        def Initialize(self) -> None:
            self.appendToolbar("Silo", names.of(toolbar))
            self.appendMenu("&Silo", names.of(menu))

        def GetClassName(self) -> str:
            return "Gui::PythonWorkbench"

    return SiloModWorkbench()
