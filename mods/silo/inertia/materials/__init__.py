# SPDX-License-Identifier: LGPL-2.1-or-later
"""Material texts → densities: the package's table with its sources, a user's on top, FreeCAD's cards behind.

Texts are compared by whole words. "Aluminum - 6061" is aluminium; "PCB FR4" is not PC. A material inside a
longer text is judged by the words around it (``words.toml``):

* platings and coats are left out: "zinc plated steel" is steel, and "zinc plated" alone is nothing;
* fills, percentages and compounds make something else of it: "PLA, 20 %", "bronzefill PLA", "lead free";
* colours, forms, treatments and grades say nothing about a density: "6061-T6 plate, black anodized";
* any other word makes the answer a guess: "tin can" may be tin, and may be a can.
"""

from __future__ import annotations

import csv
import hashlib
import io
import math
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from silo.bom.errors import ConfigError, InputError
from silo.bom.numbers import LONGEST, parse_number, plain_text, read_number
from silo.bom.quantities import plain
from silo.freecads import material_folders
from silo.inertia.bom.mass_cell import MASS_UNITS
from silo.inertia.matching import Suggester

if TYPE_CHECKING:
    MATERIAL_DENSITIES: Mapping[str, float]


@cache
def _densities() -> Mapping[str, float]:
    rows = {row.name: row.density for row in package_rows()}
    aliases = {alias: row.density for row in package_rows() for alias in row.aliases}
    return MappingProxyType({**aliases, **rows, "default": 1000.0})


def __getattr__(name: str) -> Any:
    # The spec's table as plain values [kg/m^3], aliases included; made when somebody wants it.
    if name == "MATERIAL_DENSITIES":
        return _densities()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


@dataclass(frozen=True)
class Material:
    """One material.

    density
        [kg/m^3] at room temperature; it varies by ± ``spread`` of itself between kinds of the material.
    family
        the more general row, or "".
    """

    name: str
    density: float
    aliases: tuple[str, ...] = ()
    source: str = ""
    family: str = ""
    spread: float = 0.0


@dataclass(frozen=True)
class MaterialHit:
    """A material text that was understood; ``doubt`` says why it may mean another material, or is empty."""

    material: Material
    doubt: str = ""


@dataclass(frozen=True)
class MaterialMiss:
    """A material text that was not understood, and why, in words that end a sentence.

    nearest
        the material that it may mean, for a person to decide; None if nothing is near.
    """

    reason: str
    nearest: Material | None = None

    @property
    def advice(self) -> str:
        """Return the reason, with the nearest material if there is one."""
        if self.nearest is None:
            return self.reason
        return f"{self.reason} (the nearest is {self.nearest.name}, {self.nearest.density:g} kg/m³)"


@dataclass(frozen=True, eq=False)
class MaterialTable:
    """Looks densities up. ``layers``: rows by rank, the first wins; ``cards``: read only when needed."""

    layers: Sequence[Sequence[Material]]
    cards: Callable[[], Sequence[Material]] = field(default=lambda: ())
    _known: dict[str, MaterialHit | MaterialMiss] = field(default_factory=dict, init=False, repr=False)

    def find(self, text: str) -> MaterialHit | MaterialMiss:
        """Find the material that ``text`` names: first an equal name, then whole words, then the name of a
        FreeCAD card.

        It never uses parts of words, nor similarity. A card fills a gap of the tables; it replaces a guess by
        one word, but never what the tables know.
        """
        if text not in self._known:
            self._known[text] = self._look_up(text)
        return self._known[text]

    def _look_up(self, text: str) -> MaterialHit | MaterialMiss:
        tokens = words(text)
        if not tokens:
            return MaterialMiss("it names nothing")
        answer = self._index.find(tokens)
        if isinstance(answer, MaterialHit) and not answer.doubt:
            return answer
        card = self._cards_by_words.get(tokens)
        if card is None:
            return answer
        if isinstance(answer, MaterialMiss) or card.density == answer.material.density:
            return MaterialHit(card)
        doubt = (
            f"{answer.doubt}; a FreeCAD card on this machine has that name, and its {card.density:g} kg/m³ "
            f"were used instead of the {answer.material.density:g} kg/m³ of {answer.material.name}"
        )
        return MaterialHit(card, doubt)

    @cached_property
    def _index(self) -> _Index:
        return _Index([row for rows in self.layers for row in rows])

    @cached_property
    def _cards_by_words(self) -> dict[Words, Material]:
        return {words(alias): card for card in self.cards() for alias in (card.name, *card.aliases)}


