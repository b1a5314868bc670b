# SPDX-License-Identifier: LGPL-2.1-or-later
"""Masses: of one product by the spec's rule, and the evidence against it, then of all instances. Pure.

    BOM mass → material × volume → zero and a warning; not in the BOM: default density and a warning.

The density that a geometry file states never outranks the BOM. It is compared, and used in the place of the
default (or of zero) only if the user asks for it. Rounding, other data and a density that no material has
are evidence against a mass that the BOM gives.

Rows of sub-assemblies never add mass to that of their parts. A row's mass is used if its parts have no
data of their own: a bought motor is one row of the BOM and twelve parts of the STEP file. Where they have,
the two are compared. A row without children stands for all below it, so that what its mass leaves after the
parts that are listed elsewhere belongs to the others. A mass that is marked as set by hand is what a scale
said: it wins at every level. The parts below are scaled to it, but for those that were weighed themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from silo.bom.message import message
from silo.inertia.arrays import Floats
from silo.inertia.assembly import Assembly, Prototype, placed_below
from silo.inertia.bom.table import BomCode, BOMEntry
from silo.inertia.codes import Decided, MassCode, Rule, Source
from silo.inertia.matching import Match, Matching
from silo.inertia.materials.densities import DENSEST, LIGHTEST, checked_density
from silo.inertia.materials.material import Material, MaterialHit
from silo.inertia.materials.table import MaterialTable
from silo.inertia.names import Suggester
from silo.inertia.notes import GeometryCode, Note
from silo.inertia.placements import place, rigid_mask
from silo.inertia.products import companions


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
        the geometry file is its own BOM, so that no other one is missed.
    """

    default_density: float = 1000.0
    step_density: bool = False
    unknown_is_zero: bool = False
    own_bom: bool = False

    def __post_init__(self) -> None:
        checked_density(self.default_density)


