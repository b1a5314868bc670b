# SPDX-License-Identifier: LGPL-2.1-or-later
"""The inertia stage of STEP assemblies: ours against the usual way, in one run.

    python benchmarks/inertia_step.py [FILE.step …] [--repeats 5] [--data FOLDER]

Without files: the example arm, and the public STEP files where they are at hand. Every measurement is a
process of its own, ours and the usual way in turn. It reports medians of CPU time (the machine may have other
work); ratios are medians of the pairs.

ours     each product measured once (tolerance 1e-8, instances placed in numpy), without and with the mesh
         cross-check, which the usual way does not have
usual    volume, centre and tensor of every instance by the kernel's default integration, as CadQuery,
         build123d and FreeCAD do it: three integrations per instance
imports  are not counted in either (inertia_aggregate.py reports them)
read     the kernel's own reading of the file, which both need; not in the ratios
error    of the whole assembly's volume, against an integration at 1e-11
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PUBLIC = ROOT.parent / "shared" / "data" / "step"

OURS = """
import json, resource, sys, time
from pathlib import Path
import numpy as np
from silo.inertia.placements import place
from silo.inertia.rigid import combine_arrays
from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.geometry.helpers import Helpers
from silo.inertia.geometry.step import read_step
from silo.inertia.geometry.worker import without
without("scipy", "networkx")
import trimesh.triangles
occt.quiet()
marks = {}
def report(stage, done, total):
    marks.setdefault(stage, time.process_time())
options = ReadOptions(mesh_check=sys.argv[2] == "mesh", eps=float(sys.argv[3]))
begin = time.process_time()
with Helpers() as nobody:
    assembly = read_step(Path(sys.argv[1]), options, report, nobody).assembly
parts = [assembly.prototypes[i.prototype] for i in assembly.instances]
volume, com, unit = place(
    [p.volume_m3 for p in parts], np.array([p.com_m for p in parts]),
    np.array([p.inertia_unit for p in parts]), np.array([i.transform for i in assembly.instances]))
whole = combine_arrays(volume, com, unit)
end = time.process_time()
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps({"read": marks["measuring"] - begin, "stage": end - marks["measuring"], "memory": memory,
    "volume": whole.mass * 1e9, "instances": len(parts), "parts": len(assembly.prototypes)}))
"""

USUAL = """
import json, resource, sys, time
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from silo.inertia.geometry import kernel as occt
occt.quiet()
begin = time.process_time()
reader = STEPControl_Reader()
reader.ReadFile(sys.argv[1])
reader.TransferRoots()
shape = reader.OneShape()
loaded = time.process_time()
total, solids = 0.0, 0
explorer = TopExp_Explorer(shape, TopAbs_SOLID)
while explorer.More():
    solid = explorer.Current()
    for wanted in ("Mass", "CentreOfMass", "MatrixOfInertia"):
        found = GProp_GProps()
        BRepGProp.VolumeProperties_s(solid, found)
        value = getattr(found, wanted)()
        if wanted == "Mass":
            total += value
    solids += 1
    explorer.Next()
end = time.process_time()
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps({"read": loaded - begin, "stage": end - loaded, "memory": memory, "volume": total,
    "instances": solids}))
"""


def measured(code: str, *words: object) -> dict[str, Any]:
    """One process; what it printed last."""
    env = {
        **os.environ,
        "PYTHONPATH": str(ROOT / "mods"),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, words)], env=env, capture_output=True, text=True, check=True
    )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def median(runs: Sequence[dict[str, Any]], key: str) -> float:
    """Of one figure."""
    return statistics.median(float(run[key]) for run in runs)


def machine() -> str:
    """Processors and load, so that figures can be judged."""
    load = ", ".join(f"{x:.1f}" for x in os.getloadavg()) if hasattr(os, "getloadavg") else "unknown"
    return f"Python {sys.version.split()[0]}, {os.cpu_count()} processors, load {load}"


def compared(path: Path, repeats: int) -> None:
    """Print one file's line."""
    ways: dict[str, Callable[[], dict[str, Any]]] = {
        "usual": lambda: measured(USUAL, path),
        "ours": lambda: measured(OURS, path, "bare", 1e-8),
        "mesh": lambda: measured(OURS, path, "mesh", 1e-8),
    }
    runs: dict[str, list[dict[str, Any]]] = {name: [] for name in ways}
    for _ in range(repeats):
        for name, run in ways.items():
            runs[name].append(run())
    exact = measured(OURS, path, "bare", 1e-11)["volume"]

    def ratio(name: str) -> float:
        pairs = zip(runs["usual"], runs[name], strict=True)
        return statistics.median(u["stage"] / o["stage"] for u, o in pairs)

    def error(name: str) -> float:
        return float(runs[name][0]["volume"]) / exact - 1 if exact else 0.0

    one = runs["ours"][0]
    print(
        f"{path.name:<30} {one['instances']:>6}/{one['parts']:<4}"
        f" {median(runs['ours'], 'read'):8.2f} {median(runs['usual'], 'stage'):8.3f}"
        f" {median(runs['ours'], 'stage'):8.3f} {ratio('ours'):6.1f}x"
        f" {median(runs['mesh'], 'stage'):8.3f} {ratio('mesh'):6.1f}x"
        f" {median(runs['mesh'], 'memory'):6.0f} {error('usual'):+9.1e} {error('ours'):+9.1e}",
        flush=True,
    )


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--data", type=Path, default=PUBLIC, help="folder of public STEP files")
    args = parser.parse_args()
    public = sorted(p for p in args.data.glob("*") if p.suffix.lower() in (".stp", ".step"))
    files = args.files or [ROOT / "examples" / "arm" / "arm.step", *public]
    print(f"CPU seconds, medians of {args.repeats}; {machine()}")
    print(
        f"{'file':<30} {'inst':>6}/{'part':<4} {'read':>8} {'usual':>8} {'ours':>8} {'ratio':>7}"
        f" {'+ mesh':>8} {'ratio':>7} {'MB':>6} {'err usual':>9} {'err ours':>9}"
    )
    for path in files:
        compared(path, args.repeats)


if __name__ == "__main__":
    main()
