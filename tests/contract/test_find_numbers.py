# SPDX-License-Identifier: LGPL-2.1-or-later
"""Find numbers stay: over removals, reorders, syncs, restore, undo and import, until the next release."""

from __future__ import annotations

import os
import random

import pytest
from hunting import BOTH
from server_testing import Api, another_user, bom


def numbers(api: Api, parent: str) -> dict[str, str | None]:
    """Part number → find number of a BOM."""
    return {line["child_part_number"]: line["find_number"] for line in api.get(bom(parent))}


def changes(api: Api, parent: str) -> list[int]:
    """The ids of the changes of a BOM, newest first."""
    return [change["id"] for change in api.get(bom(parent, "history"))]


@BOTH
def test_a_line_keeps_its_number(api: Api) -> None:
    """What is removed is not given again; what comes back comes back with its number."""
    top, a, b, c, d = api.items(5)
    api.merge(top, {a: 1, b: 2})
    assert numbers(api, top) == {a: "10", b: "20"}
    api.merge(top, {c: 1, b: 3, a: 1})
    assert numbers(api, top) == {a: "10", b: "20", c: "30"}
    api.good("DELETE", bom(top, c))
    api.add_line(top, d)
    assert numbers(api, top) == {a: "10", b: "20", d: "40"}
    api.merge(top, {a: 1, b: 3, c: 5})
    assert numbers(api, top) == {a: "10", b: "20", d: "40", c: "30"}
    api.merge(top, {a: 1})
    assert numbers(api, top)[b] == "20"
    api.good("DELETE", bom(top, b))
    api.good("POST", bom(top, "undo"), {"change_id": changes(api, top)[0]})
    assert numbers(api, top)[b] == "20"


@BOTH
def test_a_release_frees_the_numbers_of_removed_lines(api: Api) -> None:
    """Then the next line gets the number; a line that comes back later gets another."""
    top, a, b, c = api.items(4)
    api.merge(top, {a: 1, b: 1})
    api.good("DELETE", bom(top, b))
    removal = changes(api, top)[0]
    approver = another_user(api, role="viewer", approver=True)
    api.good("POST", f"/api/items/{top}/releases", {"with_parts": True})
    approver.good("POST", f"/api/items/{top}/releases/A/approval", {"override": "a test"})
    api.merge(top, {a: 1, c: 1})
    assert numbers(api, top) == {a: "10", c: "20"}
    api.good("POST", bom(top, "undo"), {"change_id": removal})
    assert numbers(api, top) == {a: "10", c: "20", b: "30"}


@BOTH
def test_cad_proposes_and_the_server_decides(api: Api) -> None:
    """A free number is taken; one that another line has is not, nor does it change a line that is there."""
    top, a, b, c = api.items(4)
    entry = {"child_part_number": a, "quantity": 1, "find_number": "7"}
    api.good("POST", bom(top, "merge"), {"entries": [entry]})
    assert numbers(api, top) == {a: "7"}
    more = [{**entry, "find_number": "8"}, {"child_part_number": b, "quantity": 1, "find_number": "7"}]
    api.good("POST", bom(top, "merge"), {"entries": [*more, {"child_part_number": c, "quantity": 1}]})
    assert numbers(api, top) == {a: "7", b: "10", c: "20"}
    long = {"child_part_number": a, "quantity": 1, "find_number": "1" * 33}
    error = api.bad(400, "POST", bom(top, "merge"), {"entries": [long]})
    assert "entries[0].find_number" in str(error["problems"])


@BOTH
def test_a_number_by_hand_wins(api: Api) -> None:
    """It is taken as it is, a sync does not change it, and the next line gets the next one."""
    top, a, b, c = api.items(4)
    api.merge(top, {a: 1, b: 1})
    api.edit_line(top, b, find_number="5a")
    api.merge(top, {a: 1, b: 4, c: 1})
    assert numbers(api, top) == {a: "10", b: "5a", c: "20"}
    api.edit_line(top, a, find_number="500")
    api.good("POST", bom(top, "import"), body=f"PN,Qty,Find number\n{a},1,500\n{b},4,6\n{c},1,20\n".encode())
    assert numbers(api, top) == {a: "500", b: "6", c: "20"}


OPERATIONS = int(os.environ.get("SILO_FIND_NUMBER_OPERATIONS", "60"))


@BOTH
@pytest.mark.parametrize("seed", [1, 2])
def test_numbers_are_a_matter_of_the_line(api: Api, seed: int) -> None:
    """Random merges, edits, removals, undos and restores: each line has a number, none has two, and none
    goes to another part. A plain notebook, which knows no server, keeps the account."""
    chance, given = random.Random(seed), dict[str, str]()
    top, *parts = api.items(7)
    for _ in range(OPERATIONS):
        there = list(numbers(api, top))
        kind = chance.choice(["merge", "add", "remove", "undo", "restore"])
        if kind == "merge":
            api.merge(
                top, {part: chance.randint(1, 9) for part in chance.sample(parts, chance.randint(1, 5))}
            )
        elif kind == "add":
            api.call("POST", bom(top), {"child_part_number": chance.choice(parts), "quantity": 1})
        elif kind == "remove" and there:
            api.good("DELETE", bom(top, chance.choice(there)))
        elif kind in ("undo", "restore") and (made := changes(api, top)):
            api.call("POST", bom(top, kind), {"change_id": chance.choice(made[:5])})
        now = numbers(api, top)
        assert None not in now.values()
        assert len(set(now.values())) == len(now)
        for part, number in now.items():
            assert given.setdefault(part, str(number)) == number
    assert len(set(given.values())) == len(given)
