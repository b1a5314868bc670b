# SPDX-License-Identifier: LGPL-2.1-or-later
"""The work of the child process: its limits, one task, the result, the kernel's complaints."""

from __future__ import annotations

import json
import os
import re
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from silo.bom.errors import ConfigError, SiloError, counted
from silo.bom.message import message
from silo.inertia.geometry.cache import provenance
from silo.inertia.geometry.helpers import helpers_for
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.geometry.read import read_here
from silo.inertia.geometry.reading import GeometryReading
from silo.inertia.geometry.stored import save
from silo.inertia.notes import GeometryCode, Note
from silo.platform.limits import limit_this_process

_COMPLAINT = re.compile(rb"ERR|Fail|\*\*\*|Exception|Unresolved", re.IGNORECASE)

_COLOUR = re.compile(rb"\x1b\[[0-9;]*m")


def main(work: Callable[[dict[str, Any], IO[str], IO[bytes]], None] | None = None) -> None:
    """Run as the child: read the task from standard input, do it, and report the result. Exit code 0 unless
    it crashed. ``work`` does the task; by default it reads the geometry of a file.

    Standard output goes to the parent, so the kernel, which prints there too, gets a file instead; its lines
    are counted and become a problem of the assembly.
    """
    parent = os.fdopen(os.dup(1), "w", encoding="utf-8")
    task = json.loads(sys.stdin.readline())
    limit(int(task["memory_mb"]), float(task["cpu_s"]))
    without("scipy", "networkx")
    with tempfile.TemporaryFile() as noise:
        os.dup2(noise.fileno(), 1)
        try:
            (work or _read)(task, parent, noise)
        except SiloError as error:
            reason = getattr(error, "reason", str(error))
            say(parent, event="error", reason=reason, config=isinstance(error, ConfigError))
    os._exit(0)


def without(*packages: str) -> None:
    """Keep this process from importing packages, even if they are installed.

    trimesh imports them if they are installed; nothing here needs them, and they cost half a second and 45
    MB.
    """
    for package in packages:
        sys.modules[package] = None  # type: ignore[assignment]


def limit(memory_mb: int, cpu_s: float) -> None:
    """Set limits of this process, if the platform has them; no core files."""
    # The limit of time is only for a parent that died; otherwise the parent's clock counts.
    limit_this_process(memory=memory_mb * 1024**2, cpu_s=int(cpu_s) + 30 if cpu_s else 0)


def _read(task: dict[str, Any], parent: IO[str], noise: IO[bytes]) -> None:
    options = ReadOptions.from_content(task["options"])

    def report(stage: str, done: int, total: int) -> None:
        say(parent, event="progress", stage=stage, done=done, total=total)

    with helpers_for(int(task["processes"]), int(task["memory_mb"])) as helpers:
        reading = read_here(Path(task["path"]), options, report, helpers)
    reading = with_complaints(reading, _complaints(noise))
    save(reading.assembly, Path(task["result"]), provenance(reading, options))
    say(parent, event="done")
    # Taking a large document of the kernel down can take longer than reading it, and may crash.
    os._exit(0)


def with_complaints(reading: GeometryReading, lines: list[str]) -> GeometryReading:
    """Add what the kernel printed, as one problem of the assembly."""
    if not lines:
        return reading
    problem = Note(
        GeometryCode.READER,
        message(
            "the geometry kernel complained {times} while reading: {first}",
            times=counted(len(lines), "time"),
            first=lines[0],
        ),
    )
    assembly = replace(reading.assembly, problems=(*reading.assembly.problems, problem))
    return replace(reading, assembly=assembly)


def _complaints(noise: IO[bytes]) -> list[str]:
    sys.stdout.flush()
    noise.seek(0)
    lines = (_COLOUR.sub(b"", line).strip() for line in noise)
    return [line.decode("utf-8", errors="replace")[:200] for line in lines if _COMPLAINT.search(line)]


def say(parent: IO[str], **event: object) -> None:
    """Send the parent a line."""
    parent.write(json.dumps(event) + "\n")
    parent.flush()
