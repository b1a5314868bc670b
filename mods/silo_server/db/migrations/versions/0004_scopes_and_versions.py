# SPDX-License-Identifier: LGPL-2.1-or-later
"""scopes of tokens, sessions that a login link began, a version of each item

Revision ID: 0004
Revises: 0003
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    # Tokens of before may do all that their user may, as they could.
    op.add_column("api_tokens", sa.Column("scope", sa.String(8), nullable=False, server_default="admin"))
    op.add_column("sessions", sa.Column("by_link", sa.Boolean, nullable=False, server_default=sa.false()))
    op.add_column("items", sa.Column("version", sa.Integer, nullable=False, server_default="1"))
    op.add_column("items", sa.Column("created_as", sa.String(64), nullable=True))
