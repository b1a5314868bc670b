# SPDX-License-Identifier: LGPL-2.1-or-later
"""Column headers: one table of aliases."""

from __future__ import annotations

import pytest

from silo.bom.headers import Role, alias, find_roles, missing_columns, normal


@pytest.mark.parametrize(
    ("header", "role"),
    [
        ("PN", Role.PART_NUMBER),
        ("Part No.", Role.PART_NUMBER),
        ("part_number", Role.PART_NUMBER),
        ("Qty.", Role.QUANTITY),
        ("QTY (pcs)", Role.QUANTITY),
        ("Stückzahl", Role.QUANTITY),
        ("Find no.", Role.FIND_NUMBER),
        ("Ref. Des.", Role.REFERENCE_DESIGNATORS),
        ("名称", Role.NAME),
    ],
)
def test_what_people_write(header: str, role: Role) -> None:
    """Case, points, underlines and brackets do not count."""
    found = alias(normal(header))
    assert found is not None
    assert found[0] is role


def test_a_word_in_a_header_is_not_the_header() -> None:
    """No likeness, no substring."""
    for header in ("Quantity unit price", "Numbering", "Part family", "PN2", ""):
        assert alias(normal(header)) is None


def test_the_better_name_wins_then_the_first() -> None:
    """Wherever it stands."""
    header = ["Component", "Name", "Title", "Name"]
    assert find_roles(header, (Role.NAME, Role.QUANTITY)) == {Role.NAME: 1}
    assert find_roles(header, (Role.QUANTITY,)) == {}


def test_what_is_missing_is_said_with_what_was_seen() -> None:
    """And nothing where nothing is."""
    header = ["PN", " Colour ", ""]
    at = find_roles(header, tuple(Role))
    assert missing_columns(header, at, (Role.PART_NUMBER,)) == ""
    text = missing_columns(header, at, (Role.PART_NUMBER, Role.QUANTITY))
    assert text.startswith("there is no column 'Quantity'; the columns are PN, Colour. ")
    assert "'Quantity' may also be called qty, qnty, count" in text
