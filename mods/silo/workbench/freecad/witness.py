# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry as witness: the solids that FreeCAD itself shows, against those that the BOM explains.

FreeCAD says by sub-object paths what an assembly shows (:class:`host.Pieces`); nothing of the BOM goes into
that, and no role of an object is believed. Each object of the assembly is then compared with what the count
explains: so many components, with so many solids each; and the lines of the BOM are compared with the count.
What is shown and does not count is right only where a finding names this object.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.findings import FindingCode
from silo.bom.key import Key
from silo.bom.message import joined, message
from silo.bom.walk.chains import chains
from silo.bom.walk.contents import Count, Lost
from silo.bom.walk.document import object_name
from silo.bom.walk.kinds import COMPONENTS, REPEATERS, Kind, kind_of
from silo.bom.walk.roots import choose_assembly, silent_reader
from silo.bom.walk.standard import STANDARD_PARTS, fastener_type, is_tool
from silo.bom.walk.tree import Tree
from silo.workbench.freecad import host
from silo.workbench.freecad.live import LinkInspector, cached_document, canonical_paths

# What is shown and not counted, on purpose: a finding of one of these names the object. So does an error of
# a file that a link wants, since the view may show what it kept.
_NAMED_SHOWN = frozenset(
    {
        *(FindingCode.CONSUMED, FindingCode.MODIFIED_HERE, FindingCode.COINCIDENT, FindingCode.NO_HARDWARE),
        *(FindingCode.SUPPRESSED, FindingCode.EXCLUDED),
    }
)
_NAMED_HIDDEN = _NAMED_SHOWN | {FindingCode.HIDDEN}

# Links count whatever a feature makes of them.
_BOUGHT = COMPONENTS | {Kind.STANDARD}
_SHOWN_BY = ("LinkedObject", "Base", "Source", "Links", "Objects", "LinkCopyOnChangeSource")
_TAKEN_BY = ("Tool", "Shapes", "BaseFeature", "Sections", "Faces", "Bodies", "Sources", "Subtractions")


@dataclass(frozen=True)
class SolidDifference:
    """An object that shows other solids than the BOM explains."""

    object: str
    label: str
    shown: int
    explained: int
    why: str


