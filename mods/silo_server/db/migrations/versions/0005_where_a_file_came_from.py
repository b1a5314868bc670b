# SPDX-License-Identifier: LGPL-2.1-or-later
"""which revision a file was made from, where it was, and what it links to

Revision ID: 0005
Revises: 0004
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    op.add_column("revisions", sa.Column("base_revision", sa.Integer, nullable=True))
    op.add_column("revisions", sa.Column("file_path", sa.Text, nullable=True))
    op.add_column("revisions", sa.Column("links", sa.Text, nullable=True))
