# SPDX-License-Identifier: LGPL-2.1-or-later
"""Documents made to hurt: exponential trees, endless lists, rings in everything that can refer to something.

No timing here; a walk that is not bounded would not end.
"""

from __future__ import annotations

from typing import Any

from fakes import Doc, edit

from silo.bom import diff_bom, extract, resolve_part_numbers
from silo.bom.consolidation import consolidation_findings
from silo.bom.entry import walk_entries
from silo.bom.view.flat_list import flat_counts
from silo.bom.view.tree_json import tree_size


class EveryItem:
    """A server that knows every UUID."""

    def get_item_by_uuid(self, uuid: str) -> dict[str, str]:
        return {"part_number": uuid.upper(), "name": uuid}


def bolt_in(path: str, uuid: str = "u") -> Any:
    return Doc(path, meta={"SiloUUID": uuid}).body()


def test_a_lattice_of_assemblies() -> None:
    """Two assemblies per level, each holding both of the next: 2^40 ways down, 80 assemblies."""
    below: tuple[Any, ...] = ()
    for level in range(40, 0, -1):
        pair = []
        for side in "ab":
            doc = Doc(f"/v/{side}{level}.FCStd", meta={"SiloUUID": f"{side}{level}"})
            members = [doc.link(f"L{n}", target) for n, target in enumerate(below)]
            bolt = bolt_in(f"/v/p{side}{level}.FCStd", f"p{side}{level}")
            pair.append(doc.assembly(*members, doc.link("P", bolt), doc.link("Q", bolt)))
        below = tuple(pair)
    top = Doc("/v/top.FCStd")
    found = extract(top.assembly(*(top.link(f"L{n}", target) for n, target in enumerate(below))))
    flat = flat_counts(found.entries)
    assert flat["/v/a40.FCStd", "Assembly"] == 2**39
    assert tree_size(found.entries) > 2**40
    resolved, unresolved = resolve_part_numbers(found.entries, EveryItem())
    assert unresolved == []
    assert flat_counts(resolved) == flat
    assert len(list(walk_entries(resolved))) == len(flat) == 160
    assert len(consolidation_findings(resolved)) == 80


def test_skipping_links_put_an_assembly_at_every_depth() -> None:
    """Each assembly holds the two below it: Fibonacci many instances, a value per assembly and level."""
    chain: list[Any] = [bolt_in("/v/bolt.FCStd")]
    for number in range(1, 60):
        doc = Doc(f"/v/{number}.FCStd")
        chain.append(doc.assembly(*(doc.link(f"L{n}", target) for n, target in enumerate(chain[-2:]))))
    found = extract(chain[-1])
    fibonacci = [1, 1]
    while len(fibonacci) < 61:
        fibonacci.append(fibonacci[-1] + fibonacci[-2])
    assert flat_counts(found.entries)["/v/bolt.FCStd", "Body"] == fibonacci[59]


def test_everything_holds_everything() -> None:
    """Twenty assemblies that all contain each other: every path is a ring, and the walk ends."""
    docs = [Doc(f"/v/{number}.FCStd") for number in range(20)]
    assemblies = [doc.assembly() for doc in docs]
    for doc, asm in zip(docs, assemblies, strict=True):
        edit(asm, Group=[doc.link(f"L{n}", target) for n, target in enumerate(assemblies)])
    found = extract(assemblies[0])
    assert found.blocked
    assert len(list(walk_entries(found.entries))) == 19


def test_a_thousand_links_in_one_group() -> None:
    """One line per part, each link once."""
    top = Doc("/v/top.FCStd")
    parts = [bolt_in(f"/v/p{n}.FCStd") for n in range(100)]
    found = extract(top.assembly(*(top.link(f"L{n}", parts[n % 100]) for n in range(1000))))
    assert len(found.entries) == 100
    assert {entry.quantity for entry in found.entries} == {10}


def test_huge_arrays_of_arrays_stay_numbers() -> None:
    """Counts multiply as whole numbers of any size; nothing overflows on the way to a comparison."""
    target: Any = bolt_in("/v/bolt.FCStd")
    for number in range(100):
        target = Doc(f"/v/h{number}.FCStd").link("Arr", target, ElementCount=2**31 - 1)
    top = Doc("/v/top.FCStd")
    (entry,) = extract(top.assembly(top.link("L", target))).entries
    assert entry.quantity == (2**31 - 1) ** 100
    resolved, _ = resolve_part_numbers([entry], EveryItem())
    assert diff_bom(resolved, []).added


def test_odd_values_where_freecad_has_others() -> None:
    """A reader of damaged files may give anything; what makes no sense counts as unset."""
    top, bolt = Doc("/v/top.FCStd"), bolt_in("/v/bolt.FCStd")
    odd: list[dict[str, Any]] = [
        {"ElementCount": -3},
        {"ElementCount": None},
        {"ElementCount": "many"},
        {"ScaleVector": None},
        {"ScaleVector": ("x", "y", "z")},
        {"ScaleVector": (1.0,)},
        {"ScaleList": None},
        {"LinkCopyOnChange": 7},
        {"Suppressed": "no"},
        {"Label": None},
        {"Label": 7},
    ]
    links = [top.link(f"L{n}", bolt, **properties) for n, properties in enumerate(odd)]
    (entry,) = extract(top.assembly(*links)).entries
    assert entry.quantity == len(odd)
