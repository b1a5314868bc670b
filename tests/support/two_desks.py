# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two designers with files that link to each other, in FreeCAD and on the command line, and their laws.

A file says itself what is in it: its label holds the numbers of all edits, its links the parts and their
counts. The laws read that with a pattern, not with the project's reader, so a lost edit shows whatever the
code thinks of records and origins. FreeCAD and the dialog are fakes; all else is the add-on's and the command
line's own.
"""

from __future__ import annotations

import io
import json
import random
import re
import shutil
import zipfile
from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

from desk import Desk, Document, Office, Silo, Watched
from fcstd_writer import Doc, Raw, container, locals_

from silo.bom.errors import DocumentError, SiloError, UnreachableError
from silo.bom.walk.links import file_bom
from silo.fcstd import Library
from silo.file_state import FileState
from silo.outbox.entry import State
from silo.registering.carry_out import take_back
from silo.registering.closed_files import carry_out_on_disk
from silo.registering.journal import Journal
from silo.registering.request import RegistrationRequest
from silo.vault.committing import CommittedFiles, commit_files
from silo.vault.project import FileStanding, find_project, read_project, stand
from silo.vault.pull import Pulled, place, rules_of
from silo.vault.tree import fetched
from silo.workbench.colleagues.theirs import Choice, Theirs, of_held
from silo.workbench.commit.desk import CommitAnswer, Look
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.commit.plan import CommitPlan, DocumentRow
from silo.workbench.documents.opened import Opened
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.revisions.flow import RevisionFlow
from silo.workbench.revisions.project import ProjectFlow
from silo.workbench.tone import Tone

FIRST = {"Plate": (), "Bracket": (), "Skeleton": (), "Sub": ("Plate",), "Top": ("Sub", "Bracket", "Skeleton")}
"""The files at the beginning, and what each links to."""


# --- a file, read without the project's reader -----------------------------------------------------------


@dataclass(frozen=True)
class Said:
    """What a file says: its edits, its links with their counts, its identity."""

    edits: frozenset[int]
    links: tuple[tuple[str, int], ...]
    identity: str


@cache
def said(content: bytes) -> Said:
    """Read what a file says."""
    xml = _xml(content)
    label = re.search(r'<Property name="Label"[^>]*>\s*<String value="\w+ \[([\d, ]*)\]"/>', xml)
    assert label is not None
    edits = frozenset(int(number) for number in label.group(1).split(",") if number.strip())
    links = re.findall(
        r'name="ElementCount".*?<Integer value="(\d+)".*?<XLink file="([^"]+)\.FCStd"', xml, re.S
    )
    identity = re.search(r'<Item key="SiloUUID(?:/Box)?" value="([^"]+)"', xml)
    return Said(
        edits,
        tuple((name, max(1, int(count))) for count, name in links),
        identity.group(1) if identity is not None else "",
    )


def _xml(content: bytes) -> str:
    with zipfile.ZipFile(io.BytesIO(content)) as read:
        return read.read("Document.xml").decode()


def changed(content: bytes, pattern: str, new: str | Callable[[re.Match[str]], str]) -> bytes:
    """Change the first place in a file that fits."""
    text, count = re.subn(pattern, new, _xml(content), count=1, flags=re.S)
    assert count, pattern
    return container({"Document.xml": text.encode()})


def hashed(content: bytes) -> str:
    return sha256(content).hexdigest()


def first_content(name: str, identity: str) -> bytes:
    """A file of the beginning."""
    uid = Raw("App::PropertyUUID", f'<Uuid value="{uuid5(NAMESPACE_URL, name)}"/>')
    made = Doc(f"{name} []", meta={"SiloUUID": identity} if identity else {}, extra={"Uid": uid})
    if name == "Skeleton":
        return made.add("Spreadsheet::Sheet", "Sheet").bytes()
    if not FIRST[name]:
        return made.add("Part::Box", "Box", Height=10.0).bytes()
    for number, below in enumerate(FIRST[name]):
        made.link(f"L{number}", f"{below}.FCStd", "Sheet" if below == "Skeleton" else "Box")
    members = [f"L{number}" for number, below in enumerate(FIRST[name]) if below != "Skeleton"]
    return made.add("App::Part", "Box", Type="Assembly", Group=locals_(*members)).bytes()


# --- FreeCAD, a command line, and their user -------------------------------------------------------------


class Paper(Document):
    """A document that FreeCAD is about to read: nothing is in it yet."""

    Objects = ()


class Marks(Watched):
    """FreeCAD's documents; one that was read again later is no longer known."""

    def is_edited(self, doc: Any, until: float, /) -> bool:
        return bool(doc.changed and not doc.recomputed)


