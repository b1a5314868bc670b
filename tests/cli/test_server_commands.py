# SPDX-License-Identifier: LGPL-2.1-or-later
"""register, diff, sync and watch: what machines read, what goes wrong, where the server is named."""

from __future__ import annotations

import json
import os
import shutil
import threading
import zipfile
from pathlib import Path
from typing import Any

import pytest
from real_silo import TOKEN, Moods, real_silo

from silo.api.config import config_path

NOWHERE = "http://127.0.0.1:9"


def test_register_reports_to_programs_what_became_of_each(run: Any, silo: Any, gearbox: Path) -> None:
    """Parts before assemblies, the top last; each with number, identity, type and category."""
    ran = run("register", gearbox, "--yes", "--json")
    assert ran.code == 0
    told = ran.json()
    assert set(told) == {"registered", "failed", "unregistered", "modelled"}
    assert (told["failed"], told["unregistered"]) == ([], [])
    assert [row["object"] for row in told["registered"][-2:]] == ["Gearbox", "TopAssembly"]
    for row in told["registered"]:
        item = silo.client.get_item(row["part_number"])
        assert (item.id, item.item_type, item["name"]) == (row["silo_uuid"], row["item_type"], row["name"])
        with zipfile.ZipFile(gearbox.parent / row["doc_path"]) as archive:
            assert row["silo_uuid"] in archive.read("Document.xml").decode()
        # Not even the first one on a new server: it says beforehand that it takes our ids.
        assert "registration_id" not in silo.client.get_properties(row["part_number"])
    bom = run("bom", gearbox, "--resolve", "--json").json()
    assert {entry["part_number"] for entry in bom["entries"]} <= {
        r["part_number"] for r in told["registered"]
    }
    assert all(entry["part_number"] for entry in bom["entries"])


def test_what_cannot_be_stamped_does_not_stop_the_rest(run: Any, silo: Any, gearbox: Path) -> None:
    """A part file that vanished after it was read: told, exit code 1, the others are registered."""
    parts = gearbox.parent / "parts"
    cover = parts / "Cover.FCStd"
    with zipfile.ZipFile(cover) as archive:
        kept = {name: archive.read(name) for name in archive.namelist() if name != "Document.xml"}
        xml = archive.read("Document.xml").replace(b"<Document ", b"<!DOCTYPE x><Document ", 1)
    with zipfile.ZipFile(cover, "w") as archive:
        archive.writestr("Document.xml", xml)
        for name, content in kept.items():
            archive.writestr(name, content)
    told = run("register", gearbox, "--yes", "--json")
    assert {row["object"] for row in told.json()["registered"]} >= {"BasePlate", "Gear", "TopAssembly"}
    assert "Cover" not in {row["object"] for row in told.json()["registered"]}
    synced = run("sync", gearbox, "--json")
    assert synced.code == 1
    assert synced.json()["results"][0]["assemblies"][0]["status"] == "blocked"


@pytest.mark.usefixtures("registered")
def test_diff_recursive_compares_each_assembly_with_its_own_lines(run: Any, silo: Any, gearbox: Path) -> None:
    """Children first; drift in a sub-assembly is drift."""
    run("sync", gearbox, "--json")  # the top only
    assert run("diff", gearbox, "--check").code == 0
    ran = run("diff", gearbox, "--recursive", "--check", "--json")
    assert ran.code == 1
    below, top = ran.json()["assemblies"]
    assert (below["object"], len(below["diff"]["added"])) == ("Gearbox", 3)
    assert top["diff"]["added"] == []
    run("sync", gearbox, "--recursive")
    assert run("diff", gearbox, "--recursive", "--check").code == 0


@pytest.mark.usefixtures("registered")
def test_files_given_twice_and_copied_are_synced_once_or_reported(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path
) -> None:
    """The same file twice is one; a copy has the same identity and changes nothing."""
    results = run("sync", gearbox, gearbox, "--recursive", "--json").json()["results"]
    assert len(results) == 1
    shutil.copytree(gearbox.parent, tmp_path / "copy")
    again = run("sync", tmp_path / "copy" / gearbox.name, "--recursive", "--json").json()["results"][0]
    assert {one["status"] for one in again["assemblies"]} == {"unchanged"}


def test_a_server_that_is_not_there_or_lets_nobody_in_is_reported(run: Any, silo: Any, gearbox: Path) -> None:
    """Also where no component has an identity yet, so that there is nothing to look up: a refused token does
    not read as components without a number.
    """
    for words in (["diff"], ["sync"], ["register", "--yes"], ["bom", "--resolve"]):
        for option, value, said in (("--server", NOWHERE, "silo-mod serve"), ("--token", "wrong", "token")):
            ran = run(words[0], gearbox, *words[1:], option, value)
            assert (ran.code, said in ran.err) == (3, True)


def test_the_configuration_file_names_the_server(
    run: Any, silo: Any, gearbox: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where neither options nor the environment do; its token goes to its server only."""
    url, token = os.environ["SILO_API_URL"], os.environ["SILO_API_TOKEN"]
    monkeypatch.delenv("SILO_API_URL")
    monkeypatch.delenv("SILO_API_TOKEN")
    assert run("diff", gearbox).code == 2
    file = config_path()
    file.parent.mkdir(parents=True)
    file.write_text(f'[server]\nurl = "{url}"\ntoken = "{token}"\n')
    file.chmod(0o600)
    assert run("bom", gearbox, "--resolve").code == 0
    file.write_text("[server\n")
    ran = run("diff", gearbox)
    assert ran.code == 2
    assert str(file) in ran.err


@pytest.mark.usefixtures("registered")
def test_watch_prints_events_as_lines_of_json(run: Any, silo: Any, gearbox: Path) -> None:
    """``--count`` ends it; what happened just before is not repeated, a merge is announced as it happens."""
    synced = threading.Event()

    def later() -> None:
        # Merge again and again (another quantity each time) until the listener has heard of one.
        line, quantity = silo.client.get_bom(top)[0], 100
        while not synced.wait(0.2):
            quantity += 1
            silo.client.update_bom_line(top, line.child_part_number, quantity=quantity)

    top = run("sync", gearbox, "--json").json()["results"][0]["assemblies"][0]["part_number"]
    worker = threading.Thread(target=later)
    worker.start()
    try:
        ran = run("watch", "--json", "--count", 1)
    finally:
        synced.set()
        worker.join()
    assert ran.code == 0
    [line] = ran.out.splitlines()
    assert set(json.loads(line)) == {"id", "type", "event", "data"}


@pytest.mark.parametrize("mode", ["normal", "read-only", "degraded"])
def test_watch_shows_the_mode_of_the_server(run: Any, monkeypatch: pytest.MonkeyPatch, mode: str) -> None:
    """A person who waits for a merge sees why none comes."""
    with real_silo(Moods(mode=mode)) as server:
        monkeypatch.setenv("SILO_API_URL", server.url)
        monkeypatch.setenv("SILO_API_TOKEN", TOKEN)
        server.announce("revision.created", {"part_number": "A01-0001"})
        ran = run("watch", "--count", 1)
    assert (ran.code, "A01-0001" in ran.out) == (0, True)
    assert f": {mode}]" in ran.err
