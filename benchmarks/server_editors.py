# SPDX-License-Identifier: LGPL-2.1-or-later
"""Fifty editors at work on the same assemblies for five minutes, with two hundred listeners.

    python benchmarks/server_editors.py [sqlite] [postgres] [--editors N] [--seconds S] [--listeners N]

Each editor merges, adds, changes and removes lines, imports, decides, undoes and reads, on a few shared
assemblies, as fast as it is answered. What counts: no answer but good ones and honest 400 (nothing to decide
any more), 404 (the line is gone), 409, 412 and 503 with ``Retry-After``; at the end every history folds to
the state, versions have no gap, and no listener that stayed lost an event.
"""

from __future__ import annotations

import argparse
import asyncio
import random
import statistics
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from server_testing import Api, Databases, ServerProcess, bom, merge_body

TOKEN = "silo_benchmark_0123456789abcdef"
ASSEMBLIES, PARTS = 8, 60
HONEST = {400, 404, 409, 412, 503}


class Editor:
    """One editor with a seeded mind of its own."""

    def __init__(self, api: Api, seed: int, assemblies: list[str], parts: list[str]) -> None:
        self.api, self.chance = api, random.Random(seed)
        self.assemblies, self.parts = assemblies, parts
        self.statuses: Counter[int] = Counter()
        self.faults: list[str] = []
        self.times: dict[str, list[float]] = {"read": [], "change": []}

    def call(self, method: str, path: str, value: Any = None, **more: Any) -> Any:
        """One request; what is neither good nor honest is a fault."""
        started = time.perf_counter()
        answer = self.api.call(method, path, value, **more)
        self.times["read" if method == "GET" else "change"].append(time.perf_counter() - started)
        self.statuses[answer.status] += 1
        unhonest = answer.status == 503 and "retry-after" not in answer.headers
        if answer.status >= 300 and (answer.status not in HONEST or unhonest):
            self.faults.append(f"{method} {path}: {answer.status} {answer.body[:200]!r}")
        return answer

    def work(self, end: float) -> None:
        """Do one thing after another until ``end``."""
        deeds: list[Callable[[str], None]] = [
            *[self.merge, self.add, self.change, self.change, self.remove, self.take_in],
            *[self.decide, self.undo, self.read, self.read, self.read],
        ]
        while time.monotonic() < end:
            self.chance.choice(deeds)(self.chance.choice(self.assemblies))

    def merge(self, parent: str) -> None:
        """A sync of some of the parts, sent twice as by a client that lost the answer."""
        chosen = self.chance.sample(self.parts, self.chance.randint(1, 30))
        body = merge_body(
            {p: self.chance.randint(1, 9) for p in chosen}, sync_id=f"{self.chance.getrandbits(64)}"
        )
        first = self.call("POST", bom(parent, "merge"), body)
        again = self.call("POST", bom(parent, "merge"), body)
        if first.status == again.status == 200 and first.body != again.body:
            self.faults.append(f"{parent}: the same sync got two answers")

    def add(self, parent: str) -> None:
        """A line by hand."""
        body = {"child_part_number": self.chance.choice(self.parts), "quantity": self.chance.randint(1, 9)}
        self.call("POST", bom(parent), body)

    def line(self, parent: str) -> tuple[dict[str, Any] | None, dict[str, str]]:
        """One of the lines as they are now, and the header that says which version that was."""
        read = self.call("GET", bom(parent))
        lines = read.json() if read.status == 200 else []
        return (self.chance.choice(lines) if lines else None), {"If-Match": read.headers.get("etag", "*")}

    def change(self, parent: str) -> None:
        """Another quantity, from what was read just before."""
        line, headers = self.line(parent)
        if line is not None:
            path = bom(parent, f"lines/{line['id']}")
            self.call("PUT", path, {"quantity": self.chance.randint(1, 9)}, headers=headers)

    def remove(self, parent: str) -> None:
        """Take a line out."""
        line, headers = self.line(parent)
        if line is not None:
            self.call("DELETE", bom(parent, f"lines/{line['id']}"), headers=headers)

    def take_in(self, parent: str) -> None:
        """Import a CSV."""
        rows = "".join(f"{p},{self.chance.randint(1, 9)}\r\n" for p in self.chance.sample(self.parts, 5))
        headers = {"Content-Type": "text/csv"}
        self.call(
            "POST", bom(parent, "import"), body=("Part number,Quantity\r\n" + rows).encode(), headers=headers
        )

    def decide(self, parent: str) -> None:
        """Settle what a merge left open."""
        review = self.call("GET", bom(parent, "review"))
        open_ones = review.json()["unreferenced"] if review.status == 200 else []
        if open_ones:
            action = self.chance.choice(["keep", "remove"])
            decision = {"line_id": self.chance.choice(open_ones)["id"], "action": action}
            self.call("POST", bom(parent, "resolve"), {"decisions": [decision]})

    def undo(self, parent: str) -> None:
        """Take the newest change back."""
        found = self.call("GET", bom(parent, "history?limit=1"))
        if found.status == 200 and found.json():
            self.call("POST", bom(parent, "undo"), {"change_id": found.json()[0]["id"]})

    def read(self, parent: str) -> None:
        """What people look at."""
        rest = self.chance.choice(["expanded", "flat", "review", "history", "where-used", "export.csv"])
        self.call("GET", bom(parent, rest))


