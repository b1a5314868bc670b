# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register``: the questions, the table, whole folders; nothing becomes an item by accident."""

from __future__ import annotations

import csv
import os
import re
import shutil
import signal
import subprocess
import sys
import zipfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, locals_, part
from server_testing import sqlite_database

from silo.bom.entry import BomEntry
from silo.bom.items.proposal import Proposal
from silo.cli.reading import read_assembly
from silo.cli.register.questions import Dialog
from silo.fcstd import open_document
from silo.registering.candidate import Candidate, ComponentState, Similar
from silo.registering.closed_files import carry_out_on_disk, proposals_for
from silo.registering.journal import Journal, component_key
from silo.registering.offer import Offer
from silo.registering.request import ITEM_TYPES, RegistrationRequest
from silo.registering.saved_file import on_disk
from silo.testing import FakeSilo
from silo_server.run import running_server

GIVEN_COUNTS = (Path(__file__).resolve().parents[3] / "shared").resolve() / "cases" / "counts"
CATEGORIES = {"A01": "Assembly", "F01": "Fastener, screw", "M01": "Machined part", "M06": "Machined frame"}


def candidate(name: str = "Bracket", **more: Any) -> Candidate:
    entry = BomEntry(f"/v/{name}.FCStd", object_name="Body", label=name, document_label=name)
    return Candidate(Proposal(entry, name, "part", "M01"), ComponentState.READY, **more)


def talk(
    *candidates: Candidate, answers: Iterable[str | None], own: bool = False
) -> tuple[list[Any], list[str], str]:
    """Orders as (name, type, category, joined), the names left out, and what was asked."""
    silo = FakeSilo()
    silo.create_item("kindred-rd", "M01", "Other")
    queue = iter(answers)

    found = Offer(candidates, CATEGORIES)
    requests, left = Dialog(candidates, found, silo, "/v", lambda _one: own, lambda _: next(queue)).ask()
    rows = [(o.name, o.item_type, o.category, o.existing and o.existing.part_number) for o in requests]
    assert not list(queue), "an answer was not asked for"
    return rows, [one.proposal.name for one in left]


