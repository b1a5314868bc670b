# SPDX-License-Identifier: LGPL-2.1-or-later
"""an index for the search, for lists at 200 000 items, and sync answers without their unchanged lines

Revision ID: 0002
Revises: 0001

The server fills the search index at its next start (``silo_server.services.search``).
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from silo_server.db.migrate import rebuilt

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    sqlite = op.get_bind().dialect.name == "sqlite"
    with rebuilt("items") as batch:
        batch.drop_column("search_key")
        if not sqlite:
            # Lists are sorted by code point on both databases; so is this column's index from now on.
            batch.alter_column(
                "part_number_key", existing_type=sa.String(64), type_=sa.String(64, collation="C")
            )
        for columns in (
            ["archived_at", "part_number_key"],
            ["item_type", "archived_at", "part_number_key"],
            ["category", "archived_at", "part_number_key"],
        ):
            batch.create_index("ix_items_" + "_".join(columns), columns)
    with rebuilt("bom_syncs") as batch:
        batch.add_column(
            sa.Column("change_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=True)
        )
    if sqlite:
        op.execute(
            "CREATE VIRTUAL TABLE item_search USING fts5(number, name, other, detail=column, columnsize=0, "
            "prefix='2 3 4', tokenize=\"unicode61 remove_diacritics 0 categories 'L* N* Co Cn'\")"
        )
    else:
        op.execute("CREATE TABLE item_search (item_id bigint PRIMARY KEY, words tsvector NOT NULL)")
        op.execute("CREATE INDEX ix_item_search_words ON item_search USING gin (words)")
