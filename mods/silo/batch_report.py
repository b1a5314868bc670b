# SPDX-License-Identifier: LGPL-2.1-or-later
"""The report of a sync, as Markdown, JSON or JUnit XML: written as the run goes, whole at every moment.

What changed is written when it has happened. What needs a person comes at the end, errors first, each thing
once however many assemblies it concerns. Where the run ends early, the report says so.
"""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, Protocol
from xml.sax.saxutils import escape, quoteattr

from silo.batch import TopResult, result_json
from silo.bom.errors import Exit, InputError, RemoteError
from silo.bom.findings import Finding, FindingCode, Severity
from silo.bom.naming import display_name
from silo.bom.report import diff_rows, finding_json, shorten
from silo.bom_sync import Outcome, Status, blocking

_LEFT = (Status.BLOCKED, Status.UNREGISTERED, Status.FAILED)
STATUS_WORDS = {
    Status.MERGED: "BOM merged",
    Status.UNCHANGED: "no change, nothing was sent",
    Status.DRY_RUN: "preview only, nothing was sent",
    Status.BLOCKED: "not synced: links are broken (see below; --allow-missing syncs all the same)",
    Status.UNREGISTERED: "not synced: the assembly has no Silo part number (silo-mod register)",
    Status.FAILED: "not synced",
}
# What changed, by the field of the diff.
_CHANGES = {
    "added": "added",
    "quantity_changed": "quantity",
    "conflicts": "a person decides",
    "removed": "not in the assembly",
}


def cell(text: str) -> str:
    """Text of others as Markdown that shows it and does nothing: one line, no markup, nobody is notified.

    On GitHub ``@team`` and ``#12`` mean somebody, escaped or not; a space without width parts them.
    """
    text = "".join(c if c.isprintable() else " " for c in text).strip().replace("&", "&amp;")
    text = re.sub(r"([@#])(?=\w)", "\\1\u200b", text)
    return re.sub(r"([\\\\`*_\[\]<>|~$#])|^(\d*)([-+.)=])", r"\2\\\1\3", text)


@dataclass
class Summary:
    """A run in numbers, and what it leaves to people.

    files, fine, unread, remote, parts
        all that were asked for; those in order; those that could not be read; those that only the server kept
        from it; those without components of others.
    statuses
        how many assemblies ended how.
    errors, warnings
        sentence → the files that it is about.
    moved
        (part, before, now), for files that carry on the identity of one that is gone.
    seconds
        time by stage.
    notes
        what concerns the whole run: its index, its server.
    """

    base: str = ""
    files: int = 0
    fine: int = 0
    unread: int = 0
    remote: int = 0
    parts: int = 0
    statuses: Counter[str] = field(default_factory=Counter)
    lines_changed: int = 0
    errors: dict[str, list[str]] = field(default_factory=dict)
    warnings: dict[str, list[str]] = field(default_factory=dict)
    findings: dict[Finding, None] = field(default_factory=dict)
    unregistered: dict[tuple[str, str], str] = field(default_factory=dict)
    moved: list[tuple[str, str, str]] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def exit_code(self) -> int:
        """0 where all is in order, 1 where something was left undone, 3 where only the server is to blame."""
        if self.fine == self.files:
            return Exit.DONE
        return Exit.REMOTE if self.remote and self.remote == self.files - self.fine else Exit.UNDONE

    def add(self, result: TopResult) -> None:
        """Count a file's result."""
        self.files += 1
        self.fine += result.fine
        causes = [one for one in (result.error, *(o.error for o in result.outcomes)) if one is not None]
        self.remote += bool(causes) and all(isinstance(cause, RemoteError) for cause in causes)
        if result.skipped:
            self.parts += 1
        if result.error is not None:
            self.unread += 1
            self._note(self.errors, str(result.error), result.top)
        for outcome in result.outcomes:
            self.statuses[outcome.status.value] += 1
            if outcome.status in (Status.MERGED, Status.DRY_RUN) and outcome.plan is not None:
                diff = outcome.plan.diff
                self.lines_changed += len(diff.added) + len(diff.quantity_changed)
            if outcome.error is not None:
                self._note(self.errors, str(outcome.error), outcome.assembly.doc_path)
            if outcome.status is Status.UNREGISTERED:
                head = outcome.assembly
                self.unregistered.setdefault(head.key, display_name(head) or head.object_name)
        for entry in result.unregistered:
            self.unregistered.setdefault(entry.key, display_name(entry) or entry.object_name)
        self.add_findings(result.findings, result.top)

    def add_findings(self, findings: Iterable[Finding], top: str = "") -> None:
        """What was noticed; parts without a number have a list of their own."""
        for finding in findings:
            if finding.severity is Severity.INFO or finding.code is FindingCode.UNREGISTERED:
                continue
            self.findings.setdefault(finding)
            where = self.errors if finding.severity is Severity.ERROR else self.warnings
            self._note(where, finding.message, finding.where[0].doc_path if finding.where else top)

    def _note(self, where: dict[str, list[str]], message: str, file: str) -> None:
        files = where.setdefault(shorten(message, self.base), [])
        file = shorten(file, self.base)
        if file not in files:
            files.append(file)

    def to_json(self) -> dict[str, Any]:
        """For machines."""
        return {
            "files": self.files,
            "in_order": self.fine,
            "parts": self.parts,
            "assemblies": dict(self.statuses),
            "lines_changed": self.lines_changed,
            "errors": [{"message": words, "files": files} for words, files in self.errors.items()],
            "warnings": [{"message": words, "files": files} for words, files in self.warnings.items()],
            "unregistered": [
                {"doc_path": shorten(path, self.base), "object": name, "label": label}
                for (path, name), label in self.unregistered.items()
            ],
            "moved": [{"name": name, "from": old, "to": new} for name, old, new in self.moved],
            "notes": self.notes,
            "seconds": {stage: round(seconds, 3) for stage, seconds in self.seconds.items()},
        }

    def sentence(self) -> str:
        """The run in one line."""
        words = [f"{self.fine} of {self.files} files in order"]
        if self.parts:
            words.append(f"{self.parts} of them parts")
        words += [f"{count} {status.replace('_', ' ')}" for status, count in sorted(self.statuses.items())]
        return ", ".join(words) + "."


