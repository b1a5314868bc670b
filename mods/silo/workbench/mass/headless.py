# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs inside ``freecadcmd``: the geometry of one assembly, measured there and left in a file.

The file that ``SILO_ARGS_FILE`` names holds a JSON object: ``top`` (the file), ``options`` (as the readers of
geometry take them), ``result`` (where the assembly goes), ``lines`` (where progress goes, one JSON object per
line; the last one says ``done`` or has the ``error``). :mod:`silo.freecadcmd.mass` is the other side.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any, TextIO

if sys.version_info < (3, 11):  # noqa: UP036  (FreeCAD brings its own Python, whatever ours is)
    sys.exit(f"Silo needs Python 3.11 or newer; this FreeCAD has {sys.version.split()[0]}")

if __name__ == "__main__":
    # Run by path: this very copy of the package is meant, also where an installed add-on was loaded at start.
    for _name in [name for name in sys.modules if name == "silo" or name.startswith("silo.")]:
        del sys.modules[_name]
    sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from silo.bom.errors import ConfigError, SiloError
from silo.files import job_text
from silo.workbench.headless import error_json

BETWEEN_LINES_S = 0.2


def main() -> int:
    """Do the job of the environment; the exit code."""
    job = json.loads(job_text(os.environ) or "")
    with open(job["lines"], "a", encoding="utf-8") as out:
        _line(out, begun=job["top"])
        try:
            _measure(job, out)
        except SiloError as error:
            _line(out, error=error_json(error))
            return 1
        _line(out, done=True)
    return 0


def _measure(job: dict[str, Any], out: TextIO) -> None:
    try:
        import numpy  # noqa: F401
    except ImportError as error:
        raise ConfigError("this FreeCAD's Python has no numpy, which masses need") from error
    from silo.fcstd import Library
    from silo.inertia.geometry import store
    from silo.inertia.geometry.options import ReadOptions
    from silo.workbench.freecad import saving
    from silo.workbench.mass import shapes

    # What could harm FreeCAD is not opened, and what is wrong with a file is reported in our reader's words.
    Library().open(job["top"])
    assembly = shapes.read_live(
        saving.open_fully(job["top"]), ReadOptions.from_content(job["options"]), _teller(out)
    )
    store.save(assembly, Path(job["result"]))


def _teller(out: TextIO) -> Any:
    told = 0.0

    def report(stage: str, done: int, total: int) -> None:
        nonlocal told
        if (now := time.monotonic()) - told >= BETWEEN_LINES_S:
            told = now
            _line(out, stage=stage, number=done, total=total)

    return report


def _line(out: TextIO, **data: Any) -> None:
    out.write(json.dumps(data) + "\n")
    out.flush()


if __name__ == "__main__":
    sys.exit(main())
