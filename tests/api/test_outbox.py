# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox: nothing lost, nothing twice, in order, whatever fails or dies."""

from __future__ import annotations

import hashlib
import os
import signal
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from silo.api.client import SiloClient
from silo.api.events import Backoff
from silo.api.outbox import Outbox, State, default_path
from silo.api.policy import Retries
from silo.api.wire import MergeEntry, MergeRequest, MergeResult, Revision, SourceDocument
from silo.bom.errors import (
    AuthError,
    CancelledError,
    ConflictError,
    DocumentError,
    ForbiddenError,
    InputError,
    ReadOnlyError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)
from silo.testing import FakeSilo


class Clock:
    """A time that only the test moves."""

    now = 1_000_000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def outbox(tmp_path: Path, clock: Clock) -> Outbox:
    return Outbox(
        tmp_path / "outbox.sqlite3", backoff=Backoff(first=10, longest=100), clock=clock, chance=lambda: 0.0
    )


@pytest.fixture
def silo() -> FakeSilo:
    """A server with two assemblies and a part."""
    made = FakeSilo()
    for category, name in (("A01", "Top"), ("A01", "Other"), ("F01", "Bolt")):
        made.create_item("kindred-rd", category, name)
    return made


TOP, OTHER, BOLT = "A01-0001", "A01-0002", "F01-0001"


def bom(quantity: float = 1, child: str = BOLT, sync_id: str | None = None) -> MergeRequest:
    return MergeRequest(entries=[MergeEntry(child_part_number=child, quantity=quantity)], sync_id=sync_id)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """A document to commit."""
    path = tmp_path / "Top ä.FCStd"
    path.write_bytes(b"first state")
    return path


def fail(silo: FakeSilo, name: str, error: BaseException, *, times: int = 1, after: bool = False) -> None:
    """Let calls of this name fail, before or after the server acted."""
    left = [times]

    def hook(called: str) -> None:
        if called == name and left[0]:
            left[0] -= 1
            raise error

    if after:
        silo.after = hook
    else:
        silo.before = hook


def log_of(silo: FakeSilo, part_number: str) -> list[str]:
    """What arrived for an item, in order: revision comments and BOM quantities."""
    said = []
    for event in silo.log:
        if event.item == part_number and event.type == "revision.created":
            said.append(event.data["comment"])
        if event.item == part_number and event.merge is not None:
            changes = [*event.merge.diff.added, *event.merge.diff.unchanged]
            said += [f"{c.quantity:g}" for c in changes]
            said += [f"{c.new_quantity:g}" for c in event.merge.diff.quantity_changed]
    return said


# -- keeping ------------------------------------------------------------------------------------------------


def test_a_commit_is_kept_as_it_was(outbox: Outbox, model: Path, clock: Clock) -> None:
    """File and BOM of one moment, whatever becomes of the file; also for the next process."""
    outbox.add("http://s", TOP, file=model, comment="first", properties={"mass_kg": 1}, bom=bom(4))
    model.write_bytes(b"second state")
    model.unlink()
    file, snapshot = Outbox(outbox.path).pending()
    assert (file.kind, file.part_number, file.server, file.taken_at) == ("file", TOP, "http://s", clock.now)
    assert file.payload["sha256"] == hashlib.sha256(b"first state").hexdigest()
    assert (file.payload["file_name"], file.payload["size"]) == ("Top ä.FCStd", 11)
    assert (outbox.path.parent / "outbox-files" / str(file.payload["copy"])).read_bytes() == b"first state"
    assert snapshot.payload["sync_id"]
    assert snapshot.payload["entries"] == [{"child_part_number": BOLT, "quantity": 4, "source": "assembly"}]


def test_a_file_that_cannot_be_read_is_told_and_nothing_is_kept(outbox: Outbox, tmp_path: Path) -> None:
    """The commit says so now, not the sending later."""
    with pytest.raises(DocumentError, match=r"gone\.FCStd.*nothing was put aside"):
        outbox.add("http://s", TOP, file=tmp_path / "gone.FCStd", bom=bom())
    with pytest.raises(InputError, match="neither a file nor a BOM"):
        outbox.add("http://s", TOP)
    with pytest.raises(InputError, match="JSON"):
        outbox.add("http://s", TOP, file=tmp_path, properties={"mass": float("nan")})
    assert outbox.pending() == ()
    assert list((outbox.path.parent / "outbox-files").iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="file modes are POSIX")