class Form(Protocol):
    """How a report is written. ``head`` and ``end`` are of one length for the same summary."""

    def head(self, summary: Summary) -> str: ...

    def one(self, result: TopResult, number: int) -> str: ...

    def end(self, summary: Summary | None) -> str:
        """``summary`` None: the run has not ended."""
        ...


class Report:
    """A file that is whole after every result: what is new replaces the end, and brings an end of its own."""

    def __init__(self, path: str, form: Form | None = None) -> None:
        self.path = path
        self.trouble = ""
        self._form = form or form_of(path)
        self._count = 0
        # A terminal or a pipe cannot be written again; it gets the whole at the end.
        later = os.path.exists(path) and not os.path.isfile(path)
        self._file: BinaryIO | None = BytesIO() if later else open(path, "wb")  # noqa: SIM115
        self._end = 0
        self._write(self._form.head(Summary()), self._form.end(None))

    def add(self, result: TopResult) -> None:
        """Write what became of a file."""
        text = self._form.one(result, self._count)
        self._count += bool(text)
        if text:
            self._write(text, self._form.end(None))

    def close(self, summary: Summary | None = None) -> None:
        """End the report; without a summary as it stands."""
        if summary is not None:
            self._write("", self._form.end(summary))
            self._write(self._form.head(summary), "", at=0)
        if self._file is not None:
            with suppress(OSError):
                if isinstance(self._file, BytesIO):
                    Path(self.path).write_bytes(self._file.getvalue())
                self._file.close()

    def _write(self, text: str, end: str, at: int | None = None) -> None:
        if self._file is None:
            return
        new, tail = (part.encode("utf-8", "replace") for part in (text, end))
        try:
            self._file.seek(self._end if at is None else at)
            self._file.write(new + tail)
            if at is None:
                self._end += len(new)
                self._file.truncate()
            self._file.flush()
        except OSError as error:
            self.trouble = f"{self.path} could not be written to its end: {error.strerror or error}"
            with suppress(OSError):
                self._file.close()
            self._file = None


def form_of(path: str) -> Form:
    """The form that a file's ending names. Raises InputError for another."""
    forms: dict[str, Form] = {".md": Markdown(), ".json": Json(), ".xml": JUnit()}
    ending = Path(path).suffix.lower()
    if ending not in forms:
        raise InputError(f"{path}: a report is Markdown (.md), JSON (.json) or JUnit XML (.xml)")
    return forms[ending]


# --- Markdown -------------------------------------------------------------------------------------------


def is_news(outcome: Outcome) -> bool:
    """True for what a reader of a report wants to see: all but assemblies that are as they were."""
    if outcome.status is Status.DRY_RUN:
        return outcome.plan is not None and (outcome.plan.news or outcome.plan.diff.drifted)
    return outcome.status is not Status.UNCHANGED


