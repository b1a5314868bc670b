# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bring a database to the newest schema; run at every start, by one process at a time.

A change of a table is a new step at the end of :data:`STEPS`; a step that is there stays as it is. The first
has the identifier of the last of the seven steps that led to it, so that a database made by them opens.
``alembic_version`` holds the newest step that a database has.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Connection,
    Float,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    Row,
    String,
    Table,
    Text,
    UniqueConstraint,
    and_,
    false,
    func,
    literal,
    select,
)

from silo.bom.errors import ConfigError, listed
from silo.bom.quantities import decimal_text, quantity_of
from silo.bom.units import known_unit, stored_unit
from silo.file_kind import MODEL, kind_by_name, kind_of
from silo_server.db.database import Database
from silo_server.db.tables import NAMES, needed, only, primary
from silo_server.db.transaction import MIGRATION_LOCK

if TYPE_CHECKING:
    from alembic.operations import Operations

_log = logging.getLogger("silo_server.migrate")

Id = BigInteger().with_variant(Integer, "sqlite")
Stamp = String(32)
Key = String(64).with_variant(String(64, collation="C"), "postgresql")
Uuid = String(36)

# What a step finds in the options of its context: the folder of the files, and where it says what it left.
FILES, LEFT = "silo_files", "silo_left"


def upgrade(db: Database, revision: str = "") -> list[str]:
    """Apply the steps that are missing up to ``revision`` (or to the newest), in one transaction.

    Returns what a step could not decide and left as it is, in sentences.

    SQLite's write transaction and PostgreSQL's advisory lock keep a second server that starts at the same
    time waiting until the first is through. Raises ConfigError for a schema that this version does not read.
    """
    with db.engine.execution_options(silo_write=True).connect() as connection, connection.begin():
        if connection.dialect.name == "postgresql":
            connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))
        version = Table(
            "alembic_version",
            MetaData(naming_convention=NAMES),
            primary("version_num", Stamp),
        )
        version.create(connection, checkfirst=True)
        before = connection.scalar(select(version.c.version_num))
        if before is not None:
            check_revision(before)
        missing = [step for step in STEPS if (before or "") < step <= (revision or max(STEPS))]
        if not missing:
            return []
        from alembic.migration import MigrationContext  # late: most starts change nothing
        from alembic.operations import Operations

        left: list[str] = []
        opts = {"target_metadata": MetaData(naming_convention=NAMES), FILES: db.settings.storage, LEFT: left}
        op = Operations(MigrationContext.configure(connection, opts=opts))
        for step in missing:
            STEPS[step](op)
        connection.execute(version.delete())
        connection.execute(version.insert().values(version_num=missing[-1]))
        return left


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


