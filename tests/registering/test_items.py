# SPDX-License-Identifier: LGPL-2.1-or-later
"""Registering a component: one item, whatever is interrupted, and whenever."""

from __future__ import annotations

import errno
import json
import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, Raw

from silo.bom.entry import BomEntry
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
from silo.bom.items.proposal import propose
from silo.fcstd import Library, stamp
from silo.platform.locks import hold_lock
from silo.registering.items import REGISTRATION_PROPERTY, Registration, finished, register
from silo.registering.journal import RESERVED, Journal, component_key

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
    silent
        nothing that asks for items is answered.
    during
        called with the wanted UUID while an item is made.
    """

    def __init__(self, *, own_ids: bool = False, shows: str = "lists") -> None:
        self.items: dict[str, dict[str, Any]] = {}
        self.own_ids, self.shows = own_ids, shows
        self.trouble: list[BaseException] = []
        self.before: SiloError | None = None
        self.searches = True
        self.silent = False
        self.during: Callable[[str], object] = lambda _uuid: None
        self.asked: list[str] = []

    def get_item_by_uuid(self, uuid: str) -> Mapping[str, Any] | None:
        if self.silent:
            raise UnreachableError("no answer")
        return self._shown(self.items[uuid]) if uuid in self.items else None

    def get_properties(self, part_number: str) -> Mapping[str, Any]:
        self.asked.append(part_number)
        if not self.shows:
            raise ServerFaultError("does not show the properties")
        return next(i["properties"] for i in self.items.values() if i["part_number"] == part_number)

    def search_items(self, query: str = "", *, limit: int = 50, offset: int = 0) -> list[Mapping[str, Any]]:
        if self.silent:
            raise UnreachableError("no answer")
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
        self.during(idempotency_key)
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
    intended = journal.pending()
    # A later refusal proves nothing: the first run's item may be there under another name.
    api.before = RejectedError("no")
    assert isinstance(register(PROPOSAL, api, journal, files.stamp).error, RejectedError)
    assert (journal.pending(), files.identity) == (intended, {})
    api.before = None
    done = register(PROPOSAL, api, journal, files.stamp)
    assert intended == {component_key(ENTRY): done.item_id}


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


def test_an_identity_that_was_saved_over_is_a_question(journal: Journal, tmp_path: Path) -> None:
    """FreeCAD had the file open while it was registered, or a copy lies in its place: both look the same."""
    path = tmp_path / "bracket.FCStd"
    before = simple_document(path)
    proposal = replace(PROPOSAL, entry=replace(ENTRY, doc_path=str(path)))
    api = Items()

    def write(entry: BomEntry, identity: str) -> None:
        stamp(entry.doc_path, identity)

    first = register(proposal, api, journal, write)
    path.write_bytes(before)  # FreeCAD saves what it has in memory
    asked = register(proposal, api, Journal(journal.path), write)
    assert "M01-0001 may be its item" in str(asked.error)
    assert (path.read_bytes(), len(api.items)) == (before, 1)
    again = register(proposal, api, Journal(journal.path), write, ask=lambda _p, found: found[0])
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


def test_two_users_of_a_journal_keep_all_their_intents(journal: Journal) -> None:
    """Nothing is lost between reading and writing."""

    def many(names: range) -> None:
        mine = Journal(journal.path)
        for name in names:
            mine.begin(f"part {name}")

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(many, (range(20), range(20, 40))))
    assert len(journal.pending()) == 40


def test_two_runs_for_one_component_make_one_item(journal: Journal, tmp_path: Path) -> None:
    """The second waits, then finds what the first did."""
    path = tmp_path / "bracket.FCStd"
    simple_document(path)
    proposal = replace(PROPOSAL, entry=replace(ENTRY, doc_path=str(path)))
    api = Items()

    def write(entry: BomEntry, identity: str) -> None:
        stamp(entry.doc_path, identity)

    with ThreadPoolExecutor(2) as pool:
        done = list(pool.map(lambda _: register(proposal, api, Journal(journal.path), write), range(2)))
    assert (len(api.items), len({result.item_id for result in done})) == (1, 1)


def test_a_turn_that_never_ends_is_reported(tmp_path: Path) -> None:
    """With words, not with a traceback; it is that of one folder, whatever the server of another does."""
    one, other = (Journal(tmp_path / name, patience=0.0) for name in ("one", "another computer"))
    (tmp_path / "slow").mkdir()
    (tmp_path / "healthy").mkdir()
    with one.turn(str(tmp_path / "slow" / "a.FCStd"), "a") as turn:
        assert turn.unseen == ""
        with other.turn(str(tmp_path / "healthy" / "a.FCStd"), "a"):
            pass
        busy = other.turn(str(tmp_path / "slow" / "b.FCStd"), "b")
        with pytest.raises(InputError, match="slow is being registered by process"), busy:
            pass
    assert list((tmp_path / "slow").iterdir()) == []


# -- another computer ------------------------------------------------------------------------------


class Shared:
    """One file on a shared disk, and a server.

    lockable
        others see the folder's lock.
    """

    def __init__(self, folder: Path, *, own_ids: bool = False, lockable: bool = False) -> None:
        self.path = folder / "shared" / "bracket.FCStd"
        self.path.parent.mkdir()
        simple_document(self.path)
        if not lockable:
            (self.path.parent / ".silo-register.lock").mkdir()
        self.proposal = replace(PROPOSAL, entry=replace(ENTRY, doc_path=str(self.path)))
        self.api = Items(own_ids=own_ids)
        self.folder = folder

    def journal(self, computer: str) -> Journal:
        return Journal(self.folder / computer / "journal", patience=0.0)

    @staticmethod
    def write(entry: BomEntry, identity: str) -> None:
        stamp(entry.doc_path, identity, replace=bool(entry.silo_uuid))

    def register(self, computer: str, **how: Any) -> Registration:
        """As that computer, which has read the file before anybody registered it."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_CACHE_HOME", str(self.folder / computer))
            return register(self.proposal, self.api, self.journal(computer), self.write, **how)

    @property
    def identity(self) -> str | None:
        with Library() as library:
            return library.open(str(self.path)).Meta.get("SiloUUID")

    def made_elsewhere(self) -> str:
        """Make an item as another computer does; its UUID."""
        made = self.api.create_item(
            "s", "M01", "Bracket", idempotency_key="11111111-2222-4333-8444-999999999999"
        )
        return str(made["id"])

    def carries(self, identity: str) -> None:
        """Let the component be read with this identity."""
        self.proposal = replace(self.proposal, entry=replace(self.proposal.entry, silo_uuid=identity))


