# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside a FreeCAD that has another Silo's workbench as well, and starts with ours."""

from __future__ import annotations

from typing import Any

from inside import App, Gui, QtWidgets, addon, assembly, part, run, tell, wait


def story() -> None:
    wait(lambda: addon().session.shown.connection == "online")
    texts = [w.toPlainText() for w in Gui.getMainWindow().findChildren(QtWidgets.QTextEdit)]
    actions = menu("&Silo")
    tell(
        report="\n".join(texts),
        ours=[action.text().replace("&", "") for action in actions],
        shortcuts={action.text(): action.shortcut().toString() for action in actions},
        whats_this=all(action.whatsThis() for action in actions),
    )
    help_entry(actions[-1])
    # A fallback does its work: the window of ours opens.
    doc = assembly("Top", ("P", part("Plate"), 0)).Document
    App.setActiveDocument(doc.Name)
    # FreeCAD looks now and then at what a command can do.
    compare = next(action for action in actions if "Compare BOM" in action.text().replace("&", ""))
    wait(compare.isEnabled)
    compare.trigger()
    tell(works=bool(wait(lambda: addon().previews._open)))
    Gui.activateWorkbench("SiloWorkbench")
    tell(theirs=[action.text().replace("&", "") for action in menu("Their Silo")])
    tell(commands_of_keys=commands_of_keys())


def commands_of_keys() -> dict[str, list[str]]:
    """Keys → the menu texts of all commands that have them, with the workbenches that a designer uses."""
    known = Gui.listWorkbenches()
    for name in ("Part", "PartDesign", "Sketcher", "Assembly", "TechDraw", "Draft", "Spreadsheet"):
        if f"{name}Workbench" in known:
            Gui.activateWorkbench(f"{name}Workbench")
    Gui.activateWorkbench("SiloModWorkbench")
    found: dict[str, list[str]] = {}
    for name in Gui.listCommands():
        for action in Gui.Command.get(name).getAction():
            for keys in action.shortcuts():
                texts = found.setdefault(keys.toString(), [])
                texts.append(action.text().replace("&", ""))
    return found


def menu(title: str) -> list[Any]:
    menus = Gui.getMainWindow().menuBar().actions()
    found = next(one for one in menus if one.text() == title)
    return [action for action in found.menu().actions() if not action.isSeparator()]


def help_entry(action: Any) -> None:
    action.trigger()
    window = wait(
        lambda: next(
            (w for w in QtWidgets.QApplication.topLevelWidgets() if w.objectName() == "SiloHelp"), None
        )
    )
    tell(help="Your first commit" in window.page.toPlainText())
    window.close()


run(story)
