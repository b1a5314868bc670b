# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two computers, two servers that flap: is anything lost, doubled or out of sight, and does memory grow?

    python benchmarks/client_soak.py [--minutes 10] [--seed 1]

Each computer is a process with an outbox and a journal of its own. Both work in the same two folders, which
belong to our server and to the emulator of the real Silo: they save and commit, make parts and register
them, and send. A proxy before each server answers with errors, web pages, half an answer, or not at all, a
third of the time. Then the servers answer well again, and each computer brings what is left to its end, as a
person who presses Retry. Ends with an error where a commit that was promised is neither in Silo nor in an
outbox, a revision or an item is there twice, a file names no item, or the last third's memory is above the
first's by more than a quarter.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "outbox"))

from crash_driver import Life
from fault_proxy import FAULTS, Proxy, fault_proxy
from real_silo import TOKEN as THEIRS
from real_silo import Moods, real_silo
from server_testing import Databases, ServerProcess

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.fcstd import Library
from silo.outbox.entry import State
from silo.outbox.send import send_all

OURS = "silo_soak_0123456789abcdef"
ITEMS = {"Assembly1": "A01", "Assembly2": "A01", "Bolt": "F01", "Plate": "M01", "Shaft": "M01"}
SAMPLES = 36


def main() -> None:
    """Let both computers work, look at their memory, then count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--computer", nargs="*", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.computer:
        computer(Path(args.computer[0]), json.loads(args.computer[1]), args.minutes * 60, args.seed)
        return
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        databases = Databases(root)
        with (
            ServerProcess(databases.new("sqlite"), root / "files", OURS) as ours,
            real_silo(Moods()) as theirs,
            fault_proxy(ours.base_url) as first,
            fault_proxy(theirs.url) as second,
        ):
            projects = [
                (first.url, OURS, str(folder_for(root / "ours", ours.base_url, OURS))),
                (second.url, THEIRS, str(folder_for(root / "theirs", theirs.url, THEIRS))),
            ]
            bad, counts = soak(root, projects, (first, second), args.minutes, args.seed)
            for address, project in zip((ours.base_url, theirs.url), projects, strict=True):
                bad += check(root, address, project[1], Path(project[2]), counts)
        databases.close()
    print(dict(counts))
    if bad:
        sys.exit("\n".join(bad[:40]))


def folder_for(folder: Path, url: str, token: str) -> Path:
    """A project's folder, with items that exist."""
    for name in ("vault", "new"):
        (folder / name).mkdir(parents=True)
    with SiloClient(url, token) as client:
        made = {name: client.create_item("kindred-rd", category, name).id for name, category in ITEMS.items()}
    (folder / "items.json").write_text(json.dumps(made))
    return folder


def soak(
    root: Path, projects: list[Any], proxies: tuple[Proxy, ...], minutes: float, seed: int
) -> tuple[list[str], Counter[str]]:
    """What is wrong with the memory, and what the computers counted."""
    environ = {**os.environ, "HOME": str(root / "home")}
    command = [sys.executable, __file__, "--minutes", str(minutes), "--computer"]
    running = []
    for number in range(2):
        place = root / f"computer{number}"
        place.mkdir()
        arguments = [*command, str(place), json.dumps(projects), "--seed", str(seed + number)]
        running.append(subprocess.Popen(arguments, env=environ, stdout=subprocess.PIPE, text=True))
    ending = threading.Event()
    flapping = [threading.Thread(target=flap, args=(proxy, ending, seed)) for proxy in proxies]
    for thread in flapping:
        thread.start()
    memory: list[list[float]] = [[] for _ in running]
    time.sleep(minutes * 6)  # the caches of the first moments are no leak
    for _ in range(SAMPLES):
        time.sleep(minutes * 54 / SAMPLES)
        for sizes, one in zip(memory, running, strict=True):
            status = Path(f"/proc/{one.pid}/status").read_text()
            sizes.append(int(status.partition("VmRSS:")[2].split()[0]) / 1024)
    ending.set()
    for thread in flapping:
        thread.join()
    (root / "calm").touch()
    counts: Counter[str] = Counter()
    bad = []
    for number, one in enumerate(running):
        told = one.communicate()[0]
        if one.returncode:
            bad.append(f"computer {number} ended with {one.returncode}")
            continue
        counts.update(json.loads(told.splitlines()[-1]))
        third = SAMPLES // 3
        begun, ended = (statistics.median(part) for part in (memory[number][:third], memory[number][-third:]))
        print(f"computer {number}: memory {begun:.0f} MB in the first third, {ended:.0f} MB in the last")
        if ended > begun * 1.25:
            bad.append(f"the memory of computer {number} grows: {begun:.0f} MB to {ended:.0f} MB")
    return bad, counts


