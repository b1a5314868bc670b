# SPDX-License-Identifier: LGPL-2.1-or-later
"""A vault in a night: reading, the index, processes, requests, kills; all ratios in one run.

    python benchmarks/vault.py [--documents 2000 10000] [--kills 50]

Data: a generated vault, four parts in five, the rest assemblies in five levels that share parts and
sub-assemblies. A part is a body with 60 features, some 90 kB of XML: the median of real files.

null        unpack every Document.xml with zipfile, let expat parse it without a handler; one process
stages      what the first run does, one after the other: reading (each file once, to its facts), walking (the
            parts, then the assemblies with facts in place of the files), remembering (the index); what is
            left of the first run is planning
first       the plan of the whole vault with an empty index: all of the stages
second      the same again, nothing changed;  five: after five files were changed
dask        the plan on a LocalCluster of two workers; again, while a worker is killed
requests    what one sync of the vault asks of a server on loopback, first and second time
kills       assemblies are changed, and the sync is killed with SIGKILL at random moments, against a server;
            at the end all lines, versions, history, events and syncs against those of undisturbed syncs; and
            the file revisions, of which a sync makes none: two items have one beforehand

Times are processor times of the process and its workers, which other work on the machine disturbs least;
``wall`` is the clock's.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections import Counter
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "mods"), str(ROOT / "tests" / "support")]

from fcstd_writer import Doc, Raw, XLink, locals_  # noqa: E402

LEVELS = (0.6, 0.25, 0.1, 0.04, 0.01)

NULL = """
import json, os, sys, time, zipfile
from xml.parsers import expat
begin, size, count = time.process_time(), 0, 0
for folder, _, names in os.walk(sys.argv[1]):
    for name in names:
        with zipfile.ZipFile(os.path.join(folder, name)) as container:
            text = container.read("Document.xml")
        expat.ParserCreate().Parse(text, True)
        size, count = size + len(text), count + 1
print(json.dumps({"cpu": time.process_time() - begin, "bytes": size, "documents": count}))
"""

PLAN = """
import hashlib, json, os, resource, sys, time
sys.path.insert(0, sys.argv[5])
from pathlib import Path
from silo.files import documents_in
from silo.vault.index import Index
from silo.vault.plan import make_plan
from silo.vault.reading import pool_of
from silo.vault.reading import VaultReader
from silo.vault.reading import Question

def main():
    folder, index, jobs, dask = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4] or None
    wall, cpu = time.perf_counter(), time.process_time()
    tops = documents_in([folder])
    with Index(Path(index)) as memory, pool_of(jobs, dask) as pool:
        memory.expect(os.path.realpath(folder))
        reading = VaultReader(memory, pool)
        plan = make_plan(tops, reading)
        memory.save()
        reads, seconds = reading.reads, reading.seconds
        done = [time.perf_counter() - wall, time.process_time() - cpu]
        rows = hashlib.sha256()
        for layer in plan.layers:
            for node in layer:
                rows.update(repr(plan.extraction(node, reading)).encode())
    own = resource.getrusage(resource.RUSAGE_SELF)
    print(json.dumps({
        "wall": done[0], "cpu": done[1] + seconds, "parent": done[1],
        "reads": reads, "assemblies": len(plan.nodes), "errors": len(plan.errors),
        "rss_mb": own.ru_maxrss / 1024, "digest": rows.hexdigest(),
    }))

if __name__ == "__main__":
    main()
"""

STAGES = """
import json, sys, time
sys.path.insert(0, sys.argv[3])
from pathlib import Path
from silo.fcstd.library import facts_of
from silo.fcstd.library import Library
from silo.files import documents_in
from silo.vault.index import Index
from silo.vault.reading import Question, WalkSession

def read(session, question):
    library = Library(contents=session.contents, locator=session.locator)
    document = library.open(question.path)
    facts_of(document), document.linked()
    library.dissolve()

def main():
    spent = dict.fromkeys(("reading", "walking", "remembering"), 0.0)
    def stage(name):
        nonlocal begin
        now = time.process_time()
        spent[name] += now - begin
        begin = now
    index = Index(Path(sys.argv[2]))
    asked = [Question(path) for path in documents_in([sys.argv[1]])]
    begin, session = time.process_time(), WalkSession()
    for question in asked:
        read(session, question)
    stage("reading")
    session = WalkSession()
    firsts = [session.read(question) for question in asked]
    stage("walking")
    spent["walking"] -= spent["reading"]  # what is left are the answers of parts
    for question, first in zip(asked, firsts):
        index.remember_facts(first.path, first.facts)
        if first.known is not None:
            index.remember(question.path, question.name, first.known)
    index.save()
    stage("remembering")
    facts = {first.path: first.facts for first in firsts}
    left = [question for question, first in zip(asked, firsts) if first.known is None]
    walked = [session.ask(question, lambda path: facts.get(path, "")) for question in left]
    stage("walking")
    for question, known in zip(left, walked):
        index.remember(question.path, question.name, known)
    index.close()
    stage("remembering")
    print(json.dumps(spent))

