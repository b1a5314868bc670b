# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a mass needs to know of FreeCAD objects beyond what a BOM does, stored in a file or live in FreeCAD.

Lengths are mm here, as FreeCAD has them. How a link places its target: ``getTransform`` in
``src/App/Link.cpp``.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from silo.bom.document import LinkProblem, own
from silo.bom.errors import DocumentError
from silo.inertia.geometry.freecad.stated_materials import Material
from silo.inertia.geometry.graph import Floats

MAX_ELEMENTS = 1_000_000


class Facts(Protocol):
    """One source of the facts: files (``places.StoredFacts``) or FreeCAD (``silo.workbench.mass.shapes``)."""

    def placement(self, obj: Any, name: str = "Placement") -> Floats:
        """(4, 4) of an object's own placement; the identity where it has none."""
        ...

    def places(self, obj: Any) -> list[Floats]:
        """(4, 4) each, the object's own ``PlacementList``."""
        ...

    def shape(self, obj: Any) -> Any:
        """A handle on the object's shape for whoever measures it; None where it has no such property."""
        ...

    def material(self, obj: Any) -> Material:
        """The material that the object itself states."""
        ...

    def problem(self, link: Any) -> LinkProblem | None:
        """Why a link has no target, as far as that is known."""
        ...


def file_of(obj: Any) -> str:
    """The path of the object's file, with "/"; "" while it is unsaved."""
    name = getattr(getattr(obj, "Document", None), "FileName", "") or ""
    return name.replace("\\", "/")


def link_placement(link: Any, facts: Facts) -> Floats:
    """A link's own placement; FreeCAD keeps ``Placement`` and ``LinkPlacement`` equal where both exist."""
    names = getattr(link, "PropertiesList", ())
    return facts.placement(link, "Placement" if "Placement" in names else "LinkPlacement")


def scale(link: Any) -> Floats:
    """(4, 4) diagonal of a link's scale. A zero would flatten the part; FreeCAD takes it as 1."""
    vector = own(link, "ScaleVector")
    parts = list(vector) if vector is not None else []
    factor = own(link, "Scale")
    if not parts and isinstance(factor, int | float):
        parts = [float(factor)] * 3
    return _diagonal(parts)


def _diagonal(parts: list[float]) -> Floats:
    matrix = np.eye(4)
    for axis, part in enumerate(parts[:3]):
        if np.isfinite(part) and abs(part) > 1e-9:
            matrix[axis, axis] = part
    return matrix


def element_places(link: Any, facts: Facts) -> list[Floats]:
    """(4, 4) [mm] of each element of a link array, in order; one identity for a plain link."""
    count = own(link, "ElementCount", 0)
    if not isinstance(count, int) or count <= 0:
        return [np.eye(4)]
    if count > MAX_ELEMENTS:
        raise DocumentError(link.Document.FileName, f"the link {link.Name} claims {count} elements")
    elements = own(link, "ElementList") or ()
    if len(elements) == count:
        return [link_placement(element, facts) @ scale(element) for element in elements]
    places = facts.places(link)
    scales = [_diagonal(list(vector)) for vector in own(link, "ScaleList") or ()]
    one = np.eye(4)
    return [
        (places[n] if n < len(places) else one) @ (scales[n] if n < len(scales) else one)
        for n in range(count)
    ]
