# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every command that a message proposes works as it is pasted, wherever the reader stands."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.commands_in_text import commands_in, outside_commands
from silo.bom.errors import Exit
from silo.bom.view.folders import shorten
from silo.cli.main import main
from silo.proposed_command import proposed

# A name as people give them, and what shells do with such a name.
FOLDER = "Robot arm; v2 $HOME 'new' `x`"
FOLDERS = (FOLDER, "-Größe 5 (Säge & Maß)", "--json")


@given(st.lists(st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=12), min_size=1))
def test_each_word_reaches_the_program_as_it_is(words: list[str]) -> None:
    """The oracle is the shell's reading of a line."""
    text = f"Or else {proposed('relink', *words)} does it."
    (command,) = commands_in(text)
    assert shlex.split(command) == ["silo-mod", "relink", *words]
    assert outside_commands(str.upper, text) == f"OR ELSE `{command}` DOES IT."


def test_a_report_shortens_no_proposed_command(tmp_path: Path) -> None:
    path = tmp_path / "Top.FCStd"
    text = f"{path} is odd; {proposed('bom', path)} shows it"
    assert shorten(text, str(tmp_path)) == f"Top.FCStd is odd; {proposed('bom', path)} shows it"


@pytest.fixture(params=FOLDERS)
def moved(synced: Path, gearbox: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A project in a folder with a bad name; six parts lie elsewhere now, under new names or the old ones."""
    project = tmp_path / request.param
    shutil.move(gearbox.parent, project)
    hardware = project / "hard ware"
    hardware.mkdir()
    parts = sorted((project / "parts").glob("*.FCStd"))
    for number, part in enumerate(parts[:6]):
        part.rename(hardware / (part.name if number % 2 else f"New {part.name}"))
    return project


def proposals(text: str) -> Iterator[str]:
    yield from commands_in(text)


def test_the_links_of_moved_files_are_led_to_them_as_proposed(
    run: Any, silo: Any, moved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By each command that says so, from the folder of the run, and from another one."""
    monkeypatch.chdir(tmp_path)
    report = tmp_path / "night"
    top = moved / "TopAssembly.FCStd"
    said = {
        "sync": run("sync", f"./{moved.name}", "--verbose").out,
        "bom": run("bom", top).out,
        "bom folder": run("bom", moved).out,
        "bom resolve": run("bom", f"./{top.relative_to(tmp_path)}", "--resolve").out,
        "diff": run("diff", top).out,
        "diff folder": run("diff", moved).out,
        "sync file": run("sync", top, "--recursive").out,
    }
    ran = run("sync", moved, *(f"--report={report}{end}" for end in (".html", ".json")), "--dry-run")
    assert ran.code == Exit.UNDONE
    data = json.loads(report.with_suffix(".json").read_text("utf-8"))
    said["json"] = "\n".join(finding["message"] for finding in data["summary"]["findings"])
    lines = [(who, line) for who, text in said.items() for line in proposals(text) if " relink " in line]
    assert {line for who, line in lines if who == "sync"} == {line for who, line in lines if who == "json"}
    once: dict[tuple[str, str], None] = dict.fromkeys(lines)
    assert len({line for _, line in once}) >= 6
    assert len(once) >= 30
    kept = tmp_path / "kept"
    shutil.copytree(moved, kept)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for number, (who, line) in enumerate(once):
        monkeypatch.chdir(elsewhere if number % 2 else tmp_path)
        assert main(shlex.split(line)[1:]) == Exit.DONE, (who, line)
        shutil.rmtree(moved)
        shutil.copytree(kept, moved)
    for line in {line for _, line in once}:
        main(shlex.split(line)[1:])
    assert "is missing" not in run("bom", moved).out


def test_what_gives_parts_their_numbers_works_as_proposed(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An edited table, the registration of a file or a folder, and the hints that a night leaves out."""
    monkeypatch.chdir(tmp_path)
    project = tmp_path / FOLDER
    shutil.move(gearbox.parent, project)
    top = project / gearbox.name
    ran = [
        run("diff", top),
        run("sync", project, "--verbose"),
        run("sync", project),
        run("sync", top),
        run("log", top),
        run("register", project, "--plan", "a table.csv", "--no-hardware", "--server", silo.client.base_url),
    ]
    lines = [line for one in ran for line in proposals(one.out + one.err)]
    assert len(lines) >= 5
    assert {line.split()[1] for line in lines} == {"register"}
    monkeypatch.chdir(project)
    for line in dict.fromkeys(lines):
        words = shlex.split(line)[1:]
        asked = [] if "--apply" in words else ["--yes"]  # a terminal would ask
        assert main([*words, *asked]) == Exit.DONE, line
    assert "--no-hardware" in lines[-1]
    run("sync", project)
    (hints,) = set(proposals(run("sync", project).out))
    assert main(shlex.split(hints)[1:]) == Exit.DONE


def test_what_makes_a_connection_works_as_proposed(
    run: Any, silo: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a token the address is that of the server that wants one."""
    monkeypatch.setenv("SILO_API_TOKEN", "")
    ran = run("search", "plate")
    (line,) = proposals(ran.err)
    assert main([*shlex.split(line)[1:], "--token", silo.token]) == Exit.DONE
    assert main(["logout"]) == Exit.DONE
    monkeypatch.setenv("SILO_API_TOKEN", "silo_wrong")
    (line,) = proposals(run("search", "plate").err)
    assert main([*shlex.split(line)[1:], "--json"]) == Exit.REMOTE
    monkeypatch.delenv("SILO_API_URL")
    found = list(proposals(run("search", "plate").err))
    assert [re.sub(r"^silo-mod ", "", line) for line in found] == ["serve", "login http://127.0.0.1:8080"]
