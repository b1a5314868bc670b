# SPDX-License-Identifier: LGPL-2.1-or-later
"""A URDF or MJCF file as geometry: each link is a sub-assembly, with the shapes that the file gives it.

* A link weighs what its visual shapes enclose; its collision shapes count only if it has no visual one.
* Meshes are in metres, as the format has it, but for those whose file states a unit; a scale counts.
* A mesh is one product, named as its file: a BOM has rows for links, meshes or both. Boxes, cylinders and
  spheres are products of their own.
* Links stand where the joints put them at position zero, so that their frames are those of the URDF.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from silo.bom.errors import DocumentError, InputError
from silo.bom.message import message
from silo.inertia.assembly import Instance, Prototype
from silo.inertia.geometry.formats import detect
from silo.inertia.geometry.graph import Unfolded, in_metres, unfold
from silo.inertia.geometry.measured import assembled
from silo.inertia.geometry.meshes import mesh_prototype, mesh_scene
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.geometry.reading import GeometryReading
from silo.inertia.geometry.together import Floats, Mesh, joined
from silo.inertia.links.frames import origin_frame
from silo.inertia.mjcf_text import read_text
from silo.inertia.notes import GeometryCode, Note
from silo.inertia.urdf_text import UrdfShape

LEVELS_UP = 6
"""Folders above the URDF in which the package of a mesh is looked for."""


def read_robot(path: Path, options: ReadOptions, report: Report) -> GeometryReading:
    """Read the links of a URDF, or the bodies of an MJCF file, with their shapes. Raises DocumentError."""
    report("reading", 0, 0)
    try:
        urdf = read_text(path)
        if urdf.problem:
            raise InputError(urdf.problem)
    except InputError as error:
        raise DocumentError(str(path), str(error)) from error
    shapes = [(link, number, shape) for link in urdf.names for number, shape in enumerate(urdf.shapes(link))]
    found = _Shapes(path, options)
    unfolded = Unfolded({})
    for done, (link, number, shape) in enumerate(shapes, start=1):
        report("measuring", done, len(shapes))
        prototype = found.prototype(shape)
        place = urdf.frames[link] @ _origin(path, link, shape)
        name = f"{prototype.name} {number + 1}" if number else prototype.name
        unfolded.instances.append(Instance((link, name), (link, prototype.name), prototype.key, place))
        unfolded.frames[(link,)] = urdf.frames[link]
    if not unfolded.instances:
        raise DocumentError(str(path), message("none of its links has a shape that can be measured"))
    assembly = assembled(
        unfolded, found.prototypes, found.problems, name=urdf.robot or path.stem, source=str(path), unit="m"
    )
    return GeometryReading(assembly, tuple(found.files), absent=tuple(found.absent))


def _origin(path: Path, link: str, shape: UrdfShape) -> Floats:
    if shape.place is not None:
        return shape.place
    if len(shape.xyz) != 3 or len(shape.rpy) != 3 or not np.isfinite([*shape.xyz, *shape.rpy]).all():
        reason = message(
            "a shape of the link {link} has no readable origin; wanted three numbers each", link=link
        )
        raise DocumentError(str(path), reason)
    return origin_frame(list(shape.xyz), list(shape.rpy))


@dataclass(eq=False)
class _Shapes:
    """The prototypes of one URDF's shapes, each measured once."""

    path: Path
    options: ReadOptions
    prototypes: dict[str, Prototype] = field(default_factory=dict)
    problems: list[Note] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    absent: list[Path] = field(default_factory=list)

    def prototype(self, shape: UrdfShape) -> Prototype:
        """Measure a shape; one that cannot be read is a product without geometry, with a note."""
        key = " ".join((shape.kind, *(f"{name}={value}" for name, value in sorted(shape.values.items()))))
        if key not in self.prototypes:
            self.prototypes[key] = self._measured(key, shape)
        return self.prototypes[key]

    def _measured(self, key: str, shape: UrdfShape) -> Prototype:
        if shape.kind != "mesh":
            return _primitive(self.path, key, shape)
        named = shape.values.get("filename", "")
        name = shape.values.get("name") or Path(named.replace("\\", "/")).stem or "mesh"
        file = found_mesh(self.path, named)
        if file is None:
            words: str = message(
                "its mesh {named} is not there, beside the URDF or in a package around it", named=named
            )
            self.absent.append(self.path.parent / Path(named).name)
            return Prototype(key, name, has_solid=False, problems=(Note(GeometryCode.NOT_READ, words),))
        try:
            scale = _values(self.path, shape, "scale", 3) if "scale" in shape.values else np.ones(3)
            mesh, notes = self._joined(file)
        except DocumentError as error:
            words = message("its mesh cannot be read: {error}", error=error)
            return Prototype(key, name, has_solid=False, problems=(Note(GeometryCode.NOT_READ, words),))
        self.files.append(file)
        faces = mesh.faces[:, ::-1] if scale.prod() < 0 else mesh.faces
        return mesh_prototype(key, name, Mesh(mesh.vertices * scale, faces), notes)

    def _joined(self, file: Path) -> tuple[Mesh, list[Note]]:
        """Read all placed meshes of a file as one, in m, and what was noticed."""
        scene = mesh_scene(file, detect(file))
        unit = scene.unit_m or 1.0
        unfolded = unfold(scene.nodes, scene.roots, self.options.max_instances)
        parts = []
        for instance in unfolded.instances:
            mesh = scene.meshes[instance.prototype]
            moved = Mesh(mesh.vertices * unit, mesh.faces)
            parts.append(moved.moved(in_metres(instance.transform, unit)))
        return joined(parts), [note for notes in scene.said.values() for note in notes]


