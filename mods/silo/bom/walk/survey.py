# SPDX-License-Identifier: LGPL-2.1-or-later
"""The objects of a whole document by their kind."""

from __future__ import annotations

from collections.abc import Set
from typing import Any

from silo.bom.walk.document import object_name, own
from silo.bom.walk.kinds import Kind, kind_of


class Survey:
    """The objects of a document by what they are, each looked at once.

    A document that knows more of its objects without making them has a ``survey`` of its own.
    """

    def __init__(self, document: Any) -> None:
        self._objects = [(obj, kind_of(obj)) for obj in getattr(document, "Objects", None) or ()]

    def of(self, kinds: Set[Kind], but: Set[str] = frozenset()) -> list[tuple[Any, Kind]]:
        """Return the objects of these kinds in document order, but not those with the names in ``but``."""
        return [(obj, kind) for obj, kind in self._objects if kind in kinds and object_name(obj) not in but]

    def grouped(self, kinds: Set[Kind]) -> set[str]:
        """Return the names of the objects in the ``Group`` of an object of these kinds."""
        return {object_name(member) for obj, _ in self.of(kinds) for member in own(obj, "Group") or ()}

    def has_python(self) -> bool:
        """Return True if the document has an object of a Python type, as standard parts are."""
        return any(getattr(obj, "TypeId", "").endswith("FeaturePython") for obj, _ in self._objects)


def survey_of(document: Any) -> Survey:
    """Return the survey of a document; its own if it has one."""
    survey = getattr(document, "survey", None)
    return survey if isinstance(survey, Survey) else Survey(document)
