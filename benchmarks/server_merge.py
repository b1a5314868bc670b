# SPDX-License-Identifier: LGPL-2.1-or-later
"""How long the server takes for BOMs of 100 to 10 000 lines, and how that grows; SQLite and PostgreSQL.

    python benchmarks/server_merge.py [sqlite] [postgres] [--repeat N]

Measured at the client, over HTTP on the loopback, the median of N: the first merge (all lines new), the same
merge again (no change), a merge in which every quantity changed, one with every line unreferenced, and the
read of the BOM. Then the expanded tree of 100 000 occurrences, once with few and once with many distinct
lines.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from silo_server.db.database import Database
from silo_server.services.items import NewItem, create_item
from silo_server.settings import Settings

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from server_testing import Api, Databases, ServerProcess, bom, merge_body

SIZES = (100, 1_000, 10_000)
TOKEN = "silo_benchmark_0123456789abcdef"


def main() -> None:
    """Run and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", default=["sqlite", "postgres"])
    parser.add_argument("--repeat", type=int, default=5)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        databases = Databases(Path(folder))
        try:
            for kind in args.kinds:
                measure(kind, databases.new(kind), Path(folder) / f"files-{kind}", args.repeat)
        finally:
            databases.close()


def measure(kind: str, url: str, files: Path, repeat: int) -> None:
    """One database."""
    with ServerProcess(url, files, TOKEN) as server, Api(server.base_url, TOKEN) as api:
        make_items(url, files, "P", max(SIZES))
        make_items(url, files, "ASM", 200)
        print(f"\n{kind}, median of {repeat} [ms]")
        print(
            f"{'lines':>7} {'first':>8} {'again':>8} {'changed':>8} {'unref.':>8} {'read':>8} {'µs/line':>8}"
        )
        number = 0
        for size in SIZES:
            rows: dict[str, list[float]] = {}
            for _ in range(repeat):
                number += 1
                for name, value in one_size(api, f"ASM-{number}", size).items():
                    rows.setdefault(name, []).append(value)
            medians = {name: statistics.median(values) * 1e3 for name, values in rows.items()}
            line = " ".join(f"{medians[name]:8.1f}" for name in ("first", "again", "changed", "gone", "read"))
            print(f"{size:7} {line} {medians['first'] * 1e3 / size:8.1f}")
        for label, shape in (("5 000 distinct lines", (20, 5, 1_000)), ("100 000 distinct", None)):
            times = expanded(api, url, files, label, shape, repeat)
            print(f"expanded tree of 100 000 occurrences, {label}: {statistics.median(times) * 1e3:.0f} ms")


def one_size(api: Api, parent: str, size: int) -> dict[str, float]:
    """The merges of one assembly; seconds by name."""
    first = {f"P-{n}": 1 + n % 7 for n in range(1, size + 1)}
    other = {number: quantity + 1 for number, quantity in first.items()}
    return {
        "first": seconds(lambda: api.good("POST", bom(parent, "merge"), merge_body(first))),
        "again": seconds(lambda: api.good("POST", bom(parent, "merge"), merge_body(first))),
        "changed": seconds(lambda: api.good("POST", bom(parent, "merge"), merge_body(other))),
        "gone": seconds(lambda: api.good("POST", bom(parent, "merge"), merge_body({}))),
        "read": seconds(lambda: api.get(bom(parent))),
    }


def expanded(
    api: Api, url: str, files: Path, label: str, shape: tuple[int, int, int] | None, repeat: int
) -> list[float]:
    """Build a tree of about 100 000 occurrences and read it ``repeat`` times; seconds."""
    prefix = "W" if shape else "V"
    if shape:
        tops, kinds, leaves = shape  # one top uses 5 sub-assemblies, each under 20 groups
        make_items(url, files, prefix, 1 + tops + kinds)
        groups = {f"{prefix}-{2 + n}": 1 for n in range(tops)}
        subs = {f"{prefix}-{2 + tops + n}": 2 for n in range(kinds)}
        api.merge(f"{prefix}-1", groups)
        for group in groups:
            api.merge(group, subs)
        for number, sub in enumerate(subs):
            api.merge(sub, {f"P-{1 + (number * 1000 + n) % 10_000}": 1 for n in range(leaves)})
    else:
        make_items(url, files, prefix, 11)
        api.merge(f"{prefix}-1", {f"{prefix}-{2 + n}": 1 for n in range(10)})
        for n in range(10):
            api.merge(f"{prefix}-{2 + n}", {f"P-{m}": 1 for m in range(1, 10_001)})
    times = []
    for _ in range(repeat):
        started = time.perf_counter()
        answer = api.call("GET", bom(f"{prefix}-1", "expanded"))
        times.append(time.perf_counter() - started)
        assert answer.status == 200, answer.body[:200]
    count = len(answer.json())
    assert 99_000 < count < 101_000, count
    return times


def make_items(url: str, files: Path, prefix: str, count: int) -> None:
    """Items PREFIX-1 … PREFIX-count, without HTTP."""
    db = Database(Settings(database_url=url, files_dir=files))
    with db.write() as tx:
        for n in range(1, count + 1):
            create_item(tx, NewItem(part_number=f"{prefix}-{n}", name=f"Part {n}"))
        tx.pending.clear()
    db.close()


def seconds(action: Callable[[], object]) -> float:
    """How long ``action`` takes."""
    started = time.perf_counter()
    action()
    return time.perf_counter() - started


if __name__ == "__main__":
    main()
