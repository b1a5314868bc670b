# SPDX-License-Identifier: LGPL-2.1-or-later
"""The values a BOM is read into: mass cells and headers, entries, warnings, the table that keeps every row.

Mass cells are number, unit, rounding quantum: "0.3 kg*", "1.234,5 g", "10.5 oz", "- None -". A cell is either
empty (in any of the spellings below), a mass, or a problem, reported with its line. It is never None in
silence.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from silo.bom.numbers import Mark, common_mark, parse_number, plain_text

HEAVIEST = 1e12
"""[kg] no part weighs that much; sums of such numbers would lose everything else."""

_POUND = 0.45359237  # exactly, by definition (NIST Handbook 44, appendix C)

_MASSES = {
    1.0: """kg; kgs; kilo; kilogram; kilograms; kilogramm; kilogramme; kilogrammes; kilogramo; kilogramos;
        chilogrammo; chilogrammi; キログラム; 千克; 公斤""",
    1e-3: """g; gr; gram; grams; gramm; gramme; grammes; gramo; gramos; grammo; grammi; gm; gms;
        grs; グラム; 克""",
    1e-2: "dag; dkg; deka",
    1e-6: "mg; milligram; milligrams; milligramm; milligramme; 毫克",
    1e-9: "µg; μg; ug; microgram; micrograms",
    1e3: "t; to; tonne; tonnes; tonnen; toneladas; tonnellate; metric ton; metric tons; トン; 吨",
    _POUND: "lb; lbs; lbm; lbmass; pound; pounds; pfund; livres; libras; libbre; ポンド; 磅",
    _POUND / 16: "oz; ozm; ounce; ounces; unze; unzen; onces; onzas; オンス",
}

MASS_UNITS = {name.strip(): factor for factor, names in _MASSES.items() for name in names.split(";")}
"""Unit → kg. "Mg" is missing on purpose: it may mean megagram or a careless mg."""

_G = 9.80665  # m/s^2, by definition (CGPM 1901)
FORCE_UNITS = {
    "N": 1 / _G, "newton": 1 / _G, "newtons": 1 / _G, "mN": 1e-3 / _G, "daN": 10 / _G, "kN": 1e3 / _G,
    "lbf": _POUND, "lb f": _POUND, "kgf": 1.0, "kp": 1.0, "gf": 1e-3,
}  # fmt: skip
"""Unit of force → kg that weigh as much. Case counts: mN is no MN."""

# What Onshape and others write for "nothing" in the languages whose headers we know.
_EMPTY = {
    "", "-", "--", "---", "–", "—", "?", "n/a", "na", "n.a.", "none", "no value", "null", "nan", "unknown",
    "not set", "unset", "unspecified", "not specified", "material <not specified>", "nicht spezifiziert",
    "material <nicht festgelegt>", "nicht festgelegt", "keine", "keiner", "keines", "kein wert", "ohne",
    "nicht zugewiesen", "aucun", "aucune", "aucune valeur", "sans valeur", "ninguno", "ninguna", "sin valor",
    "nessuno", "nessuna", "nessun valore", "なし", "値なし", "無し", "无", "无值", "無", "没有值",
}  # fmt: skip


def is_empty(cell: str) -> bool:
    """Return True if a cell says "nothing": empty, "No value", "- None -", and their translations."""
    text = unicodedata.normalize("NFKC", cell).strip().casefold()
    inner = re.fullmatch(r"[-–—<]\s*(.*?)\s*[-–—>]", text)
    return text in _EMPTY or (inner is not None and inner[1] in _EMPTY)


@dataclass(frozen=True, slots=True)
class MassCell:
    """What one cell says.

    kg
        the mass, None if the cell is empty or unreadable.
    quantum_kg
        half the weight of the last written digit: the mass is ``kg`` ± this.
    unit
        the unit it was read in, "" if none was written.
    overridden
        marked by hand ("0.3 kg*").
    mark, ambiguous
        see :class:`~silo.inertia.bom.numbers.Number`.
    doubt
        why the mass may not be meant as such, in words that end a sentence.
    problem
        why it could not be read; None if all is well.
    """

    kg: float | None = None
    quantum_kg: float = 0.0
    unit: str = ""
    overridden: bool = False
    mark: Mark | None = None
    ambiguous: bool = False
    doubt: str = ""
    problem: str | None = None


_CELL = re.compile(
    r"(?P<number>[+\-−]?\s*[\d.,¼-¾⅐-⅞](?:[\d.,\s'’_]*[\d.,¼-¾⅐-⅞])?(?:[eE][+\-−]?\d+)?)"
    r"\s*(?P<unit>[^\d*]*?)(?P<star>\*?)"
)


_PER_PIECE = re.compile(
    r"\s*(?:\b(?:per|pro|par)\b\s*|/\s*)?\b(?:each|ea|pcs?|pieces?|stk|stück|unit)\.?$", re.IGNORECASE
)
_TWO_UNITS = re.compile(r"([\d.,]+)\s*([^\W\d_]+)\.?[\s,]*([\d.,]+)\s*([^\W\d_]+)\.?")
_UNIT_FIRST = re.compile(r"(?P<unit>[^\W\d_]{2,}|[^\W\d_](?=[\s.]))\.?\s*(?P<number>[\d.,].*)")
_TOLERANCE = re.compile(r"(?P<mass>.+?)\s*(?:±|\+/-|\+-)\s*(?P<by>[\d.,]+)\s*(?P<unit>[^\d\s]*)")
_ERROR = re.compile(r"#[^\W\d]|Err:\d")


def parse_mass(text: str, *, mark: Mark | None = None, unit: str | None = None) -> MassCell:
    """Read one cell as a mass. ``mark``: the column's decimal mark, ``unit``: its header's; None: unknown.

    "2 ± 0.1 kg", "1 kg 200 g", "kg 1.2" and "2 kg each" are masses; "~2 kg" and "(2 kg)" are, with a doubt.
    """
    if is_empty(text):
        return MassCell()
    cell = plain_text(text)
    if _ERROR.match(cell):
        return MassCell(problem="is an error of the spreadsheet")
    if (split := _TOLERANCE.fullmatch(cell)) is not None:
        own = split["mass"] + (f" {split['unit']}" if split["mass"][-1].isdecimal() else "")
        whole, by = (
            parse_mass(part, mark=mark, unit=unit) for part in (own, f"{split['by']} {split['unit']}")
        )
        return whole if by.kg is None else replace(whole, quantum_kg=max(whole.quantum_kg, by.kg))
    if (both := _TWO_UNITS.fullmatch(cell)) is not None and (one_large := unit_factor(both[2])):
        large, small = (parse_mass(both[i], mark=mark, unit=both[i + 1]) for i in (1, 3))
        if large.kg is None or small.kg is None or small.kg >= one_large:
            return MassCell(problem="is no mass")
        return replace(small, kg=large.kg + small.kg, ambiguous=large.ambiguous or small.ambiguous)
    if (split := _UNIT_FIRST.fullmatch(cell)) is not None and unit_factor(split["unit"]) is not None:
        cell = f"{split['number']} {split['unit']}"
    doubt = ""
    if cell[:1] in ("~", "≈"):
        cell, doubt = cell.lstrip("~≈ "), "is marked as approximate"
    if cell.startswith("(") and cell.endswith(")"):
        cell, doubt = cell[1:-1].strip(), "is in brackets: a reference, or a negative number"
    split = _CELL.fullmatch(_PER_PIECE.sub("", cell))
    if split is None:
        return MassCell(problem="is no mass")
    number = parse_number(re.sub(r"^([+\-−])\s+", r"\1", split["number"]), mark)
    if number is None:
        return MassCell(problem="has no number that can be read")
    written = split["unit"].strip().rstrip(".")
    factor = unit_factor(written or unit or "kg")
    if factor is None:
        return MassCell(problem=f"has the unknown unit “{written or unit}”")
    value = number.value * factor
    if not math.isfinite(value) or value >= HEAVIEST:
        return MassCell(problem=f"is above {HEAVIEST:g} kg" if math.isfinite(value) else "is not finite")
    if value < 0:
        return MassCell(problem="is negative")
    return MassCell(
        kg=value,
        quantum_kg=number.step * factor / 2,
        unit=written or unit or "",
        overridden=bool(split["star"]),
        mark=number.mark,
        ambiguous=number.ambiguous,
        doubt=doubt,
    )


def unit_factor(unit: str) -> float | None:
    """Return how many kg a ``unit`` is; None if it is no unit of mass or weight.

    Upper and lower case matter only for Mg and for forces.
    """
    text = plain_text(unit).rstrip(".")
    if text == "Mg":
        return None
    return FORCE_UNITS.get(text) or MASS_UNITS.get(text) or MASS_UNITS.get(text.casefold())


def column_mark(cells: Iterable[str]) -> Mark | None:
    """Return the decimal mark that a column's unambiguous cells show; None if they show none, or both."""
    return common_mark(cell.mark for cell in map(parse_mass, cells))


