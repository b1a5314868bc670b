# SPDX-License-Identifier: LGPL-2.1-or-later
"""A backup comes before each upgrade of a database that holds data; without it nothing is changed."""

from __future__ import annotations

from pathlib import Path

import pytest
from server_testing import sqlite_database
from sqlalchemy import text

from silo.bom.errors import ConfigError
from silo_server import backup
from silo_server.db.database import Database
from silo_server.db.migrate import STEPS, upgrade
from silo_server.run import prepare
from silo_server.settings import Settings

OLD = "0018"


@pytest.fixture(name="settings")
def _settings(empty_url: str, tmp_path: Path) -> Settings:
    return Settings(database_url=empty_url, files_dir=tmp_path / "files")


def _old(settings: Settings, users: int) -> Database:
    db = Database(settings)
    upgrade(db, OLD)
    with db.write() as tx:
        for number in range(users):
            columns = "username, username_key, display_name, role, active, created_at, approver"
            name, at = f"user{number}", "2026-01-01T00:00:00.000000Z"
            values = f"'{name}', '{name}', 'a', 'admin', true, '{at}', true"
            tx.conn.execute(text(f"INSERT INTO users ({columns}) VALUES ({values})"))  # noqa: S608
    return db


def _schema(db: Database) -> str:
    with db.read() as tx:
        return str(tx.conn.scalar(text("SELECT version_num FROM alembic_version")))


def test_the_state_before_an_upgrade_is_kept_whole(settings: Settings, tmp_path: Path) -> None:
    db = _old(settings, users=1)
    welcome = prepare(db, "silo_test")
    (saved,) = (tmp_path / "files-before-upgrade").iterdir()
    assert any(str(saved) in warning for warning in welcome.warnings)
    assert (backup.verify(saved).schema, _schema(db)) == (OLD, max(STEPS))
    # It can be restored, and a start that changes nothing makes no other.
    other = Settings(database_url=sqlite_database(tmp_path / "other.db"), files_dir=tmp_path / "other")
    backup.restore(other, saved)
    prepare(db, "silo_test")
    assert len(list(saved.parent.iterdir())) == 1
    db.close()


def test_a_new_or_empty_database_is_not_backed_up(settings: Settings, tmp_path: Path) -> None:
    db = _old(settings, users=0)
    prepare(db, "silo_test")
    assert not (tmp_path / "files-before-upgrade").exists()
    db.close()


def test_without_a_backup_nothing_is_changed(settings: Settings, tmp_path: Path) -> None:
    db = _old(settings, users=1)
    (tmp_path / "files-before-upgrade").write_text("in the way")
    with pytest.raises(ConfigError, match="nothing was changed"):
        prepare(db, "silo_test")
    assert _schema(db) == OLD
    db.close()
