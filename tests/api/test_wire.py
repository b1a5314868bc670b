# SPDX-License-Identifier: LGPL-2.1-or-later
"""The wire models read both dialects and write the spec's."""

from __future__ import annotations

import subprocess
import sys

import pytest
from pydantic import ValidationError

from silo.api.wire import (
    BomLine,
    Item,
    MergeDiff,
    MergeEntry,
    MergeEvent,
    MergeRequest,
    MergeResult,
    Revision,
)

SPEC_RESPONSE = {
    "status": "merged",
    "diff": {
        "added": [{"part_number": "PRT-300", "quantity": 1}],
        "removed": [{"part_number": "PRT-400", "quantity": 2}],
        "quantity_changed": [{"part_number": "F01-001", "old_quantity": 8, "new_quantity": 12}],
        "unchanged": [
            {"part_number": "PRT-100", "quantity": 1},
            {"part_number": "ASM-200", "quantity": 2},
        ],
    },
    "warnings": [
        {
            "type": "unreferenced",
            "part_number": "PRT-400",
            "message": "Present in server BOM but not in assembly",
        }
    ],
    "resolve_url": "/items/ASM-001/bom",
}

SPEC_REQUEST = {
    "source": "assembly",
    "entries": [
        {"child_part_number": "PRT-100", "quantity": 1, "source": "assembly"},
        {"child_part_number": "ASM-200", "quantity": 2, "source": "assembly"},
        {"child_part_number": "PRT-300", "quantity": 1, "source": "assembly"},
        {"child_part_number": "F01-001", "quantity": 12, "source": "assembly"},
    ],
}


def test_the_specs_response_survives_the_round_trip() -> None:
    """Spec bom-sync §5, "Response body"."""
    result = MergeResult.model_validate(SPEC_RESPONSE)
    assert result.model_dump(mode="json", exclude_none=True) == SPEC_RESPONSE


def test_the_specs_request_is_written_and_read() -> None:
    """Spec bom-sync §5, "Request body"."""
    pairs = [("PRT-100", 1), ("ASM-200", 2), ("PRT-300", 1), ("F01-001", 12)]
    request = MergeRequest(entries=[MergeEntry(child_part_number=pn, quantity=q) for pn, q in pairs])
    assert request.model_dump(mode="json", exclude_none=True) == SPEC_REQUEST
    assert MergeRequest.model_validate(SPEC_REQUEST) == request


@pytest.mark.parametrize("quantity", [0, -1, float("nan"), float("inf"), "x", None])
def test_a_quantity_that_is_none_cannot_be_sent(quantity: object) -> None:
    """Finite and above 0."""
    with pytest.raises(ValidationError):
        MergeEntry.model_validate({"child_part_number": "A", "quantity": quantity})


def test_the_event_is_read_in_both_dialects() -> None:
    """The spec's bom_merge/item, the real Silo's part_number and unchanged_count."""
    spec = MergeEvent.model_validate(
        {
            "type": "bom_merge",
            "item": "ASM-001",
            "user": "joseph",
            "timestamp": "2026-02-08T22:15:00Z",
            "summary": "BOM updated: 1 added, 1 quantity changed, 1 unreferenced",
            "diff": SPEC_RESPONSE["diff"],
            "resolve_url": "/items/ASM-001/bom",
        }
    )
    real = MergeEvent.model_validate(
        {"part_number": "ASM-001", "user": "joseph", "diff": {"added": None, "unchanged_count": 2}}
    )
    assert spec.item == real.item == "ASM-001"
    assert spec.timestamp is not None
    assert spec.timestamp.year == 2026
    assert (real.diff.added, real.diff.unchanged_count) == ([], 2)
    assert MergeDiff.model_validate(SPEC_RESPONSE["diff"]) == spec.diff


def test_a_bad_time_stamp_costs_only_itself() -> None:
    """It is there to be shown."""
    event = MergeEvent.model_validate({"item": "A", "timestamp": "yesterday"})
    assert event.timestamp is None


def test_the_name_is_the_description_where_there_is_none() -> None:
    """The real Silo has no proven name; and at the very least there is the number."""
    real = Item.model_validate(
        {"id": "u", "part_number": "F01-0001", "description": "Bolt", "properties": None}
    )
    bare = Item.model_validate({"uuid": "u", "part_number": "F01-0001"})
    assert (real["name"], real["properties"], bare["name"]) == ("Bolt", {}, "F01-0001")


def test_a_record_is_a_mapping_of_its_fields_and_nothing_else() -> None:
    """The listings of the spec take mappings; methods are no keys."""
    line = BomLine(child_part_number="A", quantity=2)
    assert line["quantity"] == line.get("quantity") == line.quantity
    assert "model_dump" not in line
    with pytest.raises(KeyError):
        line["no_such"]
    assert dict(line)["source"] == "assembly"
    assert len(line) == len(list(line))


@pytest.mark.parametrize(
    ("source", "read"),
    [
        (None, "assembly"),
        ("", "assembly"),
        ("ASSEMBLY", "assembly"),
        ("manual", "manual"),
        ("csv-import", "manual"),
    ],
)
def test_a_line_of_unknown_source_is_somebodys(source: str | None, read: str) -> None:
    """Only what says "assembly", or nothing, may be changed by a merge."""
    assert BomLine.model_validate({"child_part_number": "A", "source": source}).source == read


def test_lines_and_revisions_tolerate_other_forms() -> None:
    """Numbers as texts, designators as one text, other names for the checksum."""
    line = BomLine.model_validate(
        {"child_part_number": "A", "id": 7, "find_number": 10, "reference_designators": "R1, R2 R3"}
    )
    assert (line.id, line.find_number, line.reference_designators) == ("7", "10", ["R1", "R2", "R3"])
    revision = Revision.model_validate({"revision": 3, "sha256": "ab", "labels": None})
    assert (revision.revision_number, revision.file_checksum, revision.labels) == (3, "ab", [])


@pytest.mark.parametrize(
    ("module", "forbidden"),
    [
        ("silo.api", {"pydantic", "requests", "urllib3"}),
        ("silo.api.wire", {"requests", "urllib3", "silo.bom.entry", "silo.bom.walk"}),
        ("silo.api.config", {"requests", "pydantic"}),
    ],
)
def test_importing_little_costs_little(module: str, forbidden: set[str]) -> None:
    """FreeCAD's start must not pay for the network; the server shares only the models."""
    code = f"import sys, {module}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not forbidden & set(done.stdout.split())
