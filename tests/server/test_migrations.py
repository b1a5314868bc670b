# SPDX-License-Identifier: LGPL-2.1-or-later
"""The schema: the migrations make exactly the tables, and keep the rows of a filled first schema."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from hunting import over
from sqlalchemy import Connection, MetaData, Table, inspect, select, text

from silo.bom.errors import ConfigError
from silo.cli.main import main
from silo_server import backup
from silo_server.db.database import Database
from silo_server.db.migrate import STEPS, upgrade
from silo_server.db.tables import metadata
from silo_server.run import prepare
from silo_server.settings import Settings

FIRST = "0007"
REVISIONS = list(STEPS)


@pytest.fixture
def first(empty_url: str, tmp_path: Path) -> Any:
    """A database of the first schema, with a row in each table."""
    db = Database(Settings(database_url=empty_url, files_dir=tmp_path))
    upgrade(db, FIRST)
    with db.write() as tx:
        fill(tx.conn)
    yield db
    db.close()


def fill(connection: Connection) -> None:
    """Add a row to each table that the connection's schema has, but to the search index."""
    tables = MetaData()
    tables.reflect(connection, only=lambda name, _: not name.startswith(("item_search", "alembic")))
    for each in tables.sorted_tables:
        connection.execute(each.insert().values(_row(each)))


def _row(table: Table) -> dict[str, object]:
    plain: dict[type, object] = {int: 1, float: 2.5, bool: True, str: "2026-11-22T01:00:00.000000Z"}
    own = {
        "users": {"role": "admin", "username": "zoe", "username_key": "zoe"},
        "items": {
            "properties": '{"mass_kg": 0.25}',
            "archived_at": None,
            "thumbnail_key": None,
            "version": 3,
        },
        "revisions": {"properties": "{}", "links": "[]", "file_checksum": "0" * 64, "thumbnail_key": None},
        "bom_lines": {"reference_designators": "[]", "metadata": "{}", "rel_type": "component"},
        "bom_last_syncs": {"left_out": "[]", "components": "{}"},
        "events": {"data": '{"user": "zoe"}', "username": "zoe"},
        "api_tokens": {"scope": "admin"},
        "login_failures": {"address": "127.0.0.1"},
    }
    row = {
        column.name: plain[column.type.python_type]
        if column.type.python_type is not str
        else str(plain[str])[: getattr(column.type, "length", None) or 27]
        for column in table.columns
        if not (column.primary_key and column.type.python_type is int and column.name == "id")
    }
    return {**row, **own.get(table.name, {})}


def test_the_migrations_make_the_tables(empty_url: str) -> None:
    """What the migrations build and what the code expects do not differ in anything."""
    db = Database(Settings(database_url=empty_url))
    upgrade(db)
    differences, tables = _differences(db)
    db.close()
    assert differences == []
    assert {name for name in tables if not name.startswith("item_search")} == {
        *metadata.tables,
        "alembic_version",
    }


def test_a_filled_database_comes_up_step_by_step_with_its_rows(first: Database) -> None:
    """Each step alone, and the newest again, which changes nothing; then a server starts with it."""
    before = _rows(first)
    assert all(before.values()), "a table of the first schema is empty"
    for revision in [*REVISIONS, REVISIONS[-1]]:
        upgrade(first, revision)
        assert _revision(first) == revision
    assert _differences(first)[0] == []
    after = _rows(first)
    for name in before.keys() & after.keys():
        for old, new in zip(before[name], after[name], strict=True):
            kept = {key: value for key, value in old.items() if key in new}
            kept |= {key: "2.5" for key in kept if key in _NUMBERS and kept[key] == 2.5}
            assert kept.items() <= new.items()
    welcome = prepare(first)
    assert welcome.username == "zoe"


# Kept as text since 0025.
_NUMBERS = ("quantity", "cad_quantity")


def test_quantities_become_exact_and_dust_is_listed(empty_url: str, tmp_path: Path) -> None:
    """0.1 + 0.2 of an old program is 0.3, and is named; what was typed with many digits keeps them."""
    db = Database(Settings(database_url=empty_url, files_dir=tmp_path))
    upgrade(db, "0024")
    with db.write() as tx:
        fill(tx.conn)
        tx.conn.execute(
            text("UPDATE bom_lines SET quantity = :dust, cad_quantity = :typed"),
            {"dust": 0.1 + 0.2, "typed": 0.1234567890123456},
        )
        tx.conn.execute(text("UPDATE bom_conflicts SET cad_quantity = 1e9"))
        number = tx.conn.scalar(text("SELECT part_number FROM items"))
    said = f"quantity of {number} in {number}: 0.30000000000000004 was rounded to 0.3"
    assert upgrade(db) == [said]
    with db.read() as tx:
        row = tx.conn.execute(text("SELECT quantity, cad_quantity FROM bom_lines")).one()
        assert tuple(row) == ("0.3", "0.1234567890123456")
        assert tx.conn.scalar(text("SELECT cad_quantity FROM bom_conflicts")) == "1000000000"
    db.close()


