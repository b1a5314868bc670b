# SPDX-License-Identifier: LGPL-2.1-or-later
"""The batch that runs inside ``freecadcmd``: many files, each on its own, results through files.

Started with its arguments in the environment (FreeCAD would open anything else on its command line)::

    SILO_ARGS='{"tops": ["vault"], "recursive": true, "report": "sync.md"}' \\
        freecadcmd -c 'import runpy; runpy.run_path(".../headless.py", run_name="__main__")' </dev/null

``SILO_ARGS`` is a JSON object, or ``SILO_ARGS_FILE`` names a file with one; docs/headless.md has its keys.
With ``lines`` the BOMs are only read, and
written there one JSON object per line as they are finished: that is how :mod:`silo.freecads.run` asks.
Otherwise they are synced with the server of ``SILO_API_URL`` and ``SILO_API_TOKEN`` (or the configuration).

Exit codes: those of the command line (:class:`silo.bom.errors.Exit`).
"""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

if sys.version_info < (3, 11):  # noqa: UP036  (FreeCAD brings its own Python, whatever ours is)
    sys.exit(f"Silo needs Python 3.11 or newer; this FreeCAD has {sys.version.split()[0]}")

if __name__ == "__main__":
    # Run by path: use this copy of the package, even if an installed add-on was loaded at start.
    for _name in [name for name in sys.modules if name == "silo" or name.startswith("silo.")]:
        del sys.modules[_name]
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from silo.bom.errors import ConfigError, DocumentError, Exit, InputError, SiloError, exit_of
from silo.bom.message import carried
from silo.files import documents_in
from silo.freecads.job import job_text
from silo.output_files import REPORTS, Output, beginning, check_outputs

if TYPE_CHECKING:
    from silo.batch import TopResult
    from silo.bom.entry import Extraction
    from silo.bom_sync.steps import Outcome
    from silo.workbench.freecad.witness import SolidCount


@dataclass(frozen=True, slots=True)
class HeadlessJob:
    """What ``SILO_ARGS`` asks for. Paths may be relative to the folder in which freecadcmd was started."""

    tops: tuple[str, ...]
    assembly: str | None = None
    lines: str | None = None
    json: str | None = None
    report: str | None = None
    recursive: bool = False
    dry_run: bool = False
    allow_missing: bool = False
    no_hardware: bool = False
    verify: bool = False

    @classmethod
    def from_text(cls, text: str | None) -> HeadlessJob:
        """Read a job; InputError names what is wrong."""
        try:
            data = json.loads(text or "")
        except ValueError as error:
            raise InputError(f"SILO_ARGS must be a JSON object such as {_EXAMPLE}; it is {text!r}") from error
        if not isinstance(data, dict):
            raise InputError(f"SILO_ARGS must be a JSON object such as {_EXAMPLE}; it is {text!r}")
        if unknown := sorted(set(data) - {f.name for f in fields(cls)}):
            raise InputError(f"SILO_ARGS has unknown keys: {', '.join(unknown)}")
        tops = data.get("tops")
        if not isinstance(tops, list) or not tops or not all(isinstance(top, str) and top for top in tops):
            raise InputError('SILO_ARGS: "tops" must be a list of files and folders, and not an empty one')
        for field in fields(cls)[1:]:
            wanted = bool if field.default is False else str
            if field.name in data and not isinstance(data[field.name], wanted):
                kind = "true or false" if wanted is bool else "a text"
                raise InputError(f'SILO_ARGS: "{field.name}" must be {kind}, got {data[field.name]!r}')
        return cls(**{**data, "tops": tuple(tops)})


_EXAMPLE = '{"tops": ["TopAssembly.FCStd"]}'


def main(env: Mapping[str, str] = os.environ) -> int:
    """Do the job that the environment describes, and return the exit code."""
    try:
        job = HeadlessJob.from_text(job_text(env))
        tops = documents_in(job.tops)
        check_outputs(_outputs(job), tops)
        if not tops:
            raise InputError(f"no FreeCAD files (*.FCStd) in {', '.join(job.tops)}")
        if job.lines is not None:
            with open(job.lines, "a", encoding="utf-8") as out:
                return _write_lines(job, out)
        return _sync(job)
    except (SiloError, OSError) as error:
        return _tell(error)