@dataclass(frozen=True)
class MassDecision:
    """Where a product's mass comes from.

    mass_kg
        of one piece, if it is given as such; else None and ``density`` [kg/m^3] times volume it is.
    quantum_kg
        the mass is known to ± this: by the BOM's digits, or by how much the material's density varies.
    material, material_name, material_card, density_source
        the BOM's text, the table's row it was understood as, the file of that row if it is a FreeCAD card,
        and where its density comes from.
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
    material_card: str = ""
    density_source: str = ""
    part_number: str = ""
    lines: tuple[int, ...] = ()
    notes: tuple[Note, ...] = ()
    pieces: float = 1.0
    compared: bool = False


@dataclass(frozen=True, eq=False)
class MassRule:
    """Decides for one product after the other. ``suggester``: knows all BOM names, to propose some."""

    materials: MaterialTable
    options: Options = field(default_factory=Options)
    suggester: Suggester = field(default_factory=lambda: Suggester(()))
    has_bom: bool = True

    def density_of(self, material: str | None) -> float | None:
        """Return the density [kg/m^3] of the material that a text names; None if the text is not
        understood.
        """
        if material is None:
            return None
        answer = self.materials.find(material)
        return answer.material.density if isinstance(answer, MaterialHit) else None

    def decide(self, prototype: Prototype, match: Match | None) -> MassDecision:
        """Decide the mass of one piece of ``prototype``, by the first rule that applies."""
        if match is None:
            return self._without_row(prototype)
        row = match.row
        base = replace(self._base(match, match.rule), part_number=row.part_number)
        if row.mass_kg is not None:
            return self._bom_mass(base, prototype, match)
        return self._without_mass(base, prototype, row.material)

    def decide_by_sub_assembly(self, prototype: Prototype, match: Match) -> MassDecision:
        """Do what :meth:`decide` does, by the row of a sub-assembly around the part, which gives no mass."""
        base = self._base(match, Rule.SUB_ASSEMBLY)
        return self._without_mass(
            base, prototype, match.row.material, message(" to “{name}” around it", name=match.row.name)
        )

    def _without_mass(
        self, base: MassDecision, prototype: Prototype, material: str | None, to: str = ""
    ) -> MassDecision:
        if material is None:
            return self._neither(base, prototype, to)
        return self._material(base, prototype, material, to)

    @staticmethod
    def _base(match: Match, rule: Rule) -> MassDecision:
        return MassDecision(
            source=Source.ZERO,
            rule=rule,
            decided=match.decided,
            material=match.row.material,
            lines=tuple(row.line for row in match.bundle.rows),
            notes=(Note(MassCode.AMBIGUOUS, match.doubt),) if match.doubt else (),
        )

    def _bom_mass(self, base: MassDecision, prototype: Prototype, match: Match) -> MassDecision:
        row = match.row
        mass = row.mass_kg or 0.0
        material = self.materials.find(row.material) if row.material is not None else None
        bom_material = material.material if isinstance(material, MaterialHit) else None
        if mass == 0 and bom_material and prototype.volume_m3 > 0 and not row.overridden and row.material:
            return self._zero_of_known_material(base, prototype, row)
        given = GivenMass(mass, row.quantum_kg, match.bundle.quantities)
        expected = expectation(prototype, row.material, bom_material)
        return replace(
            base,
            source=Source.BOM_MASS,
            mass_kg=mass,
            quantum_kg=row.quantum_kg,
            material_name=bom_material.name if bom_material else None,
            pieces=given.pieces,
            compared=expected is not None,
            notes=(*base.notes, *two_ways(row), *mass_doubts(given, prototype, expected)),
        )

    def _zero_of_known_material(
        self, base: MassDecision, prototype: Prototype, row: BOMEntry
    ) -> MassDecision:
        """Decide on "0 kg" of steel: it is less than the BOM can show, but not nothing."""
        decision = self._material(base, prototype, row.material or "")
        given = GivenMass(0.0, row.quantum_kg)
        note = zero_doubt(given, prototype.volume_m3, decision.density or 0.0, row.material or "")
        return replace(decision, notes=(*decision.notes, note))

    def _material(self, base: MassDecision, prototype: Prototype, text: str, to: str = "") -> MassDecision:
        answer = self.materials.find(text)
        notes = list(base.notes)
        name, spread, card = None, 0.0, ""
        if isinstance(answer, MaterialHit):
            material = answer.material
            kind, density, where = Source.MATERIAL, material.density, material.source
            name, spread, card = material.name, material.spread, material.card
            notes += density_doubts(prototype, material)
            if answer.doubt:
                words = message(
                    "'{text}' was taken for {name} ({density} kg/m³): {doubt}",
                    text=text,
                    name=name,
                    density=f"{density:g}",
                    doubt=answer.doubt,
                )
                notes.append(Note(MassCode.GUESSED_MATERIAL, words))
        else:
            if self.options.step_density and prototype.step_density is not None:
                kind, density, where = (
                    Source.STEP_DENSITY,
                    prototype.step_density,
                    message("the geometry file"),
                )
                used = message("the density in the file ({density} kg/m³) was used", density=f"{density:g}")
            else:
                kind, density, where = Source.DEFAULT_DENSITY, self.options.default_density, "default"
                used = message("the default density ({density} kg/m³) was used", density=f"{density:g}")
            words = message(
                "Unknown material '{text}'{to}: {advice}; {used}",
                text=text,
                to=to and ", assigned" + to,
                advice=answer.advice,
                used=used,
            )
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
            material_card=card,
            density_source=where,
            notes=tuple(notes),
        )

    def _neither(self, base: MassDecision, prototype: Prototype, to: str) -> MassDecision:
        if self.options.step_density and prototype.step_density is not None:
            note = Note(
                MassCode.NO_MASS_NO_MATERIAL,
                message(
                    "No mass or material assigned{to} in the BOM; the density in the file "
                    "({step_density} kg/m³) was used",
                    to=to,
                    step_density=f"{prototype.step_density:g}",
                ),
            )
            return self._from_file(base, prototype, (*base.notes, note))
        hint = ""
        if prototype.step_density is not None:
            hint = message(
                " (the file states {step_density} kg/m³)", step_density=f"{prototype.step_density:g}"
            )
        note = Note(
            MassCode.NO_MASS_NO_MATERIAL,
            message("No mass or material assigned{to}: counted as 0 kg{hint}", to=to, hint=hint),
        )
        return replace(base, source=Source.ZERO, mass_kg=0.0, notes=(*base.notes, note))

    def _without_row(self, prototype: Prototype) -> MassDecision:
        stated = prototype.step_density
        base = MassDecision(source=Source.DEFAULT_DENSITY)
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

    def _from_file(self, base: MassDecision, prototype: Prototype, notes: tuple[Note, ...]) -> MassDecision:
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
    words = message(
        "its mass in BOM line {line} can be read two ways; {mass_kg} kg was used",
        line=row.line,
        mass_kg=f"{row.mass_kg:.6g}",
    )
    return (Note(BomCode.AMBIGUOUS_MASS, words),)


def _no_volume(prototype: Prototype) -> Note:
    kind = message("no solid") if not prototype.has_solid else message("no volume")
    return Note(
        MassCode.NO_VOLUME,
        message("the part has {kind} to multiply a density with: counted as 0 kg", kind=kind),
    )


ROUNDING_LIMIT = 0.02
"""A quantum above this share of the mass is reported."""

MISMATCH_LIMIT = 0.05
"""Mass against density times volume, and STEP density against the one used: above this share is reported."""

SPREAD_LIMIT = 0.1
"""A material whose density varies by this share or more is reported."""

EXACT = 1e-9
"""Relative: two sums of the same masses are one number below this."""

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
        """Return the largest number of pieces for which the row can be; 1 if it does not say."""
        return max(self.quantities, default=1.0)


@dataclass(frozen=True, slots=True)
class Expectation:
    """A density [kg/m^3] that the mass can be held against, in words as well; it varies by ``spread``."""

    density: float
    words: str
    spread: float = 0.0


def expectation(prototype: Prototype, text: str | None, material: Material | None) -> Expectation | None:
    """Expect the density of the row's material if it is known, else the one that the geometry file states."""
    if prototype.volume_m3 <= 0:
        return None
    if material is not None:
        return Expectation(
            material.density,
            message("{text} ({density} kg/m³)", text=text, density=f"{material.density:g}"),
            material.spread,
        )
    stated = prototype.step_density
    return (
        Expectation(stated, message("the file's {stated} kg/m³", stated=f"{stated:g}"))
        if stated is not None
        else None
    )


