# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD's start runs (``InitGui.py``): announce commands, dock, workbench and preference page.

Nothing here talks to a server or imports what talks to one; that begins when the window stands. The whole
add-on may cost FreeCAD's start 50 ms.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from silo.workbench import dependencies, host, words
from silo.workbench.addon import AddOn
from silo.workbench.commands import ACTIVITY, BOM, COMMIT, OWN_COMMIT, REGISTER, SETTINGS, commands
from silo.workbench.placement import place

RESOURCES = Path(__file__).parent / "resources"
PREFERENCE_GROUP = "Silo"

# Kept for FreeCAD's whole run: its C++ side holds no reference to what Python hands over.
_kept: list[Any] = []


def start() -> None:
    """Make the add-on known to FreeCAD. A problem here costs the add-on, never FreeCAD's start."""
    words.use(host.translate)
    host.add_resources(str(RESOURCES / "icons"), str(RESOURCES / "translations"))
    if missing := dependencies.missing():
        host.error(dependencies.sentence(missing))
        return
    addon = AddOn()
    names = register_commands(addon)
    host.add_workbench(silo_workbench(names))
    host.add_preference_page(addon.preference_page(), PREFERENCE_GROUP)
    _kept.extend((addon, place(names, addon.shown_everywhere)))
    addon.begin()


def register_commands(addon: AddOn) -> list[str]:
    """Register the commands; gives their names as they are, in the order of the menu."""
    names = []
    for name, command in commands(addon).items():
        if host.add_command(name, command):
            names.append(name)
        elif name == COMMIT:
            # FreeCAD, or a fork of it, commits by itself: its command stays, its end is hooked.
            addon.hook_commit(COMMIT)
            if host.add_command(OWN_COMMIT, command):
                names.append(OWN_COMMIT)
            else:
                addon.hook_commit(OWN_COMMIT)
    return names


def silo_workbench(names: list[str]) -> Any:
    """The Silo workbench: a toolbar and a menu with all commands."""

    class SiloWorkbench(host.gui().Workbench):  # type: ignore[misc]  # FreeCAD has no types
        MenuText = words.translate("Silo", "Silo")
        ToolTip = words.translate("Silo", "Keep the BOM of an assembly in step with Silo")
        Icon = str(RESOURCES / "icons" / "silo.svg")

        def Initialize(self) -> None:
            order = [n for n in (COMMIT, OWN_COMMIT, BOM, REGISTER, ACTIVITY, SETTINGS) if n in names]
            self.appendToolbar("Silo", order[:-1])
            self.appendMenu("&Silo", order)

        def GetClassName(self) -> str:
            return "Gui::PythonWorkbench"

    return SiloWorkbench()
