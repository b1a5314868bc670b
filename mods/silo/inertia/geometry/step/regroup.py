# SPDX-License-Identifier: LGPL-2.1-or-later
"""Flat assemblies of thousands, cut into groups before the kernel reads them.

The kernel's reader goes through all uses of a product for each of its uses: 10 000 parts on one level (a
populated circuit board, a flat export) cost it 8 s, in a hundred groups of a hundred 1 s. So the text of
such a file gets groups, sub-assemblies at the origin that :mod:`xcaf` takes out again; nothing else is
touched, and a file whose structure is not plain is left as it is.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

from silo.inertia.geometry.step.part21 import Buffer, Part21, ref, refs
from silo.inertia.geometry.step.product_text import Products

GROUP_FROM = 1_000
GROUP_SIZE = 100
MARK = "silo-mod:group:"
"""What the products of our groups are called; no file has it."""

_USE = "NEXT_ASSEMBLY_USAGE_OCCURRENCE"
_REFERENCE = re.compile(rb"'(?:[^']|'')*'|#(\d+)")
_TIED = re.compile(
    rb"(?<![A-Z_])REPRESENTATION_RELATIONSHIP\s*\((?:'(?:[^']|'')*'|[\s,$])*#(\d+)\s*,\s*#(\d+)"
)
_MOVED = re.compile(rb"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION\s*\(\s*#(\d+)")
_DATA_END = re.compile(rb"ENDSEC\s*;\s*END-ISO-10303-21")


@dataclass(frozen=True, slots=True)
class _Use:
    """One use of a part in an assembly: its occurrence, the relationship that places it, and the items of
    the assembly's representation that the placement speaks of."""

    occurrence: int
    relationship: int
    items: tuple[int, ...]


@dataclass(eq=False)
class _Flat:
    """An assembly with too many uses. ``context`` of its representation, ``about`` of its definition."""

    definition: int
    representation: int
    context: int
    about: int
    product_context: tuple[int, ...]
    uses: list[_Use] = field(default_factory=list)


def regrouped(source: Part21, products: Products) -> tuple[bytes | None, int]:
    """The text with groups in its flat assemblies, and how many entities were added at its end.

    (None, 0) where no assembly is flat, or nothing can be done.
    """
    counts: dict[int, int] = defaultdict(int)
    for assembly, _ in products.uses:
        counts[assembly] += 1
    flat = [assembly for assembly, count in counts.items() if count >= GROUP_FROM]
    if not flat:
        return None, 0
    data = source.data
    found = [_flat(source, assembly) for assembly in flat]
    cuttable = [one for one in found if one is not None]
    end = _DATA_END.search(data)
    if not cuttable or end is None:
        return None, 0
    writer = _Writer(source.highest + 1)
    edits: list[tuple[int, int, bytes]] = []
    for one in cuttable:
        edits += _edits(source, one, writer)
    edits.append((end.start(), end.start(), "".join(writer.lines).encode("ascii")))
    return _edited(data, edits), len(writer.lines)


def _flat(source: Part21, definition: int) -> _Flat | None:
    """What is needed of one assembly; None where anything is not as the recommended practice has it."""
    arguments = source.arguments(definition)
    formation = source.arguments(ref(arguments, 2) or 0)
    product = source.arguments(ref(formation, 2) or 0)
    shapes = {first: n for n, (first, *_) in _ends_of(source, "PRODUCT_DEFINITION_SHAPE", 1)}
    defined = {
        shape: found for _, (shape, found, *_) in _ends_of(source, "SHAPE_DEFINITION_REPRESENTATION", 2)
    }
    representation = defined.get(shapes.get(definition, 0), 0)
    context = ref(source.arguments(representation), 2)
    about = ref(arguments, 3)
    if context is None or about is None or len(product) < 4:
        return None
    flat = _Flat(definition, representation, context, about, refs(product[3]))
    own_items = frozenset(refs(source.arguments(representation)[1]))
    placing = {
        used: placed
        for _, (placed, used, *_) in _ends_of(source, "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION", 2)
    }
    for number, (assembly, *_) in _ends_of(source, _USE, 2):
        if assembly == definition:
            relationship = placing.get(shapes.get(number, 0), 0)
            tied = _TIED.search(source.body(relationship))
            if tied is None or representation not in (int(tied[1]), int(tied[2])):
                return None
            moved = _MOVED.search(source.body(relationship))
            items = source.references(int(moved[1])) if moved is not None else ()
            flat.uses.append(_Use(number, relationship, tuple(i for i in items if i in own_items)))
    return flat


