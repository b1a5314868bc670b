# SPDX-License-Identifier: LGPL-2.1-or-later
"""Laws of the mass rule over random assemblies and BOMs: no mass without a source, no gap without a word."""

from __future__ import annotations

import json
from collections.abc import Callable
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
