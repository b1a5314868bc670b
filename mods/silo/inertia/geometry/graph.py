# SPDX-License-Identifier: LGPL-2.1-or-later
"""Products that contain products, and their unfolding into placed instances. Pure; the same for all
formats.

A product is kept once, however often it is used; only :func:`unfold` multiplies. It counts before it does:
a small hostile file can name 2**40 instances.

What all readers share is here as well: names (which are none, which have lost characters), the STEP files
of a folder, what a caller may say about reading and a reader says while it works, and which reader a file
belongs to, by its content first and by its suffix if the content says nothing.
"""

from __future__ import annotations

import os
import re
import unicodedata
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import StrEnum
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.bom.errors import DocumentError, InputError
from silo.inertia.assembly import Assembly, Instance
from silo.inertia.notes import GeometryCode, Note

_GENERIC = re.compile(r"(?:(?:SOLID|COMPOUND|COMPSOLID|SHELL|FACE|WIRE|EDGE|VERTEX)(?:_?\d+)?|=>\[[\d:]*\])?")
_STEP_SUFFIXES = (".step", ".stp", ".p21")
MAX_ENTRIES = 20_000
"""Folder entries looked at; a home directory given by mistake must not be searched through."""


def is_generic(name: str) -> bool:
    """Return True for names that the kernel makes up: ``SOLID``, ``COMPOUND``, ``=>[0:1:1:14]``, or none at
    all.
    """
    return _GENERIC.fullmatch(name.strip()) is not None


def lost_characters(name: str) -> list[Note]:
    """Note "?" and U+FFFD, which exporters write for characters that they lack ("Peça" → "Pe?a")."""
    if "?" not in name and "\ufffd" not in name:
        return []
    words = f"characters of its name were lost in the export: '{name}'"
    return [Note(GeometryCode.NAME, words)]


def clean(name: str) -> str:
    """Remove control characters and outer blanks from a name; the rest stays, even if it is garbled."""
    return "".join(c for c in name if unicodedata.category(c)[0] != "C" or c == "\ufffd").strip()


def file_key(name: str) -> str:
    """Return a name in the form in which products and files are compared: NFC, case folded, without outer
    blanks.
    """
    return unicodedata.normalize("NFC", name).strip().casefold()


def bare_stem(document: str) -> str:
    """Return the bare name in a path from any system. Its folder is never opened."""
    return PurePosixPath(PureWindowsPath(document).name).stem


def step_files(root: Path, depth: int) -> Iterator[Path]:
    """Yield the STEP files in a folder and ``depth`` levels below, in a fixed order, without links that lead
    outside.
    """
    seen = 0
    waiting = [(root, 0)]
    while waiting:
        folder, level = waiting.pop(0)
        try:
            entries = sorted(os.scandir(folder), key=lambda e: e.name)
        except OSError:
            continue
        for item in entries:
            seen += 1
            if seen > MAX_ENTRIES:
                return
            path = Path(item.path)
            if item.is_symlink() and not Path(os.path.realpath(path)).is_relative_to(root):
                continue
            if item.is_dir() and level < depth:
                waiting.append((path, level + 1))
            elif item.is_file() and path.suffix.lower() in _STEP_SUFFIXES:
                yield Path(os.path.realpath(path))


Floats = NDArray[np.float64]
IDENTITY: Floats = np.eye(4)


@dataclass(frozen=True, eq=False)
class Child:
    """One use of a product. ``transform`` (4, 4), lengths in m: product axes → axes of its parent."""

    name: str
    product: str
    transform: Floats = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, eq=False)
class Node:
    """One product. ``has_geometry``: it has shapes of its own, and so a prototype with the same key."""

    key: str
    name: str
    children: tuple[Child, ...] = ()
    has_geometry: bool = False


def in_metres(matrix: Floats, unit: float = 1e-3) -> Floats:
    """Convert the translation of a placement (4, 4) from ``unit`` [m], mm by default, to m."""
    converted = matrix.copy()
    converted[:3, 3] *= unit
    return converted


