# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands as a user runs them, on the example and a real embedded server."""

from __future__ import annotations

import csv
import os
import shlex
import shutil
import zipfile
from decimal import Decimal
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from fcstd_writer import Doc, locals_
from running_freecad import opened

from silo.api.client import SiloClient
from silo.bom.commands_in_text import commands_in
from silo.bom.errors import BusyError
from silo.cli.setup.demo_edits import remove_from_assembly, set_element_count

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def counts(rows: list[dict[str, Any]]) -> dict[str, int]:
    return {row["object"]: row["quantity"] for row in rows}


def test_bom_prints_the_json_that_is_documented(run: Any, gearbox: Path) -> None:
    """Relative paths with /, quantities per one parent, levels by nesting."""
    ran = run("bom", gearbox, "--json")
    assert ran.code == 0
    data = ran.json()
    assert data["assembly"]["doc_path"] == "TopAssembly.FCStd"
    assert counts(data["entries"]) == {
        "BasePlate": 1,
        "Gearbox": 2,
        "Cover": 1,
        "M8x20Bolt": 12,
        "MotorMount": 1,
    }
    gear = next(e for e in data["entries"] if e["object"] == "Gearbox")
    assert counts(gear["children"]) == {"Housing": 1, "Gear": 4, "Shaft": 1}
    assert {child["level"] for child in gear["children"]} == {2}
    assert gear["children"][0]["doc_path"].startswith("parts/")


def test_flat_multiplies_down_the_tree(run: Any, gearbox: Path) -> None:
    """Two gearboxes with four gears each are eight gears; sub-assemblies are listed too."""
    flat = run("bom", gearbox, "--flat", "--json").json()
    assert counts(flat) == {
        "BasePlate": 1,
        "Gearbox": 2,
        "Housing": 2,
        "Gear": 8,
        "Shaft": 2,
        "Cover": 1,
        "M8x20Bolt": 12,
        "MotorMount": 1,
    }


@pytest.mark.parametrize("flat", [(), ("--flat",)])
def test_the_bom_as_a_spreadsheet(run: Any, gearbox: Path, tmp_path: Path, flat: tuple[str, ...]) -> None:
    """CSV and workbook hold the lines of --json; what a spreadsheet would run is text."""
    (gearbox.parent / "parts" / "Cover.FCStd").unlink()
    paths = tmp_path / "bom.csv", tmp_path / "bom.xlsx"
    assert run("bom", gearbox, *flat, "--csv", paths[0], "--xlsx", paths[1]).code == 1
    with paths[0].open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    sheet = openpyxl.load_workbook(paths[1]).active
    cells = [["" if cell is None else str(cell) for cell in row] for row in sheet.iter_rows(values_only=True)]
    assert cells == [list(rows[0]), *(list(row.values()) for row in rows)]
    told = run("bom", gearbox, *flat, "--json").json()
    if not flat:
        assert [row["level"] for row in rows if row["object"] == "Gear"] == ["2"]
        told = [one for entry in told["entries"] for one in (entry, *entry["children"])]
    assert [(row["object"], row["quantity"]) for row in rows] == [
        (one["object"], str(one["quantity"])) for one in told
    ]
    assert [row["object"] for row in rows if row["missing"]] == ["Cover"]
    assert run("bom", gearbox, *flat, "--csv", "-").out.splitlines()[0] == ",".join(rows[0])
    assert run("bom", gearbox.parent, "--csv", "-").code == 2


def test_the_consolidation_warning_has_the_words_of_the_spec(run: Any, gearbox: Path) -> None:
    """With the count of individual links; the array beside them does not count as one."""
    findings = run("bom", gearbox, "--json").json()["findings"]
    [message] = [f["message"] for f in findings if f["code"] == "consolidation"]
    assert message == (
        "[Silo BOM] M8x20 Bolt has 8 individual links. "
        "Consider using a link array (ElementCount) for cleaner assembly management."
    )
    assert "individual links" not in run("bom", gearbox).out, "a hint is for who asks for it"
    assert run("bom", gearbox, "--verbose").out.count("individual links") == 1


