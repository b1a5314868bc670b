# SPDX-License-Identifier: LGPL-2.1-or-later
"""What each object of an assembly is, and what it brings: one pass, which everything else reads.

Each object in an assembly has exactly one :class:`~silo.bom.walk.contents.ObjectRole`. A component brings
what it shows. A link brings what its target brings, once per element; a Draft array what its original brings,
once per instance; a link group, a compound, an inline part or a folder what its members bring. That ends in
an object of another file, in a standard part, in an object with an identity of its own, or in geometry of
this very file: an *own part*, which is no item yet. How an object comes to bring something is kept
(:class:`~silo.bom.walk.contents.Contribution`), so masses and people can follow the same chain.

* An object counts once, however many lists of the tree name it; each link group that shows it counts.
* What shows others is counted; the others count where they lie only if they are visible there. The original
  of an array and the members of a compound never do.
* What lies in something suppressed or excluded is left out with it.
* What a cut, a boolean or a fusion consumes is no piece to buy, wherever that feature lies; but what a saved
  view shows is one.
* A feature over linked parts is these parts, modified here: they count, once, and it is no part of its own.
* A configured copy counts with its own contents, under its original and its values.
* A broken link brings a :class:`Lost` component with its quantity, and a finding that blocks.

Nothing here depends on where the assembly is used, so each is read once (:class:`Reader`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from silo.bom.errors import DocumentError, listed
from silo.bom.findings import FindingCode
from silo.bom.key import Key
from silo.bom.message import message
from silo.bom.walk.arrays import draft_count, draft_elements, elements, is_array, left_out_by
from silo.bom.walk.contents import (
    Contents,
    Contribution,
    Count,
    CountedObjects,
    Lost,
    Modified,
    ObjectRole,
    add,
)
from silo.bom.walk.covering import Covering
from silo.bom.walk.document import (
    LinkProblem,
    derived,
    first_of,
    label_of,
    located,
    own,
    same_document,
)
from silo.bom.walk.facts import Facts, Files
from silo.bom.walk.identity import identity_of
from silo.bom.walk.imported import source_of
from silo.bom.walk.kinds import (
    COMPONENTS,
    INLINE,
    REPEATERS,
    Kind,
    has_solid,
    is_named_assembly,
    kind_of,
    sources,
)
from silo.bom.walk.notes import Notes
from silo.bom.walk.operands import Taking, guides, operands
from silo.bom.walk.seen import is_said_to_count
from silo.bom.walk.standard import STANDARD_PARTS
from silo.bom.walk.targets import (
    Inspect,
    Target,
    is_assembly_link,
    is_link,
    own_parts,
    stale_copies,
)
from silo.bom.walk.tree import Tree, is_switched_on
from silo.bom.walk.variants import values_of

# Groups that link to groups: no file needs many of these, but an attack does.
_MAX_NESTING = 32
# A link without a target, and one that leads back to itself, stand for no component.
_NO_COMPONENT_LOST = (FindingCode.UNSET_LINK, FindingCode.CYCLE)
# What may have an identity of its own and is a component then.
DECLARABLE = REPEATERS | {Kind.LOCAL, Kind.FOREIGN, Kind.CONTAINER, Kind.LINK_GROUP}
_COUNTABLE = COMPONENTS | REPEATERS | {Kind.ELEMENT, Kind.STANDARD}
SHOWING = COMPONENTS | REPEATERS | {Kind.ELEMENT}
_GEOMETRY = REPEATERS | {Kind.LOCAL}


_COUNTS = (ObjectRole.COMPONENT, ObjectRole.HOLDER)


class Reader(Facts):
    """Reads assemblies, each once, and keeps what it learnt of the objects that it met on the way.

    beside
        finds what counts with an assembly though it lies beside it.
    hardware
        False leaves standard parts out.
    """

    def __init__(
        self,
        inspect: Inspect | None,
        files: Files,
        *,
        beside: Callable[[Any], Iterable[Any]] = lambda _container: (),
        hardware: bool = True,
    ) -> None:
        super().__init__(inspect, files)
        self.notes = Notes(files.path)
        self.beside = beside
        self.hardware = hardware
        self._known: dict[Key, Contents] = {}

    def contents(self, container: Any) -> Contents:
        """Read what an assembly holds, once for all its uses."""
        key = self.key(container)
        if key not in self._known:
            self.notes.reading = key[0]
            try:
                self._known[key] = Reading(self, container).contents(container)
            except DocumentError as error:
                self.notes.unreadable(container, error)
                self._known[key] = Contents(holds_components=True)
        return self._known[key]

    def brings(self, obj: Any) -> list[Any]:
        """Return the components that one object shows, each once; no own parts of the file."""
        try:
            return Reading(self, obj).brought_by(obj)
        except DocumentError:
            return []


class Reading:
    """One assembly while it is being read."""

    def __init__(self, reader: Reader, container: Any) -> None:
        self._reader = reader
        self._notes = reader.notes
        self._key = reader.key
        self._document = container.Document
        self._path, _ = reader.key(container)
        # The assembly's own identity on something in it means the assembly itself.
        self._identity = (identity_of(container) or "").lower()
        self._is_root = getattr(container, "is_document_root", False)
        self._nodes: dict[Key, Contribution] = {}
        self._mine: dict[int, tuple[Any, bool]] = {}
        self._trees: dict[Key, Tree] = {}
        self._ones: dict[Key, CountedObjects] = {}
        self._links: set[Key] = set()
        self._wholes: set[Key] = set()
        self._inside: set[Key] = set()
        self._shown: set[Key] = set()
        self._covering = Covering(reader.key)
        self._roles: dict[Key, ObjectRole] = {}
        self._holds_components = False
        self._main: Tree | None = None
        self._hidden: list[Any] = []
        self._hidden_counted: list[Any] = []
        self._references: list[Any] = []
        self._modified: list[Modified] = []
        self._guides: set[Key] = set()
        # What was entered and not yet left, the assembly first; and the ways that led back into themselves.
        self._open: dict[Key, Any] = {}
        self._rings: list[dict[Key, Any]] = []

    def contents(self, container: Any) -> Contents:
        """Find what an assembly contains."""
        top, kind = self._key(container), kind_of(container)
        if kind in REPEATERS:
            node = self._node(top, container, kind)
            leaves = [(node, 1)] if node is not None and node.brings else []
            counts, mine = self._split(leaves)
            mine = [count for count in mine if count.target is not container]
            return Contents(counts, mine, {top: ObjectRole.COMPONENT}, self._holds_components or bool(counts))
        self._open[top] = container
        tree = self._tree(top, container)
        self._main = tree
        self._shown = self.shown_by([count for count in tree.members.values() if count[1] in SHOWING])
        leaves = self._leaves(tree)
        counts, mine = self._split(leaves)
        beside = list(self._reader.beside(container)) if tree.members else []
        for obj in beside:
            if self._key(obj) in tree.members:
                self._notes.add(FindingCode.TWO_ROLES, obj)
        nodes = [
            node for obj in beside if (node := self._node(self._key(obj), obj, kind_of(obj))) is not None
        ]
        self._roles.update({node.key: ObjectRole.COMPONENT for node in nodes})
        about = str(self._notes.place(container))
        for obj in beside:
            self._notes.add(FindingCode.COUNTED_BESIDE, obj, about, target=container)
        counts += self._split([(node, 1) for node in nodes], beside=True)[0]
        is_part = self._is_root and not self._holds_components and self._is_one_part(counts or mine)
        if is_part:
            counts, mine = [], [*counts, *mine]
        self._report_rings()
        for key in self._shown:
            self._roles.setdefault(key, ObjectRole.SOURCE)
        for count in (*counts, *mine):
            if self._roles.get(count.shown.key) is not ObjectRole.COMPONENT:
                self._notes.add(FindingCode.TWO_ROLES, count.shown.obj)
        holds = self._holds_components or bool(counts)
        contents = Contents(counts, mine, self._roles, holds, is_part, self._hidden, tree)
        contents.hidden_counted, contents.references = self._hidden_counted, self._references
        contents.modified = self._modified
        if contents.is_assembly(container):
            self._notes.hidden(container, self._hidden_counted, self._hidden, self._references)
        return contents

    def _is_one_part(self, counts: list[Count]) -> bool:
        """Return True if the only component of a file is its only part: the file then is this part, and no
        assembly of it.
        """
        only = counts[0] if len(counts) == 1 else None
        return (
            only is not None
            and only.quantity == 1
            and only.target is only.shown.obj
            and not only.key[0].startswith(STANDARD_PARTS)
        )

    def brought_by(self, obj: Any) -> list[Any]:
        node = self._node(self._key(obj), obj, kind_of(obj))
        return [count.target for count in self._split([(node, 1)])[0]] if node is not None else []

    # --- which objects count -------------------------------------------------------------------------------

    def _tree(self, key: Key, container: Any) -> Tree:
        if (tree := self._trees.get(key)) is None:
            tree = self._trees[key] = Tree(container, self._key, self._is_closed)
            self._find_wholes(tree, container)
            self._find_repeated(tree)
            self._find_guides(tree)
        return tree

    def _is_closed(self, obj: Any, kind: Kind) -> bool:
        """Return True if a user declared the inline container a component of its own."""
        return kind in DECLARABLE and self._is_declared(obj)

    def _is_declared(self, obj: Any) -> bool:
        """Return True if an object has an identity of its own."""
        identity = self._reader.declared_identity(obj)
        return bool(identity) and identity is not None and identity.lower() != self._identity

    def _is_mine(self, target: Any) -> bool:
        """Return True if an object belongs to this file; FreeCAD makes two documents of a file that it opened
        by two paths.
        """
        if isinstance(target, Lost):
            return False
        document = target.Document
        known = self._mine.get(id(document))
        if known is None or known[0] is not document:
            is_here = bool(self._path) and self._key(target)[0] == self._path
            known = self._mine[id(document)] = (
                document,
                is_here or same_document(document, self._document),
            )
        return known[1]

    def _is_own(self, target: Any) -> bool:
        """Return True for geometry of this file that was not declared a component."""
        if not self._is_mine(target) or self._is_declared(target):
            return False
        return not self._reader.standard(target)[0]

    def _find_wholes(self, tree: Tree, container: Any) -> None:
        """Find parts that hold nothing but geometry: each is one own part, and not one for each piece."""
        mixed, full = set[Key](), set[Key]()
        for name, (obj, kind) in tree.members.items():
            if kind in _GEOMETRY and not self._is_declared(obj) and self._is_geometry(obj, kind):
                full.update(tree.above(name))
            elif (
                kind in COMPONENTS or kind in _COUNTABLE or kind is Kind.FOREIGN or self._is_closed(obj, kind)
            ):
                mixed.update(tree.above(name))
            elif kind is Kind.CONTAINER and is_named_assembly(obj):
                mixed.update((name, *tree.above(name)))
        wholes = full - mixed
        if tree.top in wholes and kind_of(container) is Kind.CONTAINER and not is_named_assembly(container):
            self._wholes.add(tree.top)
        if not wholes.difference((tree.top,)):
            return
        for name, (_, kind) in tree.members.items():
            if not self._wholes.isdisjoint(tree.around(name)):
                self._inside.add(name)
            elif kind is Kind.CONTAINER and name in wholes:
                self._wholes.add(name)

    def _is_geometry(self, obj: Any, kind: Kind, depth: int = 0) -> bool:
        """Return True if an object shows nothing but geometry."""
        if kind not in REPEATERS:
            return kind is Kind.LOCAL
        return depth < _MAX_NESTING and all(
            self._is_geometry(source, kind_of(source), depth + 1) for source in sources(obj)
        )

    def _find_repeated(self, tree: Tree) -> None:
        """Find what arrays and compounds show: that never counts at its own place, nor do elements of link
        arrays.
        """
        has_elements = any(kind is Kind.ELEMENT for _, kind in tree.members.values())
        for name, (obj, kind) in tree.members.items():
            if kind is Kind.LINK and has_elements:
                self._inside.update(map(self._key, elements(obj)))
            elif kind in REPEATERS:
                self._covering.look_at(tree, name)

    def _find_guides(self, tree: Tree) -> None:
        """Find the wires and points along which arrays and sweeps go; they are no parts."""
        for obj, kind in tree.members.values():
            if kind in (Kind.DRAFT_ARRAY, Kind.LOCAL):
                self._guides.update(self._key(guide) for guide in guides(obj) if not has_solid(guide))

    def shown_by(self, objects: list[tuple[Any, Kind]]) -> set[Key]:
        """Return the objects of the document that these show, directly or not."""
        keys: set[Key] = set()
        while objects:
            for show in self._shows(*objects.pop()):
                if show is None or not self._is_mine(show) or (key := self._key(show)) in keys:
                    continue
                keys.add(key)
                kind = kind_of(show)
                objects.append((show, kind))
                if kind in INLINE and key not in self._trees:
                    objects += self._tree(key, show).members.values()
        return keys

    def _shows(self, obj: Any, kind: Kind) -> list[Any]:
        if kind in REPEATERS:
            return sources(obj)
        if kind not in SHOWING or kind is Kind.ASSEMBLY_LINK:
            return []
        try:
            linked = getattr(obj, "LinkedObject", None)
        except DocumentError:  # the caller that counts it reports that
            return []
        if isinstance(linked, tuple):
            is_near = linked[0] is not None and self._is_mine(linked[0])
            linked = self._reader.resolve(obj).obj if is_near else None
        return [linked, first_of(own(obj, "LinkCopyOnChangeSource"))]

    def _leaves(self, tree: Tree) -> list[tuple[Contribution, int]]:
        """Return what counts in a container, and how often. Notes the role of each object in it."""
        leaves: list[tuple[Contribution, int]] = []
        for name, (obj, kind) in tree.members.items():
            try:
                role, node = self._judged(tree, name, obj, kind)
            except DocumentError as error:
                self._unreadable(obj, error)
                role, node = ObjectRole.COMPONENT, None
            if tree is self._main:
                self._roles[name] = role
            else:  # shown only through what led here
                self._roles.setdefault(name, ObjectRole.SOURCE if role in _COUNTS else role)
            if node is not None:
                leaves.append((node, tree.times(name)))
        return self._without_hidden_geometry(tree, leaves)

    def _judged(self, tree: Tree, name: Key, obj: Any, kind: Kind) -> tuple[ObjectRole, Contribution | None]:
        if kind is Kind.NOTHING:
            return ObjectRole.CONSTRUCTION, None
        if name in self._inside:
            return ObjectRole.INSIDE, None
        # Few assemblies have anything covered or shown twice; to climb for each takes long in deep ones.
        around = (name, *tree.around(name)) if self._covering or self._shown else ()
        if any(self._is_covered(tree, outer) for outer in around):
            self._report_covered(tree, name, obj)
            return ObjectRole.SOURCE, None
        if name in self._covering.gone:
            return ObjectRole.LEFT_OUT, None
        if not tree.times(name):
            if left_out_by(obj) and any(tree.times(holder) for holder in tree.holders[name]):
                self._report_left_out(obj, kind)
            return ObjectRole.LEFT_OUT, None
        if kind in INLINE and name not in self._wholes and not self._is_closed(obj, kind):
            return ObjectRole.HOLDER, None
        if any(outer in self._shown and not tree.visible(outer) for outer in around):
            return ObjectRole.SOURCE, None
        if name in self._guides:
            return ObjectRole.CONSTRUCTION, None
        if kind in COMPONENTS and self._is_reference(tree, name, obj):
            return ObjectRole.REFERENCE, None
        node = self._node(name, obj, kind)
        if node is None or not node.brings:
            return ObjectRole.CONSTRUCTION, None
        if kind is Kind.LOCAL and node.shown_objects:
            return self._modified_here(tree, name, node)
        return self._unconsumed(tree, name, node)

    def _is_covered(self, tree: Tree, name: Key) -> bool:
        """Return True if an array or a compound shows an object in the object's own place."""

        def shows(key: Key) -> bool:
            repeater, _ = tree.members[key]
            if is_said_to_count(repeater) or not self._reader.has_view(repeater.Document):
                return True
            inner = key if self._consumer(tree, key) is None else name
            node = self._node(inner, *tree.members[inner])
            return key not in self._shown and node is not None and bool(self._outlasting(node))

        return self._covering.covers(tree, name, shows)

    def _report_covered(self, tree: Tree, name: Key, obj: Any) -> None:
        """Say that a visible original lies where an array or a compound shows it, or is used up with that."""
        if not self._is_covered(tree, name) or not tree.visible(name):
            return
        for key, (other, kind) in tree.members.items():
            if kind not in REPEATERS or not any(source is obj for source in sources(other)):
                continue
            node = self._node(name, obj, kind_of(obj))
            taker = self._consumer(tree, key)
            if taker is None or node is None or self._outlasting(node):
                self._notes.add(FindingCode.COINCIDENT, obj, target=other)
            elif self._is_hardware(node):
                self._notes.add(FindingCode.CONSUMED, obj, target=taker[0])
            return

    def _is_reference(self, tree: Tree, name: Key, link: Any) -> bool:
        """Return True for a hidden link that only supports other geometry; the file may say otherwise."""
        if tree.visible(name) or is_said_to_count(link) or not self._reader.supported_by(link):
            return False
        self._references.append(link)
        self._holds_components = True
        return True

    def _is_piece(self, obj: Any) -> bool:
        """Return True for an object that a saved view shows, whatever uses it."""
        key = self._key(obj)
        tree = self._main
        is_seen = tree.visible(key) if tree is not None and key in tree.members else is_switched_on(obj)
        return is_seen and self._reader.has_view(obj.Document)

    def _linked_operands(self, feature: Any) -> list[Contribution]:
        """Return the linked parts whose solids live on in a feature, directly or through other features."""
        parts: dict[Key, Contribution] = {}
        seen, further = {self._key(feature)}, [feature]
        for taker in further:
            inner = own(taker, "Group") or () if derived(taker, "PartDesign::Body") else ()
            for operand in (operand for step in (taker, *inner) for operand in operands(step)):
                key = self._key(operand.obj)
                if operand.how is Taking.TOOL or key in seen or not self._is_mine(operand.obj):
                    continue
                seen.add(key)
                kind = kind_of(operand.obj)
                if kind is Kind.NOTHING or self._is_piece(operand.obj):
                    continue
                if kind is Kind.LOCAL and not self._is_declared(operand.obj):
                    further.append(operand.obj)
                elif (node := self._node(key, operand.obj, kind)) is not None and self._has_linked(node):
                    parts[key] = node
        return list(parts.values())

    def _has_linked(self, node: Contribution) -> bool:
        return any(
            key[0] != STANDARD_PARTS and not (key[0] == self._path and self._is_own(target))
            for key, (target, _) in node.brings.items()
        )

    def _modified_here(
        self, tree: Tree, name: Key, node: Contribution
    ) -> tuple[ObjectRole, Contribution | None]:
        """Judge a feature over linked parts: they count at their own places; what lies elsewhere counts
        here.
        """
        if self._consumer(tree, name) is not None:
            return ObjectRole.OPERAND, None
        parts = [part for part, _ in node.shown_objects]
        names = sorted({label_of(part.obj) for part in parts})
        self._notes.add(FindingCode.MODIFIED_HERE, node.obj, parts=listed(names, 8))
        self._modified.append(Modified(node.obj, frozenset(part.key for part in parts)))
        rest = [(part, 1) for part in parts if part.key not in tree.members]
        if not rest:
            return ObjectRole.MODIFIED, None
        return ObjectRole.COMPONENT, Contribution(name, node.obj, node.kind, self._sum(rest), tuple(rest))

    def _consumer(self, tree: Tree, name: Key) -> tuple[Any, Taking] | None:
        features = (obj for obj, kind in tree.members.values() if kind is Kind.LOCAL)
        eaten = self._reader.eaten(self._document, features)
        if not eaten:
            return None
        owners = (name, *tree.above(name))
        takers = (eaten.of(owner, lambda: tree.visible(name)) for owner in owners)
        return next((taker for taker in takers if taker is not None), None)

    def _report_left_out(self, obj: Any, kind: Kind) -> None:
        """Report what is left out by itself; not what its container leaves out, or what is never bought."""
        if kind in _COUNTABLE or kind in INLINE or kind in DECLARABLE:
            self._is_left_out(obj)
            self._holds_components |= kind is Kind.DRAFT_ARRAY or kind in COMPONENTS

    def _unconsumed(
        self, tree: Tree, name: Key, node: Contribution
    ) -> tuple[ObjectRole, Contribution | None]:
        """Leave out standard parts and geometry that a feature consumes; a part of another file stays."""
        if all(key[0] != STANDARD_PARTS and key[0] != self._path for key in node.brings):
            return ObjectRole.COMPONENT, node
        if len(tree.members) < 2 and not self._is_hardware(node):  # to ask every feature takes long
            return ObjectRole.COMPONENT, node
        if (taker := self._consumer(tree, name)) is None:
            return ObjectRole.COMPONENT, node
        feature, how = taker
        if how is Taking.TOOL and derived(node.obj, "PartDesign::Body") and not tree.visible(name):
            return ObjectRole.COMPONENT, node  # a device that cut its place, hidden: asked about as such
        if self._is_hardware(node):
            self._notes.add(FindingCode.CONSUMED, node.obj, target=feature)
        if not (remaining := self._outlasting(node)):
            return ObjectRole.OPERAND, None
        return ObjectRole.COMPONENT, Contribution(
            name, node.obj, node.kind, remaining, node.shown_objects, node.tree
        )

    def _outlasting(self, node: Contribution) -> CountedObjects:
        """Return what no feature uses up: the parts of other files, and declared parts."""
        return {
            key: owner
            for key, owner in node.brings.items()
            if key[0] != STANDARD_PARTS and not (key[0] == self._path and self._is_own(owner[0]))
        }

    @staticmethod
    def _is_hardware(node: Contribution) -> bool:
        return any(key[0] == STANDARD_PARTS for key in node.brings)

    def _without_hidden_geometry(
        self, tree: Tree, leaves: list[tuple[Contribution, int]]
    ) -> list[tuple[Contribution, int]]:
        """Drop hidden geometry modelled in the file, unless there is nothing else."""

        hidden = set()
        for node, _ in leaves:
            if node.kind not in DECLARABLE or tree.visible(node.key) or is_said_to_count(node.obj):
                continue
            if all(key[0] == self._path and self._is_own(target) for key, (target, _) in node.brings.items()):
                hidden.add(node.key)
        if len(hidden) == len(leaves):
            hidden = set()
        if tree is self._main:
            self._roles.update(dict.fromkeys(hidden, ObjectRole.HIDDEN))
            self._hidden += [obj for name, (obj, _) in tree.members.items() if name in hidden]
            self._hidden_counted += [
                node.obj for node, _ in leaves if node.key not in hidden and not tree.visible(node.key)
            ]
        return [leaf for leaf in leaves if leaf[0].key not in hidden] if hidden else leaves

    def _split(
        self, leaves: Iterable[tuple[Contribution, int]], *, beside: bool = False
    ) -> tuple[list[Count], list[Count]]:
        """Split the counts into components, and parts of this file that are no items yet."""
        counts: list[Count] = []
        mine: list[Count] = []
        for node, times in leaves:
            link = node.key in self._links
            for key, (target, quantity) in node.brings.items():
                count = Count(node, key, quantity * times, link, link and is_array(node.obj), beside)
                is_mine = key[0] == self._path and self._is_own(target)
                (mine if is_mine else counts).append(count)
        return counts, mine

    def _report_rings(self) -> None:
        """Report links that lead back to their holder, unless they bring nothing anyway."""
        for ring in self._rings:
            links = [obj for obj in ring.values() if is_link(obj)]
            if not links or any(key in self._nodes and self._nodes[key].brings for key in ring):
                for obj in ring.values():
                    self._notes.loop(obj)
                continue
            for link in links:
                self._notes.in_document(link, self._reader.resolve(link).obj, leads_back=True)

    # --- what each of them brings ---

    def _node(self, key: Key, obj: Any, kind: Kind) -> Contribution | None:
        """Return what one object brings. Looks at each object once, so groups of groups cost no more than
        they hold.

        None for a ring, for an object that is nested too deep, and for a damaged object.
        """
        if (contribution := self._nodes.get(key)) is not None:
            return contribution
        if key in self._open:
            ring = list(self._open)[list(self._open).index(key) :]
            self._rings.append({name: self._open[name] for name in ring})
            return None
        if len(self._open) > _MAX_NESTING:
            self._notes.add(FindingCode.TOO_DEEP, obj, str(_MAX_NESTING), levels=_MAX_NESTING)
            return None
        self._open[key] = obj
        try:
            node = self._made(key, obj, kind)
        except DocumentError as error:
            # One damaged object must not hide the others; the finding blocks the BOM anyway.
            self._unreadable(obj, error)
            return None
        finally:
            del self._open[key]
        self._nodes[key] = node
        return node

    def _unreadable(self, obj: Any, error: DocumentError) -> None:
        self._holds_components = True
        self._notes.unreadable(obj, error)

    def _made(self, key: Key, obj: Any, kind: Kind) -> Contribution:
        if kind in COMPONENTS or kind is Kind.ELEMENT:
            return self._link(key, obj, kind)
        if kind is Kind.STANDARD:
            return Contribution(key, obj, kind, self._standard(obj))
        if kind is Kind.LOCAL or self._is_closed(obj, kind) or key in self._wholes:
            if kind is Kind.LOCAL and not self._is_declared(obj) and (parts := self._linked_operands(obj)):
                several = tuple((part, 1) for part in parts)
                return Contribution(key, obj, kind, self._sum(several), several)
            return Contribution(key, obj, kind, {key: (obj, 1)})
        if kind is Kind.FOREIGN:
            return Contribution(key, obj, kind, self._imported(key, obj))
        if kind in REPEATERS:
            return self._repeater(key, obj, kind)
        if kind not in INLINE:
            return Contribution(key, obj, kind, {})
        tree = self._tree(key, obj)
        if key in self._wholes:
            return Contribution(key, obj, kind, {key: (obj, 1)})
        leaves = self._leaves(tree)
        return Contribution(key, obj, kind, self._sum(leaves), tuple(leaves), tree=tree)

    @staticmethod
    def _sum(leaves: Iterable[tuple[Contribution, int]]) -> CountedObjects:
        brings: CountedObjects = {}
        for node, times in leaves:
            add(brings, node.brings, times)
        return brings

    def _standard(self, fastener: Any) -> CountedObjects:
        if not self._reader.hardware:
            self._notes.add(FindingCode.NO_HARDWARE, fastener, "")
            return {}
        return {self._reader.component(fastener): (fastener, 1)}

    def _imported(self, key: Key, obj: Any) -> CountedObjects:
        """Return the part in another file from which A2plus imported this part."""
        file, part = source_of(obj)
        ask = getattr(obj.Document, "imported", None) if file else None
        if ask is None:
            self._notes.add(FindingCode.FOREIGN_COMPONENT, obj, self._notes.place(obj).doc_path)
            return {key: (obj, 1)}
        target = ask(file, part)
        if not isinstance(target, LinkProblem):
            if getattr(target, "is_document_root", False):
                inner = self._reader.contents(target)
                target = inner.own[0].target if inner.is_part else target
            return {self._key(target): (target, 1)}
        self._holds_components = True
        problem = replace(target, file=located(target.file, obj.Document.FileName))
        self._notes.broken(obj, problem)
        lost = Lost(problem.file, "", label_of(obj))
        return {lost.key: (lost, 1)}

    def _repeater(self, key: Key, obj: Any, kind: Kind) -> Contribution:
        listed = sources(obj)
        shown = [member for member in listed if not self._is_left_out(member)]
        nodes = [self._node(self._key(member), member, kind_of(member)) for member in shown]
        shown_objects = [(node, 1) for node in nodes if node is not None and node.brings]
        brings = self._sum(shown_objects)
        one_piece = kind is Kind.COMPOUND and bool(brings) and self._is_geometry(obj, kind)
        if not listed or (one_piece and all(self._is_own(target) for target, _ in brings.values())):
            return Contribution(key, obj, kind, {key: (obj, 1)})
        if not brings or kind is not Kind.DRAFT_ARRAY:
            return Contribution(key, obj, kind, brings, tuple(shown_objects))
        count = draft_count(obj)
        for element in draft_elements(obj):
            self._is_left_out(element)
        if count == 0:
            self._holds_components = True
            return Contribution(key, obj, kind, {})
        if count is None:
            self._notes.add(FindingCode.ARRAY_SIZE, obj, target=shown[0])
        elif not all(self._is_own(target) for target, _ in brings.values()):
            self._notes.add(FindingCode.DRAFT_ARRAY, obj, target=shown[0], count=count)
        shown_objects = [(node, count or 1) for node, _ in shown_objects]
        return Contribution(key, obj, kind, self._sum(shown_objects), tuple(shown_objects))

    def _is_left_out(self, obj: Any) -> bool:
        """Return True if an object is left out, and note that."""
        mark = left_out_by(obj)
        if mark == "Suppressed":
            self._notes.add(FindingCode.SUPPRESSED, obj)
        elif mark:
            self._notes.add(FindingCode.EXCLUDED, obj, by="itself")
        return bool(mark)

    def _link(self, key: Key, link: Any, kind: Kind) -> Contribution:
        nothing = Contribution(key, link, kind, {})
        if self._is_left_out(link):
            self._holds_components = True
            return nothing
        for element in elements(link):
            self._is_left_out(element)
        target = self._reader.resolve(link)
        if target.obj is None:
            self._holds_components = True
            self._notes.broken(link, target.problem)
            return Contribution(key, link, kind, self._lost_by(link, target))
        if target.element:
            self._notes.add(FindingCode.SUB_ELEMENT_LINK, link, element=target.element)
        elif target.excluded:
            self._holds_components = True
            self._notes.add(
                FindingCode.EXCLUDED, link, by=message("its part {obj}", obj=label_of(target.obj))
            )
        elif not target.instances:  # every element is left out
            self._holds_components = True
        else:
            return self._whole_object(key, link, kind, target)
        return nothing

    @staticmethod
    def _lost_by(link: Any, target: Target) -> CountedObjects:
        """Return the component that a broken link stood for, if the link says so; its finding covers the
        rest.
        """
        problem = target.problem
        if problem is None or not problem.file or problem.code in _NO_COMPONENT_LOST or not target.instances:
            return {}
        lost = Lost(problem.file, problem.obj, label_of(link))
        return {lost.key: (lost, target.instances)}

    def _whole_object(self, key: Key, link: Any, kind: Kind, target: Target) -> Contribution:
        if self._is_mine(target.obj):
            return self._in_document(key, link, kind, target)
        name = self._key(target.obj)
        if words := self._reader.no_component(name, target.obj):
            self._notes.add(FindingCode.NO_COMPONENT, link, target=target.obj, words=words)
            return Contribution(key, link, kind, {})
        # An object of another file is a component, whatever it is.
        text, _ = self._reader.standard(target.obj, name)
        variant = self._reader.variant(target)
        if text:
            brings = self._standard(target.obj)
        elif variant is not None:
            brings = {variant.key: (variant.copy, 1)}
        else:
            brings = self._ones.setdefault(name, {name: (target.obj, 1)})
        if not brings:
            return Contribution(key, link, kind, brings)
        if is_link(link):
            self._links.add(key)
            self._notes.link_type(link)
        self._remarks(link, target)
        if target.instances != 1:
            brings = {brought: (obj, count * target.instances) for brought, (obj, count) in brings.items()}
        if not is_assembly_link(link):
            return Contribution(key, link, kind, brings)
        parts = own_parts(link, target.obj, self._key)
        nodes = [self._node(self._key(part), part, kind_of(part)) for part in parts]
        shown_objects = [(node, 1) for node in nodes if node is not None]
        brings = dict(brings)
        add(brings, self._sum(shown_objects))
        return Contribution(key, link, kind, brings, tuple(shown_objects))

    def _in_document(self, key: Key, link: Any, kind: Kind, target: Target) -> Contribution:
        """Return what a link within the file brings: the same as its target, which may be nothing."""
        variant = self._reader.variant(target)
        obj = target.obj if variant is None else variant.copy
        node = self._node(self._key(obj), obj, kind_of(obj))
        shown_objects = ((node, target.instances),) if node is not None and node.brings else ()
        if not shown_objects:
            if not any(key in ring for ring in self._rings):
                self._notes.in_document(link, obj)
        else:
            self._doubts(link, target)
        return Contribution(key, link, kind, self._sum(shown_objects), shown_objects)

    def _remarks(self, link: Any, target: Target) -> None:
        self._doubts(link, target)
        if is_assembly_link(link):
            gone, new = stale_copies(link, target.obj, self._key)
            if gone or new:
                self._notes.stale(link, target.obj, gone, new)

    def _doubts(self, link: Any, target: Target) -> None:
        """Note what makes a piece differ from its part: another hand, another size, other values."""
        if target.mirrored:
            self._notes.add(FindingCode.MIRRORED, link, target=target.obj)
        if target.scaled:
            self._notes.add(FindingCode.SCALED, link, target=target.obj)
        variant = self._reader.variant(target)
        is_own_item = variant is not None and self._reader.variant_identity(variant) is not None
        if target.variant is not None and not is_own_item:
            values = values_of(target.configured, target.obj) or message("with its values unchanged")
            self._notes.add(FindingCode.VARIANT, link, target=target.obj, values=values)
