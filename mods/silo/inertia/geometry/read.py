# SPDX-License-Identifier: LGPL-2.1-or-later
"""Read the geometry of any file we know: from the cache, in a child process, or here.

Reading in a child process: the geometry kernel may crash, hang or eat memory, and only the child does.

The child (:func:`read.main`) gets its task as one JSON line, answers with JSON lines (progress, then done or
error), and leaves the result in a file in a folder that is ours. Its standard error is kept for the message.

What was read is kept, by content: the same bytes, kernel and options give the same numbers. The key holds the
file's SHA-256, the reading options, the kernel's version and a fingerprint of our own code that measures. The
folder is bounded: what was not used for longest goes first. A split assembly also keeps the hashes of the
files it was completed from, and the names of those it lacked: one part file changed, added or removed, and
the assembly is read again. Anything unexpected counts as "not there".

An assembly is one file: numbers as npz arrays, words as JSON, and nothing in it can be executed. The same
form goes from the reading process to its parent and into the cache.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import queue
import re
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from silo import platform
from silo.bom.document import relative
from silo.bom.errors import CancelledError, ConfigError, DocumentError, InputError, SiloError, counted
from silo.checksums import content_hash
from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.geometry.graph import (
    Format,
    GeometryReading,
    Progress,
    ReadOptions,
    Report,
    detect,
    file_key,
    step_files,
)
from silo.inertia.geometry.helpers import Helpers, helpers_for
from silo.inertia.geometry.together import Mesh
from silo.inertia.notes import GeometryCode, Note
from silo.platform import cache_folder, limit_this_process, remove_patiently, replacing, scratch_folder

POLL_SECONDS = 0.05
_OUT_OF_MEMORY = ("MemoryError", "bad_alloc", "Cannot allocate memory", "failed to map segment")
_WORKER = "from silo.inertia.geometry.read import main; main()"


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
            raise CancelledError(f"{path}: reading was cancelled")
        if deadline is not None and time.monotonic() > deadline:
            raise DocumentError(
                str(path),
                f"could not be read within {options.timeout_s:g} s; allow more time, or simplify it",
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
        **platform.child_options(group=True),
    )
    try:
        yield process
    finally:
        platform.end(process)
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def python() -> str:
    """Find a Python interpreter to start. Inside FreeCAD ``sys.executable`` is FreeCAD itself."""
    if "python" in Path(sys.executable or "").name.lower():
        return sys.executable
    for path in platform.python_beside(sys.base_exec_prefix):
        if os.path.isfile(path):
            return path
    raise ConfigError(
        f"no Python interpreter was found beside {sys.executable} to read geometry with; "
        "read it with isolate=False"
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
        return f"needs more than the {options.memory_mb} MB allowed to read it; allow more memory"
    if code < 0:
        return (
            f"the geometry kernel {platform.how_it_ended(code)} on it; the file is damaged, or trips "
            "a bug of the kernel. Export it again, or with another application protocol"
        )
    last = next((line for line in reversed(words.splitlines()) if line.strip()), f"exit code {code}")
    return f"the reader stopped with an error: {last.strip()}"


ATTEMPTS = 3
"""Readings of a file that changes meanwhile, before that is an error."""
_COMPLAINT = re.compile(rb"ERR|Fail|\*\*\*|Exception|Unresolved", re.IGNORECASE)
_COLOUR = re.compile(rb"\x1b\[[0-9;]*m")


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
        if not kind.is_mesh:
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
        str(path), f"changed while it was read, {ATTEMPTS} times; read it when nobody writes to it"
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
    except InputError as error:  # of a structure that does not end
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
            raise CancelledError(f"{path}: reading was cancelled")
        if options.progress is not None:
            options.progress(Progress(stage, done, total))

    return report


# --- the child ------------------------------------------------------------------------------------------


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
        f"the geometry kernel complained {counted(len(lines), 'time')} while reading: {lines[0]}",
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


FORMAT = 2
"""Raise it when the form, or the meaning of a number in it, changes."""


def save(assembly: Assembly, path: Path, extra: dict[str, Any] | None = None) -> None:
    """Write ``assembly`` to ``path``; ``extra`` is kept with it (JSON values)."""
    prototypes = list(assembly.prototypes.values())
    number = {prototype.key: n for n, prototype in enumerate(prototypes)}
    header = {
        "format": FORMAT,
        "name": assembly.name,
        "source": assembly.source,
        "unit": assembly.unit,
        "problems": _problems_out(assembly.problems),
        "prototypes": [_prototype_out(p) for p in prototypes],
        "instances": [(i.path, i.product_path, number[i.prototype]) for i in assembly.instances],
        "frames": list(assembly.frames),
        "extra": extra or {},
    }
    arrays: dict[str, NDArray[Any]] = {
        "header": np.frombuffer(json.dumps(header).encode("utf-8"), dtype=np.uint8),
        "transforms": np.array([i.transform for i in assembly.instances]),
        "frames": np.array(list(assembly.frames.values())),
    }
    for n, prototype in enumerate(prototypes):
        if isinstance(prototype.mesh, Mesh):
            arrays[f"vertices_{n}"] = prototype.mesh.vertices.astype(np.float32)
            arrays[f"faces_{n}"] = prototype.mesh.faces.astype(np.int32)
    with path.open("wb") as stream:
        np.savez(stream, **arrays)  # type: ignore[arg-type]


def load(path: Path) -> tuple[Assembly, dict[str, Any]]:
    """Read the assembly in ``path``, and what was kept with it. InputError if the file is not one of ours."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            return _assembly_in(arrays)
    except (OSError, ValueError, KeyError, IndexError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is not stored geometry of format {FORMAT}: {error}") from error


def _problems_out(problems: tuple[Note, ...]) -> list[list[str]]:
    return [[str(p.code), p.message] for p in problems]


def _problems_in(rows: list[list[str]]) -> tuple[Note, ...]:
    return tuple(Note(str(code), str(message)) for code, message in rows)


def _prototype_out(prototype: Prototype) -> dict[str, Any]:
    values = {f.name: getattr(prototype, f.name) for f in fields(prototype) if f.name != "mesh"}
    values["problems"] = _problems_out(prototype.problems)
    return {name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in values.items()}


def _assembly_in(arrays: Any) -> tuple[Assembly, dict[str, Any]]:
    header = json.loads(bytes(arrays["header"]).decode("utf-8"))
    if header.get("format") != FORMAT:
        raise InputError(f"wanted stored geometry of format {FORMAT}, got {header.get('format')!r}")
    prototypes = [_prototype_in(n, row, arrays) for n, row in enumerate(header["prototypes"])]
    instances = tuple(
        Instance(tuple(path), tuple(products), prototypes[n].key, transform)
        for (path, products, n), transform in zip(header["instances"], arrays["transforms"], strict=True)
    )
    assembly = Assembly(
        name=header["name"],
        prototypes={prototype.key: prototype for prototype in prototypes},
        instances=instances,
        problems=_problems_in(header["problems"]),
        source=header["source"],
        unit=header["unit"],
        frames={tuple(path): f for path, f in zip(header["frames"], arrays["frames"], strict=True)},
    )
    return assembly, header["extra"]


def _prototype_in(number: int, row: dict[str, Any], arrays: Any) -> Prototype:
    mesh = None
    if f"faces_{number}" in arrays.files:
        mesh = Mesh(arrays[f"vertices_{number}"], arrays[f"faces_{number}"])
    return Prototype(**{**row, "problems": _problems_in(row["problems"])}, mesh=mesh)


KERNELS = ("cadquery-ocp-novtk", "cadquery-ocp", "trimesh", "manifold3d", "numpy")

MAX_BYTES = 1_000_000_000
"""Of all that is kept; an assembly of a thousand parts with its picture takes some 20 MB."""


def default_folder() -> Path:
    """Return the folder in which readings are kept. Nothing is created."""
    return cache_folder() / "geometry"


def key_of(path: Path, options: Mapping[str, Any]) -> str:
    """Return the key under which the reading of a file is kept."""
    return hashlib.sha256("\n".join(key_parts(path, options)).encode("utf-8")).hexdigest()


def key_parts(path: Path, options: Mapping[str, Any]) -> list[str]:
    """List all on which a result depends. The file's name counts, since unnamed parts get it."""
    content, asked = content_hash(path), json.dumps(options, sort_keys=True)
    return [content, path.name, str(FORMAT), _versions(), measured_by(), asked]


@cache
def measured_by() -> str:
    """Return a fingerprint of the code that reads and measures, since another version's numbers may
    differ.
    """
    package = Path(__file__).resolve().parent
    values = (package.parent / f"{name}.py" for name in ("arrays", "assembly", "notes", "placements"))
    return fingerprint([*package.rglob("*.py"), *values])


def fingerprint(paths: Iterable[Path]) -> str:
    """Hash all these files with SHA-256."""
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(f"{path.name}\0{content_hash(path)}\n".encode())
    return digest.hexdigest()


def _versions() -> str:
    versions = []
    for name in KERNELS:
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return ", ".join(versions)


@dataclass(frozen=True)
class Cache:
    """One folder of stored readings; ``max_bytes`` in all."""

    folder: Path
    max_bytes: int = MAX_BYTES

    def get(self, key: str, source: Path) -> Assembly | None:
        """Return the stored assembly of ``source``, under its present path; None if none is stored that is
        still valid.
        """
        path = self._path(key)
        if not path.is_file():
            return None
        try:
            assembly, extra = load(path)
        except InputError:
            return None
        if not _holds(extra, source):
            return None
        with suppress(OSError):
            os.utime(path)  # recently used readings stay
        return replace(assembly, source=str(source))

    def put(self, key: str, stored: Path) -> None:
        """Store the file ``stored``, atomically. If the cache cannot be written, that is no error."""
        target = self._path(key)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with replacing(target) as stream:
                stream.write(stored.read_bytes())
            self._make_room()
        except OSError:
            return

    def _make_room(self) -> None:
        """Delete the entries that were not used for longest, until the rest fits."""
        kept = []
        for path in self.folder.glob("*/*.npz"):
            with suppress(OSError):
                stat = path.stat()
                kept.append((stat.st_mtime_ns, stat.st_size, path))
        size = sum(count for _, count, _ in kept)
        for _, one, path in sorted(kept):
            if size <= self.max_bytes:
                return
            remove_patiently(path)
            size -= one

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / f"{key}.npz"


def provenance(reading: GeometryReading, options: ReadOptions) -> dict[str, Any]:
    """Return everything besides its own bytes on which a reading depends. It is kept with it, and
    :meth:`Cache.get` checks it.
    """
    folder = Path(reading.assembly.source).resolve().parent
    return {
        "others": {relative(str(path), str(folder)): content_hash(path) for path in reading.others},
        "missing": sorted({file_key(name) for name in reading.missing}),
        "absent": sorted(relative(str(path), str(folder)) for path in reading.absent),
        "depth": options.sibling_depth,
    }


def _holds(extra: Mapping[str, Any], source: Path) -> bool:
    folder = source.resolve().parent
    others: Mapping[str, str] = extra.get("others", {})
    for name, digest in others.items():
        path = folder / name
        if not path.is_file() or content_hash(path) != digest:
            return False
    if any((folder / name).exists() for name in extra.get("absent", ())):
        return False
    missing = set(extra.get("missing", ()))
    return not missing or not any(
        file_key(path.stem) in missing for path in step_files(folder, int(extra.get("depth", 0)))
    )


def changed_since(begin_ns: int, extra: Mapping[str, Any], source: Path) -> bool:
    """Return True if a file read beside ``source`` was written after ``begin_ns`` (:func:`time.time_ns`).

    The same counts for a file that was copied there: a copy may keep the old time of writing, but its entry
    in the folder is new.
    """
    folder = source.resolve().parent
    for name in extra.get("others", {}):
        try:
            stat = (folder / name).stat()
            if max(stat.st_mtime_ns, stat.st_ctime_ns) > begin_ns:
                return True
        except OSError:
            return True
    return False
