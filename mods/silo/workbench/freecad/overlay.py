# SPDX-License-Identifier: LGPL-2.1-or-later
"""What lies over the model in FreeCAD's 3D view: parts that are lit, and another revision as a ghost.

They are nodes of our own in the view's scene graph; a property of a view would mark the document as modified.
They need pivy, which some packages of FreeCAD lack: then objects are selected only.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from silo.workbench.freecad import host
from silo.workbench.gui import qt

if TYPE_CHECKING:
    from silo.inertia.geometry.together import Floats
    from silo.workbench.ghost import Differences, Ghost


MM = 1e-3

# As on the server's pages.
LIT, ADDED, REMOVED, MOVED = "#1a73e8", "#1a9850", "#d73027", "#7b5cd6"

# Of a shape's diagonal; it is a highlight.
COARSE = 0.01

# Two places are one to this [mm], and to this in each number of the rotation.
SAME_PLACE = 1e-3


class Overlay:
    """What lies over the model: parts that are lit, until something else is selected, and a ghost."""

    def __init__(self) -> None:
        self._lit: list[tuple[Any, Any]] = []
        self._ghost: list[tuple[Any, Any]] = []
        self.ghost_of: tuple[str, int] | None = None
        self._is_ours = False
        host.add_selection_observer(self)

    # FreeCAD calls these.

    def addSelection(self, *_what: Any) -> None:
        """Stop the highlighting when something else is selected."""
        if not self._is_ours and self._lit:
            qt.later(0, lambda: _remove(self._lit))  # the scene graph is in use now

    setSelection = removeSelection = clearSelection = addSelection

    def light(self, doc: Any, names: Sequence[str]) -> int:
        """Select objects and draw them in front of what covers them; returns how many there are."""
        _remove(self._lit)
        self._is_ours = True
        try:
            count = host.select(doc, names)
        finally:
            self._is_ours = False
        self._lit = _add(doc, ((mesh, LIT, 0.4, True) for mesh in _meshes(doc, names)))
        return count

    def clear(self) -> None:
        """Remove the ghost and the lit objects."""
        _remove(self._lit)
        _remove(self._ghost)
        self.ghost_of = None

    def compare(self, doc: Any, top: str, mine: Iterable[str], theirs: Sequence[Ghost]) -> Differences:
        """Draw as a ghost what another revision has at another place, or has alone; light what only this one
        has.

        top, mine
            the assembly in the document, and the objects that it shows.
        """
        from silo.workbench.ghost import Differences

        self.clear()
        whole = doc.getObject(top)
        nodes: list[_Drawn] = []
        removed = moved = unknown = 0
        names = {their.path[0].partition(".")[0] for their in theirs if their.path}
        for ghost in theirs:
            place = _place(whole, ghost.path)
            if place is None and ghost.path and doc.getObject(ghost.path[0].partition(".")[0]) is not None:
                unknown += 1  # FreeCAD has no path to it: a group, an array without links
            elif place is None or not _same(place, ghost.matrix):
                removed, moved = removed + (place is None), moved + (place is not None)
                colour = REMOVED if place is None else MOVED
                mesh = replace(ghost.mesh, vertices=ghost.mesh.vertices / MM).moved(_matrix(whole.Placement))
                nodes.append(((mesh.vertices.tolist(), mesh.faces.tolist()), colour, 0.6, False))
        extra = [name for name in mine if name not in names]
        nodes += [(mesh, ADDED, 0.4, True) for mesh in _meshes(doc, extra)]
        self._ghost = _add(doc, nodes)
        return Differences(removed, moved, len(extra), unknown)


def _matrix(placement: Any) -> Any:
    import numpy as np

    return np.array(placement.toMatrix().A).reshape(4, 4)


def _place(whole: Any, path: Sequence[str]) -> Any | None:
    """Return the placement (4, 4) [mm] at a path below an assembly; None if nothing is there."""
    import Part

    try:
        shape = Part.getShape(whole, "".join(f"{place}." for place in path), transform=False)
    except Exception:  # noqa: BLE001 - FreeCAD says "no such object" with several types
        return None
    return None if shape.isNull() else _matrix(shape.Placement)


def _same(place: Any, matrix: Floats) -> bool:
    """Return True if two placements are equal; ``matrix`` in m. Ignores scales, which FreeCAD's placements
    lack.
    """
    import numpy as np

    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    turned = np.abs(place[:3, :3] - matrix[:3, :3] / np.where(scale > 0, scale, 1)).max()
    return bool(max(turned, np.abs(place[:3, 3] - matrix[:3, 3] / MM).max()) <= SAME_PLACE)


_Triangles = tuple[Sequence[Any], Sequence[Any]]

_Drawn = tuple[_Triangles, str, float, bool]


def _meshes(doc: Any, names: Iterable[str]) -> Iterable[_Triangles]:
    """Yield the triangles [mm] of objects at the places where the document shows them."""
    import Part

    for name in list(names)[: host.MOST_SELECTED]:
        obj = doc.getObject(name)
        for root, sub in (obj.Parents or [(obj, "")]) if obj is not None else ():
            if root.Document.Name != doc.Name:
                continue
            shape = Part.getShape(root, sub)
            if not shape.isNull():
                yield shape.tessellate(max(COARSE * shape.BoundBox.DiagonalLength, 1e-3))


def _node(mesh: _Triangles, colour: str, clear: float, through: bool) -> Any:
    """Make a node that shows triangles [mm]; with ``through``, also behind other objects. It cannot
    be picked.
    """
    from pivy import coin

    node, points, faces = coin.SoSeparator(), coin.SoCoordinate3(), coin.SoIndexedFaceSet()
    style, material, hints = coin.SoPickStyle(), coin.SoMaterial(), coin.SoShapeHints()
    style.style = coin.SoPickStyle.UNPICKABLE
    material.diffuseColor = tuple(channel / 255 for channel in bytes.fromhex(colour[1:]))
    material.transparency = clear
    hints.vertexOrdering = coin.SoShapeHints.COUNTERCLOCKWISE
    corners, rows = mesh
    points.point.setValues(0, len(corners), [tuple(corner) for corner in corners])
    index = [corner for row in rows for corner in (*row, -1)]
    faces.coordIndex.setValues(0, len(index), index)
    if through:
        depth = coin.SoDepthBuffer()
        depth.test = False
        node.addChild(depth)
    for child in (style, material, hints, points, faces):
        node.addChild(child)
    return node


def _add(doc: Any, drawn: Iterable[_Drawn]) -> list[tuple[Any, Any]]:
    """Put nodes into the view of a document; returns each with its parent. Returns nothing without pivy."""
    view: Any = getattr(host.view_of(doc), "ActiveView", None)
    if not hasattr(view, "getSceneGraph"):
        return []
    try:
        made = [_node(*shape) for shape in drawn]
        import pivy.coin  # noqa: F401 - FreeCAD wraps its scene graph with it
    except ImportError:
        return []
    graph = view.getSceneGraph()
    for node in made:
        graph.addChild(node)
    return [(graph, node) for node in made]


def _remove(shown: list[tuple[Any, Any]]) -> None:
    for graph, node in shown:
        graph.removeChild(node)
    shown.clear()
