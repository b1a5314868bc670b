# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project goes into Silo whole and comes out whole: ``commit``, ``status`` and ``pull``."""

from __future__ import annotations

import json
import os
import shutil
import zipfile
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from fcstd_writer import Doc, Raw, locals_, part
from server_testing import Api, sqlite_database

from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
from silo.outbox.store import Store
from silo.project_folder import PROJECT_FILE, FileRecord, Project
from silo_server.run import running_server


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """An assembly in a folder of its own, a part, a file of two parts, a spreadsheet, a backup."""
    root = tmp_path / "robot"
    for folder in ("asm", "parts"):
        (root / folder).mkdir(parents=True)
    part("Arm", "Box", Label="Arm").save(root / "parts" / "Arm.FCStd")
    own = '<Uuid value="5b4cb85d-6224-4a3f-bde2-ab5c5ce51866"/>'  # what the writer gives is one for all
    both = Doc(label="Both", extra={"Uid": Raw("App::PropertyUUID", own)})
    both.add("PartDesign::Body", "Left", Label="Left")
    both.add("PartDesign::Body", "Right", Label="Right")
    both.save(root / "parts" / "Both.FCStd")
    sheet = Doc(label="Master")
    sheet.add("Spreadsheet::Sheet", "Sheet")
    sheet.save(root / "Master.FCStd")
    top = Doc(label="Top").link("L1", "../parts/Arm.FCStd", "Box").link("L2", "../parts/Both.FCStd", "Left")
    top.link("L3", "../parts/Both.FCStd", "Right").link("S", "../Master.FCStd", "Sheet")
    top.add(
        "Assembly::AssemblyObject", "Asm", Label="Robot", Group=locals_("L1", "L2", "L3"), Type="Assembly"
    )
    top.save(root / "asm" / "Top.FCStd")
    shutil.copy(root / "asm" / "Top.FCStd", root / "asm" / "Top.20260101.FCBak")
    return root


def contents(root: Path) -> dict[str, bytes]:
    """The FreeCAD files below a folder."""
    found = (Path(folder, name) for folder, _, names in os.walk(root) for name in names)
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in found if p.suffix.lower() == ".fcstd"}


def bom(path: Path, root: Path) -> Any:
    """The BOM of a file, with paths as seen from the project."""
    with Library() as library:
        found = extract(choose_assembly(library.open(path)))
    entries = [
        (os.path.relpath(e.doc_path, root), e.object_name, e.quantity, e.missing) for e in found.entries
    ]
    return sorted(entries), sorted((f.code, f.severity) for f in found.findings)


@pytest.fixture
def registered(robot: Path, silo: Any, run: Any) -> Path:
    assert run("register", robot / "asm" / "Top.FCStd", "--yes").code == 0
    return robot


def states(ran: Any) -> dict[str, str]:
    return {one["path"]: one["state"] for one in ran.json()["files"]}


def test_a_project_comes_back_as_it_was(registered: Path, silo: Any, run: Any, tmp_path: Path) -> None:
    """Each file in its place with its bytes, also those of several items and of none; the same BOM."""
    top = registered / "asm" / "Top.FCStd"
    ran = run("commit", top, "--root", registered, "--comment", "first", "--json")
    assert ran.code == 0, ran.out + ran.err
    assert set(states(ran).values()) == {"new"}
    assert (ran.json()["models"], ran.json()["undrawn"]) == (4, [])
    assert "asm/Top.20260101.FCBak" not in states(ran)
    number = next(one["part_number"] for one in ran.json()["sent"] if one["path"] == "asm/Top.FCStd")
    pulled = run("pull", number, "--into", tmp_path / "back")
    assert pulled.code == 0, pulled.out
    assert contents(tmp_path / "back") == contents(registered)
    back = tmp_path / "back"
    assert bom(back / "asm" / "Top.FCStd", back) == bom(top, registered)
    assert {line.quantity for line in silo.client.get_bom(number)} == {1}
    assert len(silo.client.get_bom(number)) == 3
    assert set(states(run("status", back, "--json")).values()) == {"same"}
    again = run("commit", top)
    assert (again.code, "Nothing to send" in again.out or "BOM unchanged" in again.out) == (0, True)
    # An item of a file of several items is pulled with that file.
    item = next(one for one in silo.client.search_items("Left"))
    (document,) = silo.client.documents_of(item.part_number)
    assert (document.part_number, document.file_path) == ("", "parts/Both.FCStd")
    assert {held.object for held in document.holds} == {"Left", "Right"}
    assert run("pull", item.part_number, "--into", tmp_path / "alone").code == 0
    assert set(contents(tmp_path / "alone")) == {"parts/Both.FCStd"}


