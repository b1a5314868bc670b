# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is drawn of an assembly and all below it, joined as the server joins it, with triangles."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.TopAbs import TopAbs_VERTEX
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from silo.api.wire import Structure
from silo.bom.walk.contents import Lost
from silo.bom.walk.standard import standard_uuid
from silo.drawing.models import FileWalk, KernelDrawer, draw
from silo.fcstd import Library
from silo.fcstd.linked import recorded_paths
from silo.inertia.geometry.fcstd import Entries, StoredFacts, Unpacked, located
from silo.inertia.geometry.freecad import Leaf, ShapeRef, file_of
from silo.inertia.geometry.kernel.solids import load_shape
from silo.inertia.geometry.together import Floats, Mesh, joined
from silo_server.services.scene import File, Joined


@dataclass(frozen=True, eq=False)
class Placed:
    """An occurrence: its file, key and path, (4, 4) [m], its mesh in its own axes, its colours."""

    file: str
    key: str
    path: tuple[str, ...]
    lines: tuple[str, ...]
    matrix: Floats
    mesh: Mesh
    colour: Any


def drawn(top: Path) -> tuple[list[Placed], list[dict[str, str]]]:
    """All occurrences below the top, and what is missing."""
    meshes: dict[tuple[str, str], tuple[Mesh, list[Any]]] = {}

    def read(path: str) -> Structure:
        glb, structure = draw(Path(path), KernelDrawer())
        meshes.update({(path, key): found for key, found in products_of(glb).items()})
        return structure

    scene = scene_of(top, read)
    found = []
    for one in scene.found:
        file = scene.drawn[one["geometry"]].checksum
        mesh, colours = meshes[file, one["key"]]
        matrix = np.array(one["matrix"]).reshape(4, 4).T
        found.append(
            Placed(file, one["key"], one["path"], one["lines"], matrix, mesh, one["color"] or colours)
        )
    return found, scene.missing


def scene_of(top: Path, read: Callable[[str], Structure]) -> Joined:
    """The structures of an assembly's files, as the server joins them."""
    files: dict[str, File] = {}
    waiting = [os.path.realpath(top)]
    while waiting:
        path = waiting.pop()
        folder, structure = os.path.dirname(path), read(path)
        links = {one: os.path.realpath(os.path.join(folder, one)) for one in recorded_paths(path)}
        files[path] = File(path, path, dict(links), structure.products, structure.roots, True, geometry="x")
        waiting += [one for one in links.values() if one not in {*files, *waiting} and os.path.exists(one)]
    whole = files[os.path.realpath(top)]
    scene = Joined(files)
    scene.below(whole, whole.roots[0])
    return scene


@dataclass(frozen=True, eq=False)
class Corners:
    """An occurrence: its path, the identities on its way, and its corners' least, most and mean [m]."""

    path: tuple[str, ...]
    lines: tuple[str, ...]
    points: Floats


def corners(top: Path) -> tuple[str, list[Corners], set[str]]:
    """What stands at the top, each occurrence by the exact corners of its shapes, and who has none.

    The identity of a product is where it is (:func:`known_as`).
    """
    points: dict[tuple[str, str], Floats] = {}
    roots: list[str] = []

    def read(path: str) -> Structure:
        entries = Entries()
        with Library() as library, TemporaryDirectory() as folder:
            document = library.open(path)
            walk = _Walk(StoredFacts(entries), hardware=True, file=document.FileName)
            found = walk.all(document)
            roots.append(found[0])
            unpacked = Unpacked(entries, Path(folder))
            for key, leaf in walk.leaves.items():
                shapes = (
                    located(load_shape(one.path, one.named), one.transform)
                    for ref in leaf.shapes
                    for one in unpacked.files(Leaf((ShapeRef(ref.handle[0], ref.transform),)))
                )
                here = sorted({point for shape in shapes for point in _corners(shape)})
                walk.products[key].shape = bool(here)
                points[path, key] = np.array(here).reshape(-1, 3) / 1e3
        entries.close()
        return Structure(roots=found, products=walk.products)

    scene = scene_of(top, read)
    result = []
    for one in scene.found:
        matrix = np.array(one["matrix"]).reshape(4, 4).T
        mine = points[scene.drawn[one["geometry"]].checksum, one["key"]] @ matrix[:3, :3].T + matrix[:3, 3]
        summed = np.array([mine.min(axis=0), mine.max(axis=0), mine.mean(axis=0)])
        result.append(Corners(tuple(one["path"]), tuple(one["lines"]), summed))
    return roots[0], result, {one["part_number"] for one in scene.missing}


def _corners(shape: Any) -> Iterator[tuple[float, ...]]:
    explorer = TopExp_Explorer(shape, TopAbs_VERTEX)
    while explorer.More():
        point = BRep_Tool.Pnt_s(TopoDS.Vertex(explorer.Current()))
        yield tuple(round(one, 6) for one in (point.X(), point.Y(), point.Z()))
        explorer.Next()


class _Walk(FileWalk):
    def _uuid(self, obj: Any) -> str:
        if isinstance(obj, Lost) or getattr(obj, "is_document_root", False):
            return ""
        standard, _ = self._reader.standard(obj)
        return standard_uuid(standard) if standard else known_as(file_of(obj), obj.Name)


def known_as(path: str, name: str) -> str:
    """The identity that :func:`corners` gives to an object of a file."""
    return str(uuid5(NAMESPACE_URL, f"{os.path.realpath(path)}#{name}"))


def products_of(glb: bytes) -> dict[str, tuple[Mesh, list[Any]]]:
    """Product → its triangles in m, with the colour of each primitive (linear RGBA)."""
    (length,) = struct.unpack_from("<I", glb, 12)
    document, blob = json.loads(glb[20 : 20 + length]), glb[28 + length :]

    def values(number: int) -> Floats:
        one = document["accessors"][number]
        view = document["bufferViews"][one["bufferView"]]
        kind = {5120: "i1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[one["componentType"]]
        width = 3 if one["type"] == "VEC3" else 1
        stride = view.get("byteStride") or np.dtype(kind).itemsize * width
        data = np.frombuffer(blob, np.uint8, view["byteLength"], view["byteOffset"])
        rows = np.lib.stride_tricks.as_strided(
            data, (one["count"], width * np.dtype(kind).itemsize), (stride, 1)
        )
        return np.ascontiguousarray(rows).view(kind).astype(float) / (65535 if one.get("normalized") else 1)

    found = {}
    for node in document.get("nodes", ()):
        meshes, colours = [], []
        matrix = np.array(node.get("matrix", np.eye(4))).reshape(4, 4).T
        for one in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            points = values(one["attributes"]["POSITION"]) @ matrix[:3, :3].T + matrix[:3, 3]
            meshes.append(Mesh(points, values(one["indices"]).astype(int).reshape(-1, 3)))
            surface = document["materials"][one["material"]]["pbrMetallicRoughness"]
            colours.append(surface["baseColorFactor"])
        found[node["extras"]["key"]] = (joined(meshes), colours)
    return found
