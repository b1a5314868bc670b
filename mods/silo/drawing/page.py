# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as one HTML page that needs nothing else: a 3D view, masses by source, warnings, tables.

The page holds three.js and the GLB. It loads nothing from anywhere, and its content security policy says so.

The 3D scene shows links in colours, their centres of mass, their inertia as ellipsoids. As GLB (glTF 2.0
binary) it has every mesh once, instances as nodes, one material per link.
"""

from __future__ import annotations

import base64
import colorsys
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from trimesh import creation

from silo.bom.errors import counted
from silo.drawing import Glb, Shape, shaded
from silo.inertia.assembly import Assembly, Instance
from silo.inertia.codes import Source
from silo.inertia.geometry.together import Floats, Mesh
from silo.inertia.output.words import NOISE, SOURCE_WORDS, how, material_of
from silo.inertia.report import InertiaReport, LinkResult, PartResult
from silo.inertia.rigid import MassProps

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
        """Return the matrix (4, 4) from the unit sphere to the ellipsoid."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.axes * self.radii
        matrix[:3, 3] = self.centre
        return matrix


def inertia_ellipsoid(props: MassProps) -> Ellipsoid | None:
    """Return the ellipsoid with the same inertia: I_a = m/5 (b² + c²), so a² = 5/(2m) (I_b + I_c - I_a).

    Returns None if there is no mass.
    """
    if props.mass <= 0 or not np.isfinite(props.inertia).all():
        return None
    moments, axes = props.principal()
    squares = 5 / (2 * props.mass) * (moments.sum() - 2 * moments)
    return Ellipsoid(props.com, axes, np.sqrt(np.clip(squares, 0.0, None)))


def colour_of(number: int) -> Colour:
    """Return a colour for the n-th link.

    Colour-blind people can distinguish the first eight well.
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
    """Make a view of each link of a report, in its order, and one of the parts without a link."""
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


_Z_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]
"""glTF has Y up, our assemblies Z: a quarter turn about X."""

MARKER = 0.008
"""Radius of the mark of a centre of mass, in diagonals of the assembly."""


def write_glb(assembly: Assembly, views: Sequence[LinkView]) -> bytes:
    """Write the scene: a node for each link, below it its instances, its centre of mass and its ellipsoid."""
    glb = Glb(assembly.name)
    top: list[int] = []
    glb.roots.append(glb.node(name=assembly.name, rotation=_Z_UP, children=top))
    shapes = {key: _shape(glb, mesh) for key, mesh in meshes_of(assembly, views).items()}
    size, ball = scene_size(assembly, views), _shape(glb, ellipsoid())
    for number, view in enumerate(views):
        colour = UNCLAIMED if view.props is None and not view.name else colour_of(number)
        name = view.name or "no link"
        material = glb.material(colour, name=name)
        children = [
            glb.node(
                glb.mesh([(shapes[instance.prototype], material)]), instance.transform, name=instance.name
            )
            for instance in view.instances
            if instance.prototype in shapes
        ]
        more: dict[str, Any] = {}
        if (props := view.props) is not None:
            children += _mass(glb, view, colour, size, ball)
            more["extras"] = {
                "mass_kg": props.mass,
                "com_m": props.com.tolist(),
                "inertia_kg_m2": props.inertia.tolist(),
            }
        if children:
            more["children"] = children
        top.append(glb.node(name=name, **more))
    return glb.packed()


def _mass(glb: Glb, view: LinkView, colour: Colour, size: float, ball: Shape) -> list[int]:
    shape = inertia_ellipsoid(view.props) if view.props is not None else None
    if shape is None:
        return []
    clear = glb.material(colour, 0.35, f"{view.name} inertia")
    dark = glb.material((0.05, 0.05, 0.05), name=f"{view.name} centre of mass")
    mark = np.diag([MARKER * size] * 3 + [1.0])
    mark[:3, 3] = shape.centre
    return [
        glb.node(glb.mesh([(ball, dark)]), mark, name=f"{view.name} centre of mass"),
        glb.node(glb.mesh([(ball, clear)]), shape.placement, name=f"{view.name} inertia ellipsoid"),
    ]


def _shape(glb: Glb, mesh: Mesh) -> Shape:
    body = shaded(mesh)
    return glb.exact(body.vertices, body.normals, body.faces)


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
    """Write the page, as text."""
    views = views_of(report, assembly)
    shapes = bool(meshes_of(assembly, views))
    glb = base64.b64encode(write_glb(assembly, views)).decode() if shapes else ""
    page = _file("drawing/report.html")
    for mark, text in (
        ("/*STYLE*/", _file("viewer/viewer.css")),
        ("/*THREE*/", _file("viewer/three.min.js") if shapes else ""),
        ("/*VIEWER*/", _file("viewer/viewer.js")),
        ("/*REPORT*/", _file("drawing/report.js")),
        ("/*GLB*/", glb),
        # Last: texts of a file must not be searched for marks.
        ("/*DATA*/", _json(_data(report, views, shapes))),
    ):
        head, _, tail = page.partition(mark)
        page = head + text + tail
    return page


@cache
def _file(path: str) -> str:
    return (resources.files("silo") / path).read_text("utf-8")


def _json(data: Any) -> str:
    """Write JSON that cannot end the HTML element around it."""
    return json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _data(report: InertiaReport, views: Sequence[LinkView], shapes: bool) -> dict[str, Any]:
    parts = report.parts()
    return {
        "name": report.assembly or "the assembly",
        "facts": list(_facts(report)),
        "sum": report.reconciliation.sentence if report.reconciliation is not None else "",
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
                {
                    "where": " / ".join(w for w in (warning.link_name, warning.part_name) if w),
                    "message": warning.message,
                }
                for warning in cause.warnings
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
    """Round values to 0 that are noise against ``size``, as the other reports do."""
    return [0.0 if abs(value) <= NOISE * size else _finite(value) for value in values]


def _finite(value: float) -> float | None:
    """Replace NaN, which JSON lacks; the page shows such a value as not finite."""
    number = float(value)
    return number if math.isfinite(number) else None


def _hex(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in colour)


def ellipsoid(rings: int = 20, sectors: int = 32) -> Mesh:
    """Make a unit sphere; scaled by three semi-axes it is any ellipsoid."""
    ball = creation.uv_sphere(radius=1.0, count=(rings, sectors))
    return Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
