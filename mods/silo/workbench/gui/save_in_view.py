# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD 0.20's own save, for any document: the one way there to take the mark of unsaved edits away.

It is a message to a 3D view. A document that a link has loaded has no view, so it gets one for the moment
(0.3 s, measured). FreeCAD asks whether to save the files below as well; the answer is no, for the caller
this decides about each file.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from silo.workbench.freecad import host
from silo.workbench.gui.qt import QtCore, QtWidgets


def save_in_view(doc: Any) -> None:
    """Save a document that has a file."""
    view = host.view_of(doc)
    with _answering_no():
        if view.ActiveView is not None:
            view.sendMsgToViews("Save")
        elif not doc.InList:
            # Its file is saved; the mark stays, for closing the last view of such a document closes it.
            doc.save()
        else:
            with host.same_active_document(), _passing_view(doc):
                view.sendMsgToViews("Save")


@contextmanager
def _passing_view(doc: Any) -> Iterator[None]:
    """Keep a 3D view open during the block, without showing it."""
    window = host.main_window()
    area = window.findChild(QtWidgets.QMdiArea)
    window.setUpdatesEnabled(False)
    try:
        before, was = area.subWindowList(), area.activeSubWindow()
        host.activate(doc)
        host.run_command("Std_ViewCreate")
        made = [widget for widget in area.subWindowList() if widget not in before]
        try:
            yield
        finally:
            for widget in made:
                widget.close()
            if was is not None:
                area.setActiveSubWindow(was)
    finally:
        window.setUpdatesEnabled(True)


@contextmanager
def _answering_no() -> Iterator[None]:
    """Answer No if FreeCAD asks about the files below."""

    def answer() -> None:
        box = QtWidgets.QApplication.activeModalWidget()
        if isinstance(box, QtWidgets.QMessageBox):
            no = box.button(QtWidgets.QMessageBox.StandardButton.No)
            if no is not None:
                no.click()

    timer = QtCore.QTimer()
    timer.timeout.connect(answer)
    timer.start(0)
    try:
        yield
    finally:
        timer.stop()
