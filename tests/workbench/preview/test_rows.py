# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview's rows: the same as those of ``silo-mod diff``, on the example assembly and a real server."""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from gearbox_story import GearboxStory
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo.api.wire import MergeEntry, MergeRequest
from silo.bom.entry import BomEntry, Extraction
from silo.bom_sync.resolved import resolve
from silo.bom_sync.steps import sync
from silo.cli.main import main
from silo.cli.reading import read_assembly
from silo.registering.closed_files import proposals_for, register_all
from silo.testing import FakeSilo
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.preview.comparison import Preview, ask, to_sync
from silo.workbench.preview.rows import PreviewRow, RowKind, rows, summary
from silo.workbench.session.worker import Control
from silo_server.run import running_server

CONTROL = Control(lambda _detail, _fraction: None)
# Of these two one stays without a part number, the other one is new to the server's BOM.
UNREGISTERED, NEW = "MotorMount", "Cover"


@pytest.fixture(name="story", scope="module")
def _story(tmp_path_factory: pytest.TempPathFactory) -> Iterator[GearboxStory]:
    """Every kind of difference at once, in the top assembly and below it; no test changes it."""
    with a_story(tmp_path_factory.mktemp("preview")) as story:
        yield story


@contextmanager
def a_story(folder: Path) -> Iterator[GearboxStory]:
    token = "silo_" + uuid.uuid4().hex
    with (
        pytest.MonkeyPatch.context() as patch,
        running_server(sqlite_database(folder / "silo.db"), token=token) as server,
        SiloClient(server.base_url, token) as client,
    ):
        for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"):
            patch.setenv(name, str(folder / "home"))
        patch.setenv("SILO_API_URL", server.base_url)
        patch.setenv("SILO_API_TOKEN", token)
        story = GearboxStory(folder, client)
        register_but(story, UNREGISTERED)
        story.sync()
        people_work(story)
        story.more_bolts(2)
        yield story


def register_but(story: GearboxStory, left_out: str) -> None:
    extraction = read_assembly(str(story.top))
    proposals = [
        proposal
        for proposal in proposals_for(extraction, story.client, "kindred-rd")
        if Path(proposal.entry.doc_path).stem != left_out
    ]
    for done in register_all(proposals, story.client, schema="kindred-rd"):
        assert done.error is None


def people_work(story: GearboxStory) -> None:
    client, top, gearbox = story.client, story.number_of("TopAssembly"), story.number_of("Gearbox")
    oil = client.create_item("kindred-rd", "C01", "Gear oil", item_type="consumable")
    plug = client.create_item("kindred-rd", "F01", "Drain plug")
    client.add_bom_line(top, oil.part_number, quantity=0.4, unit="l")
    client.update_bom_line(top, story.number_of("BasePlate"), quantity=3)
    for parent, left_out, more in (
        (top, story.number_of(NEW), plug.part_number),
        (gearbox, story.number_of("Gear"), plug.part_number),
    ):
        for line in client.get_bom(parent):
            if line.child_part_number == left_out:
                client.remove_bom_line(parent, left_out)
        kept = [
            MergeEntry(child_part_number=line.child_part_number, quantity=line.quantity)
            for line in client.get_bom(parent)
            if line.source != "manual"
        ]
        entries = [*kept, MergeEntry(child_part_number=more, quantity=1)]
        client.merge_bom(parent, MergeRequest(entries=entries))


def preview_of(story: GearboxStory, extraction: Extraction | None = None) -> Preview:
    found = extraction or read_assembly(str(story.top))
    head = found.assembly
    return ask(Snapshot(str(story.top), head.label, head.silo_uuid, found), story.client, CONTROL)


@pytest.fixture(name="preview", scope="module")
def _preview(story: GearboxStory) -> Preview:
    return preview_of(story)


@pytest.fixture(name="diff")
def _diff(story: GearboxStory, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["diff", "--recursive", "--json", str(story.top)]) == 0
    data = json.loads(capsys.readouterr().out)
    assert isinstance(data, dict)
    return data


def lines(table: Iterable[PreviewRow]) -> set[tuple[str, str, str, str]]:
    """(kind, part number, CAD's quantity, Silo's)."""
    told = (RowKind.GROUP, RowKind.NOT_COUNTED, RowKind.UNREGISTERED)
    return {(row.kind.value, row.number, row.cad, row.silo) for row in table if row.kind not in told}


