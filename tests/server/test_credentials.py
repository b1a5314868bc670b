# SPDX-License-Identifier: LGPL-2.1-or-later
"""Credentials are a tree: what a leaked one made ends with it, and nobody else's does."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from server_testing import Api
from web_visitor import FORM, HTML, Visitor, enter, link_of

from silo_server.db.database import Database
from silo_server.db.tables import api_tokens
from silo_server.run import RunningServer, prepare, running_server
from silo_server.services.access.tokens import create_token, list_tokens
from silo_server.settings import Settings

FIRST, SECOND = "silo_first_0123456789abcdef", "silo_second_0123456789abcdef"


@pytest.fixture(name="server")
def _server(url: str, tmp_path: Path) -> Iterator[RunningServer]:
    with running_server(url, token=FIRST, files_dir=tmp_path) as running:
        yield running


@pytest.fixture(name="api")
def _api(server: RunningServer) -> Iterator[Api]:
    with Api(server.base_url, FIRST) as caller:
        yield caller


def child(of: Api, name: str) -> Api:
    """A token that this caller makes."""
    return of.as_(of.good("POST", "/api/auth/tokens", {"name": name})["token"])


def lets_in(caller: Api) -> bool:
    return caller.call("GET", "/api/auth/me").status == 200


def id_of(caller: Api, name: str) -> int:
    return next(token["id"] for token in caller.get("/api/auth/tokens") if token["name"] == name)


def test_a_leaked_token_ends_all_below_it(api: Api) -> None:
    """Tokens of tokens, a link and the session that it began, and the token made in that session."""
    leaked, other = child(api, "leaked"), child(api, "other")
    below = child(child(leaked, "second"), "third")
    beside = child(other, "beside")
    leaked.good("POST", "/api/users", {"username": "anna", "role": "editor"})
    session = enter(leaked, "anna")
    headers = {"Cookie": session.cookie, "X-CSRF-Token": session.csrf}
    made = api.as_(None).call("POST", "/api/auth/tokens", {"name": "in the session"}, headers=headers)
    of_anna = api.as_(made.json()["token"])
    unused = link_of(leaked, "anna")
    assert all(map(lets_in, (leaked, below, of_anna)))
    refused = api.bad(409, "DELETE", f"/api/auth/tokens/{id_of(api, 'leaked')}")
    for name in ("second", "third", "in the session", "session", "link"):
        assert name in refused["message"]
    assert "beside" not in refused["message"]
    assert lets_in(leaked)
    api.good("DELETE", f"/api/auth/tokens/{id_of(api, 'leaked')}?children=end")
    assert not any(map(lets_in, (leaked, below, of_anna)))
    assert api.as_(None).call("GET", "/api/auth/me", headers={"Cookie": session.cookie}).status == 401
    assert api.as_(None).call("POST", unused).status == 401
    assert all(map(lets_in, (api, other, beside)))


def test_an_ordinary_deletion_keeps_what_is_below_if_asked_so(api: Api) -> None:
    parent = child(api, "parent")
    kept = child(parent, "kept")
    api.good("DELETE", f"/api/auth/tokens/{id_of(api, 'parent')}?children=keep")
    assert (lets_in(parent), lets_in(kept)) == (False, True)
    # A token without children asks nothing, and an ended child is none.
    api.good("DELETE", f"/api/auth/tokens/{id_of(api, 'kept')}")
    last = child(api, "last")
    child(last, "ended")
    api.good("DELETE", f"/api/auth/tokens/{id_of(api, 'ended')}")
    api.good("DELETE", f"/api/auth/tokens/{id_of(api, 'last')}")


def test_the_list_names_what_made_a_token(api: Api) -> None:
    child(child(api, "parent"), "child")
    parents = {token["name"]: token["parent"] for token in api.get("/api/auth/tokens")}
    assert parents["SILO_API_TOKEN"] is None
    assert (parents["child"]["name"], parents["child"]["kind"]) == ("parent", "token")
    assert parents["parent"]["name"] == "SILO_API_TOKEN"


def test_rotating_the_configured_token_ends_what_was_made_with_it(url: str, tmp_path: Path) -> None:
    settings = Settings(database_url=url, files_dir=tmp_path)
    with running_server(url, token=FIRST, settings=settings) as running, Api(running.base_url, FIRST) as api:
        made = child(child(api, "a"), "b").token
        user = enter(api, "admin").cookie
    with (
        running_server(url, token=SECOND, settings=settings) as running,
        Api(running.base_url, SECOND) as api,
    ):
        assert lets_in(api)
        assert not lets_in(api.as_(made))
        assert not lets_in(api.as_(FIRST))
        assert api.as_(None).call("GET", "/api/auth/me", headers={"Cookie": user}).status == 401


def test_logging_out_everywhere_ends_sessions_and_what_they_made_for_one_user(api: Api) -> None:
    """Also what a session made that is over; another user, and a token from elsewhere, stay."""
    for name in ("anna", "bert"):
        api.good("POST", "/api/users", {"username": name, "role": "editor"})
    first, second, other = enter(api, "anna"), enter(api, "anna"), enter(api, "bert")
    tokens = []
    for each in (first, second, other):
        headers = {"Cookie": each.cookie, "X-CSRF-Token": each.csrf}
        made = api.as_(None).call("POST", "/api/auth/tokens", {"name": "mine"}, headers=headers)
        tokens.append(api.as_(made.json()["token"]))
    first.post("/logout")
    assert all(map(lets_in, tokens))
    answer = second.post("/account/logout-everywhere")
    assert (answer.status, answer.headers["location"].partition("?")[0]) == (303, "/login")
    assert [lets_in(token) for token in tokens] == [False, False, True]
    for each, status in ((second, 401), (other, 200)):
        assert api.as_(None).call("GET", "/api/auth/me", headers={"Cookie": each.cookie}).status == status


def test_the_page_shows_what_is_below_and_asks(api: Api) -> None:
    visitor: Visitor = enter(api, "admin")
    kept = child(child(api, "parent"), "the child")
    where = f"/account/tokens/{id_of(api, 'parent')}/revoke"
    asked = visitor.post(where, **{"from": "account"})
    assert "the child" in asked.body.decode()
    assert lets_in(kept)
    visitor.post(where, **{"from": "account", "children": "end"})
    assert not lets_in(kept)
    page = visitor.api.call("GET", "/account", headers={"Cookie": visitor.cookie, **HTML, **FORM})
    assert "Made by" in page.body.decode()


def test_what_an_older_version_made_is_listed_as_such(db: Database) -> None:
    prepare(db, FIRST)
    with db.write() as tx:
        tx.conn.execute(api_tokens.metadata.tables["credentials"].update().values(known=False))
    with db.read() as tx:
        assert all(token.parent is not None and not token.parent.known for token in list_tokens(tx))
    with db.write() as tx:
        assert create_token(tx, 1, "new")[0].parent is None
