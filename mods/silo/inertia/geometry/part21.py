# SPDX-License-Identifier: LGPL-2.1-or-later
"""The text of a STEP file (ISO 10303-21), as far as the geometry kernel does not pass it on.

The kernel drops part numbers, drops densities that come without a material name, and turns the unit of the
others into one of its own. So the few entities that carry them are read here, from the text: one pass of a
regular expression finds where every entity stands, and only wanted ones are taken apart.

Of products the text says part number, material, density, bodies and files outside. The way from a piece of
geometry to its product, as AP203, AP214 and AP242 all have it::

    MANIFOLD_SOLID_BREP ← …SHAPE_REPRESENTATION (← SHAPE_REPRESENTATION_RELATIONSHIP) ←
    SHAPE_DEFINITION_REPRESENTATION → PRODUCT_DEFINITION_SHAPE → PRODUCT_DEFINITION → … → PRODUCT
"""

from __future__ import annotations

import mmap
import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.inertia.geometry.graph import IDENTITY, Child, Node, bottom_up, count_instances
from silo.inertia.geometry.part_files import bare_stem

Buffer: TypeAlias = bytes | mmap.mmap


@dataclass(frozen=True, slots=True)
class EntityRef:
    """A reference to another entity: ``#12``."""

    id: int


@dataclass(frozen=True, slots=True)
class Typed:
    """A value with its type, ``LENGTH_MEASURE(1.)``, or one part of a complex entity."""

    name: str
    values: tuple[Value, ...]


Value: TypeAlias = "EntityRef | Typed | str | float | tuple[Value, ...] | None"
"""One argument. ``$`` and ``*`` are None, enumerations are strings with their dots (``.KILO.``)."""

MAX_DEPTH = 60
MAX_ENTITY_BYTES = 4_000_000

_ENTITY = re.compile(rb"#(\d++)\s*+=\s*+([A-Z_0-9]*+)\s*+\(")
_COMPLEX = re.compile(rb"UNIT|REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION|SOLID_MODEL")
_BODY = re.compile(rb"(?:[^';]+|'[^']*')*")
_REFERENCE = re.compile(rb"'(?:[^']|'')*'|#(\d+)")
_COMMENT = re.compile(rb"'[^']*(?:'|\Z)|/\*.*?\*/", re.DOTALL)
_TOKEN = re.compile(
    rb"\s*(?:(?P<string>'(?:[^']|'')*')|#(?P<ref>\d+)|(?P<enum>\.[A-Za-z0-9_]+\.)"
    rb"|(?P<number>[+-]?\d+\.?\d*(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_!][A-Za-z0-9_]*)"
    rb'|(?P<binary>"[0-9A-Fa-f]*")|(?P<mark>[(),$*]))'
)
_END = b"END-ISO-10303-21"


@dataclass(eq=False)
class Part21:
    """The wanted entities of one file.

    keywords
        id → keyword ("" for a complex entity).
    ordinals
        id → position among all entities of the file, counted from 1: the kernel numbers them so.
    ids
        keyword → the ids that have it, in file order.
    count, highest
        how many entities there are, and the largest id.
    complete
        False if the file lacks its end mark, so that it was cut off.
    """

    data: Buffer
    keywords: dict[int, str] = field(default_factory=dict)
    ordinals: dict[int, int] = field(default_factory=dict)
    starts: dict[int, int] = field(default_factory=dict)
    ids: dict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    count: int = 0
    highest: int = 0
    complete: bool = False

    def of(self, *keywords: str) -> Iterator[tuple[int, tuple[Value, ...]]]:
        """Yield id and arguments of each wanted entity with one of these keywords."""
        for number in self.listed(*keywords):
            yield number, self.arguments(number)

    def arguments(self, number: int) -> tuple[Value, ...]:
        """Return the arguments of entity ``number``, or the parts of a complex one as Typed; () if
        unreadable.
        """
        try:
            return _parsed(self.body(number))
        except InputError:
            return ()

    def references(self, number: int) -> tuple[int, ...]:
        """Return all ids to which entity ``number`` refers, in order, at any depth. Quick."""
        return tuple(int(numbers) for numbers in _REFERENCE.findall(self.body(number)) if numbers)

    def listed(self, *keywords: str) -> Iterator[int]:
        """Return the ids of all wanted entities with one of these keywords; those of one keyword in file
        order.
        """
        return (number for keyword in keywords for number in self.ids.get(keyword, ()))

    def body(self, number: int) -> bytes:
        """Return the text of entity ``number`` from its bracket to before its semicolon; empty if there is
        none.
        """
        start = self.starts.get(number)
        if start is None:
            return b""
        match = _BODY.match(self.data, start, min(len(self.data), start + MAX_ENTITY_BYTES))
        return match[0] if match is not None else b""


