# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a token may do beyond its user's role: its scope, its end, and the account that it belongs to."""

from __future__ import annotations

import json
import threading
import uuid
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
from hunting import BOTH
from server_testing import Answer, Api, Databases, bom
from web_visitor import enter

from silo.bom.errors import ConflictError
from silo_server.actors import SYSTEM, Role
from silo_server.db.database import Database
from silo_server.run import Greeting, RunningServer, prepare, running_server
from silo_server.services.access.tokens import shown_prefix
from silo_server.services.access.users import change_user, create_user, get_user, list_users
from silo_server.settings import Settings

pytestmark = BOTH


def token(api: Api, **values: Any) -> Any:
    """A new token of the caller's."""
    return api.good("POST", "/api/auth/tokens", {"name": "t" + uuid.uuid4().hex[:6], **values})


def test_a_token_that_ends_makes_none_that_lives_longer(api: Api) -> None:
    """Neither an eternal one, nor one with a later end; if none is named, the ends are the same."""
    short = token(api, expires_in_days=1)
    mine = api.as_(short["token"])
    for days in (None, 2, 3650):
        mine.bad(403, "POST", "/api/auth/tokens", {"name": "longer", "expires_in_days": days})
    assert token(mine)["expires_at"] == short["expires_at"]
    assert token(mine, expires_in_days=0.5)["expires_at"] < short["expires_at"]


@pytest.mark.parametrize(
    ("scopes", "reads", "writes", "rules"),
    [
        (["read"], 200, 403, 403),
        (["write"], 200, 201, 403),
        (["admin"], 200, 201, 200),
        (["admin", "read"], 200, 201, 200),
    ],
)
def test_a_token_goes_as_far_as_its_scope(
    api: Api, scopes: list[str], reads: int, writes: int, rules: int
) -> None:
    """And it makes none that goes further."""
    made = token(api, scopes=scopes)
    assert made["scopes"] == ["read", "write", "admin"][: len(made["scopes"])]
    assert set(scopes) <= set(made["scopes"])
    mine = api.as_(made["token"])
    assert mine.call("GET", "/api/items").status == reads
    assert mine.call("POST", "/api/items", {"part_number": "S-" + uuid.uuid4().hex[:8]}).status == writes
    assert mine.call("GET", "/api/users").status == rules
    further = {"name": "further", "scopes": ["admin"]}
    assert (mine.call("POST", "/api/auth/tokens", further).status == 201) == ("admin" in scopes)
    assert set(api.get("/api/auth/tokens")[0]["scopes"]) <= {"read", "write", "admin"}


def test_a_token_that_may_only_read_changes_nothing_at_all(api: Api) -> None:
    """Not its own tokens either; looking many items up is reading."""
    made = token(api, scopes=["read"])
    mine = api.as_(made["token"])
    assert mine.call("POST", "/api/items/by-uuid", {"uuids": []}).status == 200
    mine.bad(403, "POST", "/api/auth/tokens", {"name": "x"})
    mine.bad(403, "DELETE", f"/api/auth/tokens/{made['id']}")
    parent, child = api.items(2)
    mine.bad(403, "POST", bom(parent), {"child_part_number": child})
    assert mine.get("/api/auth/me")["role"] == "viewer"


def test_a_token_makes_one_of_its_own_scope_unless_asked_for_less(api: Api) -> None:
    """Never a wider one, also where the request does not name a scope."""
    writer = api.as_(token(api, scopes=["write"])["token"])
    same = api.as_(token(writer)["token"])
    same.bad(403, "GET", "/api/users")
    same.item()
    api.as_(token(writer, scopes=["read"])["token"]).bad(403, "POST", "/api/items", {"category": "F01"})


def test_a_limit_that_is_misspelt_or_unknown_makes_no_token(api: Api) -> None:
    """It would be one without that limit."""
    limits = [{"scope": "read"}, {"days": 1}, {"expires": 1}]
    for limit in [*limits, *({"scopes": scopes} for scopes in ([], ["king"], ["read", 1], "read"))]:
        api.bad(400, "POST", "/api/auth/tokens", {"name": "limited", **limit})
    assert "limited" not in [one["name"] for one in api.get("/api/auth/tokens")]