class Window(Desk):
    """FreeCAD's window. The BOM is that of the file that was just saved, as FreeCAD's objects have it."""

    def snapshot(self, doc: Any) -> Snapshot:
        with Library() as library:
            item, bom = file_bom(library.open(doc.FileName))
        return Snapshot(doc.FileName, doc.Label, item or None, bom)


class FilesDesk:
    """The part of the window that gets files from Silo."""

    def __init__(self, user: Designer) -> None:
        self.user = user
        self.documents = user.watched
        self.find = user.desk.find

    def close(self, doc: Any, /) -> None:
        self.user.close(doc)

    def save_copy(self, doc: Any, path: Path, /) -> None:
        path.write_bytes(doc.content)

    def open(self, path: str, /) -> Any:
        if Path(path).parent == self.user.root and Path(path).suffix == ".FCStd":
            self.user.doc(Path(path).stem)

    def open_paths(self) -> tuple[str, ...]:
        return tuple(doc.FileName for doc in self.user.desk.open)

    def is_open_elsewhere(self, _path: str, /) -> bool:
        return False


class Designer(Office):
    """A FreeCAD, a command line, and the user of both.

    exit
        what the last commit of the command line was; None where the last step was another one.
    promised
        the file whose commit in the window ended without a remark; "" where there was none.
    old
        names of files that are of an older revision at the user's word.
    """

    def __init__(self, world: World, name: str) -> None:
        self.world, self.name = world, name
        self.root = world.folder / name / "work"
        self.root.mkdir(parents=True)
        self.committed: CommittedFiles | None = None
        self.promised = ""
        self.old: set[str] = set()
        super().__init__(world.folder / name, world.silo)
        self.preferences.set("ProjectFolder", str(self.root))

    def start(self) -> Any:
        session = super().start()
        opened = Opened(lambda: self.session.outbox)
        opened.begin(lambda call: call())
        self.watched = Marks(opened)
        self.desk = Window(self.watched, decide=self.decide)
        self.commits = CommitFlow(session, self.preferences, self.desk, path=self.folder / "same.json")
        self.files_desk = FilesDesk(self)
        self.revisions = RevisionFlow(session, self.files_desk)
        self.commits.choose = self.revisions.choose
        self.projects = ProjectFlow(session, self.preferences, self.commits, self.files_desk, self.revisions)
        return session

    def path(self, name: str) -> Path:
        return self.root / f"{name}.FCStd"

    def on_disk(self, name: str) -> Said:
        return said(self.path(name).read_bytes())

    @property
    def names(self) -> list[str]:
        """The files that are there."""
        return sorted(path.stem for path in self.root.glob("*.FCStd"))

    def below(self, top: str) -> list[str]:
        """A file and all files to which it links, as far as they are there."""
        found = [top]
        for name in found:
            if self.path(name).exists():
                found += [link for link, _ in self.on_disk(name).links if link not in found]
        return [name for name in found if self.path(name).exists()]

    def is_whole(self, top: str) -> bool:
        """Return True if each link leads to a file."""
        below = self.below(top)
        return all(link in below for name in below for link, _ in self.on_disk(name).links)

    # -- FreeCAD ----------------------------------------------------------------------------------------

    def doc(self, name: str) -> Document | None:
        """The open document of a file; opened with all below it if the file is there."""
        for below in reversed(self.below(name)):
            if not any(doc.Name == below for doc in self.desk.open):
                doc = Paper(below, "")
                doc.FileName, doc.content, doc.changed = (
                    str(self.path(below)),
                    self.path(below).read_bytes(),
                    False,
                )
                self.watched.opened.slotChangedDocument(doc, "FileName")
                self.desk.open.append(doc)
        self.relate()
        return next((doc for doc in self.desk.open if doc.Name == name), None)

    def relate(self) -> None:
        """Give each document the identity and the links that are in it."""
        by_name = {doc.Name: doc for doc in self.desk.open}
        for doc in self.desk.open:
            doc.identity = said(doc.content).identity
            doc.OutList = [by_name[link] for link, _ in said(doc.content).links if link in by_name]

    def close(self, doc: Any) -> None:
        self.watched.opened.slotDeletedDocument(doc)
        doc.closed = True
        self.desk.open.remove(doc)
        self.relate()

    def close_all(self) -> None:
        """Close all documents; unsaved edits are given up."""
        for doc in [*self.desk.open]:
            self.close(doc)

    def any_doc(self) -> Document | None:
        return self.doc(self.world.random.choice(self.names)) if self.names else None

    def change(self, doc: Document, pattern: str, new: str | Callable[[re.Match[str]], str]) -> None:
        doc.content, doc.changed, doc.recomputed = changed(doc.content, pattern, new), True, False
        self.relate()

    def edit(self, name: str = "") -> None:
        doc = self.doc(name) if name else self.any_doc()
        if doc is not None:
            self.change(doc, *self.world.next_edit())

    def edit_and_commit(self) -> None:
        """Both in one go, while the other user may have done the same."""
        self.edit()
        self.commit("Top" if self.world.random.random() < 0.6 else "")

    def undo(self) -> None:
        """Undo all edits of a document; FreeCAD's mark stays."""
        for doc in [doc for doc in self.desk.open if doc.changed and self.path(doc.Name).exists()][:1]:
            if not self.watched.base(doc).replaced:
                doc.content, doc.recomputed = self.path(doc.Name).read_bytes(), True
        self.relate()

    def recompute(self) -> None:
        for doc in self.desk.open:
            if not doc.changed:
                doc.changed = doc.recomputed = True

    def save(self, name: str = "") -> None:
        """Ctrl+S in one document: what links to it is marked."""
        for doc in [doc for doc in self.desk.open if doc.changed and name in ("", doc.Name)][:1]:
            if self.watched.base(doc).replaced:
                return
            self.watched.save(doc)
            doc.recomputed = False
            for user in self.desk.open:
                if doc in user.OutList and not user.changed:
                    user.changed = user.recomputed = True

    def save_as(self) -> None:
        """FreeCAD's *Save As*: the open files that link to the document follow it to its new name."""
        doc = self.any_doc()
        if doc is None:
            return
        users = [user for user in self.desk.open if doc in user.OutList]
        before, doc.Name = doc.Name, self.world.new_name(doc.Name)
        base = self.watched.opened._bases.pop(before, None)
        if base is not None:
            self.watched.opened._bases[doc.Name] = base
        doc.FileName = str(self.path(doc.Name))
        self.watched.opened.slotChangedDocument(doc, "FileName")
        self.watched.save(doc)
        doc.recomputed = False
        for user in users:
            self.change(user, rf'file="{before}\.FCStd"', f'file="{doc.Name}.FCStd"')

    def replace_link(self) -> None:
        """Let a link lead to another part."""
        doc = self.any_doc()
        parts = [name for name in self.names if not name.startswith(("Skeleton", "Top", "Sub"))]
        links = [link for link, _ in said(doc.content).links if link in parts] if doc is not None else []
        if doc is not None and links:
            old, new = self.world.random.choice(links), self.world.random.choice(parts)
            self.change(doc, rf'file="{old}\.FCStd"', f'file="{new}.FCStd"')
            self.doc(doc.Name)

    def grow(self) -> None:
        """Add an element to an array."""
        doc = self.any_doc()
        if doc is not None and said(doc.content).links:
            one_more = lambda found: f"{found[1]}{int(found[2]) + 1}"  # noqa: E731
            self.change(doc, r'(name="ElementCount".*?<Integer value=")(\d+)', one_more)

    # -- outside of FreeCAD -----------------------------------------------------------------------------

    def foreign(self) -> None:
        """Another program writes a file, open in FreeCAD or not."""
        if self.names:
            path = self.path(self.world.random.choice(self.names))
            path.write_bytes(changed(path.read_bytes(), *self.world.next_edit()))

    def copy(self) -> None:
        if self.names:
            name = self.world.random.choice(self.names)
            shutil.copyfile(self.path(name), self.path(self.world.new_name(name)))

    def rename(self) -> None:
        """Rename a file outside of FreeCAD; what links to it is relinked, or is not."""
        self.close_all()
        if self.names:
            name = self.world.random.choice(self.names)
            new = self.world.new_name(name)
            self.path(name).rename(self.path(new))
            if self.world.random.random() < 0.7:
                for user in self.names:
                    content = self.path(user).read_bytes()
                    if name in dict(said(content).links):
                        self.path(user).write_bytes(
                            changed(content, rf'file="{name}\.FCStd"', f'file="{new}.FCStd"')
                        )

    def delete(self) -> None:
        self.close_all()
        spare = [name for name in self.names if name not in self.below("Top")]
        if spare or self.world.random.random() < 0.2:
            self.path(self.world.random.choice(spare or self.names or [""])).unlink(missing_ok=True)

    # -- Silo -------------------------------------------------------------------------------------------

    def settle(self) -> None:
        self.silo.user = self.name
        super().settle()

    def commit(self, name: str = "") -> None:
        """*Commit* of a document in the window."""
        doc = self.doc(name or self.world.random.choice(("Top", "Top", *(self.names or ["Top"]))))
        if doc is None:
            return
        before = self.session.shown.activity.entries
        self.left_out = False
        self.commits.start(doc)
        self.settle()
        boxes = [box for box in self.session.shown.activity.entries if box not in before]
        remarks = [box for box in boxes if box.tone in (Tone.ERROR, Tone.WARNING) or box.asks]
        is_told = remarks or self.session.shown.waiting or self.session.shown.held or self.desk.warned
        self.desk.warned.clear()
        if not is_told and not self.left_out and not self.world.away:
            self.promised = doc.Name

    def commit_all(self) -> None:
        """*Commit All* of the project view."""
        self.projects.look(str(self.root), lambda _view: None, lambda _error: None)
        self.settle()
        if self.projects.view.root:
            self.projects.commit_all("all")
            self.settle()

    def decide(self, planned: CommitPlan, look: Look) -> CommitAnswer | None:
        """The dialog: once Silo was looked at, the user decides each row as a die falls."""
        answers: list[Mapping[str, Theirs]] = []
        look(answers.append)
        self.wait()
        seen = answers[-1] if answers else {}
        rows: list[DocumentRow] = []
        choices: list[tuple[DocumentRow, Theirs, Choice]] = []
        for row in planned.rows:
            theirs = seen.get(row.path)
            chance = self.world.random.random()
            if theirs is None:
                rows += [row] if row.wanted else []
            elif chance < 0.4:
                self.world.choose(theirs.newer or {})
                rows.append(replace(row, on_top=theirs.newer or {}))
            elif chance < 0.7:
                choices.append((row, theirs, Choice.TAKE))
        self.left_out = len(rows) < len(planned.rows)
        return CommitAnswer(tuple(rows), "dialog", choices=tuple(choices))

    def wait(self) -> None:
        """Let workers work, but no turn of a commit pass."""
        while not (self.session.idle and self.gui.calls.empty()):
            self.gui.run_all()
            self.session._net.left(0.01)

    def command(self, top: str = "", *, on_top: bool = False) -> None:
        """``silo-mod commit`` of a file or the folder."""
        self.silo.user = self.name
        self.close_all()
        tops = [str(self.path(top))] if top and self.path(top).exists() else [str(self.root)]
        if self.names:
            away = UnreachableError("nobody answers") if self.world.away else None
            client = None if away else self.silo
            belonging = read_project(tops, find_project(tops))
            self.committed = commit_files(belonging, client, self.session.outbox, on_top=on_top, away=away)

    def command_top(self) -> None:
        self.command("Top")

    def command_on_top(self) -> None:
        """The user has seen whatever is newest in Silo, and goes over it."""
        self.world.choose_newest()
        self.command(on_top=True)

    def pull(self, number: int | None = None, *, overwrite: bool = False) -> Pulled | None:
        if self.world.away or not self.world.stored("Top"):
            return None
        self.close_all()
        self.silo.user = self.name
        rules = rules_of(self.session.outbox, self.silo, overwrite=overwrite, is_open=lambda _path: False)
        with fetched(self.silo, self.world.number("Top"), number) as tree:
            pulled = place(tree, self.root, rules)
        names = {file.path.stem for file in pulled.files}
        waiting = {Path(entry.path).stem for entry in self.session.outbox.entries()}
        self.old = self.old | names if number is not None else self.old - (names - waiting)
        return pulled

    def pull_old(self) -> None:
        if files := self.world.stored("Top").files:
            self.pull(self.world.random.choice([*files]))

    def pull_over(self) -> None:
        """``silo-mod pull --replace``."""
        self.pull(overwrite=True)

    def register(self) -> None:
        """``silo-mod register`` of a file without an item."""
        if self.world.away:
            return
        self.close_all()
        self.silo.user = self.name
        items = {stored.item.name for stored in self.silo.items.values()}
        nameless = [
            name for name in self.names if not self.on_disk(name).identity and not name.startswith("Skeleton")
        ]
        nameless = [name for name in nameless if name not in items]  # the dialog shows look-alikes
        if nameless:
            name = self.world.random.choice(nameless)
            request = self.world.registration(self.path(name), name)
            (result,) = carry_out_on_disk([request], self.silo, schema="kindred-rd")
            if result.error is None:
                self.world.registered.append((self.name, request, result))

    def undo_registration(self) -> None:
        mine = [one for one in self.world.registered if one[0] == self.name]
        if not mine or self.world.away:
            return
        self.close_all()
        _, request, result = mine[-1]
        path = Path(request.candidate.entry.doc_path)
        if not path.exists() or said(path.read_bytes()).identity == "":
            return

        def restore(_candidate: Any) -> None:
            text = r'\s*<Item key="SiloUUID(?:/Box)?" value="[^"]+"/>'
            content = changed(path.read_bytes(), text, "")
            count = r'(<Map count=")\d+'
            path.write_bytes(changed(content, count, lambda found: f"{found[1]}0"))

        self.world.registered.remove(mine[-1])
        self.world.revisions.pop(said(path.read_bytes()).identity, None)  # an archived item is not shown
        take_back(
            [(request, result)],
            self.silo,
            Journal(),
            restore,
            control=_Nothing(),
            back=lambda _request, _error: None,
        )

    def answer(self) -> None:
        """Decide about a held commit: send it on top of what was seen, take theirs, or drop it."""
        held = [entry for entry in self.session.outbox.entries() if entry.state is State.HELD]
        if not held or self.world.away:
            return
        entry, chance = self.world.random.choice(held), self.world.random.random()
        if entry.newer and not entry.superseded and chance < 0.4:
            self.world.choose(entry.newer)
            self.session.retry(entry.id)
        elif entry.newer and chance < 0.7:
            self.revisions.choose(
                entry.path,
                of_held(entry),
                Choice.TAKE,
                taken=lambda: self.session.discard(entry.id, keep=True),
            )
        elif chance < 0.85 and not entry.newer:
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

    def die_in_commit(self) -> None:
        """FreeCAD is killed in the middle of a commit."""
        doc = self.doc("Top")
        if doc is not None:
            self.commits.start(doc)
            for _ in range(self.world.random.randrange(4)):
                if self.desk.turns:
                    self.desk.turns.pop(0)()
                if not self.gui.calls.empty():
                    self.gui.calls.get()()
        self.die()

    def standings(self) -> list[FileStanding]:
        return stand([str(self.root)], find_project([str(self.root)]), self.silo, self.session.outbox)[1]


