# SPDX-License-Identifier: LGPL-2.1-or-later
"""Our commands against a Silo as its documents describe it: in each mood, in mixed moods, with each fault.

Whatever happens, and however often a plain user repeats a command, the server holds each thing once.
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import random
import re
import shutil
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from fcstd_writer import Doc, Raw, locals_
from hunting import LONG
from real_silo import (
    FAULTS,
    HOMES,
    MIXTURES,
    MOODS,
    TOKEN,
    Item,
    Moods,
    RealSilo,
    mixed,
    real_silo,
    register_elsewhere,
)

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.batch import SyncOptions, TopResult, sync_top
from silo.bom.errors import AuthError, BusyError, InputError, ServerFaultError, SiloError
from silo.bom_sync.resolved import resolve
from silo.bom_sync.steps import Status, compare
from silo.cli.connection import client_of
from silo.cli.reading import read_assembly
from silo.inertia.push import PushItem, PushPlan, push
from silo.outbox.entry import Commit, State
from silo.outbox.report import Report
from silo.outbox.send import send_all
from silo.outbox.status_text import pause_text
from silo.outbox.store import Store
from silo.registering.closed_files import proposals_for, register_all
from silo.registering.journal import RESERVED
from silo.vault.project import commits, find_project, keep, name_documents, read_project
from silo.vault.project import compare as compare_project

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "gearbox"
NAMES = 9
"""Components of the example, its two assemblies included."""


@pytest.fixture(autouse=True)
def _home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))


class Desk:
    """A designer's files and the commands; each command may be repeated like a plain user would."""

    def __init__(self, folder: Path, silo: RealSilo) -> None:
        self.silo, self.folder = silo, folder
        self.top = folder / "gearbox" / "TopAssembly.FCStd"
        shutil.copytree(
            EXAMPLE, self.top.parent, ignore=shutil.ignore_patterns("*.py", "__pycache__", "*.md")
        )
        self.outbox = Store(folder / "outbox.sqlite3")

    def client(self) -> SiloClient:
        """A new one, as each run of a command has it."""
        retries = Retries(tries=2, sleep=lambda _s: None)
        # Only a fault may make an answer late: on a busy machine others come late as well.
        patience = 0.25 if "slow" in self.silo.faults.values() else 60
        return SiloClient(self.silo.url, TOKEN, timeout=(60, patience), retries=retries)

    def register(self, ask: Any = None) -> list[SiloError]:
        extraction = read_assembly(str(self.top))
        with self.client() as client:
            schema = client.find_schema("kindred-rd")
            proposals = proposals_for(extraction, client, schema)
            options = {"ask": ask} if ask else {}
            done = register_all(proposals, client, schema=schema, **options)
        return [result.error for result in done if result.error is not None]

    def take(self) -> list[SiloError]:
        """``register --unclear take``: the person looked, and the one item that fits is it."""

        def one(_proposal: object, found: Any) -> Any:
            assert len(found) == 1
            return found[0]

        return self.register(one)

    def diff(self) -> list[SiloError]:
        with self.client() as client:
            resolved = resolve(read_assembly(str(self.top)), client)
            if resolved.assembly.part_number:
                compare(resolved, client)
        return []

    def sync(self) -> list[SiloError]:
        result = self.synced()
        return [error for error in (result.error, *(o.error for o in result.outcomes)) if error is not None]

    def synced(self) -> TopResult:
        with self.client() as client:
            return sync_top(str(self.top), read_assembly(str(self.top)), client, SyncOptions(recursive=True))

    def push(self) -> list[SiloError]:
        item = self.silo.named("Housing")
        plan = PushPlan((PushItem(item.part_number, "Housing", {"mass_kg": 1.5}),), comment="masses")
        with self.client() as client:
            return [error for _, error in push(client, plan).failed]

    def wait(self) -> None:
        """Put a file into the queue."""
        path = next(self.top.parent.rglob("Housing.FCStd"))
        number = self.silo.named("Housing").part_number
        self.outbox.add(Commit(str(path), 0.0, part_number=number, comment="c", file=path), self.silo.url)

    def queue(self) -> list[SiloError]:
        """Send one file by the queue; added once, sent as often as it takes."""
        if not self.outbox.entries() and not any(item.files for item in self.silo.items.values()):
            self.wait()
        with self.client() as client:
            report = send_all(self.outbox, client, force=True)
        for entry in report.held:
            self.outbox.retry(entry.id)
        stopped = [report.stopped_by] if report.stopped_by is not None else []
        return [*stopped, *(InputError(entry.reason) for entry in (*report.held, *report.failed))]