@pytest.mark.usefixtures("registered")
def test_the_whole_story(run: Any, silo: Any, gearbox: Path) -> None:
    """Sync, sync again, edit, sync: each step as the spec's merge table says."""
    first = run("sync", gearbox, "--recursive", "--json").json()["results"][0]
    assert [a["status"] for a in first["assemblies"]] == ["merged", "merged"]
    top = first["assemblies"][-1]["part_number"]
    assert len(first["assemblies"][-1]["diff"]["added"]) == 5

    again = run("sync", gearbox, "--recursive", "--json")
    assert again.code == 0
    assert [a["status"] for a in again.json()["results"][0]["assemblies"]] == ["unchanged", "unchanged"]
    assert run("diff", gearbox, "--check").code == 0

    remove_from_assembly(gearbox, "Cover")
    set_element_count(gearbox, "CoverBolts", added=4)
    glue = silo.client.create_item("kindred-rd", "C01", "Thread locker", item_type="consumable")
    silo.client.add_bom_line(top, glue.part_number, quantity=1)
    assert run("diff", gearbox, "--check").code == 1
    third = run("sync", gearbox, "--json").json()["results"][0]["assemblies"][0]
    assert [c["local_quantity"] for c in third["diff"]["quantity_changed"]] == [16]
    assert len(third["diff"]["removed"]) == 1
    [manual] = third["diff"]["manual"]
    assert (manual["part_number"], manual["quantity"]) == (glue.part_number, 1)
    lines = {line.child_part_number: line for line in silo.client.get_bom(top)}
    assert len(lines) == 6, "nothing is ever deleted"
    assert lines[glue.part_number].source == "manual"
    assert sum(line.unreferenced_since is not None for line in lines.values()) == 1


