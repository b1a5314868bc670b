# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who may see and send what on the pages: every page × every role, form secrets, login and log-out."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Iterator
from urllib.parse import quote, unquote, urlencode

import pytest
from fastapi.routing import APIRoute
from server_testing import Api, sqlite_database
from starlette.datastructures import FormData
from web_visitor import FORM, HTML, ROLES, Visitor, enter, link_of

from silo.api.client import SiloClient
from silo.bom.errors import AuthError
from silo_server.run import RunningServer, running_server
from silo_server.services.access.signing import signing_key
from silo_server.settings import Settings
from silo_server.web.pages import ROUTERS
from silo_server.web.unsent_form import MOST_KEPT, UnsentForm, read_signed, unsent_form

TOKEN = "silo_pages"
VIEWER, EDITOR, ADMIN = ROLES
PUBLIC = "public"

# Reading is for viewers, changing for editors. These are the exceptions.
PUBLIC = {
    *("GET /login", "POST /login", "POST /language"),
    *("GET /login/link/{secret}", "POST /login/link/{secret}"),
}
OF_VIEWERS = {
    *("POST /login/device", "POST /logout", "POST /mine/follow", "POST /mine/seen", "POST /account/tokens"),
    *("POST /account/tokens/{token_id}/revoke", "POST /account/password"),
    "POST /account/logout-everywhere",
    # These two need the right to approve, whatever the role.
    "POST /items/{part_number}/releases/{label}/approval",
    "POST /items/{part_number}/releases/{label}/end",
}
OF_EDITORS = {"GET /items/new", "GET /items/{part_number}/edit", "GET /items/{part_number}/import"}
OF_EDITORS |= {"GET /items/import"}
OF_ADMINS = re.compile("[A-Z]+ /(users|mode|audit|system)|POST /suppliers/rates|POST /categories")
ROUTES = [route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute)]
NAMED = {f"{method} {route.path}" for route in ROUTES for method in route.methods}
CHANGING = sorted(route.removeprefix("POST ") for route in NAMED - PUBLIC if route.startswith("POST "))


def needed(route: str) -> str:
    """Return the least role that a page lets in."""
    if OF_ADMINS.match(route):
        return ADMIN
    return EDITOR if route in OF_EDITORS or not (route.startswith("GET ") or route in OF_VIEWERS) else VIEWER


def fill(path: str) -> str:
    """Return the path of something that does not exist, so that nothing is harmed."""
    return re.sub(r"{(\w+)}", lambda found: "999999" if found[1] == "token_id" else "NO-SUCH", path)


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visitor]:
    """An admin at a server that was started read-only."""
    url = sqlite_database(tmp_path_factory.mktemp("closed") / "silo.db")
    settings = Settings(database_url=url, read_only=True)
    with running_server(url, token=TOKEN, settings=settings) as running, Api(running.base_url, TOKEN) as api:
        yield enter(api, ADMIN)


# --- who may ------------------------------------------------------------------------------------------------


def test_a_page_lets_in_who_may(visitors: dict[str, Visitor], api: Api) -> None:
    """Nobody is led to the login page, who may not gets a page that says so, who may gets in."""
    assert NAMED >= PUBLIC | OF_VIEWERS | OF_EDITORS
    assert not any(route.include_in_schema for route in ROUTES)
    ends_sessions = {"POST /logout", "POST /account/logout-everywhere"}  # these have their own tests
    for route in sorted(NAMED - PUBLIC - ends_sessions):
        method, path = fill(route).split()
        stranger = api.as_(None).call(method, path, headers=HTML)
        assert (stranger.status, stranger.headers["location"][:12]) == (303, "/login?next="), route
        for role in ROLES:
            visitor = visitors[role]
            # "password" and "mode" without fields are refused by their content, so nothing is harmed.
            answer = visitor.get(path) if method == "GET" else visitor.post(path)
            refused = ROLES.index(role) < ROLES.index(needed(route))
            assert (answer.status == 403, answer.status < 500) == (refused, True), (route, role, answer.body)
            assert not refused or f"this needs {needed(route)}" in answer.body.decode()


def test_every_form_needs_its_secret(visitors: dict[str, Visitor]) -> None:
    """403 with a page in words for each form without the session's own secret, whoever sends it."""
    for path in CHANGING:
        for csrf in ("", "wrong", "ü"):
            answer = visitors[ADMIN].post(fill(path), csrf=csrf)
            assert (answer.status, b"load the page again" in answer.body) == (403, True), (path, csrf)


