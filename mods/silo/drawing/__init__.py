# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writes GLB (glTF 2.0 binary): meshes once, nodes that use them, materials; for reports and for models.

A general writer repeats a mesh for each colour it has, or each use of it. Here meshes share vertices and
triangles and differ in the material only, so 10 000 instances stay a few MB.

Normals are smooth over a fillet, sharp at an edge.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.inertia.geometry.together import Floats, Indices, Mesh, distinct, joined

Shape = tuple[int, int, int]
"""The accessors of positions, normals and indices."""

_VERTICES, _INDICES = 34962, 34963
_TYPES = {"<f4": 5126, "|i1": 5120, "<u2": 5123, "<u4": 5125}
QUANTIZED = "KHR_mesh_quantization"


class Glb:
    """A GLB that grows. What ``node`` returns goes below another node, or below the scene."""

    def __init__(self, name: str = "") -> None:
        self.nodes: list[dict[str, Any]] = []
        self.roots: list[int] = []
        self._name = name
        self._blob = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._materials: dict[str, int] = {}
        self._meshes: dict[tuple[tuple[Shape, int], ...], int] = {}
        self._quantized = False

    def material(self, colour: Sequence[float], alpha: float = 1.0, name: str = "") -> int:
        """Add a material, and return its number; ``colour`` is RGB as a screen shows it."""
        # glTF wants linear values.
        linear = [round(float(c) ** 2.2, 4) for c in colour[:3]]
        surface = {
            "baseColorFactor": [*linear, round(float(alpha), 4)],
            "metallicFactor": 0.1,
            "roughnessFactor": 0.7,
        }
        made: dict[str, Any] = {"name": name} if name else {}
        made |= {"doubleSided": True, "pbrMetallicRoughness": surface}
        if alpha < 1:
            made["alphaMode"] = "BLEND"
        return self._materials.setdefault(json.dumps(made), len(self._materials))

    def exact(self, vertices: Floats, normals: Floats, faces: NDArray[Any]) -> Shape:
        """Add triangles unchanged."""
        points = vertices.astype("<f4")
        position = self._accessor(points, "VEC3", _VERTICES)
        self._accessors[position] |= _bounds(points)
        return position, self._accessor(normals.astype("<f4"), "VEC3", _VERTICES), self._index(faces, "<u4")

    def quantized(
        self, vertices: Floats, normals: Floats, faces: NDArray[Any], low: Floats, size: float
    ) -> Shape:
        """Add triangles in a cube from ``low`` with edges of ``size``, rounded to 1/65535 of it; see
        :func:`cube`.
        """
        self._quantized = True
        points = np.zeros((len(vertices), 4), "<u2")
        points[:, :3] = np.clip(np.rint((vertices - low) / size * 65535), 0, 65535)
        turned = np.zeros((len(normals), 4), "|i1")
        turned[:, :3] = np.clip(np.rint(normals * 127), -127, 127)
        position = self._accessor(points, "VEC3", _VERTICES, padded=True)
        self._accessors[position] |= _bounds(points[:, :3])
        normal = self._accessor(turned, "VEC3", _VERTICES, padded=True)
        return position, normal, self._index(faces, "<u2" if len(vertices) <= 65535 else "<u4")

    def mesh(self, primitives: Sequence[tuple[Shape, int]]) -> int:
        """Add the mesh of these triangles and materials, and return its number."""
        return self._meshes.setdefault(tuple(primitives), len(self._meshes))

    def node(self, mesh: int | None = None, matrix: Floats | None = None, **more: Any) -> int:
        """Add a node."""
        made = dict(more)
        if mesh is not None:
            made["mesh"] = mesh
        if matrix is not None:
            made["matrix"] = [float(f"{value:.8g}") for value in matrix.T.ravel()]
        self.nodes.append(made)
        return len(self.nodes) - 1

    def packed(self) -> bytes:
        """Write everything as one GLB file."""
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "silo-mod"},
            "scene": 0,
            "scenes": [{"name": self._name, "nodes": self.roots}],
            "nodes": self.nodes,
            "meshes": [{"primitives": list(map(_primitive, mesh))} for mesh in self._meshes],
            "materials": list(map(json.loads, self._materials)),
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._blob)}] if self._blob else [],
        }
        if self._quantized:
            document |= {"extensionsUsed": [QUANTIZED], "extensionsRequired": [QUANTIZED]}
        document = {name: value for name, value in document.items() if value != [] or name == "scenes"}
        text = json.dumps(document, separators=(",", ":")).encode("utf-8")
        text += b" " * (-len(text) % 4)
        blob = bytes(self._blob) + b"\0" * (-len(self._blob) % 4)
        header = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(blob))
        chunks = (
            struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
        )
        return header + chunks

    def _index(self, faces: NDArray[Any], kind: str) -> int:
        return self._accessor(faces.astype(kind).ravel(), "SCALAR", _INDICES)

    def _accessor(self, values: NDArray[Any], kind: str, target: int, padded: bool = False) -> int:
        self._blob += b"\0" * (-len(self._blob) % 4)
        data = values.tobytes()
        view = {"buffer": 0, "byteOffset": len(self._blob), "byteLength": len(data), "target": target}
        made = {
            "bufferView": len(self._views),
            "componentType": _TYPES[values.dtype.str],
            "count": len(values),
            "type": kind,
        }
        if padded:
            view["byteStride"] = values.itemsize * values.shape[1]
            made["normalized"] = True
        self._blob += data
        self._views.append(view)
        self._accessors.append(made)
        return len(self._accessors) - 1


