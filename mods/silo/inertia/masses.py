# SPDX-License-Identifier: LGPL-2.1-or-later
"""One product's mass by the spec's rule, and everything that speaks against it. Pure.

    BOM mass → material × volume → zero and a warning; not in the BOM: default density and a warning.

The density that a geometry file states never outranks the BOM. It is compared, and used in the place of the
default (or of zero) only if the user asks for it.

Rounding, other data and what no matter can weigh speak against a mass that the BOM gives.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from silo.inertia.bom.table import BomCode, BOMEntry
from silo.inertia.codes import Decided, MassCode, Rule, Source
from silo.inertia.matching import Match, Suggester
from silo.inertia.materials import DENSEST, LIGHTEST, Material, MaterialHit, MaterialTable, checked_density
from silo.inertia.model import Note, Prototype


@dataclass(frozen=True)
class Options:
    """How gaps in the data are filled.

    default_density
        [kg/m^3] of parts that the BOM does not have, and of unknown materials.
    step_density
        use the density of the geometry file before the default and before zero (a tier of its own).
    unknown_is_zero
        without a BOM, a part whose file states no density counts as 0 kg instead of the default density:
        for FreeCAD documents.
    own_bom
        the geometry file is its own BOM, so that nobody misses another one.
    """

    default_density: float = 1000.0
    step_density: bool = False
    unknown_is_zero: bool = False
    own_bom: bool = False

    def __post_init__(self) -> None:
        checked_density(self.default_density)


@dataclass(frozen=True)
class Decision:
    """Where a product's mass comes from.

    mass_kg
        of one piece, if it is given as such; else None and ``density`` [kg/m^3] times volume it is.
    quantum_kg
        the mass is known to ± this: by the BOM's digits, or by how much the material's density varies.
    material, material_name, density_source
        the BOM's text, the table's row it was understood as, and where its density comes from.
    pieces, compared
        how many pieces the BOM row is for, and whether its mass could be held against a density.
    """

    source: Source
    rule: Rule = Rule.NONE
    decided: Decided = Decided.ONLY
    mass_kg: float | None = None
    density: float | None = None
    quantum_kg: float = 0.0
    material: str | None = None
    material_name: str | None = None
    density_source: str = ""
    part_number: str = ""
    lines: tuple[int, ...] = ()
    notes: tuple[Note, ...] = ()
    pieces: float = 1.0
    compared: bool = False

    @property
    def informed(self) -> bool:
        """Report whether the BOM itself has a mass or a material for the product."""
        return self.source in (Source.BOM_MASS, Source.MATERIAL) or self.material is not None


@dataclass(frozen=True, eq=False)
class MassRule:
    """Decides for one product after the other. ``suggester``: knows all BOM names, to propose some."""

    materials: MaterialTable
    options: Options = field(default_factory=Options)
    suggester: Suggester = field(default_factory=lambda: Suggester(()))
    has_bom: bool = True

    def density_of(self, material: str | None) -> float | None:
        """Return the density [kg/m^3] of a material text, None if it is not understood."""
        if material is None:
            return None
        answer = self.materials.find(material)
        return answer.material.density if isinstance(answer, MaterialHit) else None

    def decide(self, prototype: Prototype, match: Match | None) -> Decision:
        """Return the mass of one piece of ``prototype``, by the first rule that applies."""
        if match is None:
            return self._without_row(prototype)
        row = match.row
        base = replace(self._base(match, match.rule), part_number=row.part_number)
        if row.mass_kg is not None:
            return self._bom_mass(base, prototype, match)
        return self._without_mass(base, prototype, row.material)

    def decide_by_sub_assembly(self, prototype: Prototype, match: Match) -> Decision:
        """Do as :meth:`decide`, by the row of a sub-assembly around the part, which gives no mass."""
        base = self._base(match, Rule.SUB_ASSEMBLY)
        return self._without_mass(base, prototype, match.row.material, f" to “{match.row.name}” around it")

    def _without_mass(
        self, base: Decision, prototype: Prototype, material: str | None, to: str = ""
    ) -> Decision:
        if material is None:
            return self._neither(base, prototype, to)
        return self._material(base, prototype, material, to)

    @staticmethod
    def _base(match: Match, rule: Rule) -> Decision:
        return Decision(
            source=Source.ZERO,
            rule=rule,
            decided=match.decided,
            material=match.row.material,
            lines=tuple(row.line for row in match.bundle.rows),
            notes=(Note(MassCode.AMBIGUOUS, match.doubt),) if match.doubt else (),
        )

    def _bom_mass(self, base: Decision, prototype: Prototype, match: Match) -> Decision:
        row = match.row
        mass = row.mass_kg or 0.0
        material = self.materials.find(row.material) if row.material is not None else None
        known = material.material if isinstance(material, MaterialHit) else None
        if mass == 0 and known and prototype.volume_m3 > 0 and not row.overridden and row.material:
            return self._zero_of_known_material(base, prototype, row)
        given = GivenMass(mass, row.quantum_kg, match.bundle.quantities)
        expected = expectation(prototype, row.material, known)
        return replace(
            base,
            source=Source.BOM_MASS,
            mass_kg=mass,
            quantum_kg=row.quantum_kg,
            material_name=known.name if known else None,
            pieces=given.pieces,
            compared=expected is not None,
            notes=(*base.notes, *two_ways(row), *mass_doubts(given, prototype, expected)),
        )

    def _zero_of_known_material(self, base: Decision, prototype: Prototype, row: BOMEntry) -> Decision:
        """Decide on "0 kg" of steel: it is less than the BOM shows, and not nothing."""
        decision = self._material(base, prototype, row.material or "")
        given = GivenMass(0.0, row.quantum_kg)
        note = zero_doubt(given, prototype.volume_m3, decision.density or 0.0, row.material or "")
        return replace(decision, notes=(*decision.notes, note))

    def _material(self, base: Decision, prototype: Prototype, text: str, to: str = "") -> Decision:
        answer = self.materials.find(text)
        notes = list(base.notes)
        name, spread = None, 0.0
        if isinstance(answer, MaterialHit):
            found = answer.material
            kind, density, where = Source.MATERIAL, found.density, found.source
            name, spread = found.name, found.spread
            notes += density_doubts(prototype, found)
            if answer.doubt:
                words = f"'{text}' was taken for {name} ({density:g} kg/m³): {answer.doubt}"
                notes.append(Note(MassCode.GUESSED_MATERIAL, words))
        else:
            if self.options.step_density and prototype.step_density is not None:
                kind, density, where = Source.STEP_DENSITY, prototype.step_density, "the geometry file"
                used = f"the density in the file ({density:g} kg/m³) was used"
            else:
                kind, density, where = Source.DEFAULT_DENSITY, self.options.default_density, "default"
                used = f"the default density ({density:g} kg/m³) was used"
            words = f"Unknown material '{text}'{to and ', assigned' + to}: {answer.advice}; {used}"
            notes.append(Note(MassCode.UNKNOWN_MATERIAL, words))
        if not prototype.volume_m3:
            notes.append(_no_volume(prototype))
        return replace(
            base,
            source=kind,
            density=density,
            # Six digits: pieces that are alike up to the last bit stay one part of the report.
            quantum_kg=float(f"{spread * density * prototype.volume_m3:.6g}"),
            material_name=name,
            density_source=where,
            notes=tuple(notes),
        )

    def _neither(self, base: Decision, prototype: Prototype, to: str) -> Decision:
        if self.options.step_density and prototype.step_density is not None:
            note = Note(
                MassCode.NO_MASS_NO_MATERIAL,
                f"No mass or material assigned{to} in the BOM; "
                f"the density in the file ({prototype.step_density:g} kg/m³) was used",
            )
            return self._from_file(base, prototype, (*base.notes, note))
        hint = ""
        if prototype.step_density is not None:
            hint = f" (the file states {prototype.step_density:g} kg/m³)"
        note = Note(MassCode.NO_MASS_NO_MATERIAL, f"No mass or material assigned{to}: counted as 0 kg{hint}")
        return replace(base, source=Source.ZERO, mass_kg=0.0, notes=(*base.notes, note))

    def _without_row(self, prototype: Prototype) -> Decision:
        stated = prototype.step_density
        base = Decision(source=Source.DEFAULT_DENSITY)
        message = "Part not found in BOM" if self.has_bom else "There is no BOM"
        if self.options.own_bom and not self.has_bom:
            message = "The document assigns no material with a density"
        alike = self.suggester.near(prototype.name) if self.has_bom else ()
        if alike:
            message += ", which has " + ", ".join(f"“{name}”" for name in alike)
        if self.options.step_density and stated is not None:
            # Without a BOM the file's density is what was asked for, and nothing to warn of.
            words = f"{message}; the density in the file ({stated:g} kg/m³) was used"
            notes = [Note(MassCode.NOT_IN_BOM, words)] if self.has_bom else []
            return self._from_file(base, prototype, tuple(notes))
        if not self.has_bom and self.options.unknown_is_zero:
            words = f"{message}: counted as 0 kg"
            return replace(
                base, source=Source.ZERO, mass_kg=0.0, notes=(Note(MassCode.NO_MASS_NO_MATERIAL, words),)
            )
        if stated is not None:
            message += f", though the file states {stated:g} kg/m³"
        density = self.options.default_density
        code = MassCode.NOT_IN_BOM if self.has_bom else MassCode.NO_BOM
        notes = [Note(code, f"{message}; the default density ({density:g} kg/m³) was used")]
        if not prototype.volume_m3:
            notes = [*(notes if self.has_bom else ()), _no_volume(prototype)]
        return replace(base, density=density, density_source="default", notes=tuple(notes))

    def _from_file(self, base: Decision, prototype: Prototype, notes: tuple[Note, ...]) -> Decision:
        return replace(
            base,
            source=Source.STEP_DENSITY,
            density=prototype.step_density,
            material_name=prototype.step_material,
            density_source="the geometry file",
            notes=notes if prototype.volume_m3 else (*notes, _no_volume(prototype)),
        )


def two_ways(row: BOMEntry) -> tuple[Note, ...]:
    """Warn of a mass whose decimal mark had to be guessed."""
    if not row.unsure:
        return ()
    words = f"its mass in BOM line {row.line} can be read two ways; {row.mass_kg:.6g} kg was used"
    return (Note(BomCode.AMBIGUOUS_MASS, words),)


def _no_volume(prototype: Prototype) -> Note:
    kind = "no solid" if not prototype.has_solid else "no volume"
    return Note(MassCode.NO_VOLUME, f"the part has {kind} to multiply a density with: counted as 0 kg")


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
class GivenMass:
    """The BOM's mass of one piece ± ``quantum`` [kg]; ``quantities``: readings of the row's quantity."""

    kg: float
    quantum: float
    quantities: frozenset[float] = frozenset()

    @property
    def pieces(self) -> float:
        """Return how many pieces the row is for by its largest reading; 1 if it does not say."""
        return max(self.quantities, default=1.0)


@dataclass(frozen=True, slots=True)
class Expectation:
    """A density [kg/m^3] that the mass can be held against, in words as well; it varies by ``spread``."""

    density: float
    words: str
    spread: float = 0.0


def expectation(prototype: Prototype, text: str | None, material: Material | None) -> Expectation | None:
    """Expect the density of the row's material if it is known, else by what the geometry file states."""
    if prototype.volume_m3 <= 0:
        return None
    if material is not None:
        return Expectation(material.density, f"{text} ({material.density:g} kg/m³)", material.spread)
    stated = prototype.step_density
    return Expectation(stated, f"the file's {stated:g} kg/m³") if stated is not None else None