def _ends_of(source: Part21, keyword: str, least: int) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Entities of one kind with what they refer to, at least ``least`` of it."""
    for number in source.listed(keyword):
        found = source.references(number)
        if len(found) >= least:
            yield number, found


def _edits(source: Part21, flat: _Flat, writer: _Writer) -> Iterator[tuple[int, int, bytes]]:
    for start in range(0, len(flat.uses), GROUP_SIZE):
        group = flat.uses[start : start + GROUP_SIZE]
        definition, representation = writer.group(flat, group)
        for use in group:
            yield from _replaced(source, use.occurrence, flat.definition, definition)
            yield from _replaced(source, use.relationship, flat.representation, representation)


def _replaced(source: Part21, number: int, old: int, new: int) -> Iterator[tuple[int, int, bytes]]:
    """Edits that make entity ``number`` refer to ``new`` where it refers to ``old``."""
    start = source.starts[number]
    for match in _REFERENCE.finditer(source.body(number)):
        if match[1] is not None and int(match[1]) == old:
            yield start + match.start(), start + match.end(), b"#%d" % new


def _edited(data: Buffer, edits: list[tuple[int, int, bytes]]) -> bytes:
    pieces, position = [], 0
    for start, end, text in sorted(edits):
        pieces += [data[position:start], text]
        position = end
    return b"".join([*pieces, data[position:]])


class _Writer:
    """New entities, numbered after the file's own."""

    def __init__(self, first: int) -> None:
        self._next = first
        self._groups = 0
        self.lines: list[str] = []

    def group(self, flat: _Flat, uses: list[_Use]) -> tuple[int, int]:
        """One more sub-assembly at the origin of ``flat``: its definition and its representation."""
        self._groups += 1
        name = f"'{MARK}{self._groups}'"
        contexts = ",".join(f"#{n}" for n in flat.product_context)
        product = self.add(f"PRODUCT({name},{name},'',({contexts}))")
        formation = self.add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
        definition = self.add(f"PRODUCT_DEFINITION('design','',#{formation},#{flat.about})")
        shape = self.add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
        axis = self._axis()
        items = ",".join(f"#{n}" for n in dict.fromkeys((axis, *(i for use in uses for i in use.items))))
        representation = self.add(f"SHAPE_REPRESENTATION('',({items}),#{flat.context})")
        self.add(f"SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})")
        use = self.add(f"{_USE}({name},{name},'',#{flat.definition},#{definition},$)")
        used = self.add(f"PRODUCT_DEFINITION_SHAPE('','',#{use})")
        stay = self.add(f"ITEM_DEFINED_TRANSFORMATION('','',#{axis},#{axis})")
        relationship = self.add(
            f"(REPRESENTATION_RELATIONSHIP('','',#{representation},#{flat.representation})"
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{stay})SHAPE_REPRESENTATION_RELATIONSHIP())"
        )
        self.add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relationship},#{used})")
        return definition, representation

    def _axis(self) -> int:
        origin = self.add("CARTESIAN_POINT('',(0.,0.,0.))")
        z, x = self.add("DIRECTION('',(0.,0.,1.))"), self.add("DIRECTION('',(1.,0.,0.))")
        return self.add(f"AXIS2_PLACEMENT_3D('',#{origin},#{z},#{x})")

    def add(self, text: str) -> int:
        """Write an entity; its number."""
        number = self._next
        self._next += 1
        self.lines.append(f"#{number}={text};\n")
        return number
