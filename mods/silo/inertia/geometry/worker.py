# SPDX-License-Identifier: LGPL-2.1-or-later
"""The child process that reads geometry; started by :mod:`isolate`, and by nothing else.

Standard output is the line to the parent, so the kernel, which prints there too, gets a file instead. What it
wrote is counted and becomes a problem of the assembly.
"""

from __future__ import annotations

import json
import os
import re
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from silo.bom.errors import ConfigError, SiloError
from silo.inertia.geometry import store
from silo.inertia.geometry.options import Reading, ReadOptions
from silo.inertia.model import GeometryCode, GeometryProblem
from silo.inertia.wording import counted
from silo.platform import limit_this_process

_COMPLAINT = re.compile(rb"ERR|Fail|\*\*\*|Exception|Unresolved", re.IGNORECASE)
_COLOUR = re.compile(rb"\x1b\[[0-9;]*m")


def main() -> None:
    """Read the task from standard input, do it, say how it went. Exit code 0 unless it crashed."""
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
    from silo.inertia.geometry.cache import provenance
    from silo.inertia.geometry.helpers import helpers_for
    from silo.inertia.geometry.read import read_here

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
