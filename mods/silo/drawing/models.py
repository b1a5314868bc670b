# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is drawn of a FreeCAD file: its geometry as GLB, and its structure (decision 24).

The walk of masses says what there is and where it stands; it stops at the file's border here, and names what
lies beyond. A kernel gives the triangles of each face: the geometry kernel in a child process, or FreeCAD's.
Each product keeps its colours, is simplified by error, and quantised. The structure states mass, material,
size and description of what can be an item.

Colours lie in ``GuiDocument.xml``, which only a FreeCAD with windows writes: ``DiffuseColor`` up to 0.21,
``ShapeAppearance`` since 1.0, a list with one entry for all faces or one for each; a link may put its own
material over its target. Sources: FreeCAD ``src/App/PropertyStandard.cpp``, ``src/Gui/ViewProviderLink.cpp``.
"""

from __future__ import annotations

import gzip
import html
import json
import os
import re
import struct
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Protocol

import numpy as np

from silo.api.wire import ModelProduct, Stated, Structure, Use
from silo.bom.errors import CancelledError, ConfigError, DocumentError, InputError, SiloError, counted
from silo.bom.key import Key
from silo.bom.message import message
from silo.bom.text import with_allowed_characters
from silo.bom.walk.arrays import elements
from silo.bom.walk.contents import Contents, Contribution, Lost
from silo.bom.walk.document import derived, label_of, object_name, own
from silo.bom.walk.identity import identity_of
from silo.bom.walk.kinds import Kind, is_container
from silo.bom.walk.roots import choose_assembly, find_assemblies
from silo.bom.walk.standard import standard_uuid
from silo.bom.walk.survey import survey_of
from silo.checksums import content_hash
from silo.drawing import Glb, cube, shaded
from silo.fcstd import Library
from silo.fcstd.linked import recorded_paths
from silo.inertia.assembly import SolidProps
from silo.inertia.digits import rounded
from silo.inertia.geometry.child import python, run
from silo.inertia.geometry.fcstd import Entries, StoredFacts, Unpacked, located
from silo.inertia.geometry.freecad import NOTHING, Leaf, ShapeRef, ShapeSource, StatedMaterial, Walk, file_of
from silo.inertia.geometry.graph import in_metres
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.options import Progress, ReadOptions
from silo.inertia.geometry.together import Box, Floats, Mesh, about_enclosed, combined, joined, welded
from silo.inertia.geometry.worker import main as read_main
from silo.inertia.geometry.worker import say
from silo.inertia.notes import DOUBTFUL
from silo.inertia.placements import is_rigid
from silo.locator import FoundFile, Locator
from silo.platform.whole_files import remove_patiently, scratch_folder

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.transport import Cancel

Rgba = tuple[float, float, float, float]
Stored = tuple[Path, str, Floats]
"""A shape: where it lies, what messages call it, and (4, 4) [mm] to its product."""

LINEAR, ANGULAR, LEAST = 0.002, 0.5, 0.5
"""Of triangles: the distance to the surface in diagonals of the shape, the angle between two [rad], the least
length of an edge that is divided, in such distances: the lead of a chip is no fine cylinder."""
LOST = 0.001
"""What simplifying may move, in diagonals of the file; and of one product at most :data:`LOST_OF_IT`."""
LOST_OF_IT = 0.05
ENOUGH, MOST_LOST = 20_000, 4
"""Triangles of a product above which it loses more, and how often :data:`LOST` at most, as long as no more
than :data:`LOST_VOLUME` of its volume goes."""
LOST_VOLUME = 0.05
GREY: Rgba = (0.8, 0.8, 0.8, 1.0)
EPS = 1e-6
WEIGHED = 4 << 20
"""Bytes: what is larger is weighed by ``silo-mod inertia`` only, since it takes minutes."""
MAX_GUI = 64 << 20
MAX_PRODUCTS = 20_000
_DRAWN = frozenset({Kind.CONTAINER, Kind.LOCAL, Kind.STANDARD, Kind.FOREIGN, Kind.LINK_GROUP})


class Drawer(Protocol):
    """Who makes triangles of a stored shape."""

    def faces(self, path: Path, named: str, place: Floats) -> Sequence[Mesh | None]:
        """Make the triangles [m] of each face; None for a face that has none. Raises DocumentError."""
        ...

    def simplified(self, mesh: Mesh, error: float, keep_border: bool) -> Mesh:
        """Make a mesh with fewer triangles, which are off by at most ``error`` [m]."""
        ...

    def measured(self, shapes: Sequence[Stored], weigh: bool) -> tuple[Box, Measured | None]:
        """Return the corners [mm] of the box around shapes, and the solids to weigh. Raises DocumentError."""
        ...


def draw(path: Path, drawer: Drawer) -> tuple[bytes, Structure]:
    """Draw a FreeCAD file: return its geometry (GLB) and its structure. Raises DocumentError."""
    entries, looks = Entries(), Looks()
    try:
        with Library() as library, scratch_folder("silo-drawn-") as folder:
            document = library.open(path)
            walk = FileWalk(StoredFacts(entries), hardware=True, file=document.FileName, looks=looks)
            roots = walk.all(document)
            unpacked = Unpacked(entries, Path(folder))
            pictures = {key: _picture(walk, key, leaf, drawer, unpacked) for key, leaf in walk.leaves.items()}
            for key, (obj, bodies) in walk.parts.items():
                if key in roots[:1] or identity_of(obj):
                    about = own(obj, "Label2") or (key in roots[:1] and document.Comment) or ""
                    facts = _stated(walk.facts, obj, bodies, drawer, unpacked)
                    facts["description"] = with_allowed_characters(str(about)).strip()[:1000] or None
                    walk.products[key].stated = Stated(**facts) if any(facts.values()) else None
    finally:
        entries.close()
    for key, picture in pictures.items():
        walk.products[key].shape = bool(picture.groups)
    return _glb(pictures, drawer), Structure(roots=roots, products=walk.products)


# --- what there is, and where ---


@dataclass(eq=False)
class FileWalk(Walk):
    """The products of one file. A key is the name of an object in it."""

    file: str = ""
    looks: Looks = field(default_factory=lambda: Looks())
    products: dict[str, ModelProduct] = field(default_factory=dict)
    parts: dict[str, tuple[Any, list[tuple[Any, Floats]]]] = field(default_factory=dict)
    """Each product's object, and its bodies if it is one part."""
    _hops: dict[str, str] | None = None

    def all(self, document: Any) -> list[str]:
        """Read the whole document; returns the key of the whole, and the keys of what else it holds."""
        try:
            top = choose_assembly(document)
            if getattr(top, "is_document_root", False) and (contents := self._reader.contents(top)).is_part:
                top = contents.own[0].target
            roots = [self.product(top)]
        except InputError:  # several assemblies
            roots = [self.product(assembly) for assembly in find_assemblies(document)]
        survey = survey_of(document)
        inner = survey.grouped(_DRAWN)
        for obj, _ in survey.of(_DRAWN):
            name = object_name(obj)
            if name not in self.products and name not in inner and len(self.products) < MAX_PRODUCTS:
                roots.append(self.product(obj))
        return list(dict.fromkeys(roots))

    def _key(self, obj: Any, copies: Any = None) -> str:
        flexible = copies is not None and copies is not obj
        return f"{object_name(obj)}@{object_name(copies)}" if flexible else object_name(obj)

    def _is_known(self, key: str) -> bool:
        return key in self.products

    def _made(self, key: str, obj: Any, uses: Iterable[Use] = ()) -> None:
        self.products[key] = ModelProduct(
            label=with_allowed_characters(label_of(obj))[:1000], uuid=self._uuid(obj), uses=list(uses)
        )

    def _uuid(self, obj: Any) -> str:
        if isinstance(obj, Lost) or getattr(obj, "is_document_root", False):
            return ""
        standard, registered = self._reader.standard(obj)
        return ((standard_uuid(standard) if standard and not registered else identity_of(obj)) or "")[:64]

    def _container(self, key: str, obj: Any, contents: Contents, moved: dict[str, Floats]) -> None:
        bodies = [use for count in contents.own for use in self._uses(obj, count, contents, moved)]
        # A piece of several bodies is one occurrence. A lone body stays a product: others may link to it.
        if not contents.counts and not contents.is_assembly(obj) and all(map(_is_body, bodies)):
            shapes = [(end, place) for end, _, place in bodies]
            if len(bodies) > 1:
                self._leaf(key, obj, shapes)
                return
            self.parts[key] = obj, shapes
        else:
            self.parts[key] = obj, []
        uses: list[Use] = []
        for count in (*contents.own, *contents.counts):
            shown = list(self._uses(obj, count, contents, moved))
            colours = self._colours(count.shown, count.key, len(shown))
            name = object_name(count.shown.obj)
            for number, (end, copies, place) in enumerate(shown):
                file, target = self._target(end, copies)
                uses.append(
                    Use(
                        member=f"{name}.{number}" if len(shown) > 1 else name,
                        file=file,
                        target=target,
                        uuid=self._uuid(end),
                        matrix=in_metres(place).ravel().tolist(),
                        color=colours[number],
                    )
                )
        self._made(key, obj, uses)

    def _target(self, end: Any, copies: Any) -> tuple[str, str]:
        if isinstance(end, Lost):
            return self._way_to(end.file), end.name
        flexible = copies is not None and copies is not end
        if file_of(end) == file_of_path(self.file) or flexible:
            return "", self.product(end, copies)
        return self._way_to(file_of(end)), object_name(end)

    def _way_to(self, file: str) -> str:
        """Return the path of a file as the links record it; paths over several files are joined with
        ``|``.
        """
        if self._hops is None:
            self._hops = _hops(self.file, self.documents)
        return self._hops.get(os.path.realpath(file), file)[-1000:]

    def _leaf(self, key: str, obj: Any, shapes: Sequence[tuple[Any, Floats]]) -> None:
        leaves = [(self.facts.shape(shape), transform, shape) for shape, transform in shapes]
        refs = [ShapeRef((handle, shape), place) for handle, place, shape in leaves if handle is not None]
        self.parts[key] = obj, list(shapes)
        self.leaves[key] = Leaf(tuple(refs), broken="" if refs else self._why(obj))
        self._made(key, obj)

    def _why(self, obj: Any) -> str:
        is_mesh = derived(obj, "Mesh::Feature")
        return (
            message("it is a mesh, which no BOM counts")
            if is_mesh
            else message("it has no shape in its file")
        )

    def _nothing(self, obj: Any, reason: str, name: str = "") -> str:
        key = self._key(obj)
        self.products.setdefault(key, ModelProduct(label=with_allowed_characters(name or key)[:1000]))
        return key

    def _colours(self, node: Contribution, key: Key, count: int) -> list[list[float] | None]:
        """Return the colour that links give each instance; the outermost link counts."""
        obj = node.obj
        here = [self.looks.override(obj)] * count
        each = elements(obj) if node.kind is Kind.LINK else []
        if not any(here) and len(each) == count:
            here = [self.looks.override(element) for element in each]
        elif not any(here) and count > 1:
            here = [*self.looks.overrides(obj), *here][:count]
        if None in here:
            steps = [step.obj for step in self._reader.resolve(obj).way[1:]] if node.kind is Kind.LINK else []
            below = next((inner.obj for inner, _ in node.shown_objects if key in inner.brings), None)
            under = next(filter(None, map(self.looks.override, [*steps, *([below] if below else [])])), None)
            here = [colour or under for colour in here]
        return [list(colour) if colour else None for colour in here]


