# SPDX-License-Identifier: LGPL-2.1-or-later
"""Decisions on what a merge left open, undo, history, compare, restore."""

from __future__ import annotations

from typing import Any

import pytest
from hunting import BOTH
from server_testing import Api, bom


def decide(api: Api, parent: str, **actions: str) -> Any:
    """Decide by part number → action."""
    decisions = [{"child_part_number": number, "action": action} for number, action in actions.items()]
    return api.good("POST", bom(parent, "resolve"), {"decisions": decisions})


@pytest.fixture
def unreferenced(api: Api) -> tuple[str, str, str]:
    """An assembly whose two parts are not referenced any more."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 1, b: 2})
    api.merge(parent, {})
    return parent, a, b


def test_keep_one_remove_one_and_the_next_sync_is_quiet(api: Api, unreferenced: Any) -> None:
    """The whole story: banner → keep one as intentional, remove one → the next merge warns of nothing."""
    parent, a, b = unreferenced
    review = api.get(bom(parent, "review"))
    assert [line["child_part_number"] for line in review["unreferenced"]] == [a, b]
    decisions = [
        {"child_part_number": a, "action": "keep", "reason": "bought separately"},
        {"child_part_number": b, "action": "remove"},
    ]
    api.good("POST", bom(parent, "resolve"), {"decisions": decisions})
    line = api.lines(parent)[a]
    assert (line["source"], line["reason"], line["unreferenced_since"]) == (
        "manual",
        "bought separately",
        None,
    )
    assert api.merge(parent, {})["warnings"] == []
    assert api.quantities(parent) == {a: 1}
    change = api.get(bom(parent, "history"))[1]
    assert (change["kind"], change["summary"], change["reason"]) == (
        "resolve",
        "1 removed, 1 kept as intentional",
        "bought separately",
    )


@BOTH
def test_undo_takes_a_decision_back(api: Api, unreferenced: Any) -> None:
    """Undo of a bulk decision brings every line back as it was, id and flag included."""
    parent, a, b = unreferenced
    before = api.get(bom(parent))
    change = decide(api, parent, **{a: "keep", b: "remove"})
    api.good("POST", bom(parent, "undo"), {"change_id": change["change_id"]})
    assert api.get(bom(parent)) == before
    newest = api.get(bom(parent, "history"))[0]
    assert (newest["kind"], newest["refers_to"]) == ("undo", change["change_id"])
    again = api.good("POST", bom(parent, "undo"), {"change_id": newest["id"]})
    assert list(api.lines(parent)) == [a]
    assert again["version"] > newest["version"]


def test_undo_is_refused_where_the_line_went_on(api: Api, unreferenced: Any) -> None:
    """What changed again since is not overwritten: 409 names it."""
    parent, a, _ = unreferenced
    change = decide(api, parent, **{a: "keep"})
    api.edit_line(parent, a, quantity=9)
    error = api.bad(409, "POST", bom(parent, "undo"), {"change_id": change["change_id"]})
    assert a in error["message"]


def test_undo_of_a_removal_makes_no_second_line(api: Api) -> None:
    """The part was added again meanwhile, as another line: there is nothing to bring back."""
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    api.good("DELETE", bom(parent, a))
    removal = api.get(bom(parent, "history"))[0]["id"]
    api.add_line(parent, a, quantity=2)
    error = api.bad(409, "POST", bom(parent, "undo"), {"change_id": removal})
    assert a in error["message"]
    assert api.quantities(parent) == {a: 2}


def test_a_conflict_is_settled_either_way(api: Api) -> None:
    """CAD says 4, Silo says 6: keep either, one click; then the next merge is quiet."""
    for action, quantity, source in (("take_cad", 4, "assembly"), ("keep_silo", 6, "manual")):
        parent, a = api.items(2)
        api.merge(parent, {a: 4})
        api.edit_line(parent, a, quantity=6)
        assert len(api.merge(parent, {a: 4})["warnings"]) == 1
        decide(api, parent, **{a: action})
        line = api.lines(parent)[a]
        assert (line["quantity"], line["source"], line["override"]) == (quantity, source, False)
        assert api.get(bom(parent, "review"))["conflicts"] == []
        assert api.merge(parent, {a: 4})["warnings"] == []


def test_a_kept_quantity_is_asked_again_only_when_cad_says_something_else(api: Api) -> None:
    """ "Keep Silo's" holds for the number that CAD said then."""
    parent, a = api.items(2)
    api.add_line(parent, a, quantity=6)
    api.merge(parent, {a: 4})
    decide(api, parent, **{a: "keep_silo"})
    assert api.merge(parent, {a: 4})["warnings"] == []
    assert [w["assembly_quantity"] for w in api.merge(parent, {a: 5})["warnings"]] == [5]


def test_another_unit_is_an_override(api: Api) -> None:
    """CAD counts pieces: "0.5 m" is a person's, CAD's 6 pieces become no 6 m, and either can be taken."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 6, b: 1})
    line = api.edit_line(parent, a, quantity=0.5, unit="m")
    assert (line["source"], line["override"], line["cad_quantity"]) == ("manual", True, 6)
    # The unit alone counts as well: one box is not one piece.
    boxed = api.edit_line(parent, b, unit="box")
    assert (boxed["source"], boxed["override"], boxed["cad_quantity"]) == ("manual", True, 1)
    messages = [warning["message"] for warning in api.merge(parent, {a: 6, b: 1})["warnings"]]
    assert ["0.5 m" in messages[0], "1 box" in messages[1]] == [True, True]
    assert api.merge(parent, {a: 6, b: 9})["diff"]["quantity_changed"] == []
    assert [one["child_part_number"] for one in api.get(bom(parent, "review"))["conflicts"]] == [a, b]
    decide(api, parent, **{a: "take_cad", b: "keep_silo"})
    lines = api.lines(parent)
    assert (lines[a]["quantity"], lines[a]["unit"], lines[a]["source"]) == (6, None, "assembly")
    assert (lines[b]["quantity"], lines[b]["unit"], lines[b]["source"]) == (1, "box", "manual")
    assert api.merge(parent, {a: 6, b: 9})["warnings"] == []


