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

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.bom.model import BomEntry, Extraction
from silo.outbox.entry import Commit, State
from silo.outbox.send import send_all
from silo.outbox.store import Store

NAMES = ("Bad", "One", "Two")


@pytest.fixture(name="proxy", scope="module")
def _proxy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxy]:
    run = pytest.importorskip("silo_server.run", reason="the embedded server needs the extra 'server'")
    folder = tmp_path_factory.mktemp("faults")
    with (
        run.running_server(f"sqlite:///{folder / 'silo.db'}", token="silo_faults") as server,
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
            path.write_bytes(f"{label} {number}".encode() * 1000)
            head = BomEntry(str(path), silo_uuid=item.id, is_assembly=True)
            lines = (BomEntry("/v/Bolt.FCStd", silo_uuid=bolt.id, quantity=number),)
            store.add(
                Commit(
                    str(path), float(number), label, item.id, file=path, extraction=Extraction(head, lines)
                )
            )
    proxy.fault, proxy.item = FAULTS[name], items["Bad"].part_number
    for _ in range(3):
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


def test_a_clock_that_is_set_back_holds_nothing_up(tmp_path: Path, proxy: Proxy, client: SiloClient) -> None:
    """What was to be tried in ten minutes is not tried in ten years."""
    proxy.fault = None
    item = client.create_item("kindred-rd", "M01", "Plate")
    path = tmp_path / "Plate.FCStd"
    path.write_bytes(b"plate")
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
CHILD = """
import os, resource, signal, sys
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
        document.write_bytes(b"x" * 3_000_000)
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
        assert [r.file_size for r in revisions] == [3_000_000] * len(waiting)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
