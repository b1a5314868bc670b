# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two people, one item: what the commit dialog is given, and what its choices do. Without FreeCAD and Qt."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from desk import Document, Office, Silo
from fcstd_writer import Doc as File
from fcstd_writer import locals_, part

from silo.api.files import Origin
from silo.api.wire import Revision
from silo.bom.compare.three_states import ThreeLines
from silo.bom.entry import BomEntry
from silo.bom.errors import ServerFaultError
from silo.outbox.entry import State
from silo.workbench.activity.box import Action, Do, EntryLine, PaneEntry
from silo.workbench.colleagues.announced import Newer
from silo.workbench.colleagues.theirs import Choice, Theirs, line_words
from silo.workbench.commit.desk import CommitAnswer, Look
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.commit.plan import CommitPlan, plan
from silo.workbench.pane.waiting import rows
from silo.workbench.tone import Tone


@pytest.fixture(name="flow")
def _flow(office: Office) -> CommitFlow:
    return CommitFlow(office.session, office.preferences, office.desk, path=office.folder / "same.json")


def number_of(office: Office, name: str) -> str:
    return next(s.item.part_number for s in office.silo.items.values() if s.item.name == name)


def colleague(office: Office, name: str, content: bytes, base: int) -> None:
    """A commit from another computer."""
    path = office.folder / "theirs" / f"{name}.FCStd"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    office.silo.user = "alice"
    office.silo.upload_file(number_of(office, name), path, "less", origin=Origin(base_revision=base))
    office.silo.user = "designer"


def committed(office: Office, flow: CommitFlow, name: str, content: bytes) -> Document:
    """A document whose file is revision 1."""
    doc = office.document(name, content)
    commit(office, flow, doc)
    return doc


def edit(doc: Document, content: bytes) -> None:
    doc.content, doc.changed = content, True


def commit(office: Office, flow: CommitFlow, doc: Document, content: bytes | None = None) -> None:
    """Commit a document, edited before if there is a content, and wait for the end."""
    if content is not None:
        edit(doc, content)
    flow.start(doc)
    office.settle()


class Person:
    """Answers the dialog once the look at Silo is done."""

    def __init__(self, office: Office, choice: Choice | None = None) -> None:
        self.office, self.choice = office, choice
        self.seen: dict[str, Theirs] = {}
        office.preferences.set("AskComment", True)
        office.desk.decide = self

    def __call__(self, planned: CommitPlan, look: Look) -> CommitAnswer | None:
        answers: list[Mapping[str, Theirs]] = []
        look(answers.append)
        self.office.gui.run_until(lambda: self.office.session.idle and answers)
        self.seen = dict(answers[-1])
        rows, choices = [], []
        for row in planned.rows:
            theirs = self.seen.get(row.path)
            if theirs is None:
                rows.append(row)
            elif self.choice is Choice.ON_TOP:
                rows.append(replace(row, on_top=theirs.newer or {}))
            elif self.choice is not None:
                choices.append((row, theirs, self.choice))
        return CommitAnswer(tuple(rows), "mine", choices=tuple(choices))


class NoChecksums(Silo):
    """A server that does not name the files' checksums."""

    def revisions(self, part_number: str, /, *, newest: int | None = None, after: int = 0) -> list[Revision]:
        found = super().revisions(part_number, newest=newest, after=after)
        return [one.model_copy(update={"file_checksum": None}) for one in found]


@pytest.mark.parametrize("kind", [Silo, NoChecksums])
def test_nothing_is_asked_where_nobody_else_committed(
    office: Office, flow: CommitFlow, kind: type[Silo]
) -> None:
    """Own commits, one after the other."""
    office.silo.__class__ = kind
    doc = committed(office, flow, "Plate", b"one")
    person = Person(office)
    for content in (b"two", b"three"):
        commit(office, flow, doc, content)
        assert person.seen == {}
    assert office.files("Plate") == [b"one", b"two", b"three"]