def lines_of_diff(diff: dict[str, Any]) -> set[tuple[str, str, str, str]]:
    def q(value: float) -> str:
        return f"{value:g}"

    found = {("added", d["part_number"], q(d["quantity"]), "") for d in diff["added"]}
    found |= {("unchanged", d["part_number"], q(d["quantity"]), q(d["quantity"])) for d in diff["unchanged"]}
    found |= {("unreferenced", d["part_number"], "", q(d["quantity"])) for d in diff["removed"]}
    for kind, key in (("changed", "quantity_changed"), ("conflict", "conflicts")):
        found |= {
            (kind, d["part_number"], q(d["local_quantity"]), q(d["remote_quantity"])) for d in diff[key]
        }
    # A line in conflict stands in the table once, with both quantities.
    conflicts = {d["part_number"] for d in diff["conflicts"]}
    return found | {
        ("manual", d["part_number"], "", q(d["quantity"]))
        for d in diff["manual"]
        if d["part_number"] not in conflicts
    }


def below(table: Iterable[PreviewRow], number: str) -> tuple[PreviewRow, ...]:
    return next(row.children for row in table if row.number == number)


def test_each_assembly_has_the_lines_of_the_diff(
    story: GearboxStory, preview: Preview, diff: dict[str, Any]
) -> None:
    """Added, changed, unchanged, unreferenced, manual and in conflict, at the top and in the sub-assembly."""
    table = rows(preview)
    by_number = {one["part_number"]: lines_of_diff(one["diff"]) for one in diff["assemblies"]}
    top, gearbox = story.number_of("TopAssembly"), story.number_of("Gearbox")
    assert lines(table) == by_number[top]
    assert lines(below(table, gearbox)) == by_number[gearbox]
    kinds = {kind for kind, *_ in lines(table)}
    assert kinds == {"added", "changed", "unchanged", "unreferenced", "manual", "conflict"}


def test_what_is_not_counted_has_the_reason_of_the_diff(preview: Preview, diff: dict[str, Any]) -> None:
    """Every finding of the walk, in the same words; unregistered components are rows of their own."""
    groups = [row for row in rows(preview) if row.kind is RowKind.GROUP]
    told = {child.note for row in groups for child in row.children if child.kind is RowKind.NOT_COUNTED}
    elsewhere = ("unregistered", "unreferenced", "conflict")
    assert told == {f["message"] for f in diff["findings"] if f["code"] not in elsewhere}
    assert any("construction geometry, which is not a part: not counted" in text for text in told)
    unregistered = [
        child.name for row in groups for child in row.children if child.kind is RowKind.UNREGISTERED
    ]
    assert unregistered == ["Motor Mount"]
    assert [f["code"] for f in diff["findings"]].count("unregistered") == 1


def test_the_summary_counts_the_same(preview: Preview) -> None:
    """One line over the table."""
    assert summary(preview) == (
        "1 to add, 1 with another quantity, 1 unreferenced, 1 in conflict, 1 without a part number; "
        "1 sub-assembly differs from Silo"
    )


def test_a_sub_assembly_whose_own_bom_is_not_in_silo_is_named(tmp_path: Path) -> None:
    """The lines of the assembly agree: that is not all that a person wants to know."""
    silo = FakeSilo()
    uuids = {
        name: silo.create_item("kindred-rd", "A01", name, item_type="part", properties={}).id
        for name in ("Top", "Arm", "Leg", "Pin")
    }

    def entry(name: str, *children: BomEntry) -> BomEntry:
        path = str(tmp_path / f"{name}.FCStd")
        return BomEntry(path, uuids[name], object_name="A", is_assembly=bool(children), children=children)

    top = replace(entry("Top"), is_assembly=True)
    below = (entry("Arm", entry("Pin")), entry("Leg", entry("Pin")))

    def look() -> Preview:
        return ask(Snapshot(top.doc_path, "Top", top.silo_uuid, Extraction(top, below)), silo, CONTROL)

    sync(resolve(Extraction(top, below), silo), silo, sync_id="one")
    assert summary(look()) == "2 lines agree; 2 sub-assemblies are not in Silo yet"
    assert {row.note for row in rows(look())} == {"its own BOM is not in Silo yet"}
    sync(resolve(Extraction(below[0], below[0].children), silo), silo, sync_id="two")
    assert summary(look()) == "2 lines agree; 1 sub-assembly is not in Silo yet"
    sync(resolve(Extraction(below[1], below[1].children), silo), silo, sync_id="three")
    assert summary(look()) == "Nothing to sync: all 2 lines agree with Silo."
    assert {row.note for row in rows(look())} == {""}