# Headers of mass columns

_TOTAL, _EACH = (
    set(words.split())
    for words in (
        """total totale totales totals tot gesamt ges insgesamt summe sum somme suma somma extended ext extd
        row line zeile all alle tous todos tutti qty quantity count menge anzahl stückzahl quantité cantidad
        quantità lot batch set group subtotal cumulative cumulated accumulated aggregate overall combined
        complete rolled roll up rollup rolledup σ ∑ 合計 小計 总 合计 總""",
        # From “net” on: how the mass of a piece was determined.
        """each ea unit units piece pieces pc pcs part item one single 1 1x einzel einzeln stück stk st teil
        pièce unité unitaire pieza unidad ud unitaria unitario pezzo unità 個 单件 単体 件 individual
        component body net netto neto nominal calculated calc estimated measured actual cad""",
    )
)
_FILLERS = {"x", "×", "in", "en", "for", "für", "of", "von", "de", "the", "a"}
_OVER = {"/", "per", "pro", "par", "por", "je"}
_ASSEMBLY = {"assembly", "assy", "baugruppe", "robot", "machine"}
_CLEAR_UNITS = {"kg", "kgs", "mg", "lb", "lbs", "lbm", "oz"}
"""Units that are no other word, wherever they stand in a header."""

_WORD = re.compile(r"[/%]|[^\W_]+|[×∑]")
_BRACKETS = re.compile(r"[\(\[（【<{]([^)\]）】>}]*)[\)\]）】>}]")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z][a-z])|(?<=[Σ∑])(?=\w)")
_MASS_WORD = re.compile(r"(?:mass[ae]?|weight|gewicht|poids|masa|peso)\b|重量|質量|质量|질량|무게")


