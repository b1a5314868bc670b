# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pages without a browser: what a strict browser needs, errors, what is escaped, what forms do."""

from __future__ import annotations

import base64
import gzip
import json
import re
import zlib
from html import unescape
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from uuid import uuid4

import pytest
from model_file import model_file
from server_testing import Api, Databases, bom, form_body, sqlite_database
from web_visitor import HTML, ROLES, Visitor, enter

from silo_server.run import running_server
from silo_server.settings import Settings
from silo_server.web import orders_page

TOKEN = "silo_pages"
VIEWER, EDITOR, ADMIN = ROLES
HOSTILE = "<script>alert(1)</script>\"'&<img src=x>"


# --- what is sent -------------------------------------------------------------------------------------------


class Strict(HTMLParser):
    """Collects what a strict policy would refuse, and forms without a secret."""

    def __init__(self) -> None:
        super().__init__()
        self.problems: list[str] = []
        self.open_form: str | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.problems += [f"{tag} {name}" for name in values if name == "style" or name.startswith("on")]
        if tag == "style" or (
            tag == "script" and not values.get("src") and values.get("type") != "application/json"
        ):
            self.problems.append(f"inline {tag}")
        for name in ("src", "href", "action"):
            link = values.get(name) or ""
            if "//" in link or link.startswith("javascript"):
                self.problems.append(f"{tag} {name}={link}")
        if tag == "form" and values.get("method") == "post":
            self.open_form = str(values.get("action"))
        if tag == "input" and values.get("name") == "csrf_token" and values.get("value"):
            self.open_form = None

    def handle_endtag(self, tag: str) -> None:
        if tag == "form" and self.open_form not in (None, "/login", "/language"):
            self.problems.append(f"the form {self.open_form} has no secret")
        if tag == "form":
            self.open_form = None


@pytest.fixture(scope="module")
def busy(api: Api) -> dict[str, str]:
    """A BOM with everything on it, and hostile texts everywhere."""
    return make_busy(api)


def make_busy(api: Api) -> dict[str, str]:
    """Used, unreferenced, manual and disputed lines, revisions, a file, a token, a user."""
    parent = api.item(name=HOSTILE)
    used, gone, other, disputed = (api.item(name=HOSTILE, long_description=HOSTILE) for _ in range(4))
    api.merge(parent, {used: 1, gone: 2, other: 3, disputed: 4}, document={"file": HOSTILE})
    api.good("PUT", bom(parent, disputed), {"quantity": 6, "notes": HOSTILE, "find_number": HOSTILE[:30]})
    api.merge(parent, {used: 1, disputed: 5}, document={"file": HOSTILE})
    api.good("PUT", f"/api/items/{used}", {"properties": {HOSTILE: HOSTILE}, "comment": HOSTILE})
    body, headers = form_body({"file": ("<b>x</b>.FCStd", model_file(b"x")), "comment": HOSTILE})
    assert api.call("POST", f"/api/items/{used}/file", body=body, headers=headers).status == 201
    sheet = str(uuid4())
    item = api.get(f"/api/items/{used}")["id"]
    about = {"path": f"a/{HOSTILE}", "items": json.dumps([{"item": item, "object": HOSTILE}])}
    about["links"] = json.dumps([{"path": HOSTILE, "item": item}])
    body, headers = form_body({"file": ("<b>x</b>.FCStd", model_file(b"x")), "comment": HOSTILE, **about})
    assert api.call("POST", f"/api/documents/{sheet}/file", body=body, headers=headers).status == 201
    api.good("POST", "/api/auth/tokens", {"name": HOSTILE})
    api.good("POST", "/api/users", {"username": f"odd-{sheet}", "display_name": HOSTILE})
    return {"parent": parent, "used": used, "disputed": disputed, "sheet": sheet, "uuid": item}


