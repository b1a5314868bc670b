# SPDX-License-Identifier: LGPL-2.1-or-later
"""A preview as GLB (glTF 2.0 binary): every mesh once, instances as nodes, one material per link.

Written here: a general writer repeats a mesh for each colour it has, or each use of it. Here the meshes of
two links share vertices and triangles and differ in the material only, so 10 000 instances stay a few MB.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.inertia.geometry.mesh import Floats, Mesh
from silo.inertia.model import Assembly
from silo.inertia.preview.scene import UNCLAIMED, Colour, LinkView, colour_of, inertia_ellipsoid, meshes_of
from silo.inertia.preview.shading import ellipsoid, shaded

_FLOAT, _UINT = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
_Z_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]
"""glTF has Y up, our assemblies Z: a quarter turn about X."""

MARKER = 0.008
"""Radius of the mark of a centre of mass, in diagonals of the assembly."""


def write_glb(assembly: Assembly, views: Sequence[LinkView]) -> bytes:
    """The scene: one node per link, below it its instances, its centre of mass and its ellipsoid."""
    return _Writer(assembly, views).run()


class _Writer:
    def __init__(self, assembly: Assembly, views: Sequence[LinkView]) -> None:
        self._assembly = assembly
        self._views = views
        self._blob = bytearray()
        self._doc: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "silo-mod"},
            "scene": 0,
            "scenes": [{"name": assembly.name, "nodes": [0]}],
            "nodes": [{"name": assembly.name, "rotation": _Z_UP, "children": []}],
            "meshes": [],
            "materials": [],
            "accessors": [],
            "bufferViews": [],
            "buffers": [],
        }
        self._shapes: dict[str, tuple[int, int, int]] = {}
        self._uses: dict[tuple[str, int], int] = {}

    def run(self) -> bytes:
        meshes = meshes_of(self._assembly, self._views)
        for key, mesh in meshes.items():
            self._shapes[key] = self._shape(mesh)
        self._shapes[""] = self._shape(ellipsoid())
        size = scene_size(self._assembly, self._views)
        for number, view in enumerate(self._views):
            colour = UNCLAIMED if view.props is None and not view.name else colour_of(number)
            self._link(view, colour, size)
        self._doc["buffers"] = [{"byteLength": len(self._blob)}]
        return self._packed()

    def _link(self, view: LinkView, colour: Colour, size: float) -> None:
        children: list[int] = []
        material = self._material(view.name or "no link", colour)
        for instance in view.instances:
            if instance.prototype in self._shapes:
                mesh = self._mesh(instance.prototype, material)
                children.append(self._node(instance.name, mesh, instance.transform))
        node: dict[str, Any] = {"name": view.name or "no link", "children": children}
        if view.props is not None:
            children += self._mass(view, colour, size)
            node["extras"] = {
                "mass_kg": view.props.mass,
                "com_m": view.props.com.tolist(),
                "inertia_kg_m2": view.props.inertia.tolist(),
            }
        if not children:
            del node["children"]
        self._doc["nodes"].append(node)
        self._doc["nodes"][0]["children"].append(len(self._doc["nodes"]) - 1)

    def _mass(self, view: LinkView, colour: Colour, size: float) -> list[int]:
        shape = inertia_ellipsoid(view.props) if view.props is not None else None
        if shape is None:
            return []
        clear = self._material(f"{view.name} inertia", colour, alpha=0.35)
        dark = self._material(f"{view.name} centre of mass", (0.05, 0.05, 0.05))
        mark = np.diag([MARKER * size] * 3 + [1.0])
        mark[:3, 3] = shape.centre
        return [
            self._node(f"{view.name} centre of mass", self._mesh("", dark), mark),
            self._node(f"{view.name} inertia ellipsoid", self._mesh("", clear), shape.placement),
        ]

    def _node(self, name: str, mesh: int, matrix: Floats) -> int:
        columns = [float(f"{value:.8g}") for value in matrix.T.ravel()]
        self._doc["nodes"].append({"name": name, "mesh": mesh, "matrix": columns})
        return len(self._doc["nodes"]) - 1

    def _mesh(self, key: str, material: int) -> int:
        if (key, material) not in self._uses:
            position, normal, index = self._shapes[key]
            primitive = {
                "attributes": {"POSITION": position, "NORMAL": normal},
                "indices": index,
                "material": material,
            }
            self._doc["meshes"].append({"primitives": [primitive]})
            self._uses[key, material] = len(self._doc["meshes"]) - 1
        return self._uses[key, material]

    def _material(self, name: str, colour: Colour, alpha: float = 1.0) -> int:
        # glTF wants linear values; ours are meant as a screen shows them.
        linear = [round(float(c) ** 2.2, 4) for c in colour]
        material: dict[str, Any] = {
            "name": name,
            "doubleSided": True,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*linear, alpha],
                "metallicFactor": 0.1,
                "roughnessFactor": 0.7,
            },
        }
        if alpha < 1:
            material["alphaMode"] = "BLEND"
        self._doc["materials"].append(material)
        return len(self._doc["materials"]) - 1

    def _shape(self, mesh: Mesh) -> tuple[int, int, int]:
        body = shaded(mesh)
        points = body.vertices.astype("<f4")
        position = self._accessor(points, "VEC3", _VERTICES)
        self._doc["accessors"][position]["min"] = [float(v) for v in points.min(axis=0)]
        self._doc["accessors"][position]["max"] = [float(v) for v in points.max(axis=0)]
        normal = self._accessor(body.normals.astype("<f4"), "VEC3", _VERTICES)
        index = self._accessor(body.faces.astype("<u4").ravel(), "SCALAR", _INDICES)
        return position, normal, index

    def _accessor(self, values: NDArray[Any], kind: str, target: int) -> int:
        data = values.tobytes()
        view = {
            "buffer": 0,
            "byteOffset": len(self._blob),
            "byteLength": len(data),
            "target": target,
        }
        self._blob += data
        self._doc["bufferViews"].append(view)
        self._doc["accessors"].append(
            {
                "bufferView": len(self._doc["bufferViews"]) - 1,
                "componentType": _FLOAT if values.dtype.kind == "f" else _UINT,
                "count": len(values),
                "type": kind,
            }
        )
        return len(self._doc["accessors"]) - 1

    def _packed(self) -> bytes:
        text = json.dumps(self._doc, separators=(",", ":")).encode("utf-8")
        text += b" " * (-len(text) % 4)
        blob = bytes(self._blob) + b"\0" * (-len(self._blob) % 4)
        header = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(blob))
        chunks = (
            struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
        )
        return header + chunks


def scene_size(assembly: Assembly, views: Sequence[LinkView]) -> float:
    """Diagonal [m] of the box around everything that is shown."""
    points = scene_corners(assembly, views)
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 1.0


def scene_corners(assembly: Assembly, views: Sequence[LinkView]) -> Floats:
    """Corners (n, 3) [m] of the boxes of all instances, placed."""
    corners = {}
    for key, mesh in meshes_of(assembly, views).items():
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        corners[key] = np.array([[(low, high)[(n >> axis) & 1][axis] for axis in range(3)] for n in range(8)])
    rows = [
        corners[i.prototype] @ i.transform[:3, :3].T + i.transform[:3, 3]
        for view in views
        for i in view.instances
        if i.prototype in corners
    ]
    return np.concatenate(rows) if rows else np.zeros((0, 3))
