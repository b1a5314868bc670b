# SPDX-License-Identifier: LGPL-2.1-or-later
"""What speaks against a mass that the BOM gives: rounding, other data, and what no matter can weigh. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from silo.inertia.codes import MassCode
from silo.inertia.materials import Material
from silo.inertia.materials.density import DENSEST, LIGHTEST
from silo.inertia.model import Prototype

ROUNDING_LIMIT = 0.02
"""A quantum above this share of the mass is reported."""

MISMATCH_LIMIT = 0.05
"""Mass against density times volume, and STEP density against the one used: above this share is reported."""

SPREAD_LIMIT = 0.1
"""A material whose density varies by this share or more is reported."""

LIGHTEST_PART = 12.0
"""[kg/m^3] a part that weighs less by the BOM is doubted: foams have 15 and more, and grams that were read as
kilograms make 1.7 to 11 of a metal."""


@dataclass(frozen=True, slots=True)
class Note:
    """Code (:class:`MassCode` or a geometry code) and one sentence."""

    code: str
    message: str


@dataclass(frozen=True, slots=True)
class GivenMass:
    """The BOM's mass of one piece ± ``quantum`` [kg]; ``quantities``: readings of the row's quantity."""

    kg: float
    quantum: float
    quantities: frozenset[float] = frozenset()

    @property
    def pieces(self) -> float:
        """How many pieces the row is for by its largest reading; 1 where it does not say."""
        return max(self.quantities, default=1.0)


@dataclass(frozen=True, slots=True)
class Expectation:
    """A density [kg/m^3] that the mass can be held against, in words as well; it varies by ``spread``."""

    density: float
    words: str
    spread: float = 0.0


def expectation(prototype: Prototype, text: str | None, material: Material | None) -> Expectation | None:
    """By the row's material where it is known, else by what the geometry file states."""
    if prototype.volume_m3 <= 0:
        return None
    if material is not None:
        return Expectation(material.density, f"{text} ({material.density:g} kg/m³)", material.spread)
    stated = prototype.step_density
    return Expectation(stated, f"the file's {stated:g} kg/m³") if stated is not None else None


def mass_doubts(given: GivenMass, prototype: Prototype, expected: Expectation | None) -> Iterator[Note]:
    """Everything that speaks against a BOM mass, worst last."""
    yield from _rounding(given)
    if given.kg > 0 and not prototype.volume_m3:
        yield Note(
            MassCode.POINT_MASS,
            "there is no solid to spread the BOM's mass over; it was put at one point, without own inertia",
        )
        return
    contradicted = list(_against(given, prototype.volume_m3, expected)) if expected is not None else []
    yield from contradicted
    if not any(note.code == MassCode.ROW_TOTAL for note in contradicted):
        yield from implausible(given, prototype.volume_m3)


def _rounding(given: GivenMass) -> Iterator[Note]:
    mass, quantum = given.kg, given.quantum
    if mass == 0:
        yield Note(
            MassCode.ZERO_MASS,
            f"the BOM says 0 kg (± {quantum:.3g} kg): it is lighter than the BOM shows, or it was zeroed",
        )
    elif quantum > ROUNDING_LIMIT * mass:
        yield Note(
            MassCode.ROUNDED,
            f"the BOM's {mass:.6g} kg is rounded to ± {quantum:.3g} kg ({quantum / mass:.0%})",
        )


def zero_doubt(given: GivenMass, volume: float, density: float, material: str) -> Note:
    """A BOM mass of 0 kg of a part whose material is known; the material's mass is used."""
    weight = density * volume
    used = f"{material} times the volume gives {weight:.6g} kg, which was used"
    if weight <= given.quantum:
        return Note(
            MassCode.ZERO_MASS, f"the BOM says 0 kg, for it shows ± {given.quantum:.3g} kg only; {used}"
        )
    code = MassCode.ZERO_MASS if given.quantum >= LIGHTEST * volume else MassCode.IMPLAUSIBLE
    words = f"the BOM says 0 kg (± {given.quantum:.3g} kg), but {used}. Was the mass set to zero? "
    return Note(code, words + "A mass that is marked as set by hand (“0 kg*”) is kept")


