# SPDX-License-Identifier: LGPL-2.1-or-later
"""One item meets every fault of a table, over HTTP: the others pass, and it arrives once when the fault is
gone."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from fault_proxy import FAULTS, Proxy, fault_proxy
from hunting import LONG
from model_file import model_file
from real_silo import MIXTURES, MOODS, TOKEN, Item, Moods, mixed, real_silo
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.bom.entry import BomEntry, Extraction
from silo.outbox.entry import Commit, State
from silo.outbox.send import send_all
from silo.outbox.store import Store

NAMES = ("Bad", "Other")


@pytest.fixture(name="proxy", scope="module")
def _proxy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxy]:
    run = pytest.importorskip("silo_server.run", reason="the embedded server needs the extra 'server'")
    folder = tmp_path_factory.mktemp("faults")
    with (
        run.running_server(sqlite_database(folder / "silo.db"), token="silo_faults") as server,
        fault_proxy(server.base_url) as proxy,
    ):
        yield proxy


@pytest.fixture(name="client")
def _client(proxy: Proxy, request: pytest.FixtureRequest) -> Iterator[SiloClient]:
    """Patient with a busy machine; with the fault "slow" not too patient."""
    patience = 4.0 if "slow" in request.node.name else 60.0
    with SiloClient(proxy.url, "silo_faults", retries=Retries(tries=1), timeout=(5.0, patience)) as client:
        yield client


@pytest.mark.parametrize("name", FAULTS)
def test_one_item_in_trouble(tmp_path: Path, proxy: Proxy, client: SiloClient, name: str) -> None:
    """Whatever the server does with it: nothing is lost, doubled, or held up."""
    proxy.fault = None
    bolt = client.create_item("kindred-rd", "F01", "Bolt")
    items = {label: client.create_item("kindred-rd", "A01", label, item_type="assembly") for label in NAMES}
    store = Store(tmp_path / "outbox.sqlite3")
    for label, item in items.items():
        for number in (1, 2):
            path = tmp_path / f"{label}.FCStd"
            path.write_bytes(model_file(f"{label} {number}".encode() * 1000))
            head = BomEntry(str(path), silo_uuid=item.id, is_assembly=True)
            lines = (BomEntry("/v/Bolt.FCStd", silo_uuid=bolt.id, quantity=number),)
            store.add(
                Commit(
                    str(path), float(number), label, item.id, file=path, extraction=Extraction(head, lines)
                )
            )
    proxy.fault, proxy.item = FAULTS[name], items["Bad"].part_number
    for _ in range(1 if name == "slow" else 2):
        # Again and again, as the timer does: no try may make another revision.
        report = send_all(store, client, force=True)
        assert report.stopped_by is None
    left = store.entries()
    assert {entry.label for entry in left} <= {"Bad"}
    assert all(entry.reason for entry in left[:1])
    proxy.fault = None
    for entry in left:
        if entry.state is State.HELD:
            store.retry(entry.id)
    send_all(store, client, force=True)
    assert [(e.label, e.reason) for e in store.entries()] == []
    for label, item in items.items():
        sizes = [r.file_size for r in client.revisions(item.part_number) if r.file_name]
        assert len(sizes) == 2, label
        assert [line.quantity for line in client.get_bom(item.part_number)] == [2], label


# Fault of an upload → what of the commit is in Silo then: its files, the lines of its BOM.
# A refused file lets its BOM go; one whose answer was lost keeps it.
UPLOADS = {
    "drop before": (0, 0),
    "drop after": (1, 0),
    "502 before": (0, 0),
    "502 after": (1, 0),
    "cut": (1, 0),
    "500": (0, 0),
    "501": (0, 1),
    "no route": (0, 1),
    "503": (0, 1),
    "no storage": (0, 1),
    "404": (0, 1),
    "403": (0, 1),
    "409": (0, 1),
    "413": (0, 1),
    "422": (0, 1),
}
FOR_A_PERSON = {"403", "409", "413", "422"}
OF_ALL = ("401", "login", "429", "503 later", "read-only")
"""Faults that end the run: nothing else arrives either."""


# What decides whether a file has arrived is the revisions and their checksums.
DECIDING = {"no checksums", "no checksums, no sizes", "no revisions"}
UPLOADING = [names for names in MIXTURES if LONG or not names or DECIDING.intersection(names)]


@pytest.mark.parametrize("moods", UPLOADING, ids=lambda names: ", ".join(names) or "default")
def test_what_still_arrives_in_each_mood_of_a_silo(tmp_path: Path, moods: tuple[str, ...]) -> None:
    """Of each commit whose upload has a fault, and of the one after them; then everything, each once."""
    store, commits = Store(tmp_path / "outbox.sqlite3"), dict[str, Item]()
    with (
        real_silo(mixed(moods)) as silo,
        SiloClient(silo.url, TOKEN, retries=Retries(tries=1), timeout=60) as client,
    ):
        before = [""] if silo.moods.upload == "presigned" else []  # the form, which it does not take

        def commit(label: str) -> None:
            item = commits[label] = silo.make("A01", label, "assembly")
            path = tmp_path / f"{label}.FCStd"
            path.write_bytes(label.encode() * 100)
            head = BomEntry(str(path), silo_uuid=item.id, is_assembly=True)
            extraction = Extraction(head, (BomEntry("/v/Bolt.FCStd", silo_uuid=bolt.id),))
            store.add(Commit(str(path), 0.0, label, item.id, file=path, extraction=extraction), silo.url)

        def arrived() -> dict[str, tuple[int, int]]:
            return {label: (len(item.files), len(item.lines)) for label, item in commits.items()}

        bolt = silo.make("F01", "Bolt")
        commit("first")
        upload = f"POST /api/items/{commits['first'].part_number}/file"
        for fault in OF_ALL:
            silo.faults_of = {upload: [*before, fault]}
            report = send_all(store, client, force=True)
            assert (report.stopped_by is not None, arrived()) == (True, {"first": (0, 0)}), fault
        for label in (*UPLOADS, "last"):
            commit(label)
        silo.faults_of = {
            f"POST /api/items/{commits[fault].part_number}/file": [*before, fault] for fault in UPLOADS
        }
        send_all(store, client, force=True)
        assert arrived() == {"first": (1, 1), **UPLOADS, "last": (1, 1)}
        held = {entry.label: entry.id for entry in store.entries() if entry.state is State.HELD}
        assert set(held) == FOR_A_PERSON
        for number in held.values():
            store.retry(number)
        report = send_all(store, client, force=True)
        assert (report.held, report.failed, store.entries()) == ([], [], ())
        assert set(arrived().values()) == {(1, 1)}


@pytest.mark.parametrize(
    "fault", ["login", "429", "read-only", "drop before", "drop after", "cut", "500", "403"]
)
def test_a_merge_by_single_lines_that_breaks_off_is_ended_by_the_next_sending(
    tmp_path: Path, fault: str
) -> None:
    """At whichever of its requests: each line is there once, and what a person wrote stays."""
    store = Store(tmp_path / "outbox.sqlite3")
    with (
        real_silo(Moods(merge="missing")) as silo,
        SiloClient(silo.url, TOKEN, retries=Retries(tries=1), timeout=60) as client,
    ):
        children = [silo.make("F01", f"Bolt {number}") for number in range(4)]
        changed, manual, *_added = (child.part_number for child in children)
        kept = [
            {"child_part_number": changed, "quantity": 9, "source": "assembly"},
            {"child_part_number": manual, "quantity": 9, "source": "manual"},
        ]
        tops = [silo.make("A01", f"Top {number}", "assembly") for number in range(5)]
        requests = ("POST {}/merge", "GET {}", "POST {}", "POST {}", f"PUT {{}}/{changed}")
        silo.faults_of = {}
        for number, (top, request) in enumerate(zip(tops, requests, strict=True)):
            top.lines = [dict(line) for line in kept]
            lines = tuple(BomEntry(f"/v/{one.id}.FCStd", silo_uuid=one.id) for one in children)
            head = BomEntry("/v/Top.FCStd", silo_uuid=top.id, is_assembly=True)
            store.add(Commit("", 0.0, "Top", top.id, extraction=Extraction(head, lines)), silo.url)
            at = request.format(f"/api/items/{top.part_number}/bom")
            silo.faults_of[at] = ["", fault] if number == 3 else [fault]
        for _ in range(len(tops) + 1):
            send_all(store, client, force=True)
            for entry in store.entries():
                if entry.state is State.HELD:
                    store.retry(entry.id)
        assert (store.entries(), [left for left in silo.faults_of.values() if left]) == ((), [])
        expected = [(changed, 1), (manual, 9), *((child.part_number, 1) for child in children[2:])]
        for top in tops:
            assert [(one["child_part_number"], one["quantity"]) for one in top.lines] == expected


def test_each_mood_is_in_a_mixture() -> None:
    """Else nobody would see that it is tried no more."""
    assert {name for names in MIXTURES for name in names} == {*MOODS}


def test_a_clock_that_is_set_back_holds_nothing_up(tmp_path: Path, proxy: Proxy, client: SiloClient) -> None:
    """What was to be tried in ten minutes is not tried in ten years."""
    proxy.fault = None
    item = client.create_item("kindred-rd", "M01", "Plate")
    path = tmp_path / "Plate.FCStd"
    path.write_bytes(model_file(b"plate"))
    now = [2_000_000_000.0]
    store = Store(tmp_path / "outbox.sqlite3", clock=lambda: now[0])
    store.add(Commit(str(path), now[0], "Plate", item.id, file=path))
    proxy.fault, proxy.item = FAULTS["500"], item.part_number
    send_all(store, client)
    proxy.fault = None
    send_all(store, client)
    assert len(store.entries()) == 1  # its pause
    now[0] = 1_000_000_000.0
    send_all(store, client)
    assert (store.entries(), len(client.revisions(item.part_number))) == ((), 1)


# A child that is not root: root may write anywhere. Files may not grow over LIMIT bytes: a disk that is full.
# ``fcntl`` is imported while it may read the folder of its Python, which is root's own in some machines.
CHILD = """
import fcntl, os, resource, signal, sys
from pathlib import Path
from silo.bom.errors import SiloError
from silo.outbox.entry import Commit
from silo.outbox.store import Store
folder, limit = Path(sys.argv[1]), int(sys.argv[2])
if os.getuid() == 0:
    os.setuid(65534)
