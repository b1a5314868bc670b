# SPDX-License-Identifier: LGPL-2.1-or-later
"""What one caller may take of the server: memory, threads, connections, time under the write lock."""

from __future__ import annotations

import ast
import itertools
import json
import socket
import threading
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from hunting import over
from server_testing import Api, bom, merge_body, sqlite_database
from sqlalchemy import Engine, event
from web_visitor import Visitor

import silo_server
from silo.bom.errors import BusyError, RejectedError
from silo.bom.headers import Heading
from silo.tables.bom_rows import BOM
from silo.tables.limits import HEADER_WITHIN
from silo.tables.sheet import Layout, first_lines
from silo_server.db.database import Database
from silo_server.db.rows import insert_rows
from silo_server.db.tables import bom_lines, items
from silo_server.db.transaction import Tx
from silo_server.db.turnstile import Turnstile
from silo_server.errors import TooLargeError
from silo_server.run import RunningServer, running_server
from silo_server.services.bom.decisions import Decision, ReviewAction, resolve
from silo_server.services.bom.imports import read_bom
from silo_server.services.bom.last_sync import record_refusal
from silo_server.services.bom.line_edit import add_line, change_line
from silo_server.services.bom.line_state import state_columns
from silo_server.services.bom.merge import merge_bom
from silo_server.services.bom.merge_request import read_merge_request
from silo_server.services.bom.waiting import waiting, waiting_count
from silo_server.services.items import NewItem, archive_item, create_item, get_item
from silo_server.services.product.graph import load_graph
from silo_server.services.product.summary_keep import keep_all
from silo_server.services.product.tree import expand
from silo_server.services.product.where_used import where_used
from silo_server.settings import Settings
from silo_server.values import LineState

PARENTS = 66_000  # more than PostgreSQL takes as parameters of one statement


def used_everywhere(db: Database) -> str:
    """A bolt with :data:`PARENTS` parents, which are all in one top assembly."""
    with db.write() as tx:
        bolt = create_item(tx, NewItem(part_number="BOLT", name="Bolt"))[0]
        top = create_item(tx, NewItem(part_number="TOP", name="Top"))[0]
        row = {
            "item_type": "assembly",
            "name": "n",
            "description": "",
            "properties": "{}",
            "current_revision": 0,
            "bom_version": 1,
            "created_at": tx.stamp,
            "created_by": "x",
            "updated_at": tx.stamp,
            "updated_by": "x",
        }
        numbers = [f"p-{n:06}" for n in range(PARENTS)]
        made = [{**row, "uuid": str(uuid.uuid4()), "part_number": n, "part_number_key": n} for n in numbers]
        # A statement must end in time on a busy machine.
        for begin in range(0, PARENTS, 5_000):
            insert_rows(tx, items, made[begin : begin + 5_000])
        found = tx.conn.execute(items.select().where(items.c.part_number.like("p-%"))).all()
        state = state_columns(LineState(1.0, "assembly"))
        pairs = [(p.id, bolt.id) for p in found] + [(top.id, p.id) for p in found]
        rows = [
            {"id": str(uuid.uuid4()), "parent_id": parent, "child_id": child, "position": n, **state}
            for n, (parent, child) in enumerate(pairs)
        ]
        for begin in range(0, len(rows), 5_000):
            insert_rows(tx, bom_lines, rows[begin : begin + 5_000])
    if not db.settings.is_sqlite:
        # What PostgreSQL does by itself after a while: until then it takes the tables for empty.
        with db.engine.connect() as connection, connection.begin():
            connection.exec_driver_sql("ANALYZE")
    return "BOLT"


@over("postgres")
def test_where_used_of_a_bolt_that_is_used_everywhere(db: Database) -> None:
    """It comes in pages, the nearest first, each use once, whatever the number of parents."""
    number = used_everywhere(db)
    with db.read() as tx:
        bolt = get_item(tx, number)
        first, total = where_used(tx, bolt, indirect=True, limit=3)
        border, _ = where_used(tx, bolt, indirect=True, limit=3, offset=PARENTS - 1)
        direct = where_used(tx, bolt, limit=1)[1]
        past, _ = where_used(tx, bolt, indirect=True, limit=3, offset=2 * PARENTS)
    assert (total, direct, past) == (2 * PARENTS, PARENTS, [])
    assert [(use.parent.part_number, use.depth) for use in first] == [(f"p-{n:06}", 1) for n in range(3)]
    assert [(use.parent.part_number, use.depth) for use in border] == [
        (f"p-{PARENTS - 1:06}", 1),
        ("TOP", 2),
        ("TOP", 2),
    ]