def _is_body(body: tuple[Any, Any, Floats]) -> bool:
    """Return True if a use can be one of the shapes of the product around it."""
    end, _, place = body
    return not isinstance(end, Lost) and not is_container(end) and is_rigid(place)


def file_of_path(path: str) -> str:
    """Return a path in the form of :func:`file_of`."""
    return path.replace("\\", "/")


def _hops(file: str, documents: Iterable[str]) -> dict[str, str]:
    """Map each real path to the way on which the links lead there from ``file``."""
    hops: dict[str, str] = {}
    waiting = [(file, "")]
    wanted = {os.path.realpath(document) for document in documents}
    while waiting:
        path, way = waiting.pop(0)
        for recorded in recorded_paths(path):
            target = Locator().find(recorded, (os.path.dirname(path),))
            if not isinstance(target, FoundFile):
                hops.setdefault(
                    os.path.realpath(os.path.join(os.path.dirname(path), recorded)), way + recorded
                )
            elif (real := os.path.realpath(target.real)) not in hops:
                hops[real] = way + recorded
                if real in wanted:
                    waiting.append((real, f"{way}{recorded}|"))
    return hops


# --- colours ---

_VIEW = re.compile(rb'<ViewProvider\s+name="([^"]*)".*?</ViewProvider>', re.DOTALL)
_PROPERTY = re.compile(rb'<Property\s+name="(\w+)".*?</Property>', re.DOTALL)
_SIDE = re.compile(rb'file="([^"]+)"')
_VALUE = re.compile(rb'value="([^"]*)"')
_MATERIAL = re.compile(rb'diffuseColor="(\d+)"[^>]*?transparency="([0-9.eE+-]+)"')


