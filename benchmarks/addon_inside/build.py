# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD without a window: an assembly of links to part files, all of them items of the server."""

from __future__ import annotations

import json
import os
from pathlib import Path

import FreeCAD as App

FOLDER = Path(os.environ["SILO_BENCH_FOLDER"])
LINKS = int(os.environ["SILO_BENCH_LINKS"])
TOP, *PARTS = json.loads(os.environ["SILO_BENCH_IDS"])

boxes = []
for number, identity in enumerate(PARTS):
    doc = App.newDocument(f"Part{number}")
    boxes.append(doc.addObject("Part::Box", "Box"))
    doc.Meta = {"SiloUUID": identity}
    doc.recompute()
    doc.saveAs(str(FOLDER / f"Part{number}.FCStd"))
doc = App.newDocument("Top")
assembly = doc.addObject("App::Part", "Assembly")
assembly.Type = "Assembly"
doc.Meta = {"SiloUUID": TOP}
doc.saveAs(str(FOLDER / "Top.FCStd"))
links = []
for number in range(LINKS):
    link = doc.addObject("App::Link", f"L{number}")
    link.LinkedObject = boxes[number % len(boxes)]
    links.append(link)
assembly.Group = links
doc.recompute()
doc.save()
