# SPDX-License-Identifier: LGPL-2.1-or-later
"""``bom --verify`` in each FreeCAD: where it agrees with the view, and where it does not."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from freecad_cases import corpora, machines
from freecad_cases.machines import MOSTLY_ENDS, WANTED

from silo.bom.entry import Extraction
from silo.cli.main import main
from silo.freecads.run import run_freecad

pytestmark = pytest.mark.freecad

# FreeCAD shows something else than the assembly: originals that nobody hid, copies of an old state, a ring.
# Each is a difference that a person sees too.
DIFFERS = {
    *(
        "array_over_an_inline_part",
        "deep_mix",
        "link_group",
    ),
    "document_cycle",
    *("assembly_link_never_recomputed", "assembly_link_stale"),
}


@pytest.mark.parametrize(("built_by", "version"), [*zip(WANTED, WANTED, strict=True), ("1.1", "0.20")])
def test_the_view_explains_each_fixture(built_by: str, version: str, tmp_path: Path) -> None:
    """Also hidden, excluded and declared parts; also assemblies of 1.1 that 0.20 cannot load."""
    freecad = machines.need(version)
    corpus = corpora.unpack(corpora.ARCHIVES / f"corpus-{built_by}.zip", tmp_path / "corpus")
    tops = {str(corpus.top(key)): key for key in corpus.built}
    env = freecad.profile(tmp_path / "profile")
    said: dict[str, Any] = {}
    assert (
        sum(
            isinstance(found, Extraction)
            for _, found in run_freecad(list(tops), command=freecad.command, env=env, witness=said)
        )
        > 40
    )
    differing = {tops[top].partition("/")[2] for top in said if not all(one["agrees"] for one in said[top])}
    known = {name for name in DIFFERS if any(key.endswith(f"/{name}") for key in corpus.built)}
    if version != built_by:  # it says that these assemblies are lost
        known -= {"assembly_link_never_recomputed", "assembly_link_stale"}
    assert differing == known


@pytest.mark.parametrize("version", MOSTLY_ENDS)
def test_each_wrong_count_is_found(version: str, tmp_path: Path) -> None:
    """Routines of the count broken on purpose, and changed lines: the witness names each, nothing else."""
    freecad = machines.need(version)
    out = tmp_path / "answers.json"
    script = Path(__file__).parent / "freecad_cases" / "wrong_counts.py"
    env = {**freecad.profile(tmp_path / "profile"), "SILO_OUT": str(out)}
    freecad.must_run(script, env, cwd=tmp_path)
    answers = json.loads(out.read_text())
    assert len(answers) > 20
    for fault, told in answers.items():
        assert all(one["agrees"] for one in told) is fault.endswith(": nothing"), (fault, told)
    ((columns,),) = [told for fault, told in answers.items() if fault == "with_everything: nothing"]
    names = ("shown", "explained", "hidden", "beside", "sources", "left_out")
    assert [columns[name] for name in names] == [11, 12, 1, 1, 4, 1]


def test_the_command_names_what_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A Draft array over an inline part that nobody hid: the view has its two screws once more."""
    freecad = machines.need("1.1")
    corpus = corpora.unpack(corpora.ARCHIVES / "corpus-1.1.zip", tmp_path / "corpus")
    for name, value in freecad.profile(tmp_path / "profile").items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("SILO_FREECADCMD", freecad.command)
    assert main(["bom", str(corpus.top("asm4/array_over_an_inline_part")), "--verify", "--json"]) == 1
    (account,) = json.loads(capsys.readouterr().out)["witness"]
    assert (account["shown"], account["explained"], account["unexplained"]) == (17, 15, ["Bolts"])
    assert main(["bom", str(corpus.top("asm4/plain_link")), "--verify"]) == 0
    told = capsys.readouterr()
    assert "the view has 1 solid" in told.out
    assert f"Compared in FreeCAD 1.1 ({freecad.command})" in told.err


def test_a_fault_of_the_witness_is_not_freecads(tmp_path: Path) -> None:
    """It costs its file only, has a place, and asks for a report; FreeCAD has not died."""
    freecad = machines.need("1.1")
    corpus = corpora.unpack(corpora.ARCHIVES / "corpus-1.1.zip", tmp_path / "corpus")
    tops = [str(corpus.top(f"asm4/{name}")) for name in ("plain_link", "draft_link_array")]
    out, job = tmp_path / "lines.jsonl", tmp_path / "job.json"
    job.write_text(json.dumps({"tops": tops, "lines": str(out), "verify": True}))
    script = Path(__file__).parent / "freecad_cases" / "own_fault.py"
    env = {**freecad.profile(tmp_path / "profile"), "SILO_ARGS_FILE": str(job)}
    freecad.must_run(script, env, cwd=tmp_path)
    lines = [json.loads(line) for line in out.read_text().splitlines()]
    failed, fine = (line for line in lines if "begun" not in line)
    assert failed["top"] == tops[0]
    told = (
        r"a fault of silo-mod, no fault of the file: KeyError: 'no such role' \(own_fault\.py:\d+\); please"
    )
    assert re.match(told, failed["error"]["reason"])
    assert (fine["top"], fine["witness"]) == (tops[1], [])
