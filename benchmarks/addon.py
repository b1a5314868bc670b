# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the add-on costs FreeCAD's window: at start, during a commit, and over a hostile document.

    python benchmarks/addon.py [start] [commit] [hostile] [--freecad 1.1] [--pairs 15] [--links 1000]

start     FreeCAD's start with the add-on and without it, in turn, each a process of its own; the median of
          the differences, and the difference of the least. Goal: under 50 ms.
commit    an assembly of single links to part files is committed to a server on this machine, six times. A
          timer of 1 ms in the GUI thread finds every moment in which the window could not react. The times
          that FreeCAD needed for the save itself, and ours for the snapshot, are measured apart and taken
          off; the median of the commits after the first, which imports modules. Goal: no other block of more
          than 100 ms. Then the pane is given a commit with 10 000 findings, and 2000 events in one burst.
hostile   10 000 links to parts with markup and endless names, missing files, rings, copied identities: the
          snapshot, the longest other block of the commit, filling preview and Register Parts, and selecting
          all instances.

Each time is given twice: processor time, and on the wall, which other programs disturb.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / path) for path in ("tests/freecad", "tests/support", "mods")]

from freecad_cases.machines import freecads  # noqa: E402
from gui_cases import hostile_vault  # noqa: E402
from gui_cases.window import Window, window  # noqa: E402

INSIDE = Path(__file__).parent / "addon_inside"
HOSTILE_LINKS = 10_000


def main() -> None:
    """Measure, and print a table."""
    parts: dict[str, Callable[[str, Path, argparse.Namespace], None]] = {
        "start": start,
        "commit": commit,
        "hostile": hostile,
    }
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", nargs="*", help=f"{', '.join(parts)} (default: all)")
    parser.add_argument("--freecad", metavar="VERSION", help="only this one (default: all on this machine)")
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--links", type=int, default=1000)
    parser.add_argument("--parts", type=int, default=200)
    args = parser.parse_args()
    if unknown := set(args.what) - set(parts):
        parser.error(f"no such measurement: {', '.join(sorted(unknown))}")
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; ms of processor time (on the wall)")
    for version in [args.freecad] if args.freecad else sorted(freecads()):
        for name in args.what or parts:
            with tempfile.TemporaryDirectory(prefix="silo-bench-") as folder:
                parts[name](version, Path(folder).resolve(), args)


def start(version: str, folder: Path, args: argparse.Namespace) -> None:
    """The start, paired."""
    with window(version, folder) as freecad:
        addon = freecad.home / "Mod" / "silo-mod"
        aside = freecad.home / "Silo-aside"
        pairs: list[tuple[dict[str, float], dict[str, float]]] = []
        # The first run of each fills caches and compiles Python files.
        for number in range(args.pairs + 1):
            one = measure(freecad)
            addon.rename(aside)
            other = measure(freecad)
            aside.rename(addon)
            if number:
                pairs.append((one, other))
    with_it = median(one for one, _ in pairs)
    without = median(other for _, other in pairs)
    cost = median({kind: one[kind] - other[kind] for kind in one} for one, other in pairs)
    # What disturbs only ever adds, so the least of each side is the truest where the machine has other work.
    least = {
        kind: min(one[kind] for one, _ in pairs) - min(other[kind] for _, other in pairs) for kind in cost
    }
    found = {"with": with_it, "without": without, "the add-on": cost, "by the least of each": least}
    tell(version, "start", found)


def measure(freecad: Window) -> dict[str, float]:
    """One start, in ms."""
    told = freecad.run(str(INSIDE / "start.py"))
    return {kind: 1e3 * told[kind] for kind in ("cpu", "wall")}


def commit(version: str, folder: Path, args: argparse.Namespace) -> None:
    """The commit, and the drawing."""
    with window(version, folder) as freecad:
        build(freecad, args.links, args.parts)
        told: dict[str, Any] = freecad.run(str(INSIDE / "commit.py"))
    first, *others = told["commits"]
    names = {"save": "FreeCAD's save", "snapshot": "snapshot", "block": "longest other block"}
    found = {text: median(one[name] for one in others) for name, text in names.items()}
    found["sent after"] = {"wall": statistics.median(one["sent"]["wall"] for one in others)}
    tell(version, f"commit of {args.links} links to {args.parts} parts", found)
    tell(version, "the first commit", {names["block"]: first["block"]})
    tell(version, "drawing", {"10 000 findings": told["box"], "block by 2000 events": told["burst"]})


def build(freecad: Window, links: int, parts: int) -> None:
    """The assembly, made without a window, which is quicker."""
    with freecad.server.client() as client:
        names = [("A01", "assembly", "Top"), *(("M01", "part", f"Part {n}") for n in range(parts))]
        ids = [client.create_item("kindred-rd", c, name, item_type=kind).id for c, kind, name in names]
    env = {
        **freecad.freecad.profile(freecad.folder / "builder"),
        "SILO_BENCH_FOLDER": str(freecad.vault),
        "SILO_BENCH_LINKS": str(links),
        "SILO_BENCH_IDS": json.dumps(ids),
    }
    run = freecad.freecad.run(INSIDE / "build.py", env, cwd=freecad.folder)
    if run.returncode:
        raise SystemExit(run.stdout)


def hostile(version: str, folder: Path, _args: argparse.Namespace) -> None:
    """The hostile document."""
    with window(version, folder) as freecad:
        with freecad.server.client() as client:
            hostile_vault.write(freecad.vault, client, HOSTILE_LINKS)
        told = freecad.run(str(INSIDE / "hostile.py"))
    names = {
        "snapshot": "snapshot",
        "commit": "longest other block of the commit",
        "preview": "filling the preview",
        "register": "filling Register Parts",
        "show": f"selecting {told['shown']} instances",
    }
    tell(version, f"hostile, {HOSTILE_LINKS} links", {text: told[name] for name, text in names.items()})


def median(values: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Of processor time and wall time, each by itself."""
    known = list(values)
    return {kind: statistics.median(one[kind] for one in known) for kind in known[0]}


def tell(version: str, what: str, found: Mapping[str, Mapping[str, float]]) -> None:
    """One line of the table."""
    parts = []
    for name, times in found.items():
        cpu = f"{times['cpu']:.0f} " if "cpu" in times else ""
        parts.append(f"{name} {cpu}({times['wall']:.0f})")
    print(f"{version:5} {what}: {', '.join(parts)}", flush=True)


if __name__ == "__main__":
    main()