def test_a_program_that_its_user_lets_in_has_a_token(visitors: dict[str, Visitor], api: Api) -> None:
    """The page shows the program's own words as such, and the code; the client's login ends with a token."""
    with SiloClient(api.base_url, None) as stranger:
        login = stranger.begin_login("FreeCAD <b>and administrator</b>")
        assert login is not None
        assert stranger.asked_again(login).token == ""
        path = login.page.removeprefix(api.base_url)
        page = visitors[EDITOR].get(path).body.decode()
        assert login.code in page
        assert "FreeCAD &lt;b&gt;and administrator&lt;/b&gt;" in page
        assert "127.0.0.1" in page
        answer = visitors[EDITOR].post("/login/device", code=login.code.lower(), answer="allow")
        assert (answer.status, answer.headers["location"].partition("?")[0]) == (303, "/account")
        token = stranger.asked_again(login).token
        with pytest.raises(AuthError, match="begin again"):
            stranger.asked_again(login)
        other = stranger.begin_login("silo-mod")
        assert other is not None
        assert visitors[EDITOR].post("/login/device", code=other.code, answer="refuse").status == 303
        with pytest.raises(AuthError, match="refused"):
            stranger.asked_again(other)
    caller = api.as_(token)
    assert caller.call("GET", "/api/auth/me").json()["username"] == EDITOR
    (made,) = [one for one in caller.call("GET", "/api/auth/tokens").json() if "FreeCAD" in one["name"]]
    assert made["scopes"] == ["read", "write"]
    assert made["expires_at"]


def test_an_administrator_lets_no_program_administer(visitors: dict[str, Visitor], api: Api) -> None:
    """The page says so."""
    with SiloClient(api.base_url, None) as stranger:
        login = stranger.begin_login("silo-mod")
        assert login is not None
        assert visitors[ADMIN].post("/login/device", code=login.code, answer="allow").status == 303
        token = stranger.asked_again(login).token
    assert api.as_(token).call("GET", "/api/users").status == 403
    assert api.as_(token).call("POST", "/api/auth/tokens", {"name": "x", "scopes": ["admin"]}).status == 403


def test_a_code_that_does_not_wait_is_named(visitors: dict[str, Visitor]) -> None:
    """On the page as in the answer of its form."""
    for code in ("BCDF-GHJK", "<script>", "0"):
        assert visitors[EDITOR].get(f"/login/device?code={quote(code)}").status == 404
        assert visitors[EDITOR].post("/login/device", code=code, answer="allow").status == 404
    assert b"Type the code" in visitors[EDITOR].get("/login/device").body


def test_a_login_form_from_another_site_is_refused(api: Api) -> None:
    """Nobody is logged in under a stranger's name by a page elsewhere."""
    body = urlencode({"username": "admin", "password": "whatever it is"}).encode()
    for headers in ({"Sec-Fetch-Site": "cross-site"}, {"Origin": "https://elsewhere.example"}):
        answer = api.as_(None).call("POST", "/login", body=body, headers={**FORM, **HTML, **headers})
        assert answer.status == 403
    answer = api.as_(None).call(
        "POST", "/login", body=body, headers={**FORM, **HTML, "Sec-Fetch-Site": "same-origin"}
    )
    assert answer.status == 401


def test_a_page_speaks_the_language_of_its_reader(api: Api) -> None:
    """By the browser, then by the choice; what the API says stays English."""
    nobody = api.as_(None)

    def title(path: str = "/login", **headers: str) -> tuple[str, str]:
        answer = nobody.call("GET", path, headers={**HTML, **headers})
        text = answer.body.decode()
        assert answer.headers["content-language"] in text.partition("<head>")[0]
        assert {"accept-language", "cookie"} <= set(answer.headers["vary"].lower().split(", "))
        return answer.headers["content-language"], text.partition("<h1>")[2].partition("<")[0]

    german = {"Accept-Language": "de-CH, en;q=0.5"}
    assert title() == ("en", "Log in")
    assert title(**german) == ("de", "Anmelden")
    body = urlencode({"language": "en", "next": "/login?next=/items"}).encode()
    chosen = nobody.call("POST", "/language", body=body, headers={**FORM, **HTML, **german})
    assert (chosen.status, chosen.headers["location"]) == (303, "/login?next=/items")
    cookie = chosen.headers["set-cookie"].partition(";")[0]
    assert title(**german, Cookie=cookie) == ("en", "Log in")
    for wrong in (b"language=", b"language=../../de", b""):
        assert nobody.call("POST", "/language", body=wrong, headers={**FORM, **HTML}).status == 400
    elsewhere = {**FORM, **HTML, "Sec-Fetch-Site": "cross-site"}
    assert nobody.call("POST", "/language", body=body, headers=elsewhere).status == 403
    plain = nobody.call("GET", "/api/items/nothing", headers=german)
    assert plain.body == nobody.call("GET", "/api/items/nothing").body