class _Index:
    """Rows by the words of their names and aliases; of two with the same words the first wins."""

    def __init__(self, rows: Sequence[Material]) -> None:
        self.exact: dict[Words, Material] = {}
        self._family: dict[str, str] = {}
        for row in rows:
            self._family.setdefault(row.name, row.family)
            for alias in (row.name, *row.aliases):
                key = words(alias)
                if key:
                    self.exact.setdefault(key, row)
        self._joined = {"".join(key): row for key, row in reversed(self.exact.items())}
        self._suggester = Suggester((" ".join(key) for key in self.exact), budget=1_000_000)
        self._single = frozenset(key[0] for key in self.exact if len(key) == 1)

    def find(self, tokens: Words) -> MaterialHit | MaterialMiss:
        equal = self.exact.get(tokens)
        if equal is None and not (joined := "".join(tokens)).isdecimal():
            equal = self._joined.get(joined)  # "GG-25", "AISI316L"
        if equal is not None:
            return MaterialHit(equal)
        text = _uncovered(tokens, self._single)
        hits = self._hits(text)
        named: dict[str, Material] = {}
        for _, _, row in hits:
            named.setdefault(row.name, row)
        general = {ancestor for name in named for ancestor in self._ancestors(name)}
        left = [row for name, row in named.items() if name not in general]
        if not left:
            return self._nothing(tokens, text)
        covered = {index for start, end, _ in hits for index in range(start, end)}
        rest = tuple(word for index, word in enumerate(text) if index not in covered)
        turn = next((w for w in rest if w in _MEANING["compound"] or _COMPOUND_SHAPES.fullmatch(w)), None)
        if turn is not None:
            return MaterialMiss(f"“{turn}” makes it something else than {left[0].name}", left[0])
        if len({row.density for row in left}) > 1:
            return MaterialMiss("it names more than one material: " + " and ".join(row.name for row in left))
        start, end = next((start, end) for start, end, row in hits if row is left[0])
        doubt = _contradiction(left[0].name, text[start:end], left[0].density, tokens, rest)
        strange = _not_understood(rest)
        if strange and not doubt:
            doubt = f"“{' '.join(strange)}” in it is not understood, and may make it another material"
        return MaterialHit(left[0], doubt)

    def _hits(self, text: Words) -> list[tuple[int, int, Material]]:
        hits = [
            (starts[0], starts[0] + len(key), row)
            for key, row in self.exact.items()
            if (starts := [i for i in range(len(text)) if text[i : i + len(key)] == key])
        ]
        # "stainless steel" in a text covers "steel" in it.
        return [
            (start, end, row)
            for start, end, row in hits
            if not any(a <= start and end <= b and b - a > end - start for a, b, _ in hits)
        ]

    def _nothing(self, tokens: Words, text: Words) -> MaterialMiss:
        if text != tokens and not _not_understood(text):
            # Most parts of which only the plating is known are of steel.
            reason = "it names what lies on the part, and not what the part is made of"
            return MaterialMiss(reason, self.exact.get(("steel",)))
        return MaterialMiss("it is in no table", self._alike(tokens))

    def _alike(self, tokens: Words) -> Material | None:
        """Find the row with the most similar spelling and the same digits, since 6063 is another alloy than
        6061.
        """
        wanted = " ".join(tokens)
        near = self._suggester.near(wanted, 1) if len(wanted) > 3 else ()  # "Air" is not like "acier"
        return self.exact[tuple(near[0].split())] if near else None

    def _ancestors(self, name: str) -> set[str]:
        ancestors: set[str] = set()
        above = self._family.get(name, "")
        while above and above not in ancestors:
            ancestors.add(above)
            above = self._family.get(above, "")
        return ancestors