def until_done(command: Callable[[], list[SiloError]], times: int = 4) -> list[SiloError]:
    """Repeat a command until it reports nothing; what it reports at last."""
    left: list[SiloError] = []
    for _ in range(times):
        try:
            left = command()
        except SiloError as error:
            left = [error]
        if not left:
            break
    return left


def assembled(desk: Desk) -> dict[str, float]:
    """The top assembly's lines as the server holds them."""
    top = desk.silo.named("Top Assembly")
    return {line["child_part_number"]: line["quantity"] for line in top.lines}


@cache
def registered_gearbox(schemas: tuple[str, ...]) -> tuple[dict[Path, bytes], dict[str, Item], list[Any]]:
    """The example's files, and a server's items and events, after a registration in a good mood."""
    with TemporaryDirectory() as name, real_silo(Moods(schemas=schemas)) as silo:
        folder = Path(name)
        desk = Desk(folder, silo)
        assert desk.register() == []
        files = {path.relative_to(folder): path.read_bytes() for path in desk.top.parent.rglob("*.FCStd")}
        return files, silo.backup(), silo.events


def registered(folder: Path, silo: RealSilo) -> Desk:
    """A desk whose components have their items."""
    desk = Desk(folder, silo)
    files, items, events = registered_gearbox(silo.moods.schemas)
    for path, content in files.items():
        (folder / path).write_bytes(content)
    silo.restore(items)
    silo.events[:] = events
    return desk


def check_held_once(desk: Desk) -> None:
    """No item twice, no line twice, every line once."""
    assert all(count == 1 for count in desk.silo.holds().values()), desk.silo.holds()
    for item in desk.silo.items.values():
        children = [line["child_part_number"] for line in item.lines]
        assert len(children) == len(set(children))


# -- each mood -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "moods",
    [*MIXTURES, *(((name,) for name in MOODS) if LONG else ())],
    ids=lambda names: ", ".join(names) or "default",
)
def test_the_whole_story_in_each_mood(tmp_path: Path, moods: tuple[str, ...]) -> None:
    """Register, sync, push, queue; then all of it again, which changes nothing."""
    with real_silo(mixed(moods)) as silo:
        story(Desk(tmp_path, silo))


def story(desk: Desk) -> None:
    """What a team does, twice; what the server holds in the end."""
    silo = desk.silo
    until_done(desk.register, 2)
    # Where nothing on the server shows for which part an item was made, a person looked.
    assert until_done(desk.take) == []
    assert len(silo.items) == NAMES
    check_held_once(desk)
    assert desk.diff() == []
    assert until_done(desk.sync) == []
    lines = assembled(desk)
    assert len(lines) == 5
    housing = silo.named("Housing")
    housing.revisions[-1]["properties"]["finish"] = "painted"
    held = silo.moods.properties != "nowhere"
    assert (until_done(desk.push) == []) == held
    newest = housing.revisions[-1]["properties"]
    assert newest["finish"] == "painted"
    assert ("mass_kg" in newest) == held
    assert until_done(desk.queue) == []
    assert len(housing.files) == 1
    counts = [len(item.revisions) for item in silo.items.values()]
    for command in (desk.register, desk.sync, desk.push):
        until_done(command, 1)
    assert (len(silo.items), assembled(desk)) == (NAMES, lines)
    assert [len(item.revisions) for item in silo.items.values()] == counts
    check_held_once(desk)


