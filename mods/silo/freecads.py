# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where FreeCADs lie on Windows, macOS and Linux: the command, material cards, caches, folders they read.

Gathered from FreeCAD's installers and packages (the Windows installer for all users or for one, the bundle
for macOS, Debian, conda, Snap, Flatpak). Of several versions the newest comes first. Standard library only.

Which files a running FreeCAD of this user has open: it would later overwrite what we write there.

FreeCAD (0.20 to 1.1) keeps a folder ``<program>_Doc_<Uid>_<hash>_<number>`` in its cache for each open
document, the hash being the first six digits of the SHA-1 of the file's path, and holds a lock on
``<program>_<number>.lock`` while it runs (App/Document.cpp, Gui/Application.cpp; seen in all three). Where
the platform cannot say whether a lock is held, nothing is known and nothing is reported; the same goes for a
FreeCAD of another user or machine. Standard library only.

FreeCAD as a child process: BOMs of many files, read by ``freecadcmd``, each on its own.

``freecadcmd script.py args`` would open the arguments as files, run a failing script twice and exit 0 all the
same (measured, 0.20 to 1.1). So: ``-c`` with runpy, arguments in a file that the environment names, results
in another one, whose lines also show at which file FreeCAD died or hung. It is then started again for the
rest.

The add-on into a FreeCAD on this machine: its folder into ``Mod``, its packages where FreeCAD looks.

FreeCAD itself is asked where that is and which Python it has (facts §7.2, §7.3): 0.20 takes packages from
``AdditionalPythonPackages``, later ones from ``AdditionalPythonPackages/py<XY>``. The packages are chosen for
FreeCAD's Python, not for the one that runs this, and FreeCAD imports them before this reports success.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from silo import FREECAD_PACKAGES, platform
from silo.bom.errors import ConfigError, DocumentError, InputError, SiloError
from silo.bom.model import Extraction
from silo.bom.report import from_plain
from silo.files import shipped
from silo.platform import (
    NAME,
    Spelling,
    child_options,
    is_locked,
    python_beside,
    remove_patiently,
    scratch_folder,
)

_COMMANDS = ("freecadcmd", "FreeCADCmd", "freecadcmd-daily", "freecad.cmd")
_FLATPAK = "org.freecad.FreeCAD"
_ROOT = Path("/")
_MOVED_CACHES = (("FREECAD_USER_TEMP", ""), ("FREECAD_USER_HOME", "temp"))
_WINDOWS_CACHES = (("LOCALAPPDATA", "/cache"), ("TEMP", ""))
_APPIMAGES = ("~/Applications", "~/AppImages", "~/.local/bin", "/opt")
_BUNDLES = ("/Applications", "~/Applications")


def commands(env: Mapping[str, str] = os.environ, platform: str = NAME, root: Path = _ROOT) -> Iterator[str]:
    """Yield every ``freecadcmd`` that can be started here, those on the PATH first. ``root``: the root of the
    disk.
    """
    on_path = (shutil.which(name, path=env.get("PATH")) for name in _COMMANDS)
    elsewhere = (str(path) for path in _matching(env, root, *_command_places(env, platform)))
    # Windows and macOS find one program under two of these names.
    real, seen = Spelling().real, set()
    for command_path in (*filter(None, on_path), *elsewhere):
        if os.access(command_path, os.X_OK) and real(command_path) not in seen:
            seen.add(real(command_path))
            yield command_path


def _command_places(env: Mapping[str, str], platform: str) -> tuple[str, ...]:
    if platform == "win32":
        return tuple(f"{base}/bin/{name}.exe" for base in _windows(env) for name in _COMMANDS[:2])
    if platform == "darwin":
        return tuple(f"{base}/FreeCAD*.app/Contents/Resources/bin/freecadcmd" for base in _BUNDLES)
    return (
        "/snap/bin/freecad.cmd",
        "/usr/local/bin/freecadcmd",
        "~/.local/bin/freecadcmd",
        *(f"{base}/exports/bin/{_FLATPAK}" for base in _flatpak_bases()),
        *(f"{folder}/FreeCAD*.AppImage" for folder in _APPIMAGES),
    )