PAGES = (
    "/login",
    "/waiting",
    "/mine",
    "/system",
    "/suppliers",
    "/items/{parent}/order?pieces=3",
    "/items/{used}/suppliers",
    "/items/{parent}/releases",
    "/items/{parent}/changes",
    "/items/{parent}/print",
    "/items",
    "/items?q=%3Cscript%3E&type=%22%3E%3Cb%3E",
    "/items/{parent}",
    "/items/{parent}?view=flat",
    "/items/{used}",
    "/documents/{sheet}",
    "/documents/{uuid}",
    "/items/{used}/edit",
    "/items/new?category=%3Cscript%3E",
    "/items/{parent}?q=%3Cscript%3E&type=%22%3E%3Cb%3E&sort=%22%3E&flip=%22%3E",
    "/items/{parent}/bom",
    "/items/{parent}/bom?edit={disputed}",
    "/items/{parent}/history",
    "/items/{parent}/compare?old=0&all=1",
    "/items/{parent}/import",
    "/activity",
    "/account",
    "/users",
    "/audit",
    "/items/%3Cscript%3E",
    "/documents/%3Cscript%3E",
    "/%3Cscript%3Ealert(1)%3C/script%3E",
    "/items/{parent}/compare?old=%3Cscript%3E",
)


@pytest.mark.parametrize("path", PAGES)
def test_pages_are_strict_and_escaped_in_each_language(
    visitors: dict[str, Visitor], busy: dict[str, str], api: Api, path: str
) -> None:
    """Nothing inline, nothing from elsewhere, every form with its secret, hostile texts as text."""
    cookie = {} if path == "/login" else {"Cookie": visitors[ADMIN].cookie}
    for language, skip in (("en", "Skip to content"), ("de", "Zum Inhalt")):
        headers = {**HTML, **cookie, "Accept-Language": language}
        shown = api.as_(None).call("GET", path.format(**busy), headers=headers)
        assert shown.status == 200 or ("%3C" in path and shown.status < 500)
        assert shown.headers["content-type"] == "text/html; charset=utf-8"
        assert "script-src 'self'" in shown.headers["content-security-policy"]
        assert shown.headers["cache-control"] == "no-store"
        text = shown.body.decode()
        assert (f'<html lang="{language}">' in text, skip in text) == (True, True)
        assert ("<script>" in text, "<img src=x" in text) == (False, False)
        assert not re.search(r"%\(\w+\)", re.sub(r'<script type="application/json".*?</script>', "", text))
        strict = Strict()
        strict.feed(text)
        assert strict.problems == []


def test_a_page_offers_nothing_that_its_reader_may_not_do(
    visitors: dict[str, Visitor], busy: dict[str, str]
) -> None:
    """No form and no button that changes anything is shown to a viewer, but for the own account."""
    own = {"/logout", "/language", "/mine/follow", "/mine/seen"}
    own |= {"/account/tokens", "/account/password", "/account/logout-everywhere"}
    # The form of a line is behind a link that only editors are given.
    for path in (path for path in PAGES if "edit=" not in path):
        page = visitors[VIEWER].get(path.format(**busy)).body.decode()
        page = re.sub(r"<form(?:(?!</form>|<button).)*</form>", "", page, flags=re.DOTALL)  # a mere table
        forms = re.findall(r'<form[^>]*method="post"[^>]*action="([^"]*)"|formaction="([^"]*)"', page)
        offered = {"".join(form).partition("?")[0] for form in forms}
        assert {one for one in offered if not one.endswith("/revoke")} <= own, path
        assert re.search(r'<form (?![^>]*action)[^>]*method="post"', page) is None, path


@pytest.mark.postgres
def test_every_page_on_the_other_database(databases: Databases, tmp_path: Path) -> None:
    """The pages work over PostgreSQL as well, and so does a decision."""
    url = databases.new("postgres")
    with running_server(url, token=TOKEN, files_dir=tmp_path) as server, Api(server.base_url, TOKEN) as api:
        numbers = make_busy(api)
        visitor = enter(api, ADMIN)
        for path in PAGES:
            status = visitor.get(path.format(**numbers)).status
            assert status == 200 or ("%3C" in path and status < 500) or path == "/login", (path, status)
        done = visitor.post(
            f"/items/{numbers['parent']}/bom/decide", chosen=numbers["disputed"], action="take_cad"
        )
        assert done.status == 303
        assert api.quantities(numbers["parent"])[numbers["disputed"]] == 5


