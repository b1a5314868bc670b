# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is proposed for a component that has no item yet (spec §2, §6)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from silo.bom.entry import BomEntry
from silo.bom.errors import ConfigError, InputError
from silo.bom.items.categories import assembly_categories, proposed_category
from silo.bom.items.naming import display_name, proposed_name
from silo.bom.items.proposal import crowded_files, propose
from silo.bom.items.schema import Categories, CategoryRule, categories_of, rules_of
from silo.bom.text import clean_name
from silo_server.schema import RULES, category_rules, describe, find_schema

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


SHIPPED = describe(find_schema(None))
KNOWN = Categories(categories_of(SHIPPED), rules_of(SHIPPED))
PART, ASSEMBLY = BomEntry("/v/x.FCStd"), BomEntry("/v/x.FCStd", is_assembly=True)


@pytest.mark.parametrize(
    ("name", "category", "sure"),
    [
        ("TorsoTopPlate", "S01", True),
        ("MotorFrame", "M06", True),
        ("Motor frame", "M06", True),
        ("M8x20 bolts", "F01", True),
        ("SensorBracket", "S06", True),
        ("Ball bearing", "R01", True),
        ("Motor", "R25", False),  # a DC motor, a stepper or a servo?
        ("MotorCover", "R25", False),
        ("Thing", "M01", False),
        ("TopLevel", "M01", False),
        ("42", "M01", False),
    ],
)
def test_a_part_gets_a_category_of_parts(name: str, category: str, sure: bool) -> None:
    """By its last word; what a word further in front says is a guess."""
    guess = proposed_category(PART, name, KNOWN)
    assert guess.is_sure is sure
    assert guess.code == category if sure else guess.code not in assembly_categories(KNOWN)


@pytest.mark.parametrize("name", ["Top", "Product", "TopLevelProduct", "Level", "AssemblyPlate"])
def test_no_part_is_an_assembly(name: str) -> None:
    """Whatever it is called."""
    assert not proposed_category(PART, name, KNOWN).code.startswith("A")
    assert proposed_category(ASSEMBLY, name, KNOWN).code.startswith("A")


def test_top_level_product_stands_among_the_assemblies() -> None:
    """By its letter, for its name does not say so; one word does not make a whole letter assemblies."""
    assert assembly_categories(KNOWN) == {"A01", "A02", "A03", "A04", "A05"}
    mixed = {"P1": "Plates", "P2": "Press assemblies", "P3": "Pins"}
    assert assembly_categories(mixed) == {"P2"}


def test_a_rule_of_the_site_comes_first() -> None:
    """All of its words, none of the others; a rule for a category that does not fit is passed over."""
    rules = [
        {"words": ["top"], "category": "A05"},
        {"words": ["plates"], "without": ["cover"], "category": "M02"},
    ]
    known = Categories(KNOWN, map(CategoryRule.read, rules))
    assert proposed_category(PART, "TopPlate", known).code == "M02"
    assert proposed_category(PART, "Cover plate", known).code == "S01"
    assert proposed_category(ASSEMBLY, "Top", known).code == "A05"


@pytest.mark.parametrize("raw", ["text", {}, {"words": "a", "category": "A"}, {"words": ["a"], "kind": 1}])
def test_a_rule_that_is_none_is_refused(raw: object) -> None:
    """In plain words; a server's is passed over."""
    with pytest.raises(InputError, match="category rule"):
        CategoryRule.read(raw)
    assert rules_of({"category_rules": [raw, {"words": ["top"], "category": "S01"}]}) == (
        CategoryRule("S01", frozenset({"top"})),
    )


@pytest.mark.parametrize("said", [None, "x", {"a": 1}, []])
def test_a_server_without_rules(said: object) -> None:
    """The real Silo has none."""
    schema: Mapping[str, object] = {"category_rules": said}
    assert rules_of(schema) == ()


def test_the_sites_file_is_read_anew(tmp_path: Path) -> None:
    """An edit counts at once; a mistake names the file."""
    file = tmp_path / "rules.toml"
    env = {RULES: str(file)}
    schema = find_schema(None)
    with pytest.raises(ConfigError, match="cannot be read"):
        category_rules(schema, env)
    file.write_text('[[rules]]\nwords = ["frame"]\ncategory = "S05"\n')
    assert category_rules(schema, env) == [{"words": ["frame"], "category": "S05"}]
    assert category_rules(schema, {})


