# SPDX-License-Identifier: LGPL-2.1-or-later
"""An MJCF file of MuJoCo as a robot: bodies as links, geoms as shapes, with the bodies' places in the text.

* A body's place is that of the file's own position: joints stand at their reference.
* A geom that collides with nothing (``contype`` and ``conaffinity`` 0) is visual, all others are collision
  shapes; geoms of the world have no mass.
* A box or another simple geom that names a mesh is that mesh: MuJoCo fits such a geom to the mesh,
  and its own size counts for nothing.
* Defaults are taken as MuJoCo does: the geom's class, else the nearest ``childclass``, else the main one.
* Included files give defaults, assets and compiler options. What makes other bodies than those in the text
  (bodies in included files, ``replicate``, ``attach``) is refused, and so is writing where MuJoCo would not
  use it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import ClassVar
from xml.parsers import expat

import numpy as np

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.inertia.arrays import Floats
from silo.inertia.urdf_text import LinkSpan, UrdfShape, UrdfText, read_bytes

Attributes = Mapping[str, str]

_COMMENT = re.compile(rb"<!--.*?(?:-->|\Z)", re.DOTALL)
_ROOT = re.compile(rb"<(\w+)")

_MAKING = ("replicate", "attach", "composite", "flexcomp")
"""Elements that make bodies or geoms that the text does not have."""

MOST_INCLUDED = 8
"""Levels of files that include each other."""

_NO_BODY = ("plane", "hfield", "sdf")


def read_text(path: Path | str) -> UrdfText:
    """Read a URDF or MJCF file; InputError if it is absent, far too large, or not readable."""
    data = read_bytes(path)
    return (MjcfText if is_mjcf(data) else UrdfText)(data, str(path))


def is_mjcf(data: bytes) -> bool:
    """Return True if the root element of a robot's file is MuJoCo's."""
    root = _ROOT.search(_COMMENT.sub(b"", data[:65536]))
    return root is not None and root[1] == b"mujoco"


@dataclass(eq=False)
class _Default:
    """A class of defaults: the class around it, and its own attributes of each element."""

    above: str
    values: dict[str, dict[str, str]] = field(default_factory=dict)


@dataclass(eq=False)
class _Geom:
    link: LinkSpan
    place: Floats
    classes: str
    attributes: Attributes


@dataclass(eq=False)
class MjcfText(UrdfText):
    """One MJCF file. It answers what a URDF does; its joints move nothing here."""

    _compiler: dict[str, str] = field(default_factory=dict)
    _defaults: dict[str, _Default] = field(default_factory=dict)
    _meshes: list[dict[str, str]] = field(default_factory=list)
    _assets: dict[str, dict[str, str]] = field(default_factory=dict)
    _bodies: list[tuple[LinkSpan, str]] = field(default_factory=list)
    _around: list[tuple[Floats, str]] = field(default_factory=list)
    _geoms: list[_Geom] = field(default_factory=list)
    _places: dict[str, Floats] = field(default_factory=dict)
    _tops: list[str] = field(default_factory=list)

    kind: ClassVar[str] = "mjcf"

    def __post_init__(self) -> None:
        self._read_settings()
        super().__post_init__()
        for geom in self._geoms:
            shape = self._shape(geom)
            if shape is not None:
                geom.link.shapes.append(shape)

    @property
    def _placements(self) -> dict[str, Floats]:
        return self._places

    @property
    def root(self) -> str:
        """Return the only body that stands in the world; the first of several."""
        return self._tops[0] if self._tops else super().root

    @property
    def fused_base(self) -> tuple[str, ...]:
        """Return nothing: MuJoCo keeps the bodies of its own files."""
        return ()

    @property
    def loose(self) -> frozenset[str]:
        """Return nothing: each body stands in the world."""
        return frozenset()

    @property
    def unused(self) -> str:
        """Say why MuJoCo would not use what is filled in; "" if it does."""
        if self._compiler.get("inertiafromgeom") == "true":
            return message(
                "{file}: by its compiler's inertiafromgeom=“true” MuJoCo ignores each <inertial>; set it "
                "to “auto”, and write again",
                file=self.source,
            )
        if max(_floats(self._compiler.get("settotalmass", "")), default=-1.0) > 0:
            return message(
                "{file}: by its compiler's settotalmass MuJoCo changes all masses; take it out, and "
                "write again",
                file=self.source,
            )
        return ""

    # --- settings, which may stand behind what needs them ------------------------------------------------

    def _read_settings(self) -> None:
        self._settings_of(self.data, self.source, [], 0)
        for attributes in self._meshes:
            own = {**self._default("mesh", attributes.get("class", "")), **attributes}
            name = own.get("name") or PurePosixPath(own.get("file", "").replace("\\", "/")).stem
            self._assets[name] = own
        if self._compiler.get("coordinate") == "global":
            raise InputError(message("{file}: global coordinates are not read", file=self.source))

    def _settings_of(self, data: bytes, source: str, classes: list[str], depth: int) -> None:
        """Take compiler options, defaults and assets from a text and from what it includes.

        classes
            the defaults around it, the innermost one last.
        """
        stack: list[str] = []

        def start(tag: str, attributes: dict[str, str]) -> None:
            stack.append(tag)
            if tag in _MAKING or (depth and tag in ("body", "geom") and "default" not in stack):
                words = message(
                    "{file}: <{tag}> makes bodies that are not in the model's own text; save the whole model "
                    "as one file first (in MuJoCo: mj_saveLastXML)",
                    file=source,
                    tag=tag,
                )
                raise InputError(words)
            if tag == "include":
                self._included(attributes.get("file", ""), source, classes, depth)
            elif tag == "compiler":
                self._compiler.update(attributes)
            elif tag == "default":
                name = attributes.get("class", "main")
                self._defaults.setdefault(name, _Default(classes[-1] if classes else ""))
                classes.append(name)
            elif classes and stack[-2:-1] in (["default"], ["mujocoinclude"]):
                self._defaults[classes[-1]].values.setdefault(tag, {}).update(attributes)
            elif tag == "mesh":
                self._meshes.append(attributes)

        def end(tag: str) -> None:
            stack.pop()
            if tag == "default":
                classes.pop()

        parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = start
        parser.EndElementHandler = end
        try:
            parser.Parse(data, True)
        except expat.ExpatError as error:
            raise InputError(f"{source}: this is not valid XML ({error})") from error

    def _included(self, file: str, by: str, classes: list[str], depth: int) -> None:
        path = Path(self.source).parent / file
        if depth >= MOST_INCLUDED:
            raise InputError(message("{file}: its includes nest without end", file=by))
        self._settings_of(read_bytes(path), str(path), list(classes), depth + 1)

    def _default(self, tag: str, name: str) -> dict[str, str]:
        """Return an element's attributes in a class: those of the classes around it, then its own."""
        found = self._defaults.get(name or "main")
        if found is None:
            return {}
        around = self._default(tag, found.above) if found.above else {}
        return {**around, **found.values.get(tag, {})}

    # --- bodies and geoms -----------------------------------------------------------------------------------

    def _start(self, parser: expat.XMLParserType, tag: str, attributes: dict[str, str]) -> None:
        here = parser.CurrentByteIndex
        if not self._stack:
            self.robot = attributes.get("model", "")
        above = self._stack[-1] if self._stack else ""
        in_world = "worldbody" in self._stack
        if self._bodies and above == "body":
            link = self._bodies[-1][0]
            link.first_child = link.first_child or here
            if tag == "inertial":
                self._inertial_at = here
                link.stated = _stated(attributes)
        if tag == "worldbody":
            self._around.append((np.eye(4), ""))
        elif in_world and tag in ("body", "frame"):
            place, classes = self._around[-1]
            place = place @ self._pose(attributes)
            self._around.append((place, attributes.get("childclass", classes)))
            if tag == "body":
                end, closed = self._tag_end(here)
                name = attributes.get("name") or f"body_{len(self._places) + 1}"
                if not self._bodies:
                    self._tops.append(name)
                self._bodies.append((LinkSpan(name, here, end, closed), name))
                self._places[name] = place
        elif in_world and tag == "geom" and self._bodies:
            link, name = self._bodies[-1]
            within: Floats = np.linalg.inv(self._places[name]) @ self._around[-1][0]
            self._geoms.append(_Geom(link, within, self._around[-1][1], attributes))
        self._stack.append(tag)

    def _end(self, parser: expat.XMLParserType, tag: str) -> None:
        here = parser.CurrentByteIndex
        self._stack.pop()
        above = self._stack[-1] if self._stack else ""
        if tag == "inertial" and above == "body" and self._bodies:
            link = self._bodies[-1][0]
            first, closed = self._tag_end(self._inertial_at)
            link.inertial = (self._inertial_at, first if closed else self._tag_end(here)[0])
            link.inertials += 1
        elif tag == "body" and self._bodies:
            link, _ = self._bodies.pop()
            link.end = here
            self._links.append(link)
        if tag in ("worldbody", "body", "frame") and self._around:
            self._around.pop()

    def _shape(self, geom: _Geom) -> UrdfShape | None:
        """Return a geom as a shape; None for what has no volume."""
        usual = self._default("geom", geom.attributes.get("class", geom.classes))
        own = {**usual, **geom.attributes}
        kind = own.get("type", "sphere")
        if kind in _NO_BODY:
            return None
        kind = "mesh" if "mesh" in own else kind
        place = geom.place @ self._pose(own)
        collides = any(own.get(key, "1") != "0" for key in ("contype", "conaffinity"))
        shape = UrdfShape(collides, kind=kind, place=place)
        if kind == "mesh":
            asset = self._assets.get(own.get("mesh", ""), {})
            shape.values, shape.place = self._mesh(own.get("mesh", ""), asset, place)
            return shape
        size = _floats(own.get("size", ""))
        if "fromto" in own and len(ends := _floats(own["fromto"])) == 6:
            start, end = np.array(ends[:3]), np.array(ends[3:])
            along = end - start
            # Across it is as wide as the first size says, in both directions, whatever the others say.
            size = [*size[:1] * (2 if kind in ("box", "ellipsoid") else 1), float(np.linalg.norm(along)) / 2]
            shape.place = geom.place @ _matrix((start + end) / 2, _turn_of_z(along))
        double = [repr(2 * value) for value in size]
        if kind == "sphere" and size:
            shape.values = {"radius": repr(size[0])}
        elif kind in ("cylinder", "capsule") and len(size) >= 2:
            shape.values = {"radius": repr(size[0]), "length": double[1]}
        elif kind in ("box", "ellipsoid") and len(size) >= 3:
            shape.values = {"size": " ".join(double[:3])}
        return shape

    def _mesh(self, name: str, asset: Attributes, place: Floats) -> tuple[dict[str, str], Floats]:
        file = asset.get("file", "")
        folder = self._compiler.get("meshdir", self._compiler.get("assetdir", ""))
        if not file:
            # Its name is what a message shows: vertices in the text, or no such asset.
            return {"filename": f"{name or 'mesh'}"}, place
        if self._compiler.get("strippath") == "true":
            file = PurePosixPath(file.replace("\\", "/")).name
        values = {"filename": str(PurePosixPath(folder) / file), "name": name}
        scale = _floats(asset.get("scale", ""))
        if len(scale) == 3:
            values["scale"] = asset["scale"]
        refpos, refquat = _floats(asset.get("refpos", "0 0 0")), _floats(asset.get("refquat", "1 0 0 0"))
        if any(refpos) or refquat != [1, 0, 0, 0]:
            factors = scale if len(scale) == 3 else [1.0, 1.0, 1.0]
            if len({abs(factor) for factor in factors}) > 1 or min(factors) < 0 or len(refpos) != 3:
                words = "{file}: the mesh {name} has refpos or refquat and a scale that is not even"
                raise InputError(message(words, file=self.source, name=name))
            reference = _matrix(np.array(refpos) * factors[0], _of_quaternion(refquat))
            place = place @ np.linalg.inv(reference)
        return values, place

    def _pose(self, attributes: Attributes) -> Floats:
        """Return the placement (4, 4) that an element gives itself."""
        unit = 1.0 if self._compiler.get("angle") == "radian" else math.pi / 180
        place = _floats(attributes.get("pos", "0 0 0"))
        turn: Floats = np.eye(3)
        if "quat" in attributes:
            turn = _of_quaternion(_floats(attributes["quat"]))
        elif "axisangle" in attributes and len(given := _floats(attributes["axisangle"])) == 4:
            turn = _about(given[:3], given[3] * unit)
        elif "euler" in attributes:
            angles = _floats(attributes["euler"])
            for letter, angle in zip(self._compiler.get("eulerseq", "xyz"), angles, strict=False):
                step = _about(np.eye(3)["xyz".index(letter.lower())], angle * unit)
                turn = turn @ step if letter.islower() else step @ turn
        elif "xyaxes" in attributes and len(given := _floats(attributes["xyaxes"])) == 6:
            x = np.array(given[:3]) / np.linalg.norm(given[:3])
            y = np.array(given[3:]) - np.dot(given[3:], x) * x
            y /= np.linalg.norm(y)
            turn = np.column_stack([x, y, np.cross(x, y)])
        elif "zaxis" in attributes:
            turn = _turn_of_z(np.array(_floats(attributes["zaxis"])))
        matrix = _matrix(np.array(place), turn) if len(place) == 3 else np.full((4, 4), np.nan)
        if not np.isfinite(matrix).all():
            words = message("{file}: a position or a turn in it is no number", file=self.source)
            raise InputError(words)
        return matrix


