# SPDX-License-Identifier: LGPL-2.1-or-later
"""What became of each file of a sync: what the command line and the add-on without a window share.

One failure does not stop the rest; every file ends in a :class:`TopResult`, which becomes JSON here, and a
report in :mod:`silo.batch`. Files that FreeCAD reads come one by one (:func:`sync_top`); those that we
read ourselves are one plan (:mod:`silo.vault.plan`).

The report of a sync, as Markdown, HTML, JSON or JUnit XML: written as the run goes, whole at every moment.

What changed is written when it has happened. At the end of the run the report gets its beginning: one line
of counts, what is new since the run before, and what needs a user, grouped by its cause. If the run ends
early, the report says so.
"""

from __future__ import annotations

import json
import os
import re
import uuid
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, Protocol
from xml.sax.saxutils import escape, quoteattr

from silo.api.wire import SourceDocument
from silo.bom.commands_in_text import outside_commands
from silo.bom.consolidation import one_hint_each
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import DocumentError, Exit, InputError, RemoteError, SiloError, counted, listed
from silo.bom.findings import Finding, FindingCode, Severity
from silo.bom.items.naming import display_name
from silo.bom.message import Message, joined, message
from silo.bom.system_refusals import why_refused
from silo.bom.view.diff_rows import diff_json, diff_rows
from silo.bom.view.folders import base_folder, project_folder, shorten
from silo.bom.view.tree_json import entry_json, finding_json
from silo.bom.walk.document import relative
from silo.bom_sync.resolved import Resolved, assemblies, blocking, resolve
from silo.bom_sync.steps import Outcome, Status, SyncApi, server_lines, sync_tree
from silo.checksums import sha256_of
from silo.platform.whole_files import replacing
from silo.proposed_command import proposed

_FINE = (Status.MERGED, Status.UNCHANGED, Status.DRY_RUN)


@dataclass(frozen=True, slots=True)
class SyncOptions:
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
    """What became of one file: its outcomes, or the error that kept it from being read or sent.

    left
        how many assemblies the error concerns.
    """

    top: str
    base: str = ""
    whole: Resolved | None = None
    outcomes: tuple[Outcome, ...] = ()
    error: SiloError | None = None
    skipped: str = ""
    left: int = 1

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Return each finding for the report once: those of the walk, and of each comparison with the
        server.
        """
        unique: dict[Finding, None] = dict.fromkeys(self.whole.findings if self.whole is not None else ())
        for outcome in self.outcomes:
            unique.update(dict.fromkeys(outcome.resolved.findings))
        for outcome in self.outcomes:
            if outcome.plan is not None:
                unique.update(dict.fromkeys(outcome.plan.diff.findings_at(outcome.assembly)))
        return tuple(unique)

    @property
    def unregistered(self) -> tuple[BomEntry, ...]:
        """Return each component without an item once. The outcome of an assembly reports if the assembly
        itself has none.
        """
        several = [self.whole] if self.whole is not None else [outcome.resolved for outcome in self.outcomes]
        return tuple({entry.key: entry for resolved in several for entry in resolved.unresolved}.values())

    @property
    def fine(self) -> bool:
        """Return True if everything was done. Own parts that are no items yet count as not done."""
        outcomes = self.outcomes
        return self.error is None and all(
            outcome.status in _FINE and not outcome.assembly.own for outcome in outcomes
        )


def sync_top(top: str, extraction: Extraction | SiloError, api: SyncApi, options: SyncOptions) -> TopResult:
    """Sync one file's BOM, or say why it was not read."""
    if isinstance(extraction, SiloError):
        return TopResult(top, error=extraction)
    base = base_folder(extraction)
    if options.skip_parts and not extraction.entries and not extraction.blocked:
        return TopResult(top, base, skipped=message("no components of other files: a part, not an assembly"))
    if options.skip_parts and not extraction.blocked and _is_library(extraction):
        return TopResult(top, base, skipped=message("only parts of its own, and no item: a library of parts"))
    try:
        whole = ask_for_moved(resolve(extraction, api), api)
        outcomes = tuple(_outcomes(whole, api, options))
    except SiloError as error:
        return TopResult(top, base, error=error)
    return TopResult(top, base, whole, outcomes)


