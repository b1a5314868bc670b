# SPDX-License-Identifier: LGPL-2.1-or-later
"""Hidden links that only support other geometry: a binder, external geometry of a sketch, an expression.

Such a link is a reference and no piece: its part lies elsewhere in the machine. A link that a joint, an array
or a feature uses as well is a piece.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any

from silo.bom.walk.document import derived, object_name, own
from silo.bom.walk.kinds import Kind
from silo.bom.walk.survey import survey_of

_SUPPORTED_BY = ("Support", "AttachmentSupport", "ExternalGeometry")
_SUPPORTERS = (
    *("PartDesign::SubShapeBinder", "PartDesign::ShapeBinder", "Part::Part2DObject", "Part::Datum"),
    *("App::DatumElement", "Part::FeaturePython"),
)
# Properties that only say where an object lies, or in what frame a binder looks.
_PLACES = frozenset({"Group", "ElementList", "Context"})
_EXPRESSIONS = "ExpressionEngine"
_LINKS = ("App::PropertyLink", "App::PropertyXLink")
_BINDERS = frozenset({Kind.NOTHING, Kind.LOCAL})


class References:
    """What the links of one document support."""

    def __init__(self, document: Any) -> None:
        self._document = document
        survey = survey_of(document)
        self._supporters = [
            obj
            for obj, _ in survey.of(_BINDERS)
            if any(derived(obj, kind) for kind in _SUPPORTERS)
            and any(own(obj, name) for name in _SUPPORTED_BY)
        ]
        self._calculated = [obj for obj in self._mentioning("<Expression ") if own(obj, _EXPRESSIONS)]

    def supported_by(self, link: Any) -> list[Any]:
        """Return what a link supports; [] if it supports nothing, or is used for anything else."""
        supported = [
            obj for obj in self._supporters if any(_leads_to(own(obj, p), link) for p in _SUPPORTED_BY)
        ]
        supported += [obj for obj in self._calculated if obj is not link and _calculates_with(obj, link)]
        if not supported:
            return []
        for user in self._mentioning(object_name(link)):
            if user is not link and any(_leads_to(own(user, name), link) for name in _other_links(user)):
                return []
        return supported

    def _mentioning(self, word: str) -> Iterable[Any]:
        ask = getattr(self._document, "mentioning", None)
        if ask is None:
            return list(getattr(self._document, "Objects", None) or ())
        return [obj for name in ask(word) if (obj := self._document.getObject(name)) is not None]


def _other_links(user: Any) -> Iterator[str]:
    type_of = getattr(user, "getTypeIdOfProperty", None)
    for name in getattr(user, "PropertiesList", None) or ():
        if name in _SUPPORTED_BY or name in _PLACES or name == _EXPRESSIONS:
            continue
        if type_of is None or str(type_of(name)).startswith(_LINKS):
            yield name


def _leads_to(value: Any, link: Any) -> bool:
    """Return True if a link property leads to the object, directly or on a path through what holds it."""
    if isinstance(value, list | tuple):
        step = f".{object_name(link)}."
        return any(
            step in f".{member}" if isinstance(member, str) else _leads_to(member, link) for member in value
        )
    return value is link or (hasattr(value, "Document") and value == link)


def _calculates_with(obj: Any, link: Any) -> bool:
    words = [re.escape(object_name(link)), re.escape(f"<<{getattr(link, 'Label', '')}>>")]
    pattern = re.compile(rf"(?<![\w.])(?:{'|'.join(words)})\.")
    return any(pattern.search(str(formula[1])) for formula in own(obj, _EXPRESSIONS) or ())