def test_a_file_of_several_items_is_on_their_pages_and_has_one(
    visitors: dict[str, Visitor], api: Api
) -> None:
    """The item names its files; the page of a file its items, what uses it, and each revision to download."""
    viewer, busy = visitors[VIEWER], make_busy(api)  # the newest, for the activity shows no more than a page
    item = unescape(viewer.get(f"/items/{busy['used']}").body.decode())
    assert f'<a href="/documents/{busy["uuid"]}">' in item
    assert f'<a href="/documents/{busy["sheet"]}">' in item
    sheet = unescape(viewer.get(f"/documents/{busy['sheet']}").body.decode())
    assert f'<a href="/items/{busy["used"]}">' in sheet
    assert f'<a href="/documents/{busy["uuid"]}">' in sheet
    assert f"/api/documents/{busy['sheet']}/file/1" in sheet
    used = viewer.get(f"/documents/{busy['uuid']}").body.decode()
    assert f'<a href="/documents/{busy["sheet"]}">' in used.partition('id="used"')[2]
    activity = viewer.get("/activity").body.decode()
    assert f"/documents/{busy['sheet']}" in activity


def test_static_files(api: Api) -> None:
    """Style and scripts need no login, are typed, and are asked for again only by their tag."""
    browser = api.as_(None)
    for name, kind in (("style.css", "text/css"), ("live.js", "javascript"), ("icon.svg", "image/svg")):
        answer = browser.call("GET", f"/static/{name}")
        assert answer.status == 200
        assert kind in answer.headers["content-type"]
        assert answer.headers["cache-control"] == "no-cache"
        again = browser.call("GET", f"/static/{name}", headers={"If-None-Match": answer.headers["etag"]})
        assert again.status == 304
    for path in ("/static/", "/static/../templates/base.html", "/static/%2e%2e/render.py"):
        assert browser.call("GET", path).status == 404


def test_browsers_get_pages_and_programs_json(visitors: dict[str, Visitor], api: Api) -> None:
    """The same error, as a page for a browser and as JSON for everybody else; the API is always JSON."""
    page = visitors[VIEWER].get("/items/NO-SUCH")
    assert (page.status, page.headers["content-type"]) == (404, "text/html; charset=utf-8")
    assert "does not exist on this server" in page.body.decode()
    assert api.call("GET", "/items/NO-SUCH").json()["error"] == "not_found"
    assert api.call("GET", "/api/items/NO-SUCH", headers=HTML).json()["error"] == "not_found"
    stranger = api.as_(None).call("GET", "/nowhere", headers=HTML)
    assert stranger.status == 404
    assert "Log out" not in stranger.body.decode()


def test_a_notice_is_shown_once_and_by_nobody_else(visitors: dict[str, Visitor], api: Api) -> None:
    """It travels in a cookie that the next page takes away; an address cannot put words on a page."""
    parent, child = api.items(2)
    visitor = visitors[EDITOR]
    done = visitor.post(f"/items/{parent}/bom/lines", child=child, quantity="2")
    page, _, key = done.headers["location"].partition("?said=")
    assert (done.status, page) == (303, f"/items/{parent}/bom")
    notice = done.headers["set-cookie"].split(";")[0]
    assert "HttpOnly" in done.headers["set-cookie"]
    both = {"Cookie": f"{visitor.cookie}; {notice}"}
    # Another tab, or a script there that fetches news, neither shows the notice nor takes it.
    for elsewhere in ("/activity", f"/items/{child}/bom", page, f"{page}?said=0"):
        other = visitor.get(elsewhere, **both)
        assert "added.</bdi>" not in other.body.decode()
        assert "set-cookie" not in other.headers
    first = visitor.get(done.headers["location"], **both)
    assert f"✓ <bdi>{child} added.</bdi>" in first.body.decode()
    assert f'silo_notice_{key}=""' in first.headers["set-cookie"]
    assert "Send money" not in visitor.get(f"/items/{parent}/bom?notice=Send+money").body.decode()


