# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a large vault costs: 200 000 items, 1 000 000 lines, on SQLite and PostgreSQL.

    python benchmarks/server_scale.py [sqlite] [postgres] [--items 10000,200000] [--plans]

A vault is made (five lines for each item; a bolt that is used in every fourth assembly; a top assembly of
five levels), on SQLite by rows, on PostgreSQL by the restore of a backup of it. Then each request is sent
over HTTP, and the CPU seconds of this process (server and caller) and of PostgreSQL's are taken: the least
of three. Growth is the cost at the larger size by that at the smaller. ``--plans`` prints how the database
looks things up. Ends with an error where a request takes more than 0.5 s, or a plan reads a large table from
end to end to answer it.

Then a server in a process of its own exports a product of some 194 000 lines in each form: CPU, and by how
much its memory grows. Last, ten viewers export at once for a minute, while another one reads: the time of
these reads by the clock (p50, p99).
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import random
import re
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from sqlalchemy import event, select, text

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from server_testing import Api, Databases, ServerProcess, bom, merge_body, postgres

from silo_server.backup import back_up, restore
from silo_server.db import tables
from silo_server.db.database import Database
from silo_server.db.rows import insert_rows
from silo_server.run import prepare, running_server, share_the_processor
from silo_server.services.items import get_item
from silo_server.services.product.summary_keep import keep_all, keep_summaries
from silo_server.services.product.summary_read import summary_of
from silo_server.settings import Settings

TOKEN = "silo_scale_0123456789abcdef"
LIMIT = 0.5
POSTMASTER: set[str] = set()
LARGE = ("items", "bom_lines", "revisions", "bom_changes", "bom_change_lines", "answers", "item_search")
WORDS = ["screw", "bolt", "nut", "washer", "plate", "bracket", "shaft", "gear", "bearing", "motor", "ring"]
MATERIALS = ["steel", "brass", "copper", "aluminium", "PA12", "POM", "rubber"]


