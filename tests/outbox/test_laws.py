# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox's law: whatever fails and whenever it dies, each commit arrives once, in order per assembly."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hunting import examples
from hypothesis import event, given, settings
from hypothesis import strategies as st

from silo.api.wire import MergeEntry, MergeRequest
from silo.bom.errors import ReadOnlyError, ServerFaultError, UnreachableError
from silo.outbox.entry import Commit, Entry, State, new_key
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.testing import FakeSilo
from vault import died


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

    def arrived(
        self,
        entry: Entry,
        kind: str,
        revision: int | None = None,
        *,
        base: int | None = None,
        note: bool = True,
    ) -> None:
        self.fate.meet(local=True)
        super().arrived(entry, kind, revision, base=base, note=note)
        self.fate.meet(local=True)

    def stage(self, commit: Commit, server: str = "") -> None:
        self.fate.meet(local=True)
        super().stage(commit, server)

    def finish(self, key: str, source: Path | None = None) -> None:
        self.fate.meet(local=True)
        super().finish(key, source)
        self.fate.meet(local=True)

    def _copied(self, source: Path, copy: Path, stamp: str) -> tuple[str, int]:
        self.fate.meet(local=True)
        found = super()._copied(source, copy, stamp)
        self.fate.meet(local=True)
        return found

    def _drop_files(self, entry: Entry) -> None:
        self.fate.meet(local=True)
        super()._drop_files(entry)


@contextmanager
def folder() -> Iterator[Path]:
    made = Path(tempfile.mkdtemp(prefix="outbox-"))
    try:
        yield made
    finally:
        shutil.rmtree(made)


def opened(path: Path, fate: Fate) -> Store:
    """A new process's outbox."""
    store = DyingStore(path)
    store.fate = fate
    return store


def sending(store: Store, silo: FakeSilo) -> None:
    send_all(store, silo, force=True, chance=lambda: 0.0)


def arrived(silo: FakeSilo, part_number: str) -> list[str]:
    """What the server took for an item, in order."""
    said = [e for e in silo.log if e.item == part_number]
    return [
        e.data["comment"] if e.merge is None else str(e.merge.sync_id)
        for e in said
        if e.type == "revision.created" or e.merge is not None
    ]


fates = st.lists(st.sampled_from([None, None, None, *FATES]), max_size=25)
# (assembly, with a file, with a BOM, the BOM names an unknown part)
commits = st.tuples(st.integers(1, 3), st.booleans(), st.booleans(), st.booleans())
actions = st.lists(st.one_of(commits, st.just("send")), min_size=1, max_size=12)


@settings(max_examples=examples(30))
@given(actions, fates)
def test_each_commit_arrives_once_and_in_order(actions: list[Any], drawn: list[str | None]) -> None:
    """Kills at every step of keeping and sending, losses before and after the server acted, refusals."""
    silo, fate = FakeSilo(), Fate(drawn)
    silo.before = lambda name: (
        fate.meet() if name in ("merge_bom", "upload_file", "revisions", "ready") else None
    )
    silo.after = lambda name: fate.meet() if name in ("merge_bom", "upload_file") else None
    for number in range(3):
        silo.create_item("kindred-rd", "A01", f"Assembly {number}")
    silo.create_item("kindred-rd", "F01", "Bolt")
    expected: dict[str, list[str]] = {f"A01-000{n}": [] for n in (1, 2, 3)}
    refused: set[str] = set()
    with folder() as place:
        for step, action in enumerate(actions):
            store = opened(place / "outbox.sqlite3", fate)
            is_staged = False
            try:
                if action == "send":
                    sending(store, silo)
                    continue
                assembly, with_file, with_bom, poisoned = action
                with_file = with_file or not with_bom
                item = f"A01-000{assembly}"
                path = place / "model.FCStd"
                path.unlink(missing_ok=True)
                path.write_bytes(b"content %d" % step)
                child = "no-such-part" if poisoned else "F01-0001"
                entry = MergeEntry(child_part_number=child, quantity=step + 1)
                request = MergeRequest(entries=[entry], sync_id=f"bom {step}")
                key = new_key()
                commit = Commit(
                    str(path),
                    float(step),
                    part_number=item,
                    key=key,
                    file=store.hold(str(path), key) if with_file else None,
                    comment=f"file {step}",
                    request=request.model_dump_json(exclude_none=True) if with_bom else "",
                )
                store.stage(commit, silo.base_url)
                is_staged = True
                store.finish(key)
            except Killed:
                event("killed")
                died(store)
            if is_staged:
                # stage() returned, so from here on the commit may not be lost.
                expected[item] += [f"file {step}"] if with_file else []
                expected[item] += [f"bom {step}"] if with_bom and not poisoned else []
                refused |= {f"bom {step}"} if with_bom and poisoned else set()
        while True:
            store = opened(place / "outbox.sqlite3", fate)
            try:
                if all(entry.state is State.HELD for entry in store.entries()):
                    break
                sending(store, silo)
            except Killed:
                died(store)
                continue
        assert {item: arrived(silo, item) for item in expected} == expected
        left = {MergeRequest.model_validate_json(store.bom(e.id)[1]).sync_id for e in store.entries()}
        assert left == refused
        store.fate = Fate([])
        store.sweep()
        assert {path.name for path in store.copies.iterdir()} == {
            name for e in store.entries() for name in (e.copy, f"{e.key}.json") if name
        }
