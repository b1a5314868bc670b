# SPDX-License-Identifier: LGPL-2.1-or-later
"""A file has a kind: the model's place takes models only; attachments have kinds and own revisions."""

from __future__ import annotations

import hashlib
import uuid
from typing import Any

import pytest
from hunting import BOTH
from model_file import model_file
from server_testing import Api, form_body

PDF, STEP, PNG = b"%PDF-1.7 drawing", b"ISO-10303-21;\nHEADER;", b"\x89PNG\r\n\x1a\npicture"


def attach(api: Api, number: str, content: bytes, name: str, status: int = 201, **parts: str) -> Any:
    """Attach a file to an item; the answer."""
    body, headers = form_body({"file": (name, content), **parts})
    answer = api.call("POST", f"/api/items/{number}/files", body=body, headers=headers)
    assert answer.status == status, answer.body
    return answer.json()


def seen(api: Api, number: str) -> list[tuple[str, str, int]]:
    """The attachments of an item: kind, name, revision."""
    files = api.get(f"/api/items/{number}/files")["files"]
    return [(one["kind"], one["file_name"], one["revision_number"]) for one in files]


@BOTH
@pytest.mark.parametrize("name", ["wheel.pdf", "wheel.FCStd", "wheel"])
def test_what_is_no_model_never_becomes_the_model(api: Api, name: str) -> None:
    """A drawing sent to the place of the model lies beside the model, whatever its name says."""
    number = api.item()
    model = model_file(b"wheel")
    api.upload(number, model, "wheel.FCStd")
    drawn = api.upload(number, PDF, name)
    assert (drawn["kind"], drawn["revision_number"], drawn["file_name"]) == ("drawing", 1, name)
    assert api.call("GET", f"/api/items/{number}/file").body == model
    assert [one["file_name"] for one in api.get(f"/api/items/{number}/revisions")] == ["wheel.FCStd"]
    (document,) = api.get(f"/api/items/{number}/documents")["documents"]
    assert document["file_name"] == "wheel.FCStd"
    assert seen(api, number) == [("drawing", name, 1)]
    assert api.call("GET", f"/api/documents/{drawn['document']}/file").body == PDF
    # The next model is made from the first one: the drawing is no newer revision.
    assert api.upload(number, model_file(b"rim"), "wheel.FCStd", base_revision="1")["revision_number"] == 2


def test_a_model_that_is_none_is_refused(api: Api) -> None:
    """A client that means a model gets an error, and no attachment in silence; so does a file of no item."""
    number = api.item()
    body, headers = form_body({"file": ("wheel.FCStd", b"PK\x03\x04 damaged"), "kind": "model"})
    error = api.bad(400, "POST", f"/api/items/{number}/file", body=body, headers=headers)
    assert "is a FreeCAD document" in error["message"]
    body, headers = form_body({"file": ("wheel.FCStd", PDF)})
    api.bad(400, "POST", f"/api/documents/{uuid.uuid4()}/file", body=body, headers=headers)
    body, headers = form_body({"file": ("a.FCStd", model_file()), "kind": "sketch"})
    api.bad(400, "POST", f"/api/items/{number}/file", body=body, headers=headers)
    assert (seen(api, number), api.get(f"/api/items/{number}/revisions")) == ([], [])


@BOTH
def test_attachments_have_kinds_and_revisions(api: Api) -> None:
    """By content, or as the sender says; one name is one attachment, the same bytes are no news."""
    number = api.item()
    attach(api, number, STEP, "w.stp")
    attach(api, number, PNG, "photo.jpeg")
    first = attach(api, number, PDF, "Wheel.pdf", comment="first")
    attach(api, number, PDF, "iso.pdf", kind="certificate")
    attach(api, number, b"text", "notes.txt")
    attach(api, number, model_file(b"page"), "page.FCStd", kind="drawing")
    attach(api, number, model_file(b"page"), "page.FCStd", status=400)
    assert attach(api, number, PDF, "Wheel.pdf", status=200) == first
    again = attach(api, number, PDF + b"2", "wheel.PDF", comment="second")
    assert (again["id"], again["revision_number"]) == (first["id"], 2)
    assert seen(api, number) == [
        ("drawing", "page.FCStd", 1),
        ("drawing", "wheel.PDF", 2),
        ("step", "w.stp", 1),
        ("picture", "photo.jpeg", 1),
        ("certificate", "iso.pdf", 1),
        ("other", "notes.txt", 1),
    ]
    history = api.get(f"/api/documents/{first['id']}/revisions")
    assert [(one["revision_number"], one["comment"], one["kind"]) for one in history] == [
        (2, "second", "drawing"),
        (1, "first", "drawing"),
    ]
    assert api.call("GET", f"/api/documents/{first['id']}/file/1").body == PDF
    body, headers = form_body({"file": ("Wheel-3.pdf", PDF + b"3")})
    assert (
        api.good("POST", f"/api/documents/{first['id']}/file", body=body, headers=headers)["revision_number"]
        == 3
    )
    assert (
        api.get(f"/api/items/{number}")["current_revision"],
        api.get(f"/api/items/{number}/revisions"),
    ) == (0, [])