MAX_DEPTH = 200
"""Levels of sub-assemblies; real ones stay below 15, and Python's own stack ends near 500."""


class Unfolded:
    """The unfolding at work, and its result: ``instances``, and ``frames`` of sub-assemblies by path."""

    def __init__(self, nodes: Mapping[str, Node]) -> None:
        self._nodes = nodes
        self._inside: dict[str, tuple[tuple[str, ...], Floats]] = {}
        self.instances: list[Instance] = []
        self.frames: dict[tuple[str, ...], Floats] = {}

    @property
    def placed(self) -> list[str]:
        """Return the products with geometry that are placed, each once, in order."""
        return list(dict.fromkeys(instance.prototype for instance in self.instances))

    def place(self, key: str, path: tuple[str, ...], products: tuple[str, ...], transform: Floats) -> None:
        """Add one use of a product at ``path``; ``products`` are the names of those around it."""
        node = self._nodes[key]
        products = (*products, node.name)
        if node.children:
            self.frames[path] = transform
            self.fill(key, path, products, transform)
        elif node.has_geometry:
            self.instances.append(Instance(path, products, key, transform))

    def fill(self, key: str, path: tuple[str, ...], products: tuple[str, ...], transform: Floats) -> None:
        """Add the inside of an assembly: its own shapes, then its children."""
        node = self._nodes[key]
        names, stack = self._named(key)
        placed = transform @ stack
        if node.has_geometry:
            own = products or (node.name,)
            self.instances.append(Instance((*path, names[0]), own, key, transform))
            names = names[1:]
        for name, child, matrix in zip(names, node.children, placed, strict=True):
            self.place(child.product, (*path, name), products, matrix)

    def _named(self, key: str) -> tuple[tuple[str, ...], Floats]:
        if key not in self._inside:
            node = self._nodes[key]
            wanted = [node.name] if node.has_geometry else []
            wanted += [child.name for child in node.children]
            stack = np.array([child.transform for child in node.children]).reshape(-1, 4, 4)
            self._inside[key] = (tuple(unique_names(wanted)), stack)
        return self._inside[key]


def unfold(nodes: Mapping[str, Node], roots: Sequence[Child], max_instances: int) -> Unfolded:
    """List all instances below ``roots``.

    A single root that holds others is the top assembly, which is not in the paths. If several uses in one
    parent have the same name, the second is called ``name<2>``, and so on, so that each path is unique.
    Shapes that belong to an assembly itself are among its children, under the assembly's own name.

    Raises InputError for a product that contains itself, for more than ``max_instances`` and for more than
    MAX_DEPTH levels.
    """
    count = 0
    for root in roots:
        order = bottom_up(nodes, root.product)
        if depth(nodes, order) > MAX_DEPTH:
            raise InputError(f"it nests its assemblies more than {MAX_DEPTH} deep")
        count += count_instances(nodes, order)
    if count > max_instances:
        raise InputError(f"it unfolds to {count} placed parts, more than the {max_instances} allowed")
    unfolded = Unfolded(nodes)
    if len(roots) == 1 and nodes[roots[0].product].children:
        unfolded.fill(roots[0].product, (), (), roots[0].transform)
    else:
        for name, root in zip(unique_names([r.name for r in roots]), roots, strict=True):
            unfolded.place(root.product, (name,), (), root.transform)
    return unfolded


def unique_names(wanted: Sequence[str]) -> list[str]:
    """Mark repeated names in order: ``<2>``, ``<3>`` …

    "/" would break a path and becomes "|".
    """
    taken: set[str] = set()
    counts: dict[str, int] = {}
    names = []
    for raw in wanted:
        name = raw.replace("/", "|")
        unique = name
        while unique in taken:
            counts[name] = counts.get(name, 1) + 1
            unique = f"{name}<{counts[name]}>"
        taken.add(unique)
        names.append(unique)
    return names