class Looks:
    """How objects look, by what is saved with their files; nothing for a file without it."""

    def __init__(self) -> None:
        self._files: dict[str, Mapping[str, Mapping[str, bytes]]] = {}

    def of_faces(self, obj: Any, count: int) -> list[Rgba]:
        """Return the colour of each face of an object's shape."""
        tip = own(obj, "Tip") if derived(obj, "PartDesign::Body") else None
        for member in (tip, obj):
            if member is not None and (colours := self._listed(member)):
                return colours if len(colours) == count else [colours[0]] * count
        return [GREY] * count

    def override(self, link: Any) -> Rgba | None:
        """Return the colour with which a link covers all that it shows; None if it does not."""
        view = self._view(link)
        flag = _VALUE.search(view.get("OverrideMaterial", b""))
        match = _MATERIAL.search(view.get("ShapeMaterial", b"")) if flag and flag[1] == b"true" else None
        return _unpacked(int(match[1]), float(match[2])) if match else None

    def overrides(self, link: Any) -> list[Rgba | None]:
        """Return the colours with which a link array covers its elements."""
        view = self._view(link)
        flags = _VALUE.search(view.get("OverrideMaterialList", b""))
        colours = _materials(self._side(link, view.get("MaterialList", b"")))
        listed = [char == ord("1") for char in reversed(flags[1])] if flags else []
        return [colour if on else None for on, colour in zip(listed, colours, strict=False)]

    def _listed(self, obj: Any) -> list[Rgba]:
        view = self._view(obj)
        if colours := _materials(self._side(obj, view.get("ShapeAppearance", b""))):
            return colours
        percent = _VALUE.search(view.get("Transparency", b""))
        clear = min(max(float(percent[1]), 0.0), 100.0) / 100 if percent else 0.0
        data = self._side(obj, view.get("DiffuseColor", b""))
        if len(data) >= 8 and len(data) == 4 + 4 * struct.unpack_from("<I", data)[0]:
            packed = struct.unpack_from(f"<{len(data) // 4 - 1}I", data, 4)
            # Up to 0.21 the last byte is transparency.
            return [_unpacked(rgba, max(clear, (rgba & 255) / 255)) for rgba in packed]
        plain = _VALUE.search(view.get("ShapeColor", b""))
        return [_unpacked(int(plain[1]), clear)] if plain and plain[1].isdigit() else []

    def _view(self, obj: Any) -> Mapping[str, bytes]:
        path = file_of(obj)
        if path not in self._files:
            self._files[path] = _views(path)
        return self._files[path].get(object_name(obj), {})

    def _side(self, obj: Any, piece: bytes) -> bytes:
        match = _SIDE.search(piece)
        return _entry(file_of(obj), html.unescape(match[1].decode("utf-8", "replace"))) if match else b""


