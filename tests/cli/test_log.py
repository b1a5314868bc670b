# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod log``: the revisions of a file, which one it is, and what each changed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from silo.checksums import sha256_of
from silo.cli.setup.demo_edits import remove_from_assembly, set_element_count
from silo.outbox.store import Store


@pytest.fixture(name="history")
def _history(registered: Path, silo: Any, gearbox: Path) -> str:
    """Three files of the top assembly are in Silo: as registered, without the cover, with other bolts."""
    (top,) = (i for i in silo.client.search_items("Top Assembly") if i.item_type == "assembly")
    number = str(top.part_number)
    silo.client.upload_file(number, gearbox, "first")
    remove_from_assembly(gearbox, "Cover")
    silo.client.upload_file(number, gearbox, "without the cover")
    set_element_count(gearbox, "CoverBolts", added=4)
    silo.client.upload_file(number, gearbox, "more [bold]bolts")
    return number


def test_the_revisions_newest_first_and_which_one_the_file_is(run: Any, history: str, gearbox: Path) -> None:
    """Markup in a comment is text."""
    ran = run("log", gearbox)
    assert ran.code == 0
    lines = ran.out.splitlines()
    assert lines[0] == f"{history}  Top Assembly"
    assert [line.rsplit("  ", 1)[-1] for line in lines[1:2]] == ["← this file"]
    assert "more [bold]bolts" in lines[1]
    assert ran.out.index("more ") < ran.out.index("without the cover") < ran.out.index("first")
    told = run("log", gearbox, "--json").json()
    assert (told["part_number"], told["edited"]) == (history, False)
    newest = told["revisions"][0]
    assert told["file_is"] == newest["revision_number"]
    count = len(told["revisions"])
    ran = run("log", gearbox, "--limit", 1)
    assert "without the cover" not in ran.out
    assert f"… and {count - 1} older; --limit shows more" in ran.out


def test_what_each_revision_changed_in_the_bom(run: Any, history: str, gearbox: Path) -> None:
    """Against the file before it, read from both files."""
    told = run("log", gearbox, "--changes", "--json").json()["revisions"]
    assert [row["bom"] for row in told if row["file_name"]][:2] == ["M8x20 Bolt 12 → 16", "- Cover 1"]
    text = run("log", gearbox, "--changes").out
    assert "- Cover 1" in text


def test_an_edited_file_says_what_it_was_made_from(run: Any, history: str, gearbox: Path) -> None:
    """Where the add-on has seen it being saved; otherwise nobody knows, and that is what it says."""
    told = run("log", gearbox, "--json").json()
    before = sha256_of(gearbox)
    set_element_count(gearbox, "CoverBolts", added=1)
    unknown = run("log", gearbox, "--json").json()
    assert (unknown["file_is"], unknown["edited"]) == (None, True)
    assert "it is not known which one it was made from" in run("log", gearbox).out
    Store().derived(sha256_of(gearbox), before)
    edited = run("log", gearbox, "--json").json()
    assert (edited["file_is"], edited["edited"]) == (told["file_is"], True)
    assert "← this file, edited since" in run("log", gearbox).out


def test_what_changed_in_the_product_since(run: Any, silo: Any, history: str, gearbox: Path) -> None:
    """Over all levels, by the file or by its part number; in a table and as JSON."""
    run("sync", gearbox, "--recursive")
    told = run("log", gearbox, "--since", "2020-01-01", "--json").json()
    rows = {(row["what"], row["within"], row["part_number"]) for row in told["changes"]}
    lines = {line.child_part_number for line in silo.client.get_bom(history)}
    assert {("added", history, child) for child in lines} | {("file", "", history)} <= rows
    ran = run("log", history, "--since", "2020-01-01", "--until", "2020-01-02")
    assert (ran.code, "nothing on any level" in ran.out) == (0, True)
    out = run("log", history, "--since", "2020-01-01").out
    assert all(child in out for child in lines)
    for wrong, why in ((("--until", "r1"), "--since"), (("--since", "yesterday"), "wanted a date")):
        ran = run("log", history, *wrong)
        assert (ran.code, why in ran.err) == (2, True)


def test_what_cannot_be_shown_is_an_error_with_a_reason(run: Any, silo: Any, gearbox: Path) -> None:
    """No file, a file without an item, a server that does not know it."""
    missing = run("log", gearbox.with_name("None.FCStd"))
    assert (missing.code, "is not a file. Give the path of an FCStd file" in missing.err) == (2, True)
    unregistered = run("log", gearbox)
    assert (unregistered.code, f"`silo-mod register {gearbox}`" in unregistered.err) == (2, True)
