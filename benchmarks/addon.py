# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the add-on costs FreeCAD's window: at start, and in the GUI thread during a commit.

    python benchmarks/addon.py [--freecad 1.1] [--pairs 15] [--links 1000] [--parts 200]

start     FreeCAD's start with the add-on and without it, in turn, each a process of its own; the difference
          of the medians, in processor time (wall time is shown too, but other programs disturb it more).
          Goal: under 50 ms.
commit    an assembly of single links to part files is committed to a server on this machine. A timer of 1 ms
          in the GUI thread finds every moment in which the window could not react. The times that FreeCAD
          needed for the save itself, and ours for the snapshot, are measured apart and taken off.
          Goal: no other block of more than 100 ms.
drawing   the pane is given a commit of an assembly with 10 000 findings, and 2000 events in one burst.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "freecad"), str(ROOT / "mods")]

from freecad_cases.machines import freecads  # noqa: E402
from gui_cases.window import Window, window  # noqa: E402

INSIDE = Path(__file__).parent / "addon_inside"


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--freecad", metavar="VERSION", help="only this one (default: all on this machine)")
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--links", type=int, default=1000)
    parser.add_argument("--parts", type=int, default=200)
    args = parser.parse_args()
    chosen = [args.freecad] if args.freecad else sorted(freecads())
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for version in chosen:
        with tempfile.TemporaryDirectory(prefix="silo-bench-") as folder:
            start(version, Path(folder).resolve() / "start", args.pairs)
            commit(version, Path(folder).resolve() / "commit", args.links, args.parts)


def start(version: str, folder: Path, pairs: int) -> None:
    """The start, paired."""
    folder.mkdir()
    with window(version, folder) as freecad:
        freecad.prepare()
        addon = freecad.home / "Mod" / "Silo"
        aside = freecad.home / "Silo-aside"
        with_it: list[dict[str, float]] = []
        without: list[dict[str, float]] = []
        # The first run of each fills caches and compiles Python files.
        for number in range(pairs + 1):
            one = measure(freecad)
            addon.rename(aside)
            other = measure(freecad)
            aside.rename(addon)
            if number:
                with_it.append(one)
                without.append(other)
    for kind in ("cpu", "wall"):
        a = statistics.median(one[kind] for one in with_it)
        b = statistics.median(one[kind] for one in without)
        paired = statistics.median(x[kind] - y[kind] for x, y in zip(with_it, without, strict=True))
        print(
            f"{version:6} start   {kind:4} with {a * 1e3:7.0f} ms, without {b * 1e3:7.0f} ms, "
            f"pairs differ by {paired * 1e3:+5.0f} ms"
        )


def measure(freecad: Window) -> dict[str, float]:
    """One start."""
    told = freecad.run(str(INSIDE / "start.py"))
    return {"cpu": told["cpu"], "wall": told["wall"]}


def commit(version: str, folder: Path, links: int, parts: int) -> None:
    """The commit, and the drawing."""
    folder.mkdir()
    with window(version, folder) as freecad:
        freecad.prepare()
        env = {"SILO_BENCH_LINKS": str(links), "SILO_BENCH_PARTS": str(parts)}
        told: dict[str, Any] = freecad.run(str(INSIDE / "commit.py"), env=env)
    print(
        f"{version:6} commit  {links} links to {parts} parts: save {told['save']:.0f} ms, snapshot "
        f"{told['snapshot']:.0f} ms, longest other block {told['block']:.0f} ms, all sent after "
        f"{told['sent']:.0f} ms"
    )
    print(
        f"{version:6} drawing 10 000 findings: {told['box']:.0f} ms; 2000 events: longest block "
        f"{told['burst']:.0f} ms"
    )


if __name__ == "__main__":
    main()
