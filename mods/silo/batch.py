# SPDX-License-Identifier: LGPL-2.1-or-later
"""What became of each file of a sync: what the command line and the add-on without a window share.

One failure does not stop the rest; every file ends in a :class:`TopResult`, which becomes JSON here, and a
report in :mod:`silo.batch_report`. Files that FreeCAD reads come one by one (:func:`sync_top`); those that we
read ourselves are one plan (:mod:`silo.vault.job`).
"""

from __future__ import annotations

import os
import uuid
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from silo.api.wire import SourceDocument
from silo.bom.document import relative
from silo.bom.errors import SiloError
from silo.bom.findings import Finding
from silo.bom.model import BomEntry, Extraction
from silo.bom.report import base_of, diff_json, entry_json, finding_json, project_folder
from silo.bom_sync import (
    Outcome,
    Resolved,
    Status,
    SyncApi,
    assemblies,
    blocking,
    resolve,
    server_lines,
    sync_tree,
)
from silo.files import sha256_of

_FINE = (Status.MERGED, Status.UNCHANGED, Status.DRY_RUN)


@dataclass(frozen=True, slots=True)
class Options:
    """How to sync.

    recursive
        sub-assemblies too, children before parents.
    allow_missing
        sync although links are broken.
    dry_run
        compare and send nothing.
    skip_parts
        a file without components of other files is a part and left alone (for whole folders).
    """

    recursive: bool = False
    allow_missing: bool = False
    dry_run: bool = False
    skip_parts: bool = False


@dataclass(frozen=True)
class TopResult:
    """What became of one file: its outcomes, or the error that kept it from being read."""

    top: str
    base: str = ""
    whole: Resolved | None = None
    outcomes: tuple[Outcome, ...] = ()
    error: SiloError | None = None
    skipped: str = ""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Everything worth a report, each once: of the walk, and of each comparison with the server."""
        found: dict[Finding, None] = dict.fromkeys(self.whole.findings if self.whole is not None else ())
        for outcome in self.outcomes:
            found.update(dict.fromkeys(outcome.resolved.findings))
        for outcome in self.outcomes:
            if outcome.plan is not None:
                found.update(dict.fromkeys(outcome.plan.diff.findings_at(outcome.assembly)))
        return tuple(found)

    @property
    def unregistered(self) -> tuple[BomEntry, ...]:
        """The components without an item, each once; of assemblies their outcome says it."""
        several = [self.whole] if self.whole is not None else [outcome.resolved for outcome in self.outcomes]
        return tuple({entry.key: entry for one in several for entry in one.unresolved}.values())

    @property
    def fine(self) -> bool:
        return self.error is None and all(outcome.status in _FINE for outcome in self.outcomes)


def sync_top(top: str, found: Extraction | SiloError, api: SyncApi, options: Options) -> TopResult:
    """Sync one file's BOM, or say why it was not read."""
    if isinstance(found, SiloError):
        return TopResult(top, error=found)
    base = base_of(found)
    if options.skip_parts and not found.entries and not found.blocked:
        return TopResult(top, base, skipped="no components of other files: a part, not an assembly")
    if options.skip_parts and not found.blocked and _is_library(found):
        return TopResult(top, base, skipped="only parts of its own, and no item: a library of parts")
    try:
        whole = ask_for_moved(resolve(found, api), api)
        outcomes = tuple(_outcomes(whole, api, options))
    except SiloError as error:
        return TopResult(top, base, error=error)
    return TopResult(top, base, whole, outcomes)


def _identities_before(
    compared: Iterable[tuple[Resolved, Iterable[Mapping[str, Any]]]],
) -> dict[tuple[str, str], str]:
    """What the last syncs said of components: (file, object) → the Silo UUID of its item.

    compared
        assemblies, each with the server's lines.
    """
    found: dict[tuple[str, str], str] = {}
    for one, lines in compared:
        for line in lines:
            for part in line.get("components") or ():
                if line.get("child_id") and isinstance(part.get("file"), str):
                    path = os.path.normpath(os.path.join(one.folder, part["file"]))
                    found[path, str(part.get("object") or "")] = str(line["child_id"])
    return found


