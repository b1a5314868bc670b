# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the designer saw: if a view of a document was saved, and what the designer said of a hidden object.

A file has a view if it holds GuiDocument.xml, or hides an object that has a shape. A file in which everything
is visible was written without a window; its visibility says nothing.
"""

from __future__ import annotations

from typing import Any

from silo.bom.walk.document import object_name, own
from silo.bom.walk.kinds import COMPONENTS, REPEATERS, Kind, has_own
from silo.bom.walk.survey import survey_of
from silo.bom.walk.tree import COPIES

_SHAPED = COMPONENTS | REPEATERS | {Kind.LOCAL, Kind.STANDARD, Kind.FOREIGN}


def has_view(document: Any) -> bool:
    """Return True if a view of the document was saved."""
    if getattr(document, "has_view", False) is True:
        return True
    copies: set[str] = set()  # FreeCAD itself hides what it copies
    survey = survey_of(document)
    for group, _ in survey.of({Kind.LINK_GROUP}):
        if object_name(group).startswith(COPIES):
            copies.update(object_name(obj) for obj in own(group, "ElementList") or ())
    return any(own(obj, "Visibility") is False for obj, _ in survey.of(_SHAPED, copies))


def is_said_to_count(obj: Any) -> bool:
    """Return True if the file keeps the answer that a hidden object counts: SiloBomExclude, set to false."""
    return own(obj, "SiloBomExclude") is False and has_own(obj, "SiloBomExclude")
