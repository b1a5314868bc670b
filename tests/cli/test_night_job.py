# SPDX-License-Identifier: LGPL-2.1-or-later
"""A disturbed job over a folder: a busy server, a signal, a second job, files that were not fetched."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fault_proxy import Fault, Proxy, fault_proxy
from fcstd_writer import Doc, locals_, part

from silo.bom.errors import InputError
from silo.cli.progress import ProgressPrinter
from silo.fcstd import Library
from silo.vault.job import NAME, only_job


def busy(status: int, after: str) -> Fault:
    """A server that puts its client off."""
    body = b'{"error": "busy", "message": "later"}'
    return Fault(status, body, "application/json", headers={"Retry-After": after})


@pytest.fixture
def proxy(registered: Path, silo: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[Proxy]:
    """Between the job and the server, which knows the parts of the example."""
    with fault_proxy(os.environ["SILO_API_URL"]) as proxy:
        monkeypatch.setenv("SILO_API_URL", proxy.url)
        yield proxy


@pytest.mark.parametrize(("status", "path"), [(429, "/merge"), (503, "/api/items")])
def test_a_busy_server_is_waited_for(run: Any, proxy: Proxy, gearbox: Path, status: int, path: str) -> None:
    """As long as it says, also by several senders; then all is as if it had not been busy."""
    proxy.item, proxy.fault, proxy.left = path, busy(status, "1"), 2
    ran = run("sync", gearbox.parent)
    assert (ran.code, proxy.left) == (0, 0), ran.out + ran.err
    assert run("diff", gearbox.parent, "--check").code == 0


def test_a_job_that_is_stopped_while_it_waits_ends_at_once_and_the_next_one_continues(
    run: Any, proxy: Proxy, gearbox: Path, tmp_path: Path
) -> None:
    """SIGTERM, by which a service is stopped: the report is written, and says that the run did not end."""
    proxy.item, proxy.fault = "/merge", busy(503, "100")
    report = tmp_path / "night.json"
    command = [sys.executable, "-m", "silo.cli.main", "sync", gearbox.parent, "--report", report]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        try:
            assert proxy.met.wait(60)
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=30)
        finally:
            process.kill()
    assert process.returncode not in (0, -signal.SIGKILL)
    assert json.loads(report.read_text(encoding="utf-8"))["ended"] is False
    assert not (gearbox.parent / NAME).exists()
    proxy.fault = None
    assert run("sync", gearbox.parent).code == 0
    assert run("diff", gearbox.parent, "--check").code == 0


def test_a_long_run_says_how_far_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """After 5 seconds, then every 10, on standard error; while it waits for a person, nothing."""
    now = [0.0]
    progress = ProgressPrinter("sync", clock=lambda: now[0])
    for second in range(60):
        now[0] = float(second)
        progress.step = f"part {second}" if second < 40 else ""
        progress.report()
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.splitlines() == [f"silo-mod sync: part {n}, {n} s" for n in (5, 15, 25, 35)]


def test_a_git_lfs_pointer_is_named_with_what_fetches_it(
    run: Any, proxy: Proxy, gearbox: Path, tmp_path: Path
) -> None:
    """As a file of its own, and as a part that others use: neither counts as in order."""
    cover = gearbox.parent / "parts" / "Cover.FCStd"
    oid = "0" * 64
    cover.write_text(f"version https://git-lfs.github.com/spec/v1\noid sha256:{oid}\nsize 12345\n")
    report = tmp_path / "night.json"
    ran = run("sync", gearbox.parent, "--report", report)
    assert ran.code == 1
    assert "git lfs pull" in ran.out + ran.err
    rows = json.loads(report.read_text(encoding="utf-8"))
    assert rows["ended"] is True
    assert "git lfs pull" in json.dumps(rows)


# --- one job at a time ----------------------------------------------------------------------------------


def test_a_second_job_on_one_folder_says_who_holds_it(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also that of another user, with another cache. It changes nothing; the lock ends with the first job."""
    with only_job(str(gearbox.parent)) as doubt:
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "another user"))
        ran = run("sync", gearbox.parent)
        assert (ran.code, doubt) == (2, "")
        assert f"process {os.getpid()} of " in ran.err
    assert not (gearbox.parent / NAME).exists()
    assert run("sync", gearbox.parent).code == 1, "nothing is registered yet"


def test_what_a_killed_job_left_behind_holds_nothing(tmp_path: Path) -> None:
    """The lock is the system's, not the file."""
    code = (
        "import os, sys; from silo.vault.job import only_job\n"
        "with only_job(sys.argv[1]): os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", code, tmp_path], check=False).returncode == -signal.SIGKILL
    assert (tmp_path / NAME).exists()
    with only_job(str(tmp_path)) as doubt:
        assert doubt == ""
    assert not (tmp_path / NAME).exists()


