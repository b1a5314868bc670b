# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that were uploaded before files had kinds are sorted by their content; nothing is lost."""

from __future__ import annotations

import hashlib
import io
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from model_file import model_file
from server_testing import Api, Databases
from sqlalchemy import MetaData, select

from silo.file_kind import kind_by_name, kind_of
from silo_server import backup
from silo_server.db.database import Database
from silo_server.db.migrate import STEPS, upgrade
from silo_server.run import running_server
from silo_server.services.file_store import FileStore
from silo_server.settings import Settings

BEFORE, STEP_NUMBER = next((a, b) for a, b in pairwise(STEPS) if STEPS[b].__name__ == "_attachments")
TOKEN = "test-" + "0" * 40
AT = "2026-11-22T01:00:00.000000Z"
WHEEL, HUB = "6f1c7a52-6c1f-4d0c-9d57-2f1c1b6a9e01", "6f1c7a52-6c1f-4d0c-9d57-2f1c1b6a9e02"
MODEL, PDF = model_file(b"wheel"), b"%PDF-1.7 wheel"


@pytest.fixture
def old(empty_url: str, tmp_path: Path) -> Any:
    """A database of the schema before, with files of all kinds in the places of models."""
    db = Database(Settings(database_url=empty_url, files_dir=tmp_path / "files"))
    upgrade(db, BEFORE)
    store = FileStore(db.settings.storage)
    with db.write() as tx:
        tables = MetaData()
        tables.reflect(tx.conn, only=["items", "documents", "revisions", "document_items", "document_links"])
        made = {"created_at": AT, "created_by": "zoe", "updated_at": AT, "updated_by": "zoe"}
        for number, (uuid, name) in enumerate([(WHEEL, "WHEEL"), (HUB, "HUB")], start=1):
            tx.conn.execute(
                tables.tables["items"].insert().values(
                    uuid=uuid, part_number=name, part_number_key=name.casefold(), name=name,
                    item_type="part", description="", properties="{}", current_revision=5, bom_version=0,
                    **made,
                )
            )  # fmt: skip
            row = {"uuid": uuid, "item_id": number, "current_revision": 5}
            tx.conn.execute(
                tables.tables["documents"].insert().values(**row, created_at=AT, created_by="zoe")
            )
            tx.conn.execute(
                tables.tables["document_items"].insert().values(document_id=number, item_id=number, object="")
            )
        files = [
            (1, 1, "wheel.FCStd", MODEL, f'[{{"path": "hub.FCStd", "item": "{HUB}"}}]'),
            (1, 2, None, None, None),
            (1, 3, "wheel.FCStd", PDF, None),
            (1, 4, "wheel.stp", b"ISO-10303-21;", None),
            (1, 5, "WHEEL.fcstd", PDF + b" 2", None),
            (2, 5, "hub.png", b"\x89PNG\r\n\x1a\n", None),
        ]
        for item, number, name, content, links in files:
            stored = store.keep(name, io.BytesIO(content)) if name and content else None
            tx.conn.execute(
                tables.tables["revisions"].insert().values(
                    item_id=item, document_id=item if stored else None, revision_number=number,
                    properties="{}",
                    comment=f"c{number}", status="draft", file_name=name, created_at=AT, created_by="zoe",
                    file_checksum=stored.checksum if stored else None, links=links,
                    file_size=stored.size if stored else None,
                )
            )  # fmt: skip
    yield db
    db.close()


def check(api: Api) -> None:
    """What a reader finds after the step."""
    assert api.call("GET", "/api/items/WHEEL/file").body == MODEL
    api.bad(404, "GET", "/api/items/HUB/file")
    history = api.get("/api/items/WHEEL/revisions")
    assert [(one["revision_number"], one["file_name"], one["comment"]) for one in history] == [
        (5, None, "c5"), (4, None, "c4"), (3, None, "c3"), (2, None, "c2"), (1, "wheel.FCStd", "c1"),
    ]  # fmt: skip
    files = api.get("/api/items/WHEEL/files")["files"]
    assert [(one["kind"], one["file_name"], one["revision_number"]) for one in files] == [
        ("drawing", "WHEEL.fcstd", 2),
        ("step", "wheel.stp", 1),
    ]
    assert api.call("GET", f"/api/documents/{files[0]['id']}/file/1").body == PDF
    # A release that was frozen before names the revision by its old number.
    assert api.call("GET", f"/api/documents/{WHEEL}/file/3").body == PDF
    assert [one["kind"] for one in api.get("/api/items/HUB/files")["files"]] == ["picture"]
    (document,) = api.get("/api/items/WHEEL/documents")["documents"]
    assert (document["revision_number"], document["file_name"]) == (1, "wheel.FCStd")
    assert api.get("/api/items/HUB/documents")["documents"] == []
    assert [one["item"] for one in api.get(f"/api/documents/{WHEEL}")["links"]] == [HUB]
    # The next model goes on top of the model, and a drawing is no newer revision.
    made = api.upload("WHEEL", model_file(b"rim"), "wheel.FCStd", base_revision="1")
    assert made["revision_number"] == 6