def test_a_manual_line_is_reported_and_stays(tmp_path: Path) -> None:
    """Whether the server refuses the merge for it or not."""
    for moods in (Moods(), Moods(manual_409=True), Moods(merge="missing"), Moods(merge="empty")):
        with real_silo(moods) as silo:
            desk = registered(tmp_path / str(silo.server_address[1]), silo)
            number = silo.named("Cover").part_number
            line = {"child_part_number": number, "quantity": 7, "source": "manual", "rel_type": "component"}
            silo.named("Top Assembly").lines.append(line)
            assert desk.sync() == []
            assert (assembled(desk)[number], len(assembled(desk))) == (7, 5)


@pytest.mark.parametrize(
    ("moods", "word"),
    [
        (Moods(role="viewer"), "editor"),
        (Moods(mode="read-only"), "no changes now"),
        (Moods(expired=True), "wants a login"),
    ],
    ids=["viewer", "read-only", "expired session"],
)
def test_a_server_that_takes_no_changes_is_asked_once(tmp_path: Path, moods: Moods, word: str) -> None:
    """Reading works where it may; the first refusal ends the run; the words say why."""
    with real_silo(moods) as silo:
        desk = registered(tmp_path / "a", silo)
        if not moods.expired:
            assert desk.diff() == []
        silo.seen.clear()
        [*errors] = desk.sync() if not moods.expired else until_done(desk.sync, 1)
        assert errors
        assert all(word in str(error) for error in errors)
        assert sum("merge" in seen for seen in silo.seen) <= 1
        fresh = Desk(tmp_path / "b", silo)
        errors = until_done(fresh.register, 1)
        assert all(word in str(error) for error in errors)
        assert sum(seen == "POST /api/items" for seen in silo.seen) <= 1
        assert len(silo.items) == NAMES


# -- waiting ---------------------------------------------------------------------------------------


def test_the_queue_keeps_the_pause_that_the_server_named(tmp_path: Path) -> None:
    """At whichever request; the entry names the time, and nothing is asked before it has passed."""
    with real_silo() as silo:
        desk, now = registered(tmp_path, silo), [1000.0]
        desk.outbox.clock = lambda: now[0]
        desk.wait()
        with desk.client() as client:
            for request in range(LENGTHS["queue"]):
                silo.faults[len(silo.seen) + request] = "429"
                report = send_all(desk.outbox, client)
                assert report.pause is not None
                assert "in 40 s" in report.pause.reason
                assert (report.pause.until, report.pause.told) == (now[0] + 40, True)
                asked = len(silo.seen)
                now[0] += 39
                send_all(desk.outbox, client)
                assert len(silo.seen) == asked
                now[0] += 1
                silo.faults.clear()
            assert len(send_all(desk.outbox, client).sent) == 1
        assert len(silo.named("Housing").files) == 1


def test_what_waits_for_a_newer_silo_is_sent_by_itself_after_the_upgrade(tmp_path: Path) -> None:
    """Nobody presses Retry; what was remembered of the old server does not stand in the way."""
    with real_silo(Moods(upload="missing")) as silo:
        desk, now = registered(tmp_path, silo), [1000.0]
        desk.outbox.clock = lambda: now[0]
        desk.wait()
        with SiloClient(silo.url, TOKEN, memory=tmp_path / "servers.json") as client:
            for _ in range(5):  # for hours
                assert send_all(desk.outbox, client).sent == []
                (entry,) = desk.outbox.entries()
                assert entry.state is State.WAITING
                pause = desk.outbox.pause(silo.url, entry.item)
                assert pause is not None
                assert now[0] < pause.until <= now[0] + 900
                now[0] = pause.until
            silo.moods = Moods()
            assert len(send_all(desk.outbox, client).sent) == 1
        assert len(silo.named("Housing").files) == 1


# -- each fault of each request --------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A fault of one request of a command."""

    command: str
    number: int
    fault: str


LENGTHS = {"register": 12, "sync": 14, "diff": 11, "push": 3, "queue": 3}
"""Requests of each command in the default mood."""
LENGTHS_BY_LINES = {**LENGTHS, "sync": 26}
"""The same where there is no merge."""