def mass_doubts(given: GivenMass, prototype: Prototype, expected: Expectation | None) -> Iterator[Note]:
    """Warn of everything that contradicts a BOM mass, the worst last."""
    yield from _rounding(given)
    if given.kg > 0 and not prototype.volume_m3:
        yield Note(
            MassCode.POINT_MASS,
            message(
                "there is no solid to spread the BOM's mass over; it was put at one point, "
                "without own inertia"
            ),
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
            message(
                "the BOM says 0 kg (± {quantum} kg): the part is lighter than the BOM shows, or "
                "its mass was set to 0",
                quantum=f"{quantum:.3g}",
            ),
        )
    elif quantum > ROUNDING_LIMIT * mass:
        yield Note(
            MassCode.ROUNDED,
            message(
                "the BOM's {mass} kg is rounded to ± {quantum} kg ({share})",
                mass=f"{mass:.6g}",
                quantum=f"{quantum:.3g}",
                share=f"{quantum / mass:.0%}",
            ),
            quantum,
        )


def zero_doubt(given: GivenMass, volume: float, density: float, material: str) -> Note:
    """Warn of a BOM mass of 0 kg for a part whose material is known; the material's mass is used."""
    weight = density * volume
    used = message(
        "{material} times the volume gives {weight} kg, which was used",
        material=material,
        weight=f"{weight:.6g}",
    )
    if weight <= given.quantum:
        return Note(
            MassCode.ZERO_MASS,
            message(
                "the BOM says 0 kg, for it shows ± {quantum} kg only; {used}",
                quantum=f"{given.quantum:.3g}",
                used=used,
            ),
        )
    code = MassCode.ZERO_MASS if given.quantum >= LIGHTEST * volume else MassCode.IMPLAUSIBLE
    words = message(
        "the BOM says 0 kg (± {quantum} kg), but {used}. Was the mass set to zero? ",
        quantum=f"{given.quantum:.3g}",
        used=used,
    )
    return Note(code, words + message("A mass that is marked as set by hand (“0 kg*”) is kept"))


