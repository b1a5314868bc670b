# SPDX-License-Identifier: LGPL-2.1-or-later
"""One contract for all commands: defaults, names of options, amounts, widths, and what ends with 2."""

from __future__ import annotations

import errno
import io
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from silo.bom.errors import (
    ConflictError,
    Exit,
    ForbiddenError,
    NotFoundError,
    RejectedError,
    RouteMissingError,
    UnreachableError,
    exit_of,
)
from silo.cli.terminal import console, table_of

ARM = Path(__file__).parents[2] / "examples" / "arm" / "arm.step"


def test_an_exit_code_says_whose_turn_it_is() -> None:
    """A value is bad input also if the server notices that; 3 is no server, or no right."""
    bad = (RejectedError("a"), NotFoundError("a"))
    assert {exit_of(error) for error in bad} == {Exit.BAD_INPUT}
    remote = (UnreachableError("a"), ForbiddenError("a"), RouteMissingError("a"))
    assert {exit_of(error) for error in remote} == {Exit.REMOTE}
    assert exit_of(ConflictError("a")) == Exit.UNDONE


@pytest.mark.usefixtures("synced")
def test_bom_and_sync_agree_about_a_bad_file(run: Any, silo: Any, gearbox: Path) -> None:
    """Named itself it is bad input; in a folder it is left out, and the rest is done."""
    bad = gearbox.with_name("bad.FCStd")
    bad.write_bytes(gearbox.read_bytes()[:500])
    for command in ("bom", "sync"):
        assert run(command, bad).code == Exit.BAD_INPUT
        assert run(command, bad.parent).code == Exit.UNDONE


@pytest.mark.usefixtures("synced")
def test_a_folder_without_freecad_files_is_the_wrong_one(run: Any, silo: Any, gearbox: Path) -> None:
    """Unless its files were there at the last commit: then they are gone, which is worth a report."""
    empty = gearbox.parent.parent / "empty"
    empty.mkdir()
    for command in ("bom", "sync", "status", "commit", "diff", "register"):
        done = run(command, empty, *(["--yes"] if command == "register" else []))
        assert (done.code, done.out) == (Exit.BAD_INPUT, ""), done
        assert "no FreeCAD files (*.FCStd) in" in done.err
    assert run("commit", gearbox.parent).code == Exit.DONE
    for file in gearbox.parent.rglob("*.FCStd"):
        file.unlink()
    done = run("status", gearbox.parent)
    assert (done.code, "TopAssembly.FCStd" in done.out) == (Exit.UNDONE, True)


@pytest.mark.usefixtures("synced")
def test_a_sentence_is_said_once(run: Any, silo: Any) -> None:
    """A server puts its only problem into its sentence, and beside it."""
    done = run("order", "A01-0001", "--spares", "many")
    assert (done.code, done.err.count("wanted a number")) == (Exit.BAD_INPUT, 1)


