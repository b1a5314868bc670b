# SPDX-License-Identifier: LGPL-2.1-or-later
# FreeCAD runs this at start where it has a window; see Init.py for what is possible here.
import sys

if sys.version_info < (3, 11):
    FreeCAD.Console.PrintError(
        "Silo needs a FreeCAD with Python 3.11 or newer; this one has %d.%d.\n" % sys.version_info[:2]
    )
else:
    from silo.workbench.start import start

    start()
