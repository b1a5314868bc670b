# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 16, 19, 41, 42, 43: what goes out reads back, loads, and is refused where no body can have it."""

from __future__ import annotations

import csv
import io
import json
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema_rs
import numpy as np
import pytest
from bodies import box, cylinder, placement, shape_only
from rich.console import Console

from silo.bom.errors import InputError
from silo.cli.terminal import console
from silo.inertia.digits import number
from silo.inertia.links.frames import ASSEMBLY_FRAME, origin_frame
from silo.inertia.links.link_map import link_map
from silo.inertia.output.accepted import settled, writable
from silo.inertia.output.csv import CSV_COLUMNS, report_csv
from silo.inertia.output.json import report_data, report_json
from silo.inertia.output.markdown import report_markdown
from silo.inertia.output.snippets import SNIPPETS, document, snippets
from silo.inertia.output.terminal import MAX_PART_ROWS, report_tables
from silo.inertia.report import LinkResult
from silo.inertia.rigid import MassProps, combine

Fixture = Callable[..., Any]
SCHEMA = Path(__file__).parents[3] / "mods" / "silo" / "inertia" / "schema.json"
BOM = (
    "Item,Quantity,Material,Mass,Name\n1,1,steel,,plate\n2,3,,0.25 kg,rod\n"
    "3,1,Unobtainium,,block\n4,1,,,pad\n5,1,,,glue\n"
)


@pytest.fixture(name="report")
def _report(assemble: Fixture, compute: Fixture) -> Any:
    """Two links with every kind of part, a link without mass, an unclaimed part."""
    rod = cylinder("rod", 0.02, 0.3)
    return compute(
        assemble(
            ("base/plate", box("plate", 0.1, 0.2, 0.01)),
            ("base/rod1", rod, origin_frame((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))),
            ("arm/rod2", rod, origin_frame((1, 0, 0), (0, 1, 0))),
            ("arm/rod3", rod, origin_frame((0, 1, 0), (1, 0, 0))),
            ("arm/block", box("block", 0.05, 0.06, 0.07), placement((0, 0, 1))),
            ("pad/pad", box("pad", 0.01, 0.01, 0.01)),
            ("loose | part", box("loose | part", 0.01, 0.02, 0.03)),
            source="arm.step",
        ),
        BOM,
        links=link_map({"links": {name: [name] for name in ("base", "arm", "pad")}}),
    )


def real_links(report: Any) -> dict[str, MassProps]:
    return writable(report.links.values())


def from_snippet(kind: str, text: str) -> dict[str, MassProps]:
    """What a consumer would read."""
    found: dict[str, MassProps] = {}
    for link in ET.fromstring(f"<all>{text}</all>"):  # noqa: S314 (our own text)
        inertial = link.find("inertial")
        assert inertial is not None
        if kind == "mjcf":
            com, mass = inertial.get("pos", ""), inertial.get("mass", "")
            xx, yy, zz, xy, xz, yz = (float(v) for v in inertial.get("fullinertia", "").split())
        elif kind == "urdf":
            com, mass = inertial.find("origin").get("xyz"), inertial.find("mass").get("value")  # type: ignore[union-attr]
            tensor = inertial.find("inertia")
            xx, yy, zz, xy, xz, yz = (
                float(tensor.get(k)) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
            )  # type: ignore[union-attr,arg-type]
        else:
            com, mass = inertial.findtext("pose", ""), inertial.findtext("mass", "")
            assert com.split()[3:] == ["0", "0", "0"]
            tensor = inertial.find("inertia")
            xx, yy, zz, xy, xz, yz = (
                float(tensor.findtext(k)) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
            )  # type: ignore[union-attr,arg-type]
        rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        found[link.get("name", "")] = MassProps(float(mass), [float(v) for v in com.split()[:3]], rows)  # type: ignore[union-attr,arg-type]
    return found


@pytest.mark.parametrize("kind", SNIPPETS)
def test_case_41_snippets_read_back(report: Any, kind: str) -> None:
    """URDF, SDF and MJCF hold the numbers to 1e-9 and better, products with their sign and in their place."""
    links = real_links(report)
    read = from_snippet(kind, snippets(links, kind))
    assert read.keys() == links.keys() == {"base", "arm"}
    for name in links:
        ours = report.links[name].props
        assert read[name].mass == pytest.approx(ours.mass, rel=1e-12)
        assert read[name].com == pytest.approx(ours.com, rel=1e-12, abs=1e-15)
        assert np.abs(read[name].inertia - ours.inertia).max() <= 1e-12 * np.abs(ours.inertia).max()
        assert read[name].check(tolerance=0.0) == ()
        assert np.abs(ours.inertia[0, 1]) > 1e-6  # the products are there to be mixed up


