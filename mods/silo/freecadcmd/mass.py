# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry of a FreeCAD assembly, read and measured by FreeCAD itself: no other kernel is needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from silo.folders import scratch_folder
from silo.freecadcmd.run import FreeCADRun, find_freecadcmd, told_error
from silo.inertia.geometry import store
from silo.inertia.geometry.options import Progress, ReadOptions
from silo.inertia.model import Assembly

SCRIPT = Path(__file__).resolve().parents[1] / "workbench" / "mass" / "headless.py"


def read_in_freecad(
    path: str | Path,
    options: ReadOptions | None = None,
    *,
    command: str | None = None,
    env: Mapping[str, str] | None = None,
) -> Assembly:
    """The assembly of one FCStd file as FreeCAD opens it; what it links to may lie anywhere.

    options
        ``eps``, ``mesh_check``, ``object_name``, ``max_instances``, ``timeout_s``, ``progress`` and
        ``cancelled`` count. There is no memory limit and no cache here.

    Raises DocumentError, ConfigError (no FreeCAD, or one that does not start), CancelledError.
    """
    options = options or ReadOptions()
    # FreeCAD is started in a folder of its own.
    top = str(Path(path).absolute())
    freecadcmd = find_freecadcmd(command)
    with scratch_folder("silo-mass-") as folder:
        result = Path(folder) / "result.npz"
        content = {**options.content_options(), "root": None}
        job = {"top": top, "result": str(result), "options": content}
        run = FreeCADRun(freecadcmd, SCRIPT, job, options.timeout_s or 1e9, env or {}, options.cancelled)
        with run:
            finished = _followed(run, options.progress)
        if not finished:
            raise run.failure(top)
        assembly, _ = store.load(result)
    return replace(assembly, source=str(path))


def _followed(run: FreeCADRun, progress: Callable[[Progress], None] | None) -> bool:
    """True where FreeCAD wrote that it is done."""
    for line in run.lines():
        if "error" in line:
            raise told_error(line["error"])
        if line.get("done"):
            return True
        if progress is not None and "stage" in line:
            progress(Progress(line["stage"], line["number"], line["total"]))
    return False
