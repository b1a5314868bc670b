# SPDX-License-Identifier: LGPL-2.1-or-later
"""who looked at a product, and when

Revision ID: 0013
Revises: 0012
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer, "sqlite")
    op.create_table(
        "product_looks",
        sa.Column("user_id", number, autoincrement=False, nullable=False),
        sa.Column("item_id", number, autoincrement=False, nullable=False),
        sa.Column("at", sa.String(32), nullable=False),
        sa.Column("since", sa.String(32)),
        sa.PrimaryKeyConstraint("user_id", "item_id", name="pk_product_looks"),
    )
