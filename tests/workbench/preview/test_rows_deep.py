# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview of an assembly whose parts stand for more rows than there is memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import pytest

from silo.bom.entry import BomEntry, Extraction
from silo.bom.findings import Finding, FindingCode, HiddenStanding, Place, Severity
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


def test_what_is_hidden_is_a_sentence_with_a_row_for_each_object(silo: FakeSilo) -> None:
    """Each can be answered, and the sentence stands for the bodies that do not count."""
    top = component(silo, "Top", component(silo, "Plate"))
    where = tuple(
        Place("/v/Top.FCStd", name, f"my {name}", standing.value)
        for name, standing in (
            ("L", HiddenStanding.COUNTS),
            ("B", HiddenStanding.NOT_COUNTED),
            ("R", HiddenStanding.REFERENCE),
        )
    )
    finding = Finding(FindingCode.HIDDEN, Severity.WARNING, "Hidden in Top: …", where)
    own = BomEntry("/v/Top.FCStd", object_name="Body001", label="Body001", document_label="Top", quantity=2)
    snapshot = Snapshot(
        top.doc_path,
        top.label,
        top.silo_uuid,
        Extraction(replace(top, own=(own,)), top.children, (finding,)),
    )
    table = rows(ask(snapshot, silo, Control(lambda _detail, _fraction: None)))
    (sentence,) = [row for row in flat(table) if row.kind is RowKind.HIDDEN_PIECES]
    assert (sentence.objects, sentence.document) == (("B",), "/v/Top.FCStd")
    assert [(row.kind, row.name, row.objects) for row in sentence.children] == [
        (RowKind.HIDDEN, f"my {name}", (name,)) for name in "LBR"
    ]
    assert [row.note for row in sentence.children] == [
        "hidden, counts",
        "hidden, does not count",
        "hidden, only a reference: does not count",
    ]
    (mine,) = [row for row in flat(table) if row.kind is RowKind.OWN]
    assert (mine.name, mine.cad, mine.document) == ("Top: Body001", "2", "/v/Top.FCStd")
