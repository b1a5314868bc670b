# SPDX-License-Identifier: LGPL-2.1-or-later
"""The dock of the Database Activity pane."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from silo.workbench.gui.dock import Dock
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.workbench.activity.box import Action
    from silo.workbench.pane.boxes import Pane
    from silo.workbench.session.state import PaneState

NAME = "Database Activity"


class ActivityDock(Dock):
    """The Database Activity pane.

    on_action
        gets every button that is pressed.
    """

    def __init__(self, window: Any, on_action: Callable[[Action], None]) -> None:
        super().__init__(window, NAME, translate("Silo", "Database Activity"))
        self._on_action = on_action
        self._shown: PaneState | None = None

    def make(self) -> Pane:
        """Make the pane."""
        from silo.workbench.pane.boxes import Pane

        return Pane(self._on_action)

    def update_shown(self, shown: PaneState) -> None:
        """Draw a new state; only remember it while the dock is not visible."""
        self._shown = shown
        if self._content is not None and self.isVisible():
            self._content.draw(shown)

    def _visible(self, visible: bool) -> None:
        super()._visible(visible)
        if visible and self._shown is not None:
            self._content.draw(self._shown)
