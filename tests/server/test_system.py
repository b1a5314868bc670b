# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an administrator sees of a server; what archiving and restoring say of other BOMs."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote

import pytest
from server_testing import Api, bom
from web_visitor import Visitor

from silo_server.backup import back_up
from silo_server.run import RunningServer, running_server
from silo_server.settings import Settings

TOKEN = "silo_system_0123456789"


def test_the_api_says_how_the_server_is(url: str, tmp_path: Path) -> None:
    """Warnings of the start, the database, the last backup, queues, counts; on both databases."""
    settings = Settings(database_url=url, warnings=("SILO_PUBLIC_URL is not set.",))
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path / "files", settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        api.item()
        told = api.get("/api/admin/system")
        assert told["backup"] is None
        assert (told["items"], told["users"]) == (1, 1)
        assert told["queues"]["exports and large reads"] == 0
        assert told["warnings"] == ["SILO_PUBLIC_URL is not set."]
        assert told["database_bytes"] > 0
        assert told["free_bytes"] is None  # the first upload makes the folder
        with server.app.state.server.large_reads.enter():
            assert api.get("/api/admin/system")["queues"]["exports and large reads"] == 1
        back_up(server.settings, tmp_path / "saved")
        assert api.get("/api/admin/system")["backup"]["target"] == str(tmp_path / "saved")


def test_the_page_says_what_is_wrong(visitors: dict[str, Visitor]) -> None:
    """It stands on top, and what to do."""
    text = visitors["admin"].get("/system").body.decode()
    assert ("No backup was made yet" in text, "schema" in text) == (True, True)


def test_archiving_says_where_the_part_is_used(api: Api) -> None:
    """The answer's headers name the BOMs; the answer stays without a body, as the contract has it."""
    top, other, part, unused = *api.items(2), api.item("Ü 7, b"), api.item()
    api.merge(top, {part: 1})
    api.merge(other, {part: 2})
    answer = api.call("DELETE", f"/api/items/{quote(part)}")
    assert (answer.status, answer.body, answer.headers["x-total-count"]) == (204, b"", "2")
    assert set(answer.headers["x-used-in"].split(",")) == {top, other}
    alone = api.call("DELETE", f"/api/items/{unused}")
    assert (alone.headers["x-total-count"], alone.headers["x-used-in"]) == ("0", "")


@pytest.fixture
def lost(api: Api) -> tuple[str, str, int]:
    """A BOM that lost a part, the part, which is archived by now, and the change before."""
    top, part, other = api.items(3)
    api.merge(top, {part: 1, other: 1})
    change = api.get(bom(top, "history"))[0]["id"]
    api.merge(top, {other: 1})
    api.good("POST", bom(top, "resolve"), {"decisions": [{"child_part_number": part, "action": "remove"}]})
    api.call("DELETE", f"/api/items/{part}")
    return top, part, change


def test_a_restore_with_an_archived_part_asks(api: Api, lost: tuple[str, str, int]) -> None:
    """409 with its number, and nothing is changed; with the yes the line is back."""
    top, part, change = lost
    asked = api.call("POST", bom(top, "restore"), {"change_id": change})
    assert asked.status == 409
    assert f"archived parts would come back ({part})" in asked.json()["message"]
    assert len(api.get(bom(top))) == 1
    api.good("POST", bom(top, "restore"), {"change_id": change, "with_archived": True})
    assert {line["child_part_number"]: line["child_archived"] for line in api.get(bom(top))}[part] is True


def test_the_page_of_a_restore_asks_too(
    api: Api, server: RunningServer, lost: tuple[str, str, int], visitors: dict[str, Visitor]
) -> None:
    """The same form again, with a box to tick."""
    top, part, change = lost
    visitor = visitors["editor"]
    asked = visitor.post(f"/items/{top}/restore", change_id=str(change), reason="back")
    page = asked.body.decode()
    assert (asked.status, f"archived parts would come back ({part})" in page) == (409, True)
    assert 'name="with_archived"' in page
    assert 'value="back"' in page
    done = visitor.post(f"/items/{top}/restore", change_id=str(change), with_archived="1")
    assert done.status == 303
    assert len(api.get(bom(top))) == 2