def found_mesh(urdf: Path, named: str) -> Path | None:
    """Find the file of a mesh: beside the URDF, or in the package around it; None if it is not there."""
    text = named.replace("\\", "/")
    scheme, _, rest = text.partition("://") if "://" in text else ("", "", text)
    if scheme == "file" or (not scheme and Path(rest).is_absolute()):
        candidates = [Path("/", rest)]
    else:
        inside = rest.partition("/")[2] if scheme in ("package", "model") else rest
        folders = [urdf.parent, *urdf.resolve().parents[:LEVELS_UP]]
        candidates = [folder / part for folder in folders for part in dict.fromkeys((rest, inside)) if part]
    return next((path for path in candidates if path.is_file()), None)


def _values(path: Path, shape: UrdfShape, name: str, count: int) -> Floats:
    text = shape.values.get(name, "")
    try:
        numbers = np.array([float(word) for word in text.split()])
    except ValueError:
        numbers = np.zeros(0)
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise DocumentError(
            str(path),
            message(
                "a {kind} has {name}=“{text}”, wanted {count} numbers",
                kind=shape.kind,
                name=name,
                text=text,
                count=count,
            ),
        )
    return numbers


def _primitive(path: Path, key: str, shape: UrdfShape) -> Prototype:
    """Measure a box, cylinder, sphere or capsule in closed form."""
    if shape.kind == "box":
        x, y, z = _values(path, shape, "size", 3)
        volume = x * y * z
        diagonal = np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 12
        name = message("box {x} × {y} × {z} m", x=f"{x:g}", y=f"{y:g}", z=f"{z:g}")
    elif shape.kind == "ellipsoid":
        x, y, z = _values(path, shape, "size", 3)
        volume = math.pi / 6 * x * y * z
        diagonal = np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 20
        name = message("ellipsoid {x} × {y} × {z} m", x=f"{x:g}", y=f"{y:g}", z=f"{z:g}")
    elif shape.kind == "sphere":
        (r,) = _values(path, shape, "radius", 1)
        volume, diagonal = 4 / 3 * math.pi * r**3, np.full(3, 2 / 5 * r * r)
        name = message("sphere r {r} m", r=f"{r:g}")
    elif shape.kind in ("cylinder", "capsule"):
        (r,), (length,) = _values(path, shape, "radius", 1), _values(path, shape, "length", 1)
        volume = math.pi * r * r * length
        across = (3 * r * r + length * length) / 12
        diagonal = np.array([across, across, r * r / 2])
        name = message("{kind} r {r} × {length} m", kind=shape.kind, r=f"{r:g}", length=f"{length:g}")
        if shape.kind == "capsule":
            ends = 4 / 3 * math.pi * r**3
            beside = 2 / 5 * r * r + length * length / 4 + 3 / 8 * length * r
            diagonal = (volume * diagonal + ends * np.array([beside, beside, 2 / 5 * r * r])) / (
                volume + ends
            )
            volume += ends
    else:
        words = message("a shape of the kind “{kind}” cannot be measured", kind=shape.kind)
        return Prototype(
            key, shape.kind or "shape", has_solid=False, problems=(Note(GeometryCode.NOT_READ, words),)
        )
    return Prototype(key, name, float(volume), np.zeros(3), np.diag(volume * diagonal))
