# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod links``: what it writes is what ``silo-mod inertia --links`` takes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

Run = Callable[..., Any]


def test_the_map_can_be_used_at_once(run: Run, arm: Path) -> None:
    """From the URDF's names, with a scene; the masses are those without a map."""
    ran = run("links", arm / "arm.step", "--urdf", arm / "arm.urdf", "--preview", arm / "map.glb")
    assert ran.code == 0
    assert "35 of 35 parts by names" in ran.err
    assert (arm / "map.glb").read_bytes().startswith(b"glTF")
    (arm / "map.yaml").write_text(ran.out, "utf-8")
    command = ["inertia", arm / "arm.step", "--bom", arm / "bom.csv", "--json"]
    mapped = run(*command, "--links", arm / "map.yaml").json()
    plain = run(*command).json()
    masses = [{link["name"]: link["mass"] for link in data["links"]} for data in (mapped, plain)]
    assert masses[0] == masses[1]


def test_the_map_goes_to_a_file_when_asked(run: Run, arm: Path) -> None:
    """And standard output stays empty."""
    ran = run("links", arm / "arm.step", "--out", arm / "map.yaml", "--clusters", "3")
    assert (ran.code, ran.out) == (0, "")
    text = (arm / "map.yaml").read_text("utf-8")
    assert (text.count("parts:"), "no sub-assemblies" in text) == (3, False)


def test_mistakes_are_plain_sentences(run: Run, arm: Path) -> None:
    """Before anything is read."""
    for words, wanted in (
        (("--clusters", "0"), "above 0"),
        (("--clusters", "2", "--urdf", arm / "arm.urdf"), "one of them"),
        (("--preview", arm / "x.png"), "--preview writes"),
        (("--out", arm / "no" / "map.yaml"), "there is no folder"),
    ):
        ran = run("links", arm / "arm.step", *words)
        assert ran.code == 2
        assert wanted in ran.err
