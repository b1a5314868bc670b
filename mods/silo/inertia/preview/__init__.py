# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as one HTML page that needs nothing else: a 3D view, masses by source, warnings, tables.

The page holds three.js and the GLB. It loads nothing from anywhere, and its content security policy says so.

The 3D scene shows links in colours, their centres of mass, their inertia as ellipsoids. As GLB (glTF 2.0
binary) it has every mesh once, instances as nodes, one material per link. Written here: a general writer
repeats a mesh for each colour it has, or each use of it. Here the meshes of two links share vertices and
triangles and differ in the material only, so 10 000 instances stay a few MB.

Normals are smooth over a fillet, sharp at an edge.
"""

from __future__ import annotations

import base64
import colorsys
import json
import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray
from trimesh import creation

from silo.bom.errors import counted
from silo.inertia.core import MassProps
from silo.inertia.geometry.together import Floats, Indices, Mesh
from silo.inertia.model import Assembly, Instance
from silo.inertia.output.text import NOISE, SOURCE_WORDS, how, material_of
from silo.inertia.report import InertiaReport, LinkResult, PartResult, Source

Colour = tuple[float, float, float]

_BASE: tuple[Colour, ...] = (
    (0.26, 0.52, 0.80),
    (0.92, 0.57, 0.20),
    (0.36, 0.66, 0.38),
    (0.80, 0.36, 0.36),
    (0.55, 0.45, 0.75),
    (0.85, 0.73, 0.25),
    (0.30, 0.67, 0.70),
    (0.80, 0.48, 0.66),
)
UNCLAIMED: Colour = (0.72, 0.72, 0.70)


@dataclass(frozen=True, eq=False)
class LinkView:
    """One link: the instances that belong to it, and its mass properties in the assembly's frame.

    ``props`` None draws the parts alone (parts that no link has, or a link without mass).
    """

    name: str
    instances: tuple[Instance, ...]
    props: MassProps | None = None


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """The solid ellipsoid of even density with a link's mass and moments of inertia.

    centre (3,) [m]; axes (3, 3), columns, right-handed; radii (3,) [m]. All in the assembly's frame.
    """

    centre: Floats
    axes: Floats
    radii: Floats

    @property
    def placement(self) -> Floats:
        """Return (4, 4) from the unit sphere to the ellipsoid."""
        result = np.eye(4)
        result[:3, :3] = self.axes * self.radii
        result[:3, 3] = self.centre
        return result


def inertia_ellipsoid(props: MassProps) -> Ellipsoid | None:
    """Return the semi-axes; a body of mass m has I_a = m/5 (b² + c²), so a² = 5/(2m) (I_b + I_c - I_a).

    None without a mass.
    """
    if props.mass <= 0 or not np.isfinite(props.inertia).all():
        return None
    moments, axes = props.principal()
    squares = 5 / (2 * props.mass) * (moments.sum() - 2 * moments)
    return Ellipsoid(props.com, axes, np.sqrt(np.clip(squares, 0.0, None)))


def colour_of(number: int) -> Colour:
    """Return a colour for the n-th link.

    Colour-blind people can distinguish the first eight as well as can be.
    """
    if number < len(_BASE):
        return _BASE[number]
    hue = (number * 0.618033988749895) % 1.0
    return colorsys.hls_to_rgb(hue, 0.45 + 0.15 * (number % 2), 0.5)


def meshes_of(assembly: Assembly, views: Sequence[LinkView]) -> Mapping[str, Mesh]:
    """Return the meshes of the prototypes that are shown, by key."""
    shown = dict.fromkeys(instance.prototype for view in views for instance in view.instances)
    return {
        key: mesh for key in shown if isinstance(mesh := assembly.prototypes[key].mesh, Mesh) and len(mesh)
    }


def views_of(report: InertiaReport, assembly: Assembly) -> list[LinkView]:
    """Return the links of a report, in its order, then what no link has."""
    by_path = {instance.name: instance for instance in assembly.instances}
    views = []
    for link in report.links.values():
        members = tuple(by_path[path] for part in link.parts for path in part.paths if path in by_path)
        props = link.props.transformed(link.frame.placement) if link.props.mass > 0 else None
        views.append(LinkView(link.name, members, props))
    loose = tuple(by_path[path] for part in report.unclaimed for path in part.paths if path in by_path)
    if loose:
        views.append(LinkView("", loose))
    return views


_FLOAT, _UINT = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
_Z_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]
"""glTF has Y up, our assemblies Z: a quarter turn about X."""

MARKER = 0.008
"""Radius of the mark of a centre of mass, in diagonals of the assembly."""


def write_glb(assembly: Assembly, views: Sequence[LinkView]) -> bytes:
    """Return the scene: one node per link, below it its instances, its centre of mass and its ellipsoid."""
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
    """Return the diagonal [m] of the box around everything that is shown."""
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
    return float(np.linalg.norm(np.ptp(np.concatenate(rows), axis=0))) if rows else 1.0


_SOURCE_COLOURS = {
    Source.BOM_MASS: "#2f7d4f",
    Source.MATERIAL: "#3d7ac0",
    Source.TARGET_MASS: "#1b6e8c",
    Source.SUB_ASSEMBLY_MASS: "#7fb7d6",
    Source.STEP_DENSITY: "#8b79c9",
    Source.DEFAULT_DENSITY: "#d9982f",
    Source.ZERO: "#b42318",
}


def report_html(report: InertiaReport, assembly: Assembly) -> str:
    """Return the page, as text."""
    views = views_of(report, assembly)
    shapes = bool(meshes_of(assembly, views))
    glb = base64.b64encode(write_glb(assembly, views)).decode() if shapes else ""
    page = _file("report.html")
    for mark, text in (
        ("/*THREE*/", _file("three.min.js") if shapes else ""),
        ("/*VIEWER*/", _file("report.js")),
        ("/*GLB*/", glb),
        # Last: what a file says must not be searched for marks.
        ("/*DATA*/", _json(_data(report, views, shapes))),
    ):
        head, _, tail = page.partition(mark)
        page = head + text + tail
    return page


@cache
def _file(name: str) -> str:
    return (resources.files("silo.inertia.preview") / "viewer" / name).read_text("utf-8")


def _json(data: Any) -> str:
    """Return JSON that cannot end the element it stands in."""
    return json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _data(report: InertiaReport, views: Sequence[LinkView], shapes: bool) -> dict[str, Any]:
    parts = report.parts()
    return {
        "name": report.assembly or "the assembly",
        "facts": list(_facts(report)),
        "shapes": shapes,
        "views": [
            {
                "name": view.name,
                "colour": _hex(UNCLAIMED if view.props is None and not view.name else colour_of(number)),
                "mass": None if view.props is None else _finite(view.props.mass),
            }
            for number, view in enumerate(views)
        ],
        "sources": _sources([part for _, part in parts]),
        "warnings": _warnings(report),
        "links": [_link(link) for link in report.links.values()],
        "parts": [_part(link, part) for link, part in parts],
    }


def _facts(report: InertiaReport) -> Iterable[str]:
    if report.total is not None:
        yield f"{report.total.mass:.6g} kg"
    yield counted(len(report.links), "link")
    yield counted(sum(part.quantity for _, part in report.parts()), "part")
    yield f"geometry: {report.source or 'unknown'}"
    yield f"BOM: {report.bom or 'none'}"
    if report.unclaimed:
        loose = sum(part.total_mass for part in report.unclaimed)
        yield f"in no link: {loose:.6g} kg"


def _sources(parts: Sequence[PartResult]) -> list[dict[str, Any]]:
    rows = []
    for source in Source:
        of_it = [part for part in parts if part.source is source]
        if of_it:
            rows.append(
                {
                    "name": SOURCE_WORDS[source],
                    "colour": _SOURCE_COLOURS[source],
                    "mass": _finite(sum(part.total_mass for part in of_it)),
                    "pieces": sum(part.quantity for part in of_it),
                }
            )
    return rows


def _warnings(report: InertiaReport) -> list[dict[str, Any]]:
    return [
        {
            "title": cause.code.replace("_", " "),
            "mass": _finite(cause.mass),
            "items": [
                {"where": " / ".join(w for w in (one.link_name, one.part_name) if w), "message": one.message}
                for one in cause.warnings
            ],
        }
        for cause in report.causes()
    ]


def _link(link: LinkResult) -> dict[str, Any]:
    t = link.props.inertia
    size = float(abs(t).max())
    return {
        "name": link.name,
        "mass": _finite(link.props.mass),
        "com": _vector(link.props.com, 1.0),
        "moments": _vector((t[0, 0], t[1, 1], t[2, 2]), size),
        "products": _vector((t[0, 1], t[0, 2], t[1, 2]), size),
        "pieces": sum(part.quantity for part in link.parts),
        "frame": link.frame.description,
        "problems": ", ".join(problem.replace("_", " ") for problem in link.problems),
        "doubt": bool(link.problems),
    }


def _part(link: str, part: PartResult) -> dict[str, Any]:
    return {
        "link": link or "(no link)",
        "name": part.name,
        "number": part.part_number,
        "paths": part.paths,
        "quantity": part.quantity,
        "mass": _finite(part.mass),
        "total": _finite(part.total_mass),
        "volume": _finite(part.volume * 1e6) if part.volume else None,
        "density": None if part.density is None else _finite(part.density),
        "material": material_of(part),
        "source": SOURCE_WORDS[part.source],
        "matched": how(part),
        "warnings": len(part.warnings) or None,
        "doubt": bool(part.warnings),
    }


def _vector(values: Iterable[float], size: float) -> list[float | None]:
    """Round what is noise against ``size`` to 0, as in the other reports."""
    return [0.0 if abs(value) <= NOISE * size else _finite(value) for value in values]


def _finite(value: float) -> float | None:
    """Replace NaN, which JSON lacks; the page shows such a value as not finite."""
    number = float(value)
    return number if math.isfinite(number) else None


def _hex(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in colour)


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
    """Return the mesh with normals; a vertex on an edge becomes several."""
    if not len(mesh):
        return Shaded(mesh.vertices, np.zeros_like(mesh.vertices), mesh.faces)
    place = np.unique(mesh.vertices, axis=0, return_inverse=True)[1].reshape(-1)
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    normals = _smoothed(place[mesh.faces].reshape(-1), np.cross(b - a, c - a))
    points = mesh.vertices[mesh.faces].reshape(-1, 3)
    rows = np.hstack([points.astype(np.float32), np.round(normals, 3).astype(np.float32)])
    unique, index = np.unique(rows, axis=0, return_inverse=True)
    return Shaded(
        unique[:, :3].astype(np.float64), _unit(unique[:, 3:].astype(np.float64)), index.reshape(-1, 3)
    )


def _smoothed(vertex: Indices, areas: Floats) -> Floats:
    """Return (3 m, 3): for each corner the mean normal of the faces at its vertex that look about its own
    way.

    ``vertex`` (3 m,) of each corner, ``areas`` (m, 3) normals as long as the faces are large.
    """
    flat = _unit(areas)
    order = np.argsort(vertex, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(vertex[order]) != 0])
    degrees = np.diff(np.r_[starts, len(order)])
    result = flat[np.arange(len(vertex)) // 3]
    for degree in np.unique(degrees):
        if degree > MAX_DEGREE:
            continue
        corners = order[starts[degrees == degree][:, None] + np.arange(degree)]
        face = corners // 3
        near = np.einsum("nix,njx->nij", flat[face], flat[face]) > CREASE
        mean = np.einsum("nij,njx->nix", near.astype(np.float64), areas[face]).reshape(-1, 3)
        result[corners.reshape(-1)] = _unit(mean)
    return result


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    result: Floats = vectors / np.where(length > 0, length, 1.0)
    return result


def ellipsoid(rings: int = 20, sectors: int = 32) -> Mesh:
    """Return a unit sphere; scaled by three semi-axes it is any ellipsoid."""
    ball = creation.uv_sphere(radius=1.0, count=(rings, sectors))
    return Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
