# SPDX-License-Identifier: LGPL-2.1-or-later
"""The walker: the components of an assembly, counted (spec bom-sync §1).

The rules of this module:

* a component is (target file, target object); labels never decide;
* quantities are per one parent; levels count up from the top;
* an assembly inside itself is cut where it closes the ring, and reported as a cycle;
* whatever is not counted has a finding.

What one assembly holds is read by :mod:`silo.bom.walk.roles`, each once; this module puts the levels
together. It walks live FreeCAD objects, objects read from FCStd files and the tests' fakes alike.
"""

from __future__ import annotations

import os.path
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.errors import InputError, SeveralAssembliesError, did_you_mean
from silo.bom.findings import Finding, FindingCode, Place
from silo.bom.items.naming import display_name
from silo.bom.key import Key
from silo.bom.message import joined, message
from silo.bom.walk.chains import chains
from silo.bom.walk.contents import Count, Lost
from silo.bom.walk.document import NAMELESS, label_of, own
from silo.bom.walk.facts import Canonical, Files
from silo.bom.walk.identity import identity_of, sole_identity
from silo.bom.walk.joints import held_by_joints, is_attached
from silo.bom.walk.kinds import Kind, is_container, is_named_assembly
from silo.bom.walk.roots import Whole, as_it_is, beside, choose_assembly, fates, silent_reader
from silo.bom.walk.shared_identity import identity_findings
from silo.bom.walk.standard import same_articles, standard_uuid
from silo.bom.walk.targets import Inspect, resolve_target
from silo.bom.walk.unexplained import counted_twice, unexplained
from silo.bom.walk.variants import Variant

# Real assemblies are some ten levels deep; deeper is an attack or a loop that no other guard saw.
MAX_LEVELS = 64
# Why an object in an assembly does not count; an error is a reason as well.
_REASONS = frozenset(
    {
        *(FindingCode.SUPPRESSED, FindingCode.EXCLUDED, FindingCode.CONSUMED, FindingCode.MODIFIED_HERE),
        *(FindingCode.COINCIDENT, FindingCode.HIDDEN, FindingCode.NO_HARDWARE, FindingCode.UNSET_LINK),
        *(FindingCode.SUB_ELEMENT_LINK, FindingCode.NO_COMPONENT, FindingCode.IN_DOCUMENT_LINK),
    }
)


def extract_bom_links(assembly_obj: Any, level: int = 1) -> list[BomEntry]:
    """Return the cross-document components of an assembly, with quantities per one parent (spec §1).

    ``level`` is given to the direct children; deeper ones count up from it. For the findings too, call
    :func:`extract`.
    """
    return list(extract(assembly_obj, level=level).entries)


def file_bom(
    document: Any, hint: Any = None, walk: Callable[[Any], Extraction] | None = None
) -> tuple[str | None, Extraction | None]:
    """Return the item to which a file's revisions belong, and the BOM of its assembly; None for each that
    does not exist.

    hint
        the container to take if the document holds several assemblies.
    walk
        reads a container, :func:`extract` unless given.

    Raises SeveralAssembliesError.
    """
    try:
        container = choose_assembly(document)
    except SeveralAssembliesError:
        if hint is None:
            raise
        container = hint
    extraction = (walk or extract)(container)
    is_assembly = container.isDerivedFrom("Assembly::AssemblyObject") or own(container, "Type") == "Assembly"
    whole = sole_identity(document)
    if not (extraction.entries or extraction.blocked or is_assembly):
        return whole, None
    head = extraction.assembly
    item = head.silo_uuid or whole
    return item, replace(extraction, assembly=replace(head, silo_uuid=item))


def file_item(document: Any, hint: Any = None) -> str | None:
    """Return the same item as :func:`file_bom`, mostly without looking for the assembly."""
    if identity := sole_identity(document):
        return identity
    try:
        return identity_of(choose_assembly(document))
    except SeveralAssembliesError:
        return identity_of(hint) if hint is not None else None


