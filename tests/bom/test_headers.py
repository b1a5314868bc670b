# SPDX-License-Identifier: LGPL-2.1-or-later
"""Column headers: one table of aliases."""

from __future__ import annotations

import pytest

from silo.bom.headers import Heading, alias, missing_columns, normal
from silo.tables.columns import find_columns
from silo.tables.kind import TableKind


@pytest.mark.parametrize(
    ("header", "role"),
    [
        ("PN", Heading.PART_NUMBER),
        ("Part No.", Heading.PART_NUMBER),
        ("part_number", Heading.PART_NUMBER),
        ("Qty.", Heading.QUANTITY),
        ("QTY (pcs)", Heading.QUANTITY),
        ("Stückzahl", Heading.QUANTITY),
        ("Find no.", Heading.FIND_NUMBER),
        ("Ref. Des.", Heading.REFERENCE_DESIGNATORS),
        ("名称", Heading.NAME),
    ],
)
def test_what_people_write(header: str, role: Heading) -> None:
    """Case, points, underlines and brackets do not count."""
    found = alias(normal(header))
    assert found is not None
    assert found[0] is role


def test_a_word_in_a_header_is_not_the_header() -> None:
    """No likeness, no substring."""
    for header in ("Quantity unit price", "Numbering", "Part family", "PN2", ""):
        assert alias(normal(header)) is None


def _roles(header: list[str], roles: tuple[Heading, ...]) -> dict[str, int]:
    return dict(find_columns(header, TableKind(roles, ())).at)


def test_the_better_name_wins_then_the_first() -> None:
    """Wherever it stands."""
    header = ["Component", "Name", "Title", "Name"]
    assert _roles(header, (Heading.NAME, Heading.QUANTITY)) == {Heading.NAME: 1}
    assert _roles(header, (Heading.QUANTITY,)) == {}


def test_what_is_missing_is_said_with_what_was_seen() -> None:
    """And nothing where nothing is."""
    header = ["PN", " Colour ", ""]
    at_heading = {Heading(role): place for role, place in _roles(header, tuple(Heading)).items()}
    assert missing_columns(header, at_heading, (Heading.PART_NUMBER,)) == ""
    text = missing_columns(header, at_heading, (Heading.PART_NUMBER, Heading.QUANTITY))
    assert text.startswith("there is no column 'Quantity'; the columns are PN, Colour. ")
    assert "'Quantity' may also be called qty, qnty, count" in text
