# SPDX-License-Identifier: LGPL-2.1-or-later
"""Laws of the mass rule over random assemblies and BOMs: no mass without a source, no gap without a word."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest
from bodies import box, placement, shape_only
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st

from silo.inertia.assembly import Assembly, Instance
from silo.inertia.bom.structure import with_structure
from silo.inertia.bom.table import BOMEntry, BomTable
from silo.inertia.codes import Source
from silo.inertia.names import bare, plain
from silo.inertia.output.json import report_json

Compute = Callable[..., Any]
NAMES = (
    "arm",
    "forearm",
    "M3x10",
    "M3x100",
    "bracket",
    "bracket_2",
    "Part 1",
    "Bolt",
    "Bolt <2>",
    "motor",
    "Peça",
    "Pe?a",
)
MATERIALS = (None, "steel", "PLA", "Unobtainium")
MASSES = (None, 0.0, 0.0785, 0.5)
SCHEMA = json.loads(
    (Path(__file__).parents[3] / "mods" / "silo" / "inertia" / "schema.json").read_text("utf-8")
)
quietly = settings(max_examples=examples(20))


@st.composite
def tables(draw: st.DrawFn) -> BomTable:
    """A BOM of up to eight rows, flat or structured."""
    rows = []
    structured = draw(st.booleans())
    for line in range(draw(st.integers(0, 8))):
        rows.append(
            BOMEntry(
                name=draw(st.sampled_from(NAMES)),
                material=draw(st.sampled_from(MATERIALS)),
                mass_kg=draw(st.sampled_from(MASSES)),
                quantity=draw(st.sampled_from([None, 1.0, 2.0, 3.0])),
                quantum_kg=0.0005,
                level=draw(st.integers(1, 3)) if structured else 1,
                line=line + 2,
            )
        )
    return BomTable(with_structure(rows))


@st.composite
def assemblies(draw: st.DrawFn) -> Assembly:
    """Up to six products of those names, some without a solid, placed one to three times in two levels."""
    prototypes = {}
    instances = []
    for number in range(draw(st.integers(1, 6))):
        name, key = draw(st.sampled_from(NAMES)), f"k{number}"
        size = draw(st.sampled_from([0.01, 0.02, 0.1]))
        solid = draw(st.integers(0, 9)) > 0
        prototypes[key] = box(name, size, size, 0.1, key=key) if solid else shape_only(name, key=key)
        for copy in range(draw(st.integers(1, 3))):
            group = draw(st.sampled_from(["motor", "base"]))
            top = draw(st.sampled_from(["left", "right"]))
            where = placement([draw(st.floats(-1, 1)) for _ in range(3)])
            instances.append(Instance((top, group, f"{key}-{copy}"), (top, group, name), key, where))
    return Assembly("asm", prototypes, tuple(instances))


@dataclass
class Tree:
    """A product with what its BOM row says: ``star`` [kg] is what a scale said."""

    name: str
    star: float | None
    plain: float | None
    material: str | None
    below: list[Tree] = field(default_factory=list)

    def leaves(self) -> list[Tree]:
        """All parts in it."""
        return [leaf for child in self.below for leaf in child.leaves()] if self.below else [self]


@st.composite
def trees(draw: st.DrawFn) -> Tree:
    """A tree of three levels, with stars, masses, materials and gaps at every level."""
    count = itertools.count()

    def tree(depth: int) -> Tree:
        mass = st.sampled_from([None, None, 0.004, 0.05, 0.5])
        made = Tree(f"n{next(count)}", draw(mass), draw(mass), draw(st.sampled_from([None, "steel", "PLA"])))
        if depth < 3 and (depth == 0 or draw(st.booleans())):
            made.below = [tree(depth + 1) for _ in range(draw(st.integers(1, 3)))]
        return made

    return tree(0)


def _of_scales(tree: Tree) -> tuple[float, bool]:
    """What scales said of parts in a tree [kg], and whether a part of it was on no scale."""
    below = [_of_scales(child) for child in tree.below]
    weighed, free = sum(kg for kg, _ in below), any(free for _, free in below) or not below
    if tree.star is None or (below and (not free or weighed > tree.star * (1 - 1e-9))):
        return weighed, free
    return tree.star, False


@quietly
@given(trees())
def test_what_was_weighed_is_what_is_counted(compute: Compute, top: Tree) -> None:
    """Each starred mass is that of its parts; where scales contradict each other, there is a warning."""
    rows, prototypes, instances, stars = [], {}, [], []

    def add(tree: Tree, path: tuple[str, ...], level: int) -> None:
        if level:
            mass = tree.plain if tree.star is None else tree.star
            rows.append(
                BOMEntry(
                    name=tree.name,
                    material=tree.material if not tree.below else None,
                    mass_kg=mass,
                    quantity=1.0,
                    quantum_kg=0.0005 if mass is not None else 0.0,
                    overridden=tree.star is not None,
                    level=level,
                    line=len(rows) + 2,
                )
            )
            path = (*path, tree.name)
            if tree.star is not None:
                stars.append(tree)
        for child in tree.below:
            add(child, path, level + 1)
        if not tree.below:
            prototypes[tree.name] = box(tree.name, 0.01, 0.02, 0.1, key=tree.name)
            instances.append(Instance(path, path, tree.name, placement([0.1 * len(instances), 0, 0])))

    add(top, (), 0)
    if not all(instance.path for instance in instances):
        return
    report = compute(Assembly("asm", prototypes, tuple(instances)), BomTable(with_structure(rows)))
    mass = {part.name: part.mass for _, part in report.parts()}
    for tree in stars:
        expected, free = _of_scales(tree)
        total = sum(mass[leaf.name] for leaf in tree.leaves())
        if not free:
            assert total == pytest.approx(expected, rel=1e-9), tree.name
        if abs(total - (tree.star or 0)) > 0.0005 + 1e-12:
            assert any(f"“{tree.name}”" in w.message and "were weighed" in w.message for w in report.warnings)


@quietly
@given(assemblies(), tables())
def test_every_gap_has_its_warning(compute: Compute, assembly: Assembly, table: BomTable) -> None:
    """A default density, a zero, a share, a point: the part itself carries the warning."""
    for _, part in compute(assembly, table).parts():
        if part.source not in (Source.BOM_MASS, Source.MATERIAL) or part.mass == 0:
            assert part.warnings, part


@quietly
@given(assemblies(), tables())
def test_a_bom_mass_is_that_of_a_row_with_this_name(
    compute: Compute, assembly: Assembly, table: BomTable
) -> None:
    """Never by substring, never by likeness."""
    for _, part in compute(assembly, table).parts():
        if part.source is Source.BOM_MASS:
            named = [
                row
                for row in table.rows
                if plain(row.name) == plain(part.name)
                or bare(row.name) == bare(part.name)
                or {row.name, part.name} == {"Peça", "Pe?a"}
            ]
            assert part.mass in {row.mass_kg for row in named}


@quietly
@given(assemblies(), tables())
def test_parts_links_and_total_agree(compute: Compute, assembly: Assembly, table: BomTable) -> None:
    """Each instance is in exactly one part, and the masses of parts, links and the whole add up."""
    report = compute(assembly, table)
    paths = [path for _, part in report.parts() for path in part.paths]
    assert len(paths) == len(set(paths)) <= len(assembly.instances)
    total = sum(part.total_mass for _, part in report.parts())
    assert report.total.mass == pytest.approx(total)
    assert sum(link.props.mass for link in report.links.values()) == pytest.approx(total)
    assert (report.total.inertia.diagonal() >= -1e-12).all()


@quietly
@given(assemblies(), tables(), st.randoms(use_true_random=False))
def test_the_order_of_rows_matters_only_where_it_is_said(
    compute: Compute, assembly: Assembly, table: BomTable, random: Any
) -> None:
    """Shuffled flat rows give the same masses, unless a warning says that the order decided."""
    rows = [row for row in table.rows if row.parent is None and not row.has_children]
    shuffled = list(rows)
    random.shuffle(shuffled)
    one, two = (compute(assembly, BomTable(with_structure(r))) for r in (rows, shuffled))
    if not any(w.code == "ambiguous" for w in (*one.warnings, *two.warnings)):
        assert one.total.mass == pytest.approx(two.total.mass)


@quietly
@given(assemblies(), tables())
def test_every_report_fits_the_schema(compute: Compute, assembly: Assembly, table: BomTable) -> None:
    """Whatever goes in: JSON without NaN, by the schema."""
    data = json.loads(report_json(compute(assembly, table)))
    assert list(jsonschema_rs.validator_for(SCHEMA).iter_errors(data)) == []
