# SPDX-License-Identifier: LGPL-2.1-or-later
"""answers to repeated requests of all kinds

Revision ID: 0008
Revises: 0007

Answers of before are not kept: they belong to a part of their request only.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    op.create_table(
        "answers",
        sa.Column("subject", sa.String(64), nullable=False),
        sa.Column("key", sa.String(128), nullable=False),
        sa.Column("request_hash", sa.String(64), nullable=False),
        sa.Column("answer", sa.Text, nullable=False),
        sa.Column("version", sa.Integer, nullable=False),
        sa.Column("at", sa.String(32), nullable=False),
        sa.Column("change_id", sa.BigInteger().with_variant(sa.Integer, "sqlite")),
        sa.PrimaryKeyConstraint("subject", "key", name="pk_answers"),
    )
    op.create_index("ix_answers_at", "answers", ["at"])
    op.drop_table("bom_syncs")
    op.drop_column("items", "created_as")
    with op.batch_alter_table("revisions", table_kwargs={"sqlite_autoincrement": True}) as batch:
        batch.drop_constraint("uq_revisions_item_id_idempotency_key", type_="unique")
        batch.drop_column("idempotency_key")