if limit:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
store = Store(folder / "data" / "outbox.sqlite3")
document = folder / "Plate.FCStd"
for hold in (True, False):
    commit = Commit(str(document), 1.0, "Plate", sys.argv[3], file=document)
    held = store.hold(str(document), commit.key) if hold else None
    try:
        store.stage(commit)
        store.finish(commit.key, document)
        print("kept")
    except SiloError as error:
        print("told:", error)
"""


@pytest.mark.parametrize("trouble", ["disk full", "folder read-only"])
@pytest.mark.usefixtures("needs_modes", "needs_limits")
def test_a_disk_that_takes_nothing_is_reported_and_loses_nothing(
    proxy: Proxy, client: SiloClient, trouble: str
) -> None:
    """What was said to be kept is sent once there is room; what was not, was said not to be."""
    proxy.fault = None
    item = client.create_item("kindred-rd", "M01", "Plate")
    folder = Path(tempfile.mkdtemp(prefix="silo-faults-"))
    try:
        document = folder / "Plate.FCStd"
        document.write_bytes(model_file(b"x" * 3_000_000))
        (folder / "data").mkdir()
        Store(folder / "data" / "outbox.sqlite3").entries()
        if os.getuid() == 0:
            for path in (folder, *folder.rglob("*")):
                os.chown(path, 65534, 65534)
        if trouble == "folder read-only":
            for path in (folder / "data").rglob("*"):
                path.chmod(0o500 if path.is_dir() else 0o400)
            (folder / "data").chmod(0o500)
        limit = "1000000" if trouble == "disk full" else "0"
        mods = str(Path(__file__).parents[2] / "mods")
        ended = subprocess.run(
            [sys.executable, "-c", CHILD, str(folder), limit, item.id],
            env={**os.environ, "PYTHONPATH": mods},
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        assert ended.returncode == 0, ended.stderr
        said = ended.stdout.splitlines()
        assert len(said) == 2
        for path in ((folder / "data"), *(folder / "data").rglob("*")):
            path.chmod(0o700)
        store = Store(folder / "data" / "outbox.sqlite3")
        waiting = store.entries()
        # With a second name it waits and says why; without, the person saw it at once.
        assert len(waiting) == said.count("kept")
        assert all(entry.reason for entry in waiting)
        assert "commit" in said[1]
        send_all(store, client, force=True)
        assert store.entries() == ()
        revisions = client.revisions(item.part_number)
        assert [r.file_size for r in revisions] == [document.stat().st_size] * len(waiting)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
