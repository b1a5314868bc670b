# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where the output goes: pipes that close, full disks, terminals without UTF-8, jobs without streams."""

from __future__ import annotations

import json
import os
import random
import shlex
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, locals_, part

SILO_MOD = shlex.join([sys.executable, "-m", "silo.cli.main"])
ASCII = {"PYTHONIOENCODING": "ascii"}


def shell(line: str, **env: str) -> subprocess.CompletedProcess[bytes]:
    """Run a line of shell; ``silo-mod`` in it is ours. ``pipefail`` shows the exit code of the first."""
    known = {name: value for name, value in os.environ.items() if name not in ("PYTHONUNBUFFERED", *ASCII)}
    return subprocess.run(
        ["bash", "-c", f'set -o pipefail; silo-mod() {{ {SILO_MOD} "$@"; }}; {line}'],
        capture_output=True,
        env={**known, **env},
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("option", ["", "--json", "--flat"])
def test_a_reader_that_has_seen_enough_is_no_failure(gearbox: Path, option: str) -> None:
    """``silo-mod bom … | head -1``."""
    ran = shell(f"silo-mod bom '{gearbox}' {option} | head -1")
    assert (ran.returncode, ran.stderr) == (0, b"")
    assert len(ran.stdout.splitlines()) == 1


FULL = pytest.mark.usefixtures("needs_dev_full")


@FULL
@pytest.mark.parametrize("option", ["", "--json", "--help"])
def test_a_full_disk_is_one_sentence(gearbox: Path, option: str) -> None:
    """And not exit code 0: the answer did not arrive."""
    ran = shell(f"silo-mod bom '{gearbox}' {option} > /dev/full")
    assert ran.returncode == 2
    assert len(ran.stderr.splitlines()) == 1


@FULL
@pytest.mark.parametrize("ending", ["| head -1", "> /dev/full"])
def test_a_sync_that_nobody_reads_is_done_to_its_end(silo: Any, run: Any, gearbox: Path, ending: str) -> None:
    """With its report: the output is for people, the work is what was asked for."""
    run("register", gearbox, "--yes")
    report = gearbox.parent / "report.md"
    options = f"--recursive --report '{report}' --server {silo.client.base_url} --token {silo.token}"
    ran = shell(f"silo-mod sync '{gearbox.parent}' {options} {ending}")
    assert ran.returncode == (0 if "head" in ending else 2), ran.stderr
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
        "import sys, time\nfrom silo.cli import bom, main\n"
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


def test_a_job_may_have_no_streams(gearbox: Path) -> None:
    """Nothing to print to, nobody to ask."""
    assert shell(f"silo-mod bom '{gearbox}' >&-").returncode == 0
    assert shell(f"silo-mod bom '{gearbox}' --json >&- 2>&-").returncode == 0
    ran = shell(f"silo-mod register '{gearbox}' <&-")
    assert ran.returncode == 2
    assert b"--yes" in ran.stderr


def test_a_terminal_without_utf_8(gearbox: Path, tmp_path: Path) -> None:
    """Text is shown as well as can be; JSON says the same everywhere."""
    folder = gearbox.parent.rename(tmp_path / "Getriebe ü &")
    ran = shell(f"silo-mod bom '{folder}/TopAssembly.FCStd'", **ASCII)
    assert ran.returncode == 0, ran.stderr
    assert b"1 ? Base Plate" in ran.stdout
    top = folder / "Größe.FCStd"
    (folder / "TopAssembly.FCStd").rename(top)
    plain = shell(f"silo-mod bom '{top}' --json")
    escaped = shell(f"silo-mod bom '{top}' --json", **ASCII)
    assert json.loads(plain.stdout) == json.loads(escaped.stdout)
    assert json.loads(plain.stdout)["assembly"]["doc_path"] == "Größe.FCStd"
    assert "Größe".encode() in plain.stdout
    assert escaped.stdout.isascii()


def test_a_file_name_that_is_no_text(gearbox: Path) -> None:
    """Names are bytes on Linux; JSON gives them as Python does, escaped."""
    strange = os.fsencode(gearbox.parent) + b"/caf\xe9.FCStd"
    try:
        os.rename(gearbox, strange)
    except OSError:
        pytest.skip("this file system wants names to be text")
    for option in ("--json", ""):
        words = [sys.executable, "-m", "silo.cli.main", "bom", strange, *([option] if option else [])]
        ran = subprocess.run(words, capture_output=True, timeout=120, check=False)
        assert ran.returncode == 0, ran.stderr


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
    """One finding that says so."""
    found = run("bom", gearbox.parent / "parts" / "Gear.FCStd", "--json").json()
    assert found["entries"] == []
    assert [finding["code"] for finding in found["findings"]] == ["empty_bom"]


@pytest.mark.parametrize("words", [["bom"], ["sync", "--dry-run"], ["diff"], ["register", "--yes"]])
def test_a_name_of_a_megabyte_does_not_fill_the_terminal(
    run: Any, silo: Any, tmp_path: Path, words: list[str]
) -> None:
    """A hostile file's name may have 60 MB: the beginning of it says enough."""
    name = random.Random(1).randbytes(500_000).hex()
    part("part", "Box", Label=name).save(tmp_path / "part.FCStd")
    top = Doc(label=name).link("L1", f"{name}.FCStd", "Box").link("L2", "part.FCStd", "Box")
    top.add("App::Part", "Top", Label=name, Group=locals_("L1", "L2"), Type="Assembly")
    done = run(words[0], top.save(tmp_path / "top.FCStd"), *words[1:])
    assert done.code == 1
    assert "there is no" not in done.err
    assert len(done.out) + len(done.err) < 50_000
