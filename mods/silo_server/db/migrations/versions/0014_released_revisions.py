# SPDX-License-Identifier: LGPL-2.1-or-later
"""released revisions of products, who may approve them, and what is frozen of each item

Revision ID: 0014
Revises: 0013
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"

ID = sa.BigInteger().with_variant(sa.Integer, "sqlite")
NUMBERED = "status IN ('review', 'released', 'obsolete')"
IN_REVIEW = "status = 'review'"


def upgrade() -> None:
    op.add_column("users", sa.Column("approver", sa.Boolean, nullable=False, server_default=sa.false()))
    op.create_table(
        "frozen_items",
        sa.Column("hash", sa.String(64), nullable=False),
        sa.Column("record", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("hash", name="pk_frozen_items"),
    )
    op.create_table(
        "releases",
        sa.Column("id", ID, nullable=False),
        sa.Column("item_id", ID, nullable=False),
        sa.Column("label", sa.String(16), nullable=False),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("record", sa.String(64), nullable=False),
        sa.Column("with_parts", sa.Boolean, nullable=False),
        sa.Column("blocks", sa.Text, nullable=False),
        sa.Column("comment", sa.Text, nullable=False),
        sa.Column("frozen_at", sa.String(32), nullable=False),
        sa.Column("created_by", sa.String(64), nullable=False),
        sa.Column("ended_at", sa.String(32)),
        sa.Column("ended_by", sa.String(64)),
        sa.Column("note", sa.Text, nullable=False),
        sa.Column("override", sa.Text),
        sa.ForeignKeyConstraint(["item_id"], ["items.id"], name="fk_releases_item_id_items"),
        sa.ForeignKeyConstraint(["record"], ["frozen_items.hash"], name="fk_releases_record_frozen_items"),
        sa.PrimaryKeyConstraint("id", name="pk_releases"),
        sqlite_autoincrement=True,
    )
    for name, columns, condition in (
        ("uq_releases_item_id_label", ["item_id", "label"], NUMBERED),
        ("uq_releases_in_review", ["item_id"], IN_REVIEW),
    ):
        only = sa.text(condition)
        op.create_index(name, "releases", columns, unique=True, sqlite_where=only, postgresql_where=only)
    op.create_index("ix_releases_record", "releases", ["record"])
    op.create_table(
        "release_approvals",
        sa.Column("release_id", ID, nullable=False),
        sa.Column("username", sa.String(64), nullable=False),
        sa.Column("at", sa.String(32), nullable=False),
        sa.Column("comment", sa.Text, nullable=False),
        sa.ForeignKeyConstraint(
            ["release_id"], ["releases.id"], name="fk_release_approvals_release_id_releases"
        ),
        sa.PrimaryKeyConstraint("release_id", "username", name="pk_release_approvals"),
    )
