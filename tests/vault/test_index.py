# SPDX-License-Identifier: LGPL-2.1-or-later
"""The index never changes an answer: whatever happens to the files and to the index itself.

The oracle is the same question asked of the files alone, by a session that knows nothing.
"""

from __future__ import annotations

import gc
import json
import os
import shutil
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import pytest
from fcstd_writer import Doc, Local, XLink, locals_, part
from hunting import examples
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from silo.bom.errors import InputError
from silo.fcstd.contents import FileContents
from silo.vault.answers import SeenFile, StoredAnswer
from silo.vault.index import Index
from silo.vault.questions import Question, WalkSession
from silo.vault.reading import VaultReader

HOUR_NS = 3600 * 10**9
NAMES = tuple(f"{folder}{name}.FCStd" for folder in ("", "sub/") for name in ("a", "b", "c", "d"))


def later() -> int:
    """A clock after every change: the state of each file counts as settled."""
    return time.time_ns() + HOUR_NS


def assembly(label: str, links: dict[str, int], uuid: str | None = None) -> Doc:
    """An assembly that links these files so often."""
    doc = Doc(label, meta={} if uuid is None else {"SiloUUID": uuid})
    names = []
    for number, (file, count) in enumerate(links.items()):
        doc.link(
            f"L{number}",
            file,
            "Box" if file.endswith(("a.FCStd", "b.FCStd")) else "Assembly",
            ElementCount=count,
        )
        names.append(f"L{number}")
    return doc.add("Assembly::AssemblyObject", "Assembly", Group=locals_(*names))


def questions(folder: Path) -> list[Question]:
    """Both kinds of question, of every file there may be."""
    return [
        Question(str(folder / name), below=below)
        for name in (*NAMES, "link.FCStd")
        for below in (True, False)
    ]


def truth(folder: Path) -> list[Any]:
    """What the files say, asked one by one without any memory."""
    return [json.loads(WalkSession().ask(question).answer) for question in questions(folder)]


def indexed(folder: Path, index: Path, contents: FileContents | None = None) -> tuple[list[Any], int]:
    """The same through the index; and how many files were read."""
    with Index(index, contents=contents or FileContents(clock=later)) as memory:
        reading = VaultReader(memory)
        return [answer.plain for answer in reading.ask_many(questions(folder))], reading.reads


