# SPDX-License-Identifier: LGPL-2.1-or-later
"""A machine builder's export comes in whole and comes out equal, cell by cell; again it changes nothing.

The export is made by the script of the material, which keeps what it wrote as JSON: that is the truth here.
"""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest
from server_testing import Api, sqlite_database

from silo.bom.items.part_address import part_segment
from silo_server.run import running_server

SCRIPT = Path(__file__).parents[2].parent / "shared" / "cases" / "tables" / "make_migration.py"
BOMS = 4
Rows = list[dict[str, str]]


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the company."""
    if not SCRIPT.is_file():
        pytest.skip("no material beside the checkout")
    folder = tmp_path_factory.mktemp("company")
    subprocess.run([sys.executable, SCRIPT], cwd=folder, check=True, capture_output=True)
    return folder / "mig"


@pytest.fixture(scope="module")
def truth(export: Path) -> dict[str, Any]:
    """What the script wrote into the files."""
    return dict(json.loads((export / "truth.json").read_text("utf-8")))


@pytest.fixture(scope="module")
def company(export: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Api]:
    """An empty server with the company's categories."""
    folder = tmp_path_factory.mktemp("silo")
    with (
        running_server(
            sqlite_database(folder / "silo.db"), token="silo_company", files_dir=folder
        ) as running,
        Api(running.base_url, "silo_company") as caller,
    ):
        caller.good("POST", "/api/categories/import", body=categories_of(export).encode())
        yield caller


def categories_of(export: Path) -> str:
    """The company's categories as a table: "Normteile/Schrauben" is Schrauben below Normteile."""
    with (export / "parts.csv").open(encoding="utf-8", newline="") as file:
        paths = sorted({row["Category"] for row in csv.DictReader(file)})
    tops = dict.fromkeys(path.partition("/")[0] for path in paths)
    rows = [f"T{number},{name},T{number}-,4," for number, name in enumerate(tops)]
    for number, path in enumerate(paths):
        top, _, name = path.partition("/")
        rows.append(f"K{number},{name},K{number}.,5,{top}")
    return "\n".join(["Code,Name,Prefix,Digits,Parent", *rows]) + "\n"


def table(data: bytes) -> Rows:
    """The rows of an export as another reader has them: without the mark that keeps formulas from running."""
    lines = data.decode("utf-8-sig")
    # What a reader must know first stands above the heading of a BOM.
    rows = csv.DictReader(io.StringIO(lines[lines.index("Item,") if "\nItem," in lines else 0 :], newline=""))
    marks = ("'=", "'+", "'-", "'@")
    return [
        {name: text[1:] if text.startswith(marks) else text for name, text in row.items()} for row in rows
    ]


@dataclass(frozen=True)
class PartsImport:
    """What the server said of the company's parts, and how they came out, before anything else came in."""

    checked: dict[str, Any]
    made: dict[str, int]
    again: list[dict[str, int]]
    exported: bytes


@pytest.fixture(scope="module")
def parts(company: Api, export: Path) -> PartsImport:
    """The company's 800 parts, which each test needs; the same from CSV and workbook."""
    data = (export / "parts.csv").read_bytes()
    where = "/api/items/import?duplicates=new"
    return PartsImport(
        company.good("POST", "/api/items/import?dry_run=1", body=data),
        company.good("POST", where, body=data)["counts"],
        [
            company.good("POST", where, body=(export / file).read_bytes())["counts"]
            for file in ("parts.csv", "parts.xlsx")
        ],
        company.call("GET", "/api/items/export.csv").body,
    )


def test_the_parts_come_out_as_they_came_in(parts: PartsImport, export: Path, truth: dict[str, Any]) -> None:
    """Each of 800 parts by its number, or by its name if it has none; again it changes nothing."""
    assert Counter(row["status"] for row in parts.checked["rows"]) == {"add": 798, "error": 2}
    assert all("more than once" in problem for problem in parts.checked["problems"])
    assert "In Stock" in parts.checked["unused_columns"]
    assert parts.made["add"] == 800
    assert parts.again == [{"add": 0, "change": 0, "same": 800, "skip": 0, "error": 0}] * 2
    categories = {
        row["Code"]: f"{row['Parent']}/{row['Name']}"
        for row in csv.DictReader(io.StringIO(categories_of(export)))
    }
    assert Counter(out(row, categories) for row in table(parts.exported)) == (
        Counter(into(part, truth["parts"]) for part in truth["parts"])
    )


def into(part: dict[str, Any], parts: list[dict[str, Any]]) -> tuple[str, ...]:
    """What a part of the file must be in Silo; its number is Silo's if it has none, or another's."""
    own = part["IPN"].strip()
    first = next(each for each in parts if each["IPN"].strip() == own)
    return (
        own if own and first is part else "",
        part["Name"],
        part["Description"],
        part["Category"],
        "assembly" if part["Assembly"] == "True" else "part",
        part["Units"],
        "purchased" if part["Purchaseable"] == "True" else "manufactured",
        part["Notes"],
        part["Link"],
    )


def out(row: dict[str, str], categories: dict[str, str]) -> tuple[str, ...]:
    """The same cells of an export. Numbers that Silo gave begin with the prefix of their category."""
    number, code = row["Part number"], row["Category"]
    given = number.startswith(f"{code}.")
    names = ("Name", "Description")
    rest = ("Item type", "Unit", "Sourcing", "Notes", "Link")
    return ("" if given else number, *(row[n] for n in names), categories[code], *(row[n] for n in rest))


