# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is proposed for a component that has no item yet (spec §2, §6)."""

from __future__ import annotations

from typing import Any

import pytest

from silo.bom.model import BomEntry
from silo.bom.naming import clean_name, crowded_files, display_name, propose, proposed_name

SCHEMA = {
    "A01": "Mechanical assembly",
    "F01": "Fasteners: screws, bolts, nuts",
    "M01": "Machined parts",
    "E01": "Electronics",
}


def entry(label: str = "Body", document: str = "", **more: Any) -> BomEntry:
    return BomEntry("/v/x.FCStd", label=label, document_label=document, object_name="Body", **more)


@pytest.mark.parametrize(
    ("label", "name"),
    [
        ("Bracket.FCStd", "Bracket"),
        ("motor_mount", "motor mount"),
        ("  two \n lines\t", "two lines"),
        ("esc\x1b[31m", "esc [31m"),
        ("u\u202egnp", "u gnp"),
        ("Cafe\u0301", "Café"),
        ("x" * 500, "x" * 200),
    ],
)
def test_names_are_clean(label: str, name: str) -> None:
    """No suffix, no control characters, no endless text; a name may come from anywhere."""
    assert clean_name(label) == name


def test_of_an_endless_label_only_the_beginning_is_read() -> None:
    """It may be megabytes long, and there may be thousands of them."""
    assert clean_name("x" * 1_000_000) == "x" * 200
    assert clean_name("Plate" + " " * 5000 + "end") == "Plate"


def test_the_name_comes_from_the_documents_label() -> None:
    """Spec §2; from the object's where its file gives several components, unless that says nothing."""
    assert proposed_name(entry("Shaft", "Gear unit")) == "Gear unit"
    assert proposed_name(entry("Shaft", "Gear unit"), shares_file=True) == "Shaft"
    assert proposed_name(entry("Body001", "Gear unit"), shares_file=True) == "Gear unit"
    assert proposed_name(entry("", "")) == "Unnamed component"


def test_a_label_that_is_only_the_files_name_gives_way() -> None:
    """FreeCAD makes the document's label from the file's name: the object's own label says more."""
    assert proposed_name(entry("Base Plate", "x")) == "Base Plate"
    assert proposed_name(entry("Body001", "x")) == "x"


def test_a_file_of_several_components_is_crowded() -> None:
    """Counted over the whole tree, each component once."""
    one, two = entry(), BomEntry("/v/x.FCStd", object_name="Other")
    alone = BomEntry("/v/y.FCStd", object_name="Body", children=(two,))
    assert crowded_files([one, alone]) == {"/v/x.FCStd"}
    assert crowded_files([one, one]) == frozenset()


def test_the_type_is_the_documents() -> None:
    """Assembly or part, as the walker found it."""
    assert propose(entry(is_assembly=True), SCHEMA).item_type == "assembly"
    assert propose(entry(), SCHEMA).item_type == "part"


@pytest.mark.parametrize(
    ("document", "is_assembly", "category"),
    [
        ("M8 bolt", False, "F01"),
        ("MainBolts", False, "F01"),
        ("Housing", False, "M01"),
        ("Gearbox", True, "A01"),
        ("Top product", False, "M01"),
    ],
)
def test_the_category_fits_the_name_and_the_type(document: str, is_assembly: bool, category: str) -> None:
    """Words of the name against the schema's, else the general part; assemblies only into theirs."""
    assert propose(entry("Body", document, is_assembly=is_assembly), SCHEMA).category == category


@pytest.mark.parametrize(("categories", "category"), [({}, ""), ({"X": "Assemblies"}, "X")])
def test_a_schema_without_a_fitting_category(categories: dict[str, str], category: str) -> None:
    """The first there is, or none: a person decides."""
    assert propose(entry("Body", "Plate"), categories).category == category


def test_the_display_name_says_something() -> None:
    """A label that FreeCAD gave gives way to the document's."""
    assert display_name(entry("Left plate", "plates")) == "Left plate"
    assert display_name(entry("Body", "Housing")) == "Housing"
    assert display_name(entry("Body", "")) == "Body"
