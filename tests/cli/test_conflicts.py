# SPDX-License-Identifier: LGPL-2.1-or-later
"""A conflict reaches the server although no line is written for it, and is quiet once a person decided."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import requests

from silo.cli.setup.demo_edits import remove_from_assembly, set_element_count

pytestmark = pytest.mark.usefixtures("synced")


@pytest.fixture
def top(silo: Any) -> str:
    """The part number of the top assembly."""
    return str(silo.client.search_items("Top Assembly")[0].part_number)


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


def conflicts(silo: Any, top: str) -> list[tuple[float, float]]:
    """Return (CAD's quantity, Silo's quantity) of each."""
    rows = ask(silo, "GET", f"/api/items/{top}/bom/review")["conflicts"]
    return [(row["assembly_quantity"], row["server_quantity"]) for row in rows]


@pytest.mark.parametrize("settled_by", ["a person", "CAD"])
def test_a_conflict_alone_is_reported_once(
    run: Any, silo: Any, gearbox: Path, top: str, settled_by: str
) -> None:
    """A person sets 14, CAD says 12: the server learns of it, and the same again sends nothing.

    A person who keeps 14 is asked again when CAD says something else; CAD that comes to 14 ends it.
    """
    bolt = next(line.child_part_number for line in silo.client.get_bom(top) if line.quantity == 12)
    silo.client.update_bom_line(top, bolt, quantity=14)
    assert [status(run, gearbox) for _ in range(2)] == ["merged", "unchanged"]
    assert conflicts(silo, top) == [(12, 14)]
    if settled_by == "a person":
        decision = {"decisions": [{"child_part_number": bolt, "action": "keep_silo"}]}
        ask(silo, "POST", f"/api/items/{top}/bom/resolve", decision)
        assert status(run, gearbox) == "unchanged"
    set_element_count(gearbox, "CoverBolts", added=4 if settled_by == "a person" else 2)
    assert [status(run, gearbox) for _ in range(2)] == ["merged", "unchanged"]
    assert conflicts(silo, top) == ([(16, 14)] if settled_by == "a person" else [])


def test_an_override_whose_component_goes_is_reported(run: Any, silo: Any, gearbox: Path, top: str) -> None:
    """A person set a quantity, then CAD drops the part: that is a question too, asked once."""
    lines = {line.child_name or line.child_description: line for line in silo.client.get_bom(top)}
    silo.client.update_bom_line(top, lines["Cover"].child_part_number, quantity=3)
    status(run, gearbox)
    remove_from_assembly(gearbox, "Cover")
    assert [status(run, gearbox) for _ in range(2)] == ["merged", "unchanged"]
    assert conflicts(silo, top) == [(0, 3)]