def _first_schema(op: Operations) -> None:
    metadata = MetaData(naming_convention=NAMES)
    Table(
        "server_state",
        metadata,
        primary("key", String(64)),
        needed("value", Text),
    )
    Table(
        "items",
        metadata,
        primary("id", Id),
        needed("uuid", Uuid, unique=True),
        needed("part_number", String(64)),
        needed("part_number_key", Key, unique=True),
        Column("schema_name", String(64)),
        Column("category", String(32)),
        needed("item_type", String(32)),
        needed("name", Text),
        needed("description", Text),
        Column("sourcing_type", String(64)),
        Column("long_description", Text),
        Column("thumbnail_key", String(64)),
        needed("properties", Text),
        needed("current_revision", Integer),
        needed("bom_version", Integer),
        needed("version", Integer, server_default="1"),
        Column("created_as", String(64)),
        needed("created_at", Stamp),
        needed("created_by", String(64)),
        needed("updated_at", Stamp),
        needed("updated_by", String(64)),
        Column("archived_at", Stamp),
        Index(None, "archived_at", "part_number_key"),
        Index(None, "archived_at", "name", "part_number_key"),
        Index(None, "archived_at", "updated_at", "part_number_key"),
        Index(None, "item_type", "archived_at", "part_number_key"),
        Index(None, "category", "archived_at", "part_number_key"),
        sqlite_autoincrement=True,
    )
    Table(
        "number_counters",
        metadata,
        primary("schema_name", String(64)),
        primary("category", String(32)),
        needed("last_serial", Integer),
    )
    Table(
        "revisions",
        metadata,
        primary("id", Id),
        needed("item_id", Id, ForeignKey("items.id")),
        needed("revision_number", Integer),
        needed("properties", Text),
        needed("comment", Text),
        needed("status", String(16)),
        Column("file_name", Text),
        Column("file_checksum", String(64)),
        Column("file_size", BigInteger),
        Column("thumbnail_key", String(64)),
        Column("idempotency_key", String(128)),
        needed("created_at", Stamp),
        needed("created_by", String(64)),
        Column("base_revision", Integer),
        Column("file_path", Text),
        Column("links", Text),
        UniqueConstraint("item_id", "revision_number"),
        UniqueConstraint("item_id", "idempotency_key"),
        Index(None, "file_checksum"),
        sqlite_autoincrement=True,
    )
    Table(
        "bom_lines",
        metadata,
        primary("id", Uuid),
        needed("parent_id", Id, ForeignKey("items.id")),
        needed("child_id", Id, ForeignKey("items.id")),
        needed("position", Integer),
        needed("rel_type", String(16)),
        needed("quantity", Float(53)),
        Column("unit", String(32)),
        needed("reference_designators", Text),
        Column("find_number", String(32)),
        Column("notes", Text),
        Column("child_revision", Integer),
        needed("source", String(16)),
        Column("unreferenced_since", Stamp),
        needed("override", Boolean),
        Column("cad_quantity", Float(53)),
        Column("reason", Text),
        needed("metadata", Text),
        UniqueConstraint("parent_id", "child_id", "rel_type"),
        Index(None, "child_id"),
        Index("ix_bom_lines_unreferenced", "parent_id", **only("unreferenced_since IS NOT NULL")),
    )
    Table(
        "bom_changes",
        metadata,
        primary("id", Id),
        needed("parent_id", Id, ForeignKey("items.id")),
        needed("version", Integer),
        needed("kind", String(16)),
        needed("at", Stamp),
        needed("username", String(64)),
        needed("summary", Text),
        Column("reason", Text),
        Column("document_file", Text),
        Column("document_sha256", String(64)),
        Column("document_revision", Integer),
        Column("sync_id", String(128)),
        Column("refers_to", Id),
        Column("decisions", Text),
        Index(None, "parent_id", "id"),
        sqlite_autoincrement=True,
    )
    Table(
        "bom_change_lines",
        metadata,
        primary("change_id", Id, ForeignKey("bom_changes.id")),
        primary("line_id", Uuid),
        needed("child_id", Id),
        needed("position", Integer),
        needed("action", String(16)),
        Column("before", Text),
        Column("after", Text),
    )
    Table(
        "bom_syncs",
        metadata,
        primary("parent_id", Id, ForeignKey("items.id")),
        primary("sync_id", String(128)),
        needed("request_hash", String(64)),
        needed("answer", Text),
        needed("version", Integer),
        needed("at", Stamp),
        Column("change_id", Id),
        Index(None, "at"),
    )
    Table(
        "bom_conflicts",
        metadata,
        primary("parent_id", Id, ForeignKey("items.id")),
        primary("child_id", Id, ForeignKey("items.id")),
        needed("cad_quantity", Float(53)),
        needed("since", Stamp),
        needed("accepted", Boolean),
    )
    Table(
        "bom_last_syncs",
        metadata,
        primary("parent_id", Id, ForeignKey("items.id")),
        Column("at", Stamp),
        needed("username", String(64)),
        Column("document_file", Text),
        needed("left_out", Text),
        needed("components", Text),
        Column("refused_at", Stamp),
        Column("refusal", Text),
        Column("folder", Text),
        Index("ix_bom_last_syncs_open", "parent_id", **only("left_out <> '[]' OR refused_at IS NOT NULL")),
    )
    Table(
        "events",
        metadata,
        primary("id", Id),
        needed("name", String(64)),
        Column("item_uuid", Uuid),
        Column("part_number_key", String(64)),
        needed("data", Text),
        needed("at", Stamp),
        Column("username", String(64)),
        sqlite_autoincrement=True,
    )
    Table(
        "users",
        metadata,
        primary("id", Id),
        needed("username", String(64)),
        needed("username_key", String(64), unique=True),
        needed("display_name", Text),
        needed("role", String(16)),
        Column("password_hash", Text),
        needed("active", Boolean),
        needed("created_at", Stamp),
        sqlite_autoincrement=True,
    )
    Table(
        "api_tokens",
        metadata,
        primary("id", Id),
        needed("user_id", Id, ForeignKey("users.id")),
        needed("name", Text),
        needed("token_hash", String(64), unique=True),
        needed("prefix", String(16)),
        needed("scope", String(8), server_default="admin"),
        needed("created_at", Stamp),
        Column("expires_at", Stamp),
        Column("last_used_at", Stamp),
        Column("revoked_at", Stamp),
        Index(None, "user_id"),
        sqlite_autoincrement=True,
    )
    Table(
        "sessions",
        metadata,
        primary("id_hash", String(64)),
        needed("user_id", Id, ForeignKey("users.id")),
        needed("csrf_token", String(64)),
        needed("by_link", Boolean, server_default=false()),
        needed("created_at", Stamp),
        needed("expires_at", Stamp),
        Index(None, "user_id"),
    )
    Table(
        "login_links",
        metadata,
        primary("token_hash", String(64)),
        needed("user_id", Id, ForeignKey("users.id")),
        needed("expires_at", Stamp),
    )
    Table(
        "login_failures",
        metadata,
        primary("id", Id),
        needed("username_key", String(64)),
        needed("address", String(64)),
        needed("at", Stamp),
        Index(None, "username_key", "at"),
        Index(None, "address", "at"),
        sqlite_autoincrement=True,
    )
    Table(
        "audit",
        metadata,
        primary("id", Id),
        needed("at", Stamp),
        needed("username", String(64)),
        needed("action", String(64)),
        needed("target", Text),
        needed("detail", Text),
        needed("address", String(64)),
        sqlite_autoincrement=True,
    )
    metadata.create_all(connection := op.get_bind())
    # The server fills the index of the search at its next start (``silo_server.services.search``).
    if connection.dialect.name == "sqlite":
        op.execute(
            "CREATE VIRTUAL TABLE item_search USING fts5(number, name, other, detail=column, columnsize=0, "
            "prefix='2 3 4', tokenize=\"unicode61 remove_diacritics 0 categories 'L* N* Co Cn'\")"
        )
    else:
        op.execute("CREATE TABLE item_search (item_id bigint PRIMARY KEY, words tsvector NOT NULL)")
        op.execute("CREATE INDEX ix_item_search_words ON item_search USING gin (words)")


