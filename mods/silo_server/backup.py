# SPDX-License-Identifier: LGPL-2.1-or-later
"""Backup and restore of a server, database and files, while it serves.

A backup is a folder::

    manifest.json   format, schema, time, rows per table, SHA-256 of the database
    silo.db         all tables of one snapshot, as SQLite, from either database
    files/          every uploaded file and thumbnail that a revision refers to, by hash

As the form is the same for both databases, a backup of SQLite can be restored to PostgreSQL and the other way
round. The database is read before the files: those are written once, before the row that refers to them, and
never deleted while a row does.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import (
    Connection,
    MetaData,
    Select,
    Table,
    column,
    func,
    insert,
    inspect,
    select,
    table,
    text,
    update,
)
from sqlalchemy.exc import SQLAlchemyError

from silo.bom.errors import ConfigError, SiloError, listed
from silo.bom.system_refusals import why_refused
from silo.platform.whole_files import (
    nearest_folder,
    replace_patiently,
    replacing,
    scratch_folder,
    sync_folder,
)
from silo_server.actors import SYSTEM
from silo_server.db.database import Database
from silo_server.db.migrate import STEPS, check_revision, upgrade
from silo_server.db.rows import insert_rows, one_of
from silo_server.db.state import mode_of, put_state
from silo_server.db.tables import (
    FILE_REFERENCES,
    api_tokens,
    device_logins,
    events,
    items,
    login_attempts,
    login_links,
    metadata,
    sessions,
    users,
)
from silo_server.db.transaction import EVENT_CHANNEL, MIGRATION_LOCK, Tx
from silo_server.errors import cause_of
from silo_server.events.log import HORIZON
from silo_server.services import audit, search
from silo_server.services.file_store import FileStore
from silo_server.settings import Settings
from silo_server.times import stamp, utc_now
from silo_server.user_json import dumps

FORMAT = 1
# When the last backup was made, and where; for the page of the system.
BACKED_UP = "backed_up"
# When a backup was last restored to see that it can be, and which.
RESTORE_TRIED = "restore_tried"
# Tables that a restore changes itself: it logs everybody out, and notes that it was done.
_ALTERED = frozenset(
    {"sessions", "login_links", "device_logins", "login_attempts", "events", "audit", "server_state"}
)
PAGE = 5000
CHUNK = 1024 * 1024
# A restored server gives its events ids that none had before, so that every listener, even one that saw more
# than the backup has, gets a reset and reads everything again.
EVENT_ID_STEP = 1_000_000_000

Report = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a backup says of itself. ``missing_files``: hashes that the server itself had lost."""

    format: int
    schema: str
    made_at: str
    database_sha256: str
    rows: dict[str, int]
    files: int
    missing_files: list[str]


def back_up(settings: Settings, target: Path, report: Report = lambda _: None) -> Manifest:
    """Write a backup to the new folder ``target``; it is whole and verified, or it is not there.

    Files that a revision refers to and that the store lost or damaged are named in the manifest; the rest is
    saved anyway. Raises ConfigError.
    """
    if target.exists():
        raise ConfigError(f"backup: {target} exists already; name a folder that does not exist")
    if not target.parent.is_dir():
        raise ConfigError(f"backup: there is no folder {target.parent}")
    if settings.sqlite_path is not None and not settings.sqlite_path.is_file():
        raise ConfigError(f"backup: there is no database {settings.sqlite_path}")
    try:
        part = Path(tempfile.mkdtemp(prefix=f".{target.name[:50]}.", suffix=".part", dir=target.parent))
        try:
            schema, rows = _save_tables(settings, part / "silo.db", report)
            wanted = _checksums(part / "silo.db")
            report(f"files: {len(wanted)}")
            missing = _copy_files(FileStore(settings.storage), FileStore(part / "files"), wanted)
            made = Manifest(
                format=FORMAT,
                schema=schema,
                made_at=stamp(utc_now()),
                database_sha256=_sha256(part / "silo.db"),
                rows=rows,
                files=len(wanted) - len(missing),
                missing_files=missing,
            )
            with replacing(part / "manifest.json") as out:
                out.write(json.dumps(asdict(made), indent=2).encode())
            replace_patiently(part, target)
        finally:
            shutil.rmtree(part, ignore_errors=True)
        sync_folder(target.parent)
        with (
            suppress(SQLAlchemyError, SiloError),
            _open(settings) as db,
            db.write(even_when_read_only=True) as tx,
        ):
            same = target.stat().st_dev == nearest_folder(settings.storage).stat().st_dev
            made_here = {"at": made.made_at, "target": str(target), "same_disk": same}
            put_state(tx, BACKED_UP, dumps(made_here))
    except OSError as error:
        raise ConfigError(f"backup: {target} cannot be written: {why_refused(error)}") from error
    return made


