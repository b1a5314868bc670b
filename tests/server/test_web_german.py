# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pages in German: errors, refused forms and what is open hold no English sentence."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape

import pytest
from server_testing import Api, bom, form_body, merge_body
from web_visitor import ROLES, Visitor

VIEWER, EDITOR, ADMIN = ROLES
# Words of English sentences that no German text has.
ENGLISH = re.compile(
    r"\b(the|is|are|were|has|have|had|wanted|got|this|that|there|and|not|with|cannot|than|which|its?|for|from"
    r"|of|to|by|yet|again|already|missing|added|removed|changed|line|lines|row|quantity|file|part|open)\b"
)


def english(html: str) -> list[str]:
    """Return what a person reads on a page, if it has English words: its texts and read attributes."""
    # The names of columns are those of a file.
    shown = re.sub(r"<(script|code|style|select|strong)\b.*?</\1>", "", html, flags=re.DOTALL)
    texts = re.findall(r'(?:title|aria-label|placeholder|alt|data-label|data-question)="([^"]*)"', shown)
    texts += re.split(r"</?(?:[a-z]\w*)[^>]*>", shown)
    read = (" ".join(re.sub(r"\S*[./]\S+", "", unescape(text)).split()) for text in texts)
    return [text for text in read if ENGLISH.search(text.lower()) and "XLSX" not in text]


@pytest.fixture(scope="module")
def german(visitors: dict[str, Visitor]) -> dict[str, Visitor]:
    """The visitors, who have chosen German."""
    return {
        role: replace(visitor, cookie=f"{visitor.cookie}; silo_language=de")
        for role, visitor in visitors.items()
    }


@pytest.fixture(scope="module")
def product(api: Api) -> dict[str, str]:
    """An assembly with everything that may be open, and a past."""
    top, part, other, gone, disputed, empty = (
        api.item(name) for name in ("TOP", "P1", "P2", "P3", "P4", "P5")
    )
    api.merge(top, {part: 1, gone: 2, disputed: 4})
    api.good("PUT", bom(top, disputed), {"quantity": 6, "notes": "Kleber"})
    gaps = [
        {"reason": "missing", "name": "Deckel", "file": "Deckel.FCStd", "quantity": 2},
        {"reason": "unregistered", "name": "Bolzen", "quantity": 1},
        {"reason": "broken", "message": "The file Deckel.FCStd is missing; used by Deckel."},
        {
            "reason": "refused",
            "message": "the BOM of TOP has version 2, the request was made from version 1; "
            "read it again and repeat",
        },
    ]
    api.good("POST", bom(top, "merge"), {**merge_body({part: 2, disputed: 5}), "left_out": gaps})
    api.good("POST", bom(top), {"child_part_number": other, "quantity": 3})
    api.good("DELETE", bom(top, other))
    undone = api.get(bom(top, "history"))[0]["id"]
    api.good("POST", bom(top, "undo"), {"change_id": undone})
    body, headers = form_body({"file": ("p1.txt", b"x")})
    assert api.call("POST", f"/api/items/{part}/file", body=body, headers=headers).status == 201
    return {"top": top, "part": part, "empty": empty}


@pytest.mark.parametrize(
    "path",
    [
        *(
            "/items/{top}",
            "/items/{top}?view=flat",
            "/items/{top}/bom",
            "/items/{top}/print",
            "/items",
            "/waiting",
        ),
        *(
            "/items/{top}/history",
            "/items/{top}/compare?old=0&all=1",
            "/items/{top}/changes",
            "/mine",
            "/system",
        ),
        *(
            "/items/{top}/order?pieces=3",
            "/items/{empty}/order",
            "/items/{top}/releases",
            "/activity",
            "/users",
        ),
        *(
            "/items/{part}",
            "/items/{part}/suppliers",
            "/account",
            "/suppliers",
            "/items/{top}/import",
            "/items/new",
        ),
    ],
)
def test_what_is_open_is_german(german: dict[str, Visitor], product: dict[str, str], path: str) -> None:
    """Findings, what the last sync left out, marks, warnings and what changed."""
    page = german[ADMIN].get(path.format(**product))
    assert page.status == 200
    assert english(page.body.decode()) == []


