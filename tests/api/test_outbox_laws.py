# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox's law: whatever fails and whenever it dies, each commit arrives once, in order per assembly."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hypothesis import event, given, settings
from hypothesis import strategies as st

from silo.api.outbox import Outbox, State
from silo.api.outbox_store import OutboxEntry, Store
from silo.api.wire import MergeEntry, MergeRequest
from silo.bom.errors import ReadOnlyError, ServerFaultError, UnreachableError
from silo.testing import FakeSilo


class Killed(BaseException):
    """The process ended here; nothing of ours ran after it."""


FATES = {
    "killed": Killed(),
    "unreachable": UnreachableError("the way broke"),
    "fault": ServerFaultError("500"),
    "read-only": ReadOnlyError("503"),
}


class Fate:
    """What happens at each step of the run, as drawn; when the draw is used up, all goes well."""

    def __init__(self, drawn: list[str | None]) -> None:
        self.drawn = drawn

    def meet(self, *, local: bool = False) -> None:
        fate = self.drawn.pop(0) if self.drawn else None
        # On this computer's own disk only a kill can happen.
        if fate is not None and (fate == "killed" or not local):
            raise FATES[fate]


class DyingStore(Store):
    """Dies before or after any of its changes."""

    fate = Fate([])

    def update(self, entry_id: int, **values: Any) -> None:
        self.fate.meet(local=True)
        super().update(entry_id, **values)
        self.fate.meet(local=True)

    def arrived(self, entry: OutboxEntry, now: float, revision: int | None = None) -> None:
        self.fate.meet(local=True)
        super().arrived(entry, now, revision)
        self.fate.meet(local=True)

    def drop_copy(self, entry: OutboxEntry) -> None:
        self.fate.meet(local=True)
        super().drop_copy(entry)

    def insert(self, rows: list[dict[str, Any]]) -> list[int]:
        self.fate.meet(local=True)
        return super().insert(rows)


@contextmanager
def folder() -> Iterator[Path]:
    made = Path(tempfile.mkdtemp(prefix="outbox-"))
    try:
        yield made
    finally:
        shutil.rmtree(made)


def opened(path: Path, fate: Fate) -> Outbox:
    """A new process's outbox."""
    outbox = Outbox(path, chance=lambda: 0.0)
    store = DyingStore(path)
    store.fate = fate
    outbox._store = store
    return outbox


def arrived(silo: FakeSilo, part_number: str) -> list[str]:
    """What the server took for an item, in order."""
    said = [e for e in silo.log if e.item == part_number]
    return [
        e.data["comment"] if e.merge is None else str(e.merge.sync_id)
        for e in said
        if e.type == "revision.created" or e.merge is not None
    ]


fates = st.lists(st.sampled_from([None, None, None, *FATES]), max_size=25)
# (assembly, with a file, with a BOM, the BOM names an unknown part, the file's content)
commits = st.tuples(
    st.integers(1, 3), st.booleans(), st.booleans(), st.booleans(), st.sampled_from([b"a", b"b"])
)
actions = st.lists(st.one_of(commits, st.just("send")), min_size=1, max_size=12)


@settings(deadline=None, max_examples=100)
@given(actions, fates)
def test_each_commit_arrives_once_and_in_order(actions: list[Any], drawn: list[str | None]) -> None:
    """Kills at every step of sending, losses before and after the server acted, rejections in between."""
    silo, fate = FakeSilo(), Fate(drawn)
    silo.before = lambda name: (
        fate.meet() if name in ("merge_bom", "upload_file", "revisions", "ready") else None
    )
    silo.after = lambda name: fate.meet() if name in ("merge_bom", "upload_file") else None
    for number in range(3):
        silo.create_item("kindred-rd", "A01", f"Assembly {number}")
    silo.create_item("kindred-rd", "F01", "Bolt")
    expected: dict[str, list[str]] = {f"A01-000{n}": [] for n in (1, 2, 3)}
    rejected: set[str] = set()
    with folder() as place:
        for step, action in enumerate(actions):
            outbox = opened(place / "outbox.sqlite3", fate)
            try:
                if action == "send":
                    outbox.send_all(silo, force=True)
                    continue
                assembly, with_file, with_bom, poisoned, content = action
                item = f"A01-000{assembly}"
                path = place / "model.FCStd"
                path.write_bytes(content)
                child = "no-such-part" if poisoned else "F01-0001"
                entry = MergeEntry(child_part_number=child, quantity=step + 1)
                request = MergeRequest(entries=[entry], sync_id=f"bom {step}")
                outbox.add(
                    silo.base_url,
                    item,
                    file=path if with_file or not with_bom else None,
                    comment=f"file {step}",
                    bom=request if with_bom else None,
                )
            except Killed:
                event("killed")
                continue
            # add() returned, so from here on the commit may not be lost.
            expected[item] += [f"file {step}"] if with_file or not with_bom else []
            expected[item] += [f"bom {step}"] if with_bom and not poisoned else []
            rejected |= {f"bom {step}"} if with_bom and poisoned else set()
        outbox = opened(place / "outbox.sqlite3", fate)
        while any(entry.state is State.WAITING for entry in outbox.pending()):
            try:
                outbox.send_all(silo, force=True)
            except Killed:
                outbox = opened(place / "outbox.sqlite3", fate)
        assert {item: arrived(silo, item) for item in expected} == expected
        assert {entry.payload["sync_id"] for entry in outbox.pending()} == rejected
