# SPDX-License-Identifier: LGPL-2.1-or-later
"""The values: frozen, comparable, and readable as the spec's dicts."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

import pytest

from silo.bom import (
    BomChange,
    BomDiff,
    BomEntry,
    Extraction,
    Finding,
    FindingCode,
    Place,
    QuantityChange,
    Severity,
)
from silo.bom.compare.bom_diff import rows_as_dicts
from silo.bom.compare.merge import MergePlan

FINDING = Finding(FindingCode.CYCLE, Severity.ERROR, "a ring", (Place("/v/a.FCStd", "A"),))
VALUES = [
    BomEntry("/v/bolt.FCStd"),
    Extraction(BomEntry("/v/top.FCStd")),
    BomChange("P", 1),
    QuantityChange("P", 1, 2),
    BomDiff(),
    FINDING,
    Place("/v/a.FCStd"),
    MergePlan(BomDiff()),
]


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_values_are_hashable(value: Any) -> None:
    """They may be keys and members of sets."""
    assert len({value, value}) == 1


def test_the_entry_of_the_spec() -> None:
    """Spec §3: the fields by name and in order, children as a list; what is kept is a tuple."""
    child = BomEntry("/v/bolt.FCStd", None, None, None, 4, 2, [])  # type: ignore[arg-type]
    entry = BomEntry(
        doc_path="/v/asm.FCStd",
        silo_uuid="u",
        part_number="ASM-200",
        name="Gearbox",
        quantity=2,
        level=1,
        children=[child],  # type: ignore[arg-type]
        consolidation_warning=False,
    )
    assert entry.children == (child,)
    assert child.children == ()


def test_labels_and_instances_are_no_part_of_equality() -> None:
    """Where a value was found, and what people call it, does not make it another value."""
    one = BomEntry("/v/b.FCStd", label="Bolt", instances=("L1",), individual_links=1, document_label="b")
    two = BomEntry("/v/b.FCStd", label="Schraube", instances=("L2",), individual_links=2, document_label="c")
    assert one == two
    assert one != BomEntry("/v/b.FCStd", quantity=2)


@pytest.mark.parametrize("kind", [f.name for f in fields(BomDiff)])
def test_lists_given_to_a_diff_become_tuples(kind: str) -> None:
    """The spec's listing builds a diff of lists; a frozen value holds tuples."""
    diff = BomDiff(**{kind: [BomChange("P", 1)]})  # type: ignore[arg-type]
    assert getattr(diff, kind) == (BomChange("P", 1),)


def test_lists_given_to_other_values_become_tuples() -> None:
    """Extractions and findings as well."""
    found = Extraction(BomEntry("/v/t.FCStd"), [BomEntry("/v/b.FCStd")], [FINDING])  # type: ignore[arg-type]
    assert isinstance(found.entries, tuple)
    assert isinstance(found.findings, tuple)
    assert Finding(FindingCode.CYCLE, Severity.INFO, "", [Place("/v/a.FCStd")]).where == (  # type: ignore[arg-type]
        Place("/v/a.FCStd"),
    )


def test_rows_are_equal_to_their_dicts() -> None:
    """A row is a mapping: both directions, and never equal to half of it."""
    row = QuantityChange("P", 12, 8)
    told = {"part_number": "P", "local_quantity": 12, "remote_quantity": 8}
    assert row == told
    assert told == row
    assert row != {**told, "remote_quantity": 9}
    assert row != {"part_number": "P"}
    assert row != BomChange("P", 12)
    assert dict(row) == told
    assert list(row) == list(told)


def test_rows_read_as_mappings_and_as_attributes() -> None:
    """``row["quantity"]`` as in the spec's listing, ``row.quantity`` in our code."""
    row = BomChange("P", 2)
    assert row["quantity"] == row.quantity == row.get("quantity") == 2
    assert "quantity" in row
    assert "keys" not in row
    with pytest.raises(KeyError):
        row["local_quantity"]
    with pytest.raises(TypeError):
        row["quantity"] = 3  # type: ignore[index]


def test_equal_rows_have_equal_hashes() -> None:
    """Two is two, as a float as well."""
    assert BomChange("P", 2) == BomChange("P", 2.0)
    assert hash(BomChange("P", 2)) == hash(BomChange("P", 2.0))


def test_rows_become_plain_dicts_for_json() -> None:
    """No special encoder."""
    assert json.loads(json.dumps(rows_as_dicts([BomChange("P", 2)]))) == [{"part_number": "P", "quantity": 2}]


@pytest.mark.parametrize(
    ("kind", "drifted"),
    [
        *(("added", True), ("quantity_changed", True), ("removed", True), ("conflicts", True)),
        *(("unchanged", False), ("manual", False)),
    ],
)
def test_what_is_drift(kind: str, drifted: bool) -> None:
    """A check reports more than a merge would write."""
    diff = BomDiff(**{kind: (BomChange("P", 1),)})  # type: ignore[arg-type]
    assert diff.drifted is drifted


def test_findings_are_found_by_code() -> None:
    """In their order; an extraction with an error is blocked."""
    info = Finding(FindingCode.EXCLUDED, Severity.INFO, "left out")
    found = Extraction(BomEntry("/v/t.FCStd"), findings=(info, FINDING))
    assert found.findings_of(FindingCode.CYCLE, FindingCode.EXCLUDED) == (info, FINDING)
    assert found.blocked
    assert not Extraction(BomEntry("/v/t.FCStd"), findings=(info,)).blocked


def test_places_read_as_file_and_object() -> None:
    """``file#object``, or the file alone."""
    assert [str(Place("/v/a.FCStd", "A")), str(Place("/v/a.FCStd"))] == ["/v/a.FCStd#A", "/v/a.FCStd"]
