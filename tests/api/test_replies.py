# SPDX-License-Identifier: LGPL-2.1-or-later
"""Answers read as data or as errors, in every form that servers and proxies send."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo import spoken
from silo.api.foreign import Where
from silo.api.replies import Reply, WebPageError, complaint, error_of
from silo.api.wire import BomLine, Item
from silo.bom.errors import (
    AuthError,
    BusyError,
    ConflictError,
    CycleError,
    ForbiddenError,
    NotFoundError,
    ReadOnlyError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
    UnreachableError,
    VersionConflictError,
)
from silo.bom.message import beside, message

WHERE = Where("silo.example.com", "item F01-0001")


def reply(status: int, body: Any, kind: str = "application/json", secret: str | None = None) -> Reply:
    content = body if isinstance(body, bytes) else json.dumps(body).encode()
    return Reply(status, content, WHERE, {"Content-Type": kind}, secret)


@pytest.mark.parametrize(
    ("body", "text"),
    [
        ({"error": "bad_request", "message": "quantity is missing"}, "quantity is missing"),
        ({"error": "quantity is missing"}, "quantity is missing"),
        ({"error": {"code": "x", "message": "quantity is missing"}}, "quantity is missing"),
        ({"detail": "quantity is missing"}, "quantity is missing"),
        ({"message": "quantity is missing"}, "quantity is missing"),
        ("quantity is missing", "quantity is missing"),
        (b"quantity is missing\n", "quantity is missing"),
        (b"<html><title>400 Bad\n Request</title>", "400 Bad Request"),
        (b"", "no reason given"),
        ({}, "no reason given"),
        (b"\xff\xfe", "\ufffd\ufffd"),
        (b"[" * 100_000, "[" * 399 + "…"),
        ([1, 2], "[1, 2]"),
    ],
)
def test_error_bodies_of_every_form_are_read(body: Any, text: str) -> None:
    """The real Silo's form is not known for sure; proxies have their own."""
    error = error_of(reply(400, body))
    assert isinstance(error, RejectedError)
    assert str(error) == f"silo.example.com (item F01-0001): not accepted (400): {text}"


@pytest.mark.parametrize(
    ("status", "kind"),
    [
        (400, RejectedError),
        (401, AuthError),
        (403, ForbiddenError),
        (404, NotFoundError),
        (405, RouteMissingError),
        (408, UnreachableError),
        (409, ConflictError),
        (410, NotFoundError),
        (412, VersionConflictError),
        (413, RejectedError),
        (415, RejectedError),
        (422, RejectedError),
        (429, BusyError),
        (500, ServerFaultError),
        (501, RouteMissingError),
        (502, UnreachableError),
        (503, ReadOnlyError),
        (504, UnreachableError),
        (507, ServerFaultError),
        (304, ServerFaultError),
    ],
)
def test_each_status_is_one_error(status: int, kind: type[SiloError]) -> None:
    """The tree of silo.bom.errors, exactly."""
    assert type(error_of(reply(status, {"error": "code", "message": "text"}), writing=True)) is kind


def test_503_is_read_only_only_for_a_change() -> None:
    """A question that gets 503 met an absent server; so did a change that a proxy's page answers."""
    assert type(error_of(reply(503, {"error": "x"}))) is UnreachableError
    page = reply(503, b"<html><title>503</title>", "text/html")
    assert type(error_of(page, writing=True)) is UnreachableError
    busy = reply(503, {"error": "unavailable", "message": "the database is away"})
    assert type(error_of(busy, writing=True)) is UnreachableError


def test_all_problems_are_kept() -> None:
    """Ours, and FastAPI's."""
    ours = error_of(reply(400, {"error": "rejected", "message": "2 bad", "problems": ["a: bad", "b: bad"]}))
    assert isinstance(ours, RejectedError)
    assert ours.problems == ("a: bad", "b: bad")
    assert "a: bad; b: bad" in str(ours)
    detail = [{"loc": ["body", "entries", 0, "quantity"], "msg": "wanted a number"}]
    theirs = error_of(reply(422, {"detail": detail}))
    assert isinstance(theirs, RejectedError)
    assert theirs.problems == ("entries.0.quantity: wanted a number",)


def test_a_servers_sentence_keeps_its_values() -> None:
    """It is shown in the user's language; a value that looks like a sentence of ours stays as it is."""
    sent = message("item {part_number} is archived", part_number="3 lines")
    body = {"error": "not_found", "message": sent, **beside(sent)}
    error = error_of(reply(404, body))
    assert "item 3 lines is archived" in str(error)
    assert "Artikel 3 lines ist archiviert" in spoken(str(error), "de")
    problems = [
        message("quantity: {problem}", problem=message("wanted a number, got {got}", got="removed")),
        "x",
    ]
    body = {"error": "rejected", "message": "x", "problems": problems}
    told = {"problem_messages": [beside(problem) for problem in problems]}
    rejected = error_of(reply(400, body | told))
    assert isinstance(rejected, RejectedError)
    assert [getattr(text, "template", "") for text in rejected.problems] == ["quantity: {problem}", ""]