class Vault(RuleBasedStateMachine):
    """Somebody works in the vault between two runs, and something happens to the index."""

    @initialize()
    def begin(self) -> None:
        self.home = Path(mkdtemp(prefix="silo-index-"))
        self.folder, self.index = self.home / "vault", self.home / "index.sqlite3"
        (self.folder / "sub").mkdir(parents=True)

    def teardown(self) -> None:
        shutil.rmtree(self.home, ignore_errors=True)

    def _write(self, name: str, content: bytes) -> None:
        """In place, and not within the tick of the file system's clock in which the last change was."""
        path = self.folder / name
        before = path.stat().st_ctime_ns if path.exists() else 0
        while not path.exists() or path.stat().st_ctime_ns == before:
            path.write_bytes(content)

    @rule(name=st.sampled_from(NAMES), label=st.sampled_from("xyz"), uuid=st.sampled_from([None, "u1", "u2"]))
    def write_part(self, name: str, label: str, uuid: str | None) -> None:
        self._write(name, part(label, uuid=uuid).bytes())

    @rule(
        name=st.sampled_from(NAMES),
        links=st.dictionaries(
            st.sampled_from([*NAMES, "../a.FCStd", "../b.FCStd", "B.fcstd"]), st.integers(1, 9), max_size=3
        ),
        uuid=st.sampled_from([None, "u1"]),
    )
    def write_assembly(self, name: str, links: dict[str, int], uuid: str | None) -> None:
        self._write(name, assembly(Path(name).stem, links, uuid).bytes())

    @rule(name=st.sampled_from(NAMES), digit=st.integers(1, 9), how=st.sampled_from(["in place", "replaced"]))
    def edit_in_secret(self, name: str, digit: int, how: str) -> None:
        """Same size, same time of modification."""
        path = self.folder / name
        if not path.exists():
            return
        status = path.stat()
        content = Doc("same", meta={"SiloUUID": f"u{digit}"}).add("Part::Box", "Box").bytes()
        content = content.ljust(max(status.st_size, len(content)), b"\0")
        if how == "in place":
            self._write(name, content)
        else:
            fresh = path.with_suffix(".new")
            fresh.write_bytes(content)
            os.replace(fresh, path)
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))

    @rule(name=st.sampled_from(NAMES))
    def delete(self, name: str) -> None:
        (self.folder / name).unlink(missing_ok=True)

    @rule(name=st.sampled_from(NAMES), to=st.sampled_from(NAMES))
    def move(self, name: str, to: str) -> None:
        if (self.folder / name).exists():
            os.replace(self.folder / name, self.folder / to)

    @rule(name=st.sampled_from(NAMES), to=st.sampled_from(NAMES))
    def copy(self, name: str, to: str) -> None:
        if (self.folder / name).exists() and name != to:
            self._write(to, (self.folder / name).read_bytes())

    @rule(name=st.sampled_from(NAMES))
    def symlink(self, name: str) -> None:
        (self.folder / "link.FCStd").unlink(missing_ok=True)
        os.symlink(self.folder / name, self.folder / "link.FCStd")

    @rule(name=st.sampled_from(NAMES), at=st.floats(0, 1), how=st.sampled_from(["cut", "flip", "empty"]))
    def damage(self, name: str, at: float, how: str) -> None:
        path = self.folder / name
        if path.exists():
            self._write(name, damaged(path.read_bytes(), at, how))

    @rule(at=st.floats(0, 1), how=st.sampled_from(["cut", "flip", "empty", "text", "gone"]))
    def damage_the_index(self, at: float, how: str) -> None:
        if not self.index.exists():
            return
        if how == "gone":
            self.index.unlink()
        elif how == "text":
            self.index.write_text("this is no database")
        else:
            self.index.write_bytes(damaged(self.index.read_bytes(), at, how))

    @rule(version=st.sampled_from([0, 99]))
    def make_the_index_foreign(self, version: int) -> None:
        if self.index.exists():
            database = sqlite3.connect(self.index)
            try:
                database.execute(f"PRAGMA user_version = {version}")
            except sqlite3.DatabaseError:
                pass  # damaged before
            database.close()

    @invariant()
    def the_answers_are_those_of_the_files(self) -> None:
        if hasattr(self, "folder"):
            wanted = truth(self.folder)
            assert indexed(self.folder, self.index)[0] == wanted
            assert indexed(self.folder, self.index)[0] == wanted


def damaged(content: bytes, at: float, how: str) -> bytes:
    """Cut short, one byte changed, or nothing left."""
    place = int(at * max(0, len(content) - 1))
    if how == "empty" or not content:
        return b""
    return (
        content[:place]
        if how == "cut"
        else content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]
    )


Vault.TestCase.settings = settings(max_examples=examples(6), stateful_step_count=12)
TestVault = Vault.TestCase


@pytest.fixture
def vault(tmp_path: Path) -> Path:
    folder = tmp_path / "vault"
    part("a", uuid="ua").save(folder / "a.FCStd")
    part("b").save(folder / "b.FCStd")
    assembly("c", {"a.FCStd": 2, "b.FCStd": 1}).save(folder / "c.FCStd")
    assembly("d", {"c.FCStd": 3, "a.FCStd": 4}).save(folder / "d.FCStd")
    return folder


def test_a_second_run_reads_nothing_and_a_change_reads_what_uses_it(vault: Path, tmp_path: Path) -> None:
    """A part's change asks those again that hold it directly; the answers are those of the files."""
    index = tmp_path / "index"
    _, reads = indexed(vault, index)
    assert reads == 4, "each once, however many use it"
    assert indexed(vault, index)[1] == 0
    part("b", uuid="new").save(vault / "b.FCStd")
    found, reads = indexed(vault, index)
    assert (found, reads) == (truth(vault), 3), "of the other part the facts are known"
    assert indexed(vault, index)[1] == 0


def test_an_edit_within_one_tick_of_the_clock_is_seen(vault: Path, tmp_path: Path) -> None:
    """Right after a save, size and times say nothing: the content is compared until the file has settled."""
    path, index = vault / "a.FCStd", tmp_path / "index"
    indexed(vault, index, FileContents())
    status = path.stat()
    others = (part("a", uuid=f"{number:x}").bytes() for number in range(1, 4096))
    path.write_bytes(next(content for content in others if len(content) == status.st_size))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert path.stat().st_size == status.st_size
    assert indexed(vault, index, FileContents())[0] == truth(vault)