def test_nobody_else_can_read_it(outbox: Outbox, model: Path) -> None:
    """Designs and comments are private: database, its companions, copies, folder."""
    reader = sqlite3.connect(outbox.path)
    reader.execute("SELECT * FROM entry").fetchall()
    outbox.add("http://s", TOP, file=model, bom=bom())
    found = [p for p in outbox.path.parent.iterdir() if p.name.startswith("outbox")]
    assert {p.name for p in found} >= {"outbox.sqlite3", "outbox.sqlite3-wal", "outbox.lock", "outbox-files"}
    copies = list((outbox.path.parent / "outbox-files").iterdir())
    for path in (*found, *copies):
        assert path.stat().st_mode & 0o077 == 0, path
    reader.close()


def test_a_newer_outbox_is_not_touched(outbox: Outbox) -> None:
    """Two versions of the add-on on one computer."""
    db = sqlite3.connect(outbox.path)
    db.execute("PRAGMA user_version = 99")
    db.close()
    with pytest.raises(InputError, match="newer silo-mod"):
        Outbox(outbox.path)


def test_what_is_no_outbox_is_told(tmp_path: Path) -> None:
    """Plain words, and the file stays as it is."""
    path = tmp_path / "outbox.sqlite3"
    path.write_bytes(b"no database at all, but long enough to be looked at" * 20)
    before = path.read_bytes()
    with pytest.raises(InputError, match="cannot be used"):
        Outbox(path)
    assert path.read_bytes() == before


def test_the_default_place_is_the_users_data_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where data that must not be lost belongs."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    if sys.platform == "linux":
        assert default_path() == tmp_path / "silo-mod" / "outbox.sqlite3"


# -- sending ------------------------------------------------------------------------------------------------


