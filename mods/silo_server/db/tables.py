# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tables, once for SQLite and PostgreSQL.

Rules of this module:

* JSON is kept as text and written by us, so that both databases give back what was stored;
* times are ISO 8601 text in UTC with microseconds (``clock.stamp``), which sorts as it reads on both;
* `*_key` columns hold the case-folded form that is unique and looked up by;
* the search index (``item_search``) is none of them: each database has its own form (``services.search``);
* history (``bom_changes``, ``bom_change_lines``) and ``audit`` are only ever inserted into, but for what
  ``operation.housekeeping`` no longer keeps.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Float,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
    false,
    text,
)

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

# What waits for a person, for indexes that hold little else; a query must say it in these words.
UNREFERENCED = "unreferenced_since IS NOT NULL"
INCOMPLETE = "left_out <> '[]' OR refused_at IS NOT NULL"
# A label that is taken; and the one submission that waits for its approval.
NUMBERED = "status IN ('review', 'released', 'obsolete')"
IN_REVIEW = "status = 'review'"


def _only(condition: str) -> dict[str, Any]:
    return {"sqlite_where": text(condition), "postgresql_where": text(condition)}


server_state = Table(
    "server_state",
    metadata,
    Column("key", String(64), primary_key=True),
    Column("value", Text, nullable=False),
)

items = Table(
    "items",
    metadata,
    Column("id", Id, primary_key=True),
    Column("uuid", Uuid, nullable=False, unique=True),
    Column("part_number", String(64), nullable=False),
    Column("part_number_key", Key, nullable=False, unique=True),
    Column("schema_name", String(64)),
    Column("category", String(32)),
    Column("item_type", String(32), nullable=False),
    Column("name", Text, nullable=False),
    Column("description", Text, nullable=False),
    Column("sourcing_type", String(64)),
    Column("long_description", Text),
    Column("thumbnail_key", String(64)),
    Column("properties", Text, nullable=False),
    Column("supplier_parts", Text),
    Column("origins", Text),
    Column("made_from", String(64)),
    Column("current_revision", Integer, nullable=False),
    Column("bom_version", Integer, nullable=False),
    Column("version", Integer, nullable=False, server_default="1"),
    Column("created_at", Stamp, nullable=False),
    Column("created_by", String(64), nullable=False),
    Column("updated_at", Stamp, nullable=False),
    Column("updated_by", String(64), nullable=False),
    Column("archived_at", Stamp),
    Index(None, "archived_at", "part_number_key"),
    Index(None, "archived_at", "name", "part_number_key"),
    Index(None, "archived_at", "updated_at", "part_number_key"),
    Index(None, "item_type", "archived_at", "part_number_key"),
    Index(None, "category", "archived_at", "part_number_key"),
    sqlite_autoincrement=True,
)

number_counters = Table(
    "number_counters",
    metadata,
    Column("schema_name", String(64), primary_key=True),
    Column("category", String(32), primary_key=True),
    Column("last_serial", Integer, nullable=False),
)

# A document is a file: its revisions are those of its item with a file, or, without an item, its own.
documents = Table(
    "documents",
    metadata,
    Column("id", Id, primary_key=True),
    Column("uuid", Uuid, nullable=False, unique=True),
    Column("item_id", Id, ForeignKey("items.id"), unique=True),
    Column("current_revision", Integer, nullable=False),
    Column("created_at", Stamp, nullable=False),
    Column("created_by", String(64), nullable=False),
    sqlite_autoincrement=True,
)

# Which items the newest revision of a document holds, and in which of its objects ("": the file as a whole).
document_items = Table(
    "document_items",
    metadata,
    Column("document_id", Id, ForeignKey("documents.id"), primary_key=True),
    Column("item_id", Id, ForeignKey("items.id"), primary_key=True),
    Column("object", String(200), primary_key=True),
    Index(None, "item_id"),
)

