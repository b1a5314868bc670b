# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the server refuses stays visible, holds up nobody, and can be tried again or given up."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import pytest
import requests
from freecad_cases.machines import NEWEST
from gui_cases.window import TOKEN, Window

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@dataclass
class Server:
    """What the script inside asks for."""

    freecad: Window

    def number(self, name: str) -> str:
        told = json.loads((self.freecad.folder / "told.json").read_text())
        return str(told["numbers"][name])

    def break_it(self) -> bool:
        """Somebody puts gearbox and frame below the top by hand."""
        with self.freecad.server.client() as client:
            for name in ("Gearbox", "Frame"):
                client.add_bom_line(self.number("Top"), self.number(name), quantity=1)
        return True

    def mend(self) -> bool:
        """And takes the gearbox away."""
        with self.freecad.server.client() as client:
            client.remove_bom_line(self.number("Top"), self.number("Gearbox"))
        return True

    def mode(self, mode: str) -> bool:
        url = f"{self.freecad.server.url}/api/admin/mode"
        head = {"Authorization": f"Bearer {TOKEN}"}
        requests.put(url, json={"mode": mode}, headers=head, timeout=60).raise_for_status()
        return True


@pytest.fixture(name="told", scope="module")
def _told(freecad: Window) -> dict[str, Any]:
    server = Server(freecad)
    freecad.answers |= {
        "number of other": lambda: server.number("Other"),
        "number of gearbox": lambda: server.number("Gearbox"),
        "break": server.break_it,
        "mend": server.mend,
        "read-only": lambda: server.mode("read-only"),
        "normal": lambda: server.mode("normal"),
    }
    said = freecad.run("refused.py")
    with freecad.server.client() as client:
        number = server.number("Frame")
        said["frame_lines"] = client.get_bom(number)
        said["frame_files"] = [r.file_name for r in client.revisions(number) if r.file_name]
    return said


def test_a_refused_bom_stays_with_its_reason(told: dict[str, Any]) -> None:
    """The file is in Silo; the BOM waits for a person."""
    assert told["rejected"] == [[told["numbers"]["Gearbox"], False, True, "held"]]
    text = "\n".join(told["rejected_text"])
    assert "1 thing waits for your choice" in text
    assert told["numbers"]["Top"] in text
    assert "cycle" in text.lower() or "itself" in text.lower()


def test_another_assembly_is_not_held_up(told: dict[str, Any]) -> None:
    """It arrived while the refused one waited."""
    assert told["still"] == told["rejected"]


def test_retry_brings_it_once_it_is_mended(told: dict[str, Any]) -> None:
    """The same BOM as it was at the commit."""
    assert [box.splitlines()[1] for box in told["after_retry"]] == ["+1 added"]


def test_discard_forgets_it_and_leaves_the_document(told: dict[str, Any]) -> None:
    """The file of that commit had gone before; the BOM on the server is what it was."""
    assert told["discarded"]
    assert told["instances"] == 1
    assert told["frame_lines"] == []
    assert told["frame_files"] == ["Frame.FCStd"]


def test_read_only_is_told_and_waited_out(told: dict[str, Any]) -> None:
    """Nothing is rejected for it, and nobody has to press anything."""
    assert "is read-only now. Commits wait here until it takes changes again." in told["read_only"]
    assert {state for *_, state in told["held"]} == {"waiting"}
    assert told["released"].splitlines()[:2] == [
        f"BOM Updated: {told['numbers']['Other']} Other",
        "~1 qty changed",
    ]
