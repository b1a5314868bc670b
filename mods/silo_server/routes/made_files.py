# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that are made for an answer: exports, spooled to the disk if they are large."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from tempfile import SpooledTemporaryFile
from typing import IO, Any, cast
from urllib.parse import quote

from starlette.responses import Response, StreamingResponse

from silo.platform.part_file_name import part_file_stem
from silo_server.db.transaction import Tx
from silo_server.routes.call import Call
from silo_server.services.product.export import Export, Row

SPOOL_BYTES = 1024 * 1024
CHUNK = 64 * 1024
CSV = "text/csv; charset=utf-8; header=present"
XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"


def content_of(media_type: str) -> dict[int | str, dict[str, Any]]:
    """Return the documented answers of a route that sends a file."""
    return {200: {"content": {media_type: {}}, "description": "The file"}}


def _attachment(name: str) -> str:
    """Write the header of a download, with a plain name beside one that is not plain (RFC 6266)."""
    plain = "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "_" for c in name)
    full = "" if plain == name else f"; filename*=UTF-8''{quote(name, safe='')}"
    return f'attachment; filename="{plain}"{full}'


class _Spool(SpooledTemporaryFile[bytes]):
    """A file, on the disk if it is large: an export must not take the memory of a whole file.

    Nor the time of a server that ends, which ``check`` reports.
    """

    check: Callable[[], object]

    def write(self, data: Any) -> int:
        self.check()
        return super().write(data)


def _while(check: Callable[[], object], rows: Iterable[Row]) -> Iterator[Row]:
    for row in rows:
        check()
        yield row


def _sent(out: IO[bytes]) -> Iterator[bytes]:
    with out:
        while chunk := out.read(CHUNK):
            yield chunk


def file_of(
    call: Call,
    make: Callable[[Tx], Export],
    write: Callable[[Export, IO[bytes]], Callable[[], None] | None],
    media_type: str,
    name: str,
) -> Response:
    """Make a file and send it; its name begins with the part number."""
    turn = call.server.large_reads
    spool = _Spool(max_size=SPOOL_BYTES)
    spool.check = turn.check
    out = cast(IO[bytes], spool)
    try:
        with turn.enter():
            with call.read() as tx:
                made = make(tx)
                pack = write(replace(made, rows=_while(turn.check, made.rows)), out)
            if pack:
                pack()
    except BaseException:
        out.close()
        raise
    headers = {
        "Content-Disposition": _attachment(f"{part_file_stem(made.root.part_number)}-{name}"),
        "Content-Length": str(out.seek(0, os.SEEK_END)),
    }
    out.seek(0)
    return StreamingResponse(_sent(out), media_type=media_type, headers=headers)