def _unpacked(packed: int, clear: float) -> Rgba:
    red, green, blue = ((packed >> shift & 255) / 255 for shift in (24, 16, 8))
    return red, green, blue, 1 - min(max(clear, 0.0), 1.0)


def _materials(data: bytes) -> list[Rgba]:
    """Read the diffuse colours of a ``PropertyMaterialList``: 24 bytes each, then texts."""
    count = struct.unpack_from("<I", data)[0] if len(data) >= 4 else 0
    if len(data) < 4 + 24 * count:
        return []
    rows = (struct.unpack_from("<4I2f", data, 4 + 24 * n) for n in range(count))
    return [_unpacked(row[1], row[5] if np.isfinite(row[5]) else 0.0) for row in rows]


def _views(path: str) -> dict[str, Mapping[str, bytes]]:
    text = _entry(path, "GuiDocument.xml")
    return {
        html.unescape(view[1].decode("utf-8", "replace")): {
            match[1].decode(): match[0] for match in _PROPERTY.finditer(view[0])
        }
        for view in _VIEW.finditer(text)
    }


def _entry(path: str, name: str) -> bytes:
    try:
        with zipfile.ZipFile(path) as archive:
            info = archive.getinfo(name)
            return archive.read(info) if info.file_size <= MAX_GUI else b""
    except (OSError, KeyError, zipfile.BadZipFile, NotImplementedError, RuntimeError, ValueError):
        return b""


