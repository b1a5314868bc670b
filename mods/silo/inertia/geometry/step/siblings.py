# SPDX-License-Identifier: LGPL-2.1-or-later
"""Split assemblies: products whose geometry lies in a file of their own, beside the assembly's.

SolidWorks and CATIA write one file per part, and an assembly file whose products hold nothing. All readers
tried give such an assembly no solid, and no message. Here a product without geometry is looked for as
``<product name>.STEP`` (.step, .stp; case ignored) in the assembly's folder and some levels below it, never
outside of it, whatever path the file itself names.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from silo.bom.errors import DocumentError, InputError
from silo.inertia.geometry.graph import Child, bottom_up
from silo.inertia.geometry.helpers import WORTH_HELP, Helpers
from silo.inertia.geometry.kernel.solids import measure
from silo.inertia.geometry.labels import bare_stem, file_key, step_files
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.geometry.step.xcaf import Stated, StepFile, load
from silo.inertia.model import GeometryCode, GeometryProblem


class Siblings:
    """The files that may hold missing products; ``problems`` by product key, ``used`` paths in order."""

    def __init__(
        self, top: StepFile, options: ReadOptions, helpers: Helpers, reading: Callable[[str], None]
    ) -> None:
        self._top = top
        self._options = options
        self._helpers = helpers
        self._reading = reading
        self._root = Path(os.path.realpath(top.path)).parent
        self._index: dict[str, list[Path]] | None = None
        self._loaded: dict[Path, StepFile | str] = {}
        self._open = {Path(os.path.realpath(top.path))}
        self.problems: dict[str, GeometryProblem] = {}
        self.used: list[Path] = []
        self.missing: list[str] = []

    def resolve(self) -> None:
        """Fill every product without geometry that has a file; note on the others why not."""
        waiting = self._top.empty
        while waiting:
            found = {key: self._find(key) for key in waiting}
            self._load([path for path, _ in found.values() if path is not None])
            waiting = []
            for key, (path, reason) in found.items():
                if path is None:
                    self.missing.append(self._top.nodes[key].name)
                    self.problems[key] = GeometryProblem(GeometryCode.NO_GEOMETRY, reason)
                    continue
                try:
                    waiting += self._fill(key, path)
                except DocumentError as error:
                    self.problems[key] = GeometryProblem(
                        GeometryCode.EXTERNAL_FILE, f"its file {path.name} cannot be read: {error.reason}"
                    )

    def _load(self, wanted: list[Path]) -> None:
        """Read files that are not read yet, large ones first, by as many processes as help."""
        paths = [path for path in dict.fromkeys(wanted) if path not in self._loaded]
        paths = paths[: max(self._options.max_siblings - len(self._loaded), 0)]
        sizes = {path: path.stat().st_size for path in paths if path.is_file()}
        paths.sort(key=lambda path: -sizes.get(path, 0))
        if len(paths) > 1 and sum(sizes.values()) >= WORTH_HELP and self._helpers.start():
            self._helpers.load_kernel()
        options = self._options
        rows = [
            (path, f"{path.relative_to(self._root).as_posix()}#", options.eps, options.mesh_check)
            for path in paths
        ]
        read = self._helpers.all(
            rows,
            lambda row: part_file(*row),
            lambda row: (part_file, row),
            lambda number, _: self._reading(paths[number - 1].name),
        )
        self._loaded.update(zip(paths, read, strict=True))

    def _find(self, key: str) -> tuple[Path | None, str]:
        node, facts = self._top.nodes[key], self._top.facts[key]
        wanted = [bare_stem(document) for document in facts.documents] + [node.name, facts.part_number]
        found: list[Path] = []
        for name in filter(None, wanted):
            found = [p for p in self._files().get(file_key(name), ()) if p not in self._open]
            if found:
                break
        if not found:
            return None, (
                f"the file holds no geometry for it, and no file '{node.name}.STEP' lies in the folder"
                if self._options.siblings
                else "the file holds no geometry for it, and files beside it are not to be used"
            )
        nearest = min(len(p.parts) for p in found)
        best = [p for p in found if len(p.parts) == nearest]
        if len(best) > 1:
            names = ", ".join(str(p.relative_to(self._root)) for p in best)
            return None, f"the file holds no geometry for it, and several files are named after it: {names}"
        return best[0], ""

    def _files(self) -> dict[str, list[Path]]:
        if self._index is None:
            self._index = {}
            for path in step_files(self._root, self._options.sibling_depth) if self._options.siblings else ():
                self._index.setdefault(file_key(path.stem), []).append(path)
        return self._index

    def _fill(self, key: str, path: Path) -> list[str]:
        """Put the file's content in the product's place; returns products that are empty in turn."""
        part = self._loaded.get(path)
        if part is None:
            raise DocumentError(
                str(path), f"more than {self._options.max_siblings} files belong to this assembly"
            )
        if isinstance(part, str):
            raise DocumentError(str(path), part)
        empty: list[str] = []
        if path not in self.used:
            empty = part.empty
            self._top.take_in(part)
            self.used.append(path)
        self._hang(key, part.roots, path)
        return empty

    def _hang(self, key: str, roots: list[Child], path: Path) -> None:
        node = self._top.nodes[key]
        content = self._top.nodes[roots[0].product] if len(roots) == 1 else None
        children = content.children if content is not None else tuple(roots)
        filled = replace(node, children=children, has_geometry=bool(content and content.has_geometry))
        self._top.nodes[key] = filled
        try:
            bottom_up(self._top.nodes, key)
        except InputError as error:
            self._top.nodes[key] = node
            raise DocumentError(str(path), "it contains the assembly that needs it") from error
        self._top.take_shape(key, roots[0].product if content is not None else "")
        if content is not None:
            here, there = self._top.facts[key], self._top.facts[roots[0].product]
            self._top.facts[key] = replace(
                here,
                part_number=here.part_number or there.part_number,
                material=here.material or there.material,
                density=here.density if here.density is not None else there.density,
            )
            if self._top.stated[key] == Stated():
                self._top.stated[key] = self._top.stated[roots[0].product]


def part_file(path: Path, prefix: str, eps: float, mesh_check: bool) -> StepFile | str:
    """A part's own file, read and measured, without the kernel's shapes; or what is wrong with it."""
    try:
        part = load(path, prefix)
    except DocumentError as error:
        return error.reason
    part.measured = {
        key: measure(shapes, eps=eps, mesh_check=mesh_check) for key, shapes in part.shapes.items()
    }
    part.shapes.clear()
    part.kept = ()
    return part
