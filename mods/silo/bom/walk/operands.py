# SPDX-License-Identifier: LGPL-2.1-or-later
"""The objects that features consume: the operands of cuts, booleans and fusions."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import Any, TypeVar

from silo.bom.walk.document import derived, own

T = TypeVar("T", bound=Hashable)

_OPERANDS = ("Base", "Tool", "Shapes", "Source", "Sections", "Spine", "Profile", "BaseFeature", "Faces")

_BY_PYTHON = ("Tool", "Subtractions", "Sources", "Bodies", "Shape1", "Shape2", "baseObject")


def consumed(objects: Iterable[Any], key: Callable[[Any], T]) -> dict[T, Any]:
    """Map the key of each object that these features (of kind LOCAL) consume to the feature."""
    eaten: dict[T, Any] = {}
    for feature in _features(objects):
        for operand in _operands(feature):
            eaten.setdefault(key(operand), feature)
    return eaten


def _features(objects: Iterable[Any]) -> Iterator[Any]:
    for obj in objects:
        yield obj
        if derived(obj, "PartDesign::Body"):
            yield from own(obj, "Group") or ()


def _operands(feature: Any) -> Iterator[Any]:
    if derived(feature, "Part::FeaturePython"):
        names: tuple[str, ...] = _BY_PYTHON
        # Fragments, slices and filters of compounds; objects that only draw others have neither.
        if own(feature, "Tool") is not None or own(feature, "FilterType") is not None:
            names = (*names, "Base")
        if own(feature, "Mode") is not None or own(feature, "Tolerance") is not None:
            names = (*names, "Objects")
    elif derived(feature, "PartDesign::Boolean"):
        names = (*_OPERANDS, "Group")
    else:
        names = _OPERANDS
    for name in names:
        value = own(feature, name)
        for member in value if isinstance(value, list | tuple) else (value,):
            operand = member[0] if isinstance(member, tuple) and member else member
            if hasattr(operand, "Document"):
                yield operand