def _against(given: GivenMass, volume: float, expected: Expectation) -> Iterator[Note]:
    weight = expected.density * volume
    allowed = max(given.quantum, MISMATCH_LIMIT * given.kg, expected.spread * weight)
    if not given.kg or abs(weight - given.kg) <= allowed:
        return
    pieces = next((q for q in given.quantities if _is_multiple(given.kg, weight, q)), None)
    if pieces is not None:
        yield Note(
            MassCode.ROW_TOTAL,
            message(
                "the BOM's {kg} kg is {pieces} times what {words} gives ({weight} kg), and the "
                "quantity is the same: this looks like the mass of the whole row. It was used as "
                "that of one piece",
                kg=f"{given.kg:.6g}",
                pieces=f"{pieces:g}",
                words=expected.words,
                weight=f"{weight:.6g}",
            ),
        )
        return
    yield Note(
        MassCode.DIFFERS,
        message(
            "the BOM says {kg} kg, but {material} times the volume gives {weight} kg ({difference}); "
            "the BOM's mass was used",
            kg=f"{given.kg:.6g}",
            material=expected.words,
            weight=f"{weight:.6g}",
            difference=f"{weight / given.kg - 1:+.0%}",
        ),
        abs(weight - given.kg),
    )


def implausible(given: GivenMass, volume: float) -> Iterator[Note]:
    """Warn of a mass that no material has in this volume.

    Grams may have been read as kilograms, or it is the mass of another part.
    """
    if volume <= 0 or not given.kg:
        return
    least, most = (given.kg - given.quantum) / volume, (given.kg + given.quantum) / volume
    if most >= LIGHTEST_PART and least <= DENSEST:
        return
    dense = least > DENSEST
    than, shape = (
        (message("denser than any metal"), "shell")
        if dense
        else (message("lighter than any solid"), "envelope")
    )
    yield Note(
        MassCode.IMPLAUSIBLE,
        message(
            "the BOM's {kg} kg in {volume} cm³ would be {density} kg/m³, {than}: is the "
            "unit, the decimal mark or the row wrong, or the shape a mere {shape} of the "
            "part? The BOM's mass was used",
            kg=f"{given.kg:.6g}",
            volume=f"{volume * 1000000.0:.4g}",
            density=f"{given.kg / volume:.3g}",
            than=than,
            shape=shape,
        ),
    )


def looks_like_totals(masses: Iterable[tuple[bool, float, bool]]) -> bool:
    """Return True if the whole mass column seems to hold row totals.

    masses
        of each row with a mass: (can be compared with a density, pieces, looks like the row's total). One
        total is enough if no comparable row of several pieces has the mass of one piece.
    """
    several = [total for compared, pieces, total in masses if compared and pieces >= 2]
    return bool(several) and all(several)


TOTAL_BY_OTHERS = Note(
    MassCode.ROW_TOTAL,
    message(
        "other masses of this BOM look like those of whole rows, and this one, of a row "
        "of several pieces, cannot be checked: no density is known for it. It was used "
        "as that of one piece"
    ),
)


