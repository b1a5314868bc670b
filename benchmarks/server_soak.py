# SPDX-License-Identifier: LGPL-2.1-or-later
"""A server under mixed load for hours: does anything grow that should not?

    python benchmarks/server_soak.py [sqlite|postgres] [--minutes 30] [--restarts 2]

Editors merge, edit, undo, import, upload, read and search; listeners come and go; the server is restarted
now and then. Twelve times in each third memory, descriptors, threads, database connections, the write-ahead
log, the rows that housekeeping bounds, latencies and the server's CPU time for each request are taken. Ends
with an error where the last third's median is above the first's by more than a quarter (and by more than a
noise that is named below), where an answer was no honest one, or where an editor or a listener could not do
its work. Latencies are printed only: they also show what else the machine does.
"""

from __future__ import annotations

import argparse
import math
import os
import random
import re
import statistics
import sys
import tempfile
import threading
import time
import uuid
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

from sqlalchemy import NullPool, create_engine, text

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from server_testing import Api, Databases, ServerProcess, bom, form_body, merge_body

TOKEN = "silo_soak_0123456789abcdef"
EDITORS = 4
HONEST = {200, 201, 204, 404, 409, 412, 503}
# What a measure may differ by without meaning anything: memory and wal in MB, cpu in ms, the others counts.
NOISE = {
    "memory": 20.0,
    "descriptors": 10,
    "threads": 5,
    "connections": 5,
    "wal": 8.0,
    "events": 300,
    "syncs": 300,
    "cpu": 3.0,
    "latency": math.inf,
}