@pytest.mark.usefixtures("parts")
def test_the_prices_come_out_as_they_came_in(company: Api, export: Path, truth: dict[str, Any]) -> None:
    """Each price of each supplier part; rows without a part number are left out by name, if that is said."""
    data = (export / "price_breaks.csv").read_bytes()
    refused = company.bad(400, "POST", "/api/suppliers/import", body=data)
    assert [problem.partition(": ")[2] for problem in refused["problems"]] == ["Part number: is empty"]
    where = "/api/suppliers/import?leave_out=1"
    first = Counter(item["status"] for item in company.good("POST", where, body=data)["items"])
    second = Counter(item["status"] for item in company.good("POST", where, body=data)["items"])
    assert (first["skip"], second) == (1, {"skip": 1, "same": first["change"]})
    wanted = {
        (
            s["IPN"].strip(),
            s["Supplier"],
            s["SKU"],
            Decimal(s["Pack"]),
            s["Currency"],
            s["Link"],
            q,
            Decimal(str(c)),
        )
        for s in truth["sup"]
        if s["IPN"].strip()
        for q, c in s["breaks"]
    }
    sent = company.call("GET", "/api/suppliers/export.csv").body
    found = {
        (
            *(row[name] for name in ("Part number", "Supplier", "Supplier's part number")),
            Decimal(row["Pack size"]),
            row["Currency"],
            row["Link"],
            int(row["From quantity"]),
            Decimal(row["Price"]),
        )
        for row in table(sent)
    }
    assert found == wanted
    back = company.good("POST", "/api/suppliers/import", body=sent)
    assert {item["status"] for item in back["items"]} == {"same"}


@pytest.mark.usefixtures("parts")
def test_the_boms_come_out_as_they_came_in(company: Api, export: Path, truth: dict[str, Any]) -> None:
    """Each fitted line, with quantity, designators and note; what is not fitted is left out by name."""
    numbers = {part["id"]: part["IPN"].strip() for part in truth["parts"]}
    names, own = {part["id"]: part["Name"] for part in truth["parts"]}, set(numbers.values())
    for index, (product, lines) in enumerate([*truth["boms"].items()][:BOMS]):
        data = (export / f"bom_{index:02d}.csv").read_bytes()
        where = f"/api/items/{part_segment(product)}/bom"
        done = company.good("POST", f"{where}/import?quantities=1&add_up=1", body=data)
        fitted = [line for line in lines if not line["dnp"]]
        assert [row["why"] for row in done["rows"] if row["status"] == "skip"] == [
            "not fitted: DNP is 'DNP'" for line in lines if line["dnp"]
        ]
        assert {"Overage", "Substitutes", "Optional"} <= set(done["unused_columns"])
        again = company.good("POST", f"{where}/import?quantities=1&add_up=1", body=data)
        assert (again["counts"]["add"], again["counts"]["change"]) == (0, 0)
        rows = table(company.call("GET", f"{where}/export.csv").body)
        found = Counter(
            (row["Part number" if row["Part number"] in own else "Name"], Decimal(row["Quantity"]))
            for row in rows
        )
        assert found == Counter(
            (numbers[line["part"]] or names[line["part"]], Decimal(line["qty"])) for line in fitted
        )
        assert Counter(row["Notes"] for row in rows) == Counter(line["note"] for line in fitted)


def test_one_undo_takes_an_import_back(company: Api) -> None:
    """Parts, prices and a BOM, each as a whole; then the same file comes in again."""
    parts = b"Part number,Name,Unit\nU/1,one,m\nU#2,two,pcs\n"
    made = company.good("POST", "/api/items/import", body=parts)["import"]
    prices = b"Part number,Supplier,Price\nU/1,W,2\nU#2,W,3\n"
    priced = company.good("POST", "/api/suppliers/import", body=prices)["import"]
    levels = b"Level,Part number,Qty,Name\n1,U#2,2,two\n2,U/1,4,one\n1,U-3,1,three\n"
    company.good("POST", "/api/items", {"part_number": "U-top", "name": "top"})
    lines = company.good("POST", "/api/items/U-top/bom/import?make=K0", body=levels)["import"]
    assert "U#2 is in the BOM of U-top" in company.bad(409, "POST", f"/api/imports/{made}/undo")["message"]
    company.good("POST", f"/api/imports/{lines}/undo")
    assert (company.get("/api/items/U-top/bom"), company.get("/api/items/U%232/bom")) == ([], [])
    company.bad(404, "GET", "/api/items/U-3")
    company.bad(409, "POST", f"/api/imports/{lines}/undo")
    changed = company.good("POST", "/api/items/import", body=b"Part number,Name,Unit\nU/1,uno,mm\n")["import"]
    company.good("POST", f"/api/imports/{changed}/undo")
    assert company.get("/api/items/U%2F1")["name"] == "one"
    assert company.get("/api/items/U%2F1")["unit"] == "m"
    company.good("POST", f"/api/imports/{priced}/undo")
    assert company.get("/api/items/U%2F1/suppliers")["supplier_parts"] == []
    company.good("POST", f"/api/imports/{made}/undo")
    company.bad(404, "GET", "/api/items/U%2F1")
    again = company.good("POST", "/api/items/import", body=parts)
    assert {row["status"] for row in again["rows"]} == {"change"}
    assert company.get("/api/items/U%2F1")["name"] == "one"