# --- pictures ---


@dataclass(frozen=True, eq=False)
class Picture:
    """The triangles of a product by colour, and what could not be drawn."""

    groups: Mapping[Rgba, Mesh]
    missing: str = ""


def _picture(walk: FileWalk, key: str, leaf: Leaf, drawer: Drawer, unpacked: Unpacked) -> Picture:
    groups: dict[Rgba, list[Mesh]] = {}
    lost, problems = 0, [leaf.broken] if leaf.broken else []
    for ref in leaf.shapes:
        handle, obj = ref.handle
        try:
            (file,) = unpacked.files(Leaf((ShapeRef(handle, ref.transform),)))
            faces = drawer.faces(file.path, file.named, file.transform)
            remove_patiently(file.path)
        except DocumentError as error:
            problems.append(error.reason)
            continue
        for mesh, colour in zip(faces, walk.looks.of_faces(obj, len(faces)), strict=True):
            if mesh is None or not len(mesh):
                lost += 1
            else:
                groups.setdefault(colour, []).append(mesh)
    if lost:
        problems.append(message("{lost} could not be drawn", lost=counted(lost, "face")))
    whole = {colour: joined(meshes) for colour, meshes in groups.items()}
    return Picture(
        {colour: welded(surface.vertices, surface.faces) for colour, surface in whole.items()},
        "; ".join(problems),
    )


def _stated(
    facts: ShapeSource, obj: Any, bodies: Sequence[tuple[Any, Floats]], drawer: Drawer, unpacked: Unpacked
) -> dict[str, Any]:
    """Measure material, size and mass of a part; no mass if a density is missing or the geometry is in
    doubt.
    """
    mine = facts.material(obj)
    by_material: dict[StatedMaterial, list[ShapeRef]] = {}
    for body, place in bodies:
        if (handle := facts.shape(body)) is not None:
            of = mine if mine != NOTHING else facts.material(body)
            by_material.setdefault(of, []).append(ShapeRef(handle, place))
    names = sorted({value.name for value in by_material if value.name})
    stated: dict[str, Any] = {"material": with_allowed_characters(", ".join(names))[:200] or None}
    weigh = all(value.density for value in by_material) and sum(map(len, by_material.values())) == len(bodies)
    solids, masses, corners = list[SolidProps](), list[float](), list[Floats]()
    for material, refs in by_material.items():
        files = unpacked.files(Leaf(tuple(refs)))
        weigh = weigh and sum(value.path.stat().st_size for value in files) <= WEIGHED
        try:
            box, measured = drawer.measured(
                [(value.path, value.named, value.transform) for value in files], weigh
            )
        except DocumentError:
            return stated
        finally:
            for value in files:
                remove_patiently(value.path)
        corners += box
        weigh = measured is not None and not any(note.code in DOUBTFUL for note in measured.problems)
        if measured is not None and weigh:
            solids.append(combined(measured.solids))
            masses.append((material.density or 0.0) * solids[-1].volume_m3)
    if corners:
        extents = np.max(corners, axis=0) - np.min(corners, axis=0)
        stated["size_m"] = [round(float(value) * 1e-3, 7) for value in extents]
    if weigh and sum(masses) > 0:
        middle = np.average([value.com_m for value in solids], axis=0, weights=masses)
        stated["mass_kg"], stated["volume_m3"] = rounded(sum(masses)), rounded(combined(solids).volume_m3)
        stated["com_m"] = [rounded(float(value)) for value in middle]
    return stated