def _answers(op: Operations) -> None:
    """Keep answers to repeated requests of all kinds, in place of those to two kinds."""
    op.create_table(
        "answers",
        primary("subject", String(64)),
        primary("key", String(128)),
        needed("request_hash", String(64)),
        needed("answer", Text),
        needed("version", Integer),
        needed("at", Stamp),
        Column("change_id", Id),
        Index(None, "at"),
    )
    op.drop_table("bom_syncs")
    op.drop_column("items", "created_as")
    with op.batch_alter_table("revisions", table_kwargs={"sqlite_autoincrement": True}) as batch:
        batch.drop_constraint("uq_revisions_item_id_idempotency_key", type_="unique")
        batch.drop_column("idempotency_key")


def _login_attempts(op: Operations) -> None:
    """Keep how each attempt to log in ended."""
    op.drop_table("login_failures")
    op.create_table(
        "login_attempts",
        primary("id", Id),
        needed("username_key", String(64)),
        needed("address", String(64)),
        needed("outcome", String(16)),
        needed("at", Stamp),
        Index(None, "username_key", "at"),
        Index(None, "address", "at"),
        sqlite_autoincrement=True,
    )


def _documents(op: Operations) -> None:
    """Keep files as documents, with the items that they hold and the documents that they link to.

    Each item that has a file gets a document with the item's UUID, whose revisions are the item's.
    """
    op.create_table(
        "documents",
        primary("id", Id),
        needed("uuid", Uuid, unique=True),
        Column("item_id", Id, ForeignKey("items.id"), unique=True),
        needed("current_revision", Integer),
        needed("created_at", Stamp),
        needed("created_by", String(64)),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "document_items",
        primary("document_id", Id, ForeignKey("documents.id")),
        primary("item_id", Id, ForeignKey("items.id")),
        primary("object", String(200)),
        Index(None, "item_id"),
    )
    op.create_table(
        "document_links",
        primary("document_id", Id, ForeignKey("documents.id")),
        primary("target", Uuid),
        Index(None, "target"),
    )
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


