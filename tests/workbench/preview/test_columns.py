# SPDX-License-Identifier: LGPL-2.1-or-later
"""The columns of the preview, by name."""

from __future__ import annotations

from silo.workbench.preview.columns import columns, sentence
from silo.workbench.preview.rows import Kind, Row

ROW = Row(Kind.CHANGED, number="M01-0001", name="Plate", cad="2", silo="3", note="will change")


def test_each_column_says_its_part() -> None:
    """From left to right, the sign before the number."""
    told = {column.name: column.text(ROW) for column in columns()}
    assert told == {
        "number": "~ M01-0001",
        "name": "Plate",
        "cad": "2",
        "silo": "3",
        "note": "will change",
    }


def test_quantities_stand_at_the_right_and_the_last_column_takes_the_rest() -> None:
    """So a table of any width is filled."""
    made = columns()
    assert [column.name for column in made if column.right] == ["cad", "silo"]
    assert [column.name for column in made if not column.most] == [made[-1].name]


def test_a_sentence_takes_the_whole_row() -> None:
    """With its sign."""
    row = Row(Kind.NOT_COUNTED, number="✗", note="Gone.FCStd is missing")
    assert sentence(row) == "✗ Gone.FCStd is missing"