def main() -> None:
    """Measure; print a table per database."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", default=["sqlite", "postgres"])
    parser.add_argument("--items", default="10000,200000")
    parser.add_argument("--plans", action="store_true")
    args = parser.parse_args()
    sizes = [int(size) for size in args.items.split(",")]
    bad: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        databases = Databases(Path(folder))
        if "postgres" in args.kinds:
            find_postmaster()
        results: dict[str, dict[int, dict[str, float]]] = {}
        for size in sizes:
            vault = Settings(database_url=databases.new("sqlite"), files_dir=Path(folder) / f"files-{size}")
            made = time.process_time()
            make_vault(vault, size)
            print(f"{size} items made in {time.process_time() - made:.1f} s of CPU", flush=True)
            made = time.process_time()
            db = Database(vault)
            count = keep_all(db)  # a server has kept them merge by merge; a restore makes them like this
            db.close()
            print(f"{count} products summed up in {time.process_time() - made:.1f} s of CPU", flush=True)
            for kind in args.kinds:
                settings = vault
                if kind == "postgres":
                    settings = Settings(database_url=databases.new(kind), files_dir=Path(folder) / "pg")
                    move(vault, settings, Path(folder) / f"backup-{size}")
                show = args.plans and size == sizes[-1]
                results.setdefault(kind, {})[size] = measure(settings, size, bad, show)
                if size == sizes[-1]:
                    export(settings, kind)
        databases.close()
    for kind, by_size in results.items():
        print(f"\n{kind:28}" + "".join(f"{size:>12}" for size in by_size) + "      growth")
        for name in by_size[sizes[-1]]:
            costs = [by_size[size][name] for size in sizes]
            growth = costs[-1] / max(costs[0], 0.001)
            print(f"{name:28}" + "".join(f"{cost * 1000:9.0f} ms" for cost in costs) + f"{growth:11.1f}")
            if costs[-1] > LIMIT:
                bad.append(f"{kind}: {name} takes {costs[-1]:.2f} s")
    if bad:
        sys.exit("\n".join(["", *sorted(set(bad))]))


def make_vault(settings: Settings, size: int) -> None:
    """Items ``P…`` (parts), ``A…`` (a tenth, assemblies), ``BOLT``, ``TOP``; five lines for each item."""
    chance = random.Random(size)
    db = Database(settings)
    prepare(db, TOKEN)
    assemblies = size // 10
    with db.write() as tx:
        at = tx.stamp

        def item(number: int, name: str, kind: str) -> dict[str, Any]:
            properties = {
                "supplier": f"Supplier {number % 97}",
                "supplier_part_number": f"{number % 89}-{number:06}",
                "material": chance.choice(MATERIALS),
                "mass_kg": round(chance.random(), 4),
                "standard_cost": round(chance.random() * 10, 2),
            }
            words = f"{chance.choice(WORDS)} {chance.choice(MATERIALS)} M{number % 24} x {number % 90}"
            return {
                "id": number,
                "uuid": str(uuid.UUID(int=chance.getrandbits(128))),
                "part_number": name,
                "part_number_key": name.casefold(),
                "item_type": kind,
                "category": f"F{number % 20:02}",
                "name": words,
                "description": f"{words}, drawing {number}",
                "properties": json.dumps(properties),
                "current_revision": 1,
                "bom_version": int(kind == "assembly"),
                "created_at": at,
                "created_by": "admin",
                "updated_at": at,
                "updated_by": "admin",
            }

        def number_of(place: int) -> str:
            if place == 1:
                return "BOLT"
            if place == 2:
                return "TOP"
            return f"A-{place:06}" if place <= assemblies else f"P-{place:06}"

        for page in pages(range(1, size + 1), 5000):
            rows = [item(n, number_of(n), "assembly" if n != 1 and n <= assemblies else "part") for n in page]
            insert_rows(tx, tables.items, rows)
            insert_rows(
                tx,
                tables.revisions,
                [
                    {
                        "item_id": row["id"],
                        "revision_number": 1,
                        "properties": row["properties"],
                        "comment": "created",
                        "status": "draft",
                        "file_name": f"{row['part_number']}.FCStd",
                        "file_checksum": f"{row['id']:064x}",
                        "created_at": at,
                        "created_by": "admin",
                    }
                    for row in rows
                ],
            )
        for page in pages(range(2, assemblies + 1), 500):
            changes, lines, told, syncs, conflicts = [], [], [], [], []
            for parent in page:
                # 50 lines each; TOP and its sub-assemblies make five levels, the bolt is in every fourth.
                children = {chance.randrange(assemblies + 1, size + 1): None for _ in range(52)}
                if parent % 4 == 0 or parent == 2:
                    children[1] = None
                below = range(3, 13) if parent == 2 else range(parent * 10, parent * 10 + 2)
                if parent == 2 or (parent < 1000 and parent * 10 + 2 <= assemblies):
                    children.update(dict.fromkeys(below))
                changes.append(
                    {
                        "id": parent,
                        "parent_id": parent,
                        "version": 1,
                        "kind": "merge",
                        "at": at,
                        "username": "admin",
                        "summary": "BOM updated",
                    }
                )
                for position, child in enumerate(children, start=1):
                    line = str(uuid.UUID(int=chance.getrandbits(128)))
                    lines.append(
                        {
                            "id": line,
                            "parent_id": parent,
                            "child_id": child,
                            "position": position,
                            "rel_type": "component",
                            "quantity": float(position % 7 + 1),
                            "reference_designators": "[]",
                            "source": "assembly",
                            "unreferenced_since": None,
                            "override": False,
                            "cad_quantity": None,
                            "metadata": "{}",
                        }
                    )
                    state = {
                        "quantity": float(position % 7 + 1),
                        "source": "assembly",
                        "rel_type": "component",
                    }
                    if position == 1 and parent % 5 == 1:  # waits: CAD has it no more
                        lines[-1]["unreferenced_since"] = at
                    if position == 1 and parent % 5 == 2:  # waits: a person's, and CAD has another quantity
                        lines[-1] |= {"source": "manual", "override": True, "cad_quantity": 9.0}
                        told_of = {"parent_id": parent, "child_id": child, "since": at, "accepted": False}
                        conflicts.append({**told_of, "cad_quantity": 9.0})
                    told.append(
                        {
                            "change_id": parent,
                            "line_id": line,
                            "child_id": child,
                            "position": position,
                            "action": "added",
                            "after": json.dumps(state),
                        }
                    )
                parts = {str(n): [{"file": f"{n}.FCStd", "object": "Body"}] for n in children}
                gaps = [{"reason": "missing", "name": "Lid", "file": "Lid.FCStd", "quantity": 1}]
                syncs.append(
                    {
                        "parent_id": parent,
                        "at": at,
                        "username": "admin",
                        "document_file": f"A-{parent:06}.FCStd",
                        "folder": f"project {parent % 40}/part {parent % 7}",
                        "left_out": json.dumps(gaps if parent % 5 == 3 else []),
                        "components": json.dumps(parts),
                    }
                )
            insert_rows(tx, tables.bom_changes, changes)
            insert_rows(tx, tables.bom_last_syncs, syncs)
            insert_rows(tx, tables.bom_conflicts, conflicts)
            insert_rows(tx, tables.bom_lines, lines)
            insert_rows(tx, tables.bom_change_lines, told)
        about = dict(tx.conn.execute(select(tables.items.c.id, tables.items.c.uuid)).all())

        def merged(number: int) -> dict[str, Any]:
            place = 2 + number % (assemblies - 1)
            lines = [{"part_number": f"P-{n:06}", "quantity": 1} for n in range(20)]
            told = {"type": "bom_merge", "item": number_of(place), "diff": {"unchanged": lines}}
            who = {"username": f"user{number % 50}", "part_number_key": number_of(place).casefold()}
            return {"name": "bom_merge", "item_uuid": about[place], "data": json.dumps(told), "at": at, **who}

        for page in pages(range(settings.event_log_size), 5000):
            insert_rows(tx, tables.events, [merged(number) for number in page])
        from silo_server.services.search import rebuild_index

        rebuild_index(tx)
    db.close()


def pages(numbers: range, size: int) -> Iterator[range]:
    """The numbers, so many at a time."""
    for start in range(0, len(numbers), size):
        yield numbers[start : start + size]


def move(origin: Settings, target: Settings, folder: Path) -> None:
    """By a backup: which is timed at this size, too."""
    started = cpu()
    back_up(origin, folder)
    middle = cpu()
    restore(target, folder)
    print(f"backup {middle - started:.1f} s, restore {cpu() - middle:.1f} s of CPU", flush=True)
    db = Database(target)
    with db.engine.connect() as connection:
        connection.execution_options(isolation_level="AUTOCOMMIT").execute(text("VACUUM ANALYZE"))
    db.close()


def measure(settings: Settings, size: int, bad: list[str], show: bool) -> dict[str, float]:
    """The CPU seconds of each request; checks the plans of what it asks the database."""
    share_the_processor()  # as a server's own process does
    with (
        running_server(settings.database_url, token=TOKEN, files_dir=settings.files_dir) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        asked: list[tuple[str, Any]] = []
        engine = server.app.state.server.db.engine
        event.listen(
            engine, "before_cursor_execute", lambda c, cur, sql, p, ctx, many: asked.append((sql, p))
        )
        costs: dict[str, float] = {}
        for name, request in requests(api, size):
            api.forget_connection()  # plans take a while on a busy machine, and it was idle meanwhile
            first = timed(request)
            keep_summaries(server.app.state.server.db)  # its thread would do it within the second
            asked.clear()
            costs[name] = min(timed(request) for _ in range(3))
            told = f"{costs[name] * 1000:.0f} ms, at first {first * 1000:.0f} ms"
            print(f"{engine.dialect.name}, {size} items, {name}: {told}", flush=True)
            for line in scans(settings, list(asked), show and name):
                bad.append(f"{engine.dialect.name}: {name} reads a table from end to end: {line}")
    return costs


def export(settings: Settings, kind: str) -> None:
    """Print what exports of the large product cost: the server, and those who read beside them."""
    with (
        ServerProcess(settings.database_url, settings.storage, TOKEN) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        # Assemblies without others below: each line is one row of the export.
        large = api.item("LARGE-" + uuid.uuid4().hex[:8])
        inside = [f"A-{n:06}" for n in range(1000, 4650)]
        api.good("POST", bom(large, "merge"), merge_body(dict.fromkeys(inside, 1)))
        db = Database(settings)
        with db.read() as tx:
            summary_of(tx, get_item(tx, large))
        keep_summaries(db)
        db.close()
        process = Path(f"/proc/{server.pid}")

        def memory(name: str) -> int:
            return int(re.search(rf"{name}:\s+(\d+)", (process / "status").read_text())[1]) // 1024  # type: ignore[index]

        def spent() -> float:
            fields = (process / "stat").read_text().rpartition(")")[2].split()
            return (
                (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") + cpu() - time.process_time()
            )

        for form in ("csv", "json", "xlsx"):
            (process / "clear_refs").write_text("5")  # the peak begins again
            before, begun = memory("VmRSS"), spent()
            size = download(server.base_url, large, form)
            took, peak = spent() - begun, memory("VmHWM")
            told = f"{took:.1f} s of CPU, {peak - before} MB more, in all {peak} MB"
            print(f"{kind}: {form.upper()} of the large product, {size / 1e6:.0f} MB: {told}", flush=True)
        end, counts, times = time.monotonic() + 60, list[int](), list[float]()

        def view(number: int) -> None:
            while time.monotonic() < end:
                counts.append(download(server.base_url, large, ("csv", "json", "xlsx")[number % 3]))

        viewers = [threading.Thread(target=view, args=(number,), daemon=True) for number in range(10)]
        for viewer in viewers:
            viewer.start()
        paths = ["/api/items/TOP", "/api/items?limit=50", bom("A-000100"), bom(large, "summary"), "/health"]
        for number in itertools.count():
            if time.monotonic() > end:
                break
            begun = time.monotonic()
            api.get(paths[number % len(paths)])
            times.append(time.monotonic() - begun)
        times.sort()
        p50, p99 = (times[int(len(times) * part)] * 1000 for part in (0.5, 0.99))
        print(f"{kind}: beside ten viewers who export ({len(counts)} done), {len(times)} reads: ", end="")
        print(f"p50 {p50:.0f} ms, p99 {p99:.0f} ms, longest {times[-1] * 1000:.0f} ms", flush=True)


def download(address: str, number: str, form: str) -> int:
    """Read an export to its end, without keeping it; its bytes, 0 if the server sends it away or ends."""
    url = f"{address}{bom(number, f'export.{form}')}?view=indented"
    request = urllib.request.Request(url, headers={"Authorization": f"Bearer {TOKEN}"})
    try:
        with urllib.request.urlopen(request) as answer:
            return sum(len(part) for part in iter(lambda: answer.read(1 << 20), b""))
    except urllib.error.HTTPError as error:
        if error.code < 500:  # sent away, or the server ends
            raise
        return 0


def requests(api: Api, size: int) -> list[tuple[str, Callable[[], Any]]]:
    """What people and programs ask for."""
    child = [f"P-{n:06}" for n in range(size // 10 + 5, size // 10 + 1005)]
    big = api.item("SCALE-" + uuid.uuid4().hex[:8])
    turns = iter(range(1, 1000))
    cookie = login(api)
    sync = merge_body(dict.fromkeys(child, 1))
    api.good("POST", bom(big, "merge"), sync)
    # Some 193 000 lines over three levels.
    vast = api.item("VAST-" + uuid.uuid4().hex[:8])
    inside = [f"A-{n:06}" for n in range(3, min(size // 10, 2000))]
    api.good("POST", bom(vast, "merge"), merge_body(dict.fromkeys(inside, 1)))

    def get(path: str) -> Callable[[], Any]:
        return lambda: api.good("GET", path)

    def html(path: str) -> Callable[[], Any]:
        def call() -> None:
            answer = api.as_(None).call("GET", path, headers={"Cookie": cookie, "Accept": "text/html"})
            assert answer.status == 200, (path, answer.status, answer.body[:300])

        return call

    def merge() -> None:
        quantity = next(turns) + 1
        api.good("POST", bom(big, "merge"), merge_body(dict.fromkeys(child, quantity)))

    middle = f"P-{size // 2:06}"
    return [
        ("page: most used bolt", html("/items/BOLT")),
        ("page: top assembly", html("/items/TOP")),
        ("page: top assembly, flat", html("/items/TOP?view=flat")),
        ("page: vast assembly", html(f"/items/{vast}")),
        ("page: vast, BOM", html(f"/items/{vast}/bom")),
        ("page: vast, what changed", html(f"/items/{vast}/changes?since=2020-01-01&until=2020-01-02")),
        ("summary: vast", get(bom(vast, "summary"))),
        ("review: vast", get(bom(vast, "review"))),
        ("page: waiting", html("/waiting")),
        ("page: activity", html("/activity")),
        ("page: activity of a product", html("/activity?item=TOP&inside=1")),
        ("page: items", html("/items")),
        ("page: search", html("/items?q=screw+steel")),
        ("search: common word", get("/api/items/search?q=screw")),
        ("search: three letters", get("/api/items/search?q=scr")),
        ("search: one letter", get("/api/items/search?q=s")),
        ("search: two words", get("/api/items/search?q=bracket+pom")),
        ("search: part number", get(f"/api/items/search?q={middle}")),
        ("search: number, no dash", get(f"/api/items/search?q={middle.replace('-', '')}")),
        ("search: supplier's number", get(f"/api/items/search?q={size // 2 % 89}-{size // 2:06}")),
        ("search: file by SHA-256", get(f"/api/items/search?q={size // 2:064x}")),
        ("list: first page", get("/api/items")),
        ("list: last page", get(f"/api/items?offset={size - 50}")),
        ("list: one category", get("/api/items?category=F07")),
        ("where-used: bolt", get(bom("BOLT", "where-used"))),
        ("where-used: bolt, indirect", get(bom("BOLT", "where-used") + "?indirect=true")),
        ("tree: top", get(bom("TOP", "expanded"))),
        ("tree: top, one level", get(bom("TOP", "expanded") + "?depth=1")),
        ("flat: top", get(bom("TOP", "flat"))),
        ("history: top", get(bom("TOP", "history"))),
        ("merge of 1 000 lines", merge),
        ("merge, nothing new", lambda: api.good("POST", bom("TOP", "merge"), top_again(api))),
    ]


def top_again(api: Api) -> Any:
    """The BOM of TOP as it is."""
    return merge_body({line["child_part_number"]: line["quantity"] for line in api.get(bom("TOP"))})


def login(api: Api) -> str:
    """A session's cookie."""
    api.call("PUT", "/api/auth/password", {"password": "scale and scale", "new_password": "scale and scale"})
    name = "scale" + uuid.uuid4().hex[:6]
    api.good("POST", "/api/users", {"username": name, "role": "editor", "password": "scale and scale"})
    answer = api.as_(None).call("POST", "/api/auth/login", {"username": name, "password": "scale and scale"})
    return answer.headers["set-cookie"].partition(";")[0]