def test_a_released_revision_comes_back_as_it_was_frozen(
    registered: Path, silo: Any, run: Any, tmp_path: Path
) -> None:
    """Every file, whatever was committed since; a label that there is not is one sentence."""
    before = contents(registered)
    assert run("commit", registered).code == 0
    number = silo.client.search_items("Robot")[0].part_number
    with Api(silo.client.base_url, silo.token) as api:
        api.good("PUT", "/api/users/admin", {"approver": True})
        api.good("POST", f"/api/items/{number}/releases", {"with_parts": True})
        api.good("POST", f"/api/items/{number}/releases/A/approval", {"override": "a trial"})
    for name in ("parts/Both.FCStd", "asm/Top.FCStd"):
        edit(registered / name, "later")
    assert run("commit", registered).code == 0
    pulled = run("pull", number, "--revision", "A", "--into", tmp_path / "A")
    assert pulled.code == 0, pulled.out
    assert contents(tmp_path / "A") == {name: before[name] for name in contents(tmp_path / "A")}
    assert contents(tmp_path / "A").keys() == before.keys()
    assert run("pull", number, "--into", tmp_path / "now").code == 0
    assert contents(tmp_path / "now") == contents(registered)
    missing = run("pull", number, "--revision", "Q", "--into", tmp_path / "Q")
    assert missing.code != 0
    assert "no revision 'Q'; there is A" in missing.err


def edit(path: Path, text: str) -> None:
    """Another content of the same document."""
    with zipfile.ZipFile(path, "a") as file:
        file.comment = text.encode()


def test_status_tells_what_is_edited_here_newer_there_and_both(
    registered: Path, silo: Any, run: Any, tmp_path: Path
) -> None:
    """And a commit sends what is edited, once per content, and nothing over a colleague's file."""
    assert run("commit", registered, "--json").code == 0
    number = silo.client.search_items("Robot")[0].part_number
    back = tmp_path / "colleague"
    assert run("pull", number, "--into", back).code == 0
    for name in ("parts/Both.FCStd", "parts/Arm.FCStd"):
        edit(back / name, "theirs")
    part("New", "Box").save(back / "new.FCStd")
    assert states(run("status", back, "--json")) == {
        "asm/Top.FCStd": "same",
        "parts/Both.FCStd": "edited",
        "parts/Arm.FCStd": "edited",
        "Master.FCStd": "same",
        "new.FCStd": "new",
    }
    sent = run("commit", back, "--json")
    assert sent.code == 0, sent.out
    files = {one["path"]: one["revision"] for one in sent.json()["sent"] if one["revision"]}
    assert files == {"parts/Both.FCStd": 2, "parts/Arm.FCStd": 2, "new.FCStd": 1}
    edit(registered / "parts" / "Both.FCStd", "mine")
    ran = run("status", registered, "--json")
    assert ran.code == 1
    assert states(ran) == {
        "asm/Top.FCStd": "same",
        "parts/Both.FCStd": "both",
        "parts/Arm.FCStd": "newer",
        "Master.FCStd": "same",
    }
    refused = run("commit", registered)
    assert refused.code == 1
    assert "--on-top" in refused.out
    assert run("commit", registered, "--on-top", "--json").code == 1  # Arm is still the older one
    document = json.loads((registered / PROJECT_FILE).read_text())["files"]["parts/Both.FCStd"]["document"]
    (newest,) = silo.client.get_documents([document]).values()
    assert newest.revision_number == 3
    assert "on top of revision 2" in newest.comment


