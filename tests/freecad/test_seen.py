# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files like those that were counted wrong, built by each FreeCAD: reader, live walk and witness agree."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from freecad_cases import answers, machines
from freecad_cases.machines import WANTED

from silo.bom.entry import Extraction
from silo.bom.findings import FindingCode
from silo.freecads.run import run_freecad

pytestmark = pytest.mark.freecad

SCRIPT = Path(__file__).parent / "freecad_cases" / "seen.py"
LAWS = (FindingCode.UNEXPLAINED, FindingCode.TWO_ROLES, FindingCode.NO_ROLE)


def lines(found: Any) -> dict[str, int]:
    assert isinstance(found, Extraction), found
    pieces: Counter[str] = Counter()
    for entry in found.entries:
        value = entry.variant.removeprefix("Height = ").removesuffix(" mm")
        name = f"missing_{entry.object_name}" if entry.missing else entry.object_name
        number = "_item" if entry.is_own_item else ""
        pieces[f"{name}_{value}{number}" if value else name] += entry.quantity
    for own in found.assembly.own:
        pieces[f"*{own.object_name}"] += own.quantity
    return dict(pieces)


@pytest.mark.parametrize("version", WANTED[1:])
def test_what_is_seen_counts(version: str, tmp_path: Path) -> None:
    freecad = machines.need(version)
    env, out = freecad.profile(tmp_path / "profile"), tmp_path.resolve() / "seen"
    out.mkdir()
    freecad.must_run(SCRIPT, {**env, "SILO_OUT": str(out)}, cwd=out)
    right = json.loads((out / "right.json").read_text())
    tops = {name: out / name / "top.FCStd" for name in right}
    said: dict[str, Any] = {}
    live = dict(
        run_freecad([str(top) for top in tops.values()], command=freecad.command, env=env, witness=said)
    )
    for name, top in tops.items():
        file = answers.read(top)
        assert lines(file) == right[name], name
        assert lines(live[str(top)]) == right[name], name
        assert isinstance(file, Extraction)
        assert not file.findings_of(*LAWS), name
        assert all(one["agrees"] for one in said[str(top)]), (name, said[str(top)])
