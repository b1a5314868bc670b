# SPDX-License-Identifier: LGPL-2.1-or-later
"""kill -9 at random moments of commits, registrations and sends: 0 lost, 0 doubled, 0 unseen."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from hunting import LONG
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo.fcstd import Library

pytestmark = pytest.mark.usefixtures("needs_signals")

ITEMS = {"Assembly1": "A01", "Assembly2": "A01", "Bolt": "F01", "Plate": "M01", "Shaft": "M01"}


MINUTES = (pytest.mark.slow, pytest.mark.skipif(not LONG, reason="two minutes; SILO_LONG=1 runs it"))


@pytest.mark.parametrize(
    ("rounds", "seed", "more"),
    [
        (10, 1, ()),
        (10, 3, ("damage",)),
        pytest.param(200, 2, (), marks=MINUTES),
        pytest.param(200, 4, ("damage",), marks=MINUTES),
    ],
    ids=["sample", "sample, with damage", "200 kills", "200 kills, with damage to the database between"],
)
def test_every_commit_is_in_silo_once(tmp_path: Path, rounds: int, seed: int, more: tuple[str, ...]) -> None:
    """And every new part has one item, which its file names."""
    run = pytest.importorskip("silo_server.run", reason="the embedded server needs the extra 'server'")
    for name in ("vault", "new"):
        (tmp_path / name).mkdir()
    with (
        run.running_server(sqlite_database(tmp_path / "silo.db"), token="silo_crash") as server,
        SiloClient(server.base_url, server.token) as client,
    ):
        made = {
            name: client.create_item(
                "kindred-rd", category, name, item_type="assembly" if category == "A01" else "part"
            )
            for name, category in ITEMS.items()
        }
        ids = {name: item.id for name, item in made.items()}
        (tmp_path / "items.json").write_text(json.dumps(ids))
        driver = Path(__file__).with_name("crash_driver.py")
        arguments = [server.base_url, "silo_crash", str(tmp_path), str(rounds), str(seed), *more]
        mods, support = (str(Path(__file__).parents[2] / name) for name in ("mods", "tests/support"))
        ended = subprocess.run(
            [sys.executable, str(driver), *arguments],
            env={**os.environ, "PYTHONPATH": os.pathsep.join((mods, support))},
            capture_output=True,
            text=True,
            check=False,
            timeout=600,
        )
        assert ended.returncode == 0, ended.stderr
        told = json.loads(ended.stdout.splitlines()[-1])
        acked = [json.loads(line) for line in (tmp_path / "acked.jsonl").read_text().splitlines()]
        # A database that is lost under a running program is reported once, and nothing is promised then.
        allowed = "OutboxError" if more else "none"
        trouble = [line["trouble"] for line in acked if "trouble" in line]
        assert [one for one in trouble if not one.startswith(allowed)] == []
        assert told == {"left": [], "kills": rounds}
        commits = [line for line in acked if "key" in line]
        for name, item in made.items():
            wanted = [line["key"] for line in commits if line["item"] == name]
            arrived = [
                r.comment
                for r in sorted(client.revisions(item.part_number), key=lambda r: r.revision_number)
                if r.file_name
            ]
            # One whose promise was cut off may have arrived too, but no revision is there twice.
            assert not Counter(wanted) - Counter(arrived), name
            assert max(Counter(arrived).values(), default=1) == 1, name
        merged = merges(client)
        wanted_boms = {line["key"] for line in commits if line["bom"]}
        assert wanted_boms <= set(merged)
        assert max(merged.values(), default=1) == 1
        assert list((tmp_path / "outbox-files").iterdir()) == []
        by_name = Counter(item.name for item in client.search_items("", limit=1000))
        for path in (tmp_path / "new").glob("*.FCStd"):
            assert by_name[path.stem] == 1, path.stem
            with Library() as library:
                identity = library.open(str(path)).Meta["SiloUUID"]
            found = client.get_item_by_uuid(identity)
            assert found is not None
            assert found.name == path.stem


def merges(client: SiloClient) -> Counter[str]:
    """How often each merge happened, by the server's own log."""
    found: Counter[str] = Counter()
    client.create_item("kindred-rd", "M01", "The end of the log")
    for event in client.events("0"):
        if event.merge is not None:
            found[str(event.merge.sync_id)] += 1
        if event.type == "item.created" and (event.data or {}).get("name") == "The end of the log":
            break
    return found
