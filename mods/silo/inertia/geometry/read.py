# SPDX-License-Identifier: LGPL-2.1-or-later
"""Read the geometry of any file we know: from the cache, in a child process, or here."""

from __future__ import annotations

import json
import os
import re
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from silo.bom.errors import CancelledError, ConfigError, DocumentError, InputError, SiloError
from silo.folders import scratch_folder
from silo.inertia.geometry import isolate, store
from silo.inertia.geometry.cache import Cache, changed_since, default_folder, key_of, provenance
from silo.inertia.geometry.detect import Kind, detect
from silo.inertia.geometry.helpers import Helpers, helpers_for
from silo.inertia.geometry.options import Progress, Reading, ReadOptions, Report
from silo.inertia.geometry.step.prepare import begin
from silo.inertia.model import Assembly, GeometryCode, GeometryProblem
from silo.inertia.wording import counted
from silo.platform import limit_this_process

ATTEMPTS = 3
"""Readings of a file that changes meanwhile, before that is an error."""
_COMPLAINT = re.compile(rb"ERR|Fail|\*\*\*|Exception|Unresolved", re.IGNORECASE)
_COLOUR = re.compile(rb"\x1b\[[0-9;]*m")


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
    try:
        return _reading(path, options, report, helpers)
    except (DocumentError, ConfigError):
        raise
    except InputError as error:  # of a structure that does not end
        raise DocumentError(str(path), str(error)) from error


def _reading(path: Path, options: ReadOptions, report: Report, helpers: Helpers) -> Reading:
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


# --- the child ------------------------------------------------------------------------------------------


def main() -> None:
    """The child: read the task from standard input, do it, say how it went. Exit code 0 unless it crashed.

    Standard output is the line to the parent, so the kernel, which prints there too, gets a file instead;
    what it wrote is counted and becomes a problem of the assembly.
    """
    parent = os.fdopen(os.dup(1), "w", encoding="utf-8")
    task = json.loads(sys.stdin.readline())
    limit(int(task["memory_mb"]), float(task["cpu_s"]))
    without("scipy", "networkx")
    with tempfile.TemporaryFile() as noise:
        os.dup2(noise.fileno(), 1)
        try:
            _read(task, parent, noise)
        except SiloError as error:
            reason = getattr(error, "reason", str(error))
            _say(parent, event="error", reason=reason, config=isinstance(error, ConfigError))
    os._exit(0)


def without(*packages: str) -> None:
    """Keep this process from importing packages that may be installed.

    trimesh imports these where they are; nothing done here needs them, and they cost half a second and 45 MB.
    """
    for package in packages:
        sys.modules[package] = None  # type: ignore[assignment]


def limit(memory_mb: int, cpu_s: float) -> None:
    """Limits of this process, where the platform has them; no core files."""
    # Time is limited only for the case that the parent died: its own clock is the one that counts.
    limit_this_process(memory=memory_mb * 1024**2, cpu_s=int(cpu_s) + 30 if cpu_s else 0)


def _read(task: dict[str, Any], parent: IO[str], noise: IO[bytes]) -> None:
    options = ReadOptions.from_content(task["options"])

    def report(stage: str, done: int, total: int) -> None:
        _say(parent, event="progress", stage=stage, done=done, total=total)

    with helpers_for(int(task["processes"]), int(task["memory_mb"])) as helpers:
        reading = read_here(Path(task["path"]), options, report, helpers)
    reading = with_complaints(reading, _complaints(noise))
    store.save(reading.assembly, Path(task["result"]), provenance(reading, options))
    _say(parent, event="done")
    # Taking a large document of the kernel down can take longer than reading it, and may crash.
    os._exit(0)


def with_complaints(reading: Reading, lines: list[str]) -> Reading:
    """What the kernel printed, as one problem of the assembly."""
    if not lines:
        return reading
    problem = GeometryProblem(
        GeometryCode.READER,
        f"the geometry kernel complained {counted(len(lines), 'time')} while reading: {lines[0]}",
    )
    assembly = replace(reading.assembly, problems=(*reading.assembly.problems, problem))
    return replace(reading, assembly=assembly)


def _complaints(noise: IO[bytes]) -> list[str]:
    sys.stdout.flush()
    noise.seek(0)
    lines = (_COLOUR.sub(b"", line).strip() for line in noise)
    return [line.decode("utf-8", errors="replace")[:200] for line in lines if _COMPLAINT.search(line)]


def _say(parent: IO[str], **event: object) -> None:
    parent.write(json.dumps(event) + "\n")
    parent.flush()