def test_a_mistake_in_the_sites_rules_is_said(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the line; the parts are registered anyway."""
    rules = tmp_path / "rules.toml"
    rules.write_text('[[rules]]\nwords = ["bolt"]\ncategory = "Z99"\n')
    monkeypatch.setenv("SILO_CATEGORY_RULES", str(rules))
    ran = run("register", gearbox, "--yes", "--json")
    assert "not used until they are mended: SILO_CATEGORY_RULES (rules.toml): line 1: " in ran.err
    assert len(ran.json()["registered"]) == 9
    rules.write_text('[[rules]]\nwords = ["bolt"]\ncategory = "F02"\n')
    assert run("register", gearbox, "--yes").err == ""


@pytest.mark.usefixtures("needs_locks")
def test_register_leaves_alone_what_freecad_has_open(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Saving there would undo it. Nothing is made on the server for it, and the others are registered."""
    monkeypatch.setenv("FREECAD_USER_TEMP", str(tmp_path / "cache"))
    before = gearbox.read_bytes()
    with opened(tmp_path / "cache", gearbox):
        ran = run("register", gearbox, "--yes", "--json")
        assert ran.code == 1
        assert len(ran.json()["registered"]) == 8
        (failed,) = ran.json()["failed"]
        assert failed["doc_path"] == gearbox.name
        assert "open in FreeCAD" in failed["error"]["message"]
        assert "--even-if-open" in failed["error"]["message"]
        assert gearbox.read_bytes() == before
        assert len(silo.client.search_items()) == 8
        ran = run("register", gearbox, "--yes", "--json", "--even-if-open")
        assert (ran.code, len(ran.json()["registered"])) == (0, 1)


@pytest.mark.usefixtures("synced")
def test_a_missing_file_never_reads_as_removed(run: Any, silo: Any, gearbox: Path) -> None:
    """The BOM is blocked, says what is missing and who uses it, and is synced on consent only."""
    os.remove(gearbox.parent / "parts" / "Cover.FCStd")
    ran = run("sync", gearbox, "--json")
    assert ran.code == 1
    [result] = ran.json()["results"]
    [outcome] = result["assemblies"]
    assert outcome["status"] == "blocked"
    [cause] = outcome["blocked_by"]
    assert cause["code"] == "missing_file"
    assert "parts/Cover.FCStd" in cause["message"]
    assert cause["where"] == [{"file": "TopAssembly.FCStd", "object": "Cover"}]
    allowed = run("sync", gearbox, "--allow-missing", "--json").json()["results"][0]["assemblies"][0]
    assert allowed["status"] == "merged"
    assert allowed["diff"]["removed"] == []
    [kept] = allowed["diff"]["kept"]
    number = outcome["part_number"]
    line = next(one for one in silo.client.get_bom(number) if one.child_part_number == kept["part_number"])
    assert (line.quantity, line.unreferenced_since) == (1, None)
    last = silo.client.get_item(number).last_sync
    assert [(one.reason, one.file) for one in last.left_out] == [("missing", "parts/Cover.FCStd")]
    again = run("sync", gearbox, "--allow-missing", "--json").json()["results"][0]["assemblies"][0]
    assert again["status"] == "unchanged"


@pytest.mark.usefixtures("synced")
@pytest.mark.parametrize("folder", [False, True], ids=["file", "folder"])
def test_sync_names_the_moved_file_by_the_identity_that_the_server_knows(
    run: Any, silo: Any, gearbox: Path, folder: bool
) -> None:
    """Renamed and moved, while an old copy without identity has the old name."""
    cover = gearbox.parent / "parts" / "Cover.FCStd"
    (gearbox.parent / "old").mkdir()
    shutil.copy(EXAMPLES / "gearbox" / "parts" / "Cover.FCStd", gearbox.parent / "old")
    (gearbox.parent / "stock").mkdir()
    cover.rename(gearbox.parent / "stock" / "Lid.FCStd")
    local = run("bom", gearbox, "--json").json()["findings"]
    assert [one["did_you_mean"] for one in local if one["code"] == "missing_file"] == ["old/Cover.FCStd"]
    ran = run("sync", gearbox.parent if folder else gearbox, "--json")
    assert ran.code == 1
    [cause] = [
        cause
        for result in ran.json()["results"]
        for outcome in result["assemblies"]
        for cause in outcome.get("blocked_by", ())
    ]
    assert "stock/Lid.FCStd (it carries the Silo identity)?" in cause["message"]
    assert run("relink", gearbox, "--from", "parts/Cover.FCStd", "--to", "stock/Lid.FCStd").code == 0
    # Nothing changes in the BOM, and the server hears where the component lies now: if it is missing again,
    # its line must not read as removed.
    for status in ("merged", "unchanged"):
        again = run("sync", gearbox, "--json").json()["results"][0]["assemblies"][0]
        assert (again["status"], again["diff"]["removed"]) == (status, [])
    os.remove(gearbox.parent / "stock" / "Lid.FCStd")
    allowed = run("sync", gearbox, "--allow-missing", "--json").json()["results"][0]["assemblies"][0]
    assert (len(allowed["diff"]["kept"]), allowed["diff"]["removed"]) == (1, [])


@pytest.mark.usefixtures("synced")
def test_a_component_that_is_back_makes_the_bom_complete_again(run: Any, silo: Any, gearbox: Path) -> None:
    """The lines agree, so nothing is to be merged; the server must hear anyway."""
    cover = gearbox.parent / "parts" / "Cover.FCStd"
    away = cover.rename(gearbox.parent / "away.FCStd")
    run("sync", gearbox, "--allow-missing")
    away.rename(cover)
    back = run("sync", gearbox, "--json").json()["results"][0]["assemblies"][0]
    assert back["status"] == "merged"
    assert silo.client.get_item(back["part_number"]).last_sync.left_out == []
    assert run("sync", gearbox, "--json").json()["results"][0]["assemblies"][0]["status"] == "unchanged"


def test_labels_cannot_steer_the_terminal(run: Any, gearbox: Path) -> None:
    """Control characters of a hostile document are shown as a replacement, markup as text."""
    with zipfile.ZipFile(gearbox) as archive:
        entries = {info.filename: archive.read(info) for info in archive.infolist()}
    xml = entries["Document.xml"].decode()
    assert "Layout reference" in xml
    entries["Document.xml"] = xml.replace("Layout reference", "[red]&#x9b;31m&lt;b&gt;").encode()
    with zipfile.ZipFile(gearbox, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    ran = run("bom", gearbox)
    assert ran.code == 0
    assert "\x9b" not in ran.out
    assert "[red]" in ran.out


def test_a_missing_file_is_a_line_and_exit_code_1(run: Any, gearbox: Path) -> None:
    """In the tree, the table, the JSON and the flat list, with its quantity; and the BOM is not in order."""
    assert run("bom", gearbox).code == 0
    os.remove(gearbox.parent / "parts" / "Gear.FCStd")
    shown = run("bom", gearbox)
    assert shown.code == 1
    assert "4 × " in next(line for line in shown.out.splitlines() if "parts/Gear.FCStd#" in line)
    assert "missing" in shown.out
    ran = run("bom", gearbox, "--json")
    assert ran.code == 1
    box = next(entry for entry in ran.json()["entries"] if entry["object"] == "Gearbox")
    gear = next(entry for entry in box["children"] if entry["object"] == "Gear")
    assert (gear["missing"], gear["quantity"], gear["doc_path"]) == (True, 4, "parts/Gear.FCStd")
    assert next(f for f in ran.json()["findings"] if f["code"] == "missing_file")["file"] == gear["doc_path"]
    flat = run("bom", gearbox, "--flat", "--json")
    assert flat.code == 1
    [lost] = [row for row in flat.json() if row["missing"]]
    assert (lost["doc_path"], lost["quantity"], lost["unit"]) == ("parts/Gear.FCStd", 8, "pcs")
    table = run("bom", gearbox, "--flat")
    assert table.code == 1
    row = next(line for line in table.out.splitlines() if "parts/Gear.FCStd" in line)
    assert "8" in row
    assert row.rstrip().endswith("missing")


def test_resolve_shows_what_has_no_number_on_every_level(run: Any, silo: Any, gearbox: Path) -> None:
    """A component of a sub-assembly is not lost because nobody registered it yet."""
    plain = run("bom", gearbox, "--json").json()["entries"]
    resolved = run("bom", gearbox, "--resolve", "--json").json()["entries"]
    assert {e["object"]: (e["quantity"], counts(e["children"])) for e in plain} == {
        e["object"]: (e["quantity"], counts(e["children"])) for e in resolved
    }


@pytest.mark.usefixtures("synced")
def test_resolve_shows_what_the_server_says_of_the_product(
    run: Any, silo: Any, gearbox: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is open on all levels, mass and cost with what they lack; nothing from a server without it."""
    top = run("bom", gearbox, "--resolve", "--json").json()
    number, part = top["assembly"]["part_number"], top["entries"][0]["part_number"]
    silo.client.update_item(part, properties={"mass_kg": 2, "standard_cost": 3})
    kept = run("bom", gearbox, "--resolve", "--json").json()["silo"]
    assert kept["part_number"] == number
    assert kept["mass_missing"]["count"] == kept["parts"] - 1
    assert kept["totals"][0]["currency"] == "EUR"
    said = run("bom", gearbox, "--resolve").out
    assert f"In Silo, {number}:\n" in said
    assert f"{kept['total_mass_kg']:g} kg for 1 of {kept['parts']} parts" in said
    for one, words in (*kept["open"].items(), *kept["incomplete"].items()):
        assert one in said
        assert words in said

    def busy(*_: Any) -> None:
        raise BusyError("it is summed up now")

    monkeypatch.setattr(SiloClient, "get_summary", busy)
    ran = run("bom", gearbox, "--resolve")
    assert "In Silo" not in ran.out
    assert "it is summed up now" in ran.err
    monkeypatch.setattr(SiloClient, "get_summary", lambda *_: None)
    assert "silo" not in run("bom", gearbox, "--resolve", "--json").json()


@pytest.mark.usefixtures("synced")
def test_the_order_list_is_that_of_the_server(run: Any, silo: Any, gearbox: Path, tmp_path: Path) -> None:
    """For so many pieces with spares, as text, JSON, CSV and a workbook, also for one supplier."""
    number = run("bom", gearbox, "--resolve", "--json").json()["assembly"]["part_number"]
    one = {row["part_number"]: int(row["total"]) for row in run("order", number, "--json").json()["parts"]}
    bought, other = list(one.items())[:2]
    terms = {"supplier": "Misumi", "standard_cost": 0.5, "lead_time_days": 9}
    silo.client.update_item(bought[0], properties=terms)
    silo.client.update_item(other[0], properties={"supplier": "Norelem"})
    words = ("order", number, "--quantity", 100, "--spares", 10)
    told = run(*words, "--json").json()
    rows = {row["part_number"]: row for row in told["parts"]}
    assert rows.keys() == one.keys()
    assert (told["pieces"], told["spares"], told["lead_time_days"], told["unpriced"]) == (
        100,
        "10",
        9,
        len(one) - 1,
    )
    assert rows[bought[0]]["needed"] == str(110 * bought[1])
    cost = Decimal(rows[bought[0]]["cost"])
    assert (Decimal(told["total_cost"]), told["costs"]) == (cost, {"EUR": told["total_cost"]})
    assert cost == 55 * bought[1]
    text = run(*words).out
    assert "This is the draft, not a released revision" in text
    assert (
        f"Cost: {told['total_cost']} EUR, not known for {told['unpriced']} parts\nLongest lead time: 9 days"
        in text
    )
    ran = run(*words, "--csv", "-", "--supplier", "Misumi")
    table = list(csv.reader(ran.out.splitlines()))
    head = next(row for row in table if "Part number" in row)
    column = head.index("Part number")
    assert [row[column] for row in table[table.index(head) + 1 :]] == [bought[0]]
    for end in ("csv", "xlsx"):
        path = tmp_path / f"order.{end}"
        assert run(*words, f"--{end}", path, "--kind", "unsaid").code == 0
        assert path.stat().st_size > 100
    for wrong, code, why in (
        (("order", "X99-9999"), 2, "there is no item"),
        (("order", number, "--supplier", "Misumi"), 2, "does nothing without --csv or --xlsx"),
        (("order", number, "--release", "B"), 2, "B"),
        (("order", number, "--spares", "many"), 2, "spares"),
    ):
        ran = run(*wrong)
        assert (ran.code, why in ran.err) == (code, True), ran.err


@pytest.mark.usefixtures("needs_locks")
def test_relink_leaves_alone_what_freecad_has_open(
    run: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Saving there would undo it; the message says how else."""
    monkeypatch.setenv("FREECAD_USER_TEMP", str(tmp_path / "cache"))
    (gearbox.parent / "hardware").mkdir()
    (gearbox.parent / "parts" / "Gear.FCStd").rename(gearbox.parent / "hardware" / "Gear.FCStd")
    order = ("relink", gearbox, "--from", "parts/Gear.FCStd", "--to", "hardware/Gear.FCStd")
    (holder,) = run(*order, "--dry-run", "--json").json()["files"]
    with opened(tmp_path / "cache", gearbox.parent / holder["file"]):
        refused = run(*order)
        assert refused.code == 2
        assert "open in FreeCAD" in refused.err
        assert "--even-if-open" in refused.err
        assert run(*order, "--even-if-open").code == 0


def test_a_moved_file_is_suggested_and_relinked(run: Any, gearbox: Path) -> None:
    """The finding names the file and the command; the command mends every file of the tree."""
    (gearbox.parent / "hardware").mkdir()
    moved = (gearbox.parent / "parts" / "Gear.FCStd").rename(gearbox.parent / "hardware" / "Gear.FCStd")
    before = counts(run("bom", gearbox, "--flat", "--json").json())
    finding = next(f for f in run("bom", gearbox, "--json").json()["findings"] if f["code"] == "missing_file")
    assert finding["did_you_mean"] == "hardware/Gear.FCStd"
    order = ("relink", gearbox, "--from", "parts/Gear.FCStd", "--to", "hardware/Gear.FCStd")
    lost = gearbox.parent / order[3]
    (command,) = commands_in(finding["message"])
    inner = gearbox.with_name("Gearbox.FCStd")
    assert shlex.split(command)[1:] == ["relink", str(inner), "--from", str(lost), "--to", str(moved)]
    dry = run(*order, "--dry-run", "--json")
    assert dry.code == 0
    assert run("bom", gearbox).code == 1, "a dry run changes nothing"
    done = run(*order, "--json")
    assert {**done.json(), "dry_run": True} == dry.json()
    assert [Path(one["file"]).name for one in done.json()["files"]] == ["Gearbox.FCStd"]
    assert run("bom", gearbox).code == 0
    assert counts(run("bom", gearbox, "--flat", "--json").json()) == before
    again = run(*order)
    assert again.code == 2
    assert "nothing to mend" in again.err
    assert moved.exists()


def test_where_used_answers_without_a_server(run: Any, gearbox: Path) -> None:
    """The files that link to it, and the tops above them; also of a file that is gone."""
    bolt = next(path for path in (gearbox.parent / "parts").iterdir() if "Gear" in path.name)
    ran = run("where-used", bolt, "--root", gearbox.parent, "--json")
    assert ran.code == 0
    assert ran.json()["tops"] == ["TopAssembly.FCStd"]
    before = ran.json()
    assert run("where-used", bolt, "--root", gearbox.parent, "--json", "--no-cache").json() == before
    bolt.unlink()
    assert run("where-used", bolt, "--root", gearbox.parent, "--json").json() == before
    assert "No file" in run("where-used", gearbox, "--root", gearbox.parent).out
    assert run("where-used", bolt, "--root", gearbox.parent / "nowhere").code == 2


@pytest.mark.usefixtures("synced")
def test_bom_and_diff_take_folders(run: Any, silo: Any, gearbox: Path) -> None:
    """Each assembly with its own lines; the check says whether anything of the folder differs."""
    found = run("bom", gearbox.parent, "--json").json()
    assert [Path(one["assembly"]["doc_path"]).name for one in found["assemblies"]] == [
        "Gearbox.FCStd",
        "TopAssembly.FCStd",
    ]
    assert run("diff", gearbox.parent, "--check").code == 0
    set_element_count(gearbox, "CoverBolts", added=4)
    ran = run("diff", gearbox.parent, "--check", "--json")
    assert (ran.code, ran.json()["drift"]) == (1, True)
    (gearbox.parent / "broken.FCStd").write_bytes(b"no document")
    assert run("bom", gearbox.parent, "--json").code == 1


def test_bom_says_why_a_line_counts_so_many(run: Any, gearbox: Path) -> None:
    """Each chain of links and arrays; a name that means nothing is refused."""
    ran = run("bom", gearbox, "--why", "M8x20 Bolt")
    assert ran.code == 0
    assert ran.out.startswith("12 × M8x20 Bolt in ")
    assert "CoverBolts × 4" in ran.out
    assert run("bom", gearbox, "--why", "M8x2O Bolt").code == 2


def test_own_parts_are_lines_and_the_exit_code_says_so(run: Any, tmp_path: Path) -> None:
    """Links to bodies of the same file are no empty BOM with exit code 0."""
    doc = Doc("top").add("PartDesign::Body", "Wheel", Group=locals_())
    doc.link("L", "", "Wheel", ElementCount=4).add("Assembly::AssemblyObject", "Top", Group=locals_("L"))
    path = doc.save(tmp_path / "top.FCStd")
    ran = run("bom", path)
    assert ran.code == 1
    assert "4 × Wheel  top.FCStd#Wheel  not an item yet" in ran.out
    assert [one["quantity"] for one in run("bom", path, "--json").json()["own"]] == [4]
