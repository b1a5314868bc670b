# SPDX-License-Identifier: LGPL-2.1-or-later
"""Build the fixtures with the FreeCAD that runs this::

    SILO_CASES_OUT=folder freecadcmd -c 'import runpy; runpy.run_path(".../build.py", run_name="__main__")'

``SILO_CASES`` may name some cases, separated by commas.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from freecad_cases import bench, control, counting, files, further, hardware, identities  # noqa: E402

# Imported for the cases that they register.
MODULES = (control, counting, files, further, hardware, identities)

out = Path(os.environ["SILO_CASES_OUT"])
built = bench.build(out, filter(None, os.environ.get("SILO_CASES", "").split(",")))
(out / "built.json").write_text(json.dumps({"freecad": list(bench.VERSION), "built": built}, indent=1) + "\n")
