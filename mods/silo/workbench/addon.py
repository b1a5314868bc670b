# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on while FreeCAD runs: what the commands ask for, and the dock. Work is done elsewhere."""

from __future__ import annotations

from typing import Any

from silo.workbench import host
from silo.workbench.pane import ActivityDock
from silo.workbench.prefs import PreferencePage
from silo.workbench.settings import GROUP, Preferences

# FreeCAD's window comes first; a server is not talked to before it stands.
BEGIN_AFTER_MS = 1500


class AddOn:
    """One per FreeCAD."""

    def __init__(self) -> None:
        self.preferences = Preferences(host.parameters(GROUP))
        self.dock = ActivityDock(host.main_window())

    def begin(self) -> None:
        """Go on once the window stands."""

    def has_document(self) -> bool:
        """True where there is something to commit."""
        return host.active_document() is not None

    def shown_everywhere(self) -> bool:
        """True where Commit belongs into every workbench's File menu."""
        return self.preferences.flag("ShowEverywhere")

    def preference_page(self) -> Any:
        """The class of the preference page."""
        return PreferencePage

    def hook_commit(self, name: str) -> None:
        """Sync the BOM after this command, which is not ours."""

    def commit(self) -> None:
        """Commit the active document."""

    def preview(self) -> None:
        """Compare the active assembly with the server."""

    def register(self) -> None:
        """Give part numbers to components."""

    def show_activity(self) -> None:
        """Show the pane."""
        self.dock.show_and_raise()

    def show_settings(self) -> None:
        """Open the preferences."""
        host.show_preferences("Silo", 0)
