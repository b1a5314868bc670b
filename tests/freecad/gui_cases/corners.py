# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: partly loaded documents with edits, unnamed documents, copied identities."""

from __future__ import annotations

import shutil
from typing import Any

from inside import (
    VAULT,
    App,
    Gui,
    QtWidgets,
    assembly,
    boxes,
    close_all,
    dialog,
    labels,
    link,
    pane,
    part,
    press,
    ready,
    register,
    registering,
    row_of,
    run,
    settled,
    tell,
    unmark,
    wait,
)


def partly_loaded(one: Any) -> None:
    """FreeCAD loads of a linked file only what is linked, and cannot save that."""
    bolt = part("Bolt")
    bolt.Document.addObject("Part::Cylinder", "Unused")
    bolt.Document.recompute()
    bolt.Document.save()
    unmark(bolt.Document)
    top = assembly("Top", ("B1", bolt, 0))
    register(bolt.Document, top.Document)
    close_all()
    opened = App.openDocument(str(VAULT / "Top.FCStd"))
    loaded = App.getDocument("Bolt")
    loaded.getObject("Box").Length = 44
    before = (VAULT / "Bolt.FCStd").read_bytes()
    seen: list[list[Any]] = []

    def answer(found: Any) -> None:
        for number in range(found.files.topLevelItemCount()):
            item = found.files.topLevelItem(number)
            seen.append(
                [item.text(0), item.text(1), int(item.checkState(0) == type(item.checkState(0)).Checked)]
            )
        found.commit.click()

    App.setActiveDocument(opened.Name)
    with dialog("SiloCommitDialog", answer):
        Gui.runCommand("Origin_Commit")
    wait(lambda: boxes("BOM Updated") and settled())
    tell(
        partial=bool(loaded.Partial),
        partial_dialog=seen,
        partial_edit=float(App.getDocument("Bolt").getObject("Box").Length),
        partial_file_untouched=(VAULT / "Bolt.FCStd").read_bytes() == before,
    )
    close_all()


def unnamed(one: Any) -> None:
    """A document that has no file: FreeCAD asks for a name; cancelled, nothing happens."""
    doc = App.newDocument("Nameless")
    from silo.workbench.commit.plan import plan, refusal

    tell(unnamed=refusal(plan(doc, one.desk.documents)))
    close_all()


def copied(one: Any) -> None:
    """Save As is how people begin a new part: two files, one identity."""
    bracket = part("Bracket")
    register(bracket.Document)
    shutil.copy(VAULT / "Bracket.FCStd", VAULT / "Bracket2.FCStd")
    other = App.openDocument(str(VAULT / "Bracket2.FCStd"))
    top = assembly("Frame", ("B1", bracket, 0), ("B2", other.getObject("Box"), 0))
    register(top.Document)
    App.setActiveDocument(top.Document.Name)
    unmark(top.Document)
    one.preferences.set("AskComment", False)
    Gui.runCommand("Origin_Commit")
    wait(lambda: boxes("BOM Updated: A01-0002") and settled())
    tell(copied_box=boxes("BOM Updated: A01-0002")[0])

    # The second file gets an item of its own.
    one.dock.show_and_raise()
    wait(lambda: "2 files carry the same Silo identity" in "".join(labels(one.dock)))
    press(one.dock, "New part…")
    window = registering()
    tell(copied_rows=[[row.component(), row.number, row.checked] for row in window.rows])
    second = row_of(window, "Bracket2.FCStd")
    second.number, second.checked = "new", True
    window._register_checked()
    wait(lambda: second.finished and settled())
    count = len(boxes("BOM Updated: A01-0002"))
    wait(lambda: count and settled())
    window.close()
    Gui.runCommand("Origin_Commit")
    wait(
        lambda: (
            settled() and "copied" not in boxes("Committed: A01-0002")[0]
            if boxes("Committed: A01-0002")
            else False
        )
    )
    tell(copied_after=boxes("Committed: A01-0002")[0])
    same_part(one, top)


def same_part(one: Any, top: Any) -> None:
    """Another copy, which is the same part on purpose; one press in the pane, and it counts."""
    shutil.copy(VAULT / "Bracket.FCStd", VAULT / "Bracket3.FCStd")
    other = App.openDocument(str(VAULT / "Bracket3.FCStd"))
    link(top, "B3", other.getObject("Box"))
    App.setActiveDocument(top.Document.Name)
    Gui.runCommand("Origin_Commit")
    wait(lambda: "identity" in newest(one) and settled())
    asked = newest(one)
    # The box of the first question may still be there, below.
    wait(lambda: "Bracket3.FCStd" in "".join(labels(one.dock)))
    min(buttons(one.dock, "Same part"), key=height).click()
    wait(lambda: "identity" not in newest(one) and settled())
    tell(same=[asked, newest(one)])
    Gui.runCommand("Origin_Commit")
    wait(lambda: newest(one).startswith("Committed") and settled())
    tell(same_again=newest(one))


def newest(one: Any) -> str:
    """The newest box of the assembly."""
    return next(text for text in pane() if "A01-0002" in text.splitlines()[0])


def buttons(widget: Any, text: str) -> list[Any]:
    return [b for b in widget.findChildren(QtWidgets.QPushButton) if b.isVisible() and b.text() == text]


def height(button: Any) -> int:
    """From the top of the screen."""
    return int(button.mapToGlobal(button.rect().topLeft()).y())


def story() -> None:
    one = ready(comments=True)
    partly_loaded(one)
    unnamed(one)
    copied(one)


run(story)
