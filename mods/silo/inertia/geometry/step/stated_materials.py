# SPDX-License-Identifier: LGPL-2.1-or-later
"""Materials and densities that a STEP file states.

Densities are read with the unit that stands beside them. The kernel's own reading loses it: steel comes out
as 0.00785 or 7.85e-6 by the call, and not at all where the material has no name.
"""

from __future__ import annotations

from collections import defaultdict

from silo.inertia.geometry.step.part21 import Part21, Typed, Value, number, ref, refs, text

_PREFIXES = {
    ".EXA.": 1e18, ".PETA.": 1e15, ".TERA.": 1e12, ".GIGA.": 1e9, ".MEGA.": 1e6, ".KILO.": 1e3,
    ".HECTO.": 1e2, ".DECA.": 1e1, ".DECI.": 1e-1, ".CENTI.": 1e-2, ".MILLI.": 1e-3, ".MICRO.": 1e-6,
    ".NANO.": 1e-9, ".PICO.": 1e-12,
}  # fmt: skip
_SI = {".METRE.": 1.0, ".GRAM.": 1e-3}


def stated_materials(source: Part21) -> list[tuple[int, str | None, float | None, str]]:
    """(PRODUCT_DEFINITION id, material name, density [kg/m^3], what is wrong with it) as they come."""
    made_from = defaultdict(list)
    for _, arguments in source.of("MAKE_FROM_USAGE_OPTION"):
        part, raw = ref(arguments, 3), ref(arguments, 4)
        if part is not None and raw is not None:
            made_from[raw].append(part)
    represented = {ref(a, 0): ref(a, 1) for _, a in source.of("PROPERTY_DEFINITION_REPRESENTATION")}
    found: list[tuple[int, str | None, float | None, str]] = []
    for definition, arguments in source.of("PROPERTY_DEFINITION"):
        if "material" not in text(arguments, 0).lower():
            continue
        target, representation = ref(arguments, 2), represented.get(definition)
        if target is None or representation is None:
            continue
        name, density, problem = _representation(source, representation)
        # Pro/E files hang the density on a raw material, a product of its own that the part is made from.
        raw_name = _product_name(source, target) if target in made_from else None
        for pd in made_from.get(target, [target]):
            found.append((pd, name or raw_name, density, problem))
    return found


def _product_name(source: Part21, pd: int) -> str | None:
    part_number, name = names_of(source, source.arguments(pd))
    return name or part_number or None


def names_of(source: Part21, definition: tuple[Value, ...]) -> tuple[str, str]:
    """PRODUCT.id and PRODUCT.name of a PRODUCT_DEFINITION."""
    formation = source.arguments(ref(definition, 2) or 0)
    product = source.arguments(ref(formation, 2) or 0)
    return text(product, 0).strip(), text(product, 1).strip()


def _representation(source: Part21, representation: int) -> tuple[str | None, float | None, str]:
    arguments = source.arguments(representation)
    kind = text(arguments, 0).lower()
    for item in refs(arguments[1]) if len(arguments) > 1 else ():
        keyword, values = source.keywords.get(item), source.arguments(item)
        if keyword == "DESCRIPTIVE_REPRESENTATION_ITEM" and "name" in kind:
            return text(values, 1).strip() or text(values, 0).strip() or None, None, ""
        if keyword == "MEASURE_REPRESENTATION_ITEM" and "density" in kind + text(values, 0).lower():
            return None, *_density(source, values)
    return None, None, ""


def _density(source: Part21, item: tuple[Value, ...]) -> tuple[float | None, str]:
    value = number(item[1]) if len(item) > 1 else None
    factor = _unit(source, ref(item, 2) or 0)
    if value is None or factor is None:
        return None, "a density is given, but its unit cannot be read; it is not used"
    density = value * factor
    # Late: few files state a density, and this loads the tables.
    from silo.inertia.materials.density import DENSEST, LIGHTEST

    if not LIGHTEST <= density <= DENSEST:
        return None, (
            f"a density of {density:.4g} kg/m3 is given, which no material has; its unit must be wrong, and "
            "it is not used"
        )
    return density, ""


def _unit(source: Part21, unit: int, depth: int = 0) -> float | None:
    """The unit in SI (kg, m), None where it is not made of masses and lengths."""
    if depth > 8:
        return None
    arguments = source.arguments(unit)
    keyword = source.keywords.get(unit)
    if keyword == "DERIVED_UNIT":
        factor = 1.0
        for element in refs(arguments[0]) if arguments else ():
            values = source.arguments(element)
            base = _unit(source, ref(values, 0) or 0, depth + 1)
            exponent = number(values[1]) if len(values) > 1 else None
            if base is None or exponent is None or not -9 <= exponent <= 9:
                return None
            factor *= base**exponent
        return factor
    return _named_unit(source, arguments, depth) if keyword == "" else None


def _named_unit(source: Part21, parts: tuple[Value, ...], depth: int) -> float | None:
    """A complex unit: ``(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.))`` or a converted one."""
    for part in parts:
        if not isinstance(part, Typed):
            continue
        if part.name == "SI_UNIT":
            prefix = _PREFIXES.get(text(part.values, 0), 1.0)
            base = _SI.get(text(part.values, 1))
            return None if base is None else prefix * base
        if part.name == "CONVERSION_BASED_UNIT":
            measure = source.arguments(ref(part.values, 1) or 0)
            value = number(measure[0]) if measure else None
            base = _unit(source, ref(measure, 1) or 0, depth + 1)
            return None if value is None or base is None else value * base
    return None
