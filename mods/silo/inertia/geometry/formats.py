# SPDX-License-Identifier: LGPL-2.1-or-later
"""The format of a geometry file: by its content first, and by its suffix if the content says nothing."""

from __future__ import annotations

import re
import zipfile
from enum import StrEnum
from pathlib import Path

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused


class Format(StrEnum):
    """A format we read."""

    STEP = "step"
    BREP = "brep"  # OpenCASCADE's own text or binary shape
    FREECAD = "fcstd"
    STL = "stl"
    OBJ = "obj"
    PLY = "ply"
    GLB = "glb"
    THREEMF = "3mf"
    DAE = "dae"
    URDF = "urdf"
    MJCF = "mjcf"

    @property
    def is_mesh(self) -> bool:
        """Return True if the format has triangles and needs no geometry kernel."""
        return self not in (Format.STEP, Format.BREP, Format.FREECAD, Format.URDF, Format.MJCF)

    @property
    def needs_kernel(self) -> bool:
        """Return True if the geometry kernel reads it."""
        return self in (Format.STEP, Format.BREP, Format.FREECAD)


_SUFFIXES = {f".{kind}": kind for kind in Format} | {
    ".stp": Format.STEP,
    ".p21": Format.STEP,
    ".brp": Format.BREP,
}


_OTHERS = {
    b"<?xml": message(
        "is XML. STEP AP242 XML (.stpx) holds no geometry; export the assembly as STEP text (.step)"
    ),
    b"\x1f\x8b": "is compressed (gzip); unpack it first",
    b"PK": message("is a zip archive, and no FreeCAD document or 3MF file; unpack it first"),
}
"""What is refused with a word of its own, by its first bytes."""

_START = re.compile(rb"<(\w+)")
_XML = {b"COLLADA": Format.DAE, b"robot": Format.URDF, b"mujoco": Format.MJCF}

_HEAD_BYTES = 1024


def detect(path: Path) -> Format:
    """Detect the format of a file.

    Raises DocumentError if the file is missing, empty, a Git LFS pointer, or of no format we read. A file
    whose content contradicts its suffix (an HTML page saved as .step) is refused as well.
    """
    head = _head(path)
    by_suffix = _SUFFIXES.get(path.suffix.lower())
    by_content = _by_content(path, head)
    if by_content is not None:
        return by_content
    if by_suffix in (Format.STL, Format.OBJ):
        # A binary STL begins with 80 free bytes and an OBJ with anything: only the suffix can say it.
        return by_suffix
    for start, words in _OTHERS.items():
        if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(start):
            raise DocumentError(str(path), words)
    if by_suffix is not None:
        raise DocumentError(
            str(path),
            message(
                "is named like a {value} file, but its content is not; export it again", value=by_suffix.value
            ),
        )
    readable = ", ".join(f".{kind}" for kind in Format)
    raise DocumentError(
        str(path), message("has no geometry format that is read here ({readable})", readable=readable)
    )


def _head(path: Path) -> bytes:
    if path.is_dir():
        raise DocumentError(str(path), message("is a folder; name one file"))
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError as error:
        raise DocumentError(
            str(path), message("cannot be opened: {error}", error=why_refused(error))
        ) from error
    if not head.strip():
        raise DocumentError(str(path), message("is empty; export it again"))
    if head.startswith(b"version https://git-lfs"):
        raise DocumentError(
            str(path), message("is a Git LFS pointer, not the file; run `git lfs pull` first")
        )
    return head


def is_binary_brep(path: Path) -> bool:
    """Return True if the shape in a file is stored as binary, False if as text."""
    with path.open("rb") as stream:
        return stream.read(64).lstrip().startswith(b"Open CASCADE Topology")


def _by_content(path: Path, head: bytes) -> Format | None:
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text.startswith(b"ISO-10303-21"):
        return Format.STEP
    if text.startswith((b"DBRep_DrawableShape", b"CASCADE Topology", b"Open CASCADE Topology")):
        return Format.BREP
    if head.startswith(b"glTF"):
        return Format.GLB
    if text.startswith((b"ply\n", b"ply\r")):
        return Format.PLY
    if text.startswith(b"solid") and b"facet" in head:
        return Format.STL
    if head.startswith(b"PK"):
        return _zip_kind(path)
    root = _START.search(text) if text.startswith(b"<") else None
    while root is not None and b"<!--" in text[: root.start()]:  # a comment may hold what looks like a tag
        _, _, text = text.partition(b"-->")
        root = _START.search(text)
    return _XML.get(root[1]) if root is not None else None


def _zip_kind(path: Path) -> Format | None:
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError) as error:
        raise DocumentError(
            str(path), message("is a damaged zip file ({error}); save it again", error=error)
        ) from error
    if "Document.xml" in names:
        return Format.FREECAD
    if any(name.lower().endswith(".model") for name in names):
        return Format.THREEMF
    return None
