# SPDX-License-Identifier: LGPL-2.1-or-later
"""3MF files (3MF Core Specification 1.3, with the Production Extension's parts in several model files).

Read here and not by trimesh, whose 3MF loader needs two further packages of 31 MB for it, drops the names of
components and takes any XML. The meshes still go the way of all others, through trimesh.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import NoReturn
from xml.parsers import expat

import numpy as np

from silo.bom.errors import DocumentError
from silo.inertia.geometry.graph import Child, Floats, Node
from silo.inertia.geometry.mesh import Mesh
from silo.inertia.geometry.meshes.meshfile import MeshScene, checked_mesh
from silo.inertia.geometry.options import MESH_UNITS

MAX_MODEL_BYTES = 2_000_000_000
MAX_MODELS = 2_000
_RELATIONS = "_rels/.rels"
_MODEL_TYPE = "3dmodel"


@dataclass(eq=False)
class _Object:
    name: str = ""
    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    faces: list[tuple[int, int, int]] = field(default_factory=list)
    components: list[tuple[str, str, Floats]] = field(default_factory=list)


@dataclass(eq=False)
class _Model:
    """One .model part: objects by id, build items, unit."""

    unit: str = "millimeter"
    objects: dict[str, _Object] = field(default_factory=dict)
    items: list[tuple[str, str, Floats]] = field(default_factory=list)


def read_3mf(path: Path) -> MeshScene:
    """The scene of a 3MF file. Raises DocumentError."""
    try:
        with zipfile.ZipFile(path) as archive:
            return _Package(path, archive).scene()
    except zipfile.BadZipFile as error:
        raise DocumentError(str(path), f"is a damaged zip file ({error}); save it again") from error


class _Package:
    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self._path = path
        self._archive = archive
        self._models: dict[str, _Model] = {}
        self._meshes: dict[str, Mesh] = {}
        self._nodes: dict[str, Node] = {}

    def scene(self) -> MeshScene:
        root = self._root()
        model = self._model(root)
        roots = []
        for part, number, transform in model.items:
            key = self._add(part or root, number, ())
            roots.append(Child(self._nodes[key].name, key, transform))
        if not roots:
            self._fail("builds nothing: no object is listed to be made")
        if model.unit not in MESH_UNITS:
            self._fail(f"states the unit '{model.unit}', which 3MF does not know")
        return MeshScene(self._meshes, self._nodes, tuple(roots), model.unit, MESH_UNITS[model.unit])

    def _root(self) -> str:
        names = self._archive.namelist()
        if _RELATIONS in names:
            finder = _Relations()
            self._parse(_RELATIONS, finder.start)
            if finder.target.lstrip("/") in names:
                return finder.target.lstrip("/")
        models = [name for name in names if name.lower().endswith(".model")]
        if not models:
            self._fail("holds no 3D model")
        return models[0]

    def _model(self, name: str) -> _Model:
        name = name.lstrip("/")
        if name not in self._models:
            if len(self._models) >= MAX_MODELS:
                self._fail(f"is spread over more than {MAX_MODELS} model files")
            reader = _ModelReader()
            self._parse(name, reader.start)
            self._models[name] = reader.model
        return self._models[name]

    def _add(self, part: str, number: str, inside: tuple[str, ...]) -> str:
        key = f"{PurePosixPath(part).name}#{number}"
        if key in inside:
            self._fail(f"its object {number} contains itself")
        if key in self._nodes:
            return key
        found = self._model(part).objects.get(number)
        if found is None:
            self._fail(f"refers to an object {number} that it does not hold")
        children = []
        for other, child, transform in found.components:
            child_key = self._add(other or part, child, (*inside, key))
            children.append(Child(self._nodes[child_key].name, child_key, transform))
        if found.faces:
            self._meshes[key] = self._mesh(number, found)
        name = found.name or (self._path.stem if not inside else f"object {number}")
        self._nodes[key] = Node(key, name, tuple(children), bool(found.faces))
        return key

    def _mesh(self, number: str, found: _Object) -> Mesh:
        faces = np.array(found.faces, dtype=np.int64)
        if faces.min() < 0 or faces.max() >= len(found.vertices):
            self._fail(f"its object {number} has triangles of vertices that it does not hold")
        return checked_mesh(self._path, f"its object {number}", found.vertices, faces)

    def _parse(self, name: str, start: Callable[[str, dict[str, str]], None]) -> None:
        try:
            info = self._archive.getinfo(name)
            if info.file_size > MAX_MODEL_BYTES:
                self._fail(f"its part {name} would unpack to {info.file_size / 1e9:.1f} GB")
            parser = expat.ParserCreate(namespace_separator=" ")
            parser.StartElementHandler = start
            parser.StartDoctypeDeclHandler = self._doctype
            with self._archive.open(info) as stream:
                parser.ParseFile(stream)
        except KeyError:
            self._fail(f"names a part {name} that it does not hold")
        except (expat.ExpatError, ValueError, zipfile.BadZipFile, EOFError) as error:
            self._fail(f"its part {name} is damaged: {error}")

    def _doctype(self, *_: object) -> NoReturn:
        self._fail("declares a document type, which no 3MF file does; it is not read")

    def _fail(self, reason: str) -> NoReturn:
        raise DocumentError(str(self._path), reason)


class _Relations:
    def __init__(self) -> None:
        self.target = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if _local(tag) == "Relationship" and attributes.get("Type", "").lower().endswith(_MODEL_TYPE):
            self.target = self.target or attributes.get("Target", "")


class _ModelReader:
    def __init__(self) -> None:
        self.model = _Model()
        self._object = _Object()

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        kind = _local(tag)
        if kind == "vertex":
            x, y, z = float(attributes["x"]), float(attributes["y"]), float(attributes["z"])
            self._object.vertices.append((x, y, z))
        elif kind == "triangle":
            a, b, c = int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])
            self._object.faces.append((a, b, c))
        elif kind == "object":
            self._object = _Object(attributes.get("name", "").strip())
            self.model.objects[attributes.get("id", "")] = self._object
        elif kind == "component":
            self._object.components.append(_use(attributes))
        elif kind == "item":
            self.model.items.append(_use(attributes))
        elif kind == "model":
            self.model.unit = attributes.get("unit", "millimeter")


def _use(attributes: dict[str, str]) -> tuple[str, str, Floats]:
    part = next((value for name, value in attributes.items() if _local(name) == "path"), "")
    return part, attributes.get("objectid", ""), _matrix(attributes.get("transform", ""))


def _matrix(text: str) -> Floats:
    """3MF writes row vectors, v' = v M: twelve numbers, row by row; ours are columns."""
    matrix = np.eye(4)
    if text.strip():
        numbers = np.array([float(word) for word in text.split()])
        if numbers.size != 12 or not np.isfinite(numbers).all():
            raise ValueError(f"a transform needs 12 numbers, got '{text[:60]}'")
        matrix[:3, :] = numbers.reshape(4, 3).T
    return matrix


def _local(tag: str) -> str:
    return tag.rpartition(" ")[2]