@pytest.mark.usefixtures("visitors")
def test_logging_out_ends_the_session(api: Api) -> None:
    """Afterwards the cookie is worth nothing."""
    visitor = enter(api, VIEWER)
    assert visitor.get("/items").status == 200
    answer = visitor.post("/logout")
    assert (answer.status, answer.headers["location"]) == (303, "/login")
    assert visitor.get("/items").status == 303


def test_the_way_back_after_a_login(api: Api) -> None:
    """The login page knows the whole address; after a lost form it is the page that the form was on."""
    browser = api.as_(None)
    asked = browser.call("GET", "/items?q=a+b&type=part", headers=HTML)
    assert unquote(asked.headers["location"]) == "/login?next=/items?q=a+b&type=part"
    host = api.base_url.removeprefix("http://")
    sent = browser.call(
        "POST", "/items/X/bom/decide", body=b"", headers={**HTML, "Referer": f"http://{host}/items/X/bom"}
    )
    assert unquote(sent.headers["location"]) == "/login?next=/items/X/bom"
    foreign = browser.call("POST", "/mode", body=b"", headers={**HTML, "Referer": "https://elsewhere/x"})
    assert unquote(foreign.headers["location"]) == "/login?next=/"


def test_a_used_link_leads_on_where_the_session_lives(api: Api) -> None:
    """Opening the same link twice in the browser that it let in is no error."""
    browser = api.as_(None)
    path = link_of(api, ADMIN)
    cookie = browser.call("POST", path).headers["set-cookie"].split(";")[0]
    again = browser.call("POST", path, body=b"next=/activity", headers={"Cookie": cookie, **FORM})
    assert (again.status, again.headers["location"]) == (303, "/activity")


def test_the_address_of_a_form_leads_to_its_page(visitors: dict[str, Visitor]) -> None:
    """Typed, reloaded or kept by a login: no address of ours is "Not found"."""
    pages = {fill(route.removeprefix("GET ")) for route in NAMED if route.startswith("GET ")}
    for path in {fill(path) for path in CHANGING} - pages:
        answer = visitors[ADMIN].get(path)
        page = answer.headers["location"]
        assert (answer.status, page in pages, path.startswith(page)) == (303, True, True), path


SAME_SITE = {"Sec-Fetch-Site": "same-origin"}


def _key(server: RunningServer) -> bytes:
    """The secret by which the running server signs."""
    with server.app.state.server.db.read() as tx:
        return signing_key(tx)


def test_a_form_of_ours_is_kept_over_the_login_and_another_site_s_is_not(
    api: Api, server: RunningServer
) -> None:
    """Its text travels in the login form; what another site sent is forgotten."""
    browser = api.as_(None)
    body = urlencode({"csrf_token": "old", "child": "X", "notes": "a <b> & c"}).encode()
    ours = browser.call(
        "POST", "/items/X/bom/lines", body=body, headers={**FORM, **HTML, **SAME_SITE}
    ).body.decode()
    packed = re.search(r'name="kept" value="([^"]+)"', ours)
    assert packed is not None
    kept = read_signed(packed[1], _key(server))
    assert kept is not None
    assert (kept.path, list(kept.fields)) == ("/items/X/bom/lines", [("child", "X"), ("notes", "a <b> & c")])
    for headers in ({}, {"Sec-Fetch-Site": "cross-site"}, {"Origin": "https://elsewhere.example"}):
        answer = browser.call("POST", "/items/X/bom/lines", body=body, headers={**FORM, **HTML, **headers})
        assert answer.status == 303
        assert answer.headers["location"].startswith("/login?next=")


def test_an_old_form_of_ours_is_shown_and_not_carried_out(visitors: dict[str, Visitor], api: Api) -> None:
    """Another session's secret: the text is there, with a button; the secret on it is the new one."""
    parent, child = api.items(2)
    visitor = visitors[EDITOR]
    body = urlencode({"csrf_token": "another session's", "child": child, "quantity": "3"}).encode()
    headers = {"Cookie": visitor.cookie, **FORM, **HTML, **SAME_SITE}
    answer = visitor.api.call("POST", f"/items/{parent}/bom/lines", body=body, headers=headers)
    assert answer.status == 403
    assert "Send it now" in answer.body.decode()
    assert "another session" not in answer.body.decode()
    assert api.lines(parent) == {}
    for other in ({}, {"Sec-Fetch-Site": "cross-site"}, {"Origin": "https://elsewhere.example"}):
        headers = {"Cookie": visitor.cookie, **FORM, **HTML, **other}
        answer = visitor.api.call("POST", f"/items/{parent}/bom/lines", body=body, headers=headers)
        assert answer.status == 403
        assert "Send it now" not in answer.body.decode()