class Markdown:
    """To read, and to attach to a job."""

    def head(self, summary: Summary) -> str:
        return "# BOM sync\n"

    def one(self, result: TopResult, number: int) -> str:
        return "".join(self._assembly(one, result.base) for one in result.outcomes if is_news(one))

    def _assembly(self, outcome: Outcome, base: str) -> str:
        head = outcome.assembly
        who = " ".join(filter(None, (head.part_number, head.name))) or display_name(head) or head.object_name
        title = f"## {cell(who)}: {STATUS_WORDS[outcome.status]}"
        lines = ["", title, "", cell(shorten(head.doc_path, base)), ""]
        # Nothing changed in a BOM that was not sent.
        plan = outcome.plan if outcome.status not in _LEFT else None
        rows = [
            f"| {' | '.join(map(cell, (_CHANGES[kind], number, outcome.names.get(number, ''), quantity)))} |"
            for kind, number, quantity in (diff_rows(plan.diff) if plan is not None else ())
            if kind in _CHANGES
        ]
        if rows:
            lines += ["| | Part number | Name | Quantity |", "|---|---|---|---:|", *rows, ""]
        lines += [f"- {cell(shorten(reason, base))}" for reason in reasons_of(outcome)]
        return "\n".join(lines).rstrip("\n") + "\n"

    def end(self, summary: Summary | None) -> str:
        if summary is None:
            return "\n*The run has not ended, or was stopped here.*\n"
        lines = ["", "# Summary", "", cell(summary.sentence())]
        for title, told in (("Errors", summary.errors), ("Warnings", summary.warnings)):
            if told:
                lines += ["", f"## {title}", ""]
                lines += [f"- {cell(words)}{_others(words, files)}" for words, files in told.items()]
        if summary.unregistered:
            lines += ["", "## Without a part number", ""]
            lines += [
                f"- {cell(name)} ({cell(shorten(path, summary.base))})"
                for (path, _), name in summary.unregistered.items()
            ]
        if summary.moved:
            lines += ["", "## Moved", ""]
            lines += [f"- {cell(name)}: {cell(old)} → {cell(new)}" for name, old, new in summary.moved]
        lines += [f"\n{cell(note)}" for note in summary.notes]
        if summary.seconds:
            stages = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in summary.seconds.items())
            lines += ["", f"Time: {stages}."]
        return "\n".join(lines) + "\n"


def _others(words: str, files: Iterable[str]) -> str:
    """The files of a sentence that it does not name itself."""
    named = [file for file in files if file and os.path.basename(file) not in words]
    more = f" and {len(named) - 5} more" if len(named) > 5 else ""
    return " " + cell(f"({', '.join(named[:5])}{more})") if named else ""


def reasons_of(outcome: Outcome) -> list[str]:
    """Why an assembly was not synced."""
    if outcome.error is not None:
        return [str(outcome.error)]
    return [finding.message for finding in blocking(outcome.resolved)] if outcome.status in _LEFT else []


# --- for machines ---------------------------------------------------------------------------------------


class Json:
    """``{"results": […], "ended": true, "summary": {…}}``."""

    def head(self, summary: Summary) -> str:
        return '{"results": ['

    def one(self, result: TopResult, number: int) -> str:
        return ("," if number else "") + "\n" + json.dumps(result_json(result))

    def end(self, summary: Summary | None) -> str:
        if summary is None:
            return '\n], "ended": false}\n'
        told = [finding_json(finding, summary.base) for finding in summary.findings]
        data: Mapping[str, Any] = {**summary.to_json(), "findings": told}
        return f'\n], "ended": true, "summary": {json.dumps(data)}}}\n'


class JUnit:
    """For CI: a test case per assembly, and per file that could not be read."""

    def head(self, summary: Summary) -> str:
        count = summary.statuses
        left = count[Status.BLOCKED] + count[Status.UNREGISTERED]
        tests, errors = count.total() + summary.unread, count[Status.FAILED] + summary.unread
        # Of one length, so that the numbers can be put in at the end.
        return (
            '<?xml version="1.0" encoding="UTF-8"?>\n<testsuites>\n<testsuite name="silo-mod sync" '
            f'tests="{tests:09d}" failures="{left:09d}" errors="{errors:09d}">'
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

    def end(self, summary: Summary | None) -> str:
        told = "the run has not ended, or was stopped here" if summary is None else summary.sentence()
        return f"\n<system-out>{escape(_clean(told))}</system-out>\n</testsuite>\n</testsuites>\n"


def _clean(text: str) -> str:
    return "".join(c if c.isprintable() or c == "\n" else "�" for c in text)


def _attribute(text: str) -> str:
    return quoteattr(_clean(text).replace("\n", " "))