@pytest.mark.parametrize("own_ids", [False, True])
def test_where_nobody_sees_a_lock_the_file_has_the_identity_first(tmp_path: Path, own_ids: bool) -> None:
    """The second computer asks while the first one's item is made: it makes none, and says what to do."""
    shared = Shared(tmp_path, own_ids=own_ids)
    inside: list[Registration] = []

    def second(wanted: str) -> None:
        assert shared.identity == wanted
        inside.append(shared.register("second"))

    shared.api.during = second
    first = shared.register("first")
    assert (first.error, shared.identity) == (None, first.item_id)
    assert "--adopt takes it over" in str(inside[0].error)
    second = shared.register("second")
    assert (second.item_id, second.found, len(shared.api.items)) == (first.item_id, True, 1)
    assert shared.journal("second").pending() == shared.journal("first").pending() == {}


@pytest.mark.parametrize("own_ids", [False, True])
@pytest.mark.parametrize("lost", [Crash(), RejectedError("no")], ids=["crash", "refused"])
def test_what_was_reserved_in_the_file_is_continued(
    tmp_path: Path, own_ids: bool, lost: BaseException
) -> None:
    """By the computer that did it: its journal knows the identity, so this is no file of another server."""
    shared = Shared(tmp_path, own_ids=own_ids)
    shared.api.before = lost  # type: ignore[assignment]
    with suppress(Crash):
        shared.register("first")
    (reserved,) = shared.journal("first").pending().values()
    assert shared.identity == reserved
    shared.api.before = None
    shared.carries(reserved)
    done = shared.register("first")
    assert (done.error, len(shared.api.items), shared.identity) == (None, 1, done.item_id)
    assert own_ids or done.item_id == reserved


def test_who_writes_the_file_last_has_it(tmp_path: Path) -> None:
    """Two computers may write at one moment; who finds another identity than its own makes no item."""
    shared = Shared(tmp_path)
    other = shared.made_elsewhere()

    def write(entry: BomEntry, identity: str) -> None:
        stamp(entry.doc_path, identity, replace=True)
        stamp(entry.doc_path, other, replace=True)

    done = register(shared.proposal, shared.api, shared.journal("first"), write)
    assert (done.item_id, done.found, len(shared.api.items)) == (other, True, 1)
    assert shared.journal("first").pending() == {}


def test_a_folder_that_another_computer_registers_is_left_alone(tmp_path: Path) -> None:
    """The lock is held from the look at the file to its identity."""
    shared = Shared(tmp_path, lockable=True)
    inside: list[Registration] = []

    def second(_wanted: str) -> None:
        assert shared.identity is None
        inside.append(shared.register("second"))

    shared.api.during = second
    first = shared.register("first")
    assert "is being registered by process" in str(inside[0].error)
    assert (shared.register("second").item_id, len(shared.api.items)) == (first.item_id, 1)


