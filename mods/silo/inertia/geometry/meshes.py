# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mesh files: STL, OBJ, PLY and GLB through trimesh, and 3MF.

A mesh has a volume only if it is closed and its triangles agree on what is outside. What is not so is
computed anyway and said: a number from an open mesh looks like any other number.

3MF files (3MF Core Specification 1.3, with the Production Extension's parts in several model files).

Read here and not by trimesh, whose 3MF loader needs two further packages of 31 MB for it, drops the names of
components and takes any XML. The meshes still go the way of all others, through trimesh.
"""

from __future__ import annotations

import json
import re
import zipfile
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import ArrayLike

from silo.bom.errors import ConfigError, DocumentError, counted
from silo.bom.message import message
from silo.bounded_json import read_json
from silo.budget import Budget, OverBudgetError
from silo.inertia.assembly import Prototype
from silo.inertia.geometry.formats import Format
from silo.inertia.geometry.graph import MAX_DEPTH, Child, Node, in_metres, unfold
from silo.inertia.geometry.limits import MESH
from silo.inertia.geometry.measured import Measured, assembled, implausible_size
from silo.inertia.geometry.options import MESH_UNITS, ReadOptions, Report
from silo.inertia.geometry.reading import GeometryReading
from silo.inertia.geometry.together import Floats, Mesh, enclosed, welded, without
from silo.inertia.notes import GeometryCode, Note

MAX_COORDINATE = 1e12
"""Of mesh files, in their own unit; nothing that is made is as large, and larger ones overflow an inertia."""


@dataclass(frozen=True, eq=False)
class MeshScene:
    """Meshes by name in file units, their placed uses, and the file's unit [m], None if it states none.

    ``said`` is by mesh, that of the whole file under "".
    """

    meshes: Mapping[str, Mesh]
    nodes: Mapping[str, Node]
    roots: tuple[Child, ...]
    unit_name: str
    unit_m: float | None
    said: Mapping[str, Sequence[Note]] = field(default_factory=dict)


def read_mesh(path: Path, kind: Format, options: ReadOptions, report: Report) -> GeometryReading:
    """Read the assembly of a mesh file: one instance, or those of its scene. Raises DocumentError."""
    report("reading", 0, 0)
    scene = mesh_scene(path, kind)
    unit, unit_name, problems = _unit(scene, options)
    with np.errstate(over="ignore", invalid="ignore"):  # what comes of it is checked
        unfolded = unfold(scene.nodes, scene.roots, options.max_instances)
    for instance in unfolded.instances:
        _check(path, message("the placement of '{name}'", name=instance.name), instance.transform)
    unfolded.instances = [replace(i, transform=in_metres(i.transform, unit)) for i in unfolded.instances]
    unfolded.frames = {path: in_metres(frame, unit) for path, frame in unfolded.frames.items()}
    prototypes = {}
    for number, key in enumerate(unfolded.placed, start=1):
        report("measuring", number, len(unfolded.placed))
        mesh = scene.meshes[key]
        notes = scene.said.get(key, ())
        name = scene.nodes[key].name
        prototypes[key] = mesh_prototype(key, name, Mesh(mesh.vertices * unit, mesh.faces), notes)
    problems += [*scene.said.get("", ())]
    problems += implausible_size(prototypes, unit_name)
    return GeometryReading(
        assembled(unfolded, prototypes, problems, name=path.stem, source=str(path), unit=unit_name)
    )


def checked_mesh(path: Path, what: str, vertices: ArrayLike, faces: ArrayLike) -> Mesh:
    """Make a welded mesh of a file's triangles. Raises DocumentError if the coordinates cannot be real."""
    points = np.asarray(vertices, dtype=np.float64)
    _check(path, what, points)
    return welded(points, np.asarray(faces, dtype=np.int64))


def _check(path: Path, what: str, numbers: Floats) -> None:
    if not (np.abs(numbers) <= MAX_COORDINATE).all():  # NaN is no more so than infinity
        reason = message(
            "{what} has numbers that are not finite, or larger than {max_coordinate}",
            what=what,
            max_coordinate=f"{MAX_COORDINATE:g}",
        )
        raise DocumentError(str(path), message("{reason}; repair the file or export it again", reason=reason))


def mesh_scene(path: Path, kind: Format) -> MeshScene:
    """Read the meshes of a file and their places. Raises DocumentError."""
    if kind is Format.THREEMF:
        return read_3mf(path)
    try:
        import trimesh
    except ImportError as error:  # pragma: no cover - the development environment always has it
        raise ConfigError(
            message('mesh files need trimesh, which is not installed: pip install "silo-mod[inertia]"')
        ) from error
    if kind is Format.PLY and _is_cut_off(path.read_bytes()):
        raise DocumentError(str(path), message("the file ends in the middle; export or copy it again"))
    if kind is Format.GLB:
        _count_claims(path)
    try:
        # Infinite coordinates are refused below, with a message; numpy's warning would be about trimesh.
        with path.open("rb") as stream, np.errstate(all="ignore"):
            # Unprocessed, since we report what trimesh would repair without a word.
            loaded = trimesh.load_scene(stream, file_type=kind.value, process=False)
    except MemoryError:
        raise
    except Exception as error:
        raise DocumentError(
            str(path), message("cannot be read as {value}: {error}", value=kind.value, error=error)
        ) from error
    return _from_trimesh(path, kind, loaded)


def _is_cut_off(data: bytes) -> bool:
    """Return True for a PLY file of text with fewer lines than its header lists; trimesh counts binary
    ones.
    """
    head, _, body = data.partition(b"end_header")
    listed = sum(map(int, re.findall(rb"^element\s+\S+\s+(\d+)", head, re.MULTILINE)))
    return b"format ascii" in head and listed > sum(bool(line.strip()) for line in body.splitlines())


def _from_trimesh(path: Path, kind: Format, loaded: Any) -> MeshScene:
    meshes: dict[str, Mesh] = {}
    nodes: dict[str, Node] = {}
    for name, geometry in loaded.geometry.items():
        faces = getattr(geometry, "faces", None)
        if faces is None or not len(faces):
            continue
        meshes[name] = checked_mesh(path, message("the mesh '{name}'", name=name), geometry.vertices, faces)
        nodes[name] = Node(name, path.stem if len(loaded.geometry) == 1 else name, (), True)
    if not meshes:
        raise DocumentError(str(path), message("holds no triangles"))
    roots = _tree(loaded.graph, nodes)
    glb = kind is Format.GLB
    if kind is Format.DAE:
        unit = _dae_unit(path)
        return MeshScene(meshes, nodes, roots, f"{unit:g} m", unit)
    notes: list[Note] = []
    if kind in (Format.OBJ, Format.GLB):
        used = [loaded.graph.transforms.node_data[n].get("geometry") for n in loaded.graph.nodes_geometry]
        read = (
            sum(name in nodes for name in used)
            if glb
            else sum(len(m.faces) for m in loaded.geometry.values())
        )
        notes = _unread(path.read_bytes(), glb, read)
    return MeshScene(meshes, nodes, roots, "m" if glb else "", 1.0 if glb else None, {"": notes})


def _count_claims(path: Path) -> None:
    """Count the numbers that a GLB file claims and does not hold: its reader makes zeros of them."""
    data = path.read_bytes()
    account = MESH.account(path.name)
    scene = _glb_json(data, path)
    for accessor in scene.get("accessors", ()):
        if "bufferView" not in accessor and isinstance(accessor.get("count"), int):
            account.take_cells(max(accessor["count"], 0))


def _glb_json(data: bytes, path: Path) -> dict[str, Any]:
    try:
        scene = read_json(data[20 : 20 + int.from_bytes(data[12:16], "little")], MESH, path.name)
    except OverBudgetError:
        raise
    except ValueError as error:
        raise DocumentError(str(path), message("cannot be read as glb: {error}", error=error)) from error
    if not isinstance(scene, dict):
        raise DocumentError(str(path), message("cannot be read as glb: its JSON is no object"))
    return scene


_DAE_UNIT = re.compile(rb"<unit\b[^>]*\bmeter\s*=\s*[\"']([0-9.eE+-]+)[\"']")


def _dae_unit(path: Path) -> float:
    """Return the unit [m] that a COLLADA file states; its default is one metre."""
    found = _DAE_UNIT.search(path.read_bytes())
    try:
        return float(found[1]) if found is not None and float(found[1]) > 0 else 1.0
    except ValueError:
        return 1.0


_POLYGON = re.compile(rb"^[ \t]*(f[ \t](?:[^\n]*\\\r?\n)*[^\n]*|surf[ \t])", re.MULTILINE)
_TRIANGLES = (4, 5, 6)
"""Ways to draw a primitive of glTF that make triangles."""


def _unread(data: bytes, glb: bool, read: int) -> list[Note]:
    """Compare what was read with the file's list: placed primitives of a GLB, polygons of an OBJ file."""
    left_out = 0
    if glb:
        scene = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
        nodes, meshes = scene.get("nodes", []), scene.get("meshes", [])
        waiting = list((scene.get("scenes") or [{}])[scene.get("scene", 0)].get("nodes", ()))
        placed = set[int]()
        while waiting:
            if (node := waiting.pop()) not in placed:
                placed.add(node)
                waiting += nodes[node].get("children", ())
        full = {n for n, node in enumerate(nodes) if "mesh" in node}
        left_out = len(full - placed)
        drawn = [meshes[nodes[n]["mesh"]].get("primitives", ()) for n in full & placed]
        listed = sum(
            primitive.get("mode", 4) in _TRIANGLES for primitives in drawn for primitive in primitives
        )
        listed += sum("EXT_mesh_gpu_instancing" in nodes[n].get("extensions", ()) for n in placed)
    else:
        lines = [line.split() for line in _POLYGON.findall(data)]
        listed = sum(max(len(line) - 3, 0) if line[0] == b"f" else 1 for line in lines)
    notes = []
    if read < listed:
        what = message("placed meshes") if glb else message("triangles and free-form surfaces")
        words = message(
            "the file has {listed} {what}, and {read} were read: volume is missing",
            listed=listed,
            what=what,
            read=read,
        )
        notes.append(Note(GeometryCode.BODY_MISSING, words))
    if left_out:
        words = message("{left_out} of the file in no scene: left out", left_out=counted(left_out, "node"))
        notes.append(Note(GeometryCode.NOT_COUNTED, words))
    return notes


def _tree(graph: Any, nodes: dict[str, Node]) -> tuple[Child, ...]:
    """Turn the scene's own tree into nodes, without branches that hold neither meshes nor branches."""
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

    top = graph.base_frame  # trimesh's own, so that it has no mesh
    roots = [use(child, top, (top,)) for child in children.get(top, ())]
    return tuple(root for root in roots if root is not None)


def _unit(scene: MeshScene, options: ReadOptions) -> tuple[float, str, list[Note]]:
    if options.mesh_unit is not None:
        if options.mesh_unit not in MESH_UNITS:
            raise ConfigError(
                message(
                    "mesh_unit: wanted one of {mesh_units}, got '{mesh_unit}'",
                    mesh_units=", ".join(MESH_UNITS),
                    mesh_unit=options.mesh_unit,
                )
            )
        return MESH_UNITS[options.mesh_unit], options.mesh_unit, []
    if scene.unit_m is not None:
        return scene.unit_m, scene.unit_name, []
    problem = Note(
        GeometryCode.UNITS,
        message("the format states no unit of length; read as mm. Name the unit if it is another"),
    )
    return MESH_UNITS["mm"], "mm", [problem]


def mesh_prototype(key: str, name: str, mesh: Mesh, notes: Sequence[Note]) -> Prototype:
    problems = list(notes)
    solid = enclosed(mesh, problems)
    solids = (solid,) if solid.volume_m3 else ()
    return Measured(solids, tuple(problems), mesh, has_faces=True).prototype(key, name)


MAX_MODELS = 2_000
_RELATIONS = "_rels/.rels"
_MODEL_TYPE = "3dmodel"
_BAMBU, _PRUSA = "Metadata/model_settings.config", "Metadata/Slic3r_PE_model.config"
_CURA = tuple(f"cura:{word}_mesh" for word in ("support", "anti_overhang", "infill", "cutting"))
"""What Cura says of an object that only tells how others are printed."""
_NEGATIVE = ("negative_part", "NegativeVolume")
_PART = ("", "model", "normal_part", "ModelPart")
"""What is the part, by the object's type or by the slicer's word. All else is not, or is negative."""


Corner = tuple[float, float, float]


@dataclass(eq=False)
class _Object:
    name: str = ""
    kind: str = ""
    vertices: list[Corner] = field(default_factory=list)
    faces: list[tuple[int, int, int]] = field(default_factory=list)
    components: list[tuple[str, str, Floats]] = field(default_factory=list)
    lattice: bool = False


@dataclass(eq=False)
class _Model:
    """One .model part: objects by id, build items, unit."""

    unit: str = "millimeter"
    objects: dict[str, _Object] = field(default_factory=dict)
    items: list[tuple[str, str, Floats]] = field(default_factory=list)
    unprinted: list[str] = field(default_factory=list)


def read_3mf(path: Path, budget: Budget = MESH) -> MeshScene:
    """Read the scene of a 3MF file. Raises DocumentError."""
    try:
        with zipfile.ZipFile(path) as archive:
            return _Package(path, archive, budget).scene()
    except zipfile.BadZipFile as error:
        raise DocumentError(
            str(path), message("is a damaged zip file ({error}); save it again", error=error)
        ) from error


_NOT_CUT = message("a negative volume could not be subtracted")


class _Package:
    def __init__(self, path: Path, archive: zipfile.ZipFile, budget: Budget) -> None:
        self._path = path
        self._archive = archive
        self._account = budget.account(message("the model"))
        self._models: dict[str, _Model] = {}
        self._meshes: dict[str, Mesh] = {}
        self._nodes: dict[str, Node] = {}
        self._reached: set[str] = set()
        self._said: dict[str, list[Note]] = defaultdict(list)
        self._slicer = _Slicer()
        for name in {_BAMBU, _PRUSA}.intersection(archive.namelist()):
            self._parse(name, self._slicer.start)

    def scene(self) -> MeshScene:
        root = self._root()
        model = self._model(root)
        roots = []
        for part, number, transform in model.items:
            if self._is_left_out("", part or root, number):
                continue
            key = self._add(part or root, number, ())
            roots.append(Child(self._nodes[key].name, key, transform))
        if not roots:
            self._fail(message("builds nothing: no object is listed to be made"))
        if model.unit not in MESH_UNITS:
            self._fail(message("states the unit '{unit}', which 3MF does not know", unit=model.unit))
        unit_m = MESH_UNITS[model.unit]
        for number, obj in model.objects.items():
            if _key(root, number) not in self._reached and obj.kind in _PART:
                why = (
                    message("is marked as not printed")
                    if number in model.unprinted
                    else message("is built by nothing")
                )
                self._say(
                    "",
                    message(
                        "object {number} “{name}” {why}: left out", number=number, name=obj.name, why=why
                    ),
                )
        return MeshScene(self._meshes, self._nodes, tuple(roots), model.unit, unit_m, self._said)

    def _say(self, key: str, words: str, code: GeometryCode = GeometryCode.NOT_COUNTED) -> None:
        self._said[key].append(Note(code, words))

    def _is_left_out(self, role: str, part: str, number: str) -> bool:
        """Return True for an object that is not the part, by the slicer's word, else by its own type.

        Bambu Studio and Orca Slicer give everything that is not the part the same type, also negative
        volumes.
        """
        self._reached.add(_key(part, number))
        obj = self._model(part).objects.get(number)
        word = role or (obj.kind if obj else "")
        if obj is None or word in (*_PART, *_NEGATIVE):
            return False
        name = f" “{obj.name}”" if obj.name else ""
        self._say(
            "",
            message(
                "object {number}{name} is not the part ({word}): left out",
                number=number,
                name=name,
                word=word,
            ),
        )
        return True

    def _root(self) -> str:
        names = self._archive.namelist()
        if _RELATIONS in names:
            finder = _Relationships()
            self._parse(_RELATIONS, finder.start)
            if finder.target.lstrip("/") in names:
                return finder.target.lstrip("/")
        models = [name for name in names if name.lower().endswith(".model")]
        if not models:
            self._fail(message("holds no 3D model"))
        return models[0]

    def _model(self, name: str) -> _Model:
        name = name.lstrip("/")
        if name not in self._models:
            if len(self._models) >= MAX_MODELS:
                self._fail(
                    message("is spread over more than {max_models} model files", max_models=MAX_MODELS)
                )
            reader = _ModelReader()
            self._parse(name, reader.start, reader.text)
            self._models[name] = reader.model
        return self._models[name]

    def _add(self, part: str, number: str, inside: tuple[str, ...]) -> str:
        key = _key(part, number)
        if key in inside:
            self._fail(message("its object {number} contains itself", number=number))
        if key in self._nodes:
            return key
        obj = self._model(part).objects.get(number)
        if obj is None:
            self._fail(message("refers to an object {number} that it does not hold", number=number))
        children: list[Child] = []
        cuts: list[Mesh] = []
        for other, child, transform in obj.components:
            roles = self._slicer.roles.get((number, child), [""])
            role = roles.pop(0) if roles[1:] else roles[0]  # a shared mesh is listed once for each use
            if self._is_left_out(role, other or part, child):
                continue
            child_key = self._add(other or part, child, (*inside, key))
            if role not in _NEGATIVE:
                children.append(Child(self._nodes[child_key].name, child_key, transform))
            elif child_key in self._meshes:
                cuts.append(self._meshes[child_key].moved(transform))
            else:
                self._say(
                    "",
                    message(
                        "the negative volume {child} is an assembly: {not_cut}", child=child, not_cut=_NOT_CUT
                    ),
                    GeometryCode.INVALID_SHAPE,
                )
        faces = dict(enumerate(obj.faces))
        for kind, first, last in self._slicer.volumes.get(number, ()):
            if kind not in _PART:
                taken = [faces.pop(row) for row in range(first, last + 1) if row in faces]
                if kind not in _NEGATIVE:
                    self._say(
                        "",
                        message(
                            "a volume of object {number} is not the part ({kind}): left out",
                            number=number,
                            kind=kind,
                        ),
                    )
                elif taken:
                    cuts.append(self._mesh(number, obj.vertices, taken))
        if faces:
            self._meshes[key] = self._mesh(number, obj.vertices, list(faces.values()))
            self._carve(key, cuts)
        if obj.lattice or not (faces or obj.components):
            what = message("beams, which are not measured") if obj.lattice else message("no triangles")
            words = message(
                "object {number} “{name}” has {what}: its volume is missing",
                number=number,
                name=obj.name,
                what=what,
            )
            self._say("", words, GeometryCode.BODY_MISSING)
        name = obj.name or (self._path.stem if not inside else message("object {number}", number=number))
        whole = tuple(self._carved(key, child, cuts) for child in children)
        self._nodes[key] = Node(key, name, whole, bool(faces))
        return key

    def _carved(self, parent: str, child: Child, cuts: Sequence[Mesh]) -> Child:
        """Return the use of a mesh without the negative volumes beside it, which becomes a mesh of its
        own.
        """
        if cuts and child.product not in self._meshes:
            words = message("“{name}” is an assembly: {not_cut} from it", name=child.name, not_cut=_NOT_CUT)
            self._say("", words, GeometryCode.INVALID_SHAPE)
        if not cuts or child.product not in self._meshes:
            return child
        key = f"{parent}-{child.name}-{child.product}"
        self._meshes[key] = self._meshes[child.product]
        self._nodes[key] = replace(self._nodes[child.product], key=key)
        inverse = np.asarray(np.linalg.inv(child.transform), dtype=np.float64)
        self._carve(key, [cut.moved(inverse) for cut in cuts])
        return replace(child, product=key)

    def _carve(self, key: str, cuts: Sequence[Mesh]) -> None:
        for cut in cuts:
            if (carved := without(self._meshes[key], cut)) is None:
                words = message("the mesh or the volume does not close: {not_cut}", not_cut=_NOT_CUT)
                self._say(key, words, GeometryCode.INVALID_SHAPE)
            else:
                self._meshes[key] = carved
                self._say(key, message("the slicer's negative volume was subtracted"))

    def _mesh(self, number: str, vertices: Sequence[Corner], rows: Sequence[tuple[int, int, int]]) -> Mesh:
        faces = np.array(rows, dtype=np.int64)
        if faces.min() < 0 or faces.max() >= len(vertices):
            self._fail(
                message("its object {number} has triangles of vertices that it does not hold", number=number)
            )
        return checked_mesh(self._path, message("its object {number}", number=number), vertices, faces)

    def _parse(
        self,
        name: str,
        start: Callable[[str, dict[str, str]], None],
        text: Callable[[str], None] | None = None,
    ) -> None:
        try:
            info = self._archive.getinfo(name)
            self._account.take_bytes(info.file_size)  # zipfile unpacks no more than that
            account = self._account

            def counted_start(tag: str, attributes: dict[str, str]) -> None:
                account.take_objects()
                start(tag, attributes)

            parser = expat.ParserCreate(namespace_separator=" ")
            parser.StartElementHandler = counted_start
            parser.CharacterDataHandler, parser.buffer_text = text, True
            parser.StartDoctypeDeclHandler = self._doctype
            with self._archive.open(info) as stream:
                parser.ParseFile(stream)
        except KeyError:
            self._fail(message("names a part {name} that it does not hold", name=name))
        except (expat.ExpatError, ValueError, zipfile.BadZipFile, EOFError) as error:
            self._fail(message("its part {name} is damaged: {error}", name=name, error=error))

    def _doctype(self, *_: object) -> NoReturn:
        self._fail(message("declares a document type, which no 3MF file does; it is not read"))

    def _fail(self, reason: str) -> NoReturn:
        raise DocumentError(str(self._path), reason)


class _Relationships:
    def __init__(self) -> None:
        self.target = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if _local(tag) == "Relationship" and attributes.get("Type", "").lower().endswith(_MODEL_TYPE):
            self.target = self.target or attributes.get("Target", "")


class _Slicer:
    """What a slicer says of the parts of an object (Bambu, Orca), or of ranges of its triangles (Prusa)."""

    def __init__(self) -> None:
        self.roles: dict[tuple[str, str], list[str]] = defaultdict(list)
        self.volumes: dict[str, list[tuple[str, int, int]]] = defaultdict(list)
        self._object = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        kind, key, value = tag, attributes.get("key", ""), attributes.get("value", "")
        if kind == "object":
            self._object = attributes.get("id", "")
        elif kind == "part":
            self.roles[self._object, attributes.get("id", "")].append(attributes.get("subtype", ""))
        elif kind == "volume":
            first, last = int(attributes["firstid"]), int(attributes["lastid"])
            self.volumes[self._object].append(("", first, last))
        elif key == "volume_type" or (key, value) == ("modifier", "1"):
            volumes = self.volumes[self._object]
            volumes[-1:] = [
                (value if key == "volume_type" else "modifier", *volume[1:]) for volume in volumes[-1:]
            ]


class _ModelReader:
    def __init__(self) -> None:
        self.model = _Model()
        self._object = _Object()
        self._metadata = ""

    def text(self, data: str) -> None:
        if self._metadata in _CURA and data.strip().casefold() == "true":
            self._object.kind = self._metadata

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        kind = _local(tag)
        self._metadata = attributes.get("name", "") if kind == "metadata" else ""
        if kind == "vertex":
            x, y, z = float(attributes["x"]), float(attributes["y"]), float(attributes["z"])
            self._object.vertices.append((x, y, z))
        elif kind == "triangle":
            a, b, c = int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])
            self._object.faces.append((a, b, c))
        elif kind == "object":
            self._object = _Object(attributes.get("name", "").strip(), attributes.get("type", ""))
            self.model.objects[attributes.get("id", "")] = self._object
        elif kind == "beam":
            self._object.lattice = True
        elif kind == "component":
            self._object.components.append(_use(attributes))
        elif kind == "item" and attributes.get("printable") == "0":
            self.model.unprinted.append(attributes.get("objectid", ""))
        elif kind == "item":
            self.model.items.append(_use(attributes))
        elif kind == "model":
            self.model.unit = attributes.get("unit", "millimeter")


def _use(attributes: dict[str, str]) -> tuple[str, str, Floats]:
    part = next((value for name, value in attributes.items() if _local(name) == "path"), "")
    return part, attributes.get("objectid", ""), _matrix(attributes.get("transform", ""))


def _matrix(text: str) -> Floats:
    """Read a placement: 3MF writes row vectors, v' = v M, twelve numbers row by row; ours are columns."""
    matrix = np.eye(4)
    if text.strip():
        numbers = np.array([float(word) for word in text.split()])
        if numbers.size != 12 or not np.isfinite(numbers).all():
            raise ValueError(message("a transform needs 12 numbers, got '{text}'", text=text[:60]))
        matrix[:3, :] = numbers.reshape(4, 3).T
    return matrix


def _key(part: str, number: str) -> str:
    return f"{part.lstrip('/')}#{number}"


def _local(tag: str) -> str:
    return tag.rpartition(" ")[2]
