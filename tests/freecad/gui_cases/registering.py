# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: give numbers to parts, from the dialog to the BOM; parts that cannot be written."""

from __future__ import annotations

import shutil
import stat
from typing import Any

from inside import (
    VAULT,
    App,
    Gui,
    QtCore,
    ask,
    assembly,
    boxes,
    close,
    close_all,
    labels,
    link,
    part,
    ready,
    registering,
    row_of,
    run,
    settled,
    tell,
    unmark,
    wait,
)

from silo.workbench.register.dialog import BUTTON, COMPONENT, NAME, NUMBER


def story() -> None:
    one = ready()
    one.preferences.set("AskRegister", True)
    parts = {name: part(name) for name in ("Bracket", "MotorMount", "Fixed", "Twin", "Construction")}
    two = two_parts()
    (VAULT / "Fixed.FCStd").chmod(stat.S_IRUSR)
    tell(folder=two.TransientDir, path=two.FileName)
    ask("open Construction elsewhere")
    made = assembly(
        "Top",
        *((name, box, 0) for name, box in parts.items()),
        ("Left", two.getObject("Left"), 0),
        ("Right", two.getObject("Right"), 0),
    )
    top = made.Document
    unmark(top)
    # An edit that is not saved yet goes along.
    parts["Bracket"].Length = 33

    dialog = registering(top)
    tell(
        offered={
            row.component(): [row.name, row.item_type, row.category, row.checked, row.note()[0]]
            for row in dialog.rows
        }
    )
    for number, row in enumerate(dialog.rows):
        if row.guesses:
            # A guess is registered where a person says so.
            dialog.table.item(number, COMPONENT).setCheckState(QtCore.Qt.CheckState.Checked)
    cell(dialog, "Construction.FCStd", COMPONENT).setCheckState(QtCore.Qt.CheckState.Unchecked)
    cell(dialog, "MotorMount.FCStd", NAME).setText("Motor mount")
    dialog.register_button.click()
    wait(lambda: done(dialog) >= 6 and settled())
    wait(lambda: boxes("BOM Updated: ") and settled())
    tell(
        registered={row.component(): row.result.part_number for row in dialog.rows if row.finished},
        left=[row.component() for row in dialog.rows if not row.finished],
        button_after_skipping=dialog.skip_button.text(),
    )
    dialog.skip_button.click()
    wait(lambda: not one.registrations._open)
    identities(top.FileName)

    # The next commit asks again, for those that were skipped.
    one.commits.start(App.ActiveDocument)
    again = registering()
    tell(asked_again=[row.component() for row in again.rows])
    close(again)
    same_part(one)
    partly_loaded()


def same_part(one: Any) -> None:
    """Two files of one identity, in an assembly with a new part; the person says they are the same."""
    close_all()
    shutil.copy(VAULT / "Bracket.FCStd", VAULT / "BracketCopy.FCStd")
    copies = [App.openDocument(str(VAULT / f"{name}.FCStd")) for name in ("Bracket", "BracketCopy")]
    targets = [*(doc.getObject("Box") for doc in copies), part("Extra")]
    frame = App.newDocument("Frame")
    container = frame.addObject("App::Part", "Assembly")
    container.Type = "Assembly"
    frame.saveAs(str(VAULT / "Frame.FCStd"))
    for target in targets:
        link(container, target.Document.Name, target)
    frame.recompute()
    # FreeCAD 0.20's save command would ask about the files that the links have touched.
    frame.save()
    dialog = registering(frame)
    for row in (row_of(dialog, "Extra.FCStd"), row_of(dialog, "Frame.FCStd")):
        dialog.table.cellWidget(dialog.rows.index(row), BUTTON).click()
        wait(lambda row=row: row.finished and settled())
    asked = {row.component(): row.number for row in dialog.rows if row.candidate.same_as}
    selected_before = dialog.register_button.isEnabled()
    cell(dialog, "Bracket.FCStd", NUMBER).setData(QtCore.Qt.ItemDataRole.UserRole, "same")
    answered = {row.component(): row.number for row in dialog.rows if row.candidate.same_as}
    dialog.register_button.click()
    wait(settled)
    tell(
        asked=asked,
        selected_before=selected_before,
        answered=answered,
        notes=[row.note()[0] for row in dialog.rows if row.candidate.same_as],
        button=dialog.skip_button.text(),
    )
    close(dialog)
    App.setActiveDocument(frame.Name)
    Gui.runCommand("Silo_RegisterParts")
    empty = wait(lambda: next(iter(one.registrations._open.values()), None))
    wait(lambda: "have their Silo part number" in " ".join(labels(empty)))
    tell(left_to_ask=[row.component() for row in empty.rows])
    close(empty)


def partly_loaded() -> None:
    """FreeCAD loads of these two files only what is linked; one of them has an edit that it cannot save."""
    close_all()
    boxes_of = {name: part(name) for name in ("Half", "Quiet")}
    for box in boxes_of.values():
        box.Document.addObject("Part::Cylinder", "Unused")
        box.Document.recompute()
        box.Document.save()
        unmark(box.Document)
    top = assembly("Whole", *((name, box, 0) for name, box in boxes_of.items())).Document.FileName
    close_all()
    App.openDocument(top)
    App.getDocument("Half").getObject("Box").Length = 44
    partial = [bool(App.getDocument(name).Partial) for name in boxes_of]
    dialog = registering(App.getDocument("Whole"))
    tell(partial=partial, half=[(row := row_of(dialog, "Half.FCStd")).checked, row.note()[0]])
    quiet = row_of(dialog, "Quiet.FCStd")
    dialog.table.cellWidget(dialog.rows.index(quiet), BUTTON).click()
    wait(lambda: quiet.result is not None and settled())
    tell(
        quiet=quiet.note()[0],
        objects=sorted(obj.Name for obj in App.getDocument("Quiet").Objects if obj.Name in ("Box", "Unused")),
        half_edit=float(App.getDocument("Half").getObject("Box").Length),
    )
    dialog.close()


def two_parts() -> Any:
    """One file that gives two parts."""
    doc = App.newDocument("Two")
    for name in ("Left", "Right"):
        doc.addObject("Part::Box", name).Label = f"{name} jaw"
    doc.recompute()
    doc.saveAs(str(VAULT / "Two.FCStd"))
    unmark(doc)
    return doc


def cell(dialog: Any, component: str, column: int) -> Any:
    return dialog.table.item(dialog.rows.index(row_of(dialog, component)), column)


def done(dialog: Any) -> int:
    return sum(1 for row in dialog.rows if row.finished)


def identities(top: str) -> None:
    """What a fresh FreeCAD session reads from the files."""
    close_all()
    doc = App.openDocument(top)
    found: dict[str, Any] = {}
    for other in App.listDocuments().values():
        found[other.Name] = {
            "meta": dict(other.Meta),
            "property": getattr(other, "SiloUUID", None) if hasattr(other, "addProperty") else None,
            "objects": {o.Name: o.SiloItemId for o in other.Objects if "SiloItemId" in o.PropertiesList},
        }
    bracket = App.getDocument("Bracket")
    App.setActiveDocument(doc.Name)
    tell(
        identities=found, edit=float(bracket.getObject("Box").Length), properties=hasattr(doc, "addProperty")
    )


run(story)
