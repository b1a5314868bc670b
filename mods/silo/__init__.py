# SPDX-License-Identifier: LGPL-2.1-or-later

# What the add-on needs inside FreeCAD: import name → package. package.xml declares the same.
FREECAD_PACKAGES = {"requests": "requests>=2.31", "pydantic": "pydantic>=2.10"}
