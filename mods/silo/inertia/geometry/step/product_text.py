# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the text of a STEP file says of its products: part number, material, density, files outside.

The way from a piece of geometry to its product, as AP203, AP214 and AP242 all have it::

    MANIFOLD_SOLID_BREP ← …SHAPE_REPRESENTATION (← SHAPE_REPRESENTATION_RELATIONSHIP) ←
    SHAPE_DEFINITION_REPRESENTATION → PRODUCT_DEFINITION_SHAPE → PRODUCT_DEFINITION → … → PRODUCT
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from silo.inertia.geometry.graph import IDENTITY, Child, Node, bottom_up, count_instances
from silo.inertia.geometry.labels import bare_stem
from silo.inertia.geometry.step.part21 import Part21, Typed, Value, number, ref, refs, text

_DEFINITIONS = (
    "PRODUCT_DEFINITION",
    "PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS",
)
_FORMATIONS = (
    "PRODUCT_DEFINITION_FORMATION",
    "PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE",
)
_PROPERTIES = ("PROPERTY_DEFINITION", "PRODUCT_DEFINITION_SHAPE")
_ITEMS = (
    "MANIFOLD_SOLID_BREP",
    "BREP_WITH_VOIDS",
    "FACETED_BREP",
    "SHELL_BASED_SURFACE_MODEL",
    "FACE_BASED_SURFACE_MODEL",
    "GEOMETRIC_CURVE_SET",
    "GEOMETRIC_SET",
    "TESSELLATED_SOLID",
    "TESSELLATED_SHELL",
)
WANTED = frozenset(
    (
        *_DEFINITIONS,
        *_FORMATIONS,
        *_PROPERTIES,
        *_ITEMS,
        "PRODUCT",
        "PROPERTY_DEFINITION_REPRESENTATION",
        "SHAPE_DEFINITION_REPRESENTATION",
        "SHAPE_REPRESENTATION_RELATIONSHIP",
        "REPRESENTATION",
        "MEASURE_REPRESENTATION_ITEM",
        "DESCRIPTIVE_REPRESENTATION_ITEM",
        "DERIVED_UNIT",
        "DERIVED_UNIT_ELEMENT",
        "LENGTH_MEASURE_WITH_UNIT",
        "MASS_MEASURE_WITH_UNIT",
        "MAKE_FROM_USAGE_OPTION",
        "APPLIED_DOCUMENT_REFERENCE",
        "DOCUMENT_PRODUCT_EQUIVALENCE",
        "DOCUMENT_FILE",
        "APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT",
        "NEXT_ASSEMBLY_USAGE_OCCURRENCE",
        "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION",
        "ITEM_DEFINED_TRANSFORMATION",
    )
)


@dataclass(frozen=True)
class ProductFacts:
    """One PRODUCT_DEFINITION.

    part_number, name
        PRODUCT.id and PRODUCT.name.
    density
        [kg/m^3], None where the file gives none that can be used; ``density_problem`` says why.
    documents
        names of the files that the product's geometry is said to be in.
    """

    part_number: str = ""
    name: str = ""
    material: str | None = None
    density: float | None = None
    density_problem: str = ""
    documents: tuple[str, ...] = ()


@dataclass(frozen=True)
class Products:
    """All products of a file. ``by_ordinal``: entity position in the file → PRODUCT_DEFINITION id.

    ``count`` is the number of entities: positions only mean something to a reader that counts as many.
    ``uses`` are (assembly, part) as PRODUCT_DEFINITION ids, ``shaped`` those with geometry of their own.
    """

    facts: dict[int, ProductFacts] = field(default_factory=dict)
    by_ordinal: dict[int, int] = field(default_factory=dict)
    count: int = 0
    uses: tuple[tuple[int, int], ...] = ()
    shaped: frozenset[int] = frozenset()

    def elsewhere(self) -> set[str]:
        """Names of the files that may hold products which have neither geometry nor parts here."""
        full = self.shaped.union(assembly for assembly, _ in self.uses)
        return {
            name
            for product, facts in self.facts.items()
            if product not in full
            for name in (*map(bare_stem, facts.documents), facts.name, facts.part_number)
            if name
        }

    def named(self, name: str) -> ProductFacts | None:
        """The facts of the only product with this name; None where there is none, or several."""
        found = [f for f in self.facts.values() if f.name == name or (not f.name and f.part_number == name)]
        return found[0] if len(found) == 1 else None