# What the newest revision of a document links to, by the UUID of a document.
document_links = Table(
    "document_links",
    metadata,
    Column("document_id", Id, ForeignKey("documents.id"), primary_key=True),
    Column("target", Uuid, primary_key=True),
    Index(None, "target"),
)

revisions = Table(
    "revisions",
    metadata,
    Column("id", Id, primary_key=True),
    Column("item_id", Id, ForeignKey("items.id")),
    Column("document_id", Id, ForeignKey("documents.id")),
    Column("revision_number", Integer, nullable=False),
    Column("properties", Text, nullable=False),
    Column("comment", Text, nullable=False),
    Column("status", String(16), nullable=False),
    Column("file_name", Text),
    Column("file_checksum", String(64)),
    Column("file_size", BigInteger),
    Column("thumbnail_key", String(64)),
    Column("created_at", Stamp, nullable=False),
    Column("created_by", String(64), nullable=False),
    Column("base_revision", Integer),
    Column("file_path", Text),
    Column("links", Text),
    UniqueConstraint("item_id", "revision_number"),
    UniqueConstraint("document_id", "revision_number"),
    Index(None, "file_checksum"),
    sqlite_autoincrement=True,
)

# What is drawn of a file, by the SHA-256 of its content: the hashes of both parts in the store, packed.
models = Table(
    "models",
    metadata,
    Column("file_checksum", String(64), primary_key=True),
    Column("geometry", String(64)),
    Column("geometry_size", BigInteger),
    Column("structure", String(64)),
)

bom_lines = Table(
    "bom_lines",
    metadata,
    Column("id", Uuid, primary_key=True),
    Column("parent_id", Id, ForeignKey("items.id"), nullable=False),
    Column("child_id", Id, ForeignKey("items.id"), nullable=False),
    Column("position", Integer, nullable=False),
    Column("rel_type", String(16), nullable=False),
    Column("quantity", Float(53), nullable=False),
    Column("unit", String(32)),
    Column("reference_designators", Text, nullable=False),
    Column("find_number", String(32)),
    Column("notes", Text),
    Column("child_revision", Integer),
    Column("source", String(16), nullable=False),
    Column("unreferenced_since", Stamp),
    Column("override", Boolean, nullable=False),
    Column("cad_quantity", Float(53)),
    Column("reason", Text),
    Column("metadata", Text, nullable=False),
    UniqueConstraint("parent_id", "child_id", "rel_type"),
    Index(None, "child_id"),
    Index("ix_bom_lines_unreferenced", "parent_id", **_only(UNREFERENCED)),
)

bom_changes = Table(
    "bom_changes",
    metadata,
    Column("id", Id, primary_key=True),
    Column("parent_id", Id, ForeignKey("items.id"), nullable=False),
    Column("version", Integer, nullable=False),
    Column("kind", String(16), nullable=False),
    Column("at", Stamp, nullable=False),
    Column("username", String(64), nullable=False),
    Column("summary", Text, nullable=False),
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
    Column("change_id", Id, ForeignKey("bom_changes.id"), primary_key=True),
    Column("line_id", Uuid, primary_key=True),
    Column("child_id", Id, nullable=False),
    Column("position", Integer, nullable=False),
    Column("action", String(16), nullable=False),
    Column("before", Text),
    Column("after", Text),
)

answers = Table(
    "answers",
    metadata,
    Column("subject", String(64), primary_key=True),
    Column("key", String(128), primary_key=True),
    Column("request_hash", String(64), nullable=False),
    Column("answer", Text, nullable=False),
    Column("version", Integer, nullable=False),
    Column("at", Stamp, nullable=False),
    Column("change_id", Id),
    Index(None, "at"),
)

bom_conflicts = Table(
    "bom_conflicts",
    metadata,
    Column("parent_id", Id, ForeignKey("items.id"), primary_key=True),
    Column("child_id", Id, ForeignKey("items.id"), primary_key=True),
    Column("cad_quantity", Float(53), nullable=False),
    Column("since", Stamp, nullable=False),
    Column("accepted", Boolean, nullable=False),
)