def _product_summaries(op: Operations) -> None:
    """Keep the summary of each product over its whole graph."""
    op.create_table(
        "product_summaries",
        primary("item_id", Id, autoincrement=False),
        needed("summary", Text),
        needed("sets", Text),
    )


def _product_looks(op: Operations) -> None:
    """Keep who looked at a product, and when."""
    op.create_table(
        "product_looks",
        primary("user_id", Id),
        primary("item_id", Id),
        needed("at", Stamp),
        Column("since", Stamp),
    )


def _releases(op: Operations) -> None:
    """Keep released revisions of products, who may approve them, and what is frozen of each item."""
    op.add_column("users", Column("approver", Boolean, nullable=False, server_default=false()))
    op.create_table(
        "frozen_items",
        primary("hash", String(64)),
        needed("record", Text),
    )
    op.create_table(
        "releases",
        primary("id", Id),
        needed("item_id", Id, ForeignKey("items.id")),
        needed("label", String(16)),
        needed("status", String(16)),
        needed("record", String(64), ForeignKey("frozen_items.hash")),
        needed("with_parts", Boolean),
        needed("blocks", Text),
        needed("comment", Text),
        needed("frozen_at", Stamp),
        needed("created_by", String(64)),
        Column("ended_at", Stamp),
        Column("ended_by", String(64)),
        needed("note", Text),
        Column("override", Text),
        Index(
            "uq_releases_item_id_label",
            *("item_id", "label"),
            unique=True,
            **only("status IN ('review', 'released', 'obsolete')"),
        ),
        Index("uq_releases_in_review", "item_id", unique=True, **only("status = 'review'")),
        Index(None, "record"),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "release_approvals",
        primary("release_id", Id, ForeignKey("releases.id")),
        primary("username", String(64)),
        needed("at", Stamp),
        needed("comment", Text),
    )


def _models(op: Operations) -> None:
    """Keep what is drawn of a file, by its content."""
    op.create_table(
        "models",
        primary("file_checksum", String(64)),
        Column("geometry", String(64)),
        Column("geometry_size", BigInteger),
        Column("structure", String(64)),
    )


def _supplier_parts_and_orders(op: Operations) -> None:
    """Keep supplier parts of items, their changes, and orders."""
    op.add_column("items", Column("supplier_parts", Text))
    op.create_table(
        "supplier_changes",
        primary("id", Id),
        needed("item_id", Id, ForeignKey("items.id")),
        needed("at", Stamp),
        needed("username", String(64)),
        needed("before", Text),
        needed("after", Text),
        Index(None, "item_id", "id"),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "orders",
        primary("id", Id),
        needed("product_id", Id, ForeignKey("items.id")),
        needed("item_id", Id, ForeignKey("items.id")),
        needed("at", Stamp),
        needed("username", String(64)),
        needed("quantity", String(64)),
        Column("unit", String(32)),
        needed("supplier", Text),
        needed("number", Text),
        Column("price", String(64)),
        Column("currency", String(3)),
        needed("note", Text),
        Column("ended_at", Stamp),
        Column("ended_by", String(64)),
        Index(None, "product_id"),
        sqlite_autoincrement=True,
    )


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


