# SPDX-License-Identifier: LGPL-2.1-or-later
"""Paper: a revision is printed as it was frozen, all else says what it is; no page ignores its address."""

from __future__ import annotations

import re
from html import unescape

import pytest
import segno
from fastapi.routing import APIRoute
from server_testing import Api, bom, form_body
from web_visitor import Visitor

from silo_server.run import RunningServer
from silo_server.web import pages
from silo_server.web.releases_page import STAMPS


@pytest.fixture
def product(api: Api) -> tuple[str, str, str]:
    """A product whose revision A is released with 8 screws, and whose draft has 99 now."""
    top, sub = api.items(2, item_type="assembly")
    screw = api.item(properties={"mass_kg": 0.006, "standard_cost": 0.12}, item_type="part")
    api.merge(sub, {screw: 8})
    api.merge(top, {sub: 2, screw: 4})
    api.good("PUT", "/api/users/admin", {"approver": True})
    api.good("POST", f"/api/items/{top}/releases", {"with_parts": True})
    api.good("POST", f"/api/items/{top}/releases/A/approval", {"override": "a prototype"})
    api.merge(sub, {screw: 99})
    return top, sub, screw


def rows_of(page: str) -> list[list[str]]:
    """The texts of the cells of each row of a page."""
    body = "".join(re.findall(r"<tbody>.*?</tbody>", page, re.DOTALL))
    plain = [
        re.sub(r"<[^>]+>", "", row)
        for row in re.findall(r"<tr.*?</tr>", body.replace("</t", "|</t"), re.DOTALL)
    ]
    return [[cell.strip() for cell in unescape(row).split("|")] for row in plain]


def test_the_print_of_a_release_is_that_release(
    product: tuple[str, str, str], visitors: dict[str, Visitor]
) -> None:
    """Quantities, totals and mass as they were frozen, and no stamp; the draft has today's and says DRAFT."""
    top, sub, screw = product
    frozen = visitors["viewer"].get(f"/items/{top}/print?release=A").body.decode()
    told = {(row[0], row[3], row[4]) for row in rows_of(frozen)}
    assert told == {(sub, "2", "2"), (screw, "8", "16"), (screw, "4", "4")}
    assert "<strong>120 g</strong>" in frozen
    assert "2.40" in frozen
    assert 'class="stamp"' not in frozen
    draft = visitors["viewer"].get(f"/items/{top}/print").body.decode()
    assert {(row[0], row[3], row[4]) for row in rows_of(draft)} == {
        (sub, "2", "2"),
        (screw, "99", "198"),
        (screw, "4", "4"),
    }
    assert re.search(r'class="stamp"><strong>DRAFT</strong> <bdi>B<', draft)
    assert draft.count('class="watermark"') == 1


def test_views_of_a_printed_release(product: tuple[str, str, str], visitors: dict[str, Visitor]) -> None:
    """Flat, filtered, for several pieces: each of what was frozen."""
    top, _sub, screw = product
    flat = visitors["viewer"].get(f"/items/{top}/print?release=A&view=flat&pieces=3").body.decode()
    assert [row[:1] + row[2:3] for row in rows_of(flat)] == [[screw, "60"]]
    found = visitors["viewer"].get(f"/items/{top}/print?release=A&type=part").body.decode()
    assert "<strong>120 g</strong>" in found
    assert "<strong><bdi>2.40 EUR" in found


def test_paper_says_the_state_of_a_revision(
    api: Api, product: tuple[str, str, str], visitors: dict[str, Visitor]
) -> None:
    """In review and obsolete stand in large letters, on the print, the release's page and the order list."""
    top, _sub, _screw = product

    def stamps(label: str) -> set[str]:
        paths = (f"print?release={label}", f"order?release={label}", f"releases/{label}")
        bodies = [visitors["viewer"].get(f"/items/{top}/{path}").body.decode() for path in paths]
        return {"".join(re.findall(r'class="stamp"><strong>([^<]+)', body)) for body in bodies}

    assert stamps("A") == {""}
    api.good("POST", f"/api/items/{top}/releases", {"with_parts": True})
    assert stamps("B") == {STAMPS["review"]}
    api.good("POST", f"/api/items/{top}/releases/B/approval", {"override": "yes"})
    assert stamps("A") == {STAMPS["obsolete"]}
    assert stamps("B") == {""}
    for path in ("", "/bom", "/order"):
        assert 'class="stamp"><strong>DRAFT' in visitors["viewer"].get(f"/items/{top}{path}").body.decode()


@pytest.mark.parametrize("path", ["print", "order", "order?pieces=2", "print?view=flat"])
def test_an_unknown_revision_is_an_error(
    product: tuple[str, str, str], visitors: dict[str, Visitor], path: str
) -> None:
    """Never the draft in its place; the page says which revisions there are."""
    answer = visitors["viewer"].get(f"/items/{product[0]}/{path}{'&' if '?' in path else '?'}release=Q")
    assert answer.status == 404
    assert "has no revision" in unescape(answer.body.decode())
    assert "<table" not in answer.body.decode()