@pytest.fixture
def interrupted(tmp_path: Path, request: pytest.FixtureRequest) -> Shared:
    """The first computer's request made the item, and its answer and all that asked for it were lost."""
    shared = Shared(tmp_path, own_ids=getattr(request, "param", False), lockable=True)
    shared.api.trouble.append(UnreachableError("the answer was lost"))
    shared.api.silent = True
    # Another request than the creation asks first; that one still arrives.
    assert isinstance(shared.register("first").error, UnreachableError)
    shared.api.silent = False
    assert (len(shared.api.items), shared.identity) == (1, None)
    return shared


def reserved(shared: Shared) -> Path:
    return shared.path.parent / RESERVED


@pytest.mark.parametrize("interrupted", [False, True], indirect=True, ids=["its ids", "ids of the server"])
def test_another_computer_continues_what_was_interrupted(interrupted: Shared) -> None:
    """It finds the item; the first one then has nothing to do, and the folder is as it was. No item is an
    orphan then: the file names it, or its server knows no item of the journal's UUID."""
    done = interrupted.register("second")
    assert (done.found, len(interrupted.api.items), interrupted.identity) == (True, 1, done.item_id)
    assert not reserved(interrupted).exists()
    again = interrupted.register("first")
    assert (again.item_id, len(interrupted.api.items)) == (done.item_id, 1)
    (record,) = interrupted.journal("first").unfinished()
    ended = finished(record, interrupted.journal("first"))
    assert ended == (done.item_id == record.item_id) == (record.item_id in interrupted.api.items)
    assert len(interrupted.journal("first").unfinished()) == (0 if ended else 1)


def test_another_document_of_the_same_name_continues_nothing(interrupted: Shared) -> None:
    """A file that took its place is another part; the journal of the first computer names the spare item."""
    simple_document(interrupted.path, uid="99999999-2222-4333-8444-555555555555")
    done = interrupted.register("second")
    assert (done.found, len(interrupted.api.items)) == (False, 2)
    (record,) = interrupted.journal("first").unfinished()
    assert not finished(record, interrupted.journal("first"))
    assert record.item_id != done.item_id


def test_what_is_begun_with_other_parts_stays(interrupted: Shared) -> None:
    """One file for the folder: each computer changes its own entry."""
    interrupted.api.before = RejectedError("no")
    other = interrupted.path.parent / "other.FCStd"
    simple_document(other)
    elsewhere = replace(interrupted.proposal, entry=replace(ENTRY, doc_path=str(other)))
    before = reserved(interrupted).read_bytes()
    assert register(elsewhere, interrupted.api, interrupted.journal("second"), Shared.write).error is not None
    assert reserved(interrupted).read_bytes() == before
    interrupted.api.before = None
    interrupted.api.silent = True
    interrupted.api.trouble.append(UnreachableError("lost"))
    register(elsewhere, interrupted.api, interrupted.journal("second"), Shared.write)
    assert set(json.loads(reserved(interrupted).read_text())) == {"bracket.FCStd#Body", "other.FCStd#Body"}
    interrupted.api.silent = False
    assert interrupted.register("third").found
    assert set(json.loads(reserved(interrupted).read_text())) == {"other.FCStd#Body"}


@pytest.mark.parametrize(
    "damage",
    ["{", "[]", '{"bracket.FCStd#Body": {"wanted": "x"}}', '{"bracket.FCStd#Body": 3}'],
    ids=["cut off", "a list", "no UUID", "a number"],
)
def test_what_cannot_be_read_is_not_taken_for_nothing(interrupted: Shared, damage: str) -> None:
    """An item may have been made: nothing is asked of the server before a person has looked."""
    reserved(interrupted).write_text(damage)
    failed = interrupted.register("second")
    assert isinstance(failed.error, InputError)
    assert "may then be made a second time" in str(failed.error)
    assert (len(interrupted.api.items), interrupted.identity) == (1, None)


def test_if_the_folder_cannot_say_what_is_begun_the_file_does(tmp_path: Path) -> None:
    """It has the identity before the item is made."""
    shared = Shared(tmp_path, lockable=True)
    seen: list[str | None] = []
    shared.api.during = lambda _wanted: seen.append(shared.identity)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("silo.registering.journal.replacing", refused)
        done = shared.register("first")
    assert (done.error, seen) == (None, [done.item_id])


def refused(*_path: Any, **_how: Any) -> Any:
    raise OSError(errno.EACCES, "Permission denied")


