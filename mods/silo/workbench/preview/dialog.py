# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview window: the assembly's BOM against the server's, and Sync. It draws ``preview.flow``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from silo.bom.errors import SiloError
from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.preview.comparison import Preview
from silo.workbench.preview.rows import MOST_CELL, MOST_ROWS, PreviewRow, RowKind, rows, summary
from silo.workbench.tone import Tone
from silo.workbench.words import counted, plain, spoken, tip, translate

if TYPE_CHECKING:
    from silo.workbench.preview.flow import PreviewFlow

_DATA = QtCore.Qt.ItemDataRole.UserRole
# Of the sentences below the table, only the first are broken into lines.
MOST_WRAPPED = 200

_TONES = {
    RowKind.ADDED: Tone.GOOD,
    RowKind.CHANGED: Tone.CHANGED,
    RowKind.CONFLICT: Tone.ERROR,
    RowKind.UNREFERENCED: Tone.WARNING,
    RowKind.MANUAL: Tone.QUIET,
    RowKind.UNREGISTERED: Tone.WARNING,
    RowKind.MISSING: Tone.ERROR,
    RowKind.NOT_COUNTED: Tone.PLAIN,
    RowKind.OWN: Tone.WARNING,
}
_SIGNS = {
    RowKind.ADDED: "+",
    RowKind.CHANGED: "~",
    RowKind.CONFLICT: "⚡",
    RowKind.UNREFERENCED: "⚠",
    RowKind.MANUAL: "✎",
    RowKind.UNREGISTERED: "?",
    RowKind.OWN: "?",
    RowKind.MISSING: "✗",
    RowKind.UNCHANGED: "=",
}


class Column(NamedTuple):
    """A column of the table: heading, content, and the least and the most width [px]."""

    heading: str
    text: Callable[[PreviewRow], str]
    least: int = 0
    most: int = 0
    is_number: bool = False


# Sentences rather than lines of a BOM.
_WIDE = (RowKind.GROUP, RowKind.NOT_COUNTED, RowKind.HIDDEN_PIECES)
# About what these rows name, the user may say if it counts.
_ANSWERABLE = (RowKind.HIDDEN, RowKind.HIDDEN_PIECES)


