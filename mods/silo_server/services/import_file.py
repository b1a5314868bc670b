# SPDX-License-Identifier: LGPL-2.1-or-later
"""The file of an import: bytes → a table, by :mod:`silo.tables`, or a refusal that the client understands.

What a user does not see in a workbook is not imported: hidden and struck-out lines, and a second sheet with
such a table, are refused. Reading needs no database: call it before a transaction begins, which others
would wait for.
"""

from __future__ import annotations

from silo.bom.errors import InputError, RejectedError, listed
from silo.bom.message import message
from silo.budget import OverBudgetError
from silo.tables.kind import TableKind
from silo.tables.sheet import Layout, Sheet, read_sheet
from silo_server.errors import TooLargeError


def read_import(data: bytes, kind: TableKind, max_rows: int, layout: Layout | None = None) -> Sheet:
    """Read a table. RejectedError if it is none of this kind, TooLargeError above ``max_rows``."""
    sheet = _read(data, kind, layout)
    if len(sheet.rows) > max_rows:
        raise TooLargeError(message("file: this server takes at most {most} rows, got more", most=max_rows))
    if sheet.sheets:
        names = listed([f"“{name}”" for name in sheet.sheets])
        raise RejectedError(
            message(
                "file: the sheets {sheets} each hold such a table; save the right sheet alone", sheets=names
            )
        )
    for lines, words in ((sheet.hidden, "hidden"), (sheet.struck, message("struck out"))):
        if lines:
            raise RejectedError(
                message(
                    "file: these lines are {words}: {lines}; show or delete them, for an import would take "
                    "them like all others",
                    words=words,
                    lines=listed([str(line) for line in lines], 8),
                )
            )
    return sheet


def _read(data: bytes, kind: TableKind, layout: Layout | None) -> Sheet:
    try:
        return read_sheet(data, message("file"), kind, layout=layout)
    except OverBudgetError as error:
        raise TooLargeError(str(error)) from None
    except InputError as error:
        raise RejectedError(str(error), list(error.problems)) from None