@pytest.mark.parametrize(
    "told",
    [
        {},
        {"template": "item {part_number} is archived", "values": {"part_number": "another"}},
        {"template": "item {part_number} is archived", "values": {}},
        {"template": ["item"], "values": 3},
    ],
)
def test_a_sentence_that_its_values_do_not_make_stays(told: dict[str, Any]) -> None:
    """An older server sends none; what a proxy changed is not believed."""
    error = error_of(reply(404, {"error": "not_found", "message": "item P1 is archived", **told}))
    assert str(error).endswith(": item P1 is archived")
    assert getattr(error.args[0], "template", "") != "item {part_number} is archived"
    assert "another" not in str(error)


def test_a_ring_keeps_its_way() -> None:
    """409 with a path is a cycle."""
    error = error_of(reply(409, {"error": "cycle", "message": "x", "path": ["A", "B", "A"]}))
    assert isinstance(error, CycleError)
    assert error.path == ("A", "B", "A")


@pytest.mark.parametrize(
    ("body", "kind"),
    [
        # What routers say: Go's, FastAPI's, ours, and web servers' pages.
        (b"404 page not found\n", RouteMissingError),
        ({"detail": "Not Found"}, RouteMissingError),
        ({"error": "no_route"}, RouteMissingError),
        ("Not Found: GET /x", RouteMissingError),
        (b"<html>", WebPageError),
        # What handlers say.
        (b"", NotFoundError),
        ({"error": "not_found"}, NotFoundError),
        ({"error": "not_found", "message": "Not Found"}, NotFoundError),
    ],
)
def test_a_missing_route_is_not_a_missing_item(body: Any, kind: type[SiloError]) -> None:
    """Else people would register everything again."""
    assert type(error_of(reply(404, body))) is kind


def test_texts_of_servers_are_made_harmless() -> None:
    """No terminal codes, no turned writing direction, one line, bounded, and never our token."""
    nasty = "\x1b[31mred\x1b[0m\r\nsecond \u202eline silo_secret " + "x" * 5000
    text = complaint(reply(400, {"error": nasty}, secret="silo_secret")).text
    assert text.startswith("[31mred [0m second line [token] xxx")
    assert len(text) == 400


@given(st.binary(max_size=300), st.integers(300, 599), st.booleans())
def test_no_bytes_break_the_reading_of_an_error(content: bytes, status: int, writing: bool) -> None:
    """Whatever comes, one of our errors comes out, in bounded text."""
    for kind in ("application/json", "text/html", ""):
        error = error_of(reply(status, content, kind), writing=writing)
        assert isinstance(error, SiloError)
        assert len(str(error)) < 600


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"\xff", b"nul", b"9" * 5000, b"[" * 100_000, b'{"id": 1}', b"[]", b'"text"', b"null"],
)
def test_what_is_no_item_is_a_server_fault(content: bytes) -> None:
    """Plain words with the host."""
    with pytest.raises(ServerFaultError, match=r"silo\.example\.com"):
        reply(200, content).model(Item)


def test_a_web_page_where_data_was_wanted_asks_for_the_address() -> None:
    """A captive portal, or the address of something else."""
    with pytest.raises(ServerFaultError, match=r"web page instead of data \(Hotel & WLAN\)"):
        reply(200, b"<html><title>Hotel &amp; WLAN</title></html>", "text/html").model(Item)


@pytest.mark.parametrize(
    "body",
    [
        [{"child_part_number": "F01-0001", "quantity": 2}],
        {"items": [{"child_part_number": "F01-0001", "quantity": "2"}]},
        {"part_number": "A", "bom": [{"child_part_number": "F01-0001", "quantity": 2.0, "unit": None}]},
        {"entries": [{"child_part_number": "F01-0001", "quantity": 2, "new_key": {}}]},
    ],
)
def test_lists_are_read_bare_or_wrapped(body: Any) -> None:
    """Unknown keys and nulls do no harm."""
    (line,) = reply(200, body).models(BomLine, "items", "entries", "bom")
    assert (line["child_part_number"], line["quantity"], line["source"]) == ("F01-0001", 2, "assembly")


def test_an_empty_list_may_be_null() -> None:
    """Go writes it so."""
    assert reply(200, {"bom": None}).models(BomLine, "bom") == []
    with pytest.raises(ServerFaultError, match="no list"):
        reply(200, {"other": []}).models(BomLine, "bom")


@pytest.mark.parametrize(("named", "said"), [("30", "in 30 s"), ("2301782400", "in 60 min")])
def test_a_pause_is_said_as_long_as_it_is_kept(named: str, said: str) -> None:
    """A server that names 26641 days is asked again after an hour, and the words say so."""
    head = {"Content-Type": "application/json", "Retry-After": named}
    answer = Reply(429, b"{}", WHERE, head, None)
    assert said in str(error_of(answer))