def count_instances(nodes: Mapping[str, Node], order: Sequence[str]) -> int:
    """Count the placed prototypes to which the last product of a :func:`bottom_up` order unfolds."""
    done: dict[str, int] = {}
    for key in order:
        node = nodes[key]
        done[key] = int(node.has_geometry) + sum(done[child.product] for child in node.children)
    return done[order[-1]]


def depth(nodes: Mapping[str, Node], order: Sequence[str]) -> int:
    """Count the levels of the last product of a :func:`bottom_up` order, itself included."""
    done: dict[str, int] = {}
    for key in order:
        done[key] = 1 + max((done[child.product] for child in nodes[key].children), default=0)
    return done[order[-1]]


def bottom_up(nodes: Mapping[str, Node], root: str) -> list[str]:
    """Order all products below ``root`` and itself by key, each once, children before parents.

    Without recursion: a file may nest deeper than Python's stack. InputError on a cycle.
    """
    order: list[str] = []
    state: dict[str, int] = {}
    stack = [(root, False)]
    while stack:
        key, finished = stack.pop()
        if finished:
            state[key] = 2
            order.append(key)
            continue
        if state.get(key) == 2:
            continue
        if state.get(key) == 1:
            raise InputError(f"the product '{nodes[key].name}' contains itself")
        state[key] = 1
        stack.append((key, True))
        stack.extend((child.product, False) for child in nodes[key].children if state.get(child.product) != 2)
    return order


MESH_UNITS: Mapping[str, float] = {
    "micron": 1e-6,
    "um": 1e-6,
    "mm": 1e-3,
    "millimeter": 1e-3,
    "cm": 1e-2,
    "centimeter": 1e-2,
    "m": 1.0,
    "meter": 1.0,
    "in": 0.0254,
    "inch": 0.0254,
    "ft": 0.3048,
    "foot": 0.3048,
}
"""Length units a caller or a 3MF file may name, in metres."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a reader is. ``total`` is 0 if it cannot be known."""

    stage: str
    done: int = 0
    total: int = 0

    def __str__(self) -> str:
        return f"{self.stage} {self.done}/{self.total}" if self.total else self.stage


@dataclass(frozen=True, eq=False)
class GeometryReading:
    """What a reader found, and what it depended on besides the file's own bytes.

    others
        files that were read as well (split assemblies, linked documents).
    missing
        product names for which no file was found.
    absent
        files that were named and are not there.
    kept
        what the process that read may keep until it ends: freeing it takes long.
    """

    assembly: Assembly
    others: tuple[Path, ...] = ()
    missing: tuple[str, ...] = ()
    absent: tuple[Path, ...] = ()
    kept: object = None


Report = Callable[[str, int, int], None]
"""What readers call: stage, done, total."""


def silent(stage: str, done: int = 0, total: int = 0) -> None:
    """Ignore progress: the report for a caller that wants none."""


_LOCAL = {"isolate", "timeout_s", "memory_mb", "processes", "cache", "cache_dir", "progress", "cancelled"}
"""Options of the machine and the moment, which change nothing of what comes out."""


