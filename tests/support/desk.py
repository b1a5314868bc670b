# SPDX-License-Identifier: LGPL-2.1-or-later
"""A FreeCAD of values: documents, a person, a GUI thread and a session, for the flows without FreeCAD and
Qt."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from silo.api.transport import Cancel
from silo.api.wire import Item, Scene
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import DocumentError, NotFoundError, SiloError
from silo.bom.findings import Finding
from silo.outbox.report import Sent
from silo.platform.stamp import stamp_of
from silo.registering.candidate import Candidate, ComponentState, OpenedFile
from silo.registering.items import Registration
from silo.registering.offer import Offer
from silo.registering.request import RegistrationRequest
from silo.testing import FakeSilo
from silo.workbench.commit.desk import CommitAnswer, Look
from silo.workbench.commit.plan import CommitPlan
from silo.workbench.documents.opened import DocumentOrigin, Opened
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.ghost import Differences, Ghost
from silo.workbench.preview.comparison import Preview
from silo.workbench.session.session import Session
from silo.workbench.session.state import Listener
from silo.workbench.settings.preferences import DEFAULTS, Preferences
from silo.workbench.settings.server import ServerPreferences

WAIT_S = 300  # reached only if the test fails; a busy machine may need minutes


class Gui:
    """Stands for the GUI thread: runs what was delivered when the test asks for it."""

    def __init__(self) -> None:
        self.calls: queue.Queue[Callable[[], None]] = queue.Queue()

    def run_until(self, reached: Callable[[], object]) -> None:
        while not reached():
            self.calls.get(timeout=WAIT_S)()

    def run_all(self) -> None:
        while not self.calls.empty():
            self.calls.get()()


class Silo(FakeSilo):
    """A server that can be closed like a client, and shows the models that a test gives it.

    ``before`` is called before a read of many items, too.
    """

    def __init__(self) -> None:
        super().__init__()
        self.scenes: dict[tuple[str, int], Scene] = {}
        self.geometries: dict[str, bytes] = {}

    def close(self) -> None:
        return

    def get_items_by_uuid(
        self, uuids: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, Item]:
        self.before("get_items_by_uuid")
        return super().get_items_by_uuid(uuids, cancelled=cancelled)

    def get_scene(self, part_number: str, revision: int, /) -> Scene:
        if (part_number, revision) not in self.scenes:
            raise NotFoundError(f"item {part_number} has no revision {revision}")
        return self.scenes[part_number, revision]

    def get_geometry(self, sha256: str, /) -> bytes:
        return self.geometries[sha256]


class NoTokens:
    """A keyring with nothing in it."""

    def get(self, _url: str) -> str:
        return ""


class Group(dict[str, Any]):
    """FreeCAD's parameters."""

    def GetString(self, name: str, default: str = "", /) -> str:
        return str(self.get(name, default))

    def GetBool(self, name: str, default: bool = False, /) -> bool:
        return bool(self.get(name, default))

    def SetString(self, name: str, value: str, /) -> None:
        self[name] = value

    def SetBool(self, name: str, value: bool, /) -> None:
        self[name] = value


@dataclass(eq=False)
class Document:
    """A document with FreeCAD's names, and what its file says."""

    Name: str
    FileName: str
    content: bytes = b""
    identity: str = ""
    changed: bool = True
    recomputed: bool = False
    closed: bool = False
    several: bool = False
    parts: dict[Document, int] = field(default_factory=dict)
    OutList: list[Document] = field(default_factory=list)

    @property
    def Label(self) -> str:
        return self.Name

    @property
    def Meta(self) -> dict[str, str]:
        return {"SiloUUID": self.identity}


@dataclass
class Documents:
    """Saving writes a new file and renames it, as FreeCAD does."""

    saved: list[str] = field(default_factory=list)
    bases: dict[str, DocumentOrigin] = field(default_factory=dict)

    def base(self, doc: Any, /) -> DocumentOrigin:
        return self.bases.setdefault(doc.Name, DocumentOrigin(doc.FileName, stamp_of(doc.FileName)))

    def linked(self, doc: Any, /) -> list[Any]:
        return [doc, *(found for below in doc.OutList for found in self.linked(below))]

    def is_partial(self, _doc: Any, /) -> bool:
        return False

    def is_modified(self, doc: Any, /) -> bool:
        return bool(doc.changed)

    def is_edited(self, doc: Any, _until: float, /) -> bool:
        return not doc.recomputed

    def is_writable(self, _path: str, /) -> bool:
        return True

    def lost_objects(self, _doc: Any, /) -> list[str]:
        return []

    def is_damaged(self, _doc: Any, /) -> bool:
        return False

    def save(self, doc: Any, /) -> None:
        if doc.closed:
            raise ReferenceError("Cannot access attribute of deleted object")
        new = Path(doc.FileName + ".new")
        new.write_bytes(doc.content)
        self.base(doc)
        new.replace(doc.FileName)
        self.base(doc).stamp = stamp_of(doc.FileName)
        doc.changed = False
        self.saved.append(doc.Name)


