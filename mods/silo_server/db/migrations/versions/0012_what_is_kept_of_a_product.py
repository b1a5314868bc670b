# SPDX-License-Identifier: LGPL-2.1-or-later
"""what is kept of a product over its whole graph

Revision ID: 0012
Revises: 0011
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"


def upgrade() -> None:
    op.create_table(
        "product_summaries",
        sa.Column(
            "item_id",
            sa.BigInteger().with_variant(sa.Integer, "sqlite"),
            autoincrement=False,
            nullable=False,
        ),
        sa.Column("summary", sa.Text, nullable=False),
        sa.Column("sets", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("item_id", name="pk_product_summaries"),
    )
