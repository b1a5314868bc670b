# SPDX-License-Identifier: LGPL-2.1-or-later
"""Users, tokens, sessions, CSRF, rate limits, audit, read-only mode."""

from __future__ import annotations

import re
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from hunting import BOTH
from server_testing import Answer, Api, Databases, bom, merge_body, wait_until
from sqlalchemy import select

from silo_server.db.tables import metadata
from silo_server.run import RunningServer, running_server
from silo_server.settings import Settings

pytestmark = BOTH

PASSWORD = "correct horse battery"
FORM = {"Content-Type": "application/x-www-form-urlencoded"}


@pytest.fixture
def user(api: Api) -> str:
    """An editor with a password."""
    name = "u" + uuid.uuid4().hex[:8]
    api.good("POST", "/api/users", {"username": name, "role": "editor", "password": PASSWORD})
    return name


def log_in(api: Api, name: str, password: str = PASSWORD) -> Answer:
    """Log in without a token."""
    return api.as_(None).call("POST", "/api/auth/login", {"username": name, "password": password})


def cookie_of(answer: Answer) -> dict[str, str]:
    """The header that sends the session back."""
    return {"Cookie": answer.headers["set-cookie"].split(";")[0]}


def test_who_am_i(api: Api) -> None:
    """401 without a token or with a wrong one; a wrong token is not saved by anything."""
    assert api.get("/api/auth/me") == {
        "username": "admin",
        "display_name": "admin",
        "role": "admin",
        "auth_source": "token",
    }
    for token in (None, "silo_wrong", "", "a b", "ü"):
        answer = api.as_(token and token.encode().decode("latin-1")).call("GET", "/api/auth/me")
        assert answer.status == 401
        assert answer.headers["www-authenticate"] == "Bearer"
    basic = api.as_(None).call("GET", "/api/auth/me", headers={"Authorization": "Basic YWJj"})
    assert basic.status == 401


def test_a_token_is_shown_once_named_and_revocable(api: Api) -> None:
    """``silo_…`` in the answer to its making and never again; its last use is known; revoked is revoked."""
    made = api.good("POST", "/api/auth/tokens", {"name": "CI", "expires_in_days": 1})
    secret = made["token"]
    assert re.fullmatch(r"silo_[0-9a-f]{40}", secret)
    mine = api.as_(secret)
    assert mine.get("/api/auth/me")["username"] == "admin"

    def listed() -> Any:
        return next(t for t in api.get("/api/auth/tokens") if t["id"] == made["id"])

    assert (listed()["name"], listed()["prefix"]) == ("CI", secret[:9])
    wait_until(lambda: listed()["last_used_at"] is not None, "the note of its last use")
    assert listed()["expires_at"] is not None
    assert secret not in str(api.get("/api/auth/tokens"))
    api.good("DELETE", f"/api/auth/tokens/{made['id']}")
    mine.bad(401, "GET", "/api/auth/me")
    api.bad(404, "DELETE", "/api/auth/tokens/99999999")


def test_an_expired_token_lets_nobody_in(api: Api) -> None:
    """A token's time is kept to the moment."""
    token = api.good("POST", "/api/auth/tokens", {"name": "brief", "expires_in_days": 1e-9})
    api.as_(token["token"]).bad(401, "GET", "/api/auth/me")


def test_a_user_revokes_only_the_own_tokens(api: Api, user: str) -> None:
    """Another's token is not there for an editor; an admin may revoke anybody's."""
    session = log_in(api, user)
    headers = {**cookie_of(session), "X-CSRF-Token": session.json()["csrf_token"]}
    stranger = api.as_(None)
    admins = api.good("POST", "/api/auth/tokens", {"name": "admin's"})
    stranger.bad(404, "DELETE", f"/api/auth/tokens/{admins['id']}", headers=headers)
    theirs = stranger.good("POST", "/api/auth/tokens", {"name": "theirs"}, headers=headers)
    assert [t["name"] for t in api.as_(theirs["token"]).get("/api/auth/tokens")] == ["theirs"]
    api.good("DELETE", f"/api/auth/tokens/{theirs['id']}")


def test_secrets_are_stored_hashed(api: Api, server: RunningServer, user: str) -> None:
    """Neither token, password, session nor login link can be read out of the database."""
    session = log_in(api, user)
    token = api.good("POST", "/api/auth/tokens", {"name": "x"})["token"]
    link = api.good("POST", f"/api/users/{user}/login-link")["path"].rpartition("/")[2]
    cookie = cookie_of(session)["Cookie"].partition("=")[2]
    with server.app.state.server.db.read() as tx:
        dump = "".join(str(tx.conn.execute(select(table)).all()) for table in metadata.sorted_tables)
    for secret in (token, PASSWORD, cookie, link):
        assert secret not in dump
    assert "$argon2id$" in dump