def mass_doubts(given: GivenMass, prototype: Prototype, expected: Expectation | None) -> Iterator[Note]:
    """Warn of everything that speaks against a BOM mass, worst last."""
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
            f"the BOM says 0 kg (± {quantum:.3g} kg): "
            "the part is lighter than the BOM shows, or its mass was set to 0",
        )
    elif quantum > ROUNDING_LIMIT * mass:
        yield Note(
            MassCode.ROUNDED,
            f"the BOM's {mass:.6g} kg is rounded to ± {quantum:.3g} kg ({quantum / mass:.0%})",
        )


def zero_doubt(given: GivenMass, volume: float, density: float, material: str) -> Note:
    """Warn of a BOM mass of 0 kg of a part whose material is known; the material's mass is used."""
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
    """Warn of a mass that no material gives in this volume.

    Grams read as kilograms, or that of another part.
    """
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
    """Report whether the whole mass column seems to hold row totals.

    masses
        of each row that gives one: (could be compared with a density, pieces, looks like the row's total).
        One total convinces if no comparable row of several pieces is that of one piece.
    """
    several = [total for compared, pieces, total in masses if compared and pieces >= 2]
    return bool(several) and all(several)


TOTAL_BY_OTHERS = Note(
    MassCode.ROW_TOTAL,
    "other masses of this BOM look like those of whole rows, and this one, of a row of several pieces, "
    "cannot be checked: no density is known for it. It was used as that of one piece",
)


def density_doubts(prototype: Prototype, used: Material) -> Iterator[Note]:
    """Warn of what the geometry file states against the material that is used, and how much that one
    varies.
    """
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
