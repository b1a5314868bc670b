# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mesh files: STL, OBJ, PLY, GLB and 3MF, through trimesh.

A mesh has a volume only where it is closed and its triangles agree on what is outside. What is not so is
computed all the same and said: a number from an open mesh looks like any other number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from silo.bom.errors import ConfigError, DocumentError
from silo.inertia.geometry.checks import assembled, implausible_size
from silo.inertia.geometry.detect import Kind
from silo.inertia.geometry.graph import MAX_DEPTH, Child, Node, in_metres, unfold
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.mesh import Floats, Mesh, welded
from silo.inertia.geometry.options import MESH_UNITS, Reading, ReadOptions, Report
from silo.inertia.geometry.together import enclosed
from silo.inertia.model import GeometryCode, GeometryProblem, Prototype

MAX_COORDINATE = 1e12
"""Of mesh files, in their own unit; nothing that is made is as large, and larger ones overflow an inertia."""


@dataclass(frozen=True, eq=False)
class MeshScene:
    """Meshes by name in file units, their placed uses, and the file's unit [m], None where it states none."""

    meshes: Mapping[str, Mesh]
    nodes: Mapping[str, Node]
    roots: tuple[Child, ...]
    unit_name: str
    unit_m: float | None


def read_mesh(path: Path, kind: Kind, options: ReadOptions, report: Report) -> Reading:
    """The assembly of a mesh file: one instance, or those of its scene. Raises DocumentError."""
    report("reading", 0, 0)
    scene = _scene(path, kind)
    unit, unit_name, problems = _unit(scene, options)
    with np.errstate(over="ignore", invalid="ignore"):  # what comes of it is checked
        unfolded = unfold(scene.nodes, scene.roots, options.max_instances)
    for instance in unfolded.instances:
        _check(path, f"the placement of '{instance.name}'", instance.transform)
    unfolded.instances = [replace(i, transform=in_metres(i.transform, unit)) for i in unfolded.instances]
    unfolded.frames = {path: in_metres(frame, unit) for path, frame in unfolded.frames.items()}
    prototypes = {}
    for number, key in enumerate(unfolded.placed, start=1):
        report("measuring", number, len(unfolded.placed))
        mesh = scene.meshes[key]
        prototypes[key] = _prototype(key, scene.nodes[key].name, Mesh(mesh.vertices * unit, mesh.faces))
    problems += implausible_size(prototypes, unit_name)
    return Reading(
        assembled(unfolded, prototypes, problems, name=path.stem, source=str(path), unit=unit_name)
    )


def checked_mesh(path: Path, what: str, vertices: ArrayLike, faces: ArrayLike) -> Mesh:
    """Triangles of a file, welded. Raises DocumentError for coordinates that cannot be meant."""
    points = np.asarray(vertices, dtype=np.float64)
    _check(path, what, points)
    return welded(points, np.asarray(faces, dtype=np.int64))


def _check(path: Path, what: str, numbers: Floats) -> None:
    if not (np.abs(numbers) <= MAX_COORDINATE).all():  # NaN is no more so than infinity
        reason = f"{what} has numbers that are not finite, or larger than {MAX_COORDINATE:g}"
        raise DocumentError(str(path), f"{reason}; repair the file or export it again")


def _scene(path: Path, kind: Kind) -> MeshScene:
    if kind is Kind.THREEMF:
        from silo.inertia.geometry.meshes.threemf import read_3mf

        return read_3mf(path)
    try:
        import trimesh
    except ImportError as error:  # pragma: no cover - the development environment always has it
        raise ConfigError(
            'mesh files need trimesh, which is not installed: pip install "silo-mod[inertia]"'
        ) from error
    try:
        # Infinite coordinates are refused below, in words; numpy's own would be about trimesh.
        with path.open("rb") as stream, np.errstate(all="ignore"):
            # Unprocessed: what trimesh would mend in silence is what we have to report.
            loaded = trimesh.load_scene(stream, file_type=kind.value, process=False)
    except MemoryError:
        raise
    except Exception as error:
        raise DocumentError(str(path), f"cannot be read as {kind.value}: {error}") from error
    return _from_trimesh(path, kind, loaded)


def _from_trimesh(path: Path, kind: Kind, loaded: Any) -> MeshScene:
    meshes: dict[str, Mesh] = {}
    nodes: dict[str, Node] = {}
    for name, geometry in loaded.geometry.items():
        faces = getattr(geometry, "faces", None)
        if faces is None or not len(faces):
            continue
        meshes[name] = checked_mesh(path, f"the mesh '{name}'", geometry.vertices, faces)
        nodes[name] = Node(name, path.stem if len(loaded.geometry) == 1 else name, (), True)
    if not meshes:
        raise DocumentError(str(path), "holds no triangles")
    roots = _tree(loaded.graph, nodes)
    glb = kind is Kind.GLB
    return MeshScene(meshes, nodes, roots, "m" if glb else "", 1.0 if glb else None)


def _tree(graph: Any, nodes: dict[str, Node]) -> tuple[Child, ...]:
    """The scene's own tree as nodes; a branch with neither meshes nor branches is left out."""
    children: Mapping[str, list[str]] = graph.transforms.children

    def use(name: str, parent: str, above: tuple[str, ...]) -> Child | None:
        if name in above or len(above) > MAX_DEPTH:
            return None
        edge = graph.transforms.edge_data[(parent, name)]
        matrix = np.asarray(edge.get("matrix", np.eye(4)), dtype=np.float64)
        below = [use(child, name, (*above, name)) for child in children.get(name, ())]
        inside = [child for child in below if child is not None]
        mesh = graph.transforms.node_data[name].get("geometry")
        if mesh in nodes:
            if not inside:
                return Child(str(name), mesh, matrix)
            inside.insert(0, Child(nodes[mesh].name, mesh))
        if not inside:
            return None
        nodes[f"node:{name}"] = Node(f"node:{name}", str(name), tuple(inside))
        return Child(str(name), f"node:{name}", matrix)

    top = graph.base_frame
    roots = [use(child, top, (top,)) for child in children.get(top, ())]
    found = [root for root in roots if root is not None]
    mesh = graph.transforms.node_data.get(top, {}).get("geometry")
    return tuple([Child(nodes[mesh].name, mesh)] if mesh in nodes else []) + tuple(found)


def _unit(scene: MeshScene, options: ReadOptions) -> tuple[float, str, list[GeometryProblem]]:
    if options.mesh_unit is not None:
        if options.mesh_unit not in MESH_UNITS:
            raise ConfigError(f"mesh_unit: wanted one of {', '.join(MESH_UNITS)}, got '{options.mesh_unit}'")
        return MESH_UNITS[options.mesh_unit], options.mesh_unit, []
    if scene.unit_m is not None:
        return scene.unit_m, scene.unit_name, []
    problem = GeometryProblem(
        GeometryCode.UNITS,
        "the format states no unit of length; read as mm. Name the unit where it is another",
    )
    return MESH_UNITS["mm"], "mm", [problem]


def _prototype(key: str, name: str, mesh: Mesh) -> Prototype:
    problems: list[GeometryProblem] = []
    solid = enclosed(mesh, problems)
    solids = (solid,) if solid.volume_m3 else ()
    return Measured(solids, tuple(problems), mesh, has_faces=True).prototype(key, name)