def test_each_file_is_sorted_by_its_content(old: Database) -> None:
    """On both databases; the numbers of revisions stay, and so do the files under them."""
    settings = old.settings
    assert upgrade(old, STEP_NUMBER) == []
    upgrade(old)
    with (
        running_server(settings.database_url, token=TOKEN, settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        check(api)


def test_a_backup_of_before_is_sorted_by_its_own_files(
    old: Database, tmp_path: Path, databases: Databases
) -> None:
    """The files are in the backup, and not yet in the store of the server that restores it."""
    backup.back_up(old.settings, tmp_path / "saved")
    url = databases.new("sqlite")
    settings = Settings(database_url=url, files_dir=tmp_path / "restored")
    backup.restore(settings, tmp_path / "saved", replace=True)
    with running_server(url, token=TOKEN, settings=settings) as server, Api(server.base_url, TOKEN) as api:
        check(api)


def test_a_file_that_is_lost_is_sorted_by_its_name_and_named(old: Database) -> None:
    """What cannot be decided stays as it was, and one sentence lists it."""
    store = FileStore(old.settings.storage)
    for content in (PDF, b"ISO-10303-21;"):
        store.path_of(hashlib.sha256(content).hexdigest()).unlink()
    (sentence,) = upgrade(old, STEP_NUMBER)
    assert sentence == (
        "2 files are not in the server's store, so their names decide what they are: "
        "wheel.FCStd (model), wheel.stp (step)"
    )
    with old.read() as tx:
        tables = MetaData()
        tables.reflect(tx.conn, only=["documents", "revisions"])
        assert tx.conn.scalar(select(tables.tables["documents"].c.current_revision).where(
            tables.tables["documents"].c.uuid == WHEEL)) == 3  # fmt: skip


@pytest.mark.parametrize(
    ("name", "content", "kind"),
    [
        ("a.FCStd", model_file(), "model"),
        ("a.kc", model_file(b"PK more"), "model"),
        ("a.pdf", model_file(), "model"),
        ("a.FCStd", b"PK\x03\x04" + bytes(40), "other"),
        ("a.FCStd", b"", "other"),
        ("a", b"%PDF-1.4", "drawing"),
        ("a", b"AC1032\0", "drawing"),
        ("a", b"999\r\nmade by\r\n  0\r\nSECTION\r\n", "drawing"),
        ("a.step", b"\n ISO-10303-21 ;", "step"),
        ("a.FCStd", b"\xff\xd8\xff\xe0", "picture"),
        ("a", b"<?xml version='1.0'?>\n<svg xmlns='x'>", "picture"),
        ("a.jpg", b"who knows", "picture"),
        ("a.docx", b"PK\x03\x04", "other"),
    ],
)
def test_the_content_decides_the_kind(tmp_path: Path, name: str, content: bytes, kind: str) -> None:
    """A name helps only where the content says nothing, and never makes a model."""
    path = tmp_path / "file"
    path.write_bytes(content)
    assert kind_of(path, name) == kind
    assert kind_by_name(name) in ("", "model", "drawing", "step", "picture")


def test_a_document_may_lie_anywhere_in_the_zip(tmp_path: Path) -> None:
    """Other programs write its entries in another order; a zip of something else is no model."""
    path = tmp_path / "file"
    for names, kind in ((("b", "Document.xml"), "model"), (("b", "word/Document.xml"), "other")):
        for how in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            with zipfile.ZipFile(path, "w", how) as archive:
                for each in names:
                    archive.writestr(each, "<?xml version='1.0'?><Document SchemaVersion='4'/>")
            assert kind_of(path) == kind