# --- forms --------------------------------------------------------------------------------------------------


def test_keeping_without_a_reason_says_so_on_the_line(visitors: dict[str, Visitor], api: Api) -> None:
    """A kept line always has a reason to show."""
    parent, child = api.items(2)
    api.merge(parent, {child: 1})
    api.merge(parent, {})
    visitors[EDITOR].post(f"/items/{parent}/bom/decide", chosen=child, action="keep")
    line = api.lines(parent)[child]
    assert (line["source"], line["reason"]) == ("manual", "kept on purpose, not in the CAD model")


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"action": "explode"}, "wanted one of the buttons"),
        ({"action": "keep", "chosen": "NO-SUCH"}, "has no line for"),
        ({"action": "keep", "reason": "x" * 501}, "wanted at most 500 characters"),
    ],
)
def test_a_form_that_makes_no_sense(
    visitors: dict[str, Visitor], api: Api, fields: dict[str, str], words: str
) -> None:
    """A page with the reason, not a fault; nothing is changed."""
    parent, child = api.items(2)
    api.merge(parent, {child: 1})
    api.merge(parent, {})
    before = api.lines(parent)
    answer = visitors[EDITOR].post(f"/items/{parent}/bom/decide", **{"chosen": child, **fields})
    assert 400 <= answer.status < 500
    assert words in answer.body.decode()
    assert api.lines(parent) == before


def test_a_choice_about_a_field_that_there_is_not(visitors: dict[str, Visitor], api: Api) -> None:
    """A form that was tampered with gets an answer, not a fault."""
    parent, child = api.items(2)
    api.merge(parent, {child: 1})
    line = api.lines(parent)[child]["id"]
    fields = {"asked": "null quantity", "quantity": "2", "was_quantity": "1"}
    answer = visitors[EDITOR].post(f"/items/{parent}/bom/lines/{line}", **fields)
    assert answer.status == 400
    assert "Choose yours or theirs" in answer.body.decode()


def test_a_long_bom_has_pages(visitors: dict[str, Visitor], api: Api) -> None:
    """A page has 500 lines; the view survives in every link, and a line of another page can be edited."""
    parent, *children = api.parts(f"LONG-{n:04}" for n in range(504))
    api.merge(parent, dict.fromkeys(children, 1))
    path = f"/items/{parent}/bom"
    page = visitors[EDITOR].get(path).body.decode()
    assert page.count("<tr id=") == 500
    assert "1 to 500 of 503 lines" in page
    last = visitors[EDITOR].get(f"{path}?sort=-number&page=2").body.decode()
    assert last.count("<tr id=") == 3
    assert "sort=-number&amp;page=2&amp;edit=" in last
    line = api.lines(parent)[children[-1]]["id"]
    assert 'aria-label="Change LONG-0503"' in visitors[EDITOR].get(f"{path}?edit={line}").body.decode()
    found = visitors[EDITOR].get(f"{path}?q=long+0499").body.decode()
    assert found.count("<tr id=") == 1
    assert "1 of 503 lines" in found
    assert visitors[EDITOR].get(f"{path}?show=hand").body.decode().count("<tr id=") == 0
    assert visitors[EDITOR].get(f"{path}?sort=nope").body.decode().count("<tr id=") == 500
    for view in ("show=%3Cb%3E", "page=9%3C", "page=0", "shwo=hand"):
        assert visitors[EDITOR].get(f"{path}?{view}").status == 400