def test_a_pdf_of_a_bought_part_is_its_data_sheet(api: Api) -> None:
    """Unless the sender says another kind."""
    bought = api.item(sourcing_type="purchased")
    assert attach(api, bought, PDF, "dc.pdf")["kind"] == "data_sheet"
    assert attach(api, bought, PDF, "dc.pdf", kind="drawing")["kind"] == "drawing"


@BOTH
def test_a_kind_is_changed_and_an_attachment_removed(api: Api) -> None:
    """A removed attachment takes no revision; a file of its name begins anew. A model has no other kind."""
    number = api.item()
    made = attach(api, number, PDF, "a.pdf")
    model = api.get(f"/api/items/{number}")["id"]
    api.upload(number)
    assert (
        api.good("PUT", f"/api/documents/{made['id']}/kind", {"kind": "certificate"})["kind"] == "certificate"
    )
    assert seen(api, number) == [("certificate", "a.pdf", 1)]
    api.bad(400, "PUT", f"/api/documents/{made['id']}/kind", {"kind": "model"})
    for of in (model, str(uuid.uuid4())):
        api.bad(404, "PUT", f"/api/documents/{of}/kind", {"kind": "drawing"})
        api.bad(404, "DELETE", f"/api/documents/{of}")
    api.good("DELETE", f"/api/documents/{made['id']}")
    assert seen(api, number) == []
    body, headers = form_body({"file": ("a.pdf", PDF + b"2")})
    api.bad(404, "POST", f"/api/documents/{made['id']}/file", body=body, headers=headers)
    assert attach(api, number, PDF, "a.pdf", kind="certificate")["revision_number"] == 1


@BOTH
def test_an_upload_with_a_key_is_one_attachment(api: Api) -> None:
    """The repeat gives the answer of the first request."""
    number = api.item()
    body, headers = form_body({"file": ("a.pdf", PDF)})
    key = {"Idempotency-Key": uuid.uuid4().hex, **headers}
    first = api.good("POST", f"/api/items/{number}/file", body=body, headers=key)
    api.upload(number, PDF + b"2", "a.pdf")
    assert api.good("POST", f"/api/items/{number}/file", body=body, headers=key) == first
    assert seen(api, number) == [("drawing", "a.pdf", 2)]


@BOTH
def test_attachments_travel_with_a_release(api: Api) -> None:
    """As they were frozen, over all levels, whatever becomes of them; so does its order list."""
    top, part = api.item(item_type="assembly"), api.item(sourcing_type="manufactured")
    api.merge(top, {part: 2})
    for number in (top, part):
        api.upload(number, model_file(number.encode()))
    drawing = attach(api, part, PDF, "part.pdf")
    certificate = attach(api, part, PDF + b"c", "c.pdf", kind="certificate")
    api.good("POST", f"/api/items/{top}/releases", {})
    before = api.get(f"/api/items/{top}/releases/A")
    assert {
        (one["part_number"], one["kind"], one["file_name"], one["revision"]) for one in before["attachments"]
    } == {
        (part, "drawing", "part.pdf", 1),
        (part, "certificate", "c.pdf", 1),
    }
    assert {one["document"] for one in before["files"]} == {
        api.get(f"/api/items/{n}")["id"] for n in (top, part)
    }
    order = f"/api/items/{top}/order?release=A"
    ordered = api.get(order)
    (made,) = ordered["parts"]
    assert [(one["kind"], one["name"]) for one in made["files"]] == [
        ("drawing", "part.pdf"),
        ("certificate", "c.pdf"),
        ("model", "x.FCStd"),
    ]
    attach(api, part, PDF + b"2", "part.pdf")
    api.good("DELETE", f"/api/documents/{certificate['id']}")
    assert api.get(f"/api/items/{top}/releases/A")["attachments"] == before["attachments"]
    assert api.get(order) == ordered
    assert api.call("GET", f"/api/documents/{drawing['id']}/file/1").body == PDF
    changed = api.get(f"/api/items/{top}/bom/changes?from=A")["changes"]
    assert {(one["what"], one["before"], one["after"]) for one in changed} == {
        ("file", "part.pdf, revision 1", "part.pdf, revision 2"),
        ("file", "c.pdf, revision 1", ""),
    }


def test_pictures_of_a_part_are_no_picture_of_its_model(api: Api) -> None:
    """The thumbnail, the 3D view and "no file" follow the model only."""
    number = api.item(item_type="part")
    attach(api, number, PNG, "photo.png")
    api.bad(404, "GET", f"/api/items/{number}/thumbnail")
    api.bad(404, "GET", f"/api/items/{number}/scene")
    checksum = hashlib.sha256(PNG).hexdigest()
    assert api.good("POST", "/api/models/missing", {"sha256": [checksum]})["sha256"] == []
    release = api.good("POST", f"/api/items/{number}/releases", {})
    assert release["blocks"] == [f"{number}: no file"]