class _Nothing:
    def progress(self, _detail: str = "", _fraction: float | None = None) -> None:
        return

    def check(self) -> None:
        return


# --- both of them, and their server ----------------------------------------------------------------------


@dataclass
class World:
    """Both designers, and their server.

    chosen
        hashes of the revisions that a user has seen and went over.
    revisions
        document → number → content, as Silo had them after the last step.
    """

    folder: Path
    random: random.Random = field(default_factory=lambda: random.Random(0))
    silo: Silo = field(default_factory=Silo)
    chosen: set[str] = field(default_factory=set)
    registered: list[tuple[str, RegistrationRequest, Any]] = field(default_factory=list)
    revisions: dict[str, dict[int, bytes]] = field(default_factory=dict)
    count: int = 0
    away: bool = False
    lossy: bool = False
    backup: Any = None

    def __post_init__(self) -> None:
        kinds = {"Plate": "part", "Sub": "assembly", "Top": "assembly"}
        made = {
            name: self.silo.create_item("kindred-rd", "M01", name, item_type=kind)
            for name, kind in kinds.items()
        }
        self.numbers = {name: item.part_number for name, item in made.items()}
        self.silo.before, self.silo.after = self.before, self.after
        self.alice, self.bob = Designer(self, "alice"), Designer(self, "bob")
        for name in FIRST:
            identity = made[name].id if name in made else ""
            self.alice.path(name).write_bytes(first_content(name, identity))
        self.both = (self.alice, self.bob)
        self.alice.command()
        self.bob.pull()
        self.alice.committed = None
        self.revisions = self.files()

    def close(self) -> None:
        self.away = self.lossy = False
        for one in self.both:
            one.session.close()

    def before(self, _name: str) -> None:
        if self.away:
            raise UnreachableError("nobody answers")

    def after(self, _name: str) -> None:
        if self.lossy and self.random.random() < 0.4:
            raise UnreachableError("the answer was lost")

    def next_edit(self) -> tuple[str, Callable[[re.Match[str]], str]]:
        """The pattern of a label, and the same label with one more edit."""
        self.count += 1
        number = self.count

        def more(found: re.Match[str]) -> str:
            edits = json.loads(f"[{found[2]}]")
            return f"{found[1]}{[*edits, number]}"

        return r'(<Property name="Label"[^>]*>\s*<String value="\w+ )\[([\d, ]*)\]', more

    def new_name(self, name: str) -> str:
        self.count += 1
        return f"{name.rstrip('0123456789')}{self.count}"

    def registration(self, path: Path, name: str) -> RegistrationRequest:
        from silo.bom.entry import BomEntry
        from silo.bom.items.proposal import Proposal
        from silo.registering.candidate import Candidate, ComponentState

        entry = BomEntry(
            str(path), object_name="Box", label=name, level=1, is_assembly=bool(said(path.read_bytes()).links)
        )
        proposal = Proposal(entry, name, "assembly" if entry.is_assembly else "part", "M01")
        return RegistrationRequest.of(Candidate(proposal, ComponentState.READY))

    def stored(self, name: str) -> Any:
        return self.silo.items.get(self.numbers[name].casefold())

    def number(self, name: str) -> str:
        return self.numbers[name]

    def choose(self, newer: Mapping[str, Any]) -> None:
        if newer.get("file_checksum"):
            self.chosen.add(str(newer["file_checksum"]))

    def choose_newest(self) -> None:
        """The user goes over whatever is newest in Silo."""
        self.chosen |= {hashed(files[max(files)]) for files in self.files().values() if files}

    def files(self) -> dict[str, dict[int, bytes]]:
        everything = (*self.silo.items.values(), *self.silo.documents.values())
        return {stored.item.id: dict(stored.files) for stored in everything}

    def lose_server(self) -> None:
        self.away = True

    def lose_answers(self) -> None:
        self.lossy = True

    def end_trouble(self) -> None:
        """The server is there again, and both send what waits."""
        self.away = self.lossy = False
        for one in self.both:
            one.silo.user = one.name
            one.session.send(force=True)
            one.settle()

    def save_backup(self) -> None:
        self.backup = deepcopy((self.silo.items, self.silo.documents, self.silo.answers))

    def set_back(self) -> None:
        """The administrator restores the server's database."""
        if self.backup is not None and not self.away and not self.lossy:
            self.silo.items, self.silo.documents, self.silo.answers = deepcopy(self.backup)
            self.revisions = self.files()
            self.backup = None

    # -- laws -------------------------------------------------------------------------------------------

    def check(self) -> None:
        """Check all laws that hold after each step."""
        self.check_revisions()
        self.check_one_item()
        for one in self.both:
            assert not one.bugs, one.bugs
            for entry in one.session.outbox.entries():
                is_own = (
                    entry.newer and entry.newer["created_by"] == one.name and not entry.newer.get("set_back")
                )
                is_old = Path(entry.path).stem in one.old
                assert entry.state is not State.HELD or not is_own or is_old, (
                    f"{entry.label}: a conflict with oneself"
                )
            if not self.away and not self.lossy:
                self.check_states(one)
                self.check_promises(one)
            one.committed, one.promised = None, ""

    def check_revisions(self) -> None:
        """No revision is lost or comes twice; none lacks an edit of the one before but at a user's word."""
        now = self.files()
        comments = {
            (stored.item.id, revision.revision_number): revision.comment or ""
            for stored in (*self.silo.items.values(), *self.silo.documents.values())
            for revision in stored.revisions
        }
        for document, before in self.revisions.items():
            assert before.items() <= now.get(document, {}).items(), f"a revision of {document} is lost"
        for document, numbers in now.items():
            earlier: bytes | None = None
            for number, content in sorted(numbers.items()):
                if earlier is not None:
                    lost = said(earlier).edits - said(content).edits
                    at_a_word = (
                        hashed(earlier) in self.chosen and "on top of revision" in comments[document, number]
                    )
                    assert not lost or at_a_word, f"revision {number} of {document} lost {lost}"
                    assert content != earlier, f"revision {number} of {document} was sent twice"
                earlier = content
        self.revisions = now

    def check_one_item(self) -> None:
        """A registered file has one item, and an item that is not archived one name."""
        names = [
            stored.item.name
            for stored in self.silo.items.values()
            if not getattr(stored.item, "archived_at", None)
        ]
        assert len(names) == len(set(names)), f"two items of one part: {sorted(names)}"

    def check_states(self, one: Designer) -> None:
        """``status`` says *same* if and only if the newest revision has these bytes."""
        if not one.names:
            return
        for standing in one.standings():
            name, files = Path(standing.file.path).stem, self.files().get(standing.file.document, {})
            is_same = bool(files) and one.path(name).read_bytes() == files[max(files)]
            is_told = standing.state is FileState.SAME
            assert is_told == is_same, f"{one.name}: {name} is {standing.state}"

    def check_promises(self, one: Designer) -> None:
        """A commit without a remark is proven: a pull elsewhere is equal, and the BOM is the file's."""
        top = one.promised
        if one.committed is not None:
            committed = one.committed
            if not committed.done:
                why = committed.left or committed.behind or committed.report.held or committed.report.failed
                why = why or [one for one in committed.after if one.held] or committed.belonging.unreadable
                why = why or committed.belonging.outside or [sent for sent in committed.sent if sent.undone]
                why = why or [sent for sent in committed.sent if sent.status == "blocked"]
                assert why, "exit 1 without a reason"
                return
            top = "Top" if "Top" in {Path(file.path).stem for file in committed.belonging.files} else ""
        if not top or not one.path(top).exists():
            return
        for doc in one.desk.open:
            if doc.Name in one.below(top) and not doc.recomputed:
                assert not doc.changed, f"{doc.Name} was not saved, without a remark"
        self.check_pull(one, top)
        self.check_bom(one, top)

    def check_pull(self, one: Designer, top: str) -> None:
        identity = one.on_disk(top).identity
        found = [stored for stored in self.silo.items.values() if stored.item.id == identity]
        if not found or not one.is_whole(top):
            return
        back = self.folder / "back"
        try:
            with fetched(self.silo, found[0].item.part_number) as tree:
                pulled = place(tree, back)
            assert not pulled.lost, f"{one.name} was told nothing, but a pull lacks {pulled.lost}"
            for name in one.below(top):
                # A file that was only renamed has its revision, and that the name of then.
                there = pulled.top if name == top else back / f"{name}.FCStd"
                assert there.exists(), f"{one.name} was told nothing, but a pull has no {name}"
                assert there.read_bytes() == one.path(name).read_bytes(), (
                    f"{one.name} was told nothing: {name} differs"
                )
        finally:
            shutil.rmtree(back, ignore_errors=True)

    def check_bom(self, one: Designer, top: str) -> None:
        """The BOM in Silo has the counts that the file's links have."""
        ids = {stored.item.id: stored.item.part_number for stored in self.silo.items.values()}
        for name in one.below(top):
            on_disk = one.on_disk(name)
            if not on_disk.links or on_disk.identity not in ids:
                continue
            wanted: dict[str, int] = {}
            for link, count in on_disk.links:
                number = ids.get(one.on_disk(link).identity) if one.path(link).exists() else None
                if number is not None:
                    wanted[number] = wanted.get(number, 0) + count
            lines = self.silo.get_bom(ids[on_disk.identity])
            there = {
                line.child_part_number: line.quantity for line in lines if line.unreferenced_since is None
            }
            assert there == wanted, f"BOM of {name}: Silo {there}, file {wanted}"