def timed(request: Callable[[], Any]) -> float:
    """CPU seconds, of this process and of PostgreSQL's."""
    before = cpu()
    request()
    return cpu() - before


def cpu() -> float:
    """CPU seconds of this process, and of the private PostgreSQL's processes."""
    total = time.process_time()
    ticks = os.sysconf("SC_CLK_TCK")
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if fields[1] in POSTMASTER:
            total += (int(fields[11]) + int(fields[12])) / ticks
    return total


def find_postmaster() -> None:
    """Remember the process id of the private PostgreSQL, whose children do its work."""
    folder = re.search(r"host=([^&]+)", postgres())
    assert folder is not None
    POSTMASTER.add((Path(unquote(folder[1])) / "postmaster.pid").read_text().split()[0])


def scans(settings: Settings, asked: list[tuple[str, Any]], show: str | bool) -> Iterator[str]:
    """Explain what was asked; the lines of plans that read all of a large table."""
    db = Database(settings)
    seen: set[str] = set()
    with db.engine.connect() as connection:
        for sql, parameters in asked:
            if (
                sql in seen
                or not re.match(r"(WITH|SELECT|UPDATE|DELETE|INSERT)\b", sql)
                or "RETURNING" in sql
            ):
                continue
            seen.add(sql)
            many = isinstance(parameters, list)
            one = parameters[0] if many and parameters else parameters
            word = "EXPLAIN QUERY PLAN " if settings.is_sqlite else "EXPLAIN "
            plan = [str(row[-1]) for row in connection.exec_driver_sql(word + sql, one)]
            if show:
                print(f"\n-- {show}: {' '.join(sql.split())[:160]}", *plan, sep="\n   ")
            for line in plan:
                table = re.search(r"(?:SCAN|Seq Scan on) (\w+)(.*)", line)
                if table and table[1] in LARGE and "INDEX" not in table[2]:
                    yield f"{line.strip()}  <- {' '.join(sql.split())[:200]}"
    db.close()


if __name__ == "__main__":
    main()
