# SPDX-License-Identifier: LGPL-2.1-or-later
"""A document as it was at one moment: what the worker needs to know of it, and nothing that is alive.

Taken in the GUI thread in milliseconds; from then on the document may change, be closed, or FreeCAD may die.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from silo.bom.entry import Extraction
from silo.bom.errors import SeveralAssembliesError
from silo.bom.snapshot import to_plain
from silo.bom.walk.identity import held_items, sole_identity
from silo.bom.walk.links import extract, file_bom
from silo.bom.walk.roots import NAME_ONE
from silo.platform.spelling import one_path
from silo.workbench.words import translate


@dataclass(frozen=True)
class Snapshot:
    """A document at commit time.

    path
        real path of its file.
    identity
        Silo UUID of the item that the file belongs to; None while unregistered.
    extraction
        the BOM, for an assembly; None for a part.
    problem
        why there is no BOM though there might be one ("several assemblies").
    several
        several items are in it, and it is none of them: its file is a document of its own.
    """

    path: str
    label: str
    identity: str | None = None
    extraction: Extraction | None = None
    problem: str = field(default="", compare=False)
    several: bool = field(default=False, compare=False)

    @property
    def is_assembly(self) -> bool:
        """Return True if there is a BOM to sync."""
        return self.extraction is not None

    def is_as(self, other: Snapshot) -> bool:
        """Return True if both are the same state: the same item, and the same BOM with everything below
        it.
        """
        mine, its = (snapshot.extraction and to_plain(snapshot.extraction) for snapshot in (self, other))
        return (self.path, self.identity, mine) == (other.path, other.identity, its)


Walk = Callable[[Any], Extraction]


def take(doc: Any, *, assembly: Any = None, walk: Walk = extract) -> Snapshot:
    """Take a snapshot of an open document.

    assembly
        the container in which a user works, if it is known; it decides if the document holds several.
    walk
        returns the BOM of a container (:func:`silo.workbench.freecad.live.extract_object`).
    """
    path = one_path(doc.FileName) if doc.FileName else ""
    label = str(getattr(doc, "Label", "") or os.path.basename(path))
    try:
        item_id, extraction = file_bom(doc, assembly, walk)
    except SeveralAssembliesError as error:
        here = translate("Silo", "Make the right assembly active: double-click it in the tree.")
        return Snapshot(path, label, sole_identity(doc), problem=str(error).replace(NAME_ONE, here))
    several = not item_id and len({identity for identity, _ in held_items(doc)}) > 1
    return Snapshot(path, label, item_id, extraction, several=several)