def _against(given: GivenMass, volume: float, expected: Expectation) -> Iterator[Note]:
    weight = expected.density * volume
    allowed = max(given.quantum, MISMATCH_LIMIT * given.kg, expected.spread * weight)
    if not given.kg or abs(weight - given.kg) <= allowed:
        return
    pieces = next((q for q in given.quantities if _is_multiple(given.kg, weight, q)), None)
    if pieces is not None:
        yield Note(
            MassCode.ROW_TOTAL,
            f"the BOM's {given.kg:.6g} kg is {pieces:g} times what {expected.words} gives ({weight:.6g} kg), "
            "and the quantity is the same: this looks like the mass of the whole row. "
            "It was used as that of one piece",
        )
        return
    yield Note(
        MassCode.DIFFERS,
        f"the BOM says {given.kg:.6g} kg, but {expected.words} times the volume gives {weight:.6g} kg "
        f"({weight / given.kg - 1:+.0%}); the BOM's mass was used",
    )


def implausible(given: GivenMass, volume: float) -> Iterator[Note]:
    """A mass that no material gives in this volume: grams read as kilograms, or that of another part."""
    if volume <= 0 or not given.kg:
        return
    least, most = (given.kg - given.quantum) / volume, (given.kg + given.quantum) / volume
    if most >= LIGHTEST_PART and least <= DENSEST:
        return
    dense = least > DENSEST
    than, shape = ("denser than any metal", "shell") if dense else ("lighter than any solid", "envelope")
    yield Note(
        MassCode.IMPLAUSIBLE,
        f"the BOM's {given.kg:.6g} kg in {volume * 1e6:.4g} cm³ would be {given.kg / volume:.3g} kg/m³, "
        f"{than}: is the unit, the decimal mark or the row wrong, or the shape a mere {shape} of the part? "
        "The BOM's mass was used",
    )


def looks_like_totals(masses: Iterable[tuple[bool, float, bool]]) -> bool:
    """True where the whole mass column seems to hold row totals.

    masses
        of each row that gives one: (could be compared with a density, pieces, looks like the row's total).
        One total convinces where no comparable row of several pieces is that of one piece.
    """
    several = [total for compared, pieces, total in masses if compared and pieces >= 2]
    return bool(several) and all(several)


TOTAL_BY_OTHERS = Note(
    MassCode.ROW_TOTAL,
    "other masses of this BOM look like those of whole rows, and this one, of a row of several pieces, "
    "cannot be checked: no density is known for it. It was used as that of one piece",
)


def density_doubts(prototype: Prototype, used: Material) -> Iterator[Note]:
    """What the geometry file states against the material that is used, and how much that one varies."""
    stated, density = prototype.step_density, used.density
    if used.spread >= SPREAD_LIMIT:
        low, high = density * (1 - used.spread), density * (1 + used.spread)
        yield Note(
            MassCode.DENSITY_VARIES,
            f"{used.name} has from {low:.4g} to {high:.4g} kg/m³, by its kind; {density:g} kg/m³ were used, "
            f"so the mass is ± {used.spread:.0%}",
        )
    if stated is not None and abs(stated - density) > max(MISMATCH_LIMIT, used.spread) * density:
        material = f" ({prototype.step_material})" if prototype.step_material else ""
        yield Note(
            MassCode.STEP_DENSITY,
            f"the file states {stated:g} kg/m³{material}, "
            f"{used.name} has {density:g} kg/m³; the BOM's material was used",
        )


def _is_multiple(mass: float, expected: float, quantity: float) -> bool:
    return quantity >= 2 and abs(mass / expected - quantity) <= MISMATCH_LIMIT * quantity