def main() -> None:
    """Load, sample, compare the thirds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", nargs="?", default="sqlite", choices=["sqlite", "postgres"])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--restarts", type=int, default=2)
    args = parser.parse_args()
    samples: dict[str, list[float]] = defaultdict(list)
    bad: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        databases = Databases(Path(name))
        url = databases.new(args.kind)
        lives = args.restarts + 1
        for _ in range(lives):
            # Each life is judged by itself: a restart frees what a process had taken.
            life(url, Path(name) / "files", args.minutes * 60 / lives, samples, bad)
        databases.close()
    for what, values in samples.items():
        per_life = len(values) // lives
        for number in range(lives):
            one = values[number * per_life : (number + 1) * per_life]
            third = max(1, len(one) // 3)
            first, last = statistics.median(one[:third]), statistics.median(one[-third:])
            print(f"{what:12} life {number + 1}: first third {first:10.1f}, last third {last:10.1f}")
            if last > first * 1.25 and last - first > NOISE[what]:
                bad.append(f"{what} grows: {first:.1f} to {last:.1f}")
    if bad:
        sys.exit("\n".join(sorted(set(bad))))


def life(url: str, files: Path, seconds: float, samples: dict[str, list[float]], bad: list[str]) -> None:
    """One process under load for so long."""
    bounds = {
        "SILO_EVENT_LOG_SIZE": "500",
        "SILO_SYNC_DAYS": "0.0002",  # 17 s
        "SILO_HOUSEKEEPING_SECONDS": "5",
        "SILO_HEARTBEAT_SECONDS": "1",
    }
    ending = threading.Event()
    times: list[float] = []
    with ServerProcess(url, files, TOKEN, **bounds) as server, Api(server.base_url, TOKEN) as api:
        items = api.items(60)
        work: list[Callable[[], None]] = [
            lambda seed=seed: edit(server.base_url, items, ending, times, bad, seed)  # type: ignore[misc]
            for seed in range(EDITORS)
        ]
        work += [lambda: listen(server.base_url, ending)] * 3
        threads = [threading.Thread(target=watched, args=(each, bad)) for each in work]
        for thread in threads:
            thread.start()
        # The caches of the first moments are no leak.
        time.sleep(seconds * 0.1)
        times.clear()
        spent = cpu_seconds(server.pid)
        for _ in range(36):
            time.sleep(seconds * 0.9 / 36)
            look(server, api, samples)
            samples["syncs"].append(rows(url, "answers"))
            recent, times[:] = list(times), []
            spent, before = cpu_seconds(server.pid), spent
            samples["cpu"].append((spent - before) * 1000 / max(len(recent), 1))
            samples["latency"].append(statistics.median(recent) * 1000 if recent else 0.0)
        ending.set()
        for thread in threads:
            thread.join()


def watched(work: Callable[[], None], bad: list[str]) -> None:
    """Do the work; what breaks it is reported, and not only printed."""
    try:
        work()
    except Exception as error:  # noqa: BLE001 - whatever it is, the run must fail
        bad.append(f"{type(error).__name__}: {error}")


def rows(url: str, table: str) -> float:
    """How many a table has."""
    engine = create_engine(url.replace("postgresql:", "postgresql+psycopg:"), poolclass=NullPool)
    with engine.connect() as connection:
        return float(connection.scalar(text(f"SELECT count(*) FROM {table}")) or 0)  # noqa: S608


def look(server: ServerProcess, api: Api, samples: dict[str, list[float]]) -> None:
    """Take one sample."""
    process = Path("/proc") / str(server.pid)
    status = (process / "status").read_text()
    samples["memory"].append(int(status.partition("VmRSS:")[2].split()[0]) / 1024)
    samples["threads"].append(int(status.partition("Threads:")[2].split()[0]))
    samples["descriptors"].append(len(os.listdir(process / "fd")))
    metrics = api.call("GET", "/metrics").body.decode()
    samples["events"].append(number_in(metrics, "silo_events_kept"))
    samples["connections"].append(number_in(metrics, "silo_database_connections"))
    samples["wal"].append(number_in(metrics, "silo_database_wal_bytes") / 1e6)


def cpu_seconds(pid: int) -> float:
    """What a process has used."""
    fields = (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def number_in(text: str, name: str) -> float:
    """A gauge of the metrics; 0 where it is not there."""
    found = re.search(rf"^{name} (\S+)$", text, re.MULTILINE)
    return float(found[1]) if found else 0.0


def edit(
    url: str, items: list[str], ending: threading.Event, times: list[float], bad: list[str], seed: int
) -> None:
    """What an editor does all day."""
    chance = random.Random(seed)
    with Api(url, TOKEN) as api:
        while not ending.is_set():
            # Two levels: trees that grow forever would be a leak of the load, not of the server.
            parent, children = chance.choice(items[:20]), chance.sample(items[20:], 11)
            started = time.perf_counter()
            what = chance.randrange(9)
            if what < 2:
                entries = {child: chance.randint(1, 9) for child in children}
                order = merge_body(entries, sync_id=f"soak-{uuid.uuid4()}")
                answer = api.call("POST", bom(parent, "merge"), order)
            elif what == 2:
                answer = api.call("GET", f"/api/items/search?q={parent[:6]}")
            elif what == 3:
                answer = api.call("GET", bom(parent, "expanded"))
            elif what == 4:
                body, headers = form_body({"file": ("a.FCStd", chance.randbytes(2000)), "comment": "soak"})
                answer = api.call("POST", f"/api/items/{parent}/file", body=body, headers=headers)
            elif what == 5:
                table = "".join(f"{child},{chance.randint(1, 9)}\n" for child in children[:3])
                headers = {"Content-Type": "text/csv"}
                answer = api.call(
                    "POST",
                    bom(parent, "import"),
                    body=b"Part Number,Quantity\n" + table.encode(),
                    headers=headers,
                )
            elif what == 6:
                newest = api.get(bom(parent, "history") + "?limit=1")
                change = {"change_id": newest[0]["id"]} if newest else {"change_id": 1}
                answer = api.call("POST", bom(parent, "undo"), change)
            elif what == 7:
                answer = api.call("PUT", f"{bom(parent)}/{children[0]}", {"notes": f"note {seed}"})
            else:
                answer = api.call("PUT", f"/api/items/{parent}", {"name": f"name {chance.random()}"})
            times.append(time.perf_counter() - started)
            if answer.status not in HONEST:
                bad.append(f"status {answer.status}: {answer.body[:200]!r}")


def listen(url: str, ending: threading.Event) -> None:
    """Come, hear some events, go, come again."""
    with Api(url, TOKEN) as api:
        while not ending.is_set():
            with api.events() as stream:
                for _ in range(20):
                    if ending.is_set():
                        break
                    stream.next()


if __name__ == "__main__":
    main()
