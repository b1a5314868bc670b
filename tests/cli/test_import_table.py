# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod import``: parts, a BOM with levels and prices by three commands, each checked first."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from silo.bom.errors import Exit

PARTS = "IPN,Name,Category,In Stock\nI-TOP,Conveyor,A01,1\nI-SUB,Frame,A01,2\nI-1,Plate,M01,3\n"
BOM = "Level,Part number,Qty,DNP\n1,I-SUB,2,\n2,I-1,4,no\n1,I-1,1,\n1,I-2,1,yes\n"
PRICES = "IPN;Lieferant;SKU;Preis;Preiseinheit\nI-1;Würth;0815;12,00;100\nSumme;;;12,00;\n"


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    made = {}
    for name, text in (("parts", PARTS), ("bom", BOM), ("prices", PRICES)):
        made[name] = tmp_path / f"{name}.csv"
        made[name].write_text(text, "utf-8")
    return made


def test_three_commands_bring_a_company(run: Any, silo: Any, files: dict[str, Path]) -> None:
    """A check writes nothing; what is left out makes the code 1, and is named."""
    checked = run("import", "parts", files["parts"], "--check")
    assert (checked.code, "3 added" in checked.out, "Nothing was written" in checked.out) == (0, True, True)
    assert "columns that are not used: In Stock" in checked.err
    assert run("import", "parts", files["parts"], "--json").json()["counts"]["add"] == 3
    again = run("import", "parts", files["parts"], "--json").json()
    assert again["counts"] == {"add": 0, "change": 0, "same": 3, "skip": 0, "error": 0}
    done = run("import", "bom", files["bom"], "--product", "I-TOP", "--json")
    assert done.code == Exit.UNDONE
    assert [row["status"] for row in done.json()["rows"]] == ["add", "add", "add", "skip"]
    prices = run("import", "prices", files["prices"])
    assert (prices.code, "1 changed" in prices.out, "1 left out" in prices.out) == (Exit.UNDONE, True, True)
    shown = run("order", "I-TOP", "--json").json()
    assert [row["supplier_part"]["prices"] for row in shown["parts"] if row["supplier_part"]] == [
        [{"quantity": "1", "price": "0.12"}]
    ]


def test_options_of_another_kind_are_refused(run: Any, files: dict[str, Path]) -> None:
    """An option that does nothing would promise something."""
    for words in (("bom",), ("parts", "--product", "A"), ("parts", "--remove"), ("prices", "--make", "F01")):
        kind, *rest = words
        assert run("import", kind, files[kind], *rest).code == Exit.BAD_INPUT


@pytest.mark.usefixtures("silo")
def test_an_import_is_taken_back_and_categories_come_in(
    run: Any, files: dict[str, Path], tmp_path: Path
) -> None:
    """The command that the import names works; its JSON and that of categories have the published shape."""
    number = run("import", "parts", files["parts"], "--json").json()["import"]
    undone = run("import", "parts", "--undo", str(number), "--json")
    assert (undone.code, undone.json()["import"]) == (0, number)
    done = run("import", "parts", files["parts"])
    command = re.search(r"silo-mod (import parts --undo \d+)", done.out)
    assert command is not None
    assert "is undone" in run(*command[1].split()).out
    table = tmp_path / "categories.csv"
    table.write_text("Code,Name\nZ01,Cables\n", "utf-8")
    checked = run("import", "categories", table, "--check", "--json")
    assert [row["status"] for row in checked.json()["rows"]] == ["add"]