def _outputs(job: HeadlessJob) -> list[Output]:
    """List the files that the job writes."""
    forms = {
        "json": REPORTS["sync"][".json"],
        "report": REPORTS["sync"][".md"],
        "lines": beginning("a list of BOMs", r'^\{"(begun|top)"'),
    }
    given = ((name, getattr(job, name)) for name in forms)
    return [Output(f'SILO_ARGS: "{name}"', path, forms[name]) for name, path in given if path]


def _tell(error: Exception) -> int:
    from silo.workbench.freecad import host

    host.error(f"Silo: {error}")
    return exit_of(error)


def _extractions(
    tops: list[str], job: HeadlessJob, look: Callable[[Extraction], None] = lambda _found: None
) -> Iterator[tuple[str, Extraction | SiloError]]:
    from silo.workbench.freecad import host, live

    for top in tops:
        extraction: Extraction | SiloError
        try:
            extraction = live.read_checked(top, job.assembly, hardware=not job.no_hardware)
            look(extraction)
        except SiloError as error:
            extraction = error
        except Exception as error:  # noqa: BLE001  # a fault of ours costs this file only, and is not FreeCAD's
            where = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{os.path.basename(where.filename)}:{where.lineno}"
            text = f"{type(error).__name__}: {error} ({place})"
            extraction = DocumentError(
                top, f"a fault of silo-mod, no fault of the file: {text}; please report this"
            )
        # The next file starts from nothing: no half loaded parts of this one, and no memory held. Before the
        # result is reported, so that what FreeCAD may die of in closing is this file's fault, not the
        # next one's.
        host.close_all()
        yield top, extraction


def _write_lines(job: HeadlessJob, out: TextIO) -> int:
    """Write one line when a file is begun and one when it is done, which shows where FreeCAD crashed."""
    from silo.bom.snapshot import to_plain

    fine = True
    tops = documents_in(job.tops)
    seen: list[SolidCount] = []

    def look(extraction: Extraction) -> None:
        from silo.workbench.freecad import witness

        seen[:] = witness.accounts(extraction, hardware=not job.no_hardware) if job.verify else []

    extractions = _extractions(tops, job, look)
    for top in tops:
        _line(out, {"begun": top})
        _, result = next(extractions)
        if isinstance(result, SiloError):
            fine = False
            _line(out, {"top": top, "error": carried_error(result)})
        else:
            record = {"witness": [account.as_dict() for account in seen]} if job.verify else {}
            _line(out, {"top": top, "extraction": to_plain(result), **record})
    return Exit.DONE if fine else Exit.UNDONE


def _line(out: TextIO, data: Mapping[str, Any]) -> None:
    out.write(json.dumps(data) + "\n")
    out.flush()


def carried_error(error: SiloError) -> dict[str, Any]:
    """Write an error for the process that asked, which shows it in its own language; a document's error has
    path and reason apart.
    """
    path, reason = getattr(error, "path", None), getattr(error, "reason", None)
    data = {"code": error.code, "message": carried(str(error))}
    return {**data, "path": path, "reason": carried(reason)} if isinstance(path, str) and reason else data


