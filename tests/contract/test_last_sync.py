# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a sync leaves out: remembered with the BOM, and no reason to call a line unreferenced."""

from __future__ import annotations

from typing import Any

from hunting import BOTH
from server_testing import Api, bom

COVER = {"file": "parts/Cover.FCStd", "object": "Body"}
MISSING = {"reason": "missing", "name": "Cover", **COVER, "quantity": 2}


def entries(*rows: tuple[str, float, list[dict[str, str]]]) -> list[dict[str, Any]]:
    return [{"child_part_number": n, "quantity": q, "components": c} for n, q, c in rows]


def merge(api: Api, parent: str, rows: list[dict[str, Any]], **more: Any) -> Any:
    return api.good("POST", bom(parent, "merge"), {"source": "assembly", "entries": rows, **more})


def last_sync(api: Api, parent: str) -> Any:
    return api.get(f"/api/items/{parent}")["last_sync"]


def test_an_item_that_was_never_synced_says_so(api: Api) -> None:
    """``at`` is null, and there is a place for what was left out."""
    (item,) = api.items(1)
    assert last_sync(api, item) == {"at": None, "left_out": []}


@BOTH
def test_a_line_of_a_missing_component_stays_as_it_is(api: Api) -> None:
    """Known by file and object from the sync before; a second sync without the file knows it again."""
    parent, cover, bolt = api.items(3)
    merge(api, parent, entries((cover, 2, [COVER]), (bolt, 4, [])))
    for _ in range(2):
        answer = merge(api, parent, entries((bolt, 6, [])), left_out=[MISSING])
        assert answer["diff"]["removed"] == []
        assert answer["left_out"] == [MISSING]
        line = api.lines(parent)[cover]
        assert (line["quantity"], line["unreferenced_since"]) == (2, None)
        assert line["components"] == [COVER]
        assert api.quantities(parent) == {cover: 2, bolt: 6}
        assert last_sync(api, parent)["left_out"] == [MISSING]


def test_a_line_with_a_missing_and_a_present_component_is_not_counted_down(api: Api) -> None:
    """Two files, one part number: nobody knows the sum while one of them is missing."""
    parent, cover = api.items(2)
    other = {"file": "parts/Lid.FCStd", "object": "Body"}
    merge(api, parent, entries((cover, 5, [COVER, other])))
    answer = merge(api, parent, entries((cover, 3, [other])), left_out=[MISSING])
    assert answer["diff"] == {"added": [], "removed": [], "quantity_changed": [], "unchanged": []}
    assert api.quantities(parent) == {cover: 5}
    merge(api, parent, entries((cover, 4, [COVER, other])))
    assert api.quantities(parent) == {cover: 4}
    assert last_sync(api, parent)["left_out"] == []


def test_a_missing_component_that_no_sync_knew_keeps_nothing(api: Api) -> None:
    """Another path is another component: the line is unreferenced as always."""
    parent, cover = api.items(2)
    merge(api, parent, entries((cover, 2, [{**COVER, "file": "old/Cover.FCStd"}])))
    answer = merge(api, parent, [], left_out=[MISSING])
    assert [change["part_number"] for change in answer["diff"]["removed"]] == [cover]


def test_a_manual_override_of_a_missing_component_is_no_conflict(api: Api) -> None:
    """A person's quantity is compared again when the component is back."""
    parent, cover = api.items(2)
    merge(api, parent, entries((cover, 2, [COVER])))
    api.edit_line(parent, cover, quantity=9)
    answer = merge(api, parent, [], left_out=[MISSING])
    assert answer["warnings"] == []
    answer = merge(api, parent, entries((cover, 2, [COVER])))
    assert [warning["type"] for warning in answer["warnings"]] == ["conflict"]


def test_a_refused_merge_is_remembered_until_the_next_good_one(api: Api) -> None:
    """What the last good one said stays beside it."""
    parent, bolt = api.items(2)
    merge(api, parent, entries((bolt, 1, [])), left_out=[MISSING])
    wrong = {"entries": [{"child_part_number": "no such item", "quantity": 1}]}
    api.bad(400, "POST", bom(parent, "merge"), wrong)
    first, second = last_sync(api, parent)["left_out"]
    assert first == MISSING
    assert second["reason"] == "refused"
    assert "no such item" in second["message"]
    merge(api, parent, entries((bolt, 1, [])))
    assert last_sync(api, parent)["left_out"] == []


def test_a_dry_run_is_not_remembered(api: Api) -> None:
    """It reports what it would leave out and changes nothing."""
    (parent,) = api.items(1)
    assert merge(api, parent, [], left_out=[MISSING], dry_run=True)["left_out"] == [MISSING]
    assert last_sync(api, parent)["at"] is None


