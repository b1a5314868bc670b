# SPDX-License-Identifier: LGPL-2.1-or-later
"""What one assembly holds itself: which components, how often, seen from its own file (spec bom-sync §1).

One rule of repetition: an object brings what it shows. A link brings what its target brings, once per
element; a Draft array what its original brings, once per instance; a link group, a compound, an inline part
or a folder what its members bring. Where that ends in an object of another file, in a standard part or in an
object with an identity of its own, there is a component. Further:

* each object counts once, however many lists of the tree name it; what a link group, an array or a compound
  shows is counted through that, and through each of them;
* what lies in something suppressed or excluded is left out with it;
* a standard part that a cut, a boolean or a fusion consumes is no piece to buy;
* a broken link brings a :class:`Lost` component with its quantity, and a finding that blocks;
* what cannot be read of a damaged file is a finding that blocks; the rest is counted.

Nothing here depends on where the assembly is used, so each is read once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from silo.bom.document import label_of, same_document
from silo.bom.findings import FindingCode
from silo.bom.walk.arrays import draft_count, elements, is_array
from silo.bom.walk.consumed import consumed
from silo.bom.walk.copies import own_parts, stale_copies
from silo.bom.walk.counts import Contents, Count, Key, Leaves, Lost, Worth, add
from silo.bom.walk.kinds import COMPONENTS, INLINE, REPEATERS, Kind, kind_of, sources
from silo.bom.walk.members import DECLARABLE, Members, Way
from silo.bom.walk.standard import STANDARD_PARTS
from silo.bom.walk.targets import Target, is_assembly_link, is_link

if TYPE_CHECKING:
    from silo.bom.walk.contents import Reader

# A link without a target, and one that leads back to itself, stand for no component.
_NO_COMPONENT_LOST = (FindingCode.UNSET_LINK, FindingCode.CYCLE)


class Reading:
    """One assembly while it is being read."""

    def __init__(self, reader: Reader, container: Any) -> None:
        self._reader = reader
        self._notes = reader.notes
        self._key = reader.key
        self._document = container.Document
        self._path, _ = reader.key(container)
        self._is_root = getattr(container, "is_document_root", False)
        self._worths: dict[Key, Worth] = {}
        self._ones: dict[Key, Worth] = {}
        self._way = Way(reader.notes)
        self._members = Members(container, reader.key, reader.notes, self._way, reader.declare)
        self._links: set[Key] = set()
        self._local: dict[Key, Any] = {}
        self._eaten: dict[Key, Any] = {}
        self._holds_components = False
        self._met_hardware = False

    def of(self, container: Any) -> Contents:
        """The contents of an assembly."""
        self._way.open[self._key(container)] = container
        document = container.Document
        members = self._of_repeater(container) or self._members.leaves(container)
        beside: Leaves = {}
        if members and (objects := list(self._reader.beside(container))):
            beside = self._members.leaves(_Group(document, objects))
            members = {key: leaf for key, leaf in members.items() if key not in self._members.shown}
            self._notes.beside_counted(container, [obj for obj, _, _ in beside.values()])
        counts = [*self._counts(members), *self._counts(beside)]
        self._holds_components |= self._way.damaged or self._members.array_left_out
        if self._is_root and not self._holds_components:
            counts = self._without_itself(counts)
        self._look_at_the_rest(container)
        self._report_rings()
        return Contents(counts, list(self._local.values()), self._holds_components or bool(counts))

    def _look_at_the_rest(self, container: Any) -> None:
        """What lies in the assembly and is no component."""
        found = [*self._members.inside(container)]
        found += [(key, obj, kind) for key, (obj, kind, _) in self._of_repeater(container).items()]
        left_out = self._members.left_out(found)
        for key, obj, kind in found:
            if key in left_out or key in self._members.shown or key in self._members.declared:
                continue
            if kind is Kind.LOCAL or (kind in REPEATERS and not self._worths.get(key)):
                self._local[key] = obj
            elif kind is Kind.FOREIGN:
                self._notes.foreign(obj)

    def _report_rings(self) -> None:
        """Links that lead back to what holds them block, except where they bring nothing anyway."""
        for ring in self._way.rings:
            links = [obj for obj in ring.values() if is_link(obj)]
            if any(self._worths.get(key) for key in ring) or not links:
                for obj in ring.values():
                    self._notes.loop(obj)
                continue
            for link in links:
                self._notes.in_document(link, self._reader.resolve(link).obj, leads_back=True)

    def brought_by(self, obj: Any) -> list[Any]:
        """The components that one object of the document shows."""
        self._way.open.clear()
        return [count.target for count in self._counts({self._key(obj): (obj, kind_of(obj), 1)})]

    def _of_repeater(self, container: Any) -> Leaves:
        kind = kind_of(container)
        if kind not in REPEATERS:
            return {}
        self._way.open.clear()
        return {self._key(container): (container, kind, 1)}

    def _counts(self, leaves: Leaves) -> list[Count]:
        return [
            Count(obj, target, quantity * times, link := key in self._links, array=link and is_array(obj))
            for key, (obj, kind, times) in leaves.items()
            for target, quantity in self._bought(key, obj, self._worth(key, obj, kind)).values()
        ]

    def _without_itself(self, counts: list[Count]) -> list[Count]:
        """A file whose one component is its own only part is that part, no assembly of it."""
        if (
            len(counts) == 1
            and counts[0].quantity == 1
            and self._key(counts[0].target) in self._members.declared
        ):
            self._local[self._key(counts[0].target)] = counts[0].target
            return []
        return counts

    # --- what each of them brings -----------------------------------------------

    def _bought(self, key: Key, obj: Any, worth: Worth) -> Worth:
        """Without the standard parts that a feature consumes."""
        if not self._met_hardware or all(name[0] != STANDARD_PARTS for name in worth):
            return worth
        if self._members.features:
            self._eaten |= consumed(self._members.features, self._key)
            self._members.features.clear()
        if (feature := self._eaten.get(key)) is None:
            return worth
        self._notes.consumed(obj, feature)
        return {name: brought for name, brought in worth.items() if name[0] != STANDARD_PARTS}

    def _worth(self, key: Key, obj: Any, kind: Kind) -> Worth:
        """What one object brings; each is looked at once, so groups of groups cost no more than they hold."""
        if (known := self._worths.get(key)) is not None:
            return known
        found = self._way.guarded(key, obj, lambda: self._worth_of(key, obj, kind))
        if found is None:  # a ring, or too deep: nobody knows what lies there
            return {}
        self._worths[key] = found
        return found

    def _worth_of(self, key: Key, obj: Any, kind: Kind) -> Worth:
        if kind in COMPONENTS or kind is Kind.ELEMENT:
            return self._link(key, obj)
        if kind is Kind.STANDARD:
            return self._standard(obj)
        if kind in DECLARABLE and self._members.is_declared(obj):
            return {key: (obj, 1)}
        if kind in REPEATERS:
            return self._repeater(obj, kind)
        return self._inline(obj) if kind in INLINE else {}

    def _inline(self, container: Any) -> Worth:
        worth: Worth = {}
        for key, (obj, kind, times) in self._members.leaves(container).items():
            add(worth, self._bought(key, obj, self._worth(key, obj, kind)), times)
        return worth

    def _standard(self, fastener: Any) -> Worth:
        if not self._reader.hardware:
            self._notes.no_hardware(fastener)
            return {}
        self._met_hardware = True
        return {self._reader.component(fastener): (fastener, 1)}

    def _repeater(self, obj: Any, kind: Kind) -> Worth:
        worth: Worth = {}
        shown = []
        for source in sources(obj):
            if not self._members.report_left_out(source):
                add(worth, self._worth(self._key(source), source, kind_of(source)))
                shown.append(source)
        if not worth or kind is not Kind.DRAFT_ARRAY:
            return worth
        count = draft_count(obj)
        if count is None:
            self._notes.unknown_array(obj, shown[0])
        else:
            self._notes.draft_array(obj, shown[0], count)
        whole: Worth = {}
        add(whole, worth, count or 1)
        return whole

    def _link(self, key: Key, link: Any) -> Worth:
        if self._members.report_left_out(link):
            self._holds_components = True
            return {}
        for element in elements(link):
            self._members.report_left_out(element)
        target = self._reader.resolve(link)
        if target.obj is None:
            self._holds_components = True
            self._notes.broken(link, target.problem)
            return self._lost(link, target)
        if target.element:
            self._notes.sub_element(link, target.element)
        elif target.excluded:
            self._holds_components = True
            self._notes.excluded(link, target.obj)
        elif not target.instances:  # every element is left out
            self._holds_components = True
        else:
            return self._whole_object(key, link, target)
        return {}

    def _lost(self, link: Any, target: Target) -> Worth:
        """A broken link counts like any other where it says what it stood for; else its finding must do."""
        problem = target.problem
        if problem is None or not problem.file or problem.code in _NO_COMPONENT_LOST or not target.instances:
            return {}
        lost = Lost(problem.file, problem.obj, label_of(link))
        return {lost.key: (lost, target.instances)}

    def _whole_object(self, key: Key, link: Any, target: Target) -> Worth:
        name = self._key(target.obj)
        # FreeCAD makes two documents of one file that it opened by two paths; the path decides.
        if same_document(target.obj.Document, self._document) or (self._path and name[0] == self._path):
            return self._in_document(link, target)
        if words := self._reader.no_component(name, target.obj):
            self._notes.no_component(link, target.obj, words)
            return {}
        # An object of another file is a component, whatever it is.
        text, _ = self._reader.standard(target.obj, name)
        worth = self._standard(target.obj) if text else self._one_of(name, target.obj)
        if not worth:
            return {}
        if is_link(link):
            self._links.add(key)
            self._notes.link_type(link)
        self._remarks(link, target)
        whole = worth
        if target.instances != 1:
            whole = {brought: (obj, count * target.instances) for brought, (obj, count) in worth.items()}
        if is_assembly_link(link):
            whole = dict(whole)
            for part in own_parts(link, target.obj, self._key):
                add(whole, self._worth(self._key(part), part, kind_of(part)))
        return whole

    def _one_of(self, name: Key, obj: Any) -> Worth:
        """What each of the links to an object brings; the same for all of them."""
        if (known := self._ones.get(name)) is None:
            known = self._ones[name] = {name: (obj, 1)}
        return known

    def _in_document(self, link: Any, target: Target) -> Worth:
        """A link within the file brings what its target brings, which may be nothing."""
        worth: Worth = {}
        obj = target.obj
        add(worth, self._worth(self._key(obj), obj, kind_of(obj)), target.instances)
        if not worth and not any(self._key(link) in ring for ring in self._way.rings):
            self._notes.in_document(link, obj)
        elif target.mirrored:
            self._notes.mirrored(link, obj)
        return worth

    def _remarks(self, link: Any, target: Target) -> None:
        if target.mirrored:
            self._notes.mirrored(link, target.obj)
        if target.variant:
            self._notes.variant(link, target.obj)
        if is_assembly_link(link):
            gone, new = stale_copies(link, target.obj, self._key)
            if gone or new:
                self._notes.stale(link, target.obj, gone, new)


class _Group:
    """Some objects of a document, to be read as if they lay in one container."""

    is_document_root = True

    def __init__(self, document: Any, objects: list[Any]) -> None:
        self.Document = document
        self.Name = ""
        self.Group = tuple(objects)

    def isDerivedFrom(self, _type_name: str, /) -> bool:
        return False
