# SPDX-License-Identifier: LGPL-2.1-or-later
"""Three designers, two files, one server and everything that goes wrong: whose edits survive.

Each designer is the add-on without FreeCAD and Qt: commit flow, session, outbox, pane. Each edit has a name,
and a file holds the names of all edits that are in it, so that a lost one shows, whatever the code thinks of
origins and revisions. The server can be away, lose its answers and come back from an older backup; disks are
full or cannot hold second names; people copy folders, rename files, fetch revisions and answer as they like.
"""

from __future__ import annotations

import errno
import json
import os
import random
import shutil
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from desk import Desk, Document, Office, Silo, Watched

from silo.bom.errors import SiloError, UnreachableError
from silo.outbox.entry import Entry, State
from silo.outbox.store import Store
from silo.project_folder import record_of, write_record
from silo.workbench.colleagues.theirs import Choice, Theirs, of_held
from silo.workbench.commit.desk import CommitAnswer, Look
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.commit.plan import CommitPlan, DocumentRow
from silo.workbench.documents.opened import Opened
from silo.workbench.revisions.flow import RevisionFlow
from silo.workbench.session.session import Session

SEEDS, STEPS = 2000, 25
SAMPLE = 6
LONG = bool(os.environ.get("SILO_LONG"))
PARTS = ("A", "B", "C", "D")
FILES = ("Sub", "Top")


