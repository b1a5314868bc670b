# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pause of a server: what is asked of one in trouble, by a clock that only the test moves."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from silo.api.foreign import Where
from silo.api.pause import Pause
from silo.api.replies import Reply, error_of
from silo.api.wire import MergeEntry, MergeRequest
from silo.bom.errors import (
    AuthError,
    BusyError,
    MissingRevisionError,
    NotFoundError,
    NotSentError,
    ReadOnlyError,
    ServerFaultError,
    SiloError,
)
from silo.outbox.entry import Commit, State
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.testing import FakeSilo

TICK_S, HOUR_S = 60.0, 3600.0


def answered(status: int, body: bytes = b"", **headers: str) -> SiloError:
    """The error of an answer to a change."""
    told = {name.replace("_", "-"): value for name, value in headers.items()}
    return error_of(Reply(status, body, Where("silo"), told, "secret"), writing=True)


class Desk:
    """A queue with commits of three items, and a server that has its moods."""

    def __init__(self, folder: Path) -> None:
        self.now, self.asked, self.uploads = 1_000_000.0, list[str](), ""
        self.silo = FakeSilo()
        self.silo.create_item("kindred-rd", "F01", "Bolt")
        self.numbers = [
            self.silo.create_item("kindred-rd", "A01", name, item_type="assembly").part_number
            for name in ("One", "Two", "Three")
        ]
        self.folder = folder
        self.store = Store(folder / "outbox.sqlite3", clock=lambda: self.now)
        self.mood: Callable[[str], object] = lambda _name: None
        self.silo.before = self._asked

    def _asked(self, name: str) -> None:
        self.asked.append(name)
        self.mood(name)

    def commit(self, number: str, quantity: int = 1) -> None:
        path = self.folder / f"{number}.FCStd"
        path.write_bytes(f"{number} {quantity}".encode())
        lines = [MergeEntry(child_part_number="F01-0001", quantity=quantity)]
        request = MergeRequest(entries=lines).model_dump_json(exclude_none=True)
        self.store.add(
            Commit(str(path), self.now, number, part_number=number, file=path, request=request),
            self.silo.base_url,
        )

    def send(self, *, force: bool = False) -> Any:
        return send_all(self.store, self.silo, force=force, chance=lambda: 0.0)

    def arrived(self) -> dict[str, tuple[int, int]]:
        """Part number → how many files and lines it has."""
        return {
            number: (
                sum(bool(one.file_name) for one in self.silo.items[number.casefold()].revisions),
                len(self.silo.items[number.casefold()].lines),
            )
            for number in self.numbers
        }


@pytest.fixture(name="desk")
def _desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path)


# The error, where it meets us, and the most requests of an hour of ticks; a new commit every five minutes.
OF_ALL: dict[str, tuple[SiloError, str, int]] = {
    "429 for ten minutes": (answered(429, Retry_After="600"), "upload_file", 30),
    "503 for ten minutes": (answered(503, Retry_After="600"), "upload_file", 30),
    "read-only": (answered(503, b'{"error": "read-only"}'), "upload_file", 45),
    "wrong token": (answered(401), "", 13),
    "a login page": (AuthError("silo wants a login"), "", 13),
    "nothing answers": (NotSentError("refused"), "", 70),
    "502 from a proxy": (answered(502), "", 140),
}


@pytest.mark.parametrize("kind", OF_ALL)
def test_a_server_in_trouble_is_left_alone(desk: Desk, kind: str) -> None:
    """One reason and one pause for all; no entry is held, and one press sends everything."""
    error, where, most = OF_ALL[kind]

    def fail(name: str) -> None:
        if where in ("", name):
            raise error

    desk.mood = fail
    for number in desk.numbers:
        desk.commit(number)
    for tick in range(int(HOUR_S / TICK_S)):
        desk.now += TICK_S
        if tick % 5 == 4:
            desk.commit(desk.numbers[0], tick)
        report = desk.send()
        assert (report.held, report.failed, report.sent) == ([], [], [])
        assert report.pause is not None
        assert report.pause.reason == str(error)
    assert 1 <= len(desk.asked) <= most
    assert {(entry.state, entry.reason) for entry in desk.store.entries()} == {(State.WAITING, "")}
    desk.mood = lambda _name: None
    assert desk.send(force=True).pause is None
    assert (desk.store.entries(), set(desk.arrived().values())) == ((), {(13, 1), (1, 1)})


def test_a_token_that_was_refused_for_a_while_is_tried_again_slowly(desk: Desk) -> None:
    """A proxy without its log-in service, a server that is being restored: no user has to press anything."""
    desk.mood = lambda _name: _raise(answered(401))
    for number in desk.numbers:
        desk.commit(number)
    first = desk.send().pause
    assert first is not None
    assert 300.0 <= first.left(desk.now) <= 900.0
    desk.mood = lambda _name: None
    desk.now += 299.0
    assert desk.send().sent == []
    desk.now += 601.0
    assert desk.send().pause is None
    assert desk.store.entries() == ()


def test_one_item_in_trouble_is_left_alone_too(desk: Desk) -> None:
    """The others are sent at once, also what comes meanwhile."""
    bad = desk.numbers[0]

    def fail(name: str) -> None:
        if name == "upload_file" and desk.uploads == bad:
            raise ServerFaultError("500 for this one")

    upload = desk.silo.upload_file

    def upload_file(number: str, *arguments: Any, **more: Any) -> Any:
        desk.uploads = number
        return upload(number, *arguments, **more)

    desk.silo.upload_file = upload_file
    desk.mood = fail
    for number in desk.numbers:
        desk.commit(number)
    tried = 0
    for tick in range(int(HOUR_S / TICK_S)):
        desk.now += TICK_S
        if tick == 30:
            desk.commit(desk.numbers[1], 7)
        tried += len(desk.send().failed)
    assert 4 <= tried <= 12
    assert [(entry.label, entry.reason) for entry in desk.store.entries()] == [(bad, "500 for this one")]
    assert list(desk.arrived().values()) == [(0, 0), (2, 1), (1, 1)]