def test_pieces_again_end_the_override(api: Api) -> None:
    """What CAD said, in pieces, is CAD's line again; another name for pieces makes no override."""
    for unit in (None, "pcs"):
        parent, a = api.items(2)
        api.merge(parent, {a: 6})
        api.edit_line(parent, a, quantity=6, unit="m")
        line = api.edit_line(parent, a, unit=unit)
        assert (line["source"], line["override"], line["unit"]) == ("assembly", False, unit)
        assert api.merge(parent, {a: 7})["diff"]["quantity_changed"]


def test_undoing_keep_silo_asks_again(api: Api) -> None:
    """The decision lives beside the line; undo takes it back too, whatever the part's number is by now."""
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    api.edit_line(parent, a, quantity=6)
    api.merge(parent, {a: 4})
    change = decide(api, parent, **{a: "keep_silo"})
    a = api.good("PUT", f"/api/items/{a}", {"part_number": f"{a}-B"})["part_number"]
    api.good("POST", bom(parent, "undo"), {"change_id": change["change_id"]})
    assert [c["child_part_number"] for c in api.get(bom(parent, "review"))["conflicts"]] == [a]
    assert len(api.merge(parent, {a: 4})["warnings"]) == 1


def test_a_decision_about_one_conflict_is_about_no_other(api: Api) -> None:
    """Neither about the BOM's other lines nor about other BOMs; so is its undo."""
    first, second, a, b = api.items(4)
    for parent in (first, second):
        api.merge(parent, {a: 4, b: 4})
        for child in (a, b):
            api.edit_line(parent, child, quantity=6)
        api.merge(parent, {a: 4, b: 4})

    def still_open(parent: str) -> set[str]:
        return {c["child_part_number"] for c in api.get(bom(parent, "review"))["conflicts"]}

    decide(api, first, **{a: "keep_silo"})
    assert (still_open(first), still_open(second)) == ({b}, {a, b})
    change = decide(api, first, **{b: "keep_silo"})
    assert (still_open(first), still_open(second)) == (set(), {a, b})
    api.good("POST", bom(first, "undo"), {"change_id": change["change_id"]})
    assert (still_open(first), still_open(second)) == ({b}, {a, b})