@over("sqlite")
def test_one_level_reads_one_level(db: Database) -> None:
    """``depth`` bounds what is read, not only what is shown."""
    with db.write() as tx:
        chain = [create_item(tx, NewItem(part_number=f"C{n}", name="c"))[0] for n in range(6)]
        state = state_columns(LineState(2.0, "manual"))
        for above, below in itertools.pairwise(chain):
            row = {"id": str(uuid.uuid4()), "parent_id": above.id, "child_id": below.id, "position": 1}
            insert_rows(tx, bom_lines, [{**row, **state}])
    with db.read() as tx:
        read = {depth: load_graph(tx, chain[0], depth) for depth in (1, 2, 4, None)}
    assert {depth: len(graph.lines) for depth, graph in read.items()} == {1: 1, 2: 2, 4: 4, None: 5}
    assert [row.total for row in expand(read[4], 4, 100)] == [2, 4, 8, 16]


@over("sqlite")
def test_a_structure_that_would_fill_the_memory_is_not_read(url: str, tmp_path: Path) -> None:
    """Below the bound all views; above it 413 with a way out, and pages that still show the item."""
    bounded = Settings(database_url=url, files_dir=tmp_path, max_expanded_rows=3)
    with (
        running_server(url, token="silo_bound", settings=bounded) as server,
        Api(server.base_url, "silo_bound") as api,
    ):
        top, sub, extra, *leaves = api.items(6)
        api.merge(sub, dict.fromkeys(leaves, 1))
        assert len(api.get(bom(sub, "flat"))["flat_bom"]) == 3
        api.merge(top, {sub: 1})
        for what in ("flat", "expanded", "cost", "mass", "export.csv?view=flat"):
            assert "sub-assemblies" in api.bad(413, "GET", bom(top, what))["message"]
        assert len(api.get(bom(top, "expanded?depth=1"))) == 1
        assert len(api.good("POST", "/api/items/boms", {"part_numbers": [sub]})["boms"][sub]) == 3
        api.merge(sub, dict.fromkeys([*leaves, extra], 1))
        assert len(api.good("POST", "/api/items/boms", {"part_numbers": [sub]})["boms"][sub]) == 4
        api.merge(sub, dict.fromkeys(leaves, 1))
        api.good("DELETE", bom(sub) + f"/{extra}")
        for several, lines in (([top, sub], 4), ([sub, sub.lower()], 6)):
            refused = api.bad(413, "POST", "/api/items/boms", {"part_numbers": several})
            assert f"these BOMs have {lines} lines" in refused["message"]
            assert "fewer" in refused["message"]
        api.good("POST", "/api/users", {"username": "ann", "role": "viewer", "password": "a pass phrase"})
        session = api.as_(None).call(
            "POST", "/api/auth/login", {"username": "ann", "password": "a pass phrase"}
        )
        cookie = session.headers["set-cookie"].partition(";")[0]
        for view in ("tree", "flat"):
            html = api.as_(None).call(
                "GET", f"/items/{top}?view={view}", headers={"Cookie": cookie, "Accept": "text/html"}
            )
            assert html.status == 200
            assert "more than 3 different lines" in html.body.decode()


def test_a_file_that_breaks_off_shows_what_can_be_read_of_it() -> None:
    """A quote too many in one row: the person sees the header, and can say which column is which."""
    data = b'Part number,Quantity\nA,1\n"B" x,2\n'
    assert first_lines(data, "file", BOM) == (",", [("Part number", "Quantity"), ("A", "1")])


def test_a_file_that_is_no_bom_is_not_read_to_its_end() -> None:
    """The header is looked for near the top; what stands at the end of such a file does not matter."""
    rows = b"a;b,c\td\n" * 5000
    with pytest.raises(RejectedError, match="found no header line"):
        read_bom(rows + b'"never closed', 20_000)
    with pytest.raises(TooLargeError):
        read_bom(b"Part number,Quantity\n" + b"A,1\n" * 21, 20)
    late = b"x\n" * (HEADER_WITHIN - 1) + b"Part number,Quantity\nA,1\n"
    assert read_bom(late, 20).rows[0].texts["part_number"] == "A"


@pytest.mark.parametrize(
    ("header", "differ", "agree"),
    [
        ("PN,Qty,Quantity", "A,4,8", ("A,4,4", "A,,4")),
        ("Part number,Qty,PN", "A,4,B", ("A,4,A",)),
        ("PN,Qty,Notes,Remarks", "A,4,ours,theirs", ("A,4,ours,ours",)),
        ("PN,Quantity (pcs),Quantity (m)", "A,,0.4", ("A,4,",)),
    ],
)
def test_two_columns_of_one_meaning_that_differ_are_refused(
    header: str, differ: str, agree: tuple[str, ...]
) -> None:
    """Neither is taken in silence; a person's choice of columns is, and so is what says the same twice."""
    data = f"A title\n{header}\n{differ}\n".encode()
    with pytest.raises(RejectedError, match=r"both mean the .* in row 3 they say") as caught:
        read_bom(data, 20)
    assert len(caught.value.problems) == 1
    layout = Layout(",", 1, {Heading.PART_NUMBER: 0, Heading.QUANTITY: 1})
    assert read_bom(data, 20, layout).rows[0].texts["part_number"] == "A"
    for row in agree:
        assert len(read_bom(f"A title\n{header}\n{row}\n".encode(), 20).rows) == 1