@dataclass
class SolidCount:
    """One assembly: the solids shown, and those that its lines explain.

    hidden
        explained, and hidden in the view: hidden components count.
    beside
        shown and explained, and lie beside the assembly.
    sources
        hidden, and shown through others only: they do not count.
    left_out
        shown, and not counted on purpose: suppressed, excluded, used up, a tool.
    """

    doc_path: str
    object: str
    label: str
    shown: int = 0
    explained: int = 0
    hidden: int = 0
    beside: int = 0
    sources: int = 0
    left_out: int = 0
    differences: list[SolidDifference] = field(default_factory=list)

    @property
    def agrees(self) -> bool:
        """Return True if every solid is explained, and every explained solid is there."""
        return not self.differences

    @property
    def unexplained(self) -> tuple[str, ...]:
        """Return the names of the objects that differ."""
        return tuple(difference.object for difference in self.differences)

    def differ(self, obj: Any, shown: int, explained: int, why: str) -> None:
        """Add a difference."""
        self.differences.append(SolidDifference(obj.Name, obj.Label, shown, explained, why))

    def sentence(self) -> str:
        """Describe the comparison in a sentence, for people."""
        solids = message("1 solid") if self.shown == 1 else message("{shown} solids", shown=self.shown)
        file = os.path.basename(self.doc_path)
        text = message(
            "{label} in {file}: the view has {solids}, the BOM explains {explained}",
            label=self.label,
            file=file,
            solids=solids,
            explained=self.explained,
        )
        further = (
            (self.hidden, message("of these hidden")),
            (self.beside, message("beside the assembly")),
            (self.sources, message("hidden sources that do not count")),
            (self.left_out, message("left out as the findings say")),
        )
        more = [
            message("{number} {words}", number=number, words=words) for number, words in further if number
        ]
        text = joined(", ", (text, *more))
        if self.agrees:
            return text + "."
        texts = [
            message(
                "{label} ({why}: shown {shown}, explained {explained})",
                label=row.label,
                why=row.why,
                shown=row.shown,
                explained=row.explained,
            )
            for row in self.differences[:8]
        ]
        return message("{text}. They differ; look at: {texts}.", text=text, texts=joined(", ", texts))

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as JSON values."""
        more = {"unexplained": list(self.unexplained), "agrees": self.agrees, "sentence": self.sentence()}
        return {**asdict(self), **more}


def accounts(extraction: Extraction, *, hardware: bool = True) -> list[SolidCount]:
    """Compare the solids of the assembly and of every sub-assembly, each once; their documents are open.

    hardware
        False if the extraction leaves standard parts out.
    """
    return _Witness(hardware).accounts(extraction)


class _Witness:
    """Looks at each object once."""

    def __init__(self, hardware: bool) -> None:
        self._reader = silent_reader(hardware=hardware, counts_beside=True, inspect=LinkInspector())
        self._documents: dict[str, Any] = {}
        self._own_shapes: dict[tuple[str, str], int] = {}
        self._canonical = canonical_paths()
        self._named_shown: set[Key] = set()
        self._named_hidden: set[Key] = set()

    def accounts(self, extraction: Extraction) -> list[SolidCount]:
        head = extraction.assembly
        document = self._document(head.doc_path)
        if document is None:
            return []
        top = document.getObject(head.object_name) if head.object_name else choose_assembly(document)
        if top is None:  # this FreeCAD is too old to load it; the extraction says so
            return []
        read = [(top, head, (*extraction.entries, *head.own))]
        for entry in walk_entries(extraction.entries):
            if entry.is_assembly and (obj := self._object(entry)) is not None:
                read.append((obj, entry, (*entry.children, *entry.own)))
        for finding in extraction.findings:
            for place in finding.where:
                path = self._canonical(place.doc_path)
                if finding.code in _NAMED_SHOWN or (finding.file and finding.blocks):
                    self._named_shown.add((path, place.obj))
                if finding.code in _NAMED_HIDDEN:
                    self._named_hidden.add((path, place.obj))
        return [self._account(*account) for account in read]

    def _document(self, path: str) -> Any:
        if path not in self._documents:
            document = host.find_document(path)
            self._documents[path] = None if document is None else cached_document(document)
        return self._documents[path]

    def _object(self, entry: BomEntry) -> Any:
        path, name = entry.copy if entry.variant else (entry.doc_path, entry.object_name)
        document = self._document(path)
        return None if document is None or entry.missing else document.getObject(name)

    def _account(self, obj: Any, head: BomEntry, lines: Sequence[BomEntry]) -> SolidCount:
        account = SolidCount(head.doc_path, head.object_name, head.label)
        contents = self._reader.contents(obj)
        top, is_array = host.real(obj), kind_of(obj) in REPEATERS
        see = host.Pieces(self._own_shapes, None if is_array else top)
        own = contents.own if head.own or not contents.is_assembly(obj) else []
        predicted: Counter[str] = Counter()
        pieces: Counter[Key] = Counter()
        beside = {}
        for count in (*contents.counts, *own):
            name = object_name(count.shown.obj)
            pieces[self._component(count.target)] += count.quantity
            if not isinstance(count.target, Lost):
                predicted[name] += count.quantity * see.of(self._drawn(count, contents.tree))[0]
            if count.beside:
                beside[name] = host.real(count.shown.obj)
        if getattr(obj, "is_document_root", False):
            inside = host.root_objects(host.real(obj.Document))
        else:
            inside = host.sub_objects(top) or []
        # An array is its own only member.
        shown = [(top, True)] if is_array else _members(inside, predicted)
        seen_by_path: dict[str, _Seen] = {}
        for one, is_visible in (*shown, *((member, member.Visibility) for member in beside.values())):
            seen_by_path.setdefault(one.Name, _Seen(one)).add(see.of(one, is_visible))
        for name in {**seen_by_path, **predicted}:
            seen = seen_by_path.get(name) or _Seen(obj.Document.getObject(name))
            account.shown += seen.shown
            account.left_out += seen.left_out
            account.beside += seen.shown if name in beside else 0
            account.explained += predicted[name]
            self._judge(account, seen, predicted[name], obj.Document, may_hide=name not in beside)
        if contents.is_assembly(obj):  # a part is not an assembly of its bodies
            self._compare_lines(account, lines, pieces)
        return account

    def _judge(
        self, account: SolidCount, seen: _Seen, explained: int, document: Any, *, may_hide: bool
    ) -> None:
        obj = host.real(seen.obj)
        kind, key = kind_of(obj), (self._canonical(document.FileName), obj.Name)
        is_bought = kind in _BOUGHT
        is_shown = _is_used_by(obj, _SHOWN_BY, but_features=kind in COMPONENTS)
        is_taken = kind not in COMPONENTS and _is_used_by(obj, (*_SHOWN_BY, *_TAKEN_BY))
        if seen.shown == explained:
            if explained or not seen.hidden or key in self._named_hidden:
                return
            if is_shown or is_taken or _is_in_source(obj):
                account.sources += seen.hidden
            else:
                account.differ(obj, 0, 0, message("hidden and not counted"))
        elif (
            seen.shown < explained <= seen.shown + seen.hidden
            and may_hide
            and (seen.shown or not (is_shown or is_taken))
        ):
            account.hidden += explained - seen.shown
        elif not explained and (
            key in self._named_shown
            or is_tool(fastener_type(obj))  # taps and dies are drawn, and no part of the product
            or (is_taken and not is_bought and not self._reader.has_view(document))
        ):
            account.left_out += seen.shown
        else:
            account.differ(
                obj, seen.shown, explained, "counted" if explained else message("neither counted nor named")
            )

    def _drawn(self, count: Count, tree: Tree | None) -> Any:
        """Return the component; if it is not open in FreeCAD, the object that stands for it in the
        assembly.
        """
        if host.is_object(host.real(count.target)):
            return count.target
        return next(chains(count, tree))[-1][0]

    def _component(self, target: Any) -> Key:
        path, name = target.key if isinstance(target, Lost) else self._reader.component(target)
        return (path if path == STANDARD_PARTS else self._canonical(path), name)

    def _compare_lines(self, account: SolidCount, lines: Sequence[BomEntry], pieces: Counter[Key]) -> None:
        """Report lines whose quantity differs from the number of pieces, and pieces without a line."""
        left = Counter(pieces)
        for line in lines:
            registered = line.key if line.variant else (line.doc_path, line.object_name)
            key = registered if registered in pieces or not line.standard else (STANDARD_PARTS, line.standard)
            left[key] -= line.quantity
        for (path, name), number in left.items():
            if number:
                total = pieces[path, name]
                account.differences.append(
                    SolidDifference(name, name, total, total - number, message("line of the BOM"))
                )


def _members(
    listed: Sequence[tuple[Any, bool]], explained: Mapping[str, int], visible: bool = True
) -> Iterator[tuple[Any, bool]]:
    """Yield each object that counts or holds nothing, once for each path, with its visibility there."""
    for member, is_visible in listed:
        if _is_holder(member) and member.Name not in explained:
            yield from _members(host.sub_objects(member) or [], explained, visible and is_visible)
        else:
            yield member, visible and is_visible


def _is_holder(obj: Any) -> bool:
    """Return True for a container whose members count by themselves, by its type alone."""
    if obj.isDerivedFrom("Assembly::AssemblyLink"):
        return False
    kinds = ("App::Part", "App::LinkGroup", "App::DocumentObjectGroup")
    return any(map(obj.isDerivedFrom, kinds)) or kind_of(obj) is Kind.CONTAINER


@dataclass
class _Seen:
    """The solids of one object over all paths to it."""

    obj: Any
    shown: int = 0
    hidden: int = 0
    left_out: int = 0

    def add(self, solids: tuple[int, int, int]) -> None:
        self.shown += solids[0]
        self.hidden += solids[1]
        self.left_out += solids[2]


def _is_in_source(obj: Any, inside: tuple[Any, ...] = ()) -> bool:
    """Return True for a member of a container that another object shows, such as the source of an array."""
    return any(
        _is_used_by(holder, _SHOWN_BY) or _is_in_source(holder, (*inside, obj))
        for holder in obj.InList
        if holder.Document == obj.Document and holder not in inside and _is_holder(holder)
    )


def _is_used_by(obj: Any, properties: Sequence[str], *, but_features: bool = False) -> bool:
    """Return True if another object of its document shows or takes this one, in one of these properties."""
    for user in obj.InList:
        if but_features and kind_of(user) is Kind.LOCAL:
            continue
        for name in properties if user.Document == obj.Document else ():
            value = getattr(user, name, None) if name in user.PropertiesList else None
            several = value if isinstance(value, list | tuple) else (value,)
            if any((one[0] if isinstance(one, tuple) and one else one) == obj for one in several):
                return True
    return False
