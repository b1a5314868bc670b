# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which part belongs to which link, and in which frame its numbers are."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bodies import box, placement
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import ConfigError, InputError
from silo.inertia.assembly import Instance
from silo.inertia.calculation import calculate
from silo.inertia.links.claims import claim
from silo.inertia.links.frames import FrameChoice, origin_frame
from silo.inertia.links.link_map import as_link_map, link_map, read_link_map
from silo.inertia.links.patterns import matches
from silo.inertia.materials.table import load_materials
from silo.inertia.task import Task
from silo.inertia.urdf import Urdf

Fixture = Callable[..., Any]
PART = box("p", 0.1, 0.1, 0.1)


def instance(path: str, products: str = "") -> Instance:
    names = tuple(path.split("/"))
    return Instance(names, tuple(products.split("/")) if products else names, "p")


@pytest.mark.parametrize(
    ("links", "words"),
    [
        ({}, "list of patterns for each link"),
        ({None: ["x"]}, "a link's name is a text, got None"),
        ({"": ["x"]}, "a link's name is a text, got ''"),
        ({"a": {"x"}}, "a: wanted a list of patterns, got {'x'}"),
        ({"a": [["x"]]}, "a: wanted a list of patterns"),
        ({"a": {"part": ["x"], 7: 1}}, "a: unknown key “7”; known are parts, frame, origin"),
        ({"a": {"parts": ["x"], "frame": {"xyz": [0, 0, 0]}}}, "a: frame: wanted the name of a part"),
        ({"a": {"parts": ["x"], "origin": 5}}, "a: origin: wanted {xyz"),
        ({"a": {"parts": ["x"], "origin": {"xyz": "ab"}}}, "a: origin: wanted {xyz"),
        ({"a": []}, "wanted a list of patterns"),
        (["x"], "got list"),
        (7, "got int"),
    ],
)
def test_plain_values_that_are_no_links_are_refused_with_a_sentence(links: Any, words: str) -> None:
    """Links given in Python, not from YAML, may hold any type."""
    with pytest.raises(ConfigError, match=re.escape(words)):
        as_link_map(links)


def test_links_as_plain_values() -> None:
    """A dict of patterns, with or without "links" around it; a map that was made stays as it is."""
    for links in ({"base": ["a*"], "arm": "b"}, {"links": {"base": ("a*",), "arm": {"parts": "b"}}}):
        found = as_link_map(links)
        assert found is not None
        assert [(link.name, link.patterns) for link in found.links] == [("base", ("a*",)), ("arm", ("b",))]
        assert as_link_map(found) is found
    assert as_link_map(None) is None


@pytest.mark.parametrize(
    ("pattern", "path", "hit"),
    [
        ("arm", "arm/bolt", True),
        ("arm", "forearm/bolt", False),
        ("arm/bolt", "arm/bolt", True),
        ("bolt", "arm/bolt", False),
        ("**/bolt", "arm/joint/bolt", True),
        ("**/bolt", "bolt", True),
        ("arm/**", "arm/joint/bolt", True),
        ("arm/**", "arm2/joint", False),
        ("arm*", "arm2/joint", True),
        ("arm/*/bolt", "arm/joint/bolt", True),
        ("arm/*/bolt", "arm/a/b/bolt", False),
        ("*", "anything/at/all", True),
        ("bolt (1)", "bolt (1)", True),
        ("a.b", "axb", False),
        ("bolt_?", "bolt_1", True),
        ("bolt_?", "bolt_10", False),
        ("1/4 bolt", "1/4 bolt", True),
    ],
)
def test_patterns(pattern: str, path: str, hit: bool) -> None:
    """``*`` within a level, ``**`` across, all below a matched sub-assembly; the rest is literal."""
    assert matches(pattern, instance(path)) is hit


def test_product_patterns() -> None:
    """Instance names of SolidWorks are NAUO1 and so on; products have the real names."""
    placed = instance("NAUO1/NAUO7", "upper arm/M4 bolt")
    assert matches("product:upper arm", placed)
    assert matches("product:M4*", placed)
    assert not matches("upper arm", placed)


def test_default_links_are_first_level_sub_assemblies(assemble: Fixture) -> None:
    """Parts beside them belong to the root link, which comes first."""
    asm = assemble(("base/a", PART), ("plate", PART), ("arm/b", PART), ("base/c", PART))
    claims = claim(asm)
    assert claims.members == {"base_link": (1,), "base": (0, 3), "arm": (2,)}
    assert next(iter(claims.members)) == "base_link"
    assert (claims.unclaimed, claims.rooted) == ((), (1,))