def cases(lengths: dict[str, int]) -> list[Case]:
    """Every request of every command with every fault."""
    return [
        Case(command, number, fault)
        for command, length in lengths.items()
        for number in range(length)
        for fault in FAULTS
    ]


# What the queue sends meets its faults in tests/outbox/test_faults.py.
SAMPLE = random.Random(15).sample([case for case in cases(LENGTHS) if case.command != "queue"], 14)
WHOLE = {
    "default": (Moods(), cases(LENGTHS)),
    "no checksums, late index": (Moods(checksums=False, search="nothing"), cases(LENGTHS)),
    # Nothing is written where the properties cannot be read.
    "properties nowhere": (Moods(properties="nowhere"), [c for c in cases(LENGTHS) if c.command != "push"]),
    "no merge": (Moods(merge="missing"), cases(LENGTHS_BY_LINES)),
}


def after_a_fault(folder: Path, case: Case, moods: Moods) -> None:
    """The command with the fault, repeated by a plain user: the server holds each thing once."""
    with real_silo(moods) as silo:
        desk = Desk(folder, silo) if case.command == "register" else registered(folder, silo)
        if case.command == "push":
            silo.named("Housing").revisions[-1]["properties"]["finish"] = "painted"
        silo.faults[case.number] = case.fault
        command = getattr(desk, case.command)
        left = until_done(command)
        if left and case.command == "register":
            # Only where nothing on the server shows for which part the item was made.
            assert moods.properties == "nowhere"
            left = until_done(desk.take)
        assert left == [], case
        check_held_once(desk)
        assert len(silo.items) == NAMES
        housing = silo.named("Housing")
        if case.command == "sync":
            assert len(assembled(desk)) == 5
        if case.command == "push":
            assert {k: housing.revisions[-1]["properties"].get(k) for k in ("finish", "mass_kg")} == {
                "finish": "painted",
                "mass_kg": 1.5,
            }
        if case.command == "queue":
            assert len(housing.files) == 1


@pytest.mark.parametrize("case", SAMPLE, ids=str)
def test_each_thing_is_held_once_after_a_fault(tmp_path: Path, case: Case) -> None:
    """A seeded sample of the table below."""
    after_a_fault(tmp_path, case, Moods())


@pytest.mark.skipif(not LONG, reason="half an hour; SILO_LONG=1 runs it")
@pytest.mark.parametrize(
    ("moods", "case"),
    [
        pytest.param(moods, case, id=f"{name}, {case}")
        for name, (moods, those) in WHOLE.items()
        for case in (those if LONG else ())
    ],
)
def test_the_whole_fault_table(tmp_path: Path, moods: Moods, case: Case) -> None:
    """Every request of every command with every fault."""
    after_a_fault(tmp_path, case, moods)


def test_a_silo_without_documents_gets_each_file_where_it_can(tmp_path: Path) -> None:
    """One of several parts at its main part, a sheet as an attachment of the assembly with the link; once."""
    root = tmp_path / "robot"
    with real_silo(Moods()) as silo, SiloClient(silo.url, TOKEN) as client:
        left, right, top = (
            client.create_item("kindred-rd", "M01", name, item_type="part").id for name in ("L", "R", "T")
        )

        def marked(uuid: str) -> dict[str, Any]:
            return {"SiloItemId": Raw("App::PropertyString", f'<String value="{uuid}"/>')}

        both = Doc(label="Both").add("Part::Box", "Left", Height=1.0, **marked(left))
        both.add("Part::Box", "Right", Height=1.0, **marked(right)).save(root / "Both.FCStd")
        Doc(label="S").add("Spreadsheet::Sheet", "Sheet").save(root / "Sheet.FCStd")
        doc = Doc(label="Top", meta={"SiloUUID": top}).link("L1", "Both.FCStd", "Left")
        doc.link("L2", "Both.FCStd", "Right").link("S", "Sheet.FCStd", "Sheet")
        doc.add("Assembly::AssemblyObject", "Asm", Group=locals_("L1", "L2"), Type="Assembly")
        doc.save(root / "Top.FCStd")
        store = Store(tmp_path / "outbox.sqlite3")
        for _again in range(2):
            found = name_documents(read_project([str(root)], find_project([str(root)])), client)
            for file, one in commits(found, compare_project(found, client, store)):
                keep(found.project, store, file, one, client.base_url)
            report = send_all(store, client, force=True)
            assert (report.held, report.failed, report.stopped_by) == ([], [], None)
        items = {item.description: item for item in silo.items.values()}
        assert list(items["L"].files.values()) == [(root / "Both.FCStd").read_bytes()]
        assert items["R"].files == {}
        assert list(items["T"].files.values()) == [(root / "Top.FCStd").read_bytes()]
        assert items["T"].attachments == [("Sheet.FCStd", (root / "Sheet.FCStd").read_bytes())]
        assert sorted(line["child_part_number"] for line in items["T"].lines) == sorted(
            [items["L"].part_number, items["R"].part_number]
        )


