# SPDX-License-Identifier: LGPL-2.1-or-later
"""The packaged part-number schema."""

from __future__ import annotations

import re

import pytest

from silo.bom.errors import NotFoundError, RejectedError
from silo_server.schema import ITEM_TYPES, describe_form, find_schema, schemas


def test_kindred_rd_has_the_known_categories() -> None:
    """Those that the real schema is known to have, under their names (silo-contract §2)."""
    categories = find_schema("kindred-rd").categories
    assert {code: categories[code].name for code in ("F01", "F02", "F03", "F04", "R27", "S05")} == {
        "F01": "Screws and bolts",
        "F02": "Threaded rods",
        "F03": "Eyebolts",
        "F04": "U-bolts",
        "R27": "Servo motors",
        "S05": "T-slot extrusions",
    }


def test_every_category_fits_its_domain_and_a_type() -> None:
    """Letter and two digits; a domain that is named; a type that items can have; assemblies are A."""
    for schema in schemas().values():
        for category in schema.categories.values():
            assert re.fullmatch(r"[A-Z]\d\d", category.code)
            assert category.domain in schema.domains
            assert category.item_type in ITEM_TYPES
            assert (category.item_type == "assembly") == (category.domain == "A")
        assert {c.domain for c in schema.categories.values()} == set(schema.domains)


def test_numbers() -> None:
    """Four digits, more when they run out."""
    schema = find_schema(None)
    assert schema.number("F01", 1) == "F01-0001"
    assert schema.number("F01", 12345) == "F01-12345"


def test_what_is_not_there() -> None:
    """Unknown names say what there is."""
    with pytest.raises(NotFoundError, match="kindred-rd"):
        find_schema("other")
    with pytest.raises(RejectedError, match="such as A01"):
        find_schema(None).category("Z00")
    assert find_schema(None).category(" f01 ").code == "F01"


def test_the_form_offers_every_category_once() -> None:
    """Domain, then category."""
    schema = find_schema(None)
    domains = describe_form(schema)["category_picker"]["domains"]
    codes = [category["code"] for domain in domains for category in domain["categories"]]
    assert sorted(codes) == sorted(schema.categories)
