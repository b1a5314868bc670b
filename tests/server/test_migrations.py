# SPDX-License-Identifier: LGPL-2.1-or-later
"""The schema: the migrations make exactly the tables, from every released state, with the data kept."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect

from silo_server.bootstrap import prepare
from silo_server.db.engine import Database
from silo_server.db.migrate import alembic_config, upgrade
from silo_server.db.tables import metadata
from silo_server.services.history import list_changes, state_at
from silo_server.services.items import get_item
from silo_server.services.lines import lines_of
from silo_server.settings import Settings

RELEASED = sorted((Path(__file__).parent / "released").glob("*.sql"))


def test_the_migrations_make_the_tables(url: str) -> None:
    """What the migrations build and what the code expects do not differ in anything."""
    db = Database(Settings(database_url=url))
    upgrade(db)
    with db.engine.connect() as connection:
        differences = compare_metadata(MigrationContext.configure(connection), metadata)
        tables = set(inspect(connection).get_table_names())
    db.close()
    assert differences == []
    assert tables == set(metadata.tables) | {"alembic_version"}


def test_every_step_up_can_be_taken_alone_and_repeated(url: str) -> None:
    """From each revision to the next; the newest again changes nothing."""
    db = Database(Settings(database_url=url))
    script = ScriptDirectory.from_config(alembic_config())
    for revision in reversed(list(script.walk_revisions())):
        upgrade(db, revision.revision)
    upgrade(db)
    with db.engine.connect() as connection:
        heads = MigrationContext.configure(connection).get_current_heads()
    db.close()
    assert heads == tuple(script.get_heads())


@pytest.mark.parametrize("dump", RELEASED, ids=[path.stem for path in RELEASED])
def test_a_released_database_comes_up_with_its_data(dump: Path, tmp_path: Path) -> None:
    """A database as version so-and-so left it: items, BOM, history and the token are all there."""
    path = tmp_path / "old.db"
    with sqlite3.connect(path) as connection:
        connection.executescript(dump.read_text("utf-8"))
    connection.close()
    db = Database(Settings(database_url=f"sqlite:///{path}", files_dir=tmp_path))
    prepare(db, "silo_released_token")
    with db.read() as tx:
        item = get_item(tx, "ASM-001")
        lines = {line.child_part_number: line.state for line in lines_of(tx, item)}
        newest = list_changes(tx, item)[0]
        past = {line.child.part_number: line.state for line in state_at(tx, item, newest.id)}
    db.close()
    assert {number: state.quantity for number, state in lines.items()} == {
        "PRT-100": 1,
        "F01-0001": 12,
        "PRT-400": 2,
    }
    assert lines["PRT-400"].unreferenced_since is not None
    assert lines["PRT-100"].source == "manual"
    assert past == lines


def test_there_is_a_dump_of_every_release() -> None:
    """The released schemas are kept here; without them the test above would test nothing."""
    assert [path.stem for path in RELEASED] == ["0.1.0"]
