# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: declare what is modelled in the file, mend a moved part's links, compare with the view."""

from __future__ import annotations

import os
from typing import Any

import Draft
from inside import (
    VAULT,
    App,
    Gui,
    QtCore,
    QtWidgets,
    assembly,
    button_texts,
    close,
    close_all,
    pane,
    part,
    picture,
    preview,
    ready,
    registering,
    row_of,
    run,
    settled,
    tell,
    unmark,
    wait,
)
from inside import press as press_button

from silo.workbench.register.dialog import BUTTON, NO_PART


def story() -> None:
    one = ready()
    top = build()
    declare(top)
    hidden_pieces(top)
    close_all()
    moved_part(one)


def build() -> Any:
    """Two motors, a jig and a screw modelled in the assembly's own file, beside a linked bolt."""
    made = assembly("Top", ("First", part("Bolt"), 0))
    doc = made.Document
    for name, size in (("Motor", 7), ("Motor001", 7), ("Jig", 9)):
        box = doc.addObject("Part::Box", name)
        box.Length = size
        box.Placement.Base = App.Vector(size * 10, len(doc.Objects) * 10, 0)
        made.addObject(box)
    screw = doc.addObject("Part::FeaturePython", "Screw")
    for name, value in (("Type", "ISO4762"), ("Diameter", "M4"), ("Length", "16")):
        screw.addProperty("App::PropertyEnumeration", name)
        setattr(screw, name, [value])
    made.addObject(screw)
    doc.recompute()
    doc.save()
    unmark(doc)
    return doc


def press(dialog: Any, section: str) -> Any:
    number = next(number for number, row in enumerate(dialog.rows) if row.section == section)
    dialog.table.cellWidget(dialog._places[number], BUTTON).click()
    return dialog.rows[number]


def texts(table: Any) -> list[str]:
    return [table.item(row, 0).text() for row in range(table.rowCount())]


def declare(doc: Any) -> None:
    dialog = registering(doc)
    dialog.resize(1100, 520)
    tell(
        offered=texts(dialog.table),
        checked=[row.component() for row in dialog.rows if row.checked],
    )
    picture(dialog, "declare")
    dialog.register_button.click()
    wait(lambda: sum(row.finished for row in dialog.rows) >= 3 and settled())
    motors = press(dialog, "modelled")
    wait(lambda: motors.finished and settled())
    tell(number=motors.result.part_number, ids=[doc.getObject(n).SiloItemId for n in ("Motor", "Motor001")])
    close(dialog)
    tell(modified=bool(Gui.getDocument(doc.Name).Modified))
    again = registering(doc)
    tell(again=texts(again.table))
    picture(again, "declared")
    taken = press(again, "declared")
    wait(lambda: not taken.candidate.decided and settled())
    jig = row_of(again, "Jig")
    again.table.cellWidget(again._places[again.rows.index(jig)], NO_PART).click()
    wait(lambda: jig.section == "no part" and settled())
    tell(excluded=doc.getObject("Jig").SiloBomExclude, remark=jig.note()[0])
    close(again)
    third = registering(doc)
    tell(third=texts(third.table))
    picture(third, "no-part")
    back = press(third, "no part")
    wait(lambda: back.section == "modelled" and settled())
    tell(asked_again="SiloBomExclude" not in doc.getObject("Jig").PropertiesList)
    close(third)
    motor = doc.getObject("Motor")
    tell(left="SiloItemId" in motor.PropertiesList and bool(motor.SiloItemId), meta=sorted(doc.Meta))


def hidden_pieces(doc: Any) -> None:
    """The jig is hidden: one press counts it, another makes it a reference, and the table says so."""
    doc.getObject("Jig").Visibility = False
    window = preview(doc)
    window.resize(1000, 520)
    answered = []
    for button in (window.count_button, window.reference_button):
        row = hidden_row(window, "Jig")
        window.table.setCurrentItem(row)
        tell(
            **{
                f"offered_{len(answered)}": [
                    button.isVisibleTo(window),
                    row.text(window.table.columnCount() - 1),
                ]
            }
        )
        if not answered:
            picture(window, "hidden")
        before = window._preview
        button.click()
        wait(lambda before=before: window._preview is not None and window._preview is not before)
        answered.append(doc.getObject("Jig").SiloBomExclude)
    picture(window, "answered")
    tell(answered=answered, words=window._view_text.text())
    close(window)


def hidden_row(window: Any, name: str) -> Any:
    items = QtWidgets.QTreeWidgetItemIterator(window.table)
    while (item := items.value()) is not None:
        if item.text(1) == name and item.data(1, QtCore.Qt.ItemDataRole.UserRole) == "hidden":
            return item
        items += 1
    raise AssertionError(f"no row of {name}")


def moved_part(one: Any) -> None:
    (VAULT / "moved").mkdir()
    os.replace(VAULT / "Bolt.FCStd", VAULT / "moved" / "Bolt.FCStd")
    from_the_pane(one)
    top = App.openDocument(str(VAULT / "Top.FCStd"))
    window = preview(top)
    picture(window, "broken")
    tell(can_mend=window.relink_button.isVisibleTo(window), tip=window.relink_button.toolTip())
    before = window._preview
    window.relink_button.click()
    wait(lambda: window._preview is not None and window._preview is not before)
    target = top.getObject("First").LinkedObject
    tell(mended=target is not None and os.path.relpath(target.Document.FileName, VAULT))
    line = window.table.topLevelItem(0)
    window.table.setCurrentItem(line)
    window.why_button.click()
    tell(line=line.text(2), why=window._view_text.text())
    window.verify_button.click()
    tell(agrees=window._view_text.text(), selected=[obj.Name for obj in Gui.Selection.getSelection()])
    # A Draft array whose original is visible: the view has one more than the BOM says.
    array = Draft.make_ortho_array(
        top.getObject("First"), App.Vector(50, 0, 0), App.Vector(0, 9, 0), App.Vector(), 3, 1, 1
    )
    top.getObject("First").Visibility = True
    next(o for o in top.Objects if o.isDerivedFrom("App::Part")).addObject(array)
    top.recompute()
    window.verify_button.click()
    tell(differs=window._view_text.text(), selection=[obj.Name for obj in Gui.Selection.getSelection()])
    picture(window, "differs")
    window.close()


def from_the_pane(one: Any) -> None:
    """A commit of the assembly: its BOM waits, and the box has both ways out."""
    top = App.openDocument(str(VAULT / "Top.FCStd"))
    top.getObject("Motor").Length = 8
    top.recompute()
    Gui.runCommand("Origin_Commit")
    wait(lambda: any("The BOM waits" in box for box in pane()))
    wait(settled)
    one.dock.show_and_raise()
    wait(lambda: "Sync without it" in button_texts(one.dock))
    picture(one.dock, "blocked")
    tell(waits=pane()[0])
    press_button(one.dock, "Sync without it")
    wait(lambda: settled() and "Incomplete" in pane()[0])
    tell(without=pane()[0])
    press_button(one.dock, "Relink…")
    window = preview()
    wait(lambda: top.getObject("First").LinkedObject is not None)
    wait(lambda: window._preview is not None and settled())
    tell(relinked=os.path.relpath(top.getObject("First").LinkedObject.Document.FileName, VAULT))
    close(window)
    close_all()  # the link is mended in this session only


run(story)