class Disk(Store):
    """The outbox on a disk that has its days."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.full = self.other = False

    def hold(self, path: str, key: str) -> Path | None:
        return None if self.other else super().hold(path, key)

    def _copied(self, source: Path, copy: Path, stamp: str) -> tuple[str, int]:
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super()._copied(source, copy, stamp)


class Paper(Document):
    """A document that FreeCAD is about to read: nothing is in it yet."""

    Objects = ()


@dataclass
class Cad(Desk):
    """FreeCAD: what is open, and what is on the disk."""

    fill: Callable[[Document], None] = lambda _doc: None

    def open_file(self, name: str, path: Path) -> Document:
        doc = Paper(name, "")
        assert isinstance(self.documents, Watched)
        doc.FileName, doc.content, doc.changed = str(path), path.read_bytes(), False
        self.documents.opened.slotChangedDocument(doc, "FileName")
        self.open.append(doc)
        self.fill(doc)
        return doc

    def close(self, doc: Any, /) -> None:
        assert isinstance(self.documents, Watched)
        self.documents.opened.slotDeletedDocument(doc)
        self.open.remove(doc)
        doc.closed = True

    def save_copy(self, doc: Any, path: Path, /) -> None:
        path.write_bytes(doc.content)


class Files:
    """The part of :class:`Cad` that gets files from Silo."""

    def __init__(self, cad: Cad) -> None:
        self.cad = cad
        self.documents = cad.documents
        self.find = cad.find
        self.close = cad.close
        self.save_copy = cad.save_copy

    def open(self, path: str, /) -> Any:
        if self.cad.find(path) is None:
            name = "Sub" if "Sub" in os.path.basename(path) else "Top"
            if not any(doc.Name == name for doc in self.cad.open):
                self.cad.open_file(name, Path(path))

    def open_paths(self) -> tuple[str, ...]:
        return tuple(doc.FileName for doc in self.cad.open)

    def is_open_elsewhere(self, _path: str, /) -> bool:
        return False


def is_recorded(path: str, sha256: str) -> bool:
    record = record_of(path)
    return record is not None and record.sha256 == sha256


def edits_of(content: bytes) -> list[str]:
    return list(json.loads(content)) if content else []


def used(edits: list[str]) -> set[str]:
    found: set[str] = set()
    for edit in edits:
        found = found | {edit[1]} if edit[0] == "+" else found - {edit[1]}
    return found


class Designer(Office):
    """A FreeCAD and the person in front of it."""

    def __init__(self, world: World, name: str, vault: Path) -> None:
        self.world, self.name, self.vault = world, name, vault
        self.paths = {file: vault / f"{file}.FCStd" for file in FILES}
        super().__init__(world.folder / name, world.silo)
        self.preferences.set("AskComment", False)

    def start(self) -> Session:
        session = super().start()
        session.outbox = self.disk = Disk(session.outbox.path)
        opened = Opened(lambda: self.disk)
        opened.begin(lambda call: call())
        self.desk = Cad(Watched(opened), decide=self.decide, fill=self.fill)
        self.commits = CommitFlow(session, self.preferences, self.desk, path=self.folder / "same.json")
        self.revisions = RevisionFlow(session, Files(self.desk))
        self.commits.choose = self.revisions.choose
        return session

    # -- FreeCAD ----------------------------------------------------------------------------------------

    def fill(self, doc: Document) -> None:
        """A document as its content has it."""
        doc.identity = self.world.ids[doc.Name]
        parts = {self.world.parts[name]: 1 for name in sorted(used(edits_of(doc.content)))}
        doc.parts = {self.world.parts["Sub" if doc.Name == "Top" else "Z"]: 1} | parts
        by_name = {one.Name: one for one in self.desk.open}
        if "Top" in by_name and "Sub" in by_name:
            by_name["Top"].OutList = [by_name["Sub"]]

    def doc(self, name: str) -> Document:
        found = next((doc for doc in self.desk.open if doc.Name == name), None)
        return found or self.desk.open_file(name, self.paths[name])

    def reopen(self) -> None:
        """Close all without saving, at a person's word, and open what is on the disk."""
        for doc in [*self.desk.open]:
            self.world.forgive(doc.content)
            self.desk.close(doc)
        for name in FILES:
            self.doc(name)

    def edit(self) -> None:
        self.world.count += 1
        doc = self.doc(self.world.random.choice(FILES))
        edits = edits_of(doc.content)
        part = self.world.random.choice(PARTS)
        sign = "-" if part in used(edits) else "+"
        doc.content = json.dumps([*edits, f"{sign}{part}{self.world.count}"]).encode()
        doc.changed = True
        self.fill(doc)

    def save(self) -> None:
        """FreeCAD's own save asks nobody: who shares a folder does not use it over a colleague's file."""
        for doc in self.desk.open:
            if doc.changed and not self.desk.documents.base(doc).replaced:
                self.desk.documents.save(doc)

    def save_as(self) -> None:
        """The same part under a new name; the old file stays where it is."""
        doc = self.doc(self.world.random.choice(FILES))
        self.world.count += 1
        self.paths[doc.Name] = path = self.vault / f"{doc.Name}-{self.world.count}.FCStd"
        doc.FileName = str(path)
        self.desk.documents.opened.slotChangedDocument(doc, "FileName")
        self.desk.documents.save(doc)

    def copy(self) -> None:
        """The colleague's folder, saved edits and all, over one's own."""
        other = self.world.random.choice(self.world.designers)
        if other.vault != self.vault:
            for doc in [*self.desk.open]:
                self.world.forgive(doc.content)
                self.desk.close(doc)
            for name in FILES:
                if self.paths[name].exists():
                    self.world.forgive(self.paths[name].read_bytes())
                shutil.copyfile(other.paths[name], self.paths[name])
                write_record(str(self.paths[name]), record_of(str(other.paths[name])))
            self.reopen()

    # -- commits ----------------------------------------------------------------------------------------

    def commit(self) -> None:
        self.preferences.set("AskComment", self.world.random.random() < 0.5)
        doc = self.doc(self.world.random.choice(("Top", "Top", "Sub")))
        self.commits.start(doc)

    def decide(self, planned: CommitPlan, look: Look) -> CommitAnswer | None:
        """The dialog: once Silo was looked at, this person decides each row as a die falls."""
        answers: list[Mapping[str, Theirs]] = []
        look(answers.append)
        self.settle(turns=False)
        seen = answers[-1] if answers else {}
        rows: list[DocumentRow] = []
        choices: list[tuple[DocumentRow, Theirs, Choice]] = []
        for row in planned.rows:
            theirs = seen.get(row.path)
            if theirs is None:
                rows += [row] if row.wanted else []
                continue
            chance = self.world.random.random()
            if chance < 0.4:
                if theirs.newer:
                    self.world.chosen.add(theirs.newer["file_checksum"])
                rows.append(replace(row, on_top=theirs.newer or {}))
            elif chance < 0.7:
                choices.append((row, theirs, Choice.TAKE))
        return CommitAnswer(tuple(rows), "dialog", choices=tuple(choices))

    def sync(self) -> None:
        """A question of the pane was answered: the BOM alone is sent. That of a file that was saved since its
        commit goes ahead of it, which is no concern of these laws."""
        doc = self.doc(self.world.random.choice(FILES))
        saved = sha256(Path(doc.FileName).read_bytes()).hexdigest()
        if saved in {entry.sha256 for entry in self.disk.entries()} or is_recorded(doc.FileName, saved):
            self.commits.sync_only(doc)
        if self.world.random.random() < 0.7:
            self.settle()

    def settle(self, *, turns: bool = True) -> None:
        self.silo.user = self.name
        if turns:
            super().settle()
            return
        while not (self.session.idle and self.gui.calls.empty()):
            self.gui.run_all()
            self.session._net.left(0.01)

    def go(self) -> None:
        """Let everything come to rest, then look at the pane: it shows what waits, and nothing else."""
        self.settle()
        self.session.send(force=self.world.random.random() < 0.8)
        self.settle()
        assert not self.bugs, self.bugs
        shown = {entry.id: entry.state for entry in self.session.shown.waiting}
        assert shown == {entry.id: entry.state for entry in self.disk.entries()}

    def held(self) -> Entry | None:
        found = [one for one in self.disk.entries() if one.state is State.HELD]
        return self.world.random.choice(found) if found else None

    def answer(self) -> None:
        """One press of a button of the pane."""
        entry = self.held()
        if entry is None:
            return
        chance = self.world.random.random()
        if chance < 0.6 and not entry.superseded:
            if entry.newer:
                self.world.chosen.add(entry.newer["file_checksum"])
            self.session.retry(entry.id)
        elif chance < 0.8 and entry.newer:
            entry_id = entry.id
            self.revisions.choose(
                entry.path,
                of_held(entry),
                Choice.TAKE,
                taken=lambda: self.session.discard(entry_id, keep=True),
            )
        elif chance < 0.9:
            self.world.forgive_hash(entry.sha256)
            self.session.discard(entry.id)
        self.settle()

    def pull(self) -> None:
        """Into the project's own folder; what is open stays."""
        name = self.world.random.choice(FILES)
        number = self.world.numbers[name]
        revision = None
        known = self.silo.items[number.casefold()].revisions
        if known and self.world.random.random() < 0.4:
            revision = self.world.random.choice(known).revision_number
        if self.world.random.random() < 0.6:
            for doc in [*self.desk.open]:
                self.world.forgive(doc.content)
                self.desk.close(doc)
        errors: list[SiloError] = []
        overwrite = self.world.random.random() < 0.3
        self.revisions.pull(
            number, revision, self.vault, overwrite=overwrite, done=lambda _pulled: None, failed=errors.append
        )
        self.settle()

    def die(self) -> None:
        """FreeCAD is killed: what was only in its memory is gone, and the person knows it."""
        for doc in self.desk.open:
            self.world.forgive(doc.content)
        self.gui.calls.queue.clear()
        self.session.close()
        self.gui.calls.queue.clear()
        self.session = self.start()
        self.session.begin(live=False)
        for name in FILES:
            self.doc(name)