class Watched(Documents):
    """FreeCAD's documents, with the observer that knows what each was made from."""

    def __init__(self, opened: Opened) -> None:
        super().__init__()
        self.opened = opened

    def base(self, doc: Any, /) -> DocumentOrigin:
        if doc.closed:
            raise ReferenceError("Cannot access attribute of deleted object")
        return self.opened.of(doc)

    def save(self, doc: Any, /) -> None:
        self.opened.slotStartSaveDocument(doc, doc.FileName)
        super().save(doc)
        self.opened.slotFinishSaveDocument(doc, doc.FileName)


@dataclass
class PreviewWindow:
    """What the flow did with it."""

    title: str
    path: str
    flow: Any
    filled: list[Preview] = field(default_factory=list)
    failed: list[SiloError] = field(default_factory=list)
    seen: list[tuple[str, bool | None]] = field(default_factory=list)
    raised: int = 0

    def busy(self) -> None:
        return

    def fill(self, preview: Preview) -> None:
        self.filled.append(preview)

    def fail(self, error: SiloError) -> None:
        self.failed.append(error)

    def tell_view(self, text: str, *, agrees: bool | None) -> None:
        self.seen.append((text, agrees))

    def raise_(self) -> None:
        self.raised += 1


@dataclass
class RegisterWindow:
    """What the flow did with it."""

    title: str
    path: str
    flow: Any
    offers: list[Offer] = field(default_factory=list)
    results: list[Registration] = field(default_factory=list)
    numbers: dict[str, str] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)
    undone: list[Any] = field(default_factory=list)
    back: list[Any] = field(default_factory=list)
    pictures: dict[str, bytes] = field(default_factory=dict)
    stops: int = 0

    def fill(self, offer: Offer) -> None:
        self.offers.append(offer)

    def fail(self, error: SiloError) -> None:
        self.told.append(str(error))

    def set_number(self, category: str, number: str) -> None:
        self.numbers[category] = number

    def registered(self, _order: RegistrationRequest, result: Registration) -> None:
        self.results.append(result)

    def register(self, requests: Iterable[RegistrationRequest]) -> None:
        self.flow.register(self.path, requests)

    def undeclared(self, row: Any, *, no_part: bool) -> None:
        self.undone.append((row, no_part))

    def taken_back(self, request: RegistrationRequest, error: SiloError | None) -> None:
        self.back.append((request.name, error))

    def show_pictures(self, pictures: Mapping[str, bytes]) -> None:
        self.pictures.update(pictures)

    def stopped(self) -> None:
        self.stops += 1

    def tell(self, text: str) -> None:
        self.told.append(text)

    def raise_(self) -> None:
        return


@dataclass
class Desk:
    """A person who says yes, and turns that the test lets pass."""

    documents: Documents = field(default_factory=Documents)
    turns: list[Callable[[], None]] = field(default_factory=list)
    warned: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)
    willing: bool = True
    decide: Callable[[CommitPlan, Look], CommitAnswer | None] | None = None
    open: list[Document] = field(default_factory=list)
    previews: list[PreviewWindow] = field(default_factory=list)
    witnessed: list[Any] = field(default_factory=list)
    relinked: list[str] = field(default_factory=list)
    answers: list[tuple[tuple[str, ...], bool]] = field(default_factory=list)
    taken_back: list[tuple[str, ...]] = field(default_factory=list)
    refusal: SiloError | None = None
    registers: list[RegisterWindow] = field(default_factory=list)

    def snapshot(self, doc: Any) -> Snapshot:
        extraction = None
        if doc.parts:
            head = BomEntry(doc.FileName, doc.identity or None, level=0, label=doc.Label, is_assembly=True)
            entries = (
                BomEntry(part.FileName, silo_uuid=part.identity or None, quantity=count, label=part.Label)
                for part, count in doc.parts.items()
            )
            extraction = Extraction(head, tuple(entries))
        return Snapshot(doc.FileName, doc.Label, doc.identity or None, extraction, several=doc.several)

    def accounts(self, extraction: Extraction) -> list[Any]:
        if self.refusal is not None:
            raise self.refusal
        return self.witnessed

    def why(self, doc: Any, assembly: str, parts: Collection[tuple[str, str]]) -> list[str]:
        if self.refusal is not None:
            raise self.refusal
        return [f"{len(doc.parts)} in {assembly or doc.Label}", *(name for _, name in parts)]

    def write_answer(self, doc: Any, names: Collection[str], *, counts: bool) -> list[str]:
        if self.refusal is not None:
            raise self.refusal
        self.answers.append((tuple(names), counts))
        return list(names)

    def relink(self, finding: Finding) -> list[str]:
        if self.refusal is not None:
            raise self.refusal
        self.relinked.append(finding.did_you_mean)
        return ["Link"]

    def find(self, path: str) -> Document | None:
        return next((doc for doc in self.open if doc.FileName == path), None)

    def preview_window(self, title: str, path: str, flow: Any) -> PreviewWindow:
        self.previews.append(PreviewWindow(title, path, flow))
        return self.previews[-1]

    def register_window(self, title: str, path: str, flow: Any, *, asks: bool) -> RegisterWindow:
        self.registers.append(RegisterWindow(title, path, flow))
        return self.registers[-1]

    def look_at(self, paths: Iterable[str]) -> dict[str, OpenedFile]:
        return {path: OpenedFile(ComponentState.READY) for path in paths}

    def remove_identity(self, candidate: Candidate, *, no_part: bool) -> None:
        if self.refusal is not None:
            raise self.refusal
        self.taken_back.append(candidate.article.objects if candidate.article is not None else ())

    def restore_identity(self, candidate: Candidate) -> None:
        if self.refusal is not None:
            raise self.refusal
        self.write_identity(candidate, candidate.entry.silo_uuid or "")

    def write_identity(self, candidate: Candidate, identity: str) -> None:
        assert threading.current_thread() is threading.main_thread()
        doc = self.find(candidate.entry.doc_path)
        assert doc is not None
        doc.identity = identity
        self.documents.save(doc)
        # As FreeCAD does it: who links to a saved document has the time of that in its file.
        for parent in self.open:
            parent.changed = parent.changed or doc in parent.parts

    def unedited(self) -> list[Document]:
        return [doc for doc in self.open if not doc.changed]

    def save_marked(self, doc: Document) -> None:
        if doc.changed:
            self.documents.save(doc)

    def save_as(self, _doc: Any) -> None:
        return

    def identity(self, doc: Any) -> str | None:
        return str(doc.identity) or None

    def ask(self, planned: CommitPlan, note: str, comment: str, look: Look) -> CommitAnswer | None:
        self.asked.append(note)
        self.comments.append(comment)
        if self.decide is not None:
            return self.decide(planned, look)
        answer = CommitAnswer(planned.wanted, comment or "a comment", planned.unregistered)
        return answer if self.willing else None

    def warn(self, _title: str, text: str) -> None:
        self.warned.append(text)

    def later(self, call: Callable[[], None]) -> None:
        self.turns.append(call)

    def pass_turns(self) -> None:
        while self.turns:
            self.turns.pop(0)()