def load_materials(paths: Iterable[Path | str] = (), *, freecad: bool = True) -> MaterialTable:
    """Load the usual table with the user tables at ``paths``, of which the last one wins; ``freecad``: and
    the cards of installed FreeCADs.
    """
    layers = [user_rows(path) for path in paths]
    layers.reverse()
    return MaterialTable((*layers, package_rows()), installed_cards if freecad else lambda: ())


# What the words of a text mean

Words = tuple[str, ...]

# A number keeps its point (1.4301, A356.0); percent signs and marks of doubt count; all else separates.
_WORD = re.compile(r"[^\W_]+(?:\.\d+)*|[%?~≈]")

_MEANING = {
    kind: frozenset(text.split())
    for kind, text in tomllib.loads((files(__package__) / "words.toml").read_text("utf-8")).items()
}
_COMPOUND_SHAPES = re.compile(
    r"\d*(?:ca|cf|gb|gf|gk|gl|md|mf|td)\d{1,2}|\d{1,2}(?:ca|cf|gb|gf|gk|gl)|t[1-4]0"
    r"|%|\w+fills?|\w+filled|\w+gefüllt|\w+verstärkt|\w+schaum"
)
_FINISHES = (("black", "oxide"), ("oxide", "finish"), ("hot", "dip"), ("hot", "dipped"))


def words(text: str) -> Words:
    """Split a material's name into words of plain characters, case-folded; a percent sign is a word."""
    # The only symbol that is another material without its capitals.
    return tuple(_WORD.findall(plain_text(re.sub(r"\bTiN\b", "titanium nitride", text)).casefold()))


def _uncovered(text: Words, covered: Set[str]) -> Words:
    """Leave out platings: ("zinc", "plated", "steel") → ("steel",), ("zinc", "plated") → ().

    covered
        words that name a material by themselves.
    """
    kept: list[str] = []
    with_what = False
    for index, word in enumerate(text):
        if (
            with_what
            and word not in _MEANING["thick"]
            and (word in covered or word in _MEANING["coat"] or word in _MEANING["with"])
        ):
            continue
        with_what = word in _MEANING["covered"] and bool(_MEANING["with"] & set(text[index + 1 : index + 2]))
        if word in _MEANING["cover"] or (kept and (kept[-1], word) in _FINISHES):
            if word not in _MEANING["cover"]:
                kept.pop()
        elif word in _MEANING["covered"]:
            if (
                kept
                and not with_what
                and kept[-1] not in _MEANING["thick"]
                and (kept[-1] in covered | _MEANING["coat"])
            ):
                kept.pop()
        else:
            kept.append(word)
    return tuple(kept)


def _not_understood(rest: Words) -> Words:
    """Return the words that may mean another material: those that are no colour, form, treatment or grade."""
    return tuple(
        word
        for word in rest
        if word in "?~≈"
        or (len(word) > 1 and word not in _MEANING["harmless"] and not re.search(r"\d", word))
    )


def _contradiction(name: str, hit: Words, density: float, text: Words, rest: Words) -> str:
    """Say why the words around a material contradict it, as the end of a sentence; "" if they do not.

    name, hit, density
        the material, the words by which it was found, and its density [kg/m^3].
    text, rest
        all words, and those that are neither ``hit`` nor platings.
    """
    words_around = set(rest)
    for kind, wrong in ((_MEANING["plastic"], density > 2300), (_MEANING["metal"], density < 1700)):
        if wrong and kind & words_around:
            return f"“{min(kind & words_around)}” in it does not fit {name}"
    if (
        len(hit) == 1
        and hit[0] in _MEANING["colour metal"]
        and (_MEANING["hue"] & words_around or _MEANING["dyed"] & set(text))
    ):
        return f"“{hit[0]}” in it may be a colour"
    if name in _MEANING["pure"] and rest:
        return f"“{' '.join(rest)}” in it may be an alloy or another purity"
    return ""


