# SPDX-License-Identifier: LGPL-2.1-or-later
"""A program of its own: starts clients that commit, register and send, and kills each at a random moment.

    crash_driver.py URL TOKEN FOLDER ROUNDS SEED [damage]

Two clients share one outbox at any time, as two FreeCADs do. Each is forked from this process, which has
imported everything: most of a life is then spent in work that can be interrupted. At the end one more client,
which nobody kills, brings everything to its end. ``acked.jsonl`` has what a client was promised.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

from fcstd_writer import Doc
from model_file import model_file

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.bom.entry import BomEntry, Extraction
from silo.bom.items.proposal import propose
from silo.fcstd import stamp
from silo.outbox.entry import Commit, State, new_key
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.registering.items import register
from silo.registering.journal import Journal

CATEGORIES = {"A01": "Mechanical assembly", "M01": "Machined parts"}
LONGEST_LIFE_S = 0.3


class Life:
    """One client, from its start to its sudden end; ``place`` is where it keeps what is its own."""

    def __init__(
        self, url: str, token: str, folder: Path, chance: random.Random, place: Path | None = None
    ) -> None:
        self.folder, self.chance, self.place = folder, chance, place or folder
        self.items = json.loads((folder / "items.json").read_text())
        self.store = Store(self.place / "outbox.sqlite3")
        self.journal = Journal(self.place / "registrations")
        self.client = SiloClient(url, token, retries=Retries(tries=1))

    def live(self) -> None:
        while True:
            self.chance.choices((self.commit, self.send, self.register), (5, 5, 1))[0]()

    def commit(self) -> None:
        """Save as FreeCAD does (a new file, renamed), hold, stage, finish."""
        name = self.chance.choice(sorted(self.items))
        key = new_key()
        path = self.folder / "vault" / f"{name}.FCStd"
        new = path.with_name(f"{name}.{os.getpid()}.new")
        new.write_bytes(model_file(f"{key} ".encode() * self.chance.randint(1, 20_000)))
        new.replace(path)
        held = self.store.hold(str(path), key)
        if held is None or not held.read_bytes().startswith(model_file(key.encode())):
            return  # the other client has just saved this document
        extraction = None
        if name.startswith("Assembly"):
            line = BomEntry(
                "/v/Bolt.FCStd", silo_uuid=self.items["Bolt"], quantity=self.chance.randint(1, 10**6)
            )
            head = BomEntry(str(path), silo_uuid=self.items[name], is_assembly=True)
            extraction = Extraction(head, (line,))
        commit = Commit(
            str(path),
            time.time(),
            name,
            self.items[name],
            key=key,
            comment=key,
            file=held,
            extraction=extraction,
        )
        self.store.stage(commit, self.client.base_url)
        self.note({"item": name, "key": key, "bom": extraction is not None, "folder": str(self.folder)})
        self.store.finish(key)

    def send(self) -> None:
        send_all(self.store, self.client, force=True)

    def register(self, path: Path | None = None) -> None:
        """A new part, or one that an earlier client left."""
        place = self.folder / "new"
        left = sorted(place.glob("*.FCStd"))
        if path is None and left and self.chance.random() < 0.5:
            path = self.chance.choice(left)
        if path is None:
            path = place / f"N{new_key()[:8]}.FCStd"
            Doc(path.stem).add("PartDesign::Body", "Body").save(path.with_suffix(".new"))
            path.with_suffix(".new").replace(path)
        entry = BomEntry(str(path), object_name="Body", document_label=path.stem)
        result = register(
            propose(entry, CATEGORIES),
            self.client,
            self.journal,
            lambda _entry, identity: stamp(str(path), identity) and None,
        )
        if result.error is not None:
            self.note({"trouble": f"{path.name}: {result.error}"})

    def note(self, data: dict[str, object]) -> None:
        with (self.place / "acked.jsonl").open("a") as file:
            file.write(json.dumps(data) + "\n")


def born(url: str, token: str, folder: Path, seed: int) -> int:
    """Fork a client; its process id."""
    pid = os.fork()
    if pid == 0:
        try:
            Life(url, token, folder, random.Random(seed)).live()
        except BaseException as error:  # noqa: BLE001  # the test has to hear of it
            with (folder / "acked.jsonl").open("a") as file:
                file.write(json.dumps({"trouble": repr(error)}) + "\n")
        finally:
            os._exit(1)
    return pid


def harm(folder: Path, chance: random.Random) -> None:
    """Lose the database of the outbox between two lives, in any way."""
    files = [*folder.glob("outbox.sqlite3*")]
    match chance.randrange(4):
        case 0:
            for file in files:
                file.unlink()
        case 1:
            for file in files:
                file.write_bytes(b"")
        case 2:
            (folder / "outbox.sqlite3").write_bytes(b"no database " * 1000)
        case _:
            with (folder / "outbox.sqlite3").open("r+b") as file:
                file.seek(4096)
                file.write(chance.randbytes(8192))


def main() -> None:
    url, token, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    rounds, seed = int(sys.argv[4]), int(sys.argv[5])
    chance = random.Random(seed)
    kills = 0
    while kills < rounds:
        pids = [born(url, token, folder, chance.randrange(2**32)) for _ in range(2)]
        for pid in pids:
            time.sleep(chance.uniform(0.0, LONGEST_LIFE_S))
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            kills += 1
        if "damage" in sys.argv and chance.random() < 0.5:
            harm(folder, chance)
    last = Life(url, token, folder, chance)
    for path in sorted((folder / "new").glob("*.FCStd")):
        last.register(path)
    while any(entry.state is not State.HELD for entry in last.store.entries()):
        report = send_all(last.store, last.client, force=True)
        if report.stopped_by is not None:
            raise report.stopped_by
    print(json.dumps({"left": [[e.label, e.reason] for e in last.store.entries()], "kills": kills}))


if __name__ == "__main__":
    main()