def scan(data: Buffer, wanted: frozenset[str]) -> Part21:
    """Find bodies, and entities whose keyword is in ``wanted`` or ends in SHAPE_REPRESENTATION.

    Of the complex entities it finds units, bodies, and relationships that place a part.
    """
    data = _without_comments(data)
    source = Part21(data)
    names: dict[bytes, str | None] = {}
    ordinal = 0
    for ordinal, match in enumerate(_ENTITY.finditer(data), start=1):
        digits, keyword = match.groups()
        if keyword not in names:
            word = keyword.decode("ascii")
            is_known = word in wanted or _SOLID.fullmatch(word) or word.endswith("SHAPE_REPRESENTATION")
            names[keyword] = word if is_known else None
        number = int(digits)
        if number > source.highest:
            source.highest = number
        name = names[keyword]
        if name is None or (not name and not _COMPLEX.search(data, match.end(), match.end() + 400)):
            continue
        source.keywords[number] = name
        source.ids[name].append(number)
        source.ordinals[number] = ordinal
        source.starts[number] = match.end() - 1
    source.count = ordinal
    source.complete = data.rfind(_END) > 0
    return source


def entities(data: Buffer) -> Iterator[re.Match[bytes]]:
    """Yield number and keyword of each entity of the file, in file order."""
    return _ENTITY.finditer(_without_comments(data))


def _without_comments(data: Buffer) -> Buffer:
    """Blank the comments, which may hold what looks like an entity; nothing else moves."""
    end = data.rfind(b"*/") + 2
    if end < 2:
        return data
    # Most have one in the header only: the rest is not looked through.
    return _COMMENT.sub(_blank, data[:end]) + data[end:]


def _blank(match: re.Match[bytes]) -> bytes:
    """Replace a comment by a space; a string stays."""
    return match[0] if match[0][:1] == b"'" else b" " * len(match[0])


def refs(value: Value) -> tuple[int, ...]:
    """Return the ids to which a value refers directly: that of a reference, or those in a list."""
    if isinstance(value, EntityRef):
        return (value.id,)
    if isinstance(value, tuple):
        return tuple(item.id for item in value if isinstance(item, EntityRef))
    return ()


def ref(values: tuple[Value, ...], position: int) -> int | None:
    """Return the id to which argument ``position`` refers; None if it is no reference."""
    references = refs(values[position]) if position < len(values) else ()
    return references[0] if references else None


def text(values: tuple[Value, ...], position: int) -> str:
    """Return argument ``position`` as text; "" if it is none."""
    value = values[position] if position < len(values) else None
    return value if isinstance(value, str) else ""


def number(value: Value) -> float | None:
    """Return the number in a value, with or without its type around it."""
    if isinstance(value, Typed) and len(value.values) == 1:
        value = value.values[0]
    return value if isinstance(value, float) else None


def _parsed(body: bytes) -> tuple[Value, ...]:
    values, end = _list(body, 0, 0)
    if body[end:].strip():
        raise InputError(message("text after the closing bracket of an entity"))
    # A complex entity is a row of Typed without commas; a simple one a list of arguments.
    return values


def _list(body: bytes, position: int, depth: int) -> tuple[tuple[Value, ...], int]:
    """Parse the bracketed list at ``position``. Returns its values, and the position after it."""
    if depth > MAX_DEPTH:
        raise InputError(
            message("an entity nests its brackets more than {max_depth} deep", max_depth=MAX_DEPTH)
        )
    values: list[Value] = []
    position = _mark(body, position, b"(")
    while True:
        match = _TOKEN.match(body, position)
        if match is None:
            raise InputError(message("an entity ends before its brackets are closed"))
        kind, token = match.lastgroup, match[match.lastgroup or 0]
        position = match.end()
        if kind == "mark" and token == b")":
            return tuple(values), position
        if kind == "mark" and token == b"(":
            inner, position = _list(body, match.end() - 1, depth + 1)
            values.append(inner)
        elif kind == "name":
            inner, position = _list(body, position, depth + 1)
            values.append(Typed(token.decode("ascii"), inner))
        elif not (kind == "mark" and token == b","):
            values.append(_scalar(kind, token))