def test_what_waits_is_sent_in_order_and_forgotten(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """File before BOM, commit after commit; the copies go with their entries."""
    for number in (1, 2):
        model.write_bytes(b"state %d" % number)
        outbox.add(silo.base_url, TOP, file=model, comment=f"c{number}", bom=bom(number))
    seen = []
    report = outbox.send_all(silo, on_delivery=lambda d: seen.append(d.entry.id))
    assert log_of(silo, TOP) == ["c1", "1", "c2", "2"]
    assert [type(d.result) for d in report.delivered] == [Revision, MergeResult, Revision, MergeResult]
    assert seen == [d.entry.id for d in report.delivered]
    assert (report.waiting, report.stopped_by, outbox.pending()) == (0, None, ())
    assert list((outbox.path.parent / "outbox-files").iterdir()) == []
    assert silo.items[TOP.casefold()].revisions[-1].file_name == "Top ä.FCStd"


def test_the_bom_learns_which_revision_its_file_became(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """Offline that could not be known; the history wants it. Another commit's BOM is left alone."""
    for _ in range(2):
        request = bom().model_copy(update={"document": SourceDocument(file="Top.FCStd")})
        outbox.add(silo.base_url, TOP, file=model, bom=request)
    seen: list[MergeRequest] = []
    merge = silo.merge_bom

    class Spy(FakeSilo):
        def merge_bom(self, part_number: str, request: MergeRequest, /, **options: Any) -> MergeResult:
            seen.append(request)
            return merge(part_number, request, **options)

    spy = Spy()
    spy.items = silo.items
    outbox.send_all(spy)
    assert [r.document.revision for r in seen if r.document] == [1, 2]


def test_entries_go_only_to_their_own_server(outbox: Outbox, silo: FakeSilo) -> None:
    """Changed settings do not send a company's BOM to another one; a person may."""
    (entry,) = outbox.add("http://old.example", TOP, bom=bom(3))
    assert outbox.send_all(silo).delivered == ()
    outbox.retry(entry.id, server=silo.base_url)
    assert len(outbox.send_all(silo).delivered) == 1


@pytest.mark.parametrize("after", [False, True], ids=["before it acted", "after it acted"])
@pytest.mark.parametrize("call", ["upload_file", "merge_bom"])
def test_a_lost_answer_is_neither_loss_nor_double(
    outbox: Outbox, silo: FakeSilo, model: Path, call: str, after: bool
) -> None:
    """The server may have acted or not; the next run finds out."""
    outbox.add(silo.base_url, TOP, file=model, comment="c1", bom=bom(2))
    fail(silo, call, UnreachableError("gone"), after=after)
    first = outbox.send_all(silo)
    assert [e.reason for e in first.failed] == ["gone"]
    second = outbox.send_all(silo, force=True)
    assert log_of(silo, TOP) == ["c1", "2"]
    assert (second.waiting, outbox.pending()) == (0, ())


def test_the_same_file_committed_twice_is_two_revisions(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """Also when the answer to the second is lost: an equal older revision is not ours."""
    outbox.add(silo.base_url, TOP, file=model, comment="one")
    outbox.send_all(silo)
    outbox.add(silo.base_url, TOP, file=model, comment="two")
    fail(silo, "upload_file", UnreachableError("gone"))
    outbox.send_all(silo)
    outbox.send_all(silo, force=True)
    assert log_of(silo, TOP) == ["one", "two"]


def test_somebody_elses_newer_revision_does_not_hide_ours(
    outbox: Outbox, silo: FakeSilo, model: Path, tmp_path: Path
) -> None:
    """Ours arrived, the answer was lost, then a colleague committed: not sent again."""
    outbox.add(silo.base_url, TOP, file=model, comment="ours")
    fail(silo, "upload_file", UnreachableError("gone"), after=True)
    outbox.send_all(silo)
    colleague = tmp_path / "colleague.FCStd"
    colleague.write_bytes(b"theirs")
    silo.upload_file(TOP, colleague, "theirs")
    outbox.send_all(silo, force=True)
    assert log_of(silo, TOP) == ["ours", "theirs"]


@pytest.mark.parametrize(
    "error",
    [ForbiddenError("no"), ConflictError("held by a colleague"), None],
    ids=["403", "409", "400"],
)
def test_what_is_rejected_stays_visible_and_holds_up_nobody(
    outbox: Outbox, silo: FakeSilo, error: SiloError | None
) -> None:
    """With its reason, until a person retries or discards it."""
    unknown = bom(1, "no-such-part")
    outbox.add(silo.base_url, TOP, bom=bom(1) if error else unknown)
    outbox.add(silo.base_url, OTHER, bom=bom(2))
    outbox.add(silo.base_url, TOP, bom=bom(3))
    if error:
        fail(silo, "merge_bom", error)
    report = outbox.send_all(silo)
    assert [e.part_number for e in report.rejected] == [TOP]
    assert (log_of(silo, OTHER), log_of(silo, TOP)) == (["2"], ["3"])
    (left,) = outbox.pending()
    assert left.state is State.REJECTED
    assert (str(error) if error else "no-such-part") in left.reason
    assert outbox.send_all(silo, force=True).delivered == ()
    outbox.discard(left.id)
    assert outbox.pending() == ()
    with pytest.raises(InputError, match="no entry"):
        outbox.discard(left.id)


def test_an_old_state_is_not_brought_back_by_a_retry(outbox: Outbox, silo: FakeSilo) -> None:
    """The newer BOM arrived; retrying the rejected older one would undo it."""
    (old,) = outbox.add(silo.base_url, TOP, bom=bom(1, "no-such-part"))
    outbox.send_all(silo)
    (early,) = outbox.add(silo.base_url, OTHER, bom=bom(1, "no-such-part"))
    outbox.add(silo.base_url, TOP, bom=bom(5))
    outbox.send_all(silo)
    assert [e.superseded for e in outbox.pending()] == [True, False]
    with pytest.raises(ConflictError, match="a newer BOM was sent"):
        outbox.retry(old.id)
    assert outbox.retry(early.id).state is State.WAITING


def test_a_retry_after_mending_goes_through(outbox: Outbox, silo: FakeSilo) -> None:
    """The missing part was registered meanwhile."""
    outbox.add(silo.base_url, TOP, bom=bom(1, "F01-0002"))
    (rejected,) = outbox.send_all(silo).rejected
    silo.create_item("kindred-rd", "F01", "Nut")
    assert outbox.retry(rejected.id).reason == ""
    assert len(outbox.send_all(silo).delivered) == 1


# -- passing failures ---------------------------------------------------------------------------------------


def test_pauses_grow_and_keep_the_order(outbox: Outbox, silo: FakeSilo, clock: Clock) -> None:
    """The second commit of an assembly waits for the first; others go on."""
    outbox.add(silo.base_url, TOP, bom=bom(1))
    outbox.add(silo.base_url, TOP, bom=bom(2))
    outbox.add(silo.base_url, OTHER, bom=bom(9))
    fail(silo, "merge_bom", ServerFaultError("500"), times=1)
    report = outbox.send_all(silo)
    assert [e.next_attempt - clock.now for e in report.failed] == [10]
    assert (log_of(silo, TOP), log_of(silo, OTHER), report.waiting) == ([], ["9"], 2)
    clock.now += 9
    assert outbox.send_all(silo).delivered == ()
    fail(silo, "merge_bom", ServerFaultError("500"), times=1)
    clock.now += 1
    assert [e.next_attempt - clock.now for e in outbox.send_all(silo).failed] == [20]
    assert len(outbox.send_all(silo, force=True).delivered) == 2
    assert log_of(silo, TOP) == ["1", "2"]


@pytest.mark.parametrize(
    "error", [ReadOnlyError("maintenance"), AuthError("who are you")], ids=["read-only", "wrong token"]
)
def test_what_concerns_all_ends_the_run(outbox: Outbox, silo: FakeSilo, error: SiloError) -> None:
    """Nothing is rejected for it; the reason is on the entry and in the report."""
    outbox.add(silo.base_url, TOP, bom=bom(1))
    outbox.add(silo.base_url, OTHER, bom=bom(2))
    fail(silo, "merge_bom", error, times=99)
    report = outbox.send_all(silo)
    assert report.stopped_by is error
    assert (report.waiting, len(report.failed), report.rejected) == (2, 1, ())
    silo.before = lambda name: None
    assert len(outbox.send_all(silo, force=True).delivered) == 2


def test_an_absent_server_ends_the_run_but_a_stubborn_entry_does_not(
    outbox: Outbox, silo: FakeSilo, model: Path
) -> None:
    """A file that always times out must not hold up the other assemblies."""
    outbox.add(silo.base_url, TOP, file=model)
    outbox.add(silo.base_url, OTHER, bom=bom(2))
    fail(silo, "upload_file", UnreachableError("too slow"), times=1)
    assert outbox.send_all(silo).stopped_by is None
    assert log_of(silo, OTHER) == ["2"]

    def gone(name: str) -> None:
        raise UnreachableError("nobody there")

    silo.before = gone
    outbox.add(silo.base_url, OTHER, bom=bom(3))
    report = outbox.send_all(silo, force=True)
    assert isinstance(report.stopped_by, UnreachableError)
    assert report.waiting == 2


def test_a_stop_between_entries_keeps_the_rest(outbox: Outbox, silo: FakeSilo) -> None:
    """No pause is put on what was not tried."""
    outbox.add(silo.base_url, TOP, bom=bom(1))
    outbox.add(silo.base_url, OTHER, bom=bom(2))
    stopped = threading.Event()
    report = outbox.send_all(silo, cancelled=stopped, on_delivery=lambda d: stopped.set())
    assert isinstance(report.stopped_by, CancelledError)
    assert (len(report.delivered), report.waiting) == (1, 1)
    assert len(outbox.send_all(silo).delivered) == 1


def test_what_is_added_while_sending_is_sent_too(outbox: Outbox, silo: FakeSilo) -> None:
    """A commit during a long run."""
    outbox.add(silo.base_url, TOP, bom=bom(1))
    added: list[object] = []

    def add_one(delivery: object) -> None:
        if not added:
            added.append(outbox.add(silo.base_url, TOP, bom=bom(2)))

    outbox.send_all(silo, on_delivery=add_one)
    assert log_of(silo, TOP) == ["1", "2"]


def test_only_one_sends_at_a_time(outbox: Outbox, silo: FakeSilo) -> None:
    """Another process or thread is told, and leaves it alone."""
    outbox.add(silo.base_url, TOP, bom=bom(1))
    others = []
    outbox.send_all(silo, on_delivery=lambda d: others.append(Outbox(outbox.path).send_all(silo)))
    assert (others[0].busy, others[0].delivered) == (True, ())
    assert outbox.send_all(silo).busy is False


def test_many_senders_at_once_send_each_entry_once(outbox: Outbox, silo: FakeSilo) -> None:
    """Threads with outboxes of their own over one file."""
    for number in range(1, 21):
        outbox.add(silo.base_url, TOP, bom=bom(number))
    start = threading.Barrier(4)

    def send() -> None:
        mine = Outbox(outbox.path)
        start.wait()
        while any(e.state is State.WAITING for e in mine.pending()):
            mine.send_all(silo)

    threads = [threading.Thread(target=send) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert log_of(silo, TOP) == [str(n) for n in range(1, 21)]


def test_leftover_copies_are_swept_up_but_not_fresh_ones(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """What a crash between copy and entry left; another process may just be about to name a fresh one."""
    outbox.add("http://elsewhere", TOP, file=model)
    copies = outbox.path.parent / "outbox-files"
    for name, age in (("old.FCStd", 7200), ("fresh.FCStd", 10)):
        (copies / name).write_bytes(b"x")
        stamp = (copies / name).stat().st_mtime - age
        os.utime(copies / name, (stamp, stamp))
    outbox.send_all(silo)
    kept = {outbox.pending()[0].payload["copy"], "fresh.FCStd"}
    assert {p.name for p in copies.iterdir()} == kept


# -- over HTTP ----------------------------------------------------------------------------------------------


@pytest.fixture
def embedded(tmp_path: Path) -> Iterator[SiloClient]:
    run = pytest.importorskip("silo_server.run", reason="the embedded server needs the extra 'server'")
    with (
        run.running_server(f"sqlite:///{tmp_path / 'silo.db'}", token="silo_outbox") as server,
        SiloClient(server.base_url, server.token, retries=Retries(tries=1)) as client,
    ):
        client.create_item("kindred-rd", "A01", "Top", item_type="assembly")
        client.create_item("kindred-rd", "F01", "Bolt")
        yield client


def test_it_sends_to_the_embedded_server(outbox: Outbox, embedded: SiloClient, model: Path) -> None:
    """File and BOM over real HTTP, with the entry's progress."""
    seen: list[tuple[int, int]] = []
    outbox.add(embedded.base_url, TOP, file=model, comment="c1", bom=bom(4))
    report = outbox.send_all(embedded, on_progress=lambda entry, done, total: seen.append((done, total)))
    assert len(report.delivered) == 2
    assert seen[-1] == (11, 11)
    revision = embedded.revisions(TOP)[0]
    assert (revision.comment, revision.file_checksum) == ("c1", hashlib.sha256(b"first state").hexdigest())
    assert [(line.child_part_number, line.quantity) for line in embedded.get_bom(TOP)] == [(BOLT, 4)]


SENDER = """
import sys
from pathlib import Path
from silo.api.client import SiloClient
from silo.api.outbox import Outbox
with SiloClient(sys.argv[2], "silo_secret") as client:
    Outbox(Path(sys.argv[1])).send_all(client, force=True)
"""


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is POSIX")
@pytest.mark.parametrize("died_in", ["upload", "merge"])
def test_a_killed_process_leaves_everything_to_the_next(
    outbox: Outbox, server: Any, answer: Any, model: Path, died_in: str
) -> None:
    """kill -9 while the server has acted and its answer is on the way: the next process completes it once."""
    files, merges = [], []
    arrived, released = threading.Event(), threading.Event()

    def hold(kind: str) -> None:
        if kind == died_in and not released.is_set():
            arrived.set()
            released.wait(60)

    def uploaded() -> None:
        files.append({"revision_number": len(files) + 1, "file_checksum": sha256})
        server.scripts["GET /api/items/A01-0001/revisions"].clear()
        server.on("GET /api/items/A01-0001/revisions", list(files))
        hold("upload")

    def merged() -> None:
        merges.append(server.seen[-1].json()["sync_id"])
        hold("merge")

    sha256 = hashlib.sha256(model.read_bytes()).hexdigest()
    server.on("GET /api/items/A01-0001/revisions", [])
    server.on("POST /api/items/A01-0001/file", answer(201, {"revision_number": 1}, before=uploaded))
    server.on(
        "POST /api/items/A01-0001/bom/merge",
        answer(200, {"status": "merged", "diff": {"added": []}}, before=merged),
    )
    outbox.add(server.url, TOP, file=model, comment="c1", bom=bom(4))
    command = [sys.executable, "-c", SENDER, str(outbox.path), server.url]
    process = subprocess.Popen(command)
    assert arrived.wait(60)
    process.send_signal(signal.SIGKILL)
    process.wait(60)
    released.set()
    # The lock went with the process, so this one may send at once.
    subprocess.run(command, check=True, timeout=60)
    assert (len(files), len(set(merges)), outbox.pending()) == (1, 1, ())
