# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two designers at one assembly, in any order of edits, saves, commits, sendings and choices: a law.

Each edit has a name, and a file holds the names of all edits that are in it. So whatever the code thinks of
origins and revisions, it shows in the files whether an edit of somebody was lost: a revision lacks what its
predecessor has only where a person chose to commit on top of that very revision.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo.api.wire import Item
from silo.bom.model import BomEntry, Extraction
from silo.outbox.entry import Commit, State
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.testing import FakeSilo
from silo.workbench.commit.opened import Base, Opened

# SILO_LONG=1 runs all seeds over both; else a sample of them. The fake answers as the server does, says the
# contract suite.
SEEDS, BLOCKS, STEPS = 200, 4, 9
SAMPLE = {FakeSilo: 60, SiloClient: 8}
LONG = bool(os.environ.get("SILO_LONG"))
PARTS = ("A", "B", "C", "D")


Client = SiloClient | FakeSilo


@pytest.fixture(name="server", scope="module")
def _server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SiloClient]:
    run = pytest.importorskip("silo_server.run", reason="the embedded server needs the extra 'server'")
    database = sqlite_database(tmp_path_factory.mktemp("silo") / "silo.db")
    with (
        run.running_server(database, token="silo_two") as server,
        SiloClient(server.base_url, server.token) as client,
    ):
        yield client


@pytest.fixture(name="client", params=["fake", "server"])
def _client(request: pytest.FixtureRequest) -> Client:
    if request.param == "fake":
        return FakeSilo()
    found: SiloClient = request.getfixturevalue("server")
    return found


@dataclass
class Doc:
    """An open document: the edits in it, in their order."""

    Name: str
    FileName: str = ""
    Objects: list[str] = field(default_factory=list)
    edits: list[str] = field(default_factory=list)

    @property
    def parts(self) -> set[str]:
        found: set[str] = set()
        for edit in self.edits:
            found = found | {edit[1]} if edit[0] == "+" else found - {edit[1]}
        return found


def content(edits: list[str]) -> bytes:
    return json.dumps(edits).encode()


class Designer:
    """A FreeCAD, as far as it matters here: one document, what it was made from, an outbox."""

    def __init__(self, world: World, name: str, path: Path, store: Store) -> None:
        self.world, self.name, self.path, self.store = world, name, path, store
        self.opened = Opened(lambda: store)
        self.opened.begin(lambda call: call())
        self.doc = Doc(name)

    @property
    def base(self) -> Base:
        return self.opened.of(self.doc)

    def reopen(self) -> None:
        """Close without saving, and open what is on the disk."""
        self.opened.slotDeletedDocument(self.doc)
        self.doc = Doc(self.name, str(self.path))
        self.opened.slotChangedDocument(self.doc, "FileName")
        self.doc.edits = json.loads(self.path.read_bytes())

    def edit(self) -> None:
        self.world.count += 1
        part = self.world.random.choice(PARTS)
        sign = "-" if part in self.doc.parts else "+"
        self.doc.edits = [*self.doc.edits, f"{sign}{part}{self.world.count}"]

    def save(self) -> None:
        """FreeCAD's own save; it asks nobody, so a person who shares a folder does not use it over a
        colleague's file."""
        if self.base.replaced:
            return
        self._write()

    def _write(self) -> None:
        self.opened.slotStartSaveDocument(self.doc, self.doc.FileName)
        part = self.path.with_suffix(".part")
        part.write_bytes(content(self.doc.edits))
        part.replace(self.path)
        self.opened.slotFinishSaveDocument(self.doc, self.doc.FileName)

    def commit(self) -> None:
        """By the add-on. A file that somebody has replaced is a question: take theirs, or leave it."""
        if self.base.replaced:
            if self.world.random.random() < 0.5:
                self.reopen()
            return
        self._write()
        entries = tuple(
            BomEntry(f"{part}.FCStd", object_name="Body", silo_uuid=self.world.ids[part], quantity=1)
            for part in sorted(self.doc.parts)
        )
        head = BomEntry(str(self.path), silo_uuid=self.world.ids["Top"], object_name="Top", is_assembly=True)
        commit = Commit(
            path=str(self.path),
            taken_at=1.0,
            label="Top",
            identity=self.world.ids["Top"],
            file=self.path,
            extraction=Extraction(head, entries),
            origin=self.base.origin,
        )
        self.store.stage(commit)
        self.base.committed(self.store.finish(commit.key, commit.file, self.base.origin))

    def send(self) -> None:
        send_all(self.store, self.world.client, force=True)

    def decide(self) -> None:
        """A person looks at what is held: on top of what they saw, or take theirs, or leave it."""
        for entry in self.store.entries():
            if entry.state is not State.HELD:
                continue
            chance = self.world.random.random()
            if chance < 0.6:
                self.world.chosen.add(entry.newer["revision_number"])
                self.store.retry(entry.id)
            elif chance < 0.8:
                self.store.discard(entry.id)
                self.take()

    def take(self) -> None:
        """The newest from Silo, in the place of mine."""
        revisions = self.world.client.revisions(self.world.number)
        if revisions:
            self.world.client.download_file(self.world.number, self.path, revisions[0].revision_number)
            self.reopen()

    def copy(self) -> None:
        """A copy of the colleague's project folder, saved edits and all."""
        other = next(one for one in self.world.designers if one is not self)
        if other.path != self.path:
            shutil.copyfile(other.path, self.path)
            self.reopen()


