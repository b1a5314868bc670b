# SPDX-License-Identifier: LGPL-2.1-or-later
"""the last sync of each assembly

Revision ID: 0003
Revises: 0002

Merges of before are taken over from the history; what they left out was never sent.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    op.create_table(
        "bom_last_syncs",
        sa.Column("parent_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("at", sa.String(length=32)),
        sa.Column("username", sa.String(length=64), nullable=False),
        sa.Column("document_file", sa.Text()),
        sa.Column("left_out", sa.Text(), nullable=False),
        sa.Column("components", sa.Text(), nullable=False),
        sa.Column("refused_at", sa.String(length=32)),
        sa.Column("refusal", sa.Text()),
        sa.ForeignKeyConstraint(["parent_id"], ["items.id"], name=op.f("fk_bom_last_syncs_parent_id_items")),
        sa.PrimaryKeyConstraint("parent_id", name=op.f("pk_bom_last_syncs")),
    )
    op.execute(
        """
        INSERT INTO bom_last_syncs (parent_id, at, username, document_file, left_out, components)
        SELECT parent_id, at, username, document_file, '[]', '{}' FROM bom_changes
        WHERE id IN (SELECT max(id) FROM bom_changes WHERE kind = 'merge' GROUP BY parent_id)
        """
    )