# -- one folder, two computers ---------------------------------------------------------------------


def keep_homes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Undo at the end what :func:`register_elsewhere` changes in this process."""
    for name in HOMES:
        monkeypatch.setenv(name, "/nowhere")


@pytest.mark.parametrize(
    ("locks", "moods"), [(True, Moods()), (False, Moods()), (False, Moods(own_ids=False))]
)
def test_two_computers_register_one_folder_once(
    tmp_path: Path, moods: Moods, locks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both read the folder before either of them registers. Without locks the file itself is the place."""
    with real_silo(moods) as silo:
        desk = Desk(tmp_path, silo)
        jobs = [(str(desk.top), silo.url, str(tmp_path / f"computer {n}")) for n in range(2)]
        if locks:
            # An executor reports a process that cannot start; a Pool would start it forever.
            with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
                assert list(pool.map(register_elsewhere, *zip(*jobs, strict=True))) == [0, 0]
        else:
            for folder in {path.parent for path in desk.top.parent.rglob("*.FCStd")}:
                (folder / ".silo-register.lock").mkdir()
            keep_homes(monkeypatch)
            assert [register_elsewhere(*job) for job in jobs] == [0, 0]
        assert (len(silo.items), set(silo.holds().values())) == (NAMES, {1})
        assert desk.register() == []
        with desk.client() as client:
            assert resolve(read_assembly(str(desk.top)), client).unresolved == ()


