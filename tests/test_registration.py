# SPDX-License-Identifier: LGPL-2.1-or-later
"""Registering a component: one item, whatever is interrupted, and whenever."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from silo.bom.errors import DocumentError, InputError, UnreachableError
from silo.bom.model import BomEntry
from silo.bom.naming import propose
from silo.registration import REGISTRATION_PROPERTY, Journal, component_key, register

ENTRY = BomEntry(doc_path="/v/bracket.FCStd", object_name="Body", document_label="Bracket")
PROPOSAL = propose(ENTRY, {"A01": "Mechanical assembly", "M01": "Machined parts"})


class Crash(BaseException):
    """The process ends here."""


class Items:
    """A server's items. ``own_ids`` is a server that gives UUIDs of its own."""

    def __init__(self, *, own_ids: bool = False) -> None:
        self.items: dict[str, dict[str, Any]] = {}
        self.own_ids = own_ids
        self.crash_after_create = False
        self.down = False

    def get_item_by_uuid(self, uuid: str) -> Mapping[str, Any] | None:
        return self.items.get(uuid)

    def search_items(self, query: str) -> list[Mapping[str, Any]]:
        return [item for item in self.items.values() if query in item["description"]]

    def create_item(
        self, schema: str, category: str, description: str, *, idempotency_key: str, **rest: Any
    ) -> Mapping[str, Any]:
        if self.down:
            raise UnreachableError("the server does not answer")
        uuid = f"own-{len(self.items)}" if self.own_ids else idempotency_key
        number = f"{category}-{len(self.items) + 1:04d}"
        self.items[uuid] = {"id": uuid, "part_number": number, "description": description, **rest}
        if self.crash_after_create:
            self.crash_after_create = False
            raise Crash
        return self.items[uuid]


class Files:
    """Identities by component; ``locked`` files refuse."""

    def __init__(self) -> None:
        self.identity: dict[str, str] = {}
        self.locked = False
        self.crash = False

    def stamp(self, entry: BomEntry, uuid: str) -> None:
        if self.crash:
            self.crash = False
            raise Crash
        if self.locked:
            raise DocumentError(entry.doc_path, "it is read-only")
        self.identity[component_key(entry)] = uuid


@pytest.fixture
def journal(tmp_path: Path) -> Journal:
    return Journal(tmp_path / "data" / "registrations.json")


def test_a_component_gets_an_item_and_its_file_names_it(journal: Journal) -> None:
    """The item's UUID is in the file, and nothing is left unfinished."""
    api, files = Items(), Files()
    done = register(PROPOSAL, api, journal, files.stamp)
    assert done.part_number == "M01-0001"
    assert files.identity == {component_key(ENTRY): done.item_id}
    assert journal.pending() == {}
    [item] = api.items.values()
    assert item["description"] == "Bracket"
    assert item["item_type"] == "part"
    assert item["properties"][REGISTRATION_PROPERTY] == done.item_id


@pytest.mark.parametrize("own_ids", [False, True])
@pytest.mark.parametrize("where", ["after create", "before stamp"])
def test_a_repeat_after_a_crash_creates_no_second_item(journal: Journal, own_ids: bool, where: str) -> None:
    """Between the item and the stamp the process may end; the next run finds the item again."""
    api, files = Items(own_ids=own_ids), Files()
    if where == "after create":
        api.crash_after_create = True
    else:
        files.crash = True
    with pytest.raises(Crash):
        register(PROPOSAL, api, journal, files.stamp)
    again = register(PROPOSAL, api, Journal(journal.path), files.stamp)
    assert len(api.items) == 1
    assert files.identity == {component_key(ENTRY): again.item_id}
    assert journal.pending() == {}


def test_a_read_only_file_is_told_and_its_item_is_used_later(journal: Journal) -> None:
    """The item is not lost: once the file can be written, the same item goes into it."""
    api, files = Items(), Files()
    files.locked = True
    failed = register(PROPOSAL, api, journal, files.stamp)
    assert "read-only" in str(failed.error)
    files.locked = False
    done = register(PROPOSAL, api, journal, files.stamp)
    assert done.error is None
    assert len(api.items) == 1


def test_a_server_that_does_not_answer_leaves_only_the_intent(journal: Journal) -> None:
    """Nothing is written into the file, and the next run uses the same UUID."""
    api, files = Items(), Files()
    api.down = True
    assert register(PROPOSAL, api, journal, files.stamp).error is not None
    intended = journal.pending()[component_key(ENTRY)]
    assert files.identity == {}
    api.down = False
    assert register(PROPOSAL, api, journal, files.stamp).item_id == intended


def test_a_damaged_journal_is_not_taken_for_an_empty_one(journal: Journal) -> None:
    """Half a file would otherwise make second items."""
    journal.path.parent.mkdir(parents=True)
    journal.path.write_text('{"half', encoding="utf-8")
    with pytest.raises(InputError, match="cannot be read"):
        journal.pending()