def test_a_turnstile_lets_in_so_many_and_no_more() -> None:
    """Places, waiting room, and patience are bounded; what left makes room again."""
    turnstile = Turnstile(places=2, waiting=1, seconds=0.05, who="tests")
    with turnstile.enter(), turnstile.enter():
        with pytest.raises(BusyError, match="took longer"), turnstile.enter():
            pass
        inside, go = threading.Event(), threading.Event()
        patient = Turnstile(places=1, waiting=1, seconds=30, who="tests")

        def wait() -> None:
            with patient.enter():
                inside.set()
                go.wait(60)

        first = threading.Thread(target=wait)
        first.start()
        inside.wait(60)
        second = threading.Thread(target=wait)
        second.start()
        while not patient.full:
            pass
        with pytest.raises(BusyError, match="too many tests"), patient.enter():
            pass
        go.set()
        first.join(60)
        second.join(60)
        with patient.enter():
            pass
    with turnstile.enter():
        pass


@pytest.mark.parametrize(
    ("sent", "answered"),
    [
        ([b""], b""),
        ([b"POST /api/items HTTP/1.1\r\nHost: x\r\n"], b""),
        (
            [
                b"POST /api/auth/login HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
                b"Content-Length: 100\r\n\r\nhalf"
            ],
            b"HTTP/1.1 408",
        ),
        ([b"GET /health HTTP/1.1\r\nHost: x\r\n\r\n", b"GET /hea"], b"HTTP/1.1 200"),
        ([b"POST /logout HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\nh", b"a"], b"HTTP/1.1 303"),
    ],
    ids=["nothing", "half a head", "half a body", "half a second request", "a body nobody read"],
)
def test_half_a_request_is_not_waited_for_for_ever(
    tmp_path: Path, sent: list[bytes], answered: bytes
) -> None:
    """The server hangs up by itself; it says why where there was a request to answer."""
    url = sqlite_database(tmp_path / "x.db")
    settings = Settings(database_url=url, request_head_seconds=0.6, request_body_seconds=0.6)
    with running_server(url, token="silo_half", settings=settings) as server:
        parts = urlsplit(server.base_url)
        with socket.create_connection((parts.hostname, parts.port), timeout=30) as connection:
            got = b""
            for part in sent:
                connection.sendall(part)
                got += connection.recv(65536)
            while chunk := connection.recv(65536):
                got += chunk
        assert got.startswith(answered)
        with Api(server.base_url, "silo_half") as api:
            assert api.item()


@over("sqlite")
def test_what_waits_is_listed_and_counted_without_reading_all_lines(db: Database) -> None:
    """Each kind once, archived ones never; every page counts them, so only what waits is looked at."""
    asked: list[tuple[str, Any]] = []
    with db.write() as tx:
        tops = [create_item(tx, NewItem(part_number=f"T{n}", name="Top"))[0].part_number for n in range(5)]
        parts = [create_item(tx, NewItem(part_number=f"C{n}", name="Part"))[0].part_number for n in range(2)]
        for top in tops:
            body = merge_body(dict.fromkeys(parts, 2))
            merge_bom(
                tx,
                top,
                read_merge_request({**body, "document": {"file": "T.FCStd", "folder": "robot/arm"}}, 9),
                None,
            )
        merge_bom(tx, "T0", read_merge_request(merge_body({"C1": 2}), 9), None)
        change_line(tx, "T1", "C0", {"quantity": 3})
        merge_bom(tx, "T1", read_merge_request(merge_body({"C0": 5, "C1": 2}), 9), None)
        gaps = [{"reason": reason, "name": reason} for reason in ("missing", "unregistered", "unregistered")]
        body = {**merge_body(dict.fromkeys(parts, 2)), "left_out": gaps}
        for top in ("T2", "T3"):
            merge_bom(tx, top, read_merge_request(body, 9), None)
        record_refusal(tx, get_item(tx, "T2"), "no such part")
        archive_item(tx, "T3")
        # Settled: the one by a person's edit, the other by a decision.
        for child in ("C2", "C3"):
            create_item(tx, NewItem(part_number=child, name="Part"))
            add_line(tx, "T4", child, LineState(3.0, "manual"))
        cad = merge_body({**dict.fromkeys(parts, 2), "C2": 5, "C3": 5})
        merge_bom(tx, "T4", read_merge_request(cad, 9), None)
        assert [one.conflicts for one in waiting(tx) if one.part_number == "T4"] == [2]
        change_line(tx, "T4", "C2", {"quantity": 5.0})
        assert [one.conflicts for one in waiting(tx) if one.part_number == "T4"] == [1]
        resolve(tx, "T4", [Decision("C3", ReviewAction.KEEP_SILO)])
    with db.read() as tx:

        def note(_conn: Any, _cursor: Any, sql: str, values: Any, *_: Any) -> None:
            asked.append((sql, values))

        event.listen(tx.conn, "before_cursor_execute", note)
        found = waiting(tx)
        assert waiting_count(tx) == len(found) == 3
        event.remove(tx.conn, "before_cursor_execute", note)
        plans = [str(row) for sql, p in asked for row in tx.conn.exec_driver_sql(_plan(tx) + sql, p)]
    counts = [(one.unreferenced, one.conflicts, one.left_out, one.unregistered) for one in found]
    assert counts == [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 2, 2)]
    assert {(one.name, one.folder) for one in found} == {("Top", "robot/arm")}
    assert all(one.synced_at for one in found)
    if db.settings.is_sqlite:
        assert not [plan for plan in plans if "SCAN bom_lines" in plan and "INDEX" not in plan]


