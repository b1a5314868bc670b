# SPDX-License-Identifier: LGPL-2.1-or-later
"""the project's folder of each sync, indexes of what waits for a person and for sorted lists

Revision ID: 0006
Revises: 0005
"""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"


def _only(condition: str) -> dict[str, Any]:
    return {"sqlite_where": sa.text(condition), "postgresql_where": sa.text(condition)}


def upgrade() -> None:
    op.add_column("bom_last_syncs", sa.Column("folder", sa.Text, nullable=True))
    op.create_index(
        "ix_bom_last_syncs_open",
        "bom_last_syncs",
        ["parent_id"],
        **_only("left_out <> '[]' OR refused_at IS NOT NULL"),
    )
    op.create_index(
        "ix_bom_lines_unreferenced", "bom_lines", ["parent_id"], **_only("unreferenced_since IS NOT NULL")
    )
    for column in ("name", "updated_at"):
        columns = ["archived_at", column, "part_number_key"]
        op.create_index(f"ix_items_{'_'.join(columns)}", "items", columns)
