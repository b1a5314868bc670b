# SPDX-License-Identifier: LGPL-2.1-or-later
"""Processor time until something happens: the command line, the BOM of a small file, importing the server.

    python benchmarks/startup.py [--runs N]

The least of N runs, each a process of its own, with the goal that it has. Runs on a machine with something
else to do show more.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TOP = ROOT / "examples" / "gearbox" / "TopAssembly.FCStd"
SILO_MOD = Path(sys.executable).with_name("silo-mod")
WALK = f"""
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
with Library() as library:
    extract(choose_assembly(library.open({str(TOP)!r})))
"""


def cpu_ms(command: list[str | Path], runs: int) -> float:
    """Return the least processor time of a command."""
    times = []
    for _ in range(runs):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times) * 1e3


def registering(count: int) -> Callable[[], object]:
    """Return what makes the table of ``count`` files with one content."""
    from silo.bom.entry import BomEntry
    from silo.bom.items.proposal import Proposal
    from silo.registering.candidate import Candidate, ComponentState
    from silo.registering.offer import Offer
    from silo.registering.table import write_table

    def candidate(number: int) -> Candidate:
        entry = BomEntry(f"/v/{number}.FCStd", object_name="Body")
        return Candidate(Proposal(entry, str(number), "part", "M01"), ComponentState.READY, sha256="same")

    offer = Offer(tuple(map(candidate, range(count))), {"M01": "Machined part"})
    return lambda: write_table(offer, lambda _: True, "/v")


def blocking(assemblies: int, count: int) -> Callable[[], object]:
    """Return what finds the errors of each of many assemblies among ``count`` findings."""
    from dataclasses import replace

    from silo.bom.entry import BomEntry
    from silo.bom.findings import Finding, FindingCode, Place, Severity
    from silo.bom_sync.resolved import Resolved, blocking

    findings = tuple(
        Finding(FindingCode.MISSING_FILE, Severity.ERROR, "m", (Place(f"/v/{number % assemblies}.FCStd"),))
        for number in range(count)
    )
    whole = Resolved(BomEntry("/v/top.FCStd", object_name="Top"), (), (), findings)
    heads = [BomEntry(f"/v/{number}.FCStd", object_name="A") for number in range(assemblies)]
    return lambda: [blocking(replace(whole, assembly=head)) for head in heads]


def main() -> None:
    """Print each figure beside its goal."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    walk = cpu_ms([sys.executable, "-c", WALK], runs)
    figures: list[tuple[str, float, float]] = [
        ("silo-mod --version", cpu_ms([SILO_MOD, "--version"], runs), 120),
        ("silo-mod --help", cpu_ms([SILO_MOD, "--help"], runs), 120),
        ("silo-mod bom, above the walk", cpu_ms([SILO_MOD, "bom", TOP], runs) - walk, 100),
        ("import silo_server.run", cpu_ms([sys.executable, "-c", "import silo_server.run"], runs), 800),
    ]
    for name, act, goal in (
        ("table of 4 000 equal files", registering(4000), 1000.0),
        ("errors of 800 assemblies, 4 000 findings", blocking(800, 4000), 100.0),
    ):
        begin = time.process_time()
        act()
        figures.append((name, (time.process_time() - begin) * 1e3, goal))
    print(f"{'the walk alone':44}{walk:8.0f} ms")
    for name, found, goal in figures:
        print(f"{name:44}{found:8.0f} ms   goal {goal:g} ms")


if __name__ == "__main__":
    main()
