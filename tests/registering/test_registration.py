# SPDX-License-Identifier: LGPL-2.1-or-later
"""Registering a component: one item, whatever is interrupted, and whenever."""

from __future__ import annotations

import multiprocessing
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, Raw

from silo.bom.errors import (
    AuthError,
    BusyError,
    ConflictError,
    DocumentError,
    InputError,
    NotSentError,
    ReadOnlyError,
    RejectedError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)
from silo.bom.model import BomEntry
from silo.bom.resolve import propose
from silo.fcstd import Library, stamp
from silo.registering.items import REGISTRATION_PROPERTY, component_key, register
from silo.registering.journal import Journal

ENTRY = BomEntry(doc_path="/v/bracket.FCStd", object_name="Body", document_label="Bracket")
PROPOSAL = propose(ENTRY, {"A01": "Mechanical assembly", "M01": "Machined parts"})


class Crash(BaseException):
    """The process ends here."""


class Items:
    """A server's items.

    own_ids
        it gives UUIDs of its own.
    shows
        where it shows properties: in "lists" and everywhere else, in the "item" alone, or nowhere ("").
    trouble
        raised after an item was made, once each.
    """

    def __init__(self, *, own_ids: bool = False, shows: str = "lists") -> None:
        self.items: dict[str, dict[str, Any]] = {}
        self.own_ids, self.shows = own_ids, shows
        self.trouble: list[BaseException] = []
        self.before: SiloError | None = None
        self.searches = True
        self.asked: list[str] = []

    def get_item_by_uuid(self, uuid: str) -> Mapping[str, Any] | None:
        return self._shown(self.items[uuid]) if uuid in self.items else None

    def get_properties(self, part_number: str) -> Mapping[str, Any]:
        self.asked.append(part_number)
        if not self.shows:
            raise ServerFaultError("does not show the properties")
        return next(i["properties"] for i in self.items.values() if i["part_number"] == part_number)

    def search_items(self, query: str = "", *, limit: int = 50, offset: int = 0) -> list[Mapping[str, Any]]:
        if query and not self.searches:
            return []
        found = [self._shown(item) for item in self.items.values() if query in item["description"]]
        return found[offset : offset + limit]

    def _shown(self, item: dict[str, Any]) -> dict[str, Any]:
        return item if self.shows == "lists" else {k: v for k, v in item.items() if k != "properties"}

    def create_item(
        self, schema: str, category: str, description: str, *, idempotency_key: str, **rest: Any
    ) -> Mapping[str, Any]:
        if self.before is not None:
            raise self.before
        uuid = f"own-{len(self.items)}" if self.own_ids else idempotency_key
        number = f"{category}-{len(self.items) + 1:04d}"
        made = datetime.now(UTC)
        known = {"id": uuid, "part_number": number, "description": description, "created_at": made, **rest}
        self.items[uuid] = known
        if self.trouble:
            raise self.trouble.pop(0)
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
    return Journal(tmp_path / "data" / "registrations.sqlite3")


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
        api.trouble = [Crash()]
    else:
        files.crash = True
    with pytest.raises(Crash):
        register(PROPOSAL, api, journal, files.stamp)
    again = register(PROPOSAL, api, Journal(journal.path), files.stamp)
    assert len(api.items) == 1
    assert files.identity == {component_key(ENTRY): again.item_id}
    assert journal.pending() == {}


def test_a_read_only_file_is_reported_and_its_item_is_used_later(journal: Journal) -> None:
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
    api.before = UnreachableError("the server does not answer")
    assert register(PROPOSAL, api, journal, files.stamp).error is not None
    intended = journal.pending()[component_key(ENTRY)]
    assert files.identity == {}
    api.before = None
    assert register(PROPOSAL, api, journal, files.stamp).item_id == intended


def test_a_damaged_journal_is_not_taken_for_an_empty_one(journal: Journal) -> None:
    """It would otherwise make second items."""
    journal.path.parent.mkdir(parents=True)
    journal.path.write_bytes(b"no database" * 100)
    with pytest.raises(InputError, match="cannot be read"):
        journal.pending()


