# SPDX-License-Identifier: LGPL-2.1-or-later
"""Qt, through FreeCAD's own ``PySide``: the only file that imports it.

The shim differs between versions (measured): FreeCAD 0.20 has no ``PySide.QtWidgets``, its ``QtGui`` holds
the widgets; PySide2 5.15 has only ``exec_``, PySide6 only ``exec``; every version takes enumerations spelled
in full.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from PySide import QtCore, QtGui

try:
    from PySide import QtWidgets
except ImportError:
    QtWidgets = QtGui

# PySide6 has it among the others of QtGui, PySide2 among the widgets.
QShortcut = getattr(QtGui, "QShortcut", None) or QtWidgets.QShortcut

__all__ = [
    "QShortcut",
    "QtCore",
    "QtGui",
    "QtWidgets",
    "Relay",
    "ask_where_to_save",
    "copy",
    "later",
    "open_url",
    "run_dialog",
    "tell_at_pointer",
]


class Relay(QtCore.QObject):  # type: ignore[misc]  # PySide has no types
    """Runs calls in the GUI thread, whatever thread posts them. Make it in the GUI thread."""

    _posted = QtCore.Signal(object)

    def __init__(self, on_error: Callable[[BaseException], None] | None = None) -> None:
        super().__init__()
        self._on_error = on_error
        self._posted.connect(self._run, QtCore.Qt.ConnectionType.QueuedConnection)

    def post(self, call: Callable[[], None]) -> None:
        """Let the GUI thread run ``call`` soon; returns at once."""
        try:
            self._posted.emit(call)
        except RuntimeError:
            # FreeCAD is closing: the C++ half of this object is gone.
            return

    def _run(self, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception as error:  # noqa: BLE001  # an exception may not pass through Qt's event loop
            if self._on_error is not None:
                self._on_error(error)
        from silo.workbench.garbage import collect_due

        # Long work reports its progress through here, so garbage does not pile up meanwhile.
        collect_due()


def later(milliseconds: int, call: Callable[[], None]) -> None:
    """Run ``call`` in the GUI thread after a while; 0 means after the present event."""
    QtCore.QTimer.singleShot(milliseconds, call)


def run_dialog(dialog: Any) -> bool:
    """Show a dialog and wait until it is closed; True if it was accepted."""
    execute = getattr(dialog, "exec", None) or dialog.exec_
    return bool(execute())


def open_url(url: str) -> bool:
    """Open a page in the browser; returns False if there is none."""
    return bool(QtGui.QDesktopServices.openUrl(QtCore.QUrl(url)))


def tell_at_pointer(text: str) -> None:
    """Show a text where the person has just clicked; it disappears by itself."""
    QtWidgets.QToolTip.showText(QtGui.QCursor.pos(), text)


def ask_where_to_save(parent: Any, title: str, name: str) -> str:
    """Let a user choose a path for a new file; "" if they choose none."""
    return str(QtWidgets.QFileDialog.getSaveFileName(parent, title, name)[0])


def copy(text: str) -> None:
    """Put text on the clipboard."""
    QtWidgets.QApplication.clipboard().setText(text)


@contextmanager
def wait_cursor() -> Iterator[None]:
    """Show the cursor of a busy window during the block."""
    QtWidgets.QApplication.setOverrideCursor(QtCore.Qt.CursorShape.WaitCursor)
    try:
        yield
    finally:
        QtWidgets.QApplication.restoreOverrideCursor()
