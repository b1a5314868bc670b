# SPDX-License-Identifier: LGPL-2.1-or-later
"""Projects as people build them: each way of use that real files have, counted as a person would.

Each FreeCAD builds them. The reader, the live walker, what is weighed and FreeCAD's own view agree on each.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from freecad_cases import answers, machines
from freecad_cases.machines import WANTED

from silo.bom.entry import BomEntry, Extraction
from silo.bom.findings import FindingCode
from silo.bom.view.flat_list import flat_lines
from silo.bom.walk.standard import STANDARD_PARTS
from silo.fcstd import Library
from silo.freecads.run import run_freecad
from silo.inertia.geometry.fcstd import Entries, StoredFacts
from silo.inertia.geometry.freecad import Walk
from silo.inertia.geometry.graph import Child, unfold

pytestmark = pytest.mark.freecad

SCRIPT = Path(__file__).parent / "freecad_cases" / "uses.py"
M4, M4_20, M4_30 = (f"ISO 4762 M4×{length}" for length in (16, 20, 30))
# Project → pieces of each component, of each own part, and what is reported as lying beside.
TRUTH: dict[str, tuple[dict[str, int], dict[str, int], list[str]]] = {
    "telescope": ({M4: 1, M4_20: 1}, {"Clamp": 1}, ["Plate"]),
    "printer": ({"Top": 2, "Box": 8, M4: 4}, {}, []),
    "changed_on_copy": ({M4_20: 1, M4_30: 2, "Box": 1}, {}, []),
    "masters": ({M4: 3, M4_20: 2, M4_30: 2, "Box": 1}, {}, []),
    "model": ({"Box": 3, M4: 4}, {}, []),
    "beside": ({M4: 1, M4_20: 1, "Box": 1}, {}, ["Array", "Clone", "Group", "Mirror", "Stored"]),
    "one_file": ({}, {"Part0": 7, "Part1": 3, "Part2": 2}, []),
    "at_the_root": ({"Box": 4, M4: 2}, {"Base": 1, "Lid": 1}, []),
    "imports": ({"Box": 4, "Other": 1, "": 1}, {"Board": 1}, []),
    "cut_away": ({M4_20: 1, "Box": 1}, {"Cut2": 1}, []),
}


def name_of(entry: BomEntry) -> str:
    return entry.standard or entry.object_name


def pieces(found: Extraction) -> dict[str, int]:
    return dict(sum((Counter({name_of(one): n}) for one, n in flat_lines(found.entries)), Counter()))


def weighed(top: Path) -> Counter[str]:
    """The pieces with a mass, by their object or their designation."""
    with Library() as library:
        walk = Walk(StoredFacts(Entries()))
        key = walk.top(library.open(top), None)
        instances = unfold(walk.nodes, [Child(walk.nodes[key].name, key)], 1000).instances
    return Counter(one.prototype.removeprefix(STANDARD_PARTS).rpartition("#")[2] for one in instances)


@pytest.fixture(name="built", scope="module", params=WANTED)
def _built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Each project in its file, live, and as FreeCAD shows it."""
    freecad = machines.need(request.param)
    folder = tmp_path_factory.mktemp("uses").resolve()
    env = freecad.profile(folder / "profile")
    freecad.must_run(SCRIPT, {**env, "SILO_OUT": str(folder / "projects")}, cwd=folder)
    tops = {name: folder / "projects" / name / "top.FCStd" for name in TRUTH}
    said: dict[str, Any] = {}
    live = dict(
        run_freecad([str(top) for top in tops.values()], command=freecad.command, env=env, witness=said)
    )
    return {name: (top, live[str(top)], said[str(top)]) for name, top in tops.items()}


@pytest.mark.parametrize("project", TRUTH)
def test_each_way_of_use_is_counted_as_a_person_would(built: Any, project: str) -> None:
    """By the file and in FreeCAD alike, and as FreeCAD's own view has it."""
    top, live, accounts = built[project]
    counts, own, beside = TRUTH[project]
    file = answers.read(top)
    for found in (file, live):
        assert (pieces(found), found.blocked) == (counts, False)
        assert {one.object_name: one.quantity for one in found.assembly.own} == own
        reported = found.findings_of(FindingCode.BESIDE_ASSEMBLY)
        assert sorted(place.obj for one in reported for place in one.where) == beside
    assert [one["sentence"] for one in accounts if not one["agrees"]] == []


@pytest.mark.parametrize("project", TRUTH)
def test_what_is_counted_is_weighed(built: Any, project: str) -> None:
    top, _, _ = built[project]
    found = answers.read(top)
    leaves = Counter({name_of(one): n for one, n in flat_lines(found.entries) if not one.children})
    leaves.update({one.object_name: one.quantity for one in found.assembly.own})
    assert weighed(top) == leaves
