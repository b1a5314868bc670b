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
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from server_testing.caller import Api, bom, merge_body
from server_testing.process import ServerProcess

TOKEN = "silo_kill_0123456789abcdef"
LINES = 300


@dataclass(frozen=True, slots=True)
class KillReport:
    """Of so many kills: the BOM was old, the BOM was new, and the answer had already come."""

    kills: int
    old: int
    new: int
    answered: int


class Moments:
    """Random moments to kill at, most of them around the commit.

    The commit is found by trying: a kill before it makes the next moments later, one after it makes them
    earlier. One moment in four is anywhere between the beginning and there.
    """

    def __init__(self, seed: int, first: float) -> None:
        self._chance = random.Random(seed)
        self._commit = first

    def next(self) -> float:
        """Seconds after the work begins."""
        if self._chance.random() < 0.25:
            return self._chance.uniform(0, self._commit)
        return self._commit * self._chance.uniform(0.6, 1.4)

    def was(self, *, done: bool) -> None:
        """What the kill at the last moment found."""
        self._commit *= 0.93 if done else 1.07


def killed(server: ServerProcess, token: str, work: Callable[[Api], object], after: float) -> bool:
    """Kill the server so many seconds after ``work`` begins; True where its answer had come."""
    came = threading.Event()

    def run() -> None:
        with Api(server.base_url, token) as api, suppress(OSError, http.client.HTTPException):
            work(api)
            came.set()

    thread = threading.Thread(target=run)
    thread.start()
    time.sleep(after)  # the moment of the kill is the random input here, not a synchronisation
    server.kill()
    thread.join()
    return came.is_set()


def kill_rounds(database_url: str, files_dir: Path, kills: int, seed: int) -> KillReport:
    """Do ``kills`` rounds; AssertionError where a BOM is between, or a retry's answer wrong."""
    server = ServerProcess.forked(database_url, files_dir, TOKEN)
    with Api(server.base_url, TOKEN) as api:
        children = api.items(LINES)
        parent = api.item("KILL-ASM")
        states = [{c: float(n % 5 + 1 + 10 * k) for n, c in enumerate(children)} for k in (0, 1)]
        api.merge(parent, states[0])
        started = time.perf_counter()
        api.merge(parent, states[1])
        moments = Moments(seed, time.perf_counter() - started)
        api.merge(parent, states[0])
    old = new = answered = 0
    for number in range(kills):
        before, after = states[number % 2], states[1 - number % 2]
        body = merge_body(after, sync_id=f"round-{seed}-{number}")
        came = killed(
            server, TOKEN, lambda api, sent=body: api.good("POST", bom(parent, "merge"), sent), moments.next()
        )
        server = ServerProcess.forked(database_url, files_dir, TOKEN)
        with Api(server.base_url, TOKEN) as api:
            found = api.quantities(parent)
            assert found in (before, after), f"round {number}: the BOM is between old and new"
            assert found == after or not came, f"round {number}: an answer was given for what is not there"
            moments.was(done=found == after)
            _check_history(api, parent)
            old, new, answered = old + (found == before), new + (found == after), answered + came
            answer = api.good("POST", bom(parent, "merge"), body)
            changed = {c["part_number"]: c["new_quantity"] for c in answer["diff"]["quantity_changed"]}
            assert changed == after, f"round {number}: the retry's answer is wrong"
            assert api.quantities(parent) == after
    server.stop()
    return KillReport(kills, old, new, answered)


def _check_history(api: Api, parent: str) -> None:
    newest = api.get(bom(parent, "history") + "?limit=1")[0]["id"]
    past = api.get(bom(parent, f"history/{newest}/bom"))
    assert {line["child_part_number"]: line["quantity"] for line in past} == api.quantities(parent)
