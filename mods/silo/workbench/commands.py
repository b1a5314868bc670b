# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD's commands of the add-on: name, menu text, tooltip, icon, and what they ask of the add-on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from silo.workbench.words import translate

COMMIT = "Origin_Commit"
# Where FreeCAD, or a fork of it, has an Origin_Commit of its own, it is left alone and hooked; ours for
# committing by hand then has this name.
OWN_COMMIT = "Silo_Commit"
BOM = "Silo_BOM"
REGISTER = "Silo_RegisterParts"
MASS = "Silo_Mass"
ACTIVITY = "Silo_Activity"
SETTINGS = "Silo_Settings"


class Command:
    """A command as FreeCAD wants it: an object with ``GetResources``, ``Activated`` and ``IsActive``."""

    def __init__(
        self,
        *,
        text: str,
        tip: str,
        icon: str,
        run: Callable[[], None],
        active: Callable[[], bool] = lambda: True,
    ) -> None:
        self.text, self.tip, self.icon, self.run, self.active = text, tip, icon, run, active

    def GetResources(self) -> dict[str, str]:
        """What FreeCAD shows."""
        return {"MenuText": self.text, "ToolTip": self.tip, "Pixmap": self.icon}

    def Activated(self, _index: int = 0) -> None:
        """Chosen from a menu, a toolbar, or by ``Gui.runCommand``."""
        self.run()

    def IsActive(self) -> bool:
        """Whether FreeCAD offers the command now."""
        return self.active()


def commands(addon: Any) -> dict[str, Command]:
    """All commands. ``addon`` does the work (:class:`silo.workbench.addon.AddOn`)."""
    return {
        COMMIT: Command(
            text=translate("Silo", "Commit to Silo"),
            tip=translate(
                "Silo",
                "Save this document and its changed sub-assemblies, upload them as new revisions, "
                "and bring the BOM to Silo",
            ),
            icon="silo-commit",
            run=addon.commit,
            active=addon.has_document,
        ),
        BOM: Command(
            text=translate("Silo", "Compare BOM with Silo…"),
            tip=translate("Silo", "Show how the BOM of this assembly differs from the one in Silo"),
            icon="silo-bom",
            run=addon.preview,
            active=addon.has_document,
        ),
        REGISTER: Command(
            text=translate("Silo", "Register Parts…"),
            tip=translate("Silo", "Give part numbers to the components of this assembly that have none"),
            icon="silo-register",
            run=addon.register,
            active=addon.has_document,
        ),
        MASS: Command(
            text=translate("Silo", "Mass of the Assembly…"),
            tip=translate(
                "Silo", "Mass and centre of mass from the parts' shapes and materials, with what is missing"
            ),
            icon="silo-mass",
            run=addon.mass,
            active=addon.has_document,
        ),
        ACTIVITY: Command(
            text=translate("Silo", "Database Activity"),
            tip=translate("Silo", "Show what happens in Silo, and what waits to be sent"),
            icon="silo-activity",
            run=addon.show_activity,
        ),
        SETTINGS: Command(
            text=translate("Silo", "Silo Settings…"),
            tip=translate("Silo", "Server, token, and what a commit does"),
            icon="silo-settings",
            run=addon.show_settings,
        ),
    }