def _identities_before(
    compared: Iterable[tuple[Resolved, Iterable[Mapping[str, Any]]]],
) -> dict[tuple[str, str], str]:
    """Collect what the last syncs recorded of components: (file, object) → the Silo UUID of its item.

    compared
        assemblies, each with the server's lines.
    """
    identities: dict[tuple[str, str], str] = {}
    for resolved, lines in compared:
        for line in lines:
            for part in line.get("components") or ():
                if line.get("child_id") and isinstance(part.get("file"), str):
                    path = os.path.normpath(os.path.join(resolved.folder, part["file"]))
                    identities[path, str(part.get("object") or "")] = str(line["child_id"])
    return identities


def _lacks_files(resolved: Resolved) -> bool:
    return any(entry.missing for entry in resolved.entries)


def ask_for_moved(whole: Resolved, api: SyncApi) -> Resolved:
    """Ask the server for the lines of assemblies that lack files, for :func:`suggest_by_identity`."""
    lacking = [assembly for assembly in assemblies(whole) if _lacks_files(assembly)]
    return suggest_by_identity(whole, [(resolved, server_lines(resolved, api)) for resolved in lacking])


def suggest_by_identity(
    whole: Resolved,
    compared: Sequence[tuple[Resolved, Iterable[Mapping[str, Any]]]],
    candidates: Callable[[Iterable[str]], Iterable[str]] | None = None,
) -> Resolved:
    """Add to findings of missing files the file that has the identity known from the last sync.

    compared
        assemblies, each with the server's lines.
    candidates
        UUIDs → the files that may carry one of them; None: any file of the project.
    """
    lacking = [(resolved, lines) for resolved, lines in compared if _lacks_files(resolved)]
    identities = _identities_before(lacking)
    if not identities:
        return whole
    from silo.fcstd.suggest import with_suggestions

    entries = (*whole.entries, *whole.unresolved)
    files = None if candidates is None else tuple(candidates(identities.values()))
    extraction = with_suggestions(Extraction(whole.assembly, entries, whole.findings), identities, files)
    return replace(whole, findings=extraction.findings)


def stopped_by(result: TopResult, api: object = None) -> SiloError | None:
    """Return the error that makes it useless to try the next file: no right, no server, or a busy server."""
    from silo.api.policy import ends_run  # loads the network's packages

    errors = (result.error, *(outcome.error for outcome in result.outcomes))
    return next((error for error in errors if error is not None and ends_run(error, api)), None)


def _is_library(extraction: Extraction) -> bool:
    """Return True for a file of screws, or of several parts, that others link: not registered, and without
    parts of other files.
    """
    path = extraction.assembly.doc_path
    return extraction.assembly.silo_uuid is None and all(
        entry.doc_path == path for entry in extraction.entries
    )


def _outcomes(whole: Resolved, api: SyncApi, options: SyncOptions) -> Iterable[Outcome]:
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
    """Describe the file, and its content, from which an assembly's BOM was taken; ``top``: the assembly of
    the run.
    """
    return SourceDocument(
        file=os.path.basename(entry.doc_path),
        folder=project_folder(entry.doc_path, top),
        sha256=sha256_of(entry.doc_path),
    )


# --- for machines ---------------------------------------------------------------------------------------


def error_json(error: SiloError) -> dict[str, str]:
    """Return an error as JSON values."""
    return {"code": error.code, "message": str(error)}


def result_json(result: TopResult) -> dict[str, Any]:
    """Return one file's result as JSON values."""
    data: dict[str, Any] = {"top": result.top, "ok": result.fine}
    if result.error is not None:
        data["error"] = error_json(result.error)
    if result.skipped:
        data["skipped"] = result.skipped
    data["assemblies"] = [outcome_json(outcome, result.base) for outcome in result.outcomes]
    if result.outcomes:
        data["unregistered"] = [entry_json(entry, result.base) for entry in result.unregistered]
        data["findings"] = [finding_json(finding, result.base) for finding in result.findings]
    return data


def outcome_json(outcome: Outcome, base: str) -> dict[str, Any]:
    """Return one assembly's outcome as JSON values."""
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
        data["error"] = error_json(outcome.error)
    if outcome.status is Status.BLOCKED:
        data["blocked_by"] = [finding_json(f, base) for f in blocking(outcome.resolved)]
    return data


_LEFT = (Status.BLOCKED, Status.UNREGISTERED, Status.FAILED)
STATUS_WORDS = {
    Status.MERGED: message("BOM merged"),
    Status.UNCHANGED: message("no change, nothing was sent"),
    Status.DRY_RUN: message("preview only, nothing was sent"),
    Status.BLOCKED: message("not synced: links are broken (see below; --allow-missing syncs anyway)"),
    Status.UNREGISTERED: message("not synced: the assembly has no Silo part number"),
    Status.FAILED: message("not synced"),
}
# What changed, by the field of the diff.
_CHANGES = {
    "added": "added",
    "quantity_changed": "quantity",
    "conflicts": message("a reviewer decides"),
    "removed": message("not in the assembly"),
}


