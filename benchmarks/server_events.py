# SPDX-License-Identifier: LGPL-2.1-or-later
"""How long a merge takes to reach 1 000 listeners, and whether any event is lost.

    python benchmarks/server_events.py [sqlite] [postgres] [--clients N] [--merges N] [--workers N]

Each listener holds a plain HTTP connection to ``/api/events``. The merges of a small BOM are posted one after
another; told is the time from sending the merge (so including it and its commit) and from its answer (the
commit is behind it) to the event's arrival, over all listeners. Server and listeners share the machine.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path
from urllib.parse import urlsplit

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from server_testing import Api, Databases, ServerProcess, bom, merge_body

TOKEN = "silo_benchmark_0123456789abcdef"


async def listen(host: str, port: int, arrivals: dict[str, list[float]], up: asyncio.Semaphore) -> None:
    """One listener: notes when each merge (known by its sync_id) arrived."""
    reader, writer = await asyncio.open_connection(host, port, limit=1 << 20)
    request = f"GET /api/events HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {TOKEN}\r\n\r\n"
    writer.write(request.encode())
    while (await reader.readline()) != b": connected\n":
        pass
    up.release()
    try:
        while line := await reader.readline():
            if line.startswith(b'data: {"type":"bom_merge"'):
                arrivals.setdefault(json.loads(line[6:])["sync_id"], []).append(time.perf_counter())
    finally:
        writer.close()


async def run(base_url: str, clients: int, merges: int) -> None:
    """Connect, merge, and print what was measured."""
    parts = urlsplit(base_url)
    arrivals: dict[str, list[float]] = {}
    up = asyncio.Semaphore(0)
    tasks = []
    started = time.perf_counter()
    for _ in range(clients):
        tasks.append(asyncio.create_task(listen(parts.hostname or "", parts.port or 80, arrivals, up)))
        if len(tasks) % 50 == 0:
            for _ in range(50):
                await up.acquire()
    connected = time.perf_counter() - started
    sent, answered = await asyncio.to_thread(post_merges, base_url, merges, arrivals, clients)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    lost = sum(clients - len(times) for times in arrivals.values())
    from_sending = sorted(t - sent[key] for key, times in arrivals.items() for t in times)
    from_answer = sorted(t - answered[key] for key, times in arrivals.items() for t in times)
    print(f"{clients} listeners ({connected:.1f} s to connect), {merges} merges, lost {lost}")
    for name, values in (("from sending the merge", from_sending), ("from its answer", from_answer)):
        p99 = values[int(len(values) * 0.99) - 1]
        print(
            f"  {name}: median {statistics.median(values) * 1e3:.0f} ms, p99 {p99 * 1e3:.0f} ms, "
            f"slowest {values[-1] * 1e3:.0f} ms"
        )


def post_merges(
    base_url: str, merges: int, arrivals: dict[str, list[float]], clients: int
) -> tuple[dict[str, float], dict[str, float]]:
    """The merges, one after another, each when the one before has reached everybody."""
    sent, answered = {}, {}
    with Api(base_url, TOKEN) as api:
        parent, *children = api.items(11)
        for n in range(merges):
            key = f"merge-{n}"
            body = merge_body(dict.fromkeys(children, n + 1), sync_id=key)
            sent[key] = time.perf_counter()
            api.good("POST", bom(parent, "merge"), body)
            answered[key] = time.perf_counter()
            deadline = time.monotonic() + 20
            while len(arrivals.get(key, ())) < clients and time.monotonic() < deadline:
                time.sleep(0.02)
    return sent, answered


def main() -> None:
    """Run on both databases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", default=["sqlite", "postgres"])
    parser.add_argument("--clients", type=int, default=1000)
    parser.add_argument("--merges", type=int, default=30)
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        databases = Databases(Path(folder))
        try:
            for kind in args.kinds:
                url = databases.new(kind)
                with ServerProcess(url, Path(folder) / kind, TOKEN, workers=args.workers) as server:
                    print(f"\n{kind}, {args.workers} worker(s)")
                    asyncio.run(run(server.base_url, args.clients, args.merges))
        finally:
            databases.close()


if __name__ == "__main__":
    main()
