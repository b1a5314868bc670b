# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables of materials in files: the package's own, and a user's CSV or TOML."""

from __future__ import annotations

import csv
import io
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any

from silo.bom.errors import ConfigError
from silo.bom.message import message
from silo.bom.numbers import parse_number
from silo.bom.system_refusals import why_refused
from silo.inertia.materials.densities import UNIT_NEEDED_BELOW, density_factor, read_density
from silo.inertia.materials.material import Material
from silo.inertia.materials.words import Words, words


@cache
def package_rows() -> tuple[Material, ...]:
    """Read the table that comes with the package (``materials/table.csv``)."""
    text = (files(__package__) / "table.csv").read_text("utf-8")
    return _csv_rows(text, "table.csv")


@cache
def plain_densities() -> Mapping[str, float]:
    """Return the package's table as name → density [kg/m^3], aliases included."""
    rows = {row.name: row.density for row in package_rows()}
    aliases = {alias: row.density for row in package_rows() for alias in row.aliases}
    return MappingProxyType({**aliases, **rows, "default": 1000.0})


def user_rows(path: Path | str) -> tuple[Material, ...]:
    """Read a user's table; its suffix is the format.

    ``.csv``: columns ``name``, ``density`` (kg/m^3, or as the header says: ``density (g/cm3)``; a cell may
    have its own unit), optional ``aliases`` (separated by ``;``), ``source``, ``family``, ``spread`` (by how
    many percent the density varies). ``.toml``: ``[materials]`` with ``"My alloy" = 2810``, ``= "2.81
    g/cm3"`` or ``= { density = …, aliases = […] }``.

    All bad rows are reported together, in one ConfigError.
    """
    path = Path(path)
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            message(
                "{path}: the material table cannot be read ({error})", path=path, error=why_refused(error)
            )
        ) from error
    if path.suffix.lower() == ".csv":
        return _csv_rows(text, str(path))
    if path.suffix.lower() == ".toml":
        return _checked(_toml_records(text, str(path)), None, str(path))
    raise ConfigError(message("{path}: a material table is a .csv or .toml file", path=path))


_Record = tuple[str, Mapping[str, Any]]
"""Where a row stands, and its cells."""


def _csv_rows(text: str, source: str) -> tuple[Material, ...]:
    first = text.partition("\n")[0]
    reader = csv.DictReader(io.StringIO(text), delimiter=";" if ";" in first and "," not in first else ",")
    heads: dict[str, str] = {}
    for head in sorted(filter(None, reader.fieldnames or ()), key=len):  # "name" goes before "name_de"
        heads.setdefault(re.sub(r"[\W_].*", "", head.strip()).casefold(), head)
    if not {"name", "density"} <= heads.keys():
        raise ConfigError(
            message(
                "{source}: wanted columns “name” and “density”, got {fieldnames}",
                source=source,
                fieldnames=reader.fieldnames,
            )
        )
    # "density (g/cm3)", "Density [g/cm3]", "density_g/cm3": everything after the word is the unit.
    unit = heads["density"].strip()[len("density") :].strip(" _:,-()[]")
    factor = density_factor(unit) if unit else None
    if unit and factor is None:
        raise ConfigError(
            message(
                "{source}: unknown density unit in the header “{heads}”",
                source=source,
                heads=heads["density"],
            )
        )
    records = (
        (
            message("line {line_num}", line_num=reader.line_num),
            {key: record.get(head) or "" for key, head in heads.items()},
        )
        for record in reader
    )
    return _checked(records, factor, source)


def _where(error: tomllib.TOMLDecodeError) -> str:
    """Say in which line a TOML text is wrong."""
    place = re.search(r"line (\d+), column (\d+)", str(error))
    if place is None:
        return message("its end is missing")
    return message("line {line}, column {column}", line=place[1], column=place[2])


def _toml_records(text: str, source: str) -> Iterator[_Record]:
    try:
        table = tomllib.loads(text).get("materials", {})
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(
            message("{source}: this is not valid TOML ({where})", source=source, where=_where(error))
        ) from error
    if not isinstance(table, dict) or not table:
        raise ConfigError(message("{source}: wanted a table [materials] with name = density", source=source))
    for name, value in table.items():
        given = value if isinstance(value, dict) else {"density": value}
        yield f"materials.{name}", {**given, "name": name}


def _checked(records: Iterable[_Record], factor: float | None, source: str) -> tuple[Material, ...]:
    """Check the rows. ``factor``: kg/m^3 per unit of the header, None if it states no unit."""
    rows: list[Material] = []
    problems: list[str] = []
    for where, cells in records:
        row = _material(cells, factor, source)
        if isinstance(row, str):
            problems.append(message("{where}: {row}", where=where, row=row))
        else:
            rows.append(row)
    seen: dict[Words, Material] = {}
    for row in rows:
        for alias in (row.name, *row.aliases):
            other = seen.setdefault(words(alias), row)
            if other is not row and other.density != row.density:
                problems.append(
                    message(
                        "“{alias}” has two densities, {density} and {other_density} kg/m³",
                        alias=alias,
                        density=f"{other.density:g}",
                        other_density=f"{row.density:g}",
                    )
                )
    if problems:
        raise ConfigError(message("{source}: ", source=source) + "; ".join(problems))
    return tuple(rows)


def _material(cells: Mapping[str, Any], factor: float | None, source: str) -> Material | str:
    """Read a row, or say what is wrong with it."""
    name, density, spread = (str(cells.get(key, "")).strip() for key in ("name", "density", "spread"))
    if not name:
        return message("wanted a name, got none for the density “{density}”", density=density)
    cell = read_density(density, factor or 1.0)
    if not cell.has_unit and factor is None and _is_below(density, UNIT_NEEDED_BELOW):
        return message(
            "“{name}” has the density {density} without a unit; as kg/m³ it would be lighter "
            "than a foam. Write “{density} g/cm3” or “{density} kg/m3”",
            name=name,
            density=density,
        )
    if cell.value is None:
        return message("the density of “{name}”: {problem}", name=name, problem=cell.problem)
    percent = parse_number(spread.removesuffix("%") or "0")
    if percent is None or not 0 <= percent.value < 100:
        return message(
            "the spread of “{name}”: wanted 0 to 100 percent, got “{spread}”", name=name, spread=spread
        )
    given = cells.get("aliases", "")
    if not isinstance(given, str | list):
        return message(
            "the aliases of “{name}”: wanted a list of names, got “{given}”", name=name, given=given
        )
    aliases = given.split(";") if isinstance(given, str) else map(str, given)
    return Material(
        name,
        cell.value,
        tuple(filter(None, (alias.strip() for alias in aliases))),
        str(cells.get("source", "")).strip() or source,
        str(cells.get("family", "")).strip(),
        percent.value / 100,
    )


def _is_below(text: str, limit: float) -> bool:
    number = parse_number(text)
    return number is not None and not number.ambiguous and 0 < number.value < limit
