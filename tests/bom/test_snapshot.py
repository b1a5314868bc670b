# SPDX-License-Identifier: LGPL-2.1-or-later
"""An extraction as plain data: nothing is lost on the way there and back, and nothing is repeated."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import InputError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.model import BomEntry, Extraction
from silo.bom.snapshot import from_plain, to_plain

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
        ({"format": 1}, "no complete BOM snapshot"),
        ({"format": 1, "assembly": 0, "entries": [], "table": [], "findings": []}, "no complete"),
        (
            {"format": 1, "assembly": 0, "entries": [], "table": [{"children": [3]}], "findings": []},
            "no complete",
        ),
    ],
)
def test_anything_else_is_refused(data: dict[str, Any], words: str) -> None:
    """A wrong or incomplete snapshot is an error that says so, never a smaller BOM."""
    with pytest.raises(InputError, match=words):
        from_plain(data)
