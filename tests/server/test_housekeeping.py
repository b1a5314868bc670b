# SPDX-License-Identifier: LGPL-2.1-or-later
"""Housekeeping: by the clock, in bounds of count, bytes and age; nothing that is needed goes."""

from __future__ import annotations

import asyncio
import json
import os
import threading
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from hunting import over
from large_boms import fcstd_with_picture, form_file
from server_testing import Api, bom, run_alone, sqlite_database, wait_until
from sqlalchemy import func, select, text

from silo_server.backup import back_up
from silo_server.db.database import Database
from silo_server.db.tables import answers, audit, bom_changes, events, sessions
from silo_server.housekeeping import keep_tidy, last_run, tidy
from silo_server.run import prepare, running_server
from silo_server.services.file_store import FileStore
from silo_server.services.search import rebuild_index
from silo_server.settings import Settings

TOKEN = "silo_tidy"


def count(db: Database, table: Any) -> int:
    """Rows of a table."""
    with db.read() as tx:
        return tx.conn.scalar(select(func.count()).select_from(table)) or 0


def database(url: str, tmp_path: Path, days_later: float = 0, **values: Any) -> Database:
    """The database, by a clock that is ahead."""
    settings = Settings(database_url=url, files_dir=tmp_path / "files", **values)
    return Database(settings, lambda: datetime.now(UTC) + timedelta(days=days_later))


def tidied(url: str, tmp_path: Path, days_later: float = 0, **values: Any) -> dict[str, int]:
    """One run; what it removed."""
    db = database(url, tmp_path, days_later, **values)
    run = tidy(db, FileStore(db.settings.storage))
    db.close()
    assert run.problem is None
    return dict(run.removed)


class Odd(FileStore):
    """A store with an error that nobody thought of; the second run ends the loop."""

    def __init__(self, root: Path, enough: Callable[[], object]) -> None:
        super().__init__(root)
        self.enough, self.runs = enough, 0

    def older_than(self, before: float) -> list[Path]:
        self.runs += 1
        if self.runs == 2:
            self.enough()
        raise ValueError(f"odd {self.runs}")


