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
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from silo.bom.entry import Extraction
from silo.bom.errors import ConfigError, DocumentError, InputError, SiloError
from silo.bom.message import from_carried, message
from silo.bom.snapshot import from_plain
from silo.bom.system_refusals import why_refused
from silo.freecads.places import commands, exchange_folder, start
from silo.platform import processes
from silo.platform.whole_files import scratch_folder

HEADLESS = Path(__file__).resolve().parents[1] / "workbench" / "headless.py"
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
                message(
                    "{wanted} cannot be run; SILO_FREECADCMD must name FreeCAD's freecadcmd, its "
                    "AppImage or what Flatpak exports (…/flatpak/exports/bin/org.freecad.FreeCAD)",
                    wanted=wanted,
                )
            )
        return command
    command = next(commands(env), None)
    if command is None:
        raise ConfigError(
            message(
                "no FreeCAD found: freecadcmd is not on the PATH, nor where FreeCAD is usually "
                "installed. Install FreeCAD, or set SILO_FREECADCMD to its freecadcmd or AppImage"
            )
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
    return command, ".".join(map(str, version)) or message("of an unknown version")


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
                    **processes.child_options(),
                )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise ConfigError(
                message("{command} does not answer: {error}", command=command, error=error)
            ) from error
        try:
            return json.loads(out.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            how, words = _last_words(run.returncode, log)
            raise ConfigError(
                message(
                    "{command} did not answer: it {how}. It said: {words}",
                    command=command,
                    how=how,
                    words=words,
                )
            ) from None


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
        return DocumentError(error["path"], from_carried(error["reason"]))
    return InputError(from_carried(error["message"]))


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
                    **processes.child_options(group=True),
                )
        except OSError as error:
            self._folder.cleanup()
            raise ConfigError(
                message(
                    "{freecadcmd} cannot be started: {error}",
                    freecadcmd=self.freecadcmd,
                    error=why_refused(error),
                )
            ) from error
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
            return DocumentError(
                path,
                message("FreeCAD did not finish it within {timeout_s} s", timeout_s=f"{self.timeout_s:g}"),
            )
        if not self.begun:
            raise ConfigError(
                message(
                    "{freecadcmd} did not work: it {how}. It said: {said}",
                    freecadcmd=self.freecadcmd,
                    how=self._how,
                    said=self._said,
                )
            )
        return DocumentError(path, message("FreeCAD died while it read this file: it {how}", how=self._how))

    def _stop(self) -> None:
        if self._process is not None:
            processes.end(self._process)


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
    return processes.how_it_ended(code), " / ".join(lines[-3:]) or message("nothing")
