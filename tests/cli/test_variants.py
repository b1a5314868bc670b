# SPDX-License-Identifier: LGPL-2.1-or-later
"""Configured copies on the command line: a column of values, a number of their own, and the sync of both."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from fcstd_writer import Doc, Raw, XLink, locals_

from silo.fcstd import open_document


def length(value: float) -> Raw:
    return Raw("App::PropertyLength", f'<Float value="{value}"/>')


@pytest.fixture
def frame(tmp_path: Path) -> Path:
    """A profile as it is, two of 300 mm, and one of 400 mm."""
    Doc(label="profile").add("Part::Box", "Profile", L=length(100)).save(tmp_path / "profile.FCStd")
    top, source = Doc(label="frame"), XLink("profile.FCStd", "Profile")
    top.link("Plain", "profile.FCStd", "Profile")
    names = ["Plain"]
    for number, value in enumerate((300, 300, 400)):
        top.add("Part::Box", f"Copy{number}", L=length(value), Visibility=False)
        top.link(f"Link{number}", "", f"Copy{number}", LinkCopyOnChangeSource=source, L=length(value))
        names.append(f"Link{number}")
    top.add("App::Part", "Frame", Group=locals_(*names), Type="Assembly")
    return top.save(tmp_path / "frame.FCStd")


def test_values_have_a_column_in_each_output(run: Any, frame: Path, tmp_path: Path) -> None:
    rows = run("bom", frame, "--flat", "--json").json()
    right = {("", 1), ("L = 300 mm", 2), ("L = 400 mm", 1)}
    assert {(row.get("variant", ""), row["quantity"]) for row in rows} == right
    assert {row["name"] for row in rows} == {"Profile"}
    whole = run("bom", frame, "--json").json()["entries"]
    assert {(row.get("variant", ""), row["quantity"]) for row in whole} == right
    assert run("bom", frame, "--csv", tmp_path / "b.csv").code == 0
    with open(tmp_path / "b.csv", encoding="utf-8-sig", newline="") as file:
        table = list(csv.DictReader(file))
    assert {(row["values"], int(row["quantity"])) for row in table} == right
    assert run("bom", frame, "--flat", "--xlsx", tmp_path / "b.xlsx").code == 0
    heading, *cells = openpyxl.load_workbook(tmp_path / "b.xlsx").active.iter_rows(values_only=True)
    places = heading.index("values"), heading.index("quantity")
    assert {(row[places[0]] or "", row[places[1]]) for row in cells} == right
    for shown in (run("bom", frame).out, run("bom", frame, "--flat").out):
        assert "Profile, L = 300 mm" in shown


def test_a_variant_counts_as_its_original_until_it_has_a_number(run: Any, silo: Any, frame: Path) -> None:
    done = run("register", frame, "--yes")
    assert "2 × Profile, L = 300 mm (Link0" in done.out
    lines = run("bom", frame, "--resolve", "--json").json()
    assert [line["quantity"] for line in lines["entries"]] == [4]
    shown = run("bom", frame, "--resolve").out
    assert "counted under the number of Profile until it has one" in shown
    assert "with variants: L = 300 mm; L = 400 mm" in shown

    assert run("register", frame, "--yes", "--declare", "Link1").code == 0
    lines = run("bom", frame, "--resolve", "--json").json()["entries"]
    assert {(line.get("variant", ""), line["quantity"], line["name"]) for line in lines} == {
        ("", 2, "Profile"),
        ("L = 300 mm", 2, "Profile, L = 300 mm"),
    }
    assert len({line["part_number"] for line in lines}) == 2
    assert run("sync", frame).code == 0
    kept = silo.client.get_bom(run("bom", frame, "--resolve", "--json").json()["assembly"]["part_number"])
    assert sorted(line.quantity for line in kept) == [2, 2]


def test_the_number_of_a_variant_lies_on_each_of_its_links(run: Any, silo: Any, frame: Path) -> None:
    """The original keeps its own; taken back, the links are as before."""
    run("register", frame, "--yes")
    profile = (frame.parent / "profile.FCStd").read_bytes()
    assert run("register", frame, "--yes", "--declare", "Link0").code == 0
    assert (frame.parent / "profile.FCStd").read_bytes() == profile
    marked = [obj.Name for obj in open_document(frame).Objects if "SiloItemId" in obj.PropertiesList]
    assert marked == ["Link0", "Link1", "Frame"]
    again = run("register", frame, "--yes", "--declare", "Link0")
    assert (again.code, "component already" in again.err) == (2, True)
    assert run("register", frame, "--undeclare", "Link0", "--yes").code == 0
    marked = [obj.Name for obj in open_document(frame).Objects if "SiloItemId" in obj.PropertiesList]
    assert marked == ["Frame"]


def test_a_variant_is_a_part_and_cannot_be_called_none(run: Any, silo: Any, frame: Path) -> None:
    refused = run("register", frame, "--not-a-part", "Link0")
    assert (refused.code, "Link0" in refused.err) == (2, True)
