# SPDX-License-Identifier: LGPL-2.1-or-later
"""Backup and restore: everything comes back, from and to both databases, also while the server serves."""

from __future__ import annotations

import json
import math
import os
import shutil
import threading
from pathlib import Path
from typing import Any

import pytest
from hunting import over
from model_file import model_file
from server_testing import Api, Databases, bom, form_body, wait_until
from sqlalchemy import text

from silo.bom.errors import ConfigError
from silo.cli.main import main
from silo_server import backup
from silo_server.db.database import Database
from silo_server.db.tables import metadata
from silo_server.run import running_server
from silo_server.services.file_store import FileStore
from silo_server.settings import Settings

TOKEN = "silo_backup"
VOLATILE = {"server_state", "events", "audit", "login_links", "login_attempts", "api_tokens", "sessions"}


def fill(api: Api) -> str:
    """A released BOM with history, an upload, and names of all kinds; returns the assembly."""
    parent, *children = api.items(
        5, description="Größe ½ 'quoted' \u202e", properties={"a": [1, {"b": None}]}
    )
    api.merge(parent, {child: n + 0.5 for n, child in enumerate(children)}, sync_id="one")
    api.merge(parent, {child: n + 1 for n, child in enumerate(children[1:])}, sync_id="two")
    api.good("PUT", bom(parent, children[1]), {"quantity": 7, "notes": "by hand"})
    upload(api, parent, b"first")
    offer = {"supplier": "Bolt", "prices": [{"price": "0.10"}], "currency": "USD"}
    api.good("PUT", f"/api/items/{children[0]}/suppliers", {"supplier_parts": [offer]})
    ordered = {"part_number": children[0], "quantity": "2.50", "price": "0.10", "currency": "USD"}
    api.good("POST", f"/api/items/{parent}/orders", {"parts": [ordered]})
    api.good("PUT", "/api/rates", {"currency": "EUR", "rates": {"USD": "0.9"}})
    api.good("PUT", "/api/users/admin", {"approver": True})
    api.good("POST", f"/api/items/{parent}/releases", {"with_parts": True})
    api.good("POST", f"/api/items/{parent}/releases/A/approval", {"override": "a trial"})
    return parent


# The file of several parts; the backup has its rows and its content.
BOTH = "0b1e7a52-6c1f-4d0c-9d57-2f1c1b6a9e10"


def send_document(api: Api, holds: str, content: bytes) -> None:
    """Upload a file that is no item's own."""
    held = [{"item": api.get(f"/api/items/{holds}")["id"], "object": "Part1"}]
    both = ("both.FCStd", model_file(content))
    fields = {"file": both, "path": "parts/both.FCStd", "items": json.dumps(held)}
    body, headers = form_body(fields)
    answer = api.call("POST", f"/api/documents/{BOTH}/file", body=body, headers=headers)
    assert answer.status == 201, answer.body


def upload(api: Api, item: str, content: bytes) -> None:
    """Upload a file as a new revision."""
    body, headers = form_body({"file": ("part.FCStd", model_file(content)), "comment": "c"})
    answer = api.call("POST", f"/api/items/{item}/file", body=body, headers=headers)
    assert answer.status == 201, answer.body


def tables(url: str, files: Path) -> dict[str, list[tuple[Any, ...]]]:
    """Every row of every table."""
    db = Database(Settings(database_url=url, files_dir=files))
    with db.read() as tx:
        found = {
            name: sorted((tuple(row) for row in tx.conn.execute(table.select())), key=repr)
            for name, table in metadata.tables.items()
        }
    db.close()
    return found


