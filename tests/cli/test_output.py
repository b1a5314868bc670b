# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where the output goes: pipes that close, full disks, terminals without UTF-8, jobs without streams."""

from __future__ import annotations

import io
import json
import os
import random
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import pytest
from fcstd_writer import Doc, locals_, part

from silo.api.wire import Draft, MergeResult
from silo.bom.entry import BomEntry
from silo.bom_sync.resolved import Resolved
from silo.bom_sync.steps import Outcome, Status
from silo.cli.main import main
from silo.cli.sync_display import outcome_text

SILO_MOD = shlex.join([sys.executable, "-m", "silo.cli.main"])


def into(stream: IO[Any] | None, *words: object) -> int:
    """Run a command whose standard output is this stream; return its exit code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", stream)
        code = main([str(word) for word in words])
        if stream is None:  # it was replaced by one that takes anything
            sys.stdout.close()
        return code


def bytes_in(encoding: str, *words: object) -> bytes:
    """Return what a command prints on a terminal of that encoding."""
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding)
    assert into(stream, *words) == 0
    stream.flush()
    return raw.getvalue()


def sentences(errors: str) -> list[str]:
    """Return the lines of standard error, but for those that a slow machine gets about the progress."""
    return [line for line in errors.splitlines() if not line.startswith("silo-mod bom: ")]


@contextmanager
def closed_pipe() -> Iterator[IO[str]]:
    """Open the output of a program whose reader is gone, as after ``| head -1``."""
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "w", encoding="utf-8") as stream:
        yield stream


@pytest.mark.usefixtures("needs_dev_full")
def test_output_that_arrives_nowhere_in_a_shell(gearbox: Path) -> None:
    """``silo-mod bom … | head -1`` is no failure, a full disk is one sentence: the answer did not arrive.

    Python itself writes nothing at the end of the process that would fail again.
    """
    for line, code, out, err in (
        (f"{SILO_MOD} bom '{gearbox}' --json | head -1", 0, 1, 0),
        (f"{SILO_MOD} bom '{gearbox}' > /dev/full", 2, 0, 1),
    ):
        command = ["bash", "-c", f"set -o pipefail; {line}"]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        assert ran.returncode == code
        assert (len(ran.stdout.splitlines()), len(sentences(ran.stderr))) == (out, err)


@pytest.mark.usefixtures("needs_dev_full")
@pytest.mark.parametrize("option", ["--flat", "--json", "--help"])
def test_output_that_arrives_nowhere(gearbox: Path, option: str, capsys: pytest.CaptureFixture[str]) -> None:
    with closed_pipe() as stream:
        assert into(stream, "bom", gearbox, option) == 0
    assert sentences(capsys.readouterr().err) == []
    with open("/dev/full", "w", encoding="utf-8") as full:
        assert into(full, "bom", gearbox, option) == 2
    assert len(sentences(capsys.readouterr().err)) == 1


@pytest.mark.usefixtures("needs_dev_full", "registered")
@pytest.mark.parametrize("full", [False, True])
def test_a_sync_that_nobody_reads_is_done_to_its_end(silo: Any, gearbox: Path, full: bool) -> None:
    """With its report: the output is for people, the work is what was asked for."""
    report = gearbox.parent / "report.md"
    with open("/dev/full", "w", encoding="utf-8") if full else closed_pipe() as stream:
        code = into(stream, "sync", gearbox.parent, "--recursive", "--report", report)
    assert code == (2 if full else 0)
    assert "files in order" in report.read_text()
    made = silo.client.search_items(item_type="assembly")
    assert made
    assert all(silo.client.get_bom(item["part_number"]) for item in made)


def test_watch_ends_with_its_reader(silo: Any) -> None:
    """It has no end of its own: ``silo-mod watch | head -1`` is over with the event after that one."""
    watch = f"{SILO_MOD} watch --json --server {silo.client.base_url} --token {silo.token} | head -1"
    with subprocess.Popen(["bash", "-c", watch], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as shell:
        for number in range(100):  # it may not listen yet at the first ones
            silo.client.create_item("kindred-rd", "F01", f"Screw {number}")
            with suppress(subprocess.TimeoutExpired):
                shell.wait(timeout=0.5)
                break
        assert shell.stdout is not None
        assert json.loads(shell.stdout.read())["id"]
        assert shell.returncode == 0


@pytest.mark.usefixtures("needs_signals")
def test_a_term_signal_ends_a_command_as_ctrl_c_does(tmp_path: Path) -> None:
    """Exit code 130, with a sentence: nobody takes it for done."""
    (tmp_path / "x.FCStd").touch()
    code = (
        "import sys, time\nfrom silo.cli import main\nfrom silo.cli.files import bom\n"
        "bom.run_bom = lambda args: (print('up', flush=True), time.sleep(60))\n"
        "sys.argv = ['silo-mod', 'bom', 'x.FCStd']\nsys.exit(main.main())"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path
    ) as job:
        assert job.stdout is not None
        assert job.stderr is not None
        assert job.stdout.readline() == b"up\n"
        job.terminate()
        assert job.stderr.read() == b"\nCancelled.\n"
    assert job.returncode == 130


def test_a_job_may_have_no_streams(
    gearbox: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing to print to, nobody to ask."""
    monkeypatch.setattr(sys, "stdin", None)
    assert main(["register", str(gearbox)]) == 2
    assert "--yes" in capsys.readouterr().err
    sys.stdin.close()
    monkeypatch.setattr(sys, "stderr", None)
    assert into(None, "bom", gearbox) == into(None, "bom", gearbox, "--json") == 0
    sys.stderr.close()


