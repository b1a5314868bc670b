# SPDX-License-Identifier: LGPL-2.1-or-later
"""The reading of any geometry file: from the cache, in a child process, or here."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from silo.bom.errors import CancelledError, ConfigError, DocumentError, InputError
from silo.bom.message import message
from silo.inertia.assembly import Assembly
from silo.inertia.geometry.cache import Cache, changed_since, default_folder, key_of
from silo.inertia.geometry.child import run
from silo.inertia.geometry.formats import Format, detect
from silo.inertia.geometry.helpers import Helpers
from silo.inertia.geometry.options import Progress, ReadOptions, Report
from silo.inertia.geometry.reading import GeometryReading
from silo.inertia.geometry.stored import load
from silo.platform.whole_files import scratch_folder

ATTEMPTS = 3
"""Readings of a file that changes meanwhile, before that is an error."""


def read(path: str | Path, *, options: ReadOptions | None = None) -> Assembly:
    """Read the geometry of a STEP, BREP, FreeCAD or mesh file: prototypes, each measured once, and their
    placements.

    Example::

        assembly = read("arm.step", options=ReadOptions(timeout_s=60))
        for instance in assembly.instances: ...

    Raises DocumentError (the file is missing, of no known format, damaged, or beyond the limits), ConfigError
    (the extra "inertia" is not installed) and CancelledError. Doubtful but usable geometry is noted as a
    problem of the assembly or of its prototypes.
    """
    options = options or ReadOptions()
    path = Path(path)
    kind = detect(path)
    if not options.isolate:
        if kind.needs_kernel:
            from silo.inertia.geometry import kernel as occt

            occt.quiet()
        with Helpers() as helpers:
            return read_here(path, options, _reporter(path, options), helpers).assembly
    kept = Cache(options.cache_dir or default_folder()) if options.cache else None
    for _ in range(ATTEMPTS):
        key = key_of(path, _content(kind, options))
        stored = kept.get(key, path) if kept else None
        if stored is not None:
            return stored
        begin = time.time_ns()
        with scratch_folder("silo-geometry-") as folder:
            result = Path(folder) / "result.npz"
            run(path, options, result)
            assembly, extra = load(result)
            if key_of(path, _content(kind, options)) != key or changed_since(begin, extra, path):
                continue
            if kept is not None:
                kept.put(key, result)
        return assembly
    raise DocumentError(
        str(path),
        message(
            "changed while it was read, {attempts} times; read it when nobody writes to it", attempts=ATTEMPTS
        ),
    )


def _content(kind: Format, options: ReadOptions) -> dict[str, Any]:
    """Return everything besides the file on which a result depends.

    For FreeCAD documents these are also the cards with densities.
    """
    content = options.content_options()
    if kind is not Format.FREECAD:
        return content
    from silo.inertia.materials.cards import cards_fingerprint

    return {**content, "cards": cards_fingerprint()}


def read_here(path: Path, options: ReadOptions, report: Report, helpers: Helpers) -> GeometryReading:
    """Read in this process and in the helpers; the child does this."""
    try:
        return _reading(path, options, report, helpers)
    except (DocumentError, ConfigError):
        raise
    except InputError as error:  # of a structure that does not end, or that asks for too much
        raise DocumentError(str(path), str(error)) from error


def _reading(path: Path, options: ReadOptions, report: Report, helpers: Helpers) -> GeometryReading:
    kind = detect(path)
    if kind is Format.STEP:
        # The kernel is not there inside FreeCAD, which reads the other formats; the text does without it.
        from silo.inertia.geometry.step_text import begin

        text = begin(path, options, helpers)
        import silo.inertia.geometry.kernel  # noqa: F401 - first: it says what is wrong with it
        from silo.inertia.geometry.step import read_step

        return read_step(path, options, report, helpers, text)
    if kind in (Format.URDF, Format.MJCF):
        from silo.inertia.geometry.robot import read_robot

        return read_robot(path, options, report)
    if kind.is_mesh:
        from silo.inertia.geometry.meshes import read_mesh

        return read_mesh(path, kind, options, report)
    if kind is Format.BREP:
        from silo.inertia.geometry.kernel.solids import read_brep

        return read_brep(path, options, report)
    from silo.inertia.geometry.fcstd import read_freecad

    return read_freecad(path, options, report, helpers)


def _reporter(path: Path, options: ReadOptions) -> Report:
    def report(stage: str, done: int, total: int) -> None:
        if options.cancelled is not None and options.cancelled():
            raise CancelledError(message("{path}: reading was cancelled", path=path))
        if options.progress is not None:
            options.progress(Progress(stage, done, total))

    return report


# --- the child ------------------------------------------------------------------------------------------
