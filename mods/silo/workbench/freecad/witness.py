# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry as witness: the solids that FreeCAD itself shows, against those that the BOM explains.

FreeCAD shows an assembly by rules of its own (:class:`host.ShownLeaves`), which know nothing of our walker.
Each assembly is compared with its direct components: so many of each, with so many solids each, and what is
modelled in the assembly's own file. Hidden components count as any other, so they are taken as shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from silo.bom.document import object_name
from silo.bom.findings import FindingCode
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry, Extraction
from silo.bom.roots import choose_assembly, silent_reader
from silo.bom.walk.kinds import Kind, flattened
from silo.workbench.freecad import host
from silo.workbench.freecad.live import cached_document


@dataclass(frozen=True)
class Account:
    """One assembly: the solids shown, those that its BOM explains, and those that are no components.

    modelled, left_out
        modelled in the assembly's own file; suppressed, excluded or used up, as a finding says.

    unexplained
        names of the members whose solids no line explains (the likeliest, where only the sum shows it).
    """

    doc_path: str
    object: str
    label: str
    shown: int
    explained: int
    modelled: int
    left_out: int = 0
    unexplained: tuple[str, ...] = ()

    @property
    def agrees(self) -> bool:
        """True where every solid is explained, and every explained solid is there."""
        return self.shown == self.explained + self.modelled + self.left_out

    def sentence(self) -> str:
        """For people."""
        solids = "1 solid" if self.shown == 1 else f"{self.shown} solids"
        text = f"{self.label}: the view has {solids}, the BOM explains {self.explained}"
        if self.modelled:
            text += f", {self.modelled} are modelled in the file itself"
        if self.left_out:
            text += f", {self.left_out} are left out as the findings say"
        if self.agrees:
            return f"{text}."
        names = ", ".join(self.unexplained[:8]) or "none that can be named"
        return f"{text}. They differ; look at: {names}."

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            **asdict(self),
            "unexplained": list(self.unexplained),
            "agrees": self.agrees,
            "sentence": self.sentence(),
        }


def accounts(extraction: Extraction, *, hardware: bool = True) -> list[Account]:
    """The assembly and every sub-assembly, each once; their documents are open.

    hardware
        False where the extraction leaves standard parts out; they are then as good as modelled in the file.
    """
    return _Witness(hardware).accounts(extraction)


_LEFT_OUT = (
    *(FindingCode.SUPPRESSED, FindingCode.EXCLUDED, FindingCode.CONSUMED),
    *(FindingCode.SUB_ELEMENT_LINK, FindingCode.NO_COMPONENT),
)


class _Witness:
    """Looks at each object once."""

    def __init__(self, hardware: bool) -> None:
        self._reader = silent_reader(hardware=hardware)
        self._documents: dict[str, Any] = {}
        self._leaves = host.ShownLeaves()
        self._solids: dict[tuple[str, str], int] = {}
        self._left_out: set[tuple[str, str]] = set()

    def accounts(self, extraction: Extraction) -> list[Account]:
        head = extraction.assembly
        document = self._document(head.doc_path)
        if document is None:
            return []
        top = document.getObject(head.object_name) if head.object_name else choose_assembly(document)
        if top is None:  # this FreeCAD is too old to load it; the extraction says so
            return []
        read = [(top, head, extraction.entries)]
        for entry in walk_entries(extraction.entries):
            if entry.is_assembly and (obj := self._object(entry)) is not None:
                read.append((obj, entry, entry.children))
        # A hidden component counts as any other.
        counted = {
            (obj.Document.Name, name) for obj, _, entries in read for one in entries for name in one.instances
        }
        self._leaves = host.ShownLeaves(counted)
        self._left_out = {
            (place.doc_path, place.obj)
            for finding in extraction.findings_of(*_LEFT_OUT)
            for place in finding.where
        }
        return [self._account(*one) for one in read]

    def _document(self, path: str) -> Any:
        if path not in self._documents:
            found = host.find_document(path)
            self._documents[path] = None if found is None else cached_document(found)
        return self._documents[path]

    def _object(self, entry: BomEntry) -> Any:
        document = self._document(entry.doc_path)
        return None if document is None or entry.missing else document.getObject(entry.object_name)

    def _account(self, obj: Any, head: BomEntry, entries: Sequence[BomEntry]) -> Account:
        members = {object_name(member): (member, kind) for _, member, kind in flattened(obj, object_name)}
        counted = {name for entry in entries for name in entry.instances}
        # What the BOM counts beside the assembly is not in the assembly's shape.
        beside = sorted(counted - {*members, object_name(obj)})
        roots = [*(obj.Group if getattr(obj, "is_document_root", False) else [obj])]
        roots += [one for name in beside if (one := obj.Document.getObject(name)) is not None]
        seen = [self._shown(one, obj.Document) for one in roots]
        shown, modelled = sum(shown for shown, _ in seen), sum(modelled for _, modelled in seen)
        explained = sum(entry.quantity * self._solids_of(entry) for entry in entries)
        # A declared part is modelled in the file, and explained by its line.
        modelled -= sum(
            entry.quantity * self._shown(part, obj.Document)[1]
            for entry in entries
            if entry.doc_path == head.doc_path and (part := self._object(entry)) is not None
        )
        left_out = self._solids_left_out(obj, head)
        suspects = tuple(
            name
            for name, (member, kind) in members.items()
            if name not in counted
            and (head.doc_path, name) not in self._left_out
            and kind not in (Kind.NOTHING, Kind.FOLDER)
            and (inside := self._shown(member, obj.Document))[0] > inside[1]
        )
        account = Account(head.doc_path, head.object_name, head.label, shown, explained, modelled, left_out)
        return account if account.agrees else replace(account, unexplained=suspects)

    def _solids_left_out(self, obj: Any, head: BomEntry) -> int:
        """What is shown and not counted, on purpose."""
        names = [name for path, name in self._left_out if path == head.doc_path]
        found = [one for name in names if (one := obj.Document.getObject(name)) is not None]
        seen = [self._shown(one, obj.Document) for one in found if getattr(one, "Visibility", True)]
        return sum(shown - modelled for shown, modelled in seen)

    def _solids_of(self, entry: BomEntry) -> int:
        obj = self._object(entry)
        return 0 if obj is None else self._shown(obj, obj.Document)[0]

    def _shown(self, obj: Any, document: Any) -> tuple[int, int]:
        """Solids that FreeCAD shows for an object; and those of them that are modelled in this document."""
        solids = modelled = 0
        for key, (leaf, times) in self._leaves.of(obj).items():
            if key not in self._solids:
                self._solids[key] = host.solids(leaf)
            solids += self._solids[key] * times
            if key[0] == document.Name and self._is_modelled(leaf, document):
                modelled += self._solids[key] * times
        return solids, modelled

    def _is_modelled(self, leaf: Any, document: Any) -> bool:
        # FreeCAD keeps the changed copies of copy-on-change links in a group of this name.
        if any(holder.Name.startswith("CopyOnChangeGroup") for holder in leaf.InList):
            return False
        return not self._reader.brings(document.getObject(leaf.Name))