KEY = b"k" * 32
SIGNED = UnsentForm("/x", [("a", "b")]).signed(KEY)


@pytest.mark.parametrize(
    "text",
    [
        "",
        ".",
        "%%%",
        "ü",
        SIGNED.partition(".")[2],
        "0" * 64 + "." + SIGNED.partition(".")[2],
        SIGNED.replace(".", "", 1),
        SIGNED[:-4],
        UnsentForm("/x", [("a", "c")]).signed(b"another server's").rstrip("="),
        base64.b64encode(zlib.compress(b'["/x", [], []]')).decode(),
        "x" * 100_000,
    ],
)
def test_a_kept_form_that_this_server_did_not_sign(api: Api, text: str) -> None:
    """It is forgotten, unread; the login works."""
    assert read_signed(SIGNED, KEY) == UnsentForm("/x", [("a", "b")], [])
    assert read_signed(text, KEY) is None
    browser = api.as_(None)
    body = urlencode({"username": "x", "password": "y", "kept": text}).encode()
    answer = browser.call("POST", "/login", body=body, headers={**FORM, **HTML})
    assert answer.status in (401, 413, 429)
    assert "is kept" not in answer.body.decode()


@pytest.mark.parametrize("length", [MOST_KEPT, 5 * MOST_KEPT])
def test_a_large_form_is_not_kept_over_a_login_and_the_page_says_so(api: Api, length: int) -> None:
    """Whether it was read, or is too large to be read before its sender is known."""
    body = urlencode({"csrf_token": "old", "child": "X", "notes": "a" * length}).encode()
    answer = api.as_(None).call(
        "POST", "/items/X/bom/lines", body=body, headers={**FORM, **HTML, **SAME_SITE}
    )
    assert answer.status == 401
    assert "What you sent is not kept" in answer.body.decode()
    assert 'name="kept"' not in answer.body.decode()


@pytest.mark.parametrize("name", ["password", "again", "current"])
def test_a_form_with_a_password_is_not_kept(name: str) -> None:
    """It goes nowhere but where it was typed for, not even packed into the login form."""
    assert unsent_form("/x", FormData([("notes", "a"), (name, "correct horse")])) is None
    kept = unsent_form("/x", FormData([("notes", "a"), ("csrf_token", "secret")]))
    assert kept is not None
    assert list(kept.fields) == [("notes", "a")]


def test_a_new_secret_is_shown_once(visitors: dict[str, Visitor]) -> None:
    """The page that shows it takes the cookie away in which it came."""
    visitor = visitors[VIEWER]
    made = visitor.post("/account/tokens", key="once", name="shown once", days="30", scope="read")
    cookie = made.headers["set-cookie"].partition(";")[0]
    _, secret = json.loads(unquote(cookie.partition("=")[2]))
    headers = {"Cookie": f"{visitor.cookie}; {cookie}", **HTML}
    page = visitor.api.call("GET", "/account", headers=headers)
    assert secret in page.body.decode()
    gone, *attributes = page.headers["set-cookie"].split("; ")
    assert gone.partition("=")[::2] == (cookie.partition("=")[0], '""')
    assert {"Max-Age=0", "Path=/account"} <= set(attributes)


def test_a_kept_form_leads_nowhere_else() -> None:
    """Its address is one of this server."""
    for path in ("https://elsewhere", "//elsewhere", "/\\elsewhere", "javascript:alert(1)"):
        kept = read_signed(UnsentForm(path, [("a", "b")]).signed(KEY), KEY)
        assert kept is not None
        assert kept.path == "/"


# --- a server that takes no changes -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "path", ["/items", "/activity", "/users", "/audit", "/account", "/nowhere", "/login"]
)
def test_a_read_only_server_says_so_on_every_page(closed: Visitor, path: str) -> None:
    """Also on pages of errors, and to those who are not logged in."""
    page = closed.api.call("GET", path, headers=HTML) if path == "/login" else closed.get(path)
    assert page.body.decode().count('id="closed"') == 1


def test_a_server_that_takes_changes_says_nothing(visitors: dict[str, Visitor]) -> None:
    """No banner, nothing switched off."""
    page = visitors[ADMIN].get("/users").body.decode()
    assert 'id="closed"' not in page
    assert "disabled" not in page


def test_a_mode_that_was_given_at_the_start_has_no_button(closed: Visitor) -> None:
    """A button that cannot work is none; the page says what does."""
    page = closed.get("/users").body.decode()
    assert "SILO_READ_ONLY" in page
    assert 'action="/mode"' in page
    assert 'name="mode"' not in page
