# SPDX-License-Identifier: LGPL-2.1-or-later
"""The part-number schemas that come with the server."""

from __future__ import annotations

import logging
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo

from silo.api.wire import ItemTexts
from silo.bom.errors import ConfigError, InputError, NotFoundError, RejectedError
from silo.bom.items.schema import CategoryRule
from silo.bom.message import message
from silo.bom.numbers import read_number
from silo.bom.quantities import plain
from silo.bom.system_refusals import why_refused
from silo_server.web_address import address_problem

DEFAULT_SCHEMA = "kindred-rd"
_log = logging.getLogger(__name__)
ITEM_TYPES = ("part", "assembly", "consumable", "tool")


@dataclass(frozen=True, slots=True)
class Category:
    """A category of a schema: ``F01``, "Screws and bolts", and what its items are by default.

    prefix, digits
        how its numbers are written: what stands before the serial, and the least digits of that.
    parent
        the code of the category above it; "" for none.
    standard
        the kinds of standard parts (screw, nut, …) that are of this category.
    """

    code: str
    name: str
    item_type: str
    domain: str
    prefix: str
    digits: int
    parent: str = ""
    standard: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PropertyField:
    """A property that the schema knows, with its checks. ``categories`` are prefixes, none = all."""

    name: str
    type: str
    label: str
    unit: str = ""
    description: str = ""
    default: str = ""
    minimum: float | None = None
    maximum: float | None = None
    pattern: str = ""
    example: str = ""
    options: tuple[str, ...] = ()
    categories: tuple[str, ...] = ()

    def fits(self, category: str | None) -> bool:
        """Return True if items of this category have the field."""
        return not self.categories or category is None or category.startswith(self.categories)

    @property
    def title(self) -> str:
        """Return the label with its unit: ``Mass [kg]``."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def read(self, text: str) -> str | int | float:
        """Read a value that somebody typed, not empty; RejectedError says what was wanted."""
        if self.type in ("number", "integer"):
            return self._number(text)
        if self.options and text not in self.options:
            raise RejectedError(
                message(
                    "{label}: wanted one of {known}, got {got}",
                    label=self.label,
                    known=", ".join(self.options),
                    got=repr(text),
                )
            )
        if self.pattern and not re.fullmatch(self.pattern, text):
            example = f" such as {self.example}" if self.example else ""
            raise RejectedError(f"{self.label}: wanted a value{example}, got {text!r}")
        if self.type == "link" and (problem := address_problem(text)):
            raise RejectedError(f"{self.label}: {problem}")
        return text

    def _number(self, text: str) -> int | float:
        reading = read_number(text)
        if reading.value is None:
            raise RejectedError(f"{self.title}: {reading.problem}")
        value = plain(reading.value)
        if self.type == "integer" and not isinstance(value, int):
            raise RejectedError(
                message("{label}: wanted a whole number, got {got}", label=self.title, got=repr(text))
            )
        low, high = self.minimum, self.maximum
        if (low is not None and value < low) or (high is not None and value > high):
            ends = [
                f"at least {low:g}" if low is not None else "",
                f"at most {high:g}" if high is not None else "",
            ]
            raise RejectedError(
                f"{self.title}: wanted a number of {' and '.join(filter(None, ends))}, got {text!r}"
            )
        return value


@dataclass(frozen=True, slots=True)
class Schema:
    """A part-number schema: the prefix of a category, and a serial that is counted for each category."""

    name: str
    version: int
    description: str
    separator: str
    serial_digits: int
    domains: Mapping[str, str]
    categories: Mapping[str, Category]
    fields: tuple[PropertyField, ...]

    def number(self, category: str, serial: int) -> str:
        """Write ``F01-0001``. A serial with more digits makes it longer; gaps are allowed everywhere."""
        of = self.categories[category]
        return f"{of.prefix}{serial:0{of.digits}d}"

    def path(self, code: str) -> str:
        """Write a category with the names above it: ``Standard parts/Screws``."""
        of = self.categories[code]
        above = f"{self.path(of.parent)}/" if of.parent else ""
        return f"{above}{of.name}"

    def named(self, text: str) -> str:
        """Find the code of a category that is named by code, name or path; "" for none, or for several."""
        if text.strip().upper() in self.categories:
            return text.strip().upper()
        wanted = text.strip().casefold()
        names = ((code, of.name, self.path(code)) for code, of in self.categories.items())
        found = {code for code, *words in names if wanted in map(str.casefold, words)}
        return found.pop() if wanted and len(found) == 1 else ""

    def category(self, code: str) -> Category:
        """Find a category by its code, in upper or lower case; RejectedError if there is none."""
        found = self.categories.get(code.strip().upper())
        if found is None:
            raise RejectedError(
                message(
                    "category: wanted a category of schema {name} (such as {examples}), got {got}; GET "
                    "/api/schemas/{name} lists them",
                    name=self.name,
                    examples=", ".join([*self.categories][:3])
                    if self.name != DEFAULT_SCHEMA
                    else "A01, F01, M01",
                    got=repr(code),
                )
            )
        return found


@cache
def schemas() -> Mapping[str, Schema]:
    """Read all schemas, by name."""
    text = resources.files("silo_server.schema").joinpath("kindred_rd.toml").read_text("utf-8")
    schema = _parse(tomllib.loads(text))
    return {schema.name: schema}


def find_schema(name: str | None) -> Schema:
    """Find the schema called ``name``, or the default one; NotFoundError if there is none."""
    wanted = name or DEFAULT_SCHEMA
    schema = schemas().get(wanted)
    if schema is None:
        raise NotFoundError(
            message(
                "schema: there is no {schema}; known are {known}",
                schema=repr(wanted),
                known=", ".join(schemas()),
            )
        )
    return schema


def _parse(raw: Mapping[str, Any]) -> Schema:
    categories = {
        code: Category(
            code,
            entry["name"],
            entry["item_type"],
            code[0],
            f"{code}{raw['separator']}",
            raw["serial_digits"],
        )
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
        fields=tuple(_parse_field(field) for field in raw["fields"]),
    )


def _parse_field(raw: Mapping[str, Any]) -> PropertyField:
    lists = {name: tuple(raw[name]) for name in ("options", "categories") if name in raw}
    return PropertyField(**{**raw, **lists})


def describe(schema: Schema) -> dict[str, Any]:
    """Describe a schema as ``GET /api/schemas/{name}`` sends it: the segments with their values."""
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
        "standard_parts": {kind: c.code for c in schema.categories.values() for kind in c.standard},
        **_described_rules(schema),
    }


def _described_rules(schema: Schema) -> dict[str, Any]:
    """Return the category rules or, if the file is wrong, none, and the problem for those who register."""
    try:
        return {"category_rules": category_rules(schema)}
    except ConfigError as error:
        _log.warning("category rules are not used: %s", error)
        return {"category_rules": [], "category_rules_problem": str(error)}


RULES = "SILO_CATEGORY_RULES"
"""Names a TOML file with the site's own rules, in place of those beside the schema."""


