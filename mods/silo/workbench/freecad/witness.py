# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry as witness: the solids that FreeCAD itself shows, against those that the BOM explains.

FreeCAD makes the shape of an assembly by rules of its own (``Part.getShape``), which know nothing of our
walker. Each assembly is compared with its direct components: so many of each, with so many solids each, and
what is modelled in the assembly's own file. What FreeCAD hides has no shape there; hidden components are
therefore told apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from silo.bom.document import object_name
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry, Extraction
from silo.bom.roots import choose_assembly
from silo.bom.walk.kinds import Kind, flattened
from silo.spelling import one_path
from silo.workbench.freecad import host
from silo.workbench.freecad.live import cached_document


@dataclass(frozen=True)
class Account:
    """One assembly: the solids shown, those that its BOM explains, and those modelled in its own file.

    unexplained
        names of the members whose solids no line explains (the likeliest, where only the sum tells).
    """

    doc_path: str
    object: str
    label: str
    shown: int
    explained: int
    modelled: int
    unexplained: tuple[str, ...] = ()

    @property
    def agrees(self) -> bool:
        """True where every solid is explained, and every explained solid is there."""
        return self.shown == self.explained + self.modelled

    def sentence(self) -> str:
        """For people."""
        text = f"{self.label}: the view has {self.shown} solids, the BOM explains {self.explained}"
        if self.modelled:
            text += f", and {self.modelled} are modelled in the file itself"
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


def accounts(extraction: Extraction) -> list[Account]:
    """The assembly and every sub-assembly, each once; their documents are open."""
    head = extraction.assembly
    document = host.find_document(head.doc_path)
    if document is None:
        return []
    cached = cached_document(document)
    top = cached.getObject(head.object_name) if head.object_name else choose_assembly(cached)
    if top is None:  # this FreeCAD is too old to load it; the extraction says so
        return []
    found = [_account(top, extraction.assembly, extraction.entries)]
    for entry in walk_entries(extraction.entries):
        if entry.is_assembly and not entry.missing and (obj := _object(entry)) is not None:
            found.append(_account(obj, entry, entry.children))
    return found


def _object(entry: BomEntry) -> Any:
    for doc in host.documents():
        if one_path(doc.FileName) == entry.doc_path:
            return doc.getObject(entry.object_name)
    return None


def _account(obj: Any, head: BomEntry, entries: Sequence[BomEntry]) -> Account:
    members = {object_name(member): (member, kind) for _, member, kind in flattened(obj, object_name)}
    counted = {name for entry in entries for name in entry.instances}
    explained = sum(entry.quantity * _solids_of(entry) for entry in entries)
    # What the BOM counts beside the assembly is not in the assembly's shape.
    beside = [obj.Document.getObject(name) for name in sorted(counted - set(members))]
    roots = list(obj.Group) if getattr(obj, "is_document_root", False) else [obj]
    shown = sum(host.solids(one) for one in (*roots, *(one for one in beside if one is not None)))
    # A container lists what lies in its folders as well, and its shape has that twice.
    shown -= sum(host.solids(member) for member, kind in members.values() if kind is Kind.FOLDER)
    local = [
        member
        for name, (member, kind) in members.items()
        if name not in counted and kind in _MODELLED and getattr(member, "Visibility", True)
    ]
    modelled = sum(host.solids(member) for member in local)
    account = Account(
        head.doc_path,
        head.object_name,
        head.label,
        shown,
        explained,
        min(modelled, max(0, shown - explained)),
    )
    if account.agrees:
        return account
    suspects = tuple(
        name
        for name, (member, kind) in members.items()
        if name not in counted and kind not in _SILENT and host.solids(member)
    )
    return Account(**{**vars(account), "unexplained": suspects})


_MODELLED = (Kind.LOCAL, Kind.COMPOUND, Kind.COPY, Kind.FOREIGN, Kind.DRAFT_ARRAY)
_SILENT = (Kind.NOTHING, Kind.FOLDER, *_MODELLED)


def _solids_of(entry: BomEntry) -> int:
    obj = None if entry.missing else _object(entry)
    return 0 if obj is None else host.solids(obj)
