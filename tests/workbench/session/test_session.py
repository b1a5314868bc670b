# SPDX-License-Identifier: LGPL-2.1-or-later
"""A session without FreeCAD and Qt: what waits is kept, shown and sent; closing loses nothing."""

from __future__ import annotations

import hashlib
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from desk import Office
from fcstd_writer import Doc
from server_testing import wait_until

from silo.api.pause import Pause
from silo.api.sse import MERGE, RESET, ServerEvent
from silo.api.wire import MergeEvent, MergeResult
from silo.bom.errors import SiloError, UnreachableError
from silo.bom_sync.steps import Status
from silo.outbox.entry import UNKNOWN, Commit, Entry, State
from silo.outbox.report import Sent
from silo.outbox.send import send_all
from silo.outbox.store import OutboxError, Store
from silo.platform.stamp import stamp_of
from silo.workbench.documents.opened import DocumentOrigin
from silo.workbench.session.last_events import LastIds
from silo.workbench.session.online import Online


def commit(
    office: Office, name: str, content: bytes = b"content", *, hold: bool = False, identity: str = ""
) -> Commit:
    """A commit of a document that is saved."""
    doc = office.document(name, content)
    office.desk.documents.save(doc)
    made = Commit(doc.FileName, 1.0, name, identity or doc.identity, file=Path(doc.FileName))
    return replace(made, file=office.session.outbox.hold(doc.FileName, made.key)) if hold else made


def keep(office: Office, made: Commit, base: DocumentOrigin | None = None) -> None:
    """Hand a commit to the session, which must not fail."""

    def failing(error: SiloError) -> None:
        raise AssertionError(error)

    office.session.keep(made, failing, base)


def begin(office: Office) -> Online:
    """Start the work of the session, without a live connection."""
    office.session.begin(live=False)
    office.settle()
    return office.session._need_online()


def announce(online: Online, identity: str, revision: int) -> None:
    """A colleague's commit, as the server tells it."""
    data = {"id": identity, "part_number": "M01-0001", "revision_number": revision, "user": "alice"}
    online._heard(ServerEvent("9", "revision.created", data), online.address)


def restore(online: Online) -> None:
    """The server says that it counts anew."""
    online._heard(ServerEvent(None, RESET, {}), online.address)


DRAWING = "print('a banner'); from silo.drawing.models import NoDrawer, work_with; work_with(NoDrawer)"