def _stated(attributes: Attributes) -> dict[str, dict[str, str]]:
    full = attributes.get("fullinertia", "").split()
    diagonal = attributes.get("diaginertia", "").split()
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    return {
        "mass": {"value": attributes.get("mass", "")},
        "inertia": dict(zip(names, full or diagonal, strict=False)),
    }


def _floats(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return [math.nan]


def _matrix(place: Floats, turn: Floats) -> Floats:
    matrix: Floats = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, place
    return matrix


def _of_quaternion(values: Sequence[float]) -> Floats:
    """Return (3, 3) of a quaternion w, x, y, z of any length."""
    if len(values) != 4 or not np.isfinite(values).all() or not np.linalg.norm(values):
        return np.full((3, 3), np.nan)
    w, x, y, z = (np.array(values) / np.linalg.norm(values)).tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _about(axis: Sequence[float] | Floats, angle: float) -> Floats:
    length = float(np.linalg.norm(axis))
    if not length > 0:
        return np.full((3, 3), np.nan)
    half = math.sin(angle / 2) / length
    return _of_quaternion([math.cos(angle / 2), *(float(value) * half for value in axis)])


def _turn_of_z(along: Floats) -> Floats:
    """Return the smallest turn (3, 3) that brings z onto ``along``."""
    length = float(np.linalg.norm(along))
    if not length > 0:
        return np.eye(3)
    x, y, z = (along / length).tolist()
    if math.hypot(x, y) < 1e-12:
        return np.eye(3) if z > 0 else np.diag([1.0, -1.0, -1.0])
    return _about([-y, x, 0.0], math.atan2(math.hypot(x, y), z))
