# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: what a person sees of the add-on: commands, icons, tool tips, menu, toolbar."""

from __future__ import annotations

from typing import Any

from inside import Gui, QtWidgets, addon, run, tell, wait


def menu_texts(window: Any) -> list[str]:
    menus = window.menuBar().findChildren(QtWidgets.QMenu)
    return [action.text().replace("&", "") for menu in menus for action in menu.actions()]


def story() -> None:
    import silo

    wait(lambda: Gui.Command.get("Origin_Commit") is not None)
    window = Gui.getMainWindow()
    # Commit stands where people save, in every workbench.
    Gui.activateWorkbench("PartWorkbench")
    wait(lambda: "Commit to Silo" in menu_texts(window))
    Gui.activateWorkbench("SiloModWorkbench")
    ours = sorted(name for name in Gui.listCommands() if name == "Origin_Commit" or name.startswith("Silo_"))
    bar = wait(lambda: window.findChild(QtWidgets.QToolBar, "Silo"))
    actions = {name: list(Gui.Command.get(name).getAction()) for name in ours}
    shown = bar.actions()
    views = window.findChildren(QtWidgets.QTextEdit)
    tell(
        **{"from": silo.__path__[0]},
        commands=ours,
        toolbar=[
            next((name for name in ours if one in actions[name]), one.text())
            for one in shown
            if not one.isSeparator()
        ],
        without_icon=[name for name in ours if not actions[name] or actions[name][0].icon().isNull()],
        without_tip=[name for name in ours if not Gui.Command.get(name).getInfo()["toolTip"]],
        report=[line for view in views for line in view.toPlainText().split("\n") if "Silo" in line],
        dock=addon().dock.objectName(),
    )


run(story)
