# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOM as rows of a spreadsheet, written as CSV or as a workbook. A text never becomes a formula."""

from __future__ import annotations

import csv
import sys
from io import StringIO
from pathlib import Path
from typing import Any

from silo.bom.entry import Extraction
from silo.bom.errors import ConfigError
from silo.bom.headers import safe_cell
from silo.bom.message import message
from silo.bom.text import with_allowed_characters
from silo.bom.view.flat_list import PIECES, flat_json
from silo.bom.view.tree_json import bom_json
from silo.platform.whole_files import replacing

_COLUMNS = (
    *("part_number", "name", "variant", "quantity", "unit", "standard", "doc_path", "object", "missing"),
)
_HEADINGS = {"part_number": "part number", "variant": "values", "doc_path": "file"}


def table_rows(extraction: Extraction, *, flat: bool) -> list[list[str | int]]:
    """Make the rows of a spreadsheet, with a heading; ``level`` is 1 for direct children of the assembly."""
    rows: list[dict[str, Any]] = []

    def grow(entries: list[dict[str, Any]]) -> None:
        for entry in entries:
            name = entry["name"] or entry["standard"] or entry["label"]
            rows.append({**entry, "name": name, "unit": PIECES})
            grow(entry["children"])

    grow([]) if flat else grow(bom_json(extraction)["entries"])
    level = () if flat else ("level",)
    columns = (*level, *_COLUMNS)
    printed = flat_json(extraction) if flat else rows
    cells = [["yes" if row.get(name) is True else row.get(name) or "" for name in columns] for row in printed]
    return [[_HEADINGS.get(name, name) for name in columns], *cells]


def write_csv(path: str, rows: list[list[str | int]]) -> None:
    text = StringIO(newline="")
    csv.writer(text).writerows(list(map(safe_cell, row)) for row in rows)
    if path == "-":
        sys.stdout.write(text.getvalue().replace("\r\n", "\n"))
        return
    with replacing(Path(path)) as file:  # spreadsheets want the mark
        file.write(b"\xef\xbb\xbf" + text.getvalue().encode("utf-8", "surrogateescape"))


def write_xlsx(path: str, rows: list[list[str | int]]) -> None:
    """Write a workbook; text stays text. ConfigError if XlsxWriter is not installed."""
    try:
        from xlsxwriter import Workbook
    except ImportError:
        raise ConfigError(
            message("--xlsx needs the package XlsxWriter: pip install 'silo-mod[server]'")
        ) from None
    with replacing(Path(path)) as file, Workbook(file, {"in_memory": True}) as book:
        sheet = book.add_worksheet()
        for number, row in enumerate(rows):
            for column, value in enumerate(row):
                if isinstance(value, str):  # no formula
                    sheet.write_string(number, column, with_allowed_characters(value)[:32767])
                else:
                    sheet.write_number(number, column, value)
        sheet.freeze_panes(1, 0)