def start(command: str) -> list[str]:
    """Return the command line that starts FreeCAD without its window; for some packages that is more than a
    path.
    """
    name = os.path.basename(command)
    if name.casefold().endswith(".appimage"):
        return [command, "freecadcmd"]  # an AppImage runs the program that its first argument names
    if name == _FLATPAK:
        return ["flatpak", "run", "--die-with-parent", "--command=FreeCADCmd", _FLATPAK]
    return [command]


def material_folders(
    env: Mapping[str, str] = os.environ, platform: str = NAME, root: Path = _ROOT
) -> Iterator[Path]:
    """Yield folders with material cards: FreeCAD's own, then the user's. ``root``: the root of the disk."""
    if platform == "win32":
        shipped = [f"{base}/{data}Mod/Material" for base in _windows(env) for data in ("data/", "")]
        own = ["{APPDATA}/FreeCAD"]
    elif platform == "darwin":
        inside = ("share/Mod", "data/Mod", "Mod")
        shipped = [f"{b}/FreeCAD*.app/Contents/Resources/{m}/Material" for b in _BUNDLES for m in inside]
        own = ["~/Library/Application Support/FreeCAD", "~/Library/Preferences/FreeCAD"]
    else:
        bases = (
            "/usr/share/freecad",
            "/usr/lib/freecad",
            "/usr/local/share/freecad",
            "/usr/lib/freecad-daily",
        )
        packed = (
            "/snap/freecad/current/usr/share/freecad",
            *(f"{base}/app/{_FLATPAK}/current/active/files" for base in _flatpak_bases()),
            *(f"{base}/app/{_FLATPAK}/current/active/files/share/freecad" for base in _flatpak_bases()),
        )
        shipped = [f"{base}/Mod/Material" for base in (*bases, *packed)]
        own = ["~/.local/share/FreeCAD", f"~/.var/app/{_FLATPAK}/data/FreeCAD", "~/snap/freecad/common"]
    yield from _matching(env, root, *shipped)
    # FreeCAD 1.1 keeps a folder of the user for each version.
    yield from _matching(env, root, *(f"{folder}/{part}Material" for folder in own for part in ("", "v*/")))


