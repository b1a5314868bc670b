# SPDX-License-Identifier: LGPL-2.1-or-later
"""The properties of an item are read in full, or not at all: a write replaces them all."""

from __future__ import annotations

from typing import Any

import pytest

from silo.api.client import SiloClient
from silo.bom.errors import NotFoundError, RemoteError, ServerFaultError

ITEM, REVISIONS = "GET /api/items/F01-0001", "GET /api/items/F01-0001/revisions"
BARE = {"id": "11111111-1111-4111-8111-111111111111", "part_number": "F01-0001", "current_revision": 2}
PAINTED = {"finish": "painted"}


def test_the_items_own_properties(server: Any, client: SiloClient) -> None:
    """One request where they are there."""
    server.on(ITEM, {**BARE, "properties": PAINTED})
    assert client.get_properties("F01-0001") == PAINTED
    assert len(server.seen) == 1


@pytest.mark.parametrize("own", [{}, {"properties": None}, {"properties": {}}], ids=repr)
def test_those_of_the_newest_revision(server: Any, client: SiloClient, own: dict[str, Any]) -> None:
    """Where the item's answer has none, which proves nothing."""
    server.on(ITEM, {**BARE, **own})
    server.on(
        REVISIONS,
        [{"revision_number": 1, "properties": {"old": 1}}, {"revision_number": 2, "properties": PAINTED}],
    )
    assert client.get_properties("F01-0001") == PAINTED


@pytest.mark.parametrize(("said", "read"), [(PAINTED, PAINTED), (None, {}), ({}, {})], ids=repr)
def test_a_list_without_content_leads_to_the_revision_itself(
    server: Any, client: SiloClient, said: Any, read: Any
) -> None:
    """Lists are often short."""
    server.on(ITEM, BARE)
    server.on(REVISIONS, [{"revision_number": 2}])
    server.on(f"{REVISIONS}/2", {"revision_number": 2, "properties": said})
    assert client.get_properties("F01-0001") == read


def test_properties_that_nobody_shows_are_not_none(server: Any, client: SiloClient) -> None:
    """Then nothing may be written."""
    server.on(ITEM, BARE)
    server.on(REVISIONS, [{"revision_number": 2}])
    server.on(f"{REVISIONS}/2", {"revision_number": 2})
    with pytest.raises(ServerFaultError, match="nothing was written"):
        client.get_properties("F01-0001")


def test_no_revision_has_no_properties(server: Any, client: SiloClient) -> None:
    """A new item."""
    server.on(ITEM, {**BARE, "current_revision": 0})
    server.on(REVISIONS, [])
    assert client.get_properties("F01-0001") == {}


def test_failures_pass(server: Any, client: SiloClient, answer: Any) -> None:
    """An unknown item, and a server that fails half-way."""
    with pytest.raises(NotFoundError):
        client.get_properties("F01-0001")
    server.on(ITEM, BARE)
    server.on(REVISIONS, answer(500))
    with pytest.raises(RemoteError):
        client.get_properties("F01-0001")
