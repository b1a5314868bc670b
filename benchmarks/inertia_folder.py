# SPDX-License-Identifier: LGPL-2.1-or-later
"""A folder of many single STEP files, the parts of one split assembly, read by one process and by two.

    python benchmarks/inertia_folder.py [--parts 60] [--repeats 3] [--processes 2]

Writes an assembly file without geometry and so many part files beside it (blocks with rounded edges and bored
holes, each of another size), as SolidWorks and CATIA do, and reads it without the cache. Goal: two processes
take 1.7 times less wall time than one, on two idle processors. The numbers must be equal to the last bit.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from inertia_step import ROOT, machine, measured, median

sys.path.insert(0, str(ROOT / "tests" / "support"))

READ = """
import hashlib, json, resource, sys, time
from pathlib import Path
begin = time.perf_counter()
from silo.inertia.geometry import ReadOptions, read
assembly = read(Path(sys.argv[1]), options=ReadOptions(cache=False, processes=int(sys.argv[2])))
end = time.perf_counter()
child = resource.getrusage(resource.RUSAGE_CHILDREN)
parts = sorted((p.name, p.volume_m3, p.com_m.tolist(), p.inertia_unit.tolist())
    for p in assembly.prototypes.values())
print(json.dumps({"wall": end - begin, "cpu": child.ru_utime + child.ru_stime, "parts": len(parts),
    "memory": child.ru_maxrss / 1024, "numbers": hashlib.sha256(repr(parts).encode()).hexdigest()}))
"""


def block(number: int) -> Any:
    """A block with rounded edges and holes; no two are of one size."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    shape = BRepPrimAPI_MakeBox(60.0 + number / 7, 30.0, 20.0).Shape()
    fillet = BRepFilletAPI_MakeFillet(shape)
    edges = TopExp_Explorer(shape, TopAbs_EDGE)
    while edges.More():
        fillet.Add(3.0, TopoDS.Edge(edges.Current()))
        edges.Next()
    shape = fillet.Shape()
    for k in range(10):
        for y in (8.0, 15.0, 22.0):
            axis = gp_Ax2(gp_Pnt(6 + 5 * k, y, -1), gp_Dir(0, 0, 1))
            shape = BRepAlgoAPI_Cut(shape, BRepPrimAPI_MakeCylinder(axis, 1.5, 40.0).Shape()).Shape()
    return shape


def write(folder: Path, count: int) -> Path:
    """The assembly file, whose products hold nothing, and its parts."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from step_writer import StepDocument, emptied, trsf_of

    document = StepDocument()
    top = document.assembly("top")
    names = [f"part{number:03d}" for number in range(count)]
    for number, name in enumerate(names):
        # What is emptied stays in the file's text: a box, so that the kernel does not read each part twice.
        empty = document.part(BRepPrimAPI_MakeBox(1, 1, 1).Shape(), name)
        document.place(top, empty, trsf_of((100.0 * number, 0, 0)), name)
        part = StepDocument()
        part.part(block(number), name)
        part.write(folder / f"{name}.step")
    return emptied(document.write(folder / "top.step"), *names)


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--parts", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--write", type=Path, help="only write the files into this folder")
    args = parser.parse_args()
    if args.write:
        write(args.write, args.parts)
        return
    with tempfile.TemporaryDirectory(prefix="silo-bench-") as name:
        words = ["--write", name, "--parts", str(args.parts)]
        subprocess.run([sys.executable, __file__, *words], check=True)
        runs: dict[int, list[dict[str, Any]]] = {1: [], args.processes: []}
        for _ in range(args.repeats):
            for processes, found in runs.items():
                found.append(measured(READ, Path(name) / "top.step", processes))
    size = "one process, then several, in turn"
    print(f"{args.parts} part files, {size}; medians of {args.repeats}; {machine()}")
    for processes, found in runs.items():
        print(
            f"  {processes} process{'es' if processes > 1 else '  '} wall {median(found, 'wall'):6.2f} s,"
            f" CPU {median(found, 'cpu'):6.2f} s, largest process {median(found, 'memory'):5.0f} MB"
        )
    pairs = zip(runs[1], runs[args.processes], strict=True)
    ratio = statistics.median(one["wall"] / other["wall"] for one, other in pairs)
    numbers = {run["numbers"] for found in runs.values() for run in found}
    print(f"  {ratio:.2f} times faster; numbers {'equal' if len(numbers) == 1 else 'DIFFER'}")


if __name__ == "__main__":
    main()