@dataclass(slots=True)
class MassHeader:
    """A mass column's header.

    title
        the words that remain: "mass" of "Mass (each) [g]".
    unit
        of its cells, "" if it states none.
    total
        True if a cell is the mass of the whole row.
    strange
        what stands in brackets and is not understood.
    rate
        True if a cell is no mass of one piece or row: "kg/m", "g/cm3", "%", "10^3 kg", "kg/100 pcs".
    names_masses
        True if a cell may be a mass by a word or a unit, whatever else the header says.
    """

    title: str = ""
    unit: str = ""
    total: bool = False
    strange: str = ""
    rate: bool = False
    names_masses: bool = False


def read_mass_header(cell: str) -> MassHeader:
    """Take a header apart; works for any text, even the header of something other than masses."""
    text = plain_text(cell)
    header = MassHeader()
    for bracket in _BRACKETS.findall(text):
        plain = bracket.strip().rstrip(".")
        if not header.unit and unit_factor(plain) is not None:
            header.unit = plain  # "lb f"
        elif _read_words(bracket, header):
            header.strange = ", ".join(filter(None, (header.strange, bracket.strip())))
    header.names_masses = header.unit not in ("", "t", *FORCE_UNITS)
    # "Mass (unit) × qty" is the row's: each says what is multiplied.
    header.title = " ".join(_read_words(_CAMEL.sub(" ", _BRACKETS.sub(" ", text)), header, title=True))
    header.names_masses |= header.unit.casefold() in _CLEAR_UNITS
    header.names_masses |= _MASS_WORD.search(header.title) is not None
    return header


def _read_words(text: str, header: MassHeader, *, title: bool = False) -> list[str]:
    """Put what the words mean into ``header``; returns the words that mean nothing to us."""
    kept: list[str] = []
    over = False
    for index, word in enumerate(_WORD.findall(text)):
        low = word.casefold()
        first = title and not index
        if low in _OVER:
            over = not first
        elif low in _TOTAL or (over and low in _ASSEMBLY):
            header.total = True
        elif low in _EACH:
            continue
        elif not header.unit and unit_factor(word) is not None and (not first or low in _CLEAR_UNITS):
            header.unit = word  # "mass_kg", "Gewicht in kg", "Masse/g"; the first word only if it is clear
        elif over or low == "%" or (not first and any(letter.isdigit() for letter in low)):
            header.rate = True  # kg/m, g/cm3, 1000 kg
        elif low not in _FILLERS:
            kept.append(low)
    return kept


