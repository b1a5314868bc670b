# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod inertia`` on the example arm: results, files, frames, exit codes."""

from __future__ import annotations

import csv
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema_rs
import numpy as np
import pytest
import yaml

from silo.bom.errors import InputError
from silo.cli.masses.geometry import read_options
from silo.cli.parser import build_parser
from silo.platform.processes import end

Run = Callable[..., Any]
SCHEMA = Path(__file__).parents[3] / "mods" / "silo" / "inertia" / "schema.json"


@pytest.fixture(name="weigh")
def _weigh(run: Run, arm: Path) -> Run:
    """``weigh(*words)``: the arm with its BOM."""
    return lambda *words: run("inertia", arm / "arm.step", "--bom", arm / "bom.csv", *words)


def by_name(rows: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    return {row["name"]: row for row in rows}


def test_the_example_by_hand(weigh: Run) -> None:
    """Masses by the rule, from dimensions in the generator: BOM, material, share, zero."""
    ran = weigh("--json")
    assert ran.code == 0
    data = ran.json()
    links = by_name(data["links"])
    assert list(links) == ["base_link", "upper_arm", "forearm", "gripper"]
    base = by_name(links["base_link"]["parts"])
    column = math.pi * (0.045**2 - 0.035**2) * 0.08 * 2700
    assert base["Base plate"]["mass"] == 0.688
    assert base["Column"]["mass"] == pytest.approx(column, rel=1e-9)
    assert base["Column"]["source"] == "material"
    assert base["Driver board"]["mass"] == pytest.approx(0.06 * 0.04 * 0.004 * 1850, rel=1e-9)
    assert base["Servo case"]["mass"] + 2 * base["Servo horn"]["mass"] == pytest.approx(0.165)
    assert base["Servo horn"]["quantity"] == 2
    assert base["Servo case"]["source"] == "sub_assembly_mass"
    expected = 0.688 + column + 0.165 + 0.01776 + 4 * 0.002
    assert links["base_link"]["mass"] == pytest.approx(expected, rel=1e-9)
    assert data["total"]["mass"] == pytest.approx(sum(link["mass"] for link in links.values()))
    assert sorted({w["code"] for w in data["warnings"]}) == [
        "mass_rounded", "no_mass_no_material", "row_unused", "sub_assembly_mass_shared",
    ]  # fmt: skip


def test_json_fits_the_schema(run: Run, weigh: Run, arm: Path) -> None:
    """What the command prints is what the docs promise."""
    schema = json.loads(SCHEMA.read_text("utf-8"))
    data = weigh("--json").json()
    assert list(jsonschema_rs.validator_for(schema).iter_errors(data)) == []
    again = run("inertia", arm / "arm.step", arm / "arm.step", "--bom", arm / "bom.csv", "--json").json()
    assert again == {"items": [data, data], "total": 2}


def test_maps_of_several_files_are_several_documents(run: Run, arm: Path) -> None:
    """And a file for one map is refused."""
    one = run("links", arm / "arm.step").out
    both = run("links", arm / "arm.step", arm / "arm.step")
    assert (both.code, list(yaml.safe_load_all(both.out))) == (0, [yaml.safe_load(one)] * 2)
    assert run("links", arm / "arm.step", arm / "arm.step", "--out", arm / "map.yaml").code == 2


def test_urdf_of_the_example_is_what_the_command_writes(weigh: Run, arm: Path) -> None:
    """The committed file does not rot, and a second run changes no byte."""
    before = (arm / "arm.urdf").read_bytes()
    ran = weigh("--urdf", arm / "arm.urdf", "--in-place")
    assert ran.code == 0
    assert "wrote the inertia of base_link, upper_arm, forearm, gripper" in ran.err
    assert numbers_of((arm / "arm.urdf").read_text()) == pytest.approx(numbers_of(before.decode()), rel=1e-9)
    again = (arm / "arm.urdf").read_bytes()
    weigh("--urdf", arm / "arm.urdf", "--in-place")
    assert (arm / "arm.urdf").read_bytes() == again


def numbers_of(text: str) -> list[float]:
    import re

    return [float(n) for n in re.findall(r'[" ](-?[\d.]+(?:e-?\d+)?)(?=[" ])', text)]


def test_the_generator_makes_the_committed_step(run: Run, weigh: Run, arm: Path, tmp_path: Path) -> None:
    """Masses, centres and tensors of a freshly generated arm are those of the committed file."""
    fresh = tmp_path / "fresh.step"
    subprocess.run([sys.executable, arm / "make_arm.py", fresh], check=True, capture_output=True)
    old = weigh("--json").json()
    new = run("inertia", fresh, "--bom", arm / "bom.csv", "--json").json()
    for left, right in zip(old["links"], new["links"], strict=True):
        assert left["mass"] == pytest.approx(right["mass"], rel=1e-9)
        assert np.allclose(left["inertia"], right["inertia"], rtol=1e-8, atol=1e-12)


def test_frames(weigh: Run, arm: Path) -> None:
    """The same link in the assembly's, its own and the URDF's frame: the centre moves, the moments stay."""
    found = {}
    for frame in ("assembly", "own", "urdf"):
        urdf = ["--urdf", arm / "arm.urdf", "--urdf-out", arm / "out.urdf"] if frame == "urdf" else []
        ran = weigh("--json", "--frame", frame, *urdf)
        found[frame] = by_name(ran.json()["links"])["forearm"]
    assert found["assembly"]["com"][2] - found["own"]["com"][2] == pytest.approx(0.42)
    assert found["own"]["com"] == pytest.approx(found["urdf"]["com"])
    for link in found.values():
        assert link["principal_moments"] == pytest.approx(found["assembly"]["principal_moments"])
    assert "assembly frame" in found["assembly"]["frame"]["description"]
    assert "URDF" in found["urdf"]["frame"]["description"]


def test_a_frame_that_is_not_the_urdfs_is_reported(weigh: Run, arm: Path) -> None:
    """A link map's frame wins; where the URDF's joints put the link elsewhere, its numbers would be wrong."""
    frames = {}
    for text in ("0.42", "0.12"):
        links = f"links: {{forearm: {{parts: [forearm], origin: {{xyz: [0, 0, {text}]}}}}}}\n"
        (arm / "map.yaml").write_text(links, "utf-8")
        data = weigh("--links", arm / "map.yaml",
            "--urdf", arm / "arm.urdf", "--urdf-out", arm / "out.urdf", "--json",
        ).json()  # fmt: skip
        frames[text] = [w["message"] for w in data["warnings"] if w["code"] == "frame_differs"]
    assert frames["0.42"] == []
    assert len(frames["0.12"]) == 1
    assert "300 mm and 0° away" in frames["0.12"][0]


def test_numbers_of_the_assembly_in_a_urdf_are_reported(weigh: Run, arm: Path) -> None:
    """``--frame assembly`` with ``--urdf`` is right for the root link only; the others are named."""
    command = ["--urdf", arm / "arm.urdf", "--json"]
    data = weigh(*command, "--urdf-out", arm / "out.urdf", "--frame", "assembly").json()
    told = {w["link"] for w in data["warnings"] if w["code"] == "frame_differs"}
    assert told == {"upper_arm", "forearm", "gripper"}
    own = weigh(*command, "--urdf-out", arm / "out.urdf", "--frame", "own").json()
    assert not [w for w in own["warnings"] if w["code"] == "frame_differs"]


def test_a_xacro_takes_numbers_in_a_named_frame_only(weigh: Run, arm: Path) -> None:
    """Its joints hold no numbers yet: by default that is an error, with --frame own it is filled."""
    xacro = arm / "arm.xacro"
    xacro.write_text(
        '<robot name="r"><link name="base_link"/><link name="forearm"/><joint name="j">'
        '<origin xyz="${x} 0 0"/><parent link="base_link"/><child link="forearm"/></joint></robot>', "utf-8",
    )  # fmt: skip
    command = ["--urdf", xacro, "--in-place"]
    assert weigh(*command).code == 2
    assert weigh(*command, "--frame", "own").code == 0
    assert xacro.read_text("utf-8").count("<inertial>") == 2


def test_link_map_and_loose_parts(weigh: Run, arm: Path) -> None:
    """Two links by patterns, the rest given to a third."""
    (arm / "map.yaml").write_text("links:\n  arm: [upper_arm, forearm]\n  hand: ['gripper/**']\n", "utf-8")
    common = ["--json", "--links", arm / "map.yaml"]
    data = weigh(*common).json()
    assert [link["name"] for link in data["links"]] == ["arm", "hand"]
    assert {part["path"].split("/")[0] for part in data["unclaimed"]} == {"base_link"}
    loose = weigh(*common, "--loose", "base").json()
    assert [link["name"] for link in loose["links"]] == ["arm", "hand", "base"]
    assert loose["unclaimed"] == []


def test_reports_of_every_kind(weigh: Run, arm: Path) -> None:
    """JSON, CSV and Markdown by suffix, beside the table on the terminal."""
    files = [arm / f"report{suffix}" for suffix in (".json", ".csv", ".md")]
    options = [word for file in files for word in ("--report", file)]
    ran = weigh(*options)
    assert ran.code == 0
    assert "Servo case" in ran.out
    assert "whole assembly" in ran.out
    assert json.loads(files[0].read_text("utf-8"))["format"] == "silo-inertia/1"
    assert len(list(csv.reader(files[1].read_text("utf-8").splitlines()))) == 20
    text = files[2].read_text("utf-8")
    assert "## Warnings" in text


def test_strict_and_allow(weigh: Run) -> None:
    """Any warning is a failure, unless it is allowed by its code."""
    command = ["--strict"]
    ran = weigh(*command)
    assert ran.code == 1
    assert "mass_rounded" in ran.err
    allowed = ["mass_rounded", "no_mass_no_material", "row_unused", "sub_assembly_mass_shared"]
    assert weigh(*command, *(word for code in allowed for word in ("--allow", code))).code == 0


def test_bom_and_material_options_reach_the_calculation(run: Run, arm: Path) -> None:
    """Renamed columns, decimal comma, grams, a table of one's own, the default density."""
    (arm / "ours.csv").write_text("Kurztext;Gew.;Stoff\nPalm;100,5;\nFinger;;house blend\n", "utf-8")
    (arm / "mat.csv").write_text("name,density\nhouse blend,2000\n", "utf-8")
    ran = run(
        "inertia", arm / "arm.step", "--bom", arm / "ours.csv", "--json",
        "--column", "name=Kurztext", "--column", "mass=Gew.", "--column", "material=Stoff", "--decimal", ",",
        "--mass-unit", "g", "--materials", arm / "mat.csv", "--default-density", "500",
    )  # fmt: skip
    gripper = by_name(by_name(ran.json()["links"])["gripper"]["parts"])
    assert gripper["Palm"]["mass"] == pytest.approx(0.1005)
    assert gripper["Finger"]["density"] == 2000
    assert gripper["Camera"]["density"] == 500


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--bom", "none.csv"], "none.csv"),
        (["--links", "none.yaml"], "none.yaml"),
        (["--urdf", "none.urdf"], "none.urdf"),
        (["--report", "out.docx"], ".json, .csv, .md"),
        (["--report", "nowhere/out.json"], "no folder"),
        (["--preview", "out.png"], "--preview writes .glb"),
        (["--frame", "urdf"], "needs --urdf"),
        (["--urdf-out", "x.urdf"], "without --urdf"),
        (["--urdf", "arm.urdf", "--urdf-out", "nowhere/x.urdf"], "no folder"),
        (["--urdf", "bom.csv", "--frame", "own"], "not valid XML"),
        (["--snippet", "sdf", "--json"], "--report FILE.json"),
        (["--default-density", "0"], "from 25 to 23000"),
        (["--default-density", "nan"], "from 25 to 23000"),
        (["--default-density", "1e999"], "from 25 to 23000"),
        (["--timeout", "-1"], "--timeout"),
        (["--push"], "no Silo server is configured"),
        (["--bom", "bom.csv", "--column", "mass"], "ROLE=HEADER"),
        (["--materials", "none.csv"], "none.csv"),
    ],
)
def test_mistakes_are_one_plain_sentence(
    run: Run, arm: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], message: str
) -> None:
    """Reported before the geometry is read, exit code 2, no trace."""
    monkeypatch.chdir(arm)
    ran = run("inertia", "arm.step", *words)
    assert ran.code == 2
    assert message in ran.err
    assert len(ran.err.strip().splitlines()) == 1


