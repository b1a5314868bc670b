# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the command to the mass window: measure the open assembly, with progress and cancel. GUI thread.

Shapes are measured where they are, in FreeCAD's main thread, face by face; in between the window lives, so
that Cancel works. A modal window keeps the person from changing what is being measured.

The mass window. It draws :mod:`silo.workbench.mass.rows`.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from silo.bom.errors import CancelledError, SiloError
from silo.workbench.freecad import host
from silo.workbench.gui import qt, widgets
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.tone import Tone
from silo.workbench.words import plain, tip, translate

if TYPE_CHECKING:
    from silo.workbench.mass.rows import MassRow, MassView

# The window is drawn this often while shapes are measured.
BREATH_S = 0.05
# Small assemblies are measured before anybody could read a progress window.
PATIENCE_MS = 500


class MassFlow:
    """Opens mass windows.

    hardware
        False leaves standard parts out, as the settings say.
    """

    def __init__(self, hardware: bool = True) -> None:
        self._hardware = hardware

    def start(self, doc: Any) -> Any:
        """Measure a document's assembly and show its masses; returns the window, None if there is nothing to
        show.
        """
        title = translate("Silo", "Mass of the assembly")
        try:
            import numpy  # noqa: F401
        except ImportError:
            text = translate("Silo", "This FreeCAD's Python has no numpy, which masses need.")
            widgets.warn(host.main_window(), title, text)
            return None
        try:
            content = self._measured(doc)
        except CancelledError:
            return None
        except SiloError as error:
            widgets.warn(host.main_window(), title, str(error))
            return None
        dialog = MassDialog(content, host.main_window())
        dialog.show()
        return dialog

    def _measured(self, doc: Any) -> Any:
        from silo.inertia.calculation import calculate
        from silo.inertia.geometry.options import ReadOptions
        from silo.inertia.links.link_map import Link, LinkMap
        from silo.inertia.masses import Options
        from silo.inertia.materials.table import load_materials
        from silo.inertia.task import Task
        from silo.workbench.freecad import shapes
        from silo.workbench.mass.rows import shown

        with WaitingWindow(plain(doc.Label, 60)) as waiting:
            assembly = shapes.read_live(doc, ReadOptions(hardware=self._hardware), waiting.report)
        rule = Options(step_density=True, unknown_is_zero=True, own_bom=True)
        # Without anything placed there is nothing for a pattern to match, which would be reported as a fault.
        everything = Link(assembly.name or "assembly", ("**",))
        whole = LinkMap((everything,)) if assembly.instances else None
        task = Task(load_materials(freecad=False), rule, whole, simulated=False)
        return shown(calculate(assembly, None, task))


class WaitingWindow:
    """A progress window with Cancel; :meth:`report` raises CancelledError once it was pressed."""

    def __init__(self, name: str) -> None:
        self._part = ""
        self._last = 0.0
        self._window = QtWidgets.QProgressDialog(host.main_window())
        self._window.setObjectName("SiloMeasuring")
        self._window.setWindowTitle(translate("Silo", "Measuring {name}", name=name))
        self._window.setWindowModality(QtCore.Qt.WindowModality.ApplicationModal)
        self._window.setMinimumDuration(PATIENCE_MS)
        self._window.setRange(0, 0)
        self._window.setLabelText(translate("Silo", "Reading the assembly…"))

    def __enter__(self) -> WaitingWindow:
        self._window.setValue(0)
        return self

    def __exit__(self, *_: object) -> None:
        self._window.reset()
        self._window.deleteLater()

    def report(self, stage: str, done: int, total: int) -> None:
        """Report each part and each face, and let the window draw now and then."""
        if stage == "measuring":
            self._part = translate("Silo", "Part {n} of {total}", n=done, total=total)
            self._window.setRange(0, total)
            self._window.setValue(done - 1)
        now = time.monotonic()
        if now - self._last < BREATH_S:
            return
        self._last = now
        if stage == "measuring faces" and total > 200:
            faces = translate("Silo", "face {n} of {total}", n=done, total=total)
            self._window.setLabelText(f"{self._part}, {faces}")
        elif self._part:
            self._window.setLabelText(self._part)
        QtWidgets.QApplication.processEvents()
        if self._window.wasCanceled():
            raise CancelledError("measuring was cancelled")


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
        qt.copy(self._content.table((name, quantity, f"{mass}, kg", f"{whole}, kg", *rest)))