@pytest.mark.parametrize("own_ids", [False, True])
def test_an_identity_of_another_server_becomes_that_of_the_item(tmp_path: Path, own_ids: bool) -> None:
    """The file is written only where the server chose another one. A server that refuses leaves no intent."""
    shared = Shared(tmp_path, own_ids=own_ids, lockable=True)
    known = "AAAAAAAA-2222-4333-8444-555555555555"
    stamp(shared.path, known)
    before = shared.path.read_bytes()
    shared.carries(known)
    shared.api.before = RejectedError("no")
    assert isinstance(shared.register("first").error, RejectedError)
    assert (shared.journal("first").pending(), shared.path.read_bytes() == before) == ({}, True)
    shared.api.before = None
    done = shared.register("first")
    assert done.item_id == ("own-0" if own_ids else known.lower())
    assert shared.identity == ("own-0" if own_ids else known)
    assert (shared.path.read_bytes() == before) is not own_ids
    assert shared.journal("first").pending() == {}


def test_an_identity_that_is_no_uuid_gives_way(tmp_path: Path) -> None:
    """No server takes it for an item's."""
    shared = Shared(tmp_path, lockable=True)
    stamp(shared.path, "part nö 7")
    shared.carries("part nö 7")
    done = shared.register("first")
    assert (done.error, shared.identity, len(str(done.item_id))) == (None, done.item_id, 36)


def test_a_copy_gets_an_identity_of_its_own(tmp_path: Path) -> None:
    """A person said that it is no more the part whose identity it carries."""
    shared = Shared(tmp_path, lockable=True)
    part = shared.made_elsewhere()
    stamp(shared.path, part)
    shared.carries(part)
    done = shared.register("first", copy=True)
    assert (shared.identity, len(shared.api.items), done.found) == (done.item_id, 2, False)
    assert done.item_id != part


def test_who_waits_for_another_computer_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After 5 seconds, then each minute, with who that is; at last it is an error."""

    class Clock:
        now = 0.0
        strftime = staticmethod(time.strftime)

        def monotonic(self) -> float:
            return self.now

        def sleep(self, seconds: float) -> None:
            self.now += 0.5 if seconds else 0.0

    clock, told = Clock(), list[tuple[float, str]]()
    path = str(tmp_path / "a.FCStd")
    with Journal(tmp_path / "one").turn(path, "a"):
        monkeypatch.setattr("silo.folder_lock.time", clock)
        waiting = Journal(tmp_path / "two", patience=130.0).turn(
            path, "a", lambda text: told.append((clock.now, text))
        )
        with pytest.raises(InputError) as raised, waiting:
            pass
    assert (clock.now, [at for at, _ in told]) == (130.0, [5.0, 65.0, 125.0])
    assert {text for _, text in told} == {str(raised.value)}
    assert f"is being registered by process {os.getpid()} of" in str(raised.value)


def test_who_finds_the_item_of_another_computer_has_it_written(tmp_path: Path) -> None:
    """An open document lacks the identity that the file on disk has by now; its next save would lose it."""
    shared, files = Shared(tmp_path, lockable=True), Files()
    made = shared.made_elsewhere()
    stamp(shared.path, made)
    done = register(shared.proposal, shared.api, shared.journal("first"), files.stamp)
    assert (done.item_id, done.found) == (made, True)
    assert files.identity == {component_key(shared.proposal.entry): made}


def test_an_intent_is_not_that_of_a_file_with_another_identity(tmp_path: Path) -> None:
    """A file that was registered elsewhere lies where an interrupted run had begun; its identity stays."""
    shared = Shared(tmp_path, lockable=True)
    shared.api.before = UnreachableError("gone")
    shared.register("first")
    shared.api.before = None
    known = "aaaaaaaa-2222-4333-8444-555555555555"
    stamp(shared.path, known)
    shared.carries(known)
    assert (shared.register("first").item_id, list(shared.api.items)) == (known, [known])


def test_a_lock_whose_file_was_deleted_meanwhile_is_taken_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its last holder removes the file; who waited has a file that nobody else will ever open."""
    tries: list[str] = []

    def slow(path: str) -> Any:
        held = hold_lock(path)
        if not tries:
            os.unlink(path)
        tries.append(path)
        return held

    monkeypatch.setattr("silo.folder_lock.hold_lock", slow)
    with Journal(tmp_path / "one").turn(str(tmp_path / "a.FCStd"), "a"):
        assert (len(tries), os.path.exists(tries[0])) == (2, True)


def test_a_disk_that_shows_another_file_each_time_is_no_endless_wait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As some network disks do: the lock is one of this computer alone then, and whoever asked knows that."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    numbers = iter(range(10**6))
    real = os.lstat

    def numbered(path: Any, **how: Any) -> Any:
        found = real(path, **how)
        inside = str(path).startswith(str(tmp_path / "shared"))
        return os.stat_result((found[0], next(numbers), *found[2:])) if inside else found

    (tmp_path / "shared").mkdir()
    monkeypatch.setattr(os, "lstat", numbered)
    with Journal(tmp_path / "one").turn(str(tmp_path / "shared" / "a.FCStd"), "a") as turn:
        assert turn.unseen == "its disk returns a different file each time"