def _glb(pictures: Mapping[str, Picture], drawer: Drawer) -> bytes:
    """Write all products as one file. The largest product limits the error of all, so the box of the file is
    not needed.
    """
    boxes = {key: joined(list(image.groups.values())) for key, image in pictures.items() if image.groups}
    sizes = {key: float(np.linalg.norm(image.extents)) for key, image in boxes.items()}
    most = LOST * max(sizes.values(), default=0.0)
    glb = Glb()
    for key, picture in pictures.items():
        extras = {"key": key, **({"missing": picture.missing} if picture.missing else {})}
        if key not in boxes:
            glb.roots.append(glb.node(extras=extras))
            continue
        low, size, matrix = cube(boxes[key].vertices)
        error, count = min(most, LOST_OF_IT * sizes[key]), ENOUGH + 1
        end, before, few = MOST_LOST * error, 0, dict[Rgba, Mesh]()
        volume = about_enclosed(boxes[key])
        while ENOUGH < count != before and error <= end:
            fewer = {
                colour: drawer.simplified(mesh, error, len(picture.groups) > 1)
                for colour, mesh in picture.groups.items()
            }
            if few and abs(about_enclosed(joined(list(fewer.values()))) - volume) > LOST_VOLUME * volume:
                break
            few, before = fewer, count
            count, error = sum(map(len, few.values())), 1.4 * error
        primitives = []
        for colour, mesh in picture.groups.items():
            body = shaded(few[colour] if len(few[colour]) else mesh)
            shape = glb.quantized(body.vertices, body.normals, body.faces, low, size)
            primitives.append((shape, glb.material(colour, colour[3])))
        glb.roots.append(glb.node(glb.mesh(primitives), matrix, extras=extras))
    return glb.packed()


class NoDrawer:
    """For files without shapes."""

    def faces(self, path: Path, named: str, place: Floats) -> list[Mesh | None]:
        """Refuse to draw: raise DocumentError."""
        raise DocumentError(named, message("is not a shape that can be drawn"))

    def simplified(self, mesh: Mesh, error: float, keep_border: bool) -> Mesh:
        """Return the mesh unchanged."""
        return mesh

    def measured(self, shapes: Sequence[Stored], weigh: bool) -> tuple[Box, Measured | None]:
        """Refuse to measure: raise DocumentError."""
        raise DocumentError(shapes[0][1], message("is not a shape that can be measured"))


class KernelDrawer:
    """Draws with the geometry kernel, and meshoptimizer if it is installed. Raises ConfigError."""

    def __init__(self) -> None:
        from silo.inertia.geometry import kernel

        kernel.quiet()

    def faces(self, path: Path, named: str, place: Floats) -> list[Mesh | None]:
        """Make the triangles of each face."""
        from silo.inertia.geometry import kernel
        from silo.inertia.geometry.kernel.solids import load_shape

        shape = located(load_shape(path, named), place)
        with kernel.Attempt():
            kernel.mesh_faces(shape, (LINEAR, ANGULAR), LEAST)
        return list(kernel.face_meshes(shape))

    def simplified(self, mesh: Mesh, error: float, keep_border: bool) -> Mesh:
        """Make a mesh with fewer triangles; with the same ones if meshoptimizer is missing."""
        return simplified(mesh, error, keep_border)

    def measured(self, shapes: Sequence[Stored], weigh: bool) -> tuple[Box, Measured | None]:
        """Return the box around the surfaces, and the solids as they are measured for a mass."""
        from silo.inertia.geometry import kernel
        from silo.inertia.geometry.kernel.solids import load_shape, measure

        loaded = [located(load_shape(path, named), place) for path, named, place in shapes]
        corners = kernel.exact_bounds(loaded)
        return corners, measure(loaded, eps=EPS, mesh_check=False) if weigh else None


