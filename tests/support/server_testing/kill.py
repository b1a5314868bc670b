# SPDX-License-Identifier: LGPL-2.1-or-later
"""``kill -9`` in the middle of merges: afterwards the BOM is the old or the new one, never between.

Two BOMs that differ in every line are merged in turn. In each round the server is killed at a random moment
around a merge; a new server over the same database must have one of the two, whole, with its history adding
up to it; and the client's retry, the same request with the same ``sync_id``, must give the right answer.
"""

from __future__ import annotations

import http.client
import random
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from server_testing.caller import Api, bom, merge_body
from server_testing.process import ServerProcess

TOKEN = "silo_kill"
LINES = 300


@dataclass(frozen=True, slots=True)
class KillReport:
    """Of so many kills: the BOM was old, the BOM was new, and the answer had already come."""

    kills: int
    old: int
    new: int
    answered: int


def kill_rounds(database_url: str, files_dir: Path, kills: int, seed: int) -> KillReport:
    """Do ``kills`` rounds; AssertionError where a BOM is between, or a retry's answer wrong."""
    chance = random.Random(seed)
    server = ServerProcess(database_url, files_dir, TOKEN)
    with Api(server.base_url, TOKEN) as api:
        children = api.items(LINES)
        parent = api.item("KILL-ASM")
        states = [{c: float(n % 5 + 1 + 10 * k) for n, c in enumerate(children)} for k in (0, 1)]
        api.merge(parent, states[0])
        started = time.perf_counter()
        api.merge(parent, states[1])
        usual = time.perf_counter() - started
        api.merge(parent, states[0])
    old = new = answered = 0
    for round_number in range(kills):
        before, after = states[round_number % 2], states[1 - round_number % 2]
        sync_id = f"round-{seed}-{round_number}"
        answered += _kill_during(server, parent, after, sync_id, chance.uniform(0, usual * 1.3))
        server = ServerProcess(database_url, files_dir, TOKEN)
        with Api(server.base_url, TOKEN) as api:
            found = api.quantities(parent)
            assert found in (before, after), f"round {round_number}: the BOM is between old and new"
            _check_history(api, parent)
            old, new = old + (found == before), new + (found == after)
            answer = api.merge(parent, after, sync_id=sync_id)
            changed = {c["part_number"]: c["new_quantity"] for c in answer["diff"]["quantity_changed"]}
            assert changed == after, f"round {round_number}: the retry's answer is wrong"
            assert api.quantities(parent) == after
    server.stop()
    return KillReport(kills, old, new, answered)


def _kill_during(
    server: ServerProcess, parent: str, after: Mapping[str, float], sync_id: str, delay: float
) -> bool:
    came = threading.Event()

    def merge() -> None:
        with Api(server.base_url, TOKEN) as api:
            try:
                api.good("POST", bom(parent, "merge"), merge_body(after, sync_id=sync_id))
            except (OSError, http.client.HTTPException):
                return
            came.set()

    thread = threading.Thread(target=merge)
    thread.start()
    time.sleep(delay)  # the moment of the kill is the random input here, not a synchronisation
    server.kill()
    thread.join()
    return came.is_set()


def _check_history(api: Api, parent: str) -> None:
    newest = api.get(bom(parent, "history") + "?limit=1")[0]["id"]
    past = api.get(bom(parent, f"history/{newest}/bom"))
    assert {line["child_part_number"]: line["quantity"] for line in past} == api.quantities(parent)