def back_up_before_upgrade(db: Database) -> Path | None:
    """Write a backup if the database holds data and steps of its schema are missing; return the folder.

    A step may change or sort what is there, so the state before it can be restored by the older version.
    Raises ConfigError if the backup cannot be written: then nothing is changed.
    """
    with db.read() as tx:
        if not inspect(tx.conn).has_table("alembic_version"):
            return None
        schema = tx.conn.scalar(text("SELECT version_num FROM alembic_version"))
        if schema is None or schema == max(STEPS):
            return None
        check_revision(str(schema))
        if not tx.conn.scalar(text("SELECT count(*) FROM users")):
            return None
    folder = db.settings.storage.with_name(f"{db.settings.storage.name}-before-upgrade")
    target = folder / f"{schema}-{utc_now():%Y%m%dT%H%M%S%f}"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        back_up(db.settings, target)
    except (OSError, ConfigError) as error:
        raise ConfigError(
            f"the database has the schema {schema}, and a backup is made before it is changed; nothing was "
            f"changed, for {error}. Make room in {folder}, then start again"
        ) from error
    return target


def verify(source: Path) -> Manifest:
    """Check that database and files of a backup are as they were written; return its manifest.

    Raises ConfigError.
    """
    made = _read_manifest(source)
    path = source / "silo.db"
    if not path.is_file() or _sha256(path) != made.database_sha256:
        raise ConfigError(f"restore: {path} is missing or damaged; use another backup")
    store = FileStore(source / "files")
    bad = [c for c in sorted(_checksums(path) - set(made.missing_files)) if not store.holds(c)]
    if bad:
        raise ConfigError(f"restore: {len(bad)} files of the backup are missing or damaged: {listed(bad)}")
    return made


def restore(
    settings: Settings, source: Path, *, replace: bool = False, report: Report = lambda _: None
) -> Manifest:
    """Restore database and files from a backup; the database in one transaction, all of it or nothing.

    The backup is verified, and brought to the newest schema in a copy, before anything is touched. A server
    may run meanwhile: it answers from the old state until the new one is committed; then its listeners get a
    ``reset``. Files that the backup does not have stay in the store.

    replace
        needed if the database has items already.
    """
    made = verify(source)
    check_revision(made.schema, "backup")
    report("the backup is whole")
    try:
        settings.storage.mkdir(mode=0o700, parents=True, exist_ok=True)
        with scratch_folder("restore-", settings.storage) as folder:
            copy = Path(folder) / "silo.db"
            shutil.copyfile(source / "silo.db", copy)
            beside = Settings(database_url=f"sqlite:///{copy}", files_dir=source / "files")
            with _open(beside) as old, _open(settings) as db:
                for sentence in upgrade(old):
                    report(sentence)
                upgrade(db)
                with db.read() as tx:
                    present = tx.conn.scalar(select(func.count()).select_from(items)) or 0
                if present and not replace:
                    raise ConfigError(
                        f"restore: the database has {present} items already; --replace replaces all of it by "
                        "the backup"
                    )
                _copy_files(FileStore(source / "files"), FileStore(settings.storage), _checksums(copy))
                with old.engine.connect() as reader, _exclusive(db) as writer:
                    _replace_rows(reader, Tx(writer, SYSTEM, utc_now(), settings), made, report)
    except OSError as error:
        raise ConfigError(f"restore: {settings.storage} cannot be written: {why_refused(error)}") from error
    return made


