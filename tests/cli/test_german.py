# SPDX-License-Identifier: LGPL-2.1-or-later
"""The command line in German: what people read is translated, what machines read is not."""

from __future__ import annotations

import argparse
import ast
import json
import re
from pathlib import Path
from typing import Any

import pytest

import silo
from silo import spoken
from silo.bom.findings import FindingCode
from silo.bom.message import Message
from silo.cli.command_table import THEMES
from silo.cli.parser import build_parser

CLI = Path(silo.__file__).parent / "cli"
SAID = ("spoken", "caption", "message", "counted_message")
WORDS = re.compile(r"[A-Za-z]{2}\b")


@pytest.fixture
def german(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SILO_LANGUAGE", "de")
    monkeypatch.setenv("COLUMNS", "80")


def parsers() -> dict[str, argparse.ArgumentParser]:
    (commands,) = (
        action for action in build_parser()._actions if isinstance(action, argparse._SubParsersAction)
    )
    return dict(commands.choices)


def test_help_is_german_and_80_columns_wide(german: None, run: Any) -> None:
    """But for examples, which are copied, and groups of options, which argparse never breaks."""
    for command in ("", *(command for commands in THEMES.values() for command in commands)):
        ran = run(*filter(None, (command, "--help")))
        assert ran.code == 0
        assert ran.out.startswith("Aufruf: silo-mod")
        assert "diese Hilfe zeigen" in ran.out
        assert f"Beispiel:\n  silo-mod {command}" in ran.out or not command
        for line in ran.out.splitlines():
            assert len(line) <= 80 or line.startswith(("  silo-mod ", " " * len("Aufruf: silo-mod"))), line


def test_each_help_is_translated(german: None) -> None:
    for command, parser in parsers().items():
        for action in parser._actions:
            text = action.help or ""
            hidden = not text or text == argparse.SUPPRESS
            assert hidden or spoken(text) != text, (command, text)
        for group in parser._action_groups:
            assert spoken(group.title or "") != group.title or group.title == "Server", group.title


def test_errors_are_german_for_people_and_english_for_machines(german: None, run: Any) -> None:
    """The exit code is the same."""
    ran = run("bom", "nothing.FCStd", "--json")
    assert ran.code == 2
    assert json.loads(ran.out)["error"]["message"].endswith("nothing.FCStd: there is no such file")
    assert "diese Datei gibt es nicht" in ran.err
    assert "unbekannte Argumente: --flatt; ist --flat gemeint?" in run("bom", "x", "--flatt").err
    assert "keine FreeCAD-Dateien" in run("sync", str(CLI)).err


def test_tables_and_findings_are_german(german: None, run: Any, gearbox: Path) -> None:
    (gearbox.parent / "parts" / "Cover.FCStd").unlink()
    ran = run("bom", gearbox, "--flat")
    assert ran.code == 1
    assert "Teilenummer" in ran.out
    assert "fehlt" in ran.out
    assert re.search(r"✗ Die Datei \S*Cover.FCStd fehlt; verwendet von Cover", ran.out)
    assert "missing" not in ran.out
    rows = run("bom", gearbox, "--csv", "-").out.splitlines()
    assert rows[0] == "level,part number,name,values,quantity,unit,standard,file,object,missing"
    found = run("bom", gearbox, "--json").json()["findings"]
    assert any("is missing; used by" in finding["message"] for finding in found)


@pytest.mark.usefixtures("synced")
def test_the_order_list_is_german(german: None, run: Any, silo: Any, gearbox: Path) -> None:
    """Headings, kinds, remarks and the end, where one is no plural; names stay."""
    number = run("bom", gearbox, "--resolve", "--json").json()["assembly"]["part_number"]
    first, other = [row["part_number"] for row in run("order", number, "--json").json()["parts"][:2]]
    terms = {"supplier": "Needed", "standard_cost": 0.5, "lead_time_days": 1}
    silo.client.update_item(first, properties=terms)
    silo.client.update_item(other, properties={"supplier": "Norelem"})
    text = run("order", number).out
    heads = next(line for line in text.splitlines() if "Teilenummer" in line)
    wanted = "Teilenummer Name Benötigt Bestellt Menge Lieferant Dessen Nummer Kosten"
    assert " ".join(heads.split()) == wanted
    assert ("gekauft" in text, "nicht gesagt" in text, "bought" in text, "unsaid" in text) == (1, 1, 0, 0)
    assert re.search(r"\d+ zu 0.5 EUR +Needed", text)
    assert "kein Preis" in text
    end = r"Kosten: [\d.]+ EUR, nicht bekannt für 6 Teile\nLängste Lieferzeit: 1 Tag$"
    assert re.search(end, text.strip()), text


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"LANG": "de_DE.UTF-8"}, "nicht in Silo"),
        ({"LANG": "de_DE.UTF-8", "LC_ALL": "C.UTF-8"}, "not in Silo"),
        ({"LANG": "en_GB.UTF-8", "LC_MESSAGES": "de_AT"}, "nicht in Silo"),
        ({"LC_ALL": "de_DE", "SILO_LANGUAGE": "en"}, "not in Silo"),
        ({"LANG": "en_US.UTF-8", "LANGUAGE": "de:en"}, "nicht in Silo"),
        ({"LANG": "de_DE.UTF-8", "LANGUAGE": "en_GB:de"}, "not in Silo"),
        ({"LANG": "C", "LANGUAGE": "de"}, "not in Silo"),
        ({"LANG": "fr_FR.UTF-8"}, "not in Silo"),
        ({}, "not in Silo"),
    ],
)
def test_the_language_is_that_of_the_environment(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], said: str
) -> None:
    for name in ("SILO_LANGUAGE", "LANGUAGE", "LC_ALL", "LC_MESSAGES", "LANG"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert spoken("not in Silo") == said


def test_masses_are_german_for_people_and_english_for_machines(german: None, run: Any) -> None:
    """Headings, where a mass comes from, and warnings."""
    arm = Path(__file__).parents[2] / "examples" / "arm" / "arm.step"
    out = run("inertia", arm).out
    assert "Es gibt keine Stückliste; die vorgegebene Dichte (1000 kg/m³) wurde verwendet" in out
    assert not {"Part", "warnings", "whole", "default", "mass"} & set(re.findall(r"\w+", out))
    assert "There is no BOM" in run("inertia", arm, "--json").out
    missing = run("inertia", arm.with_name("none.step"))
    assert (missing.code, "kann nicht geöffnet werden" in missing.err) == (2, True)


def test_texts_of_the_pane_are_german_on_the_command_line_too(german: None) -> None:
    """What both show stands in a call for Qt."""
    for text in (
        "out of date",
        "Its file is being copied.",
        "It is meant for a.example.com, which is not the server in use.",
    ):
        assert spoken(text) != text


def test_english_reads_no_catalogue(run: Any) -> None:
    silo._catalogue.cache_clear()
    assert run("--help").code == 0
    assert run("bom", "nothing.FCStd").code == 2
    assert silo._catalogue.cache_info().currsize == 0


def test_sentences_of_several_parts_are_german_as_a_whole(german: None) -> None:
    """What is made of a list, and of a count."""
    assert spoken("BOM updated: 1 added, 2 unreferenced, 1 in conflict") == (
        "Stückliste erneuert: 1 hinzugekommen, 2 nicht verwendet, 1 im Konflikt"
    )


def test_names_stay(german: None) -> None:
    """A part may be called as a word of ours, and look like the beginning or the end of a sentence."""
    for name in ("missing", "Open frame", "server", "cover moved", "a: b", "in Silo", "x (file)", "…"):
        said = spoken(f"The file {name}.FCStd is missing; used by {name}, {name} 2.")
        assert said == f"Die Datei {name}.FCStd fehlt; verwendet von {name}, {name} 2."


def test_names_that_look_like_our_sentences_stay(german: None) -> None:
    """In a finding, and in the suggestion behind it."""
    for name in (
        "used by b",
        "same part",
        "The file A is missing; used by B. Did you mean C",
        "{file}",
        "%s",
    ):
        code = FindingCode.MISSING_FILE
        values = {"text": Message(code.sentence, {"file": name}), "tail": Message(code.tail, {"users": name})}
        said = spoken(Message("{text}; {tail}.", values))
        assert said == f"Die Datei {name} fehlt; verwendet von {name}."


def test_each_finding_is_german(german: None) -> None:
    for code in FindingCode:
        assert spoken(code.meaning) != code.meaning
        for text in filter(None, (code.sentence, code.tail)):
            named = {name: f"<{name.upper()}>" for name in re.findall(r"{(\w+)}", text)}
            said = spoken(Message(text, named))
            assert said != text.format(**named)
            for value in named.values():
                assert said.count(value) == text.format(**named).count(value), said


def test_what_the_command_line_prints_goes_through_the_catalogue() -> None:
    """Headings, marks and prompts are said; standard error, and sentences on a console, are said there."""
    found = []
    for path in sorted(CLI.rglob("*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        said = {
            id(inner)
            for call in ast.walk(tree)
            if isinstance(call, ast.Call)
            and getattr(call.func, "id", "") in ("spoken", "message", "caption", "counted_message")
            for inner in ast.walk(call)
        }
        for node in ast.walk(tree):  # keys are no texts
            if isinstance(node, ast.Subscript | ast.Dict):
                said.update(map(id, node.keys if isinstance(node, ast.Dict) else [node.slice]))
        for call in ast.walk(tree):
            if not isinstance(call, ast.Call):
                continue
            name = getattr(call.func, "attr", getattr(call.func, "id", ""))
            to_errors = any(given.arg == "file" for given in call.keywords)
            plain = isinstance(call.func, ast.Name) and name == "print" and not to_errors
            styled = name == "append" and len(call.args) == 2
            if plain or styled or name in ("Text", "add_column", "input", "getpass"):
                for one in ast.walk(call.args[0]) if call.args else ():
                    if not isinstance(one, ast.Constant) or not isinstance(one.value, str):
                        continue
                    if WORDS.search(one.value) and id(one) not in said:
                        found.append(f"{path.name}:{one.lineno}: {one.value}")
    assert [text for text in found if not re.search(r"silo-mod( \(not installed\))?", text)] == []