def extract(
    assembly_obj: Any,
    *,
    level: int = 1,
    inspect: Inspect | None = None,
    canonical: Canonical | None = None,
    whole: Whole = as_it_is,
    hardware: bool = True,
    below: bool = True,
) -> Extraction:
    """Walk an assembly.

    inspect
        says what is wrong with a live object (see :func:`silo.bom.walk.targets.resolve_target`); links read
        from FCStd files know it themselves.
    canonical
        makes one path of the several paths that a file may have (``os.path.realpath`` for live documents).
    whole
        returns a document with all its objects for one that FreeCAD loaded in part.
    hardware
        False leaves standard parts out.
    below
        False reads this one assembly only. ``is_assembly`` then says for each entry if it may be one; nothing
        is reported that needs the whole tree (rings, shared identities).
    """
    walker = _Walker(inspect, canonical, whole, hardware, below)
    top = assembly_obj
    entries: tuple[BomEntry, ...] = ()
    target = resolve_target(top, inspect)
    if target.obj is None:
        walker.notes.broken(top, target.problem)
    else:
        top = target.obj
        entries = walker.tree(top, level)
    head = walker.entry_for(top)
    holds = head.is_assembly or (below and bool(entries)) or walker.holds(top)
    mine = walker.own_lines(top, level) if target.obj is not None else ()
    head = replace(head, level=level - 1, is_assembly=holds, own=mine)
    if entries or mine or walker.notes.any_blocking():
        if getattr(top, "is_document_root", False):  # the links lie in the document itself
            walker.notes.add(FindingCode.NO_CONTAINER, top, "")
    elif shown := walker.shown_by_part(top) if target.obj is not None else []:
        walker.notes.one_part(top, head, shown)
    else:
        walker.notes.empty(head)
    if target.obj is not None:
        walker.look_beside(top, empty=not entries)
        walker.say_what_is_hidden(top)
        walker.look_for_unexplained(top, (*entries, *mine))
    for entry, other in same_articles_of(walk_entries(entries)):
        walker.notes.same_article(entry, other)
    findings = walker.notes.findings()
    if below:
        findings = (*findings, *identity_findings([replace(head, children=entries)]))
    return Extraction(assembly=head, entries=entries, findings=findings)


def why(
    assembly_obj: Any,
    parts: Collection[str | Key],
    *,
    inspect: Inspect | None = None,
    canonical: Canonical | None = None,
    whole: Whole = as_it_is,
    hardware: bool = True,
) -> list[str]:
    """Say why the assembly itself has this quantity of a part: the number, then each chain of links to it.

    parts
        the keys of the lines, or a name, a label or a designation.

    InputError if the assembly itself has none of them.
    """
    walker = _Walker(inspect, canonical, whole, hardware, below=False)
    contents = walker.reader.contents(assembly_obj)
    total, all_names, lines = 0, set[str](), list[str]()
    for count in (*contents.counts, *contents.own):
        entry = walker.entry_for(count.target)
        names = (entry.object_name, entry.label, entry.document_label, entry.standard or "")
        all_names.update(names)
        if not (meant := [piece for piece in (entry.key, *names) if piece in parts]):
            continue
        part = meant[0] if isinstance(meant[0], str) else entry.standard or display_name(entry)
        total += count.quantity
        for way in chains(count, contents.tree):
            steps = [f"{label_of(obj)} × {times}" if times > 1 else label_of(obj) for obj, times in way]
            lines.append(joined(" → ", [*[message("beside the assembly")] * count.beside, *steps]))
    if not lines:
        wanted = next((piece for piece in parts if isinstance(piece, str)), message("This line"))
        meant_by = did_you_mean(wanted, sorted(all_names - {""})) or "."
        raise InputError(
            message(
                "{wanted} is not a part of {assembly} itself{meant_by}",
                wanted=repr(wanted),
                assembly=label_of(assembly_obj),
                meant_by=meant_by,
            )
        )
    return [
        message("{total} × {part} in {assembly}:", total=total, part=part, assembly=label_of(assembly_obj)),
        *lines,
    ]


def same_articles_of(entries: Iterable[BomEntry]) -> list[tuple[BomEntry, BomEntry]]:
    """Find standard parts that are one article under two standards."""
    bom_entries = {entry.standard: entry for entry in entries if entry.standard}
    return [
        (bom_entries[designation], bom_entries[other]) for designation, other in same_articles(bom_entries)
    ]