def test_what_the_system_says_is_said_in_our_words(
    run: Any, silo: Any, gearbox: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Commands by places that the system refuses: no sentence of the system's own is shown."""
    monkeypatch.chdir(gearbox.parent)
    places = {
        "a file as folder": gearbox / "x.csv",
        "too long": gearbox.parent / ("x" * 300),
        "a folder": gearbox.parent,
        "nowhere": gearbox.parent / "no" / "x.csv",
        "a file": gearbox,
    }
    lines = (
        "import parts @",
        "sync @",
        "bom TopAssembly.FCStd --csv @",
        "bom . --index @",
        "pull A01-0001 --into @",
        "register . --apply @",
        "backup @",
        "restore @",
        "relink TopAssembly.FCStd --from Gearbox.FCStd --to @",
        "inertia @",
        "mass TopAssembly.FCStd --bom @",
        "mass TopAssembly.FCStd --materials @",
        "links @",
        f"inertia {ARM} --links @",
        f"inertia {ARM} --urdf @",
        "login http://127.0.0.1:9 --paste --ca @",
        "bom-diff @ .",
        "where-used parts/Gear.FCStd --root @",
    )
    system = {os.strerror(number) for number in errno.errorcode}
    for line in lines:
        for place in places.values():
            done = run(*(place if word == "@" else word for word in line.split()))
            said = done.out + done.err
            assert not [text for text in system if text in said], (line, place, said)
            assert "Errno" not in said, (line, place, said)


@pytest.mark.usefixtures("synced")
def test_the_folder_is_the_current_one(
    run: Any, silo: Any, gearbox: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(gearbox.parent)
    assert "9 of 9 files" in run("sync").out
    assert "TopAssembly.FCStd" in run("status").out


def test_two_files_are_compared_as_two_states_of_one(run: Any, gearbox: Path) -> None:
    """Whatever they are called."""
    new = gearbox.with_name("Top v2.FCStd")
    shutil.copy(gearbox, new)
    ran = run("bom-diff", gearbox, new, "--json")
    assert (ran.code, ran.json()["changes"]) == (Exit.DONE, [])
    from silo.cli.setup.demo_edits import remove_from_assembly

    remove_from_assembly(new, "Cover")
    (changed,) = run("bom-diff", gearbox, new, "--json").json()["changes"]
    assert [(line["change"], line["doc_path"]) for line in changed["lines"]] == [
        ("removed", "parts/Cover.FCStd")
    ]
    bad = gearbox.with_name("bad.FCStd")
    bad.write_bytes(b"")
    assert run("bom-diff", gearbox, bad).code == Exit.BAD_INPUT


@pytest.mark.usefixtures("synced")
def test_log_takes_numbers(run: Any, silo: Any, gearbox: Path) -> None:
    (top,) = silo.client.search_items("Top Assembly")
    done = run("log", top.part_number)
    assert done.code == Exit.DONE
    assert done.out.startswith(top.part_number)
    assert "this file" not in done.out
    assert run("log", top.part_number, "--json").json()["part_number"] == top.part_number
    assert run("log", "X99-9999").code == Exit.BAD_INPUT
    assert run("log", top.part_number, "--changes").code == Exit.BAD_INPUT


def test_an_old_name_of_an_option_works_for_one_release_and_warns(run: Any, tmp_path: Path) -> None:
    done = run("restore", tmp_path / "none", "--verify")
    assert done.code == Exit.BAD_INPUT
    assert "--verify is called --dry-run now" in done.err
    assert "--verify" not in run("restore", "--help").out


def test_the_package_is_a_program_too() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "silo", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("silo-mod ")


@pytest.mark.usefixtures("needs_pty")
def test_ctrl_d_is_an_answer() -> None:
    """Where a token is asked for."""
    terminal, inside = os.openpty()
    command = [sys.executable, "-m", "silo", "login", "http://127.0.0.1:9", "--paste"]
    with subprocess.Popen(
        command,
        stdin=inside,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        text=True,
    ) as child:
        os.close(inside)
        assert child.stderr is not None
        asked = ""
        while "API token of" not in asked or not asked.endswith("): "):
            letter = child.stderr.read(1)
            assert letter, asked
            asked += letter
        os.write(terminal, b"\x04")
        _out, told = child.communicate(timeout=120)
        os.close(terminal)
    assert child.returncode == Exit.BAD_INPUT
    assert "no answer was given" in told
    assert "Traceback" not in told


def test_no_width_is_unbounded() -> None:
    """A rule in a pipe had a million characters."""
    out = io.StringIO()
    terminal = console(out)
    terminal.rule("Title", align="left")
    terminal.print("x" * 3000)
    rule, text, *_ = out.getvalue().splitlines()
    assert len(rule) <= 80
    assert text == "x" * 3000


def test_a_part_number_stays_whole_on_a_narrow_terminal() -> None:
    table = table_of("Part number", "Name", "Remark")
    table.add_row("A01-0001-LONG-7", "name " * 12, "remark " * 12)
    out = io.StringIO()
    Console(file=out, width=60).print(table)
    assert "A01-0001-LONG-7" in out.getvalue()


@pytest.mark.usefixtures("synced")
def test_amounts_are_written_alike(run: Any, silo: Any) -> None:
    """12, not 12.0; without any price there is no cost of 0."""
    (top,) = silo.client.search_items("Top Assembly")
    for words in (("show", top.part_number), ("order", top.part_number)):
        text = run(*words).out
        assert re.search(r"\b12\b", text)
        assert "12.0" not in text
    assert "not priced" in run("order", top.part_number).out
    assert " 0 EUR" not in run("order", top.part_number).out


def test_an_assembly_without_materials_weighs_nothing_and_says_why_first(run: Any, gearbox: Path) -> None:
    ran = run("mass", gearbox)
    assert ran.code == Exit.UNDONE
    first = next(line for line in ran.err.splitlines() if "silo-mod mass: " not in line)  # how far it is
    assert "no part has a material with a density" in first
    assert run("mass", gearbox, "--default-density", "1000").code == Exit.DONE


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("inertia", ARM, "--strict", "--allow", "mass_roundet"), "did you mean mass_rounded"),
        (("inertia", ARM, "--mesh-unit", "furlong"), "wanted one of"),
    ],
)
def test_an_unknown_word_is_an_error(run: Any, words: tuple[object, ...], said: str) -> None:
    done = run(*words)
    assert (done.code, done.out) == (Exit.BAD_INPUT, "")
    assert said in done.err


def test_an_unknown_schema_is_an_error(run: Any, silo: Any, gearbox: Path) -> None:
    """Also where the server has only one."""
    done = run("register", gearbox, "--yes", "--schema", "nope")
    assert done.code == Exit.BAD_INPUT
    assert "kindred-rd" in done.err
