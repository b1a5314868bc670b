# SPDX-License-Identifier: LGPL-2.1-or-later
"""Nothing is written over a model or an input: every command × every option that writes × existing files."""

from __future__ import annotations

import argparse
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from silo.bom.errors import Exit
from silo.cli.parser import build_parser, command_parsers


def parsers() -> dict[str, argparse.ArgumentParser]:
    return command_parsers(build_parser())


ARM = Path(__file__).parents[2] / "examples" / "arm"

# What each command with such options is run with; TOP, ARM and OTHER are files.
WORDS = {
    "bom": "bom TOP",
    "bom-diff": "bom-diff FOLDER FOLDER",
    "diff": "diff TOP",
    "register": "register TOP",
    "sync": "sync TOP",
    "where-used": "where-used TOP --root FOLDER",
    "order": "order A01-0001",
    "inertia": "inertia ARM --bom BOM --urdf URDF",
    "mass": "mass TOP --push",
    "links": "links ARM --urdf URDF",
}
ENDINGS = {
    "--csv": ".csv",
    "--xlsx": ".xlsx",
    "--plan": ".csv",
    "--preview": ".glb",
    "--out": ".yaml",
    "--urdf-out": ".urdf",
    "--index": ".db",
}


def outputs() -> Iterator[tuple[str, str, str]]:
    """Yield each command, each of its options that write, and each ending that a file of it may have."""
    for command, parser in parsers().items():
        for option, _form in parser.get_default("outputs") or ():
            if option == "--report":
                text = parser._option_string_actions[option].help or ""
                endings = text.partition("(")[2].partition(")")[0].split(", ")
                yield from ((command, option, ending) for ending in endings)
            else:
                yield command, option, ENDINGS[option]


OUTPUTS = sorted(outputs())


def test_each_option_that_writes_a_file_is_guarded() -> None:
    """An option whose help says that it writes a file is declared as one that does."""
    for command, parser in parsers().items():
        declared = {option for option, _ in parser.get_default("outputs") or ()}
        for action in parser._actions:
            named = action.metavar in ("FILE", "MAP")
            if named and any(word in (action.help or "") for word in ("write ", "remember")):
                assert set(action.option_strings) <= declared, (command, action.option_strings)
    assert {command for command, _, _ in OUTPUTS} == set(WORDS)