def read_products(source: Part21) -> Products:
    """Everything the text says of products."""
    facts = {pd: ProductFacts(*names_of(source, a)) for pd, a in source.of(*_DEFINITIONS)}
    for pd, material, density, problem in stated_materials(source):
        if pd in facts:
            old = facts[pd]
            facts[pd] = replace(
                old,
                material=material or old.material,
                density=density if density is not None else old.density,
                density_problem=problem or old.density_problem,
            )
    for pd, documents in _documents(source).items():
        if pd in facts:
            facts[pd] = replace(facts[pd], documents=documents)
    items = [
        (owner, item)
        for representation, owner in _representation_owners(source).items()
        for item in source.references(representation)
        if source.keywords.get(item)
    ]
    return Products(
        facts,
        by_ordinal={
            **{source.ordinals[product]: product for product in facts},
            **{source.ordinals[item]: owner for owner, item in items},
        },
        count=source.count,
        uses=tuple(_uses(source, facts)),
        shaped=frozenset(owner for owner, item in items if source.keywords[item] in _ITEMS),
    )


def _representation_owners(source: Part21) -> dict[int, int]:
    """Representation id → PRODUCT_DEFINITION id, also over SHAPE_REPRESENTATION_RELATIONSHIPs."""
    shapes = {n: next(iter(source.references(n)), 0) for n in source.listed("PRODUCT_DEFINITION_SHAPE")}
    owner: dict[int, int] = {}
    for _, arguments in source.of("SHAPE_DEFINITION_REPRESENTATION"):
        pd = shapes.get(ref(arguments, 0) or 0)
        representation = ref(arguments, 1)
        if pd is not None and representation is not None:
            owner[representation] = pd
    for _, arguments in source.of("SHAPE_REPRESENTATION_RELATIONSHIP"):
        one, two = ref(arguments, 2), ref(arguments, 3)
        if one is not None and two is not None:
            if one in owner:
                owner.setdefault(two, owner[one])
            elif two in owner:
                owner.setdefault(one, owner[two])
    return owner


def _uses(source: Part21, facts: dict[int, ProductFacts]) -> Iterator[tuple[int, int]]:
    for number_ in source.listed("NEXT_ASSEMBLY_USAGE_OCCURRENCE"):
        ends = source.references(number_)
        if len(ends) >= 2 and ends[0] in facts and ends[1] in facts:
            yield ends[0], ends[1]


def count_placed(products: Products) -> int:
    """How many placed parts the file's structure amounts to. InputError where a product contains itself."""
    children: dict[int, list[Child]] = {pd: [] for pd in products.facts}
    use = {pd: Child("", str(pd), IDENTITY) for pd in products.facts}
    for assembly, part in products.uses:
        children[assembly].append(use[part])
    nodes = {
        str(pd): Node(str(pd), products.facts[pd].name, tuple(found), not found)
        for pd, found in children.items()
    }
    used = {str(part) for _, part in products.uses}
    tops = [key for key in nodes if key not in used] or list(nodes)[:1]
    return sum(count_instances(nodes, bottom_up(nodes, top)) for top in tops)


# --- split assemblies -------------------------------------------------------------------------------------


def _documents(source: Part21) -> dict[int, tuple[str, ...]]:
    """PRODUCT_DEFINITION id → names of the files said to hold its geometry (AP214 external references)."""
    files = {n: text(a, 0) or text(a, 1) for n, a in source.of("DOCUMENT_FILE")}
    if not files:
        return {}
    by_formation = {
        ref(a, 2): tuple(files[d] for d in refs(a[4]) if d in files)
        for _, a in source.of("PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS")
        if len(a) > 4
    }
    by_document = {
        ref(a, 2): by_formation.get(ref(a, 3), ()) for _, a in source.of("DOCUMENT_PRODUCT_EQUIVALENCE")
    }
    result: dict[int, tuple[str, ...]] = {}
    for _, arguments in source.of("APPLIED_DOCUMENT_REFERENCE"):
        names = by_document.get(ref(arguments, 0), ())
        for pd in refs(arguments[2]) if len(arguments) > 2 else ():
            result[pd] = result.get(pd, ()) + names
    return result


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