# Densities: "7900 kg/m^3", "1,19 g/cm³", "0.2852 lb/in3"

LIGHTEST = 5.0
"""[kg/m^3] no solid that parts are made of is lighter. FreeCAD's "Default" card has 1, "None" 0, air 1.2."""

DENSEST = 23_000.0
"""[kg/m^3] nothing that parts are made of is denser (osmium has 22 590)."""

UNIT_NEEDED_BELOW = 25.0
"""[kg/m^3] a number below this needs its unit: who writes 7.85 alone means g/cm³."""

_VOLUMES = {"m": 1.0, "dm": 1e-3, "cm": 1e-6, "mm": 1e-9, "in": 0.0254**3, "ft": 0.3048**3, "l": 1e-3}
_SHAPE = re.compile(
    r"(?P<number>[^a-zµ]+(?:e[+-]?\d+)?)\s*(?P<mass>[a-zµ]+)\s*/\s*(?P<volume>[a-z]+)\s*\^?\s*3?"
)


class DensityCell(NamedTuple):
    """What a text says: ``value`` [kg/m^3], or why it was refused in words that end a sentence.

    has_unit
        False if the unit came from elsewhere, or kg/m^3 was assumed.
    """

    value: float | None
    problem: str = ""
    has_unit: bool = False


def checked_density(value: float) -> float:
    """Check a density [kg/m^3] that a caller gives as a number. InputError if no solid has it."""
    if UNIT_NEEDED_BELOW <= value <= DENSEST:
        return value
    hint = f"; {value:g} g/cm³ are {value * 1000:g} kg/m³" if 0.01 < value < UNIT_NEEDED_BELOW else ""
    raise InputError(
        f"wanted a default density from {UNIT_NEEDED_BELOW:g} to {DENSEST:g} kg/m³, got {value:g}{hint}"
    )


def density_factor(unit: str) -> float | None:
    """Return how many kg/m^3 a ``unit`` such as "g/cm^3" is; None if it is no unit of density."""
    match = _SHAPE.fullmatch(f"1 {_plain_density(unit)}")
    return _factor_of(match) if match else None


def read_density(text: str, factor: float = 1.0, *, points_are_decimal: bool = False) -> DensityCell:
    """Read a density that a person wrote: "7.85 g/cm³", "7850". ``factor``: for a number without a unit.

    "7,850 g/cm3" is 7.85, since nothing is denser than a metal; "7,850 kg/m3" is refused, and both readings
    are named. A density that no solid has is refused.
    """
    cell = _plain_density(text)
    match = _SHAPE.fullmatch(cell)
    if match is not None:
        own = _factor_of(match)
        if own is None:
            return DensityCell(None, f"wanted a unit such as kg/m3 or g/cm3, got “{text.strip()[:LONGEST]}”")
        factor, cell = own, match["number"].strip()
    has_unit = match is not None
    number = parse_number(cell)
    if number is not None and number.other is not None and float(number.other) * factor > DENSEST:
        value = float(number.exact)  # the other reading is denser than any metal
    else:
        reading = read_number(cell, points_are_decimal=points_are_decimal)
        if reading.value is None:
            return DensityCell(None, reading.problem, has_unit)
        value = float(reading.value)
    value *= factor
    if not LIGHTEST <= value <= DENSEST:
        than = "lighter than any solid" if value < LIGHTEST else "denser than any metal"
        shown = f"{plain(value):.6g} kg/m³" if math.isfinite(value) else "that"
        return DensityCell(None, f"{shown} is {than}; is the unit or the decimal mark wrong?", has_unit)
    return DensityCell(value, "", has_unit)


def parse_density(text: str) -> float | None:
    """Read the density [kg/m^3] that a program wrote, as in a material card; points are decimal marks.

    Returns None if it cannot be read, or if no solid has it.
    """
    return read_density(text, points_are_decimal=True).value


def _plain_density(text: str) -> str:
    return re.sub(r"³$", "3", plain_text(text).strip("\"'")).casefold().replace("μ", "µ")


