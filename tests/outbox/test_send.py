# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox: nothing lost, nothing twice, in order, whatever fails or dies."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest

from silo.api.policy import Backoff
from silo.api.wire import (
    MergeEntry,
    MergeRequest,
    MergeResult,
    ProductSummary,
    Revision,
    SourceDocument,
)
from silo.bom.errors import (
    CancelledError,
    ConflictError,
    DocumentError,
    InputError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)
from silo.outbox.entry import Commit, Entry, State
from silo.outbox.report import Report
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.testing import FakeSilo


class Clock:
    """A time that only the test moves."""

    now = 1_000_000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


class Outbox(Store):
    """A store, and sending from it without chance."""

    def put(
        self,
        server: str,
        part_number: str,
        *,
        file: Path | None = None,
        bom: MergeRequest | None = None,
        comment: str = "",
        **more: Any,
    ) -> Entry:
        return self.add(
            Commit(
                path=str(file or ""),
                taken_at=self.clock(),
                part_number=part_number,
                file=file,
                request=bom.model_dump_json(exclude_none=True) if bom else "",
                comment=comment,
                **more,
            ),
            server,
        )

    def send(self, silo: Any, **more: Any) -> Report:
        return send_all(self, silo, backoff=Backoff(first=10, longest=100), chance=lambda: 0.0, **more)

    def waiting(self) -> int:
        return sum(entry.state is State.WAITING for entry in self.entries())


@pytest.fixture
def outbox(tmp_path: Path, clock: Clock) -> Outbox:
    return Outbox(tmp_path / "outbox.sqlite3", clock=clock)


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


# -- sending ------------------------------------------------------------------------------------------------


