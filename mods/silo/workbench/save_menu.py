# SPDX-License-Identifier: LGPL-2.1-or-later
"""Commit where users save: in the File menu and the File toolbar of every workbench.

FreeCAD >= 0.21 has workbench manipulators for that. In 0.20 the entries are put in place by hand after each
change of the workbench, since FreeCAD rebuilds its menus then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from silo.workbench import words
from silo.workbench.freecad import host
from silo.workbench.gui.qt import QtGui, QtWidgets

AFTER = "Std_Save"


class Manipulator:
    """Asked by FreeCAD whenever it builds the menus and toolbars of a workbench."""

    def __init__(self, names: Callable[[], list[str]], wanted: Callable[[], bool]) -> None:
        self._names, self._wanted = names, wanted

    def modifyMenuBar(self) -> list[dict[str, str]]:
        """Insert after Save; the last one inserted is on top."""
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
        """Put the entries into their places, if they are not there."""
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