def _follows_and_assignees(op: Operations) -> None:
    """Keep what people follow, and who settles what is open in a BOM."""
    op.create_table(
        "follows",
        primary("user_id", Id),
        primary("target", String(1024)),
        needed("seen", Stamp),
        needed("event", Id),
    )
    op.create_table(
        "assignees",
        primary("item_id", Id, autoincrement=False),
        needed("user_id", Id),
        needed("at", Stamp),
        Index(None, "user_id"),
    )


def _documents_that_became_others(op: Operations) -> None:
    """Keep which document a file is now, after it was registered, split, or taken out of its item."""
    op.add_column("documents", Column("became", String(36)))


def _units(op: Operations) -> None:
    """Give items a unit, and write the units of lines and orders in their one form.

    A word that is no unit that we know stays, and is listed: its line is an open question from now on.
    """
    op.add_column("items", Column("unit", String(32)))
    op.create_index("ix_items_unit", "items", ["id"], **only("unit IS NOT NULL"))
    op.create_index("ix_bom_lines_unit", "bom_lines", ["parent_id"], **only("unit IS NOT NULL"))
    bind = op.get_bind()
    tables = {name: Table(name, MetaData(), autoload_with=bind) for name in _WITH_UNITS}
    for name in ("bom_lines", "orders"):
        column = tables[name].c.unit
        for unit in bind.scalars(select(column).distinct().where(column.is_not(None))).all():
            if unit != stored_unit(unit):
                bind.execute(tables[name].update().where(column == unit).values(unit=stored_unit(unit)))
    # History is the same lines as they were: with other spellings, none of them would be as it was.
    history = tables["bom_change_lines"]
    some = '%"unit":%'
    query = select(history.c.change_id, history.c.line_id, history.c.before, history.c.after)
    for change_id, line_id, *sides in bind.execute(
        query.where(history.c.before.like(some) | history.c.after.like(some))
    ).all():
        before, after = map(_with_stored_unit, sides)
        if [before, after] != sides:
            this = (history.c.change_id == change_id) & (history.c.line_id == line_id)
            bind.execute(history.update().where(this).values(before=before, after=after))
    bind.execute(tables["product_summaries"].delete())  # they have more in them now
    lines, parents = tables["bom_lines"], tables["items"]
    query = select(lines.c.unit, parents.c.part_number).join(parents, parents.c.id == lines.c.parent_id)
    unknown: dict[str, set[str]] = {}
    for row in bind.execute(query.where(lines.c.unit.is_not(None))).all():
        if known_unit(row.unit) is None:
            unknown.setdefault(row.unit, set()).add(row.part_number)
    for unit, numbers in sorted(unknown.items()):
        _log.warning(
            "the unit %r is none that we know; lines of %s have it", unit, listed(sorted(numbers), 20)
        )


_WITH_UNITS = ("bom_lines", "orders", "bom_change_lines", "product_summaries", "items")


def _with_stored_unit(text: str | None) -> str | None:
    state = json.loads(text) if text else {}
    if "unit" not in state or state["unit"] == stored_unit(state["unit"]):
        return text
    unit = stored_unit(state["unit"])
    state = {name: unit if name == "unit" else value for name, value in state.items()}
    kept = {name: value for name, value in state.items() if value is not None}
    return json.dumps(kept, separators=(",", ":"), ensure_ascii=False)


