# SPDX-License-Identifier: LGPL-2.1-or-later
"""Faults planted in the roles of objects, one at a time: each that changes a count is found."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from fakes import Doc, Obj

from silo.bom import extract
from silo.bom.entry import Extraction
from silo.bom.findings import FindingCode
from silo.bom.walk import roles
from silo.bom.walk.contents import ObjectRole

FOUND_BY = (FindingCode.UNEXPLAINED, FindingCode.TWO_ROLES, FindingCode.NO_ROLE)


def bolt() -> Obj:
    return Doc("/v/bolt.FCStd").body("Bolt")


def machine() -> Obj:
    """Links, an array, hidden pieces, a cut, a modified link, hardware, a compound and a folder."""
    doc = Doc("/v/top.FCStd")
    plate, drill = (
        doc.link("Plate", bolt(), Visibility=False),
        doc.add("Part::Box", "Drill", Visibility=False),
    )
    master, member = doc.screw("Master", Visibility=False), doc.add("Part::Box", "Member", Visibility=False)
    foam, device = doc.add("Part::Box", "Foam", Visibility=False), doc.body("Device")
    base = doc.link("Base", bolt(), Visibility=False)
    return doc.assembly(
        doc.link("L", bolt()),
        doc.array("Row", bolt(), 3),
        doc.link("Quiet", bolt(), Visibility=False),
        *(plate, drill, doc.add("Part::Cut", "Drilled", Base=plate, Tool=drill)),
        *(master, doc.link("Copy", master, ElementCount=2)),
        *(foam, device, doc.add("Part::Cut", "Insert", Base=foam, Tool=device)),
        *(base, doc.add("Part::FeaturePython", "Array", Base=base, Count=4)),
        *(member, doc.add("Part::Compound", "Pair", Links=[member])),
        doc.part("Sub", doc.link("Inner", bolt()), doc.screw("Screw")),
        *(doc.body("Body"), doc.body("Stored", Visibility=False)),
    )


def pieces(found: Extraction) -> list[tuple[Any, ...]]:
    lines = (*found.entries, *found.assembly.own)
    return sorted((line.key, line.quantity, sorted(line.instances)) for line in lines)


def with_fault(name: str, planted: ObjectRole) -> Callable[..., Any]:
    right = roles.Reading._judged

    def judged(self: Any, tree: Any, key: Any, obj: Any, kind: Any) -> Any:
        role, node = right(self, tree, key, obj, kind)
        if key[1] != name:
            return role, node
        if planted is ObjectRole.COMPONENT:
            return planted, node or self._node(key, obj, kind)
        return planted, None

    return judged


OBJECTS = [member.Name for member in machine().Group] + ["Inner", "Screw"]


@pytest.mark.parametrize("name", OBJECTS)
def test_each_planted_role_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = extract(machine())
    assert not right.findings_of(*FOUND_BY)
    for planted in ObjectRole:
        with monkeypatch.context() as patch:
            patch.setattr(roles.Reading, "_judged", with_fault(name, planted))
            wrong = extract(machine())
        if pieces(wrong) != pieces(right):
            assert wrong.findings_of(*FOUND_BY), (name, planted)


def test_enough_faults_change_a_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise the test above would show nothing."""
    right, changed = pieces(extract(machine())), 0
    for name in OBJECTS:
        for planted in ObjectRole:
            with monkeypatch.context() as patch:
                patch.setattr(roles.Reading, "_judged", with_fault(name, planted))
                changed += pieces(extract(machine())) != right
    assert changed >= 40