def density_doubts(prototype: Prototype, used: Material) -> Iterator[Note]:
    """Warn if the density of the used material varies much, and if the geometry file states another
    density.
    """
    stated, density = prototype.step_density, used.density
    if used.spread >= SPREAD_LIMIT:
        low, high = density * (1 - used.spread), density * (1 + used.spread)
        yield Note(
            MassCode.DENSITY_VARIES,
            message(
                "{name} has from {low} to {high} kg/m³, by its kind; {density} kg/m³ were used, "
                "so the mass is ± {spread}",
                name=used.name,
                low=f"{low:.4g}",
                high=f"{high:.4g}",
                density=f"{density:g}",
                spread=f"{used.spread:.0%}",
            ),
            used.spread * density * prototype.volume_m3,
        )
    if stated is not None and abs(stated - density) > max(MISMATCH_LIMIT, used.spread) * density:
        material = (
            message(" ({step_material})", step_material=prototype.step_material)
            if prototype.step_material
            else ""
        )
        yield Note(
            MassCode.STEP_DENSITY,
            message(
                "the file states {stated} kg/m³{material}, {name} has {density} kg/m³; the BOM's "
                "material was used",
                stated=f"{stated:g}",
                material=material,
                name=used.name,
                density=f"{density:g}",
            ),
            abs(stated - density) * prototype.volume_m3,
        )


def _is_multiple(mass: float, expected: float, quantity: float) -> bool:
    return quantity >= 2 and abs(mass / expected - quantity) <= MISMATCH_LIMIT * quantity


@dataclass(frozen=True)
class PlacedAssembly:
    """A placed sub-assembly whose row gives a mass.

    path, below
        its instance path, and the indices of all parts in it.
    agrees
        the parts' masses sum up to it, or were taken from it.
    implausible
        nothing that parts are made of gives this mass in their volume.
    """

    match: Match
    path: tuple[str, ...]
    below: tuple[int, ...]
    agrees: bool
    implausible: bool


