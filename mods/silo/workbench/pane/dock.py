# SPDX-License-Identifier: LGPL-2.1-or-later
"""The docks. Both come after FreeCAD's other add-ons, and get their places back then. Their content is made
when somebody first looks at it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.workbench.activity.box import Action
    from silo.workbench.pane.boxes import Pane
    from silo.workbench.revisions.dialog import ProjectPane
    from silo.workbench.revisions.flow import ProjectFlow
    from silo.workbench.session.state import PaneState

NAME = "Database Activity"
PROJECT = "Silo Project"

# Pixels.
NARROW, WIDTH = 260, 320


class Dock(QtWidgets.QDockWidget):  # type: ignore[misc]  # PySide has no types
    """A dock whose content is made when somebody first looks at it.

    FreeCAD restores place and visibility by its object name, so that must never change.
    """

    def __init__(self, window: Any, name: str, title: str) -> None:
        super().__init__(title, window)
        self.setObjectName(name)
        self._content: Any = None
        window.addDockWidget(QtCore.Qt.DockWidgetArea.RightDockWidgetArea, self)
        self.hide()
        self.visibilityChanged.connect(self._visible)
        window.restoreDockWidget(self)

    def make(self) -> Any:
        """Make the content of the dock."""
        raise NotImplementedError

    def show_and_raise(self) -> None:
        """Show the dock, even if it is a tab behind another one."""
        self.show()
        self.raise_()

    def _visible(self, visible: bool) -> None:
        if visible and self._content is None:
            self._content = self.make()
            self.setWidget(self._content)
            if self.width() < NARROW:
                # If the user has never placed it: wide enough to read, narrow enough to work beside it.
                self.parent().resizeDocks([self], [WIDTH], QtCore.Qt.Orientation.Horizontal)


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


class ProjectDock(Dock):
    """The project view.

    flow
        gives :class:`silo.workbench.revisions.flow.ProjectFlow`, when it is first needed.
    """

    def __init__(self, window: Any, flow: Callable[[], ProjectFlow]) -> None:
        super().__init__(window, PROJECT, translate("Silo", "Silo Project"))
        self._flow = flow

    def make(self) -> ProjectPane:
        """Make the project view."""
        from silo.workbench.revisions.dialog import ProjectPane

        return ProjectPane(self._flow())

    def refresh(self) -> None:
        """Look at the files again, if the dock is visible."""
        if self._content is not None and self.isVisible():
            self._content.refresh()