def cell(text: str) -> str:
    """Return foreign text as Markdown that only shows it: one line, no markup, and GitHub notifies no one.

    On GitHub ``@team`` and ``#12`` are links, escaped or not; a space without width separates them.
    """
    text = "".join(c if c.isprintable() else " " for c in text).strip().replace("&", "&amp;")
    text = re.sub(r"([@#])(?=\w)", "\\1\u200b", text)
    return re.sub(r"([\\\\`*_\[\]<>|~$#])|^(\d*)([-+.)=])", r"\2\\\1\3", text)


def sentence_cell(text: str) -> str:
    """Return a sentence of ours as Markdown: a command in backticks can be copied as it is."""

    def escaped(part: str) -> str:
        inner = part.strip()
        begin = part.index(inner)
        return f"{part[:begin]}{cell(inner)}{part[begin + len(inner) :]}" if inner else part

    def code_kept(part: str) -> str:
        pieces = re.split(r"(`[\w /.:~+-]+`)", part)
        return "".join(piece if number % 2 else escaped(piece) for number, piece in enumerate(pieces))

    return outside_commands(code_kept, text)


@dataclass
class RunSummary:
    """A run in numbers, and what it leaves to people.

    files, fine, unread, parts
        all that were asked for; those in order; those that could not be read; those without components of
        others.
    statuses
        how many assemblies ended how.
    unsent
        reason → how many assemblies the server, or the way to it, kept from being sent.
    errors, warnings
        sentence → the files that it is about.
    causes
        sentence → what it has in common with others.
    at_fault
        sentence → the files that have to be repaired, though other files suffer as well.
    unreadable
        file → why it cannot be read.
    changed
        the assemblies that were sent, or would be.
    held
        the assemblies that were not synced, without those of the server's errors.
    moved
        (part, before, now), for files that carry on the identity of one that is gone.
    before
        the sentences of the run before; None if they are not known.
    seconds
        time by stage.
    notes
        what concerns the whole run: its index, its server.
    page
        the HTML report of the run, which has all of it; "" if none is written.
    """

    base: str = ""
    files: int = 0
    fine: int = 0
    unread: int = 0
    parts: int = 0
    statuses: Counter[str] = field(default_factory=Counter)
    unsent: Counter[str] = field(default_factory=Counter)
    lines_changed: int = 0
    errors: dict[str, list[str]] = field(default_factory=dict)
    warnings: dict[str, list[str]] = field(default_factory=dict)
    causes: dict[str, str] = field(default_factory=dict)
    at_fault: dict[str, str] = field(default_factory=dict)
    unreadable: dict[str, str] = field(default_factory=dict)
    changed: list[str] = field(default_factory=list)
    held: list[str] = field(default_factory=list)
    findings: dict[Finding, None] = field(default_factory=dict)
    unregistered: dict[tuple[str, str], str] = field(default_factory=dict)
    moved: list[tuple[str, str, str]] = field(default_factory=list)
    before: frozenset[str] | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    page: str = ""

    @property
    def exit_code(self) -> Exit:
        """Return the worst exit code: 3 if the server kept anything from being sent, 1 if something else was
        left undone.
        """
        if self.unsent:
            return Exit.REMOTE
        return Exit.DONE if self.fine == self.files else Exit.UNDONE

    def add(self, result: TopResult) -> None:
        """Count a file's result."""
        self.files += 1
        self.fine += result.fine
        if result.skipped:
            self.parts += 1
        if result.error is not None:
            self.unread += 1
            self._fail(result.error, result.top, result.left)
        for outcome in result.outcomes:
            self.statuses[outcome.status.value] += 1
            if outcome.status in (Status.MERGED, Status.DRY_RUN) and outcome.plan is not None:
                diff = outcome.plan.diff
                self.lines_changed += len(diff.added) + len(diff.quantity_changed)
            if is_news(outcome) and outcome.error is None:
                (self.changed if outcome.status in _FINE else self.held).append(_name_of(outcome))
            if outcome.error is not None:
                self._fail(outcome.error, outcome.assembly.doc_path, 1)
            if outcome.status is Status.UNREGISTERED:
                head = outcome.assembly
                self.unregistered.setdefault(head.key, display_name(head) or head.object_name)
        for entry in result.unregistered:
            self.unregistered.setdefault(entry.key, display_name(entry) or entry.object_name)
        self.add_findings(result.findings, result.top)

    def _fail(self, error: SiloError, file: str, count: int) -> None:
        if isinstance(error, RemoteError):
            self.unsent[str(error)] += count
        cause = error.reason if isinstance(error, DocumentError) else str(error)
        self._note(self.errors, str(error), file, cause, file)
        if isinstance(error, DocumentError):
            self.unreadable[self.at_fault[shorten(str(error), self.base)]] = cause

    def add_findings(self, findings: Iterable[Finding], top: str = "") -> None:
        """Count what was noticed; parts without a number have a list of their own."""
        for finding in one_hint_each(findings):
            if finding.severity is Severity.INFO or finding.code is FindingCode.UNREGISTERED:
                continue
            self.findings.setdefault(finding)
            where = self.errors if finding.severity is Severity.ERROR else self.warnings
            place = finding.where[0].doc_path if finding.where else top
            self._note(where, finding.message, place, finding.code.meaning, finding.file or place)

    def _note(self, where: dict[str, list[str]], message: str, file: str, cause: str, at_fault: str) -> None:
        message, file = shorten(message, self.base), shorten(file, self.base)
        self.causes[message] = cause
        self.at_fault[message] = shorten(os.path.realpath(at_fault) if self.base else at_fault, self.base)
        files = where.setdefault(message, [])
        if file not in files:
            files.append(file)

    def told(self) -> dict[str, str]:
        """Return everything that needs a user: the sentence by which the next run knows it → the report's
        line.
        """
        several = ((words, files) for lines in (self.errors, self.warnings) for words, files in lines.items())
        return {
            **{words: joined("", (words, _others(words, files))) for words, files in several},
            **{line: message("{line}: no part number", line=line) for line in self._without_number()},
        }

    def new(self) -> list[str] | None:
        """Return the lines that the last run did not have; None if its lines are not known."""
        if self.before is None:
            return None
        return [line for words, line in self.told().items() if words not in self.before]

    def _without_number(self) -> list[str]:
        return [f"{name} ({shorten(path, self.base)})" for (path, _), name in self.unregistered.items()]

    def to_json(self) -> dict[str, Any]:
        """Return the summary as JSON values."""
        return {
            "files": self.files,
            "in_order": self.fine,
            "parts": self.parts,
            "assemblies": dict(self.statuses),
            "not_sent": self.unsent.total(),
            "lines_changed": self.lines_changed,
            "new": self.new(),
            "errors": [self._caused(words, files) for words, files in self.errors.items()],
            "warnings": [self._caused(words, files) for words, files in self.warnings.items()],
            "unregistered": [
                {"doc_path": shorten(path, self.base), "object": name, "label": label}
                for (path, name), label in self.unregistered.items()
            ],
            "moved": [{"name": name, "from": old, "to": new} for name, old, new in self.moved],
            "notes": self.notes,
            "seconds": {stage: round(seconds, 3) for stage, seconds in self.seconds.items()},
        }

    def _caused(self, words: str, files: list[str]) -> dict[str, Any]:
        return {"message": words, "cause": self.causes.get(words, words), "files": files}

    def sentence(self) -> str:
        """Say in one line how the run went; first what the server kept from being sent."""
        words: list[str] = []
        for why, count in self.unsent.most_common():
            words.append(
                message(
                    "{count} not sent: {why}. ",
                    count=counted(count, "assembly", "assemblies"),
                    why=why.rstrip("."),
                )
            )
        kept = joined("", words)
        words = [message("{fine} of {files} files in order", fine=self.fine, files=self.files)]
        if self.parts:
            words.append(message("{parts} of them parts", parts=self.parts))
        for status, count in sorted(self.statuses.items()):
            words.append(Message(f"{{n}} {status.replace('_', ' ')}", {"n": count}))
        return kept + joined(", ", words) + "."

    def mail(self) -> Iterator[tuple[str, list[str]]]:
        """Yield what fits on one screen: a title, and its lines; a line for each cause, with three examples.

        All of it is in :meth:`sections`.
        """
        told = self.told()
        if self.before is not None:
            new = [_first_ones(cause) for cause in self._by_cause(self._unknown())]
            new += self._numberless(self.before)
            yield message("New since the last run"), _most(new or ["nothing"])
        yield "Errors", _most(map(_first_ones, self._by_cause(self.errors)))
        yield "Warnings", _most(map(_first_ones, self._by_cause(self._warned(self.before or frozenset()))))
        yield message("Without a part number"), self._numberless(frozenset()) if told else []
        lists = (("Changed", self.changed), (message("Not synced"), self.held))
        for title, names in lists:
            yield title, [_examples(counted(len(names), "assembly", "assemblies"), names)] if names else []
        moves = [f"{old} → {new}" for _name, old, new in self.moved]
        yield "Moved", [_examples(counted(len(moves), "file"), moves)] if moves else []
        more = [
            message("All of it: `{page}`", page=self.page)
            if self.page
            else message("--report FILE.html has all of it")
        ]
        yield "Notes", [*self._notes(), *more]

    def sections(self) -> Iterator[tuple[str, list[tuple[str, list[str]]]]]:
        """Yield the sections below the line of counts: a title, and its lines, each with the lines below it.

        Errors and warnings of one cause are one line, with a line for each file at fault. A hint about how
        something is modelled is only in the first report.
        """
        before = self.before or frozenset()
        if self.before is not None:
            new = [_whole(cause) for cause in self._by_cause(self._unknown())]
            new += [(line, []) for line in self._numberless(before)]
            yield message("New since the last run"), new or [("nothing", [])]
        yield "Errors", [_whole(cause) for cause in self._by_cause(self.errors)]
        yield "Warnings", [_whole(cause) for cause in self._by_cause(self._warned(before))]
        title = message("Without a part number")
        yield title, [(line, []) for line in (*self._without_number(), *self._numberless(frozenset())[:1])]
        yield "Moved", [(f"{name}: {old} → {new}", []) for name, old, new in self.moved]
        yield "Notes", [(note, []) for note in self._notes()]

    def _notes(self) -> list[str]:
        notes = list(self.notes)
        if old := len(self.warnings) - len(self._warned(self.before or frozenset())):
            command = proposed("bom", Path(self.base or "."), "--verbose")
            notes.append(
                message(
                    "Hints that were there before: {old} ({command} shows them).", old=old, command=command
                )
            )
        if self.seconds:
            times = [
                message("{stage} {seconds} s", stage=_STAGES[stage], seconds=f"{seconds:.1f}")
                for stage, seconds in self.seconds.items()
            ]
            notes.append(message("Time: {times}.", times=joined(", ", times)))
        return notes

    def _unknown(self) -> list[str]:
        """List the sentences about files that the last run did not have."""
        before = self.before or frozenset()
        return [words for words in (*self.errors, *self.warnings) if words not in before]

    def _warned(self, before: frozenset[str]) -> list[str]:
        """List the warnings, without hints about modelling that an earlier report had."""
        hint = FindingCode.CONSOLIDATION.meaning
        return [text for text in self.warnings if self.causes.get(text) != hint or text not in before]

    def _numberless(self, before: frozenset[str]) -> list[str]:
        """Say in one line how many parts have no part number, and what gives them one."""
        lines = [line for line in self._without_number() if line not in before]
        if not lines:
            return []
        command = (
            message("; {base} gives them one", base=proposed("register", Path(self.base)))
            if self.base
            else ""
        )
        return [joined("", (_examples(counted(len(lines), "part"), lines), command))]

    def _by_cause(self, sentences: Iterable[str]) -> list[FaultCause]:
        """Put sentences of one cause together, and those about one file at fault below it.

        A file that cannot be read itself is the cause of what its assemblies say of it.
        """
        lines = self.told()
        groups: dict[str, dict[str, list[str]]] = {}
        for words in sentences:
            file = self.at_fault.get(words, words)
            cause = self.unreadable.get(file) or self.causes.get(words, words)
            groups.setdefault(cause, {}).setdefault(file, []).append(lines[words])
        return [FaultCause(cause, files) for cause, files in groups.items()]


