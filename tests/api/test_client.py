# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the client asks, and what it makes of other servers' answers."""

from __future__ import annotations

import threading
from typing import Any
from uuid import uuid4

import pytest

from silo.api.client import SiloClient
from silo.api.wire import MergeEntry, MergeRequest
from silo.bom.errors import (
    InputError,
    NotFoundError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
    UnreachableError,
)
from silo.bom.items.schema import categories_of

UUIDS = [str(uuid4()) for _ in range(2000)]


def item(uuid: str, name: str | None = None) -> dict[str, Any]:
    return {"id": uuid, "part_number": f"P-{uuid[:8]}", "description": None, "name": name}


def route_missing(answer: Any) -> Any:
    return answer(405, "Method Not Allowed", {"Content-Type": "text/plain"})


def test_two_thousand_identities_cost_two_requests(server: Any, client: SiloClient) -> None:
    """1000 each; the answers are put together under the identities as given."""
    server.on(
        "POST /api/items/by-uuid",
        {"items": [item(u) for u in UUIDS[:1000]]},
        {"items": [item(u) for u in UUIDS[1000:1900]]},
    )
    found = client.get_items_by_uuid([*UUIDS, *UUIDS])
    assert list(found) == UUIDS[:1900]
    assert [len(seen.json()["uuids"]) for seen in server.seen] == [1000, 1000]


def test_nothing_to_look_up_is_no_request(server: Any, client: SiloClient) -> None:
    """Empty, and empty texts."""
    assert client.get_items_by_uuid(["", ""]) == {}
    assert server.seen == []