def _lacks_files(one: Resolved) -> bool:
    return any(entry.missing for entry in one.entries)


def ask_for_moved(whole: Resolved, api: SyncApi) -> Resolved:
    """:func:`suggest_by_identity`, with the lines that the server has of assemblies that lack files."""
    lacking = [one for one in assemblies(whole) if _lacks_files(one)]
    return suggest_by_identity(whole, [(one, server_lines(one, api)) for one in lacking])


def suggest_by_identity(
    whole: Resolved,
    compared: Sequence[tuple[Resolved, Iterable[Mapping[str, Any]]]],
    candidates: Callable[[Iterable[str]], Iterable[str]] | None = None,
) -> Resolved:
    """Findings of missing files, with the one that has the identity known from the last sync.

    compared
        assemblies, each with the server's lines.
    candidates
        UUIDs → the files that may carry one of them; None: any file of the project.
    """
    lacking = [(one, lines) for one, lines in compared if _lacks_files(one)]
    known = _identities_before(lacking)
    if not known:
        return whole
    from silo.fcstd.suggest import with_suggestions

    entries = (*whole.entries, *whole.unresolved)
    files = None if candidates is None else tuple(candidates(known.values()))
    told = with_suggestions(Extraction(whole.assembly, entries, whole.findings), known, files)
    return replace(whole, findings=told.findings)


def stopped_by(result: TopResult, api: object = None) -> SiloError | None:
    """The error that makes it useless to try the next file: no right, no server, a server that is busy."""
    from silo.api.policy import ends_run  # loads the network's packages

    errors = (result.error, *(outcome.error for outcome in result.outcomes))
    return next((error for error in errors if error is not None and ends_run(error, api)), None)


def _is_library(found: Extraction) -> bool:
    """A file of screws or of several parts for others to link: unregistered, and nothing of other files."""
    path = found.assembly.doc_path
    return found.assembly.silo_uuid is None and all(entry.doc_path == path for entry in found.entries)


def _outcomes(whole: Resolved, api: SyncApi, options: Options) -> Iterable[Outcome]:
    return sync_tree(
        whole,
        api,
        sync_id=lambda: str(uuid.uuid4()),
        describe=lambda entry: source_document(entry, whole.assembly.doc_path),
        allow_missing=options.allow_missing,
        dry_run=options.dry_run,
        recursive=options.recursive,
    )


def source_document(entry: BomEntry, top: str = "") -> SourceDocument:
    """Which file, with which content, an assembly's BOM was taken from; ``top``: the assembly of the run."""
    return SourceDocument(
        file=os.path.basename(entry.doc_path),
        folder=project_folder(entry.doc_path, top),
        sha256=sha256_of(entry.doc_path),
    )


# --- for machines ---------------------------------------------------------------------------------------


def result_json(result: TopResult) -> dict[str, Any]:
    """One file's result for machines."""
    data: dict[str, Any] = {"top": result.top, "ok": result.fine}
    if result.error is not None:
        data["error"] = {"code": result.error.code, "message": str(result.error)}
    if result.skipped:
        data["skipped"] = result.skipped
    data["assemblies"] = [outcome_json(outcome, result.base) for outcome in result.outcomes]
    if result.outcomes:
        data["unregistered"] = [entry_json(entry, result.base) for entry in result.unregistered]
        data["findings"] = [finding_json(finding, result.base) for finding in result.findings]
    return data


def outcome_json(outcome: Outcome, base: str) -> dict[str, Any]:
    """One assembly's outcome for machines."""
    head = outcome.assembly
    data: dict[str, Any] = {
        "doc_path": relative(head.doc_path, base),
        "object": head.object_name,
        "part_number": head.part_number,
        "status": outcome.status.value,
    }
    if outcome.plan is not None:
        data["diff"] = diff_json(outcome.plan.diff)
    if outcome.result is not None:
        data["result"] = outcome.result.model_dump(mode="json", exclude_none=True)
    if outcome.error is not None:
        data["error"] = {"code": outcome.error.code, "message": str(outcome.error)}
    if outcome.status is Status.BLOCKED:
        data["blocked_by"] = [finding_json(f, base) for f in blocking(outcome.resolved)]
    return data
