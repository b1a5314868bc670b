# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview of an assembly whose parts stand for more rows than there is memory."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest
from fcstd_writer import Doc, locals_, part

from silo.fcstd import Library
from silo.testing import FakeSilo
from silo.workbench.commit.plan import take
from silo.workbench.preview.flow import MOST_ROWS, Preview, PreviewRow, RowKind, ask, rows
from silo.workbench.session import Control

CONTROL = Control(lambda _detail, _fraction: None)


def assembly(folder: Path, silo: FakeSilo, name: str, *below: str) -> str:
    """An assembly of links to other files, registered."""
    item = silo.create_item("kindred-rd", "A01", name, item_type="assembly")
    links = [f"L{number}" for number in range(len(below))]
    doc = Doc(name, meta={"SiloUUID": item.id})
    doc.add("App::Part", "Assembly", Type="Assembly", Group=locals_(*links))
    for link, file in zip(links, below, strict=True):
        doc.link(link, f"{file}.FCStd", "Box" if file == "Leaf" else "Assembly")
    doc.save(folder / f"{name}.FCStd")
    return name


@pytest.fixture(name="silo")
def _silo() -> FakeSilo:
    return FakeSilo()


@pytest.fixture(name="folder")
def _folder(tmp_path: Path, silo: FakeSilo) -> Path:
    part("Leaf", uuid=silo.create_item("kindred-rd", "M01", "Leaf").id).save(tmp_path / "Leaf.FCStd")
    return tmp_path


def preview(folder: Path, silo: FakeSilo, name: str) -> Preview:
    return ask(take(Library().open(str(folder / f"{name}.FCStd"))), silo, CONTROL)


def flat(table: Iterable[PreviewRow]) -> list[PreviewRow]:
    return [row for top in table for row in (top, *flat(top.children))]


def test_levels_that_double_the_rows_end_with_a_remark(folder: Path, silo: FakeSilo) -> None:
    """Thirty levels of two assemblies that share the next level: a thousand million lines, and some rows."""
    below = "Leaf"
    for level in range(30):
        twins = [assembly(folder, silo, f"{side}{level}", below) for side in "AB"]
        below = assembly(folder, silo, f"Level{level}", *twins)
    table = flat(rows(preview(folder, silo, below)))
    assert 100 < len(table) < MOST_ROWS
    assert any(
        row.kind is RowKind.GROUP and row.name == "… more rows than can be shown here" for row in table
    )


def test_each_sub_assembly_gets_its_share(folder: Path, silo: FakeSilo) -> None:
    """One that is full of rows does not take the room of the next one; the assembly's own lines all stay."""
    wide = [assembly(folder, silo, f"Wide{number}", "Leaf") for number in range(40)]
    assembly(folder, silo, "Many", *wide)
    assembly(folder, silo, "Few", "Leaf")
    assembly(folder, silo, "Top", "Many", "Few")
    many, few = rows(preview(folder, silo, "Top"), most=60)
    assert [row.kind for row in many.children] == [RowKind.GROUP]
    assert [row.name for row in few.children] == ["Leaf"]
    assert len(rows(preview(folder, silo, "Many"), most=4)) == 40