def test_no_page_ignores_a_parameter(
    api: Api, server: RunningServer, product: tuple[str, str, str], visitors: dict[str, Visitor]
) -> None:
    """Each page with an address of its own refuses an unknown parameter, and names the one that was meant."""
    top, visitor = product[0], visitors["admin"]
    paths = [
        route.path
        for router in pages.ROUTERS
        for route in router.routes
        if isinstance(route, APIRoute) and "GET" in route.methods
    ]
    assert len(paths) > 20
    for path in paths:
        filled = re.sub(r"\{[^}]*\}", "A", path.replace("{part_number}", top))
        answer = visitor.get(f"{filled}?relaese=B")
        assert answer.status == 400, path
        assert "no parameter 'relaese'" in unescape(answer.body.decode()), path
    meant = unescape(visitor.get(f"/items/{top}/print?relaese=A").body.decode())
    assert "did you mean release?" in meant
    for path in ("print?view=flta", "releases/A?view=flta"):
        assert visitor.get(f"/items/{top}/{path}").status == 400
    assert visitor.get("/waiting?kind=conflict").status == 400
    for name in ("bom/export.csv", "bom/export.json", "bom/export.xlsx", "order", "order.csv", "order.xlsx"):
        error = api.bad(400, "GET", f"/api/items/{top}/{name}?relaese=A")
        assert "did you mean release?" in error["message"]


def badge(visitor: Visitor) -> int:
    """The number beside *For me*."""
    found = re.search(r'>For me</a><span class="dot"[^>]*>([0-9]+)<', visitor.get("/account").body.decode())
    return int(found[1]) if found else 0


def test_a_review_waits_for_those_who_may_approve(api: Api, visitors: dict[str, Visitor]) -> None:
    """*For me* shows it to an approver who has not approved; *Waiting* is calm only if no review is open."""
    (top,) = api.items(1, item_type="assembly")
    part = api.item()
    api.merge(top, {part: 1})
    before = badge(visitors["editor"])
    api.good("PUT", "/api/users/admin", {"approver": True})
    api.good("POST", f"/api/items/{top}/releases", {"with_parts": True, "comment": "please look"})
    assert top in visitors["viewer"].get("/waiting").body.decode()
    assert "Nothing waits" not in visitors["viewer"].get("/waiting").body.decode()
    assert top not in visitors["editor"].get("/mine").body.decode()
    api.good("PUT", "/api/users/editor", {"approver": True})
    try:
        assert badge(visitors["editor"]) == before + len(
            set(re.findall(r'href="/items/([^"/]+)/releases"', visitors["editor"].get("/mine").body.decode()))
        )
        assert "please look" in visitors["editor"].get("/mine").body.decode()
    finally:
        api.good("PUT", "/api/users/editor", {"approver": False})
    api.good("POST", f"/api/items/{top}/releases/A/end", {"status": "rejected", "note": "no"})
    assert top not in visitors["viewer"].get("/waiting").body.decode()
    assert api.get(bom(top))[0]["quantity"] == 1


def test_a_traveller_goes_through_the_workshop(
    api: Api, server: RunningServer, product: tuple[str, str, str], visitors: dict[str, Visitor]
) -> None:
    """Position, quantity, material, remark and designators, the drawings, the code of the page; no cost."""
    top, sub, screw = product
    values = {"notes": "with Loctite 243", "reference_designators": ["S1", "S2"]}
    api.good("PUT", bom(top, screw), values)
    api.good("PATCH", f"/api/items/{screw}/properties", {"material": "Steel 8.8"})
    body, headers = form_body({"kind": "drawing", "file": (f"{sub}.pdf", b"%PDF-1.7\n%%EOF\n")})
    api.good("POST", f"/api/items/{sub}/files", body=body, headers=headers)

    def traveller(label: str) -> str:
        path = f"/items/{top}/print?sheet=traveller&pieces=2{label}"
        answer = visitors["viewer"].get(path)
        assert answer.status == 200
        return answer.body.decode()

    draft = traveller("")
    rows = {(row[2], row[5], row[6]): row for row in rows_of(draft) if len(row) > 8}
    assert set(rows) == {(sub, "2", "4"), (screw, "99", "396"), (screw, "4", "8")}
    of_screw = rows[screw, "4", "8"]
    assert (of_screw[0], of_screw[4], of_screw[7]) == ("20", "Steel 8.8", "S1 S2with Loctite 243")
    assert f"{sub}.pdf</bdi></a>" in draft
    assert "DRAFT" in draft
    frozen = traveller("&release=A")
    assert (screw, "8", "32") in {(row[2], row[5], row[6]) for row in rows_of(frozen) if len(row) > 8}
    assert "Loctite" not in frozen
    assert f"{sub}.pdf</bdi></a>" not in frozen
    for page in (draft, frozen):
        assert "EUR" not in page
        assert "0.12" not in page
    address = f"{server.settings.public_url}/items/{top}"
    for page, about in ((draft, address), (frozen, f"{address}/releases/A")):
        assert segno.make_qr(about, error="m").svg_inline(scale=3, border=2, light="#fff") in page
