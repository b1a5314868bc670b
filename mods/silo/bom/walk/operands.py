# SPDX-License-Identifier: LGPL-2.1-or-later
"""What features take of other objects: a solid that lives on in the result, a tool that cuts, or a mere look.

* Consumed is the operand of a cut, a boolean, a fusion, a fillet, and what a PartDesign feature outside a
  Body grows from. The tool of a cut is consumed as well, but its solid does not live on.
* Use is not consumption: a sweep's spine, a face that a pad grows from, the inputs of a section, the body
  that a PartDesign *Clone* shows once more.
* Where a view was saved, what the view shows is a piece, whatever uses it (:class:`Consumers`).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from enum import Enum, auto
from typing import Any, Generic, NamedTuple, TypeVar

from silo.bom.walk.document import derived, first_of, is_element_name, own

T = TypeVar("T", bound=Hashable)

# What a property of a feature takes: (of built-in features, of Python features).
_OPERANDS = ("Base", "Tool", "Shapes", "Source", "Sections", "Profile", "BaseFeature", "Faces")
_BY_PYTHON = ("Tool", "Subtractions", "Sources", "Bodies", "Shape1", "Shape2", "baseObject")
_TOOLS = ("Tool", "Subtractions")
_GUIDES = ("PathObject", "PointObject", "Spine")
_CUT = 1  # PartDesign::Boolean's Type


class Taking(Enum):
    """How a feature takes an operand."""

    SOLID = auto()  # it lives on in the result
    TOOL = auto()  # it is cut away
    COPY = auto()  # a clone of a body, which stays a piece if it is visible


class Operand(NamedTuple):
    """An object that a feature takes, and how."""

    obj: Any
    how: Taking


class Consumers(Generic[T]):
    """Who consumes the objects of a document.

    features
        of kind LOCAL.
    has_view
        True if a view of the document was saved, so that what is visible is a piece.
    """

    def __init__(
        self, features: Iterable[Any], key: Callable[[Any], T], has_view: Callable[[], bool]
    ) -> None:
        self._has_view = has_view
        self._by: dict[T, list[tuple[Any, Taking]]] = {}
        for feature in _features(features):
            for operand in operands(feature):
                self._by.setdefault(key(operand.obj), []).append((feature, operand.how))

    def __bool__(self) -> bool:
        return bool(self._by)

    def of(self, key: T, is_visible: Callable[[], bool]) -> tuple[Any, Taking] | None:
        """Return the feature that consumes an object, and how; None if the object stays a piece."""
        if not (takers := self._by.get(key)):
            return None
        if not is_visible():
            return takers[0]
        taker = next((taker for taker in takers if taker[1] is not Taking.COPY), None)
        return None if taker is None or self._has_view() else taker


def _features(objects: Iterable[Any]) -> Iterator[Any]:
    for obj in objects:
        yield obj
        if derived(obj, "PartDesign::Body"):
            yield from own(obj, "Group") or ()


def operands(feature: Any) -> Iterator[Operand]:
    """Yield what a feature consumes, and a Body that it clones."""
    if derived(feature, "Part::Section"):  # it only looks at them
        return
    is_cut = derived(feature, "Part::Cut")
    if derived(feature, "Part::FeaturePython"):
        names: tuple[str, ...] = _BY_PYTHON
        # Fragments, slices and filters of compounds; objects that only draw others have neither.
        if own(feature, "Tool") is not None or own(feature, "FilterType") is not None:
            names = (*names, "Base")
        if own(feature, "Mode") is not None or own(feature, "Tolerance") is not None:
            names = (*names, "Objects")
        is_cut = True
    elif derived(feature, "PartDesign::Boolean"):
        names = (*_OPERANDS, "Group")
    else:
        names = _OPERANDS
    if (grown := _grown_from(feature)) is not None:
        yield Operand(grown, Taking.SOLID)
    cuts_group = own(feature, "Type") in (_CUT, "Cut")
    for name in names:
        how = Taking.TOOL if (is_cut and name in _TOOLS) or (name == "Group" and cuts_group) else Taking.SOLID
        value = own(feature, name)
        if isinstance(value, tuple) and len(value) == 2 and _is_pair(*value):
            value = (value,)
        for member in value if isinstance(value, list | tuple) else (value,):
            operand, subs = (member[0], member[1]) if isinstance(member, tuple) and member else (member, ())
            if not hasattr(operand, "Document"):
                continue
            if name == "Profile" and any(map(_is_geometry, [subs] if isinstance(subs, str) else subs)):
                continue
            is_clone = name == "BaseFeature" and derived(operand, "PartDesign::Body")
            yield Operand(operand, Taking.COPY if is_clone else how)


def _grown_from(feature: Any) -> Any:
    """Return the feature on whose face a PartDesign feature without a Body grows (FreeCAD before 0.17): its
    solid lives on. None for any other feature.
    """
    if not derived(feature, "PartDesign::Feature") or own(feature, "BaseFeature") is not None:
        return None
    sketch = first_of(own(feature, "Sketch") or own(feature, "Profile"))
    support = own(sketch, "Support") or own(sketch, "AttachmentSupport")
    face = support[0] if isinstance(support, list) and support else support
    grown = first_of(face)
    return grown if derived(grown, "PartDesign::Feature") else None


def _is_pair(first: Any, second: Any) -> bool:
    """Return True for an object with its sub-names, not for two objects."""
    return hasattr(first, "Document") and not hasattr(second, "Document")


def guides(obj: Any) -> Iterator[Any]:
    """Yield the objects along which an array or a sweep goes."""
    for name in _GUIDES:
        value = own(obj, name)
        guide = value[0] if isinstance(value, tuple) and value else value
        if hasattr(guide, "Document"):
            yield guide


def _is_geometry(sub: Any) -> bool:
    return is_element_name(str(sub).rpartition(".")[2])