def test_a_colleagues_commit_is_a_question_and_nothing_goes_without_a_choice(
    office: Office, flow: CommitFlow
) -> None:
    """Who, when, what; neither saved nor sent."""
    doc = committed(office, flow, "Plate", b"one")
    colleague(office, "Plate", b"one less", 1)
    edit(doc, b"one other")
    person = Person(office)
    commit(office, flow, doc)
    (theirs,) = person.seen.values()
    assert (theirs.who, theirs.revision, theirs.base, theirs.comment) == ("alice", 2, 1, "less")
    assert theirs.headline == "alice committed revision 2; yours was made from revision 1"
    assert office.files("Plate") == [b"one", b"one less"]
    assert Path(doc.FileName).read_bytes() == b"one"


def test_a_notice_goes_once_the_server_has_nothing_newer(office: Office, flow: CommitFlow) -> None:
    """An announced commit that a restore took away, also where FreeCAD never heard of the restore."""
    doc = committed(office, flow, "Plate", b"one")
    office.session._heard(doc.identity, Newer("M01-0001", 2, "alice", time.monotonic()))
    edit(doc, b"two")
    person = Person(office)
    office.preferences.set("AskComment", False)
    flow.start(doc)
    assert (len(office.desk.asked), person.seen, office.session.shown.newer) == (1, {}, {})
    office.settle()
    commit(office, flow, doc, b"three")
    assert (len(office.desk.asked), office.files("Plate")) == (1, [b"one", b"two", b"three"])


def test_a_notice_stays_where_a_copy_of_the_file_is_older(office: Office, flow: CommitFlow) -> None:
    """Two files of one item: one is the newest commit, the other would undo it."""
    doc = committed(office, flow, "Plate", b"one")
    copy = office.document("Copy")
    copy.identity = doc.identity
    Path(copy.FileName).write_bytes(b"older")
    doc.OutList = [copy]
    edit(doc, b"two")
    edit(copy, b"older still")
    office.session._heard(doc.identity, Newer("M01-0001", 2, "alice", time.monotonic()))
    person = Person(office)
    flow.start(doc)
    assert (list(person.seen), list(office.session.shown.newer)) == ([copy.FileName], [doc.identity])


def test_on_top_at_a_persons_word(office: Office, flow: CommitFlow) -> None:
    """The comment notes it; the next commit is made from that one."""
    doc = committed(office, flow, "Plate", b"one")
    colleague(office, "Plate", b"one less", 1)
    edit(doc, b"one other")
    person = Person(office, Choice.ON_TOP)
    commit(office, flow, doc)
    newest = office.silo.revisions(number_of(office, "Plate"))[0]
    assert newest.comment == "mine (on top of revision 2 by alice, which is not in it)"
    assert newest.base_revision == 2
    commit(office, flow, doc, b"next")
    assert person.seen == {}
    assert office.files("Plate")[-1] == b"next"


def test_other_choices_are_handed_on(office: Office, flow: CommitFlow) -> None:
    """The other files of the commit go."""
    leaf, top = committed(office, flow, "Leaf", b"one"), committed(office, flow, "Top", b"top")
    top.OutList = [leaf]
    colleague(office, "Leaf", b"theirs", 1)
    edit(leaf, b"mine")
    edit(top, b"new top")
    wanted: list[Any] = []
    flow.choose = lambda *what: wanted.append(what)
    Person(office, Choice.TAKE)
    commit(office, flow, top)
    assert office.files("Top") == [b"top", b"new top"]
    assert office.files("Leaf") == [b"one", b"theirs"]
    ((path, theirs, choice),) = wanted
    assert (path, theirs.revision, choice) == (leaf.FileName, 2, Choice.TAKE)


@pytest.mark.parametrize("hashed", [True, False])
def test_without_the_dialog_it_waits_in_the_pane(office: Office, flow: CommitFlow, *, hashed: bool) -> None:
    """The look at sending catches it; file and BOM are held with the question.

    hashed
        if not, nobody knows what the document is made from.
    """
    doc = committed(office, flow, "Plate", b"one")
    colleague(office, "Plate", b"one less", 1)
    if not hashed:
        office.desk.documents.bases.clear()
    commit(office, flow, doc, b"one other")
    (held,) = office.session.shown.waiting
    assert (held.state, held.newer["revision_number"]) == (State.HELD, 2)
    assert office.files("Plate") == [b"one", b"one less"]