# The stages of a run, as a report of a night names them.
_STAGES = {"reading": message("reading"), "server": message("server")}


@dataclass(frozen=True)
class FaultCause:
    """What several sentences of a run have in common; ``files``: file at fault → its sentences."""

    words: str
    files: Mapping[str, Sequence[str]]


_EXAMPLES = 3
_MOST_CAUSES = 12


def _first_ones(cause: FaultCause) -> str:
    """Write a cause in one line: its only sentence, or how many files are at fault, with three of them."""
    (first, *others), *more = cause.files.values()
    if not more:
        return joined("", (first, _more_places(others)))
    return _examples(_counted_cause(cause), list(cause.files))


def _counted_cause(cause: FaultCause) -> str:
    return message("{count} × {cause}", count=len(cause.files), cause=cause.words)


def _more_places(others: Sequence[str]) -> str:
    return message(" ({others})", others=counted(len(others), "more place")) if others else ""


def _whole(cause: FaultCause) -> tuple[str, list[str]]:
    """Write a cause as a line, and a line for each file at fault below it."""
    ways: list[str] = [
        joined("", (_without_cause(first, cause.words), _more_places(others)))
        for first, *others in cause.files.values()
    ]
    if len(ways) == 1:
        return _first_ones(cause), []
    return _counted_cause(cause), ways