@dataclass(frozen=True, kw_only=True)
class ReadOptions:
    """How to read one file. Only the first group changes what comes out (and so takes part in the cache key).

    eps
        relative tolerance of the volume integration. The kernel's default integration is off by more than
        1e-3 on one real part in twenty; 1e-8 is what "exact" means here.
    mesh_check
        tessellate every solid and compare volumes; also what the preview draws.
    mesh_unit
        length unit of files that state none (STL, OBJ, PLY): a key of :data:`MESH_UNITS`; None reads mm and
        says so.
    siblings, sibling_depth, max_siblings
        resolve products without geometry from files named after them, in the file's own folder and so many
        folder levels below it, at most so many files.
    max_instances
        a file that expands to more placed parts than this is refused.
    object_name
        FreeCAD documents: the assembly or part to read; None takes the top one.
    hardware
        FreeCAD documents: False leaves standard parts out.
    root
        FreeCAD documents: links leaving this folder are not followed; None: the top file's own rules.

    isolate
        read in a child process, so that a crash of the geometry kernel is an error message.
    timeout_s, memory_mb
        limits of that process; 0 means none.
    processes
        how many may work on one file or split assembly; 0: as many as there are processors. Those beside the
        first are started for large files only, and have ``memory_mb`` together once more.
    cache, cache_dir
        keep what was read, by content, for the next time; None: the user's cache folder.
    progress, cancelled
        called while reading; a True from ``cancelled`` stops at once (CancelledError).
    """

    eps: float = 1e-8
    mesh_check: bool = True
    mesh_unit: str | None = None
    siblings: bool = True
    sibling_depth: int = 2
    max_siblings: int = 200
    max_instances: int = 1_000_000
    object_name: str | None = None
    hardware: bool = True
    root: Path | None = None

    isolate: bool = True
    timeout_s: float = 600.0
    memory_mb: int = 8192
    processes: int = 0
    cache: bool = True
    cache_dir: Path | None = None
    progress: Callable[[Progress], None] | None = None
    cancelled: Callable[[], bool] | None = None

    def content_options(self) -> dict[str, Any]:
        """Return the options that change the result, as plain JSON values."""
        values = {name: value for name, value in vars(self).items() if name not in _LOCAL}
        return {**values, "root": str(self.root) if self.root is not None else None}

    @classmethod
    def from_content(cls, values: Mapping[str, Any]) -> ReadOptions:
        """Make the options from :meth:`content_options`, for the child process: without isolation and
        cache.
        """
        names = {f.name for f in fields(cls)}
        given = {name: value for name, value in values.items() if name in names - _LOCAL}
        if given.get("root") is not None:
            given["root"] = Path(given["root"])
        return cls(**given, isolate=False, cache=False)


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

    @property
    def is_mesh(self) -> bool:
        """Return True if the format has triangles and needs no geometry kernel."""
        return self not in (Format.STEP, Format.BREP, Format.FREECAD)


_SUFFIXES = {f".{kind}": kind for kind in Format} | {
    ".stp": Format.STEP,
    ".p21": Format.STEP,
    ".brp": Format.BREP,
}


def is_model_name(path: Path) -> bool:
    """Return True if a file of this name is taken for geometry, whatever it holds."""
    return path.suffix.lower() in _SUFFIXES


_OTHERS = {
    b"<?xml": "is XML. STEP AP242 XML (.stpx) holds no geometry; export the assembly as STEP text (.step)",
    b"\x1f\x8b": "is compressed (gzip); unpack it first",
    b"PK": "is a zip archive, and no FreeCAD document or 3MF file; unpack it first",
}
"""What is refused with a word of its own, by its first bytes."""

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
            str(path), f"is named like a {by_suffix.value} file, but its content is not; export it again"
        )
    readable = ", ".join(f".{kind}" for kind in Format)
    raise DocumentError(str(path), f"has no geometry format that is read here ({readable})")


def _head(path: Path) -> bytes:
    if path.is_dir():
        raise DocumentError(str(path), "is a folder; name one file")
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError as error:
        raise DocumentError(str(path), f"cannot be opened: {error.strerror or error}") from error
    if not head.strip():
        raise DocumentError(str(path), "is empty; export it again")
    if head.startswith(b"version https://git-lfs"):
        raise DocumentError(str(path), "is a Git LFS pointer, not the file; run `git lfs pull` first")
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
    return None


def _zip_kind(path: Path) -> Format | None:
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError) as error:
        raise DocumentError(str(path), f"is a damaged zip file ({error}); save it again") from error
    if "Document.xml" in names:
        return Format.FREECAD
    if any(name.lower().endswith(".model") for name in names):
        return Format.THREEMF
    return None
