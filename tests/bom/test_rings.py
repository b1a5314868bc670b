# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rings of assemblies: found, and cut so that no assembly stands below itself."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from silo.bom.key import Key
from silo.bom.walk.links import Graph, Rings, strongly_connected


def graph(**edges: str) -> Graph:
    return {key(name): [key(target) for target in targets] for name, targets in edges.items()}


def key(name: str) -> Key:
    return (f"/v/{name}.FCStd", "Assembly")


graphs = st.dictionaries(st.sampled_from("abcdef"), st.text("abcdef", max_size=5)).map(
    lambda edges: graph(**{name: "".join(sorted(set(edges.get(name, "")))) for name in "abcdef"})
)


def reachable(edges: Graph, start: Key) -> set[Key]:
    """What is below a node, found in the plainest way."""
    found: set[Key] = set()
    for _ in edges:
        found |= {target for node in ({start} | found) for target in edges[node]}
    return found


@given(graphs)
def test_parts_are_those_that_reach_each_other(edges: Graph) -> None:
    """By the definition, against every pair."""
    parts = strongly_connected(edges)
    assert sorted(node for part in parts for node in part) == sorted(edges)
    for part in parts:
        for one in part:
            for other in edges:
                together = one == other or (other in reachable(edges, one) and one in reachable(edges, other))
                assert (other in part) is together


@given(graphs, st.sampled_from("abcdef"))
def test_what_is_left_has_no_ring_and_still_shows_all(edges: Graph, entry_name: str) -> None:
    """From any entry, the links that are kept lead to every member of its ring, and never back."""
    rings, entry = Rings(edges), key(entry_name)
    members = {node for node in edges if rings.same_ring(entry, node)}
    kept = {
        node: [to for to in edges[node] if to in members and not rings.closes(entry, node, to)]
        for node in members
    }
    assert all(node not in reachable(kept, node) for node in members)
    assert not members or {entry} | reachable(kept, entry) == members


@given(graphs, st.sampled_from("abcdef"))
def test_the_example_is_a_ring(edges: Graph, name: str) -> None:
    """Each holds the next, the last the first, none twice; the same for all that are in it."""
    rings = Rings(edges)
    if not rings.same_ring(key(name), key(name)):
        return
    ring = rings.example(key(name))
    assert len(set(ring)) == len(ring)
    assert all(after in edges[node] for node, after in zip(ring, [*ring[1:], ring[0]], strict=True))
    assert {rings.example(node) for node in ring} == {ring}


def test_links_out_of_a_ring_and_into_it_stay() -> None:
    """Only what closes the ring is cut."""
    rings = Rings(graph(top="ab", a="b", b="ac", c=""))
    a, b = key("a"), key("b")
    assert not rings.closes(key("top"), key("top"), a)
    assert not rings.closes(a, b, key("c"))
    assert (rings.closes(a, a, b), rings.closes(a, b, a)) == (False, True)
    assert (rings.closes(b, a, b), rings.closes(b, b, a)) == (True, False)


def test_targets_that_were_not_read_are_in_no_ring() -> None:
    """Beyond the depth limit nothing is known."""
    rings = Rings({key("a"): [key("b")]})
    assert not rings.same_ring(key("a"), key("b"))


def test_thousands_in_one_ring() -> None:
    """No recursion, whatever the length."""
    nodes = [key(f"{number:05}") for number in range(3000)]
    rings = Rings({node: [after] for node, after in zip(nodes, [*nodes[1:], nodes[0]], strict=True)})
    assert rings.example(nodes[7]) == tuple(nodes)
    assert rings.closes(nodes[3], nodes[2], nodes[3])