def test_a_file_that_was_renamed_or_moved_is_the_same_document(registered: Path, silo: Any, run: Any) -> None:
    """It is shown before it is sent; nothing asks whether it is the same part."""
    assert run("commit", registered).code == 0
    (registered / "lib").mkdir()
    (registered / "parts" / "Both.FCStd").rename(registered / "lib" / "Pair.FCStd")
    (registered / "parts" / "Arm.FCStd").rename(registered / "parts" / "Boom.FCStd")
    (registered / "Master.FCStd").unlink()
    ran = run("status", registered, "--json").json()
    moved = {one["path"]: one["moved_from"] for one in ran["files"] if one["moved_from"]}
    assert moved == {"lib/Pair.FCStd": "parts/Both.FCStd", "parts/Boom.FCStd": "parts/Arm.FCStd"}
    assert ran["gone"] == ["Master.FCStd"]
    edit(registered / "lib" / "Pair.FCStd", "x")
    edit(registered / "parts" / "Boom.FCStd", "x")
    sent = run("commit", registered / "lib", registered / "parts", "--json")
    assert sent.code == 0, sent.out
    assert {one["path"]: one["revision"] for one in sent.json()["sent"]} == {
        "lib/Pair.FCStd": 2,
        "parts/Boom.FCStd": 2,
    }
    assert run("status", registered, "--json").json()["gone"] == ["Master.FCStd"]


def test_a_copy_of_the_files_alone_finds_its_documents_by_the_links(
    registered: Path, silo: Any, run: Any, tmp_path: Path
) -> None:
    """What the project remembers may be lost; no second document is made of a file."""
    assert run("commit", registered).code == 0
    copy = tmp_path / "copy"
    shutil.copytree(registered, copy, ignore=shutil.ignore_patterns(".silo*"))
    assert set(states(run("status", copy, "--json")).values()) == {"same"}
    before = json.loads((registered / PROJECT_FILE).read_text())["files"]
    assert run("commit", copy).code == 0
    after = json.loads((copy / PROJECT_FILE).read_text())["files"]
    assert {place: one["document"] for place, one in after.items()} == {
        place: one["document"] for place, one in before.items()
    }


def test_a_link_out_of_the_project_is_reported_and_not_followed(
    registered: Path, run: Any, silo: Any, tmp_path: Path
) -> None:
    part("Far", "Box").save(tmp_path / "Far.FCStd")
    Doc(label="U").link("L", "../Far.FCStd", "Box").link("M", "no.FCStd", "Box").save(registered / "U.FCStd")
    ran = run("commit", registered / "U.FCStd", "--root", registered, "--json")
    assert ran.code == 1
    assert ran.json()["outside"] == [{"file": "U.FCStd", "link": "../Far.FCStd"}]
    assert ran.json()["missing"] == [{"file": "U.FCStd", "link": "no.FCStd"}]
    assert list(states(ran)) == ["U.FCStd"]


def test_what_cannot_be_sent_waits_in_the_queue_of_the_add_on(registered: Path, silo: Any, run: Any) -> None:
    """Another program is sending: the commit is kept, and the next run sends it and nothing twice."""
    top = registered / "asm" / "Top.FCStd"
    with Store().send_lock():
        ran = run("commit", registered)
    assert ran.code == 1
    assert "waits in the queue" in ran.out
    assert set(states(run("status", registered, "--json")).values()) == {"waiting"}
    assert run("commit", top).code == 0
    assert set(states(run("status", registered, "--json")).values()) == {"same"}
    (item,) = silo.client.search_items("Robot")
    assert [bool(one.file_checksum) for one in silo.client.revisions(item.part_number)] == [True]


