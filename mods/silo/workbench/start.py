# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD's start runs (``InitGui.py``): announce commands, dock, workbench and preference page.

Nothing here talks to a server or imports what talks to one; that begins when the window stands. The whole
add-on may cost FreeCAD's start 50 ms.

Commit where people save: in the File menu and the File toolbar of every workbench.

FreeCAD >= 0.21 has workbench manipulators for that. In 0.20 the entries are put in place by hand after each
change of the workbench, since FreeCAD rebuilds its menus then.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from silo.workbench import dependencies, words
from silo.workbench.addon import AddOn
from silo.workbench.commands import (
    ACTIVITY,
    BOM,
    COMMIT,
    FALLBACK,
    HELP,
    HISTORY,
    INSTALL,
    MASS,
    OPEN,
    OWN_COMMIT,
    REGISTER,
    SETTINGS,
    Command,
    commands,
)
from silo.workbench.freecad import host
from silo.workbench.gui import qt
from silo.workbench.gui.qt import QtGui, QtWidgets

AFTER = "Std_Save"
PLACED = (COMMIT, BOM)


class Manipulator:
    """Asked by FreeCAD whenever it builds the menus and toolbars of a workbench."""

    def __init__(self, names: Callable[[], list[str]], wanted: Callable[[], bool]) -> None:
        self._names, self._wanted = names, wanted

    def modifyMenuBar(self) -> list[dict[str, str]]:
        """Insert after Save; the last one inserted stands first."""
        if not self._wanted():
            return []
        return [{"insert": name, "menuItem": AFTER, "after": ""} for name in reversed(self._names())]

    def modifyToolBars(self) -> list[dict[str, str]]:
        """Append the commit to the File toolbar."""
        return [{"append": name, "toolBar": "File"} for name in self._names()[:1]] if self._wanted() else []


class ByHand:
    """The same for FreeCAD 0.20, with actions of our own that run the commands."""

    def __init__(self, names: list[str], wanted: Callable[[], bool]) -> None:
        self._names, self._wanted = names, wanted
        self._actions: dict[str, Any] = {}

    def put(self, _workbench: str = "") -> None:
        """Put the entries in place where they are not."""
        if not self._wanted():
            return
        window = host.main_window()
        for menu in window.menuBar().findChildren(QtWidgets.QMenu):
            actions = menu.actions()
            place = next((i for i, a in enumerate(actions) if a.data() == AFTER), None)
            if place is not None and not any(a in actions for a in self._actions.values()):
                before = actions[place + 1] if place + 1 < len(actions) else None
                for name in self._names:
                    menu.insertAction(before, self._action(name))
        bar = window.findChild(QtWidgets.QToolBar, "File")
        if bar is not None and self._names and self._action(self._names[0]) not in bar.actions():
            bar.addAction(self._action(self._names[0]))

    def _action(self, name: str) -> Any:
        if name not in self._actions:
            info = host.command_info(name)
            text, tip = (words.of_command(name, info.get(key, "")) for key in ("menuText", "toolTip"))
            action = QtGui.QAction(text or name, host.main_window())
            action.setObjectName(name)
            action.setToolTip(tip)
            icon = host.icon(info.get("pixmap", ""))
            if icon is not None:
                action.setIcon(icon)
            action.triggered.connect(lambda _checked=False, name=name: host.run_command(name))
            self._actions[name] = action
        return self._actions[name]


RESOURCES = Path(__file__).parent / "resources"
PREFERENCE_GROUP = "Silo"
LOADING_MS = 30

TOOLBAR = (COMMIT, BOM, REGISTER, ACTIVITY)
MENU = (COMMIT, OPEN, HISTORY, BOM, REGISTER, MASS, ACTIVITY, SETTINGS, HELP)

# Kept for FreeCAD's whole run: its C++ side holds no reference to what Python hands over.
_kept: list[Any] = []


