# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD's start runs (``InitGui.py``): announce commands, dock, workbench and preference page.

Nothing here talks to a server or imports what talks to one; that begins when the window stands. The whole
add-on may cost FreeCAD's start 50 ms.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from silo.workbench import dependencies, words
from silo.workbench.addon import AddOn
from silo.workbench.commands import (
    ACTIVITY,
    BOM,
    COMMIT,
    MASS,
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

# Kept for FreeCAD's whole run: its C++ side holds no reference to what Python hands over.
_kept: list[Any] = []


def start() -> None:
    """Make the add-on known to FreeCAD. A problem here costs the add-on, never FreeCAD's start."""
    words.use(host.translate)
    host.add_resources(str(RESOURCES / "icons"), str(RESOURCES / "translations"))
    if missing := dependencies.missing():
        host.error(dependencies.sentence(missing, host.packages_folder(), sys.version_info[:2]))
        return
    addon = AddOn()
    known = commands(addon)
    for name in (BOM, REGISTER, MASS, ACTIVITY, SETTINGS):
        host.add_command(name, known[name])
    host.add_workbench(silo_workbench())
    host.add_preference_page(addon.preference_page(), PREFERENCE_GROUP)
    _kept.append(addon)
    qt.later(0, lambda: when_loaded(lambda: finish(addon, known)))


def when_loaded(call: Callable[[], None]) -> None:
    """Call once all add-ons are loaded. A timer alone does not tell: the splash screen lets timers pass."""
    if host.has_active_workbench():
        call()
    else:
        qt.later(LOADING_MS, lambda: when_loaded(call))


def finish(addon: AddOn, known: dict[str, Command]) -> None:
    """The rest, once all add-ons are loaded: one of them may have brought an ``Origin_Commit`` of its own."""
    if host.add_command(COMMIT, known[COMMIT]):
        commit = COMMIT
    else:
        # FreeCAD, or a fork of it, commits by itself: its command stays, its end is hooked.
        addon.hook_commit(COMMIT)
        commit = OWN_COMMIT
        if not host.add_command(OWN_COMMIT, known[COMMIT]):
            addon.hook_commit(OWN_COMMIT)
    _kept.append(place([commit, BOM], addon.shown_everywhere))
    host.reload_workbench()
    addon.begin()


def silo_workbench() -> Any:
    """The Silo workbench: a toolbar and a menu with all commands."""

    class SiloWorkbench(host.gui().Workbench):  # type: ignore[misc]  # FreeCAD has no types
        MenuText = words.translate("Silo", "Silo")
        ToolTip = words.translate("Silo", "Keep the BOM of an assembly in step with Silo")
        Icon = str(RESOURCES / "icons" / "silo.svg")

        def Initialize(self) -> None:
            self.appendToolbar("Silo", [COMMIT, BOM, REGISTER, ACTIVITY])
            self.appendMenu("&Silo", [COMMIT, BOM, REGISTER, MASS, ACTIVITY, SETTINGS])

        def GetClassName(self) -> str:
            return "Gui::PythonWorkbench"

    return SiloWorkbench()
