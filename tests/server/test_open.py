# SPDX-License-Identifier: LGPL-2.1-or-later
"""One truth about a product: what is open on any level is in every view, and a filter holds for all of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from typing import Any

import pytest
from openpyxl import load_workbook
from server_testing import Api, bom, merge_body
from web_visitor import Visitor

GAP = {"reason": "missing", "name": "Lid", "file": "Lid.FCStd", "object": "Body", "quantity": 1}


def gone(api: Api, sub: str, part: str, other: str) -> None:
    """Six of a part that CAD has no more."""
    api.merge(sub, {part: 6, other: 1})
    api.merge(sub, {other: 1})


def disputed(api: Api, sub: str, part: str, other: str) -> None:
    """9 in Silo, 3 in CAD."""
    api.merge(sub, {part: 1, other: 1})
    api.good("PUT", bom(sub, part), {"quantity": 9})
    api.merge(sub, {part: 3, other: 1})


def incomplete(api: Api, sub: str, part: str, other: str) -> None:
    """A file is missing."""
    api.good("POST", bom(sub, "merge"), {**merge_body({part: 2, other: 1}), "left_out": [GAP]})


# State → how it comes about, the words of its BOM, of its line in the tree, of its part in the flat list.
STATES: dict[str, tuple[Callable[..., None], str, str, str]] = {
    "gone": (gone, "1 unreferenced line", "unreferenced", "unreferenced"),
    "disputed": (disputed, "1 conflict", "CAD says 3", "a quantity in conflict"),
    "incomplete": (incomplete, "incomplete: 1 missing", "", ""),
}


@pytest.fixture(params=[1, 2])
def levels(request: pytest.FixtureRequest) -> int:
    """How deep below the product something is open."""
    return int(request.param)


@pytest.mark.parametrize("state", STATES)
def test_what_is_open_below_is_in_every_view(
    api: Api, visitors: dict[str, Visitor], levels: int, state: str
) -> None:
    """Product page, flat list, both prints, BOM page, the API and all exports say it; none is calm."""
    make, of_bom, of_line, of_part = STATES[state]
    top, sub, part, other, *middle = api.items(3 + levels)
    make(api, sub, part, other)
    for parent, child in zip([top, *middle], [*middle, sub], strict=True):
        api.merge(parent, {child: 2})
    pages = {
        name: visitors["editor"].get(f"/items/{top}{path}").body.decode()
        for name, path in {
            "tree": "",
            "closed": "?depth=1",
            "flat": "?view=flat",
            "print": "/print",
            "flat print": "/print?view=flat",
            "bom": "/bom",
        }.items()
    }
    where = f'<a href="/items/{sub}/bom"><bdi>{sub}</bdi></a>: <bdi>{of_bom}</bdi>'
    assert [name for name, page in pages.items() if where not in page] == []
    assert "Nothing to decide" not in pages["bom"]
    below = of_bom if levels == 1 else "open in 1 BOM below"
    assert f"⚠ {below}</span>" in pages["closed"]
    assert not of_line or f"⚠ {of_line}</span>" in pages["tree"]
    for view in ("flat", "flat print"):
        assert not of_part or f"⚠ {of_part}</span>" in pages[view]
    flat = api.get(bom(top, "flat"))
    kept = api.get(bom(top, "summary"))
    for told in (flat, kept):
        assert {**told["open"], **told["incomplete"]} == {sub: of_bom}
    assert api.get(bom(top, "review"))["below"] == {sub: of_bom}
    (row,) = (row for row in flat["flat_bom"] if row["part_number"] == part)
    gone = row["total_quantity"] if state == "gone" else None
    assert (row.get("unreferenced_quantity"), row.get("in_conflict")) == (gone, state == "disputed" or None)
    for view in ("single", "indented", "flat"):
        book = load_workbook(io.BytesIO(api.call("GET", bom(top, f"export.xlsx?view={view}")).body))
        assert f"{sub} {of_bom}" in str(book.active["A1"].value)
        assert f"{sub} {of_bom}" in api.call("GET", bom(top, f"export.csv?view={view}")).body.decode()
    for view, words in (("indented", of_line), ("flat", of_part)):
        made = api.get(bom(top, f"export.json?view={view}"))
        assert any(f"{sub} {of_bom}" in note for note in made["notes"])
        (line,) = (one for one in made["lines"] if one["part_number"] == part)
        assert (line["open"] or "") == words


def test_a_banner_names_what_is_missing_until_a_sync_brings_it(
    api: Api, visitors: dict[str, Visitor]
) -> None:
    """An incomplete BOM never looks complete, and an assembly that was never synced never like a part."""
    top, part, sub, never = *api.items(2), *api.items(2, item_type="assembly")
    pin = {"reason": "unregistered", "name": "Pin <b>", "file": "Pin.FCStd", "object": "Pin", "quantity": 3}
    body = merge_body({part: 1})
    api.good("POST", bom(sub, "merge"), {**body, "left_out": [{**GAP, "quantity": 2}, pin]})
    api.merge(top, {sub: 1, never: 1})

    def shown(path: str) -> str:
        return (
            visitors["viewer"].get(f"/items/{path}").body.decode().replace("<bdi>", "").replace("</bdi>", "")
        )

    for page in (shown(sub), shown(f"{sub}/bom")):
        for words in (
            "Incomplete: 1 missing, 1 unregistered",
            "Lid.FCStd",
            "3 × Pin &lt;b&gt; (Pin.FCStd): no part",
        ):
            assert words in page
        assert "Nothing to decide" not in page
    for path, count in ((top, 1), (f"{top}?view=flat", 1), (never, 1), (part, 0)):
        assert ("never synced" in shown(path)) == count, path
    assert "this item has no children" in shown(part)
    api.good("POST", bom(sub, "merge"), {**body, "left_out": []})
    page = shown(f"{sub}/bom")
    assert ("Incomplete" in page, "Nothing to decide" in page) == (False, True)


def test_a_part_that_cad_has_in_one_place_and_no_more_in_another(api: Api) -> None:
    """How much of the total is in doubt is counted, over all ways to it and for all pieces."""
    top, sub, part, other = api.items(4)
    gone(api, sub, part, other)
    api.merge(top, {sub: 2, part: 5})
    (row,) = (row for row in api.get(bom(top, "flat"))["flat_bom"] if row["part_number"] == part)
    assert (row["total_quantity"], row["unreferenced_quantity"]) == (17, 12)
    lines = api.get(bom(top, "export.json?view=flat&pieces=10"))["lines"]
    assert [one["open"] for one in lines if one["part_number"] == part] == ["120 of 170 unreferenced"]
    # An assembly that CAD has no more takes all of its parts with it.
    api.merge(top, {part: 5})
    flat = {row["part_number"]: row for row in api.get(bom(top, "flat"))["flat_bom"]}
    assert (flat[other]["unreferenced_quantity"], flat[part]["unreferenced_quantity"]) == (2, 12)


@pytest.fixture
def bought(api: Api) -> tuple[str, ...]:
    """top → 2 × sub, 1 × plate; sub → 4 × bearing of Misumi, 1 × cover. All weigh and cost something."""
    top, sub, plate, bearing, cover = api.items(5)
    for number, values in {
        plate: {"mass_kg": 8, "standard_cost": 80},
        bearing: {"mass_kg": 0.5, "standard_cost": 3, "supplier": "Misumi"},
        cover: {"mass_kg": 1, "standard_cost": 5},
    }.items():
        api.good("PATCH", f"/api/items/{number}/properties", values)
    api.merge(sub, {bearing: 4, cover: 1})
    api.merge(top, {sub: 2, plate: 1})
    return top, sub, plate, bearing, cover


def rows_of(answer: Any) -> list[dict[str, str]]:
    """The rows of a CSV below its notes."""
    text = answer.body.decode("utf-8-sig")
    return list(csv.DictReader(io.StringIO(text[text.index("Item,Level") :], newline="")))


def test_totals_and_exports_follow_the_filter(
    api: Api, visitors: dict[str, Visitor], bought: tuple[str, ...]
) -> None:
    """8 bearings of one supplier: their mass and cost, on the page, on paper and in files, in both views."""
    top, sub, _, bearing, _ = bought
    for view, shown in (("flat", [bearing]), ("tree", [sub, bearing])):
        for path in (f"/items/{top}", f"/items/{top}/print"):
            page = visitors["editor"].get(f"{path}?view={view}&q=misumi").body.decode()
            assert ("<strong>4 kg</strong>" in page, "24.00 EUR" in page) == (True, True)
            # The head of the page is about the whole product.
            assert "14 kg" not in page[page.rindex("<thead>") :]
        kind = "flat" if view == "flat" else "indented"
        rows = rows_of(api.call("GET", bom(top, f"export.csv?view={kind}&q=misumi")))
        assert [row["Part number"] for row in rows] == shown
        page = visitors["editor"].get(f"/items/{top}?view={view}&q=misumi").body.decode()
        assert f"export.xlsx?view={kind}&q=misumi" in page.replace("&amp;", "&")
    made = api.get(bom(top, "export.json?view=flat&q=Misumi&pieces=3"))
    assert [(one["part_number"], one["total_quantity"]) for one in made["lines"]] == [(bearing, 24)]
    assert made["notes"][1] == "Only what fits “Misumi”"


def test_what_is_found_whole_is_counted_once(
    api: Api, visitors: dict[str, Visitor], bought: tuple[str, ...]
) -> None:
    """An assembly that is found counts with all that is in it; what is found in it does not count again."""
    top, sub, *_ = bought
    page = visitors["editor"].get(f"/items/{top}?q={sub}").body.decode()
    assert "<strong>6 kg</strong>" in page
    everything = visitors["editor"].get(f"/items/{top}?q=T-").body.decode()
    assert "<strong>14 kg</strong>" in everything
    nothing = visitors["editor"].get(f"/items/{top}?type=consumable").body.decode()
    assert "none known" in nothing
    assert [
        row["Part number"] for row in rows_of(api.call("GET", bom(top, "export.csv?view=flat&type=part&q=x")))
    ] == []
