# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tables, once for SQLite and PostgreSQL.

Rules of this module:

* JSON is kept as text and written by us, so that both databases give back what was stored;
* times are ISO 8601 text in UTC with microseconds (``times.stamp``), which sorts as it reads on both;
* `*_key` columns hold the case-folded form that is unique and looked up by;
* the search index (``item_search``) is none of them: each database has its own form (``services.search``);
* history (``bom_changes``, ``bom_change_lines``) and ``audit`` are only ever inserted into, but for what
  housekeeping no longer keeps.
"""

from __future__ import annotations

from decimal import Decimal
from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Dialect,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    TypeDecorator,
    UniqueConstraint,
    false,
    text,
)

from silo.bom.quantities import decimal_text, quantity_of

NAMES = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}
metadata = MetaData(naming_convention=NAMES)

# SQLite gives out row ids (and never reuses one) only for a column of exactly INTEGER.
Id = BigInteger().with_variant(Integer, "sqlite")
Stamp = String(32)
# By code point on both databases, whatever language a PostgreSQL sorts in by itself.
Key = String(64).with_variant(String(64, collation="C"), "postgresql")
Uuid = String(36)


class Amount(TypeDecorator[Decimal]):
    """A quantity: a decimal, kept as its one text, as prices are. Binary numbers would not keep 0.1."""

    impl = String(48)
    cache_ok = True

    def process_bind_param(self, value: Any, dialect: Dialect) -> str | None:
        """Write a quantity."""
        return None if value is None else decimal_text(quantity_of(value))

    def process_result_value(self, value: Any, dialect: Dialect) -> Decimal | None:
        """Read a quantity."""
        return None if value is None else Decimal(value)


# What waits for a decision, for indexes that hold little else; a query must say it in these words.
UNREFERENCED = "unreferenced_since IS NOT NULL"
WITH_UNIT = "unit IS NOT NULL"
INCOMPLETE = "left_out <> '[]' OR refused_at IS NOT NULL"
# A label that is taken; and the one submission that waits for its approval.
NUMBERED = "status IN ('review', 'released', 'obsolete')"
IN_REVIEW = "status = 'review'"


def needed(name: str, kind: Any, *more: Any, **options: Any) -> Column[Any]:
    """Make a column that always has a value."""
    return Column(name, kind, *more, nullable=False, **options)


def primary(name: str, kind: Any, *more: Any, **options: Any) -> Column[Any]:
    """Make a column of the primary key."""
    return Column(name, kind, *more, primary_key=True, **options)


def only(condition: str) -> dict[str, Any]:
    """Limit an index to the rows of a condition."""
    return {"sqlite_where": text(condition), "postgresql_where": text(condition)}


server_state = Table(
    "server_state",
    metadata,
    primary("key", String(64)),
    needed("value", Text),
)

items = Table(
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
    Column("unit", String(32)),
    Column("thumbnail_key", String(64)),
    needed("properties", Text),
    Column("supplier_parts", Text),
    Column("origins", Text),
    Column("made_from", String(64)),
    needed("current_revision", Integer),
    needed("bom_version", Integer),
    needed("version", Integer, server_default="1"),
    needed("created_at", Stamp),
    needed("created_by", String(64)),
    needed("updated_at", Stamp),
    needed("updated_by", String(64)),
    Column("archived_at", Stamp),
    Column("gone_find_numbers", Text),
    Index(None, "archived_at", "part_number_key"),
    Index(None, "archived_at", "name", "part_number_key"),
    Index(None, "archived_at", "updated_at", "part_number_key"),
    Index(None, "item_type", "archived_at", "part_number_key"),
    Index(None, "category", "archived_at", "part_number_key"),
    Index("ix_items_unit", "id", **only(WITH_UNIT)),
    sqlite_autoincrement=True,
)

number_counters = Table(
    "number_counters",
    metadata,
    primary("schema_name", String(64)),
    primary("category", String(32)),
    needed("last_serial", Integer),
)

# A document is a file: its revisions are those of its item with a model, or, without an item, its own. An
# attachment is a document of another kind than ``model``, beside the item ``attached_to``.
documents = Table(
    "documents",
    metadata,
    primary("id", Id),
    needed("uuid", Uuid, unique=True),
    Column("item_id", Id, ForeignKey("items.id"), unique=True),
    needed("current_revision", Integer),
    needed("created_at", Stamp),
    needed("created_by", String(64)),
    Column("became", Uuid),
    needed("kind", String(16), server_default="model"),
    Column("attached_to", Id, ForeignKey("items.id")),
    Column("removed_at", Stamp),
    Index(None, "attached_to"),
    sqlite_autoincrement=True,
)

# Which items the newest revision of a document holds, and in which of its objects ("": the file as a whole).
document_items = Table(
    "document_items",
    metadata,
    primary("document_id", Id, ForeignKey("documents.id")),
    primary("item_id", Id, ForeignKey("items.id")),
    primary("object", String(200)),
    Index(None, "item_id"),
)

# What the newest revision of a document links to, by the UUID of a document.
document_links = Table(
    "document_links",
    metadata,
    primary("document_id", Id, ForeignKey("documents.id")),
    primary("target", Uuid),
    Index(None, "target"),
)

revisions = Table(
    "revisions",
    metadata,
    primary("id", Id),
    Column("item_id", Id, ForeignKey("items.id")),
    Column("document_id", Id, ForeignKey("documents.id")),
    needed("revision_number", Integer),
    needed("properties", Text),
    needed("comment", Text),
    needed("status", String(16)),
    Column("file_name", Text),
    Column("file_checksum", String(64)),
    Column("file_size", BigInteger),
    Column("thumbnail_key", String(64)),
    needed("created_at", Stamp),
    needed("created_by", String(64)),
    Column("base_revision", Integer),
    Column("file_path", Text),
    Column("links", Text),
    Column("kind", String(16)),
    UniqueConstraint("item_id", "revision_number"),
    UniqueConstraint("document_id", "revision_number"),
    Index(None, "file_checksum"),
    sqlite_autoincrement=True,
)

# What is drawn of a file, by the SHA-256 of its content: the hashes of both parts in the store, packed.
models = Table(
    "models",
    metadata,
    primary("file_checksum", String(64)),
    Column("geometry", String(64)),
    Column("geometry_size", BigInteger),
    Column("structure", String(64)),
)

bom_lines = Table(
    "bom_lines",
    metadata,
    primary("id", Uuid),
    needed("parent_id", Id, ForeignKey("items.id")),
    needed("child_id", Id, ForeignKey("items.id")),
    needed("position", Integer),
    needed("rel_type", String(16)),
    needed("quantity", Amount),
    Column("unit", String(32)),
    needed("reference_designators", Text),
    Column("find_number", String(32)),
    Column("notes", Text),
    Column("child_revision", Integer),
    needed("source", String(16)),
    Column("unreferenced_since", Stamp),
    needed("override", Boolean),
    Column("cad_quantity", Amount),
    Column("reason", Text),
    needed("metadata", Text),
    UniqueConstraint("parent_id", "child_id", "rel_type"),
    Index(None, "child_id"),
    Index("ix_bom_lines_unreferenced", "parent_id", **only(UNREFERENCED)),
    Index("ix_bom_lines_unit", "parent_id", **only(WITH_UNIT)),
)

bom_changes = Table(
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

bom_change_lines = Table(
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

answers = Table(
    "answers",
    metadata,
    primary("subject", String(64)),
    primary("key", String(128)),
    needed("request_hash", String(64)),
    needed("answer", Text),
    needed("version", Integer),
    needed("at", Stamp),
    Column("change_id", Id),
    Index(None, "at"),
)

bom_conflicts = Table(
    "bom_conflicts",
    metadata,
    primary("parent_id", Id, ForeignKey("items.id")),
    primary("child_id", Id, ForeignKey("items.id")),
    needed("cad_quantity", Amount),
    needed("since", Stamp),
    needed("accepted", Boolean),
)

bom_last_syncs = Table(
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
    Index("ix_bom_last_syncs_open", "parent_id", **only(INCOMPLETE)),
)

# A BOM that waits on a designer's computer: what for, since when, and when it was last reported.
held_boms = Table(
    "held_boms",
    metadata,
    primary("parent_id", Id, ForeignKey("items.id"), autoincrement=False),
    needed("since", Stamp),
    needed("at", Stamp),
    needed("username", String(64)),
    needed("left_out", Text),
    Column("document_file", Text),
    Column("folder", Text),
)

# What services.product keeps of each assembly: no foreign key, so that keeping waits for no item.
product_summaries = Table(
    "product_summaries",
    metadata,
    primary("item_id", Id, autoincrement=False),
    needed("summary", Text),
    needed("sets", Text),
)

# When a user looked at a product last, and the time before, for what changed since.
product_looks = Table(
    "product_looks",
    metadata,
    primary("user_id", Id, autoincrement=False),
    primary("item_id", Id, autoincrement=False),
    needed("at", Stamp),
    Column("since", Stamp),
)

# What a user follows ("item:UUID", "folder:PATH"), and up to when and which event they have seen its news.
follows = Table(
    "follows",
    metadata,
    primary("user_id", Id, autoincrement=False),
    primary("target", String(1024)),
    needed("seen", Stamp),
    needed("event", Id),
)

# Who settles what is open in a BOM.
assignees = Table(
    "assignees",
    metadata,
    primary("item_id", Id, autoincrement=False),
    needed("user_id", Id),
    needed("at", Stamp),
    Index(None, "user_id"),
)

# What is frozen of an item when a product is submitted: JSON under its SHA-256. A row never changes.
frozen_items = Table(
    "frozen_items",
    metadata,
    primary("hash", String(64)),
    needed("record", Text),
)

# A revision of a product that was submitted for release, or was released: ``record`` is its frozen item.
releases = Table(
    "releases",
    metadata,
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
    Index("uq_releases_item_id_label", "item_id", "label", unique=True, **only(NUMBERED)),
    Index("uq_releases_in_review", "item_id", unique=True, **only(IN_REVIEW)),
    Index(None, "record"),
    sqlite_autoincrement=True,
)

release_approvals = Table(
    "release_approvals",
    metadata,
    primary("release_id", Id, ForeignKey("releases.id")),
    primary("username", String(64)),
    needed("at", Stamp),
    needed("comment", Text),
)

# What became of an item's supplier parts: the whole list before and after.
supplier_changes = Table(
    "supplier_changes",
    metadata,
    primary("id", Id),
    needed("item_id", Id, ForeignKey("items.id")),
    needed("at", Stamp),
    needed("username", String(64)),
    needed("before", Text),
    needed("after", Text),
    Index(None, "item_id", "id"),
    sqlite_autoincrement=True,
)

# What was ordered for a product; ``ended_at``: it was taken back. Amounts are decimals as text.
orders = Table(
    "orders",
    metadata,
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

# What an import of a table did (``done``, as JSON), to take it back as a whole.
imports = Table(
    "imports",
    metadata,
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

# How a user assigned the columns of a table (``layout``, as JSON), by the kind of table and its headings.
table_layouts = Table(
    "table_layouts",
    metadata,
    primary("kind", String(16)),
    primary("headings", String(64)),
    needed("layout", Text),
    needed("at", Stamp),
    needed("username", String(64)),
)

events = Table(
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

users = Table(
    "users",
    metadata,
    primary("id", Id),
    needed("username", String(64)),
    needed("username_key", String(64), unique=True),
    needed("display_name", Text),
    needed("role", String(16)),
    Column("password_hash", Text),
    needed("active", Boolean),
    needed("approver", Boolean, server_default=false()),
    needed("created_at", Stamp),
    sqlite_autoincrement=True,
)

# What lets somebody in: a token, a session or a login link. ``parent_id`` made it. ``known`` is false for
# those of versions that did not write a parent down.
credentials = Table(
    "credentials",
    metadata,
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

api_tokens = Table(
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
    needed("credential_id", Id, ForeignKey("credentials.id"), unique=True),
    Index(None, "user_id"),
    sqlite_autoincrement=True,
)

sessions = Table(
    "sessions",
    metadata,
    primary("id_hash", String(64)),
    needed("user_id", Id, ForeignKey("users.id")),
    needed("csrf_token", String(64)),
    needed("by_link", Boolean, server_default=false()),
    needed("created_at", Stamp),
    needed("expires_at", Stamp),
    needed("credential_id", Id, ForeignKey("credentials.id"), unique=True),
    Index(None, "user_id"),
)

login_links = Table(
    "login_links",
    metadata,
    primary("token_hash", String(64)),
    needed("user_id", Id, ForeignKey("users.id")),
    needed("expires_at", Stamp),
    needed("credential_id", Id, ForeignKey("credentials.id"), unique=True),
)

device_logins = Table(
    "device_logins",
    metadata,
    primary("device_hash", String(64)),
    needed("user_code", String(8), unique=True),
    needed("program", Text),
    needed("machine", Text),
    needed("address", String(64)),
    needed("asked_at", Stamp),
    needed("expires_at", Stamp),
    needed("refused", Boolean),
    Column("polled_at", Stamp),
    # Of the user who let the program in, until it fetches its token.
    Column("user_id", Id, ForeignKey("users.id")),
    Column("credential_id", Id, ForeignKey("credentials.id"), unique=True),
    Column("token_expires_at", Stamp),
)

login_attempts = Table(
    "login_attempts",
    metadata,
    primary("id", Id),
    needed("username_key", String(64)),
    needed("address", String(64)),
    needed("outcome", String(16)),
    needed("at", Stamp),
    Index(None, "username_key", "at"),
    Index(None, "address", "at"),
    sqlite_autoincrement=True,
)

audit = Table(
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

# Every place that refers to a file of the store, by its hash: what a backup takes, and housekeeping keeps.
FILE_REFERENCES = (
    revisions.c.file_checksum,
    revisions.c.thumbnail_key,
    items.c.thumbnail_key,
    models.c.geometry,
    models.c.structure,
)