def assembly(identity: str, bolts: int) -> bytes:
    doc = File("Top", meta={"SiloUUID": identity}).link("Bolts", "Bolt.FCStd", "Box", ElementCount=bolts)
    return doc.add("App::Part", "Assembly", Type="Assembly", Group=locals_("Bolts")).bytes()


def test_the_pane_has_the_difference_of_a_held_commit(office: Office, flow: CommitFlow) -> None:
    """Base, theirs and mine, found by a worker; a server that has no time costs the details alone."""
    bolt, top = office.document("Bolt"), office.document("Top")
    Path(bolt.FileName).write_bytes(part("Bolt", uuid=bolt.identity).bytes())
    top.content, top.parts = assembly(top.identity, 6), {bolt: 6}
    commit(office, flow, top)
    colleague(office, "Top", assembly(top.identity, 4), 1)
    edit(top, assembly(top.identity, 8))
    top.parts = {bolt: 8}
    download, office.silo.download_file = office.silo.download_file, lost  # type: ignore[method-assign]
    commit(office, flow, top)
    (held,) = office.session.shown.waiting
    assert (held.newer["revision_number"], office.session.shown.theirs) == (2, {})
    office.silo.download_file = download  # type: ignore[method-assign]
    office.session.tick()
    office.settle()
    (row,) = rows([held], office.silo.base_url, office.session.shown.theirs)
    assert row.details == ("Bolt: 6 → 4 by them, 8 by you",)
    office.session.discard(held.id)
    office.settle()
    assert office.session.shown.theirs == {}
    assert office.bugs == []


def lost(*_: object, **__: object) -> None:
    raise ServerFaultError("no time")


def test_an_answer_reaches_older_boxes(office: Office, flow: CommitFlow) -> None:
    """Given in Register Parts, or in another box; other files and other identities still ask."""

    def asking(key: str, identity: str, *files: str) -> PaneEntry:
        same = Action(Do.SAME, "Same part", identity, objects=files)
        return PaneEntry(key, "x", 1.0, lines=(EntryLine("2 files", Tone.WARNING, (same,)),))

    office.session.add(asking("asked", "ID", "/v/a", "/v/b"))
    office.session.add(asking("more", "ID", "/v/a", "/v/b", "/v/c"))
    office.session.add(asking("other", "other", "/v/a", "/v/b"))
    flow.accept("id", ["/v/a", "/v/b"])
    boxes = office.session.shown.activity.entries
    assert {box.key: bool(box.lines[0].actions) for box in boxes} == {
        "asked": False,
        "more": True,
        "other": True,
    }


def test_a_file_that_somebody_replaced_is_asked_about_also_offline(office: Office, flow: CommitFlow) -> None:
    """A colleague's save on a shared drive: the dialog comes although comments are not asked for."""
    doc = committed(office, flow, "Plate", b"one")
    Path(doc.FileName).write_bytes(b"by a colleague, not committed")
    edit(doc, b"mine")

    asked: list[CommitPlan] = []

    def person(planned: CommitPlan, look: Look) -> CommitAnswer | None:
        asked.append(planned)
        found: list[Mapping[str, Theirs]] = []
        look(found.append)
        assert found[0][doc.FileName].headline == "the file on disk was changed since you opened it"
        return None

    office.desk.decide = person
    commit(office, flow, doc)
    assert [row.replaced for row in asked[0].rows] == [True]
    office.desk.decide = lambda planned, _look: CommitAnswer(planned.rows, "mine")
    commit(office, flow, doc)
    kept = [path.read_bytes() for path in (office.folder / "data" / "kept-aside").rglob("*.FCStd")]
    assert kept == [b"by a colleague, not committed"]
    assert office.files("Plate")[-1] == b"mine"