NAMES = ("arm", "a <b> & 'c' \"d\"", "é 手 ß")


@pytest.mark.parametrize("name", NAMES)
def test_the_mjcf_file_loads_in_mujoco(report: Any, name: str) -> None:
    """As written, without a change; mass, centre and principal moments read back."""
    mujoco = pytest.importorskip("mujoco")
    links = {name if old == "arm" else old: props for old, props in real_links(report).items()}
    model = mujoco.MjModel.from_xml_string(document(links, "mjcf", f"robot {name}"))
    for link, props in links.items():
        body = model.body(link)
        assert body.mass[0] == pytest.approx(props.mass, rel=1e-12)
        assert body.ipos == pytest.approx(props.com, rel=1e-12, abs=1e-15)
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, body.iquat)
        turn = turn.reshape(3, 3)
        tensor = turn @ np.diag(body.inertia) @ turn.T
        assert np.abs(tensor - props.inertia).max() <= 1e-9 * np.abs(props.inertia).max()


@pytest.fixture(name="read_sdf", scope="module")
def _read_sdf(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], dict[str, list[Any]]]:
    """Debian's libsdformat, the format's own reader, behind a small program; skipped, loudly, without it."""
    folder = tmp_path_factory.mktemp("sdf")
    flags: list[str] = []
    packages = ("sdformat12", "sdformat13", "sdformat14", "sdformat") if shutil.which("pkg-config") else ()
    for package in packages:
        found = subprocess.run(["pkg-config", "--cflags", "--libs", package], capture_output=True, text=True)
        if found.returncode == 0:
            flags = found.stdout.split()
            break
    if not flags or shutil.which("g++") is None:
        pytest.skip("libsdformat is not here (apt install g++ pkg-config libsdformat-dev)")
    source = Path(__file__).parents[2] / "support" / "native" / "read_sdf.cc"
    subprocess.run(["g++", "-std=c++17", source, "-o", folder / "read_sdf", *flags], check=True)

    def read(text: str) -> dict[str, list[Any]]:
        (folder / "robot.sdf").write_text(text, "utf-8")
        done = subprocess.run([folder / "read_sdf", folder / "robot.sdf"], capture_output=True, check=True)
        rows = [line.split("\t") for line in done.stdout.decode().splitlines()]
        assert done.stderr == b""
        return {name: rest for name, *rest in rows}

    return read


@pytest.mark.parametrize("name", NAMES)
def test_the_sdf_file_loads_in_libsdformat(report: Any, name: str, read_sdf: Any) -> None:
    """As written; mass, centre and every element of the tensor read back, and the library accepts them."""
    links = {name if old == "arm" else old: props for old, props in real_links(report).items()}
    read = read_sdf(document(links, "sdf", f"robot {name}"))
    assert read.keys() == links.keys()
    for link, props in links.items():
        mass, centre, valid, tensor = read[link]
        assert valid == "1"
        assert float(mass) == pytest.approx(props.mass, rel=1e-12)
        assert [float(v) for v in centre.split()] == pytest.approx(props.com, rel=1e-12, abs=1e-15)
        rows = np.array(tensor.split(), float).reshape(3, 3)
        assert np.abs(rows - props.inertia).max() <= 1e-12 * np.abs(props.inertia).max()


def test_names_that_a_format_keeps_for_itself_are_refused() -> None:
    """MuJoCo has a body "world" already; SDFormat separates names by two colons."""
    props = MassProps(1.0, [0, 0, 0], np.eye(3))  # type: ignore[arg-type]
    for kind, name in (("mjcf", "world"), ("sdf", "world"), ("sdf", "a::b"), ("sdf", "__root__")):
        with pytest.raises(InputError, match="does not allow"):
            document({name: props}, kind, "robot")
    assert "a b" in document({"x": props}, "sdf", "a::b")


def mujoco_model(links: dict[str, MassProps]) -> Any:
    mujoco = pytest.importorskip("mujoco")
    bodies = snippets(links, "mjcf").replace("<inertial", "<freejoint/><inertial")
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")


def link(props: MassProps, name: str = "arm") -> LinkResult:
    return LinkResult(name, props, ASSEMBLY_FRAME, (), props.check())


BAD = [
    np.diag([1.0, 1.0, 2.1]),
    np.diag([1.0, 1.0, 2.0 * (1 + 1e-6)]),
    np.diag([0.02] * 3) + 0.015 * np.array([[0, 1, 0], [1, 0, 0], [0, 0, 0.0]]),
    np.diag([-1.0, 2.0, 2.0]),
    np.zeros((3, 3)),
]