def test_an_error_is_logged_at_once_and_the_next_run_comes(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Not when the server stops, and not by ending the loop; the run that failed is shown as such."""
    url = sqlite_database(tmp_path / "silo.db")
    now = datetime.now(UTC)

    def clock() -> datetime:
        nonlocal now
        now += timedelta(days=2)  # each run is due, and looks at the files
        return now

    db = Database(Settings(database_url=url, files_dir=tmp_path / "files", housekeeping_seconds=0.01), clock)
    prepare(db, TOKEN)

    async def work() -> None:
        ending, loop = asyncio.Event(), asyncio.get_running_loop()
        store = Odd(tmp_path / "files", lambda: loop.call_soon_threadsafe(ending.set))
        await asyncio.wait_for(keep_tidy(db, store, ending), 60)

    run_alone(work())
    assert [text in caplog.text for text in ("odd 1", "odd 2")] == [True, True]
    with db.read() as tx:
        run = last_run(tx)
    db.close()
    assert run is not None
    assert run.problem == "files: odd 2"


@over("sqlite")
def test_a_busy_server_trims_its_log(url: str, tmp_path: Path) -> None:
    """News all the time, so that no poll is ever idle: the clock alone decides; the run is shown."""
    settings = Settings(
        database_url=url, files_dir=tmp_path, event_log_size=20, housekeeping_seconds=0.2, poll_seconds=3600
    )
    with running_server(url, token=TOKEN, settings=settings) as server, Api(server.base_url, TOKEN) as api:
        started = api.get("/api/admin/housekeeping")["last_run"]["at"]
        ending = threading.Event()

        def work() -> None:
            while not ending.is_set():
                api.item()

        worker = threading.Thread(target=work)
        worker.start()
        db = server.app.state.server.db

        def trimmed() -> bool:
            with db.read() as tx:
                oldest = tx.conn.scalar(select(func.min(events.c.id))) or 0
            return oldest > 40

        wait_until(trimmed, "the trimming of a busy server's log")
        ending.set()
        worker.join()
        run = api.get("/api/admin/housekeeping")["last_run"]
    assert run["at"] > started
    assert run["problem"] is None


def test_the_log_and_the_answers_are_bounded_in_bytes(url: str, tmp_path: Path) -> None:
    """However few there are: the oldest go until the rest fits; one is always kept."""
    with running_server(url, token=TOKEN, files_dir=tmp_path) as server, Api(server.base_url, TOKEN) as api:
        parent, *children = api.items(60)
        for number in range(20):
            api.merge(parent, dict.fromkeys(children, number + 1), sync_id=f"s{number}")
        db = server.app.state.server.db
        with db.read() as tx:
            sizes = [len(data.encode()) for data in tx.conn.scalars(select(events.c.data))]
    db = database(url, tmp_path)
    budget = sum(sizes) // 2
    assert tidied(url, tmp_path) == {}
    removed = tidied(url, tmp_path, event_log_bytes=budget, sync_bytes=20_000)
    assert removed["events"] > 5
    assert removed["answers"] > 5
    with db.read() as tx:
        left = [len(data.encode()) for data in tx.conn.scalars(select(events.c.data))]
        assert budget - max(sizes) < sum(left) <= budget
        newest = tx.conn.scalars(select(answers.c.key).order_by(answers.c.at.desc())).first()
    assert newest == "s19"
    tidied(url, tmp_path, event_log_bytes=1, sync_bytes=1)
    assert (count(db, events), count(db, answers)) == (1, 1)
    db.close()


@over("sqlite")
@pytest.mark.parametrize("retention", [False, True])
def test_what_is_kept_by_age(url: str, tmp_path: Path, retention: bool) -> None:
    """Sessions, answers to syncs go in their time; history and audit only where somebody asked for it."""
    values = {"audit_days": 30, "history_days": 30} if retention else {}
    with running_server(url, token=TOKEN, files_dir=tmp_path) as server, Api(server.base_url, TOKEN) as api:
        api.good("POST", "/api/users", {"username": "u", "role": "editor", "password": "a long pass phrase"})
        api.good("POST", "/api/auth/login", {"username": "u", "password": "a long pass phrase"})
        parent, child, *others = api.items(32)
        rest = dict.fromkeys(others, 1)
        for quantity in (1, 2, 3):
            api.merge(parent, {child: quantity, **rest}, sync_id=f"s{quantity}")
        db = server.app.state.server.db
        assert tidied(url, tmp_path, 29, **values).get("history") is None
        removed = tidied(url, tmp_path, 31, **values)
        assert ("audit" in removed, "history" in removed) == (retention, retention)
        assert (count(db, sessions), count(db, bom_changes)) == (0, 1 if retention else 3)
        assert (count(db, audit) == 0) == retention
        # An answer that refers to a change goes with it; the first one says all by itself.
        assert count(db, answers) == (1 if retention else 3)
        tidied(url, tmp_path, 91, **values)
        assert count(db, answers) == 0
        # The history that is left still folds to the state, and says that it does not go further back.
        change = api.get(bom(parent, "history"))[0]
        past = api.get(bom(parent, f"history/{change['id']}/bom"))
        assert {line["child_part_number"]: line["quantity"] for line in past} == api.quantities(parent)
        if retention:
            assert change["kind"] == "folded"
            assert "3 older changes" in change["summary"]
            problem = api.bad(409, "POST", bom(parent, "undo"), {"change_id": change["id"]})
            assert "no longer kept" in problem["message"]
            api.merge(parent, {child: 7})
            api.good("POST", bom(parent, "restore"), {"change_id": change["id"]})
            assert api.quantities(parent) == {child: 3, **rest}


@over("sqlite")
def test_an_answer_kept_as_a_reference_is_the_same_answer(url: str, tmp_path: Path) -> None:
    """Whatever lines there are and whatever happened since: the repeat's bytes are the first answer's."""
    with running_server(url, token=TOKEN, files_dir=tmp_path) as server, Api(server.base_url, TOKEN) as api:
        parent, *children = api.items(40)
        everything = {child: n + 0.25 for n, child in enumerate(children)}
        api.merge(parent, everything)
        api.good("PUT", bom(parent, children[0]), {"quantity": 99})
        api.good("POST", bom(parent), {"child_part_number": api.item(), "quantity": 3})
        entries = {**everything, children[1]: 5, children[2]: 77}
        del entries[children[3]]
        first = api.merge(parent, entries, sync_id="kept")
        assert len(first["diff"]["unchanged"]) > 30
        api.merge(parent, dict.fromkeys(children, 1))
        api.good("DELETE", bom(parent, children[10]))
        assert api.merge(parent, entries, sync_id="kept") == first
        with server.app.state.server.db.read() as tx:
            row = tx.conn.execute(select(answers)).one()
        assert row.change_id is not None
        assert len(row.answer) < len(json.dumps(first)) / 1.4


def _old(path: Path) -> None:
    os.utime(path, (0, 0))


@over("sqlite")
def test_uploads_that_nothing_refers_to_are_collected(url: str, tmp_path: Path) -> None:
    """What no revision has, after a day; never what one has, nor what was uploaded again meanwhile.

    A backup takes the same: the files and the pictures of all revisions, not of the newest alone.
    """
    root = tmp_path / "files"
    with running_server(url, token=TOKEN, files_dir=root) as server, Api(server.base_url, TOKEN) as api:
        item = api.item()
        for seed in (1, 2):
            body, headers = form_file("a.FCStd", fcstd_with_picture(seed))
            assert api.call("POST", f"/api/items/{item}/file", body=body, headers=headers).status == 201
    store = FileStore(root)
    used = list(root.glob("??/??/*"))
    assert len(used) == 4
    orphan = store.path_of(store.keep("b", BytesIO(b"orphan")).checksum)
    fresh = store.path_of(store.keep("c", BytesIO(b"fresh")).checksum)
    half = root / "upload-half"
    half.write_bytes(b"half")
    for path in (*used, orphan, half):
        _old(path)
    db = database(url, tmp_path, 1.01)
    # Fresh by the clock of the run.
    os.utime(fresh, (db.clock().timestamp(), db.clock().timestamp()))
    assert tidy(db, store).removed["files"] == 2
    assert all(path.exists() for path in used)
    assert (fresh.exists(), orphan.exists(), half.exists()) == (True, False, False)
    assert back_up(db.settings, tmp_path / "saved").files == len(used)
    db.close()


def test_an_upload_in_the_moment_of_the_collection_stays(tmp_path: Path) -> None:
    """The same content comes again after the collection has chosen the old file, before it deletes it."""
    store = FileStore(tmp_path)
    path = store.path_of(store.keep("a", BytesIO(b"again")).checksum)
    _old(path)
    before = path.stat().st_mtime + 1
    (chosen,) = store.older_than(before)
    store.keep("a", BytesIO(b"again"))
    assert not store.remove_old(chosen, before)
    assert path.read_bytes() == b"again"
    assert [p for p in tmp_path.iterdir() if p.is_file()] == []


def test_a_step_that_fails_is_shown_and_the_others_are_done(db: Database) -> None:
    """A broken table: the run says so, and the next steps have run."""
    with db.write() as tx:
        rename: Callable[[str], Any] = lambda sql: tx.conn.execute(text(sql))  # noqa: E731
        rename("ALTER TABLE login_links RENAME TO gone")
    run = tidy(db, FileStore(db.settings.storage))
    assert run.problem is not None
    assert run.problem.startswith("login links: ")
    with db.read() as tx:
        assert last_run(tx) == run


def test_the_index_of_the_search_is_made_where_there_is_none(db: Database) -> None:
    """After an update: at the next start, once."""
    from silo_server.services.items import ItemQuery, NewItem, create_item, list_items

    with db.write() as tx:
        create_item(tx, NewItem(part_number="X-1", name="Zahnrad"))
        tx.conn.execute(text("DELETE FROM item_search"))
        tx.conn.execute(text("DELETE FROM server_state WHERE key = 'search_index'"))
    prepare(db, TOKEN)
    with db.write() as tx:
        assert [item.part_number for item in list_items(tx, ItemQuery(search="zahn"))[0]] == ["X-1"]
        assert rebuild_index(tx) == 1
