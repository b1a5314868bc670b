# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM as JSON: the spec's shapes, relative paths, flat lists, trees too large to write out; snapshots."""

from __future__ import annotations

import json
import ntpath
from dataclasses import fields
from typing import Any

import pytest
from fakes import Doc
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st

from silo.bom import BomEntry, Extraction, Finding, FindingCode, Place, Severity, diff_bom, extract
from silo.bom.errors import InputError
from silo.bom.snapshot import from_plain, to_plain
from silo.bom.view.diff_rows import diff_json
from silo.bom.view.flat_list import flat_counts, flat_json
from silo.bom.view.folders import project_folder, shorten
from silo.bom.view.tree_json import bom_json, tree_size
from silo.bom.walk.document import relative


def entry(name: str, quantity: int = 1, *children: BomEntry, level: int = 1) -> BomEntry:
    return BomEntry(
        f"/proj/{name}.FCStd",
        f"u-{name}",
        quantity=quantity,
        level=level,
        object_name="Body",
        label=name,
        children=children,
    )


def extraction(*entries: BomEntry, findings: tuple[Finding, ...] = ()) -> Extraction:
    head = BomEntry("/proj/top.FCStd", "u-top", object_name="Assembly", label="Top", is_assembly=True)
    return Extraction(head, entries, findings)


def test_the_json_of_the_command() -> None:
    """The keys of the issue, quantities per one parent, paths from the top file's folder."""
    finding = Finding(
        FindingCode.MISSING_FILE,
        Severity.ERROR,
        "/proj/parts/b.FCStd is missing",
        (Place("/proj/top.FCStd", "L"),),
    )
    found = extraction(entry("parts/sub", 2, entry("../lib/bolt", 4, level=2)), findings=(finding,))
    told = json.loads(json.dumps(bom_json(found)))
    assert (
        told["assembly"] | {"doc_path": "top.FCStd", "object": "Assembly", "label": "Top"} == told["assembly"]
    )
    (line,) = told["entries"]
    assert {key: line[key] for key in ("doc_path", "object", "label", "silo_uuid", "quantity", "level")} == {
        "doc_path": "parts/sub.FCStd",
        "object": "Body",
        "label": "parts/sub",
        "silo_uuid": "u-parts/sub",
        "quantity": 2,
        "level": 1,
    }
    assert (line["part_number"], line["name"], line["consolidation_warning"]) == (None, None, False)
    assert [(c["doc_path"], c["quantity"], c["children"]) for c in line["children"]] == [
        ("../lib/bolt.FCStd", 4, [])
    ]
    assert told["findings"] == [
        {
            "code": "missing_file",
            "severity": "error",
            "message": "parts/b.FCStd is missing",
            "where": [{"file": "top.FCStd", "object": "L"}],
        }
    ]


def test_flat_quantities_are_multiplied_down_the_tree() -> None:
    """Two gearboxes with four gears each are eight gears; sub-assemblies are listed as well."""
    bolt = entry("bolt", 3, level=2)
    found = extraction(entry("sub", 2, entry("gear", 4, level=2), bolt), entry("bolt", 5))
    assert [(row["doc_path"], row["object"], row["quantity"]) for row in flat_json(found)] == [
        ("sub.FCStd", "Body", 2),
        ("gear.FCStd", "Body", 8),
        ("bolt.FCStd", "Body", 11),
    ]


@pytest.mark.parametrize(
    ("path", "base", "told"),
    [
        ("/p/a.FCStd", "/p", "a.FCStd"),
        ("/q/a.FCStd", "/p", "../q/a.FCStd"),
        ("", "/p", ""),
        ("/p/a.FCStd", "", "/p/a.FCStd"),
    ],
)
def test_paths_are_reported_relative_to_the_top_file(path: str, base: str, told: str) -> None:
    """With ``/``; unsaved documents have no path."""
    assert relative(path, base) == told


def doubling(levels: int) -> BomEntry:
    """A tree in which each assembly holds two others, which hold the same ones: 2^levels lines."""
    below: tuple[BomEntry, ...] = ()
    for level in range(levels, 0, -1):
        below = (entry(f"a{level}", 1, *below, level=level), entry(f"b{level}", 1, *below, level=level))
    return entry("root", 1, *below)


def test_a_tree_that_nobody_could_read_is_refused() -> None:
    """2^40 lines are counted, not written; the flat list has them all at once."""
    found = extraction(doubling(40))
    assert tree_size(found.entries) == 2**41 - 1
    with pytest.raises(InputError, match="--flat"):
        bom_json(found)
    assert len(flat_json(found)) == 81
    assert flat_counts(found.entries)["/proj/b40.FCStd", "Body"] == 2**39


def test_a_component_below_its_equal_counts_with_it() -> None:
    """Where a ring of files is cut, the same component lies below itself."""
    ring = entry("a", 2, entry("b", 3, entry("a", 5)))
    counts = flat_counts([ring])
    assert (counts["/proj/a.FCStd", "Body"], counts["/proj/b.FCStd", "Body"]) == (2 + 2 * 3 * 5, 2 * 3)