@pytest.mark.parametrize(
    "slip", ["yse", "?", "F99", "Bracket 2", "cat F99", "type screw", "name", "0", "Y es"]
)
def test_a_slip_is_asked_again_and_becomes_nothing(slip: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What is not understood is never a name, a category or a yes."""
    rows, left = talk(candidate(), answers=[slip, "n"])
    assert (rows, left) == ([], ["Bracket"])
    assert capsys.readouterr().err


def test_help_explains_every_answer(capsys: pytest.CaptureFixture[str]) -> None:
    talk(candidate(), answers=["?", "n"])
    text = capsys.readouterr().err
    assert all(
        f"  {word}" in text for word in ("y, yes", "n, no", "name", "type", "cat", "join", "all", "q, quit")
    )


def test_name_type_and_category_can_be_changed(capsys: pytest.CaptureFixture[str]) -> None:
    """The category follows the type where nobody chose one; it is listed with what it means."""
    changes = ["name Motor frame", "cat frame", "cat m06", "y"]
    assert talk(candidate(), answers=changes)[0] == [("Motor frame", "part", "M06", None)]
    assert "M06  Machined frame" in capsys.readouterr().err
    assert talk(candidate(), answers=["type assembly", "y"])[0] == [("Bracket", "assembly", "A01", None)]
    assert talk(candidate(), answers=["cat F01", "type tool", "y"])[0] == [("Bracket", "tool", "F01", None)]
    assert set(ITEM_TYPES) == {"part", "assembly", "consumable", "tool"}


def test_a_probable_duplicate_is_not_taken_by_enter() -> None:
    """Enter and "all" take what is without a doubt only."""
    twin = candidate(similar=(Similar("M01-0001", "u", "Bracket"),))
    assert talk(twin, answers=["", "n"])[1] == ["Bracket"]
    assert talk(twin, answers=["y"])[0] == [("Bracket", "part", "M01", None)]
    assert talk(twin, answers=["join M01-0001", "y"])[0] == [("Bracket", "part", "M01", "M01-0001")]
    assert talk(twin, answers=["join M99-0001", "n"])[1] == ["Bracket"]
    assert talk(twin, answers=[""], own=True)[0] == [("Bracket", "part", "M01", None)]
    rows, left = talk(candidate("A"), twin, candidate("B"), answers=["all", "n"])
    assert ([row[0] for row in rows], left) == (["A", "B"], ["Bracket"])
    copies = [candidate(name, sha256="same", twin="the other") for name in ("A", "B")]
    assert talk(*copies, answers=["all", "n"])[1] == ["B"]


def test_a_copy_that_stays_the_same_part_is_not_left_without_a_number() -> None:
    """It has the number of the file that it was copied from."""
    assert talk(candidate(same_as="M01-0001"), answers=["n"]) == ([], [])


@pytest.mark.parametrize("end", ["q", "quit", None])
def test_quitting_leaves_out_the_rest(end: str | None) -> None:
    rows, left = talk(candidate("A"), candidate("B"), candidate("C"), answers=["y", end])
    assert ([row[0] for row in rows], left) == (["A"], ["B", "C"])


@pytest.mark.usefixtures("needs_signals")
@pytest.mark.usefixtures("needs_pty")
def test_the_questions_on_a_terminal(silo: Any, gearbox: Path) -> None:
    """As a person meets them: on a terminal, with standard output elsewhere; Ctrl-C leaves all as it was."""
    before = gearbox.read_bytes()

    pty = pytest.importorskip("pty")
    own, other = pty.openpty()
    words = [sys.executable, "-m", "silo.cli.main", "register", str(gearbox)]
    with subprocess.Popen(words, stdin=other, stdout=subprocess.PIPE, stderr=other) as job:
        os.close(other)
        try:
            for answer in (b"F99\n", b""):
                seen = b""
                while b"/?] " not in seen:
                    seen += os.read(own, 4096)
                os.write(own, answer)
            assert b"'F99' is no answer" in seen
            printed = None
            # Python does not notice a Ctrl-C that comes between the question and the reading of the answer.
            while printed is None:
                job.send_signal(signal.SIGINT)
                with suppress(subprocess.TimeoutExpired):
                    printed = job.communicate(timeout=10)[0]
            assert printed == b""
        finally:
            job.kill()
    os.close(own)
    assert job.returncode == 130
    assert gearbox.read_bytes() == before
    assert silo.client.search_items() == []


# --- the table ------------------------------------------------------------------------------------------


def planned(run: Any, top: Path, table: Path) -> list[dict[str, str]]:
    assert run("register", top, "--plan", table).code == 0
    with table.open(newline="", encoding="utf-8-sig", errors="surrogateescape") as file:
        return list(csv.DictReader(file))


def save(table: Path, rows: list[dict[str, str]], **how: Any) -> None:
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0], **how)
        writer.writeheader()
        writer.writerows(rows)


def test_a_table_is_edited_and_applied(run: Any, silo: Any, gearbox: Path, tmp_path: Path) -> None:
    """As a spreadsheet saves it; repeating it is harmless; what is not in it is reported."""
    table = tmp_path / "plan.csv"
    rows = planned(run, gearbox, table)
    assert len(rows) == 9
    assert silo.client.search_items() == []
    assert {row["type"] for row in rows} == {"part", "assembly"}
    # One in a thousand has digits alone, and came back from a spreadsheet rounded: "the file has changed".
    assert all(row["fingerprint"].startswith("x") for row in rows)
    for row in rows:
        if "Cover" in row["file"] and row["type"] == "part":
            row |= {"register": "no"}
        if "Bolt" in row["file"]:
            row |= {"name": "=Bolt; long", "category": "F01", "type": "consumable"}
    save(table, rows, delimiter=";")
    done = run("register", gearbox, "--apply", table, "--json")
    registered = {row["name"]: row for row in done.json()["registered"]}
    assert registered["=Bolt; long"]["part_number"].startswith("F01-")
    count = len(registered)
    assert len(silo.client.search_items()) == count == sum(row["register"] == "yes" for row in rows)
    edited = table.read_bytes()
    assert run("register", gearbox, "--plan", table).code == 2
    assert table.read_bytes() == edited, "a table that a person edited is not written over"
    again = run("register", gearbox, "--apply", table)
    assert (again.code, f"{count} of the table's components had their number" in again.out) == (0, True)
    assert len(silo.client.search_items()) == count
    save(table, [row for row in rows if row["register"] == "yes"])
    fewer = run("register", gearbox, "--apply", table)
    assert fewer.code == 1
    assert "unregistered" in fewer.out


def test_all_problems_of_a_table_are_reported_at_once(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path
) -> None:
    """With their lines; nothing is registered, not even what is right."""
    table = tmp_path / "plan.csv"
    rows = planned(run, gearbox, table)
    rows[0]["register"] = "yse"
    rows[1]["category"] = "F99"
    rows[2]["type"] = "screw"
    rows[3]["name"] = " "
    rows[8]["name"] = "two\nlines"
    rows[4]["part_number"] = "M01-4711"
    rows[5]["file"] = "elsewhere.FCStd"
    rows.append(dict(rows[6]))
    save(table, rows)
    changed = gearbox.parent / rows[7]["file"]
    _touch(changed)
    done = run("register", gearbox, "--apply", table)
    assert done.code == 2
    for line, word in enumerate(
        ("yse", "F99", "screw", "empty", "M01-4711", "elsewhere", "more than once"), 2
    ):
        assert f"line {line}: " in done.err
        assert word in done.err
    assert "line 9: " in done.err
    assert "has changed since" in done.err
    assert "one line of at most 200 characters" in done.err
    assert "line 12: " in done.err
    assert silo.client.search_items() == []


def _touch(path: Path) -> None:
    """Save as FreeCAD does: a new time stamp in the document."""
    with zipfile.ZipFile(path) as old:
        members = {info: old.read(info) for info in old.infolist()}
    with zipfile.ZipFile(path, "w") as new:
        for info, data in members.items():
            new.writestr(info, data)
        new.writestr("added.brp", b"a new shape")


def test_a_number_that_was_copied_down_a_column_is_asked_about(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path
) -> None:
    """Two different files would become one part."""
    number = silo.client.create_item("kindred-rd", "M01", "Known").part_number
    table = tmp_path / "plan.csv"
    rows = planned(run, gearbox, table)
    for row in rows[:2]:
        row["part_number"] = number
    rows[3]["name"] = "Gr\ufffd\ufffde"
    save(table, rows)
    done = run("register", gearbox, "--apply", table)
    assert done.code == 2
    assert f"line 3: part_number: {number} is already for" in done.err
    assert "line 5: name: " in done.err
    assert "lost letters" in done.err


def test_an_interrupted_table_can_be_applied_again(run: Any, silo: Any, tmp_path: Path) -> None:
    """Two parts of one file: the first has its identity in the file by then, and that is no edit."""
    kit = Doc(label="kit")
    for name in ("Lid", "Case"):
        kit.add("Part::Box", name, Height=10.0)
    kit.save(tmp_path / "kit.FCStd")
    top = Doc(label="top").link("LLid", "kit.FCStd", "Lid").link("LCase", "kit.FCStd", "Case")
    top.add("App::Part", "Top", Group=locals_("LLid", "LCase"), Type="Assembly")
    path = top.save(tmp_path / "top.FCStd")
    table = tmp_path / "plan.csv"
    rows = planned(run, path, table)
    assert len(rows) == 3
    first = [row | {"register": "yes" if row["object"] == "Lid" else "no"} for row in rows]
    save(table, first)
    assert run("register", path, "--apply", table).code == 0
    save(table, [row | {"register": "yes"} for row in rows])
    done = run("register", path, "--apply", table)
    assert done.code == 0, done.err
    assert len(silo.client.search_items()) == 3


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such names")
def test_a_table_knows_files_with_odd_names(run: Any, silo: Any, tmp_path: Path) -> None:
    """No text, a formula, quotes, line ends, spaces: each is the file that it was."""
    vault = tmp_path / "vault"
    vault.mkdir()
    names = [
        b"caf\xe9",
        b"=cmd,x;y",
        b"'=a",
        b"''-a",
        b"new\nline",
        b" space ",
        "日本".encode(),
        b'"q"',
        b"a\tb",
    ]
    for number, name in enumerate(names):
        path = Path(os.fsdecode(os.path.join(os.fsencode(vault), name + b".FCStd")))
        part(f"part {number}", "Body").save(path)
    rows = planned(run, vault, tmp_path / "plan.csv")
    assert len(rows) == len(names)
    text = (tmp_path / "plan.csv").read_bytes().replace(b"\nno,", b"\nyes,")
    (tmp_path / "plan.csv").write_bytes(text)
    done = run("register", vault, "--apply", tmp_path / "plan.csv", "--json")
    assert done.code == 0, done.err
    assert len({row["doc_path"] for row in done.json()["registered"]}) == len(names)
    assert run("register", vault, "--plan", tmp_path / "after.csv").err.startswith(
        f"{tmp_path}/after.csv: 0 "
    )


class Interrupted(FakeSilo):
    """Ctrl-C while the second item is made."""

    def create_item(self, *args: Any, **more: Any) -> Any:
        if self.items:
            raise KeyboardInterrupt
        return super().create_item(*args, **more)


def test_what_was_done_before_ctrl_c_is_known(gearbox: Path) -> None:
    """Its number is in the list that the report is made of, and in its file."""
    silo, done = Interrupted(), []
    extraction = read_assembly(str(gearbox))
    proposals = proposals_for(extraction, silo, "kindred-rd")
    requests = [RegistrationRequest.of(Candidate(one, ComponentState.READY)) for one in proposals]
    with pytest.raises(KeyboardInterrupt):
        carry_out_on_disk(requests, silo, schema="kindred-rd", done=done)
    (first,) = done
    assert open_document(first.proposal.entry.doc_path).Meta["SiloUUID"] == first.item_id


# --- whole folders --------------------------------------------------------------------------------------


def test_a_folder_is_registered_as_a_whole(run: Any, silo: Any, gearbox: Path) -> None:
    """Backups and ignored files left out; what no assembly uses is for a person; twice gives nothing new."""
    vault = gearbox.parent
    shutil.copy(gearbox, vault / "TopAssembly.FCBak")
    shutil.copy(gearbox, vault / "TopAssembly.FCStd1")
    (vault / "old").mkdir()
    shutil.copy(gearbox, vault / "old" / "Top.FCStd")
    (vault / ".siloignore").write_text("old/\n")
    part("Spare", "Body").save(vault / "Spare.FCStd")
    one = run("register", gearbox, "--plan", vault / "one.csv")
    assert one.code == 0
    rows = planned(run, vault, vault / "all.csv")
    alone = planned(run, gearbox, vault / "two.csv")
    assert {(r["file"], r["name"], r["type"], r["category"]) for r in rows if r["file"] != "Spare.FCStd"} == {
        (r["file"], r["name"], r["type"], r["category"]) for r in alone
    }
    (spare,) = [row for row in rows if row["file"] == "Spare.FCStd"]
    assert (spare["register"], spare["type"]) == ("no", "part")
    done = run("register", vault, "--yes", "--json")
    assert (done.code, len(done.json()["registered"])) == (0, 9)
    assert "1 file that no assembly uses" in run("register", vault, "--yes").err
    assert len(silo.client.search_items()) == 9


@pytest.mark.parametrize(
    ("name", "copy"),
    [
        ("sub/Drive.FCStd", "sub/Drive (conflicted copy).FCStd"),
        ("sub/Drive.FCStd", "Drive.FCStd"),
        ("TopAssembly.FCStd", "TopAssembly (conflicted copy).FCStd"),
    ],
)
def test_of_equal_files_the_linked_one_gets_the_item(
    run: Any, silo: Any, gearbox: Path, name: str, copy: str
) -> None:
    """The copy of a sync tool sorts before its original; of two that nothing links to it is no other."""
    vault = gearbox.parent
    if name != gearbox.name:
        (vault / "sub").mkdir()
        Doc().link("L", "../parts/Cover.FCStd", "Body").add(
            "App::Part", "Sub", Type="Assembly", Group=locals_("L")
        ).save(vault / name)
        Doc().link("L", name, "Sub").add("App::Part", "Top", Type="Assembly", Group=locals_("L")).save(
            vault / "Above.FCStd"
        )
    shutil.copy(vault / name, vault / copy)
    done = run("register", vault, "--yes", "--json").json()
    files = {row["doc_path"] for row in done["registered"]}
    left = {row["doc_path"] for row in done["unregistered"]}
    assert (name in files, copy in left) == (True, True), (files, left)


@pytest.mark.skipif(not GIVEN_COUNTS.is_dir(), reason="the given files are not beside this checkout")
def test_the_given_conflicted_copy_gets_no_item(run: Any, silo: Any, tmp_path: Path) -> None:
    vault = tmp_path / "vault"
    vault.mkdir()
    for file in (GIVEN_COUNTS / "conflicted-copy").iterdir():
        (vault / file.name).write_bytes(file.read_bytes())
    done = run("register", vault, "--yes", "--json").json()
    assert "SubOne.FCStd" in {row["doc_path"] for row in done["registered"]}
    assert [row["doc_path"] for row in done["unregistered"]] == ["SubOne (conflicted copy).FCStd"]


@pytest.mark.parametrize("damage", [b"PK\x03\x04 cut short", None])
def test_a_file_that_cannot_be_read_is_something_left_undone(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path, damage: bytes | None
) -> None:
    """Nobody knows what it holds; the others are registered."""
    cover = gearbox.parent / "parts" / "Cover.FCStd"
    before = cover.read_bytes()
    cover.unlink()
    if damage:
        cover.write_bytes(damage)
    for top in (gearbox, gearbox.parent):
        for words in (["--plan", tmp_path / f"{top.name}.csv"], ["--yes"]):
            done = run("register", top, *words)
            assert (done.code, "Cover.FCStd is left out" in done.err) == (1, True)
    assert len(silo.client.search_items()) == 8
    cover.write_bytes(before)
    assert run("register", gearbox.parent, "--yes").code == 0


def test_probable_duplicates_are_not_made_in_silence(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path
) -> None:
    """The same files once more, without their identities: each says what it may be."""
    fresh = tmp_path / "fresh"
    shutil.copytree(gearbox.parent, fresh)
    assert run("register", gearbox, "--yes").code == 0
    done = run("register", fresh / gearbox.name, "--yes")
    assert done.code == 1
    assert "Silo has this very file as" in done.out
    assert "--duplicates join" in done.out
    assert len(silo.client.search_items()) == 9
    joined = run("register", fresh / gearbox.name, "--yes", "--duplicates", "join", "--json").json()
    assert (len(joined["registered"]), len(silo.client.search_items())) == (9, 9)


def test_a_lost_identity_comes_back_by_one_word(run: Any, silo: Any, gearbox: Path) -> None:
    """FreeCAD saved its own copy over the stamped file, or a copy of the part lies there: nobody but a person
    knows. Nothing is taken and nothing is made before the answer."""
    before = gearbox.read_bytes()
    assert run("register", gearbox, "--yes").code == 0
    gearbox.write_bytes(before)
    asked = run("register", gearbox, "--yes", "--json")
    assert (asked.code, gearbox.read_bytes() == before) == (1, True)
    (failed,) = asked.json()["failed"]
    assert "The same part, or a copy of it?" in failed["error"]["message"]
    assert "--unclear take" in failed["error"]["message"]
    done = run("register", gearbox, "--yes", "--unclear", "take", "--json").json()
    assert ([row["found"] for row in done["registered"]], done["unregistered"]) == ([True], [])
    assert len(silo.client.search_items()) == 9


def test_an_interrupted_registration_goes_on_without_a_question(run: Any, silo: Any, tmp_path: Path) -> None:
    """Killed between the item and the file: the item of the same name is its own, no duplicate."""
    path = part("Bracket", "Body").save(tmp_path / "Bracket.FCStd")
    refused = run("register", path, "--yes", "--category", "F99")
    assert (refused.code, "F01" in refused.err) == (2, True)
    entry = read_assembly(str(path)).assembly
    intent, _ = Journal().begin(component_key(entry))
    made = silo.client.create_item("kindred-rd", "M01", "Bracket", idempotency_key=intent.wanted)
    (row,) = run("register", path, "--yes", "--json").json()["registered"]
    assert (row["part_number"], row["found"]) == (made.part_number, True)
    # A loop over a vault once gave 226 parts the number of an assembly, for good.
    assert (row["item_type"], row["category"][0] != "A") == ("part", True)


def test_an_item_that_no_file_names_is_named(run: Any, silo: Any, tmp_path: Path) -> None:
    """Of this folder alone; registering takes it, or a person puts it out of use."""
    paths = [part(name, "Body").save(tmp_path / name / f"{name}.FCStd") for name in ("Bracket", "Cover")]
    for path in paths:
        entry = read_assembly(str(path)).assembly
        intent, _ = Journal().begin(component_key(entry))
        silo.client.create_item("kindred-rd", "M01", path.stem, idempotency_key=intent.wanted)
    Journal().begin(f"{tmp_path}/Never.FCStd#Body")
    listed = run("register", tmp_path, "--orphans", "list", "--json")
    assert (listed.code, [row["name"] for row in listed.json()["orphans"]]) == (1, ["Bracket", "Cover"])
    text = run("register", paths[0], "--orphans", "list").out
    assert (f"M01-0001  Bracket  {paths[0]}#" in text, "Cover" in text) == (True, False)
    assert len(run("register", paths[0], "--orphans", "archive", "--json").json()["archived"]) == 1
    assert [item.name for item in silo.client.search_items()] == ["Cover"]
    assert not any("Bracket" in component for component in Journal().pending())
    assert run("register", paths[1], "--yes").code == 0
    assert run("register", tmp_path, "--orphans", "list", "--json").json()["orphans"] == []
    assert len(silo.client.search_items()) == 1


def test_what_another_computer_finished_is_no_orphan(
    run: Any, silo: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its file names the item: --orphans archive would put a part in use out of use."""
    path = part("Bracket", "Body").save(tmp_path / "Bracket.FCStd")
    entry = read_assembly(str(path)).assembly
    with Journal().turn(str(path), component_key(entry)) as turn:
        intent, _ = turn.begin("", on_disk(entry)[0])
    silo.client.create_item("kindred-rd", "M01", "Bracket", idempotency_key=intent.wanted)
    with monkeypatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path / "another computer"))
        (row,) = run("register", path, "--yes", "--json").json()["registered"]
    assert (row["found"], len(silo.client.search_items())) == (True, 1)
    assert run("register", tmp_path, "--orphans", "archive", "--json").json() == {"archived": []}
    assert [item.name for item in silo.client.search_items()] == ["Bracket"]
    assert Journal().pending() == {}