def _attachments(op: Operations) -> None:
    """Sort the files by their content: models stay, all others become attachments with their revisions.

    A revision of an item that holds an attachment keeps its number and its file, which releases name; it is
    marked with its kind. A file that is not in the store is sorted by its name.
    """
    bind = op.get_bind()
    number = "INTEGER" if bind.dialect.name == "sqlite" else "BIGINT"
    op.add_column("documents", Column("kind", String(16), nullable=False, server_default="model"))
    # In words of SQL: SQLite takes a foreign key with a new column only like this, without a new table.
    op.execute(
        f"ALTER TABLE documents ADD COLUMN attached_to {number} "
        "CONSTRAINT fk_documents_attached_to_items REFERENCES items (id)"
    )
    op.add_column("documents", Column("removed_at", Stamp))
    op.create_index("ix_documents_attached_to", "documents", ["attached_to"])
    op.add_column("revisions", Column("kind", String(16)))
    tables = MetaData()
    tables.reflect(bind, only=["items", "documents", "revisions", "document_items", "document_links"])
    items, documents, revisions = (tables.tables[name] for name in ("items", "documents", "revisions"))
    with_file = select(revisions).where(revisions.c.file_checksum.is_not(None)).order_by(revisions.c.id)
    folder, left = op.get_context().opts[FILES], op.get_context().opts[LEFT]
    lost, others = [], []
    for row in bind.execute(with_file).all():
        checksum, name = row.file_checksum, row.file_name or ""
        try:
            kind = kind_of(folder / checksum[:2] / checksum[2:4] / checksum, name)
        except OSError:
            kind = kind_by_name(name) or MODEL
            lost.append(f"{name or checksum} ({kind})")
        if kind != MODEL:
            others.append((row, kind))
    if lost:
        left.append(
            f"{len(lost)} files are not in the server's store, so their names decide what they are: "
            + ", ".join(lost[:20])
            + (", …" if len(lost) > 20 else "")
        )
    bind.execute(revisions.update().where(revisions.c.file_checksum.is_not(None)).values(kind=MODEL))
    if not others:
        return
    bought = _bought(bind, items)
    of_documents: dict[int, list[tuple[Row[Any], str]]] = {}
    for row, kind in others:
        if kind == "drawing" and row.item_id in bought and (row.file_name or "").lower().endswith(".pdf"):
            kind = "data_sheet"
        bind.execute(revisions.update().where(revisions.c.id == row.id).values(kind=kind))
        of_documents.setdefault(row.document_id, []).append((row, kind))
    for document_id, files in of_documents.items():
        document = bind.execute(documents.select().where(documents.c.id == document_id)).one()
        _follow_model(bind, tables, document)
        if document.item_id is None:
            names = ", ".join(row.file_name or "" for row, _ in files[:5])
            left.append(f"the document {document.uuid} of no item holds files that are no models: {names}")
            continue
        _attach_all(bind, tables, document.item_id, files)


def _bought(bind: Connection, items: Table) -> set[int]:
    found = set()
    for row in bind.execute(
        select(items.c.id, items.c.sourcing_type, items.c.supplier_parts, items.c.properties)
    ):
        supplied = row.supplier_parts not in (None, "[]") or json.loads(row.properties).get("supplier")
        if row.sourcing_type == "purchased" or (not row.sourcing_type and supplied):
            found.add(row.id)
    return found


def _follow_model(bind: Connection, tables: MetaData, document: Row[Any]) -> None:
    """Let a document be what its newest model is; without any, it holds no item, and has the newest kind."""
    documents, revisions = tables.tables["documents"], tables.tables["revisions"]
    items_in, links_of = tables.tables["document_items"], tables.tables["document_links"]
    its = revisions.select().where(revisions.c.document_id == document.id)
    newest_first = bind.execute(its.order_by(revisions.c.revision_number.desc())).all()
    model = next((row for row in newest_first if row.kind == MODEL), None)
    if model is not None and model.revision_number == document.current_revision:
        return
    this = documents.c.id == document.id
    bind.execute(links_of.delete().where(links_of.c.document_id == document.id))
    if model is None:
        bind.execute(items_in.delete().where(items_in.c.document_id == document.id))
        now = (
            {"current_revision": 0}
            if document.item_id is not None
            else {"kind": newest_first[0].kind, "current_revision": newest_first[0].revision_number}
        )
        bind.execute(documents.update().where(this).values(now))
        return
    bind.execute(documents.update().where(this).values(current_revision=model.revision_number))
    links = json.loads(model.links or "[]")
    targets = dict.fromkeys(link.get("document") or link.get("item") or "" for link in links)
    rows = [
        {"document_id": document.id, "target": target} for target in targets if target and len(target) <= 36
    ]
    if rows:
        bind.execute(links_of.insert(), rows)


