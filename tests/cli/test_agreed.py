# SPDX-License-Identifier: LGPL-2.1-or-later
"""What all commands agree on: exit codes, and JSON by a schema."""

from __future__ import annotations

import argparse
import json
import re
import shutil
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest
from fault_proxy import FAULTS, fault_proxy

from silo.bom.errors import Exit
from silo.cli.command_table import THEMES
from silo.cli.json_schemas import NAMES, schema_of
from silo.cli.main import main
from silo.cli.parser import build_parser, command_parsers
from silo.files import documents_in

DOCS = Path(__file__).parents[2] / "docs"


def parsers() -> dict[str, argparse.ArgumentParser]:
    return command_parsers(build_parser())


# Every command that is given a file or folder that must be there, and where in its words it stands.
WITH_PATHS = {
    "bom": "bom @",
    "diff": "diff @",
    "bom-diff": "bom-diff @ @",
    "where-used": "where-used part.FCStd --root @",
    "relink": "relink @ --from a --to b",
    "sync": "sync @",
    "commit": "commit @",
    "status": "status @",
    "register": "register @ --yes",
    "log": "log @",
    "restore": "restore @ --dry-run",
    "import": "import parts @",
    "inertia": "inertia @",
    "links": "links @",
    "mass": "mass @",
}
WITHOUT_PATHS = {
    *("pull", "serve", "backup", "summaries", "watch", "login", "doctor", "install-addon", "demo", "schema"),
    *("search", "show", "order", "whoami", "logout", "completion", "queue", "help"),
}


def test_every_command_is_in_the_tables() -> None:
    assert set(WITH_PATHS) | WITHOUT_PATHS == set(parsers())