GOOD = '[[rules]]\nwords = ["frame"]\ncategory = "S05"\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[rules", "at end of document"),
        (GOOD + "without = glass\n", "line 4"),
        ("rules = 3", "wanted [[rules]] with words and a category, got rules = 3"),
        (GOOD + "\n\n" + GOOD.replace("S05", "Z99"), "line 6: "),
        ('rules = [{words = ["a"], category = "S05"}, 7]', "rule 2: category rule: wanted a table"),
        (
            GOOD.replace("S05", "Z9") + GOOD.replace("words", "word"),
            "line 4: category rule: unknown keys: word",
        ),
        (GOOD.replace("S05", "Z9") + GOOD.replace("words", "word"), "line 1: "),
    ],
)
def test_a_mistake_names_the_file_and_the_line(tmp_path: Path, text: str, said: str) -> None:
    """All of them at once, and not the folder of the server's disk."""
    file = tmp_path / "rules.toml"
    file.write_text(text)
    with pytest.raises(ConfigError) as wrong:
        category_rules(find_schema(None), {RULES: str(file)})
    assert f"{RULES} (rules.toml)" in str(wrong.value)
    assert said in str(wrong.value)
    assert str(tmp_path) not in str(wrong.value)


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    """An error with a reason, too."""
    (tmp_path / "rules.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match="utf-8"):
        category_rules(find_schema(None), {RULES: str(tmp_path / "rules.toml")})


STANDARDS = {
    "ISO 4762 M4×16": "F01",
    "ASME B18.3.1A 1/4in": "F01",
    "ISO 4032 M4": "F05",
    "ASME B18.2.2.1A 1/4in": "F05",
    "Tee nut 4PWTI M4": "F05",
    "PEM press nut M4": "F05",
    "IUT heat insert M3": "F07",
    "PCB standoff M3": "F07",
    "PCB spacer M3": "F07",
    "ISO 7089 M4": "F06",
    "ISO 2338 4×20": "F08",
    "DIN 471 10": "F10",
    "Threaded rod M6": "F02",
    "DIN 580 M8": "F03",
    "SAE USS 1/4in": "F06",
}


@pytest.mark.parametrize("designation", STANDARDS)
def test_a_standard_part_gets_the_category_of_its_kind(designation: str) -> None:
    """Numbers are forever: a nut was registered, checked and certain, as a screw."""
    guess = proposed_category(standard(designation), designation, shipped())
    assert (guess.code, guess.is_sure) == (STANDARDS[designation], True)


def shipped() -> Categories:
    schema = describe(find_schema(None))
    return Categories(categories_of(schema), rules_of(schema))


def standard(designation: str) -> BomEntry:
    return BomEntry("a.FCStd", object_name="o", standard=designation)


@pytest.mark.parametrize(
    ("known", "code", "sure"),
    [
        ({"S": "Screws", "P": "Parts"}, "S", False),
        ({"P": "Parts", "N": "Wing nuts", "M": "Nuts"}, "N", False),
        ({"F": "Fasteners", "P": "Parts"}, "F", True),
        ({"S": "Screws", "N": "Nuts"}, "N", True),
    ],
)
def test_a_nut_where_no_category_or_several_are_for_nuts(
    known: dict[str, str], code: str, sure: bool
) -> None:
    guess = proposed_category(standard("ISO 4032 M4"), "ISO 4032 M4", known)
    assert (guess.code, guess.is_sure) == (code, sure)


def test_the_site_decides_about_kinds_by_its_rules() -> None:
    """As about names: a rule with the word of the kind."""
    known = Categories({"S": "Screws", "N": "Nuts", "B": "Bought"}, [CategoryRule("B", frozenset({"nut"}))])
    assert proposed_category(standard("ISO 4032 M4"), "ISO 4032 M4", known).code == "B"
    assert proposed_category(standard("ISO 4762 M4×16"), "", known).code == "S"


def test_a_standard_of_no_known_kind_is_no_screw_for_certain() -> None:
    assert not proposed_category(standard("NF E27-619 5"), "", shipped()).is_sure