@pytest.mark.parametrize("moods", [Moods(), Moods(own_ids=False)], ids=["its own ids", "our ids"])
def test_what_one_computer_began_another_one_ends(
    tmp_path: Path, moods: Moods, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From any creation on no answer reaches the first computer: neither to that nor to what it asks then."""
    keep_homes(monkeypatch)
    for number in range(NAMES) if LONG else (0, 4, 8):
        with real_silo(moods) as silo:
            folder = tmp_path / str(number)
            desk = Desk(folder, silo)
            silo.answered_creations = number
            assert register_elsewhere(str(desk.top), silo.url, str(folder / "first")) > 0
            assert len(silo.items) == number + 1
            silo.answered_creations = None
            assert register_elsewhere(str(desk.top), silo.url, str(folder / "second")) == 0
            assert register_elsewhere(str(desk.top), silo.url, str(folder / "first")) == 0
            assert (len(silo.items), set(silo.holds().values())) == (NAMES, {1})
            assert list(desk.top.parent.rglob(RESERVED)) == []


@pytest.mark.parametrize("moods", [Moods(), Moods(own_ids=False)], ids=["its own ids", "our ids"])
def test_a_project_moves_from_a_trial_server_to_the_real_one(tmp_path: Path, moods: Moods) -> None:
    """By identity, with the UUIDs if the server takes them. A second computer finds what this one took."""
    with real_silo(Moods(own_ids=False)) as trial, real_silo(moods) as real:
        desk = registered(tmp_path, trial)
        before = {item.description: item.id for item in trial.items.values()}
        shutil.copytree(desk.top.parent, tmp_path / "another" / "gearbox")
        desk.silo = real
        assert desk.register() == []
        assert (len(real.items), set(real.holds().values())) == (NAMES, {1})
        if not moods.own_ids:
            assert {item.description: item.id for item in real.items.values()} == before
        with desk.client() as client:
            assert resolve(read_assembly(str(desk.top)), client).unresolved == ()
        top = str(tmp_path / "another" / "gearbox" / desk.top.name)
        assert register_elsewhere(top, real.url, str(tmp_path / "computer 2")) == 0
        assert (len(real.items), set(real.holds().values())) == (NAMES, {1})


# -- pages -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("oldest_first", [True, False], ids=["oldest first", "newest first"])
@pytest.mark.parametrize("how", ["header", "body", "next", "link"])
def test_lists_are_read_to_their_end(how: str, oldest_first: bool) -> None:
    """However the server says that there is more, and whatever size its pages have."""
    moods = Moods(page=5, total=how, oldest_first=oldest_first)
    with real_silo(moods) as silo, SiloClient(silo.url, TOKEN) as client:
        top = client.create_item("kindred-rd", "A01", "Top", item_type="assembly").part_number
        parts = [client.create_item("kindred-rd", "M01", f"Part {n}").part_number for n in range(12)]
        for number in parts:
            client.add_bom_line(top, number)
            silo.named("Top").revisions.append({"revision_number": len(silo.named("Top").revisions) + 1})
        silo.seen.clear()
        assert [one.revision_number for one in client.revisions(top)] == [*range(13, 0, -1)]
        assert len(silo.seen) == 3
        assert [one.revision_number for one in client.revisions(top, newest=2)] == [13, 12]
        assert [one.revision_number for one in client.revisions(top, newest=1, after=12)] == [13]
        assert client.revisions(top, after=13) == []
        assert [line.child_part_number for line in client.get_bom(top)] == parts


def test_the_newest_of_a_server_that_says_so_is_one_row() -> None:
    """Newest first, with their count: no second question."""
    with real_silo(Moods(page=50, total="header")) as silo, SiloClient(silo.url, TOKEN) as client:
        top = client.create_item("kindred-rd", "A01", "Top").part_number
        silo.named("Top").revisions += [{"revision_number": n} for n in range(2, 121)]
        silo.seen.clear()
        assert [one.revision_number for one in client.revisions(top, newest=1)] == [120]
        assert len(silo.seen) == 1


@pytest.mark.parametrize("how", ["header", "body", "next", "link"])
def test_a_list_with_more_than_it_shows_is_no_list(how: str) -> None:
    """A server that shows the first page whatever it is asked: nothing is concluded from that."""
    with (
        real_silo(Moods(page=2, total=how, first_page_only=True)) as silo,
        SiloClient(silo.url, TOKEN) as client,
    ):
        top = client.create_item("kindred-rd", "A01", "Top").part_number
        for n in range(3):
            client.add_bom_line(top, client.create_item("kindred-rd", "M01", f"Part {n}").part_number)
        with pytest.raises(ServerFaultError, match="more of them than the 2 that it shows"):
            client.get_bom(top)


def test_an_answer_for_many_that_is_cut_off_is_asked_one_by_one() -> None:
    """Read as whole, it would have the rest registered again."""
    with real_silo(Moods(page=2, total="body", batch=200)) as silo, SiloClient(silo.url, TOKEN) as client:
        made = [client.create_item("kindred-rd", "M01", f"Part {n}").id for n in range(5)]
        assert sorted(client.get_items_by_uuid(made)) == sorted(made)


# -- what everybody is told ------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["sync", "queue"])
def test_an_unreferenced_line_is_told_once(tmp_path: Path, how: str) -> None:
    """A Silo that does not show which lines are unreferenced gets no merge and sends no event per sync."""
    with real_silo() as silo:
        desk = registered(tmp_path, silo)
        top = silo.named("Top Assembly")

        def sync() -> int:
            silo.seen.clear()
            if how == "sync":
                assert desk.sync() == []
            else:
                extraction = read_assembly(str(desk.top))
                uuid = extraction.assembly.silo_uuid or ""
                desk.outbox.add(Commit(str(desk.top), 0.0, identity=uuid, extraction=extraction), silo.url)
                with desk.client() as client:
                    (sent,) = send_all(desk.outbox, client, force=True).sent
                assert sent.status in (Status.MERGED, Status.UNCHANGED)
            return silo.seen.count(f"POST /api/items/{top.part_number}/bom/merge")

        assert [sync(), sync()] == [1, 0]
        lines = [{"quantity": 1, "source": "assembly", "child_part_number": f"M01-900{n}"} for n in range(3)]
        top.lines.append(lines[0])
        assert [sync(), sync()] == [1, 0]
        top.lines += lines[1:]
        assert [sync(), sync()] == [1, 0]
        top.lines.remove(lines[0])
        assert sync() == 0, "a person decided about one; the others are known"
        top.lines[0]["quantity"] = 99
        assert [sync(), sync()] == [1, 0]


# -- waiting ---------------------------------------------------------------------------------------


class Stop(threading.Event):
    """Waits no time; ``waited``: the seconds that were asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.waited: list[float] = []

    def wait(self, timeout: float | None = None) -> bool:
        self.waited.append(timeout or 0.0)
        return False


@pytest.mark.parametrize(("fault", "seconds"), [("429", 40.0), ("503 later", 70.0)])
def test_a_command_that_waits_says_for_how_long_and_what_to_do(
    fault: str, seconds: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """On standard error, where it is no terminal as well."""
    with real_silo() as silo:
        silo.faults = {0: fault, 1: fault}
        stop, args = Stop(), argparse.Namespace(server=silo.url, token=TOKEN)
        with client_of(args, Retries(busy_tries=5, longest=120.0), stop=stop) as client:
            assert client.search_items() == []
    lines = capsys.readouterr().err.splitlines()
    assert (stop.waited, len(lines)) == ([seconds, seconds], 2)
    assert f"asked again in {seconds:.0f} s; Ctrl-C ends this" in lines[0]


def test_a_date_in_2099_is_not_waited_for_and_an_hour_is_said(tmp_path: Path) -> None:
    """An error and the pause of the queue name the hour after which the server is asked again."""
    with real_silo() as silo:
        silo.faults = {0: "503 in 2099"}
        once = Retries(longest=1e12, busy_tries=1)
        with (
            SiloClient(silo.url, TOKEN, retries=once) as client,
            pytest.raises(BusyError, match=r"Try again in 60 min$"),
        ):
            client.search_items()
        path = tmp_path / "a.FCStd"
        path.write_bytes(b"a")
        store = Store(tmp_path / "outbox.sqlite3")
        store.add(Commit(str(path), 0.0, part_number="M01-0001", file=path), silo.url)
        silo.faults = dict.fromkeys(range(1, 9), "503 in 2099")
        with SiloClient(silo.url, TOKEN, retries=Retries(tries=1)) as client:
            pause = send_all(store, client).pause
        assert pause is not None
        now = store.clock()
        assert 3500 < pause.left(now) <= 3600
        assert re.search(
            r"Nothing is sent to 127.0.0.1:\d+ for (59|60) min: .*Try again in 60 min",
            pause_text(pause, silo.url, now),
        )


# -- what comes back -------------------------------------------------------------------------------


def committed(desk: Desk, *, label: str = "Top Assembly") -> Commit:
    """A commit of the top assembly as it is: its file and its BOM."""
    extraction = read_assembly(str(desk.top))
    identity = extraction.assembly.silo_uuid or ""
    commit = Commit(
        str(desk.top), 0.0, label=label, identity=identity, file=desk.top, extraction=extraction, comment="c"
    )
    desk.outbox.add(commit, desk.silo.url)
    return commit


def sent(desk: Desk, token: str = TOKEN) -> Report:
    """What a sending that a person asked for did."""
    retries = Retries(tries=2, sleep=lambda _s: None)
    with SiloClient(desk.silo.url, token, timeout=60, retries=retries) as client:
        return send_all(desk.outbox, client, force=True)


@pytest.mark.parametrize(("storage", "upload"), [("down", "multipart"), ("none", "presigned")])
def test_a_storage_that_is_down_keeps_files_back_and_no_bom(
    tmp_path: Path, storage: str, upload: str
) -> None:
    """The BOM arrives at once, the file when the storage is back, each once."""
    with real_silo() as silo:
        desk = registered(tmp_path, silo)
        committed(desk)
        silo.moods = Moods(storage=storage, upload=upload)
        top = silo.named("Top Assembly")
        for _ in range(3):
            sent(desk)
        assert (len(top.lines), top.files, len(desk.outbox.entries())) == (5, {}, 1)
        merges = sum("merge" in one for one in silo.seen)
        assert merges == 1
        silo.moods = Moods(upload=upload)
        for entry in desk.outbox.entries():
            desk.outbox.retry(entry.id)
        sent(desk)
        assert (desk.outbox.entries(), [*top.files.values()]) == ((), [desk.top.read_bytes()])
        assert sum("merge" in one for one in silo.seen) == merges


def test_a_bom_alone_does_not_undo_a_colleagues_on_a_server_that_does_not_look(tmp_path: Path) -> None:
    """The real Silo merges whatever comes; the file's revisions say whose BOM counts."""
    with real_silo() as silo:
        desk = registered(tmp_path, silo)
        first = committed(desk)
        assert len(sent(desk).sent) == 1
        silo.revise(silo.named("Top Assembly"), "theirs", None, b"a colleague's")
        content = hashlib.sha256(desk.top.read_bytes()).hexdigest()
        assert first.extraction is not None
        one, *others = first.extraction.entries
        more = replace(first.extraction, entries=(replace(one, quantity=99), *others))
        alone = replace(first, key="alone", file=None, sha256=content, origin=content, extraction=more)
        desk.outbox.add(alone, silo.url)
        silo.seen.clear()
        (told,) = sent(desk).sent
        assert "has committed revision 3 since, whose BOM counts" in told.entry.remark
        assert not any("merge" in one for one in silo.seen)


def test_a_token_that_expires_in_between_loses_and_doubles_nothing(tmp_path: Path) -> None:
    """Nothing is asked of the server before a person acts; a new token sends all."""
    with real_silo() as silo:
        desk = registered(tmp_path, silo)
        committed(desk)
        silo.token = "silo_renewed"
        assert isinstance(sent(desk).stopped_by, AuthError)
        asked = len(silo.seen)
        with desk.client() as client:
            report = send_all(desk.outbox, client)
        assert (report.sent, len(silo.seen), report.pause is not None) == ([], asked, True)
        assert [entry.state for entry in desk.outbox.entries()] == [State.WAITING]
        assert len(sent(desk, silo.token).sent) == 1
        top = silo.named("Top Assembly")
        assert (desk.outbox.entries(), len(top.files), len(top.lines)) == ((), 1, 5)


def test_a_restored_backup_gets_again_what_it_lost(tmp_path: Path) -> None:
    """The second commit was made from a revision that the server lost: one press sends it anyway."""
    with real_silo() as silo:
        desk = registered(tmp_path, silo)
        committed(desk)
        sent(desk)
        backup, housing = silo.backup(), silo.named("Housing")
        path = next(desk.top.parent.rglob("Housing.FCStd"))
        first = path.read_bytes()
        for content, origin in ((first, ""), (first + b" ", hashlib.sha256(first).hexdigest())):
            path.write_bytes(content)
            identity, number = housing.id, housing.part_number
            commit = Commit(str(path), 0.0, identity=identity, part_number=number, file=path, origin=origin)
            desk.outbox.add(commit, silo.url)
            if not origin:
                assert len(sent(desk).sent) == 1
                silo.restore(backup)
        for _ in range(2):
            sent(desk)
        assert desk.outbox.entries() == ()
        assert [*silo.named("Housing").files.values()] == [first + b" "]
        check_held_once(desk)