def test_a_store_that_is_down_for_all_files_lets_all_boms_go(desk: Desk) -> None:
    """An unnamed 503 of the uploads is no read-only server; one of everything is."""
    desk.mood = lambda name: _raise(answered(503)) if name == "upload_file" else None
    for number in desk.numbers:
        desk.commit(number)
    report = desk.send()
    assert (report.stopped_by, set(desk.arrived().values())) == (None, {(0, 1)})
    for entry in desk.store.entries():
        desk.store.discard(entry.id)
    desk.mood = lambda name: _raise(answered(503)) if name in ("upload_file", "merge_bom") else None
    desk.commit(desk.numbers[0], 5)
    report = desk.send(force=True)
    assert isinstance(report.stopped_by, ReadOnlyError)
    desk.mood = lambda _name: None
    desk.send(force=True)
    assert desk.store.entries() == ()


def _raise(error: SiloError) -> None:
    raise error


def test_a_server_that_is_swapped_for_an_empty_one_holds_nothing(desk: Desk) -> None:
    """For a minute it knows no item: all waits with a reason, and goes by itself."""
    for number in desk.numbers:
        desk.commit(number)
    desk.mood = lambda name: _raise(NotFoundError("not found"))
    for _ in range(3):
        desk.now += TICK_S
        assert desk.send().held == []
    assert {(entry.state, entry.reason) for entry in desk.store.entries()} == {(State.WAITING, "not found")}
    desk.mood = lambda _name: None
    desk.now += 900
    desk.send()
    assert desk.store.entries() == ()


def test_a_copy_that_is_gone_blocks_nothing(desk: Desk) -> None:
    """It is held with its reason; its BOM and the newer commits of its item are sent."""
    for quantity in (1, 2):
        desk.commit(desk.numbers[0], quantity)
    first = desk.store.entries()[0]
    (desk.store.copies / first.copy).unlink()
    report = desk.send()
    assert [(entry.id, "is gone" in entry.reason) for entry in report.held] == [(first.id, True)]
    assert desk.arrived()[desk.numbers[0]] == (1, 1)
    assert [entry.id for entry in desk.store.entries()] == [first.id]


def test_success_ends_the_pause(desk: Desk) -> None:
    """The next trouble begins with a short pause again."""
    failing = [True]
    desk.mood = lambda name: _raise(BusyError("busy")) if failing[0] and name == "merge_bom" else None
    waits = []
    for round_ in range(4):
        failing[0] = round_ != 2
        desk.commit(desk.numbers[0], round_ + 1)
        report = desk.send()
        waits.append(0.0 if report.pause is None else report.pause.left(desk.now))
        desk.now += 1000
    assert waits == [5.0, 10.0, 0.0, 5.0]


def test_a_pause_that_the_server_named_is_ended_by_a_person_only(desk: Desk) -> None:
    """A new login ends the pause of a wrong token, and only that; Retry all ends both."""
    server, now = desk.silo.base_url, desk.now
    busy = Pause(now + 600, "busy", "busy", told=True)
    for pause, left in ((Pause(now + 600, "wrong token", "auth"), None), (busy, busy)):
        desk.store.set_pause(server, pause)
        desk.store.resume(server, told=False)
        assert desk.store.pause(server) == left
    desk.store.resume(server)
    assert desk.store.pause(server) is None


@pytest.mark.parametrize("choice", ["retry", "discard"])
def test_what_a_person_decides_of_a_commit_ends_the_pause_of_its_item(desk: Desk, choice: str) -> None:
    """That of this item, here; the next commit of it is sent at once."""
    one, other = desk.numbers[:2]
    for number in (one, other):
        desk.commit(number)
        desk.store.set_pause(desk.silo.base_url, Pause(desk.now + 600, "500"), number.casefold())
    getattr(desk.store, choice)(desk.store.entries()[0].id)
    desk.commit(one, 2)
    desk.send()
    assert [entry.part_number for entry in desk.store.entries()] == [other]


def test_retry_all_sends_nothing_that_is_meant_for_another_server(desk: Desk) -> None:
    """Also what that one has lost, which the next press there sends."""
    desk.commit(desk.numbers[0])
    entry = desk.store.entries()[0]
    newer = json.dumps({"revision_number": 1, "set_back": True})
    desk.store.update(entry.id, state=State.HELD, newer=newer, server="http://there/api")
    desk.send(force=True)
    assert [one.state for one in desk.store.entries()] == [State.HELD]


def test_a_bom_alone_whose_revision_is_not_there_is_held(desk: Desk) -> None:
    """There is no file that could be sent again."""
    number = desk.numbers[0]
    desk.commit(number)
    entry = desk.store.entries()[0]
    request = desk.store.bom(entry.id)[1]
    desk.store.discard(entry.id)
    desk.store.add(Commit("", desk.now, number, part_number=number, request=request))
    desk.mood = lambda name: _raise(MissingRevisionError("no such file")) if name == "merge_bom" else None
    assert [(one.state, one.file_left) for one in desk.send().held] == [(State.HELD, False)]
