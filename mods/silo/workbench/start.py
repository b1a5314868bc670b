# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD's start runs (``InitGui.py``): announce commands, dock, workbench and preference page.

Nothing here talks to a server or imports what talks to one; that begins when the window stands. The whole
add-on may cost FreeCAD's start 50 ms.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
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
from silo.workbench.freecad.placement import place
from silo.workbench.gui import qt

RESOURCES = Path(__file__).parent / "resources"
PREFERENCE_GROUP = "Silo"
LOADING_MS = 30

TOOLBAR = (COMMIT, BOM, REGISTER, ACTIVITY)
MENU = (COMMIT, OPEN, HISTORY, BOM, REGISTER, MASS, ACTIVITY, SETTINGS, HELP)

# Kept for FreeCAD's whole run: its C++ side holds no reference to what Python hands over.
_kept: list[Any] = []


def start() -> None:
    """Make the add-on known to FreeCAD. A problem here costs the add-on, never FreeCAD's start."""
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
    qt.later(0, lambda: when_loaded(lambda: finish(addon, names)))


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
        return name


def when_loaded(call: Callable[[], None]) -> None:
    """Call once all add-ons are loaded. A timer alone is not enough: the splash screen lets timers pass."""
    if host.has_active_workbench():
        call()
    else:
        qt.later(LOADING_MS, lambda: when_loaded(call))


def finish(addon: AddOn, names: Names) -> None:
    """The rest, once all add-ons are loaded: one of them may have brought an ``Origin_Commit`` of its own."""
    placed = names.of([COMMIT, BOM])
    for name in names.foreign:
        if name in (COMMIT, OWN_COMMIT):
            # FreeCAD, or a fork of it, commits by itself: its command stays, its end is hooked.
            addon.hook_commit(name)
    _kept.append(place(placed, addon.shown_everywhere))
    # The menus and toolbars get the commands that are new.
    host.gui().activeWorkbench().reloadActive()
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
