# SPDX-License-Identifier: LGPL-2.1-or-later
"""files as documents, with the items that they hold and the documents that they link to

Revision ID: 0011
Revises: 0009

Each item that has a file gets a document with the item's UUID, whose revisions are the item's.
"""

from __future__ import annotations

import json

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0009"

ID = sa.BigInteger().with_variant(sa.Integer, "sqlite")


def upgrade() -> None:
    op.create_table(
        "documents",
        sa.Column("id", ID, nullable=False),
        sa.Column("uuid", sa.String(36), nullable=False),
        sa.Column("item_id", ID),
        sa.Column("current_revision", sa.Integer, nullable=False),
        sa.Column("created_at", sa.String(32), nullable=False),
        sa.Column("created_by", sa.String(64), nullable=False),
        sa.ForeignKeyConstraint(["item_id"], ["items.id"], name="fk_documents_item_id_items"),
        sa.PrimaryKeyConstraint("id", name="pk_documents"),
        sa.UniqueConstraint("uuid", name="uq_documents_uuid"),
        sa.UniqueConstraint("item_id", name="uq_documents_item_id"),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "document_items",
        sa.Column("document_id", ID, nullable=False),
        sa.Column("item_id", ID, nullable=False),
        sa.Column("object", sa.String(200), nullable=False),
        sa.ForeignKeyConstraint(
            ["document_id"], ["documents.id"], name="fk_document_items_document_id_documents"
        ),
        sa.ForeignKeyConstraint(["item_id"], ["items.id"], name="fk_document_items_item_id_items"),
        sa.PrimaryKeyConstraint("document_id", "item_id", "object", name="pk_document_items"),
    )
    op.create_index("ix_document_items_item_id", "document_items", ["item_id"])
    op.create_table(
        "document_links",
        sa.Column("document_id", ID, nullable=False),
        sa.Column("target", sa.String(36), nullable=False),
        sa.ForeignKeyConstraint(
            ["document_id"], ["documents.id"], name="fk_document_links_document_id_documents"
        ),
        sa.PrimaryKeyConstraint("document_id", "target", name="pk_document_links"),
    )
    op.create_index("ix_document_links_target", "document_links", ["target"])
    with op.batch_alter_table("revisions", table_kwargs={"sqlite_autoincrement": True}) as batch:
        batch.alter_column("item_id", existing_type=ID, nullable=True)
        batch.add_column(sa.Column("document_id", ID))
        batch.create_foreign_key("fk_revisions_document_id_documents", "documents", ["document_id"], ["id"])
        batch.create_unique_constraint(
            "uq_revisions_document_id_revision_number", ["document_id", "revision_number"]
        )
    _documents_of_items()


def _documents_of_items() -> None:
    bind = op.get_bind()
    tables = sa.MetaData()
    tables.reflect(bind, only=["items", "documents", "revisions", "document_items", "document_links"])
    items, documents, revisions = (tables.tables[name] for name in ("items", "documents", "revisions"))
    with_file = revisions.c.file_checksum.is_not(None)
    newest = (
        sa.select(
            revisions.c.item_id,
            sa.func.max(revisions.c.revision_number).label("number"),
            sa.func.min(revisions.c.created_at).label("at"),
        )
        .where(with_file)
        .group_by(revisions.c.item_id)
        .subquery()
    )
    rows = sa.select(items.c.uuid, items.c.id, newest.c.number, newest.c.at, items.c.created_by)
    names = ["uuid", "item_id", "current_revision", "created_at", "created_by"]
    bind.execute(documents.insert().from_select(names, rows.join(newest, newest.c.item_id == items.c.id)))
    its = sa.select(documents.c.id).where(documents.c.item_id == revisions.c.item_id).scalar_subquery()
    bind.execute(revisions.update().where(with_file).values(document_id=its))
    held = sa.select(documents.c.id, documents.c.item_id, sa.literal(""))
    bind.execute(
        tables.tables["document_items"].insert().from_select(["document_id", "item_id", "object"], held)
    )
    told = sa.select(documents.c.id, revisions.c.links).join(
        revisions,
        (revisions.c.document_id == documents.c.id)
        & (revisions.c.revision_number == documents.c.current_revision),
    )
    links = {
        (row.id, link["item"])
        for row in bind.execute(told.where(revisions.c.links.is_not(None)))
        for link in json.loads(row.links)
        if link.get("item")
    }
    if links:
        into = tables.tables["document_links"].insert()
        bind.execute(into, [{"document_id": one, "target": target} for one, target in sorted(links)])