REFUSED = [
    (ADMIN, "/users", {"username": "a b", "role": "viewer"}, 400),
    (ADMIN, "/users", {"username": "viewer", "role": "viewer"}, 409),
    (ADMIN, "/users/nobody", {"role": "viewer"}, 404),
    (ADMIN, "/users/admin/login-link", {}, 403),
    (ADMIN, "/suppliers/rates", {"own": "euros"}, 400),
    (ADMIN, "/mode", {"mode": "x"}, 400),
    (EDITOR, "/account/tokens", {"name": "", "days": "30", "scope": "read"}, 400),
    (EDITOR, "/account/password", {"password": "abc", "again": "abc", "current": "x"}, 400),
    (EDITOR, "/items/new", {"name": "Rad", "part_number": "a\tb"}, 400),
    (EDITOR, "/items/new", {"name": "Rad", "part_number": "TOP"}, 409),
    (EDITOR, "/items/new", {"name": "Rad", "category": "ZZ9"}, 400),
    (EDITOR, "/items/new", {"name": "Rad", "part_number": "R1", "p.mass_kg": "schwer"}, 400),
    (EDITOR, "/items/new", {"name": "Rad", "part_number": "R1", "p.sourcing_link": "kein"}, 400),
    (EDITOR, "/items/{top}/bom/lines", {"child": "NOPE", "quantity": "1"}, 404),
    (EDITOR, "/items/{top}/bom/lines", {"child": "{top}", "quantity": "1"}, 409),
    (EDITOR, "/items/{top}/bom/lines", {"child": "{part}", "quantity": "1"}, 409),
    (EDITOR, "/items/{top}/bom/lines", {"child": "{empty}", "quantity": "viel"}, 400),
    (EDITOR, "/items/{top}/bom/lines", {"child": "{empty}", "quantity": "1,000"}, 400),
    (EDITOR, "/items/{top}/bom/decide", {"chosen": "{part}", "action": "keep"}, 400),
    (EDITOR, "/items/{top}/bom/decide", {"chosen": "{part}", "action": "take_cad"}, 400),
    (EDITOR, "/items/{top}/bom/undo", {"change_id": "99999"}, 404),
    (EDITOR, "/items/{top}/restore", {"change_id": "99999"}, 404),
    (EDITOR, "/items/{top}/order/7/take-back", {}, 404),
    (EDITOR, "/items/{top}/releases", {"label": "!", "comment": ""}, 400),
    (EDITOR, "/items/{top}/releases/A/approval", {}, 404),
    (
        EDITOR,
        "/items/{part}/suppliers",
        {"rows": "1", "supplier.0": "", "link.0": "kein", "minimum.0": "x"},
        400,
    ),
    (EDITOR, "/items/{part}/suppliers", {"rows": "1", "supplier.0": "A", "prices.0": "1: 2; 1: 3"}, 400),
    (EDITOR, "/items/{part}/suppliers/undo", {"change": "5"}, 409),
    (EDITOR, "/waiting/assign", {"chosen": ["{top} x"], "assignee": "viewer"}, 403),
    (EDITOR, "/mine/follow", {"on": "yes", "target": "was"}, 400),
    (VIEWER, "/items/{top}/bom/lines", {"child": "{part}", "quantity": "1"}, 403),
    (VIEWER, "/items/{top}/releases/A/approval", {}, 404),
]


@pytest.mark.parametrize(("role", "path", "fields", "status"), REFUSED)
def test_a_refused_form_is_german(
    german: dict[str, Visitor],
    product: dict[str, str],
    role: str,
    path: str,
    fields: dict[str, str | list[str]],
    status: int,
) -> None:
    """What was wrong, and what to do."""
    sent = {
        name: [text.format(**product) for text in value]
        if isinstance(value, list)
        else value.format(**product)
        for name, value in fields.items()
    }
    page = german[role].post(path.format(**product), **sent)
    assert page.status == status
    assert english(page.body.decode()) == []


@pytest.mark.parametrize(
    ("role", "path", "status"),
    [
        (ADMIN, "/items/NOPE", 404),
        (ADMIN, "/gibtsnicht", 404),
        (ADMIN, "/documents/x", 400),
        (ADMIN, "/items?page=abc", 400),
        (ADMIN, "/items?page=0", 400),
        (ADMIN, "/items/{top}/compare?old=99999", 404),
        (ADMIN, "/items/{top}/changes?since=gestern", 404),
        (ADMIN, "/items/{top}/order?release=Q", 404),
        (ADMIN, "/items/{top}/releases/Q", 404),
        (VIEWER, "/users", 403),
        (VIEWER, "/items/new", 403),
    ],
)
def test_an_error_page_is_german(
    german: dict[str, Visitor], product: dict[str, str], role: str, path: str, status: int
) -> None:
    page = german[role].get(path.format(**product))
    assert page.status == status
    assert english(page.body.decode()) == []


def test_a_table_that_cannot_be_imported_is_german(
    german: dict[str, Visitor], product: dict[str, str]
) -> None:
    for content in (b"x", b"Part number,Quantity\nNOPE,1\nTOP,viel\n,3\nP1,1\nP1,2\n", b"\xff\xfe\x00"):
        editor = german[EDITOR]
        body, headers = form_body({"csrf_token": editor.csrf, "file": ("teile.csv", content)})
        page = editor.api.call(
            "POST",
            f"/items/{product['top']}/import/check",
            body=body,
            headers={"Cookie": editor.cookie, "Accept": "text/html", **headers},
        )
        assert english(page.body.decode()) == []
