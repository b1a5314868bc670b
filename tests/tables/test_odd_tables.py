# SPDX-License-Identifier: LGPL-2.1-or-later
"""Odd tables as companies bring them: each has one answer, from each reader and in each format.

A table is a BOM (read for an import and for masses) or a price list. Its answer is its lines, the rows that
are left out, the questions, or a refusal; and the columns that are not used.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import pytest
from openpyxl import Workbook

from silo.bom.errors import InputError
from silo.bom.headers import Heading
from silo.inertia.bom.parser import BOMParser
from silo.tables.bom_rows import BOM, bom_rows
from silo.tables.price_rows import PRICES, price_rows
from silo.tables.sheet import read_sheet

GIVEN = Path(__file__).parents[2].parent / "shared" / "cases" / "tables"


@dataclass(frozen=True)
class Bom:
    """A table of a BOM.

    lines
        (part number, quantity or None for a question, number of the row above it).
    out
        part numbers of the rows that are left out.
    asks
        a part of each question.
    refused
        a part of the refusal; such a table has no lines.
    """

    text: str
    lines: Sequence[tuple[str, str | None, str]] = ()
    out: Sequence[str] = ()
    asks: Sequence[str] = ()
    refused: str = ""
    unused: Sequence[str] = ()
    units: Sequence[str] = ()


@dataclass(frozen=True)
class Prices:
    """A price list. ``lines``: (part number, supplier's number, "from: price, …" of one, currency)."""

    text: str
    lines: Sequence[tuple[str, str, str, str]] = ()
    asks: Sequence[str] = ()
    refused: str = ""
    unused: Sequence[str] = ()


A, AB = [("A", "1", "")], [("A", "1", ""), ("B", "2", "")]
TREE = [("A", "1", ""), ("B", "2", "A"), ("C", "3", "")]
DEEP = [("A", "1", ""), ("B", "2", "A"), ("C", "3", "B"), ("D", "4", "")]

BOMS = {
    "commas": Bom("PN,Qty\nA,1\nB,2\n", AB),
    "semicolons": Bom("PN;Qty\nA;1\nB;2\n", AB),
    "tabs": Bom("PN\tQty\nA\t1\nB\t2\n", AB),
    "bars": Bom("PN|Qty\nA|1\nB|2\n", AB),
    "german": Bom("Teilenummer;Menge;Einheit\nA;1;Stk\nB;2;Stk\n", AB),
    "titles above": Bom("Bill of materials;\nof 3 May;\n\nPN;Qty\nA;1\nB;2\n", AB),
    "empty rows between": Bom("PN,Qty\nA,1\n,\n\nB,2\n", AB),
    "heading repeated": Bom("PN,Qty\nA,1\nPN,Qty\nB,2\n", AB),
    "cells missing at the end": Bom("PN,Qty,Notes,Unit\nA,1\nB,2,x\n", AB),
    "columns without headings, empty": Bom("PN,Qty,,\nA,1,,\nB,2,,\n", AB),
    "a column without a heading": Bom("PN,Qty,\nA,1,x\n", A, unused=["column 3, which has no heading"]),
    "columns that nothing reads": Bom(
        "PN,Qty,Overage,Substitutes,Colour\nA,1,5%,X,red\n", A, unused=["Overage", "Substitutes", "Colour"]
    ),
    "a type and a revision of others": Bom(
        "PN,Qty,Type,Revision\nA,1,Resistor,C\n", A, unused=["Type", "Revision"]
    ),
    "more cells than headings": Bom("PN,Qty\nA,1\nB,2,5,cut\n", refused="line 3: wanted 2 cells"),
    "a name with a comma": Bom(
        "Part number,Name,Find number,Quantity\nA,Plate, 100x50,10,3\n", refused="line 2: wanted 4 cells"
    ),
    "a decimal comma between commas": Bom("PN,Qty\nA,0,5\n", refused="line 2: wanted 2 cells"),
    "a quote that stays open": Bom('PN,Qty\nA,1\n"B,2\n', refused="quotes do not match"),
    "a web page": Bom("<html><table><tr><td>PN</td></tr></table></html>", refused="HTML or XML"),
    "nothing": Bom("", refused="empty"),
    "a table of something else": Bom("a,b\n1,2\n", refused="no header line"),
    "positions": Bom("Pos.;Artikelnummer;Menge\n1;A;1\n1.1;B;2\n2;C;3\n", TREE),
    "positions with commas": Bom("Pos.;Artikelnummer;Menge\n1;A;1\n1,1;B;2\n2;C;3\n", TREE),
    "positions with a point at the end": Bom("Pos.;PN;Menge\n1.;A;1\n1.1.;B;2\n2.;C;3\n", TREE),
    "items of a CAD program": Bom("Item,Quantity,Part number,Name\n1,1,A,a\n1.1,2,B,b\n2,3,C,c\n", TREE),
    "deep positions": Bom("Index,PN,Qty\n1,A,1\n1.1,B,2\n1.1.1,C,3\n2,D,4\n", DEEP),
    "positions as levels": Bom("Level,PN,Qty\n1,A,1\n1.1,B,2\n2,C,3\n", TREE),
    "levels": Bom("Level,PN,Qty\n1,A,1\n2,B,2\n1,C,3\n", TREE),
    "levels from 0": Bom("Level,PN,Qty\n0,A,1\n1,B,2\n0,C,3\n", TREE),
    "levels with zeros before them": Bom("BOM Level,PN,Qty\n01,A,1\n02,B,2\n01,C,3\n", TREE),
    "levels with a point before them": Bom("Level,PN,Qty\n.1,A,1\n..2,B,2\n.1,C,3\n", TREE),
    "levels as a spreadsheet writes them": Bom("Level,PN,Qty\n1.0,A,1\n2.0,B,2\n1.0,C,3\n", TREE),
    "levels as dots": Bom("Ebene;PN;Menge\n.;A;1\n..;B;2\n.;C;3\n", TREE),
    "german levels": Bom("Stufe;Teilenummer;Menge\n1;A;1\n2;B;2\n3;C;3\n1;D;4\n", DEEP),
    "numbers indented by spaces": Bom("PN,Qty\nA,1\n  B,2\nC,3\n", TREE),
    "one stray space": Bom("PN,Qty\nA,1\n B,2\n", AB),
    "a level that jumps": Bom(
        "Level,PN,Qty\n1,A,1\n3,B,2\n", [("A", "1", ""), ("B", "2", "A")], asks=["level 3"]
    ),
    "DNP 0": Bom('Reference,Qty,DNP,PN\n"R1,R2",2,0,A\nC1,1,1,B\n', [("A", "2", "")], out=["B"]),
    "DNP no": Bom("PN,Qty,DNP\nA,1,no\nB,2,yes\n", A, out=["B"]),
    "DNP False": Bom("PN,Qty,DNP\nA,1,False\nB,2,True\n", A, out=["B"]),
    "DNP nein": Bom("PN;Menge;DNP\nA;1;nein\nB;2;ja\n", A, out=["B"]),
    "DNP by its name": Bom("PN,Qty,DNP\nA,1,\nB,2,DNP\n", A, out=["B"]),
    "DNP with a mark": Bom("PN,Qty,DNP\nA,1,\nB,2,x\n", A, out=["B"]),
    "excluded": Bom("PN,Qty,Exclude from BOM\nA,1,\nB,2,Excluded from BOM\n", A, out=["B"]),
    "not fitted, in German": Bom("PN;Menge;Nicht bestückt\nA;1;0\nB;2;1\n", A, out=["B"]),
    "populate 0": Bom("PN,Qty,Populate\nA,1,1\nB,2,0\n", A, out=["B"]),
    "populate DNP": Bom("PN,Qty,Populate\nA,1,yes\nB,2,DNP\n", A, out=["B"]),
    "installed false": Bom("PN,Qty,Installed\nA,1,TRUE\nB,2,FALSE\n", A, out=["B"]),
    "bestückt nein": Bom("PN;Menge;Bestückt\nA;1;ja\nB;2;nein\n", A, out=["B"]),
    "populate empty": Bom("PN,Qty,Populate\nA,1,yes\nB,2,\n", AB, asks=["Populate: is empty"]),
    "DNP maybe": Bom("PN,Qty,DNP\nA,1,\nB,2,perhaps\n", AB, asks=["DNP: wanted yes or no"]),
    "a sum": Bom("PN;Menge\nA;1\nB;2\nSumme;3\n", AB, out=["Summe"]),
    "a total in another column": Bom("Name,PN,Qty\na,A,1\nTotal:,,1\n", A, out=[""]),
    "a part that is called Total": Bom("PN,Name,Qty\nA,Total,1\n", A),
    "1.250 among semicolons": Bom("PN;Qty\nA;1.250\n", [("A", None, "")], asks=["1250 or 1.25"]),
    "1,500 in quotes": Bom('PN,Qty\nA,"1,500"\n', [("A", None, "")], asks=["1500 or 1.5"]),
    "a column of decimal commas": Bom("PN;Qty\nA;0,5\nB;1.250\n", [("A", "0.5", ""), ("B", "1250", "")]),
    "a unit in the heading": Bom("PN;Menge [m]\nA;1,5\n", [("A", "1.5", "")], units=["m"]),
    "a unit in the cell": Bom(
        "PN;Menge\nA;1,5 m\nB;2 Stk\n", [("A", "1.5", ""), ("B", "2", "")], units=["m", ""]
    ),
    "two units": Bom("PN;Menge;Einheit\nA;1,5 m;kg\n", [("A", "1.5", "")], asks=["is in m"]),
    "units": Bom("PN,Qty,Units\nA,1,mm\n", A, units=["mm"]),
    "designators that disagree": Bom('PN,Ref,Qty\nA,"R1,R2",1\n', A, asks=["name 2"]),
    "two heading rows": Bom("Part,,Quantity\nNumber,Name,\nA,a,1\nB,b,2\n", AB),
    "units below the heading": Bom("PN,Name,Qty\n,,[m]\nA,a,1\n", A, units=["m"]),
    "two quantities that differ": Bom("PN,Qty,Quantity\nA,4,8\n", refused="both mean the quantity"),
    "two numbers of ours that differ": Bom(
        "PN,Part number,Qty\nA,B,1\n", refused="both mean the part number"
    ),
    "their number alone": Bom("SKU,Qty\nA,1\n", refused="no column 'Part number'"),
    "our number and theirs": Bom("IPN,Supplier,SKU,Qty\nA,W,77,1\n", A),
    "french": Bom("Repère;Référence;Désignation;Quantité\n1;A;a;1\n2;B;b;2\n", AB),
    "spanish": Bom("Número de pieza;Denominación;Cantidad\nA;a;1\nB;b;2\n", AB),
    "italian": Bom("Codice articolo;Denominazione;Quantità\nA;a;1\nB;b;2\n", AB),
    "japanese": Bom("部品番号,品名,数量\nA,a,1\nB,b,2\n", AB),
    "chinese": Bom("零件号,名称,数量\nA,a,1\nB,b,2\n", AB),
    "french positions": Bom("Repère;Référence;Quantité\n1;A;1\n1.1;B;2\n2;C;3\n", TREE),
    "german with a sum of the masses": Bom(
        "Pos;Teilenummer;Menge;Gewicht\n1;A;1;2,5\n2;B;2;1,5\n;Gesamtgewicht;;5,5\n",
        AB,
        out=["Gesamtgewicht"],
        unused=["Gewicht"],
    ),
    "a subtotal in the middle": Bom("PN,Qty\nA,1\nZwischensumme,1\nB,2\n", AB, out=["Zwischensumme"]),
    "do not populate": Bom("PN,Qty,Do Not Populate\nA,1,\nB,2,x\n", AB[:1], out=["B"]),
    "DNF with 1 and 0": Bom("PN,Qty,DNF\nA,1,0\nB,2,1\n", A, out=["B"]),
    "fitted, in Italian": Bom("PN;Qtà;Montato\nA;1;sì\nB;2;no\n", A, out=["B"]),
    "the word NP": Bom("PN,Qty,DNP\nA,1,\nB,2,NP\n", A, out=["B"]),
    "a space as the sign of thousands": Bom("PN;Qty\nA;1 250,5\n", [("A", "1250.5", "")]),
    "an apostrophe as the sign of thousands": Bom("PN;Qty\nA;1'250.5\n", [("A", "1250.5", "")]),
    "points and a comma": Bom("PN;Qty\nA;1.250,5\n", [("A", "1250.5", "")]),
    "commas and a point": Bom('PN,Qty\nA,"1,250.5"\n', [("A", "1250.5", "")]),
    "no quantity": Bom("PN,Qty\nA,1\nB,\n", [("A", "1", ""), ("B", None, "")], asks=["Quantity"]),
    "a negative quantity": Bom("PN,Qty\nA,-1\n", [("A", None, "")], asks=["above 0"]),
    "a quantity in words": Bom("PN,Qty\nA,two\n", [("A", None, "")], asks=["Quantity"]),
    "quotes within quotes": Bom('PN,Name,Qty\nA,"½"" hose",1\n', A),
    "a line break in a name": Bom('PN,Name,Qty\nA,"a\nb",1\nB,b,2\n', AB),
    "a column that says yes or no beside the name": Bom(
        "PN,Name,Component,Qty\nA,a,True,1\nB,b,False,2\n", AB, unused=["Component"]
    ),
}

PRICE_LISTS = {
    "plain": Prices("Part number,Supplier,Price\nA,W,0.12\n", [("A", "", "1: 0.12", "")]),
    "per 100 in the heading": Prices(
        "Part number,Supplier,Price per 100\nA,W,12.00\n", [("A", "", "1: 0.12", "")]
    ),
    "per 100 in brackets": Prices("PN,Supplier,Price (per 100)\nA,W,12\n", [("A", "", "1: 0.12", "")]),
    "pro 100 Stk": Prices("PN;Lieferant;Preis/100 Stk\nA;W;12,00\n", [("A", "", "1: 0.12", "")]),
    "Preiseinheit": Prices(
        "Artikelnummer;Lieferant;Preis;Preiseinheit\nA;W;12,00;100\n", [("A", "", "1: 0.12", "")]
    ),
    "Preiseinheit in words": Prices("PN;Lieferant;Preis;PE\nA;W;12,00;per 100\n", [("A", "", "1: 0.12", "")]),
    "Preiseinheit of a length": Prices(
        "PN;Lieferant;Preis;PE\nA;W;12,00;m\n", [("A", "", "1: 12", "")], asks=["Price basis"]
    ),
    "a price of a metre": Prices(
        "PN,Supplier,Price per m\nA,W,10\n", [("A", "", "1: 10", "")], asks=["price of 1 m"]
    ),
    "a price of a pack": Prices("PN,Supplier,Pack,Price per pack\nA,W,50,10\n", [("A", "", "1: 0.2", "")]),
    "a price of a pack of unknown size": Prices(
        "PN,Supplier,Price per pack\nA,W,10\n", [("A", "", "1: 10", "")], asks=["no pack size"]
    ),
    "a price for each quantity": Prices(
        "Part number;Supplier;Price 1;Price 100\nA;W;0,12;0,10\n", [("A", "", "1: 0.12, 100: 0.1", "")]
    ),
    "one price with a number": Prices(
        "PN,Supplier,Price 100\nA,W,12\n", [("A", "", "", "")], asks=["price of one from 100"]
    ),
    "a price from 100": Prices("PN;Lieferant;Preis ab 100\nA;W;4\n", [("A", "", "100: 4", "")]),
    "quantities below the prices": Prices(
        "PN,Supplier,Price,,\n,,1,10,100\nA,W,3,2,1\n", [("A", "", "1: 3, 10: 2, 100: 1", "")]
    ),
    "breaks in one cell": Prices(
        'PN;Supplier;Price\nA;W;"1: 0,12; 100: 0,10"\n', [("A", "", "1: 0.12, 100: 0.1", "")]
    ),
    "breaks without quotes": Prices(
        "PN;Supplier;Price\nA;W;1: 0,12; 100: 0,10\n", refused="line 2: wanted 3 cells"
    ),
    "a decimal comma between commas": Prices(
        "PN,Supplier,Price\nA,W,0,12\n", refused="line 2: wanted 3 cells"
    ),
    "a currency in the heading": Prices("PN,Supplier,Price (USD)\nA,W,1.5\n", [("A", "", "1: 1.5", "USD")]),
    "a currency in the cell": Prices("PN;Supplier;Price\nA;W;1,50 €\n", [("A", "", "1: 1.5", "EUR")]),
    "two currencies": Prices(
        "PN;Supplier;Price (USD);Currency\nA;W;1,50;EUR\n", [("A", "", "1: 1.5", "EUR")], asks=["EUR and USD"]
    ),
    "their number": Prices("IPN,Supplier,SKU,Price\nA,W,77,1.5\n", [("A", "77", "1: 1.5", "")]),
    "their number alone": Prices("SKU,Supplier,Price\nA,W,1\n", refused="no column 'Part number'"),
    "a maker's number": Prices("IPN,Supplier,MPN,Price\nA,W,M,1\n", [("A", "", "1: 1", "")], unused=["MPN"]),
    "our Artikelnummer and their Bestellnummer": Prices(
        "Artikelnummer;Lieferant;Bestellnummer;Preis\nA;W;77;1,5\n", [("A", "77", "1: 1.5", "")]
    ),
    "1.250 among semicolons": Prices(
        "PN;Supplier;Price\nA;W;1.250\n", [("A", "", "", "")], asks=["1250 or 1.25"]
    ),
    "a price of a box": Prices(
        "PN,Supplier,Price (per box)\nA,W,1\n", [("A", "", "1: 1", "")], asks=["no pack size"]
    ),
    "a price with an unknown word": Prices(
        "PN,Supplier,Price (old)\nA,W,1\n", [("A", "", "1: 1", "")], asks=["unknown word “old”"]
    ),
    "a sum": Prices("PN,Supplier,Price\nA,W,1\nTotal,,1\n", [("A", "", "1: 1", "")]),
    "a part that is called =SUM": Prices("PN,Supplier,Price\n=SUM,W,1\n", [("=SUM", "", "1: 1", "")]),
    "a row for each quantity": Prices(
        "IPN,Supplier,SKU,Quantity,Price\nA,W,7,1,3\nA,W,7,10,2\n",
        [("A", "7", "1: 3", ""), ("A", "7", "10: 2", "")],
    ),
    "one quantity beside a price": Prices(
        "IPN,Supplier,Quantity,Price\nA,W,100,3\n",
        [("A", "", "100: 3", "")],
        asks=["from which the price counts"],
    ),
    "one piece beside a price": Prices("IPN,Supplier,Quantity,Price\nA,W,1,3\n", [("A", "", "1: 3", "")]),
    "a price of a thousand": Prices("PN;Lieferant;Preis/1000 Stk\nA;W;12,00\n", [("A", "", "1: 0.012", "")]),
    "a dozen in words": Prices(
        "PN,Supplier,Price,Price basis\nA,W,12,dozen\n", [("A", "", "1: 12", "")], asks=["Price basis"]
    ),
    "french prices": Prices("Référence;Fournisseur;Prix\nA;W;1,50 €\n", [("A", "", "1: 1.5", "EUR")]),
    "a currency column": Prices("PN;Lieferant;Preis;Währung\nA;W;1,50;chf\n", [("A", "", "1: 1.5", "CHF")]),
    "a sum with a supplier": Prices("PN,Supplier,Price\nA,W,1\nSumme,,1\n", [("A", "", "1: 1", "")]),
}


def as_xlsx(text: str) -> bytes:
    """The same table as texts in a workbook."""
    mark = max(",;\t|", key=text.count)
    book = Workbook()
    for row in csv.reader(io.StringIO(text), delimiter=mark):
        book.active.append(row)
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def formats(text: str, refused: str) -> list[bytes]:
    """The table as CSV and, unless its trouble is one of CSV alone, as a workbook of texts."""
    plain = text.encode()
    decides_by_comma = text.count(",") > text.count(";") and any(c.isdigit() for c in text) and "." in text
    if "wanted" in refused or refused in ("quotes do not match", "HTML or XML", "empty") or decides_by_comma:
        return [plain, text.encode("utf-16")]
    return [plain, text.encode("utf-8-sig"), as_xlsx(text)]


@pytest.mark.parametrize("name", BOMS)
def test_a_bom_has_one_answer(name: str) -> None:
    """For an import and for masses."""
    case = BOMS[name]
    for data in formats(case.text, case.refused):
        if case.refused:
            with pytest.raises(InputError, match=case.refused):
                bom_rows(read_sheet(data, "file", BOM))
            continue
        read = bom_rows(read_sheet(data, "file", BOM))
        lines = [row for row in read.rows if not row.left_out]
        above = [lines[row.parent].texts["part_number"] if row.parent is not None else "" for row in lines]
        assert [
            (row.texts["part_number"], None if row.quantity is None else f"{row.quantity:f}", parent)
            for row, parent in zip(lines, above, strict=True)
        ] == list(case.lines)
        assert [row.texts.get("part_number", "") for row in read.rows if row.left_out] == list(case.out)
        asked = [
            *(problem for row in lines for problem in row.problems),
            *(row.doubt for row in lines if row.doubt),
        ]
        assert len(asked) == len(case.asks), asked
        assert all(part in said for part, said in zip(case.asks, asked, strict=True)), asked
        assert list(read.unused) == list(case.unused)
        if case.units:
            assert [row.texts.get(Heading.UNIT, "") for row in lines] == list(case.units)


@pytest.mark.parametrize("name", [name for name, case in BOMS.items() if not case.refused])
def test_masses_read_the_same_rows(name: str) -> None:
    """The same parts in the same tree; a part that is not fitted, and a sum, have no mass."""
    case = BOMS[name]
    for data in formats(case.text, case.refused):
        table = BOMParser().parse_bytes(data)
        found = [
            (row.part_number, table.rows[row.parent].part_number if row.parent is not None else "")
            for row in table.rows
        ]
        assert found == [(part, above) for part, _, above in case.lines]


@pytest.mark.parametrize(
    "name",
    [
        n
        for n, c in BOMS.items()
        if c.refused in ("quotes do not match", "HTML or XML", "empty") or "wanted" in c.refused
    ],
)
def test_masses_refuse_the_same_files(name: str) -> None:
    """What no reader can trust."""
    with pytest.raises(InputError, match=BOMS[name].refused):
        BOMParser().parse_bytes(BOMS[name].text.encode())


@pytest.mark.parametrize("name", PRICE_LISTS)
def test_a_price_list_has_one_answer(name: str) -> None:
    """The price is that of one piece, whatever the table's basis is."""
    case = PRICE_LISTS[name]
    for data in formats(case.text, case.refused):
        if case.refused:
            with pytest.raises(InputError, match=case.refused):
                price_rows(read_sheet(data, "file", PRICES))
            continue
        read = price_rows(read_sheet(data, "file", PRICES))
        lines = [row for row in read.rows if not row.left_out]
        assert [
            (
                row.texts["part_number"],
                row.texts.get("supplier_part_number", ""),
                ", ".join(f"{least:f}: {plain(price)}" for least, price in row.prices),
                row.texts.get("currency", ""),
            )
            for row in lines
        ] == list(case.lines)
        asked = [problem for row in lines for problem in row.problems]
        assert len(asked) == len(case.asks), asked
        assert all(part in said for part, said in zip(case.asks, asked, strict=True)), asked
        assert list(read.unused) == list(case.unused)


def plain(price: Decimal) -> str:
    """A price without zeros at its end."""
    return f"{price.normalize():f}"


GIVEN_ANSWERS = {
    "breaks_unquoted.csv": "line 2",
    "comma_name.csv": "line 2",
    "dnp01.csv": [("F01-0001", "2", "")],
    "per100.csv": [("F01-0001", "1: 0.12")],
    "preiseinheit.csv": [("F01-0001", "1: 0.12")],
    "price_columns.csv": [("F01-0001", "1: 0.12, 100: 0.1")],
    "structured.csv": [("A01-0002", "2", ""), ("F01-0001", "3", "A01-0002"), ("F01-0002", "1", "")],
}


@pytest.mark.parametrize("name", GIVEN_ANSWERS)
def test_the_given_tables(name: str) -> None:
    """The tables of the material, if it is there."""
    if not GIVEN.is_dir():
        pytest.skip("no material beside the checkout")
    data, wanted = (GIVEN / name).read_bytes(), GIVEN_ANSWERS[name]
    is_price_list = b"Supplier" in data or b"Lieferant" in data
    if isinstance(wanted, str):
        with pytest.raises(InputError, match=wanted):
            read_sheet(data, "file", PRICES if is_price_list else BOM)
    elif is_price_list:
        rows = price_rows(read_sheet(data, "file", PRICES)).rows
        assert [
            (row.texts["part_number"], ", ".join(f"{least:f}: {plain(price)}" for least, price in row.prices))
            for row in rows
        ] == wanted
    else:
        lines = [row for row in bom_rows(read_sheet(data, "file", BOM)).rows if not row.left_out]
        assert [
            (
                row.texts["part_number"],
                f"{row.quantity:f}",
                "" if row.parent is None else lines[row.parent].texts["part_number"],
            )
            for row in lines
        ] == wanted
