# SPDX-License-Identifier: LGPL-2.1-or-later
"""Twenty clients merge and edit one BOM at once: no lost update, no fault, the history adds up."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from server_testing import Api, ServerProcess, bom, merge_body

CLIENTS = 20


class Crowd:
    """What the clients share: the BOM, and every status they got."""

    def __init__(self, api: Api) -> None:
        self.api = api
        self.parent = api.item()
        self.shared = api.item()
        self.own = api.items(CLIENTS)
        self.statuses: list[int] = []

    def call(self, api: Api, method: str, path: str, value: object, **more: object) -> int:
        """One change, sent again when a slow machine is too busy for it; its status is kept."""
        while True:
            answer = api.call(method, path, value, **more)  # type: ignore[arg-type]
            if answer.status != 503:
                self.statuses.append(answer.status)
                return answer.status
            assert answer.headers["retry-after"]  # nothing was done

    def add_own(self, api: Api, number: int) -> None:
        """Each client adds one line of its own by hand."""
        self.call(api, "POST", bom(self.parent), {"child_part_number": self.own[number], "quantity": 1})

    def count_up(self, api: Api, number: int) -> None:
        """Read, add one, write with ``If-Match``, again where somebody was quicker; every third client."""
        while number % 3 == 0:
            read = api.call("GET", bom(self.parent))
            lines = {line["child_part_number"]: line for line in read.json()}
            change = {"quantity": lines[self.shared]["quantity"] + 1}
            headers = {"If-Match": read.headers["etag"]}
            if self.call(api, "PUT", bom(self.parent, self.shared), change, headers=headers) == 200:
                return

    def merge(self, api: Api, number: int) -> None:
        """Merge some of the assembly's parts; twice, as a client that lost the answer does."""
        body = merge_body(dict.fromkeys(self.parts[number % 7 :], number + 1), sync_id=f"client-{number}")
        self.call(api, "POST", bom(self.parent, "merge"), body)
        self.call(api, "POST", bom(self.parent, "merge"), body)

    parts: list[str] = []


@pytest.mark.slow
def test_many_clients_on_one_bom(url: str, tmp_path: Path) -> None:
    """Every edit is there at the end, every quantity was somebody's, versions have no gap."""
    workers = 2 if url.startswith("postgres") else 1
    with (
        ServerProcess(url, tmp_path, "silo_crowd_0123456789abcdef", workers=workers) as server,
        Api(server.base_url, "silo_crowd_0123456789abcdef") as api,
    ):
        crowd = Crowd(api)
        crowd.parts = api.items(10)
        api.good("POST", bom(crowd.parent), {"child_part_number": crowd.shared, "quantity": 1})
        run_together([crowd.add_own, crowd.merge, crowd.count_up], api)

        assert {status for status in crowd.statuses if status >= 500} == set()
        lines = api.lines(crowd.parent)
        assert lines[crowd.shared]["quantity"] == 1 + len(range(0, CLIENTS, 3))
        assert set(crowd.own) <= lines.keys()
        assert {lines[part]["source"] for part in crowd.parts if part in lines} == {"assembly"}
        check_history(api, crowd.parent)


def run_together(actions: list[Callable[[Api, int], None]], api: Api) -> None:
    """All clients at once, each doing all actions, in another order."""
    failures: list[BaseException] = []
    gate = threading.Barrier(CLIENTS)

    def client(number: int) -> None:
        mine = api.as_(api.token)
        try:
            gate.wait(60)
            for n in range(len(actions)):
                actions[(n + number) % len(actions)](mine, number)
        except Exception as error:  # noqa: BLE001  whatever it was, the test is to tell it
            failures.append(error)

    threads = [threading.Thread(target=client, args=(number,)) for number in range(CLIENTS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert failures == []


def check_history(api: Api, parent: str) -> None:
    """Versions count up one by one, and the changes fold to the BOM."""
    changes: list[dict[str, int]] = []
    before = ""
    while page := api.get(bom(parent, "history") + f"?limit=100{before}"):
        changes.extend(page)
        before = f"&before={page[-1]['id']}"
    versions = [change["version"] for change in reversed(changes) if change["line_count"]]
    assert versions == list(range(1, len(versions) + 1))
    merges = [change for change in changes if change["kind"] == "merge"]
    assert len(merges) == CLIENTS  # each sync_id counted once
    past = api.get(bom(parent, f"history/{changes[0]['id']}/bom"))
    assert {line["child_part_number"]: line["quantity"] for line in past} == api.quantities(parent)