@pytest.mark.parametrize("tensor", BAD)
def test_wrong_tensors_are_refused_by_us_first(tensor: np.ndarray) -> None:
    """What MuJoCo refuses on a moving link never gets that far; the message names the link."""
    mujoco = pytest.importorskip("mujoco")
    props = MassProps(1.0, [0, 0, 0], tensor)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="arm has"):
        writable([link(props)])
    with pytest.raises(ValueError, match=r"inertia|mjMINVAL"):
        mujoco_model({"arm": props})
    assert mujoco.__version__


def test_all_bad_links_are_named_at_once() -> None:
    """Not the first one only."""
    bad = MassProps(1.0, [0, 0, 0], BAD[0])  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"elbow has .*; wrist has"):
        writable([link(bad, "elbow"), link(bad, "wrist")])


def test_case_16_flat_plate_survives_printing() -> None:
    """a + b = c in any orientation: after rounding MuJoCo still takes it, and the numbers hardly move."""
    rng = np.random.default_rng(7)
    for _ in range(50):
        a, b = rng.uniform(1e-9, 1e-3, 2)
        turn = origin_frame((0, 0, 0), rng.uniform(-3, 3, 3))
        plate = MassProps(0.01, [0, 0, 0], np.diag([a, b, a + b])).transformed(turn)  # type: ignore[arg-type]
        out = settled(plate)
        assert out.check(tolerance=0.0) == ()
        assert np.abs(out.inertia - plate.inertia).max() <= 1e-12 * (a + b)
        mujoco_model({"plate": out})


def test_tiny_parts_keep_their_digits() -> None:
    """5e-9 kg m² on 0.2 g: printing with %g would lose them."""
    tensor = np.diag([5.123456789012e-9, 5.2e-9, 6e-9])
    read = from_snippet("urdf", snippets({"x": MassProps(2e-4, [0, 0, 0], tensor)}, "urdf"))  # type: ignore[arg-type]
    assert read["x"].inertia[0, 0] == pytest.approx(5.123456789012e-9, rel=1e-14)


def test_case_19_a_link_without_mass_is_left_out_and_reported(report: Any, codes: Fixture) -> None:
    """No simulator takes a moving link of no mass; it gets no <inertial>, and a warning."""
    assert "pad" not in real_links(report)
    assert [w.code for w in report.warnings if w.link_name == "pad" and not w.part_name] == ["zero_mass_link"]


@pytest.mark.parametrize(
    ("value", "text"), [(-0.0, "0"), (0.1, "0.1"), (0.1 + 0.2, "0.3"), (1e-300, "1e-300")]
)
def test_numbers(value: float, text: str) -> None:
    """Fifteen digits: no noise of the last bit, no minus zero."""
    assert number(value) == text


def test_case_43_json_fits_its_schema(report: Any) -> None:
    """The documented schema holds, for a full report and an empty one."""
    from silo.inertia.report import InertiaReport

    schema = json.loads(SCHEMA.read_text("utf-8"))
    validator = jsonschema_rs.validator_for(schema)
    for one in (report, InertiaReport()):
        data = json.loads(report_json(one))
        assert list(validator.iter_errors(data)) == []
        assert data == report_data(one)
    data = json.loads(report_json(report))
    data["links"][0]["parts"][0]["source"] = "a feeling"
    assert not validator.is_valid(data)


def test_schema_knows_every_code_of_the_program() -> None:
    """Enumerations of schema and program are the same."""
    from silo.inertia.codes import Decided, Rule, Source
    from silo.inertia.rigid import TensorProblem

    schema = json.loads(SCHEMA.read_text("utf-8"))["$defs"]
    part = schema["part"]["properties"]
    assert part["source"]["enum"] == [str(s) for s in Source]
    assert part["rule"]["enum"] == [str(r) for r in Rule]
    assert part["decided_by"]["enum"] == [str(d) for d in Decided]
    assert set(schema["link"]["properties"]["problems"]["items"]["enum"]) == {str(t) for t in TensorProblem}


def test_case_43_order_is_stable_and_warnings_complete(report: Any) -> None:
    """Links as placed, parts as placed, and each warning with a code and a sentence."""
    data = report_data(report)
    assert [one["name"] for one in data["links"]] == ["base", "arm", "pad"]
    assert [p["name"] for p in data["links"][1]["parts"]] == ["rod", "block"]
    assert data["links"][1]["parts"][0]["paths"] == ["arm/rod2", "arm/rod3"]
    assert [p["name"] for p in data["unclaimed"]] == ["loose | part"]
    assert report_data(report) == data
    for warning in data["warnings"]:
        assert warning["code"]
        assert warning["message"]
        assert warning["link"] or warning["part"]
    told = {(w["link"], w["part"], w["code"]) for w in data["warnings"]}
    assert {
        ("arm", "block", "unknown_material"),
        ("pad", "pad", "no_mass_no_material"),
        ("", "glue", "row_unused"),
        ("", "loose | part", "unclaimed"),
    } <= told