def test_without_a_server_the_commit_waits_in_the_queue(
    registered: Path, silo: Any, run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next commit with a server sends it, once."""
    address = os.environ["SILO_API_URL"]
    monkeypatch.setenv("SILO_API_URL", "http://127.0.0.1:9")
    ran = run("commit", registered, "--comment", "on the train", "--json")
    assert ran.code == 3
    assert {one["path"] for one in ran.json()["waiting"]} == set(states(ran))
    kept = len(Store().entries())
    again = run("commit", registered, "--json")
    assert (again.code, again.json()["waiting"]) == (3, ran.json()["waiting"])
    assert len(Store().entries()) == kept  # nothing is kept twice
    monkeypatch.setenv("SILO_API_URL", address)
    assert run("commit", registered).code == 0
    assert set(states(run("status", registered, "--json")).values()) == {"same"}
    (item,) = silo.client.search_items("Robot")
    assert [one.comment for one in silo.client.revisions(item.part_number) if one.file_checksum] == [
        "on the train"
    ]


def test_what_somebody_wrote_into_the_memory_of_a_project_is_left_out(tmp_path: Path) -> None:
    """Only what names a document is a file; keys of a newer version are passed over."""
    odd = {"a": 5, "b": {}, "c": {"document": ""}, "d": {"document": "D", "newer": 1}, "e": ["x"]}
    (tmp_path / PROJECT_FILE).write_text(json.dumps({"files": odd}))
    assert Project(str(tmp_path)).records() == {"d": FileRecord("D")}
    (tmp_path / PROJECT_FILE).write_text(json.dumps({"files": ["a"]}))
    assert Project(str(tmp_path)).records() == {}


def test_a_bom_that_is_held_is_said_and_goes_out_when_its_file_is_back(
    registered: Path, silo: Any, run: Any, tmp_path: Path
) -> None:
    """``commit`` says why as ``sync`` does, and ends with 1; any later commit frees it."""
    arm, away = registered / "parts" / "Arm.FCStd", tmp_path / "Arm.FCStd"
    arm.rename(away)
    ran = run("commit", registered)
    assert ran.code == 1
    assert "not synced: links are broken" in ran.out
    reason = next(line.strip() for line in ran.out.splitlines() if "Arm.FCStd" in line and "missing" in line)
    assert reason.rpartition("/")[2] in run("sync", registered / "asm" / "Top.FCStd").out
    (item,) = silo.client.search_items("Robot")
    assert silo.client.get_item(item.part_number).last_sync.held.left_out[0].file.endswith("Arm.FCStd")
    told = run("status", registered, "--json")
    held = {one["path"]: one["held_bom"] for one in told.json()["files"] if one["held_bom"]}
    assert (told.code, held) == (1, {"asm/Top.FCStd": "1 file missing"})
    assert "its BOM is held: 1 file missing" in run("status", registered).out
    away.rename(arm)
    other = tmp_path / "other"
    other.mkdir()
    Doc(label="Sheet").save(other / "Sheet.FCStd")
    assert run("commit", other).code == 0
    assert silo.client.get_item(item.part_number).last_sync.held is None
    assert len(silo.client.get_bom(item.part_number)) == 3
    assert run("commit", registered).code == 0
    assert run("status", registered).code == 0


def test_a_server_that_was_set_back_is_asked_about_once(
    robot: Path, run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``status`` and ``commit`` recognise it, and end with 1; one ``--on-top`` sends all that it has lost."""
    token, database = "silo_" + "b2" * 20, tmp_path / "server" / "silo.db"
    database.parent.mkdir()
    monkeypatch.setenv("SILO_API_TOKEN", token)
    with running_server(sqlite_database(database), token=token) as server:
        monkeypatch.setenv("SILO_API_URL", server.base_url)
        port = urlsplit(server.base_url).port or 0
        assert run("register", robot / "asm" / "Top.FCStd", "--yes").code == 0
        assert run("commit", robot).code == 0
    older = tmp_path / "older.db"
    shutil.copy(database, older)
    with running_server(f"sqlite:///{database}", token=token, port=port):
        for place in ("parts/Arm.FCStd", "Master.FCStd"):
            edit(robot / place, "second")
        assert run("commit", robot).code == 0
    for rest in database.parent.glob("silo.db*"):
        rest.unlink()
    shutil.copy(older, database)
    with running_server(f"sqlite:///{database}", token=token, port=port):
        told = run("status", robot, "--json")
        lost = {"parts/Arm.FCStd", "Master.FCStd"}
        assert told.code == 1
        assert {place for place, state in states(told).items() if state == "server set back"} == lost
        assert {state for place, state in states(told).items() if place not in lost} == {"same"}
        ran = run("commit", robot)
        assert ran.code == 1
        assert "--on-top sends all such files again" in ran.out
        assert run("commit", robot, "--on-top").code == 0
        after = run("status", robot, "--json")
        assert (after.code, set(states(after).values())) == (0, {"same"})


def test_a_commit_that_is_held_ends_with_1(registered: Path, silo: Any, run: Any, tmp_path: Path) -> None:
    """For a colleague's newer file; the next commit that sends nothing ends with 1 too."""
    assert run("commit", registered).code == 0
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(registered, elsewhere)
    edit(elsewhere / "parts" / "Arm.FCStd", "theirs")
    assert run("commit", elsewhere).code == 0
    edit(registered / "parts" / "Arm.FCStd", "mine")
    for _ in range(2):
        ran = run("commit", registered, "--json")
        assert ran.code == 1
        assert states(ran)["parts/Arm.FCStd"] in ("both", "held")
    assert run("commit", registered, "--on-top").code == 0
    assert run("status", registered).code == 0
