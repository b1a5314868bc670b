# SPDX-License-Identifier: LGPL-2.1-or-later
"""Material rows from files: the package's table, a user's CSV or TOML."""

from __future__ import annotations

import csv
import io
import re
import tomllib
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from silo.bom.errors import ConfigError
from silo.bom.numbers import parse_number
from silo.inertia.materials.density import UNIT_NEEDED_BELOW, read_density, unit_factor
from silo.inertia.materials.table import Material
from silo.inertia.materials.words import Words, words


@cache
def package_rows() -> tuple[Material, ...]:
    """The table that comes with the package (``materials/table.csv``)."""
    text = (files("silo.inertia.materials") / "table.csv").read_text("utf-8")
    return _csv_rows(text, "table.csv")


def user_rows(path: Path | str) -> tuple[Material, ...]:
    """A user's table, by suffix.

    ``.csv``: columns ``name``, ``density`` (kg/m^3, or as the header says: ``density (g/cm3)``; a cell may
    carry its own unit), optional ``aliases`` (separated by ``;``), ``source``, ``family``.
    ``.toml``: ``[materials]`` with ``"My alloy" = 2810``, ``= "2.81 g/cm3"`` or
    ``= { density = …, aliases = […] }``.

    All bad rows are reported together, in one ConfigError.
    """
    path = Path(path)
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: the material table cannot be read ({error})") from error
    if path.suffix.lower() == ".csv":
        return _csv_rows(text, str(path))
    if path.suffix.lower() == ".toml":
        return _toml_rows(text, str(path))
    raise ConfigError(f"{path}: a material table is a .csv or .toml file")


def _csv_rows(text: str, source: str) -> tuple[Material, ...]:
    first = text.partition("\n")[0]
    reader = csv.DictReader(io.StringIO(text), delimiter=";" if ";" in first and "," not in first else ",")
    heads = {re.sub(r"[\s(\[].*", "", head).casefold(): head for head in reader.fieldnames or () if head}
    if not {"name", "density"} <= heads.keys():
        raise ConfigError(f"{source}: wanted columns “name” and “density”, got {reader.fieldnames}")
    unit = re.search(r"[(\[](.+)[)\]]", heads["density"])
    factor = unit_factor(unit[1]) if unit else 1.0
    if factor is None:
        raise ConfigError(f"{source}: unknown density unit in the header “{heads['density']}”")
    rows: list[Material] = []
    problems: list[str] = []
    for record in reader:
        cells = {key: (record.get(head) or "").strip() for key, head in heads.items()}
        row = _material(
            cells["name"],
            cells["density"],
            [alias.strip() for alias in cells.get("aliases", "").split(";") if alias.strip()],
            cells.get("source", "") or source,
            cells.get("family", ""),
            factor if unit else None,
        )
        if isinstance(row, str):
            problems.append(f"line {reader.line_num}: {row}")
        else:
            rows.append(row)
    return _checked(rows, problems, source)


def _toml_rows(text: str, source: str) -> tuple[Material, ...]:
    try:
        table = tomllib.loads(text).get("materials", {})
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{source}: this is no TOML ({error})") from error
    if not isinstance(table, dict) or not table:
        raise ConfigError(f"{source}: wanted a table [materials] with name = density")
    rows: list[Material] = []
    problems: list[str] = []
    for name, value in table.items():
        given: dict[str, Any] = value if isinstance(value, dict) else {"density": value}
        aliases = given.get("aliases", [])
        row = _material(
            str(name),
            str(given.get("density", "")),
            [str(alias) for alias in aliases] if isinstance(aliases, list) else [],
            str(given.get("source", source)),
            str(given.get("family", "")),
            None,
        )
        if isinstance(row, str):
            problems.append(f"materials.{name}: {row}")
        else:
            rows.append(row)
    return _checked(rows, problems, source)


def _material(
    name: str, density: str, aliases: list[str], source: str, family: str, factor: float | None
) -> Material | str:
    """``factor``: kg/m^3 per unit of the header, None where it states none. What is wrong, in words, else."""
    if not name:
        return f"wanted a name, got none for the density “{density}”"
    cell = read_density(density, factor or 1.0)
    if not cell.has_unit and factor is None and _is_below(density, UNIT_NEEDED_BELOW):
        return (
            f"“{name}” has the density {density} without a unit; as kg/m³ it would be lighter than a foam. "
            f"Write “{density} g/cm3” or “{density} kg/m3”"
        )
    if cell.value is None:
        return f"the density of “{name}”: {cell.problem}"
    return Material(name, cell.value, tuple(aliases), source, family)


def _is_below(text: str, limit: float) -> bool:
    number = parse_number(text)
    return number is not None and not number.ambiguous and 0 < number.value < limit


def _checked(rows: list[Material], problems: list[str], source: str) -> tuple[Material, ...]:
    seen: dict[Words, Material] = {}
    for row in rows:
        for alias in (row.name, *row.aliases):
            other = seen.setdefault(words(alias), row)
            if other is not row and other.density != row.density:
                problems.append(f"“{alias}” has two densities, {other.density:g} and {row.density:g} kg/m³")
    if problems:
        raise ConfigError(f"{source}: " + "; ".join(problems))
    return tuple(rows)
