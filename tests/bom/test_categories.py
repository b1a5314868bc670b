# SPDX-License-Identifier: LGPL-2.1-or-later
"""Categories for components: no assembly's for a part, guesses known as such, and the site's own rules."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from silo.api.items import categories_of, rules_of
from silo.bom.categories import Categories, Rule, assembly_categories, proposed_category
from silo.bom.errors import ConfigError, InputError
from silo.bom.model import BomEntry
from silo_server.schema.catalog import RULES, category_rules, describe, find_schema

SCHEMA = describe(find_schema(None))
KNOWN = Categories(categories_of(SCHEMA), rules_of(SCHEMA))
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
    known = Categories(KNOWN, map(Rule.read, rules))
    assert proposed_category(PART, "TopPlate", known).code == "M02"
    assert proposed_category(PART, "Cover plate", known).code == "S01"
    assert proposed_category(ASSEMBLY, "Top", known).code == "A05"


@pytest.mark.parametrize("raw", ["text", {}, {"words": "a", "category": "A"}, {"words": ["a"], "kind": 1}])
def test_a_rule_that_is_none_is_refused(raw: object) -> None:
    """In plain words; a server's is passed over."""
    with pytest.raises(InputError, match="category rule"):
        Rule.read(raw)
    assert rules_of({"category_rules": [raw, {"words": ["top"], "category": "S01"}]}) == (
        Rule("S01", frozenset({"top"})),
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
