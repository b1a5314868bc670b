# SPDX-License-Identifier: LGPL-2.1-or-later
"""The schema: the migrations make exactly the tables, from every released state, with the data kept."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import delete, insert, inspect, select, text
from sqlalchemy.exc import IntegrityError

from silo.bom.errors import ConfigError
from silo.cli.main import main
from silo_server.bootstrap import prepare
from silo_server.db.engine import Database
from silo_server.db.migrate import alembic_config, newest_revision, upgrade
from silo_server.db.tables import events, items, metadata, sessions
from silo_server.services.access.credentials import actor_by_token
from silo_server.services.bom.history import list_changes, state_at
from silo_server.services.bom.last_sync import last_sync
from silo_server.services.bom.lines import lines_of
from silo_server.services.bom.merge import merge_bom
from silo_server.services.bom.merge_json import read_merge_order
from silo_server.services.items import get_item
from silo_server.services.search import search_for
from silo_server.settings import Settings
from silo_server.values import Role, Scope

FOLDER = Path(__file__).parent / "released"
SCHEMAS = sorted({path.name.split(".")[0] for path in FOLDER.glob("*.sql")})

# A revision as a later version may bring it: two filled tables that refer to each other are made anew.
REBUILD = '''
"""rebuild two filled tables"""
import sqlalchemy as sa
from silo_server.db.migrate import rebuilt

revision = "9001"
down_revision = {head!r}
branch_labels = depends_on = None


def upgrade():
    with rebuilt("items") as batch:
        batch.add_column(sa.Column("weight_class", sa.String(8), nullable=False, server_default="light"))
        batch.alter_column("name", existing_type=sa.Text(), type_=sa.String(4000), existing_nullable=False)
    with rebuilt("events") as batch:
        batch.alter_column("name", existing_type=sa.String(64), type_=sa.String(80), existing_nullable=False)
    with rebuilt("bom_lines") as batch:
        batch.drop_column("reason")
'''

ORPHANS = '''
"""lose an item that lines refer to"""
from alembic import op

revision = "9001"
down_revision = {head!r}
branch_labels = depends_on = None


def upgrade():
    op.execute("DELETE FROM items WHERE part_number = 'PRT-400'")
'''


@pytest.fixture(params=SCHEMAS)
def released(request: pytest.FixtureRequest, url: str, tmp_path: Path) -> Iterator[Database]:
    """A database as a released version left it, on the kind of ``url``, not yet brought up to date."""
    db = _as_released(request.param, url, tmp_path)
    yield db
    db.close()


def _as_released(schema: str, url: str, folder: Path) -> Database:
    db = Database(Settings(database_url=url, files_dir=folder))
    kind = "sqlite" if db.settings.is_sqlite else "postgres"
    dump = (FOLDER / f"{schema}.{kind}.sql").read_text("utf-8")
    if db.settings.sqlite_path:
        with sqlite3.connect(db.settings.sqlite_path) as connection:
            connection.executescript(dump)
        connection.close()
    else:
        raw = db.engine.raw_connection()
        raw.driver_connection.execute(dump)
        raw.commit()
        raw.invalidate()  # the dump leaves this connection without a search path
    return db


def test_there_are_dumps_of_every_schema_that_filled_tables_changed_after() -> None:
    """They are kept here, of both databases; without them the tests below test nothing."""
    assert SCHEMAS[:3] == ["schema-0001", "schema-0003", "schema-0004"]
    assert len(list(FOLDER.iterdir())) == 2 * len(SCHEMAS)


def test_the_migrations_make_the_tables(url: str) -> None:
    """What the migrations build and what the code expects do not differ in anything."""
    db = Database(Settings(database_url=url))
    upgrade(db)
    differences, tables = _differences(db)
    db.close()
    assert differences == []
    assert {name for name in tables if not name.startswith("item_search")} == {
        *metadata.tables,
        "alembic_version",
    }


def test_every_step_up_can_be_taken_alone_and_repeated(url: str) -> None:
    """From each revision to the next; the newest again changes nothing."""
    db = Database(Settings(database_url=url))
    script = ScriptDirectory.from_config(alembic_config())
    for revision in reversed(list(script.walk_revisions())):
        upgrade(db, revision.revision)
    upgrade(db)
    assert _revision(db) == newest_revision()
    db.close()


def test_a_released_database_comes_up_with_its_data(
    released: Database, request: pytest.FixtureRequest
) -> None:
    """A database as an earlier version left it: every row is still there, the code works with it."""
    before = _counts(released)
    assert min(before.values()) > 0, "a table of the fixture is empty: run scripts/dump_release.py"
    upgrade(released)
    after = _counts(released)
    differences, _ = _differences(released)
    assert differences == []
    assert {name: after[name] for name in before} == before
    prepare(released, "silo_released_token")
    actor = actor_by_token(released, "silo_released_token", "127.0.0.1")
    assert actor is not None
    # A token of before scopes may do what it could.
    assert (actor.username, actor.role, actor.scope) == ("admin", Role.ADMIN, Scope.ADMIN)
    with released.read() as tx:
        found = search_for(tx, "unicode7")
        assert found is not None
        assert tx.conn.scalars(select(items.c.part_number).where(found[0])).all() == ["Ünïcode-7"]
        assert set(tx.conn.scalars(select(items.c.version))) <= set(range(1, 9))
        assert not any(tx.conn.scalars(select(sessions.c.by_link)))
        top = last_sync(tx, get_item(tx, "ASM-TOP"))
        assert top.at is not None
        told_since = request.node.callspec.params["released"] >= "schema-0003"
        assert [gap["name"] for gap in top.left_out] == (["Lid"] if told_since else [])
        told = [
            (event.username, json.loads(event.data).get("user")) for event in tx.conn.execute(select(events))
        ]
        assert any(user for _, user in told)
        assert all(name == user for name, user in told)
        item = get_item(tx, "asm-001")
        lines = {line.child_part_number: line.state for line in lines_of(tx, item)}
        newest = list_changes(tx, item)[0]
        past = {line.child.part_number: line.state for line in state_at(tx, item, newest.id)}
    assert {number: state.quantity for number, state in lines.items()} == {
        "PRT-100": 1,
        "F01-0001": 12,
        "PRT-400": 2,
    }
    assert lines["PRT-400"].unreferenced_since is not None
    assert lines["PRT-100"].override
    assert past == lines


def test_the_last_syncs_are_taken_over_from_the_history(url: str, tmp_path: Path) -> None:
    """Each assembly has its newest merge, whatever was edited since; lines and history stay as they were."""
    db = _as_released("schema-0001", url, tmp_path)
    upgrade(db, "0002")
    late = {"version": 9, "username": "night", "document_file": "Top Ünï.FCStd", "summary": "merged"}
    changes = [  # the clock of a server may stand still, or go back: the order is that of the ids
        {**late, "parent_id": 2, "kind": "merge", "at": "2026-11-22T01:00:00.000000Z"},
        {**late, "parent_id": 2, "kind": "edit", "at": "2026-11-22T03:00:00.000000Z"},
        {**late, "parent_id": 4, "kind": "edit", "at": "2026-11-22T03:00:00.000000Z"},
    ]
    with db.write() as tx:
        columns = ", ".join(changes[0])
        values = ", ".join(f":{name}" for name in changes[0])
        tx.conn.execute(text(f"INSERT INTO bom_changes ({columns}) VALUES ({values})"), changes)  # noqa: S608
    before = {name: _rows(db, name) for name in ("bom_lines", "bom_changes", "bom_change_lines")}
    merges = {row["parent_id"]: row for row in before["bom_changes"] if row["kind"] == "merge"}
    upgrade(db, "0003")
    assert {name: _rows(db, name) for name in before} == before
    taken = {row["parent_id"]: row for row in _rows(db, "bom_last_syncs")}
    assert taken.keys() == merges.keys() == {2, 3}
    for parent, row in taken.items():
        copied = ("at", "username", "document_file")
        assert [row[name] for name in copied] == [merges[parent][name] for name in copied]
        assert (row["left_out"], row["components"], row["refused_at"], row["refusal"]) == (
            "[]",
            "{}",
            None,
            None,
        )
    upgrade(db)
    with db.read() as tx:
        names = {row.id: row.part_number for row in tx.conn.execute(select(items))}
        top, never = (get_item(tx, names[number]) for number in (2, 4))
        assert last_sync(tx, top).document_file == "Top Ünï.FCStd"
        assert last_sync(tx, never).at is None
        lines = {line.child_part_number: line.state for line in lines_of(tx, top)}
    # Nobody knows which line a missing component had before: none of them reads as removed.
    missing = {"reason": "missing", "name": "Lid", "file": "parts/Lid.FCStd", "object": "Body", "quantity": 1}
    order = read_merge_order({"source": "assembly", "entries": [], "left_out": [missing]}, 10)
    with db.write() as tx:
        merge_bom(tx, top.part_number, order, None)
        after = {line.child_part_number: line.state for line in lines_of(tx, top)}
    assert after == lines
    db.close()


def test_a_revision_that_rebuilds_filled_tables_keeps_their_rows(released: Database, tmp_path: Path) -> None:
    """Rows, references, and the rule that an id is never given out twice, all outlive a rebuild."""
    upgrade(released)
    with released.write() as tx:
        newest = tx.conn.scalars(select(events.c.id).order_by(events.c.id.desc())).first()
        tx.conn.execute(delete(events).where(events.c.id == newest))
        if released.settings.is_sqlite:
            tx.conn.execute(text("CREATE TRIGGER kept AFTER INSERT ON items BEGIN SELECT 1; END"))
        before = tx.conn.execute(select(items).order_by(items.c.id)).mappings().all()
    counts = _counts(released)
    upgrade(released, more=_revision_file(tmp_path, REBUILD))
    assert _revision(released) == "9001"
    assert _counts(released) == counts
    with released.write() as tx:
        rows = tx.conn.execute(text("SELECT * FROM items ORDER BY id")).mappings().all()
        assert [dict(row) for row in rows] == [{**row, "weight_class": "light"} for row in before]
        tx.conn.execute(insert(events).values(name="new", data="{}", at=tx.stamp))
        assert tx.conn.scalars(select(events.c.id).order_by(events.c.id.desc())).first() == newest + 1
        if released.settings.is_sqlite:
            kept = tx.conn.scalar(text("SELECT count(*) FROM sqlite_master WHERE name = 'kept'"))
            assert kept == 1
    # References are enforced again, in the very connection that did the work.
    with pytest.raises(IntegrityError), released.write() as tx:
        tx.conn.execute(text("DELETE FROM items WHERE part_number = 'PRT-400'"))


def test_a_revision_that_loses_referenced_rows_is_refused(released: Database, tmp_path: Path) -> None:
    """Nothing is changed, and nothing of the revision stays."""
    upgrade(released)
    before = _counts(released)
    with pytest.raises((ConfigError, IntegrityError), match=r"bom_lines|foreign key"):
        upgrade(released, more=_revision_file(tmp_path, ORPHANS))
    assert _revision(released) == newest_revision()
    assert _counts(released) == before


def test_a_database_of_a_newer_version_is_one_sentence(
    released: Database, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Which schema it has, which one this version knows, what to do; and the database stays as it is."""
    upgrade(released)
    upgrade(released, more=_revision_file(tmp_path, REBUILD))
    assert main(["serve", "--port", "0", "--database", released.settings.database_url]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "schema 9001 of a newer silo-mod" in told
    assert f"up to {newest_revision()}" in told
    assert _revision(released) == "9001"


def _revision_file(folder: Path, template: str) -> Path:
    versions = folder / "versions"
    versions.mkdir()
    (versions / "9001_later.py").write_text(template.format(head=newest_revision()), "utf-8")
    return versions


def _revision(db: Database) -> str | None:
    with db.engine.connect() as connection:
        return MigrationContext.configure(connection).get_current_revision()


def _differences(db: Database) -> tuple[list[object], set[str]]:
    with db.engine.connect() as connection:
        found = compare_metadata(MigrationContext.configure(connection), metadata)
        # The search index has another form in each database, of which Alembic knows nothing.
        found = [each for each in found if "item_search" not in str(each)]
        return found, set(inspect(connection).get_table_names())


def _rows(db: Database, table: str) -> list[dict[str, object]]:
    with db.read() as tx:
        order = "id" if table in ("bom_lines", "bom_changes") else "1, 2"
        found = tx.conn.execute(text(f"SELECT * FROM {table} ORDER BY {order}"))  # noqa: S608
        return [dict(row) for row in found.mappings()]


def _counts(db: Database) -> dict[str, int]:
    with db.read() as tx:
        names = inspect(tx.conn).get_table_names()
        return {name: tx.conn.scalar(text(f'SELECT count(*) FROM "{name}"')) or 0 for name in names}  # noqa: S608
