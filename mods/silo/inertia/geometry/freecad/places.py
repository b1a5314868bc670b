# SPDX-License-Identifier: LGPL-2.1-or-later
"""Placements and side entries of objects in an FCStd file, which a BOM does not need and a mass does.

Sources: FreeCAD ``src/App/PropertyGeo.cpp`` (PropertyPlacement, PropertyPlacementList),
``src/Mod/Part/App/PropertyTopoShape.cpp``. Lengths are mm here, as FreeCAD has them.
"""

from __future__ import annotations

import html
import re
import struct
import zipfile
from dataclasses import dataclass
from typing import Any

import numpy as np

from silo.bom.errors import DocumentError
from silo.inertia.geometry.graph import Floats

MAX_ENTRY_BYTES = 1_000_000_000

_PLACEMENT = re.compile(rb"<PropertyPlacement\s([^>]*)>")
_ATTRIBUTE = re.compile(rb"""([A-Za-z0-9]+)\s*=\s*["']([^"']*)["']""")
_FILE = re.compile(rb"""<(?:Part|PlacementList|VectorList)\s[^>]*?file\s*=\s*["']([^"']+)["']""")
_UUID = re.compile(rb"""<PropertyMaterial\s[^>]*?uuid\s*=\s*["']([0-9A-Fa-f-]+)["']""")


@dataclass(frozen=True, slots=True)
class StoredShape:
    """Where a shape is kept: a file, and an entry in it."""

    path: str
    entry: str


def placement(obj: Any, name: str = "Placement") -> Floats:
    """(4, 4) [mm] of an object's own placement; the identity where it has none or one that is no number."""
    found = _PLACEMENT.search(_piece(obj, name))
    matrix = np.eye(4)
    if found is None:
        return matrix
    values = {key.decode(): value for key, value in _ATTRIBUTE.findall(found[1])}
    try:
        point = [float(values[key]) for key in ("Px", "Py", "Pz")]
        turn = [float(values[key]) for key in ("Q0", "Q1", "Q2", "Q3")]
    except (KeyError, ValueError):
        return matrix
    return placed(np.array([*point, *turn]))


def placed(numbers: Floats) -> Floats:
    """(4, 4) from x y z and the quaternion x y z w, as FreeCAD orders it; identity where it is none."""
    x, y, z, w = numbers[3:7]
    norm = x * x + y * y + z * z + w * w
    matrix = np.eye(4)
    if not np.isfinite(numbers).all() or norm < 1e-12:
        return matrix
    s = 2.0 / norm
    matrix[:3, :3] = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    matrix[:3, 3] = numbers[:3]
    return matrix


def list_places(obj: Any, files: Entries) -> list[Floats]:
    """The placements in an object's ``PlacementList``."""
    found = _FILE.search(_piece(obj, "PlacementList"))
    if found is None:
        return []
    data = files.read(obj.Document.FileName, _name(found))
    if len(data) < 4:
        return []
    (count,) = struct.unpack_from("<I", data)
    for form, width in (("<f8", 56), ("<f4", 28)):
        if len(data) == 4 + count * width:
            rows = np.frombuffer(data, dtype=form, offset=4).reshape(-1, 7).astype(np.float64)
            return [placed(row) for row in rows]
    raise DocumentError(
        obj.Document.FileName, f"the placements of {obj.Name} are damaged (their length is wrong)"
    )


def shape_entry(obj: Any) -> str | None:
    """The name of the entry that holds the object's shape, None where it has none."""
    found = _FILE.search(_piece(obj, "Shape"))
    return _name(found) if found is not None else None


def material_uuid(obj: Any) -> str | None:
    """The id of the object's ``ShapeMaterial`` (FreeCAD >= 1.0)."""
    found = _UUID.search(_piece(obj, "ShapeMaterial"))
    return found[1].decode("ascii").lower() if found is not None else None


def _piece(obj: Any, name: str) -> bytes:
    table = getattr(obj, "properties", None)
    if table is None or name not in table.names:
        return b""
    piece: bytes = table.piece(name)
    return piece


def _name(found: re.Match[bytes]) -> str:
    return html.unescape(found[1].decode("utf-8", errors="replace"))


class Entries:
    """Side entries of FCStd files. Files stay open until :meth:`close`."""

    def __init__(self) -> None:
        self._open: dict[str, zipfile.ZipFile] = {}

    def read(self, path: str, name: str) -> bytes:
        """The bytes of one entry. Raises DocumentError."""
        try:
            if path not in self._open:
                self._open[path] = zipfile.ZipFile(path)
            info = self._open[path].getinfo(name)
            if info.file_size > MAX_ENTRY_BYTES:
                raise DocumentError(path, f"its {name} would unpack to {info.file_size / 1e9:.1f} GB")
            return self._open[path].read(info)
        except KeyError as error:
            raise DocumentError(path, f"its {name} is missing") from error
        except (OSError, zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
            raise DocumentError(path, f"its {name} cannot be unpacked: {error}") from error

    def size(self, path: str, name: str) -> int:
        """How many bytes :meth:`read` would return; 0 where it would raise."""
        try:
            if path not in self._open:
                self._open[path] = zipfile.ZipFile(path)
            return self._open[path].getinfo(name).file_size
        except (KeyError, OSError, zipfile.BadZipFile):
            return 0

    def close(self) -> None:
        """Close all files."""
        for archive in self._open.values():
            archive.close()
        self._open.clear()