def _without_cause(line: str, cause: str) -> str:
    """Take the cause out of the line of a file, where it stands above."""
    return shortened if (shortened := line.replace(f": {cause}", "")) != line else line


def _examples(head: str, names: Sequence[str]) -> str:
    return message("{head}: {examples}", head=head, examples=listed(names, _EXAMPLES))


def _most(lines: Iterable[str]) -> list[str]:
    """Cut a list of lines, and say how many there are more."""
    every = list(lines)
    rest = len(every) - _MOST_CAUSES
    return (
        [*every[:_MOST_CAUSES], message("… and {rest}", rest=counted(rest, "more cause"))]
        if rest > 1
        else every
    )


class Form(Protocol):
    """How a report is written: a beginning, what became of each file, and an end."""

    def head(self, summary: RunSummary | None) -> str:
        """Return the beginning of the report; ``summary`` is None until the run has ended."""
        ...

    def one(self, result: TopResult, number: int) -> str: ...

    def end(self, summary: RunSummary | None) -> str:
        """Return the end of the report; ``summary`` is None until the run has ended."""
        ...

    def body(self, summary: RunSummary, written: bytes) -> bytes:
        """Return what the ended report keeps of the results between its beginning and its end."""
        return written


class ReportFile:
    """A file that is whole after every result: what is new replaces the end, and brings an end of its own."""

    def __init__(self, path: str, form: Form | None = None) -> None:
        self.path = path
        self.trouble = ""
        self._form = form or form_of(path)
        self._count = 0
        # A terminal or a pipe cannot be rewritten; it gets the whole report at the end.
        later = os.path.exists(path) and not os.path.isfile(path)
        self._file: BinaryIO | None = BytesIO() if later else open(path, "w+b")  # noqa: SIM115
        self._begin = self._end = 0
        self._write(self._form.head(None), self._form.end(None))
        self._begin = self._end

    def add(self, result: TopResult) -> None:
        """Write the result of a file into the report."""
        text = self._form.one(result, self._count)
        self._count += bool(text)
        if text:
            self._write(text, self._form.end(None))

    def close(self, summary: RunSummary | None = None) -> None:
        """End the report; without a summary, end it as it is."""
        if self._file is None:
            return
        try:
            if summary is not None:
                self._file.seek(self._begin)
                tail = self._file.read(self._end - self._begin)
                body = self._form.body(summary, tail)
                whole = _bytes(self._form.head(summary)) + body + _bytes(self._form.end(summary))
                if isinstance(self._file, BytesIO):
                    self._file = BytesIO(whole)
                else:
                    mode = os.fstat(self._file.fileno()).st_mode & 0o777
                    self._file.close()
                    with replacing(Path(os.path.realpath(self.path)), mode=mode) as file:
                        file.write(whole)
            if isinstance(self._file, BytesIO):
                Path(self.path).write_bytes(self._file.getvalue())
        except OSError as error:
            self._give_up(error)
        with suppress(OSError):
            self._file.close()

    def _write(self, text: str, end: str) -> None:
        if self._file is None:
            return
        new = _bytes(text)
        try:
            self._file.seek(self._end)
            self._file.write(new + _bytes(end))
            self._end += len(new)
            self._file.truncate()
            self._file.flush()
        except OSError as error:
            self._give_up(error)
            with suppress(OSError):
                self._file.close()
            self._file = None

    def _give_up(self, error: OSError) -> None:
        self.trouble = message(
            "{path} could not be written to its end: {error}", path=self.path, error=why_refused(error)
        )


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "replace")


