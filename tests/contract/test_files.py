# SPDX-License-Identifier: LGPL-2.1-or-later
"""Uploads as revisions, downloads, thumbnails."""

from __future__ import annotations

import hashlib
import io
import json
import uuid
import zipfile
from pathlib import Path
from typing import Any

from hunting import BOTH
from model_file import model_file
from server_testing import Answer, Api, bom, form_body, merge_body

from silo.api.client import SiloClient
from silo.api.files import DocumentId, Origin

SHOUTED = hashlib.sha256(model_file(b"two")).hexdigest().upper()
PNG = b"\x89PNG\r\n\x1a\n" + b"picture"


def document(content: bytes, **more: Any) -> dict[str, Any]:
    """The file that a merge names, by its content."""
    return {"file": "Top.FCStd", "sha256": hashlib.sha256(content).hexdigest(), **more}


def upload(api: Api, number: str, content: bytes, name: str = "Part.FCStd", **more: Any) -> Answer:
    """Upload a file."""
    headers = more.pop("headers", {})
    body, form = form_body({"file": (name, content), **more})
    return api.call("POST", f"/api/items/{number}/file", body=body, headers={**form, **headers})


def test_an_upload_is_a_new_revision(api: Api) -> None:
    """``file``, ``comment``, ``properties``: the answer has number, SHA-256 and size."""
    number = api.item()
    content = model_file(b"content" * 1000)
    answer = upload(api, number, content, comment="first", properties=json.dumps({"mass_kg": 2}))
    assert answer.status == 201
    revision = answer.json()
    assert revision["revision_number"] == 1
    assert revision["file_checksum"] == hashlib.sha256(content).hexdigest()
    assert (revision["file_size"], revision["file_name"]) == (len(content), "Part.FCStd")
    assert (revision["comment"], revision["properties"]) == ("first", {"mass_kg": 2})
    assert upload(api, number, model_file(b"second")).json()["revision_number"] == 2
    item = api.get(f"/api/items/{number}")
    assert (item["current_revision"], item["properties"]) == (2, {"mass_kg": 2})
    assert [r["revision_number"] for r in api.get(f"/api/items/{number}/revisions")] == [2, 1]
    assert api.get(f"/api/items/{number}/revisions/1") == revision


def test_a_download_is_the_file_and_never_something_to_run(api: Api) -> None:
    """Served as an attachment of no type, sandboxed, with its hash as ETag."""
    number = api.item()
    page = model_file(b"<script>alert(1)</script>")
    upload(api, number, page, name='evil".html')
    upload(api, number, model_file(b"newest"))
    answer = api.call("GET", f"/api/items/{number}/file/1")
    assert answer.body == page
    assert answer.headers["content-type"] == "application/octet-stream"
    assert answer.headers["content-disposition"].startswith("attachment")
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert "sandbox" in answer.headers["content-security-policy"]
    assert api.call("GET", f"/api/items/{number}/file").body == model_file(b"newest")
    etag = {"If-None-Match": answer.headers["etag"]}
    assert api.call("GET", f"/api/items/{number}/file/1", headers=etag).status == 304
    part = api.call("GET", f"/api/items/{number}/file/1", headers={"Range": "bytes=0-6"})
    assert (part.status, part.body) == (206, page[:7])


def test_a_name_from_a_client_is_only_a_name(api: Api) -> None:
    """No path of an upload reaches the disk."""
    number = api.item()
    for name in ("../../etc/passwd", "..\\..\\x.FCStd", "/abs/olute", "..", "\x01"):
        revision = upload(api, number, model_file(b"x"), name=name).json()
        assert "/" not in revision["file_name"]
        assert "\\" not in revision["file_name"]
        assert revision["file_name"] not in ("", ".", "..")


def test_the_same_content_is_kept_once(api: Api, server: Any) -> None:
    """By hash: two items with the same file share it."""
    a, b = api.items(2)
    content = model_file(b"only once " * 50)
    checksum = upload(api, a, content).json()["file_checksum"]
    upload(api, b, content)
    assert len(list(server.settings.storage.rglob(checksum))) == 1
    assert api.call("GET", f"/api/items/{b}/file").body == content