def try_restore(settings: Settings, source: Path, report: Report = lambda _: None) -> Manifest:
    """Restore a backup into a scratch folder beside it, compare each table, and note the day at the server.

    The server's own state stays as it is. Raises ConfigError if the backup cannot be restored, or if rows or
    files of it are not there afterwards.
    """
    try:
        with scratch_folder(".restore-test-", source.parent) as name:
            folder = Path(name)
            beside = Settings(database_url=f"sqlite:///{folder / 'silo.db'}", files_dir=folder / "files")
            made = restore(beside, source, report=report)
            with _open(beside) as db, db.read() as tx:
                there = inspect(tx.conn).get_table_names()
                wrong = [
                    table_name
                    for table_name, rows in made.rows.items()
                    if made.schema == max(STEPS)
                    and table_name not in _ALTERED
                    and (
                        table_name not in there
                        or tx.conn.scalar(select(func.count()).select_from(table(table_name))) != rows
                    )
                ]
            store = FileStore(beside.storage)
            kept = _checksums(folder / "silo.db") - {*made.missing_files}
            wrong += [checksum for checksum in sorted(kept) if not store.holds(checksum)]
    except OSError as error:
        raise ConfigError(
            f"restore: no test beside {source}, for that folder cannot be written: {why_refused(error)}"
        ) from error
    if wrong:
        raise ConfigError(f"restore: after a test restore of {source} these differ: {listed(wrong)}")
    with _open(settings) as db, db.write(even_when_read_only=True) as tx:
        put_state(tx, RESTORE_TRIED, dumps({"at": tx.stamp, "made_at": made.made_at, "source": str(source)}))
    return made


@contextmanager
def _open(settings: Settings) -> Iterator[Database]:
    db = Database(settings)
    try:
        yield db
    except SQLAlchemyError as error:
        raise ConfigError(f"the database cannot be used: {cause_of(error)}") from error
    finally:
        db.close()


@contextmanager
def _exclusive(db: Database) -> Iterator[Connection]:
    """Begin a transaction that keeps all other writers, and migrations, waiting; readers continue."""
    with db.engine.execution_options(silo_write=True).connect() as connection, connection.begin():
        if connection.dialect.name == "postgresql":
            connection.execute(text("SET LOCAL statement_timeout = 0"))
            connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))
            names = ", ".join(sorted(metadata.tables))
            connection.execute(text(f"LOCK TABLE {names} IN EXCLUSIVE MODE"))
        yield connection


def _save_tables(settings: Settings, path: Path, report: Report) -> tuple[str, dict[str, int]]:
    rows: dict[str, int] = {}
    with _open(settings) as db, _open(Settings(database_url=f"sqlite:///{path}")) as new, db.read() as tx:
        if tx.postgres:
            tx.conn.execute(text("SET LOCAL statement_timeout = 0"))
        if not inspect(tx.conn).has_table("alembic_version"):
            raise ConfigError("backup: this is not the database of a Silo server")
        schema = str(tx.conn.scalar(text("SELECT version_num FROM alembic_version")))
        # The backup has the schema that the database has, even if that is older than this version's.
        check_revision(schema)
        upgrade(new, schema)
        with new.engine.execution_options(silo_write=True).connect() as writer, writer.begin():
            into = Tx(writer, SYSTEM, utc_now(), new.settings)
            tables = MetaData()
            tables.reflect(writer, only=lambda name, _: name in metadata.tables)
            for target in reversed(tables.sorted_tables):
                writer.execute(target.delete())
            for target in tables.sorted_tables:
                names = [c.name for c in target.columns]
                origin = table(target.name, *[column(name) for name in names])
                rows[target.name] = _copy_rows(tx.conn, select(*origin.columns), into, target)
                report(f"{target.name}: {rows[target.name]} rows")
            _set_highest_ids(writer, _highest_ids(tx.conn, tables.tables.values()))
    with closing(sqlite3.connect(path)) as saved:
        saved.execute("PRAGMA journal_mode = DELETE")  # one file, with nothing beside it
        if saved.execute("PRAGMA integrity_check").fetchall() != [("ok",)]:
            raise ConfigError("backup: the copy of the database is damaged; is the disk sound?")
        if saved.execute("PRAGMA foreign_key_check").fetchall():
            raise ConfigError("backup: the database refers to rows that it does not have")
    return schema, rows