def form_of(path: str) -> Form:
    """Return the format that a file's ending names. Raises InputError for another ending."""
    forms: dict[str, Form] = {".md": Markdown(), ".html": Html(), ".json": Json(), ".xml": JUnit()}
    ending = Path(path).suffix.lower()
    if ending not in forms:
        kinds = message("Markdown (.md), HTML (.html), JSON (.json) or JUnit XML (.xml)")
        raise InputError(message("{path}: a report is {kinds}", path=path, kinds=kinds))
    return forms[ending]


# --- for people -------------------------------------------------------------------------------------------


def is_news(outcome: Outcome) -> bool:
    """Return True if the report shows the assembly; it leaves out those in which nothing changed."""
    if outcome.status is Status.DRY_RUN:
        return outcome.plan is not None and (outcome.plan.news or outcome.plan.diff.drifted)
    return outcome.status is not Status.UNCHANGED


def _name_of(outcome: Outcome) -> str:
    head = outcome.assembly
    return " ".join(filter(None, (head.part_number, head.name))) or display_name(head) or head.object_name


def _changes(outcome: Outcome, base: str) -> tuple[str, str, list[tuple[str, ...]], list[str]]:
    """Return what the report shows of an assembly: title, file, rows of changes, and why it was not
    synced.
    """
    head = outcome.assembly
    # Nothing changed in a BOM that was not sent.
    plan = outcome.plan if outcome.status not in _LEFT else None
    rows: list[tuple[str, ...]] = [
        (_CHANGES[kind], number, outcome.names.get(number, ""), quantity)
        for kind, number, quantity in (diff_rows(plan.diff) if plan is not None else ())
        if kind in _CHANGES
    ]
    reasons = [shorten(reason, base) for reason in reasons_of(outcome)]
    return (
        message("{outcome}: {status}", outcome=_name_of(outcome), status=STATUS_WORDS[outcome.status]),
        shorten(head.doc_path, base),
        rows,
        reasons,
    )