def deeds(world: World, one: Designer) -> list[tuple[int, Callable[[], object]]]:
    """Each thing that may happen, with its weight."""
    return [
        (9, one.edit),
        (9, one.edit_and_commit),
        (7, one.save),
        (1, one.undo),
        (1, one.recompute),
        (1, one.save_as),
        (2, one.replace_link),
        (2, one.grow),
        (3, one.foreign),
        (1, one.copy),
        (1, one.rename),
        (1, one.delete),
        (7, one.commit),
        (3, one.commit_all),
        (3, one.command),
        (3, one.command_top),
        (1, one.command_on_top),
        (3, one.pull),
        (1, one.pull_old),
        (1, one.pull_over),
        (2, one.register),
        (1, one.undo_registration),
        (4, one.answer),
        (1, one.discard),
        (1, one.die),
        (1, one.die_in_commit),
        (1, world.lose_server),
        (1, world.lose_answers),
        (1, world.save_backup),
        (1, world.set_back),
    ]


Step = tuple[str, str, int]
"""Who, what, and the seed of what the step chooses."""


def play(folder: Path, steps: Iterable[Step]) -> str:
    """Play a story; returns what broke a law, "" if nothing did."""
    world = World(folder)
    try:
        for number, (who, what, seed) in enumerate(steps, 1):
            world.random.seed(seed)
            if (world.away or world.lossy) and seed % 4 == 0:
                world.end_trouble()
            one = getattr(world, who)
            deed = getattr(one, what, None) or getattr(world, what)
            try:
                deed()
                for each in world.both:
                    each.settle()
            except (UnreachableError, DocumentError) as error:
                if not (world.away or world.lossy or isinstance(error, DocumentError)):
                    return f"{error!r}, step {number}"
            world.check()
    except (AssertionError, SiloError, KeyError, ValueError, TypeError, AttributeError, OSError) as error:
        import traceback

        where = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno}), step {number}"
    finally:
        world.close()
    return ""


def story(seed: int, count: int) -> list[Step]:
    """Choose the steps of a walk."""
    chooser = random.Random(seed)
    world_deeds = [(weight, deed.__name__) for weight, deed in deeds(_Names(), _Names())]  # type: ignore[arg-type]
    names, weights = [name for _, name in world_deeds], [weight for weight, _ in world_deeds]
    return [
        (chooser.choice(("alice", "bob")), chooser.choices(names, weights)[0], chooser.randrange(1 << 30))
        for _ in range(count)
    ]


class _Names:
    """Gives a function with the name that is asked for."""

    def __getattr__(self, name: str) -> Callable[[], None]:
        def deed() -> None:
            return

        deed.__name__ = name
        return deed