def test_a_file_that_arrives_otherwise_is_no_revision(api: Api) -> None:
    """``sha256`` says what was sent."""
    number = api.item()
    wanted = hashlib.sha256(model_file(b"whole")).hexdigest()
    assert upload(api, number, model_file(b"who"), sha256=wanted).status == 400
    assert upload(api, number, model_file(b"whole"), sha256="no hash").status == 400
    assert api.get(f"/api/items/{number}/revisions") == []
    assert upload(api, number, model_file(b"whole"), sha256=wanted.upper()).status == 201


def test_a_thumbnail_is_taken_from_an_fcstd_file(api: Api) -> None:
    """``thumbnails/Thumbnail.png`` inside the file; what is no PNG is not served."""
    number, other = api.items(2)
    api.bad(404, "GET", f"/api/items/{number}/thumbnail")
    for item, picture in ((number, PNG), (other, b"<svg onload=alert(1)>")):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            archive.writestr("Document.xml", "<Document/>")
            archive.writestr("thumbnails/Thumbnail.png", picture)
        upload(api, item, out.getvalue())
    answer = api.call("GET", f"/api/items/{number}/thumbnail")
    assert (answer.status, answer.body, answer.headers["content-type"]) == (200, PNG, "image/png")
    api.bad(404, "GET", f"/api/items/{other}/thumbnail")
    upload(api, number, model_file(b"a later revision without a picture"))
    assert api.call("GET", f"/api/items/{number}/thumbnail").body == PNG


def png(width: int = 128, height: int = 128, more: bytes = b"") -> bytes:
    """The frame of a PNG, with its size."""
    head = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + width.to_bytes(4) + height.to_bytes(4) + b"\x08\x06\0\0\0crc!"
    return head + more + b"\0\0\0\0IEND\xaeB`\x82"


def drawn(api: Api, number: str, picture: bytes) -> int:
    """Send what a browser drew of an item."""
    path = f"/api/items/{number}/thumbnail"
    return api.call("PUT", path, body=picture, headers={"Content-Type": "image/png"}).status


def test_an_item_without_a_picture_takes_what_a_browser_drew(api: Api) -> None:
    """Only an item without a picture; bounded in bytes and pixels; no news, no new version, no revision."""
    number = api.item()
    before = api.get(f"/api/items/{number}")
    for bad in (
        b"", b"<svg/>", png()[:-1], png(15), png(128, 513), png(1 << 31), png(more=bytes(256 * 1024)),
        png(more=b"not a part"), png(0),
    ):  # fmt: skip
        assert drawn(api, number, bad) == 400
    assert drawn(api, "NO-SUCH", png()) == 404
    assert api.get(f"/api/items/{number}") == before
    assert drawn(api, number, png()) == 204
    after = api.get(f"/api/items/{number}")
    assert {name for name in before if before[name] != after[name]} == {"thumbnail_key"}
    assert drawn(api, number, png(64)) == 409
    assert api.call("GET", f"/api/items/{number}/thumbnail").body == png()


def test_a_new_file_takes_a_drawn_picture_away(api: Api) -> None:
    """That of its own file and those of the items that it holds; what came in a file stays."""
    whole, a, b, other = api.items(4)
    for number in (whole, a, b, other):
        assert drawn(api, number, png()) == 204
    upload(api, whole, model_file(b"new"))
    held = [{"item": api.get(f"/api/items/{one}")["id"], "object": one} for one in (a, b)]
    body, form = form_body({"file": ("x.FCStd", model_file(b"two parts")), "items": json.dumps(held)})
    api.good("POST", f"/api/documents/{uuid.uuid4()}/file", body=body, headers=form)
    kept = [api.get(f"/api/items/{one}")["thumbnail_key"] is not None for one in (whole, a, b, other)]
    assert kept == [False, False, False, True]


def test_what_is_no_upload_is_refused(api: Api) -> None:
    """400 with what was wanted; nothing is stored."""
    number = api.item()
    path = f"/api/items/{number}/file"
    api.bad(400, "POST", path, {"file": "x"})
    body, headers = form_body({"comment": "no file"})
    assert "'file'" in api.bad(400, "POST", path, body=body, headers=headers)["message"]
    body, headers = form_body({"file": ("a", b"x"), "properties": "{}", "properties2": '{"a": 1}'})
    error = api.bad(400, "POST", path, body=body.replace(b"properties2", b"properties"), headers=headers)
    assert "properties: wanted one part of this name" in error["message"]
    body, headers = form_body({"file": ("a", b"x"), "properties": "[1]"})
    assert "properties" in api.bad(400, "POST", path, body=body, headers=headers)["message"]
    assert upload(api, "NO-SUCH", model_file(b"x")).status == 404
    assert api.get(f"/api/items/{number}/revisions") == []
    api.bad(404, "GET", f"/api/items/{number}/file")
    api.bad(404, "GET", f"/api/items/{number}/file/1")