@dataclass(eq=False)
class Groups:
    """The masses and decisions of all instances, while sub-assembly rows may still change them.

    ``mass`` and ``decisions`` are changed in place; instances that are not ``counted`` are left alone.

    weighed
        (N,) bool: instances whose mass a scale said, alone or with others. They keep it at every level above.
    """

    assembly: Assembly
    volume: Floats
    mass: Floats
    decisions: list[MassDecision]
    counted: NDArray[np.bool_]
    rule: MassRule
    weighed: NDArray[np.bool_]
    _made: dict[tuple[Match, MassDecision, str], MassDecision] = field(default_factory=dict)

    def apply(self, matches: Mapping[str, Match]) -> Iterator[PlacedAssembly]:
        """Use or compare every matched row, once per placed sub-assembly. ``matches``: by product name."""
        for match, path, below in self._occurrences(matches):
            row = match.row
            with_data = [i for i in below if _has_data(self.decisions[i])]
            gaps = [i for i in below if not _has_data(self.decisions[i])]
            if row.mass_kg is None:
                if not row.has_children:
                    self._cover(match, gaps)
                continue
            left = row.mass_kg - float(self.mass[with_data].sum())
            agrees = True
            if gaps and (left > 0 or not with_data):
                self._share(match, gaps, left, partly=bool(with_data))
            if row.overridden:
                agrees = self._weigh(match, below)
            elif with_data:
                agrees = self._compare(match, below, with_data[0])
            volume = float(self.volume[below].sum())
            odd = any(implausible(GivenMass(row.mass_kg, row.quantum_kg), volume))
            yield PlacedAssembly(match, path, tuple(below), agrees, odd)

    def _occurrences(
        self, matches: Mapping[str, Match]
    ) -> Iterator[tuple[Match, tuple[str, ...], list[int]]]:
        """Yield each placed sub-assembly that has a row, deepest first, with its instances."""
        for path, indices in sorted(placed_below(self.assembly).items(), key=lambda pair: -len(pair[0])):
            names = {index: self.assembly.instances[index].product_path for index in indices}
            match = matches.get(names[indices[0]][len(path) - 1])
            below = [index for index in indices if self.counted[index] and len(names[index]) > len(path)]
            if match is not None and below:
                yield match, path, below

    def _share(self, match: Match, gaps: list[int], mass: float, *, partly: bool) -> None:
        """Spread a mass over parts without data by volume, or evenly if none has a volume."""
        row = match.row
        weights = self.volume[gaps]
        solid = bool(weights.sum() > 0)
        if not solid:
            weights = np.ones(len(gaps))
        self.mass[gaps] = mass * weights / weights.sum()
        what = message("{mass_kg} kg for “{name}” around it", mass_kg=f"{row.mass_kg:.6g}", name=row.name)
        if partly:
            what += message(", of which its other parts leave {mass} kg", mass=f"{mass:.6g}")
        note = Note(
            MassCode.SUB_ASSEMBLY_SHARED,
            message("the BOM has no data for it, but {what}; that was spread ", what=what)
            + (message("by volume") if solid else message("evenly, as points, since there is no solid")),
        )
        volume = float(self.volume[gaps].sum())
        doubts = tuple(implausible(GivenMass(mass, row.quantum_kg), volume)) if solid else ()
        for index in gaps:
            new = replace(
                self.decisions[index],
                rule=Rule.SUB_ASSEMBLY,
                decided=match.decided,
                lines=tuple(line.line for line in match.bundle.rows),
                source=Source.SUB_ASSEMBLY_MASS,
                mass_kg=None,
                density=None,
                density_source="",
                quantum_kg=row.quantum_kg,
                notes=(*_doubt(match), note, *doubts),
            )
            self._set(index, match, new)

    def _weigh(self, match: Match, below: list[int]) -> bool:
        """Scale the parts of a sub-assembly to what a scale said of it, but for those that were weighed."""
        row, stated = match.row, match.row.mass_kg or 0.0
        rest = [index for index in below if not self.weighed[index]]
        total = float(self.mass[below].sum())
        left = stated - (total - float(self.mass[rest].sum()))
        if not rest or left <= EXACT * stated:
            return self._compare(
                match, below, below[0], row.quantum_kg, message("were weighed, too, and were used")
            )
        if abs(total - stated) > EXACT * stated:
            weights = next(
                (w for w in (self.mass[rest], self.volume[rest]) if w.sum() > 0), np.ones(len(rest))
            )
            self.mass[rest] = left * weights / weights.sum()
            note = Note(
                MassCode.SUB_ASSEMBLY_SHARED,
                message(
                    "the BOM's {stated} kg for “{name}” around it are marked as set by hand: its "
                    "parts sum up to {total} kg, and were scaled to it",
                    stated=f"{stated:.6g}",
                    name=row.name,
                    total=f"{total:.6g}",
                ),
            )
            for index in rest:
                old = self.decisions[index]
                new = replace(
                    old,
                    source=Source.SUB_ASSEMBLY_MASS,
                    mass_kg=None,
                    density=None,
                    density_source="",
                    quantum_kg=row.quantum_kg,
                    notes=(*old.notes, note),
                )
                self._set(index, match, new)
        self.weighed[below] = True
        return True

    def _compare(
        self,
        match: Match,
        below: list[int],
        first: int,
        allowed: float | None = None,
        why: str = "were used",
    ) -> bool:
        row = match.row
        total = float(self.mass[below].sum())
        stated = row.mass_kg or 0.0
        if allowed is None:
            allowed = max(row.quantum_kg, MISMATCH_LIMIT * stated)
        if abs(total - stated) <= allowed:
            return True
        note = Note(
            MassCode.SUB_ASSEMBLY,
            message(
                "the parts of “{name}” sum up to {total} kg, its own row says {stated} kg; the parts {why}",
                name=row.name,
                total=f"{total:.6g}",
                stated=f"{stated:.6g}",
                why=why,
            ),
        )
        old = self.decisions[first]
        if note not in old.notes:
            new = replace(old, notes=(*old.notes, note))
            self.decisions[:] = [new if decision is old else decision for decision in self.decisions]
        return False

    def _cover(self, match: Match, gaps: list[int]) -> None:
        """Let a row without children and mass stand for the parts that the BOM does not list."""
        for index in gaps:
            prototype = self.assembly.prototypes[self.assembly.instances[index].prototype]
            if self.decisions[index].rule is Rule.NONE:
                self._set(index, match, self.rule.decide_by_sub_assembly(prototype, match))
                self.mass[index] = (self.decisions[index].density or 0.0) * self.volume[index]

    def _set(self, index: int, match: Match, new: MassDecision) -> None:
        """Set the decision of an instance. All instances of one (row, product) share it, so that they stay
        one part in the report.
        """
        key = (match, self.decisions[index], self.assembly.instances[index].prototype)
        self.decisions[index] = self._made.setdefault(key, new)


