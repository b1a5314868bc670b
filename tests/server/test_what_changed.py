# SPDX-License-Identifier: LGPL-2.1-or-later
"""What changed in a product over all levels: as a page, as files, by the API; and since a person looked."""

from __future__ import annotations

import csv
import io
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from hunting import over
from large_boms import form_file
from model_file import model_file
from openpyxl import load_workbook
from server_testing import Api, bom
from web_visitor import Visitor

from silo_server.db.database import Database
from silo_server.db.tables import bom_change_lines, bom_changes, product_looks
from silo_server.run import RunningServer
from silo_server.services.items import NewItem, create_item
from silo_server.services.looks import SAME_LOOK, keep_looks, last_look
from silo_server.times import stamp


def now() -> str:
    return datetime.now(UTC).isoformat()


def changes(api: Api, top: str, since: str, until: str = "") -> list[tuple[str, ...]]:
    """(what, in, item, before, after) of each row."""
    query = f"changes?from={since}&to={until}".replace("+", "%2B")
    rows = api.get(bom(top, query))["changes"]
    return [tuple(row[name] for name in ("what", "within", "part_number", "before", "after")) for row in rows]


@pytest.fixture
def product(api: Api) -> tuple[str, ...]:
    """top → sub → part, other; and the moment when it was so."""
    top, sub, part, other, new = api.items(5)
    api.merge(sub, {part: 2, other: 1})
    api.merge(top, {sub: 1})
    return top, sub, part, other, new, now()


def test_lines_quantities_data_and_files_of_all_levels(api: Api, product: tuple[str, ...]) -> None:
    """Each with its BOM; what was added or removed is not looked into; nothing of before the time."""
    top, sub, part, other, new, since = product
    inner = api.item(item_type="assembly")
    api.merge(inner, {other: 7})
    api.merge(sub, {part: 3, new: 4})
    api.good("POST", bom(sub, "resolve"), {"decisions": [{"child_part_number": other, "action": "remove"}]})
    api.good("POST", bom(top), {"child_part_number": inner, "quantity": 1})
    api.good("PATCH", f"/api/items/{part}/properties", {"mass_kg": 2})
    body, headers = form_file("part.FCStd", model_file(b"one"))
    assert api.call("POST", f"/api/items/{part}/file", body=body, headers=headers).status == 201
    assert set(changes(api, top, since)) == {
        ("quantity", sub, part, "2", "3"),
        ("added", sub, new, "", "4"),
        ("removed", sub, other, "1", ""),
        ("added", top, inner, "", "1"),
        ("data", "", part, "mass_kg: –", "mass_kg: 2"),
        ("file", "", part, "", "part.FCStd, revision 2"),
    }
    assert changes(api, top, now()) == []
    assert changes(api, top, since, since) == []
    today = datetime.now(UTC).date()
    assert len(changes(api, top, since, str(today))) == 6
    # The other way round is the same question.
    end = now()
    assert changes(api, top, end, since) == changes(api, top, since, end)
    # What happened and was taken back is no change.
    later = now()
    api.merge(sub, {part: 9, new: 4})
    api.merge(sub, {part: 3, new: 4})
    assert changes(api, top, later) == []


def test_a_note_is_a_change_of_the_line(api: Api, product: tuple[str, ...]) -> None:
    """Every field that a person changes is named with both values."""
    top, sub, part, *_, since = product
    api.good("PUT", bom(sub, part), {"notes": "glued", "find_number": "7"})
    (row,) = changes(api, top, since)
    assert row[0] == "line"
    assert (row[3], row[4]) == ("find number: 10; notes: –", "find number: 7; notes: glued")


def test_revisions_are_moments_and_what_is_none_is_refused(api: Api, product: tuple[str, ...]) -> None:
    """From one revision of the product to another."""
    top, sub, part, other, _, _ = product
    for n in (1, 2):
        api.good("PATCH", f"/api/items/{top}/properties", {"n": n})
        api.merge(sub, {part: 2 + n, other: 1})
    assert ("quantity", sub, part, "2", "3") in changes(api, top, "r1", "r2")
    assert ("quantity", sub, part, "2", "4") in changes(api, top, "r1")
    for wrong, status in (("r9", 404), ("yesterday", 404), ("2026-13-01", 400), ("2026-02-08T10:00", 400)):
        assert api.call("GET", bom(top, f"changes?from={wrong}")).status == status


def test_frozen_revisions_are_compared_as_they_are(
    api: Api, product: tuple[str, ...], server: RunningServer, visitors: dict[str, Visitor]
) -> None:
    """Two of them, or one and now, whatever is kept of the history between; either way round."""
    top, sub, part, other, new, _ = product

    def freeze(label: str) -> None:
        api.good("POST", f"/api/items/{top}/releases", {"label": label})
        api.good("POST", f"/api/items/{top}/releases/{label}/approval", {"override": "a trial"})

    api.good("PUT", "/api/users/admin", {"approver": True})
    freeze("A")
    api.merge(sub, {part: 3, new: 4, other: 1})
    api.good("PUT", bom(sub, part), {"notes": "glued"})
    api.good("PATCH", f"/api/items/{part}/properties", {"mass_kg": 2})
    api.good("PUT", f"/api/items/{other}", {"name": "Another name"})
    body, headers = form_file("part.FCStd", model_file(b"one"))
    assert api.call("POST", f"/api/items/{part}/file", body=body, headers=headers).status == 201
    expected = {
        ("line", sub, part, "notes: –", "notes: glued"),
        ("added", sub, new, "", "4"),
        ("data", "", part, "mass_kg: –", "mass_kg: 2"),
        ("data", "", top, "mass in all [kg]: –", "mass in all [kg]: 6"),
        ("file", "", part, "", "part.FCStd, revision 2"),
    }
    assert expected <= set(changes(api, top, "A"))
    freeze("B")
    told = changes(api, top, "A", "B")
    assert expected <= set(told)
    assert [row[4] for row in told if row[2] == other] == ["name: Another name"]
    assert changes(api, top, "B", "A") == told
    assert changes(api, top, "A", "A") == changes(api, top, "B") == []
    api.merge(sub, {part: 9})
    assert changes(api, top, "A", "B") == told
    assert ("quantity", sub, part, "3", "9") in changes(api, top, "B")
    with server.app.state.server.db.write() as tx:
        for table in (bom_change_lines, bom_changes):
            tx.conn.execute(table.delete())
    assert changes(api, top, "A", "B") == told
    page = visitors["viewer"].get(f"/items/{top}/releases/B").body.decode()
    assert f"/items/{top}/changes?since=A&until=B" in page.replace("&amp;", "&")
    page = visitors["viewer"].get(f"/items/{top}/changes?since=A&until=B").body.decode()
    assert "notes: glued" in page
    assert ">By</th>" not in page
    assert api.call("GET", bom(top, "changes?from=Z")).status == 404