@pytest.mark.usefixtures("needs_locks")
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems lock in another way")
def test_a_job_of_a_network_client_is_seen_on_the_server(tmp_path: Path) -> None:
    """Servers of NFS take their clients' locks as a process takes those of POSIX; both see each other."""
    path = tmp_path / NAME
    code = (
        "import fcntl, sys; file = open(sys.argv[1], 'a+')\n"
        "fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB); print('held', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", code, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        assert client.stdout.readline() == "held\n"
        with pytest.raises(InputError, match="is being synced by"), only_job(str(tmp_path)):
            pass
        client.communicate("")
    with only_job(str(tmp_path)):
        path.write_text("x")  # readers and writers of the file are not kept out
        assert subprocess.run(command, input="", text=True, capture_output=True).returncode == 1


def test_where_the_folder_takes_no_lock_the_report_says_what_that_means(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path
) -> None:
    """A folder that may not be written. Two jobs of one user still see each other."""
    (gearbox.parent / NAME).mkdir()
    report = tmp_path / "night.json"
    assert run("sync", gearbox.parent, "--report", report).code == 1, "nothing is registered yet"
    assert "of another user or machine is not noticed" in report.read_text(encoding="utf-8")
    with only_job(str(gearbox.parent)):
        assert run("sync", gearbox.parent).code == 2


@pytest.mark.usefixtures("needs_symlinks")
def test_a_lock_that_is_a_link_is_not_followed(tmp_path: Path) -> None:
    """Who may write into the vault must not choose which file of ours is emptied."""
    mine = tmp_path / "mine"
    mine.write_text("dear")
    vault = tmp_path / "vault"
    vault.mkdir()
    (vault / NAME).symlink_to(mine)
    with only_job(str(vault)) as doubt:
        assert "symbolic link" in doubt
    assert mine.read_text() == "dear"


# --- files that moved -----------------------------------------------------------------------------------


def moves(run: Any, folder: Path, *words: object) -> list[tuple[str, str]]:
    """What a sync reports as moved."""
    ran = run("sync", folder, "--json", *words)
    assert ran.code == 0, ran.out + ran.err
    return [(one["from"], one["to"]) for one in ran.json()["summary"]["moved"]]


@pytest.fixture
def parts(silo: Any, run: Any, tmp_path: Path) -> Path:
    """A vault with an assembly of two parts that was synced once."""
    folder = tmp_path / "vault"
    (folder / "p").mkdir(parents=True)
    for name in ("a", "b"):
        part(name, uuid=silo.client.create_item("kindred-rd", "M01", name).id).save(
            folder / f"p/{name}.FCStd"
        )
    item = silo.client.create_item("kindred-rd", "A01", "top", item_type="assembly")
    top(folder, item.id, "p/a.FCStd", "p/b.FCStd")
    assert moves(run, folder) == []
    return folder


def top(folder: Path, identity: str, *files: str) -> None:
    """The assembly, with links to these files."""
    doc = Doc("top", meta={"SiloUUID": identity})
    for number, file in enumerate(files):
        doc.link(f"L{number}", file, "Box")
    doc.add("Assembly::AssemblyObject", "Assembly", Group=locals_(*(f"L{n}" for n in range(len(files)))))
    doc.save(folder / "top.FCStd")


def test_a_renamed_file_is_reported_once_by_the_run_that_syncs(run: Any, parts: Path) -> None:
    """A dry run reports it, and takes it from nobody."""
    with Library() as library:
        identity = library.open(str(parts / "top.FCStd")).Meta["SiloUUID"]
    (parts / "p/a.FCStd").rename(parts / "c.FCStd")
    top(parts, identity, "c.FCStd", "p/b.FCStd")
    wanted = [("p/a.FCStd", "c.FCStd")]
    summary = run("sync", parts, "--json", "--dry-run").json()["summary"]
    assert (summary["moved"][0]["name"], summary["lines_changed"]) == ("c", 0), "it is the same part"
    assert moves(run, parts, "--dry-run") == wanted
    assert [moves(run, parts), moves(run, parts)] == [wanted, []]


def test_two_files_that_change_places_are_reported_as_moved(run: Any, parts: Path) -> None:
    """The old names are there, with other items behind them."""
    one, two = parts / "p/a.FCStd", parts / "p/b.FCStd"
    one.rename(parts / "x")
    two.rename(one)
    (parts / "x").rename(two)
    assert sorted(moves(run, parts)) == [("p/a.FCStd", "p/b.FCStd"), ("p/b.FCStd", "p/a.FCStd")]
    assert moves(run, parts) == []


def test_a_name_that_is_not_unicode_is_the_same_name_in_the_next_night(run: Any, parts: Path) -> None:
    name = os.fsdecode(b"top \xff.FCStd")
    try:
        (parts / "top.FCStd").rename(parts / name)
    except OSError:
        pytest.skip("names on this disk are Unicode")
    assert moves(run, parts) == [("top.FCStd", name)]
    assert moves(run, parts) == []


@pytest.mark.usefixtures("needs_symlinks")
def test_a_folder_that_is_named_twice_is_one_job(run: Any, parts: Path) -> None:
    """Also where one of the names is a link to it."""
    (parts.parent / "link").symlink_to(parts)
    ran = run("sync", parts, parts.parent / "link", f"{parts}/.", "--json")
    assert (ran.code, ran.json()["summary"]["files"]) == (0, 3), ran.err
