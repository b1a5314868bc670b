# SPDX-License-Identifier: LGPL-2.1-or-later
"""The objects of a file by their kinds, most of them known by their type alone."""

from __future__ import annotations

from collections.abc import Set
from typing import TYPE_CHECKING, Any

from silo.bom.walk.kinds import Kind, kind_by_type, kind_of
from silo.bom.walk.survey import Survey
from silo.fcstd.type_tree import ancestors, is_listed
from silo.fcstd.values import LocalList
from silo.fcstd.xmltext import XmlText

if TYPE_CHECKING:
    from silo.fcstd.document import FcstdDocument


class FileSurvey(Survey):
    """Objects by kind, most of them known by their type alone."""

    def __init__(self, document: FcstdDocument, xml: XmlText) -> None:
        self._document, self._xml = document, xml
        types = xml.head.types
        self._types = set(types.values())
        kinds = {kind: kind_by_type(ancestors(kind)) if is_listed(kind) else None for kind in self._types}
        self._kinds = {
            name: kind or kind_of(document.object_of(name, types[name]))
            for name, kind in zip(types, map(kinds.__getitem__, types.values()), strict=True)
        }
        self._there = set(self._kinds.values())
        self._groups: list[tuple[Kind, tuple[str, ...]]] | None = None

    def of(self, kinds: Set[Kind], but: Set[str] = frozenset()) -> list[tuple[Any, Kind]]:
        if self._there.isdisjoint(kinds):
            return []
        types, make = self._xml.head.types, self._document.object_of
        return [
            (make(name, types[name]), kind)
            for name, kind in self._kinds.items()
            if kind in kinds and name not in but
        ]

    def grouped(self, kinds: Set[Kind]) -> set[str]:
        if self._groups is None:
            types, make = self._xml.head.types, self._document.object_of
            groups = [
                (kind, make(name, types[name]).properties.value("Group"))
                for name in self._xml.mentioning("Group")
                if (kind := self._kinds.get(name)) is not None
            ]
            self._groups = [(kind, group.names) for kind, group in groups if isinstance(group, LocalList)]
        return {name for kind, names in self._groups if kind in kinds for name in names}

    def only(self, kinds: Set[Kind]) -> bool:
        """Return True if all objects are of these kinds."""
        return self._there <= kinds

    def has_python(self) -> bool:
        return any(type_id.endswith("FeaturePython") for type_id in self._types)
