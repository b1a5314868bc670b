# SPDX-License-Identifier: LGPL-2.1-or-later
# FreeCAD runs this at start, with and without a window. It is executed inside a function: there is no
# __file__, and names made here are invisible in functions. So: plain statements only, real code is in silo.
import os
import sys

found = ""
for entry in list(sys.path):
    mods = os.path.join(entry, "mods")
    if os.path.isfile(os.path.join(mods, "silo", "workbench", "start.py")):
        sys.path.remove(entry)  # else "import tests" and "import docs" would find ours
        found = found or mods
if found and found not in sys.path:
    sys.path.insert(0, found)
if found:
    FreeCAD.__unit_test__ += ["silo.workbench.smoke"]