def test_a_decision_about_very_many_lines(visitors: dict[str, Visitor], api: Api) -> None:
    """A thousand boxes at once are no form too large; what is shown of more is bounded."""
    parent, *children = api.parts(f"MANY-{n:04}" for n in range(1103))
    api.merge(parent, dict.fromkeys(children, 1))
    api.merge(parent, {children[0]: 1})
    page = visitors[EDITOR].get(f"/items/{parent}/bom").body.decode()
    boxes = re.findall(r'name="chosen" form="bulk" value="([^"]+)"', page)
    assert len(boxes) == 1000
    # "name mark", as in /waiting: one script looks after the boxes of both pages.
    assert {box.rpartition(" ")[0] for box in boxes} <= {line["id"] for line in api.lines(parent).values()}
    assert "the first 1000; the others follow" in page
    assert page.count("<form") < 10
    lines = [line["id"] for line in api.lines(parent).values() if line["unreferenced_since"]]
    answer = visitors[EDITOR].post(f"/items/{parent}/bom/decide", chosen=lines, action="keep", bulk="yes")
    assert answer.status == 303
    assert not any(line["unreferenced_since"] for line in api.lines(parent).values())
    assert len(lines) == 1101


def test_a_conflict_that_came_meanwhile_is_not_decided(visitors: dict[str, Visitor], api: Api) -> None:
    """A sync that changes no line, and brings another number: nobody has seen it, so nobody has decided."""
    parent, child = api.items(2)
    api.merge(parent, {child: 4})
    api.good("PUT", f"/api/items/{parent}/bom/{child}", {"quantity": 6})
    api.merge(parent, {child: 5})
    visitor = visitors[EDITOR]

    def box() -> str:
        page = visitor.get(f"/waiting?q={parent}").body.decode()
        return unescape(re.findall(r'name="chosen" form="bulk" value="([^"]+)"', page)[0])

    seen = box()
    assert seen.rpartition(" ")[0] == parent
    api.merge(parent, {child: 12})
    answer = visitor.post("/waiting/decide", chosen=seen, action="keep_silo", reason="the drawing says so")
    assert answer.status == 409
    assert "it was changed meanwhile" in answer.body.decode()
    assert 'name="reason" value="the drawing says so"' in answer.body.decode()
    assert [c["assembly_quantity"] for c in api.get(f"/api/items/{parent}/bom/review")["conflicts"]] == [12]
    assert visitor.post("/waiting/decide", chosen=box(), action="keep_silo").status == 303
    assert api.get(f"/api/items/{parent}/bom/review")["conflicts"] == []


def test_a_carried_file_that_was_tampered_with(visitors: dict[str, Visitor], api: Api) -> None:
    """What comes back between check and import is checked again; a bomb is not unpacked."""
    parent, child = api.items(2)
    bomb = base64.b64encode(zlib.compress(b"\n" * 9_000_000)).decode()
    for packed, status in (
        ("%%%", 400),
        (base64.b64encode(b"no zlib").decode(), 400),
        (bomb, 413),
        ("", 413),
    ):
        answer = visitors[EDITOR].post(f"/items/{parent}/import", packed=packed, name="x.csv")
        assert answer.status == status, packed[:20]
    forged = base64.b64encode(zlib.compress(f"Part number,Quantity\n{child},-1\n".encode())).decode()
    answer = visitors[EDITOR].post(f"/items/{parent}/import", packed=forged, name="x.csv")
    assert answer.status == 400
    assert api.lines(parent) == {}


def test_a_file_that_is_no_bom(visitors: dict[str, Visitor], api: Api) -> None:
    """No file, a picture, a table without the columns: a page that says what is wanted."""
    parent = api.item()
    visitor = visitors[EDITOR]
    wanted = {b"": "Part number", b"\x89PNG\r\n\x1a\n\x00": "Part number", b"a,b\n1,2\n": "Part number"}
    for content, words in {**wanted, b"PK\x03\x04" + bytes(99): "workbook cannot be read"}.items():
        body, headers = form_body({"csrf_token": visitor.csrf, "file": ("x.csv", content)})
        sent = {"Cookie": visitor.cookie, **HTML, **headers}
        answer = visitor.api.call("POST", f"/items/{parent}/import/check", body=body, headers=sent)
        assert answer.status == 400
        assert words in answer.body.decode()
    assert visitor.post(f"/items/{parent}/import/check").status == 400