def test_units_get_their_one_form_and_the_others_are_listed(
    empty_url: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Of lines and in their history, so that the line is still as its last change left it."""
    db = Database(Settings(database_url=empty_url, files_dir=tmp_path))
    upgrade(db, "0019")
    with db.write() as tx:
        fill(tx.conn)
        state = '{"quantity":2.5,"source":"manual","unit":"Stk.","notes":"ä"}'
        tx.conn.execute(text("UPDATE bom_lines SET unit = 'Stk.'"))
        tx.conn.execute(text("UPDATE bom_change_lines SET before = NULL, after = :state"), {"state": state})
        tx.conn.execute(text("UPDATE orders SET unit = 'Karton'"))
    upgrade(db, "0020")
    with db.read() as tx:
        assert tx.conn.scalar(text("SELECT unit FROM bom_lines")) == "pcs"
        after = tx.conn.scalar(text("SELECT after FROM bom_change_lines"))
        assert after == state.replace("Stk.", "pcs")
        assert tx.conn.scalar(text("SELECT unit FROM orders")) == "Karton"
    assert "none that we know" not in caplog.text
    db.close()


@over("sqlite")
@pytest.mark.parametrize(
    ("revision", "sentence"),
    [
        (
            "9001",
            f"the schema 9001 of a newer silo-mod, and this version reads schemas up to {REVISIONS[-1]};",
        ),
        (
            "0006",
            "the schema 0006 of a silo-mod before the first release, and this version reads schemas from "
            f"{FIRST} on;",
        ),
    ],
)
def test_a_database_of_another_version_is_one_sentence(
    first: Database, tmp_path: Path, revision: str, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """At a start, in a backup, in a restore: which schema, which are read, what to do; nothing changes."""
    saved = tmp_path / "saved"
    backup.back_up(first.settings, saved)
    manifest = saved / "manifest.json"
    manifest.write_text(manifest.read_text("utf-8").replace(f'"{FIRST}"', f'"{revision}"'), "utf-8")
    with first.write() as tx:
        tx.conn.execute(text("UPDATE alembic_version SET version_num = :to"), {"to": revision})
    before = _rows(first)
    assert main(["serve", "--port", "0", "--database", first.settings.database_url]) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1
    assert f"the database has {sentence}" in printed
    with pytest.raises(ConfigError, match="the database has the schema " + revision):
        backup.back_up(first.settings, tmp_path / "again")
    with pytest.raises(ConfigError, match="the backup has the schema " + revision):
        backup.restore(first.settings, saved, replace=True)
    assert (_revision(first), _rows(first)) == (revision, before)


def test_a_backup_of_the_first_schema_is_brought_up_to_date(first: Database, tmp_path: Path) -> None:
    """Made before an update, restored after it."""
    made = backup.back_up(first.settings, tmp_path / "saved")
    assert made.schema == FIRST
    assert made.missing_files == ["0" * 64]
    upgrade(first)
    backup.restore(first.settings, tmp_path / "saved", replace=True)
    with first.read() as tx:
        assert tx.conn.scalar(select(metadata.tables["items"].c.version)) == 3


def test_each_item_with_a_file_gets_its_document(first: Database) -> None:
    """With the item's UUID, the revisions that have a file, and what the newest one links to."""
    target = str(uuid4())
    with first.write() as tx:
        tables = MetaData()
        tables.reflect(tx.conn, only=["items", "revisions"])
        links = f'[{{"path": "a.FCStd", "item": "{target}"}}, {{"path": "b.FCStd", "item": ""}}]'
        row = {**_row(tables.tables["revisions"]), "item_id": 1, "links": links, "idempotency_key": None}
        into = tables.tables["revisions"].insert()
        tx.conn.execute(into.values({**row, "revision_number": 2}))
        tx.conn.execute(into.values({**row, "revision_number": 3, "file_checksum": None, "links": None}))
    upgrade(first)
    with first.read() as tx:
        uuid = tx.conn.scalar(select(metadata.tables["items"].c.uuid))
        documents = metadata.tables["documents"].c
        assert tx.conn.execute(select(documents.uuid, documents.current_revision)).all() == [(uuid, 2)]
        revisions = metadata.tables["revisions"].c
        rows = tx.conn.execute(
            select(revisions.revision_number, revisions.document_id).order_by(revisions.revision_number)
        ).all()
        assert rows == [(1, 1), (2, 1), (3, None)]
        assert tx.conn.execute(select(metadata.tables["document_items"])).all() == [(1, 1, "")]
        assert tx.conn.execute(select(metadata.tables["document_links"])).all() == [(1, target)]


def _revision(db: Database) -> str | None:
    with db.engine.connect() as connection:
        return MigrationContext.configure(connection).get_current_revision()


def _differences(db: Database) -> tuple[list[object], set[str]]:
    with db.engine.connect() as connection:
        found = compare_metadata(MigrationContext.configure(connection), metadata)
        # The search index has another form in each database, of which Alembic knows nothing.
        found = [each for each in found if "item_search" not in str(each)]
        return found, set(inspect(connection).get_table_names())


def _rows(db: Database) -> dict[str, list[dict[str, object]]]:
    with db.read() as tx:
        names = [
            name
            for name in inspect(tx.conn).get_table_names()
            if "search" not in name and "alembic" not in name
        ]
        return {
            name: [dict(row) for row in tx.conn.execute(text(f'SELECT * FROM "{name}"')).mappings()]  # noqa: S608
            for name in names
        }