class BomCode(StrEnum):
    """The machine names of what reading a BOM noticed."""

    FILE = "bom_file"  # how the file had to be read
    NO_NAME = "bom_row_without_name"
    ROW_LENGTH = "bom_row_length"
    DUPLICATE_NAME = "bom_duplicate_name"
    UNREADABLE_MASS = "bom_mass_unreadable"
    AMBIGUOUS_MASS = "bom_mass_ambiguous"
    MASS_WITHOUT_UNIT = "bom_mass_without_unit"
    UNREADABLE_QUANTITY = "bom_quantity_unreadable"
    TOTAL_DIFFERS = "bom_total_differs"
    MISSING_COLUMN = "bom_missing_column"
    UNUSED_COLUMN = "bom_column_unused"  # that may hold masses


@dataclass(frozen=True)
class BomWarning:
    """One finding about the BOM; ``line`` of the file (1 = first), 0 if it is about no single line."""

    code: BomCode
    message: str
    line: int = 0
    name: str = ""

    def __str__(self) -> str:
        return f"line {self.line}: {self.message}" if self.line else self.message


@dataclass(frozen=True)
class BOMEntry:
    """One row of a BOM (spec bom-inertia, Task 1: ``name``, ``material``, ``mass_kg``; the rest is ours).

    name
        as written, stripped.
    material
        None if none is assigned.
    mass_kg
        mass of ONE piece [kg], None if the BOM has none.
    quantity
        pieces per one parent; None if the file does not say or cannot be read.
    quantum_kg
        half of the last digit the file shows: the mass is ``mass_kg`` ± this.
    overridden, unsure
        the mass is marked as set by hand; it could be read two ways.
    item, level, parent, has_children
        structure: the item number ("1.1.2"), nesting depth (1 = top), index of the parent row in the table's
        ``rows`` (None at the top), and whether rows hang below this one (a sub-assembly).
    line
        of the file, for people; not part of equality.
    """

    name: str
    material: str | None
    mass_kg: float | None
    part_number: str = ""
    quantity: float | None = None
    quantum_kg: float = 0.0
    overridden: bool = False
    unsure: bool = False
    item: str = ""
    level: int = 1
    parent: int | None = None
    has_children: bool = False
    line: int = field(default=0, compare=False)

    @property
    def has_mass(self) -> bool:
        """Return True if the BOM gives a mass; 0 kg is one."""
        return self.mass_kg is not None

    @property
    def has_material(self) -> bool:
        """Return True if a material is assigned."""
        return self.material is not None

    @property
    def data(self) -> tuple[str | None, float | None]:
        """Return the values that decide a mass; rows with equal values need not be distinguished."""
        return (self.material, self.mass_kg)


class BomTable(Mapping[str, BOMEntry]):
    """All rows of a BOM; as a mapping, name → entry.

    Under a name that several rows share, the mapping gives the *first* row, and ``warnings`` says so with
    the lines. Calculations use ``rows``, never the mapping.
    """

    def __init__(
        self, rows: tuple[BOMEntry, ...], warnings: tuple[BomWarning, ...] = (), source: str = ""
    ) -> None:
        self.rows = rows
        self.warnings = warnings
        self.source = source
        self._first: dict[str, BOMEntry] = {}
        for row in rows:
            self._first.setdefault(row.name, row)

    def __getitem__(self, name: str) -> BOMEntry:
        return self._first[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._first)

    def __len__(self) -> int:
        return len(self._first)

    def __repr__(self) -> str:
        return f"BomTable({len(self.rows)} rows, {len(self)} names, {len(self.warnings)} warnings)"

    def total_quantity(self, row: BOMEntry) -> float | None:
        """Return the pieces in the whole product: the row's quantity times that of every parent; None if one
        is unknown.
        """
        total = 1.0
        for entry in (row, *self.ancestors(row)):
            if entry.quantity is None:
                return None
            total *= entry.quantity
        return total

    def ancestors(self, row: BOMEntry) -> tuple[BOMEntry, ...]:
        """Return the rows above in the structure, the nearest first."""
        entries: list[BOMEntry] = []
        parent = row.parent
        while parent is not None:
            entries.append(self.rows[parent])
            parent = self.rows[parent].parent
        return tuple(entries)


def as_table(entries: Mapping[str, BOMEntry]) -> BomTable:
    """Make a table of any mapping name → entry; a table is returned unchanged."""
    if isinstance(entries, BomTable):
        return entries
    return BomTable(tuple(replace(entry, name=name) for name, entry in entries.items()))