def _plan(tx: Tx) -> str:
    return "EXPLAIN " if tx.postgres else "EXPLAIN QUERY PLAN "


def test_pages_read_a_bom_once_and_no_whole_parts(
    server: RunningServer, api: Api, visitors: dict[str, Visitor]
) -> None:
    """Of thousands of parts a page needs a few columns; the items that it reads whole are products."""
    top, *parts = api.items(4)
    api.merge(top, dict.fromkeys(parts, 2))
    keep_all(server.app.state.server.db)
    asked: list[tuple[str, Any]] = []

    def note(_conn: Any, _cursor: Any, sql: str, values: Any, *_: Any) -> None:
        asked.append((sql, values))

    def reads(page: str) -> tuple[int, int, int]:
        asked.clear()
        assert visitors["viewer"].get(f"/items/{top}{page}").status == 200
        whole = [values for sql, values in asked if "items.origins" in sql and "json_each" in sql]
        # What waits is counted on each page, by indexes of its own: no lines in their order.
        read = ("bom_lines.position", "FROM bom_lines JOIN items", "parent_id")
        lines = sum(all(part in sql for part in read) for sql, _ in asked)
        parts = sum("items.supplier_parts, items.sourcing_type" in sql for sql, _ in asked)
        return lines, parts, max((len(json.loads(values[0])) for values in whole), default=0)

    event.listen(Engine, "before_cursor_execute", note)
    try:
        pages = ("/order", "?q=1", "?q=1&sort=cost", "?view=flat&q=1", "/bom", "/changes")
        found = {page: reads(page) for page in pages}
    finally:
        event.remove(Engine, "before_cursor_execute", note)
    assert found.pop("/changes")[2] == 1
    assert found.pop("/bom") == (1, 0, 0)
    assert set(found.values()) == {(1, 1, 0)}, found


def returned_late(function: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    """What a function returns after its last transaction that writes; functions inside it count alone."""
    own = list(own_nodes(function))
    blocks = [node for node in own if isinstance(node, ast.With) and ".write(" in ast.unparse(node.items[0])]
    end = max((block.end_lineno or 0 for block in blocks), default=10**9)
    returns = [node.value for node in own if isinstance(node, ast.Return) and node.lineno > end]
    said = [ast.unparse(value) for value in returns if value is not None]
    return [text for text in said if not text.startswith("Response(status_code=204")]


def own_nodes(function: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a function without those of functions inside it."""
    for node in ast.iter_child_nodes(function):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node
            yield from own_nodes(node)


def test_every_answer_is_written_before_the_commit() -> None:
    """An answer that cannot be written must undo the change: no route renders after its transaction."""
    routes = Path(silo_server.__file__).parent / "routes"
    late = {
        f"{path.name} {node.name}": said
        for path in routes.glob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and (said := returned_late(node))
    }
    assert late == {}


def test_every_cursor_of_the_database_is_closed_by_its_reader() -> None:
    """Rows read in portions hold a cursor of the database open, also when their reader stops early."""

    def in_portions(node: ast.AST) -> bool:
        return isinstance(node, ast.Call) and "yield_per" in {
            key.value
            for word in node.keywords
            if word.arg == "execution_options" and isinstance(word.value, ast.Dict)
            for key in word.value.keys
            if isinstance(key, ast.Constant)
        }

    found = 0
    for path in Path(silo_server.__file__).parent.rglob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        closed = {item.context_expr for node in nodes if isinstance(node, ast.With) for item in node.items}
        for node in filter(in_portions, nodes):
            found += 1
            assert node in closed, f"{path.name}: {ast.unparse(node)}"
    assert found >= 5