def test_a_state_counts_as_settled_only_well_after_its_last_change(vault: Path) -> None:
    """The clock of a file system has ticks of up to 2 s: two changes in one tick look like one."""
    status = (vault / "a.FCStd").stat()
    changed = max(status.st_mtime_ns, status.st_ctime_ns)
    state = (status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)
    looks = {after: SeenFile("", *state, changed + after * 10**9).still(status) for after in (-1, 0, 2, 3)}
    assert looks == {-1: False, 0: False, 2: False, 3: True}


def test_one_assembly_is_asked_and_what_it_uses_has_changed(vault: Path, tmp_path: Path) -> None:
    """Nobody asked for the part itself since: what is known of it is what it was."""
    index, asked = tmp_path / "index", Question(str(vault / "c.FCStd"))
    indexed(vault, index)
    part("b", uuid="new").save(vault / "b.FCStd")
    with Index(index, contents=FileContents(clock=later)) as memory:
        found = VaultReader(memory).ask(asked)
    assert found.plain == json.loads(WalkSession().ask(asked).answer)
    assert "new" in found.known.answer


def odd_target() -> Doc:
    """A file with all that a link may name, and more objects than its facts tell of."""
    doc = Doc("odd", meta={"SiloUUID/Screw": "screw", "SiloUUID": "odd"}, extra={"SiloUUID": "document"})
    doc.add("Part::Box", "Pad").add("PartDesign::Body", "Body", Group=locals_("Pad"), SiloItemId="body")
    doc.add("Part::FeaturePython", "Screw", Type="ISO4762", Diameter="M4", Length="16", Invert=False)
    doc.add("Spreadsheet::Sheet", "Sheet").link("Chain", "", "Body").link("Out", "a.FCStd", "Box")
    doc.add("Part::Box", "Hidden", SiloBomExclude=True).add("Part::Feature", "Ähn<lich", Label='a "b" & c')
    doc.add("App::Part", "Inner", Group=locals_("Out", "Body")).link("Array", "", "Body", ElementCount=3)
    doc.add("Future::Links", "Later", LinkedObject=XLink("a.FCStd", "Box"), ElementCount=2)
    doc.add("Part::Box", "Types", Label=7, SiloItemId={"SiloUUID": "x"}, Meta="text", SiloUUID=Local("Pad"))
    for number in range(30):
        doc.add("Part::Box", f"More{number}", SiloItemId=f"more {number}")
    return doc


def test_a_session_frees_what_it_made(vault: Path) -> None:
    """Documents and their objects refer to each other; thousands of them must not wait for the collector."""
    session = WalkSession()
    asked = [Question(str(path), below=below) for path in vault.glob("*.FCStd") for below in (True, False)]

    def run() -> None:
        for question in asked:
            session.read(question)
            session.ask(question)

    run()
    gc.collect()
    gc.disable()
    try:
        for _ in range(5):
            run()
        gc.set_debug(gc.DEBUG_SAVEALL)
        gc.collect()
        # Whatever else this process left behind is not ours.
        ours = [one for one in gc.garbage if type(one).__module__.partition(".")[0] == "silo"]
        assert len(ours) < len(asked)
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()


def trail_of(known: StoredAnswer) -> object:
    """Where the order of files does not matter."""
    return known.trail if known.is_of_one_file else json.loads(known.trail)