@dataclass
class World:
    """Two designers and a Silo; ``shared``: both have the same file open, on one computer."""

    client: Client
    parts: dict[str, Item]
    folder: Path
    random: random.Random
    shared: bool
    count: int = 0
    chosen: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        items = {
            **self.parts,
            "Top": self.client.create_item("kindred-rd", "A01", "Top", item_type="assembly"),
        }
        self.ids = {name: item.id for name, item in items.items()}
        self.number = items["Top"].part_number
        self.names = {item.part_number: name for name, item in items.items()}
        first = self.folder / "alice" / "Top.FCStd"
        second = first if self.shared else self.folder / "bob" / "Top.FCStd"
        stores = [Store(self.folder / "a.sqlite3")]
        stores.append(stores[0] if self.shared else Store(self.folder / "b.sqlite3"))
        for path in (first, second):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content([]))
        self.designers = [
            Designer(self, name, path, store)
            for name, path, store in zip(("alice", "bob"), (first, second), stores, strict=True)
        ]
        for one in self.designers:
            one.reopen()
        # Both have opened revision 1.
        self.designers[0].edit()
        self.designers[0].commit()
        self.designers[0].send()
        self.designers[1].take()

    def step(self) -> None:
        one = self.random.choice(self.designers)

        def work() -> None:
            one.edit()
            one.commit()

        def hurry() -> None:
            work()
            one.send()

        deeds = [hurry, work, one.edit, one.send, one.save, one.decide, one.reopen, one.copy, one.take]
        self.random.choices(deeds, weights=[6, 3, 2, 3, 2, 4, 1, 1, 1])[0]()

    def end(self) -> None:
        for one in self.designers:
            one.send()

    def check(self) -> None:
        """No revision lacks an edit of the one before, but at a person's word; the BOM is that of the newest
        file."""
        before: set[str] = set()
        edits: list[str] = []
        for revision in sorted(self.client.revisions(self.number), key=lambda one: one.revision_number):
            target = self.folder / "looked at"
            sha256 = self.client.download_file(self.number, target, revision.revision_number)
            assert sha256 == hashlib.sha256(target.read_bytes()).hexdigest()
            edits = json.loads(target.read_bytes())
            lost = before - set(edits)
            previous = revision.revision_number - 1
            at_a_word = previous in self.chosen and f"on top of revision {previous}" in revision.comment
            assert not lost or at_a_word, f"revision {revision.revision_number} lost {lost}"
            before = set(edits)
        if not any(one.store.entries() for one in self.designers):
            lines = self.client.get_bom(self.number)
            used = {self.names[line.child_part_number] for line in lines if line.unreferenced_since is None}
            assert used == Doc("", edits=edits).parts


@pytest.mark.parametrize("block", range(BLOCKS))
def test_no_edit_is_lost_without_a_choice(client: Client, block: int, tmp_path: Path) -> None:
    """200 seeds, half of them with one file open twice."""
    seeds = range(block, SEEDS if LONG else SAMPLE[type(client)], BLOCKS)
    parts = {name: client.create_item("kindred-rd", "M01", name) for name in PARTS}
    revisions = asked = 0
    for seed in seeds:
        world = World(client, parts, tmp_path / str(seed), random.Random(seed), shared=seed % 8 > 3)
        for _ in range(STEPS):
            world.step()
        world.end()
        world.check()
        revisions += len(client.revisions(world.number))
        asked += len(world.chosen)
    # The runs are no idle ones: people committed, were asked, and committed on top of a colleague's revision.
    assert revisions > len(seeds)
    if LONG:
        assert asked > 0