def _attach_all(
    bind: Connection, tables: MetaData, item_id: int, files: Sequence[tuple[Row[Any], str]]
) -> None:
    """Make an attachment of all files of one kind and name, with a revision for each."""
    documents, revisions = tables.tables["documents"], tables.tables["revisions"]
    alike: dict[tuple[str, str], list[Row[Any]]] = {}
    for row, kind in files:
        alike.setdefault((kind, (row.file_name or "").casefold()), []).append(row)
    for (kind, _), rows in alike.items():
        first = {"created_at": rows[0].created_at, "created_by": rows[0].created_by}
        about = {"kind": kind, "attached_to": item_id, "current_revision": len(rows)}
        made = documents.insert().values(uuid=str(uuid4()), **about, **first)
        document_id = bind.execute(made.returning(documents.c.id)).scalar_one()
        kept = ("comment", "status", "file_name", "file_checksum", "file_size", "created_at", "created_by")
        copies = [
            {name: getattr(row, name) for name in kept}
            | {"document_id": document_id, "revision_number": number, "properties": "{}", "kind": kind}
            for number, row in enumerate(rows, start=1)
        ]
        bind.execute(revisions.insert(), copies)


def _credentials(op: Operations) -> None:
    """Write down which credential made which; those that there are have no parent, and are known as such."""
    op.create_table(
        "credentials",
        primary("id", Id),
        Column("parent_id", Id, ForeignKey("credentials.id")),
        needed("kind", String(16)),
        needed("user_id", Id, ForeignKey("users.id")),
        needed("name", Text),
        needed("known", Boolean),
        needed("created_at", Stamp),
        Index(None, "parent_id"),
        Index(None, "user_id"),
        sqlite_autoincrement=True,
    )
    connection = op.get_bind()
    rows = MetaData()
    rows.reflect(connection, only=["credentials", "api_tokens", "sessions", "login_links"])
    made = rows.tables["credentials"]
    kinds = {"api_tokens": ("id", "token"), "sessions": ("id_hash", "session")}
    kinds["login_links"] = ("token_hash", "link")
    for name, (key, kind) in kinds.items():
        old = rows.tables[name]
        owned: list[tuple[object, int]] = []
        for row in connection.execute(select(old)).mappings().all():
            values = {
                "kind": kind,
                "user_id": row["user_id"],
                "name": row.get("name", ""),
                "known": False,
                "created_at": row.get("created_at", row.get("expires_at")),
            }
            noted = made.insert().values(values).returning(made.c.id)
            owned.append((row[key], connection.execute(noted).scalar_one()))
        options = {"sqlite_autoincrement": True} if name == "api_tokens" else {}
        with op.batch_alter_table(name, table_kwargs=options) as table:
            table.add_column(Column("credential_id", Id))
        fresh = Table(name, MetaData(), autoload_with=connection)
        for value, credential in owned:
            connection.execute(fresh.update().where(fresh.c[key] == value).values(credential_id=credential))
        with op.batch_alter_table(name, table_kwargs=options) as table:
            table.alter_column("credential_id", existing_type=Id, nullable=False)
            table.create_foreign_key(
                f"fk_{name}_credential_id_credentials", "credentials", ["credential_id"], ["id"]
            )
            table.create_unique_constraint(f"uq_{name}_credential_id", ["credential_id"])


def _held_boms(op: Operations) -> None:
    """Let a client report the BOMs that wait on its computer."""
    op.create_table(
        "held_boms",
        primary("parent_id", Id, ForeignKey("items.id"), autoincrement=False),
        needed("since", Stamp),
        needed("at", Stamp),
        needed("username", String(64)),
        needed("left_out", Text),
        Column("document_file", Text),
        Column("folder", Text),
    )