def test_facts_in_place_of_a_file_change_nothing(vault: Path, tmp_path: Path) -> None:
    """Whatever a link names in a file of which the facts are known, also what they do not tell."""
    odd_target().save(vault / "odd.FCStd")
    named = [
        *("Pad", "Body", "Screw", "Sheet", "Chain", "Out", "Hidden", "Ähn<lich", "Inner", "Array"),
        *("Later", "Types"),
    ]
    links = [XLink("odd.FCStd", name) for name in (*named, "Gone", "More1", "More29")]
    links += [
        XLink("odd.FCStd", "Inner", (sub,)) for sub in ("Body.", "Out.", "Body.Face1", "Gone.", "$Out.")
    ]
    top = Doc("top").add("App::Part", "A", Group=locals_(*(f"L{n}" for n in range(len(links)))))
    for number, link in enumerate(links):
        top.add("App::Link", f"L{number}", LinkedObject=link)
        one = Doc("one").add("App::Link", "L", LinkedObject=link).add("App::Part", "A", Group=locals_("L"))
        one.save(vault / f"one{number}.FCStd")
    top.save(vault / "top.FCStd")
    asked = [
        Question(str(path), below=below) for path in sorted(vault.glob("*.FCStd")) for below in (True, False)
    ]
    wanted = [WalkSession().ask(question) for question in asked]
    for _ in ("found out", "remembered", "walked again with the facts of the index"):
        with Index(tmp_path / "index", contents=FileContents(clock=later)) as memory:
            found = [answer.known for answer in VaultReader(memory).ask_many(asked)]
        assert [json.loads(one.answer) for one in found] == [json.loads(one.answer) for one in wanted]
        assert [trail_of(one) for one in found] == [trail_of(one) for one in wanted]
        if _ == "remembered":
            with closing(sqlite3.connect(tmp_path / "index")) as database, database:
                database.execute("DELETE FROM answers")


def test_facts_of_another_state_of_a_file_are_not_mixed_with_it(vault: Path, tmp_path: Path) -> None:
    """A file that is saved between the two steps of a run: what its facts do not say is not taken from it."""
    odd_target().save(vault / "odd.FCStd")
    facts = WalkSession().read(Question(str(vault / "odd.FCStd"))).facts
    doc = Doc("top").add("App::Part", "A", Group=locals_("Known", "Unknown"))
    doc.link("Known", "odd.FCStd", "Body").link("Unknown", "odd.FCStd", "More29").save(vault / "top.FCStd")
    part("odd", name="More29", uuid="new").save(vault / "odd.FCStd")
    known = WalkSession().ask(Question(str(vault / "top.FCStd")), lambda path: facts if "odd" in path else "")
    plain = json.loads(known.answer)
    assert [row["silo_uuid"] for row in plain["table"] if row["object_name"] == "Body"] == ["body"]
    assert "being written just now" in plain["findings"][0]["message"]
    assert plain["findings"][0]["severity"] == "error"
    with Index(tmp_path / "index") as memory:
        memory.remember(str(vault / "top.FCStd"), "question", known)
    with Index(tmp_path / "index") as memory:
        assert memory.recall(str(vault / "top.FCStd"), "question") is None, "the next run finds out again"


def test_facts_that_somebody_changed_in_the_index_are_not_there(vault: Path, tmp_path: Path) -> None:
    """Each row has a checksum; what fails it is read from the file."""
    index = tmp_path / "index"
    indexed(vault, index)
    with closing(sqlite3.connect(index)) as database, database:
        done = database.execute("UPDATE facts SET facts = replace(facts, 'ua', 'ub')")
        assert done.rowcount >= 2
        database.execute("DELETE FROM answers")
    assert indexed(vault, index)[0] == truth(vault)


@pytest.mark.parametrize("waiting", [0, 1, 100])
def test_only_what_changed_is_read_again(vault: Path, tmp_path: Path, waiting: int) -> None:
    """Of what an assembly links to the facts are known from before, however few answers may wait."""
    index = tmp_path / "index"
    asked = [Question(str(vault / name)) for name in ("a.FCStd", "b.FCStd", "c.FCStd", "d.FCStd")]
    for change, reads in (("", 4), ("", 0), ("d.FCStd", 1)):
        if change:
            assembly("d", {"a.FCStd": 3, "b.FCStd": 1}).save(vault / change)
        with Index(index, contents=FileContents(clock=later)) as memory:
            reading = VaultReader(memory, waiting=waiting)
            found = [answer.known.answer for answer in reading.ask_many(asked)]
            assert found == [WalkSession().ask(question).answer for question in asked]
            assert reading.reads == reads


def test_a_file_that_was_only_touched_is_known_by_its_content(vault: Path, tmp_path: Path) -> None:
    """A copy from a backup, a check-out: other times and another inode, the same answers without a walk."""
    index = tmp_path / "index"
    indexed(vault, index)
    shutil.copytree(vault, tmp_path / "copy")
    shutil.rmtree(vault)
    (tmp_path / "copy").rename(vault)
    with Index(index) as memory:
        reading = VaultReader(memory)
        list(reading.ask_many(questions(vault)))
        assert reading.asked == len(questions(vault)) - 8, "only the files that are not there"


