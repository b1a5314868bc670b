# SPDX-License-Identifier: LGPL-2.1-or-later
"""The numbers of a column: its decimal mark, and a cell as a number with its unit or currency.

The texts of a column decide together what "1,234" means. What shows nothing stays a question, in a CSV file
and in a workbook alike: a workbook's own numbers have no mark, and show nothing of its texts. In a file
separated by commas a program wrote "1.250" with a decimal point.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

from silo.bom.numbers import LONGEST, Mark, common_mark, parse_number, read_count
from silo.bom.units import UnitKind, known_unit
from silo.tables.heading_detail import currency_of_word
from silo.tables.limits import LONGEST_AMOUNT
from silo.tables.sheet import Sheet
from silo.workbook.sheet import SheetRow


@dataclass(frozen=True, slots=True)
class Amount:
    """A cell as a number. ``unit``, ``currency``: written beside it, "" if none is. ``problem``: why it is
    none.
    """

    value: Decimal | None
    unit: str = ""
    currency: str = ""
    problem: str = ""


@dataclass(frozen=True, slots=True)
class Numerals:
    """Reads the numbers of one column."""

    index: int | None
    mark: Mark | None = None
    points_are_decimal: bool = False

    @classmethod
    def of(cls, sheet: Sheet, index: int | None, mark: Mark | None = None) -> Numerals:
        """Find the decimal mark of a column; ``mark``: the user's word."""
        if mark is None and index is not None:
            texts = [
                row.cells[index] for row in sheet.rows if index < len(row.cells) and index not in row.numbers
            ]
            mark = common_mark(
                number.mark for text in texts if (number := parse_number(_bare(text)[0])) is not None
            )
            return cls(index, mark, sheet.delimiter == ",")
        return cls(index, mark)

    def read(self, row: SheetRow) -> Amount:
        """Read the row's cell of this column."""
        text = row.cells[self.index] if self.index is not None and self.index < len(row.cells) else ""
        return self.read_text(text, is_number=self.index in row.numbers)

    def read_text(self, text: str, *, is_number: bool = False) -> Amount:
        """Read a text: a number, with a unit or a currency beside it."""
        number, unit, currency = _bare(text)
        mark = None if is_number else self.mark
        reading = read_count(number, mark, points_are_decimal=is_number or self.points_are_decimal)
        value = None if reading.value is None else Decimal(f"{reading.value.normalize():f}")
        return Amount(value, unit, currency, reading.problem)


def _bare(text: str) -> tuple[str, str, str]:
    """Split a text into number, unit and currency: "12,00 €", "EUR 3", "0.5 m"."""
    bare = text.strip().lstrip("'")
    if len(bare) > LONGEST_AMOUNT or not bare:
        return bare[: LONGEST + 1], "", ""
    words = bare.split()
    for number, word in ((bare[:-1], bare[-1]), (bare[1:], bare[0])):
        if not word.isalpha() and (code := currency_of_word(word)):
            return number.strip(), "", code
    if len(words) > 1:
        for rest, word in ((words[:-1], words[-1]), (words[1:], words[0])):
            if code := currency_of_word(word):
                return " ".join(rest), "", code
    end = len(bare)
    while end and not bare[end - 1].isdecimal():
        end -= 1
    for cut in (end, end - 1):  # "m2" ends in a digit
        unit = known_unit(bare[cut:]) if 0 < cut < len(bare) else None
        if unit is not None and unit.kind is not UnitKind.PIECES and parse_number(bare[:cut]):
            return bare[:cut].strip(), unit.symbol, ""
    square = bare.rstrip("23²³")
    tail = len(square.rstrip("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"))
    unit = known_unit(bare[tail:]) if 0 < tail < len(square) < len(bare) else None
    if unit is not None and parse_number(bare[:tail]):
        return bare[:tail].strip(), unit.symbol, ""
    return bare, "", ""