def _mark(body: bytes, position: int, mark: bytes) -> int:
    match = _TOKEN.match(body, position)
    if match is None or match["mark"] != mark:
        raise InputError(
            message(
                "wanted {mark} in an entity, got {position}",
                mark=mark.decode(),
                position=repr(body[position : position + 10]),
            )
        )
    return match.end()


def _scalar(kind: str | None, token: bytes) -> Value:
    if kind == "ref":
        return EntityRef(int(token))
    if kind == "number":
        return float(token)
    if kind == "enum":
        return token.decode("ascii")
    if kind == "string":
        return decoded(token[1:-1])
    return None


_ESCAPE = re.compile(
    r"\\X2\\(?P<two>[0-9A-Fa-f]*)\\X0\\|\\X4\\(?P<four>[0-9A-Fa-f]*)\\X0\\"
    r"|\\X\\(?P<one>[0-9A-Fa-f]{2})|\\S\\(?P<shift>.)|\\P[A-I]\\|\\\\|''",
    re.DOTALL,
)


def decoded(raw: bytes) -> str:
    """Decode a Part 21 string: quotes, ``\\X\\``, ``\\X2\\``, ``\\X4\\`` and ``\\S\\``.

    Bytes above 127 break the standard, but are common; they are read as UTF-8 if possible, else as
    Windows-1252.
    """
    try:
        plain = raw.decode("utf-8")
    except UnicodeDecodeError:
        plain = raw.decode("cp1252", errors="replace")
    return _ESCAPE.sub(_unescaped, plain.replace("\r", "").replace("\n", ""))