@pytest.fixture
def desk(tmp_path: Path, gearbox: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """Files of a user, by the words that stand for them."""
    for file in ARM.iterdir():
        if file.is_file():
            shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    words = {"TOP": gearbox, "FOLDER": gearbox.parent, "ARM": tmp_path / "arm.step"}
    return words | {"BOM": tmp_path / "bom.csv", "URDF": tmp_path / "arm.urdf"}


def line(command: str, desk: dict[str, Path]) -> list[object]:
    return [desk.get(word, word) for word in WORDS[command].split()]


def with_content(content: bytes) -> Callable[[Path, dict[str, Path]], None]:
    return lambda path, _desk: path.write_bytes(content) and None


def _workbook(path: Path, _desk: dict[str, Path]) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")


# What may be at the place of an output already, and must stay as it is.
TAKEN: dict[str, Callable[[Path, dict[str, Path]], Any]] = {
    "notes": with_content(b"Torque of the screws: 3 Nm\n"),
    "a table of prices": with_content(b"part,price\nBolt,0.1\n"),
    "a page": with_content(b"<!doctype html><html><title>Our robot</title></html>"),
    "a README": with_content(b"# Our robot\n\nHow it is built.\n"),
    "JSON": with_content(b'{"name": "robot", "version": 1}'),
    "XML": with_content(b'<?xml version="1.0"?><project name="robot"/>'),
    "a workbook": _workbook,
    "a foreign scene": with_content(b'glTF\2\0\0\0\0\0\0\0\0\0\0\0JSON{"asset":{"generator":"another"}}'),
    "bytes": with_content(bytes(range(256))),
    "a copy of a model": lambda path, desk: shutil.copy(desk["TOP"], path),
    "a second name of a model": lambda path, desk: os.link(desk["TOP"], path),
    "a second name of a table that is read": lambda path, desk: os.link(desk["BOM"], path),
    "a link to a model": lambda path, desk: path.symlink_to(desk["TOP"]),
}


@pytest.mark.usefixtures("needs_symlinks")
@pytest.mark.parametrize(("command", "option", "ending"), OUTPUTS)
def test_what_is_there_already_stays(
    run: Any, desk: dict[str, Path], tmp_path: Path, command: str, option: str, ending: str
) -> None:
    """Whatever it is: bad input before the first step, with the name of the file, and nothing changed."""
    target = tmp_path / f"taken{ending}"
    for what, make in TAKEN.items():
        make(target, desk)
        before = target.read_bytes()
        done = run(*line(command, desk), option, target)
        assert (done.code, done.out) == (Exit.BAD_INPUT, ""), (what, done)
        assert target.name in done.err, (what, done.err)
        assert target.read_bytes() == before, what
        target.unlink()


@pytest.mark.parametrize(("command", "option", "ending"), OUTPUTS)
def test_a_model_is_no_output(
    run: Any, desk: dict[str, Path], command: str, option: str, ending: str
) -> None:
    """The value was forgotten, and the first file that the shell names took its place."""
    first, *others = sorted(desk["FOLDER"].glob("*.FCStd"))
    backup = desk["TOP"].with_suffix(".FCStd1")
    backup.write_bytes(b"")
    models = [first, desk["ARM"], backup, desk["FOLDER"] / "new.fcstd"]
    before = {path: path.read_bytes() for path in desk["FOLDER"].rglob("*.FCStd")}
    for model in models:
        done = run(*line(command, desk), option, model)
        assert (done.code, done.out) == (Exit.BAD_INPUT, ""), done
    done = run(WORDS[command].split()[0], option, first, *others)
    assert done.code == Exit.BAD_INPUT
    assert {path: path.read_bytes() for path in desk["FOLDER"].rglob("*.FCStd")} == before
    assert not backup.read_bytes()


@pytest.mark.parametrize(("command", "option", "ending"), OUTPUTS)
def test_what_the_run_reads_is_no_output(
    run: Any, desk: dict[str, Path], tmp_path: Path, command: str, option: str, ending: str
) -> None:
    """Even if it has the form of the output: a table of materials, a configuration."""
    own = tmp_path / f"own{ending}"
    own.write_bytes(b"")
    parser = parsers()[command]
    reading = [
        action.option_strings[0]
        for action in parser._actions
        if action.metavar in ("FILE", "BOM", "MAP", "FOLDER")
        and action.option_strings
        and action.option_strings[0] not in {name for name, _ in parser.get_default("outputs")}
    ]
    for other in reading:
        done = run(*line(command, desk), other, own, option, own)
        assert (done.code, done.out) == (Exit.BAD_INPUT, ""), (other, done)
        reasons = ("is read by this command", "does nothing", "not allowed with")
        assert any(reason in done.err for reason in reasons), (other, done.err)
    assert own.read_bytes() == b""


def test_two_outputs_are_two_files(run: Any, desk: dict[str, Path], tmp_path: Path) -> None:
    """All problems of a run are reported together."""
    one = tmp_path / "one.csv"
    done = run("bom", desk["TOP"], "--csv", one, "--xlsx", one)
    assert (done.code, one.exists()) == (Exit.BAD_INPUT, False)
    assert "--csv writes this file too" in done.err
    done = run("bom", desk["TOP"], "--csv", tmp_path / "no" / "a.csv", "--xlsx", tmp_path / "a.step")
    assert done.code == Exit.BAD_INPUT
    assert "there is no folder" in done.err
    assert "is the name of a model" in done.err
    assert run("bom", desk["TOP"], "--xlsx", "-").code == Exit.BAD_INPUT
    assert not Path("-").exists()


@pytest.mark.usefixtures("synced")
@pytest.mark.parametrize(
    ("command", "option", "ending"), [one for one in OUTPUTS if one[1] not in ("--plan", "--out", "--index")]
)
def test_a_report_of_last_night_is_replaced(
    run: Any, silo: Any, desk: dict[str, Path], tmp_path: Path, command: str, option: str, ending: str
) -> None:
    """The same command line works every night; an empty file may be filled."""
    target = tmp_path / f"night{ending}"
    target.touch()
    number = silo.client.search_items("Top", limit=1)[0].part_number
    words = [number if word == "A01-0001" else word for word in line(command, desk)]
    first = run(*words, option, target)
    assert first.code != Exit.BAD_INPUT, first
    assert target.stat().st_size > 0
    os.utime(target, (1, 1))
    again = run(*words, option, target)
    assert again.code == first.code, again
    assert target.stat().st_mtime > 1


def test_an_edited_link_map_stays(run: Any, desk: dict[str, Path], tmp_path: Path) -> None:
    """A map is made to be edited; the same command line the next day is no reason to lose that."""
    made = tmp_path / "map.yaml"
    assert run("links", desk["ARM"], "--out", made).code == Exit.DONE
    made.write_text(made.read_text("utf-8").replace("base_link", "pedestal"), "utf-8")
    edited = made.read_bytes()
    done = run("links", desk["ARM"], "--out", made)
    assert (done.code, made.read_bytes()) == (Exit.BAD_INPUT, edited)
    assert "may hold edits" in done.err


def test_the_urdf_of_another_robot_stays(run: Any, desk: dict[str, Path], tmp_path: Path) -> None:
    other = tmp_path / "cart.urdf"
    other.write_text('<robot name="cart"><link name="base_link"/></robot>', "utf-8")
    before = other.read_bytes()
    done = run(*line("inertia", desk), "--urdf-out", other)
    assert (done.code, other.read_bytes()) == (Exit.BAD_INPUT, before)
    assert "the URDF of another robot, cart" in done.err


def test_a_pipe_and_a_device_are_written(run: Any, desk: dict[str, Path]) -> None:
    assert run("bom", desk["TOP"], "--csv", os.devnull).code in (Exit.DONE, Exit.UNDONE)