def start() -> None:
    """Make the add-on known to FreeCAD, once. A problem here costs the add-on, never FreeCAD's start."""
    if _kept:
        _report_copies()
        return
    _kept.append(start)
    words.use(host.translate)
    host.add_resources(str(RESOURCES / "icons"), str(RESOURCES / "translations"))
    if missing := dependencies.missing():
        from silo.workbench.gui.installing import stub_commands

        host.error(dependencies.sentence(missing, host.packages_folder(), sys.version_info[:2]))
        host.gui().addWorkbench(silo_workbench(Names(stub_commands(missing)), [INSTALL], [INSTALL]))
        return
    addon = AddOn()
    names = Names(commands(addon))
    host.gui().addWorkbench(silo_workbench(names, TOOLBAR, MENU))
    host.gui().addPreferencePage(addon.preference_page(), PREFERENCE_GROUP)
    _kept.append(addon)
    # FreeCAD asks it first when the first workbench starts; all add-ons are loaded then.
    manipulator = Manipulator(lambda: names.of(PLACED), addon.shown_everywhere)
    by_hand = not host.add_workbench_manipulator(manipulator)
    _kept.append(manipulator)
    qt.later(0, lambda: when_loaded(lambda: finish(addon, names, by_hand=by_hand)))


def _report_copies() -> None:
    """Report that FreeCAD starts the add-on from several folders; the first one works."""
    places = Path(host.user_data_folder(), "Mod").glob("*/mods/silo/workbench/start.py")
    folders = ", ".join(sorted(str(place.parents[3]) for place in places))
    text = words.translate(
        "Silo", "Silo is installed more than once: {folders}. Only {used} is used; remove the others."
    )
    host.error(text.replace("{folders}", folders).replace("{used}", str(Path(__file__).parents[3])))


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
        """The names of these commands; adds them all, the first time."""
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
            command = replace(command, text=text, tip=tip, help=more)
        return name


def when_loaded(call: Callable[[], None]) -> None:
    """Call once all add-ons are loaded. A timer alone is not enough: the splash screen lets timers pass."""
    if host.has_active_workbench():
        call()
    else:
        qt.later(LOADING_MS, lambda: when_loaded(call))


def finish(addon: AddOn, names: Names, *, by_hand: bool) -> None:
    """The rest, once all add-ons are loaded: one of them may have brought an ``Origin_Commit`` of its own."""
    placed = names.of(PLACED)
    for name in names.foreign:
        if name in (COMMIT, OWN_COMMIT):
            # FreeCAD, or a fork of it, commits by itself: its command stays, its end is hooked.
            addon.hook_commit(name)
    if by_hand:
        hand = ByHand(placed, addon.shown_everywhere)
        _kept.append(hand)
        host.main_window().workbenchActivated.connect(hand.put)
        # A reloaded workbench is not activated anew, so it sends no signal.
        qt.later(0, hand.put)
    # Our own menus get the commands that are new; the toolbars of another workbench are not ours to reset.
    workbench = host.gui().activeWorkbench()
    if workbench.name() == "SiloModWorkbench":
        workbench.reloadActive()
    addon.begin()


def silo_workbench(names: Names, toolbar: Sequence[str], menu: Sequence[str]) -> Any:
    """The Silo workbench: a toolbar and a menu with all commands.

    FreeCAD knows it by the name of its class, and the real Silo's is called SiloWorkbench.
    """

    class SiloModWorkbench(host.gui().Workbench):  # type: ignore[misc]  # FreeCAD has no types
        MenuText = words.translate("Silo", "Silo")
        ToolTip = words.translate("Silo", "Keep the BOM of an assembly in step with Silo")
        Icon = str(RESOURCES / "icons" / "silo.svg")

        def Initialize(self) -> None:
            self.appendToolbar("Silo", names.of(toolbar))
            self.appendMenu("&Silo", names.of(menu))

        def GetClassName(self) -> str:
            return "Gui::PythonWorkbench"

    return SiloModWorkbench()