def test_a_diff_as_json() -> None:
    """All six lists, as plain dicts."""
    told: dict[str, Any] = diff_json(diff_bom([{"child_part_number": "P", "quantity": 2}], []))
    assert set(told) == {"added", "quantity_changed", "removed", "unchanged", "manual", "conflicts", "kept"}
    assert json.loads(json.dumps(told))["added"] == [{"part_number": "P", "quantity": 2}]


def test_the_root_of_the_disk_is_no_folder_to_leave_out() -> None:
    """Its separators would all go."""
    assert shorten("/a/b.FCStd: broken", "/") == "/a/b.FCStd: broken"
    assert shorten("/a/b.FCStd: broken", "/a") == "b.FCStd: broken"


@pytest.mark.parametrize(
    ("path", "top", "folder"),
    [
        ("/home/a/robot/Robot.FCStd", "", "robot"),
        ("/home/a/robot/Robot.FCStd", "/home/a/robot/Robot.FCStd", "robot"),
        ("/home/a/robot/arm/wrist/W.FCStd", "/home/a/robot/Robot.FCStd", "robot/arm/wrist"),
        ("/home/a/library/Bolt.FCStd", "/home/a/robot/Robot.FCStd", "library"),
        ("Robot.FCStd", "", ""),
        ("/Robot.FCStd", "", ""),
    ],
)
def test_a_project_folder_is_the_same_on_every_machine(path: str, top: str, folder: str) -> None:
    """From the folder of the run's assembly on; elsewhere the file's own folder."""
    assert project_folder(path, top) == folder
    windows = project_folder(
        "C:" + path.replace("/", "\\"), "C:" + top.replace("/", "\\") if top else "", ntpath
    )
    assert windows == folder or "/" not in path


def test_a_label_of_megabytes_is_cut() -> None:
    """In findings, lines and JSON alike."""
    top = Doc("/v/top.FCStd")
    members = top.link("L", None), top.body("B", Label="x" * 1_000_000)
    found = extract(top.assembly(*members, Label="y" * 1_000_000))
    assert len(json.dumps(bom_json(found))) < 5000


TEXT = st.text(max_size=8)
OPTIONAL = st.none() | TEXT


def entries(children: st.SearchStrategy[list[BomEntry]]) -> st.SearchStrategy[BomEntry]:
    return st.builds(
        BomEntry,
        doc_path=TEXT,
        silo_uuid=OPTIONAL,
        part_number=OPTIONAL,
        name=OPTIONAL,
        quantity=st.integers(1, 9),
        level=st.integers(0, 9),
        children=children,
        consolidation_warning=st.booleans(),
        object_name=TEXT,
        label=TEXT,
        is_assembly=st.booleans(),
        individual_links=st.integers(0, 9),
        link_objects=st.integers(0, 9),
        instances=st.lists(TEXT, max_size=3),
        document_label=TEXT,
    )


LEAVES = entries(st.just([]))
TREES = st.recursive(LEAVES, lambda below: entries(st.lists(below, max_size=3)), max_leaves=6)
FINDINGS = st.builds(
    Finding,
    st.sampled_from(FindingCode),
    st.sampled_from(Severity),
    TEXT,
    st.lists(st.builds(Place, TEXT, TEXT), max_size=2).map(tuple),
)
EXTRACTIONS = st.builds(
    Extraction, TREES, st.lists(TREES, max_size=3).map(tuple), st.lists(FINDINGS, max_size=3).map(tuple)
)


def everything(entry: BomEntry) -> list[Any]:
    """All fields, also those that take no part in equality."""
    own = [getattr(entry, field.name) for field in fields(entry) if field.name != "children"]
    return [own, [everything(child) for child in entry.children]]


@settings(max_examples=examples(10))
@given(EXTRACTIONS)
def test_the_way_there_and_back_loses_nothing(extraction: Extraction) -> None:
    """Through JSON text as well, and with the fields that do not count in comparisons."""
    again = from_plain(json.loads(json.dumps(to_plain(extraction))))
    assert again == extraction
    assert everything(again.assembly) == everything(extraction.assembly)
    assert [everything(e) for e in again.entries] == [everything(e) for e in extraction.entries]


def test_shared_children_are_written_once() -> None:
    """Thirty levels with two uses of the next one each: thirty rows, not a billion."""
    entry = BomEntry(doc_path="part.FCStd", object_name="Part")
    for level in range(30):
        entry = BomEntry(doc_path=f"{level}.FCStd", object_name="Sub", children=(entry, entry))
    plain = to_plain(Extraction(assembly=entry, entries=entry.children))
    assert len(plain["table"]) == 31
    again = from_plain(plain)
    assert again.assembly.children[0] is again.assembly.children[1]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({}, "expected a BOM snapshot of format 1, got None"),
        ({"format": 2}, "expected a BOM snapshot of format 1, got 2"),
        ({"format": 1}, "BOM snapshot is not complete"),
        ({"format": 1, "assembly": 0, "entries": [], "table": [], "findings": []}, "is not complete"),
        (
            {"format": 1, "assembly": 0, "entries": [], "table": [{"children": [3]}], "findings": []},
            "is not complete",
        ),
    ],
)
def test_anything_else_is_refused(data: dict[str, Any], words: str) -> None:
    """A wrong or incomplete snapshot is an error that says so, never a smaller BOM."""
    with pytest.raises(InputError, match=words):
        from_plain(data)