def test_the_bom_learns_which_revision_its_file_became(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """Offline that could not be known; the history wants it. Another commit's BOM is left alone."""
    for number in range(2):
        model.write_bytes(b"state %d" % number)
        request = bom().model_copy(update={"document": SourceDocument(file="Top.FCStd")})
        outbox.put(silo.base_url, TOP, file=model, bom=request)
    seen: list[MergeRequest] = []
    merge = silo.merge_bom

    class Spy(FakeSilo):
        def merge_bom(self, part_number: str, request: MergeRequest, /, **options: Any) -> MergeResult:
            seen.append(request)
            return merge(part_number, request, **options)

    spy = Spy()
    spy.items = silo.items
    outbox.send(spy)
    assert [r.document.revision for r in seen if r.document] == [1, 2]


def test_entries_go_only_to_their_own_server(outbox: Outbox, silo: FakeSilo) -> None:
    """Changed settings do not send a company's BOM to another one; a person may."""
    entry = outbox.put("http://old.example", TOP, bom=bom(3))
    assert outbox.send(silo).sent == []
    outbox.retry(entry.id, server=silo.base_url)
    assert len(outbox.send(silo).sent) == 1


def test_going_back_is_a_revision_also_when_its_answer_was_lost(
    outbox: Outbox, silo: FakeSilo, model: Path
) -> None:
    """An equal older revision is not ours."""
    for number, content in enumerate((b"one", b"two", b"one")):
        model.write_bytes(content)
        outbox.put(silo.base_url, TOP, file=model, comment=f"c{number}")
        fail(silo, "upload_file", UnreachableError("gone"))
        outbox.send(silo)
        outbox.send(silo, force=True)
    assert log_of(silo, TOP) == ["c0", "c1", "c2"]


@pytest.mark.parametrize(
    "error",
    [ConflictError("held by a colleague"), None],
    ids=["409", "400"],
)
def test_what_is_rejected_stays_visible_and_holds_up_nobody(
    outbox: Outbox, silo: FakeSilo, error: SiloError | None
) -> None:
    """With its reason, until a person retries or discards it."""
    unknown = bom(1, "no-such-part")
    outbox.put(silo.base_url, TOP, bom=bom(1) if error else unknown)
    outbox.put(silo.base_url, OTHER, bom=bom(2))
    outbox.put(silo.base_url, TOP, bom=bom(3))
    if error:
        fail(silo, "merge_bom", error)
    report = outbox.send(silo)
    assert [e.part_number for e in report.held] == [TOP]
    assert (log_of(silo, OTHER), log_of(silo, TOP)) == (["2"], ["3"])
    (left,) = outbox.entries()
    assert left.state is State.HELD
    assert (str(error) if error else "no-such-part") in left.reason
    assert outbox.send(silo, force=True).sent == []
    outbox.discard(left.id)
    assert outbox.entries() == ()
    with pytest.raises(InputError, match="no entry"):
        outbox.discard(left.id)


def test_a_half_that_went_alone_is_reported(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """A refused file does not keep its BOM, nor the other way round; the entry says which one went."""
    fail(silo, "upload_file", ConflictError("held by a colleague"))
    outbox.put(silo.base_url, TOP, file=model, bom=bom(2))
    outbox.put(silo.base_url, OTHER, file=model, bom=bom(1, "no-such-part"))
    outbox.put(silo.base_url, BOLT, bom=bom(1, "no-such-part"))
    outbox.send(silo)
    file, lines, only = (entry.reason.splitlines() for entry in outbox.entries())
    assert file == ["held by a colleague", "Its BOM is in Silo; only the file is not"]
    assert lines[-1] == "Its file is in Silo; only the BOM is not"
    assert len(only) == 1
    fail(silo, "upload_file", ConflictError("still held"))
    outbox.retry(outbox.entries()[0].id)
    outbox.send(silo)
    assert outbox.entries()[0].reason == "still held\nIts BOM is in Silo; only the file is not"


def test_messages_name_the_users_file(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """Not the copy that is kept for sending, of which people know nothing."""
    spoil = {
        "shorter": lambda copy: fail(silo, "upload_file", DocumentError(str(copy), "became shorter")),
        "gone": Path.unlink,
        "damaged": lambda copy: copy.write_bytes(b"x"),
    }
    for name, harm in spoil.items():
        entry = outbox.put(silo.base_url, TOP, file=model)
        copy = outbox.copies / entry.copy
        harm(copy)
        outbox.send(silo)
        said = outbox.entries()[-1].reason
        assert said.startswith(f"{model}: "), name
        assert entry.key not in said, name
        outbox.discard(entry.id)


def test_an_old_state_is_not_brought_back_by_a_retry(outbox: Outbox, silo: FakeSilo) -> None:
    """The newer BOM arrived; retrying the rejected older one would undo it."""
    old = outbox.put(silo.base_url, TOP, bom=bom(1, "no-such-part"))
    outbox.send(silo)
    early = outbox.put(silo.base_url, OTHER, bom=bom(1, "no-such-part"))
    outbox.put(silo.base_url, TOP, bom=bom(5))
    outbox.send(silo)
    assert [e.superseded for e in outbox.entries()] == [True, False]
    with pytest.raises(ConflictError, match=r"a newer commit was sent; this one would overwrite it"):
        outbox.retry(old.id)
    outbox.retry(early.id)
    assert [e.state for e in outbox.entries()] == [State.HELD, State.WAITING]


# -- passing failures ---------------------------------------------------------------------------------------


def test_pauses_grow_and_keep_the_order(outbox: Outbox, silo: FakeSilo, clock: Clock) -> None:
    """The second commit of an assembly waits for the first; others continue. What arrived ends the growth."""
    outbox.put(silo.base_url, TOP, bom=bom(1))
    outbox.put(silo.base_url, TOP, bom=bom(2))
    outbox.put(silo.base_url, OTHER, bom=bom(9))
    fail(silo, "merge_bom", ServerFaultError("500"), times=1)
    report = outbox.send(silo)

    def left() -> float:
        pause = outbox.pause(silo.base_url, TOP.casefold())
        assert pause is not None
        return pause.left(clock.now)

    assert ([e.reason for e in report.failed], left()) == (["500"], 10)
    assert (log_of(silo, TOP), log_of(silo, OTHER), outbox.waiting()) == ([], ["9"], 2)
    clock.now += 9
    assert outbox.send(silo).sent == []
    fail(silo, "merge_bom", ServerFaultError("500"), times=1)
    clock.now += 1
    assert (len(outbox.send(silo).failed), left()) == (1, 20)
    clock.now += 20
    assert len(outbox.send(silo).sent) == 2
    assert log_of(silo, TOP) == ["1", "2"]
    outbox.put(silo.base_url, TOP, bom=bom(3))
    fail(silo, "merge_bom", ServerFaultError("500"), times=1)
    assert (len(outbox.send(silo).failed), left()) == (1, 10)


def test_a_stop_between_entries_keeps_the_rest(outbox: Outbox, silo: FakeSilo) -> None:
    """No pause is put on what was not tried."""
    outbox.put(silo.base_url, TOP, bom=bom(1))
    outbox.put(silo.base_url, OTHER, bom=bom(2))
    stopped = threading.Event()
    report = outbox.send(silo, cancelled=stopped, on_sent=lambda _sent: stopped.set())
    assert isinstance(report.stopped_by, CancelledError)
    assert (len(report.sent), outbox.waiting()) == (1, 1)
    assert len(outbox.send(silo).sent) == 1


def test_what_is_added_while_sending_is_sent_too(outbox: Outbox, silo: FakeSilo) -> None:
    """A commit during a long run."""
    outbox.put(silo.base_url, TOP, bom=bom(1))
    added: list[object] = []

    def add_one(delivery: object) -> None:
        if not added:
            added.append(outbox.put(silo.base_url, TOP, bom=bom(2)))

    outbox.send(silo, on_sent=add_one)
    assert log_of(silo, TOP) == ["1", "2"]


def test_only_one_sends_at_a_time(outbox: Outbox, silo: FakeSilo) -> None:
    """Another process or thread finds it busy, and leaves it alone."""
    outbox.put(silo.base_url, TOP, bom=bom(1))
    others = []
    outbox.send(silo, on_sent=lambda d: others.append(Outbox(outbox.path).send(silo)))
    assert (others[0].busy, others[0].sent) == (True, [])
    assert outbox.send(silo).busy is False


def test_many_senders_at_once_send_each_entry_once(outbox: Outbox, silo: FakeSilo) -> None:
    """Threads with outboxes of their own over one file."""
    for number in range(1, 7):
        outbox.put(silo.base_url, TOP, bom=bom(number))
    start = threading.Barrier(4)

    def send() -> None:
        mine = Outbox(outbox.path)
        start.wait()
        while mine.waiting():
            mine.send(silo)

    threads = [threading.Thread(target=send) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert log_of(silo, TOP) == [str(n) for n in range(1, 7)]


def test_a_copy_without_a_row_is_in_view(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """It may be a commit that nobody has sent; what was cut off has no name of its own and is none."""
    entry = outbox.put("http://elsewhere", TOP, file=model)
    for name in ("found.FCStd", ".cut.FCStd.x1.part", f"{entry.key}.FCStd", "ended.FCStd", "ended.gone"):
        (outbox.copies / name).write_bytes(b"x")
    outbox.send(silo)
    assert [(one.key, one.state) for one in outbox.entries()] == [
        (entry.key, State.WAITING),
        ("found", State.HELD),
    ]
    assert {p.name.split(".")[0] for p in outbox.copies.iterdir()} == {entry.key, "found"}


def test_a_silo_without_summaries_is_asked_once(outbox: Outbox, silo: FakeSilo) -> None:
    """In each sending, however many BOMs arrive; what the server keeps of a product comes with its commit."""
    asked: list[str] = []
    summary = ProductSummary(part_number=TOP, parts=1)

    class Spy(FakeSilo):
        def get_summary(self, part_number: str, /) -> ProductSummary | None:
            asked.append(part_number)
            return summary if len(asked) == 1 else None

    spy = Spy()
    spy.items = silo.items
    for number in (TOP, OTHER, TOP):
        outbox.put(silo.base_url, number, bom=bom(1))
    assert [sent.summary for sent in outbox.send(spy).sent] == [summary, None, None]
    assert asked == [TOP, OTHER]


def test_the_names_of_a_commit_go_along(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """Its key makes a repeat harmless, for the file and for the BOM; its hash says what must arrive.

    How much of the file is sent is told with its entry.
    """
    entry = outbox.put(silo.base_url, TOP, file=model, bom=bom(1))
    seen: dict[str, Any] = {}

    class Spy(FakeSilo):
        def upload_file(
            self, part_number: str, path: Path | str, *arguments: Any, **options: Any
        ) -> Revision:
            seen.update(options)
            return super().upload_file(part_number, path, *arguments, **options)

        def merge_bom(self, part_number: str, request: MergeRequest, /, **options: Any) -> MergeResult:
            seen["sync_id"] = request.sync_id
            return super().merge_bom(part_number, request, **options)

    spy = Spy()
    spy.items = silo.items
    told: list[tuple[int, int, int]] = []
    outbox.send(spy, on_progress=lambda one, done, total: told.append((one.id, done, total)))
    assert told[-1] == (entry.id, 11, 11)
    assert (seen["idempotency_key"], seen["sync_id"], seen["sha256"]) == (entry.key, entry.key, entry.sha256)


def unsent_beside_five(outbox: Outbox, silo: FakeSilo, model: Path) -> Any:
    """Return a commit that did not arrive at a server, which has five older revisions of the item."""
    for number in range(5):
        model.write_bytes(b"older %d" % number)
        silo.upload_file(TOP, model)
    model.write_bytes(b"ours")
    entry = outbox.put(silo.base_url, TOP, file=model)
    fail(silo, "upload_file", UnreachableError("gone"))
    outbox.send(silo)
    return entry


def test_what_was_seen_of_the_old_server_says_nothing_of_the_new_one(
    outbox: Outbox, silo: FakeSilo, model: Path
) -> None:
    """The old one had five revisions; on the new one this very file is there already, as the first."""
    entry = unsent_beside_five(outbox, silo, model)
    moved = FakeSilo("http://moved.example")
    moved.create_item("kindred-rd", "A01", "Top")
    moved.upload_file(TOP, model)
    outbox.retry(entry.id, server=moved.base_url)
    outbox.send(moved)
    assert (len(moved.revisions(TOP)), outbox.entries()) == (1, ())


def test_an_upload_to_a_new_server_that_loses_its_answer_is_found_there(
    outbox: Outbox, silo: FakeSilo, model: Path
) -> None:
    """Its numbers are lower than those that the old one had reached, and it knows no names of requests."""
    entry = unsent_beside_five(outbox, silo, model)

    class Plain(FakeSilo):
        def upload_file(self, *arguments: Any, idempotency_key: str | None = None, **more: Any) -> Revision:
            return super().upload_file(*arguments, **more)

    moved = Plain("http://moved.example")
    moved.create_item("kindred-rd", "A01", "Top")
    outbox.retry(entry.id, server=moved.base_url)

    def lose(name: str) -> None:
        if name == "upload_file" and len(moved.revisions(TOP)) == 1:
            moved.upload_file(TOP, model.with_name("Other.FCStd"))
            raise UnreachableError("gone")

    model.with_name("Other.FCStd").write_bytes(b"a colleague's")
    moved.after = lose
    outbox.send(moved)
    outbox.send(moved, force=True)
    assert (len(moved.revisions(TOP)), outbox.entries()) == (2, ())


def test_a_bom_that_moves_to_another_server_takes_its_file_along(
    outbox: Outbox, silo: FakeSilo, model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither server keeps checksums; the number that the file had on the old one is another file's there."""
    read = FakeSilo.revisions

    def without_checksums(self: FakeSilo, *arguments: Any, **more: Any) -> Any:
        return [one.model_copy(update={"file_checksum": None}) for one in read(self, *arguments, **more)]

    monkeypatch.setattr(FakeSilo, "revisions", without_checksums)
    entry = outbox.put(silo.base_url, TOP, file=model, bom=bom(1))
    fail(silo, "merge_bom", ServerFaultError("500"))
    outbox.send(silo)
    assert [one.file_left for one in outbox.entries()] == [False]
    moved = FakeSilo("http://moved.example")
    for category, name in (("A01", "Top"), ("F01", "Bolt")):
        moved.create_item("kindred-rd", category, name)
    other = model.with_name("Other.FCStd")
    other.write_bytes(b"another file")
    moved.upload_file(TOP, other)
    outbox.retry(entry.id, server=moved.base_url)
    outbox.send(moved)
    assert outbox.entries() == ()
    assert [one.file_name for one in moved.revisions(TOP)] == [model.name, other.name]


def test_a_file_of_another_name_is_no_question_for_whoever_names_the_item(
    outbox: Outbox, silo: FakeSilo, model: Path
) -> None:
    """The name is asked about where the identity in the file says which item it is: "Save As" copies that."""
    silo.upload_file(TOP, model)
    other = model.with_name("Renamed.FCStd")
    other.write_bytes(b"another state")
    outbox.put(silo.base_url, TOP, file=other)
    assert len(outbox.send(silo).sent) == 1
    assert [one.file_name for one in silo.revisions(TOP)][:2] == ["Renamed.FCStd", model.name]


def test_an_entry_that_is_not_copied_yet_keeps_its_place(outbox: Outbox, silo: FakeSilo, model: Path) -> None:
    """A later commit of the same item waits for it; others do not."""
    outbox.copies.mkdir(parents=True, exist_ok=True)
    first = Commit(str(model), 1.0, part_number=TOP, file=model, comment="first")
    outbox.stage(first)  # its copy is for another thread to make
    outbox.put(silo.base_url, TOP, bom=bom(2))
    outbox.put(silo.base_url, OTHER, bom=bom(3))
    outbox.send(silo)
    assert (log_of(silo, TOP), log_of(silo, OTHER)) == ([], ["3"])
    assert [entry.state for entry in outbox.entries()] == [State.KEEPING, State.WAITING]
    assert outbox.finish(first.key, model)
    outbox.send(silo)
    assert log_of(silo, TOP) == ["first", "2"]