def simplified(mesh: Mesh, error: float, keep_border: bool) -> Mesh:
    """Make a mesh with fewer triangles, off by at most ``error`` [m]; the same mesh if meshoptimizer is
    missing.
    """
    try:
        from meshoptimizer import simplifier
    except (ImportError, OSError):
        return mesh
    # For single precision: moved to the origin, and scaled to size 1.
    middle = mesh.vertices.min(axis=0)
    size = float(mesh.extents.max()) or 1.0
    points = np.ascontiguousarray((mesh.vertices - middle) / size, dtype=np.float32)
    indices = np.ascontiguousarray(mesh.faces.ravel(), dtype=np.uint32)
    kept = np.zeros_like(indices)
    options = simplifier.SIMPLIFY_ERROR_ABSOLUTE | (simplifier.SIMPLIFY_LOCK_BORDER if keep_border else 0)
    count = simplifier.simplify(
        kept, indices, points, target_index_count=0, target_error=error / size, options=options
    )
    return Mesh(mesh.vertices, kept[:count].astype(np.int64).reshape(-1, 3))


# --- making and sending, after a commit ---

_WORKER = "from silo.drawing.models import main; main()"
# For a file, and for the child that draws several.
SECONDS, START_SECONDS = 30.0, 120.0


def send_models(
    client: SiloClient,
    files: Iterable[tuple[Path, str]],
    *,
    command: Sequence[str] = (),
    cancelled: Cancel | None = None,
    at: Callable[[str], object] = lambda _: None,
) -> tuple[int, list[str]]:
    """Make and send the models of these files that the server lacks; each file has its SHA-256.

    Returns how many were sent, and a sentence for each that was not. The commits remain done, whatever
    happens here.

    command
        starts another child than that of the geometry kernel; it draws as :func:`work_with` does.
    """
    wanted = {sha256: path for path, sha256 in files}
    try:
        lacking = client.lacking_models(wanted)
    except SiloError:
        return 0, []  # a Silo without models, or one that cannot be reached now
    todo = [(wanted[place], place) for place in sorted(lacking, key=lambda one: str(wanted[one]))]
    sent, problems, left = 0, list[str](), len(todo)
    at(message("drawing {left}", left=counted(left, "file")))
    # Our work must not keep FreeCAD's window waiting.
    shapes = todo if command else [place for place in todo if _has_shapes(place[0])]
    bare = ((*place, _drawn_here(*place)) for place in todo if place not in shapes)
    for path, sha256, model in chain(bare, _drawn(shapes, command, cancelled, problems)):
        at(message("sending models, {left} left", left=counted(left, "file")))
        left -= 1
        try:
            if isinstance(model, str):
                problems.append(message("{name}: no model was made: {model}", name=path.name, model=model))
                continue
            for part, body in zip(("structure", "geometry"), model, strict=True):
                client.put_model(sha256, part, body)
            sent += 1
        except CancelledError:
            break
        except SiloError as error:
            problems.append(message("{name}: its model was not sent: {error}", name=path.name, error=error))
    return sent, problems


_Found = tuple[Path, str, tuple[bytes, bytes] | str]


def _has_shapes(path: Path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name.endswith((".brp", ".bin")) for name in archive.namelist())
    except (OSError, zipfile.BadZipFile):
        return False


def _drawn_here(path: Path, sha256: str) -> tuple[bytes, bytes] | str:
    """Draw a file that only places others, which needs neither a kernel nor a child."""
    try:
        models = packed(path, NoDrawer())
        return models if content_hash(path) == sha256 else CHANGED
    except (SiloError, OSError) as error:
        return str(getattr(error, "reason", error))


CHANGED = message("the file has changed since it was committed")


def packed(path: Path, drawer: Drawer) -> tuple[bytes, bytes]:
    """Write the structure and the geometry of a file as they are sent. Raises DocumentError."""
    glb, structure = draw(path, drawer)
    data = structure.model_dump_json(exclude_defaults=True).encode()
    return gzip.compress(data, 6, mtime=0), gzip.compress(glb, 6, mtime=0)


