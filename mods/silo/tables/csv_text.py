# SPDX-License-Identifier: LGPL-2.1-or-later
"""The text of a CSV file and its records.

A byte order mark decides the encoding; then UTF-8; then code pages, in the order of the kind of table.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.tables import limits
from silo.workbook.encoding import unicode_name
from silo.workbook.sheet import SheetRow

DELIMITERS = ",;\t|"


def decodings(
    data: bytes, encoding: str | None, source: str, code_pages: Sequence[str]
) -> Iterator[tuple[str, str]]:
    """Yield the name of each encoding that is possible, and the text in it.

    Without code pages, bytes that are no UTF-8 stay in the text, for the names of files.
    """
    if encoding is not None:
        try:
            yield encoding, data.decode(encoding)
        except (UnicodeDecodeError, LookupError) as error:
            raise InputError(
                message(
                    "{source}: cannot be read as {encoding}: {error}",
                    source=source,
                    encoding=encoding,
                    error=error,
                )
            ) from error
        return
    if name := unicode_name(data):
        # Bytes that are no text are kept in the name of a file, which only UTF-8 can; else they are marked.
        kept = not code_pages and name.startswith("utf-8")
        yield name, data.decode(name, errors="surrogateescape" if kept else "replace")
        return
    if not code_pages:
        yield "utf-8", data.decode("utf-8", "surrogateescape")
    for name in ("utf-8", *code_pages) if code_pages else ():
        try:
            yield name, data.decode(name)
        except UnicodeDecodeError:
            continue


def read_records(text: str, delimiter: str, source: str) -> list[SheetRow]:
    """Read all records with their lines. InputError for quotes that do not match, and above the limits.

    A quote that is never closed would hide all rows below it.
    """
    rows: list[SheetRow] = []
    account = limits.TABLE.account(source)
    line = 1
    try:
        for row in _records(text, delimiter):
            if len(row.cells) > limits.MOST_COLUMNS:
                raise InputError(
                    message(
                        "{source}: line {line} has {count} cells; a table has at most {most_columns} columns",
                        source=source,
                        line=row.line,
                        count=len(row.cells),
                        most_columns=limits.MOST_COLUMNS,
                    )
                )
            account.take_objects()
            account.take_cells(len(row.cells))
            for cell in row.cells:
                account.check_text(cell)
            rows.append(row)
            line = row.line + sum(cell.count("\n") for cell in row.cells) + 1
    except csv.Error as error:
        raise InputError(
            message(
                "{source}: the row of line {line} cannot be read as CSV: its quotes do not match, so the "
                "rows from there on may be wrong or missing ({error})",
                source=source,
                line=line,
                error=error,
            )
        ) from None
    return rows


def first_records(text: str, delimiter: str) -> list[SheetRow]:
    """Read the lines in which the heading must be; as many as can be read."""
    rows: list[SheetRow] = []
    try:
        for row in _records(text, delimiter):
            if len(rows) >= limits.HEADER_WITHIN or len(row.cells) > limits.MOST_COLUMNS:
                break
            rows.append(row)
    except csv.Error:
        pass  # what was read before may hold the heading; read_records reports the error
    return rows


def _records(text: str, delimiter: str) -> Iterator[SheetRow]:
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    line = 1
    for cells in reader:
        yield SheetRow(line, tuple(cell.replace("\0", "") for cell in cells))
        line = reader.line_num + 1