def test_the_head_of_a_product_counts_lines_of_an_older_revision(
    visitors: dict[str, Visitor], api: Api
) -> None:
    """On all levels, each line once, however often its assembly is used."""
    top, one, other, screw = api.items(4)
    for _ in range(2):
        api.good("POST", f"/api/items/{screw}/revisions", {"comment": "newer"})
    for parent in (one, other, top):
        api.good("POST", bom(parent), {"child_part_number": screw, "quantity": 2})
    for child in (one, other):
        api.good("POST", bom(top), {"child_part_number": child, "quantity": 3})
    assert "of an older revision" not in visitors["viewer"].get(f"/items/{top}").body.decode()
    for parent, revision in ((one, 1), (top, 1), (other, 2)):
        api.good("PUT", bom(parent, screw), {"child_revision": revision})
    assert "(2 of an older revision)" in visitors["viewer"].get(f"/items/{top}").body.decode()
    assert "of an older revision" not in visitors["viewer"].get(f"/items/{other}").body.decode()


def test_a_secret_travels_over_tls_only_where_there_is_tls(
    visitors: dict[str, Visitor], tmp_path: Path
) -> None:
    """The cookie with a new login link, like that of a session."""
    url = sqlite_database(tmp_path / "silo.db")
    settings = Settings(database_url=url, files_dir=tmp_path, secure_cookies=True)
    with running_server(url, token=TOKEN, settings=settings) as server, Api(server.base_url, TOKEN) as api:
        api.good("POST", "/api/users", {"username": VIEWER})
        for visitor, secure in ((enter(api, ADMIN), True), (visitors[ADMIN], False)):
            made = visitor.post(f"/users/{VIEWER}/login-link")
            assert made.status == 303
            assert ("secure" in made.headers["set-cookie"].lower()) is secure


def test_activity_gives_only_what_is_new(visitors: dict[str, Visitor], api: Api) -> None:
    """With ``after`` the page holds the later events only, and says up to where it knows."""
    api.item()
    first = visitors[VIEWER].get("/activity").body.decode()
    last = re.search(r'data-last="(\d+)-[0-9a-f]{8}"', first)
    assert last is not None
    number = api.item()
    news = visitors[VIEWER].get(f"/activity?newer_than={last[1]}").body.decode()
    assert news.count('<li class="entry">') == 1
    assert number in news


def test_a_file_too_large_is_a_page(tmp_path: Path) -> None:
    """What the server does not take is reported in a page to a browser, and as JSON to a program."""
    url = sqlite_database(tmp_path / "small.db")
    small = Settings(database_url=url, max_body_bytes=10_000)
    with running_server(url, token=TOKEN, settings=small) as server, Api(server.base_url, TOKEN) as api:
        parent = api.item()
        visitor = enter(api, ADMIN)
        body, headers = form_body({"file": ("x.FCStd", model_file(b"x" * 12_000))})
        for of in (f"items/{parent}", f"documents/{uuid4()}"):  # files have a limit of their own
            assert api.call("POST", f"/api/{of}/file", body=body, headers=headers).status == 201
        body, headers = form_body({"csrf_token": visitor.csrf, "file": ("x.csv", b"x" * 12_000)})
        path = f"/items/{parent}/import/check"
        page = visitor.api.call(
            "POST", path, body=body, headers={"Cookie": visitor.cookie, **HTML, **headers}
        )
        assert (page.status, page.headers["content-type"]) == (413, "text/html; charset=utf-8")
        assert "larger than this server takes" in page.body.decode()
        assert (
            api.bad(413, "POST", f"{bom(parent)}/import", body=body, headers=headers)["error"] == "too_large"
        )


@pytest.mark.parametrize(
    ("language", "pages"),
    [
        ("en", {"": "1 row", "?view=flat": "1 part", "/bom?q=zzz": "0 of 1 line", "?q=zzz": "0 of 1 row"}),
        ("de", {"": "1 Zeile", "?view=flat": "1 Teil", "/bom?q=zzz": "0 von 1 Position"}),
    ],
)
def test_a_table_counts_one_as_one(
    visitors: dict[str, Visitor], api: Api, language: str, pages: dict[str, str]
) -> None:
    """Rows, parts and lines, also in German."""
    top, part = api.items(2)
    api.merge(top, {part: 1})
    for path, words in pages.items():
        page = visitors[VIEWER].get(f"/items/{top}{path}", **{"Accept-Language": language}).body.decode()
        assert f'id="found" role="status">{words}<' in page.replace(' class="hint"', "")


