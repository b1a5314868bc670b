# SPDX-License-Identifier: LGPL-2.1-or-later
"""Read the geometry of any file we know: from the cache, in a child process, or here."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from silo.bom.errors import CancelledError, DocumentError
from silo.folders import scratch_folder
from silo.inertia.geometry import isolate, store
from silo.inertia.geometry.cache import Cache, changed_since, default_folder, key_of
from silo.inertia.geometry.detect import Kind, detect
from silo.inertia.geometry.helpers import Helpers
from silo.inertia.geometry.options import Progress, Reading, ReadOptions, Report
from silo.inertia.geometry.step.prepare import begin
from silo.inertia.model import Assembly

ATTEMPTS = 3
"""Readings of a file that changes meanwhile, before that is an error."""


def read(path: str | Path, *, options: ReadOptions | None = None) -> Assembly:
    """The geometry of a STEP, BREP, FreeCAD or mesh file: prototypes measured once, and where they are.

    Example::

        assembly = read("arm.step", options=ReadOptions(timeout_s=60))
        for instance in assembly.instances: ...

    Raises DocumentError (the file is missing, of no known format, damaged, or beyond the limits), ConfigError
    (the extra "inertia" is not installed) and CancelledError. What is doubtful but usable is a problem of the
    assembly or of its prototypes.
    """
    options = options or ReadOptions()
    path = Path(path)
    kind = detect(path)
    if not options.isolate:
        if not detect(path).is_mesh:
            from silo.inertia.geometry.kernel import occt

            occt.quiet()
        with Helpers() as helpers:
            return read_here(path, options, _reporter(path, options), helpers).assembly
    cache = Cache(options.cache_dir or default_folder()) if options.cache else None
    for _ in range(ATTEMPTS):
        key = key_of(path, _content(kind, options))
        known = cache.get(key, path) if cache else None
        if known is not None:
            return known
        begin = time.time_ns()
        with scratch_folder("silo-geometry-") as folder:
            result = Path(folder) / "result.npz"
            isolate.run(path, options, result)
            assembly, extra = store.load(result)
            if key_of(path, _content(kind, options)) != key or changed_since(begin, extra, path):
                continue
            if cache is not None:
                cache.put(key, result)
        return assembly
    raise DocumentError(
        str(path), f"changed while it was read, {ATTEMPTS} times; read it when nobody writes to it"
    )


def _content(kind: Kind, options: ReadOptions) -> dict[str, Any]:
    """What a result depends on besides the file: for FreeCAD documents also the cards that hold densities."""
    content = options.content_options()
    if kind is not Kind.FREECAD:
        return content
    from silo.inertia.materials.cards import cards_fingerprint

    return {**content, "cards": cards_fingerprint()}


def read_here(path: Path, options: ReadOptions, report: Report, helpers: Helpers) -> Reading:
    """Read in this process, and in the helpers: what the child does."""
    kind = detect(path)
    if kind is Kind.STEP:
        text = begin(path, options, helpers)
        from silo.inertia.geometry.step.read import read_step

        return read_step(path, options, report, helpers, text)
    if kind.is_mesh:
        from silo.inertia.geometry.meshes.meshfile import read_mesh

        return read_mesh(path, kind, options, report)
    if kind is Kind.BREP:
        from silo.inertia.geometry.kernel.brep import read_brep

        return read_brep(path, options, report)
    from silo.inertia.geometry.freecad.files import read_freecad

    return read_freecad(path, options, report, helpers)


def _reporter(path: Path, options: ReadOptions) -> Report:
    def report(stage: str, done: int, total: int) -> None:
        if options.cancelled is not None and options.cancelled():
            raise CancelledError(f"{path}: reading was cancelled")
        if options.progress is not None:
            options.progress(Progress(stage, done, total))

    return report
