# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two designers with files that link to each other, in the window and on the command line, in any order.

A file holds the names of all edits that are in it, so that a lost one shows, whatever the code thinks of
records and origins. After each step: no revision is lost or lacks an edit of the one before without a choice,
nobody is in conflict with themselves, each state is what the bytes say, and what is wholly in Silo comes back
as it is.
"""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from desk import Desk, Document, Office, Silo, Watched
from fcstd_writer import Doc, locals_, part

from silo.bom.errors import UnreachableError
from silo.outbox.entry import State
from silo.outbox.send import send_all
from silo.vault.project import (
    FileStanding,
    commits,
    compare,
    find_project,
    keep,
    name_documents,
    read_project,
    remember,
    stand,
)
from silo.vault.pull import place, rules_of
from silo.vault.tree import fetched
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.documents.opened import Opened

LONG = bool(os.environ.get("SILO_LONG"))
SEEDS, STEPS = (20, 300) if LONG else (4, 30)
FILES = ("Plate", "Sub", "Skeleton", "Top")
USERS = {"Plate": ("Sub", "Top"), "Sub": ("Top",), "Skeleton": ("Top",), "Top": ()}


def hashed(content: bytes) -> str:
    return sha256(content).hexdigest()


class Paper(Document):
    """A document that FreeCAD is about to read: nothing is in it yet."""

    Objects = ()


class Designer(Office):
    """A FreeCAD, a command line, and the user of both."""

    def __init__(self, world: World, name: str) -> None:
        self.world, self.name = world, name
        self.root = world.folder / name / "work"
        self.root.mkdir(parents=True)
        super().__init__(world.folder / name, world.silo)

    def start(self) -> Any:
        session = super().start()
        opened = Opened(lambda: self.session.outbox)
        opened.begin(lambda call: call())
        self.watched = Watched(opened)
        self.desk = Desk(self.watched)
        self.commits = CommitFlow(session, self.preferences, self.desk, path=self.folder / "same.json")
        return session

    def path(self, name: str) -> Path:
        return self.root / f"{name}.FCStd"

    def doc(self, name: str) -> Document | None:
        """The open document of a file; opened if the file is there."""
        found = next((doc for doc in self.desk.open if doc.Name == name), None)
        if found is not None or not self.path(name).exists():
            return found
        doc = Paper(name, "")
        doc.FileName, doc.content, doc.changed = str(self.path(name)), self.path(name).read_bytes(), False
        doc.identity = self.world.ids.get(name, "")
        self.watched.opened.slotChangedDocument(doc, "FileName")
        self.desk.open.append(doc)
        by_name = {one.Name: one for one in self.desk.open}
        for one in self.desk.open:
            one.OutList = [by_name[below] for below in self.world.below(one.Name) if below in by_name]
        return doc

    def close_all(self) -> None:
        """Close all documents; unsaved edits are given up."""
        for doc in [*self.desk.open]:
            self.watched.opened.slotDeletedDocument(doc)
            doc.closed = True
        self.desk.open.clear()

    def settle(self) -> None:
        self.silo.user = self.name
        super().settle()

    # -- what a designer does ---------------------------------------------------------------------------

    def edit(self) -> None:
        doc = self.doc(self.world.random.choice(FILES))
        if doc is not None:
            doc.content = self.world.edited(doc.Name, doc.content)
            doc.changed, doc.recomputed = True, False

    def save(self) -> None:
        """Ctrl+S in one document: what links to it is marked."""
        for doc in [doc for doc in self.desk.open if doc.changed and not doc.recomputed][:1]:
            if self.watched.base(doc).replaced:
                return
            self.watched.save(doc)
            for user in self.desk.open:
                if user.Name in USERS[doc.Name] and not user.changed:
                    user.changed = user.recomputed = True

    def commit(self) -> None:
        doc = self.doc(self.world.random.choice(("Top", "Top", "Sub", "Plate", "Skeleton")))
        if doc is not None:
            self.commits.start(doc)
            self.settle()

    def foreign(self) -> None:
        """Another program writes a file that FreeCAD does not have open."""
        name = self.world.random.choice(FILES)
        if self.path(name).exists() and self.desk.find(str(self.path(name))) is None:
            self.path(name).write_bytes(self.world.edited(name, self.path(name).read_bytes()))

    def command(self) -> None:
        """``silo-mod commit`` of the folder."""
        self.silo.user = self.name
        self.close_all()
        client, store = (None if self.world.away else self.silo), self.session.outbox
        found = name_documents(read_project([str(self.root)], find_project([str(self.root)])), client)
        standings = compare(found, client, store)
        remember(found.project, standings, client)
        for file, one in commits(found, standings, allow_missing=True):
            keep(found.project, store, file, one, self.silo.base_url if client else "")
        if client is not None:
            send_all(store, client, force=True)

    def pull(self, number: int | None = None) -> None:
        if self.world.away:
            return
        self.close_all()
        self.silo.user = self.name
        with fetched(self.silo, self.world.number("Top"), number) as tree:
            place(tree, self.root, rules_of(self.session.outbox, self.silo, is_open=lambda _path: False))

    def pull_old(self) -> None:
        self.pull(self.world.random.choice([*self.world.stored("Top").files]))

    def answer(self) -> None:
        """Decide about a held commit: send it on top of what was seen, or drop it."""
        held = [entry for entry in self.session.outbox.entries() if entry.state is State.HELD]
        if held and not self.world.away:
            entry = self.world.random.choice(held)
            if entry.newer and not entry.superseded and self.world.random.random() < 0.5:
                self.world.chosen.add(entry.newer["file_checksum"])
                self.session.retry(entry.id)
            else:
                self.session.discard(entry.id, keep=True)
            self.settle()

    def discard(self) -> None:
        for entry in self.session.outbox.entries()[:1]:
            self.session.discard(entry.id, keep=True)
            self.settle()

    def die(self) -> None:
        """FreeCAD is killed, and started again."""
        self.gui.calls.queue.clear()
        self.session.close()
        self.gui.calls.queue.clear()
        self.session = self.start()
        self.session.begin(live=False)
        self.settle()

    def standings(self) -> list[FileStanding]:
        project = find_project([str(self.root)])
        return stand([str(self.root)], project, self.silo, self.session.outbox)[1]


@dataclass
class World:
    """Both of them, and their server."""

    folder: Path
    random: random.Random
    silo: Silo = field(default_factory=Silo)
    edits: dict[str, tuple[int, ...]] = field(default_factory=dict)
    ids: dict[str, str] = field(default_factory=dict)
    chosen: set[str] = field(default_factory=set)
    count: int = 0
    away: bool = False

    def __post_init__(self) -> None:
        for name, kind in (("Plate", "part"), ("Sub", "assembly"), ("Top", "assembly")):
            self.ids[name] = self.silo.create_item("kindred-rd", "M01", name, item_type=kind).id
        self.silo.before = self.before
        self.alice, self.bob = Designer(self, "alice"), Designer(self, "bob")
        for name in FILES:
            self.alice.path(name).write_bytes(self.content(name, ()))
        self.alice.command()
        self.bob.pull()

    def before(self, _name: str) -> None:
        if self.away:
            raise UnreachableError("nobody answers")

    def below(self, name: str) -> tuple[str, ...]:
        return {"Sub": ("Plate",), "Top": ("Sub", "Skeleton")}.get(name, ())

    def content(self, name: str, edits: tuple[int, ...]) -> bytes:
        label = f"{name} {edits}"
        if name == "Plate":
            made = part(label, uuid=self.ids[name])
        elif name == "Skeleton":
            made = Doc(label=label).add("Spreadsheet::Sheet", "Sheet")
        else:
            made = Doc(label, meta={"SiloUUID": self.ids[name]})
            for below in self.below(name):
                made.link(below, f"{below}.FCStd", "Sheet" if below == "Skeleton" else "Box")
            members = locals_(self.below(name)[0])
            made.add("App::Part", "Box", Type="Assembly", Group=members)
        content = made.bytes()
        self.edits[hashed(content)] = edits
        return content

    def edited(self, name: str, content: bytes) -> bytes:
        self.count += 1
        return self.content(name, (*self.edits[hashed(content)], self.count))

    def stored(self, name: str) -> Any:
        if name in self.ids:
            return next(one for one in self.silo.items.values() if one.item.name == name)
        return next(iter(self.silo.documents.values()))

    def number(self, name: str) -> str:
        return str(self.stored(name).item.part_number)

    def change_server(self) -> None:
        self.away = not self.away
        if not self.away:
            for one in (self.alice, self.bob):
                one.silo.user = one.name
                one.session.send(force=True)
                one.settle()

    # -- laws -------------------------------------------------------------------------------------------

    def check(self, seen: dict[str, dict[int, str]]) -> None:
        assert len(self.silo.documents) == 1, "the skeleton is two documents"
        for name in FILES:
            stored, before = self.stored(name), None
            numbers = {number: hashed(content) for number, content in sorted(stored.files.items())}
            assert seen.get(name, {}).items() <= numbers.items(), f"a revision of {name} is lost"
            seen[name] = numbers
            comments = {one.revision_number: one.comment for one in stored.revisions}
            for number, now in numbers.items():
                lost = set(self.edits[before]) - set(self.edits[now]) if before else set()
                at_a_word = before in self.chosen and "on top of revision" in comments[number]
                assert not lost or at_a_word, f"revision {number} of {name} lost {lost}"
                assert now != before, f"revision {number} of {name} was sent twice"
                before = now
        for one in (self.alice, self.bob):
            assert not one.bugs, one.bugs
            for entry in one.session.outbox.entries():
                if entry.state is State.HELD and entry.newer:
                    assert entry.newer["created_by"] != one.name, "a conflict with oneself"
        if not self.away:
            self.check_states()

    def check_states(self) -> None:
        for one in (self.alice, self.bob):
            standings = one.standings()
            for standing in standings:
                name = Path(standing.file.path).stem
                newest = hashed(self.stored(name).files[max(self.stored(name).files)])
                is_same = hashed(one.path(name).read_bytes()) == newest
                assert (standing.state.value == "same") == is_same, f"{one.name}: {name} is {standing.state}"
            if all(standing.state.value == "same" for standing in standings) and len(standings) == len(FILES):
                back = self.folder / "back"
                with fetched(self.silo, self.number("Top")) as tree:
                    pulled = place(tree, back)
                assert not pulled.lost, pulled.lost
                for name in FILES:
                    assert (back / f"{name}.FCStd").read_bytes() == one.path(name).read_bytes(), name
                shutil.rmtree(back)

    def step(self, log: list[str]) -> None:
        one = self.random.choice((self.alice, self.bob))
        deeds: list[tuple[int, Callable[[], None]]] = [
            (8, one.edit),
            (6, one.save),
            (6, one.commit),
            (3, one.command),
            (2, one.foreign),
            (3, one.pull),
            (1, one.pull_old),
            (3, one.answer),
            (1, one.discard),
            (1, one.die),
            (1, self.change_server),
        ]
        (deed,) = self.random.choices([deed for _, deed in deeds], [weight for weight, _ in deeds])
        log.append(f"{one.name}: {deed.__name__}{' (away)' if self.away else ''}")
        deed()
        one.settle()


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SILO_API_URL", "SILO_API_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    for name in ("XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name))


FIRST = int(os.environ.get("SILO_FIRST_SEED", "0"))


@pytest.mark.parametrize("seed", range(FIRST, FIRST + SEEDS))
def test_what_is_in_silo_is_what_they_have(seed: int, tmp_path: Path) -> None:
    """A law, for any days of two designers."""
    world = World(tmp_path, random.Random(seed))
    log: list[str] = []
    seen: dict[str, dict[int, str]] = {}
    try:
        for _ in range(STEPS):
            world.step(log)
            world.check(seen)
    except Exception as error:
        raise AssertionError(f"{error!r}\nseed {seed}, step {len(log)}:\n" + "\n".join(log[-40:])) from error
    finally:
        world.away = False
        for one in (world.alice, world.bob):
            one.session.close()