async def listen(base_url: str, seen: list[int], up: asyncio.Semaphore) -> None:
    """One listener; notes the number of each event."""
    parts = urlsplit(base_url)
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port, limit=1 << 22)
    writer.write(f"GET /api/events HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {TOKEN}\r\n\r\n".encode())
    while (await reader.readline()) != b": connected\n":
        pass
    await reader.readline()  # the id of the greeting
    up.release()
    try:
        while line := await reader.readline():
            if line.startswith(b"id: "):
                seen.append(int(line[4:].partition(b"-")[0]))
    finally:
        writer.close()


async def run(api: Api, args: argparse.Namespace) -> list[str]:
    """Let everybody work; the problems that were found."""
    parts = await asyncio.to_thread(api.items, PARTS)
    assemblies = await asyncio.to_thread(api.items, ASSEMBLIES)
    up = asyncio.Semaphore(0)
    seen: list[list[int]] = [[] for _ in range(args.listeners)]
    tasks = [asyncio.create_task(listen(api.base_url, mine, up)) for mine in seen]
    for _ in tasks:
        await up.acquire()
    end = time.monotonic() + args.seconds
    editors = [Editor(api.as_(TOKEN), args.seed * 1000 + n, assemblies, parts) for n in range(args.editors)]
    threads = [threading.Thread(target=editor.work, args=(end,)) for editor in editors]
    for thread in threads:
        thread.start()
    for thread in threads:
        await asyncio.to_thread(thread.join)
    # The connections from before are idle for longer than a server keeps them.
    api = Api(api.base_url, TOKEN)
    report(editors)
    await asyncio.sleep(5)  # the last events are on their way to two hundred listeners
    for task in tasks:
        task.cancel()
    problems = [fault for editor in editors for fault in editor.faults]
    for parent in assemblies:
        problems += await asyncio.to_thread(history_problems, api, parent)
    longest = max(seen, key=len)
    problems += [f"a listener saw {len(m)} of {len(longest)} events" for m in seen if m != longest]
    print(f"  {len(longest)} events to each listener")
    api.close()
    return problems


def history_problems(api: Api, parent: str) -> list[str]:
    """What is wrong with one history: gaps, or a fold that is not the state."""
    changes: list[dict[str, Any]] = []
    before = ""
    while page := api.get(bom(parent, "history") + f"?limit=500{before}"):
        changes.extend(page)
        before = f"&before={page[-1]['id']}"
    versions = [change["version"] for change in reversed(changes) if change["line_count"]]
    problems = [] if versions == list(range(1, len(versions) + 1)) else [f"{parent}: versions have a gap"]
    folded: dict[str, Any] = {}
    for change in reversed(changes):
        for line in api.get(bom(parent, f"history/{change['id']}"))["lines"] if change["line_count"] else ():
            if line["before"] != folded.get(line["line_id"]):
                problems.append(f"{parent}: change {change['id']} begins from another state")
            folded[line["line_id"]] = line["after"]
    kept = {i: (s["quantity"], s["source"]) for i, s in folded.items() if s is not None}
    now = {line["id"]: (line["quantity"], line["source"]) for line in api.get(bom(parent))}
    return problems if kept == now else [*problems, f"{parent}: the history does not fold to the BOM"]


def report(editors: list[Editor]) -> None:
    """Figures."""
    statuses = sum((editor.statuses for editor in editors), Counter[int]())
    print(f"  {sum(statuses.values())} requests: {dict(sorted(statuses.items()))}", flush=True)
    for kind in ("read", "change"):
        times = sorted(t for editor in editors for t in editor.times[kind])
        p99 = times[int(len(times) * 0.99)]
        print(f"  {kind}: median {statistics.median(times) * 1e3:.0f} ms, p99 {p99 * 1e3:.0f} ms")


def main() -> int:
    """Both databases, or the one that is named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", help="sqlite, postgres; both where none is named")
    parser.add_argument("--editors", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--listeners", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    bad = 0
    for kind in args.kinds or ["sqlite", "postgres"]:
        with tempfile.TemporaryDirectory() as folder:
            databases = Databases(Path(folder))
            print(
                f"{kind}: {args.editors} editors, {args.seconds:g} s, {args.listeners} listeners", flush=True
            )
            with (
                ServerProcess(databases.new(kind), Path(folder) / "files", TOKEN) as server,
                Api(server.base_url, TOKEN) as api,
            ):
                problems = asyncio.run(run(api, args))
            databases.close()
            print(f"  problems: {len(problems)}", *problems[:20], sep="\n    ", flush=True)
            bad += len(problems)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