_INFORMED = {Source.BOM_MASS, Source.MATERIAL, Source.SUB_ASSEMBLY_MASS}


def _has_data(decision: MassDecision) -> bool:
    return decision.source in _INFORMED or decision.material is not None


def _doubt(match: Match) -> tuple[Note, ...]:
    return (*((Note(MassCode.AMBIGUOUS, match.doubt),) if match.doubt else ()), *two_ways(match.row))


@dataclass(frozen=True, eq=False)
class Placed:
    """Every instance in the assembly's frame.

    volume (N,) [m^3]; com (N, 3) [m]; unit (N, 3, 3) [m^5]; mass (N,) [kg]
    decisions
        one per instance; instances of one product share theirs.
    counted
        (N,) bool; False for wires and surfaces that merely stand beside a solid of the same product.
    groups
        placed sub-assemblies whose BOM row gives a mass.
    on_scale
        (N,) bool: what the BOM marks as set by hand, of the part or of a sub-assembly around it.
    """

    volume: Floats
    com: Floats
    unit: Floats
    mass: Floats
    decisions: Sequence[MassDecision]
    counted: NDArray[np.bool_]
    groups: Sequence[PlacedAssembly] = ()
    on_scale: NDArray[np.bool_] | None = None

    def inertia(self, index: NDArray[np.intp]) -> Floats:
        """Return the tensors (n, 3, 3) [kg m^2] of these instances, about their own centres of mass."""
        volume = self.volume[index]
        density = np.divide(self.mass[index], volume, out=np.zeros(len(index)), where=volume > 0)
        tensors: Floats = self.unit[index] * density[:, None, None]
        return tensors


def place_all(assembly: Assembly, rule: MassRule, matching: Matching) -> Placed:
    """Decide the mass of every product once, then give each instance its mass."""
    instances = assembly.instances
    volume, com, unit = _geometry(assembly)
    beside = companions(assembly)
    counted = np.array([i.prototype not in beside for i in instances], bool)
    per_product = {
        key: rule.decide(prototype, matching.parts.get(key)) for key, prototype in assembly.prototypes.items()
    }
    _note_totals(per_product)
    _note_scaling(assembly, per_product)
    decisions = [per_product[i.prototype] for i in instances]
    mass = np.array(
        [
            decision.mass_kg if decision.mass_kg is not None else (decision.density or 0.0) * v
            for decision, v in zip(decisions, volume, strict=True)
        ],
        float,
    ).reshape(len(instances))
    mass[~counted] = 0.0
    by_scale = {
        key for key, found in matching.parts.items() if found.row.overridden and found.row.mass_kg is not None
    }
    on_scale = np.array([i.prototype in by_scale for i in instances], bool)
    groups = tuple(Groups(assembly, volume, mass, decisions, counted, rule, on_scale).apply(matching.groups))
    return Placed(volume, com, unit, mass, decisions, counted, groups, on_scale)


