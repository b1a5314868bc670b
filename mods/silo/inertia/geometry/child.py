# SPDX-License-Identifier: LGPL-2.1-or-later
"""The child process that reads a file: started, watched, and ended by the parent.

The geometry kernel may crash, hang or eat memory, and only the child does. The child (:mod:`worker`) gets its
task as one JSON line, answers with JSON lines (progress, then done or error), and leaves the result in a file
in a folder that is ours. Its standard error is kept for the message.
"""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from silo.bom.errors import CancelledError, ConfigError, DocumentError
from silo.bom.message import message
from silo.inertia.geometry.options import Progress, ReadOptions
from silo.platform import processes

POLL_SECONDS = 0.05

_OUT_OF_MEMORY = (
    "MemoryError",
    "bad_alloc",
    message("Cannot allocate memory"),
    message("failed to map segment"),
)

_WORKER = "from silo.inertia.geometry.worker import main; main()"


def run(path: Path, options: ReadOptions, result: Path, command: Sequence[str] = (), **env: str) -> None:
    """Read ``path`` in a child process, which stores the geometry at ``result``.

    ``command`` starts another child than the usual worker, with the same protocol; ``env`` is set for it.

    Raises DocumentError (bad file, crash, time or memory limit), ConfigError (kernel not installed) and
    CancelledError.
    """
    task = {
        "path": str(path),
        "result": str(result),
        "options": options.content_options(),
        "memory_mb": options.memory_mb,
        "processes": options.processes,
        "cpu_s": options.timeout_s,
    }
    command = command or [python(), "-c", _WORKER]
    # In a file: FreeCAD's window would be ended by the signal of a pipe whose reader has died.
    with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as errors:
        given.write(json.dumps(task).encode("utf-8") + b"\n")
        given.seek(0)
        with _child(command, given, errors, env) as process:
            answer = _talk(process, path, options)
            process.wait()
        if answer is None:
            raise DocumentError(str(path), _death(process.returncode, errors, options))
    if answer.get("event") == "error":
        if answer.get("config"):
            raise ConfigError(str(answer["reason"]))
        raise DocumentError(str(path), str(answer["reason"]))


def _talk(process: subprocess.Popen[bytes], path: Path, options: ReadOptions) -> dict[str, Any] | None:
    """Pass on the child's progress, and return its last message; None if it ended without one."""
    lines: queue.Queue[bytes | None] = queue.Queue()
    threading.Thread(target=_pump, args=(process.stdout, lines), daemon=True).start()
    deadline = time.monotonic() + options.timeout_s if options.timeout_s else None
    while True:
        if options.cancelled is not None and options.cancelled():
            raise CancelledError(message("{path}: reading was cancelled", path=path))
        if deadline is not None and time.monotonic() > deadline:
            raise DocumentError(
                str(path),
                message(
                    "could not be read within {timeout_s} s; allow more time, or simplify it",
                    timeout_s=f"{options.timeout_s:g}",
                ),
            )
        try:
            line = lines.get(timeout=POLL_SECONDS)
        except queue.Empty:
            continue
        if line is None:
            return None
        if not line.startswith(b"{"):
            continue  # FreeCAD's banner
        event: dict[str, Any] = json.loads(line)
        if event.get("event") != "progress":
            return event
        if options.progress is not None:
            options.progress(Progress(str(event["stage"]), int(event["done"]), int(event["total"])))


def _pump(stream: IO[bytes] | None, lines: queue.Queue[bytes | None]) -> None:
    for line in stream or ():
        lines.put(line)
    lines.put(None)


@contextmanager
def _child(
    command: Sequence[str], given: IO[bytes], errors: IO[bytes], env: Mapping[str, str]
) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(
        command,
        stdin=given,
        stdout=subprocess.PIPE,
        stderr=errors,
        env={**_environment(), **env},
        **processes.child_options(group=True),
    )
    try:
        yield process
    finally:
        processes.end(process)
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def python() -> str:
    """Find a Python interpreter to start. Inside FreeCAD ``sys.executable`` is FreeCAD itself."""
    if "python" in Path(sys.executable or "").name.lower():
        return sys.executable
    for path in processes.python_beside(sys.base_exec_prefix):
        if os.path.isfile(path):
            return path
    raise ConfigError(
        message(
            "no Python interpreter was found beside {executable} to read geometry with; read "
            "it with isolate=False",
            executable=sys.executable,
        )
    )


def _environment() -> dict[str, str]:
    # The child must find the same modules, however this process found them.
    paths = os.pathsep.join(p for p in sys.path if p)
    # One thread: numpy's pool would reserve memory for each core, which counts against the limit.
    environment = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    # What the kernel prints is written at once, and not lost when the child ends itself.
    return {**os.environ, **environment, "PYTHONPATH": paths, "PYTHONUNBUFFERED": "1"}


def _death(code: int, errors: IO[bytes], options: ReadOptions) -> str:
    errors.seek(0)
    words = errors.read()[-4000:].decode("utf-8", errors="replace")
    if any(sign in words for sign in _OUT_OF_MEMORY):
        return message(
            "needs more than the {memory_mb} MB allowed to read it; allow more memory",
            memory_mb=options.memory_mb,
        )
    if code < 0:
        return message(
            "the geometry kernel {code} on it; the file is damaged, or trips a bug of the "
            "kernel. Export it again, or with another application protocol",
            code=processes.how_it_ended(code),
        )
    last = next(
        (line for line in reversed(words.splitlines()) if line.strip()),
        message("exit code {code}", code=code),
    )
    return message("the reader stopped with an error: {last}", last=last.strip())