class _Walker:
    def __init__(
        self,
        inspect: Inspect | None,
        canonical: Canonical | None,
        whole: Whole,
        hardware: bool,
        below: bool,
    ) -> None:
        self._goes_below = below
        # Nothing here refers back to the walker, so all values of a walk are freed with it, at once.
        self._files = files = Files(canonical)
        # For what is not counted; its findings would only repeat others.
        self.silent = silent_reader(files, inspect=inspect, hardware=hardware)
        self.reader = silent_reader(
            files, inspect=inspect, hardware=hardware, counts_beside=hardware, whole=whole
        )
        self.notes = self.reader.notes
        self._rings = Rings({})
        self._memo: dict[tuple[Key, int, Key], tuple[BomEntry, ...]] = {}
        self._heads: dict[Key, BomEntry] = {}
        # Kept with their objects, so that ids stay theirs.
        self._components: dict[int, tuple[Any, Key]] = {}
        self._containers: dict[Key, bool] = {}
        self._nameless: dict[int, list[Any]] = {}
        self._held: dict[Key, set[str]] = {}
        # The assemblies of the walk, with the names of the objects that their lines count.
        self._counted: dict[Key, tuple[Any, set[str]]] = {}

    def component(self, obj: Any) -> Key:
        """Return the identity of a component; it is its key if it has a name.

        Components without a name are distinguished by their order in the document, so that two documents of
        one file agree.
        """
        if isinstance(obj, Lost):
            return (self._files.canonical(obj.file), obj.name)
        if (cached := self._components.get(id(obj))) is not None:
            return cached[1]
        key = self._component(obj)
        self._components[id(obj)] = (obj, key)
        return key

    def _component(self, obj: Any) -> Key:
        path, name = key = self.reader.component(obj)
        if not path or not name.startswith(NAMELESS):
            return key
        shown = self._nameless.setdefault(id(obj.Document), [])
        place = next((place for place, other in enumerate(shown) if other is obj), len(shown))
        if place == len(shown):
            shown.append(obj)
        return (path, f"{NAMELESS}{place + 1}" if place else "")

    def entry_for(self, obj: Any) -> BomEntry:
        """Make the entry of an object from what it says of itself, wherever it is used."""
        path, name = key = self.component(obj)
        if isinstance(obj, Lost):
            stem = os.path.splitext(os.path.basename(path.replace("\\", "/")))[0]
            return BomEntry(path, object_name=name, missing=True, label=obj.label, document_label=stem)
        if key not in self._heads and (variant := self.reader.variant_of(obj)) is not None:
            self._heads[key] = self._variant_entry(variant)
        if key not in self._heads:
            standard, registered = self.reader.standard(obj)
            if standard and not registered:  # where it first occurs
                path, name = self._files.key(obj)
            self._heads[key] = BomEntry(
                doc_path=path,
                silo_uuid=standard_uuid(standard) if standard and not registered else identity_of(obj),
                object_name=name,
                standard=standard or None,
                label=label_of(obj),
                document_label=getattr(getattr(obj, "Document", None), "Label", "") or "",
                is_assembly=is_named_assembly(obj),
            )
        return self._heads[key]

    def _variant_entry(self, variant: Variant) -> BomEntry:
        """Make the entry of a configured copy: that of its original, with values. It may have an identity of
        its own.
        """
        base = self.entry_for(variant.base)
        identity = self.reader.variant_identity(variant)
        return replace(
            base,
            silo_uuid=identity or base.silo_uuid,
            variant=variant.values,
            copy=self._files.key(variant.copy),
            is_own_item=identity is not None,
        )

    def tree(self, top: Any, level: int) -> tuple[BomEntry, ...]:
        """Return the direct children of the top, with all that is below them."""
        if self._goes_below:
            self._rings = Rings(self._read_all(top))
        else:
            self.notes.newer(top.Document)
        return self._assembly(top, level, depth=1, entry=self.component(top))

    def _read_all(self, top: Any) -> dict[Key, list[Key]]:
        """Read every assembly that can be reached; returns which of them each one holds."""
        holds: dict[Key, list[Key]] = {}
        layer = {self.component(top): top}
        for _ in range(MAX_LEVELS):
            below: dict[Key, Any] = {}
            for key, container in layer.items():
                self.notes.newer(container.Document)
                counts = self.reader.contents(container).counts
                for count in counts:
                    if not isinstance(count.target, Lost) and self.reader.standard(count.target)[0]:
                        self.entry_for(count.target)  # the top's own screws come first
                targets = {self.component(count.target): count.target for count in counts}
                held = {name: target for name, target in targets.items() if self._is_container(name, target)}
                holds[key] = sorted(held)
                below.update(held)
            layer = {name: target for name, target in below.items() if name not in holds}
        return holds

    def _is_container(self, key: Key, target: Any) -> bool:
        if key not in self._containers:
            self._containers[key] = not isinstance(target, Lost) and is_container(target)
        return self._containers[key]

    def _assembly(self, container: Any, level: int, depth: int, entry: Key) -> tuple[BomEntry, ...]:
        """Make the entries of an assembly's direct children, once per nesting level at which it occurs.

        entry
            where the walk entered the assembly's ring; the assembly itself if it is in none.
        """
        key = self.component(container)
        if (known := self._memo.get((key, level, entry))) is not None:
            return known
        contents = self.reader.contents(container)
        lines: dict[Key, list[Count]] = {}
        for count in contents.counts:
            name = self.component(count.target)
            if self._rings.closes(entry, key, name):
                self.notes.cycle(count.shown.obj, self._rings.example(name))
            else:
                lines.setdefault(name, []).append(count)
        entries = []
        for name, counts in lines.items():
            inner = entry if self._rings.same_ring(key, name) else name
            target = counts[0].target
            children = self._below(target, level + 1, depth + 1, inner)
            goes_on = self._goes_below and self._is_container(name, target)
            mine = self.own_lines(target, level + 1) if goes_on else ()
            if goes_on and name not in self._counted and not isinstance(target, Lost):
                names = {shown for line in (*children, *mine) for shown in line.instances}
                self._counted[name] = (target, names)
            entries.append(self._entry(container, counts, level, children, own=mine))
        self._memo[(key, level, entry)] = tuple(entries)
        return self._memo[(key, level, entry)]

    def _below(self, target: Any, level: int, depth: int, entry: Key) -> tuple[BomEntry, ...]:
        if not self._goes_below or not self._is_container(self.component(target), target):
            return ()
        if depth > MAX_LEVELS:
            self.notes.add(FindingCode.TOO_DEEP, target, str(MAX_LEVELS), levels=MAX_LEVELS)
            return ()
        return self._assembly(target, level, depth, entry)

    def look_beside(self, top: Any, *, empty: bool) -> None:
        """Report objects beside the top that hold components, and objects without a role, whose meaning is
        unknown.
        """
        roles = fates(top, self.reader.contents(top), self.silent)
        for name, role in roles.items():
            if role is None:
                self.notes.add(FindingCode.NO_ROLE, top.Document.getObject(name))
        self.notes.beside(beside(top, roles), empty=empty)

    def say_what_is_hidden(self, top: Any) -> None:
        """Name what is hidden in a chosen part; an assembly has said it."""
        contents = self.reader.contents(top)
        if not contents.is_assembly(top):
            self.notes.hidden(top, contents.hidden_counted, contents.hidden, contents.references)

    def shown_by_part(self, top: Any) -> list[Any]:
        """Return what a part shows; [] for an assembly."""
        contents = self.reader.contents(top)
        return [] if contents.is_assembly(top) else [count.shown.obj for count in contents.own]

    def look_for_unexplained(self, top: Any, lines: Sequence[BomEntry]) -> None:
        """Look at each assembly of the walk without believing its roles."""
        self._counted[self.component(top)] = (top, {name for line in lines for name in line.instances})
        named: dict[str, set[str]] = {}
        for finding in self.notes.findings():
            if finding.blocks or finding.code in _REASONS:
                for place in finding.where:
                    named.setdefault(place.doc_path, set()).add(place.obj)
        for container, counted in self._counted.values():
            contents = self.reader.contents(container)
            if contents.tree is None or contents.is_part or not contents.is_assembly(container):
                continue
            here = named.get(self.notes.place(container).doc_path, set())
            has_view = partial(self.reader.has_view, container.Document)
            for obj in unexplained(contents.tree, counted, here.__contains__, has_view):
                self.notes.add(FindingCode.UNEXPLAINED, obj)
            for obj in counted_twice(contents.tree, counted, has_view):
                self.notes.add(FindingCode.TWO_ROLES, obj)

    def own_lines(self, container: Any, level: int) -> tuple[BomEntry, ...]:
        """Make entries of the parts of its own file that an assembly shows and that are no items yet."""
        contents = self.reader.contents(container)
        if not contents.is_assembly(container):
            return ()
        lines: dict[Key, list[Count]] = {}
        for count in contents.own:
            lines.setdefault(self.component(count.target), []).append(count)
        entries = [self._entry(container, counts, level, (), silo_uuid=None) for counts in lines.values()]
        self.notes.own_parts(container, entries)
        return tuple(entries)

    def _free(self, links: list[Count], container: Any) -> list[Count]:
        """Return the links that no joint holds, which an array could replace."""
        if len(links) < 2:
            return []
        if (key := self.component(container)) not in self._held:
            tree = self.reader.contents(container).tree
            inner = tree.members.values() if tree is not None else ()
            inline = (obj for obj, kind in inner if kind in (Kind.NOTHING, Kind.CONTAINER))
            self._held[key] = held_by_joints([container, *inline])
        held = self._held[key]
        return [link for link in links if link.shown.key[1] not in held and not is_attached(link.shown.obj)]

    def _entry(
        self, container: Any, counts: list[Count], level: int, children: tuple[BomEntry, ...], **more: Any
    ) -> BomEntry:
        target = counts[0].target
        entry = self.entry_for(target)
        links = [count for count in counts if count.link]
        values = {
            "level": level,
            "quantity": sum([count.quantity for count in counts]),
            "children": children,
            "is_assembly": entry.is_assembly or self._is_assembly(target),
            "consolidation_warning": len(self._free(links, container)) > 1,
            "individual_links": sum([not link.array for link in links]),
            "link_objects": len(links),
            "instances": tuple([count.shown.key[1] for count in counts]),
            "find_number": next(filter(None, map(_proposed, counts)), ""),
            **more,
        }
        return BomEntry(**(vars(entry) | values))  # dataclasses.replace() takes twice as long

    def _is_assembly(self, target: Any) -> bool:
        key = self.component(target)
        if not self._is_container(key, target):
            return False
        return not self._goes_below or self.reader.contents(target).holds_components

    def holds(self, top: Any) -> bool:
        """Return True if the top holds components, even if they do not count."""
        return self.reader.contents(top).holds_components


