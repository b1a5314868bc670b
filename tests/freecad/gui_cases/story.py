# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: a designer's day. Commit with changed sub-assemblies, preview, server gone and back."""

from __future__ import annotations

from typing import Any

from inside import (
    FOLDER,
    App,
    Gui,
    QtWidgets,
    ask,
    assembly,
    boxes,
    button_texts,
    close,
    dialog,
    labels,
    link,
    modified,
    pane,
    part,
    press,
    ready,
    register,
    run,
    settled,
    tell,
    wait,
)
from inside import preview as preview_of
from themes import in_themes


def commit(document: Any, comment: str = "", seen: list[list[str]] | None = None) -> None:
    """Commit by the command, answering the dialog as a person does."""

    def answer(found: Any) -> None:
        if seen is not None:
            tree = found.files
            items = [tree.topLevelItem(i) for i in range(tree.topLevelItemCount())]
            seen.extend([[item.text(0), item.text(1)] for item in items])
        found.comment.setPlainText(comment)
        found.commit.click()

    App.setActiveDocument(document.Name)
    with dialog("SiloCommitDialog", answer):
        Gui.runCommand("Origin_Commit")


def make() -> dict[str, Any]:
    plate, bolt, cover = part("BasePlate"), part("Bolt"), part("Cover")
    gearbox = assembly("Gearbox", ("Cover", cover, 0), ("Bolts", bolt, 6))
    top = assembly(
        "Top", ("Plate", plate, 0), ("Gearbox1", gearbox, 0), ("Gearbox2", gearbox, 0), ("Bolt1", bolt, 0)
    )
    return {"plate": plate, "bolt": bolt, "cover": cover, "gearbox": gearbox, "top": top}


def story() -> None:
    one = ready(comments=True)
    made = make()
    docs = {name: obj.Document for name, obj in made.items()}
    numbers = register(*(docs[name] for name in ("plate", "bolt", "gearbox", "top")))
    tell(numbers=numbers)
    # 1. Everything is dirty: sub-assembly and part below the top.
    made["gearbox"].Document.getObject("Bolts").ElementCount = 8
    made["plate"].Length = 50
    link(made["top"], "Bolt2", made["bolt"])
    docs["top"].recompute()
    seen: list[list[str]] = []
    commit(docs["top"], "wider plate", seen)
    wait(lambda: boxes("BOM Updated: " + numbers["Top"]) and settled())
    tell(
        dialog=seen,
        first=pane(),
        still_modified=[doc.Label for doc in docs.values() if modified(doc)],
        dock_visible=one.dock.isVisible(),
        active=App.ActiveDocument.Name,
    )

    # 2. The same again: nothing is posted.
    commit(docs["top"])
    wait(lambda: settled() and boxes("Committed: " + numbers["Top"]) and boxes("5 files of it are in Silo"))
    tell(second=boxes("Committed: " + numbers["Top"])[0], below=boxes("5 files of it are in Silo")[0])

    # 3. What a person reads in the dock.
    one.dock.show_and_raise()
    wait(lambda: any("BOM Updated" in text for text in labels(one.dock)))
    tell(dock=labels(one.dock))
    pages(one)

    # 4. Somebody else merges: the pane hears of it.
    tell(other=ask("other merge"))
    wait(lambda: sum(1 for text in pane() if "1 unreferenced" in text) >= 1)
    tell(heard=pane()[0])

    # 5. The server goes; a commit waits; the server comes back; it arrives by itself.
    ask("server down")
    wait(lambda: one.session.shown.connection == "offline")
    docs["top"].removeObject("Bolt2")
    made["plate"].Length = 60
    docs["top"].recompute()
    commit(docs["top"], "offline")
    wait(lambda: len(one.session.shown.waiting) >= 2 and settled())
    wait(lambda: any("waits to be sent" in t or "wait to be sent" in t for t in labels(one.dock)))
    tell(offline=labels(one.dock), waiting=[w.label for w in one.session.shown.waiting])
    before = len(boxes("BOM Updated: " + numbers["Top"]))
    ask("server up")
    if "Try again" in button_texts(one.dock):  # unless the add-on itself was quicker
        press(one.dock, "Try again")
    wait(lambda: len(boxes("BOM Updated: " + numbers["Top"])) > before and settled())
    wait(lambda: not one.session.shown.waiting)
    wait(lambda: one.session.shown.connection == "online")
    tell(after=pane()[0], connection=one.session.shown.connection)
    preview(one, docs["top"])


def pages(one: Any) -> None:
    """Without a browser the address is on the clipboard; another server's page is not opened at all."""
    from silo.workbench.gui import qt

    asked: list[str] = []
    qt.open_url = asked.append
    for url in ("https://example.org/items/A01-0001/bom", "javascript:alert(1)//", "file:///etc/passwd"):
        one.buttons.open_page(url)
    tell(elsewhere=asked[:])
    press(one.dock, "View in Silo →")
    tell(opened=asked[-1], copied=QtWidgets.QApplication.clipboard().text())


def _is_synced(diff: Any) -> bool:
    return not diff.added and not diff.quantity_changed


def preview(one: Any, top: Any) -> None:
    """6. The preview: what differs, then Sync."""
    top.getObject("Gearbox2").ElementCount = 3
    window = preview_of(top)
    window.table.setColumnWidth(1, 460)  # little is left for what a sync does
    window.resize(1, 480)  # as narrow as its buttons let it be
    for _ in range(20):
        QtWidgets.QApplication.processEvents()
    window.grab().save(str(FOLDER / "preview.png"))
    tell(preview=rows(window.table), preview_text=labels(window), can_sync=window.sync_button.isEnabled())
    tell(cut=cut(window.table))
    window.sync_button.click()
    wait(lambda: settled() and window._preview is not None and _is_synced(window._preview.top.diff))
    tell(preview_after=rows(window.table))
    item = window.table.topLevelItem(0)
    window.table.setCurrentItem(item)
    window.show_button.click()
    tell(selected=[obj.Name for obj in Gui.Selection.getSelection(top.Name)])
    close(window)
    # 7. Light and dark.
    in_themes(one)


def cut(tree: Any) -> list[str]:
    """The lines of the last column that are wider than the column, or higher than their row."""
    found: list[str] = []
    metrics, width = tree.fontMetrics(), tree.columnWidth(4)
    items = QtWidgets.QTreeWidgetItemIterator(tree)
    while (item := items.value()) is not None:
        lines = item.text(4).split("\n")
        if not item.isFirstColumnSpanned() and item.text(4):
            found += [line for line in lines if " " in line and metrics.horizontalAdvance(line) > width]
            height = tree.visualItemRect(item).height()
            if height and height < len(lines) * metrics.height():
                found.append(item.text(4))
        items += 1
    return found


def rows(tree: Any) -> list[list[str]]:
    """The rows of a tree, opened all the way down."""
    found: list[list[str]] = []

    def walk(item: Any, depth: int) -> None:
        found.append([str(depth), *(" ".join(item.text(column).split()) for column in range(5))])
        for number in range(item.childCount()):
            walk(item.child(number), depth + 1)

    for number in range(tree.topLevelItemCount()):
        walk(tree.topLevelItem(number), 0)
    return found


run(story)