def test_keeping_silo_s_quantity_keeps_the_reason_of_the_line(api: Api) -> None:
    """Why the line is there stays, unless the decision gives another reason."""
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    api.merge(parent, {})
    keep = {"child_part_number": a, "action": "keep", "reason": "a spare"}
    api.good("POST", bom(parent, "resolve"), {"decisions": [keep]})
    for quantity, reason, wanted in ((5, None, "a spare"), (6, "two spares", "two spares")):
        api.merge(parent, {a: quantity})
        decision = {"child_part_number": a, "action": "keep_silo", "reason": reason}
        api.good("POST", bom(parent, "resolve"), {"decisions": [decision]})
        assert api.lines(parent)[a]["reason"] == wanted


def test_an_override_that_cad_dropped_can_be_removed_by_taking_cad(api: Api) -> None:
    """CAD no longer has it: taking CAD's word removes the line."""
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    api.edit_line(parent, a, quantity=6)
    api.merge(parent, {})
    decide(api, parent, **{a: "take_cad"})
    assert api.get(bom(parent)) == []


def test_decisions_that_do_not_fit_are_reported_together_and_change_nothing(
    api: Api, unreferenced: Any
) -> None:
    """All or nothing, all problems at once, each with its index."""
    parent, a, b = unreferenced
    api.merge(parent, {a: 1})
    before = api.get(bom(parent))
    decisions = [
        {"child_part_number": b, "action": "remove"},
        {"child_part_number": a, "action": "keep"},
        {"child_part_number": "NO-SUCH", "action": "remove"},
        {"child_part_number": a, "action": "take_cad"},
    ]
    error = api.bad(400, "POST", bom(parent, "resolve"), {"decisions": decisions})
    assert [problem[:12] for problem in error["problems"]] == ["decisions[1]", "decisions[2]", "decisions[3]"]
    assert api.get(bom(parent)) == before
    api.bad(400, "POST", bom(parent, "resolve"), {"decisions": []})
    # Two decisions about one line, under its number and its id: neither is the right one.
    line = api.lines(parent)[b]["id"]
    twice = [
        {"child_part_number": b, "action": "keep"},
        {"child_part_number": b, "line_id": line, "action": "remove"},
    ]
    error = api.bad(400, "POST", bom(parent, "resolve"), {"decisions": twice})
    assert "decided twice" in error["message"]
    assert b in api.lines(parent)