def test_a_project_of_another_server_is_taken_over_when_a_person_says_so(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Never by --yes, which knows nothing of where an identity is from; the UUIDs stay."""
    database = sqlite_database(tmp_path / "trial.db")
    with running_server(database, token=silo.token) as trial, monkeypatch.context() as patch:
        patch.setenv("SILO_API_URL", trial.base_url)
        assert run("register", gearbox, "--yes").code == 0
    before = gearbox.read_bytes()
    left = run("register", gearbox, "--yes", "--json")
    assert (left.code, len(left.json()["unregistered"])) == (1, 9)
    assert all("another server" in row["note"] for row in left.json()["unregistered"])
    said = " ".join(run("register", gearbox, "--yes").out.split())
    assert re.search(r"another server\? `silo-mod register \S*TopAssembly\.FCStd --adopt` takes them", said)
    assert silo.client.search_items() == []
    table = planned(run, gearbox, tmp_path / "plan.csv")
    assert {row["register"] for row in table} == {"no"}
    new = part("New", "Body").save(gearbox.parent / "parts" / "New.FCStd")
    done = run("register", gearbox, "--adopt", "--json").json()
    assert (len(done["registered"]), done["failed"], done["unregistered"]) == (9, [], [])
    assert (gearbox.read_bytes(), len(silo.client.search_items())) == (before, 9)
    assert "has its part number already" in run("register", gearbox, "--yes").out
    assert run("register", new, "--adopt").code == 1, "it carries no identity"