if __name__ == "__main__":
    main()
"""


def uuid_of(kind: int, number: int) -> str:
    """An identity."""
    return f"00000000-0000-4000-{kind:04x}-{number:012d}"


def build(folder: Path, documents: int, features: int = 60, edition: int = 0) -> None:
    """Write the vault; of another edition the assemblies, of which one in five holds other quantities."""
    chance = random.Random(1)
    parts = documents * 4 // 5
    place = Raw("App::PropertyPlacement", '<PropertyPlacement Px="0.0000000000000000" Q3="1.0"/>')
    names = [f"Box{number}" for number in range(features)]
    for number in range(0 if edition else parts):
        doc = Doc(f"part{number}")
        for name in names:
            doc.add(
                "PartDesign::AdditiveBox", name, Length=10.0 + number, Width=3.0, Placement=place, Refine=True
            )
        doc.add("PartDesign::Body", "Body", Group=locals_(*names), SiloItemId=uuid_of(0x8000, number))
        doc.save(folder / f"parts/{number // 500:03d}/part{number:06d}.FCStd")
    below: list[str] = []
    count = 0
    for level, share in enumerate(LEVELS):
        here = []
        for _ in range(max(1, int((documents - parts) * share))):
            doc = Doc(f"asm{count}")
            used = [chance.randrange(parts) for _ in range(8)]
            links = [(f"../../parts/{n // 500:03d}/part{n:06d}.FCStd", "Body") for n in dict.fromkeys(used)]
            links += [(path, "Assembly") for path in chance.sample(below, min(4, len(below)))]
            changed = {"ElementCount": edition + 1} if edition and count % 5 == edition % 5 else {}
            for number, (path, name) in enumerate(links):
                doc.add("App::Link", f"L{number}", LinkedObject=XLink(path, name), **changed)
            members = locals_(*(f"L{number}" for number in range(len(links))))
            doc.add("Assembly::AssemblyObject", "Assembly", Group=members, SiloItemId=uuid_of(0x9000, count))
            name = f"{level}/asm{count:06d}.FCStd"
            doc.save(folder / "asm" / name)
            here.append(f"../{name}")
            count += 1
        below = here


def child(code: str, *words: object) -> dict[str, Any]:
    """One measurement in a fresh interpreter."""
    with tempfile.NamedTemporaryFile("w", suffix=".py") as file:
        file.write(code)
        file.flush()
        command = [sys.executable, file.name, *map(str, words)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    data: dict[str, Any] = json.loads(done.stdout)
    return data


def plan(folder: Path, index: Path, jobs: int = 1, dask: str = "") -> dict[str, Any]:
    """The plan of the vault."""
    return child(PLAN, folder, index, jobs, dask, ROOT / "mods")


def reading(folder: Path, scratch: Path, use_dask: bool) -> None:
    """Must shows 1 and 2."""
    null = child(NULL, folder)
    count = null["documents"]
    print(f"{count} documents, {null['bytes'] / count / 1000:.0f} kB of XML each; null {null['cpu']:.2f} s")
    stages = child(STAGES, folder, scratch / "stages", ROOT / "mods")
    first = plan(folder, scratch / "one")
    two = plan(folder, scratch / "two", 2)
    time.sleep(3)  # files that were written just now are compared by content
    settled = plan(folder, scratch / "one")
    second = plan(folder, scratch / "one")
    chosen = sorted(folder.rglob("*.FCStd"))[:: max(1, count // 5)][:5]
    for path in chosen:
        rename_a_feature(path)
    five = plan(folder, scratch / "one")
    runs = {"first": first, "jobs 2": two, "settled": settled, "second": second, "five": five}
    for name, run in runs.items():
        each = run["cpu"] / count * 1e6
        print(
            f"{name:8} cpu {run['cpu']:7.2f} s  wall {run['wall']:7.2f} s  {each:6.0f} µs each  "
            f"reads {run['reads']:6}  parent {run['parent']:.2f} s, {run['rss_mb']:.0f} MB"
        )
    stages["planning"] = first["cpu"] - sum(stages.values())
    for name, seconds in stages.items():
        print(f"{name:11} cpu {seconds:6.2f} s  {seconds / count * 1e6:4.0f} µs each")
    print(f"reading : null = {stages['reading'] / null['cpu']:.2f}")
    print(f"first : null = {first['cpu'] / null['cpu']:.2f}")
    print(f"first : second = {first['cpu'] / second['cpu']:.1f}")
    print(f"first : five = {first['cpu'] / five['cpu']:.1f}")
    same = first["digest"] == two["digest"] == second["digest"]
    print(f"jobs 1 : jobs 2 = {first['wall'] / two['wall']:.2f} by the clock; same answers: {same}")
    if use_dask:
        from dask.distributed import LocalCluster

        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            run = plan(folder, scratch / "dask", 1, cluster.scheduler_address)
            print(f"dask: wall {run['wall']:.2f} s, same answers: {run['digest'] == five['digest']}")
            victim = threading.Timer(run["wall"] / 3, lambda: os.kill(cluster.workers[0].pid, signal.SIGKILL))
            victim.start()
            run = plan(folder, scratch / "dask killed", 1, cluster.scheduler_address)
            print(f"dask, a worker killed: same answers: {run['digest'] == five['digest']}")


def rename_a_feature(path: Path) -> None:
    """A person works in a file and saves it."""
    with zipfile.ZipFile(path) as container:
        entries = {name: container.read(name) for name in container.namelist()}
    entries["Document.xml"] = entries["Document.xml"].replace(b'"Box1"/>', b'"Pad"/>')
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as container:
        for name, content in entries.items():
            container.writestr(name, content)


def serve(scratch: Path, documents: int) -> tuple[Any, Any]:
    """A server with an item for each document: two are created, the others are rows like them."""
    from silo.api.client import SiloClient
    from silo_server.run import running_server

    scratch.mkdir(parents=True)
    context = running_server(f"sqlite:///{scratch / 'silo.db'}", token="silo_" + "b" * 40)
    server = context.__enter__()
    parts = documents * 4 // 5
    assemblies = sum(max(1, int((documents - parts) * share)) for share in LEVELS)
    with SiloClient(server.base_url, server.token) as client:
        for kind, category, item_type in ((0x8000, "M01", "part"), (0x9000, "A01", "assembly")):
            item = client.create_item(
                "kindred-rd", category, "first", item_type=item_type, idempotency_key=uuid_of(kind, 0)
            )
            client.upload_file(item.part_number, Doc("first").save(scratch / "first.FCStd"))
    with closing(sqlite3.connect(scratch / "silo.db")) as database:
        for kind, category, count in ((0x8000, "M01", parts), (0x9000, "A01", assemblies)):
            begin = uuid_of(kind, 0)
            database.execute("CREATE TEMP TABLE one AS SELECT * FROM items WHERE uuid = ?", (begin,))
            for number in range(1, count):
                name = f"{category}-{number + 1:05}"
                database.execute(
                    "UPDATE one SET id = NULL, uuid = ?, name = ?, part_number = ?, part_number_key = ?",
                    (uuid_of(kind, number), f"{kind:x} {number}", name, name.lower()),
                )
                database.execute("INSERT INTO items SELECT * FROM one")
            database.execute("DROP TABLE one")
        database.commit()
    return context, server


def sync_command(folder: Path, index: Path, report: Path, jobs: int = 1) -> list[str]:
    """The job as a user starts it."""
    words = ["sync", folder, "--index", index, "--report", report, "--jobs", jobs]
    return [sys.executable, "-m", "silo.cli.main", *map(str, words)]


def environment(server: Any, home: Path) -> dict[str, str]:
    """Of the job: this server, and folders of its own."""
    return {
        **os.environ,
        "PYTHONPATH": str(ROOT / "mods"),
        "SILO_HOME": str(home),
        "SILO_API_URL": server.base_url,
        "SILO_API_TOKEN": server.token,
    }


def state(scratch: Path) -> dict[str, Any]:
    """All that the server's database has of BOMs: lines, versions, revisions, history, news."""
    questions = {
        "BOMs": """SELECT p.uuid, c.uuid, l.quantity, l.source FROM bom_lines l
            JOIN items p ON p.id = l.parent_id JOIN items c ON c.id = l.child_id""",
        "versions": "SELECT uuid, bom_version, current_revision, version FROM items",
        "revisions": """SELECT i.uuid, r.revision_number, count(*) FROM revisions r
            JOIN items i ON i.id = r.item_id GROUP BY 1, 2""",
        "history": """SELECT p.uuid, h.version, h.kind, c.uuid, l.action, l.before, l.after FROM bom_changes h
            JOIN items p ON p.id = h.parent_id LEFT JOIN bom_change_lines l ON l.change_id = h.id
            LEFT JOIN items c ON c.id = l.child_id""",
        "events": "SELECT name, item_uuid, count(*) FROM events GROUP BY 1, 2",
        "syncs": "SELECT subject, version, count(*) FROM answers GROUP BY 1, 2",
    }
    with closing(sqlite3.connect(scratch / "silo.db")) as database:
        return {name: sorted(map(repr, database.execute(text))) for name, text in questions.items()}


