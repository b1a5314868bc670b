# SPDX-License-Identifier: LGPL-2.1-or-later
"""Somebody at the web pages, without a browser: a session, its form secret, and what a browser would send."""

from __future__ import annotations

import re
from dataclasses import dataclass
from urllib.parse import urlencode
from uuid import uuid4

from server_testing import Answer, Api

HTML = {"Accept": "text/html,application/xhtml+xml"}
FORM = {"Content-Type": "application/x-www-form-urlencoded"}
ROLES = ("viewer", "editor", "admin")


@dataclass(frozen=True)
class Visitor:
    """Somebody with a session: the cookie, and the secret for forms."""

    api: Api
    cookie: str
    csrf: str

    def get(self, path: str, **headers: str) -> Answer:
        """A page."""
        return self.api.call("GET", path, headers={"Cookie": self.cookie, **HTML, **headers})

    def post(self, path: str, *, csrf: str | None = None, **fields: str | list[str]) -> Answer:
        """A form, with the secret unless another is given; a list is a field that stands there often."""
        sent = urlencode({"csrf_token": self.csrf if csrf is None else csrf, **fields}, doseq=True).encode()
        return self.api.call("POST", path, body=sent, headers={"Cookie": self.cookie, **HTML, **FORM})

    @property
    def username(self) -> str:
        """Whose session it is."""
        return str(self.get("/api/auth/me").json()["username"])


SECOND_ADMIN = "second-admin"


def link_of(api: Api, username: str) -> str:
    """The path of a login link. Nobody makes one for the own account, so a second admin does."""
    where = f"/api/users/{username}/login-link"
    if api.get("/api/auth/me")["username"] != username:
        return str(api.good("POST", where)["path"])
    second = {"username": SECOND_ADMIN, "role": "admin"}
    assert api.call("POST", "/api/users", second).status in (201, 409)
    visitor = enter(api, second["username"])
    headers = {"Cookie": visitor.cookie, "X-CSRF-Token": visitor.csrf}
    return str(visitor.api.good("POST", where, headers=headers)["path"])


def enter(api: Api, username: str) -> Visitor:
    """A new session by a login link."""
    browser = api.as_(None)
    path = link_of(api, username)
    cookie = browser.call("POST", path).headers["set-cookie"].split(";")[0]
    page = browser.call("GET", "/account", headers={"Cookie": cookie}).body.decode()
    found = re.search(r'name="csrf_token" value="([^"]+)"', page)
    assert found is not None
    return Visitor(browser, cookie, found[1])


def newcomer(api: Api, role: str) -> Visitor:
    """A session of a new user, of whom no other test knows."""
    username = f"{role}-{uuid4().hex[:8]}"
    api.good("POST", "/api/users", {"username": username, "role": role})
    return enter(api, username)


def visitors_of(api: Api) -> dict[str, Visitor]:
    """A session per role."""
    for role in ROLES[:2]:
        api.good("POST", "/api/users", {"username": role, "role": role})
    return {role: enter(api, role) for role in ROLES}