@BOTH
def test_a_file_is_found_by_its_content(api: Api) -> None:
    """Searching for a SHA-256 finds the items that have, or had, this very file, whatever their name."""
    content = model_file(uuid.uuid4().bytes)
    older, newer = api.item(name="Motor bracket"), api.item(name="Mount")
    checksum = upload(api, older, content).json()["file_checksum"]
    upload(api, older, model_file(b"a later revision"))
    known = {"properties": {"file_sha256": checksum}}
    assert api.call("PUT", f"/api/items/{newer}", known).status == 200
    for query in (checksum, f"sha256:{checksum}".upper()):
        found = api.get(f"/api/items/search?q={query}")
        assert {item["part_number"] for item in found} == {older, newer}
    assert api.get(f"/api/items/search?q={'0' * 64}") == []
    both = api.get(f"/api/items/search?q={checksum}%20bracket")
    assert [item["part_number"] for item in both] == [older]


def test_revisions_come_in_pages(api: Api) -> None:
    """The newest first, so many at a time; the client gets all of them, or the newest without the others."""
    number = api.item()
    for count in range(1, 8):
        api.good("POST", f"/api/items/{number}/revisions", {"properties": {"n": count}})

    def numbers(query: str) -> list[int]:
        answer = api.call("GET", f"/api/items/{number}/revisions?{query}")
        assert answer.headers["x-total-count"] == ("2" if "after" in query else "7")
        return [revision["revision_number"] for revision in answer.json()]

    assert numbers("limit=3") == [7, 6, 5]
    assert numbers("limit=3&before=5") == [4, 3, 2]
    assert numbers("after=5") == [7, 6]
    api.bad(400, "GET", f"/api/items/{number}/revisions?limit=0")
    with SiloClient(api.base_url, api.token) as client:
        assert [r.revision_number for r in client.revisions(number)] == [7, 6, 5, 4, 3, 2, 1]
        assert [r.revision_number for r in client.revisions(number, newest=2)] == [7, 6]
        assert [r.revision_number for r in client.revisions(number, after=4)] == [7, 6, 5]


@BOTH
def test_a_file_that_was_made_from_an_older_revision_is_refused(api: Api) -> None:
    """409 with the newer one; nothing is added. With the newest as its base it passes, and that is kept."""
    number = api.item()
    first = upload(api, number, model_file(b"one"), base_revision="0").json()
    assert (first["revision_number"], first["base_revision"]) == (1, 0)
    upload(api, number, model_file(b"one less"), base_revision="1", comment="less")
    refused = upload(api, number, model_file(b"one other"), base_revision="1")
    assert (refused.status, refused.json()["error"]) == (409, "newer_revision")
    newer = refused.json()["revision"]
    assert (newer["revision_number"], newer["comment"]) == (2, "less")
    assert newer["file_checksum"] == hashlib.sha256(model_file(b"one less")).hexdigest()
    assert len(api.get(f"/api/items/{number}/revisions")) == 2
    on_top = upload(api, number, model_file(b"one other"), base_revision="2")
    assert (on_top.status, on_top.json()["base_revision"]) == (201, 2)
    assert upload(api, number, model_file(b"who knows")).status == 201  # a client that does not say it


@BOTH
def test_what_is_no_other_file_is_no_newer_one(api: Api) -> None:
    """The same content, a repeat with its key, and a revision of properties alone."""
    number = api.item()
    key = {"Idempotency-Key": uuid.uuid4().hex}
    upload(api, number, model_file(b"one"))
    mine = upload(api, number, model_file(b"two"), base_revision="1", headers=key)
    assert upload(api, number, model_file(b"two"), base_revision="1").status == 201
    upload(api, number, model_file(b"three"), base_revision="3")
    again = upload(api, number, model_file(b"two"), base_revision="1", headers=key)
    assert (again.status, again.json()) == (201, mine.json())
    assert upload(api, number, model_file(b"another"), base_revision="1", headers=key).status == 409
    api.good("POST", f"/api/items/{number}/revisions", {"properties": {"mass_kg": 2}, "comment": "weighed"})
    assert upload(api, number, model_file(b"five"), base_revision="4").json()["revision_number"] == 6


