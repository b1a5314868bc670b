# SPDX-License-Identifier: LGPL-2.1-or-later
"""``--push`` against a real embedded server: properties, revisions, the roll-up."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo_server.run import running_server

Run = Callable[..., Any]


@pytest.fixture
def client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SiloClient]:
    """A running server that the environment names."""
    token = "silo_" + "c1" * 20
    with running_server(sqlite_database(tmp_path / "silo.db"), token=token) as server:
        monkeypatch.setenv("SILO_API_URL", server.base_url)
        monkeypatch.setenv("SILO_API_TOKEN", token)
        with SiloClient(server.base_url, token) as found:
            yield found


def item_for(client: SiloClient, name: str, category: str, **properties: Any) -> str:
    return client.create_item("kindred-rd", category, name, name=name, properties=properties).part_number


def test_push_writes_properties_once_and_the_roll_up_uses_them(
    run: Run, arm: Path, client: SiloClient
) -> None:
    """A BOM with the server's numbers: the items get masses, the assembly's roll-up adds them up."""
    category = next(iter(client.categories()))
    plate = item_for(client, "Base plate", category, finish="painted")
    column = item_for(client, "Column", category)
    top = client.create_item("kindred-rd", category, "Arm", name="Arm", item_type="assembly").part_number
    bom = arm / "silo.csv"
    bom.write_text(
        "Part number,Name,Quantity,Material,Mass\n"
        f"{plate},Base plate,1,,0.688 kg\n{column},Column,1,Aluminum,\n",
        "utf-8",
    )
    ran = run("inertia", arm / "arm.step", "--bom", bom, "--push", "--json")
    assert ran.code == 0
    assert "2 items written" in ran.err
    assert "Not written: Camera" in ran.err
    found = client.get_item(plate)
    assert found.properties["finish"] == "painted"
    assert found.properties["mass_kg"] == 0.688
    assert found.properties["volume_m3"] == pytest.approx(2.5463e-4, rel=1e-3)
    assert found.properties["com_m"] == pytest.approx([0, 0, 0.005], abs=1e-9)
    newest = client.revisions(plate)[0]
    assert newest.comment == "Mass properties from arm.step and silo.csv"
    again = run("inertia", arm / "arm.step", "--bom", bom, "--push", "--json")
    assert "0 items written, 2 had these numbers already" in again.err
    assert client.revisions(plate)[0].revision_number == newest.revision_number
    rolled = roll_up(client, top, {plate: 1, column: 2})
    assert rolled["total_mass_kg"] == pytest.approx(0.688 + 2 * client.get_item(column).properties["mass_kg"])


def roll_up(client: SiloClient, top: str, children: dict[str, int]) -> Any:
    """The server's own mass of an assembly."""
    from silo.api.wire import MergeEntry, MergeRequest

    entries = [MergeEntry(child_part_number=number, quantity=count) for number, count in children.items()]
    client.merge_bom(top, MergeRequest(entries=entries))
    return client._get("its mass", "items", top, "bom", "mass").mapping()


def test_a_bought_unit_is_rolled_up_by_its_own_mass(run: Run, arm: Path, client: SiloClient) -> None:
    """The servo has a mass in the BOM, its case and horns have none: the server takes the servo's."""
    category = next(iter(client.categories()))
    servo = client.create_item(
        "kindred-rd", category, "Servo", name="Servo", item_type="assembly"
    ).part_number
    case = item_for(client, "Servo case", category)
    top = client.create_item("kindred-rd", category, "Arm", name="Arm", item_type="assembly").part_number
    bom = arm / "silo.csv"
    bom.write_text(f"Part number,Name,Quantity,Material,Mass\n{servo},Servo,3,,0.165 kg\n", "utf-8")
    ran = run("inertia", arm / "arm.step", "--bom", bom, "--push", "--json")
    assert ran.code == 0
    assert "1 item written" in ran.err
    assert "Not written: Servo case: its mass is a share" in ran.err
    properties = client.get_item(servo).properties
    assert properties["mass_kg"] == 0.165
    assert properties["volume_m3"] == pytest.approx(8.276e-5, rel=1e-3)
    roll_up(client, servo, {case: 1})
    rolled = roll_up(client, top, {servo: 3})
    assert rolled["total_mass_kg"] == pytest.approx(3 * 0.165)
    assert rolled["missing"] == []


def test_the_roll_up_of_the_whole_arm_is_our_total(run: Run, arm: Path, client: SiloClient) -> None:
    """Every row an item: parts, bolts and the servos; the server adds up what the geometry weighs."""
    category = next(iter(client.categories()))
    with (arm / "bom.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        row["Part number"] = item_for(client, row["Name"], category)
    with (arm / "numbered.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    ran = run("inertia", arm / "arm.step", "--bom", arm / "numbered.csv", "--push", "--json")
    assert ran.code == 0, ran.err
    assert "Not written: Threadlocker: no part of the geometry belongs to its row" in ran.err
    top = client.create_item("kindred-rd", category, "Arm", name="Arm", item_type="assembly").part_number
    counts = {row["Part number"]: int(row["Quantity"]) for row in rows}
    rolled = roll_up(client, top, counts)
    assert rolled["total_mass_kg"] == pytest.approx(ran.json()["total"]["mass"], rel=1e-9)
    without = {row["Part number"] for row in rows if row["Name"] in ("Cable duct", "Threadlocker")}
    assert set(rolled["missing"]) == without


def test_dry_run_asks_no_server(run: Run, arm: Path) -> None:
    """The plan, without a server anywhere."""
    ran = run("inertia", arm / "arm.step", "--bom", arm / "bom.csv", "--push", "--dry-run", "--json")
    assert ran.code == 0
    assert "F02-0001  Base plate: 0.688 kg" in ran.err
    assert "Not written: Cable duct" in ran.err


def test_unknown_items_are_reported(run: Run, arm: Path, client: SiloClient) -> None:
    """Exit 1, with their numbers."""
    ran = run("inertia", arm / "arm.step", "--bom", arm / "bom.csv", "--push", "--json")
    assert ran.code == 1
    assert "Unknown to the server" in ran.err
    assert "F02-0001" in ran.err