def test_a_session_works_like_a_token_and_needs_its_csrf_secret(api: Api, user: str) -> None:
    """Reading needs the cookie, changing needs the secret too; a foreign page has neither."""
    answer = log_in(api, user)
    assert answer.status == 200
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "samesite=lax" in cookie.lower()
    browser, session = api.as_(None), cookie_of(answer)
    assert browser.call("GET", "/api/auth/me", headers=session).json()["auth_source"] == "session"
    body = {"part_number": "C-" + uuid.uuid4().hex[:8], "name": "x"}
    for wrong in ({}, {"X-CSRF-Token": ""}, {"X-CSRF-Token": "guess"}):
        browser.bad(403, "POST", "/api/items", body, headers={**session, **wrong})
    secret = {"X-CSRF-Token": answer.json()["csrf_token"]}
    assert browser.call("POST", "/api/items", body, headers={**session, **secret}).status == 201
    assert browser.call("POST", "/api/auth/logout", headers={**session, **secret}).status == 204
    browser.bad(401, "GET", "/api/auth/me", headers=session)


def test_a_new_password_needs_the_old_one_and_its_length(api: Api, user: str) -> None:
    """Afterwards the old one is wrong."""
    answer = log_in(api, user)
    headers = {**cookie_of(answer), "X-CSRF-Token": answer.json()["csrf_token"]}
    browser = api.as_(None)
    for wrong in (
        {"password": "short", "current_password": PASSWORD},
        {"password": "another password"},
        {"password": "another password", "current_password": "a guess"},
    ):
        browser.bad(400, "PUT", "/api/auth/password", wrong, headers=headers)
    change = {"password": "another password", "current_password": PASSWORD}
    browser.good("PUT", "/api/auth/password", change, headers=headers)
    assert log_in(api, user).status == 401
    assert log_in(api, user, "another password").status == 200


def test_users(api: Api, user: str) -> None:
    """Made, changed, listed; names are unique whatever their case."""
    assert api.good("PUT", f"/api/users/{user}", {"role": "viewer"})["role"] == "viewer"
    assert user in [u["username"] for u in api.get("/api/users")]
    api.bad(409, "POST", "/api/users", {"username": user.upper()})
    api.bad(400, "POST", "/api/users", {"username": "bad name"})
    api.bad(400, "POST", "/api/users", {"username": "ok2", "password": "short"})
    api.bad(400, "POST", "/api/users", {"username": "ok3", "role": "king"})
    api.bad(404, "PUT", "/api/users/nobody", {"role": "viewer"})


def test_a_login_link_works_once(api: Api, user: str) -> None:
    """The link begins a session, once; afterwards it is worth nothing."""
    path = api.good("POST", f"/api/users/{user}/login-link")["path"]
    browser = api.as_(None)
    for _ in range(2):  # a mail scanner looks at it
        looked = browser.call("GET", path + "?next=/items/X/bom")
        assert looked.status == 200
        assert "set-cookie" not in looked.headers
        assert b'value="/items/X/bom"' in looked.body
    answer = browser.call("POST", path, body=b"next=/items/X/bom", headers=FORM)
    assert (answer.status, answer.headers["location"]) == (303, "/items/X/bom")
    me = browser.call("GET", "/api/auth/me", headers=cookie_of(answer)).json()
    assert me["username"] == user
    assert browser.call("POST", path).status == 401
    assert browser.call("POST", "/login/link/guess").status == 401
    assert browser.call("POST", path, headers={"Sec-Fetch-Site": "cross-site"}).status == 403


def test_a_login_leads_nowhere_else(api: Api, user: str) -> None:
    """``next`` is a path of this server or the start page."""
    for target in ("https://evil.example", "//evil.example", "/\\evil.example", "x"):
        path = api.good("POST", f"/api/users/{user}/login-link")["path"]
        body = f"next={quote(target, safe='')}".encode()
        answer = api.as_(None).call("POST", path, body=body, headers=FORM)
        assert answer.headers["location"] == "/"