def counted(folder: Path, scratch: Path, env: dict[str, str]) -> Counter[str]:
    """One job, and what it asked of the server."""
    command = sync_command(folder, scratch / "calm.idx", scratch / "calm.json")[3:]
    run = subprocess.run(
        [sys.executable, "-c", COUNTED, *command], env=env, check=True, capture_output=True, text=True
    )
    return Counter(json.loads(run.stderr.splitlines()[-1]))


def requests(folder: Path, scratch: Path, documents: int) -> None:
    """Must show 3."""
    context, server = serve(scratch, documents)
    env = environment(server, scratch / "home")
    for name in ("first", "second"):
        asked = counted(folder, scratch, env)
        allowed = documents / 1000 + asked["merges"] + 10
        print(
            f"{name} sync of {documents} documents: {asked['merges']} merges, "
            f"{asked['questions']} questions; {asked.total()} requests, at most {allowed:.0f} wanted"
        )
    context.__exit__(None, None, None)


def kills(folder: Path, scratch: Path, documents: int, count: int, seed: int) -> None:
    """Must show 4: rounds of changes, each synced undisturbed, and to another server by killed jobs."""
    chance = random.Random(seed)
    calm, calm_server = serve(scratch / "calm", documents)
    wild, wild_server = serve(scratch / "wild", documents)
    calm_env = environment(calm_server, scratch / "calm-home")
    env = environment(wild_server, scratch / "wild-home")
    killed, edition, whole = 0, 0, 0.0
    codes = set()
    while killed < count:
        if edition:
            build(folder, documents, edition=edition)
        edition += 1
        begin = time.perf_counter()
        counted(folder, scratch, calm_env)
        whole = time.perf_counter() - begin
        for last in (False,) * 5 + (True,):
            command = sync_command(folder, scratch / "wild.idx", scratch / "wild.json", 2)
            process = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                # From 0.3 of an undisturbed run on: before that, Python has not begun.
                codes.add(process.wait(None if last else whole * chance.uniform(0.3, 1)))
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.wait()
                killed += 1
    calm.__exit__(None, None, None)
    wild.__exit__(None, None, None)
    wanted, found = state(scratch / "calm"), state(scratch / "wild")
    print(f"{killed} kills in {edition} rounds of changes; exit codes of the runs that ended: {codes}")
    for name in wanted:
        print(f"  {name}: {len(wanted[name])}, equal to those undisturbed: {found[name] == wanted[name]}")


COUNTED = """
import collections, json, sys
from silo.api import transport
count = collections.Counter()
inner = transport.Transport._attempt
def attempt(self, call):
    count["merges" if call.url.endswith("/merge") else "questions"] += 1
    return inner(self, call)
transport.Transport._attempt = attempt
from silo.cli.main import main
if __name__ == "__main__":
    code = main(sys.argv[1:])
    print(json.dumps(count), file=sys.stderr)
    sys.exit(code)
"""


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--documents", type=int, nargs="*", default=[2000, 10000])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--kill-documents", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    scratch, begin = Path(tempfile.mkdtemp(prefix="silo-vault-")), time.perf_counter()
    try:
        for documents in args.documents:
            folder, aside = scratch / f"vault{documents}", scratch / str(documents)
            aside.mkdir()
            build(folder, documents)
            reading(folder, aside, find_spec("distributed") is not None)
        if args.documents:
            requests(folder, aside / "server", documents)
        if args.kills:
            build(scratch / "small", args.kill_documents, features=5)
            kills(scratch / "small", scratch / "servers", args.kill_documents, args.kills, args.seed)
        print(f"all of it: {time.perf_counter() - begin:.0f} s by the clock")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


if __name__ == "__main__":
    main()