def _factor_of(match: re.Match[str]) -> float | None:
    mass, volume = MASS_UNITS.get(match["mass"]), _VOLUMES.get(match["volume"])
    return None if mass is None or volume is None else mass / volume


# The package's table, and a user's CSV or TOML


@cache
def package_rows() -> tuple[Material, ...]:
    """Read the table that comes with the package (``materials/table.csv``)."""
    text = (files(__package__) / "table.csv").read_text("utf-8")
    return _csv_rows(text, "table.csv")


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
        raise ConfigError(f"{path}: the material table cannot be read ({error})") from error
    if path.suffix.lower() == ".csv":
        return _csv_rows(text, str(path))
    if path.suffix.lower() == ".toml":
        return _checked(_toml_records(text, str(path)), None, str(path))
    raise ConfigError(f"{path}: a material table is a .csv or .toml file")


_Record = tuple[str, Mapping[str, Any]]
"""Where a row stands, and its cells."""


def _csv_rows(text: str, source: str) -> tuple[Material, ...]:
    first = text.partition("\n")[0]
    reader = csv.DictReader(io.StringIO(text), delimiter=";" if ";" in first and "," not in first else ",")
    heads: dict[str, str] = {}
    for head in sorted(filter(None, reader.fieldnames or ()), key=len):  # "name" goes before "name_de"
        heads.setdefault(re.sub(r"[\W_].*", "", head.strip()).casefold(), head)
    if not {"name", "density"} <= heads.keys():
        raise ConfigError(f"{source}: wanted columns “name” and “density”, got {reader.fieldnames}")
    # "density (g/cm3)", "Density [g/cm3]", "density_g/cm3": everything after the word is the unit.
    unit = heads["density"].strip()[len("density") :].strip(" _:,-()[]")
    factor = density_factor(unit) if unit else None
    if unit and factor is None:
        raise ConfigError(f"{source}: unknown density unit in the header “{heads['density']}”")
    records = (
        (f"line {reader.line_num}", {key: record.get(head) or "" for key, head in heads.items()})
        for record in reader
    )
    return _checked(records, factor, source)


def _toml_records(text: str, source: str) -> Iterator[_Record]:
    try:
        table = tomllib.loads(text).get("materials", {})
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{source}: this is not valid TOML ({error})") from error
    if not isinstance(table, dict) or not table:
        raise ConfigError(f"{source}: wanted a table [materials] with name = density")
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
            problems.append(f"{where}: {row}")
        else:
            rows.append(row)
    seen: dict[Words, Material] = {}
    for row in rows:
        for alias in (row.name, *row.aliases):
            other = seen.setdefault(words(alias), row)
            if other is not row and other.density != row.density:
                problems.append(f"“{alias}” has two densities, {other.density:g} and {row.density:g} kg/m³")
    if problems:
        raise ConfigError(f"{source}: " + "; ".join(problems))
    return tuple(rows)


def _material(cells: Mapping[str, Any], factor: float | None, source: str) -> Material | str:
    """Read a row, or say what is wrong with it."""
    name, density, spread = (str(cells.get(key, "")).strip() for key in ("name", "density", "spread"))
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
    percent = parse_number(spread.removesuffix("%") or "0")
    if percent is None or not 0 <= percent.value < 100:
        return f"the spread of “{name}”: wanted 0 to 100 percent, got “{spread}”"
    given = cells.get("aliases", "")
    if not isinstance(given, str | list):
        return f"the aliases of “{name}”: wanted a list of names, got “{given}”"
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


# Cards of an installed FreeCAD (INI up to 0.21, YAML from 1.0)
#
# Read at run time, never copied: they carry their own licences (LGPL and CC-BY mixed). Only name, UUID,
# inheritance and density are read. FreeCAD 1.0's "Default" card has 1 kg/m^3 and "None" has 0: those, and
# gases, are no materials here.

MAX_CARD_BYTES = 1_000_000

