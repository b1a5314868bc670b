# SPDX-License-Identifier: LGPL-2.1-or-later
"""Open each file of ``SILO_FILES`` (a JSON list) in FreeCAD and save it; runs inside FreeCAD."""

from __future__ import annotations

import json
import os

import FreeCAD as App

for path in json.loads(os.environ["SILO_FILES"]):
    doc = App.openDocument(path)
    doc.recompute()
    doc.save()
    for name in list(App.listDocuments()):
        App.closeDocument(name)
