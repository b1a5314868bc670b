# SPDX-License-Identifier: LGPL-2.1-or-later
"""How long 10 000 placed parts take once their shapes are measured: placing, summing up, the whole report.

    python benchmarks/inertia_aggregate.py [--instances N] [--repeat N]

It prints the median of N runs: `aggregate` is the numeric stage (place every instance, sum up every link),
`loop` the same sums one instance after the other as most tools do, `report` everything from BOM matching to
the finished report. Import times are those of a fresh process.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from silo.inertia.arrays import Floats
from silo.inertia.assembly import Assembly, Instance
from silo.inertia.bom.parser import BOMParser
from silo.inertia.calculation import calculate
from silo.inertia.links.frames import origin_frame
from silo.inertia.materials.table import load_materials
from silo.inertia.placements import place
from silo.inertia.rigid import MassProps, combine_arrays
from silo.inertia.task import Task

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

PARTS, LINKS, DENSITY = 20, 20, 7850.0


def assembly(count: int) -> Assembly:
    """``count`` instances of 20 boxes in 20 links, anywhere."""
    from bodies import box, placement

    rng = np.random.default_rng(1)
    prototypes = {f"part {n}": box(f"part {n}", 0.01 + 0.001 * n, 0.02, 0.03) for n in range(PARTS)}
    instances = tuple(
        Instance(
            (f"link {k % LINKS}", f"i{k}"),
            (f"link {k % LINKS}", f"part {k % PARTS}"),
            f"part {k % PARTS}",
            placement(rng.uniform(-1, 1, 3), origin_frame((0, 0, 0), rng.uniform(-3, 3, 3))[:3, :3]),
        )
        for k in range(count)
    )
    return Assembly("scale", prototypes, instances)


def arrays(asm: Assembly) -> tuple[Floats, Floats, Floats, Floats]:
    """Volumes, centres, tensors and placements of all instances."""
    parts = [asm.prototypes[i.prototype] for i in asm.instances]
    return (
        np.array([p.volume_m3 for p in parts]),
        np.array([p.com_m for p in parts]),
        np.array([p.inertia_unit for p in parts]),
        np.array([i.transform for i in asm.instances]),
    )


def aggregate(volumes: Floats, coms: Floats, units: Floats, placements: Floats) -> list[MassProps]:
    """The numeric stage, as silo does it."""
    volume, com, unit = place(volumes, coms, units, placements)
    mass = volume * DENSITY
    link = np.arange(len(mass)) % LINKS
    return [combine_arrays(mass[link == k], com[link == k], unit[link == k] * DENSITY) for k in range(LINKS)]


def loop(
    volumes: Floats, coms: Floats, units: Floats, placements: Floats
) -> list[tuple[float, Floats, Floats]]:
    """The same sums, one instance after the other."""
    sums = [(0.0, np.zeros(3), np.zeros((3, 3))) for _ in range(LINKS)]
    for k in range(len(volumes)):
        turn, shift = placements[k][:3, :3], placements[k][:3, 3]
        mass = volumes[k] * DENSITY
        com = turn @ coms[k] + shift
        tensor = turn @ units[k] @ turn.T * DENSITY + mass * (
            np.dot(com, com) * np.eye(3) - np.outer(com, com)
        )
        total, first, second = sums[k % LINKS]
        sums[k % LINKS] = (total + mass, first + mass * com, second + tensor)
    return [
        (m, c / m, t - m * (np.dot(c / m, c / m) * np.eye(3) - np.outer(c / m, c / m))) for m, c, t in sums
    ]


def median_ms(run: Callable[[], object], repeat: int) -> float:
    """Median time of ``run`` [ms]."""
    times = []
    for _ in range(repeat):
        started = time.perf_counter()
        run()
        times.append(time.perf_counter() - started)
    return statistics.median(times) * 1e3


def import_ms(module: str, repeat: int) -> float:
    """What importing ``module`` adds to starting Python [ms]."""

    def start(code: str) -> float:
        return median_ms(lambda: subprocess.run([sys.executable, "-c", code], check=True), repeat)

    return start(f"import {module}") - start("pass")


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--instances", type=int, default=10_000)
    parser.add_argument("--repeat", type=int, default=7)
    args = parser.parse_args()
    asm = assembly(args.instances)
    values = arrays(asm)
    rows = "".join(f"part {n},{args.instances // PARTS},steel,\n" for n in range(PARTS))
    table = BOMParser().parse_bytes(f"Name,Quantity,Material,Mass\n{rows}".encode())
    task = Task(materials=load_materials(freecad=False))
    ours, naive = aggregate(*values), loop(*values)
    worst = max(
        float(np.abs(a.inertia - b[2]).max() / np.abs(b[2]).max()) for a, b in zip(ours, naive, strict=True)
    )
    print(f"{args.instances} instances of {PARTS} parts in {LINKS} links, median of {args.repeat}")
    print(f"  aggregate {median_ms(lambda: aggregate(*values), args.repeat):8.1f} ms")
    slow = median_ms(lambda: loop(*values), args.repeat)
    print(f"  loop      {slow:8.1f} ms  (largest difference {worst:.1e})")
    print(f"  report    {median_ms(lambda: calculate(asm, table, task), args.repeat):8.1f} ms")
    for module in ("silo.inertia", "silo.inertia.bom", "silo.inertia.assembly", "silo.inertia.calculator"):
        print(f"  import {module:<26} {import_ms(module, args.repeat):8.1f} ms")


if __name__ == "__main__":
    main()
