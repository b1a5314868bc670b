# SPDX-License-Identifier: LGPL-2.1-or-later
"""The dock of the project view."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from silo.workbench.gui.dock import Dock
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.workbench.revisions.dialog import ProjectPane
    from silo.workbench.revisions.project import ProjectFlow


PROJECT = "Silo Project"


class ProjectDock(Dock):
    """The project view.

    flow
        gives :class:`silo.workbench.revisions.project.ProjectFlow`, when it is first needed.
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
