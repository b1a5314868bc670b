# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD as a child process: BOMs of many files, read by ``freecadcmd``, each on its own.

``freecadcmd script.py args`` would open the arguments as files, run a failing script twice and exit 0 all the
same (measured, 0.20 to 1.1). So: ``-c`` with runpy, arguments in a file that the environment names, results
in another one, whose lines also show at which file FreeCAD died or hung. It is then started again for the
rest.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from silo import platform
from silo.bom.errors import CancelledError, ConfigError, DocumentError, InputError, SiloError
from silo.bom.model import Extraction
from silo.bom.report import from_plain
from silo.folders import scratch_folder
from silo.freecads import commands, exchange_folder, start

HEADLESS = Path(__file__).resolve().parents[1] / "workbench" / "headless.py"
# FreeCAD opens large assemblies in minutes; this is per file.
TIMEOUT_S = 900.0
_POLL_S = 0.05
_CODE = 'import os, runpy; runpy.run_path(os.environ["SILO_SCRIPT"], run_name="__main__")'


def find_freecadcmd(given: str | None = None, env: Mapping[str, str] = os.environ) -> str:
    """The ``freecadcmd`` to start: the given one, ``SILO_FREECADCMD``, or one found. ConfigError if none."""
    wanted = given or env.get("SILO_FREECADCMD")
    if wanted:
        found = shutil.which(wanted)
        if found is None:
            raise ConfigError(
                f"{wanted} cannot be run; SILO_FREECADCMD must name FreeCAD's freecadcmd, its AppImage "
                "or what Flatpak exports (…/flatpak/exports/bin/org.freecad.FreeCAD)"
            )
        return found
    found = next(commands(env), None)
    if found is None:
        raise ConfigError(
            "no FreeCAD found: freecadcmd is not on the PATH, nor where FreeCAD is usually installed. "
            "Install FreeCAD, or set SILO_FREECADCMD to its freecadcmd or AppImage"
        )
    return found


def run_freecad(
    tops: Sequence[str],
    assembly: str | None = None,
    *,
    command: str | None = None,
    timeout_s: float = TIMEOUT_S,
    env: Mapping[str, str] | None = None,
    hardware: bool = True,
) -> Iterator[tuple[str, Extraction | SiloError]]:
    """Read each file in FreeCAD; results in order, as they come.

    timeout_s
        for one file, FreeCAD's start included.
    env
        set in FreeCAD's environment beside our own, such as ``FREECAD_USER_HOME``.

    A file that FreeCAD cannot read, dies of or hangs on gives its error, and the rest is still read.
    ConfigError where there is no FreeCAD, or where it does not start.
    """
    settings = {"assembly": assembly, "no_hardware": not hardware}
    for top, line in _each(tops, settings, command, timeout_s, env):
        yield top, line if isinstance(line, SiloError) else _result(line)


@dataclass(frozen=True)
class Witnessed:
    """A BOM as live FreeCAD has it, and for each assembly the solids shown and those explained."""

    extraction: Extraction
    accounts: tuple[Mapping[str, Any], ...]

    @property
    def agrees(self) -> bool:
        """True where every assembly's solids are explained."""
        return all(account["agrees"] for account in self.accounts)


def verify_in_freecad(
    tops: Sequence[str],
    assembly: str | None = None,
    *,
    command: str | None = None,
    timeout_s: float = TIMEOUT_S,
    env: Mapping[str, str] | None = None,
    hardware: bool = True,
) -> Iterator[tuple[str, Witnessed | SiloError]]:
    """As :func:`run_freecad`, with the geometry as witness (``silo.workbench.freecad.witness``)."""
    settings = {"assembly": assembly, "no_hardware": not hardware, "verify": True}
    for top, line in _each(tops, settings, command, timeout_s, env):
        if isinstance(line, SiloError):
            yield top, line
        else:
            found = _result(line)
            yield top, Witnessed(found, tuple(line["witness"])) if isinstance(found, Extraction) else found


