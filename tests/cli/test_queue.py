# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod queue``: what is not in Silo yet, in the words of the pane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from model_file import model_file

from silo.api.pause import Pause
from silo.outbox.entry import Commit, State
from silo.outbox.store import Store
from silo.workbench.pane.waiting import rows


@dataclass
class Queue:
    """Three commits: one waits, one is held, one is meant for another server."""

    store: Store
    url: str
    ids: list[int]


@pytest.fixture(name="queue")
def _queue(silo: Any, tmp_path: Path) -> Queue:
    store, url, ids = Store(), silo.client.base_url, []
    for name, server in (("One", url), ("Two", url), ("Three", "http://old.example:80")):
        item = silo.client.create_item("kindred-rd", "M01", name)
        path = tmp_path / f"{name}.FCStd"
        path.write_bytes(model_file(name.encode()))
        ids.append(store.add(Commit(str(path), 1000.0, name, item.id, file=path), server).id)
    store.update(ids[1], state=State.HELD, reason="413: [bold]too large")
    return Queue(store, url, ids)


def test_the_list_says_what_the_pane_says(run: Any, queue: Queue) -> None:
    """State and reason come from one table."""
    ran = run("queue", "--json")
    assert ran.code == 1
    told = ran.json()
    pane = {row.title: row for row in rows(queue.store.entries(), queue.url)}
    assert [(one["number"], one["label"]) for one in told["items"]] == [
        *zip(queue.ids, ("One", "Two", "Three"), strict=True)
    ]
    for one in told["items"]:
        row = pane[one["label"]]
        assert (one["what"], one["state"], one["reason"], one["needs_a_person"]) == (
            *(row.what, row.state, row.reason),
            row.urgent,
        )
    assert [one["state"] for one in told["items"]] == [
        *("waiting", "held for your choice", "for another server")
    ]
    assert "413: [bold]too large" in " ".join(run("queue").out.split())


@pytest.mark.parametrize(
    ("until", "said"),
    [(600.0, "for 10 min: silo is busy"), (math.inf, "before you retry: silo is busy")],
)
def test_a_pause_is_said_once_and_ends_with_retry(
    run: Any, silo: Any, queue: Queue, until: float, said: str
) -> None:
    """What is held stays held; what is meant for another server is not sent here."""
    now = queue.store.clock()
    queue.store.set_pause(queue.url, Pause(now + until, "silo is busy", "busy", 1, told=True))
    told = run("queue", "--json").json()
    assert told["pause"].endswith(said)
    assert told["items"][0]["state"] == "paused"
    ran = run("queue", "retry")
    assert (ran.code, "M01-0001 One is in Silo" in ran.err) == (1, True)
    assert [entry.label for entry in queue.store.entries()] == ["Two", "Three"]
    assert queue.store.pause(queue.url) is None
    assert run("queue", "retry", queue.ids[1]).code == 1
    assert run("queue", "retry", queue.ids[2], "--here").code == 0
    assert [r.file_name for r in silo.client.revisions("M01-0003") if r.file_name] == ["Three.FCStd"]
    assert "every commit of this computer is in Silo" in run("queue").out


def test_files_are_saved_and_commits_discarded(run: Any, queue: Queue, tmp_path: Path) -> None:
    """A discarded file is kept aside; nothing is done without a number."""
    assert run("queue", "save", queue.ids[0], "--into", tmp_path / "out").code == 1
    assert (tmp_path / "out" / f"{queue.ids[0]}-One.FCStd").read_bytes() == model_file(b"One")
    assert run("queue", "discard", queue.ids[0], queue.ids[1]).code == 1
    assert [entry.label for entry in queue.store.entries()] == ["Three"]
    kept = {path.read_bytes() for path in (queue.store.path.parent / "kept-aside").rglob("*.FCStd")}
    assert kept == {model_file(b"One"), model_file(b"Two")}
    for words, said in ((("discard",), "which commit?"), (("discard", 99), "no commit 99")):
        ran = run("queue", *words)
        assert (ran.code, said in ran.err) == (2, True)


def test_a_new_login_ends_the_pause_of_a_wrong_token(run: Any, silo: Any, queue: Queue) -> None:
    """The pane looks at the same pause."""
    queue.store.set_pause(queue.url, Pause(math.inf, "401", "unauthorized"))
    assert run("login", queue.url, "--token", silo.token).code == 0
    assert queue.store.pause(queue.url) is None
