# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs inside FreeCAD: measures ``SILO_TOP`` as the mass window does, into ``SILO_OUT``."""

from __future__ import annotations

import os
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, os.environ["SILO_MODS"])

from silo.inertia.geometry.options import ReadOptions  # noqa: E402
from silo.inertia.geometry.stored import save  # noqa: E402
from silo.workbench.freecad import shapes  # noqa: E402
from silo.workbench.freecad.opening import open_fully  # noqa: E402

document = open_fully(os.environ["SILO_TOP"])
save(shapes.read_live(document, ReadOptions(), lambda *_: None), Path(os.environ["SILO_OUT"]))
