# SPDX-License-Identifier: LGPL-2.1-or-later
"""who each event is of

Revision ID: 0007
Revises: 0006

Events of before say it in their data, where they say it.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    op.add_column("events", sa.Column("username", sa.String(64), nullable=True))
    if op.get_bind().dialect.name == "postgresql":
        op.execute("UPDATE events SET username = left(data::json ->> 'user', 64)")
    else:
        op.execute("UPDATE events SET username = substr(json_extract(data, '$.user'), 1, 64)")