_CARD_NAME = re.compile(r"^\s*Name\s*[:=]\s*[\"']?(.+?)[\"']?\s*$", re.MULTILINE)
_CARD_DENSITY = re.compile(r"^\s*Density\s*[:=]\s*[\"']?([^\"'\n]+?)[\"']?\s*$", re.MULTILINE)
_UUID = re.compile(r"UUID\s*[:=]\s*[\"']?([0-9a-fA-F-]{36})")
_INHERITS = re.compile(r"^Inherits:\s*\n(?:\s+.*\n)*?\s+UUID:\s*[\"']?([0-9a-fA-F-]{36})", re.MULTILINE)


@dataclass(frozen=True)
class Card:
    """One card: its name (if it has one), density [kg/m^3] (its own or inherited), id and file."""

    name: str | None
    density: float | None
    uuid: str
    path: Path


@cache
def all_cards() -> tuple[Card, ...]:
    """Read the cards of every FreeCAD on this machine, in the order of :func:`card_folders`."""
    return tuple(cards_in(card_folders()))


@cache
def installed_cards() -> tuple[Material, ...]:
    """Return the materials of all cards with a density; of equal names the first wins."""
    return tuple(materials_of(all_cards()))


@cache
def card_of(uuid: str) -> Card | None:
    """Return the first card with this id; None if there is none."""
    return next((card for card in all_cards() if card.uuid == uuid.casefold()), None)


def card_folders() -> tuple[Path, ...]:
    """Return the folders with material cards on this machine: FREECAD_MATERIALS first, then the usual
    places.
    """
    given = [Path(p) for p in os.environ.get("FREECAD_MATERIALS", "").split(os.pathsep) if p]
    return tuple(folder for folder in (*given, *material_folders()) if folder.is_dir())


def cards_fingerprint() -> str:
    """Return a text that changes whenever a card is added, removed or edited. Caches keep it."""
    seen = hashlib.sha256()
    for folder in card_folders():
        for path in sorted(folder.rglob("*.FCMat")):
            try:
                stat = path.stat()
            except OSError:
                continue
            seen.update(f"{path}\0{stat.st_size}\0{stat.st_mtime_ns}\n".encode())
    return seen.hexdigest()


def materials_of(cards: Iterable[Card]) -> list[Material]:
    """Make a material of each card with a density, by its name and its file name; of equal names the first
    wins.
    """
    materials: dict[str, Material] = {}
    for card in cards:
        if card.density is not None:
            stem = card.path.stem
            title = card.name or stem
            aliases = {stem, stem.removesuffix("-Generic"), title.removesuffix(" Generic")} - {title}
            source = f"FreeCAD card {card.path.name}"
            materials.setdefault(title, Material(title, card.density, tuple(sorted(aliases)), source))
    return list(materials.values())


def cards_in(folders: Iterable[Path]) -> list[Card]:
    """Read all cards below ``folders`` (``.FCMat``, both formats), in path order."""
    texts = [(path, text, _own_uuid(text)) for folder in folders for path, text in _texts(folder)]
    by_uuid: dict[str, str] = {}
    for _, text, uuid in texts:
        by_uuid.setdefault(uuid, text)
    return [
        Card(
            name[1] if (name := _CARD_NAME.search(text)) else None,
            _card_density(text, by_uuid, 0),
            uuid,
            path,
        )
        for path, text, uuid in texts
    ]


def _texts(folder: Path) -> Iterator[tuple[Path, str]]:
    for path in sorted(folder.rglob("*.FCMat")):
        try:
            if path.stat().st_size <= MAX_CARD_BYTES:
                yield path, path.read_text("utf-8", errors="replace")
        except OSError:
            continue  # a card that cannot be read is as if it were not installed


def _own_uuid(text: str) -> str:
    match = _UUID.search(text.partition("Inherits:")[0])
    return match[1].casefold() if match else ""


def _card_density(text: str, by_uuid: Mapping[str, str], depth: int) -> float | None:
    own = _CARD_DENSITY.search(text)
    if own is not None:
        return parse_density(own[1])
    parent = _INHERITS.search(text)
    above = by_uuid.get(parent[1].casefold()) if parent is not None and depth < 8 else None
    return _card_density(above, by_uuid, depth + 1) if above is not None else None