def _sync(job: HeadlessJob) -> int:
    try:
        client = _client()
    except ImportError as error:
        return _without_server(job, error)
    from silo.batch import (
        Json,
        Markdown,
        ReportFile,
        RunSummary,
        SyncOptions,
        TopResult,
        stopped_by,
        sync_top,
    )
    from silo.workbench.freecad import host

    tops = documents_in(job.tops)
    options = SyncOptions(
        recursive=job.recursive,
        allow_missing=job.allow_missing,
        dry_run=job.dry_run,
        skip_parts=any(os.path.isdir(top) for top in job.tops),
    )
    summary = RunSummary()
    reports = [ReportFile(job.json, Json())] if job.json is not None else []
    reports += [ReportFile(job.report, Markdown())] if job.report is not None else []

    def take(result: TopResult) -> None:
        summary.add(result)
        for report in reports:
            report.add(result)

    with client:
        for number, (top, extraction) in enumerate(_each(tops, job), start=1):
            result = sync_top(top, extraction, client, options)
            take(result)
            host.message(f"Silo: [{number}/{len(tops)}] {_in_words(result)}")
            if (stopped := stopped_by(result, client)) is not None:
                for untried in tops[number:]:
                    take(TopResult(untried, error=stopped))
                if tops[number:]:
                    host.message(f"Silo: {len(tops) - number} more not tried: {stopped}")
                break
    for report in reports:
        report.close(summary)
        if report.trouble:
            host.error(f"Silo: {report.trouble}")
    return summary.exit_code or (Exit.UNDONE if any(report.trouble for report in reports) else Exit.DONE)


def _each(tops: list[str], job: HeadlessJob) -> Iterator[tuple[str, Extraction | SiloError]]:
    """Yield the BOM of each file, read by another FreeCAD. If a file makes that one crash, a new one reads
    the rest.

    If this program cannot start itself again, it reads the files itself.
    """
    from silo.freecads.run import run_freecad
    from silo.workbench.freecad import host

    done = 0
    try:
        for top, result in run_freecad(
            tops, job.assembly, command=host.program(), hardware=not job.no_hardware
        ):
            done += 1
            yield top, result
    except ConfigError:
        yield from _extractions(tops[done:], job)


def _client() -> Any:
    from silo.api.client import SiloClient
    from silo.api.config import resolve_server

    where = resolve_server(None, None)
    return SiloClient(where.url, where.token, verify=where.verify)


def _without_server(job: HeadlessJob, error: ImportError) -> int:
    """Write the BOMs without the packages for a server, and say what to do."""
    from silo.bom.view.tree_json import bom_json

    config_error = ConfigError(
        f"FreeCAD's Python has no package {error.name!r}, so nothing was synced. `silo-mod install-addon` "
        "installs what it needs, or run `silo-mod sync`, which needs no FreeCAD"
    )
    if job.json is not None:
        results = [
            {"top": top, "error": carried_error(silo_error)}
            if isinstance(silo_error, SiloError)
            else {"top": top, "bom": bom_json(silo_error)}
            for top, silo_error in _each(documents_in(job.tops), job)
        ]
        _write(job.json, json.dumps({"results": results}, indent=2, ensure_ascii=False) + "\n")
        config_error = ConfigError(f"{config_error}. The BOMs themselves were written to {job.json}")
    return _tell(config_error)


def _write(path: str, text: str) -> None:
    """Write the whole report or nothing, so that a run that crashes leaves the previous report."""
    from silo.platform.whole_files import replacing

    target = Path(path)
    if target.exists() and not target.is_file():  # a terminal, a pipe
        target.write_text(text, encoding="utf-8")
        return
    with replacing(target, mode=0o644) as file:
        file.write(text.encode())


def _in_words(result: TopResult) -> str:
    if result.error is not None:
        return f"{result.top}: {result.error}"
    words = ", ".join(_outcome_words(outcome) for outcome in result.outcomes)
    return f"{result.top}: {result.skipped or words}"


def _outcome_words(outcome: Outcome) -> str:
    from silo.api.merging import unusual
    from silo.bom_sync.resolved import blocking

    text = f"{outcome.assembly.part_number or outcome.assembly.label} {outcome.status.value}"
    reasons = [str(outcome.error)] if outcome.error is not None else []
    if outcome.status.value == "blocked":
        reasons += [finding.message for finding in blocking(outcome.resolved)]
    reasons += unusual(outcome.result)
    return f"{text} ({'; '.join(reasons)})" if reasons else text


if __name__ == "__main__":
    sys.exit(main())