def test_the_files_have_the_same_rows(
    api: Api, product: tuple[str, ...], visitors: dict[str, Visitor]
) -> None:
    """CSV, XLSX and the page."""
    top, *_ = product
    query = "from=2020-01-01"
    told = changes(api, top, "2020-01-01")
    text = api.call("GET", bom(top, f"changes.csv?{query}")).body.decode("utf-8-sig")
    rows = list(csv.DictReader(io.StringIO(text[text.index("What,In") :], newline="")))
    assert [(row["What"], row["In"], row["Part number"], row["Before"], row["After"]) for row in rows] == told
    book = load_workbook(io.BytesIO(api.call("GET", bom(top, f"changes.xlsx?{query}")).body))
    body = list(book.active.iter_rows(min_row=3, values_only=True))
    assert [row[2] for row in body] == [row[2] for row in told]
    page = visitors["viewer"].get(f"/items/{top}/changes?since=2020-01-01").body.decode()
    assert "<strong>1 added</strong>" in page
    assert f"/api/items/{top}/bom/changes.xlsx?from=2020-01-01" in page
    wrong = visitors["viewer"].get(f"/items/{top}/changes?since=nonsense")
    assert (wrong.status, "wanted a date" in wrong.body.decode().lower()) == (404, True)
    assert visitors["viewer"].get(f"/items/{top}/changes?since=2026-13-99").status == 400


@over("sqlite")
def test_a_look_within_the_hour_is_the_same_look(db: Database) -> None:
    """The product page shows what changed since the visit before this one, not since the last reload."""
    with db.write() as tx:
        item = create_item(tx, NewItem(category="A01", name="Top"))[0]
        begin = tx.at
    for minutes, before in ((0, None), (30, None), (120, 30), (150, 30), (170, 30), (300, 170)):
        at = begin + timedelta(minutes=minutes)
        db.clock = lambda at=at: at
        with db.read() as tx:
            found = last_look(tx, 7, item)
        told = None if before is None else stamp(begin + timedelta(minutes=before))
        assert found == told
        db.looks[7, item.id] = stamp(at)
        keep_looks(db)
        assert db.looks == {}
    assert timedelta(minutes=30) < SAME_LOOK < timedelta(minutes=120)


def test_the_product_page_says_what_is_new(
    api: Api, server: RunningServer, product: tuple[str, ...], visitors: dict[str, Visitor]
) -> None:
    """Open questions with the way there, totals with what they lack, and what is new since the last look."""
    top, sub, part, *_ = product
    api.good("PATCH", f"/api/items/{part}/properties", {"mass_kg": 0.5})
    api.merge(sub, {part: 2})
    visitor: Any = visitors["editor"]
    page = visitor.get(f"/items/{top}").body.decode()
    assert "1 open question</a> in 1 sub-assembly" in page
    assert "<strong>1 kg</strong>, 1 of 2 parts known" in page
    assert 'Cost: none known, <span class="warn">not known for 2 parts' in page
    assert "Changed since you looked" not in page
    assert ">Mass each<" in page
    assert ">Cost each<" not in page
    db = server.app.state.server.db
    keep_looks(db)
    with db.write() as tx:
        tx.conn.execute(product_looks.update().values(at="2020-01-01T00:00:00.000000+00:00"))
    page = visitor.get(f"/items/{top}").body.decode()
    assert "<strong>Changed since you looked</strong> (" in page
    assert f'href="/items/{top}/changes?since=look"' in page


def test_activity_of_a_product_and_of_days(
    api: Api, product: tuple[str, ...], visitors: dict[str, Visitor]
) -> None:
    """With all that is in it, on these days, and no others."""
    top, _, part, *_, new, _ = product
    day = datetime.now(UTC).date()
    visitor = visitors["viewer"]

    def shown(query: str) -> set[str]:
        page = visitor.get(f"/activity?{query}").body.decode()
        return {number for number in (top, part, new) if f'href="/items/{number}' in page}

    assert shown(f"item={top}") == {top}
    assert shown(f"item={top}&inside=1") == {top, part}
    assert shown(f"item={top}&inside=1&since={day}&until={day}") == {top, part}
    assert shown(f"item={top}&inside=1&since={day + timedelta(days=1)}") == set()
    assert shown(f"item={top}&inside=1&until={day - timedelta(days=1)}") == set()
    assert shown(f"item={top}&since=nonsense") == {top}