_HEADINGS = ("", message("Part number"), "Name", "Quantity")
_NOT_ENDED = message("The run has not ended, or was stopped here.")


class Markdown(Form):
    """A mail of one screen. A run in which few assemblies changed has their lines too."""

    def head(self, summary: RunSummary | None) -> str:
        lines = [
            message("# BOM sync"),
            "",
            *([sentence_cell(summary.sentence()), ""] if summary is not None else []),
        ]
        for title, lines_below in summary.mail() if summary is not None else ():
            if lines_below:
                lines += [f"## {cell(title)}", "", *(f"- {sentence_cell(line)}" for line in lines_below), ""]
        if summary is None or _few(summary):
            lines += ["## Assemblies", ""]
        return "\n".join(lines)

    def body(self, summary: RunSummary, written: bytes) -> bytes:
        return written if _few(summary) else b""

    def one(self, result: TopResult, number: int) -> str:
        return "".join(
            self._assembly(outcome, result.base) for outcome in result.outcomes if is_news(outcome)
        )

    def _assembly(self, outcome: Outcome, base: str) -> str:
        title, file, rows, reasons = _changes(outcome, base)
        lines = ["", f"### {cell(title)}", "", cell(file), ""]
        if rows:
            lines += [f"| {' | '.join(_HEADINGS)} |", "|---|---|---|---:|"]
            lines += [f"| {' | '.join(map(cell, row))} |" for row in rows]
            lines.append("")
        lines += [f"- {sentence_cell(reason)}" for reason in reasons]
        return "\n".join(lines).rstrip("\n") + "\n"

    def end(self, summary: RunSummary | None) -> str:
        if summary is None:
            return f"\n*{_NOT_ENDED}*\n"
        return message("\nNothing else changed.\n") if _few(summary) else ""


_FEW = 3


def _few(summary: RunSummary) -> bool:
    """Return True if a mail has room for each assembly that changed or was held."""
    return len(summary.changed) + len(summary.held) <= _FEW


_STYLE = """:root{color-scheme:light dark}
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse}p:first-of-type{font-weight:600}li,td,h3{overflow-wrap:anywhere}
td,th{padding:.2rem .8rem .2rem 0;text-align:left;border-bottom:1px solid #8886}
td:last-child,th:last-child{text-align:right}"""


class Html(Form):
    """One page to read, in mail or in a browser."""

    def head(self, summary: RunSummary | None) -> str:
        parts = [
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>BOM sync</title>',
            f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>',
            "<body><h1>BOM sync</h1>",
        ]
        if summary is not None:
            parts.append(_element("p", summary.sentence()))
            for title, subtitle in summary.sections():
                if subtitle:
                    parts += [_element("h2", title), _list(subtitle)]
        return "\n".join([*parts, "<h2>Assemblies</h2>", ""])

    def one(self, result: TopResult, number: int) -> str:
        return "".join(
            self._assembly(outcome, result.base) for outcome in result.outcomes if is_news(outcome)
        )

    def _assembly(self, outcome: Outcome, base: str) -> str:
        title, file, rows, reasons = _changes(outcome, base)
        parts = [_element("h3", title), _element("p", file)]
        if rows:
            lines = (("th", _HEADINGS), *(("td", row) for row in rows))
            cells = ("".join(_element(tag, text) for text in line) for tag, line in lines)
            parts.append(f"<table>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>")
        return "\n".join([*parts, *([_list([(reason, []) for reason in reasons])] if reasons else []), ""])

    def end(self, summary: RunSummary | None) -> str:
        return (
            _element("p", _NOT_ENDED if summary is None else message("Nothing else changed."))
            + "</body></html>\n"
        )