@pytest.mark.parametrize("moved", ["part", "folder"])
def test_what_became_a_symlink_is_what_it_leads_to(vault: Path, tmp_path: Path, moved: str) -> None:
    """The content is the same; the components are not. People move a folder to a larger disk like this."""
    index, asked = tmp_path / "index", [Question(str(vault / f"{name}.FCStd")) for name in "ad"]
    indexed(vault, index)
    before, after = (
        (vault / "a.FCStd", vault / "moved.FCStd") if moved == "part" else (vault, tmp_path / "moved")
    )
    before.rename(after)
    os.symlink(after, before)
    with Index(index, contents=FileContents(clock=later)) as memory:
        found = list(VaultReader(memory).ask_many(asked))
    assert [one.plain for one in found] == [json.loads(WalkSession().ask(one).answer) for one in asked]
    assert all("moved" in one.known.answer for one in found)


def test_another_current_folder_is_another_file(
    vault: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A name without a folder means nothing to the index."""
    other = tmp_path / "other"
    part("a", uuid="elsewhere").save(other / "a.FCStd")
    answers = []
    for folder in (vault, other):
        monkeypatch.chdir(folder)
        with Index(tmp_path / "index", contents=FileContents(clock=later)) as memory:
            answers.append(VaultReader(memory).ask(Question("a.FCStd")).plain["table"][0]["silo_uuid"])
    assert answers == ["ua", "elsewhere"]


def test_a_file_that_the_user_named_and_that_is_no_index_stays(vault: Path) -> None:
    """A slip of the hand (--index top.FCStd) must not cost a drawing."""
    before = (vault / "d.FCStd").read_bytes()
    with pytest.raises(InputError, match="not an index"):
        Index(vault / "d.FCStd", given=True)
    assert (vault / "d.FCStd").read_bytes() == before


def test_an_index_that_cannot_be_written_costs_time_only(vault: Path, tmp_path: Path) -> None:
    """A full disk, a folder in its place."""
    (tmp_path / "folder").mkdir()
    with Index(tmp_path / "folder", contents=FileContents(clock=later)) as memory:
        assert "cannot be used" in memory.trouble
        assert [answer.plain for answer in VaultReader(memory).ask_many(questions(vault))] == truth(vault)
    if Path("/dev/full").exists():
        small = tmp_path / "small"
        with Index(small, contents=FileContents(clock=later)) as memory:
            memory._database._database.execute("PRAGMA max_page_count = 1")
            found = [answer.plain for answer in VaultReader(memory, waiting=0).ask_many(questions(vault))]
            memory.save()
            assert "full" in memory.trouble
            assert found == truth(vault)
            assert [answer.plain for answer in VaultReader(memory).ask_many(questions(vault))] == found


def _processes(folder: Path, index: Path, count: int) -> Iterator[subprocess.Popen[bytes]]:
    code = (
        "import sys; from pathlib import Path; sys.path[:0] = sys.argv[3:]; import test_index as t\n"
        "for _ in range(8): t.indexed(Path(sys.argv[1]), Path(sys.argv[2]))"
    )
    here = Path(__file__).parent
    paths = [str(here), str(here.parent / "support"), str(here.parents[1] / "mods")]
    for _ in range(count):
        yield subprocess.Popen([sys.executable, "-c", code, str(folder), str(index), *paths])


def test_two_processes_at_once_and_somebody_who_works(vault: Path, tmp_path: Path) -> None:
    """Both end well, and the index is true afterwards."""
    index = tmp_path / "index"
    with ExitStack() as stack:
        running = [stack.enter_context(process) for process in _processes(vault, index, 2)]
        number = 0
        while any(process.poll() is None for process in running):
            number += 1
            part("a", uuid=f"u{number}").save(vault / "a.FCStd")
            assembly("c", {"a.FCStd": number % 7 + 1, "b.FCStd": 1}).save(vault / "c.FCStd")
            if number == 5:
                index.unlink(missing_ok=True)
        assert [process.wait() for process in running] == [0, 0]
    assert indexed(vault, index)[0] == truth(vault)
