# SPDX-License-Identifier: LGPL-2.1-or-later
"""How a file is read: what a caller may say about it, and what a reader reports while it works."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

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
    step_encoding
        of names in STEP files whose bytes are no UTF-8; None reads Windows-1252, and says so.
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
    step_encoding: str | None = None
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