def test_no_mass_is_lost_without_a_map(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """The links together weigh what the assembly weighs; a warning names parts that lie beside them."""
    asm = assemble(("base_link/a", PART), ("plate", PART), ("plate#2", PART), ("arm/b", PART))
    report = compute(asm, "Name,Material,Mass\np,steel,\n")
    assert sum(link.props.mass for link in report.links.values()) == pytest.approx(report.total.mass)
    assert report.links["base_link"].props.mass == pytest.approx(3 * 7.85)
    assert codes(report) == ["in_root_link"]
    assert "2 pieces, 15.7 kg" in report.warnings[0].message
    assert report.unclaimed == ()


def test_the_root_link_has_the_name_that_the_urdf_gives_it() -> None:
    """base_link where there is one (a root without mass stands above it), else the tree's root."""
    joint = '<joint name="{0}"><parent link="{1}"/><child link="{2}"/></joint>'
    for names, root in ((("torso", "arm"), "torso"), (("world", "base_link", "arm"), "base_link")):
        text = "".join(f'<link name="{name}"/>' for name in names)
        text += "".join(joint.format(b, a, b) for a, b in pairwise(names))
        assert Urdf(f'<robot name="r">{text}</robot>'.encode()).root == root
    assert Urdf(b'<robot name="r"><link name="a"/><link name="b"/></robot>').root == "base_link"


def test_without_sub_assemblies_all_is_one_link(assemble: Fixture) -> None:
    """A flat file is one link, named after it."""
    assert claim(assemble(("a", PART), ("b", PART), name="gripper")).members == {"gripper": (0, 1)}


def test_unclaimed_parts_are_in_no_link_but_in_the_total(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """Their mass is reported, with one warning per product."""
    asm = assemble(("base/a", PART), ("plate", PART))
    links = link_map({"links": {"base": ["base"]}})
    report = compute(asm, "Name,Material,Mass\np,steel,\n", links=links)
    assert report.links["base"].props.mass == pytest.approx(7.85)
    assert report.total.mass == pytest.approx(15.7)
    assert [part.total_mass for part in report.unclaimed] == [pytest.approx(7.85)]
    assert codes(report) == ["unclaimed"]
    assert "7.85 kg" in report.warnings[0].message


def test_loose_parts_can_be_given_a_link(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """The user's word for what lies beside the sub-assemblies."""
    asm = assemble(("arm/a", PART), ("plate", PART))
    report = compute(asm, "Name,Material,Mass\np,steel,\n", loose_link="base_link")
    assert report.links["base_link"].props.mass == pytest.approx(7.85)
    assert report.unclaimed == ()
    assert codes(report) == []


def test_map_claims_in_order_and_reports_overlaps(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """The first link has it; the second is reported; a pattern without effect as well."""
    asm = assemble(("base/a", PART), ("arm/b", PART))
    links = link_map({"links": {"base": ["base", "arm/b"], "arm": ["arm/**", "wrist"], "empty": ["nothing"]}})
    report = compute(asm, "Name,Material,Mass\np,steel,\n", links=links)
    assert report.links["base"].props.mass == pytest.approx(15.7)
    assert report.links["arm"].props.mass == 0
    found = {(w.link_name, str(w.code)) for w in report.warnings}
    assert found == {
        ("arm", "claimed_twice"),
        ("arm", "pattern_unused"),
        ("arm", "zero_mass_link"),
        ("empty", "pattern_unused"),
        ("empty", "zero_mass_link"),
    }


def test_an_overlap_of_many_parts_is_reported_once(assemble: Fixture, compute: Fixture) -> None:
    """A thousand bolts that two links want are one warning, not a thousand."""
    asm = assemble(*((f"arm/b{i}", PART) for i in range(1000)))
    report = compute(
        asm, "Name,Material,Mass\np,steel,\n", links=link_map({"links": {"a": ["arm"], "b": ["arm"]}})
    )
    (told,) = [w for w in report.warnings if w.code == "claimed_twice"]
    assert told.message.startswith("arm/b0 and 999 more of it: a has them")


def test_map_from_yaml(tmp_path: Path, assemble: Fixture, compute: Fixture) -> None:
    """The documented form, with frames."""
    path = tmp_path / "links.yaml"
    path.write_text(
        "links:\n  base: base\n  arm:\n    parts: ['arm/**']\n"
        "    origin: {xyz: [1, 0, 0], rpy: [0, 0, 1.5707963267948966]}\n",
        "utf-8",
    )
    asm = assemble(("base/a", PART), ("arm/b", PART, origin_frame((1, 2, 0), (0, 0, 0))))
    report = compute(asm, None, links=read_link_map(path))
    assert report.links["arm"].props.com == pytest.approx([2, 0, 0])
    assert report.links["arm"].frame.description == "origin in the link map"
    assert report.links["base"].frame.description == "assembly frame"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (None, "wanted “links:”"),
        ({"links": {}}, "wanted “links:”"),
        (
            {"links": {"a": 3, "b": {"parts": ["x"], "colour": 1}}},
            "a: wanted a list.*b: unknown key “colour”",
        ),
        ({"links": {"a": {"parts": ["x"], "frame": "f", "origin": {}}}}, "both a frame and an origin"),
        ({"links": {"a": {"parts": ["x"], "origin": {"xyz": [1, 2]}}}}, "origin: wanted"),
        ({"links": {"a": {"parts": ["x"], "origin": {"xyz": "far"}}}}, "origin: wanted"),
    ],
)
def test_bad_maps_name_all_problems(data: Any, words: str) -> None:
    """All problems of the file at once."""
    with pytest.raises(ConfigError, match=words):
        link_map(data)


def test_map_files_that_cannot_be_read(tmp_path: Path) -> None:
    """Absent, or no YAML."""
    bad = tmp_path / "bad.yaml"
    bad.write_text("links: [a: {", "utf-8")
    with pytest.raises(ConfigError, match="not valid YAML"):
        read_link_map(bad)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_link_map(tmp_path / "none.yaml")


def test_a_link_given_twice_is_refused(tmp_path: Path) -> None:
    """YAML would take the last one; the parts of the first would be in no link."""
    path = tmp_path / "twice.yaml"
    path.write_text("links:\n  arm: [a]\n  base: [b]\n  arm: [c]\n", "utf-8")
    with pytest.raises(ConfigError, match=r"given twice: “arm” \(line 4\)"):
        read_link_map(path)


@pytest.mark.parametrize(
    "text",
    [
        "links: &a\n  x: *a\n",
        "links:\n  ? [a, b]\n  : [c]\n",
        "- 1\n",
        "links: [a]\n",
        "a: 1\n---\nb: 2\n",
        "",
    ],
)
def test_odd_yaml_is_a_plain_error(tmp_path: Path, text: str) -> None:
    """A ring, a key that is a list, a list, several documents, nothing: one sentence with the file."""
    path = tmp_path / "odd.yaml"
    path.write_text(text, "utf-8")
    with pytest.raises(ConfigError, match=r"odd\.yaml"):
        read_link_map(path)


def test_frame_of_a_sub_assembly(assemble: Fixture, compute: Fixture) -> None:
    """``frame: arm`` gives the link's numbers in the placed sub-assembly's own axes."""
    frame = origin_frame((0, 0, 2), (np.pi / 2, 0, 0))
    asm = assemble(("arm/b", box("b", 0.1, 0.2, 0.3), frame), frames={("arm",): frame})
    links = link_map({"links": {"arm": {"parts": ["arm"], "frame": "arm"}}})
    report = compute(asm, "Name,Material,Mass\nb,steel,\n", links=links)
    own = compute(asm, "Name,Material,Mass\nb,steel,\n", frame=FrameChoice.OWN)
    for found in (report.links["arm"], own.links["arm"]):
        assert found.props.com == pytest.approx([0, 0, 0], abs=1e-12)
        assert found.props.inertia == pytest.approx(np.diag(np.diag(found.props.inertia)), abs=1e-15)
        assert found.props.inertia[0, 0] == pytest.approx(7850 * 0.006 * (0.04 + 0.09) / 12)


def test_a_frame_that_is_not_there_is_an_error(assemble: Fixture) -> None:
    """With the link and the name."""
    links = link_map({"links": {"arm": {"parts": ["arm"], "frame": "wrist"}}})
    with pytest.raises(ConfigError, match="arm: there is no placed sub-assembly or part “wrist”"):
        claim(assemble(("arm/b", PART)), links)


def test_a_mirrored_frame_is_refused(assemble: Fixture, compute: Fixture) -> None:
    """A left-handed link frame exists in no simulator."""
    asm = assemble(("arm/b", PART), frames={("arm",): np.diag([-1.0, 1, 1, 1])})
    with pytest.raises(InputError, match="mirrored"):
        compute(asm, None, frame=FrameChoice.OWN)


def test_names_that_yaml_takes_for_other_values_are_names(tmp_path: Path, assemble: Fixture) -> None:
    """A link called "on", one called 1.10, a part called 12."""
    path = tmp_path / "map.yaml"
    path.write_text(
        "links:\n  on: [12]\n  1.10: [null]\n  0x10: {parts: [yes], origin: {xyz: [0, 0, 1e-1]}}\n"
    )
    asm = assemble(("12", PART), ("null", PART), ("yes", PART))
    assert claim(asm, read_link_map(path)).members == {"on": (0,), "1.10": (1,), "0x10": (2,)}
    path.write_text("links:\n  arm:\n  hand: ['']\n")
    with pytest.raises(ConfigError, match=r"arm: wanted a list of patterns.*hand: wanted a list of patterns"):
        read_link_map(path)


def test_many_stars_take_no_time() -> None:
    """Each star is tried once: a pattern of fifteen was worth an hour."""
    long = Instance(("a" * 200,), ("a" * 200,), "p", np.eye(4))
    assert not matches("a*" * 15 + "b", long)
    assert matches("a*" * 15, long)


@given(st.text("ab*?/", min_size=1, max_size=7), st.text("ab/", min_size=1, max_size=7))
def test_patterns_match_as_they_are_documented(pattern: str, name: str) -> None:
    """Against a matcher that tries everything, level by level."""

    def level(p: str, n: str) -> bool:
        if not p:
            return not n
        if p[0] == "*":
            return any(level(p[1:], n[k:]) for k in range(len(n) + 1))
        return bool(n) and p[0] in (n[0], "?") and level(p[1:], n[1:])

    def levels(p: list[str], n: list[str]) -> bool:
        if not p:
            return not n
        if p[0] == "**":
            return any(levels(p[1:], n[k:]) for k in range(len(n) + 1))
        return bool(n) and level(p[0], n[0]) and levels(p[1:], n[1:])

    path = tuple(part or "x" for part in name.split("/"))
    asked = pattern.strip("/").split("/")
    if "" in asked:
        return  # an empty level is no pattern that anybody documents
    wanted = any(levels(asked, list(path[:end])) for end in range(1, len(path) + 1))
    assert matches(pattern, Instance(path, path, "p", np.eye(4))) == wanted


def test_an_origin_in_degrees_is_refused() -> None:
    """rpy is in rad: 90 is fourteen turns."""
    with pytest.raises(ConfigError, match="more than a whole turn; is it in degrees"):
        link_map({"links": {"a": {"parts": ["x"], "origin": {"rpy": [0, 0, 90]}}}})


def robot(parent: str, child: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> Urdf:
    """Two links and the joint between them."""
    joint = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
    return Urdf(
        f'<robot><link name="{parent}"/><link name="{child}"/><joint>{joint}</joint></robot>'.encode()
    )


NAMES = ("base_link", "upper_arm", "forearm", "gripper")
LOOSE = {"forearm": "link_loose", "gripper": "link_loose"}
ABSENT = {"gripper": "link_not_in_urdf"}
URDFS = {
    "as it should be": (NAMES, "base_link>upper_arm upper_arm>forearm forearm>gripper", {}),
    "another case": (
        ("base_link", "Upper_Arm", "forearm link", "GRIPPER"),
        "base_link>Upper_Arm Upper_Arm>forearm_link forearm_link>GRIPPER", {},
    ),
    "a joint is missing": (NAMES, "base_link>upper_arm forearm>gripper", LOOSE),
    "a parent that is no link": (NAMES, "base_link>upper_arm ghost>forearm forearm>gripper", LOOSE),
    "a link is missing": (NAMES[:3], "base_link>upper_arm upper_arm>forearm", ABSENT),
    "another name": ((*NAMES[:3], "hand"), "base_link>upper_arm upper_arm>forearm forearm>hand", ABSENT),
    "two of one word": (
        (*NAMES[:3], "Gripper", "GRIPPER"),
        "base_link>upper_arm upper_arm>forearm forearm>Gripper forearm>GRIPPER", ABSENT,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", URDFS)
def test_links_that_the_urdf_does_not_hold_together(case: str, assemble: Fixture, compute: Fixture) -> None:
    """Mutations of a URDF: each link whose mass or frame is lost has a warning; the others are filled."""
    names, joints, wanted = URDFS[case]
    text = "".join(f'<link name="{name}"/>' for name in names)
    for joint in joints.split():
        parent, child = joint.replace("forearm_link", "forearm link").split(">")
        text += f'<joint name="{child}"><parent link="{parent}"/><child link="{child}"/></joint>'
    urdf = Urdf(f'<robot name="r">{text}</robot>'.encode())
    report = compute(assemble(*((f"{name}/p", PART) for name in NAMES)), None, urdf=urdf)
    assert {w.link_name: w.code for w in report.warnings if w.code != "no_bom"} == wanted
    filled = urdf.filled({name: link.props for name, link in report.links.items()})
    assert len(filled.written) == len(NAMES) - (wanted is ABSENT)


def far_frames(report: Any) -> list[str]:
    """The warnings about frames in another unit."""
    return [w.message for w in report.warnings if w.code == "frame_far"]


def test_a_urdf_in_millimetres_is_doubted(assemble: Fixture) -> None:
    """Joints at 120 m in an arm of half a metre; 0.12 m are fine, and so is a far assembly frame."""
    asm = assemble(("base/a", PART), ("arm/b", PART, placement((0, 0, 0.5))))
    for factor, doubted in ((1.0, False), (1000.0, True)):
        task = Task(
            load_materials(freecad=False),
            frame=FrameChoice.URDF,
            urdf=robot("base", "arm", f"0 0 {0.12 * factor}"),
        )
        found = far_frames(calculate(asm, None, task))
        assert bool(found) == doubted
        assert not doubted or ("arm lies 119.5 m" in found[0] and "in mm?" in found[0])
    far = assemble(("base/a", PART, placement((900, 0, 0))), ("arm/b", PART, placement((900, 0, 0.5))))
    assert far_frames(calculate(far, None, Task(load_materials(freecad=False)))) == []
    links = {"all": {"parts": ["**"], "origin": {"xyz": [0, 0, 300]}}}
    assert far_frames(calculate(asm, None, Task(load_materials(freecad=False), links=links)))


def test_two_links_that_mean_one_word_keep_their_names(assemble: Any, compute: Any, codes: Any) -> None:
    """Either may be the URDF's: both named like it would be one link, and the parts of the other lost."""
    cube = box("a", 0.1, 0.1, 0.1)
    alone = compute(assemble(("Arm link/a", cube)), "Name,Mass\na,1 kg\n", urdf=robot("base", "arm"))
    assert list(alone.links) == ["arm"]
    both = assemble(("Arm link/a", cube), ("ARM/a", cube))
    report = compute(both, "Name,Mass\na,1 kg\n", urdf=robot("base", "arm"))
    assert {name: link.props.mass for name, link in report.links.items()} == {"Arm link": 1.0, "ARM": 1.0}
    assert codes(report).count("link_not_in_urdf") == 2


def test_a_link_without_mass_need_not_be_in_the_urdf(assemble: Any, compute: Any, codes: Any) -> None:
    """Nothing of it is lost; one with a mass is named."""
    parts = assemble(("arm/a", box("a", 0.1, 0.1, 0.1)), ("marks/b", box("b", 0.1, 0.1, 0.1)))
    for mass, told in (("0 kg*", 0), ("1 kg", 1)):
        report = compute(parts, f"Name,Mass\na,1 kg\nb,{mass}\n", urdf=robot("base", "arm"))
        assert codes(report).count("link_not_in_urdf") == told


def test_a_urdf_in_degrees_is_doubted() -> None:
    """A joint turned by 90 rad; one by half a turn is none."""
    (found,) = robot("a", "b", rpy="0 0 90").doubts
    assert "a → b" in found
    assert "rad" in found
    assert robot("a", "b", rpy="0 0 3.1415927").doubts == ()


def test_a_frame_that_only_turns_differs_as_well(assemble: Any, compute: Any, codes: Any) -> None:
    """At one origin, turned by a quarter: the tensor is another one."""
    asm = assemble(("l/a", box("a", 0.1, 0.2, 0.3)))
    for rpy, told in (("0 0 1.5707963", True), ("0 0 0", False)):
        report = compute(asm, "Name,Mass,Material\na,1 kg,\n", urdf=robot("root", "l", rpy=rpy))
        assert ("frame_differs" in codes(report)) is told