def weighed(placed: Placed, groups: Sequence[tuple[str, Sequence[int], float]]) -> tuple[Placed, list[Note]]:
    """Scale the instances so that each group has its weighed mass; also return notes on groups where that is
    impossible.

    groups
        (name, indices, kg), those inside of others first. A part with its own weight keeps it, and the rest
        of its group shares the remaining weight: by mass, or by volume if there are no masses.
    """
    mass, decisions = placed.mass.copy(), list(placed.decisions)
    notes: list[Note] = []
    for name, indices, kg in groups:
        members = [index for index in indices if placed.counted[index]]
        rest = [index for index in members if decisions[index].source is not Source.TARGET_MASS]
        left = kg - float(mass[members].sum() - mass[rest].sum())
        if placed.on_scale is not None:  # what the BOM says of a scale stays, unless it is of these parts
            others = [index for index in rest if not placed.on_scale[index]]
            left_for_others = kg - float(mass[members].sum() - mass[others].sum())
            if others and left_for_others > 0:
                rest, left = others, left_for_others
        weights = next((w for w in (mass[rest], placed.volume[rest]) if w.sum() > 0), np.ones(len(rest)))
        if not members or not (left > 0 if rest else abs(left) <= MISMATCH_LIMIT * kg):
            why = (
                message("its weighed parts sum up to {left} kg", left=f"{kg - left:.6g}")
                if members
                else message("nothing is called so")
            )
            words = message(
                "{name} shall weigh {kg} kg, but {why}: that was not used", name=name, kg=f"{kg:.6g}", why=why
            )
            notes.append(Note(MassCode.TARGET_DIFFERS, words))
            continue
        words = message("weighed: {name} is {kg} kg", name=name, kg=f"{kg:.6g}")
        mass[rest] = left * weights / weights.sum() if rest else []
        made: dict[MassDecision, MassDecision] = {}
        for index in rest:
            old = decisions[index]
            if old not in made:
                new = replace(old, source=Source.TARGET_MASS, mass_kg=None, density=None, quantum_kg=0.0)
                made[old] = replace(new, density_source=words)
            decisions[index] = made[old]
    return replace(placed, mass=mass, decisions=decisions), notes


def _geometry(assembly: Assembly) -> tuple[Floats, Floats, Floats]:
    keys = list(assembly.prototypes)
    at = {key: index for index, key in enumerate(keys)}
    which = np.array([at[i.prototype] for i in assembly.instances], int)
    prototypes = list(assembly.prototypes.values())
    volumes = np.array([p.volume_m3 for p in prototypes], float)[which]
    coms = np.array([p.com_m for p in prototypes], float).reshape(-1, 3)[which]
    units = np.array([p.inertia_unit for p in prototypes], float).reshape(-1, 3, 3)[which]
    placements = np.array([i.transform for i in assembly.instances], float).reshape(-1, 4, 4)
    return place(volumes, coms, units, placements)


def _note_totals(decisions: dict[str, MassDecision]) -> None:
    """Mark masses that cannot be checked as doubtful, if those that can be are row totals."""
    given = {key: decision for key, decision in decisions.items() if decision.source is Source.BOM_MASS}
    totals = {key: any(note.code == MassCode.ROW_TOTAL for note in d.notes) for key, d in given.items()}
    if not looks_like_totals((d.compared, d.pieces, totals[key]) for key, d in given.items()):
        return
    for key, decision in given.items():
        if not decision.compared and decision.pieces >= 2:
            decisions[key] = replace(decision, notes=(*decision.notes, TOTAL_BY_OTHERS))


def _note_scaling(assembly: Assembly, decisions: dict[str, MassDecision]) -> None:
    placements = np.array([i.transform for i in assembly.instances], float).reshape(-1, 4, 4)
    scaled = {assembly.instances[i].prototype for i in np.flatnonzero(~rigid_mask(placements))}
    for key in sorted(scaled):
        codes = {problem.code for problem in assembly.prototypes[key].problems}
        if GeometryCode.SCALED in codes:
            continue
        note = Note(
            GeometryCode.SCALED,
            message(
                "some of its placements scale the part; its volume and inertia were scaled with "
                "it, a BOM mass was not"
            ),
        )
        decisions[key] = replace(decisions[key], notes=(*decisions[key].notes, note))