def _drawn(
    todo: Sequence[tuple[Path, str]], command: Sequence[str], cancelled: Cancel | None, problems: list[str]
) -> Iterator[_Found]:
    """Draw the files; adds one problem for all files if nothing here can draw."""
    try:
        yield from _by_children(todo, command, cancelled)
    except ConfigError as error:
        problems.append(
            message(
                "Silo gets no model, size or mass of {todo}: {error}",
                todo=counted(len(todo), "file"),
                error=error,
            )
        )


def _by_children(
    todo: Sequence[tuple[Path, str]], command: Sequence[str], cancelled: Cancel | None
) -> Iterator[_Found]:
    """Draw in at most two children; FreeCAD is one child."""
    count = min(1 if command else 2, os.cpu_count() or 1, len(todo))
    with ThreadPoolExecutor(max(count, 1)) as pool:
        shares = [todo[number::count] for number in range(count)]
        for batches in pool.map(lambda share: list(_by_child(share, command, cancelled)), shares):
            yield from batches


def _by_child(
    files: Sequence[tuple[Path, str]], command: Sequence[str], cancelled: Cancel | None
) -> Iterator[_Found]:
    """Draw in a child; a file that crashes it is left out, and the next child continues after it."""
    starts = 2  # sometimes FreeCAD ends while it starts
    while files:
        at = -1

        def reached(progress: Progress) -> None:
            nonlocal at
            at = progress.done

        limits = ReadOptions(
            timeout_s=START_SECONDS + SECONDS * len(files),
            progress=reached,
            cancelled=cancelled.is_set if cancelled is not None else None,
        )
        with scratch_folder("silo-models-") as folder:
            listed = Path(folder) / "files.json"
            listed.write_text(json.dumps([str(path) for path, _ in files]), encoding="utf-8")
            why = ""
            try:
                # A FreeCAD in the background shares no settings and no locks with the one of the window.
                started = command or [python(), "-c", _WORKER]
                run(listed, limits, Path(folder), started, FREECAD_USER_HOME=folder)
                at = len(files)
            except CancelledError:
                return
            except ConfigError:  # nothing here can draw: the extra "inertia"
                raise
            except SiloError as error:
                why = getattr(error, "reason", str(error))
            for number, (path, sha256) in enumerate(files[: max(at, 0)]):
                yield path, sha256, _result(Path(folder), number, path, sha256)
        starts -= at < 0
        if at < 0 and starts:
            continue
        at = max(at, 0)
        if at < len(files):
            yield (*files[at], why)
        files = files[at + 1 :]


def _result(folder: Path, number: int, path: Path, sha256: str) -> tuple[bytes, bytes] | str:
    try:
        if (problem := folder / f"{number}.txt").exists():
            return problem.read_text("utf-8")
        if content_hash(path) != sha256:
            return CHANGED
        return (folder / f"{number}.json.gz").read_bytes(), (folder / f"{number}.glb.gz").read_bytes()
    except (OSError, DocumentError) as error:
        return str(error)


def main() -> None:
    """Run as the child, with the geometry kernel."""
    work_with(KernelDrawer)


def work_with(make: Callable[[], Drawer]) -> None:
    """Run as the child: draw the files of a list, each into the folder of the results."""

    def work(task: dict[str, Any], parent: IO[str], _noise: IO[bytes]) -> None:
        folder, drawer = Path(task["result"]), make()
        paths = json.loads(Path(task["path"]).read_text("utf-8"))
        for number, path in enumerate(paths):
            say(parent, event="progress", stage="drawing", done=number, total=len(paths))
            try:
                structure, glb = packed(Path(path), drawer)
                (folder / f"{number}.glb.gz").write_bytes(glb)
                (folder / f"{number}.json.gz").write_bytes(structure)
            except Exception as error:  # noqa: BLE001 - whatever a kernel raises: the next file may do
                reason = getattr(error, "reason", "") or f"{type(error).__name__}: {error}"
                (folder / f"{number}.txt").write_text(reason[:1000], encoding="utf-8")
        say(parent, event="done")

    read_main(work)
