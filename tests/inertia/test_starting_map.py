# SPDX-License-Identifier: LGPL-2.1-or-later
"""Link maps to start from: every instance once, in a link that a person would expect."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from bodies import box, placement
from hypothesis import given
from hypothesis import strategies as st

from silo.inertia.assembly import Assembly, Instance
from silo.inertia.geometry.graph import unique_names
from silo.inertia.links.claims import claim
from silo.inertia.links.link_map import link_map, read_link_map
from silo.inertia.links.starting_map import as_map, as_yaml, starting_map

Fixture = Callable[..., Any]
PART = box("p", 0.1, 0.1, 0.1)


def read_back(assembly: Assembly, tmp_path: Path, **options: Any) -> dict[str, list[str]]:
    """Link → names of its instances, through the YAML file; checked against what was meant."""
    start = starting_map(assembly, **options)
    path = tmp_path / "map.yaml"
    path.write_text(as_yaml(start, assembly), "utf-8")
    claims = claim(assembly, read_link_map(path))
    assert claims.members == start.members
    assert (claims.unclaimed, claims.twice, claims.unused) == ((), (), ())
    return {name: [assembly.instances[i].name for i in ids] for name, ids in claims.members.items()}


def test_sub_assemblies_are_links_and_loose_parts_the_root(assemble: Fixture, tmp_path: Path) -> None:
    """As without a map."""
    asm = assemble(("base/a", PART), ("plate", PART), ("arm/b", PART), ("arm/c/d", PART))
    found = read_back(asm, tmp_path)
    assert found == {"base_link": ["plate"], "base": ["base/a"], "arm": ["arm/b", "arm/c/d"]}
    assert claim(asm).members == starting_map(asm).members


def test_a_urdf_s_names_decide_the_innermost_level_first(assemble: Fixture, tmp_path: Path) -> None:
    """By link names without "link", by mesh names, at any depth; the rest is in the root."""
    asm = assemble(
        ("robot/Upper Arm <1>/a", PART),
        ("robot/Upper Arm <1>/forearm:1/b", PART),
        ("robot/x", PART, None, "robot/Gripper_v2"),
        ("robot/bolt", PART),
    )
    links = {
        "base": (),
        "upper_arm_link": (),
        "link_forearm": (),
        "hand": ("package://r/meshes/gripper_v2.stl",),
        "tool": (),
    }
    found = read_back(asm, tmp_path, urdf_links=links, root="base")
    assert found == {
        "base": ["robot/bolt"],
        "upper_arm_link": ["robot/Upper Arm <1>/a"],
        "link_forearm": ["robot/Upper Arm <1>/forearm:1/b"],
        "hand": ["robot/x"],
    }
    start = starting_map(asm, links, root="base")
    assert start.empty == ("tool",)
    assert '#  "tool":' in as_yaml(start, asm)
    assert start.how.startswith("3 of 4 parts")


def test_a_mesh_that_links_share_says_nothing(assemble: Fixture) -> None:
    """Four wheels of one mesh: their parts are left in the root, for a person."""
    asm = assemble(("wheel/a", PART), ("body/b", PART))
    links = {"body": (), "front": ("wheel.stl",), "rear": ("wheel.stl",)}
    assert starting_map(asm, links, root="body").members == {"body": (0, 1)}


def test_flat_exports_are_cut_by_position(assemble: Fixture, tmp_path: Path) -> None:
    """Three heaps of parts far apart are three links, the nearest to the origin first; --clusters decides."""
    random = np.random.default_rng(4)
    heaps = [(0, 0, 0), (0, 0, 2), (0, 3, 2)]
    parts = [
        (f"part {h}.{n}", PART, placement(np.array(heap) + random.normal(0, 0.05, 3)))
        for n in range(6)
        for h, heap in enumerate(heaps)
    ]
    asm = assemble(*parts)
    found = read_back(asm, tmp_path)
    assert {name: {path[:6] for path in paths} for name, paths in found.items()} == {
        "link_1": {"part 0"},
        "link_2": {"part 1"},
        "link_3": {"part 2"},
    }
    assert len(read_back(asm, tmp_path, clusters=2)) == 2
    assert len(read_back(asm, tmp_path, clusters=100)) == 18
    assert read_back(assemble(("a", PART), ("b", PART), name="hand"), tmp_path) == {"hand": ["a", "b"]}


@pytest.mark.parametrize(
    "name", ["bolt *", "M?", "product:x", "path:y", "a: b", "#1", "é\u2028\n", "'\"", "/x/"]
)
def test_names_with_meaning_to_yaml_or_patterns(assemble: Fixture, tmp_path: Path, name: str) -> None:
    """They are reported as they are."""
    asm = Assembly(
        "asm",
        {"p": PART},
        (
            Instance((name, "a"), (name, "a"), "p"),
            Instance(("bolt 1", "M3", "z"), ("bolt 1", "M3", "z"), "p"),
        ),
    )
    assert read_back(asm, tmp_path) == {name: [f"{name}/a"], "bolt 1": ["bolt 1/M3/z"]}


words = st.text(st.sampled_from("ab*?:/# é-"), min_size=1, max_size=3)
paths = st.lists(
    st.lists(words, min_size=1, max_size=3).map(tuple),
    min_size=1,
    max_size=12,
    unique_by=lambda path: "/".join(path),
)


@given(paths, st.integers(1, 4) | st.none())
def test_every_instance_stands_once(found: list[tuple[str, ...]], clusters: int | None) -> None:
    """Whatever the parts are called, the YAML gives each instance to one link, and says so of all."""
    tree = [path for path in found if not any(o != path and o[: len(path)] == path for o in found)]
    asm = Assembly("asm", {"p": PART}, tuple(Instance(path, path, "p") for path in tree))
    start = starting_map(asm, clusters=clusters)
    assert sorted(i for ids in start.members.values() for i in ids) == list(range(len(tree)))
    again = link_map(yaml.safe_load(as_yaml(start, asm)))
    mapped = as_map(start, asm)
    assert [(k.name, k.patterns) for k in again.links] == [(k.name, k.patterns) for k in mapped.links]


@pytest.mark.parametrize("name", ["as1-oc-214.stp", "asm4_bearing.stp", "so101_wrist_roll_pitch.step"])
def test_real_files_are_given_to_links_whole(
    name: str, real: Callable[[str], Assembly], tmp_path: Path
) -> None:
    """Public STEP files: the map as read gives what was meant."""
    pytest.importorskip("OCP.BRep", exc_type=ImportError)
    read_back(real(name), tmp_path)


ODD = st.text(
    st.one_of(
        st.sampled_from("ab*?|:#\"'\\ \n\x00\x07\x85\u2028\ud800\U0001f600\U00011af9ß[]{}&!>%@~"),
        st.characters(),
    ),
    min_size=1,
    max_size=6,
)


@given(st.lists(st.tuples(ODD, st.one_of(st.none(), ODD)), min_size=1, max_size=5))
def test_whatever_parts_are_called_the_map_reads_back(
    tmp_path_factory: pytest.TempPathFactory, names: list[tuple[str, str | None]]
) -> None:
    """Wildcards, quotes, control characters, halves of characters: each part is in its link, once."""
    tops = unique_names([top for top, _ in names])
    paths = [
        (top,) if part is None else (top, *unique_names([part]))
        for top, (_, part) in zip(tops, names, strict=True)
    ]
    instances = tuple(Instance(path, path, PART.key, placement()) for path in paths)
    read_back(Assembly("odd", {PART.key: PART}, instances), tmp_path_factory.getbasetemp())