def test_a_terminal_without_utf_8(gearbox: Path, tmp_path: Path) -> None:
    """Text is shown as well as can be; JSON says the same everywhere."""
    folder = gearbox.parent.rename(tmp_path / "Getriebe ü &")
    assert b"1 ? Base Plate" in bytes_in("ascii", "bom", folder / gearbox.name)
    top = (folder / gearbox.name).rename(folder / "Größe.FCStd")
    plain, escaped = (bytes_in(encoding, "bom", top, "--json") for encoding in ("utf-8", "ascii"))
    assert json.loads(plain) == json.loads(escaped)
    assert json.loads(plain)["assembly"]["doc_path"] == "Größe.FCStd"
    assert "Größe".encode() in plain
    assert escaped.isascii()


def test_a_file_name_that_is_no_text(gearbox: Path) -> None:
    """Names are bytes on Linux; JSON gives them as Python does, escaped."""
    strange = Path(os.fsdecode(os.fsencode(gearbox.parent) + b"/caf\xe9.FCStd"))
    try:
        gearbox.rename(strange)
    except OSError:
        pytest.skip("this file system wants names to be text")
    assert json.loads(bytes_in("utf-8", "bom", strange, "--json"))["assembly"]["doc_path"] == strange.name
    assert b"Top Assembly" in bytes_in("utf-8", "bom", strange)


def test_a_report_that_cannot_be_written_is_one_sentence(run: Any, silo: Any, gearbox: Path) -> None:
    """It names the file."""
    ran = run("sync", gearbox, "--report", gearbox.parent / "no" / "report.md")
    assert ran.code == 2
    assert "report.md" in ran.err
    assert "Traceback" not in ran.err


@pytest.mark.usefixtures("needs_symlinks")
def test_paths_are_those_of_the_caller(
    run: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Relative, from another folder, through a symlink: the same BOM, reported relative to the top file."""
    told = run("bom", gearbox, "--json").out
    monkeypatch.chdir(tmp_path)
    assert run("bom", gearbox.relative_to(tmp_path), "--json").out == told
    assert run("bom", Path("gearbox") / ".." / "gearbox" / gearbox.name, "--json").out == told
    monkeypatch.chdir(gearbox.parent / "parts")
    assert run("bom", Path("..") / gearbox.name, "--json").out == told
    (tmp_path / "way").symlink_to(gearbox.parent)
    assert run("bom", tmp_path / "way" / gearbox.name, "--json").out == told


def test_a_part_has_an_empty_bom_and_nothing_beside(run: Any, gearbox: Path) -> None:
    """One finding that says so: the file is one part, and no assembly."""
    found = run("bom", gearbox.parent / "parts" / "Gear.FCStd", "--json").json()
    assert found["entries"] == []
    assert [(finding["code"], finding["severity"]) for finding in found["findings"]] == [("one_part", "info")]


def test_a_name_of_a_megabyte_does_not_fill_the_terminal(run: Any, silo: Any, tmp_path: Path) -> None:
    """A hostile file's name may have 60 MB: the beginning of it says enough."""
    name = random.Random(1).randbytes(500_000).hex()
    part("part", "Box", Label=name).save(tmp_path / "part.FCStd")
    top = Doc(label=name).link("L1", f"{name}.FCStd", "Box").link("L2", "part.FCStd", "Box")
    top.add("App::Part", "Top", Label=name, Group=locals_("L1", "L2"), Type="Assembly")
    path = top.save(tmp_path / "top.FCStd")
    for words in (["bom"], ["sync", "--dry-run"], ["diff"], ["register", "--yes"]):
        done = run(words[0], path, *words[1:])
        assert done.code == 1
        assert "there is no" not in done.err
        assert len(done.out) + len(done.err) < 50_000


def test_an_outcome_says_which_draft_it_is_part_of() -> None:
    """Before the first release it says nothing, in one line."""
    top = Resolved(BomEntry("asm/Top.FCStd", object_name="Top", label="Top"), (), (), ())
    result = MergeResult(draft=Draft(label="C", released="B"))
    told = [str(outcome_text(Outcome(Status.MERGED, top, result=one), "")) for one in (MergeResult(), result)]
    assert [text.count("\n") for text in told] == [0, 1]
    assert told[1].endswith("\n  This is part of draft C. Revision B stays released as it is.")