class PreviewDialog(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """Not modal: one looks at the model while one reads it."""

    def __init__(self, title: str, path: str, flow: PreviewFlow, parent: Any) -> None:
        super().__init__(parent)
        self._path, self._flow = path, flow
        self.finished.connect(lambda _result: flow.closed(path))
        self._preview: Preview | None = None
        self._columns = self._make_columns()
        text = translate("Silo", "BOM in Silo: {name}", name=plain(title, 80))
        layout = widgets.lay_out(self, "SiloPreview", text, 860, 560)
        self._title = widgets.label("", bold=True)
        self._summary = widgets.label(translate("Silo", "Comparing with Silo…"))
        self._problem = widgets.label("", Tone.ERROR)
        self._problem.hide()
        self.table = self._make_table()
        self._view_text = widgets.label("")
        self._view_text.hide()
        for part in (self._title, self._summary, self._problem, self._view_text):
            layout.addWidget(part)
        layout.addWidget(self.table, 1)
        self._make_options(layout)
        layout.addLayout(self._make_buttons())
        self._enable()

    # -- made once --------------------------------------------------------------------------------------

    def _make_columns(self) -> tuple[Column, ...]:
        """Make the columns; the last has the rest of the width."""
        return (
            Column(
                translate("Silo", "Part number"),
                lambda row: f"{_SIGNS.get(row.kind, '')} {row.number}".strip(),
                130,
                240,
            ),
            Column(translate("Silo", "Name"), lambda row: row.name, 150, 280),
            Column(translate("Silo", "Assembly"), lambda row: row.cad, 66, 110, is_number=True),
            Column(translate("Silo", "In Silo"), lambda row: row.silo, 66, 180, is_number=True),
            Column(translate("Silo", "What a sync does"), lambda row: plain(row.note, MOST_CELL)),
        )

    def _make_table(self) -> Any:
        numbers = [number for number, column in enumerate(self._columns) if column.is_number]
        headings = [column.heading for column in self._columns]
        tree = widgets.tree("rows", headings, numbers, flat=False)
        tree.setAlternatingRowColors(True)
        tree.itemDoubleClicked.connect(lambda *_: self._show())
        return tree

    def _make_options(self, layout: Any) -> None:
        self.changes_only = QtWidgets.QCheckBox(translate("Silo", "Show only lines that differ"))
        self.changes_only.toggled.connect(lambda _on: self._fill())
        self.below = QtWidgets.QCheckBox("")
        self.missing = QtWidgets.QCheckBox(
            translate(
                "Silo", "Sync although links are broken (the lines that they stand for stay as they are)"
            )
        )
        self.missing.toggled.connect(lambda _on: self._enable())
        for box in (self.changes_only, self.below, self.missing):
            layout.addWidget(box)
        self.below.hide()
        self.missing.hide()

    def _make_buttons(self) -> Any:
        button = widgets.button
        self.show_button = button(
            translate("Silo", "Show"),
            "show",
            self._show,
            translate("Silo", "Select the instances in the 3D view and the tree"),
        )
        self.why_button = button(
            translate("Silo", "Why so many?"),
            "why",
            self._why,
            translate("Silo", "Show each chain of links and arrays from the assembly to the part"),
        )
        self.count_button = button(
            translate("Silo", "Count It"),
            "count",
            lambda: self._decide(counts=True),
            translate("Silo", "Count the hidden objects of the selected row; the file keeps that"),
        )
        self.reference_button = button(
            translate("Silo", "Reference"),
            "reference",
            lambda: self._decide(counts=False),
            translate("Silo", "The hidden objects of the selected row count nowhere; the file keeps that"),
        )
        self.refresh_button = button(
            translate("Silo", "Compare again"), "refresh", lambda: self._flow.again(self._path)
        )
        self.verify_button = button(
            translate("Silo", "Compare with 3D view"),
            "verify",
            lambda: self._ask(self._flow.verify),
            translate(
                "Silo",
                "Check that the BOM explains each solid in 3D, and select any other solid",
            ),
        )
        self.relink_button = button(
            translate("Silo", "Mend links"), "relink", lambda: self._ask(self._flow.relink)
        )
        self.relink_button.hide()
        self.view_button = button(translate("Silo", "View in Silo →"), "view", lambda: self._ask(self._view))
        self.register_button = button(
            translate("Silo", "Register Parts…"), "register", lambda: self._flow.register(self._path)
        )
        self.sync_button = button(translate("Silo", "Sync"), "sync", self._sync, default=True)
        close = button(translate("Silo", "Close"), "close", self.close)
        left = (self.show_button, self.why_button, self.refresh_button, self.verify_button, self.view_button)
        self.table.itemSelectionChanged.connect(self._enable_answers)
        answers = (self.count_button, self.reference_button)
        right = (self.relink_button, self.register_button, self.sync_button, close)
        return widgets.line(*left[:2], *answers, *left[2:], None, *right)

    # -- what is shown ----------------------------------------------------------------------------------

    def busy(self) -> None:
        """Show that a comparison is running."""
        self._problem.hide()
        self._summary.setText(translate("Silo", "Comparing with Silo…"))
        self._preview = None
        self._enable()

    def fail(self, error: SiloError) -> None:
        """Show why the comparison failed."""
        self._summary.setText("")
        self._tell(str(error))
        self._enable()

    def fill(self, preview: Preview) -> None:
        """Show a comparison."""
        self._preview = preview
        head = preview.top.resolved.assembly
        self._title.setText(
            plain(" ".join(filter(None, (preview.number, head.name or preview.snapshot.label))))
        )
        self._summary.setText(summary(preview))
        self._tell(self._problems(preview))
        text = translate("Silo", "Sync the {n} sub-assembly that differs too, before this one")
        many = translate("Silo", "Sync the {n} sub-assemblies that differ too, before this one")
        self.below.setText(counted(preview.to_send_below, text, many))
        self.below.setVisible(bool(preview.to_send_below))
        self.missing.setVisible(bool(preview.broken))
        self._fill()
        self._enable()

    def _problems(self, preview: Preview) -> str:
        lines = [preview.note] if preview.note else []
        if not preview.number:
            lines.append(
                translate("Silo", "This assembly has no Silo part number yet. Register it to sync its BOM.")
            )
        if preview.broken:
            text = translate("Silo", "{n} broken link: the BOM is not synced until it is mended.")
            many = translate("Silo", "{n} broken links: the BOM is not synced until they are mended.")
            lines.append(counted(len(preview.broken), text, many))
        return "\n".join(lines)

    def tell_view(self, text: str, *, agrees: bool | None) -> None:
        """Show the result of a comparison with the 3D view, or why a line has this quantity (``agrees``
        None).
        """
        text = spoken(text)
        self._view_text.setText(plain(text, 2000) if "\n" not in text else text)
        widgets.paint(self._view_text, {True: Tone.GOOD, False: Tone.ERROR, None: Tone.PLAIN}[agrees])
        self._view_text.show()

    def _tell(self, text: str) -> None:
        text = spoken(text)
        self._problem.setText(plain(text, 500) if "\n" not in text else text)
        self._problem.setVisible(bool(text))

    def _fill(self) -> None:
        self.table.clear()
        if self._preview is None:
            return
        left = [MOST_ROWS]
        self.table.addTopLevelItems(list(self._items(rows(self._preview), left)))
        if left[0] < 0:
            more = QtWidgets.QTreeWidgetItem(["", translate("Silo", "… and {n} more rows", n=-left[0])])
            self.table.addTopLevelItem(more)
        for number in range(self.table.topLevelItemCount()):
            self._spread(self.table.topLevelItem(number))
        for number, column in enumerate(self._columns[:-1]):
            self.table.resizeColumnToContents(number)
            width = self.table.columnWidth(number) + 12
            self.table.setColumnWidth(number, min(max(width, column.least), column.most))
        self._wrap()

    def _spread(self, item: Any) -> None:
        """Let sentences use the whole width, and open the items that are short enough."""
        item.setFirstColumnSpanned(item.data(1, _DATA) in _WIDE)
        item.setExpanded(item.childCount() <= 12)
        for number in range(item.childCount()):
            self._spread(item.child(number))

    def resizeEvent(self, event: Any) -> None:
        """Break the sentences again for the new width."""
        super().resizeEvent(event)
        QtCore.QTimer.singleShot(0, self._wrap)

    def _wrap(self) -> None:
        """Break the sentences to the present width; the view itself would cut them."""
        tree = self.table
        metrics, whole = tree.fontMetrics(), tree.viewport().width() - 2 * tree.indentation() - 12
        items = QtWidgets.QTreeWidgetItemIterator(tree)
        left, last = MOST_WRAPPED, len(self._columns) - 1
        while left and (item := items.value()) is not None:
            if text := item.data(2, _DATA):
                spanned = item.isFirstColumnSpanned()
                width = whole if spanned else tree.columnWidth(last) - 12
                item.setText(0 if spanned else last, widgets.broken(text, metrics, width))
                left -= 1
            items += 1

    def _items(self, wanted: Iterable[PreviewRow], left: list[int]) -> Iterable[Any]:
        only = self.changes_only.isChecked()
        for row in wanted:
            children = list(self._items(row.children, left))
            if only and row.kind is RowKind.UNCHANGED and not children:
                continue
            left[0] -= 1
            if left[0] >= 0:
                yield self._item(row, children)

    def _item(self, row: PreviewRow, children: list[Any]) -> Any:
        texts = [column.text(row) for column in self._columns]
        if row.kind in _WIDE:
            texts = [" ".join(filter(None, (row.number, row.name or texts[-1])))]
        item = QtWidgets.QTreeWidgetItem(texts)
        item.setData(2, _DATA, "" if row.kind is RowKind.GROUP else texts[-1])
        tone = Tone.ERROR if row.number == "✗" else _TONES.get(row.kind, Tone.PLAIN)
        for number, column in enumerate(self._columns):
            if tone is not Tone.PLAIN:
                item.setForeground(number, widgets.brush(tone, self.table))
            if column.is_number:
                item.setTextAlignment(number, QtCore.Qt.AlignmentFlag.AlignRight)
        if row.kind is RowKind.GROUP:
            widgets.embolden(item)
        if row.note:
            item.setToolTip(len(texts) - 1, tip(row.note))
        what = (row.document, list(row.objects), row.assembly, list(map(list, row.parts)))
        item.setData(0, _DATA, what)
        item.setData(1, _DATA, row.kind.value)
        item.addChildren(children)
        return item

    def _enable(self) -> None:
        preview = self._preview
        ready = preview is not None and bool(preview.number)
        held = preview is not None and bool(preview.broken) and not self.missing.isChecked()
        self.sync_button.setEnabled(ready and not held)
        self.view_button.setEnabled(ready)
        self.register_button.setEnabled(preview is not None and bool(preview.unregistered))
        self.verify_button.setEnabled(preview is not None)
        movable = preview.movable if preview is not None else ()
        self.relink_button.setVisible(bool(movable))
        self._enable_answers()
        self.relink_button.setToolTip(
            tip("\n".join(f"{finding.file} → {finding.did_you_mean}" for finding in movable))
        )

    # -- what is asked for ------------------------------------------------------------------------------

    def _counted(self) -> Any:
        """Return what the selected row stands for: document, objects, assembly, parts."""
        item = self.table.currentItem()
        return (item.data(0, _DATA) if item is not None else None) or ("", (), "", ())

    def _show(self) -> None:
        document, objects, *_ = self._counted()
        if objects:
            self._flow.show(document, tuple(objects))

    def _why(self) -> None:
        document, _, assembly, parts = self._counted()
        if parts:
            self._flow.why(self._path, document, assembly, [(path, name) for path, name in parts])

    def _enable_answers(self) -> None:
        """Offer the answers about hidden objects while one of them is selected."""
        item = self.table.currentItem()
        is_hidden = item is not None and item.data(1, _DATA) in _ANSWERABLE and bool(self._counted()[1])
        for button in (self.count_button, self.reference_button):
            button.setVisible(is_hidden)

    def _decide(self, *, counts: bool) -> None:
        document, objects, *_ = self._counted()
        if objects:
            self._flow.decide(self._path, document, tuple(objects), counts=counts)

    def _sync(self) -> None:
        if self._preview is not None:
            below = self.below.isVisible() and self.below.isChecked()
            self._flow.sync(self._preview, below, self.missing.isChecked())

    def _view(self, preview: Preview) -> None:
        self._flow.view(preview.page)

    def _ask(self, wish: Callable[[Preview], None]) -> None:
        if self._preview is not None:
            wish(self._preview)