def flap(proxy: Proxy, ending: threading.Event, seed: int) -> None:
    """Spoil what passes, now and then, for a moment."""
    chance = random.Random(seed)
    names = sorted(FAULTS.keys() - {"wrong checksum"})  # that one reads JSON alone
    while not ending.wait(chance.uniform(0.1, 2.0)):
        proxy.fault = FAULTS[chance.choice(names)] if chance.random() < 0.35 else None
    proxy.fault = None


def computer(place: Path, projects: list[Any], seconds: float, seed: int) -> None:
    """Work for so long; then, when the servers are well, bring all to its end."""
    chance = random.Random(seed)
    lives = [Life(url, token, Path(folder), chance, place) for url, token, folder in projects]
    for life, (url, token, _) in zip(lives, projects, strict=True):
        life.client = SiloClient(url, token, timeout=(5, 3), retries=Retries(tries=1))
    counts: Counter[str] = Counter()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        life = chance.choice(lives)
        what = chance.choices(("commit", "send", "register"), (5, 4, 2))[0]
        getattr(life, what)()
        counts[what] += 1
    while not (place.parent / "calm").exists():
        time.sleep(0.2)
    for life, (url, token, _) in zip(lives, projects, strict=True):
        life.client = SiloClient(url, token, timeout=300)
        for path in sorted((life.folder / "new").glob("*.FCStd")):
            life.register(path)
    store = lives[0].store
    for _ in range(20):
        for entry in store.entries():
            if entry.state is State.HELD and not entry.superseded:
                counts["released by hand"] += 1
                store.retry(entry.id)
        for life in lives:
            send_all(store, life.client, force=True)
    counts["left"] = len(store.entries())
    (place / "left.json").write_text(json.dumps([entry.key for entry in store.entries()]))
    print(json.dumps(counts))


def check(root: Path, url: str, token: str, folder: Path, counts: Counter[str]) -> list[str]:
    """What is wrong with a project: each commit and each item is there once."""
    bad = []
    promised: dict[str, str] = {}
    for place in root.glob("computer*"):
        for line in (place / "acked.jsonl").read_text().splitlines():
            told = json.loads(line)
            if told.get("folder") == str(folder) and "key" in told:
                promised[told["key"]] = told["item"]
            counts["errors while it flapped"] += "trouble" in told
    left = {key for place in root.glob("computer*") for key in json.loads((place / "left.json").read_text())}
    with SiloClient(url, token, timeout=300) as client:
        items = json.loads((folder / "items.json").read_text())
        arrived: Counter[str] = Counter()
        for identity in items.values():
            item = client.get_item_by_uuid(identity)
            assert item is not None
            arrived.update(one.comment for one in client.revisions(item.part_number) if one.file_checksum)
        counts["commits"] += len(promised)
        bad += [f"{folder.name}: {key} is lost" for key in promised.keys() - arrived.keys() - left]
        bad += [f"{folder.name}: {key} is there {n} times" for key, n in arrived.items() if n > 1]
        names: Counter[str] = Counter()
        for start in range(0, 10**6, 50):
            page = client.search_items("", limit=50, offset=start)
            names.update(str(one.name or one.description) for one in page)
            if len(page) < 50:
                break
        for path in (folder / "new").glob("*.FCStd"):
            counts["parts"] += 1
            with Library() as library:
                identity = library.open(str(path)).Meta.get("SiloUUID", "")
            found = client.get_item_by_uuid(identity) if identity else None
            if found is None:
                bad.append(f"{folder.name}: {path.name} names no item ({identity or 'no identity'})")
            if names[path.stem] != 1:
                bad.append(f"{folder.name}: {path.stem} is there {names[path.stem]} times")
    return bad


if __name__ == "__main__":
    main()