@pytest.mark.parametrize("dies", ["", "if not os.path.exists('x'): open('x', 'w'); os._exit(1)", "1 / 0"])
def test_a_model_is_drawn_after_its_commit_arrived(
    office: Office, dies: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a child, which may print a banner, and die once while it starts; if it dies again, it is a line."""
    monkeypatch.chdir(office.folder)
    office.session._drawing = lambda: [sys.executable, "-c", f"import os\n{dies}\n{DRAWING}"]
    keep(office, commit(office, "Box", Doc("Box").save(office.folder / "made.FCStd").read_bytes()))
    office.settle()
    assert office.session._models.left(60) == 0
    office.gui.run_all()
    assert len(office.files("Box")) == 1
    works = dies != "1 / 0"
    assert [set(parts) for parts in office.silo.models.values()] == [{"structure", "geometry"}] * works
    assert [line.partition(": the")[0] for line in office.console] == [
        "[Silo] Box.FCStd: no model was made"
    ] * (not works)


def test_a_restored_server_that_counts_anew_gives_our_number_to_a_colleague(office: Office) -> None:
    """Before it says so, an event with that number is our own."""
    made = commit(office, "Bolt")
    keep(office, made)
    office.settle()
    online = office.session._need_online()
    for restored, names in ((False, []), (True, ["alice"])):
        if restored:
            restore(online)
        announce(online, made.identity, 1)
        office.gui.run_all()
        assert [one.who for one in office.session.shown.newer.values()] == names


@pytest.mark.parametrize("kept", [0, 1, 2])
def test_after_a_restore_a_colleagues_commit_that_is_gone_is_no_news(office: Office, kept: int) -> None:
    """``kept``: so many of the two announced revisions are in the backup; 0: not even the item is."""
    made = commit(office, "Bolt")
    online = begin(office)
    for _ in range(kept):
        office.silo.upload_file("M01-0001", made.path, "theirs")
    if not kept:
        office.silo.items.clear()
    announce(online, made.identity, 2)
    office.gui.run_all()
    assert [one.revision for one in office.session.shown.newer.values()] == [2]
    # Whether it is still there is asked at once, and the answer may be quick.
    restore(online)
    office.settle()
    assert [one.revision for one in office.session.shown.newer.values()] == ([2] if kept == 2 else [])


def test_looking_for_what_a_restore_took_can_be_stopped(office: Office) -> None:
    """A request for each notice, of which a day may bring hundreds; those stay then."""
    made = commit(office, "Bolt")
    online, asked = begin(office), list[str]()

    def stop(name: str) -> None:
        asked.append(name)
        office.session.cancel()

    office.silo.before = stop
    for number in (made.identity, "another"):
        announce(online, number, 2)
    office.gui.run_all()
    restore(online)
    office.settle()
    assert (asked, len(office.session.shown.newer)) == (["revisions"], 2)


class SlowStore(Store):
    """A disk on which copies take until the test lets them go."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.gate = threading.Event()
        self.copies_made = 0

    def _copied(self, source: Path, copy: Path, stamp: str) -> tuple[str, int]:
        self.gate.wait(60)
        self.copies_made += 1
        return super()._copied(source, copy, stamp)


@pytest.fixture(name="slow")
def _slow(office: Office) -> SlowStore:
    store = SlowStore(office.session.outbox.path)
    office.session.outbox = store
    return store


def test_closing_waits_for_the_disk(office: Office, slow: SlowStore) -> None:
    """Twelve commits, closed at once: all of them are copied, none is sent, none is lost."""
    for number in range(12):
        keep(office, commit(office, f"P{number}", b"%d" % number, hold=True))
    counts: list[int] = []

    def wait(left: Any) -> None:
        counts.append(left(0.0))
        slow.gate.set()
        while left(1.0):
            continue

    office.session.close(wait)
    assert counts[0] >= 1
    entries = Store(slow.path).entries()
    assert [(entry.label, entry.state) for entry in entries] == [
        (f"P{number}", State.WAITING) for number in range(12)
    ]
    assert slow.copies_made == 12


class FullDisk(Store):
    """A disk that takes the row of a commit, and then nothing more until there is room."""

    room = False

    def update(self, entry_id: int, **values: Any) -> None:
        self._need_room()
        super().update(entry_id, **values)

    def entries(self) -> tuple[Entry, ...]:
        self._need_room()
        return super().entries()

    def _need_room(self) -> None:
        if not self.room:
            raise OutboxError("the outbox cannot be used now (database or disk is full)")


@pytest.mark.parametrize("hold", [True, False])
def test_a_commit_that_a_full_disk_kept_is_not_reported_as_lost(office: Office, *, hold: bool) -> None:
    """It is reported as kept, and goes by itself as soon as there is room."""
    office.session.outbox = disk = FullDisk(office.session.outbox.path)
    made = commit(office, "Bolt", hold=hold)
    base = DocumentOrigin(made.path, stamp_of(made.path), UNKNOWN)
    keep(office, made, base)
    office.session._waits(((), None, ()))  # read before there was anything
    office.settle()
    assert base.content == hashlib.sha256(b"content").hexdigest()  # the next commit is made from this one
    assert any("Bolt: The commit is kept. It is sent as soon" in line for line in office.console)
    disk.room = True
    office.session.tick()
    office.settle()
    assert (office.files("Bolt"), office.session.shown.waiting) == ([b"content"], ())


@pytest.mark.parametrize(("hold", "elsewhere"), [(True, False), (False, False), (True, True)])
def test_a_document_knows_what_it_is_made_from_whoever_sends_its_commit(
    office: Office, slow: SlowStore, *, hold: bool, elsewhere: bool
) -> None:
    """No other worker sends what is being copied; another program, such as the command line, may."""
    made, later = commit(office, "Bolt", hold=hold), commit(office, "Plate", hold=True)
    base = DocumentOrigin(made.path, stamp_of(made.path), UNKNOWN)
    keep(office, later)
    keep(office, replace(made, origin=UNKNOWN), base)
    wait_until(lambda: len(slow.entries()) == 2, "both rows are there")
    # The copy of the other one is under way; meanwhile the sender comes along.
    assert len(send_all(Store(slow.path) if elsewhere else slow, office.silo).sent) == 2 * elsewhere
    assert [entry.state for entry in slow.entries()] == [State.KEEPING] * 2 * (not elsewhere)
    slow.gate.set()
    office.settle()
    assert office.session.shown.waiting == ()
    assert base.content == hashlib.sha256(b"content").hexdigest()


def test_who_does_not_want_to_wait_loses_nothing_either(office: Office, slow: SlowStore) -> None:
    """No row waits for a copy; the next start makes these from the second names."""
    for number in range(12):
        keep(office, commit(office, f"P{number}", b"%d" % number, hold=True))
    office.session._rows.left(30.0)
    # The first copy hangs, and nobody wants to wait for it.
    office.session.close(lambda left: None)
    assert [entry.state for entry in Store(slow.path).entries()] == [State.KEEPING] * 12
    slow.gate.set()
    office.session = office.start()
    begin(office)
    assert [office.files(f"P{number}") for number in range(12)] == [[b"%d" % number] for number in range(12)]
    assert Store(slow.path).entries() == ()


def test_closing_does_not_wait_for_the_network(office: Office) -> None:
    """A server that hangs; the commit waits for the next time."""
    reached, released = threading.Event(), threading.Event()

    def hang(name: str) -> None:
        if name == "upload_file":
            reached.set()
            released.wait(60)

    office.silo.before = hang
    keep(office, commit(office, "Bolt", hold=True))
    office.gui.run_until(reached.is_set)
    office.session.close(lambda left: left(30.0))
    assert [entry.label for entry in Store(office.session.outbox.path).entries()] == ["Bolt"]
    released.set()


def test_what_waits_for_another_address_is_shown_and_can_be_sent_here(office: Office) -> None:
    """The server moved; an old spelling of the same address needs no person at all."""
    store = Store(office.session.outbox.path)
    for name, server in (("Old", "http://old.example/api"), ("Same", "HTTP://Silo.Invalid:80/api/")):
        store.add(commit(office, name), server)
    begin(office)
    (waiting,) = office.session.shown.waiting
    assert (waiting.label, office.files("Same")) == ("Old", [b"content"])
    office.session.send_here([waiting.id])
    office.settle()
    assert (office.session.shown.waiting, office.files("Old")) == ((), [b"content"])


def test_a_person_saves_a_copy_and_discards(office: Office) -> None:
    """Of what cannot be sent."""
    store = Store(office.session.outbox.path)
    entry = store.add(commit(office, "Bolt", identity="no-item"))
    begin(office)
    assert [(w.state, bool(w.reason)) for w in office.session.shown.waiting] == [(State.WAITING, True)]
    target = office.folder / "saved.FCStd"
    office.session.save_copy(entry.id, target)
    office.session.discard(entry.id)
    office.settle()
    assert (target.read_bytes(), office.session.shown.waiting) == (b"content", ())


def test_a_pause_that_is_over_is_not_shown_with_what_waits(office: Office) -> None:
    """Whatever brings what is shown: a start, or a person's choice."""
    made, store = commit(office, "Bolt"), Store(office.session.outbox.path)
    entries = [store.add(replace(made, key=key), office.silo.base_url) for key in ("a", "b", "c")]
    store.set_pause(office.silo.base_url, Pause(store.clock() + 600, "busy (429)", "busy", 1, told=True))
    begin(office)
    assert office.session.shown.pause is not None
    office.session.discard(entries[0].id)
    office.settle()
    assert office.session.shown.pause is not None
    store.set_pause(office.silo.base_url, None)
    office.session.discard(entries[1].id)
    office.settle()
    assert (len(office.session.shown.waiting), office.session.shown.pause) == (1, None)


def test_one_item_in_trouble_holds_up_no_other(office: Office) -> None:
    """The server fails on one file each time; the others pass, and it says why it waits."""

    def fail(name: str) -> None:
        if name == "upload_file" and office.files("Bad") == [] and calls.pop(0) == 0:
            raise UnreachableError("500 for this one")

    calls = [0, 1, 1, 1]
    commits = [commit(office, name) for name in ("Bad", "One", "Two")]
    office.silo.before = fail
    for made in commits:
        office.session.outbox.add(made)
    office.session.send(force=False)
    office.settle()
    assert (office.files("One"), office.files("Two"), office.files("Bad")) == ([b"content"], [b"content"], [])
    (waiting,) = office.session.shown.waiting
    assert (waiting.label, waiting.reason) == ("Bad", "500 for this one")


def test_a_burst_of_events_is_one_file_written(tmp_path: Path) -> None:
    """The first is written at once, the others with the end of the connection."""
    known = LastIds(tmp_path / "last-events.json")
    for number in range(100):
        known.set("http://silo", str(number))
    assert LastIds(tmp_path / "last-events.json").get("http://silo") == "0"
    known.save()
    assert LastIds(tmp_path / "last-events.json").get("http://silo") == "99"


@pytest.mark.parametrize("event_first", [True, False])
def test_after_a_crash_the_events_of_our_own_merges_do_not_come_again(
    office: Office, *, event_first: bool
) -> None:
    """Those of colleagues are on disk every ten seconds only; our own at once, before or after the answer."""
    online = begin(office)
    written = online._last_ids._path

    def hear(number: int, sync_id: str) -> None:
        data = {"type": "bom.merged", "item": "A01-0001", "sync_id": sync_id, "user": "x", "diff": {}}
        online._heard(ServerEvent(str(number), MERGE, data, MergeEvent.model_validate(data)), online.address)

    def tell() -> None:
        entry = Store(office.session.outbox.path).add(Commit("", 1.0, part_number="A01-0001", request="{}"))
        online._tell(Sent(entry, "A01-0001", Status.MERGED, result=MergeResult(), sync_id="mine"))

    hear(1, "theirs")  # the first one is written at once
    for step in (lambda: hear(2, "mine"), tell)[:: 1 if event_first else -1]:
        step()
    assert LastIds(written).get(online.address) == "2"
    for number in range(3, 9):
        hear(number, "theirs")
    assert LastIds(written).get(online.address) == "2"