def test_a_giant_tree_is_shown_less_deep(visitors: dict[str, Visitor], api: Api) -> None:
    """A tree too large for a page is shown less deep, says so, and has pages where all is asked for."""
    levels = [api.items(14) for _ in range(3)]
    root = api.item()
    api.merge(root, dict.fromkeys(levels[0], 1))
    for upper, lower in pairwise(levels):
        for number in upper:
            api.merge(number, dict.fromkeys(lower, 1))
    path = f"/items/{root}"
    page = visitors[VIEWER].get(path).body.decode()
    assert "210 rows in the first 2 levels; 2954 in all 3" in page
    assert page.count('<tr class="l') == 14 + 14 * 14
    second = visitors[VIEWER].get(f"{path}?depth=3&page=2").body.decode()
    assert "501 to 1000 of 2954 rows" in second
    assert second.count('<tr class="l') == 500
    assert '<tr class="trail">' in second
    assert visitors[VIEWER].get(f"{path}?depth=3&page=99").body.decode().count('<tr class="l') == 454
    one = levels[2][5]
    found = visitors[VIEWER].get(f"{path}?q={one}").body.decode()
    assert found.count('<tr class="l3" ') == 14 * 14
    assert found.count('<tr class="l') == 14 + 14 * 14 + 14 * 14


def test_answers_are_compressed_and_secrets_masked(visitors: dict[str, Visitor], api: Api) -> None:
    """Pages and JSON are, for those who take it; no two answers have the same secret."""
    parent, *children = api.parts(f"GZIP-{n:03}" for n in range(120))
    api.merge(parent, dict.fromkeys(children, 1))
    visitor = visitors[EDITOR]
    asked = {"Cookie": visitor.cookie, **HTML, "Accept-Encoding": "gzip"}
    packed = api.as_(None).call("GET", f"/items/{parent}/bom", headers=asked)
    plain = visitor.get(f"/items/{parent}/bom")
    assert packed.headers["content-encoding"] == "gzip"
    assert "content-encoding" not in plain.headers
    assert len(packed.body) * 6 < len(plain.body)
    text = gzip.decompress(packed.body).decode()
    secrets = {
        re.search(r'name="csrf_token" value="([^"]+)"', page)[1] for page in (text, plain.body.decode())
    }
    assert len(secrets) == 2
    for secret in secrets:
        sent = visitor.post(f"/items/{parent}/bom/lines", csrf=secret, child=children[0], quantity="2")
        assert sent.status in (303, 409), sent.body
    for wrong in ("", "m.", "m.00", "m.zz", "m.0", secrets.pop()[:-2]):
        sent = visitor.post(f"/items/{parent}/bom/lines", csrf=wrong, child=children[0], quantity="2")
        assert sent.status == 403
    answer = api.call("GET", bom(parent), headers={"Accept-Encoding": "gzip"})
    assert answer.headers["content-encoding"] == "gzip"
    assert len(json.loads(gzip.decompress(answer.body))) == 119


def test_a_form_reads_quantities_as_people_type_them(api: Api, visitors: dict[str, Visitor]) -> None:
    """What is ambiguous is refused with both readings, and what was typed stays in the form."""
    parent, child = api.items(2)
    refused = visitors[EDITOR].post(f"/items/{parent}/bom/lines", child=child, quantity="1,000")
    assert refused.status == 400
    assert b"1000 or 1" in refused.body
    assert b'value="1,000"' in refused.body
    assert visitors[EDITOR].post(f"/items/{parent}/bom/lines", child=child, quantity="1,5").status == 303
    assert api.quantities(parent) == {child: 1.5}