@pytest.mark.parametrize(
    "words",
    [
        "links arm.step --out arm.step",
        "links arm.step --urdf arm.urdf --out ./arm.urdf",
        "inertia arm.step --bom bom.csv --report linked.csv",
        "inertia arm.step --urdf arm.urdf --urdf-out arm.urdf",
        "inertia arm.step --report new.md --report new.md",
        "links arm.step --out part.stl",
        "inertia arm.step --preview new.glb --preview new.glb",
    ],
)
def test_what_is_read_is_never_overwritten(
    run: Run, arm: Path, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    """The map of links was written over the CAD file; a report over the BOM that it was made from."""
    monkeypatch.chdir(arm)
    os.symlink("bom.csv", "linked.csv")
    for other in ("part.FCStd", "part.stl"):
        (arm / other).write_bytes(b"of a person")
    before = {path.name: path.read_bytes() for path in arm.iterdir()}
    ran = run(*words.split())
    assert (ran.code, ran.out) == (2, "")
    reasons = ("is the name of a model", "is read by this command", "writes this file too")
    assert any(reason in ran.err for reason in reasons)
    assert {path.name: path.read_bytes() for path in arm.iterdir()} == before


@pytest.mark.parametrize("command", ["inertia", "links", "mass"])
def test_jobs_say_how_many_processes_read(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The processors by default; a number that is none is refused."""
    parser = build_parser()
    assert read_options(parser.parse_args([command, "arm.step"])).processes == 0
    assert read_options(parser.parse_args([command, "arm.step", "--jobs", "3"])).processes == 3
    with pytest.raises(InputError, match="no number from 1 to 512"):
        parser.parse_args([command, "arm.step", "--jobs", "0"])
    assert f"usage: silo-mod {command}" in capsys.readouterr().err


@pytest.mark.parametrize("data", [b"", b"not a step file", b"ISO-10303-21;\nHEADER;\n"])
def test_bad_geometry_is_one_plain_sentence(run: Run, arm: Path, data: bytes) -> None:
    """Case 17 through the command: empty, foreign, cut off."""
    (arm / "bad.step").write_bytes(data)
    ran = run("inertia", arm / "bad.step")
    assert ran.code == 2
    assert "bad.step" in ran.err
    assert "Traceback" not in ran.err


def test_a_urdf_of_another_robot_is_refused(weigh: Run, arm: Path) -> None:
    """None of its links is ours: nothing is written, and both lists are named."""
    other = arm / "other.urdf"
    other.write_text('<robot name="r"><link name="torso"/></robot>', "utf-8")
    ran = weigh("--urdf", other)
    assert ran.code == 2
    assert "torso" in ran.err
    assert "base_link" in ran.err
    assert other.read_text("utf-8") == '<robot name="r"><link name="torso"/></robot>'


def test_a_link_that_no_body_can_be_is_shown_and_refused(run: Run, step_files: Path, tmp_path: Path) -> None:
    """A mass without geometry has no inertia: the report says why, the URDF stays as it was, exit 2."""
    (tmp_path / "map.yaml").write_text("links: {holder: ['product:Wiring_holder*'], rest: ['**']}\n", "utf-8")
    (tmp_path / "bom.csv").write_text("Name,Material,Mass\nWiring_holder v1,,0.0020 kg\n", "utf-8")
    urdf = tmp_path / "robot.urdf"
    urdf.write_text('<robot name="r"><link name="holder"/><link name="rest"/></robot>', "utf-8")
    before = urdf.read_bytes()
    ran = run(
        "inertia", step_files / "so101_wrist_roll_pitch.step", "--bom", tmp_path / "bom.csv",
        "--links", tmp_path / "map.yaml", "--urdf", urdf, "--in-place", "--json",
    )  # fmt: skip
    assert ran.code == 2
    assert urdf.read_bytes() == before
    assert "holder has no inertia (a point mass)" in ran.err
    codes = {(w["link"], w["code"]) for w in ran.json()["warnings"]}
    assert {("holder", "bad_tensor"), ("holder", "point_mass")} <= codes


def test_links_of_the_urdf_that_get_nothing_are_named(weigh: Run, arm: Path) -> None:
    """A link that our assembly does not have keeps its old numbers: somebody should know."""
    text = (arm / "arm.urdf").read_text("utf-8")
    hand = '<link name="hand"><inertial><mass value="7"/></inertial></link></robot>'
    (arm / "arm.urdf").write_text(text.replace("</robot>", hand), "utf-8")
    ran = weigh("--urdf", arm / "arm.urdf", "--in-place")
    assert ran.code == 0
    assert "left as they were, no link of ours: hand" in ran.err
    assert hand in (arm / "arm.urdf").read_text("utf-8")


def test_a_weight_on_the_command_line(weigh: Run) -> None:
    """It is the link's mass in every output; what is no pair is one plain sentence."""
    command = ["--json"]
    links = {link["name"]: link for link in weigh(*command, "--mass", "forearm=1.5 lb").json()["links"]}
    assert links["forearm"]["mass"] == pytest.approx(1.5 * 0.45359237)
    assert {part["source"] for part in links["forearm"]["parts"]} == {"target_mass"}
    assert "--mass wants NAME=MASS" in weigh(*command, "--mass", "forearm").err


def test_a_urdf_is_written_only_where_somebody_says(run: Run, weigh: Run, arm: Path) -> None:
    """Neither --urdf-out nor --in-place: it gives names and frames, and stays as it is."""
    before = (arm / "arm.urdf").read_bytes()
    ran = weigh("--urdf", arm / "arm.urdf")
    assert ran.code == 0
    assert "not written; --urdf-out FILE or --in-place" in ran.err
    assert (arm / "arm.urdf").read_bytes() == before
    command = ["inertia", arm / "arm.step", "--urdf", arm / "arm.urdf", "--in-place"]
    assert run(*command, "--urdf-out", arm / "out.urdf").code == 2


def test_json_alone_goes_to_standard_output(weigh: Run, arm: Path) -> None:
    """Whatever else is asked for, standard output is one JSON text."""
    ran = weigh("--json", "--strict",
        "--urdf", arm / "arm.urdf", "--in-place", "--report", arm / "r.md", "--preview", arm / "p.glb",
        "--push", "--dry-run",
    )  # fmt: skip
    assert ran.code == 1
    assert ran.json()["format"] == "silo-inertia/1"
    for words in ("--strict: ", "wrote the inertia", "Would write "):
        assert words in ran.err
    assert (arm / "p.glb").read_bytes().startswith(b"glTF")
    assert (arm / "r.md").read_text("utf-8").startswith("# ")


@pytest.mark.parametrize("output", ["--json", "--snippet=urdf"])
def test_names_survive_a_pipe_of_another_code_page(arm: Path, output: str) -> None:
    """A pipe on Windows, or a job in a C locale: escaped, never a question mark."""
    (arm / "map.yaml").write_text("links: {größe_Ω: [base_link]}\n", "utf-8")
    ran = subprocess.run(
        [
            sys.executable,
            "-m",
            "silo.cli.main",
            "inertia",
            arm / "arm.step",
            "--links",
            arm / "map.yaml",
            output,
        ],
        env={**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"},
        capture_output=True,
        check=True,
    )
    if output == "--json":
        assert json.loads(ran.stdout.decode("cp1252"))["links"][0]["name"] == "größe_Ω"
    else:
        # As a reader of the file takes it: it says nothing of an encoding, so it is UTF-8.
        assert ET.fromstring(ran.stdout)[0].get("name") == "größe_Ω"  # noqa: S314 (our own text)


def test_a_snippet_comes_with_the_reports(weigh: Run, arm: Path) -> None:
    """Files that were asked for are written, whatever goes to standard output; warnings go to the other."""
    ran = weigh("--snippet", "mjcf", "--report", arm / "r.json")
    assert ran.out.startswith("<mujoco")
    assert ran.out.count("fullinertia") == 4
    assert "forearm: frame of the numbers: assembly frame" in ran.err
    assert "No mass or material assigned: counted as 0 kg  [no_mass_no_material]" in ran.err
    assert json.loads((arm / "r.json").read_text("utf-8"))["format"] == "silo-inertia/1"


def reader_of(pid: int) -> int:
    """The child that reads for a process, once it loads the kernel: the reading itself comes later."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        for found in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            if "/OCP" in Path(f"/proc/{found}/maps").read_text():
                return int(found)
        threading.Event().wait(0.01)  # the processor is needed by the process that is waited for
    raise AssertionError(f"{pid} started no process that loads the geometry kernel")


@pytest.mark.usefixtures("needs_pty", "needs_signals")
def test_ctrl_c_is_a_plain_sentence(arm: Path) -> None:
    """Cancelled while reading: exit 130, one line, no trace, no child left behind."""
    # A terminal of its own makes the progress bar appear: it says when the reading has begun.
    parent, child = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "silo.cli.main", "inertia", str(arm / "arm.step"), "--no-cache"],
        stdout=subprocess.PIPE,
        stderr=child,
        start_new_session=True,
    )
    os.close(child)
    try:
        # Its reader is halted early, so that the reading cannot be done before the signal comes.
        reader = reader_of(process.pid)
        os.kill(reader, signal.SIGSTOP)
        seen = b""
        deadline = time.monotonic() + 60
        while b"arm.step" not in seen and time.monotonic() < deadline:
            seen += os.read(parent, 4096)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60)
        rest = b""
        try:
            while piece := os.read(parent, 4096):
                rest += piece
        except OSError:  # the terminal's other end is closed: all was read
            pass
    finally:
        end(process)
    os.close(parent)
    assert process.returncode == 130
    assert out == b""
    assert b"Cancelled." in rest
    assert b"Traceback" not in seen + rest
    with pytest.raises(ProcessLookupError):
        os.kill(reader, 0)
