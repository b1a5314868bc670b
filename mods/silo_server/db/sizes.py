# SPDX-License-Identifier: LGPL-2.1-or-later
"""How many bytes texts take in the database, and at which row a budget of bytes is passed."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, LargeBinary, Select, cast, func

from silo_server.db.transaction import Tx


def bytes_of(tx: Tx, written: ColumnElement[str]) -> ColumnElement[int]:
    """Make the expression for the size of a text [bytes], uncompressed."""
    return func.octet_length(written) if tx.postgres else func.length(cast(written, LargeBinary))


def beyond(tx: Tx, newest: Select[Any], budget: int) -> Any:
    """Find the newest row at which the sizes pass ``budget`` [bytes]; None if they never do.

    newest
        selects (key, size in bytes), newest first. Returns a key; never that of the first row.
    """
    total = 0
    with tx.conn.execute(newest, execution_options={"yield_per": 1000}) as rows:
        for number, (key, size) in enumerate(rows):
            total += size
            if total > budget and number:
                return key
    return None
