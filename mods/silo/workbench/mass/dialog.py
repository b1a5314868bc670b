# SPDX-License-Identifier: LGPL-2.1-or-later
"""The mass window. It draws :mod:`silo.workbench.mass.rows`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from silo.bom.message import message
from silo.workbench.gui import qt, widgets
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.tone import Tone
from silo.workbench.words import plain, tip, translate

if TYPE_CHECKING:
    from silo.workbench.mass.rows import MassRow, MassView


NUMBERS = (1, 2, 3, 4)

MOST_NOTES = 50


class MassDialog(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """Not modal: one looks at the model while one reads it."""

    def __init__(self, content: MassView, parent: Any) -> None:
        super().__init__(parent)
        self._content = content
        title = translate("Silo", "Mass of {name}", name=plain(content.title, 80))
        layout = widgets.lay_out(self, "SiloMass", title, 900, 520)
        self.summary = widgets.label(content.summary, bold=True)
        layout.addWidget(self.summary)
        if content.incomplete:
            layout.addWidget(widgets.label(content.incomplete, Tone.WARNING))
        self.table = self._make_table()
        layout.addWidget(self.table, 1)
        if content.notes:
            notes = "\n".join(plain(note, 300) for note in content.notes[:MOST_NOTES])
            layout.addWidget(widgets.label(notes, Tone.QUIET))
        tip = translate("Silo", "Copy the table, for a spreadsheet")
        copy = widgets.button(translate("Silo", "Copy"), "copy", self._copy, tip)
        close = widgets.button(translate("Silo", "Close"), "close", self.close, default=True)
        layout.addLayout(widgets.line(copy, None, close))

    def headings(self) -> tuple[str, ...]:
        """Return the headings of the columns."""
        return (
            translate("Silo", "Part"),
            translate("Silo", "Quantity"),
            translate("Silo", "Mass of one"),
            translate("Silo", "Mass"),
            translate("Silo", "Volume of one, cm³"),
            translate("Silo", "Material"),
            translate("Silo", "Remarks"),
        )

    def _make_table(self) -> Any:
        tree = widgets.tree("rows", self.headings(), NUMBERS)
        tree.setAlternatingRowColors(True)
        for row in self._content.rows:
            tree.addTopLevelItem(self._item(row, tree))
        for column in range(6):
            tree.resizeColumnToContents(column)
        return tree

    def _item(self, row: MassRow, tree: Any) -> Any:
        item = QtWidgets.QTreeWidgetItem([plain(cell, 200) for cell in row.cells()])
        for column in NUMBERS:
            item.setTextAlignment(column, QtCore.Qt.AlignmentFlag.AlignRight)
        if row.doubtful:
            item.setToolTip(6, tip(row.why))
            item.setForeground(6, widgets.brush(Tone.WARNING, tree))
        return item

    def _copy(self) -> None:
        """Copy the table to the clipboard, with plain numbers in kg."""
        name, quantity, mass, whole, *rest = self.headings()
        qt.copy(
            self._content.table(
                (name, quantity, message("{mass}, kg", mass=mass), message("{whole}, kg", whole=whole), *rest)
            )
        )