def _replace_rows(reader: Connection, tx: Tx, made: Manifest, report: Report) -> None:
    revoked = tx.conn.scalars(
        select(api_tokens.c.token_hash).where(api_tokens.c.revoked_at.is_not(None))
    ).all()
    inactive = tx.conn.scalars(select(users.c.username_key).where(~users.c.active)).all()
    user_count = tx.conn.scalar(select(func.count()).select_from(users)) or 0
    highest = _highest_ids(tx.conn, metadata.sorted_tables)
    for target in reversed(metadata.sorted_tables):
        tx.conn.execute(target.delete())
    for target in metadata.sorted_tables:
        if target in (sessions, login_links, device_logins, login_attempts):
            continue  # a restore lets no one in who would not be let in by it now
        count = _copy_rows(reader, select(target), tx, target)
        report(f"{target.name}: {count} rows")
    _keep_out(tx, revoked, inactive)
    if not user_count:
        report(
            f"tokens that were revoked, users that were deactivated and passwords that were changed after "
            f"{made.made_at} are as they were before; look at them on the page of the users"
        )
    for name, value in _highest_ids(reader, metadata.sorted_tables).items():
        highest[name] = max(highest.get(name, 0), value)
    horizon = highest.get("events", 0) + EVENT_ID_STEP
    put_state(tx, HORIZON, str(horizon))
    # Servers that run look for events above the newest they know, and find by this one that all is new.
    tx.conn.execute(
        insert(events).values(
            id=horizon + 1, name="server.state", data=dumps({"mode": mode_of(tx)}), at=tx.stamp
        )
    )
    _set_highest_ids(tx.conn, {**highest, "events": horizon + 1})
    search.rebuild_index(tx)
    audit.note(tx, "server.restored", detail=f"backup of {made.made_at}")
    if tx.postgres:
        tx.conn.execute(select(func.pg_notify(EVENT_CHANNEL, "")))


def _keep_out(tx: Tx, revoked: Sequence[str], inactive: Sequence[str]) -> None:
    """Revoke tokens and deactivate users again, if that was done since the backup was made."""
    tokens = one_of(tx, api_tokens.c.token_hash, revoked) & api_tokens.c.revoked_at.is_(None)
    tx.conn.execute(update(api_tokens).where(tokens).values(revoked_at=tx.stamp))
    tx.conn.execute(update(users).where(one_of(tx, users.c.username_key, inactive)).values(active=False))


def _copy_rows(reader: Connection, query: Select[Any], writer: Tx, target: Table) -> int:
    count = 0
    names = [c.name for c in target.columns]
    with reader.execute(query, execution_options={"yield_per": PAGE}) as rows:
        for page in rows.partitions(PAGE):
            insert_rows(writer, target, [dict(zip(names, row, strict=True)) for row in page])
            count += len(page)
    return count


def _highest_ids(connection: Connection, tables: Collection[Table]) -> dict[str, int]:
    """Find the highest id that each table has ever given out."""
    names = [t.name for t in tables if "id" in t.c and t.c["id"].type.python_type is int]
    if connection.dialect.name == "sqlite":
        rows = connection.execute(text("SELECT name, seq FROM sqlite_sequence")).all()
        return {name: seq for name, seq in rows if name in names}
    highest = {}
    for name in names:
        sequence = connection.scalar(select(func.pg_get_serial_sequence(name, "id")))
        called, last = connection.execute(text(f"SELECT is_called, last_value FROM {sequence}")).one()  # noqa: S608
        if called:
            highest[name] = int(last)
    return highest


def _set_highest_ids(connection: Connection, highest: dict[str, int]) -> None:
    for name, value in highest.items():
        if connection.dialect.name == "sqlite":
            values = {"name": name, "seq": value}
            connection.execute(text("DELETE FROM sqlite_sequence WHERE name = :name"), values)
            connection.execute(text("INSERT INTO sqlite_sequence (name, seq) VALUES (:name, :seq)"), values)
        else:
            # A table that never had a row begins at 1, which is not taken yet.
            sequence = func.pg_get_serial_sequence(name, "id")
            connection.execute(select(func.setval(sequence, max(value, 1), value > 0)))


def _checksums(path: Path) -> set[str]:
    """Find the hashes of all files that the saved database refers to."""
    checksums: set[str] = set()
    with closing(sqlite3.connect(path)) as saved:
        # An older schema has fewer tables.
        tables = {row[0] for row in saved.execute("SELECT name FROM sqlite_master")}
        for place in FILE_REFERENCES:
            if place.table.name in tables:
                checksums.update(row[0] for row in saved.execute(f"{select(place).distinct()}") if row[0])
    return checksums


def _copy_files(source: FileStore, target: FileStore, wanted: Collection[str]) -> list[str]:
    """Copy the files that the target lacks; return the hashes that the source lacks or has damaged."""
    return [c for c in sorted(wanted) if not target.renew(c) and not target.copy_from(source, c)]


def _read_manifest(source: Path) -> Manifest:
    try:
        made = Manifest(**json.loads((source / "manifest.json").read_text("utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise ConfigError(f"restore: {source} is not a backup: its manifest.json cannot be read") from error
    if made.format != FORMAT:
        raise ConfigError(
            f"restore: the backup has the format {made.format}, this version knows {FORMAT}; use a newer one"
        )
    return made


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
