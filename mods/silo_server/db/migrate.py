# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bring a database to the newest schema; run at every start, by one process at a time.

A change of a table is a new step at the end of :data:`STEPS`; what a step does stays. A step makes a table as
it is in :mod:`silo_server.db.tables`: a change that comes later is taken out again in the step that makes the
table, as ``_first_schema`` does it (``tests/server/test_migrations.py`` fails until then). The first step has
the identifier of the last of the seven steps that led to it, so that a database made by them opens.
``alembic_version`` holds the newest step that a database has.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
    false,
    func,
    literal,
    select,
)

from silo.bom.errors import ConfigError
from silo_server.db.engine import MIGRATION_LOCK, Database
from silo_server.db.tables import NAMES, Id, Stamp, metadata

if TYPE_CHECKING:
    from alembic.operations import Operations


def upgrade(db: Database, revision: str = "") -> None:
    """Apply the steps that are missing up to ``revision`` (or to the newest), in one transaction.

    SQLite's write transaction and PostgreSQL's advisory lock keep a second server that starts at the same
    time waiting until the first is through. Raises ConfigError for a schema that this version does not read.
    """
    with db.engine.execution_options(silo_write=True).connect() as connection, connection.begin():
        if connection.dialect.name == "postgresql":
            connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))
        version = Table(
            "alembic_version",
            MetaData(naming_convention=NAMES),
            Column("version_num", Stamp, primary_key=True),
        )
        version.create(connection, checkfirst=True)
        before = connection.scalar(select(version.c.version_num))
        if before is not None:
            check_revision(before)
        missing = [step for step in STEPS if (before or "") < step <= (revision or max(STEPS))]
        if not missing:
            return
        from alembic.migration import MigrationContext  # late: most starts change nothing
        from alembic.operations import Operations

        names = {"target_metadata": MetaData(naming_convention=NAMES)}
        op = Operations(MigrationContext.configure(connection, opts=names))
        for step in missing:
            STEPS[step](op)
        connection.execute(version.delete())
        connection.execute(version.insert().values(version_num=missing[-1]))


def check_revision(revision: str, holder: str = "database") -> None:
    """Raise ConfigError if this version does not read the schema ``revision`` of the ``holder``."""
    oldest, newest = min(STEPS), max(STEPS)
    if revision in STEPS:
        return
    if revision < oldest:
        raise ConfigError(
            f"the {holder} has the schema {revision} of a silo-mod before the first release, and this "
            f"version reads schemas from {oldest} on; nothing was changed. Start the version before this one "
            "once, or begin with a new database"
        )
    raise ConfigError(
        f"the {holder} has the schema {revision} of a newer silo-mod, and this version reads schemas up to "
        f"{newest}; nothing was changed. Start the newer version or restore a backup"
    )


def _add(*names: str) -> Callable[[Operations], None]:
    """Return a step that makes these tables as they are today."""
    made = [metadata.tables[name] for name in names]
    return lambda op: metadata.create_all(op.get_bind(), tables=made)


def _first_schema(op: Operations) -> None:
    """Make the tables of the first schema."""
    before = MetaData(naming_convention=NAMES)
    _add(
        *("server_state", "items", "number_counters", "bom_lines", "bom_changes", "bom_change_lines"),
        *("bom_conflicts", "bom_last_syncs", "events", "users", "api_tokens", "sessions", "login_links"),
        "audit",
    )(op)
    for table, later in (("items", ("supplier_parts", "origins", "made_from")), ("users", ("approver",))):
        for name in later:
            op.drop_column(table, name)
    op.add_column("items", Column("created_as", String(64)))
    Table("items", before, Column("id", Id, primary_key=True))
    Table(
        "revisions",
        before,
        Column("id", Id, primary_key=True),
        Column("item_id", Id, ForeignKey("items.id"), nullable=False),
        Column("revision_number", Integer, nullable=False),
        Column("properties", Text, nullable=False),
        Column("comment", Text, nullable=False),
        Column("status", String(16), nullable=False),
        Column("file_name", Text),
        Column("file_checksum", String(64)),
        Column("file_size", BigInteger),
        Column("thumbnail_key", String(64)),
        Column("idempotency_key", String(128)),
        Column("created_at", Stamp, nullable=False),
        Column("created_by", String(64), nullable=False),
        Column("base_revision", Integer),
        Column("file_path", Text),
        Column("links", Text),
        UniqueConstraint("item_id", "revision_number"),
        UniqueConstraint("item_id", "idempotency_key"),
        Index(None, "file_checksum"),
        sqlite_autoincrement=True,
    )
    Table(
        "bom_syncs",
        before,
        Column("parent_id", Id, ForeignKey("items.id"), primary_key=True),
        Column("sync_id", String(128), primary_key=True),
        Column("request_hash", String(64), nullable=False),
        Column("answer", Text, nullable=False),
        Column("version", Integer, nullable=False),
        Column("at", Stamp, nullable=False),
        Column("change_id", Id),
        Index(None, "at"),
    )
    Table(
        "login_failures",
        before,
        Column("id", Id, primary_key=True),
        Column("username_key", String(64), nullable=False),
        Column("address", String(64), nullable=False),
        Column("at", Stamp, nullable=False),
        Index(None, "username_key", "at"),
        Index(None, "address", "at"),
        sqlite_autoincrement=True,
    )
    before.create_all(op.get_bind())
    # The server fills the index of the search at its next start (``silo_server.services.search``).
    if op.get_bind().dialect.name == "sqlite":
        op.execute(
            "CREATE VIRTUAL TABLE item_search USING fts5(number, name, other, detail=column, columnsize=0, "
            "prefix='2 3 4', tokenize=\"unicode61 remove_diacritics 0 categories 'L* N* Co Cn'\")"
        )
    else:
        op.execute("CREATE TABLE item_search (item_id bigint PRIMARY KEY, words tsvector NOT NULL)")
        op.execute("CREATE INDEX ix_item_search_words ON item_search USING gin (words)")