def cache_folders(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Iterator[Path]:
    """Yield the cache folders of this user's FreeCADs."""
    # Both are used as they are; the others get a folder for the program (App/ApplicationDirectories).
    moved = [Path(env[name], part) for name, part in _MOVED_CACHES if env.get(name)]
    yield from (folder for folder in moved if folder.is_dir())
    if platform == "win32":
        bases = [f"{{{name}}}{part}" for name, part in _WINDOWS_CACHES if env.get(name)]
    elif platform == "darwin":
        bases = ["~/Library/Caches"]
    else:
        bases = ["{XDG_CACHE_HOME}"] if env.get("XDG_CACHE_HOME") else []
        bases += ["~/.cache", f"~/.var/app/{_FLATPAK}/cache", "~/snap/freecad/common/.cache"]
    yield from _matching(env, _ROOT, *(f"{base}/FreeCAD/Cache" for base in bases))


def exchange_folder(command: str, env: Mapping[str, str] = os.environ) -> str | None:
    """Return the folder in which a FreeCAD can see our files; None if it sees any temporary folder.

    Under Snap and Flatpak, a program has its own ``/tmp`` and sees only a part of the user's home.
    """
    real = os.path.realpath(command)
    home = Path(env.get("HOME") or Path.home())
    if command.startswith(("/snap/", "/var/lib/snapd/")) or os.path.basename(real) == "snap":
        return str(home / "snap" / "freecad" / "common")
    if os.path.basename(command) == _FLATPAK or "flatpak" in command or "flatpak" in real:
        return str(home / ".var" / "app" / _FLATPAK / "cache")
    return None


def _windows(env: Mapping[str, str]) -> list[str]:
    """Find programs that are installed for all users, or for one."""
    roots = [name for name in ("PROGRAMFILES", "PROGRAMW6432", "LOCALAPPDATA") if env.get(name)]
    places = [f"{{{name}}}" for name in roots]
    places += ["{LOCALAPPDATA}/Programs"] if "LOCALAPPDATA" in roots else []
    return [f"{place}/FreeCAD*" for place in places]


def _flatpak_bases() -> tuple[str, str]:
    return "/var/lib/flatpak", "~/.local/share/flatpak"


def _matching(env: Mapping[str, str], root: Path, *patterns: str) -> Iterator[Path]:
    """Yield the existing paths that match, each once; those of one pattern with the newest version first."""
    seen = set()
    for pattern in patterns:
        for path in sorted(_glob(env, root, pattern), key=_version, reverse=True):
            if path not in seen:
                seen.add(path)
                yield path


def _glob(env: Mapping[str, str], root: Path, pattern: str) -> Iterator[Path]:
    first, *rest = pattern.split("/")
    if first == "~":
        base = Path(env.get("HOME") or Path.home())
    elif first.startswith("{"):
        base = Path(env.get(first.strip("{}")) or os.devnull)
    else:
        base = root
    return base.glob("/".join(rest))


def _version(path: Path) -> list[tuple[int, ...]]:
    return [tuple(map(int, re.findall(r"\d+", part))) for part in path.parts]


_FOLDER = re.compile(r"(?P<program>.+)_Doc_[0-9a-fA-F-]{36}_(?P<hash>[0-9a-f]{6})_(?P<number>\d+)")


class OpenInFreecad:
    """What the FreeCADs that use these cache folders have open now.

    but_not
        the number of a FreeCAD that does not count; by default this process, should it be one. Our own lock
        must not even be looked at, since closing the file would give the lock up.
    """

    def __init__(self, caches: Iterable[str | Path], but_not: str = str(os.getpid())) -> None:
        self._hashes = frozenset(digest for cache in caches for digest in _open_in(cache, but_not))

    def has(self, *paths: str) -> bool:
        """Return True if FreeCAD has the file open under one of these spellings."""
        return any(
            hashlib.sha1(os.fsencode(path), usedforsecurity=False).hexdigest()[:6] in self._hashes
            for path in paths
            if path
        )

    def has_file(self, path: str) -> bool:
        """Return True if FreeCAD has the file open under its given, its absolute or its real path.

        FreeCAD writes "/" on Windows too.
        """
        absolute = os.path.abspath(path)
        spellings = (path, absolute, os.path.realpath(path))
        return self.has(*spellings, *(spelt.replace("\\", "/") for spelt in spellings))


def open_in_any() -> OpenInFreecad:
    """Find what any FreeCAD of this user has open now."""
    return OpenInFreecad(cache_folders())


def open_in_others(own_folder: str) -> OpenInFreecad:
    """Find what FreeCADs other than this one have open now.

    own_folder
        the cache folder of a document that is open here (``Document.TransientDir``); without it, nothing is
        found.
    """
    cache, name = os.path.split(own_folder.rstrip("/\\"))
    own = _FOLDER.fullmatch(name)
    return OpenInFreecad((), "") if own is None else OpenInFreecad((cache,), own["number"])


def _open_in(cache: str | Path, but_not: str) -> frozenset[str]:
    try:
        names = os.listdir(cache)
    except OSError:
        return frozenset()
    matches = [match for name in names if (match := _FOLDER.fullmatch(name)) and match["number"] != but_not]
    locks = {f"{match['program']}_{match['number']}.lock" for match in matches}
    alive = {lock for lock in locks if is_locked(os.path.join(cache, lock))}
    # A folder whose lock is free is what a FreeCAD that crashed has left behind.
    return frozenset(m["hash"] for m in matches if f"{m['program']}_{m['number']}.lock" in alive)


HEADLESS = Path(__file__).resolve().parent / "workbench" / "headless.py"
# FreeCAD opens large assemblies in minutes; this is per file.
TIMEOUT_S = 900.0
_POLL_S = 0.05
_ASK_S = 120.0
_CODE = 'import os, runpy; runpy.run_path(os.environ["SILO_SCRIPT"], run_name="__main__")'


def find_freecadcmd(given: str | None = None, env: Mapping[str, str] = os.environ) -> str:
    """Find the ``freecadcmd`` to start: the given one, that of ``SILO_FREECADCMD``, or an installed one.
    ConfigError if there is none.
    """
    wanted = given or env.get("SILO_FREECADCMD")
    if wanted:
        command = shutil.which(wanted)
        if command is None:
            raise ConfigError(
                f"{wanted} cannot be run; SILO_FREECADCMD must name FreeCAD's freecadcmd, its AppImage "
                "or what Flatpak exports (…/flatpak/exports/bin/org.freecad.FreeCAD)"
            )
        return command
    command = next(commands(env), None)
    if command is None:
        raise ConfigError(
            "no FreeCAD found: freecadcmd is not on the PATH, nor where FreeCAD is usually installed. "
            "Install FreeCAD, or set SILO_FREECADCMD to its freecadcmd or AppImage"
        )
    return command


_VERSION = """
import FreeCAD, json, os
with open(os.environ["SILO_OUT"], "w") as out:
    json.dump([int(part) for part in FreeCAD.Version()[:2]], out)
"""


def freecad_for(saved_by: tuple[int, ...]) -> tuple[str, str]:
    """Find a FreeCAD that can open what the version ``saved_by`` saved: its command, and its own version.

    It is the first one that is not older, else the newest. The one that ``SILO_FREECADCMD`` names is always
    taken. ConfigError if there is none.
    """
    given = [find_freecadcmd()] if os.environ.get("SILO_FREECADCMD") else None
    versions: list[tuple[tuple[int, ...], str]] = []
    for command in given or commands():
        with suppress(ConfigError):
            versions.append((tuple(ask_inside(command, _VERSION, {})), command))
            if versions[-1][0] >= saved_by:
                break
    version, command = max(versions, key=lambda pair: pair[0]) if versions else ((), find_freecadcmd())
    return command, ".".join(map(str, version)) or "of an unknown version"


def ask_inside(command: str, script: str, env: Mapping[str, str]) -> Any:
    """Run a script inside FreeCAD; return the JSON that it wrote to the file ``SILO_OUT``. ConfigError.

    The script is in a file, since FreeCAD 1.1 ends at once if the text after ``-c`` has about 250 characters.
    """
    shared = exchange_folder(command)
    if shared is not None:
        os.makedirs(shared, exist_ok=True)
    with scratch_folder("silo-ask-", shared) as folder:
        out, path, log = (Path(folder) / name for name in ("answer.json", "ask.py", "log.txt"))
        path.write_text(script, encoding="utf-8")
        try:
            with open(log, "wb") as output:
                run = subprocess.run(
                    [*start(command), "-c", _CODE],
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    cwd=folder,
                    env={**os.environ, **env, "SILO_SCRIPT": str(path), "SILO_OUT": str(out)},
                    timeout=_ASK_S,
                    check=False,
                    **platform.child_options(),
                )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise ConfigError(f"{command} does not answer: {error}") from error
        try:
            return json.loads(out.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            how, words = _last_words(run.returncode, log)
            raise ConfigError(f"{command} did not answer: it {how}. It said: {words}") from None


def run_freecad(
    tops: Sequence[str],
    assembly: str | None = None,
    *,
    command: str | None = None,
    timeout_s: float = TIMEOUT_S,
    env: Mapping[str, str] | None = None,
    hardware: bool = True,
    witness: dict[str, list[dict[str, Any]]] | None = None,
) -> Iterator[tuple[str, Extraction | SiloError]]:
    """Read each file in FreeCAD; yields the results in order, as they come.

    timeout_s
        for one file, FreeCAD's start included.
    env
        set in FreeCAD's environment beside our own, such as ``FREECAD_USER_HOME``.
    witness
        receives what the geometry of each file shows (``silo.workbench.freecad.live``), by file.

    A file that FreeCAD cannot read, or that makes it crash or hang, gives an error; the rest is still read.
    ConfigError if there is no FreeCAD, or if it does not start.
    """
    freecadcmd = find_freecadcmd(command)
    rest = [os.path.abspath(top) for top in tops]
    answers = dict(zip(rest, tops, strict=True))
    settings = {"assembly": assembly, "no_hardware": not hardware, "verify": witness is not None}
    given = {key: value for key, value in settings.items() if value}
    while rest:
        with FreeCADRun(freecadcmd, {**given, "tops": rest}, timeout_s, env or {}) as run:
            for line in run.lines():
                top = answers[rest.pop(0)]
                if witness is not None:
                    witness[top] = line.get("witness", [])
                yield top, _result(line)
        if rest:
            # The process is over, and this file was not finished.
            failed = rest.pop(0)
            yield answers[failed], run.failure(failed)


def _result(line: Mapping[str, Any]) -> Extraction | SiloError:
    """Read the answer in one line: an extraction, or the error that the script inside FreeCAD wrote."""
    error = line.get("error")
    if error is None:
        return from_plain(line["extraction"])
    if error.get("path") and error.get("reason"):
        return DocumentError(error["path"], error["reason"])
    return InputError(error["message"])


@dataclass
class FreeCADRun:
    """One process that reads files in FreeCAD (``HEADLESS``), and writes its results as JSON lines.

    job
        stands in the file that ``SILO_ARGS_FILE`` names, with the file where ``lines`` go.
    timeout_s
        for one line, FreeCAD's start included.
    """

    freecadcmd: str
    job: Mapping[str, Any]
    timeout_s: float
    env: Mapping[str, str]
    begun: bool = False
    timed_out: bool = False
    _folder: tempfile.TemporaryDirectory[str] = field(init=False)
    _process: subprocess.Popen[bytes] | None = None
    _how: str = ""
    _said: str = ""

    def __post_init__(self) -> None:
        shared = exchange_folder(self.freecadcmd)
        if shared is not None:
            os.makedirs(shared, exist_ok=True)
        self._folder = scratch_folder("silo-freecad-", shared)

    @property
    def _results(self) -> Path:
        return Path(self._folder.name) / "results.jsonl"

    @property
    def _log(self) -> Path:
        return Path(self._folder.name) / "log.txt"

    def __enter__(self) -> FreeCADRun:
        self._results.touch()
        job = Path(self._folder.name) / "job.json"
        job.write_text(json.dumps({**self.job, "lines": str(self._results)}), encoding="utf-8")
        env = {
            **os.environ,
            **self.env,
            "SILO_SCRIPT": str(HEADLESS),
            "SILO_ARGS_FILE": str(job),
        }
        try:
            with open(self._log, "wb") as log:
                self._process = subprocess.Popen(
                    [*start(self.freecadcmd), "-c", _CODE],
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    # FreeCAD reads a FreeCAD.cfg in the current folder; here is none.
                    cwd=self._folder.name,
                    env=env,
                    **platform.child_options(group=True),
                )
        except OSError as error:
            self._folder.cleanup()
            raise ConfigError(f"{self.freecadcmd} cannot be started: {error.strerror or error}") from error
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()
        if self._process is not None:
            self._how, self._said = _last_words(self._process.returncode, self._log)
        self._folder.cleanup()

    def lines(self) -> Iterator[dict[str, Any]]:
        """Yield the results as they are written, until the process ends or its time is over."""
        assert self._process is not None  # entered
        deadline = time.monotonic() + self.timeout_s
        with open(self._results, encoding="utf-8") as results:
            while True:
                # Asked first, so that lines that a process wrote before its end are read in this round.
                over = self._process.poll() is not None
                for line in _complete_lines(results):
                    deadline = time.monotonic() + self.timeout_s
                    self.begun = "begun" in line
                    if not self.begun:
                        yield line
                        # The reader may have taken its time; FreeCAD's runs from now.
                        deadline = time.monotonic() + self.timeout_s
                if over:
                    return
                if time.monotonic() > deadline:
                    self.timed_out = True
                    return
                time.sleep(_POLL_S)

    def failure(self, path: str) -> SiloError:
        """Say why the file that was being read has no result. Raises ConfigError if FreeCAD did not even
        begin.
        """
        if self.timed_out:
            return DocumentError(path, f"FreeCAD did not finish it within {self.timeout_s:g} s")
        if not self.begun:
            raise ConfigError(f"{self.freecadcmd} did not work: it {self._how}. It said: {self._said}")
        return DocumentError(path, f"FreeCAD died while it read this file: it {self._how}")

    def _stop(self) -> None:
        if self._process is not None:
            platform.end(self._process)


def _complete_lines(file: IO[str]) -> Iterator[dict[str, Any]]:
    while True:
        place = file.tell()
        line = file.readline()
        if not line.endswith("\n"):
            file.seek(place)
            return
        yield json.loads(line)


# FreeCAD catches the signals of a crash, prints where it was, and ends with 1 like any program (0.20 to 1.1).
_CRASHED = re.compile(r"Program received signal (SIGSEGV|SIGABRT|SIGILL|SIGFPE)")


def _last_words(code: int, log: Path) -> tuple[str, str]:
    """Say how a FreeCAD ended, and return its last lines of output, without those of a crash."""
    text = log.read_text(encoding="utf-8", errors="replace")
    if crash := _CRASHED.search(text):
        code, text = -signal.Signals[crash[1]], text[: crash.start()]
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return platform.how_it_ended(code), " / ".join(lines[-3:]) or "nothing"


# The Addon Manager's name for it, so that there is only one folder; and the earlier name.
FOLDER, OLD_FOLDER = "silo-mod", "Silo"

_ASK = """
import importlib, json, os, sys
import FreeCAD
version = [int(part) for part in FreeCAD.Version()[:2]]
data = os.environ["SILO_ASK_DATA"] or FreeCAD.getUserAppDataDir()
packages = os.path.join(data, "AdditionalPythonPackages")
if version >= [1, 0]:
    packages = os.path.join(packages, "py%d%d" % sys.version_info[:2])
if packages not in sys.path:
    sys.path.append(packages)
missing = {}
for name in os.environ["SILO_ASK_NAMES"].split():
    try:
        importlib.import_module(name)
    except Exception as error:
        missing[name] = "%s: %s" % (type(error).__name__, error)
try:
    from addonmanager_freecad_interface import Preferences
    constraints = Preferences().get("pip_constraints_path") or ""
except Exception:
    constraints = ""
with open(os.environ["SILO_OUT"], "w", encoding="utf-8") as out:
    json.dump({"data": data, "packages": packages, "freecad": version, "python": sys.version_info[:2],
               "prefix": sys.base_exec_prefix, "missing": missing, "constraints": constraints}, out)
"""
_ASK_SECONDS, _PIP_SECONDS = 60.0, 600.0


@dataclass(frozen=True)
class Installation:
    """A FreeCAD: how it is started, its data folder, its folder for packages, its version and its Python's.

    pythons
        where that Python may be started.
    missing
        import name of a package that the add-on needs → what importing it inside FreeCAD says.
    constraints
        where FreeCAD's add-on manager has its list of versions that go together; "" without one.
    """

    command: str
    data: Path
    packages: Path
    freecad: tuple[int, int]
    python: tuple[int, int]
    pythons: tuple[str, ...] = ()
    missing: Mapping[str, str] = field(default_factory=dict)
    constraints: str = ""

    @property
    def mod(self) -> Path:
        """Return the folder into which the add-on is installed."""
        return self.data / "Mod" / FOLDER


def ask_freecad(freecadcmd: str | None = None, data: Path | None = None) -> Installation:
    """Ask FreeCAD for its folders and versions, and let it import what the add-on needs. Raises ConfigError.

    data
        replaces the data folder that FreeCAD names.
    """
    command = find_freecadcmd(freecadcmd)
    env = {"SILO_ASK_DATA": str(data or ""), "SILO_ASK_NAMES": " ".join(FREECAD_PACKAGES)}
    answer = ask_inside(command, _ASK, env)
    (major, minor), python = answer["freecad"], answer["python"]
    return Installation(
        command,
        Path(answer["data"]),
        Path(answer["packages"]),
        (major, minor),
        (python[0], python[1]),
        (*python_beside(answer["prefix"]), *python_beside(os.path.dirname(os.path.realpath(command)))),
        answer["missing"],
        answer["constraints"],
    )


def _pip_words(run: subprocess.CompletedProcess[str]) -> str:
    return next(iter((run.stderr or run.stdout).strip().splitlines()[-1:]), "it said nothing")


def _run(command: list[str], seconds: float, **more: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        timeout=seconds,
        check=False,
        **child_options(),
        **more,
    )


def _has_pip(python: str, version: tuple[int, int] | None = None) -> bool:
    """Return True if this is a Python with pip; if ``version`` is given, of that version."""
    code = "import pip, sys; print(*sys.version_info[:2])"
    try:
        ran = _run([python, "-c", code], _ASK_SECONDS)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return not ran.returncode and (version is None or ran.stdout.split() == [str(part) for part in version])


def _any_python() -> str:
    """Find a Python with pip. Inside FreeCAD, ``sys.executable`` is FreeCAD."""
    paths = (sys.executable, shutil.which("python3"), shutil.which("python"), shutil.which("py"))
    for python in paths:
        if python and "freecad" not in os.path.basename(python).lower() and _has_pip(python):
            return python
    raise ConfigError(
        "no Python with pip was found on this computer. Install pip (on Debian and Ubuntu: apt install "
        "python3-pip), or Python from python.org, then try again"
    )


def install_folder(place: Installation, source: Path | None = None, *, copy: bool = False) -> str:
    """Link (or copy) the add-on into ``Mod``; returns what was done. A folder that is not ours is left alone.

    source
        a folder whose root has the files that FreeCAD loads: the checkout, or the wheel's files, which are
        copied.
    """
    source = source or shipped()
    if not (source / "package.xml").is_file():
        raise InputError(f"{source} holds no package.xml; install silo-mod again")
    whole = (source / "mods" / "silo").is_dir()
    copy = copy or not whole
    _remove_old(place)
    target = place.mod
    if target.is_symlink() and target.resolve() == source:
        return f"{target} leads to this checkout already"
    if target.exists() or target.is_symlink():
        if not copy or target.is_symlink() or not (target / "package.xml").is_file():
            raise InputError(f"{target} is there already; move it away, then repeat")
        shutil.rmtree(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    if copy:
        names = ("Init.py", "InitGui.py", "package.xml", "LICENSE", "README.md")
        target.mkdir()
        for name in names:
            shutil.copy2(source / name, target / name)
        modules = source / "mods" / "silo" if whole else Path(__file__).parent
        without = shutil.ignore_patterns("__pycache__", "shipped")
        shutil.copytree(modules, target / "mods" / "silo", ignore=without)
        if (source / "docs").is_dir():
            shutil.copytree(source / "docs", target / "docs", ignore=shutil.ignore_patterns("decisions"))
        return f"copied to {target}"
    try:
        target.symlink_to(source, target_is_directory=True)
    except OSError:  # Windows lets only administrators and developers make links
        return f"{install_folder(place, source, copy=True)} (this system makes no links)"
    return f"{target} now leads to this checkout"


def _remove_old(place: Installation) -> None:
    """Remove the add-on under the name of earlier versions: FreeCAD would start both."""
    old = place.data / "Mod" / OLD_FOLDER
    if (old / "package.xml").is_file() and (old / "mods" / "silo" / "workbench").is_dir():
        remove_patiently(old) if old.is_symlink() else shutil.rmtree(old)


def install_packages(place: Installation) -> str:
    """Install what the add-on lacks inside this FreeCAD, let FreeCAD import it, and return its folder.

    Packages that are there already stay unchanged, because other add-ons use them too. ConfigError if FreeCAD
    still cannot import one of the packages.
    """
    version = "{}.{}".format(*place.python)
    if place.python < (3, 11):
        raise ConfigError(f"this FreeCAD has Python {version}; the add-on needs 3.11 or newer")
    if not place.missing:
        return str(place.packages)
    names = [FREECAD_PACKAGES[name] for name in place.missing]
    install = ["install", "--quiet", "--target", str(place.packages), *names]
    # Packages there that cannot be imported, such as those for another Python, are useless.
    if any((place.packages / name).exists() for name in place.missing):
        install.append("--upgrade")
    own = next((python for python in place.pythons if _has_pip(python, place.python)), None)
    if own is not None:  # FreeCAD's own knows which packages fit it, and which processor it is made for
        command = [own, "-m", "pip", *install]
    else:
        command = [_any_python(), "-m", "pip", *install]
        command += ["--python-version", version, "--implementation", "cp", "--only-binary=:all:"]
    run = _run([*command, *_constraint(place)], _PIP_SECONDS)
    if (
        run.returncode and place.constraints
    ):  # the list is on the Internet, the packages may be on a server nearby
        run = _run(command, _PIP_SECONDS)
    if run.returncode:
        raise ConfigError(f"pip could not install {', '.join(names)} for Python {version}: {_pip_words(run)}")
    missing = ask_freecad(place.command, place.data).missing
    if missing:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in missing.items())
        raise ConfigError(f"the packages are in {place.packages}, but FreeCAD cannot import them: {reasons}")
    return str(place.packages)


def _constraint(place: Installation) -> list[str]:
    if not place.constraints:
        return []
    return ["--constraint", "{}/{}.{}/constraints.txt".format(place.constraints.rstrip("/"), *place.python)]
