# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview of an assembly whose parts stand for more rows than there is memory."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from silo.bom.entry import BomEntry, Extraction
from silo.testing import FakeSilo
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.preview.comparison import ask
from silo.workbench.preview.rows import MOST_ROWS, PreviewRow, RowKind, rows
from silo.workbench.session.worker import Control


@pytest.fixture(name="silo")
def _silo() -> FakeSilo:
    return FakeSilo()


def component(silo: FakeSilo, name: str, *below: BomEntry) -> BomEntry:
    """A registered part, or the assembly of these components."""
    kind, category = ("assembly", "A01") if below else ("part", "M01")
    item = silo.create_item("kindred-rd", category, name, item_type=kind)
    return BomEntry(f"/v/{name}.FCStd", item.id, label=name, is_assembly=bool(below), children=below)


def table_of(silo: FakeSilo, top: BomEntry, most: int = MOST_ROWS) -> tuple[PreviewRow, ...]:
    snapshot = Snapshot(top.doc_path, top.label, top.silo_uuid, Extraction(top, top.children))
    return rows(ask(snapshot, silo, Control(lambda _detail, _fraction: None)), most)


def flat(table: Iterable[PreviewRow]) -> list[PreviewRow]:
    return [row for top in table for row in (top, *flat(top.children))]


def test_levels_that_double_the_rows_end_with_a_remark(silo: FakeSilo) -> None:
    """Thirty levels of two assemblies that share the next level: a thousand million lines, and some rows."""
    below = component(silo, "Leaf")
    for level in range(30):
        below = component(silo, f"Level{level}", *(component(silo, f"{side}{level}", below) for side in "AB"))
    table = flat(table_of(silo, below))
    assert 100 < len(table) < MOST_ROWS
    assert any(
        row.kind is RowKind.GROUP and row.name == "… more rows than can be shown here" for row in table
    )


def test_each_sub_assembly_gets_its_share(silo: FakeSilo) -> None:
    """One that is full of rows does not take the room of the next one; the assembly's own lines all stay."""
    leaf = component(silo, "Leaf")
    wide = component(silo, "Many", *(component(silo, f"Wide{number}", leaf) for number in range(40)))
    many, few = table_of(silo, component(silo, "Top", wide, component(silo, "Few", leaf)), most=60)
    assert [row.kind for row in many.children] == [RowKind.GROUP]
    assert [row.name for row in few.children] == ["Leaf"]
    assert len(table_of(silo, wide, most=4)) == 40
