# SPDX-License-Identifier: LGPL-2.1-or-later
"""A designer's day in FreeCAD's window, with a real server: commit, pane, offline, preview."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest
from gui_cases.window import Window

from silo.api.wire import MergeEntry, MergeRequest

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@dataclass
class Told:
    """What the script inside told, and the server that it talked to."""

    window: Window
    said: dict[str, Any]

    def __getitem__(self, name: str) -> Any:
        return self.said[name]

    def number(self, name: str) -> str:
        return str(self.said["numbers"][name])


@pytest.fixture(name="day", scope="module")
def _day(freecad: Window) -> Told:
    freecad.answers["other merge"] = lambda: other_merge(freecad)
    return Told(freecad, freecad.run("story.py"))


def other_merge(freecad: Window) -> str:
    """Somebody else syncs the gearbox without its bolts."""
    with freecad.server.client() as client:
        (gearbox,) = (i for i in client.search_items("Gearbox") if i.item_type == "assembly")
        children = [line.child_part_number for line in client.get_bom(gearbox.part_number)]
        kept = [MergeEntry(child_part_number=child, quantity=1) for child in children[1:]]
        client.merge_bom(gearbox.part_number, MergeRequest(entries=kept))
        return gearbox.part_number


def test_the_dialog_lists_what_is_changed_leaves_first(day: Told) -> None:
    """Untouched documents are not in it; the asked one comes last. The other two do not use each other."""
    files = [row[0] for row in day["dialog"]]
    assert (sorted(files[:2]), files[2:]) == (["BasePlate.FCStd", "Gearbox.FCStd"], ["Top.FCStd"])
    assert {row[1] for row in day["dialog"]} == {"unsaved edits: will be saved"}


def test_all_of_them_are_saved(day: Told) -> None:
    """No mark of unsaved edits is left, and the person's document is still the active one."""
    assert day["still_modified"] == []
    assert day["active"] == "Top"


def test_the_files_arrive_in_order_with_the_comment(day: Told) -> None:
    """Children before parents."""
    with day.window.server.client() as client:
        firsts = {}
        for name in ("BasePlate", "Gearbox", "Top"):
            found = [
                r for r in client.revisions(day.number(name)) if r.file_name and r.comment == "wider plate"
            ]
            assert [r.file_name for r in found] == [f"{name}.FCStd"]
            firsts[name] = found[0].created_at
    assert max(firsts["BasePlate"], firsts["Gearbox"]) <= firsts["Top"]


def test_the_boms_are_those_of_the_edited_assemblies(day: Told) -> None:
    """Two single bolts beside a plate and two gearboxes; eight bolts in the gearbox. Cover has no number."""
    top, gearbox = day.number("Top"), day.number("Gearbox")
    boxes = [box for box in day["first"] if box.startswith("BOM Updated")]
    assert boxes[0].splitlines()[:2] == [f"BOM Updated: {top} Top", "+3 added"]
    assert boxes[1].splitlines()[:2] == [f"BOM Updated: {gearbox} Gearbox", "+1 added"]
    assert "1 component has no Silo part number [Register Parts…]" in boxes[0]


def test_the_same_again_posts_nothing(day: Told) -> None:
    """The box says so."""
    assert day["second"].splitlines() == [
        f"Committed: {day.number('Top')} Top",
        "BOM unchanged",
        "The file is in Silo already",
        "1 component has no Silo part number [Register Parts…]",
        "Cover",
        f"Open in {day.number('Gearbox')}: incomplete: 1 unregistered",
        "[View in Silo →]",
    ]


def test_each_file_below_is_the_same_in_silo(day: Told) -> None:
    """The look after the commit has a line for each."""
    _title, _top, *below = day["below"].splitlines()
    assert len(below) == 4
    assert all(line.endswith(": the same") for line in below)


def test_a_person_reads_it_in_the_dock(day: Told) -> None:
    """The spec's box: title, counts, and what has no number."""
    assert day["dock_visible"]
    texts = "\n".join(day["dock"])
    assert f"BOM Updated: {day.number('Top')} Top" in texts
    assert "+3 added" in texts
    assert "⚠ 1 component has no Silo part number" in texts
    assert "● Connected to 127.0.0.1" in texts


def test_a_page_is_opened_on_the_server_in_use_alone(day: Told) -> None:
    """What is no page of any server is at most a page of ours; without a browser the address is copied."""
    url = day.window.server.url
    assert not [page for page in day["elsewhere"] if not page.startswith(f"{url}/") or "example.org" in page]
    assert day["opened"] == day["copied"]
    assert day["opened"].startswith(f"{url}/items/")


def test_a_merge_of_somebody_else_is_heard(day: Told) -> None:
    """Live, with its counts."""
    assert day["heard"].splitlines()[:2] == [f"BOM Updated: {day['other']}", "⚠1 unreferenced"]


def test_offline_is_shown_and_nothing_is_lost(day: Told) -> None:
    """The banner says what happens to commits, the list what waits."""
    texts = "\n".join(day["offline"])
    assert "Commits wait here and are sent later." in texts
    assert "2 things wait to be sent" in texts
    assert day["waiting"] == ["BasePlate", "Top"]


def test_back_online_it_arrives(day: Told) -> None:
    """Once, in the order of the commits."""
    assert day["after"].splitlines()[:3] == [
        f"BOM Updated: {day.number('Top')} Top",
        "~1 qty changed",
        "Revision 2 uploaded: offline",
    ]
    assert day["connection"] == "online"
    with day.window.server.client() as client:
        lines = {ln.child_part_number: ln.quantity for ln in client.get_bom(day.number("Top"))}
    assert lines[day.number("Bolt")] == 1


def test_the_preview_shows_both_sides(day: Told) -> None:
    """What differs, level by level, what has no number, and what a sync does."""
    rows = {(row[0], row[2]): row for row in day["preview"]}
    changed = rows["0", "Gearbox"]
    assert changed[1:] == [
        f"~ {day.number('Gearbox')}",
        "Gearbox",
        "4",
        "2",
        "will take the assembly's quantity; its own BOM differs from Silo",
    ]
    assert rows["0", "BasePlate"][1:5] == [f"= {day.number('BasePlate')}", "BasePlate", "1", "1"]
    assert rows["1", "Bolt"][3:5] == ["8", "8"]
    assert next(row[:3] for row in day["preview"] if row[2] == "Cover") == ["1", "?", "Cover"]
    assert day["can_sync"]
    assert day["cut"] == []


def test_sync_from_the_preview(day: Told) -> None:
    """Afterwards both sides agree."""
    with day.window.server.client() as client:
        lines = {ln.child_part_number: ln.quantity for ln in client.get_bom(day.number("Top"))}
    assert lines[day.number("Gearbox")] == 4
    after = next(row for row in day["preview_after"] if row[0] == "0" and row[2] == "Gearbox")
    assert after[1] == f"= {day.number('Gearbox')}"


def test_show_selects_the_instances(day: Told) -> None:
    """The first row is the plate."""
    assert day["selected"] == ["Plate"]


@pytest.mark.parametrize("theme", ["light", "dark", "light again"])
def test_every_text_of_the_pane_can_be_read(day: Told, theme: str) -> None:
    """Titles, warnings, times and links; 4.5 is what WCAG asks of normal text (AA)."""
    contrasts = day[theme]
    assert {text: value for text, value in contrasts.items() if value < 4.5} == {}
    assert any(text.startswith("BOM Updated") for text in contrasts)
    assert "Register Parts…" in contrasts