def category_rules(schema: Schema, env: Mapping[str, str] = os.environ) -> list[Mapping[str, Any]]:
    """Read the rules that map names of parts to categories: the site's, else those beside the schema.

    The file is read each time, so that an edit counts at once. ConfigError if the site's file is wrong, with
    all that is wrong in it. It names the file without its folder, as every designer reads it.
    """
    path = env.get(RULES)
    name = f"{RULES} ({Path(path).name})" if path else "category_rules.toml"
    try:
        source = Path(path) if path else resources.files("silo_server.schema").joinpath(name)
        text = source.read_text("utf-8")
        rules = tomllib.loads(text).get("rules", [])
    except OSError as error:
        raise ConfigError(f"{name} cannot be read: {why_refused(error)}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{name}: {error}") from error
    if not isinstance(rules, list):
        raise ConfigError(f"{name}: wanted [[rules]] with words and a category, got rules = {rules!r}")
    wrong = []
    if schema.name != DEFAULT_SCHEMA:  # rules about categories of another scheme say nothing of this one
        texts = [rule.get("category") if isinstance(rule, dict) else None for rule in rules]
        return [rule for rule, code in zip(rules, texts, strict=True) if code in schema.categories]
    for rule, where in zip(rules, _places(text, len(rules)), strict=True):
        try:
            schema.category(CategoryRule.read(rule).category)
        except (InputError, RejectedError) as error:
            wrong.append(f"{where}: {error}")
    if wrong:
        raise ConfigError(f"{name}: {'; '.join(wrong)}")
    return rules


def _places(text: str, count: int) -> list[str]:
    """Name the place of each rule in the file, for messages."""
    lines = [number for number, line in enumerate(text.splitlines(), 1) if _RULE.match(line)]
    if len(lines) != count:
        return [f"rule {number}" for number in range(1, count + 1)]
    return [f"line {number}" for number in lines]


_RULE = re.compile(r"\s*\[\[\s*[\"']?rules[\"']?\s*\]\]")


def describe_form(schema: Schema) -> dict[str, Any]:
    """Describe the form of an item: a two-stage category picker, the item's fields, and the properties."""
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


def _field(field: PropertyField) -> dict[str, Any]:
    filled = {name: value for name, value in asdict(field).items() if value not in ("", None, ())}
    return {"required": False, **filled}


def text_hints(field: FieldInfo) -> Mapping[str, Any]:
    """Return the hints of a text field for its form and its length: ``options``, ``long``, ``maxLength``."""
    hints = field.json_schema_extra
    return hints if isinstance(hints, dict) else {}


def _text_field(name: str, field: FieldInfo) -> dict[str, Any]:
    hints = text_hints(field)
    kind = "select" if "options" in hints else "text" if hints.get("long") else "string"
    field_json = {"name": name, "type": kind, "label": field.title, "required": False}
    return field_json | ({"options": hints["options"]} if "options" in hints else {})


_ITEM_FIELDS: list[dict[str, Any]] = [
    {"name": "name", "type": "string", "label": "Name", "required": True},
    {"name": "description", "type": "string", "label": "Description", "required": False},
    {"name": "item_type", "type": "select", "label": "Type", "required": False, "options": list(ITEM_TYPES)},
    *(_text_field(name, field) for name, field in ItemTexts.model_fields.items()),
]
