# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD's commands of the add-on: name, menu text, tooltip, icon, and what they ask of the add-on.

FreeCAD translates a command's texts itself, in the context of the command's name, also when the user changes
the language: so they are only marked here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from silo.workbench.words import QT_TRANSLATE_NOOP

COMMIT = "Origin_Commit"

BOM = "Silo_BOM"

REGISTER = "Silo_RegisterParts"

MASS = "Silo_Mass"

HELP = "Silo_Help"

INSTALL = "Silo_InstallPackages"

ACTIVITY = "Silo_Activity"

SETTINGS = "Silo_Settings"

OPEN = "Silo_Open"

PROJECT = "Silo_Project"

HISTORY = "Silo_History"


class Command:
    """A command as FreeCAD wants it: an object with ``GetResources``, ``Activated`` and ``IsActive``."""

    # No dataclass: to make one costs FreeCAD's start a millisecond.
    def __init__(
        self,
        text: str,
        tip: str,
        icon: str,
        run: Callable[[], None],
        keys: str = "",
        help: str = "",
        active: Callable[[], bool] = lambda: True,
    ) -> None:
        self.text, self.tip, self.icon, self.run = text, tip, icon, run
        self.keys, self.help, self.active = keys, help, active

    def GetResources(self) -> dict[str, str]:
        """Return the texts, the icon and the keys of the command."""
        texts = {
            "MenuText": self.text,
            "ToolTip": self.tip,
            "WhatsThis": self.help or self.tip,
            "StatusTip": self.tip,
            "Pixmap": self.icon,
            "Accel": self.keys,
        }
        return {name: text for name, text in texts.items() if text}

    def Activated(self, _index: int = 0) -> None:
        """Run the command: chosen from a menu, a toolbar, or by ``Gui.runCommand``."""
        self.run()

    def IsActive(self) -> bool:
        """Return True if FreeCAD offers the command now."""
        return self.active()


def commands(addon: Any) -> dict[str, Command]:
    """Make all commands. ``addon`` does the work (:class:`silo.workbench.addon.AddOn`)."""
    return {
        COMMIT: Command(
            text=QT_TRANSLATE_NOOP("Origin_Commit", "Commit to Silo"),
            tip=QT_TRANSLATE_NOOP(
                "Origin_Commit",
                "Save this document and its changed sub-assemblies, upload them as new revisions, "
                "and bring the BOM to Silo",
            ),
            icon="silo-commit",
            keys="Ctrl+Alt+S",
            help=QT_TRANSLATE_NOOP(
                "Origin_Commit",
                "Saves this document and the edited ones below it, uploads each as a new revision with your "
                "comment, and brings the BOM to Silo. Nothing is ever deleted there.",
            ),
            run=addon.commit,
            active=addon.has_document,
        ),
        BOM: Command(
            text=QT_TRANSLATE_NOOP("Silo_BOM", "Compare BOM with Silo…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_BOM", "Show how the BOM of this assembly differs from the one in Silo"
            ),
            icon="silo-bom",
            keys="Ctrl+Alt+B",
            run=addon.preview,
            active=addon.has_document,
        ),
        REGISTER: Command(
            text=QT_TRANSLATE_NOOP("Silo_RegisterParts", "Register Parts…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_RegisterParts", "Give part numbers to the components of this assembly that have none"
            ),
            icon="silo-register",
            keys="Ctrl+Alt+R",
            run=addon.register,
            active=addon.has_document,
        ),
        MASS: Command(
            text=QT_TRANSLATE_NOOP("Silo_Mass", "Mass of the Assembly…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_Mass",
                "Mass and centre of mass from the parts' shapes and materials, with what is missing",
            ),
            icon="silo-mass",
            keys="Ctrl+Alt+M",
            run=addon.mass,
            active=addon.has_document,
        ),
        ACTIVITY: Command(
            text=QT_TRANSLATE_NOOP("Silo_Activity", "Database Activity"),
            tip=QT_TRANSLATE_NOOP("Silo_Activity", "Show events in Silo, and commits that wait to be sent"),
            icon="silo-activity",
            keys="Ctrl+Alt+A",
            run=addon.show_activity,
        ),
        OPEN: Command(
            text=QT_TRANSLATE_NOOP("Silo_Open", "Open from Silo…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_Open", "Find an item in Silo and open its file with all that it links to"
            ),
            icon="silo-open",
            run=addon.open_from_silo,
        ),
        PROJECT: Command(
            text=QT_TRANSLATE_NOOP("Silo_Project", "Project"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_Project", "All files of the project, which of them Silo has, and Commit All"
            ),
            icon="silo-project",
            keys="Ctrl+Alt+P",
            run=addon.show_project,
        ),
        HISTORY: Command(
            text=QT_TRANSLATE_NOOP("Silo_History", "History…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_History", "The revisions of this document: who, when, and what changed in the BOM"
            ),
            icon="silo-history",
            run=addon.history,
            active=addon.has_document,
        ),
        SETTINGS: Command(
            text=QT_TRANSLATE_NOOP("Silo_Settings", "Silo Settings…"),
            tip=QT_TRANSLATE_NOOP("Silo_Settings", "Server, token, and what a commit does"),
            icon="silo-settings",
            run=addon.show_settings,
        ),
        HELP: Command(
            text=QT_TRANSLATE_NOOP("Silo_Help", "Help on Silo"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_Help", "Open the page that explains the commands, the pane and the messages"
            ),
            icon="silo",
            run=addon.show_help,
        ),
    }