@pytest.mark.parametrize("command", WITH_PATHS)
def test_a_path_that_is_nowhere_is_bad_input_everywhere(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    """One code for all, before a server is asked; a sentence with the name; nothing on standard output, but
    with --json an object.
    """
    monkeypatch.chdir(tmp_path)
    for path in ("nowhere.FCStd", "no/where", "-", ""):
        words = [path if word == "@" else word for word in WITH_PATHS[command].split()]
        done = run(*words)
        assert (done.code, done.out) == (Exit.BAD_INPUT, ""), done
        assert (path or "''") in done.err
    if "--json" in parsers()[command]._option_string_actions:
        refused_as_json(run(*words, "--json"))


def refused_as_json(ran: Any) -> None:
    """The error is an object on standard output, where a program reads; its sentence is on standard error."""
    assert ran.code == Exit.BAD_INPUT
    told = json.loads(ran.out)["error"]
    assert told["code"] == "bad_input"
    assert told["message"] in ran.err


def declared(how: str) -> list[tuple[str, str, str]]:
    """Return (command, option, the others) of each ``needs`` or ``excludes``."""
    return [(name, *pair) for name, parser in parsers().items() for pair in parser.get_default(how) or ()]


IDLE, BESIDE = declared("needs"), declared("excludes")


def test_an_option_that_would_do_nothing_is_refused(run: Any) -> None:
    """Who wrote --dry-run, and got a run that sends nothing anyway, learns it the next time with --push; a
    flat list was asked for, and --verify printed the tree.
    """
    for command, option, needed in IDLE:
        done = run(command, "x.FCStd", *_words(command, option))
        assert (done.code, done.out) == (Exit.BAD_INPUT, "")
        assert f"{option} does nothing without {needed.replace(' ', ' or ')}" in done.err
    for command, option, other in BESIDE:
        done = run(command, "x.FCStd", *_words(command, option), *_words(command, other))
        assert done.code == Exit.BAD_INPUT
        assert f"{option} does nothing with {other}" in done.out + done.err
        assert "--json" in (option, other) or done.out == ""


def _words(command: str, option: str) -> list[str]:
    action = parsers()[command]._option_string_actions[option]
    if action.nargs == 0:
        return [option]
    return [option, next((choice for choice in action.choices or () if choice != action.default), "1")]


def test_which_options_exclude_another() -> None:
    reading = ("--index", "--no-cache", "--jobs", "--dask")
    assert {(command, other, option) for command, option, other in BESIDE} == {
        *(("bom", "--verify", one) for one in ("--flat", "--resolve", "--csv", "--xlsx", "--why", *reading)),
        *(("bom", "--why", one) for one in ("--flat", "--resolve", "--csv", "--xlsx", "--json", *reading)),
        *(("register", "--undeclare", option) for option in ("--declare", "--category", "--not-a-part")),
        *(("register", "--not-a-part", option) for option in ("--declare", "--category")),
        ("register", "--apply", "--category"),
        *(
            ("register", decided, option)
            for decided in ("--count-hidden", "--reference")
            for option in ("--declare", "--undeclare", "--not-a-part", "--category")
        ),
        *(("restore", "--test", option) for option in ("--replace-database", "--dry-run")),
        *(("restore", "--dry-run", option) for option in ("--replace-database", "--database", "--files")),
    }


def test_which_options_need_another() -> None:
    found = {(command, needed, option) for command, option, needed in IDLE}
    weighing = ("inertia", "mass")
    assert found == {
        ("register", "--yes", "--duplicates"),
        ("log", "--since", "--until"),
        *(("order", "--csv --xlsx", option) for option in ("--kind", "--supplier", "--layout")),
        ("register", "--declare", "--apart"),
        *((command, "--strict", "--allow") for command in weighing),
        *(
            (command, "--push", option)
            for command in weighing
            for option in ("--dry-run", "--item", "--server", "--token")
        ),
        ("mass", "--push", "--index"),
        ("bom", "--resolve", "--server"),
        ("bom", "--resolve", "--token"),
        *(
            (command, "--bom", option)
            for command in weighing
            for option in ("--column", "--encoding", "--delimiter", "--decimal", "--mass-unit")
        ),
    }


def test_an_option_is_one_word_and_means_one_thing() -> None:
    """No second spelling, and the same kind of value in each command."""
    kinds: dict[str, set[tuple[Any, Any]]] = {}
    for parser in parsers().values():
        for action in parser._actions:
            if action.help == argparse.SUPPRESS:  # a name of the last release
                continue
            long = [name for name in action.option_strings if name.startswith("--")]
            assert len(long) <= 1, long
            for name in long:
                kinds.setdefault(name, set()).add((action.nargs, action.metavar))
    assert {name: found for name, found in kinds.items() if len(found) > 1} == {}


def test_no_option_can_be_shortened() -> None:
    """``sync --all`` would mean --allow-missing."""
    assert not [name for name, parser in parsers().items() if parser.allow_abbrev]


REFUSED = {
    **{
        f"{words} --assembly Top": "name the file"
        for words in ("bom FOLDER", "diff FOLDER", "sync FOLDER", "register FOLDER --yes")
    },
    "bom FOLDER --verify": "name the file",
    "register FOLDER --plan - --json": "leave out --json",
    "pull A01-4711": "there is no item A01-4711 on http",
    "watch --item A01-4711": "there is no item A01-4711 on http",  # it would wait for its events forever
}


def test_what_contradicts_itself_or_means_nothing_is_refused(run: Any, silo: Any, tmp_path: Path) -> None:
    """With a sentence, and nothing on standard output, where a program may read."""
    for words, why in REFUSED.items():
        done = run(*(tmp_path if word == "FOLDER" else word for word in words.split()))
        assert done.code == Exit.BAD_INPUT
        assert why in done.out + done.err
        assert "--json" in words or done.out == ""


def test_a_misspelt_file_is_used_by_nobody_and_that_is_no_answer(run: Any, gearbox: Path) -> None:
    """Who reads "No file links to it" deletes the file; one that is gone, and linked to, is answered."""
    done = run("where-used", gearbox.parent / "parts" / "Cvoer.FCStd", "--root", gearbox.parent)
    assert (done.code, done.out) == (Exit.BAD_INPUT, "")
    assert "did you mean parts/Cover.FCStd" in done.err
    (gearbox.parent / "parts" / "Cover.FCStd").unlink()
    done = run("where-used", gearbox.parent / "parts" / "Cover.FCStd", "--root", gearbox.parent)
    assert (done.code, "TopAssembly.FCStd" in done.out) == (Exit.DONE, True)


def test_an_assembly_without_a_number_cannot_be_compared(run: Any, silo: Any, gearbox: Path) -> None:
    """1 with --check and without, for a file and for a folder."""
    for words in ([gearbox], [gearbox, "--check"], [gearbox.parent]):
        assert run("diff", *words).code == Exit.UNDONE


@pytest.mark.usefixtures("registered")
def test_sync_does_nothing_where_one_of_its_files_is_not_there(run: Any, silo: Any, gearbox: Path) -> None:
    """A typing mistake is found before the first merge, all of them at once."""
    done = run("sync", gearbox, "nowhere.FCStd", "nirgends.FCStd")
    assert done.code == Exit.BAD_INPUT
    assert "nowhere" in done.err
    assert "nirgends" in done.err
    assert not any(silo.client.get_bom(item.part_number) for item in silo.client.search_items())


def test_the_codes_stand_in_one_table() -> None:
    """docs/headless.md has each code of the enum once, in its order."""
    page = (DOCS / "headless.md").read_text("utf-8")
    codes = re.findall(r"^\| (\d+) \|", page, re.MULTILINE)
    assert codes == [str(int(code)) for code in Exit]


@pytest.mark.usefixtures("synced")
def test_diff_says_nothing_of_agreement_where_a_file_is_missing(run: Any, silo: Any, gearbox: Path) -> None:
    """Nobody knows what the missing file holds: 1, with --check and without, for a file and for a folder."""
    shutil.move(next(gearbox.parent.rglob("*Cover*.FCStd")), gearbox.parent.parent)
    for words in ([gearbox], [gearbox.parent]):
        for command in (["bom"], ["diff"], ["diff", "--check"]):
            codes = [run(*command, *words, *allow).code for allow in ((), ("--allow-missing",))]
            assert codes == [Exit.UNDONE, Exit.DONE], (command, words)
    for words in ([gearbox], [gearbox.parent], [gearbox, "--check"]):
        done = run("diff", *words)
        assert done.code == Exit.UNDONE
        assert "No differences" not in done.out
        assert "no differences" not in done.out


def test_every_command_that_prints_data_prints_json_by_a_schema() -> None:
    """The demo prints a story for people, completion a script."""
    with_json = {name for name, one in parsers().items() if "--json" in one._option_string_actions}
    assert with_json == set(NAMES)
    assert set(parsers()) - with_json == {"demo", "completion", "help"}
    for name in NAMES:  # a key more is an error, so that no key comes in without its description
        assert not jsonschema_rs.validator_for(schema_of(name)).is_valid({"surprise": 1}), name


def test_schemas_are_printed(run: Any) -> None:
    assert run("schema").out.split() == list(NAMES)
    assert run("schema", "--json").json() == {"items": list(NAMES), "total": len(NAMES)}
    assert '"$schema"' in run("schema", "inertia").out
    assert run("schema", "bmo").code == Exit.BAD_INPUT


@pytest.mark.usefixtures("needs_symlinks")
def test_a_file_named_in_several_ways_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first way is the one that is shown."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "v" / "w").mkdir(parents=True)
    (tmp_path / "v" / "A.FCStd").touch()
    (tmp_path / "link.FCStd").symlink_to("v/A.FCStd")
    (tmp_path / "u").symlink_to("v")
    ways = [
        "v/A.FCStd",
        "./v/A.FCStd",
        "v/w/../A.FCStd",
        str(tmp_path / "v" / "A.FCStd"),
        "link.FCStd",
        *("u", "v", "v/."),
    ]
    assert documents_in(ways) == ["v/A.FCStd"]


def test_a_count_is_a_number_above_zero(run: Any) -> None:
    """Nothing is done, and the sentence names the option."""
    for words in ("watch --count", "log a.FCStd --limit", "pull A01-0001 --revision", "bom a --jobs"):
        for count in ("0", "-1", "1,000", "1e3", "", "9" * 5000):
            done = run(*words.split(), count)
            assert done.code == Exit.BAD_INPUT
            assert f"argument {words.split()[-1]}" in done.err


def test_help_is_a_command_too(run: Any) -> None:
    """The list of all; the options of one; and a mistyped name is answered with the right one."""
    assert run("help").out == run("--help").out
    assert run("help", "sync").out == run("sync", "--help").out
    done = run("help", "snyc")
    assert (done.code, done.out) == (Exit.BAD_INPUT, "")
    assert "did you mean sync" in done.err


def test_silo_mod_alone_lists_every_command_by_theme(run: Any) -> None:
    """Each once, with the words of its own help."""
    assert main([]) == Exit.DONE
    assert sorted(name for names in THEMES.values() for name in names) == sorted(parsers())


@pytest.mark.parametrize(
    ("words", "meant"),
    [(["bm"], "bom"), (["sync", ".", "--recusive"], "--recursive"), (["completion", "bsh"], "bash")],
)
def test_a_wrong_word_is_answered_with_the_right_one(
    words: list[str], meant: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == Exit.BAD_INPUT
    assert f"did you mean {meant}" in capsys.readouterr().err


def test_with_json_a_wrong_option_or_a_disk_that_says_no_is_an_object_too(
    run: Any, gearbox: Path, tmp_path: Path
) -> None:
    """A program that reads standard output learns what was wrong with its words."""
    for command in NAMES:
        for wrong in ("--no-such-option", "--assembly"):
            ran = run(command, "x.FCStd", "--json", wrong)
            refused_as_json(ran)
            assert "usage: silo-mod" in ran.err
    arm = Path(__file__).parents[2] / "examples" / "arm" / "arm.step"
    (tmp_path / "taken").mkdir()
    refused_as_json(run("links", arm, "--json", "--out", tmp_path / "taken"))


# Commands that ask no server.
LOCAL = ("mass", "inertia", "links")
# Commands that take other paths, or no file of FreeCAD's and no server that somebody else runs.
ELSEWHERE = {
    *("serve", "backup", "restore", "summaries", "demo", "login", "logout", "install-addon", "completion"),
    "help",
    *("schema", "bom-diff", "relink", "import"),
}
# Commands that read a file or ask a server, as docs/headless.md lists them.
FAULTY = {
    **{
        name: WITH_PATHS[name]
        for name in ("bom", "diff", "sync", "commit", "status", "register", "log", *LOCAL)
    },
    "where-used": "where-used @ --root .",
    "bom --resolve": "bom @ --resolve",
    "pull": "pull A01-0001",
    "search": "search plate",
    "show": "show A01-0001",
    "order": "order A01-0001",
    "whoami": "whoami",
    "doctor": "doctor",
    "queue retry": "queue retry",
    "watch": "watch --count 1",
}


@pytest.mark.usefixtures("synced")
def test_exit_codes_are_those_of_the_table(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Commands by faults; no fault is a stack trace."""
    assert {line.split()[0] for line in FAULTY.values()} | ELSEWHERE == set(parsers())
    url = silo.client.base_url
    damaged = tmp_path / "damaged.FCStd"
    damaged.write_bytes(gearbox.read_bytes()[:2000])
    lacking = tmp_path / "lacking"
    shutil.copytree(gearbox.parent, lacking)
    (lacking / "parts" / "Cover.FCStd").unlink()
    monkeypatch.chdir(tmp_path)
    with fault_proxy(url) as proxy:
        proxy.fault = FAULTS["500"]
        faults = {
            "no such file": (Path("nowhere.FCStd"), url, silo.token),
            "damaged file": (damaged, url, silo.token),
            "linked file gone": (lacking / gearbox.name, url, silo.token),
            "no server named": (gearbox, "", silo.token),
            "no address": (gearbox, "ftp://x", silo.token),
            "server away": (gearbox, "http://127.0.0.1:9", silo.token),
            "token refused": (gearbox, url, "silo_wrong"),
            "server fails": (gearbox, proxy.url, silo.token),
        }
        rows = [f"| | {' | '.join(faults)} |", "|---" * (len(faults) + 1) + "|"]
        for command, line in FAULTY.items():
            codes = []
            for path, address, token in faults.values():
                about_server = path == gearbox
                if (
                    about_server
                    if command in (*LOCAL, "bom-diff", "where-used")
                    else not about_server and "@" not in line
                ):
                    codes.append("–")
                    continue
                monkeypatch.setenv("SILO_API_URL", address)
                monkeypatch.setenv("SILO_API_TOKEN", token)
                ran = run(*(path if word == "@" else word for word in line.split()))
                assert "Traceback" not in ran.err
                codes.append(str(ran.code))
            rows.append(f"| `{command}` | {' | '.join(codes)} |")
    page = (DOCS / "headless.md").read_text("utf-8")
    assert "\n".join(rows) in page, "\n".join(rows)


@pytest.mark.usefixtures("registered")
def test_several_files_are_taken_one_after_the_other(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path
) -> None:
    """The worst exit code; with --json a list; a file that is not there stops all."""
    inner = gearbox.with_name("Gearbox.FCStd")
    ran = run("bom", gearbox, inner, "--json")
    told = json.loads(ran.out)["items"]
    assert [one["assembly"]["doc_path"] for one in told] == [gearbox.name, inner.name]
    assert told[1] == run("bom", inner, "--json").json()
    empty = tmp_path / "empty.FCStd"
    empty.write_bytes(b"")
    ran = run("diff", gearbox, empty, inner, "--json")
    told = json.loads(ran.out)["items"]
    assert (ran.code, len(told), told[1]["error"]["code"]) == (Exit.BAD_INPUT, 3, "bad_document"), ran
    assert str(empty) in ran.err
    numbers = [item.part_number for item in silo.client.search_items("", limit=2)]
    assert run("show", *numbers).out.count("/items/") == 2
    assert run("bom", gearbox, "nowhere.FCStd").out == ""
    parts = [gearbox.parent / "parts" / f"{name}.FCStd" for name in ("Cover", "Gear")]
    told = json.loads(run("where-used", *parts, "--root", gearbox.parent, "--json").out)["items"]
    assert [one["part"] for one in told] == ["parts/Cover.FCStd", "parts/Gear.FCStd"]
    ran = run("bom", gearbox, inner, "--csv", "-")
    assert (ran.code, ran.out) == (Exit.BAD_INPUT, "")
    assert "--csv is for one" in ran.err
