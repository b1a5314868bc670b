# SPDX-License-Identifier: LGPL-2.1-or-later
"""A conflict reaches the server although no line is written for it, and is quiet once a person decided."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import requests

from silo.cli.demo import remove_from_assembly, set_element_count


@pytest.fixture
def top(run: Any, silo: Any, gearbox: Path) -> str:
    """The part number of the synced top assembly."""
    run("register", gearbox, "--yes")
    return str(run("sync", gearbox, "--json").json()["results"][0]["assemblies"][0]["part_number"])


def status(run: Any, gearbox: Path) -> str:
    return str(run("sync", gearbox, "--json").json()["results"][0]["assemblies"][0]["status"])


def ask(silo: Any, method: str, path: str, body: Any = None) -> Any:
    answer = requests.request(
        method,
        silo.client.base_url + path,
        json=body,
        headers={"Authorization": f"Bearer {silo.token}"},
        timeout=120,
    )
    answer.raise_for_status()
    return answer.json()


def bolt_of(silo: Any, top: str) -> str:
    return next(line.child_part_number for line in silo.client.get_bom(top) if line.quantity == 12)


def test_a_conflict_alone_is_reported_once(run: Any, silo: Any, gearbox: Path, top: str) -> None:
    """A person sets 14, CAD says 12: the server learns of it, and the same again sends nothing."""
    bolt = bolt_of(silo, top)
    silo.client.update_bom_line(top, bolt, quantity=14)
    assert status(run, gearbox) == "merged"
    [conflict] = ask(silo, "GET", f"/api/items/{top}/bom/review")["conflicts"]
    assert (conflict["assembly_quantity"], conflict["server_quantity"]) == (12, 14)
    assert status(run, gearbox) == "unchanged"


def test_what_a_person_kept_stays_quiet_until_cad_says_something_else(
    run: Any, silo: Any, gearbox: Path, top: str
) -> None:
    """Keep 14: no more questions; four more bolts in CAD: asked again."""
    bolt = bolt_of(silo, top)
    silo.client.update_bom_line(top, bolt, quantity=14)
    status(run, gearbox)
    decision = {"decisions": [{"child_part_number": bolt, "action": "keep_silo"}]}
    ask(silo, "POST", f"/api/items/{top}/bom/resolve", decision)
    assert status(run, gearbox) == "unchanged"
    set_element_count(gearbox, "CoverBolts", added=4)
    assert status(run, gearbox) == "merged"
    [conflict] = ask(silo, "GET", f"/api/items/{top}/bom/review")["conflicts"]
    assert conflict["assembly_quantity"] == 16


def test_a_conflict_that_cad_settles_is_over(run: Any, silo: Any, gearbox: Path, top: str) -> None:
    """CAD comes to the person's number: the server hears of it, and asks no more."""
    bolt = bolt_of(silo, top)
    silo.client.update_bom_line(top, bolt, quantity=14)
    status(run, gearbox)
    set_element_count(gearbox, "CoverBolts", added=2)
    assert status(run, gearbox) == "merged"
    assert ask(silo, "GET", f"/api/items/{top}/bom/review")["conflicts"] == []
    assert status(run, gearbox) == "unchanged"


def test_an_override_whose_component_goes_is_reported(run: Any, silo: Any, gearbox: Path, top: str) -> None:
    """A person set a quantity, then CAD drops the part: that is a question too, asked once."""
    lines = {line.child_name or line.child_description: line for line in silo.client.get_bom(top)}
    silo.client.update_bom_line(top, lines["Cover"].child_part_number, quantity=3)
    status(run, gearbox)
    remove_from_assembly(gearbox, "Cover")
    assert status(run, gearbox) == "merged"
    [conflict] = ask(silo, "GET", f"/api/items/{top}/bom/review")["conflicts"]
    assert (conflict["assembly_quantity"], conflict["server_quantity"]) == (0, 3)
    assert status(run, gearbox) == "unchanged"
