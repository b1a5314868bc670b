# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tests with real FreeCAD share. ``freecad_cases`` beside this file is their common library."""

from __future__ import annotations

import sys
from pathlib import Path

# Test folders are no packages (import mode "importlib"), so the library is made known by its folder.
if str(Path(__file__).parent) not in sys.path:
    sys.path.insert(0, str(Path(__file__).parent))
