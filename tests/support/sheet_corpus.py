# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sheets as people save them, each with the masses and the warnings that it must give in every format.

`python tests/support/sheet_corpus.py` has LibreOffice write them as XLSX, ODS and XLS, and as CSV of the
values that it reads itself, into tests/data/sheets.tar.xz. The tests read that and need no LibreOffice.
"""

from __future__ import annotations

import datetime
import io
import subprocess
import tarfile
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

CORPUS = Path(__file__).parents[1] / "data" / "sheets.tar.xz"
FORMATS = ("xlsx", "ods", "xls")
Change = Callable[[Any], object]


@dataclass(frozen=True)
class Case:
    """Rows of a sheet, and what they must give.

    kg
        name → mass of one piece, in order; None if the sheet states none.
    warnings
        all of them, as a person reads them; a beginning is enough.
    change
        what is done to the sheet (of openpyxl) after its cells are filled.
    """

    rows: Sequence[Sequence[Any]]
    kg: Mapping[str, float | None]
    warnings: tuple[str, ...] = ()
    change: Change = field(default=lambda sheet: None)


HEAD = ["Name", "Qty", "Material", "Mass (g)"]
ROWS = [HEAD, ["lid", 1, "steel", 12.5], ["bolt", 4, "brass", 3.25], ["pin", 2, "steel", 1]]
KG: dict[str, float | None] = {"lid": 0.0125, "bolt": 0.00325, "pin": 0.001}
PLAIN = [["Name", "Qty", "Material", "Mass"], *ROWS[1:]]


def without(name: str, **others: float | None) -> dict[str, float | None]:
    return {**KG, name: None, **others}


def put(**cells: Any) -> Change:
    """Set cells: ``put(D3="=1/0")``."""

    def change(sheet: Any) -> None:
        for place, value in cells.items():
            sheet[place] = value

    return change


def looks(pattern: str, *places: str) -> Change:
    """Give cells a number format."""

    def change(sheet: Any) -> None:
        for place in places:
            sheet[place].number_format = pattern

    return change


def struck(*places: str) -> Change:
    from openpyxl.styles import Font

    def change(sheet: Any) -> None:
        for place in places:
            sheet[place].font = Font(strike=True)

    return change


def merged(*ranges: str) -> Change:
    """Merge cells; the covered ones keep what they hold, as some programs leave it."""

    def change(sheet: Any) -> None:
        for one in ranges:
            sheet.merged_cells.add(one)

    return change


def hidden(*, rows: Sequence[int] = (), columns: str = "") -> Change:
    def change(sheet: Any) -> None:
        for row in rows:
            sheet.row_dimensions[row].hidden = True
        for column in columns:
            sheet.column_dimensions[column].hidden = True

    return change


def both(*changes: Change) -> Change:
    def change(sheet: Any) -> None:
        for one in changes:
            one(sheet)

    return change


def grouped(sheet: Any) -> None:
    sheet.row_dimensions.group(3, 3, hidden=True)


def grouped_columns(sheet: Any) -> None:
    sheet.column_dimensions.group("C", "C", hidden=True)


def filtered(sheet: Any) -> None:
    sheet.auto_filter.ref = "A1:D4"
    sheet.auto_filter.add_filter_column(2, ["steel"])
    sheet.row_dimensions[3].hidden = True


def half_struck(place: str, *texts: str) -> Change:
    """Strike out the first of two texts, or the middle one of three."""

    def change(sheet: Any) -> None:
        from openpyxl.cell.rich_text import CellRichText, TextBlock
        from openpyxl.cell.text import InlineFont

        *before, gone, kept = texts
        sheet[place] = CellRichText(*before, TextBlock(InlineFont(strike=True), gone), kept)

    return change


def sheet_beside(
    title: str, rows: Sequence[Sequence[Any]], *, first: bool = False, away: bool = False
) -> Change:
    def change(sheet: Any) -> None:
        other = sheet.parent.create_sheet(title, 0 if first else None)
        for row in rows:
            other.append(row)
        if away:
            other.sheet_state = "hidden"

    return change


def commented(sheet: Any) -> None:
    from openpyxl.comments import Comment

    sheet["D2"].comment = Comment("was 99 g", "a reviewer")


def linked(sheet: Any) -> None:
    sheet["A2"].hyperlink = "https://example.com/lid"
    sheet["A2"].value = "lid"


def _error(place: str, text: str) -> str:
    return f"line {place[1:]}: the mass “{text}” is an error of the spreadsheet; it is not used"


def _hidden(line: int) -> str:
    return f"line {line} is hidden in the workbook; hidden lines are read like all others"


_NOT_READ = "sheet “BOM” of the workbook was read; not read: sheet “{}”"
_MERGED = "merged cells: “{}” in lines 2 to {}"
_UNDER = "under merged cells, where no program shows it: “{}” in line {}; it is not used"

# fmt: off
CASES: dict[str, Case] = {
    "plain": Case(ROWS, KG),
    "title-lines": Case([["Robot arm", "", "rev B"], [], *ROWS], KG),
    "texts-for-numbers": Case([HEAD, ["lid", "1", "steel", "12.5"], ["bolt", "4 pcs", "brass", "3.25 g"]],
                              {"lid": 0.0125, "bolt": 0.00325}),
    "decimal-commas": Case([HEAD, ["lid", 1, "steel", "12,5 g"], ["bolt", 4, "brass", "3,25 g"]],
                           {"lid": 0.0125, "bolt": 0.00325}),
    "line-breaks": Case([["Name", "Qty", "Material", "Mass\n(g)"], ["lid\nupper", 1, "steel", 12.5]],
                        {"lid upper": 0.0125}),
    "empty-lines": Case([ROWS[0], [], ROWS[1], [], [], ROWS[2], ROWS[3]], KG),
    "far-corner": Case(ROWS, KG, ("line 90: has no name and no part number",), put(IV90="note")),
    "booleans": Case(ROWS, without("lid"), ("line 2: the mass “TRUE” is no mass",), put(D2=True)),
    "indented": Case(
        [HEAD, ["arm", 1, "", ""], ["  lid", 1, "steel", 12.5], ["  bolt", 4, "brass", 3.25]],
        {"arm": None, "lid": 0.0125, "bolt": 0.00325},
        ("line 1: the names are indented; a row belongs to the one above it that is indented less",),
    ),
    "many-scripts": Case([["名称", "数量", "材料", "質量（g）"], ["Träger ™ 支架", 1, "Stahl", 12.5]],
                         {"Träger ™ 支架": 0.0125}),
    # formulas
    "formula": Case(ROWS, KG, change=put(D2="=10+2.5", B3="=2*2")),
    "formula-of-a-text": Case(ROWS, KG, change=put(D2='="12.5"&" g"', C3='="br"&"ass"')),
    "formula-of-an-empty-text": Case(ROWS, without("lid"), change=put(D2='=""', D3="=3.25")),
    "formula-of-a-sum": Case(ROWS, {**KG, "bolt": 0.0135}, change=put(D3="=SUM(D2,D4)")),
    **{
        f"error-{title}": Case(ROWS, without("bolt"), (_error("D3", text),), put(D3=formula))
        for title, formula, text in (
            ("division", "=1/0", "#DIV/0!"), ("not-there", "=NA()", "#N/A"), ("value", '="x"+1', "#VALUE!"),
            ("name", "=UNKNOWN_NAME", "#NAME?"), ("number", "=SQRT(-1)", "#VALUE!"),
            ("reference", '=INDEX(A1:A2,9)', "#VALUE!"),
        )
    },
    "error-handed-on": Case(ROWS, without("lid", bolt=None), (_error("D2", "#N/A"), _error("D3", "#N/A")),
                            put(D2="=NA()", D3="=D2*2")),
    "error-in-a-quantity": Case(ROWS, KG, ("line 3: the quantity “#DIV/0!” cannot be read",), put(B3="=1/0")),
    "error-in-a-material": Case(ROWS, without("bolt"), (), put(C3="=NA()", D3=None)),
    "error-in-a-name": Case(ROWS, {"lid": 0.0125, "#N/A": 0.00325, "pin": 0.001}, change=put(A3="=NA()")),
    "error-beside-the-table": Case(ROWS, KG, change=put(F3="=1/0")),
    # what is not shown
    "hidden-line": Case(ROWS, KG, (_hidden(3),), hidden(rows=[3])),
    "hidden-lines": Case(ROWS, KG, ("lines 2, 4 are hidden in the workbook",), hidden(rows=[2, 4])),
    "hidden-empty-line": Case(ROWS, KG, change=hidden(rows=[7])),
    "filtered-line": Case(ROWS, KG, (_hidden(3),), filtered),
    "collapsed-line": Case(ROWS, KG, (_hidden(3),), grouped),
    "hidden-column": Case(
        ROWS, KG,
        ("the column “Mass (g)” is hidden in the workbook; hidden columns are read like all others",),
        hidden(columns="D"),
    ),
    "hidden-columns": Case(ROWS, KG, ("the columns “Qty”, “Material” are hidden in the workbook",),
                           hidden(columns="BC")),
    "hidden-column-beside": Case([[*row, "x"] for row in ROWS], KG, change=hidden(columns="E")),
    "collapsed-column": Case(ROWS, KG, ("the column “Material” is hidden",), grouped_columns),
    "hidden-sheet-before": Case(
        ROWS, KG, (_NOT_READ.format("old"),),
        sheet_beside("old", [HEAD, ["lid", 1, "steel", 99]], first=True, away=True),
    ),
    "cover-sheet": Case(ROWS, KG, change=sheet_beside("Cover", [["Robot arm"], ["by"]], first=True)),
    "second-bom": Case(
        ROWS, KG, (_NOT_READ.format("rev A"),),
        sheet_beside("rev A", [HEAD, ["lid", 1, "steel", 99]]),
    ),
    "struck-line": Case(ROWS, KG, ("line 3 has struck-out text in the workbook; it is read like all others",),
                        struck("A3", "B3", "C3", "D3")),
    "struck-mass": Case(ROWS, KG, ("line 3 has struck-out text",), struck("D3")),
    "struck-beside": Case([[*row, "x"] for row in ROWS], KG, change=struck("E3")),
    "struck-words": Case([*ROWS[:2], ["bolt", 4, "", 3.25]], {"lid": 0.0125, "bolt": 0.00325},
                         ("line 3 has struck-out text",), half_struck("C3", "steel", " brass")),
    "struck-within": Case([*ROWS[:2], ["bolt", 4, "", 3.25]], {"lid": 0.0125, "bolt": 0.00325},
                          ("line 3 has struck-out text",), half_struck("C3", "cast ", "steel", " brass")),
    "formula-elsewhere": Case([*ROWS[:3], ["tape", 2, "steel", 0]],
                              {"lid": 0.0125, "bolt": 0.00325, "tape": 0},
                              change=sheet_beside("Notes", [[], [], [], ["", "", "", "=1-1"]])),
    "comment": Case(ROWS, KG, change=commented),
    "link": Case(ROWS, KG, change=linked),
    # merged cells
    "merged-text": Case(
        [*ROWS[:2], ["bolt", 4, None, 3.25], ["pin", 2, None, 1]], KG,
        (_MERGED.format("steel", 4) + "; each of these lines was given the text",), merged("C2:C4"),
    ),
    "merged-number": Case(
        [*ROWS[:2], ["bolt", 4, "brass", None], ROWS[3]], without("bolt"),
        (_MERGED.format("12.5", 3) + "; only the first of these lines has the number",), merged("D2:D3"),
    ),
    "merged-over-a-text": Case(
        ROWS, KG,
        (_MERGED.format("steel", 3), _UNDER.format("brass", 3)), merged("C2:C3"),
    ),
    "merged-over-a-mass": Case(
        ROWS, without("bolt"),
        (_MERGED.format("12.5", 3), _UNDER.format("3.25", 3)), merged("D2:D3"),
    ),
    "merged-across": Case([*ROWS, ["Fasteners"]], {**KG, "Fasteners": None}, change=merged("A5:D5")),
    "merged-title": Case([["Robot arm"], *ROWS], KG, change=merged("A1:D1")),
    "merged-beside": Case([[*row, None] for row in ROWS], KG, change=both(put(E2="note"), merged("E2:E4"))),
    "merged-header": Case(
        [["Name", "Qty", "Material", "Mass", None], [None, None, None, "each (g)", "total (g)"],
         ["lid", 1, "steel", 12.5, 12.5], ["bolt", 4, "brass", 3.25, 13]],
        {"lid": 0.0125, "bolt": 0.00325}, change=merged("A1:A2", "B1:B2", "C1:C2", "D1:E1"),
    ),
    "merged-block": Case(
        [*ROWS[:2], ["bolt", 4, None, None], ["pin", 2, "brass", 1]], without("bolt", lid=None),
        (_MERGED.format("steel", 3), _UNDER.format("12.5", 2)), merged("C2:D3"),
    ),
    # number formats
    "format-of-grams": Case(PLAIN, KG, change=looks('0.0" g"', "D2", "D3", "D4")),
    "format-of-two-units": Case(
        PLAIN, {**KG, "lid": 12.5}, change=both(looks('0.0" kg"', "D2"), looks('0.0" g"', "D3", "D4")),
    ),
    "format-against-header": Case(ROWS, {**KG, "lid": 12.5}, change=looks('0.0 "kg"', "D2")),
    "format-of-thousands": Case([PLAIN[0], ["lid", 1, "steel", 12500], ["bolt", 4, "brass", 3250]],
                                {"lid": 12.5, "bolt": 3.25}, change=looks('0.0,"kg"', "D2", "D3")),
    "format-with-conditions": Case(
        [PLAIN[0], ["lid", 1, "steel", 12500], ["bolt", 4, "brass", 3.25]], {"lid": 12.5, "bolt": 0.00325},
        change=looks('[>=1000]0.00,"kg";0.00"g"', "D2", "D3"),
    ),
    "format-of-two-places": Case(
        [["Name", "Qty", "Material", "Mass (kg)"], ["lid", 1, "steel", 0.0123456], ["bolt", 4, "brass", 1.2]],
        {"lid": 0.0123456, "bolt": 1.2}, change=looks("0.00", "D2", "D3"),
    ),
    "format-of-leading-zeros": Case(
        [["Part number", *HEAD[1:]], [123, 1, "steel", 12.5], [4, 1, "brass", 3.25]],
        {"00123": 0.0125, "00004": 0.00325}, change=looks("00000", "A2", "A3"),
    ),
    "format-of-drawings": Case(
        [["Part number", *HEAD[1:]], [12, 1, "steel", 12.5]], {"P-012": 0.0125},
        change=looks('"P-"000', "A2"),
    ),
    "format-of-pieces": Case(ROWS, KG, change=looks('0" pcs"', "B2", "B3", "B4")),
    "format-grouped": Case([HEAD, ["lid", 1, "", 12500.5]], {"lid": 12.5005}, change=looks("#,##0.0", "D2")),
    "format-scientific": Case([HEAD, ["lid", 1, "", 1.25e-5]], {"lid": 1.25e-8},
                              change=looks("0.00E+00", "D2")),
    "format-percent": Case(ROWS, without("bolt"), ("line 3: the mass “325%”",), looks("0%", "D3")),
    "format-money": Case(ROWS, without("bolt"), ("line 3: the mass “3.25 €” has the unknown unit “€”",),
                         looks('#,##0.00\\ [$€-407];-#,##0.00\\ [$€-407]', "D3")),
    "format-of-signs": Case(ROWS, KG, change=looks('0.0_);[Red]\\(0.0\\);"-"', "D2", "D3", "D4")),
    "negative": Case([*ROWS[:2], ["bolt", 4, "brass", -3.25]], {"lid": 0.0125, "bolt": None},
                     ("line 3: the mass “-3.25 g” is negative",), looks('0.0" g";[Red]\\-0.0" g"', "D3")),
    "date-for-a-quantity": Case(ROWS, KG, ("line 3: the quantity “2026-01-02” cannot be read",),
                                put(B3=datetime.date(2026, 1, 2))),
    "date-for-an-item": Case(
        [["Item", *HEAD], [1, *ROWS[1]], ["1.1", *ROWS[2]], [datetime.date(2026, 1, 2), *ROWS[3]]], KG,
        ("line 4: the item number “2026-01-02” cannot be read",),
    ),
    "time-for-a-mass": Case(ROWS, without("bolt"), ("line 3: the mass “01:30:00” is no mass",),
                            put(D3=datetime.time(1, 30))),
    "items-with-zeros": Case(
        [["Item", *HEAD], [1, *ROWS[1]], [1.1, *ROWS[2]], [1.2, *ROWS[3]]], KG,
        change=looks("0.0", "A3", "A4"),
    ),
}
# fmt: on


def source(case: Case) -> Any:
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "BOM"
    for number, row in enumerate(case.rows, 1):
        for column, value in enumerate(row, 1):
            sheet.cell(number, column, value)
    case.change(sheet)
    book.active = sheet
    return book


def write_corpus() -> None:
    """Write every case in all formats, and LibreOffice's own CSV of its sheet."""
    # Cells as they are stored, not as they are shown; -1: every sheet into a file of its own.
    csv = "csv:Text - txt - csv (StarCalc):44,34,76,1,,0,false,false,false,false,false,-1"
    with tempfile.TemporaryDirectory() as folder:
        for name, case in CASES.items():
            source(case).save(Path(folder) / f"{name}.xlsx")
        sources = sorted(Path(folder).glob("*.xlsx"))
        with tarfile.open(CORPUS, "w:xz") as corpus:
            for form in (*FORMATS, csv):
                out = Path(folder) / form.partition(":")[0]
                command = ["soffice", "--headless", f"-env:UserInstallation=file://{folder}/profile"]
                subprocess.run([*command, "--convert-to", form, "--outdir", out, *sources], check=True)
                for path in sorted(out.iterdir()):
                    name = path.name.replace("-BOM.csv", ".csv")
                    if Path(name).stem in CASES:
                        data = path.read_bytes()
                        info = tarfile.TarInfo(name)
                        stored = _unpacked(data) if form in ("xlsx", "ods") else data
                        info.size = len(stored)
                        corpus.addfile(info, io.BytesIO(stored))


def _unpacked(book: bytes) -> bytes:
    """Return the same zip without its own compression, which keeps the corpus small, and without pictures."""
    with zipfile.ZipFile(io.BytesIO(book)) as old, zipfile.ZipFile(out := io.BytesIO(), "w") as new:
        for info in old.infolist():
            if not info.filename.startswith("Thumbnails"):
                new.writestr(zipfile.ZipInfo(info.filename), old.read(info))
    return out.getvalue()


def read_corpus() -> dict[str, bytes]:
    """The files by name: "plain.xlsx"."""
    with tarfile.open(CORPUS) as corpus:
        return {info.name: corpus.extractfile(info).read() for info in corpus}  # type: ignore[union-attr]


if __name__ == "__main__":
    write_corpus()