bom_last_syncs = Table(
    "bom_last_syncs",
    metadata,
    Column("parent_id", Id, ForeignKey("items.id"), primary_key=True),
    Column("at", Stamp),
    Column("username", String(64), nullable=False),
    Column("document_file", Text),
    Column("left_out", Text, nullable=False),
    Column("components", Text, nullable=False),
    Column("refused_at", Stamp),
    Column("refusal", Text),
    Column("folder", Text),
    Index("ix_bom_last_syncs_open", "parent_id", **_only(INCOMPLETE)),
)

# What services.bom.summary keeps of each assembly: no foreign key, so that keeping waits for no item.
product_summaries = Table(
    "product_summaries",
    metadata,
    Column("item_id", Id, primary_key=True, autoincrement=False),
    Column("summary", Text, nullable=False),
    Column("sets", Text, nullable=False),
)

# When a person looked at a product last, and the time before, for what changed since.
product_looks = Table(
    "product_looks",
    metadata,
    Column("user_id", Id, primary_key=True, autoincrement=False),
    Column("item_id", Id, primary_key=True, autoincrement=False),
    Column("at", Stamp, nullable=False),
    Column("since", Stamp),
)

# What a person follows ("item:UUID", "folder:PATH"), and up to when and which event they have seen its news.
follows = Table(
    "follows",
    metadata,
    Column("user_id", Id, primary_key=True, autoincrement=False),
    Column("target", String(1024), primary_key=True),
    Column("seen", Stamp, nullable=False),
    Column("event", Id, nullable=False),
)

# Who settles what is open in a BOM.
assignees = Table(
    "assignees",
    metadata,
    Column("item_id", Id, primary_key=True, autoincrement=False),
    Column("user_id", Id, nullable=False),
    Column("at", Stamp, nullable=False),
    Index(None, "user_id"),
)

# What is frozen of an item when a product is submitted: JSON under its SHA-256. A row never changes.
frozen_items = Table(
    "frozen_items",
    metadata,
    Column("hash", String(64), primary_key=True),
    Column("record", Text, nullable=False),
)

# A revision of a product that was submitted for release, or was released: ``record`` is its frozen item.
releases = Table(
    "releases",
    metadata,
    Column("id", Id, primary_key=True),
    Column("item_id", Id, ForeignKey("items.id"), nullable=False),
    Column("label", String(16), nullable=False),
    Column("status", String(16), nullable=False),
    Column("record", String(64), ForeignKey("frozen_items.hash"), nullable=False),
    Column("with_parts", Boolean, nullable=False),
    Column("blocks", Text, nullable=False),
    Column("comment", Text, nullable=False),
    Column("frozen_at", Stamp, nullable=False),
    Column("created_by", String(64), nullable=False),
    Column("ended_at", Stamp),
    Column("ended_by", String(64)),
    Column("note", Text, nullable=False),
    Column("override", Text),
    Index("uq_releases_item_id_label", "item_id", "label", unique=True, **_only(NUMBERED)),
    Index("uq_releases_in_review", "item_id", unique=True, **_only(IN_REVIEW)),
    Index(None, "record"),
    sqlite_autoincrement=True,
)

release_approvals = Table(
    "release_approvals",
    metadata,
    Column("release_id", Id, ForeignKey("releases.id"), primary_key=True),
    Column("username", String(64), primary_key=True),
    Column("at", Stamp, nullable=False),
    Column("comment", Text, nullable=False),
)

# What became of an item's supplier parts: the whole list before and after.
supplier_changes = Table(
    "supplier_changes",
    metadata,
    Column("id", Id, primary_key=True),
    Column("item_id", Id, ForeignKey("items.id"), nullable=False),
    Column("at", Stamp, nullable=False),
    Column("username", String(64), nullable=False),
    Column("before", Text, nullable=False),
    Column("after", Text, nullable=False),
    Index(None, "item_id", "id"),
    sqlite_autoincrement=True,
)