def test_a_lines_words() -> None:
    """Base, theirs and mine, in a sentence."""

    def entry(quantity: int) -> BomEntry | None:
        return (
            BomEntry("Bolt.FCStd", object_name="Body", label="Bolt", quantity=quantity) if quantity else None
        )

    def said(base: int, theirs: int, mine: int) -> str:
        return line_words(ThreeLines(entry(base), entry(theirs), entry(mine)))

    assert said(6, 0, 6) == "Bolt: 6 → 0 by them, as before in yours"
    assert said(6, 4, 8) == "Bolt: 6 → 4 by them, 8 by you"
    assert said(6, 6, 8) == "Bolt: 6 → 8 by you, as before in theirs"
    assert said(6, 8, 8) == "Bolt: 6 → 8 by both of you"


def two_bolts(office: Office, flow: CommitFlow) -> tuple[Document, Document]:
    """Top with two bolts, committed as revision 1, and the bolt."""
    bolt, top = office.document("Bolt"), office.document("Top", b"two bolts")
    top.parts[bolt] = 2
    commit(office, flow, top)
    return top, bolt


def bolts(office: Office) -> list[float | None]:
    return [line.quantity for line in office.silo.get_bom(number_of(office, "Top"))]


def test_a_bom_alone_is_that_of_the_file_in_silo(office: Office, flow: CommitFlow) -> None:
    """A question about a part was answered, or the parts were registered: unsaved edits do not go along."""
    top, bolt = two_bolts(office, flow)
    top.parts[bolt] = 3
    edit(top, b"three bolts")
    flow.sync_only(top)
    office.settle()
    assert bolts(office) == [2]
    box = next(e for e in office.session.shown.activity.entries if e.title == "Not committed: Top")
    assert "it changed after its commit. Commit it again" in box.lines[0].text
    top.changed = False
    Path(top.FileName).write_bytes(b"by somebody on the same share")
    flow.sync_only(top)
    office.settle()
    assert bolts(office) == [2]
    top.changed = True
    office.desk.documents.save(top)
    top.changed = top.recomputed = True  # nothing differs from the file
    flow.sync_only(top)
    office.settle()
    assert bolts(office) == [3]


def test_a_bom_alone_does_not_undo_a_colleagues(office: Office, flow: CommitFlow) -> None:
    """Here it is known what the document was made from; where a fork has committed the file, the file says
    it."""
    top, bolt = two_bolts(office, flow)
    colleague(office, "Top", b"one less", 1)
    top.parts[bolt] = 3
    flow.sync_only(top)
    office.settle()
    assert (bolts(office), office.session.shown.waiting) == ([2], ())
    assert "alice has committed revision 2 since" in office.sent[-1].entry.remark
    edit(top, b"on top of it")
    office.desk.documents.save(top)
    colleague(office, "Top", b"on top of it", 2)
    flow.sync_only(top)
    office.settle()
    assert bolts(office) == [3]


def test_a_file_that_is_replaced_while_the_person_decides(office: Office, flow: CommitFlow) -> None:
    """It is in no row of the dialog: the commit does not write over it."""
    doc = committed(office, flow, "Plate", b"one")
    edit(doc, b"mine")
    rows = plan(doc, office.desk.documents).wanted
    Path(doc.FileName).write_bytes(b"by somebody on the same share")
    flow.run(rows)
    office.settle()
    assert Path(doc.FileName).read_bytes() == b"by somebody on the same share"
    assert office.files("Plate") == [b"one"]
    (box,) = [e for e in office.session.shown.activity.entries if e.title == "Not committed: Plate"]
    assert "choose which one counts" in box.lines[0].text
    flow.run(plan(doc, office.desk.documents).rows)
    office.settle()
    assert office.files("Plate") == [b"one", b"mine"]


def test_a_bom_alone_of_a_file_that_was_saved_since(office: Office, flow: CommitFlow) -> None:
    """Registering a part saves the assembly above it, which is no revision yet; it was made from one."""
    top, bolt = two_bolts(office, flow)
    edit(top, b"with the times at which its parts were saved")
    office.desk.documents.save(top)
    office.desk.documents.base(top).content = sha256(b"two bolts").hexdigest()
    top.parts[bolt] = 3
    flow.sync_only(top)
    office.settle()
    assert (bolts(office), office.session.shown.waiting) == ([3], ())
    assert office.desk.documents.base(top).content == sha256(b"two bolts").hexdigest()