@dataclass
class Cad:
    """FreeCAD's documents and files, for what opens and closes them."""

    documents: Documents
    docs: list[Document]
    opened: list[Path] = field(default_factory=list)
    ghosts: Sequence[Ghost] = ()

    def find(self, path: str, /) -> Document | None:
        return next((doc for doc in self.docs if doc.FileName == path), None)

    def open(self, path: str, /) -> None:
        self.opened.append(Path(path))

    def close(self, doc: Any, /) -> None:
        self.docs.remove(doc)

    def save_copy(self, doc: Any, path: Path, /) -> None:
        path.write_bytes(doc.content)

    def compare(self, path: str, _revision: int, theirs: Sequence[Ghost], /) -> Differences | None:
        if self.find(path) is None:
            raise DocumentError(path, "it is not open any more")
        self.ghosts = () if self.ghosts else theirs
        return Differences(len(theirs), 1, 2, 3) if self.ghosts else None

    def open_paths(self) -> tuple[str, ...]:
        return tuple(doc.FileName for doc in self.docs)

    def is_open_elsewhere(self, _path: str, /) -> bool:
        return False


@dataclass
class Office:
    """A session with a server in memory, and all that goes with it."""

    folder: Path
    silo: Silo = field(default_factory=Silo)
    gui: Gui = field(default_factory=Gui)
    desk: Desk = field(default_factory=Desk)
    sent: list[Sent] = field(default_factory=list)
    console: list[str] = field(default_factory=list)
    bugs: list[BaseException] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.preferences = Preferences(Group({**DEFAULTS, "AskComment": False}))
        self.session = self.start()

    def start(self) -> Session:
        """Another FreeCAD of the same user."""
        listener = Listener(console=self.console.append, sent=self.sent.append, bug=self.bugs.append)
        self.session = Session(
            self.gui.calls.put,
            ServerPreferences(url=self.silo.base_url),
            NoTokens(),
            listener=listener,
            folder=self.folder / "data",
            make_client=lambda _server: self.silo,
        )
        return self.session

    def document(self, name: str, content: bytes = b"content", *, registered: bool = True) -> Document:
        path = self.folder / "vault" / f"{name}.FCStd"
        path.parent.mkdir(exist_ok=True)
        identity = self.silo.create_item("kindred-rd", "M01", name).id if registered else ""
        made = Document(name, str(path), content, identity)
        self.desk.open.append(made)
        return made

    def files(self, name: str) -> list[bytes]:
        """Contents of the item's revisions, oldest first."""
        stored = next(s for s in self.silo.items.values() if s.item.name == name)
        return [stored.files[number] for number in sorted(stored.files)]

    def settle(self) -> None:
        """Let the GUI thread and the workers work until nothing is left."""
        while True:
            self.desk.pass_turns()
            self.gui.run_all()
            if self.session.idle and self.gui.calls.empty() and not self.desk.turns:
                return
            self.session._rows.left(0.01)
            self.session._disk.left(0.01)
            self.session._net.left(0.01)


@pytest.fixture
def office(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Office]:
    """With no server in the environment, and closed at the end."""
    for name in ("SILO_API_URL", "SILO_API_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    made = Office(tmp_path)
    yield made
    made.session.close()