@dataclass
class World:
    """All of it. ``chosen``: hashes of colleagues' files that a person saw and went over."""

    folder: Path
    random: random.Random
    silo: Silo = field(default_factory=Silo)
    count: int = 0
    chosen: set[str] = field(default_factory=set)
    forgiven: set[str] = field(default_factory=set)
    made: set[str] = field(default_factory=set)
    archive: dict[str, bytes] = field(default_factory=dict)
    backup: Any = None
    trouble: str = ""

    def __post_init__(self) -> None:
        made = {name: self.silo.create_item("kindred-rd", "M01", name) for name in (*PARTS, "Z", *FILES)}
        self.ids = {name: item.id for name, item in made.items()}
        self.numbers = {name: item.part_number for name, item in made.items()}
        self.parts = {
            name: Document(name, f"/parts/{name}.FCStd", identity=self.ids[name])
            for name in (*PARTS, "Z", "Sub")
        }
        self.silo.before, self.silo.after = self.before, self.after
        own, shared = self.folder / "alice" / "work", self.folder / "bob" / "work"
        for vault in (own, shared):
            vault.mkdir(parents=True)
            for name in FILES:
                (vault / f"{name}.FCStd").write_bytes(b"[]")
        self.designers = [
            Designer(self, "alice", own),
            Designer(self, "bob", shared),
            Designer(self, "carol", shared),
        ]
        for one in self.designers:
            one.session.begin(live=False)
            one.reopen()
        alice = self.designers[0]
        for name in FILES:
            doc = alice.doc(name)
            doc.content, doc.changed = json.dumps(["+A0"]).encode(), True
            alice.fill(doc)
            alice.commits.start(doc)
            alice.go()
        for one in self.designers[1:]:
            one.copy()

    # -- trouble ----------------------------------------------------------------------------------------

    def before(self, called: str) -> None:
        if self.trouble == "away":
            raise UnreachableError("nobody answers")
        if self.trouble == "flaky" and self.random.random() < 0.2:
            raise UnreachableError("no answer")

    def after(self, called: str) -> None:
        for stored in self.silo.items.values():
            self.archive |= {sha256(content).hexdigest(): content for content in stored.files.values()}
        if self.trouble in ("lossy", "flaky") and self.random.random() < 0.4:
            raise UnreachableError("the answer was lost")

    def change_trouble(self) -> None:
        self.trouble = self.random.choice(("", "", "away", "lossy", "flaky"))

    def change_disk(self) -> None:
        disk = self.random.choice(self.designers).disk
        disk.full, disk.other = self.random.random() < 0.3, self.random.random() < 0.5

    def save_backup(self) -> None:
        if self.is_at_rest() and not self.wrong_boms():
            self.backup = deepcopy(self.silo.items)

    def restore(self) -> None:
        """The administrator puts back what there is; what came since is gone from the server."""
        if self.backup is not None and self.random.random() < 0.5:
            self.silo.items = deepcopy(self.backup)

    # -- what a person gave up --------------------------------------------------------------------------

    def forgive(self, content: bytes) -> None:
        self.forgiven |= set(edits_of(content))

    def forgive_hash(self, found: str) -> None:
        for one in self.designers:
            for path in one.disk.copies.glob("*"):
                if sha256(path.read_bytes()).hexdigest() == found:
                    self.forgive(path.read_bytes())

    # -- laws -------------------------------------------------------------------------------------------

    def is_at_rest(self) -> bool:
        return not any(one.disk.entries() for one in self.designers)

    def files(self, name: str) -> list[tuple[int, str, bytes]]:
        stored = self.silo.items[self.numbers[name].casefold()]
        found = {revision.revision_number: revision for revision in stored.revisions}
        return [(number, found[number].comment, content) for number, content in sorted(stored.files.items())]

    def wrong_boms(self) -> list[str]:
        wrong = []
        for name in FILES:
            (_, _, content) = self.files(name)[-1]
            wanted = used(edits_of(content)) | {"Sub" if name == "Top" else "Z"}
            names = {number: part for part, number in self.numbers.items()}
            lines = self.silo.get_bom(self.numbers[name])
            there = {names[line.child_part_number] for line in lines if line.unreferenced_since is None}
            if there != wanted:
                wrong.append(f"{name}: BOM {sorted(there)}, newest file {sorted(wanted)}")
        return wrong

    def check_revisions(self) -> None:
        """No revision lacks an edit of the one before, but at a person's word; none is there twice."""
        for name in FILES:
            before: bytes = b""
            for number, comment, content in self.files(name):
                lost = set(edits_of(before)) - set(edits_of(content))
                at_a_word = sha256(before).hexdigest() in self.chosen and "on top of revision" in comment
                assert not lost or at_a_word, f"revision {number} of {name} lost {lost} ({comment})"
                assert content != before, f"revision {number} of {name} was sent twice"
                before = content

    def check_edits(self) -> None:
        """Every edit is in Silo (or was, before it was restored), on a disk, in a window, or was given up."""
        left: set[str] = set()
        for content in self.archive.values():
            left |= set(edits_of(content))
        for one in self.designers:
            for doc in one.desk.open:
                left |= set(edits_of(doc.content))
        for path in self.folder.rglob("*.FCStd"):
            left |= set(edits_of(path.read_bytes()))
        there = {edit[2:] for edit in left | self.forgiven}
        assert self.made <= there, f"edits {sorted(self.made - there)} are nowhere"

    def step(self, log: list[str]) -> None:
        one = self.random.choice(self.designers)

        def work() -> None:
            one.edit()
            one.commit()

        def hurry() -> None:
            work()
            one.go()

        deeds: list[tuple[int, str, Callable[[], None]]] = [
            (8, "hurry", hurry),
            (3, "work", work),
            (2, "edit", one.edit),
            (3, "go", one.go),
            (2, "save", one.save),
            (1, "save as", one.save_as),
            (5, "answer", one.answer),
            (1, "reopen", one.reopen),
            (1, "copy", one.copy),
            (2, "pull", one.pull),
            (2, "sync", one.sync),
            (1, "die", one.die),
            (2, "trouble", self.change_trouble),
            (1, "disk", self.change_disk),
            (2, "backup", self.save_backup),
            (1, "restore", self.restore),
        ]
        _, name, deed = self.random.choices(deeds, weights=[weight for weight, _, _ in deeds])[0]
        count = self.count
        log.append(f"{one.name}: {name} {self.trouble}")
        deed()
        for doc in one.desk.open:
            self.made |= {edit[2:] for edit in edits_of(doc.content)}
        if self.count != count:
            log[-1] += f" (#{self.count})"

    def end(self) -> None:
        """Everything works again, and everybody sends what they have."""
        self.trouble = ""
        for one in self.designers:
            one.disk.full = False
            one.settle()
            one.session.send(force=True)
            one.go()

    def close(self) -> None:
        for one in self.designers:
            one.session.close()


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SILO_API_URL", "SILO_API_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


FIRST = int(os.environ.get("SILO_FIRST_SEED", "0"))


@pytest.mark.parametrize("seed", range(FIRST, FIRST + (SEEDS if LONG else SAMPLE)))
def test_nothing_is_lost_without_a_choice(seed: int, tmp_path: Path) -> None:
    """A law, for every day of three designers."""
    world = World(tmp_path, random.Random(seed))
    log: list[str] = []
    try:
        for _ in range(STEPS):
            world.step(log)
            world.check_revisions()
            world.check_edits()
        world.end()
        world.check_revisions()
        world.check_edits()
        if world.is_at_rest():
            assert world.wrong_boms() == []
    except AssertionError as error:
        raise AssertionError(f"{error}\nseed {seed}:\n" + "\n".join(log)) from error
    finally:
        world.close()