def _answers(op: Operations) -> None:
    """Keep answers to repeated requests of all kinds, in place of those to two kinds."""
    _add("answers")(op)
    op.drop_table("bom_syncs")
    op.drop_column("items", "created_as")
    with op.batch_alter_table("revisions", table_kwargs={"sqlite_autoincrement": True}) as batch:
        batch.drop_constraint("uq_revisions_item_id_idempotency_key", type_="unique")
        batch.drop_column("idempotency_key")


def _login_attempts(op: Operations) -> None:
    """Keep how each attempt to log in ended."""
    op.drop_table("login_failures")
    _add("login_attempts")(op)


def _documents(op: Operations) -> None:
    """Keep files as documents, with the items that they hold and the documents that they link to.

    Each item that has a file gets a document with the item's UUID, whose revisions are the item's.
    """
    _add("documents", "document_items", "document_links")(op)
    with op.batch_alter_table("revisions", table_kwargs={"sqlite_autoincrement": True}) as batch:
        batch.alter_column("item_id", existing_type=Id, nullable=True)
        batch.add_column(Column("document_id", Id))
        batch.create_foreign_key("fk_revisions_document_id_documents", "documents", ["document_id"], ["id"])
        batch.create_unique_constraint(
            "uq_revisions_document_id_revision_number", ["document_id", "revision_number"]
        )
    bind = op.get_bind()
    tables = MetaData()
    tables.reflect(bind, only=["items", "documents", "revisions", "document_items", "document_links"])
    items, documents, revisions = (tables.tables[name] for name in ("items", "documents", "revisions"))
    with_file = revisions.c.file_checksum.is_not(None)
    newest = (
        select(
            revisions.c.item_id,
            func.max(revisions.c.revision_number).label("number"),
            func.min(revisions.c.created_at).label("at"),
        )
        .where(with_file)
        .group_by(revisions.c.item_id)
        .subquery()
    )
    added = select(items.c.uuid, items.c.id, newest.c.number, newest.c.at, items.c.created_by)
    names = ["uuid", "item_id", "current_revision", "created_at", "created_by"]
    bind.execute(documents.insert().from_select(names, added.join(newest, newest.c.item_id == items.c.id)))
    its = select(documents.c.id).where(documents.c.item_id == revisions.c.item_id).scalar_subquery()
    bind.execute(revisions.update().where(with_file).values(document_id=its))
    held = select(documents.c.id, documents.c.item_id, literal(""))
    bind.execute(
        tables.tables["document_items"].insert().from_select(["document_id", "item_id", "object"], held)
    )
    newest_links = select(documents.c.id, revisions.c.links).join(
        revisions,
        (revisions.c.document_id == documents.c.id)
        & (revisions.c.revision_number == documents.c.current_revision),
    )
    links = {
        (row.id, link["item"])
        for row in bind.execute(newest_links.where(revisions.c.links.is_not(None)))
        for link in json.loads(row.links)
        if link.get("item")
    }
    if links:
        into = tables.tables["document_links"].insert()
        bind.execute(
            into, [{"document_id": document, "target": target} for document, target in sorted(links)]
        )


def _releases(op: Operations) -> None:
    """Keep released revisions of products, who may approve them, and what is frozen of each item."""
    op.add_column("users", Column("approver", Boolean, nullable=False, server_default=false()))
    _add("frozen_items", "releases", "release_approvals")(op)


def _supplier_parts_and_orders(op: Operations) -> None:
    """Keep supplier parts of items, their changes, and orders."""
    op.add_column("items", Column("supplier_parts", Text))
    _add("supplier_changes", "orders")(op)


def _origins_of_facts(op: Operations) -> None:
    """Keep where mass and material of an item come from, and its file beside its properties."""
    op.add_column("items", Column("origins", Text))
    op.add_column("items", Column("made_from", String(64)))
    bind = op.get_bind()
    items = Table("items", MetaData(), autoload_with=bind)
    with_file = select(items.c.id, items.c.properties).where(items.c.properties.like('%"file_sha256"%'))
    for number, stored in bind.execute(with_file).all():
        properties = json.loads(stored)
        checksum = properties.pop("file_sha256", None)
        if isinstance(checksum, str) and len(checksum) <= 64:
            left = json.dumps(properties, separators=(",", ":"), ensure_ascii=False)
            changed = {"properties": left, "made_from": checksum.lower()}
            bind.execute(items.update().where(items.c.id == number).values(changed))


STEPS: dict[str, Callable[[Operations], None]] = {
    "0007": _first_schema,
    "0008": _answers,
    "0009": _login_attempts,
    "0011": _documents,
    "0012": _add("product_summaries"),
    "0013": _add("product_looks"),
    "0014": _releases,
    "0015": _add("models"),
    "0016": _supplier_parts_and_orders,
    "0017": _origins_of_facts,
    "0018": _add("follows", "assignees"),
}