def test_variants_are_named_in_the_line_that_counts_them(tmp_path: Path) -> None:
    """Without a number of their own they are pieces of their original; with one they are a line."""
    silo = FakeSilo()
    top, profile, own = (
        silo.create_item("kindred-rd", "A01", name, item_type="part", properties={}).id
        for name in ("Top", "Profile", "Long")
    )
    head = BomEntry(str(tmp_path / "top.FCStd"), top, object_name="A", is_assembly=True)
    plain = BomEntry(str(tmp_path / "profile.FCStd"), profile, object_name="Body")
    copy = replace(plain, variant="L = 300 mm", quantity=5)
    longer = replace(plain, silo_uuid=own, variant="L = 900 mm", is_own_item=True)
    found = Extraction(head, (plain, copy, longer))
    table = rows(ask(Snapshot(head.doc_path, "Top", top, found), silo, CONTROL))
    assert [(row.name, row.cad) for row in table] == [("Profile", "6"), ("Long, L = 900 mm", "1")]
    assert "with variants: L = 300 mm" in table[0].note


def test_a_sync_with_its_sub_assemblies_sends_those_that_differ_first(
    story: GearboxStory, preview: Preview
) -> None:
    """The gearbox differs too; without the wish the top assembly only."""
    assert preview.to_send_below == 1
    paths = [Path(taken.path).name for taken in to_sync(preview, below=True)]
    assert paths == ["Gearbox.FCStd", "TopAssembly.FCStd"]
    assert [Path(t.path).name for t in to_sync(preview, below=False)] == ["TopAssembly.FCStd"]


def test_an_unregistered_sub_assembly_can_be_opened_too(story: GearboxStory) -> None:
    """Its own lines are below it, as the diff lists them."""
    found = read_assembly(str(story.top))
    entries = tuple(replace(e, silo_uuid=None) if e.is_assembly else e for e in found.entries)
    table = rows(preview_of(story, replace(found, entries=entries)))
    (group,) = (row for row in table if row.kind is RowKind.GROUP and row.name.startswith("Without"))
    gearbox = next(row for row in group.children if row.name.startswith("Gearbox"))
    assert {row.name for row in gearbox.children} == {"Housing", "Shaft", "Gear"}


def test_a_missing_component_is_a_row_of_its_own_kind(tmp_path: Path) -> None:
    """With its quantity and where it should be; the line that the server knows it by stays."""
    silo = FakeSilo()
    uuids = {}
    for name in ("Top", "Lid", "Pin"):
        uuids[name] = silo.create_item("kindred-rd", "M01", name, item_type="part", properties={}).id
    top = BomEntry(str(tmp_path / "top.FCStd"), uuids["Top"], object_name="Assembly", is_assembly=True)
    known = [
        BomEntry(str(tmp_path / f"{name}.FCStd"), uuids[name], quantity=2, object_name="Body")
        for name in ("Lid", "Pin")
    ]
    sync(resolve(Extraction(top, tuple(known)), silo), silo, sync_id="one")
    lost = replace(known[0], silo_uuid=None, missing=True, label="Lid")
    preview = ask(
        Snapshot(top.doc_path, "top", top.silo_uuid, Extraction(top, (lost, known[1]))), silo, CONTROL
    )
    kinds = {(row.kind, row.name, row.cad, row.silo) for row in rows(preview)}
    assert (RowKind.MISSING, "Lid", "2", "") in kinds
    assert (RowKind.MISSING, "Lid", "", "2") in kinds
    assert (RowKind.UNCHANGED, "Pin", "2", "2") in kinds
    assert next(row.note for row in rows(preview)) == "missing: Lid.FCStd#Body"
    assert summary(preview) == "1 missing"


def test_what_a_sync_would_not_send_is_not_offered_below(tmp_path: Path) -> None:
    """The sync's own decision: the server knows already that a line of the gearbox is unreferenced."""
    with a_story(tmp_path) as story:
        story.sync()
        preview = preview_of(story)
    (gearbox,) = preview.compared[:-1]
    assert gearbox.diff.removed
    assert preview.to_send_below == 0
    assert [Path(taken.path).name for taken in to_sync(preview, below=True)] == ["TopAssembly.FCStd"]
