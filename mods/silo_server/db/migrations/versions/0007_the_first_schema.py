# SPDX-License-Identifier: LGPL-2.1-or-later
"""the first schema

Revision ID: 0007
Revises:

It has the identifier of the last of the seven steps that led to it, so that a database made by them opens.
What it says stays as it is: a change of a table is a revision of its own.
"""

from __future__ import annotations

from typing import Any

from alembic import op
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

revision = "0007"
down_revision = None

metadata = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)

Id = BigInteger().with_variant(Integer, "sqlite")
Stamp = String(32)
Key = String(64).with_variant(String(64, collation="C"), "postgresql")
Uuid = String(36)


def _only(condition: str) -> dict[str, Any]:
    return {"sqlite_where": text(condition), "postgresql_where": text(condition)}


Table(
    "server_state",
    metadata,
    Column("key", String(64), primary_key=True),
    Column("value", Text, nullable=False),
)

Table(
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
    Column("current_revision", Integer, nullable=False),
    Column("bom_version", Integer, nullable=False),
    Column("version", Integer, nullable=False, server_default="1"),
    Column("created_as", String(64)),
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

Table(
    "number_counters",
    metadata,
    Column("schema_name", String(64), primary_key=True),
    Column("category", String(32), primary_key=True),
    Column("last_serial", Integer, nullable=False),
)

Table(
    "revisions",
    metadata,
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
    Index("ix_bom_lines_unreferenced", "parent_id", **_only("unreferenced_since IS NOT NULL")),
)

Table(
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

Table(
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

Table(
    "bom_syncs",
    metadata,
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
    "bom_conflicts",
    metadata,
    Column("parent_id", Id, ForeignKey("items.id"), primary_key=True),
    Column("child_id", Id, ForeignKey("items.id"), primary_key=True),
    Column("cad_quantity", Float(53), nullable=False),
    Column("since", Stamp, nullable=False),
    Column("accepted", Boolean, nullable=False),
)

Table(
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
    Index("ix_bom_last_syncs_open", "parent_id", **_only("left_out <> '[]' OR refused_at IS NOT NULL")),
)

Table(
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

Table(
    "users",
    metadata,
    Column("id", Id, primary_key=True),
    Column("username", String(64), nullable=False),
    Column("username_key", String(64), nullable=False, unique=True),
    Column("display_name", Text, nullable=False),
    Column("role", String(16), nullable=False),
    Column("password_hash", Text),
    Column("active", Boolean, nullable=False),
    Column("created_at", Stamp, nullable=False),
    sqlite_autoincrement=True,
)

Table(
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

Table(
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

Table(
    "login_links",
    metadata,
    Column("token_hash", String(64), primary_key=True),
    Column("user_id", Id, ForeignKey("users.id"), nullable=False),
    Column("expires_at", Stamp, nullable=False),
)

Table(
    "login_failures",
    metadata,
    Column("id", Id, primary_key=True),
    Column("username_key", String(64), nullable=False),
    Column("address", String(64), nullable=False),
    Column("at", Stamp, nullable=False),
    Index(None, "username_key", "at"),
    Index(None, "address", "at"),
    sqlite_autoincrement=True,
)

Table(
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


def upgrade() -> None:
    connection = op.get_bind()
    metadata.create_all(connection)
    # The server fills the index of the search at its next start (``silo_server.services.search``).
    if connection.dialect.name == "sqlite":
        op.execute(
            "CREATE VIRTUAL TABLE item_search USING fts5(number, name, other, detail=column, columnsize=0, "
            "prefix='2 3 4', tokenize=\"unicode61 remove_diacritics 0 categories 'L* N* Co Cn'\")"
        )
    else:
        op.execute("CREATE TABLE item_search (item_id bigint PRIMARY KEY, words tsvector NOT NULL)")
        op.execute("CREATE INDEX ix_item_search_words ON item_search USING gin (words)")
