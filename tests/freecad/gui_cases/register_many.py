# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: a project of many files is registered in one table, and taken back."""

from __future__ import annotations

from typing import Any

from inside import (
    VAULT,
    App,
    Gui,
    QtCore,
    QtGui,
    QtWidgets,
    close,
    link,
    modified,
    picture,
    ready,
    registering,
    run,
    settled,
    tell,
    unmark,
    wait,
)

# Folder → names of files; the parts of a file are called as it is, the second one "… cover".
FILES = {
    "frame": [f"Bracket {n}" for n in range(4)],
    "bought": [f"Widget {n}" for n in range(4)],
    "electronics": [f"Gizmo {n}" for n in range(5)],
}
TWO_PARTS = {f"Gizmo {n}" for n in range(3)}
DOCUMENTS = 1 + sum(map(len, FILES.values()))

actions: list[str] = []


def act(what: str) -> None:
    """Count what a person does."""
    actions.append(what)
    QtWidgets.QApplication.processEvents()


def story() -> None:
    one = ready()
    top = project()
    dialog = registering(top)
    tell(
        rows=len(dialog.rows),
        documents=len(App.listDocuments()) == DOCUMENTS,
        smallest=[dialog.minimumSizeHint().width(), dialog.minimumSizeHint().height()],
        headings=list(dialog._headings.values()),
        unsure=sum(not row.checked for row in dialog.rows),
        names=sorted(row.name for row in dialog.rows)[:2],
    )
    filter_rows(dialog, "unsure", "widget")
    tell(shown=len(dialog._visible()))
    choose_all(dialog)
    pick(dialog, "sourcing", "purchased")
    write(dialog, "supplier", "Miracle Motors")
    search(dialog, "category", "servo")
    filter_rows(dialog, "unsure", "gizmo")
    choose_all(dialog)
    search(dialog, "category", "circuit")
    filter_rows(dialog, "all", "")
    # Return in a field sets a value, and registers nothing.
    assert not any(row.finished or row.running for row in dialog.rows)
    act("check all certain")
    dialog.checks["certain"].click()
    picture(dialog, "register-many")
    act("register")
    dialog.register_button.click()
    wait(lambda: all(row.finished or row.result for row in dialog.rows) and settled(), 250)
    tell(
        actions=actions,
        numbers={row.component(): row.result.part_number for row in dialog.rows if row.finished},
        left=[[row.component(), row.note()[0]] for row in dialog.rows if not row.finished],
    )
    project_view(one)
    taken_back(dialog, top)


def project_view(one: Any) -> None:
    """The folder is chosen; an edit is shown, there and in the tree, and marks no document; Commit All."""
    Gui.runCommand("Silo_Project")
    view = wait(lambda: one.project._content)
    tell(asked=view.news.text())
    view._choose(str(VAULT))
    wait(lambda: len(view._flow.view.rows) == DOCUMENTS)
    wait(settled)
    # A file of several parts is no item's, so registering has not sent it.
    tell(several=[row.words() for row in view._flow.view.rows if "Gizmo 0" in row.place])
    edited = next(doc for doc in App.listDocuments().values() if doc.Label == "Bracket 3")
    edited.getObject("Box0").Length = 33
    view.refresh()
    wait(lambda: any(row.edits for row in view._flow.view.rows) and settled())
    view.only_left.setChecked(True)
    view.words.setText("bracket")
    left = view._flow.view.shown("bracket", only_left=True)
    tell(
        left_rows=[[row.place, row.words()] for row in left],
        shown_rows=view.files.topLevelItemCount(),
        in_tree=tree_tip("Bracket 3"),
        marked=[doc.Label for doc in App.listDocuments().values() if modified(doc)],
    )
    view.words.clear()
    tell(all_left=view.files.topLevelItemCount())
    picture(one.project, "project")
    view.comment.setText("longer")
    view.commit.click()
    wait(lambda: settled() and view._flow.view.rows and not view._flow.view.shown("", only_left=True))
    tell(left_after=view.files.topLevelItemCount(), root=one.preferences.text("ProjectFolder"))
    view.only_left.setChecked(False)


def tree_tip(label: str) -> str:
    """What FreeCAD's tree says of a document."""
    trees = [
        tree
        for tree in Gui.getMainWindow().findChildren(QtWidgets.QTreeWidget)
        if tree.metaObject().className() == "Gui::TreeWidget"
    ]
    found = [item for tree in trees for item in tree.findItems(label, QtCore.Qt.MatchFlag.MatchRecursive)]
    return next((item.toolTip(0) for item in found if "Silo" in item.toolTip(0)), "")


def taken_back(dialog: Any, top: Any) -> None:
    """One press undoes all of it; what was chosen is known the next time."""
    dialog.undo_button.click()
    tell(visible=dialog.undo_button.isVisible())
    wait(lambda: not any(row.finished or row.running for row in dialog.rows), 250)
    wait(settled)
    tell(
        undone=[row.component() for row in dialog.rows if row.result is not None],
        identities=sum(bool(doc.Meta.get("SiloUUID")) for doc in App.listDocuments().values()),
    )
    close(dialog)
    again = registering(top)
    widget = next(row for row in again.rows if row.name == "Widget 3")
    tell(
        again=[widget.category, widget.sourcing, widget.supplier, widget.checked, widget.note()[0]],
        recent=again.bulk["category"].itemData(0),
    )
    again.close()


def project() -> Any:
    """Make the files, and the assembly that links to all of their parts."""
    top = App.newDocument("Machine")
    container = top.addObject("App::Part", "Assembly")
    container.Type = "Assembly"
    top.saveAs(str(VAULT / "Machine.FCStd"))
    for folder, names in FILES.items():
        (VAULT / folder).mkdir()
        for name in names:
            doc = App.newDocument(name.replace(" ", ""))
            parts = [name, f"{name} cover"] if name in TWO_PARTS else ["Part__Feature"]
            for number, label in enumerate(parts):
                doc.addObject("Part::Box", f"Box{number}").Label = label
            doc.recompute()
            doc.saveAs(str(VAULT / folder / f"{name}.FCStd"))
            unmark(doc)
            for number in range(len(parts)):
                link(container, f"{doc.Name}_{number}", doc.getObject(f"Box{number}"))
    top.recompute()
    top.save()
    unmark(top)
    return top


def filter_rows(dialog: Any, only: str, words: str) -> None:
    if dialog.only.currentData() != only:
        dialog.only.setCurrentIndex(dialog.only.findData(only))
        dialog.only.activated.emit(dialog.only.currentIndex())
        act(f"show {only}")
    dialog.words.setText(words)
    act(f"filter {words!r}")


def choose_all(dialog: Any) -> None:
    dialog.table.selectAll()
    act("choose all")


def pick(dialog: Any, column: str, key: str) -> None:
    box = dialog.bulk[column]
    box.setCurrentIndex(box.findData(key))
    box.activated.emit(box.currentIndex())
    act(f"{column} {key}")


def write(dialog: Any, column: str, text: str) -> None:
    dialog.bulk[column].setText(text)
    dialog.bulk[column].returnPressed.emit()
    act(f"{column} {text!r}")


def search(dialog: Any, column: str, letters: str) -> None:
    """Type letters that fit one category, then Return."""
    box = dialog.bulk[column]
    box.lineEdit().setText(letters)
    key = QtCore.Qt.Key.Key_Return
    event = QtGui.QKeyEvent(QtCore.QEvent.Type.KeyPress, key, QtCore.Qt.KeyboardModifier.NoModifier)
    QtWidgets.QApplication.sendEvent(box.lineEdit(), event)
    act(f"{column} {letters!r}")


run(story)
