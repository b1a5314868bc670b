# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a tree of assemblies that contain each other is cut, so that it ends.

Assemblies that contain each other form a ring (in general: a strongly connected part of the graph). Entered
at one of them, a ring is shown outwards from there: a link is followed where it leads one step further
from the entry, and cut otherwise. So no assembly stands below itself, and the cut depends neither on the
order in which links are met nor on what was walked before.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

Key = tuple[str, str]
Graph = Mapping[Key, Sequence[Key]]


class Rings:
    """The rings of a graph: for each assembly, the assemblies that it holds, in a fixed order."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._members: dict[Key, frozenset[Key]] = {}
        for members in strongly_connected(graph):
            if len(members) > 1 or any(node in graph[node] for node in members):
                self._members.update(dict.fromkeys(members, members))
        self._distances: dict[Key, dict[Key, int]] = {}
        self._told: dict[frozenset[Key], tuple[Key, ...]] = {}

    def same_ring(self, one: Key, other: Key) -> bool:
        """True where each of the two contains the other, however deep."""
        return other in self._members.get(one, ())

    def closes(self, entry: Key, here: Key, there: Key) -> bool:
        """True where the link from ``here`` to ``there`` is cut, in a ring that was entered at ``entry``."""
        if not self.same_ring(here, there):
            return False
        if entry not in self._distances:
            self._distances[entry] = {node: step for node, _, step in self._outwards(entry)}
        distance = self._distances[entry]
        return distance[there] <= distance[here]

    def example(self, node: Key) -> tuple[Key, ...]:
        """A ring to report: the shortest through the first of those in a ring with ``node``."""
        members = self._members[node]
        if members not in self._told:
            self._told[members] = self._shortest(min(members))
        return self._told[members]

    def _shortest(self, node: Key) -> tuple[Key, ...]:
        before = {reached: source for reached, source, _ in self._outwards(node)}
        ring = [next(reached for reached in before if node in self._graph[reached])]
        while ring[-1] != node:
            ring.append(before[ring[-1]])
        return tuple(reversed(ring))

    def _outwards(self, entry: Key) -> Iterator[tuple[Key, Key, int]]:
        """All in a ring with the entry, nearest first: the assembly, the one before it, the distance."""
        members = self._members[entry]
        seen, layer, step = {entry}, [(entry, entry)], 0
        while layer:
            further = []
            for node, before in layer:
                yield node, before, step
                for reached in self._graph[node]:
                    if reached in members and reached not in seen:
                        seen.add(reached)
                        further.append((reached, node))
            layer, step = further, step + 1


def strongly_connected(graph: Graph) -> list[frozenset[Key]]:
    """The strongly connected parts of a graph (Kosaraju's algorithm, without recursion)."""
    backwards: dict[Key, list[Key]] = {node: [] for node in graph}
    for node, targets in graph.items():
        for target in targets:
            if target in backwards:
                backwards[target].append(node)
    taken: set[Key] = set()
    parts = []
    for node in reversed(_finished(graph)):
        if node in taken:
            continue
        taken.add(node)
        part, open_nodes = {node}, [node]
        while open_nodes:
            for source in backwards[open_nodes.pop()]:
                if source not in taken:
                    taken.add(source)
                    part.add(source)
                    open_nodes.append(source)
        parts.append(frozenset(part))
    return parts


def _finished(graph: Graph) -> list[Key]:
    """The nodes in the order in which a depth-first walk is done with them."""
    seen: set[Key] = set()
    done = []
    for start in graph:
        if start in seen:
            continue
        seen.add(start)
        path = [(start, iter(graph[start]))]
        while path:
            node, targets = path[-1]
            further = next((target for target in targets if target in graph and target not in seen), None)
            if further is None:
                done.append(node)
                path.pop()
            else:
                seen.add(further)
                path.append((further, iter(graph[further])))
    return done