def test_a_malformed_list_is_refused_and_named(api: Api) -> None:
    """Nothing of a request that cannot be understood is kept."""
    (parent,) = api.items(1)
    lists: list[tuple[Any, str]] = [
        ("x", "left_out"),
        ([{}], "left_out[0]"),
        ([{"reason": "missing", "file": 5}], "left_out[0].file"),
        ([{"reason": "missing", "name": "x" * 2000}], "left_out[0].name"),
        ([{"reason": "missing", "quantity": "2"}], "left_out[0].quantity"),
    ]
    for left_out, where in lists:
        answer = api.bad(400, "POST", bom(parent, "merge"), {"entries": [], "left_out": left_out})
        assert where in str(answer)
    entry = {"child_part_number": "x", "quantity": 1, "components": [{}]}
    answer = api.bad(400, "POST", bom(parent, "merge"), {"entries": [entry]})
    assert "entries[0].components" in str(answer)


def export(api: Api, item: str, view: str) -> Any:
    return api.get(bom(item, f"export.json?view={view}"))["lines"]


def test_an_assembly_that_was_never_synced_is_no_leaf(api: Api) -> None:
    """In the flat list and in every export; a part is one, and an assembly with lines made by hand is not."""
    top, part = api.items(2)
    never, empty, manual = (api.item(item_type="assembly") for _ in range(3))
    merge(api, empty, [])
    api.add_line(manual, part, quantity=1)
    merge(api, top, entries((part, 1, []), (never, 2, []), (empty, 1, []), (manual, 1, [])))
    for view in ("single", "indented", "flat"):
        told = {row["part_number"]: row["incomplete"] for row in export(api, top, view)}
        assert told[never] == "never synced", view
        assert set(told.values()) == {None, "never synced"}, view
    assert api.get(bom(top, "flat"))["incomplete"] == {never: "never synced"}


def test_what_is_missing_is_a_line_of_every_export(api: Api) -> None:
    """At the end, without a part number; and the assembly that it is missing from is marked."""
    top, part = api.items(2)
    sub = api.item(item_type="assembly")
    merge(api, sub, entries((part, 1, [])), left_out=[MISSING])
    merge(
        api, top, entries((sub, 2, [])), left_out=[{"reason": "unregistered", "name": "Pin", "quantity": 3}]
    )
    rows = export(api, top, "indented")
    assert rows[0]["incomplete"] == "incomplete: 1 missing"
    gaps = {row["name"]: (row["quantity"], row["incomplete"]) for row in rows if not row["part_number"]}
    assert set(gaps) == {"Cover", "Pin"}
    assert gaps["Pin"] == (3, f"{top}: 3 × Pin: no part number yet")
    assert gaps["Cover"][1].startswith(f"{sub}: 2 × Cover (parts/Cover.FCStd): the file is missing")
    assert {row["name"] for row in export(api, top, "single") if not row["part_number"]} == {"Pin"}


def test_a_gap_of_an_export_is_no_part_of_the_same_name(api: Api) -> None:
    """It is not looked up by its name: a line that the file does not have is reported as missing."""
    top, part = api.items(2)
    name = f"Cover of {top}"
    namesake = api.item(name=name)
    merge(api, top, entries((part, 4, [])), left_out=[{**MISSING, "name": name}])
    data = api.call("GET", bom(top, "export.csv")).body
    assert name.encode() in data
    api.add_line(top, namesake)
    answer = api.good("POST", bom(top, "import?dry_run=1"), body=data)
    assert [(row["part_number"], row["status"]) for row in answer["rows"]] == [(part, "same"), ("", "skip")]
    assert answer["rows"][1]["name"] == name
    assert [line["part_number"] for line in answer["missing"]] == [namesake]


def test_an_export_with_gaps_can_be_imported_again(api: Api) -> None:
    """Rows that say what is missing are no lines of the BOM: the answer says that each was left out."""
    top, part = api.items(2)
    merge(api, top, entries((part, 4, [])), left_out=[MISSING])
    for query in ("", "?semicolons=true"):
        data = api.call("GET", bom(top, f"export.csv{query}")).body
        assert data.decode("utf-8-sig").startswith(f"Incomplete: {top} incomplete: 1 missing")
        assert b"Cover" in data
        answer = api.good("POST", bom(top, "import"), body=data)
        assert [(row["part_number"], row["status"]) for row in answer["rows"]] == [
            (part, "same"),
            ("", "skip"),
        ]
        assert answer["rows"][1]["why"]
        assert list(api.quantities(top)) == [part]