# --- assemblies that contain themselves ---


Graph = Mapping[Key, Sequence[Key]]


class Rings:
    """The rings of a graph: for each assembly, the assemblies that it holds, in a fixed order."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._members: dict[Key, frozenset[Key]] = {}
        for members in strongly_connected(graph):
            if len(members) > 1 or any(node in graph[node] for node in members):
                self._members.update(dict.fromkeys(members, members))
        self._ways: dict[Key, dict[Key, tuple[Key, int]]] = {}

    def same_ring(self, key: Key, other: Key) -> bool:
        """Return True if each of the two contains the other, however deep."""
        return other in self._members.get(key, ())

    def closes(self, entry: Key, here: Key, there: Key) -> bool:
        """Return True if the walk cuts the link from ``here`` to ``there``, in a ring that it entered at
        ``entry``.
        """
        if not self.same_ring(here, there):
            return False
        ways = self._outwards(entry)
        return ways[there][1] <= ways[here][1]

    def example(self, node: Key) -> tuple[Key, ...]:
        """Return a ring for the report: the shortest through the first of those in a ring with ``node``."""
        first = min(self._members[node])
        ways = self._outwards(first)
        ring = [next(reached for reached in ways if first in self._graph[reached])]
        while ring[-1] != first:
            ring.append(ways[ring[-1]][0])
        return tuple(reversed(ring))

    def _outwards(self, entry: Key) -> dict[Key, tuple[Key, int]]:
        """Return the assemblies in a ring with the entry, nearest first: the assembly before each, and the
        distance.
        """
        if entry not in self._ways:
            ways, further = {entry: (entry, 0)}, [entry]
            for node in further:
                for reached in self._graph[node]:
                    if reached in self._members[entry] and reached not in ways:
                        ways[reached] = (node, ways[node][1] + 1)
                        further.append(reached)
            self._ways[entry] = ways
        return self._ways[entry]


def strongly_connected(graph: Graph) -> list[frozenset[Key]]:
    """Return the strongly connected parts of a graph (Gabow's algorithm, without recursion)."""
    at: dict[Key, int] = {}
    path, starts, parts = list[Key](), list[int](), list[frozenset[Key]]()
    waiting = [(node, False) for node in graph]
    while waiting:
        node, is_done = waiting.pop()
        if is_done:
            if starts[-1] == at[node]:
                parts.append(frozenset(path[starts.pop() :]))
                del path[at[node] :]
                at.update(dict.fromkeys(parts[-1], len(graph)))
        elif node not in at:
            at[node] = len(path)
            starts.append(len(path))
            path.append(node)
            waiting += [(node, True), *((target, False) for target in graph[node] if target in graph)]
        else:
            while starts and starts[-1] > at[node]:
                starts.pop()
    return parts


__all__ = ["Extraction", "Finding", "FindingCode", "Place", "extract", "extract_bom_links"]


def _proposed(count: Count) -> str:
    """Return the find number that a counted link proposes; "" for none."""
    value = own(count.shown.obj, "SiloFindNumber")
    return str(value).strip() if isinstance(value, str | int) and value is not True and value else ""