def test_csv_has_one_row_per_link_and_part(report: Any) -> None:
    """Readable by any spreadsheet, complete, and safe from formulae."""
    rows = list(csv.reader(io.StringIO(report_csv(report))))
    assert rows[0] == list(CSV_COLUMNS)
    assert [row[:2] for row in rows[1:]] == [
        ["base", "plate"], ["base", "rod"], ["arm", "rod"], ["arm", "block"], ["pad", "pad"],
        ["", "loose | part"],
    ]  # fmt: skip
    assert float(rows[2][4]) == 0.25


@pytest.mark.parametrize("name", ["=1+1", "@SUM(A1)", "+7", "-3 bracket"])
def test_csv_does_not_run_part_names(assemble: Fixture, compute: Fixture, name: str) -> None:
    """A spreadsheet must not take a part's name for a formula."""
    report = compute(assemble(("l/x", box(name, 0.1, 0.1, 0.1))), None)
    assert list(csv.reader(io.StringIO(report_csv(report))))[1][1] == "'" + name


def test_markdown_and_table_hold_the_essentials(report: Any) -> None:
    """Links, sources, rules, materials, warnings; names are text and not markup."""
    text = report_markdown(report)
    assert "loose \\| part" in text
    assert "BOM mass" in text
    assert "assembly frame" in text
    assert "`unknown_material`" in text
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(report_tables(report))
    shown = console.export_text()
    assert "whole assembly" in shown
    assert "(no link)" in shown
    assert "Unobtainium" in shown


def test_a_pipe_gets_every_part_each_on_one_line(assemble: Fixture, compute: Fixture) -> None:
    """However long the names are; a terminal gets the first ones."""
    names = [f"{number}: {'a bracket of the left hand side, ' * 5}" for number in range(MAX_PART_ROWS + 5)]
    report = compute(assemble(*((f"l/{name}", box(name, 0.1, 0.1, 0.1)) for name in names)), None)
    pipe = io.StringIO()
    console(pipe).print(report_tables(report, whole=True))
    lines = pipe.getvalue().splitlines()
    assert [sum(f" {name.strip()} " in line and "│" in line for line in lines) for name in names] == [
        1
    ] * len(names)
    terminal = io.StringIO()
    Console(width=200, file=terminal).print(report_tables(report))
    assert "and 5 more" in terminal.getvalue()


def test_names_do_not_steer_the_terminal(assemble: Fixture, compute: Fixture) -> None:
    """Control characters and rich markup in a part's name are shown as text, on one line."""
    report = compute(assemble(("l/x", box("a\x1b[31m[red]b[/red]\nc", 0.1, 0.1, 0.1))), None)
    out = io.StringIO()
    Console(width=200, file=out).print(report_tables(report))
    assert "\x1b" not in out.getvalue()
    assert "[31m[red]b[/red] c" in out.getvalue()


def test_point_masses_of_one_link_make_a_body(assemble: Fixture, compute: Fixture) -> None:
    """Several points have an inertia together, which passes where it is a real one."""
    x = shape_only("x")
    spots = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    asm = assemble(*((f"l/x{i}", x, placement(spot)) for i, spot in enumerate(spots)))
    report = compute(asm, "Name,Material,Mass\nx,,0.500 kg\n")
    assert combine([MassProps(0.5, spot, np.zeros((3, 3))) for spot in spots]).inertia == pytest.approx(  # type: ignore[arg-type]
        report.links["l"].props.inertia
    )
    assert real_links(report)["l"].mass == 2.0


@pytest.mark.parametrize("kind", ["urdf", "sdf", "mjcf"])
def test_names_that_xml_cannot_hold_are_refused(kind: str) -> None:
    """A control character or half a character makes a file that no reader opens; other alphabets are fine."""
    props = MassProps(1.0, np.zeros(3), np.eye(3) * 0.01)
    for bad in ("arm\x01", "\ud800", "a\ufffe"):
        with pytest.raises(InputError, match="XML cannot hold"):
            document({bad: props}, kind, "robot")
    for good in ("Füße", "手首", "рука", 'a & <b> "c"', "😀"):
        tree = ET.fromstring(document({good: props}, kind, "ro\x07bot").encode("utf-8"))  # noqa: S314
        assert good in {element.get("name") for element in tree.iter()}