def products(glb: bytes) -> dict[str, Mesh]:
    """Read the triangles [m] of each product of a model (decision 24). Raises ValueError, LookupError."""
    (length,) = struct.unpack_from("<I", glb, 12)
    document, blob = json.loads(glb[20 : 20 + length]), glb[28 + length :]
    views, accessors = document.get("bufferViews", ()), document.get("accessors", ())

    def values(number: int, width: int) -> Floats:
        accessor = accessors[number]
        view = views[accessor["bufferView"]]
        kind = next(np.dtype(name) for name, code in _TYPES.items() if code == accessor["componentType"])
        row = view.get("byteStride", kind.itemsize * width) // kind.itemsize
        start = view["byteOffset"]
        rows_of_values = np.frombuffer(blob, kind, row * accessor["count"], start).reshape(-1, row)[:, :width]
        return rows_of_values / 65535 if accessor.get("normalized") else rows_of_values.astype(float)

    made = {}
    for node in document.get("nodes", ()):
        matrix = np.array(node.get("matrix", np.eye(4).ravel())).reshape(4, 4).T
        parts = document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ()
        meshes = [
            Mesh(values(part["attributes"]["POSITION"], 3), values(part["indices"], 1).astype(np.int64))
            for part in parts
        ]
        made[str(node["extras"]["key"])] = joined(meshes).moved(matrix)
    return made


def cube(vertices: Floats) -> tuple[Floats, float, Floats]:
    """Return corner and edge of a cube around points, and the matrix (4, 4) from the unit cube to it.

    The scale is the same along all axes, so that normals stay as they are.
    """
    low = vertices.min(axis=0)
    size = float(np.ptp(vertices, axis=0).max()) or 1.0
    matrix = np.diag([size, size, size, 1.0])
    matrix[:3, 3] = low
    return low, size, matrix


def _bounds(points: NDArray[Any]) -> Mapping[str, Any]:
    return {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}


def _primitive(primitive: tuple[Shape, int]) -> dict[str, Any]:
    (position, normal, index), material = primitive
    attributes = {"POSITION": position, "NORMAL": normal}
    return {"attributes": attributes, "indices": index, "material": material}


CREASE = np.cos(np.radians(38.0))
"""Faces that meet at more than this angle keep their edge."""

MAX_DEGREE = 100
"""Triangles at one vertex up to which normals are smoothed; the tip of a fan looks well enough flat."""


@dataclass(frozen=True, eq=False)
class Shaded:
    """Triangles with one normal per vertex: vertices (n, 3) [m], normals (n, 3), faces (m, 3)."""

    vertices: Floats
    normals: Floats
    faces: Indices


def shaded(mesh: Mesh) -> Shaded:
    """Add normals to the mesh; a vertex on a sharp edge becomes several."""
    if not len(mesh):
        return Shaded(mesh.vertices, np.zeros_like(mesh.vertices), mesh.faces)
    place = distinct(mesh.vertices)[1]
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    normals = _smoothed(place[mesh.faces].reshape(-1), np.cross(b - a, c - a))
    points = mesh.vertices[mesh.faces].reshape(-1, 3)
    rows = np.hstack([points.astype(np.float32), np.round(normals, 3).astype(np.float32)])
    first, index = distinct(rows)
    unique = rows[first]
    return Shaded(
        unique[:, :3].astype(np.float64), _unit(unique[:, 3:].astype(np.float64)), index.reshape(-1, 3)
    )


def _smoothed(vertex: Indices, areas: Floats) -> Floats:
    """Return (3 m, 3): for each corner the mean normal of those faces at its vertex that look in a similar
    direction.

    ``vertex`` (3 m,) of each corner, ``areas`` (m, 3) normals whose lengths are the areas of the faces.
    """
    flat = _unit(areas)
    order = np.argsort(vertex, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(vertex[order]) != 0])
    degrees = np.diff(np.r_[starts, len(order)])
    normals = flat[np.arange(len(vertex)) // 3]
    for degree in np.unique(degrees):
        if degree > MAX_DEGREE:
            continue
        corners = order[starts[degrees == degree][:, None] + np.arange(degree)]
        face = corners // 3
        near = np.einsum("nix,njx->nij", flat[face], flat[face]) > CREASE
        mean = np.einsum("nij,njx->nix", near.astype(np.float64), areas[face]).reshape(-1, 3)
        normals[corners.reshape(-1)] = _unit(mean)
    return normals


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    units: Floats = vectors / np.where(length > 0, length, 1.0)
    return units