# -- lost and odd answers --------------------------------------------------------------------------

LOST = [UnreachableError("502"), ServerFaultError("another body")]


@pytest.mark.parametrize("shows", ["lists", "item"])
@pytest.mark.parametrize("searches", [True, False])
@pytest.mark.parametrize("lost", LOST, ids=str)
def test_an_item_whose_answer_was_lost_is_found_at_once(
    journal: Journal, shows: str, searches: bool, lost: SiloError
) -> None:
    """The server gives its own UUIDs, may show properties on the item only, and may not find by name."""
    api, files = Items(own_ids=True, shows=shows), Files()
    api.trouble, api.searches = [lost], searches
    done = register(PROPOSAL, api, journal, files.stamp)
    assert (len(api.items), done.error, files.identity) == (1, None, {component_key(ENTRY): "own-0"})


@pytest.mark.parametrize("lost", LOST, ids=str)
def test_where_nothing_names_the_registration_a_person_is_asked(journal: Journal, lost: SiloError) -> None:
    """Run after run: no second item before somebody looked."""
    api, files = Items(own_ids=True, shows=""), Files()
    api.trouble = [lost]
    for _ in range(3):
        failed = register(PROPOSAL, api, journal, files.stamp)
        assert isinstance(failed.error, ConflictError)
        assert "M01-0001" in str(failed.error)
    assert len(api.items) == 1
    done = register(PROPOSAL, api, journal, files.stamp, ask=lambda _p, found: found[0])
    assert (done.part_number, done.found, len(api.items)) == ("M01-0001", True, 1)


def test_a_person_may_say_that_it_is_another_part(journal: Journal) -> None:
    """Then a new item is made."""
    api, files = Items(own_ids=True, shows=""), Files()
    api.trouble = [UnreachableError("502")]
    register(PROPOSAL, api, journal, files.stamp)
    done = register(PROPOSAL, api, journal, files.stamp, ask=lambda _p, _found: None)
    assert (done.part_number, len(api.items)) == ("M01-0002", 2)


def test_items_from_long_before_and_of_other_components_are_no_candidates(journal: Journal) -> None:
    """Nobody is asked about them."""
    api, files = Items(own_ids=True, shows=""), Files()
    old = api.create_item("s", "M01", "Bracket", idempotency_key="x")
    api.items[str(old["id"])]["created_at"] = datetime.now(UTC) - timedelta(days=3)
    other = replace(PROPOSAL, entry=replace(ENTRY, doc_path="/v/other.FCStd"))
    assert register(other, api, journal, files.stamp).error is None
    api.before = UnreachableError("gone")
    register(PROPOSAL, api, journal, files.stamp)
    api.before = None
    assert register(PROPOSAL, api, journal, files.stamp).part_number == "M01-0003"


@pytest.mark.parametrize("kind", [RejectedError, AuthError, BusyError, NotSentError, ReadOnlyError])
def test_an_item_that_was_certainly_not_made_leaves_no_intent(
    journal: Journal, kind: type[SiloError]
) -> None:
    """The next run need not look for it."""
    api, files = Items(), Files()
    api.before = kind("no")
    assert isinstance(register(PROPOSAL, api, journal, files.stamp).error, kind)
    assert journal.pending() == {}


def test_nothing_is_made_for_a_file_that_cannot_take_an_identity(journal: Journal) -> None:
    """It is asked before the server is."""
    api, files = Items(), Files()

    def check(entry: BomEntry) -> None:
        raise DocumentError(entry.doc_path, "it is read-only")

    failed = register(PROPOSAL, api, journal, files.stamp, check=check)
    assert "read-only" in str(failed.error)
    assert (api.items, journal.pending()) == ({}, {})


