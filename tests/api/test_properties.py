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


NEWEST = [{"revision_number": 1, "properties": {"old": 1}}, {"revision_number": 2, "properties": PAINTED}]


@pytest.mark.parametrize(
    ("own", "listed", "single", "read"),
    [
        ({"properties": PAINTED}, None, None, PAINTED),
        # The item's answer has none, which proves nothing: those of the newest revision.
        ({}, NEWEST, None, PAINTED),
        ({"properties": None}, NEWEST, None, PAINTED),
        ({"properties": {}}, NEWEST, None, PAINTED),
        # Lists are often short: the revision itself.
        ({}, [{"revision_number": 2}], PAINTED, PAINTED),
        ({}, [{"revision_number": 2}], {}, {}),
        ({"current_revision": 0}, [], None, {}),
    ],
)
def test_the_properties_of_an_item(
    server: Any, client: SiloClient, own: dict[str, Any], listed: Any, single: Any, read: dict[str, Any]
) -> None:
    """Wherever the server shows them, with no more requests than that takes."""
    server.on(ITEM, {**BARE, **own})
    server.on(REVISIONS, listed)
    server.on(f"{REVISIONS}/2", {"revision_number": 2, "properties": single})
    assert client.get_properties("F01-0001") == read
    assert len(server.seen) == 1 + (listed is not None) + (single is not None)


def test_properties_that_nobody_shows_are_not_none(server: Any, client: SiloClient) -> None:
    """Then nothing may be written."""
    server.on(ITEM, BARE)
    server.on(REVISIONS, [{"revision_number": 2}])
    server.on(f"{REVISIONS}/2", {"revision_number": 2})
    with pytest.raises(ServerFaultError, match="nothing was written"):
        client.get_properties("F01-0001")


def test_failures_pass(server: Any, client: SiloClient, answer: Any) -> None:
    """An unknown item, and a server that fails half-way."""
    with pytest.raises(NotFoundError):
        client.get_properties("F01-0001")
    server.on(ITEM, BARE)
    server.on(REVISIONS, answer(500))
    with pytest.raises(RemoteError):
        client.get_properties("F01-0001")