def test_without_the_batch_a_bounded_pool_asks_and_remembers(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """Never one after another, never all at once; the missing route is asked for once only."""
    together, most, now = threading.Barrier(8, timeout=60), 0, 0
    lock = threading.Lock()

    def enter() -> None:
        nonlocal most, now
        with lock:
            now += 1
            most = max(most, now)
        # Eight have to be inside at one time, or this breaks: that they are asked together is proven.
        together.wait()
        with lock:
            now -= 1

    server.on("POST /api/items/by-uuid", route_missing(answer))
    for uuid in UUIDS[:16]:
        server.on(f"GET /api/items/by-uuid/{uuid}", answer(200, item(uuid), before=enter))
    assert len(client.get_items_by_uuid(UUIDS[:16])) == 16
    assert most == 8
    client.get_items_by_uuid([str(uuid4())])
    assert len(server.paths("POST")) == 1


def test_look_alikes_of_a_thousand_components_cost_a_request(server: Any, client: SiloClient) -> None:
    """Whole vaults are registered; a search for each would take the night."""
    like = {"id": UUIDS[0], "part_number": "M01-0001", "name": "Lid", "same_file": True}
    server.on(
        "POST /api/items/look-alikes",
        {"look_alikes": [[like], *([[]] * 999)]},
        {"look_alikes": [[]] * 200},
    )
    wanted = [(f"Lid {n}", "") for n in range(1200)]
    found = client.find_look_alikes([*wanted, *wanted])
    assert [key for key, likes in found.items() if likes] == [("Lid 0", "")]
    assert [len(seen.json()["wanted"]) for seen in server.seen] == [1000, 200]


def test_an_answer_of_another_length_is_no_answer(server: Any, client: SiloClient) -> None:
    """The look-alikes of one component must not be taken for another's."""
    server.on("POST /api/items/look-alikes", {"look_alikes": [[]]})
    with pytest.raises(ServerFaultError, match="wanted 2 lists"):
        client.find_look_alikes([("A", ""), ("B", "")])


def test_without_that_request_each_component_is_searched_for(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """By name and by file, as the real Silo does; the missing route is asked for once only."""
    server.on("POST /api/items/look-alikes", route_missing(answer))
    server.on("GET /api/items/search", [item(UUIDS[0], "LID"), item(UUIDS[1], "Lid 2")])
    for _ in range(2):
        (likes,) = client.find_look_alikes([("Lid", "")]).values()
        assert [(one.id, one.same_file) for one in likes] == [(UUIDS[0], False)]
    assert len(server.paths("POST")) == 1


@pytest.mark.parametrize("written", ["{}", "sha256:{}"])
def test_the_same_file_is_seen_however_the_server_writes_its_hash(
    server: Any, client: SiloClient, answer: Any, written: str
) -> None:
    """In capitals, or with the kind of the hash before it; without that, a second item is made for it."""
    digest = "ab" * 32
    server.on("POST /api/items/look-alikes", route_missing(answer))
    server.on("GET /api/items/search", [item(UUIDS[0], "Cover")])
    revision = {"revision_number": 1, "file_checksum": written.format(digest.upper())}
    server.on(f"GET /api/items/P-{UUIDS[0][:8]}/revisions", [revision])
    (likes,) = client.find_look_alikes([("Lid", digest)]).values()
    assert [(one.id, one.same_file) for one in likes] == [(UUIDS[0], True)]


def test_the_boms_of_many_items_cost_one_request_or_one_each(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """A server without the request is asked one by one; an item that is not known is left out."""
    line = {"child_part_number": "C", "quantity": 2}
    server.on("POST /api/items/boms", {"boms": {"A": [line]}}, route_missing(answer))
    assert [one.quantity for one in client.get_boms(["A", "B", "A"])["A"]] == [2]
    assert [seen.json()["part_numbers"] for seen in server.seen] == [["A", "B"]]
    server.on("GET /api/items/A/bom", [line])
    server.on("GET /api/items/B/bom", answer(404, {"error": "not_found"}))
    assert list(client.get_boms(["A", "B"])) == ["A"]
    assert list(client.get_boms(["A", "B"])) == ["A"]
    assert len(server.paths("POST")) == 2, "the missing route is asked for once only"


def test_boms_that_are_too_many_for_one_answer_are_asked_for_in_halves(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """Not one by one: a server bounds the lines of an answer, and a thousand BOMs may be just above it."""
    line = {"child_part_number": "C", "quantity": 2}
    many = answer(413, {"error": "too_large", "message": "these BOMs have 12000 lines; ask for fewer"})
    halves = ({"boms": {name: [line] for name in some}} for some in ("AB", "CD"))
    server.on("POST /api/items/boms", many, *halves)
    assert list(client.get_boms("ABCD")) == list("ABCD")
    assert [seen.json()["part_numbers"] for seen in server.seen] == [list("ABCD"), list("AB"), list("CD")]


def test_a_server_that_keeps_no_summaries_is_no_failure(server: Any, client: SiloClient, answer: Any) -> None:
    """The real Silo has no such request; an item that is not known is still an error."""
    server.on("GET /api/items/A/bom/summary", route_missing(answer), answer(404, {"error": "not_found"}))
    assert client.get_summary("A") is None
    with pytest.raises(NotFoundError):
        client.get_summary("A")


def test_the_bom_of_another_item_is_no_answer(server: Any, client: SiloClient) -> None:
    """From a proxy's cache, say: it would be compared with the wrong assembly."""
    line = {"child_part_number": "C", "quantity": 2, "parent_part_number": "a01-0001"}
    server.on("GET /api/items/A01-0001/bom", [line])
    server.on("GET /api/items/A01-0002/bom", [line])
    server.on("POST /api/items/boms", {"boms": {"A01-0001": [line], "A01-0002": [line]}})
    assert len(client.get_bom("A01-0001")) == 1
    for ask in (client.get_bom, lambda number: client.get_boms(["A01-0001", number])):
        with pytest.raises(ServerFaultError, match="A01-0002: the server answered with the BOM of a01-0001"):
            ask("A01-0002")


def test_another_item_is_no_answer(server: Any, client: SiloClient) -> None:
    """A file would be sent to it."""
    server.on(f"GET /api/items/by-uuid/{UUIDS[0]}", item(UUIDS[1]))
    server.on(f"GET /api/items/by-uuid/{UUIDS[1].upper()}", item(UUIDS[1]))
    assert client.get_item_by_uuid(UUIDS[1].upper()) is not None
    with pytest.raises(ServerFaultError, match=f"answered with the item {UUIDS[1]}"):
        client.get_item_by_uuid(UUIDS[0])


def test_one_malformed_identity_does_not_spoil_the_others(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """A server may refuse the whole batch for it; then they are asked one by one."""
    server.on("POST /api/items/by-uuid", answer(400, {"error": "bad uuid"}))
    server.on("GET /api/items/by-uuid/garbage", answer(400, {"error": "bad uuid"}))
    server.on(f"GET /api/items/by-uuid/{UUIDS[0]}", item(UUIDS[0]))
    assert list(client.get_items_by_uuid([UUIDS[0], "garbage"])) == [UUIDS[0]]


def test_a_failed_look_up_is_an_error_not_an_unknown_item(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """Otherwise a broken network would read as "not registered"."""
    server.on("POST /api/items/by-uuid", route_missing(answer))
    server.on("*", answer(drop=True))
    with pytest.raises(UnreachableError):
        client.get_items_by_uuid(UUIDS[:20])


@pytest.mark.parametrize("body", ["404 page not found\n", {"detail": "Not Found"}])
def test_a_server_without_identities_is_reported(
    server: Any, client: SiloClient, answer: Any, body: Any
) -> None:
    """A missing route must not read as "not registered" either."""
    server.on("*", answer(404, body, {"Content-Type": "text/plain"} if isinstance(body, str) else {}))
    with pytest.raises(RouteMissingError):
        client.get_item_by_uuid(UUIDS[0])


def test_a_web_page_404_counts_only_from_a_silo(server: Any, client: SiloClient, answer: Any) -> None:
    """Some servers answer pages; whether it is a Silo at all is asked once."""
    page = answer(404, "<html><title>404</title>", {"Content-Type": "text/html"})
    server.on(f"GET /api/items/by-uuid/{UUIDS[0]}", page)
    server.on(f"GET /api/items/by-uuid/{UUIDS[1]}", page)
    server.on("GET /api/items", [])
    assert client.get_item_by_uuid(UUIDS[0]) is None
    assert client.get_item_by_uuid(UUIDS[1]) is None
    assert server.paths().count("GET /api/items?limit=1") == 1


def test_a_web_page_404_from_something_else_is_an_error(server: Any, client: SiloClient, answer: Any) -> None:
    """A wrong address must not make everything unregistered."""
    server.on("*", answer(404, "<html><title>404</title>", {"Content-Type": "text/html"}))
    with pytest.raises(RouteMissingError, match="is this the address of a Silo server"):
        client.get_item_by_uuid(UUIDS[0])


MERGE = "POST /api/items/A01-0001/bom/merge"
REQUEST = MergeRequest(entries=[MergeEntry(child_part_number="F01-0001", quantity=1)], sync_id="s")


@pytest.mark.parametrize(
    ("status", "known", "kind", "words"),
    [
        (404, False, NotFoundError, "has no item A01-0001; register"),
        (404, True, RouteMissingError, "not how to merge a BOM"),
        (405, True, RouteMissingError, "not how to merge a BOM"),
    ],
)
def test_a_missing_route_is_not_a_missing_assembly(
    server: Any, client: SiloClient, answer: Any, status: int, known: bool, kind: type[Exception], words: str
) -> None:
    """The merge is not there: the item's own address says whether the assembly is, or the server is older."""
    missing = answer(404, {"error": "not_found"})
    server.on(MERGE, answer(status, {"error": "not_found"}))
    server.on("GET /api/items/A01-0001", {"id": "u", "part_number": "A01-0001"} if known else missing)
    with pytest.raises(kind, match=words) as caught:
        client.merge_bom("A01-0001", REQUEST)
    assert type(caught.value) is kind


def test_the_version_goes_along_as_a_tag(server: Any, client: SiloClient) -> None:
    """If-Match, quoted once whatever was given; the BOM's version is read from ETag or body."""
    server.on(MERGE, {"status": "merged", "diff": {"added": []}})
    for version in (7, "7", '"7"'):
        client.merge_bom("A01-0001", REQUEST, if_match=version)
    assert [seen.headers["If-Match"] for seen in server.seen] == ['"7"'] * 3


@pytest.mark.parametrize(
    ("headers", "body", "version"),
    [
        ({"ETag": '"12"'}, [], "12"),
        ({"ETag": 'W/"12"'}, [], "12"),
        ({}, {"version": 12}, "12"),
        ({}, [], None),
    ],
)
def test_the_version_of_a_bom(
    server: Any, client: SiloClient, answer: Any, headers: dict[str, str], body: Any, version: str | None
) -> None:
    """In either place, or none."""
    server.on("GET /api/items/A/bom", answer(200, body, headers))
    assert client.get_bom_version("A") == version


@pytest.mark.parametrize(
    "schema",
    [
        {"categories": {"F01": "Screws", "A01": "Assemblies"}},
        {"categories": [{"code": "F01", "name": "Screws"}, {"code": "A01", "description": "Assemblies"}]},
        {
            "segments": [
                {"name": "serial"},
                {"name": "category", "values": {"F01": "Screws", "A01": "Assemblies"}},
            ]
        },
        {"segments": {"category": {"values": {"F01": {"label": "Screws"}, "A01": {"name": "Assemblies"}}}}},
    ],
)
def test_categories_are_read_in_every_form(schema: dict[str, Any]) -> None:
    """Code to text, in order."""
    assert list(categories_of(schema).items()) == [("F01", "Screws"), ("A01", "Assemblies")]
    assert categories_of({"segments": "odd", "categories": None}) == {}
    assert categories_of({"categories": ["F01"]}) == {"F01": ""}


def test_the_search_falls_back_to_the_list(server: Any, client: SiloClient, answer: Any) -> None:
    """A server without /search takes "search" for a part number and has none."""
    server.on("GET /api/items/search", answer(404, {"error": "not_found"}))
    server.on("GET /api/items", {"items": [item(UUIDS[0])], "total": 1})
    assert client.search_items("bolt & nut", limit=5)[0].id == UUIDS[0]
    assert server.paths()[1] == "GET /api/items?limit=5&offset=0&search=bolt+%26+nut"


def test_a_change_without_content_is_read_back(server: Any, client: SiloClient, answer: Any) -> None:
    """204 after PUT."""
    server.on("PUT /api/items/A", answer(204))
    server.on("GET /api/items/B", {"id": "u", "part_number": "B"})
    assert client.update_item("A", part_number="B").part_number == "B"


def test_what_json_cannot_hold_is_not_sent(server: Any, client: SiloClient) -> None:
    """NaN is no JSON, and a server would refuse or, worse, read it as something."""
    for odd in (float("nan"), float("inf"), {1, 2}, object()):
        with pytest.raises(InputError):
            client.create_item("kindred-rd", "F01", "Bolt", properties={"mass": odd})
    with pytest.raises(InputError, match="category"):
        client.create_item("kindred-rd", "", "Bolt")
    assert server.seen == []


def test_a_server_that_is_not_ready_says_why(server: Any, client: SiloClient, answer: Any) -> None:
    """503 with a mode is an answer; without one it is an absent server. Neither address is below /api."""
    html = answer(503, "<html>", {"Content-Type": "text/html"})
    server.on("GET /ready", answer(503, {"status": "not ready", "mode": "degraded"}), html)
    assert client.ready().mode == "degraded"
    with pytest.raises(UnreachableError):
        client.ready()


# -- other moods of the real server ---------------------------------------------------------------------

FOUND = {"id": "11111111-1111-4111-8111-111111111111", "part_number": "F01-0001"}


def test_an_empty_list_may_be_null(server: Any, client: SiloClient) -> None:
    """Go's nil."""
    for path in ("bom", "revisions"):
        server.on(f"GET /api/items/A01-0001/{path}", "null")
    server.on("GET /api/items/search", "null")
    number = "A01-0001"
    for empty in (
        client.get_bom(number),
        client.revisions(number),
        client.search_items("x"),
    ):
        assert empty == []
    # For a batch it may be no answer at all, and "not registered" would be a lie.
    server.on(f"GET /api/items/by-uuid/{FOUND['id']}", FOUND)
    server.on("POST /api/items/by-uuid", "null", {"items": None, "total": 0})
    for _ in range(2):
        assert list(client.get_items_by_uuid([FOUND["id"]])) == [FOUND["id"]]


@pytest.mark.parametrize("status", [403, 503, 404, 405, 429])
def test_identities_are_read_by_get_where_a_post_is_refused(
    server: Any, client: SiloClient, answer: Any, status: int
) -> None:
    """To viewers, and on a read-only server; asked once."""
    server.on("POST /api/items/by-uuid", answer(status, {"error": "no"}))
    server.on(f"GET /api/items/by-uuid/{FOUND['id']}", FOUND)
    for _ in range(2):
        assert list(client.get_items_by_uuid([FOUND["id"]])) == [FOUND["id"]]
    assert len(server.paths("POST")) == (3 if status == 429 else 1)  # a busy server is asked again first


STRICT = [
    (400, {"error": "bad_request", "message": 'json: unknown field "sync_id"'}),
    (422, {"detail": [{"loc": ["body", "id"], "msg": "Extra inputs are not permitted"}]}),
    (400, "additional properties are not allowed"),
]


@pytest.mark.parametrize(("status", "said"), STRICT)
def test_a_strict_server_gets_no_extensions(
    server: Any, client: SiloClient, answer: Any, status: int, said: Any
) -> None:
    """One bare repeat, and from then on bare at once."""
    server.on("POST /api/items", answer(status, said), answer(201, FOUND))
    merge = "POST /api/items/A01-0001/bom/merge"
    server.on(merge, {"diff": {"added": []}})
    client.create_item("kindred-rd", "F01", "Bolt", idempotency_key=FOUND["id"], properties={"id": 1})
    assert server.seen[0].json()["id"] == FOUND["id"]
    assert (server.seen[1].json(), len(server.seen)) == (
        {
            "schema": "kindred-rd",
            "category": "F01",
            "description": "Bolt",
            "item_type": "part",
            "properties": {"id": 1},
        },
        2,
    )
    client.merge_bom(
        "A01-0001",
        MergeRequest(entries=[MergeEntry(child_part_number="F01-0001", quantity=2)], sync_id="s"),
    )
    assert server.seen[2].json() == {"entries": [{"child_part_number": "F01-0001", "quantity": 2}]}


def test_another_refusal_is_not_repeated(server: Any, client: SiloClient, answer: Any) -> None:
    """The category is unknown, not the key."""
    server.on("POST /api/items", answer(400, {"error": "bad_request", "message": "unknown category Q99"}))
    with pytest.raises(RejectedError, match="Q99"):
        client.create_item("kindred-rd", "Q99", "Bolt", idempotency_key=FOUND["id"])
    assert len(server.seen) == 1


def test_a_dry_run_never_becomes_a_merge(server: Any, client: SiloClient, answer: Any) -> None:
    """Without its key it would be one."""
    server.on("POST /api/items/A01-0001/bom/merge", answer(400, 'unknown field "dry_run"'))
    with pytest.raises(RejectedError):
        client.merge_bom("A01-0001", MergeRequest(entries=[], dry_run=True))
    assert len(server.seen) == 1


@pytest.mark.parametrize("body", [{"item": FOUND}, {"data": FOUND}, {"part_number": "F01-0001"}], ids=repr)
def test_a_new_item_may_come_wrapped(server: Any, client: SiloClient, answer: Any, body: Any) -> None:
    """Created is created."""
    server.on("POST /api/items", answer(201, body))
    server.on("GET /api/items/F01-0001", FOUND)
    assert client.create_item("kindred-rd", "F01", "Bolt").id == FOUND["id"]


@pytest.mark.parametrize(
    "listed",
    [[{"name": "acme"}], ["acme"], {"schemas": [{"name": "acme"}]}, {"acme": {"version": 2}}],
    ids=repr,
)
def test_the_only_schema_is_taken(server: Any, client: SiloClient, listed: Any) -> None:
    """Whatever its name; asked once."""
    server.on("GET /api/schemas", listed)
    assert [client.find_schema("kindred-rd") for _ in range(2)] == ["acme", "acme"]
    assert len(server.seen) == 2


def test_one_of_several_schemas_is_a_persons_choice(server: Any, client: SiloClient) -> None:
    """They are named, and how to choose."""
    server.on("GET /api/schemas", [{"name": "acme"}, {"name": "beta"}])
    with pytest.raises(InputError, match=r"acme, beta.*--schema"):
        client.find_schema("kindred-rd")
    server.on("GET /api/schemas/beta", {"name": "beta"})
    assert client.find_schema("beta") == "beta"