def _each(
    tops: Sequence[str],
    settings: Mapping[str, Any],
    command: str | None,
    timeout_s: float,
    env: Mapping[str, str] | None,
) -> Iterator[tuple[str, dict[str, Any] | SiloError]]:
    """What FreeCAD wrote of each file. It is started again for the rest where it dies or hangs."""
    freecadcmd = find_freecadcmd(command)
    rest = [os.path.abspath(top) for top in tops]
    told = dict(zip(rest, tops, strict=True))
    given = {key: value for key, value in settings.items() if value}
    while rest:
        with FreeCADRun(freecadcmd, HEADLESS, {**given, "tops": rest}, timeout_s, env or {}) as run:
            for line in run.lines():
                path = rest.pop(0)
                yield told[path], line
        if rest:
            # The process is over, and this file was not finished.
            failed = rest.pop(0)
            yield told[failed], run.failure(failed)


def _result(line: Mapping[str, Any]) -> Extraction | SiloError:
    error = line.get("error")
    return from_plain(line["extraction"]) if error is None else told_error(error)


def told_error(error: Mapping[str, str]) -> SiloError:
    """An error that the script inside FreeCAD wrote into its lines."""
    if error.get("path") and error.get("reason"):
        return DocumentError(error["path"], error["reason"])
    return InputError(error["message"])


@dataclass
class FreeCADRun:
    """One process that does one job, and writes its results as JSON lines.

    script
        runs inside FreeCAD. The file that ``SILO_ARGS_FILE`` names holds ``job`` and where ``lines`` go.
    timeout_s
        for one line, FreeCAD's start included.
    """

    freecadcmd: str
    script: Path
    job: Mapping[str, Any]
    timeout_s: float
    env: Mapping[str, str]
    cancelled: Callable[[], bool] | None = None
    begun: bool = False
    timed_out: bool = False
    _folder: tempfile.TemporaryDirectory[str] = field(init=False)
    _process: subprocess.Popen[bytes] | None = None

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
            "SILO_SCRIPT": str(self.script),
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
        self._last_words = _last_lines(self._log)
        self._folder.cleanup()

    def lines(self) -> Iterator[dict[str, Any]]:
        """The results as they are written; ends with the process, or with its time. CancelledError."""
        assert self._process is not None  # entered
        deadline = time.monotonic() + self.timeout_s
        with open(self._results, encoding="utf-8") as results:
            while True:
                # Asked first: what a process wrote before it ended is read in this same round.
                over = self._process.poll() is not None
                for line in _complete_lines(results):
                    if "stage" in line:
                        # How far it is, within the file's own time.
                        yield line
                        continue
                    deadline = time.monotonic() + self.timeout_s
                    self.begun = "begun" in line
                    if not self.begun:
                        yield line
                        # The reader may have taken its time; FreeCAD's runs from now.
                        deadline = time.monotonic() + self.timeout_s
                if over:
                    return
                if self.cancelled is not None and self.cancelled():
                    raise CancelledError("reading in FreeCAD was cancelled")
                if time.monotonic() > deadline:
                    self.timed_out = True
                    return
                time.sleep(_POLL_S)

    def failure(self, path: str) -> SiloError:
        """Why the file that was being read has no result. ConfigError where FreeCAD never got that far."""
        if self.timed_out:
            return DocumentError(path, f"FreeCAD did not finish it within {self.timeout_s:g} s")
        assert self._process is not None  # entered
        code = self._process.returncode
        how = platform.how_it_ended(code)
        if not self.begun:
            raise ConfigError(f"{self.freecadcmd} did not work ({how}). It said: {self._last_words}")
        return DocumentError(path, f"FreeCAD died while it read this file ({how})")

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


def _last_lines(log: Path, count: int = 3) -> str:
    text = log.read_text(encoding="utf-8", errors="replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return " / ".join(lines[-count:]) or "nothing"
