# SPDX-License-Identifier: LGPL-2.1-or-later
"""The picture that a browser drew of an item without a picture; it stays until a new file replaces it."""

from __future__ import annotations

import io

from sqlalchemy import update

from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.errors import DuplicateError
from silo_server.services.file_store import FileStore
from silo_server.services.thumbnails import png_size
from silo_server.values import Item


def keep_picture(tx: Tx, store: FileStore, item: Item, picture: bytes) -> None:
    """Store a PNG that a browser drew, for an item without a picture. RejectedError, DuplicateError."""
    size = png_size(picture)
    if len(picture) > MAX_DRAWN or not size:
        raise RejectedError(
            message("picture: wanted a whole PNG of at most {most} KiB, got another", most=MAX_DRAWN // 1024)
        )
    if not 16 <= min(size) <= max(size) <= 512:
        raise RejectedError(
            message(
                "picture: wanted 16 to 512 pixels each way, got {width} × {height}",
                width=size[0],
                height=size[1],
            )
        )
    kept = store.keep("picture.png", io.BytesIO(picture)).checksum
    bare = (items.c.id == item.id) & items.c.thumbnail_key.is_(None)
    if not tx.conn.execute(update(items).where(bare).values(thumbnail_key=kept)).rowcount:
        raise DuplicateError(
            message("{subject} has a picture already; a new file takes it away", subject=item.subject)
        )


MAX_DRAWN = 256 * 1024
