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
        FreeCAD.Console.PrintError(
            f"Silo does not start: another package named silo was loaded before, from {place}. "
            "Remove it, or the add-on that brings it, then start FreeCAD again.\n"
        )
    else:
        from silo.workbench.start import start

        start()
