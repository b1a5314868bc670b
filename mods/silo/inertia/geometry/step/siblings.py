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
from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.labels import file_key
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.geometry.step.folder import bare_stem, step_files
from silo.inertia.geometry.step.xcaf import Stated, StepFile, load
from silo.inertia.model import GeometryCode, GeometryProblem


class Siblings:
    """The files that may hold missing products; ``problems`` by product key, ``used`` paths in order."""

    def __init__(self, top: StepFile, options: ReadOptions, cancelled_check: Callable[[str], None]) -> None:
        self._top = top
        self._options = options
        self._tick = cancelled_check
        self._root = Path(os.path.realpath(top.path)).parent
        self._index: dict[str, list[Path]] | None = None
        self._loaded: dict[Path, list[Child]] = {}
        self._open = {Path(os.path.realpath(top.path))}
        self.problems: dict[str, GeometryProblem] = {}
        self.used: list[Path] = []
        self.missing: list[str] = []

    def resolve(self) -> None:
        """Fill every product without geometry that has a file; note on the others why not."""
        waiting = self._empty(self._top)
        while waiting:
            key = waiting.pop(0)
            node = self._top.nodes[key]
            path, reason = self._find(key)
            if path is None:
                self.missing.append(node.name)
                self.problems[key] = GeometryProblem(GeometryCode.NO_GEOMETRY, reason)
                continue
            try:
                waiting += self._fill(key, path)
            except DocumentError as error:
                self.problems[key] = GeometryProblem(
                    GeometryCode.EXTERNAL_FILE, f"its file {path.name} cannot be read: {error.reason}"
                )

    def _empty(self, step: StepFile) -> list[str]:
        return [
            key
            for key, shapes in step.shapes.items()
            if not step.nodes[key].children and not any(occt.has_edges(shape) for shape in shapes)
        ]

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
        self._tick(path.name)
        empty: list[str] = []
        if path not in self._loaded:
            if len(self._loaded) >= self._options.max_siblings:
                raise DocumentError(
                    str(path), f"more than {self._options.max_siblings} files belong to this assembly"
                )
            part = load(path, prefix=f"{path.relative_to(self._root).as_posix()}#")
            empty = self._empty(part)
            self._top.take_in(part)
            self._loaded[path] = part.roots
            self.used.append(path)
        self._hang(key, self._loaded[path], path)
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
        self._top.shapes[key] = self._top.shapes.get(roots[0].product, []) if content is not None else []
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