@pytest.fixture(scope="module")
def strict(
    kind: str, databases: Databases, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[RunningServer]:
    """A server of its own, with a password for its admin."""
    url, tmp_path = databases.new(kind), tmp_path_factory.mktemp("strict")
    settings = Settings(database_url=url, admin_username="chief", admin_password=PASSWORD)
    with running_server(url, token="silo_strict", files_dir=tmp_path, settings=settings) as running:
        yield running


def test_the_last_admin_stays_one(strict: RunningServer) -> None:
    """Neither demoted nor locked out; one who is locked out may lose the role."""
    with Api(strict.base_url, "silo_strict") as api:
        api.good("POST", "/api/users", {"username": "second", "role": "admin"})
        api.good("PUT", "/api/users/second", {"active": False})
        assert api.good("PUT", "/api/users/second", {"role": "viewer"})["role"] == "viewer"
        for change in ({"role": "editor"}, {"active": False}):
            assert "last admin" in api.bad(409, "PUT", "/api/users/chief", change)["message"]


def test_logins_are_rate_limited(strict: RunningServer) -> None:
    """After five failures the name waits, even with the right password; Retry-After says for how long."""
    with Api(strict.base_url, "silo_strict") as api:
        assert log_in(api, "chief").status == 200
        for _ in range(5):
            assert log_in(api, "chief", "wrong").status == 401
        answer = log_in(api, "chief")
        assert answer.status == 429
        assert answer.json()["error"] == "too_many_attempts"
        assert 0 < int(answer.headers["retry-after"]) <= 300
        assert log_in(api, "another").status == 401
        actions = [(e["action"], e["username"]) for e in api.get("/api/admin/audit?limit=50")]
        assert actions.count(("login.failed", "chief")) == 5
        assert api.get("/api/auth/me")["username"] == "chief"


def test_an_unknown_name_is_reported_the_same(api: Api, user: str) -> None:
    """Nobody learns which names there are."""
    known, unknown = log_in(api, user, "wrong password"), log_in(api, "nobody-here", "wrong password")
    assert (known.status, known.body) == (unknown.status, unknown.body)


def test_the_audit_list_says_all_and_has_no_secrets(api: Api, user: str) -> None:
    """Who did what to whom; newest first, in pages."""
    token = api.good("POST", "/api/auth/tokens", {"name": "audited"})["token"]
    entries = api.get("/api/admin/audit?limit=2")
    assert [(e["action"], e["target"]) for e in entries] == [
        ("token.created", "audited"),
        ("user.created", user),
    ]
    assert entries[0]["address"] == "127.0.0.1"
    older = api.get(f"/api/admin/audit?limit=1&before={entries[0]['id']}")
    assert older[0]["id"] == entries[1]["id"]
    assert token not in str(api.get("/api/admin/audit"))


def test_read_only_mode(strict: RunningServer) -> None:
    """503 for every change, reading continues, the mode is reported and announced; then all is as before."""
    with Api(strict.base_url, "silo_strict") as api:
        parent, child = api.items(2)
        api.merge(parent, {child: 1})
        with api.events() as events:
            api.good("PUT", "/api/admin/mode", {"mode": "read-only"})
            assert events.next("server.state").data == {"mode": "read-only"}
        refused: list[tuple[str, str, Any]] = [
            ("POST", bom(parent, "merge"), merge_body({child: 2})),
            ("POST", "/api/items", {"part_number": "X", "name": "x"}),
            ("PUT", bom(parent, child), {"quantity": 2}),
            ("DELETE", bom(parent, child), None),
        ]
        for method, path, value in refused:
            answer = api.call(method, path, value)
            assert (answer.status, answer.json()["error"]) == (503, "read_only")
            assert answer.headers["retry-after"]
        assert api.quantities(parent) == {child: 1}
        assert api.merge(parent, {child: 2}, dry_run=True)["status"] == "merged"
        assert api.get("/health")["mode"] == "read-only"
        assert api.get("/ready")["mode"] == "read-only"
        api.good("PUT", "/api/admin/mode", {"mode": "normal"})
        api.merge(parent, {child: 2})
        assert api.quantities(parent) == {child: 2}
        api.bad(400, "PUT", "/api/admin/mode", {"mode": "odd"})


def test_a_server_started_read_only_stays_so(kind: str, databases: Databases, tmp_path: Path) -> None:
    """The setting wins over the switch."""
    url = databases.new(kind)
    settings = Settings(database_url=url, read_only=True)
    with (
        running_server(url, token="silo_ro", files_dir=tmp_path, settings=settings) as running,
        Api(running.base_url, "silo_ro") as api,
    ):
        assert api.good("PUT", "/api/admin/mode", {"mode": "normal"}) == {"mode": "read-only"}
        api.bad(503, "POST", "/api/items", {"part_number": "X", "name": "x"})