@BOTH
def test_a_bom_that_comes_late_does_not_undo_that_of_a_newer_file(api: Api) -> None:
    """``document.revision``: the revision whose BOM it is; by its SHA-256 it may be the newest by another
    number."""
    number, bolt, nut = api.items(3)
    upload(api, number, model_file(b"one"))
    upload(api, number, model_file(b"two"))
    api.merge(number, {bolt: 2}, document=document(model_file(b"two"), revision=2))
    api.merge(number, {bolt: 2}, document=document(model_file(b"two"), revision=2, sha256=SHOUTED))
    late = merge_body({nut: 9}, document=document(model_file(b"one"), revision=1))
    error = api.bad(409, "POST", bom(number, "merge"), late)
    assert (error["error"], error["revision"]["revision_number"]) == ("newer_revision", 2)
    assert api.quantities(number) == {bolt: 2}
    api.merge(number, {bolt: 3}, document=document(model_file(b"two"), revision=1))
    assert api.quantities(number) == {bolt: 3}


def test_the_bom_of_an_older_file_is_known_by_its_content(api: Api) -> None:
    """A file that was not fetched again, in a vault that is synced at night, says no revision."""
    number, bolt, nut = api.items(3)
    for content in (model_file(b"two"), model_file(b"three")):
        upload(api, number, content)
    api.merge(number, {bolt: 2}, document=document(model_file(b"three")))
    two = model_file(b"two")
    for dry_run, of in ((True, document(two)), (False, document(two, sha256=SHOUTED))):
        stale = merge_body({nut: 9}, document=of, dry_run=dry_run)
        error = api.bad(409, "POST", bom(number, "merge"), stale)
        assert (error["error"], error["revision"]["revision_number"]) == ("newer_revision", 2)
    assert api.quantities(number) == {bolt: 2}
    api.merge(number, {bolt: 3}, document=document(model_file(b"edited, and in no revision")))
    upload(api, number, model_file(b"two"), comment="back to it")
    api.merge(number, {bolt: 4}, document=document(model_file(b"two")))
    assert api.quantities(number) == {bolt: 4}


def test_a_bom_does_not_go_without_its_file(api: Api) -> None:
    """``document.revision`` and its SHA-256 name a file that is not here: the server was restored since, and
    the number is free, or that of a colleague's file."""
    number, bolt = api.items(2)
    upload(api, number, model_file(b"one"))
    for revision in (1, 2):
        for dry_run in (True, False):
            of = document(model_file(b"gone"), revision=revision)
            gone = merge_body({bolt: 9}, document=of, dry_run=dry_run)
            assert api.bad(409, "POST", bom(number, "merge"), gone)["error"] == "missing_revision"
    assert api.quantities(number) == {}


def test_whose_content_it_is_now(api: Api, tmp_path: Path) -> None:
    """A file that was a document of its own and got its part number: its old content leads to the new."""
    silo = SiloClient(api.base_url, api.token)
    item = silo.create_item("kindred-rd", "M01", "Plate")
    document = DocumentId(str(uuid.uuid4()))
    contents = {}
    for name, of, former in (("before", document, ""), ("after", item.part_number, str(document))):
        path = tmp_path / f"{name}.FCStd"
        path.write_bytes(model_file(name.encode()))
        contents[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        silo.upload_file(of, path, origin=Origin(file_path="parts/Plate.FCStd", former=former))
    found = {one.sha256: one for one in silo.get_contents([*contents.values(), "0" * 64])}
    assert found.keys() == set(contents.values())
    before, after = (found[contents[name]] for name in ("before", "after"))
    assert (before.document, before.now, before.part_number) == (document, item.id, item.part_number)
    assert (after.document, after.now, after.part_number) == (item.id, item.id, item.part_number)
    assert (before.revision_number, before.file_path) == (1, "parts/Plate.FCStd")
    # Taken out of its item again, and back: the way does not go in a ring.
    for of, former in ((document, item.id), (item.part_number, str(document)), (document, item.id)):
        path.write_bytes(path.read_bytes() + b"!")
        silo.upload_file(of, path, origin=Origin(former=former))
    (now,) = silo.get_contents([contents["after"]])
    assert (now.now, now.part_number) == (document, "")