@BOTH
def test_history_says_who_when_and_what(api: Api) -> None:
    """Every merge and every edit is a change with its lines before and after."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 1, b: 1})
    api.merge(parent, {a: 3})
    api.edit_line(parent, b, notes="spare")
    api.good("DELETE", bom(parent, b))
    changes = api.get(bom(parent, "history"))
    assert [c["kind"] for c in changes] == ["edit", "edit", "merge", "merge"]
    assert [c["version"] for c in changes] == [4, 3, 2, 1]
    merge = api.get(bom(parent, f"history/{changes[2]['id']}"))
    lines = {line["child_part_number"]: line for line in merge["lines"]}
    assert (lines[a]["before"]["quantity"], lines[a]["after"]["quantity"]) == (1, 3)
    assert "unreferenced_since" in lines[b]["after"]
    removed = api.get(bom(parent, f"history/{changes[0]['id']}"))["lines"][0]
    assert (removed["before"]["notes"], removed["after"]) == ("spare", None)
    assert api.get(bom(parent, "history") + f"?before={changes[1]['id']}&limit=1") == [changes[2]]


def test_a_merge_without_change_is_in_the_history_too(api: Api) -> None:
    """Who checked, when, from which file is stored; the version stays."""
    parent, a = api.items(2)
    api.merge(parent, {a: 1})
    api.merge(parent, {a: 1}, document={"file": "A.FCStd", "revision": 2})
    newest, oldest = api.get(bom(parent, "history"))
    assert (newest["version"], newest["line_count"]) == (oldest["version"], 0)
    assert newest["document"]["revision"] == 2


@BOTH
def test_any_two_points_compare_side_by_side(api: Api) -> None:
    """Change ids, times, and now; rows say what was added, removed, changed and how."""
    parent, a, b, c = api.items(4)
    api.merge(parent, {a: 1, b: 1})
    first = api.get(bom(parent, "history"))[0]["id"]
    api.merge(parent, {a: 2, b: 1, c: 1})
    api.good("DELETE", bom(parent, b))
    rows = {row["child_part_number"]: row for row in api.get(bom(parent, f"compare?from={first}"))["lines"]}
    assert {number: row["status"] for number, row in rows.items()} == {
        a: "changed",
        b: "removed",
        c: "added",
    }
    assert rows[a]["fields"] == ["quantity"]
    assert (rows[a]["before"]["quantity"], rows[a]["after"]["quantity"]) == (1, 2)
    everything = api.get(bom(parent, "compare?from=2020-01-01T00:00:00Z&to=now"))
    assert everything["from"] == 0
    assert {row["status"] for row in everything["lines"]} == {"added"}
    same = api.get(bom(parent, "compare?from=now"))
    assert {row["status"] for row in same["lines"]} == {"unchanged"}
    for wrong in ("yesterday", "2020-01-01"):
        api.bad(400, "GET", bom(parent, f"compare?from={wrong}"))
    api.bad(404, "GET", bom(parent, "compare?from=999999999"))


def test_restore_writes_a_new_change(api: Api) -> None:
    """An earlier state comes back with its line ids; nothing of the history is lost."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 1, b: 2})
    wanted = api.get(bom(parent))
    first = api.get(bom(parent, "history"))[0]["id"]
    api.merge(parent, {a: 5})
    api.good("DELETE", bom(parent, b))
    api.good("POST", bom(parent, "restore"), {"change_id": first, "reason": "wrong file"})
    assert api.get(bom(parent)) == wanted
    changes = api.get(bom(parent, "history"))
    assert (changes[0]["kind"], changes[0]["refers_to"], changes[0]["reason"]) == (
        "restore",
        first,
        "wrong file",
    )
    assert len(changes) == 4
    api.good("POST", bom(parent, "restore"), {"change_id": 0})
    assert api.get(bom(parent)) == []
    api.bad(404, "POST", bom(parent, "restore"), {"change_id": 10**9})


def test_edits_respect_if_match(api: Api) -> None:
    """Two people with the same page open: the second gets 412."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 1})
    page = {"If-Match": api.call("GET", bom(parent)).headers["etag"]}
    assert api.call("PUT", bom(parent, a), {"notes": "first"}, headers=page).status == 200
    api.bad(412, "PUT", bom(parent, a), {"notes": "second"}, headers=page)
    api.bad(412, "DELETE", bom(parent, a), headers=page)
    api.bad(412, "POST", bom(parent), {"child_part_number": b}, headers=page)
    api.bad(412, "POST", bom(parent, "undo"), {"change_id": 1}, headers={"If-Match": '"nonsense"'})


def test_lines_by_hand(api: Api) -> None:
    """Add, change, clear, remove; a child stands in a BOM once."""
    parent, a = api.items(2)
    line = api.add_line(parent, a)
    assert (line["quantity"], line["source"], line["rel_type"]) == (1, "manual", "component")
    api.bad(409, "POST", bom(parent), {"child_part_number": a})
    api.bad(404, "POST", bom(parent), {"child_part_number": "NO-SUCH"})
    changed = api.edit_line(parent, a, notes="n", reference_designators=["R1"], unit="m")
    assert (changed["notes"], changed["reference_designators"], changed["unit"]) == ("n", ["R1"], "m")
    cleared = api.edit_line(parent, a, notes=None)
    assert (cleared["notes"], cleared["unit"]) == (None, "m")
    api.bad(400, "PUT", bom(parent, a), {"quantity": None})
    api.bad(400, "PUT", bom(parent, a), {"rel_type": "friend"})
    api.bad(400, "PUT", bom(parent, a), {"source": "dream"})
    assert api.call("DELETE", bom(parent, a)).status == 204
    api.bad(404, "DELETE", bom(parent, a))
    api.bad(404, "PUT", bom(parent, a), {"notes": "x"})
