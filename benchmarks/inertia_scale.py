# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a STEP file with thousands of placed parts to the finished report: wall, CPU and memory.

    python benchmarks/inertia_scale.py [--instances 10000] [--repeats 5] [--usual 1000] [--nested]
    python benchmarks/inertia_scale.py --entities 2000000 [--repeats 1]

Writes an assembly of 20 parts (plates with holes, grooved rings, rounded blocks) placed N times, flat in the
top assembly, or with ``--nested`` in 20 sub-assemblies. Goal: 10 000 in 3.3 s of wall time on two
idle processors, and 350 MB.

whole     `silo-mod`'s own way: child process with its limits, mesh cross-check, report; no cache. CPU and
          memory are those of parent and child; the memory is the larger one's peak.
cached    the same again, from the cache
entities  instead: a file of so many entities (2 million are 104 MB), where no part is like another, on one
          core and on all; goal: 300 s and 1.5 GB on one core
stage     the inertia stage alone against the usual way (inertia_step.py), at ``--usual`` instances
"""

from __future__ import annotations

import argparse
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from inertia_step import OURS, ROOT, USUAL, machine, measured, median

sys.path.insert(0, str(ROOT / "tests" / "support"))

PARTS = 20

WHOLE = """
import json, resource, sys, time
from pathlib import Path
begin = time.perf_counter()
from silo.inertia.bom.parser import BOMParser
from silo.inertia.calculation import calculate
from silo.inertia.calculator import read_geometry
from silo.inertia.task import Task
from silo.inertia.geometry import ReadOptions
from silo.inertia.materials.table import load_materials
options = ReadOptions(
    cache=sys.argv[2] == "cache", cache_dir=Path(sys.argv[3]), processes=int(sys.argv[4]), timeout_s=3000
)
assembly = read_geometry(sys.argv[1], options)
read = time.perf_counter()
rows = "".join(f"part {n},steel\\n" for n in range(20))
table = BOMParser().parse_bytes(("Name,Material\\n" + rows).encode())
report = calculate(assembly, table, Task(materials=load_materials(freecad=False)))
end = time.perf_counter()
me, child = (resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
print(json.dumps({"wall": end - begin, "report": end - read,
    "cpu": sum(u.ru_utime + u.ru_stime for u in (me, child)),
    "memory": max(me.ru_maxrss, child.ru_maxrss) / 1024,
    "mass": sum(p.mass for p in report.link_properties.values())}))
"""


def parts() -> list[Any]:
    """Twenty different solids."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeTorus
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    def plate(n: int) -> Any:
        shape = BRepPrimAPI_MakeBox(60.0 + n, 30.0, 6.0).Shape()
        for k in range(4):
            axis = gp_Ax2(gp_Pnt(10 + 12 * k, 15, -1), gp_Dir(0, 0, 1))
            shape = BRepAlgoAPI_Cut(shape, BRepPrimAPI_MakeCylinder(axis, 3.0, 9.0).Shape()).Shape()
        return shape

    def ring(n: int) -> Any:
        outer = BRepPrimAPI_MakeCylinder(12.0 + n, 8.0).Shape()
        bored = BRepAlgoAPI_Cut(outer, BRepPrimAPI_MakeCylinder(6.0, 8.0).Shape()).Shape()
        return BRepAlgoAPI_Cut(bored, BRepPrimAPI_MakeTorus(12.0 + n, 2.0).Shape()).Shape()

    def rounded(n: int) -> Any:
        block = BRepPrimAPI_MakeBox(20.0 + n, 20.0, 20.0).Shape()
        fillet = BRepFilletAPI_MakeFillet(block)
        edges = TopExp_Explorer(block, TopAbs_EDGE)
        while edges.More():
            fillet.Add(3.0, TopoDS.Edge(edges.Current()))
            edges.Next()
        return fillet.Shape()

    return [(plate, ring, rounded)[n % 3](n) for n in range(PARTS)]


def write_large(path: Path, entities: int) -> Path:
    """A perforated plate, a grooved ring, a rounded block and a lofted body, each again and again."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.TopoDS import TopoDS_Compound
    from step_writer import StepDocument

    builder, holes = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(holes)
    for n in range(120):
        axis = gp_Ax2(gp_Pnt(10 + n % 12 * 12, 10 + n // 12 * 12, -1), gp_Dir(0, 0, 1))
        builder.Add(holes, BRepPrimAPI_MakeCylinder(axis, 4.0, 9.0).Shape())
    plate = BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(152.0, 128.0, 6.0).Shape(), holes).Shape()
    loft = BRepOffsetAPI_ThruSections(True, False)
    for height, (width, depth) in enumerate([(20, 30), (28, 22), (18, 26), (24, 20)]):
        loft.AddWire(_ellipse(width, depth, 12.0 * height))
    document = StepDocument()
    for number, shape in enumerate([plate, *parts()[1:3], loft.Shape()]):
        document.part(shape, f"part {number}")
    text = document.write(path).read_text("ascii")
    head, rest = text.split("DATA;\n", 1)
    data, tail = rest.rsplit("ENDSEC;", 1)
    each = data.count(";\n")
    highest = max(int(number) for number in re.findall(r"^#(\d+)", data, re.MULTILINE))
    with path.open("w", encoding="ascii") as stream:
        stream.write(f"{head}DATA;\n")
        for copy in range(-(-entities // each)):
            moved = re.sub(r"#(\d+)", lambda found, by=copy * highest: f"#{int(found[1]) + by}", data)
            stream.write(
                re.sub(
                    r"PRODUCT\('part (\d)','part \d'", rf"PRODUCT('part \1 {copy}','part \1 {copy}'", moved
                )
            )
        stream.write(f"ENDSEC;{tail}")
    return path


def _ellipse(width: float, depth: float, height: float) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeWire
    from OCP.gp import gp_Ax2, gp_Dir, gp_Elips, gp_Pnt

    along = gp_Dir(1, 0, 0) if width >= depth else gp_Dir(0, 1, 0)
    axes = gp_Ax2(gp_Pnt(0, 0, height), gp_Dir(0, 0, 1), along)
    edge = BRepBuilderAPI_MakeEdge(gp_Elips(axes, max(width, depth), min(width, depth))).Edge()
    return BRepBuilderAPI_MakeWire(edge).Wire()


def write(path: Path, count: int, nested: bool) -> Path:
    """The assembly as a STEP file."""
    from step_writer import StepDocument, trsf_of

    from silo.inertia.links.frames import origin_frame

    random = np.random.default_rng(1)
    document = StepDocument()
    made = [document.part(shape, f"part {n}") for n, shape in enumerate(parts())]
    top = document.assembly("top")
    homes = [document.assembly(f"link {n}") for n in range(20)] if nested else [top]
    for k in range(count):
        turn = origin_frame((0, 0, 0), random.uniform(-3, 3, 3))[:3, :3]
        trsf = trsf_of(random.uniform(-1000, 1000, 3), turn)
        document.place(homes[k % len(homes)], made[k % PARTS], trsf, f"i{k}")
    if nested:
        for home in homes:
            document.place(top, home)
    return document.write(path)


def written(path: Path, *words: object) -> Path:
    """The assembly, by a process of its own, whose memory peak the measured processes do not inherit."""
    words = ("--write", path, *words)
    subprocess.run([sys.executable, __file__, *map(str, words)], check=True)
    return path


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--instances", type=int, default=10_000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--usual", type=int, default=1000, help="instances for the comparison; 0: none")
    parser.add_argument("--nested", action="store_true")
    parser.add_argument("--entities", type=int, default=0, help="so many of them, of parts that differ")
    parser.add_argument("--write", type=Path, help="only write the assembly to this file")
    args = parser.parse_args()
    if args.write:
        if args.entities:
            write_large(args.write, args.entities)
        else:
            write(args.write, args.instances, args.nested)
        return
    if args.entities:
        _large(args)
        return
    shape = ["--nested"] if args.nested else []
    with tempfile.TemporaryDirectory(prefix="silo-bench-") as name:
        folder = Path(name)
        path = written(folder / "scale.step", "--instances", args.instances, *shape)
        layout = "in 20 sub-assemblies" if args.nested else "flat"
        print(f"{args.instances} instances of {PARTS} parts, {layout}, {path.stat().st_size / 1e6:.1f} MB")
        print(f"medians of {args.repeats}; {machine()}")
        measured(WHOLE, path, "cache", folder / "cache", 0)
        runs: dict[str, list[dict[str, Any]]] = {"no": [], "cache": []}
        for _ in range(args.repeats):
            for way, found in runs.items():
                found.append(measured(WHOLE, path, way, folder / "cache", 0))
        for way, found in runs.items():
            walls = sorted(run["wall"] for run in found)
            print(
                f"  {'cached' if way == 'cache' else 'whole':<7} wall {median(found, 'wall'):6.2f} s"
                f" ({walls[0]:.2f} to {walls[-1]:.2f}), CPU {median(found, 'cpu'):6.2f} s,"
                f" {median(found, 'memory'):5.0f} MB, of it the report {median(found, 'report'):5.2f} s"
            )
        if args.usual:
            _against_usual(written(folder / "usual.step", "--instances", args.usual, *shape), args)


def _large(args: argparse.Namespace) -> None:
    with tempfile.TemporaryDirectory(prefix="silo-bench-") as name:
        path = written(Path(name) / "large.step", "--entities", args.entities)
        print(f"{path.stat().st_size / 1e6:.0f} MB of parts that differ; {machine()}")
        for processes in (1, 0):
            runs = [measured(WHOLE, path, "no", name, processes) for _ in range(args.repeats)]
            print(
                f"  {'one core' if processes else 'all cores'}: wall {median(runs, 'wall'):.0f} s, "
                f"CPU {median(runs, 'cpu'):.0f} s, {median(runs, 'memory'):.0f} MB"
            )


def _against_usual(path: Path, args: argparse.Namespace) -> None:
    repeats = min(args.repeats, 3)
    ways = (("usual", USUAL, ()), ("bare", OURS, ("bare", 1e-8)), ("mesh", OURS, ("mesh", 1e-8)))
    runs: dict[str, list[dict[str, Any]]] = {name: [] for name, _, _ in ways}
    for _ in range(repeats):
        for name, code, words in ways:
            runs[name].append(measured(code, path, *words))
    print(f"  stage at {args.usual} instances: usual {median(runs['usual'], 'stage'):.2f} s CPU")
    for name in ("bare", "mesh"):
        pairs = zip(runs["usual"], runs[name], strict=True)
        ratio = statistics.median(u["stage"] / o["stage"] for u, o in pairs)
        print(f"    ours, {name}: {median(runs[name], 'stage'):.3f} s, {ratio:.1f} times less")


if __name__ == "__main__":
    main()