def _graded_costs(op: Operations) -> None:
    """Forget the summaries: costs are made of the suppliers' prices too. They are made again when asked."""
    op.execute("DELETE FROM product_summaries")


def _exact_quantities(op: Operations) -> None:
    """Keep quantities as decimals in text, as prices are. What arithmetic left behind in them is rounded.

    0.30000000000000004 becomes 0.3, and is listed.
    """
    bind, left = op.get_bind(), op.get_context().opts.get(LEFT, [])
    items = Table("items", MetaData(), autoload_with=bind)
    numbers = dict(bind.execute(select(items.c.id, items.c.part_number)).all())
    for name, keys, columns in (
        ("bom_lines", ("id",), ("quantity", "cad_quantity")),
        ("bom_conflicts", ("parent_id", "child_id"), ("cad_quantity",)),
    ):
        old = Table(name, MetaData(), autoload_with=bind)
        before = bind.execute(select(old)).mappings().all()
        with op.batch_alter_table(name) as table:
            for column in columns:
                table.alter_column(column, existing_type=Float(53), type_=String(48))
        made = Table(name, MetaData(), autoload_with=bind)
        for row in before:
            texts = {
                column: decimal_text(quantity_of(float(row[column])))
                for column in columns
                if row[column] is not None
            }
            this = and_(*(made.c[key] == row[key] for key in keys))
            bind.execute(made.update().where(this).values(texts))
            for column, text in texts.items():
                if Decimal(text) != Decimal(repr(float(row[column]))):
                    parent, child = numbers.get(row["parent_id"]), numbers.get(row["child_id"])
                    left.append(f"{column} of {child} in {parent}: {row[column]!r} was rounded to {text}")


def _find_numbers(op: Operations) -> None:
    """Let a BOM remember the find numbers of removed lines until the next release."""
    op.add_column("items", Column("gone_find_numbers", Text))


def _device_logins(op: Operations) -> None:
    """Let programs wait for a user who types their code."""
    op.create_table(
        "device_logins",
        primary("device_hash", String(64)),
        needed("user_code", String(8), unique=True),
        needed("program", Text),
        needed("machine", Text),
        needed("address", String(64)),
        needed("asked_at", Stamp),
        needed("expires_at", Stamp),
        needed("refused", Boolean),
        Column("polled_at", Stamp),
        Column("user_id", Id, ForeignKey("users.id")),
        Column("credential_id", Id, ForeignKey("credentials.id"), unique=True),
        Column("token_expires_at", Stamp),
    )


def _imports(op: Operations) -> None:
    """Remember what an import did, and how the columns of tables were assigned."""
    op.create_table(
        "imports",
        primary("id", Id),
        needed("at", Stamp),
        needed("username", String(64)),
        needed("kind", String(16)),
        needed("file_name", Text),
        needed("done", Text),
        Column("undone_at", Stamp),
        Column("undone_by", String(64)),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "table_layouts",
        primary("kind", String(16)),
        primary("headings", String(64)),
        needed("layout", Text),
        needed("at", Stamp),
        needed("username", String(64)),
    )


STEPS: dict[str, Callable[[Operations], None]] = {
    "0007": _first_schema,
    "0008": _answers,
    "0009": _login_attempts,
    "0011": _documents,
    "0012": _product_summaries,
    "0013": _product_looks,
    "0014": _releases,
    "0015": _models,
    "0016": _supplier_parts_and_orders,
    "0017": _origins_of_facts,
    "0018": _follows_and_assignees,
    "0019": _documents_that_became_others,
    "0020": _units,
    "0021": _attachments,
    "0022": _credentials,
    "0023": _held_boms,
    "0024": _graded_costs,
    "0025": _exact_quantities,
    "0026": _find_numbers,
    "0027": _device_logins,
    "0028": _imports,
}
