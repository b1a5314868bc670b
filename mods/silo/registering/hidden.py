# SPDX-License-Identifier: LGPL-2.1-or-later
"""The hidden objects of an assembly about which a user can say if they count.

These are what the finding ``hidden`` names, and what the file already has an answer for.
"""

from __future__ import annotations

from silo.bom.findings import FindingCode, HiddenStanding, Place
from silo.bom.walk.document import label_of, object_name, own
from silo.bom.walk.kinds import COMPONENTS, INLINE, Kind
from silo.bom.walk.links import extract
from silo.bom.walk.roles import DECLARABLE
from silo.bom.walk.roots import choose_assembly
from silo.bom.walk.survey import survey_of
from silo.fcstd import Library

_ANSWERABLE = COMPONENTS | DECLARABLE | INLINE | {Kind.STANDARD}


def hidden_in(path: str, assembly: str | None = None) -> list[Place]:
    """Find what is hidden in the assembly of a file, without FreeCAD. DocumentError, InputError."""
    with Library() as library:
        top = choose_assembly(library.open(path), assembly)
        found = extract(top, below=False)
        places = [place for finding in found.findings_of(FindingCode.HIDDEN) for place in finding.where]
        known = {place.obj for place in places}
        for obj, _ in survey_of(top.Document).of(_ANSWERABLE, known):
            if own(obj, "SiloBomExclude") is True:
                file = top.Document.FileName
                places.append(Place(file, object_name(obj), label_of(obj), HiddenStanding.REFERENCE.value))
        return places
