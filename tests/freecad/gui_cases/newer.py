# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside an older FreeCAD: a file of a newer FreeCAD is open; saving it would destroy some of its objects."""

from __future__ import annotations

import os
from typing import Any

from inside import (
    FOLDER,
    VAULT,
    App,
    Gui,
    QtWidgets,
    addon,
    boxes,
    dialog,
    labels,
    modified,
    run,
    settled,
    tell,
    wait,
)

TITLE = "Made by a newer FreeCAD: "


def save(button: str) -> str:
    """Save as a person does, and answer the question; what it said."""
    said: list[str] = []

    def answer(box: Any) -> None:
        said.extend(labels(box))
        box.grab().save(str(FOLDER / f"{button}.png"))
        (found,) = (one for one in box.buttons() if one.text() == button)
        found.click()

    with dialog("SiloConfirm", answer):
        Gui.runCommand("Std_Save")
    wait(settled)
    for _ in range(10):
        QtWidgets.QApplication.processEvents()
    return " ".join(said)


def story() -> None:
    one = addon()
    wait(lambda: one.session.shown.connection == "online" and settled())
    team = wait(lambda: boxes("Your team works with"))
    path = VAULT / os.environ.get("SILO_NEWER", "TopAssembly.FCStd")
    before = path.read_bytes()
    doc = App.openDocument(str(path))
    wait(lambda: boxes(TITLE))
    opened = boxes(TITLE)
    doc.addObject("Part::Box", "Edit")
    from silo.workbench.gui import widgets

    told: list[str] = []
    widgets.warn = lambda _parent, _title, text: told.append(text)
    Gui.runCommand("Origin_Commit")
    wait(lambda: told and settled())
    untouched = path.read_bytes() == before

    asked = save("Keep the newer file")
    kept = path.read_bytes() == before
    wait(lambda: modified(doc))
    after_keeping = boxes(TITLE)
    again = save("Save over it")
    over = boxes(TITLE)
    addon().dock.show_and_raise()
    for _ in range(20):
        QtWidgets.QApplication.processEvents()
    Gui.getMainWindow().grab().save(str(FOLDER / "window.png"))
    tell(
        team=team,
        opened=opened,
        told=told,
        untouched=untouched,
        asked=asked,
        kept=kept,
        after_keeping=after_keeping,
        again=again,
        over=over,
        replaced=path.read_bytes() != before,
        aside=sorted(str(one) for one in FOLDER.rglob("kept-aside/*/*.FCStd")),
        modified=modified(doc),
    )


run(story)