def test_a_server_that_keeps_our_ids_is_asked_for_them_alone(journal: Journal) -> None:
    """No property for people to wonder about, no list to read."""
    api, files = Items(), Files()
    api.keeps_item_ids = True  # type: ignore[attr-defined]
    api.trouble = [Crash()]
    with pytest.raises(Crash):
        register(PROPOSAL, api, journal, files.stamp)
    done = register(PROPOSAL, api, journal, files.stamp)
    assert (len(api.items), api.items[str(done.item_id)]["properties"]) == (1, {})


# -- a FreeCAD that saved over the identity --------------------------------------------------------


def simple_document(path: Path, uid: str = "11111111-2222-4333-8444-555555555555") -> bytes:
    """A part's file; its content."""
    written = Raw("App::PropertyUUID", f'<Uuid value="{uid}"/>')
    Doc("bracket", extra={"Uid": written}).add("Part::Feature", "Body").save(path)
    return path.read_bytes()


def test_an_identity_that_was_saved_over_is_written_again(journal: Journal, tmp_path: Path) -> None:
    """FreeCAD had the file open while it was registered: the same document, the same item."""
    path = tmp_path / "bracket.FCStd"
    before = simple_document(path)
    proposal = replace(PROPOSAL, entry=replace(ENTRY, doc_path=str(path)))
    api = Items()

    def write(entry: BomEntry, identity: str) -> None:
        stamp(entry.doc_path, identity)

    first = register(proposal, api, journal, write)
    path.write_bytes(before)  # FreeCAD saves what it has in memory
    again = register(proposal, api, Journal(journal.path), write)
    assert (again.item_id, again.found, len(api.items)) == (first.item_id, True, 1)
    with Library() as library:
        assert library.open(str(path)).Meta["SiloUUID"] == first.item_id


def test_another_document_in_the_same_place_gets_an_item_of_its_own(journal: Journal, tmp_path: Path) -> None:
    """The path alone proves nothing."""
    path = tmp_path / "bracket.FCStd"
    proposal = replace(PROPOSAL, entry=replace(ENTRY, doc_path=str(path)))
    api, files = Items(), Files()
    simple_document(path)
    first = register(proposal, api, journal, files.stamp)
    simple_document(path, uid="00000000-1111-4222-8333-444444444444")
    second = register(proposal, api, journal, files.stamp)
    assert (first.item_id != second.item_id, len(api.items)) == (True, 2)


# -- several processes -----------------------------------------------------------------------------


def _many(path: str, first: int, count: int) -> None:
    journal = Journal(Path(path))
    for number in range(first, first + count):
        with journal.turn():
            journal.begin(f"part {number}")


def test_two_processes_keep_all_their_intents(journal: Journal) -> None:
    """Nothing is lost between reading and writing."""
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=_many, args=(str(journal.path), n * 40, 40)) for n in range(2)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(120)
    assert len(journal.pending()) == 80


def test_two_runs_for_one_component_make_one_item(journal: Journal, tmp_path: Path) -> None:
    """The second waits, then finds what the first did."""
    path = tmp_path / "bracket.FCStd"
    simple_document(path)
    proposal = replace(PROPOSAL, entry=replace(ENTRY, doc_path=str(path)))
    api, files = Items(), Files()
    with ThreadPoolExecutor(2) as pool:
        done = list(pool.map(lambda _: register(proposal, api, Journal(journal.path), files.stamp), range(2)))
    assert (len(api.items), len({result.item_id for result in done})) == (1, 1)


def test_a_turn_that_never_ends_is_reported(journal: Journal) -> None:
    """With words, not with a traceback."""
    impatient = Journal(journal.path, patience=0.05)
    with journal.turn(), pytest.raises(InputError, match="another registration"), impatient.turn():
        pass


def test_a_slow_server_holds_nobody_up_at_another(tmp_path: Path) -> None:
    """Each server has a turn of its own; two projects at one server take turns."""
    journal, other = (Journal(tmp_path / "registrations", patience=0.0) for _ in range(2))
    with journal.turn("http://slow"):
        with other.turn("http://healthy"):
            pass
        with pytest.raises(InputError, match="another registration runs"), other.turn("http://slow"):
            pass