@pytest.mark.postgres
@pytest.mark.parametrize("kind", ["sqlite", "postgres"], ids="{0} and postgres".format, indirect=True)
def test_what_was_saved_comes_back_on_the_other_database(
    kind: str, url: str, databases: Databases, tmp_path: Path
) -> None:
    """Every row of every table and every file, while the first server still runs; the second server works."""
    settings = Settings(database_url=url, files_dir=tmp_path / "files")
    with (
        running_server(url, token=TOKEN, settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        parent = fill(api)
        send_document(api, parent, b"of two parts")
        backup.back_up(settings, tmp_path / "saved")
        lines, history = api.get(bom(parent)), api.get(bom(parent, "history"))
        rates, frozen = api.get("/api/rates"), api.get(f"/api/items/{parent}/releases/A")
        before = tables(url, tmp_path)
    assert backup.verify(tmp_path / "saved").missing_files == []
    other = databases.empty("sqlite" if kind == "postgres" else "postgres")
    backup.restore(Settings(database_url=other, files_dir=tmp_path / "other"), tmp_path / "saved")
    after = tables(other, tmp_path)
    assert {n: after[n] for n in after if n not in VOLATILE} == {
        n: before[n] for n in before if n not in VOLATILE
    }
    with (
        running_server(other, token=TOKEN, files_dir=tmp_path / "other") as server,
        Api(server.base_url, TOKEN) as api,
    ):
        assert api.get(bom(parent)) == lines
        assert api.get(bom(parent, "history")) == history
        assert api.get("/api/rates") == rates
        assert api.get(f"/api/items/{parent}/releases/A") == frozen
        assert api.call("GET", f"/api/items/{parent}/file").body == model_file(b"first")
        assert api.call("GET", f"/api/documents/{BOTH}/file").body == model_file(b"of two parts")
        told = api.get(f"/api/documents/{BOTH}")
        assert (told["file_path"], [one["part_number"] for one in told["holds"]]) == (
            "parts/both.FCStd",
            [parent],
        )
        assert api.get(f"/api/items?search={parent}")[0]["part_number"] == parent
        # Ids count on where they were, so that a new change follows the old ones.
        api.merge(parent, {})
        assert api.get(bom(parent, "history"))[0]["id"] > history[0]["id"]


@over("sqlite")
def test_a_restore_lets_nobody_in_who_was_sent_away(url: str, databases: Databases, tmp_path: Path) -> None:
    """Tokens that were revoked and users who were locked out since stay so; sessions and links are over.

    A new database cannot know them: there it says so.
    """
    settings = Settings(database_url=url, files_dir=tmp_path / "files")
    with (
        running_server(url, token=TOKEN, settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        api.good(
            "POST", "/api/users", {"username": "ann", "role": "editor", "password": "a long pass phrase"}
        )
        login = {"username": "ann", "password": "a long pass phrase"}
        session = api.as_(None).call("POST", "/api/auth/login", login)
        headers = {"Cookie": session.headers["set-cookie"].split(";")[0]}
        link = api.good("POST", "/api/users/ann/login-link")["path"]
        made = [api.good("POST", "/api/auth/tokens", {"name": name}) for name in ("kept", "revoked")]
        api.item("KEPT")
        backup.back_up(settings, tmp_path / "saved")
        api.good("DELETE", f"/api/auth/tokens/{made[1]['id']}")
        said: list[str] = []
        backup.restore(settings, tmp_path / "saved", replace=True, report=said.append)
        assert not any("revoked" in line for line in said)
        assert [api.as_(one["token"]).call("GET", "/api/auth/me").status for one in made] == [200, 401]
        assert api.as_(None).call("GET", "/api/auth/me", headers=headers).status == 401
        assert api.as_(None).call("POST", link).status == 401
        assert api.as_(None).call("POST", "/api/auth/login", login).status == 200
        api.good("PUT", "/api/users/ann", {"active": False})
        backup.restore(settings, tmp_path / "saved", replace=True)
        assert api.as_(None).call("POST", "/api/auth/login", login).status == 401
    other = Settings(database_url=databases.empty("sqlite"), files_dir=tmp_path / "other")
    backup.restore(other, tmp_path / "saved", report=said.append)
    assert any("tokens that were revoked" in line and "as they were before" in line for line in said)


def test_files_that_a_restore_needs_are_not_collected_under_it(tmp_path: Path, databases: Databases) -> None:
    """An old file that nothing refers to any more counts as new once a restore is about to refer to it."""
    settings = Settings(database_url=databases.new("sqlite"), files_dir=tmp_path / "files")
    with (
        running_server(settings.database_url, token=TOKEN, settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        fill(api)
        backup.back_up(settings, tmp_path / "saved")
    store = FileStore(settings.storage)
    for path in store.older_than(math.inf):
        os.utime(path, (0, 0))
    (old,) = store.older_than(1)
    backup.restore(settings, tmp_path / "saved", replace=True)
    assert not store.remove_old(old, 1)
    assert old.read_bytes() == model_file(b"first")


def test_a_restore_into_a_running_server_resets_its_listeners(url: str, tmp_path: Path) -> None:
    """Who listens hears ``reset``; who comes back with an id from before, even a higher one, does as well."""
    settings = Settings(database_url=url, files_dir=tmp_path / "files", poll_seconds=0.05)
    with (
        running_server(url, token=TOKEN, settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
        api.events() as stream,
    ):
        parent = fill(api)
        backup.back_up(settings, tmp_path / "saved")
        saved = api.get(bom(parent))
        api.merge(parent, {})
        later = api.item()
        last = stream.next("item.created")
        while last.data["part_number"] != later:
            last = stream.next("item.created")
        with pytest.raises(ConfigError, match="--replace"):
            backup.restore(settings, tmp_path / "saved")
        backup.restore(settings, tmp_path / "saved", replace=True)
        assert stream.next("reset").id is not None
        assert api.get(bom(parent)) == saved
        api.bad(404, "GET", f"/api/items/{later}")
        new = api.item()
        assert stream.next("item.created").data["part_number"] == new
        for _ in range(last.id or 0):
            api.item()  # the log passes the old id
        with api.events(last_event_id=last.id) as again:
            assert again.next().name == "reset"


def test_a_backup_while_many_write_is_one_moment(url: str, tmp_path: Path) -> None:
    """Merges that change two BOMs' lines and uploads continue; in the backup all adds up."""
    settings = Settings(database_url=url, files_dir=tmp_path / "files")
    ending = threading.Event()
    with (
        running_server(url, token=TOKEN, settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        parent, *children = api.items(6)

        def work(number: int) -> None:
            round_number = 0
            while not ending.is_set():
                round_number += 1
                api.merge(parent, dict.fromkeys(children, round_number * 2 + number))
                upload(api, children[number], f"{number} {round_number}".encode())

        threads = [threading.Thread(target=work, args=(n,)) for n in range(2)]
        for thread in threads:
            thread.start()
        wait_until(lambda: len(api.get(bom(parent, "history"))) > 5, "some merges")
        made = backup.back_up(settings, tmp_path / "saved")
        ending.set()
        for thread in threads:
            thread.join()
    assert made.missing_files == []
    assert backup.verify(tmp_path / "saved") == made
    copy = f"sqlite:///{tmp_path / 'copy.db'}"
    backup.restore(Settings(database_url=copy, files_dir=tmp_path / "copies"), tmp_path / "saved")
    with (
        running_server(copy, token=TOKEN, files_dir=tmp_path / "copies") as server,
        Api(server.base_url, TOKEN) as api,
    ):
        assert len(set(api.quantities(parent).values())) == 1
        newest = api.get(bom(parent, "history"))[0]["id"]
        past = api.get(bom(parent, f"history/{newest}/bom"))
        assert {line["child_part_number"]: line["quantity"] for line in past} == api.quantities(parent)


@pytest.fixture
def saved(db: Database, tmp_path: Path) -> Path:
    """A backup with a file in it."""
    with (
        running_server(db.settings.database_url, token=TOKEN, files_dir=tmp_path / "files") as server,
        Api(server.base_url, TOKEN) as api,
    ):
        fill(api)
        backup.back_up(server.settings, tmp_path / "saved")
    return tmp_path / "saved"


@over("sqlite")
def test_a_damaged_backup_is_refused_before_anything_is_touched(saved: Path, tmp_path: Path) -> None:
    """A byte of the database, a byte of a file, a file gone, no manifest, a format of the future."""
    target = Settings(database_url=f"sqlite:///{tmp_path / 'new.db'}", files_dir=tmp_path / "new")

    def refused(message: str) -> None:
        with pytest.raises(ConfigError, match=message):
            backup.restore(target, damaged)
        assert not (tmp_path / "new.db").exists()
        assert not (tmp_path / "new").exists()
        shutil.rmtree(damaged)
        shutil.copytree(saved, damaged)

    damaged = tmp_path / "damaged"
    shutil.copytree(saved, damaged)
    content = (damaged / "silo.db").read_bytes()
    (damaged / "silo.db").write_bytes(content[:5000] + bytes([content[5000] ^ 1]) + content[5001:])
    refused(r"silo.db is missing or damaged")
    file = next(path for path in (damaged / "files").rglob("*") if path.is_file())
    file.write_bytes(b"other")
    refused("1 files of the backup are missing or damaged")
    next(path for path in (damaged / "files").rglob("*") if path.is_file()).unlink()
    refused("1 files of the backup are missing or damaged")
    (damaged / "manifest.json").write_text("{}")
    refused("is not a backup")
    manifest = json.loads((damaged / "manifest.json").read_text())
    (damaged / "manifest.json").write_text(json.dumps({**manifest, "format": 2}))
    refused("use a newer one")


@over("sqlite")
def test_what_the_server_lost_is_named_and_the_rest_is_saved(
    db: Database, saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A damaged file in the store: exit code 1 and its hash; the backup can be restored anyway."""
    store = tmp_path / "files"
    file = next(path for path in store.rglob("*") if path.is_file())
    file.write_bytes(b"damaged")
    where = ["--database", db.settings.database_url, "--files", str(store)]
    assert main(["backup", str(tmp_path / "second"), *where]) == 1
    assert file.name in capsys.readouterr().err
    whole, rest = backup.verify(saved), backup.verify(tmp_path / "second")
    assert (rest.files, rest.missing_files) == (whole.files - 1, [file.name])
    assert main(["backup", str(tmp_path / "second"), *where]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["restore", str(tmp_path / "second"), "--verify"]) == 0
    assert main(["restore", str(tmp_path / "second"), "--replace", *where]) == 0
    # The other backup has the file undamaged, and mends the store.
    assert main(["restore", str(saved), "--replace", *where]) == 0
    assert file.read_bytes() == model_file(b"first")


def test_a_backup_that_fails_leaves_nothing(tmp_path: Path, databases: Databases) -> None:
    """No database, no Silo database, no folder to write into."""
    missing = Settings(database_url=f"sqlite:///{tmp_path / 'none.db'}")
    with pytest.raises(ConfigError, match="there is no database"):
        backup.back_up(missing, tmp_path / "saved")
    foreign = Settings(database_url=databases.empty("sqlite"))
    db = Database(foreign)
    with db.engine.begin() as connection:
        connection.execute(text("CREATE TABLE items (id INTEGER)"))
    db.close()
    with pytest.raises(ConfigError, match="not the database of a Silo server"):
        backup.back_up(foreign, tmp_path / "saved")
    with pytest.raises(ConfigError, match="there is no folder"):
        backup.back_up(foreign, tmp_path / "none" / "saved")
    assert sorted(path.name for path in tmp_path.iterdir()) == []