def test_an_order_list_shows_what_it_knows(api: Api, visitors: dict[str, Visitor]) -> None:
    """No cost if nothing is bought, no empty column; without any mass the totals name no parts."""
    top, part = api.items(2)
    api.merge(top, {part: 2})
    page = visitors[EDITOR].get(f"/items/{top}/order").body.decode()
    assert "1 neither" in page
    assert "Choose all" in page
    for word in ("0.00 EUR", "lead time", "Material", "Ordered already", "Mass of one"):
        assert word not in page
    assert "states none" not in visitors[EDITOR].get(f"/items/{top}").body.decode()
    api.good("PATCH", f"/api/items/{part}/properties", {"material": "Steel", "supplier": "Acme"})
    page = visitors[EDITOR].get(f"/items/{top}/order").body.decode()
    assert "Longest lead time" in page
    assert "no price" in page


def test_an_order_list_has_pages_with_the_totals_of_all(
    api: Api, visitors: dict[str, Visitor], monkeypatch: pytest.MonkeyPatch
) -> None:
    """By supplier, then made, then the others; page 0 has all, for paper. Exports are whole."""
    monkeypatch.setattr(orders_page, "PAGE_ROWS", 2)
    top, *parts = api.items(6)
    api.merge(top, dict.fromkeys(parts, 1))
    for part, supplier, days in zip(parts, ("bolts", "Axles", "bolts"), (3, 9, 4), strict=False):
        terms = {"supplier": supplier, "standard_cost": 100 + days, "lead_time_days": days}
        api.good("PATCH", f"/api/items/{part}/properties", terms)
    api.good("PUT", f"/api/items/{parts[3]}", {"sourcing_type": "manufactured"})
    as_shown = [parts[1], *sorted((parts[0], parts[2])), parts[3], parts[4]]

    def shown(query: str) -> list[str]:
        page = visitors[EDITOR].get(f"/items/{top}/order{query}").body.decode()
        for words in ("316.00 EUR", "3 bought parts, 1 made part, 1 neither", "9 days"):
            assert words in page
        return re.findall(r'aria-label="Choose ([^"]+)"', page)

    assert [shown(f"?page={number}") for number in (1, 2, 3)] == [as_shown[:2], as_shown[2:4], as_shown[4:]]
    assert shown("?page=99") == as_shown[4:]
    assert shown("?page=0") == as_shown
    second = visitors[EDITOR].get(f"/items/{top}/order?pieces=7&page=2").body.decode()
    assert f"/items/{top}/order?pieces=7&amp;page=3" in second
    (export,) = re.findall(r'"(/api/[^"]+order.csv[?]pieces=7&amp;kind=bought)"', second)
    written = visitors[EDITOR].get(unescape(export)).body.decode()
    assert all(part in written for part in as_shown[:3])


def test_only_the_newest_change_of_suppliers_is_undone(api: Api, visitors: dict[str, Visitor]) -> None:
    """An older one is refused, and nothing changes."""
    (part,) = api.items(1)
    path = f"/api/items/{part}/suppliers"
    versions = [api.good("PUT", path, {"supplier_parts": [{"supplier": who}]})["version"] for who in "AB"]
    undo = f"/items/{part}/suppliers/undo"
    assert visitors[EDITOR].post(undo, change=str(versions[0])).status == 409
    assert [one["supplier"] for one in api.get(path)["supplier_parts"]] == ["B"]
    assert visitors[EDITOR].post(undo, change=str(versions[1])).status == 303
    assert [one["supplier"] for one in api.get(path)["supplier_parts"]] == ["A"]


def test_the_bom_page_says_what_happened_since_the_last_sync(api: Api, visitors: dict[str, Visitor]) -> None:
    """The sync itself is not among the changes after it."""
    parent, child = api.items(2)
    api.merge(parent, {child: 1})

    def heads() -> list[str]:
        page = visitors[EDITOR].get(f"/items/{parent}/bom").body.decode()
        return [head for head in ("Last sync from CAD", "Since then") if f"<h2>{head}</h2>" in page]

    assert heads() == ["Last sync from CAD"]
    api.edit_line(parent, child, notes="x")
    assert heads() == ["Last sync from CAD", "Since then"]