def test_the_first_characters_of_a_short_secret_are_not_most_of_it(api: Api, server: RunningServer) -> None:
    """A secret that somebody chose is not shown by its prefix, nor when the server starts."""
    given = next(t for t in api.get("/api/auth/tokens") if t["name"] == "SILO_API_TOKEN")
    assert len(given["prefix"]) <= len(server.token) // 4
    assert [shown_prefix(secret) for secret in ("letmein", "a-longer-one", "x" * 80)] == ["l", "a-l", "x" * 9]
    assert server.token not in "".join(Greeting("u", given["prefix"], "l", "d", False).lines())


def test_links_are_built_from_the_configured_address(api: Api, server: RunningServer) -> None:
    """Whatever the Host header says."""
    api.call("POST", "/api/users", {"username": "linked"})
    made = api.good("POST", "/api/users/linked/login-link", headers={"Host": "evil.example"})
    assert made["url"] == f"{server.base_url}{made['path']}"


def test_two_admins_who_demote_each_other_leave_one(kind: str, databases: Databases, tmp_path: Path) -> None:
    """Both begin at the same moment; one of them learns that the other is the last."""
    db = Database(Settings(database_url=databases.new(kind), files_dir=tmp_path))
    prepare(db)
    for number in range(4):
        with db.write() as tx:
            change_user(tx, "admin", role=Role.ADMIN)
            if number == 0:
                create_user(tx, "other", Role.ADMIN)
            change_user(tx, "other", role=Role.ADMIN)
        gate, refused = threading.Barrier(2), []

        def demote(name: str, gate: threading.Barrier = gate, refused: list[str] = refused) -> None:
            with db.write(SYSTEM) as tx:
                # On PostgreSQL both are inside here at once; SQLite lets one in after the other.
                if tx.postgres:
                    gate.wait(60)
                try:
                    change_user(tx, name, role=Role.VIEWER)
                except ConflictError:
                    refused.append(name)

        threads = [threading.Thread(target=demote, args=(name,)) for name in ("admin", "other")]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
        with db.read() as tx:
            admins = [user for user in list_users(tx) if user.role is Role.ADMIN]
        assert len(admins) == len(refused) == 1
    db.close()


def test_a_server_without_an_admin_starts_and_can_be_got_back(
    kind: str, databases: Databases, tmp_path: Path
) -> None:
    """It serves those who have tokens, says what to do, and ``--reset-admin`` lets somebody in."""
    url = databases.new(kind)
    settings = Settings(database_url=url, files_dir=tmp_path)
    db = Database(settings)
    prepare(db)
    with db.write() as tx:
        from silo_server.db.tables import users

        tx.conn.execute(users.update().values(role="viewer"))
    locked_out = prepare(db, "silo_of_nobody")
    assert (locked_out.username, locked_out.token, locked_out.login_secret) == (None, None, None)
    assert "--reset-admin" in Greeting("u", None, None, "d", False).lines()[-1]
    with running_server(url, files_dir=tmp_path) as running, Api(running.base_url) as nobody:
        assert nobody.call("GET", "/ready").status == 200
    for name in ("Admin", "new-boss"):
        back = prepare(db, reset_admin=name)
        assert back.username is not None
        assert back.username.casefold() == name.casefold()
        with db.read() as tx:
            user = get_user(tx, name)
        assert (user.role, user.active) == (Role.ADMIN, True)
        assert back.token
        assert back.login_secret
    db.close()


def test_a_form_sent_twice_makes_one_token(api: Api) -> None:
    """Also at once; the secret is that of the one token. Another form makes another, and nothing makes an
    eternal one by accident."""
    admin = enter(api, "admin")

    def make(key: str, name: str = "laptop", days: str = "30") -> Answer:
        return admin.post("/account/tokens", key=key, name=name, days=days, scope="read")

    def tokens() -> list[str]:
        return [one["name"] for one in api.get("/api/auth/tokens") if one["name"] in ("laptop", "phone")]

    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(lambda _: make("k1"), range(4)))
    assert {answer.status for answer in answers} == {303}
    shown = {answer.headers["set-cookie"].partition(";")[0] for answer in answers}
    assert len(shown) == 1
    assert tokens() == ["laptop"]
    name, secret = json.loads(unquote(shown.pop().partition("=")[2]))
    assert name == "laptop"
    assert api.as_(secret).get("/api/auth/me")["username"] == "admin"
    make("k1", "phone")
    make("k2")
    assert sorted(tokens()) == ["laptop", "laptop", "phone"]
    assert make("k3", days="abc").status == 400
    assert len(tokens()) == 3
