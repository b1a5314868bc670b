# SPDX-License-Identifier: LGPL-2.1-or-later
# FreeCAD runs this at start where it has a window; see Init.py for what is possible here.
import sys

if sys.version_info < (3, 11):  # noqa: UP036  # the one file that an older Python must understand
    FreeCAD.Console.PrintError(
        "Silo needs a FreeCAD with Python 3.11 or newer; this one has {}.{}.\n".format(*sys.version_info)
    )
else:
    import silo

    if not hasattr(silo, "FREECAD_PACKAGES"):
        place = silo.__file__ or list(silo.__path__)
        text = (
            f"Silo does not start: another package named silo was loaded before, from {place}. "
            "Remove it, or the add-on that brings it, then start FreeCAD again."
        )
        FreeCAD.Console.PrintError(text + "\n")
        # In the pane's place, since the report view is often hidden. Nothing of ours can be imported here.
        import FreeCADGui
        from PySide import QtCore, QtGui

        try:
            from PySide import QtWidgets
        except ImportError:
            QtWidgets = QtGui
        pane = QtWidgets.QDockWidget("Database Activity", FreeCADGui.getMainWindow())
        pane.setObjectName("Database Activity")
        words = QtWidgets.QLabel(text)
        words.setTextFormat(QtCore.Qt.TextFormat.PlainText)
        words.setWordWrap(True)
        pane.setWidget(words)
        FreeCADGui.getMainWindow().addDockWidget(QtCore.Qt.DockWidgetArea.RightDockWidgetArea, pane)
    else:
        from silo.workbench.start import start

        start()
