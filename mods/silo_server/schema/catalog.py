# SPDX-License-Identifier: LGPL-2.1-or-later
"""The part-number schemas that come with the server."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from silo.bom.errors import NotFoundError, RejectedError

DEFAULT_SCHEMA = "kindred-rd"
ITEM_TYPES = ("part", "assembly", "consumable", "tool")
SOURCING_TYPES = ("manufactured", "purchased")


@dataclass(frozen=True, slots=True)
class Category:
    """A category of a schema: ``F01``, "Screws and bolts", and what its items are by default."""

    code: str
    name: str
    item_type: str
    domain: str


@dataclass(frozen=True, slots=True)
class Schema:
    """A part-number schema: ``<category><separator><serial>``."""

    name: str
    version: int
    description: str
    separator: str
    serial_digits: int
    domains: Mapping[str, str]
    categories: Mapping[str, Category]
    fields: tuple[Mapping[str, Any], ...]

    def number(self, category: str, serial: int) -> str:
        """``F01-0001``. A serial beyond the digits simply grows; gaps are tolerated everywhere."""
        return f"{category}{self.separator}{serial:0{self.serial_digits}d}"

    def category(self, code: str) -> Category:
        """The category, in whatever case it is asked for."""
        found = self.categories.get(code.strip().upper())
        if found is None:
            raise RejectedError(
                f"category: wanted one of schema {self.name} (such as A01, F01, M01), got {code!r}; "
                f"GET /api/schemas/{self.name} lists them"
            )
        return found


@cache
def schemas() -> Mapping[str, Schema]:
    """All schemas by name."""
    text = resources.files("silo_server.schema").joinpath("kindred_rd.toml").read_text("utf-8")
    schema = _parse(tomllib.loads(text))
    return {schema.name: schema}


def find_schema(name: str | None) -> Schema:
    """The schema called ``name``, or the default one; NotFoundError otherwise."""
    wanted = name or DEFAULT_SCHEMA
    found = schemas().get(wanted)
    if found is None:
        raise NotFoundError(f"schema: there is no {wanted!r}; known are {', '.join(schemas())}")
    return found


def _parse(raw: Mapping[str, Any]) -> Schema:
    categories = {
        code: Category(code, entry["name"], entry["item_type"], code[0])
        for code, entry in raw["categories"].items()
    }
    return Schema(
        name=raw["name"],
        version=raw["version"],
        description=raw["description"],
        separator=raw["separator"],
        serial_digits=raw["serial_digits"],
        domains=raw["domains"],
        categories=categories,
        fields=tuple(raw["fields"]),
    )


def describe(schema: Schema) -> dict[str, Any]:
    """The schema as ``GET /api/schemas/{name}`` tells it: the segments with their values."""
    values = {category.code: category.name for category in schema.categories.values()}
    return {
        "name": schema.name,
        "version": schema.version,
        "description": schema.description,
        "separator": schema.separator,
        "uniqueness": {"scope": "global", "case_sensitive": False},
        "segments": [
            {"name": "category", "type": "enum", "required": True, "values": values},
            {"name": "sequence", "type": "serial", "length": schema.serial_digits, "scope": "category"},
        ],
        "domains": dict(schema.domains),
    }


def describe_form(schema: Schema) -> dict[str, Any]:
    """The form descriptor: a two-stage category picker, the item's fields, and the property fields."""
    return {
        "schema": schema.name,
        "category_picker": {
            "stages": [{"name": "domain"}, {"name": "category"}],
            "domains": [_describe_domain(schema, code, label) for code, label in schema.domains.items()],
        },
        "item_fields": _ITEM_FIELDS,
        "field_groups": [
            {"name": "properties", "label": "Properties", "fields": [_field(f) for f in schema.fields]}
        ],
    }


def _describe_domain(schema: Schema, code: str, label: str) -> dict[str, Any]:
    members = [c for c in schema.categories.values() if c.domain == code]
    return {
        "code": code,
        "label": label,
        "categories": [{"code": c.code, "label": c.name, "item_type": c.item_type} for c in members],
    }


def _field(raw: Mapping[str, Any]) -> dict[str, Any]:
    return {"required": False, **raw}


_ITEM_FIELDS: list[dict[str, Any]] = [
    {"name": "name", "type": "string", "label": "Name", "required": True},
    {"name": "description", "type": "string", "label": "Description", "required": False},
    {"name": "item_type", "type": "select", "label": "Type", "required": False, "options": list(ITEM_TYPES)},
    {
        "name": "sourcing_type",
        "type": "select",
        "label": "Sourcing",
        "required": False,
        "options": list(SOURCING_TYPES),
    },
    {"name": "long_description", "type": "text", "label": "Long description", "required": False},
]
