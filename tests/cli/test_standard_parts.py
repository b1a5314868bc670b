# SPDX-License-Identifier: LGPL-2.1-or-later
"""Standard parts of a real project: registered in one press; no file takes their identity."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from public_projects import ASSEMBLIES

from silo.bom.walk.standard import standard_uuid
from silo.fcstd import open_document

PROJECT = ASSEMBLIES / "asm4-examples"
SCREW = "ISO 4762 M6×20"


@pytest.fixture
def engine(tmp_path: Path) -> Path:
    """A copy of a project whose screws lie in the assembly's own files."""
    if not PROJECT.is_dir():
        pytest.skip(f"the public assemblies are not there ({PROJECT})")
    shutil.copytree(PROJECT / "Asm4_Example2", tmp_path / "engine", copy_function=shutil.copyfile)
    for path in (tmp_path / "engine").rglob("*"):
        path.chmod(0o755 if path.is_dir() else 0o644)
    (tmp_path / "engine").chmod(0o755)
    return tmp_path / "engine" / "asm_V4.FCStd"


def test_one_press_registers_the_screws(run: Any, silo: Any, engine: Path) -> None:
    """Under the identity that their designation gives; the files keep theirs; every row has a number."""
    done = run("register", engine, "--yes", "--json")
    assert done.code == 0, done.out
    rows = {row["standard"]: row for row in done.json()["registered"] if row["standard"]}
    assert set(rows) == {SCREW}
    item = silo.client.get_item(rows[SCREW]["part_number"])
    assert (item.id, item.description) == (standard_uuid(SCREW), SCREW)
    for file in engine.parent.rglob("*.[Ff][Cc][Ss]td"):
        assert standard_uuid(SCREW) not in open_document(file).Meta.values(), file
    flat = run("bom", engine, "--flat", "--resolve", "--json").json()
    (screws,) = [row for row in flat if row["standard"]]
    assert (screws["part_number"], screws["name"]) == (item.part_number, SCREW)
    assert all(row["part_number"] for row in flat)
    assert run("sync", engine, "--recursive").code == 0
    again = run("register", engine, "--yes", "--json").json()
    assert {key: again[key] for key in ("registered", "failed", "unregistered")} == {
        "registered": [],
        "failed": [],
        "unregistered": [],
    }
    # Sizes come with a commit, from a child with the geometry kernel.
    pytest.importorskip("OCP")
    assert run("commit", engine, "--json").json()["undrawn"] == []
    found = {one.name: one for one in silo.client.search_items()}
    assert found["Piston"].properties["size_m"] == [0.09, 0.09, 0.1]
    assert found["Piston"].origins["size_m"].source == "cad"
    # Its file holds FreeCAD's icon only, which shows no part.
    assert silo.client.thumbnail(found["Piston"].part_number) is None


def test_a_table_with_standard_parts_can_be_applied_twice(
    run: Any, silo: Any, engine: Path, tmp_path: Path
) -> None:
    """They have a row by their designation, which is their name; the second time there is nothing to do."""
    table = tmp_path / "plan.csv"
    assert run("register", engine, "--plan", table).code == 0
    text = table.read_text("utf-8-sig")
    assert f",{SCREW},{SCREW},bought,,,part," in text
    table.write_text(text.replace(f",{SCREW},{SCREW},", f",{SCREW},A screw,"), "utf-8")
    refused = run("register", engine, "--apply", table)
    assert (refused.code, "called by its designation" in refused.err) == (2, True)
    table.write_text(text, "utf-8")
    assert run("register", engine, "--apply", table).code == 0
    count = len(silo.client.search_items())
    again = run("register", engine, "--apply", table)
    assert (again.code, f"{count} of the table's components" in again.out) == (0, True)
