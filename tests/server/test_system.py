# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an administrator sees of a server; what archiving and restoring say of other BOMs."""

from __future__ import annotations

import json
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote

import pytest
from server_testing import Api, bom, sqlite_database
from web_visitor import Visitor

from silo.bom.errors import ConfigError
from silo_server.backup import RESTORE_TRIED, back_up, try_restore
from silo_server.db.database import Database
from silo_server.db.state import get_state
from silo_server.open_secrets import open_secrets
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
        assert told["free_bytes"] > 0  # also before the first upload, which makes the folder
        assert (told["request"]["scheme"], told["request"]["address"]) == ("http", "127.0.0.1")
        assert (told["restore_tried"], told["secure_cookies"]) == (None, False)
        with server.app.state.server.large_reads.enter():
            assert api.get("/api/admin/system")["queues"]["exports and large reads"] == 1
        back_up(server.settings, tmp_path / "saved")
        told = api.get("/api/admin/system")
        assert (told["backup"]["target"], told["backup"]["same_disk"]) == (str(tmp_path / "saved"), True)
        made = try_restore(server.settings, tmp_path / "saved")
        tried = api.get("/api/admin/system")["restore_tried"]
        assert (tried["made_at"], tried["source"]) == (made.made_at, str(tmp_path / "saved"))
        assert api.get("/api/admin/system")["items"] == 1  # its own state stays


def test_a_test_restore_that_lacks_rows_is_no_success(db: Database, tmp_path: Path) -> None:
    """The manifest says how many there were; the server notes no day."""
    target = tmp_path / "saved"
    back_up(db.settings, target)
    manifest = json.loads((target / "manifest.json").read_text("utf-8"))
    manifest["rows"]["users"] += 1
    (target / "manifest.json").write_text(json.dumps(manifest), "utf-8")
    with pytest.raises(ConfigError, match=r"these differ: users$"):
        try_restore(db.settings, target)
    with db.read() as tx:
        assert get_state(tx, RESTORE_TRIED) is None
    assert sorted(path.name for path in tmp_path.iterdir() if path.name.startswith(".restore")) == []


def test_the_document_needs_a_login_if_the_site_says_so(tmp_path: Path) -> None:
    """Without the setting everybody reads it."""
    for wanted, status in ((False, 200), (True, 401)):
        url = sqlite_database(tmp_path / f"{status}.db")
        settings = Settings(database_url=url, openapi_login=wanted)
        with running_server(url, token=TOKEN, settings=settings) as server, Api(server.base_url) as api:
            assert api.call("GET", "/api/openapi.json").status == status
            assert "paths" in api.as_(TOKEN).get("/api/openapi.json")


@pytest.mark.usefixtures("needs_modes")
def test_secrets_that_lie_open_are_named(tmp_path: Path) -> None:
    """Of a password that can be guessed, a first password that is still set, and files that others read."""
    database = tmp_path / "silo.db"
    database.touch()
    mine = Settings(database_url=f"sqlite:///{database}", files_dir=tmp_path / "files")
    assert open_secrets(mine) == []
    assert open_secrets(replace(mine, admin_password="x")) == ["admin_password"]
    for password, found in (("password", True), ("silo", True), ("kT7rQm2wZx", False)):
        theirs = replace(mine, database_url=f"postgresql://silo:{password}@db/silo")
        assert open_secrets(theirs) == (["database_password"] if found else [])
    assert open_secrets(replace(mine, database_url="postgresql://silo@db/silo")) == []
    public = Path(tempfile.mkdtemp(dir="/tmp"))
    try:
        (public / "files").mkdir()
        for folder in (public, public / "files"):
            folder.chmod(0o755)
        assert open_secrets(replace(mine, files_dir=public / "files")) == [f"readable: {public / 'files'}"]
        public.chmod(0o750)
        assert open_secrets(replace(mine, files_dir=public / "files")) == []
    finally:
        shutil.rmtree(public)


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