def _element(tag: str, text: str) -> str:
    return f"<{tag}>{escape(_clean(text))}</{tag}>"


def _list(sections: Iterable[tuple[str, Sequence[str]]]) -> str:
    text = ""
    for line, more in sections:
        below = _list([(phrase, []) for phrase in more]) if more else ""
        text += f"<li>{escape(_clean(line))}{below}</li>"
    return f"<ul>{text}</ul>"


def _others(words: str, files: Iterable[str]) -> str:
    """Return the files that a sentence does not name itself, in brackets."""
    named = [file for file in files if file and os.path.basename(file) not in words]
    return message(" ({named})", named=listed(named)) if named else ""


def reasons_of(outcome: Outcome) -> list[str]:
    """Return the reasons why an assembly was not synced."""
    if outcome.error is not None:
        return [str(outcome.error)]
    if outcome.status is Status.UNREGISTERED:
        return [
            message("{doc_path} gives it one", doc_path=proposed("register", Path(outcome.assembly.doc_path)))
        ]
    return [finding.message for finding in blocking(outcome.resolved)] if outcome.status in _LEFT else []


# --- for machines ---------------------------------------------------------------------------------------


class Json(Form):
    """``{"results": […], "ended": true, "summary": {…}}``."""

    def head(self, summary: RunSummary | None) -> str:
        return '{"results": ['

    def one(self, result: TopResult, number: int) -> str:
        return ("," if number else "") + "\n" + json.dumps(result_json(result))

    def end(self, summary: RunSummary | None) -> str:
        if summary is None:
            return '\n], "ended": false}\n'
        findings = [finding_json(finding, summary.base) for finding in summary.findings]
        data: Mapping[str, Any] = {**summary.to_json(), "findings": findings}
        return f'\n], "ended": true, "summary": {json.dumps(data)}}}\n'


class JUnit(Form):
    """For CI: a test case per assembly, and per file that could not be read."""

    def head(self, summary: RunSummary | None) -> str:
        summary = summary or RunSummary()
        count = summary.statuses
        failures = count[Status.BLOCKED] + count[Status.UNREGISTERED]
        tests, errors = count.total() + summary.unread, count[Status.FAILED] + summary.unread
        return (
            '<?xml version="1.0" encoding="UTF-8"?>\n<testsuites>\n<testsuite name="silo-mod sync" '
            f'tests="{tests}" failures="{failures}" errors="{errors}">'
        )

    def one(self, result: TopResult, number: int) -> str:
        if result.error is not None:
            return self._case(result.top, result.top, "error", str(result.error))
        cases = []
        for outcome in result.outcomes:
            head = outcome.assembly
            name = " ".join(filter(None, (head.part_number, display_name(head) or head.object_name)))
            path = shorten(head.doc_path, result.base)
            if outcome.status not in _LEFT:
                cases.append(self._case(path, name))
                continue
            why = "; ".join(reasons_of(outcome)) or STATUS_WORDS[outcome.status]
            kind = "error" if outcome.status is Status.FAILED else "failure"
            cases.append(self._case(path, name, kind, shorten(why, result.base)))
        return "".join(cases)

    def _case(self, file: str, name: str, kind: str = "", why: str = "") -> str:
        head = f"\n<testcase classname={_attribute(file)} name={_attribute(name)}"
        if not kind:
            return f"{head}/>"
        return f"{head}><{kind} message={_attribute(why)}/></testcase>"

    def end(self, summary: RunSummary | None) -> str:
        text: str = _NOT_ENDED
        if summary is not None:
            text = "\n".join(
                [summary.sentence(), *(message("new: {line}", line=line) for line in summary.new() or ())]
            )
        return f"\n<system-out>{escape(_clean(text))}</system-out>\n</testsuite>\n</testsuites>\n"


def _clean(text: str) -> str:
    return "".join(c if c.isprintable() or c == "\n" else "�" for c in text)


def _attribute(text: str) -> str:
    return quoteattr(_clean(text).replace("\n", " "))