def _unescaped(match: re.Match[str]) -> str:
    if (code := match["two"] or match["four"]) is not None:
        encoding = "utf-16-be" if match["two"] else "utf-32-be"
        return bytes.fromhex(code[: len(code) // 2 * 2]).decode(encoding, errors="replace")
    if match["one"] is not None:
        return chr(int(match["one"], 16))
    if match["shift"] is not None:
        return chr((ord(match["shift"]) + 128) % 256) if ord(match["shift"]) < 128 else match["shift"]
    return {"\\\\": "\\", "''": "'"}.get(match[0], "")


_DEFINITIONS = ("PRODUCT_DEFINITION", "PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS")
TREES = ("CSG_SOLID", "BOOLEAN_RESULT", "SOLID_REPLICA")
"""Bodies that are made from other bodies."""


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_SOLID = re.compile(
    r"\w*SOLID|SOLID_(?!ANGLE)\w+|\w+_BREP|BREP_WITH_VOIDS|\w+_VOLUME|BOXED_HALF_SPACE|BOOLEAN_RESULT|BLOCK"
    r"|SPHERE|TORUS|ELLIPSOID|ECCENTRIC_CONE|RIGHT_\w+|RECTANGULAR_PYRAMID|TETRAHEDRON|CONVEX_HEXAHEDRON"
    r"|FACETED_PRIMITIVE|"
)
"""Entities that are a body wherever they stand among the items of a product's shape: whatever is called a
solid, a B-rep or a volume, and the primitives; "" is a complex one with a SOLID_MODEL in it."""

_SURFACES = _words(
    """SHELL_BASED_SURFACE_MODEL FACE_BASED_SURFACE_MODEL GEOMETRIC_CURVE_SET GEOMETRIC_SET
    TESSELLATED_SHELL"""
)
_LAYER = "PRESENTATION_LAYER_ASSIGNMENT"
_STYLES = _words("STYLED_ITEM OVER_RIDING_STYLED_ITEM CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM")
HIDING = _STYLES | {"INVISIBILITY", _LAYER}
"""Wanted only from a file that hides something: each coloured face has a style."""
WANTED = _words(
    """PRODUCT_DEFINITION_FORMATION PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE PROPERTY_DEFINITION
    PRODUCT_DEFINITION_SHAPE MAPPED_ITEM REPRESENTATION_MAP PRODUCT PROPERTY_DEFINITION_REPRESENTATION
    SHAPE_DEFINITION_REPRESENTATION SHAPE_REPRESENTATION_RELATIONSHIP REPRESENTATION
    MEASURE_REPRESENTATION_ITEM DESCRIPTIVE_REPRESENTATION_ITEM DERIVED_UNIT DERIVED_UNIT_ELEMENT
    LENGTH_MEASURE_WITH_UNIT MASS_MEASURE_WITH_UNIT PLANE_ANGLE_MEASURE_WITH_UNIT MAKE_FROM_USAGE_OPTION
    APPLIED_DOCUMENT_REFERENCE DOCUMENT_PRODUCT_EQUIVALENCE DOCUMENT_FILE
    APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT NEXT_ASSEMBLY_USAGE_OCCURRENCE
    CONTEXT_DEPENDENT_SHAPE_REPRESENTATION ITEM_DEFINED_TRANSFORMATION"""
).union(_DEFINITIONS, TREES, _SURFACES)


@dataclass(frozen=True)
class ProductFacts:
    """One PRODUCT_DEFINITION.

    part_number, name
        PRODUCT.id and PRODUCT.name.
    density
        [kg/m^3], None if the file gives none that can be used; ``density_problem`` says why.
    documents
        names of the files that the product's geometry is in, by its own words.
    bodies
        the entities that are its solids by the text; ``hidden``: how many the file does not show.
    mapped
        those of them that stand in another place than their numbers say.
    unit_mm, unit_rad
        of its lengths, None if the file states none; of its angles.
    """

    part_number: str = ""
    name: str = ""
    material: str | None = None
    density: float | None = None
    density_problem: str = ""
    documents: tuple[str, ...] = ()
    bodies: tuple[int, ...] = ()
    hidden: int = 0
    mapped: frozenset[int] = frozenset()
    unit_mm: float | None = None
    unit_rad: float = 1.0


@dataclass(frozen=True)
class Products:
    """All products of a file. ``by_ordinal``: entity position in the file → PRODUCT_DEFINITION id.

    ``solids`` are all entities that may be a body: keyword and position; ``trees`` of those that are made
    from others: an operator and their numbers; ``stray`` are bodies of no product.
    ``count`` is the number of entities: positions only mean something to a reader that counts as many.
    ``uses`` are (assembly, part) as PRODUCT_DEFINITION ids, ``shaped`` those with geometry of their own.
    """

    facts: dict[int, ProductFacts] = field(default_factory=dict)
    by_ordinal: dict[int, int] = field(default_factory=dict)
    count: int = 0
    uses: tuple[tuple[int, int], ...] = ()
    shaped: frozenset[int] = frozenset()
    solids: dict[int, tuple[str, int]] = field(default_factory=dict)
    trees: dict[int, tuple[str, tuple[int, ...]]] = field(default_factory=dict)
    stray: tuple[int, ...] = ()

    def elsewhere(self) -> set[str]:
        """Return the names of files that may hold the products without geometry or parts here."""
        full = self.shaped.union(assembly for assembly, _ in self.uses)
        return {
            name
            for product, facts in self.facts.items()
            if product not in full
            for name in (*map(bare_stem, facts.documents), facts.name, facts.part_number)
            if name
        }

    def named(self, name: str) -> ProductFacts | None:
        """Return the facts of the only product with this name; None if there is none, or several."""
        facts = [f for f in self.facts.values() if f.name == name or (not f.name and f.part_number == name)]
        return facts[0] if len(facts) == 1 else None


def read_products(source: Part21) -> Products:
    """Read everything that the text says about products."""
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
    owners = _representation_owners(source)
    items = [
        (owner, item)
        for representation, owner in owners.items()
        for item in source.references(representation)
        if source.keywords.get(item) or _is_body(source, item)
    ]
    stray = _bodies(source, facts, owners)
    return Products(
        facts,
        by_ordinal={
            **{source.ordinals[product]: product for product in facts},
            **{source.ordinals[item]: owner for owner, item in items},
        },
        count=source.count,
        uses=tuple(_uses(source, facts)),
        shaped=frozenset(
            owner for owner, item in items if source.keywords[item] in _SURFACES or _is_body(source, item)
        ),
        solids={
            n: (word, source.ordinals[n]) for n, word in source.keywords.items() if _SOLID.fullmatch(word)
        },
        trees={
            n: (next((v for v in a if isinstance(v, str) and v[:1] == "."), ""), tuple(_within(a)))
            for n, a in source.of(*TREES)
        },
        stray=stray,
    )


def _is_body(source: Part21, item: int) -> bool:
    keyword = source.keywords.get(item)
    if keyword == "":
        return b"SOLID_MODEL" in source.body(item)
    return keyword is not None and _SOLID.fullmatch(keyword) is not None


def _is_linked(source: Part21, item: int) -> bool:
    """Return True for the triangles of an exact body, which are no other body."""
    return source.keywords[item] == "TESSELLATED_SOLID" and ref(source.arguments(item), 2) is not None


def _within(values: tuple[Value, ...]) -> Iterator[int]:
    for value in values:
        yield from _within(value.values) if isinstance(value, Typed) else refs(value)


def _bodies(source: Part21, facts: dict[int, ProductFacts], owners: dict[int, int]) -> tuple[int, ...]:
    """Put bodies and unit of length into the facts of each product.

    Returns the bodies that belong to no product, and that are part of no other body.
    """
    hidden = set(_hidden(source))
    mapped = {n: next(iter(source.references(n)[1:]), 0) for n in source.listed("REPRESENTATION_MAP")}
    used = set(mapped.values())
    visited = set[int]()
    bodies_of: dict[int, dict[int, None]] = defaultdict(dict)
    contexts: dict[int, tuple[int, ...]] = {}
    moved: set[int] = set()
    hides: dict[int, int] = defaultdict(int)
    for representation in [n for n, word in source.keywords.items() if word.endswith("SHAPE_REPRESENTATION")]:
        owner = owners.get(representation, 0)
        if owner not in facts:
            visited.update(source.references(representation) if representation in used else ())
            continue
        waiting, seen = [representation], set[int]()
        while waiting:
            if (one := waiting.pop()) in seen:
                continue
            seen.add(one)
            linked: set[int] = set()
            for item in source.references(one):
                if source.keywords.get(item) == "MAPPED_ITEM":
                    waiting += [
                        m for n in source.references(item) if (m := mapped.get(n, 0)) and m not in owners
                    ]
                elif _is_body(source, item):
                    bodies_of[owner][item] = None
                    moved.update([item] if one != representation else [])
                    hides[owner] += item in hidden or one in hidden
                    linked.update([item] if _is_linked(source, item) else [])
            visited.update(bodies_of[owner])
            for item in linked:
                del bodies_of[owner][item]
            if bodies_of[owner]:
                contexts.setdefault(owner, source.references(one)[-1:])
    for owner, bodies in bodies_of.items():
        length = _unit_of(source, contexts.get(owner, ()), "LENGTH_UNIT")
        facts[owner] = replace(
            facts[owner],
            bodies=tuple(bodies),
            hidden=hides[owner],
            mapped=frozenset(moved.intersection(bodies)),
            unit_mm=length and length * 1e3,
            unit_rad=_unit_of(source, contexts.get(owner, ()), "PLANE_ANGLE_UNIT") or 1.0,
        )
    solids = [number_ for number_ in source.keywords if _is_body(source, number_)]
    visited.update(part for solid in solids for part in source.references(solid))
    return tuple(n for n in solids if n not in visited and not _is_linked(source, n))


def _hidden(source: Part21) -> Iterator[int]:
    """Yield the entities that INVISIBILITY hides: directly, or through styles and layers."""
    for entity in source.listed("INVISIBILITY"):
        for number_ in source.references(entity):
            yield number_
            layered = source.keywords.get(number_) == _LAYER
            for item in source.references(number_) if layered else (number_,):
                yield item
                if source.keywords.get(item) in _STYLES:
                    yield from source.references(item)


def _unit_of(source: Part21, context: tuple[int, ...], kind: str) -> float | None:
    """Return a unit of a representation's context in m or rad; None if it has none that we understand."""
    for part in (part for number_ in context for part in source.arguments(number_)):
        if isinstance(part, Typed) and part.name == "GLOBAL_UNIT_ASSIGNED_CONTEXT":
            for unit in _within(part.values):
                parts = source.arguments(unit)
                if any(isinstance(typed, Typed) and typed.name == kind for typed in parts):
                    return _named_unit(source, parts, 0)
    return None


def _representation_owners(source: Part21) -> dict[int, int]:
    """Map representation id → PRODUCT_DEFINITION id, also through SHAPE_REPRESENTATION_RELATIONSHIPs."""
    shapes = {n: next(iter(source.references(n)), 0) for n in source.listed("PRODUCT_DEFINITION_SHAPE")}
    owner: dict[int, int] = {}
    for _, arguments in source.of("SHAPE_DEFINITION_REPRESENTATION"):
        pd = shapes.get(ref(arguments, 0) or 0)
        representation = ref(arguments, 1)
        if pd is not None and representation is not None:
            owner[representation] = pd
    related = defaultdict(list)
    for _, arguments in source.of("SHAPE_REPRESENTATION_RELATIONSHIP"):
        one, two = ref(arguments, 2), ref(arguments, 3)
        if one is not None and two is not None:
            related[one].append(two)
            related[two].append(one)
    waiting = list(owner)
    while waiting:
        one = waiting.pop()
        new = [other for other in related[one] if other not in owner]
        owner.update(dict.fromkeys(new, owner[one]))
        waiting += new
    return owner


def _uses(source: Part21, facts: dict[int, ProductFacts]) -> Iterator[tuple[int, int]]:
    for number_ in source.listed("NEXT_ASSEMBLY_USAGE_OCCURRENCE"):
        ends = source.references(number_)
        if len(ends) >= 2 and ends[0] in facts and ends[1] in facts:
            yield ends[0], ends[1]


def count_placed(products: Products) -> int:
    """Count the placed parts in the file's structure.

    Raises InputError if a product contains itself.
    """
    children: dict[int, list[Child]] = {pd: [] for pd in products.facts}
    use = {pd: Child("", str(pd), IDENTITY) for pd in products.facts}
    for assembly, part in products.uses:
        children[assembly].append(use[part])
    nodes = {
        str(pd): Node(str(pd), products.facts[pd].name, tuple(uses_below), not uses_below)
        for pd, uses_below in children.items()
    }
    used = {str(part) for _, part in products.uses}
    tops = [key for key in nodes if key not in used] or list(nodes)[:1]
    return sum(count_instances(nodes, bottom_up(nodes, top)) for top in tops)


# --- split assemblies -------------------------------------------------------------------------------------


def _documents(source: Part21) -> dict[int, tuple[str, ...]]:
    """Map PRODUCT_DEFINITION id → names of the files that hold its geometry (AP214 external references)."""
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
    documents: dict[int, tuple[str, ...]] = {}
    for _, arguments in source.of("APPLIED_DOCUMENT_REFERENCE"):
        document = ref(arguments, 0)  # of the file itself (Pro/E, CATIA), or of a document that stands for it
        names = (files[document],) if document in files else by_document.get(document, ())
        for pd in refs(arguments[2]) if len(arguments) > 2 else ():
            documents[pd] = documents.get(pd, ()) + names
    return documents


_PREFIXES = {
    ".EXA.": 1e18, ".PETA.": 1e15, ".TERA.": 1e12, ".GIGA.": 1e9, ".MEGA.": 1e6, ".KILO.": 1e3,
    ".HECTO.": 1e2, ".DECA.": 1e1, ".DECI.": 1e-1, ".CENTI.": 1e-2, ".MILLI.": 1e-3, ".MICRO.": 1e-6,
    ".NANO.": 1e-9, ".PICO.": 1e-12,
}  # fmt: skip
_SI = {".METRE.": 1.0, ".GRAM.": 1e-3, ".RADIAN.": 1.0}


def stated_materials(source: Part21) -> list[tuple[int, str | None, float | None, str]]:
    """List (PRODUCT_DEFINITION id, material name, density [kg/m^3], what is wrong with it) in file order."""
    made_from = defaultdict(list)
    for _, arguments in source.of("MAKE_FROM_USAGE_OPTION"):
        part, raw = ref(arguments, 3), ref(arguments, 4)
        if part is not None and raw is not None:
            made_from[raw].append(part)
    represented = {ref(a, 0): ref(a, 1) for _, a in source.of("PROPERTY_DEFINITION_REPRESENTATION")}
    materials: list[tuple[int, str | None, float | None, str]] = []
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
            materials.append((pd, name or raw_name, density, problem))
    return materials


def _product_name(source: Part21, pd: int) -> str | None:
    part_number, name = names_of(source, source.arguments(pd))
    return name or part_number or None


def names_of(source: Part21, definition: tuple[Value, ...]) -> tuple[str, str]:
    """Return PRODUCT.id and PRODUCT.name of a PRODUCT_DEFINITION."""
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
        return None, message("a density is given, but its unit cannot be read; it is not used")
    density = value * factor
    # Late: few files state a density, and this loads the tables.
    from silo.inertia.materials.densities import DENSEST, LIGHTEST

    if not LIGHTEST <= density <= DENSEST:
        return None, (
            message(
                "a density of {density} kg/m3 is given, which no material has; its unit must be "
                "wrong, and it is not used",
                density=f"{density:.4g}",
            )
        )
    return density, ""


def _unit(source: Part21, unit: int, depth: int = 0) -> float | None:
    """Return the unit in SI (kg, m); None if it does not consist of masses and lengths."""
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
    """Return in SI the unit ``(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.))``, or a converted
    one.
    """
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