# What was ordered for a product; ``ended_at``: it was taken back. Amounts are decimals as text.
orders = Table(
    "orders",
    metadata,
    Column("id", Id, primary_key=True),
    Column("product_id", Id, ForeignKey("items.id"), nullable=False),
    Column("item_id", Id, ForeignKey("items.id"), nullable=False),
    Column("at", Stamp, nullable=False),
    Column("username", String(64), nullable=False),
    Column("quantity", String(64), nullable=False),
    Column("unit", String(32)),
    Column("supplier", Text, nullable=False),
    Column("number", Text, nullable=False),
    Column("price", String(64)),
    Column("currency", String(3)),
    Column("note", Text, nullable=False),
    Column("ended_at", Stamp),
    Column("ended_by", String(64)),
    Index(None, "product_id"),
    sqlite_autoincrement=True,
)

events = Table(
    "events",
    metadata,
    Column("id", Id, primary_key=True),
    Column("name", String(64), nullable=False),
    Column("item_uuid", Uuid),
    Column("part_number_key", String(64)),
    Column("data", Text, nullable=False),
    Column("at", Stamp, nullable=False),
    Column("username", String(64)),
    sqlite_autoincrement=True,
)

users = Table(
    "users",
    metadata,
    Column("id", Id, primary_key=True),
    Column("username", String(64), nullable=False),
    Column("username_key", String(64), nullable=False, unique=True),
    Column("display_name", Text, nullable=False),
    Column("role", String(16), nullable=False),
    Column("password_hash", Text),
    Column("active", Boolean, nullable=False),
    Column("approver", Boolean, nullable=False, server_default=false()),
    Column("created_at", Stamp, nullable=False),
    sqlite_autoincrement=True,
)

api_tokens = Table(
    "api_tokens",
    metadata,
    Column("id", Id, primary_key=True),
    Column("user_id", Id, ForeignKey("users.id"), nullable=False),
    Column("name", Text, nullable=False),
    Column("token_hash", String(64), nullable=False, unique=True),
    Column("prefix", String(16), nullable=False),
    Column("scope", String(8), nullable=False, server_default="admin"),
    Column("created_at", Stamp, nullable=False),
    Column("expires_at", Stamp),
    Column("last_used_at", Stamp),
    Column("revoked_at", Stamp),
    Index(None, "user_id"),
    sqlite_autoincrement=True,
)

sessions = Table(
    "sessions",
    metadata,
    Column("id_hash", String(64), primary_key=True),
    Column("user_id", Id, ForeignKey("users.id"), nullable=False),
    Column("csrf_token", String(64), nullable=False),
    Column("by_link", Boolean, nullable=False, server_default=false()),
    Column("created_at", Stamp, nullable=False),
    Column("expires_at", Stamp, nullable=False),
    Index(None, "user_id"),
)

login_links = Table(
    "login_links",
    metadata,
    Column("token_hash", String(64), primary_key=True),
    Column("user_id", Id, ForeignKey("users.id"), nullable=False),
    Column("expires_at", Stamp, nullable=False),
)

login_attempts = Table(
    "login_attempts",
    metadata,
    Column("id", Id, primary_key=True),
    Column("username_key", String(64), nullable=False),
    Column("address", String(64), nullable=False),
    Column("outcome", String(16), nullable=False),
    Column("at", Stamp, nullable=False),
    Index(None, "username_key", "at"),
    Index(None, "address", "at"),
    sqlite_autoincrement=True,
)

audit = Table(
    "audit",
    metadata,
    Column("id", Id, primary_key=True),
    Column("at", Stamp, nullable=False),
    Column("username", String(64), nullable=False),
    Column("action", String(64), nullable=False),
    Column("target", Text, nullable=False),
    Column("detail", Text, nullable=False),
    Column("address", String(64), nullable=False),
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
