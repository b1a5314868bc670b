# SPDX-License-Identifier: LGPL-2.1-or-later
"""The life of a credential: what each kind may create, and what ends each kind."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hunting import BOTH
from server_testing import Answer, Api, Databases

from silo_server.run import running_server


@pytest.fixture(scope="module")
def own(kind: str, databases: Databases, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Api]:
    """A server of its own: with more than one admin, others could not test the last one."""
    folder, token = tmp_path_factory.mktemp("credentials"), "silo_credentials"
    with (
        running_server(databases.new(kind), token=token, files_dir=folder) as server,
        Api(server.base_url, token) as caller,
    ):
        yield caller


@pytest.fixture
def api(own: Api) -> Api:
    """The first admin of that server."""
    return own


PASSWORD, OTHER = "correct horse battery", "another long password"


class Caller:
    """Somebody with a credential: an admin with a token, or a session that a password or a link began."""

    def __init__(self, api: Api, name: str, token: str | None = None, session: Answer | None = None) -> None:
        self.api, self.name = api.as_(token), name
        self.headers: dict[str, str] = {}
        if session is not None:
            self.headers["Cookie"] = session.headers["set-cookie"].split(";")[0]
            page = self.api.call("GET", "/account", headers=self.headers).body.decode()
            self.headers["X-CSRF-Token"] = page.partition('name="csrf_token" value="')[2].partition('"')[0]

    def call(self, method: str, path: str, value: Any = None) -> int:
        return self.api.call(method, path, value, headers=self.headers).status

    @property
    def works(self) -> bool:
        return self.call("GET", "/api/auth/me") == 200


def user(api: Api, role: str = "admin") -> str:
    """A user with a password."""
    name = "u" + uuid.uuid4().hex[:8]
    api.good("POST", "/api/users", {"username": name, "role": role, "password": PASSWORD})
    return name


def by_password(api: Api, name: str, password: str = PASSWORD) -> Caller:
    answer = api.as_(None).call("POST", "/api/auth/login", {"username": name, "password": password})
    return Caller(api, name, session=answer)


def link_of(api: Api, name: str) -> str:
    return str(api.good("POST", f"/api/users/{name}/login-link")["path"])


def by_link(api: Api, name: str) -> Caller:
    return Caller(api, name, session=api.as_(None).call("POST", link_of(api, name)))


def by_token(api: Api, name: str, days: float | None = None) -> Caller:
    session = by_password(api, name)
    said = {"name": "t", "expires_in_days": days}
    made = session.api.good("POST", "/api/auth/tokens", said, headers=session.headers)
    return Caller(api, name, made["token"])


KINDS: dict[str, Callable[[Api, str], Caller]] = {
    "session": by_password,
    "login link": by_link,
    "token": by_token,
    "token that ends": lambda api, name: by_token(api, name, 1),
}
ALL, BY_BROWSER = set(KINDS), {"session", "login link"}
LASTING = BY_BROWSER | {"token"}
# What is asked for, and which kinds may have it; OWN is the caller, OTHER another admin, NEW nobody yet.
MAY: dict[str, tuple[str, str, dict[str, Any], set[str]]] = {
    "a token without end": ("POST", "/api/auth/tokens", {"name": "x", "expires_in_days": None}, LASTING),
    "a token that ends": ("POST", "/api/auth/tokens", {"name": "x", "expires_in_days": 0.5}, ALL),
    "a user without a password": ("POST", "/api/users", {"username": "NEW", "role": "admin"}, ALL),
    "a user with one": ("POST", "/api/users", {"username": "NEW", "password": OTHER}, LASTING),
    "another's password": ("PUT", "/api/users/OTHER", {"password": OTHER}, LASTING),
    "another's login link": ("POST", "/api/users/OTHER/login-link", {}, LASTING),
    "the own login link": ("POST", "/api/users/OWN/login-link", {}, set()),
    "the own password as an admin": ("PUT", "/api/users/OWN", {"password": OTHER}, BY_BROWSER),
    "the own password": (
        "PUT",
        "/api/auth/password",
        {"password": OTHER, "current_password": PASSWORD},
        BY_BROWSER,
    ),
    "the own password without the old one": (
        "PUT",
        "/api/auth/password",
        {"password": OTHER},
        {"login link"},
    ),
    "a higher role": ("PUT", "/api/users/VIEWER", {"role": "editor"}, LASTING),
    "a lower role": ("PUT", "/api/users/OTHER", {"role": "viewer"}, ALL),
    "a way out": ("PUT", "/api/users/OTHER", {"active": False}, ALL),
    "a way back in": ("PUT", "/api/users/LOCKED", {"active": True}, LASTING),
    "the right to approve": ("PUT", "/api/users/OTHER", {"approver": True}, LASTING),
    "the name of the server's token": ("POST", "/api/auth/tokens", {"name": "SILO_API_TOKEN"}, set()),
}


@pytest.mark.parametrize("credential", KINDS)
def test_what_a_credential_may_create(api: Api, credential: str) -> None:
    """What ends makes nothing that lasts longer, and nobody sets the own password without the old one."""
    for what, (method, path, said, kinds) in MAY.items():
        caller = KINDS[credential](api, user(api))
        assert caller.works  # a second request of the session
        names = {"OWN": caller.name, "NEW": "n" + uuid.uuid4().hex[:8]}
        for other, role in (("OTHER", "admin"), ("VIEWER", "viewer"), ("LOCKED", "admin")):
            if other in path:
                names[other] = user(api, role)
        if "LOCKED" in names:
            api.good("PUT", f"/api/users/{names['LOCKED']}", {"active": False})
        path = "/".join(names.get(part, part) for part in path.split("/"))
        status = caller.call(method, path, {key: names.get(str(value), value) for key, value in said.items()})
        assert (status < 300) == (credential in kinds), (what, status)
        assert status in (200, 201, 204, 400, 403), what


EVENTS: dict[str, tuple[Callable[[Api, str], Any], set[str]]] = {
    "a new password": (
        lambda api, name: api.good("PUT", f"/api/users/{name}", {"password": OTHER}),
        {"session", "login link's session", "login link", "password"},
    ),
    "an own new password": (
        lambda api, name: by_password(api, name).call(
            "PUT", "/api/auth/password", {"password": OTHER, "current_password": PASSWORD}
        ),
        {"session", "login link's session", "login link", "password"},
    ),
    "another role": (
        lambda api, name: api.good("PUT", f"/api/users/{name}", {"role": "editor"}),
        {"login link"},
    ),
    "the same role": (lambda api, name: api.good("PUT", f"/api/users/{name}", {"role": "admin"}), set()),
    "another name": (lambda api, name: api.good("PUT", f"/api/users/{name}", {"display_name": "x"}), set()),
    "a lock-out": (
        lambda api, name: api.good("PUT", f"/api/users/{name}", {"active": False}),
        {"session", "login link's session", "login link", "password", "token", "token that ends"},
    ),
    "a lock-out that is taken back": (
        lambda api, name: [
            api.good("PUT", f"/api/users/{name}", {"active": active}) for active in (False, True)
        ],
        {"session", "login link's session", "login link", "token", "token that ends"},
    ),
}


@BOTH
@pytest.mark.parametrize("event", EVENTS)
def test_what_ends_a_credential(api: Api, event: str) -> None:
    """Each kind, before and after."""
    name = user(api)
    known = {
        "login link's session": by_link(api, name),
        "session": by_password(api, name),
        "token": by_token(api, name),
        "token that ends": by_token(api, name, 1),
    }
    link = link_of(api, name)
    assert all(caller.works for caller in known.values())
    happen, ends = EVENTS[event]
    happen(api, name)
    works = {kind for kind, caller in known.items() if caller.works}
    if api.as_(None).call("POST", link).status == 303:
        works.add("login link")
    if api.as_(None).call("POST", "/api/auth/login", {"username": name, "password": PASSWORD}).status == 200:
        works.add("password")
    assert works == {*known, "login link", "password"} - ends
