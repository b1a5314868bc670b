# SPDX-License-Identifier: LGPL-2.1-or-later
"""One plan for many files: which assemblies there are, each once, and in which order they are synced.

Every file is asked for its assembly, then for the sub-assemblies that others use and nobody has asked for.
The plan keeps how the assemblies hang together, not what they hold; that is asked for again, from the index,
when an assembly's turn comes. So memory grows with the number of files, and little.

A job carries a plan out: it looks everything up at once, compares, and merges what is news, children before
parents. Requests depend on the number of identities and of changes, not on that of assemblies: identities
and BOMs are asked for by the thousand. Assemblies that do not depend on each other are merged side by side.
Whatever ends the job, the next one continues: what was merged agrees then, and is not sent again. There is
one job at a time on a vault: if its disk carries no locks, the report says what that cannot prevent.
"""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from pathlib import Path
from typing import Any
from uuid import uuid4

from silo.api.policy import ends_run
from silo.api.wire import SourceDocument
from silo.batch import SyncOptions, TopResult, source_document, suggest_by_identity
from silo.bom.compare.states import ComparedAssembly
from silo.bom.document import relative
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import CancelledError, DocumentError, InputError, SeveralAssembliesError, SiloError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.items.lookup import Known
from silo.bom.links import MAX_LEVELS, Rings, extract
from silo.bom.roots import choose_assembly, find_assemblies
from silo.bom.snapshot import whole_row
from silo.bom.standard import standard_uuid
from silo.bom.view.folders import shorten
from silo.bom.walk.shared_identity import copied_identity
from silo.bom_sync.resolved import Resolved, blocking, known_items, resolve_known
from silo.bom_sync.steps import Outcome, Status, SyncApi, plain_lines, sync
from silo.fcstd import Library
from silo.fcstd.suggest import with_suggestions
from silo.files import documents_in
from silo.folder_lock import folder_lock
from silo.vault.reading import Question, VaultReader, WalkAnswer, collecting_seldom, grouped


@dataclass(frozen=True, slots=True)
class FolderBoms:
    """What the files of a folder say. Paths are relative to it.

    unreadable
        file and reason, for files that could not be read.
    findings
        what keeps a BOM from being complete (severity error), each once.
    """

    base: str
    assemblies: tuple[ComparedAssembly, ...] = ()
    unreadable: tuple[tuple[str, str], ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def complete(self) -> bool:
        """Return True if every file was read and every BOM is whole."""
        return not self.unreadable and not self.findings


def read_folder(
    folder: Path | str, *, root: Path | str | None = None, lost: Sequence[tuple[str, str]] = ()
) -> FolderBoms:
    """Read all assemblies below a folder. ``root``: no file outside of it is read.

    lost
        each file that is known to be missing, and the reason.

    Raises InputError if there is no such folder. A file that cannot be read is reported in the result.
    """
    base = os.path.realpath(folder)
    if not os.path.isdir(base):
        raise InputError(f"{folder} is not a folder. Name a folder of FreeCAD files.")
    assemblies: dict[tuple[str, str], ComparedAssembly] = {}
    unreadable = [(relative(os.path.join(root or base, path), base), why) for path, why in lost]
    findings: dict[Finding, None] = {}
    with Library(root) as library:
        for path in _users_first(documents_in([base]), library):
            try:
                for extraction in _extractions(library, path, assemblies):
                    findings.update(
                        dict.fromkeys(f for f in extraction.findings if f.severity is Severity.ERROR)
                    )
                    for assembly in _assemblies(extraction):
                        assemblies.setdefault(assembly.head.key, assembly)
            except SiloError as error:
                unreadable.append((relative(path, base), _without(str(error), base, root)))
    ordered = sorted(assemblies.values(), key=lambda assembly: assembly.head.key)
    return FolderBoms(
        base,
        tuple(_relative(assembly, base) for assembly in ordered),
        tuple(unreadable),
        tuple(replace(finding, message=_without(finding.message, base, root)) for finding in findings),
    )


def _without(message: str, base: str, root: Path | str | None) -> str:
    """Shorten the paths in a message, also those beside the folder, since the root may be a temporary one."""
    message = shorten(message, base)
    if root is None or (top := os.path.realpath(root)) == base:
        return message
    return message.replace(top + os.sep, f"{relative(top, base)}/")


def _users_first(paths: Sequence[str], library: Library) -> list[str]:
    """Put files to which no other links first, so that the files that they use are walked once, as part of
    them.
    """
    used: set[str] = set()
    for path in paths:
        with suppress(SiloError):  # reported when it is read
            used.update(os.path.basename(recorded).lower() for recorded in library.open(path).linked())
    return sorted(paths, key=lambda path: os.path.basename(path).lower() in used)


def _extractions(
    library: Library, path: str, assemblies: dict[tuple[str, str], ComparedAssembly]
) -> Iterator[Extraction]:
    """Yield the BOMs of a file's assemblies, but not those that were read as part of another one."""
    document = library.open(path)
    for top in _tops(document):
        if (document.FileName, top.Name) not in assemblies:
            yield extract(top)


def _tops(document: Any) -> Iterable[Any]:
    try:
        return (choose_assembly(document),)
    except InputError:  # if several are equally likely, all of them count here
        return find_assemblies(document)


def _assemblies(extraction: Extraction) -> Iterator[ComparedAssembly]:
    """Yield the assembly itself and every sub-assembly below it that has lines."""
    seen: set[int] = set()
    stack = [(extraction.assembly, extraction.entries)]
    while stack:
        head, lines = stack.pop()
        if lines and id(lines) not in seen:
            seen.add(id(lines))
            yield ComparedAssembly(replace(head, children=(), quantity=1, level=0), tuple(lines))
            stack += [(line, line.children) for line in lines]


def _relative(assembly: ComparedAssembly, base: str) -> ComparedAssembly:
    def moved(entry: BomEntry) -> BomEntry:
        return replace(entry, doc_path=relative(entry.doc_path, base), children=())

    return ComparedAssembly(moved(assembly.head), tuple(moved(line) for line in assembly.lines))


Key = tuple[str, str]


@dataclass(slots=True)
class PlannedAssembly:
    """One assembly of the plan.

    top
        the file, as the caller named it, whose result it is part of.
    below
        its sub-assemblies.
    content
        a digest of its lines by identity: two copies of one file have the same.
    broken
        it misses files.
    """

    key: Key
    top: str
    question: Question
    uuid: str | None
    below: list[Key]
    content: bytes
    is_assembly: bool
    broken: bool


@dataclass
class Plan:
    """What is to be synced.

    layers
        children before parents; those of one layer do not depend on each other.
    errors
        file → why it could not be read.
    parts
        how many files hold no components of others.
    uuids, standards
        all that is to be looked up: identities, and the standard parts by theirs.
    places
        (identity, file) of every component.
    spares
        the same of files that hold no components of others, used or not.
    findings, shared
        what only the whole plan shows: of one assembly, and of none.
    """

    tops: list[str] = field(default_factory=list)
    nodes: dict[Key, PlannedAssembly] = field(default_factory=dict)
    layers: list[list[PlannedAssembly]] = field(default_factory=list)
    errors: dict[str, SiloError] = field(default_factory=dict)
    parts: int = 0
    uuids: dict[str, None] = field(default_factory=dict)
    standards: dict[str, BomEntry] = field(default_factory=dict)
    places: set[tuple[str, str]] = field(default_factory=set)
    spares: set[tuple[str, str]] = field(default_factory=set)
    findings: dict[Key, list[Finding]] = field(default_factory=dict)
    shared: list[Finding] = field(default_factory=list)
    _assemblies: dict[Key, bool] = field(default_factory=dict)
    _with_suggestion: dict[Finding, Finding] = field(default_factory=dict)
    _files: dict[str, str] = field(default_factory=dict)

    def extraction(self, node: PlannedAssembly, reading: VaultReader) -> Extraction:
        """Return what an assembly holds, with everything that the whole plan knows about it. Raises
        SiloError.
        """
        found = reading.ask(node.question).found
        if isinstance(found, SiloError):
            raise found
        entries = tuple(
            replace(entry, is_assembly=self._assemblies.get(entry.key, entry.is_assembly))
            for entry in found.entries
        )
        findings = dict.fromkeys(self._with_suggestion.get(finding, finding) for finding in found.findings)
        for key in (node.key, *(entry.key for entry in entries)):
            findings.update(dict.fromkeys(self.findings.get(key, ())))
        return replace(found, entries=entries, findings=tuple(findings))


@collecting_seldom()
def make_plan(
    tops: Sequence[str],
    reading: VaultReader,
    *,
    assembly: str | None = None,
    hardware: bool = True,
    each: bool = True,
    recursive: bool = True,
    skip_parts: bool = True,
    progress: Callable[[str], None] = lambda _top: None,
) -> Plan:
    """Read all files and put their assemblies in order.

    each
        if a file has several assemblies, read all of them.
    recursive
        with the sub-assemblies, even if no file of ``tops`` has them.
    skip_parts
        leave out files without components of other files, and unregistered libraries of parts.
    """
    plan = Plan(list(tops))
    several: dict[Key, str] = {}
    below: dict[Key, str] = {}
    asked_for = _announced(tops, progress)
    answers = reading.ask_many(Question(top, assembly, hardware) for top in asked_for)
    for top, answer in zip(tops, answers, strict=True):
        error = _error(answer)
        if each and isinstance(error, SeveralAssembliesError):
            several |= {(error.path, name): top for name in error.names}
            plan._files.setdefault(error.path, top)
            continue
        if error is not None:
            plan.errors[top] = error
            continue
        head, entries = rows = _rows(answer.plain)
        path = head["doc_path"]
        plan._files.setdefault(path, top)
        if skip_parts and _is_part(answer.plain, head, entries):
            plan.parts += 1
            plan.spares.add(((head["silo_uuid"] or "").lower(), path))
            plan._assemblies.setdefault((path, head["object_name"]), head["is_assembly"])
        else:
            _add(plan, _node(answer.question, rows, top), rows, below)
    wanted = several | (below if recursive else {})
    while asked := {key: top for key, top in wanted.items() if key not in plan._assemblies}:
        wanted, below = {}, {}
        questions = [Question(path, name, hardware, name_only=True) for path, name in asked]
        for (key, top), answer in zip(asked.items(), reading.ask_many(questions), strict=True):
            plan._assemblies[key] = False
            if _error(answer) is not None:
                continue
            rows = _rows(answer.plain)
            if (node := _node(answer.question, rows, top)).is_assembly:
                _add(plan, node, rows, below)
                plan._assemblies[key] = True  # the name that the link has for it
        wanted = below if recursive else {}
    _add_used_parts(plan, reading, hardware, recursive)
    for node in plan.nodes.values():
        node.below = [key for key in dict.fromkeys(node.below) if key in plan.nodes]
    _put_in_order(plan)
    _find_copies(plan)
    _find_meant(plan, reading)
    return plan


def _announced(tops: Iterable[str], progress: Callable[[str], None]) -> Iterator[str]:
    for top in tops:
        progress(top)
        yield top


def _error(answer: WalkAnswer) -> SiloError | None:
    if "table" in answer.plain:
        return None
    error = answer.found
    assert isinstance(error, SiloError)  # the only other thing that an answer may be
    return error


_Row = Mapping[str, Any]
_Rows = tuple[_Row, list[_Row]]


def _rows(plain: Mapping[str, Any]) -> _Rows:
    """Return the rows of the assembly and of its components."""
    table = plain["table"]
    return whole_row(table[plain["assembly"]]), [whole_row(table[number]) for number in plain["entries"]]


def _is_part(plain: Mapping[str, Any], head: _Row, entries: Sequence[_Row]) -> bool:
    """Return True if it is no assembly: it is empty, or an unregistered file of screws or parts for others to
    link.
    """
    if any(finding["severity"] == Severity.ERROR for finding in plain["findings"]):
        return False
    if not entries:  # a named assembly of own parts that are no items yet is one anyway
        return not (head.get("own") and (head["is_assembly"] or head["silo_uuid"]))
    return head["silo_uuid"] is None and all(entry["doc_path"] == head["doc_path"] for entry in entries)


def _is_article(row: Mapping[str, Any]) -> bool:
    standard = row["standard"]
    return standard is not None and row["silo_uuid"] == standard_uuid(standard)


def _node(question: Question, rows: _Rows, top: str) -> PlannedAssembly:
    head, entries = rows
    content = sorted(
        (str(e["silo_uuid"] or (e["doc_path"], e["object_name"])), e["quantity"]) for e in entries
    )
    return PlannedAssembly(
        (head["doc_path"], head["object_name"]),
        top,
        question,
        head["silo_uuid"],
        [(e["doc_path"], e["object_name"]) for e in entries if e["is_assembly"] and not e["missing"]],
        blake2b(repr(content).encode("utf-8", "surrogateescape"), digest_size=8).digest(),
        head["is_assembly"],
        any(e["missing"] for e in entries),
    )


def _add(plan: Plan, node: PlannedAssembly, rows: _Rows, wanted: dict[Key, str]) -> None:
    plan.nodes.setdefault(node.key, node)
    plan._assemblies[node.key] = True
    head, entries = rows
    for row in (head, *entries):
        if (uuid := row["silo_uuid"]) is None:
            continue
        plan.uuids[uuid] = None
        if _is_article(row):
            plan.standards.setdefault(uuid, _entry(row))
        elif not row["missing"]:
            plan.places.add((uuid.lower(), row["doc_path"]))
    for key in node.below:
        wanted.setdefault(key, node.top)


def _entry(row: Mapping[str, Any]) -> BomEntry:
    names = ("doc_path", "silo_uuid", "object_name", "standard", "label")
    return BomEntry(**{name: row[name] for name in names})


def _add_used_parts(plan: Plan, reading: VaultReader, hardware: bool, recursive: bool) -> None:
    """Add named assemblies without components if another assembly uses them."""
    if not recursive:
        return
    used = {key: node.top for node in plan.nodes.values() for key in node.below}
    empty = {key: top for key, top in used.items() if key not in plan.nodes and plan._assemblies.get(key)}
    questions = [Question(path, name, hardware, name_only=True) for path, name in empty]
    for top, answer in zip(empty.values(), reading.ask_many(questions), strict=True):
        if _error(answer) is None:
            rows = _rows(answer.plain)
            _add(plan, _node(answer.question, rows, top), rows, {})


# --- order ----------------------------------------------------------------------------------------------


def _put_in_order(plan: Plan) -> None:
    for node in plan.nodes.values():  # a file of its own has a result of its own
        node.top = plan._files.get(node.key[0], node.top)
    waits = {key: len(node.below) for key, node in plan.nodes.items()}
    above: dict[Key, list[Key]] = {}
    for key, node in plan.nodes.items():
        for child in node.below:
            above.setdefault(child, []).append(key)
    layer = [key for key, count in waits.items() if not count]
    while layer:
        plan.layers.append([plan.nodes[key] for key in layer])
        further = []
        for key in layer:
            del waits[key]
            for parent in above.get(key, ()):
                waits[parent] -= 1
                if not waits[parent]:
                    further.append(parent)
        layer = further
    if waits:
        _report_rings(plan, list(waits))
        plan.layers.append([plan.nodes[key] for key in waits])
    for deep in plan.layers[MAX_LEVELS:]:
        for node in deep:
            message = f"The assembly is nested more than {MAX_LEVELS} levels deep, so it is not synced."
            _tell(plan, node.key, FindingCode.TOO_DEEP, message, [node.key])


def _report_rings(plan: Plan, keys: Sequence[Key]) -> None:
    """Report assemblies that contain themselves, and those above them, since their number of pieces is
    unknown.
    """
    rings = Rings({key: plan.nodes[key].below for key in plan.nodes})
    for key in keys:
        members = [key] if rings.same_ring(key, key) else [k for k in keys if rings.same_ring(k, k)]
        ring = rings.example(members[0])
        path = " → ".join(str(Place(*node)) for node in (*ring, ring[0]))
        _tell(plan, key, FindingCode.CYCLE, FindingCode.CYCLE.sentence.format(path=path), [*ring, key])


def _find_copies(plan: Plan) -> None:
    """Find files that claim to be the same item: fine if they hold the same, else no BOM of that item is
    right.
    """
    users: dict[str, list[PlannedAssembly]] = {}
    for node in plan.nodes.values():
        if node.uuid:
            users.setdefault(node.uuid.lower(), []).append(node)
    for uuid, nodes in users.items():
        if len({node.content for node in nodes}) > 1:
            keys = [node.key for node in nodes]
            files = ", ".join(sorted(str(Place(*key)) for key in keys))
            message = (
                f"{len(nodes)} assemblies carry the same Silo identity {uuid}: {files}. They hold different "
                "components, so none of them is synced. Give the new one a number of its own."
            )
            for key in keys:
                _tell(plan, key, FindingCode.COPIED_IDENTITY, message, keys)
    paths: dict[str, set[str]] = {}
    for uuid, path in plan.places:
        paths.setdefault(uuid, set()).add(path)
    for uuid, several in paths.items():
        if len(several) > 1 and uuid not in users:
            plan.shared.append(copied_identity(uuid, tuple(map(Place, sorted(several)))))


def _tell(plan: Plan, key: Key, code: FindingCode, message: str, where: Iterable[Key]) -> None:
    places = tuple(sorted({Place(*extraction) for extraction in where}))
    plan.findings.setdefault(key, []).append(Finding(code, Severity.ERROR, message, places))


def _find_meant(plan: Plan, reading: VaultReader) -> None:
    """Find the files that were meant by missing ones; reads the project's files once for all."""
    broken = [node for node in plan.nodes.values() if node.broken]
    if not broken:
        return
    extractions = [
        extraction
        for extraction in (reading.ask(node.question).found for node in broken)
        if isinstance(extraction, Extraction)
    ]
    heads = [replace(extraction.assembly, children=extraction.entries) for extraction in extractions]
    findings = [finding for extraction in extractions for finding in extraction.findings]
    used = [BomEntry(path) for path in sorted({path for _, path in plan.places})]
    whole = Extraction(replace(heads[0], children=()), (*heads, *used), tuple(findings))
    for before, after in zip(findings, with_suggestions(whole).findings, strict=True):
        if after is not before:
            plan._with_suggestion[before] = after


NAME = ".silo-sync.lock"


@contextmanager
def only_job(folder: str) -> Iterator[str]:
    """Keep a second job away from a folder; yields what the lock cannot prevent, "" for nothing.

    Raises InputError with the name of the first job.
    """
    with folder_lock(folder, NAME, "synced") as problem:
        yield problem and (
            f"{folder} cannot be locked ({problem}): a job of another user or machine is not "
            "noticed. Two jobs at once cost requests; the BOMs are right anyway."
        )


_AT_ONCE = 500  # assemblies whose BOMs are in memory at one time
_SENDERS = 4
Lines = Mapping[str, Sequence[Mapping[str, Any]]]
_KEPT = ("id", "part_number", "name", "description", "last_sync")


@dataclass
class SyncJob:
    """One run of a plan.

    base
        the folder that paths in the results are relative to; "" for that of each file.
    stop
        set where the job is interrupted, so that no merge waits for a busy server any more.
    senders
        merges that are under way at one time.
    """

    plan: Plan
    reading: VaultReader
    api: SyncApi
    options: SyncOptions
    base: str
    stop: threading.Event = field(default_factory=threading.Event)
    senders: int = _SENDERS

    def __post_init__(self) -> None:
        self.stopped: SiloError | None = None
        self._sent: dict[str, Future[Outcome]] = {}

    def results(self) -> Iterator[TopResult]:
        """Yield the result of each file as soon as it is known; files that could not be read come first."""
        for top, error in self.plan.errors.items():
            yield TopResult(top, self._base(top), error=error)
        try:
            items = self._known_items()
        except SiloError as error:
            self.stopped = error
            for top, count in Counter(node.top for node in self.plan.nodes.values()).items():
                yield TopResult(top, self._base(top), error=error, left=count)
            return
        left = Counter(node.top for node in self.plan.nodes.values())
        done: dict[str, list[Outcome]] = {}
        for layer in self.plan.layers:
            for nodes in grouped(layer, _AT_ONCE):
                for node, outcome in zip(nodes, self._outcomes(nodes, items), strict=True):
                    done.setdefault(node.top, []).append(outcome)
                    left[node.top] -= 1
                    if not left[node.top]:
                        yield TopResult(node.top, self._base(node.top), outcomes=tuple(done.pop(node.top)))

    def _base(self, top: str) -> str:
        return self.base or os.path.dirname(os.path.realpath(top))

    def _known_items(self) -> Known:
        """Look up the items of everything in the plan, and keep what is needed of them."""
        items = known_items(self.plan.uuids, self.plan.standards.values(), self.api)
        return {
            key: {name: item.get(name) for name in _KEPT} for key, item in items.items() if item is not None
        }

    def _outcomes(self, nodes: Sequence[PlannedAssembly], items: Known) -> list[Outcome]:
        """Sync assemblies that do not depend on each other."""
        several = [resolve_known(self.plan.extraction(node, self.reading), items) for node in nodes]
        numbers = [resolved.assembly.part_number for resolved in several]
        lines = self._lines([number for number in numbers if number is not None])
        several = [self._with_suggestion(resolved, lines) for resolved in several]
        with ThreadPoolExecutor(self.senders, "silo-merge") as pool:
            asked = []
            try:
                for resolved in several:
                    number = resolved.assembly.part_number
                    first = self._sent.get(number or "")
                    # Copies of one file are one item, and one merge.
                    if first is None or blocking(resolved):
                        first = pool.submit(self._sync, resolved, lines)
                        if number is not None and not blocking(resolved):
                            self._sent[number] = first
                    asked.append(first)
                outcomes = [future.result() for future in asked]
            except BaseException:  # Ctrl-C, also while the first are sent; the senders end what is under way
                self.stopped = self.stopped or CancelledError("the job was stopped")
                self.stop.set()
                raise
        return [
            outcome if outcome.resolved is resolved else _as_the_first(resolved, outcome)
            for resolved, outcome in zip(several, outcomes, strict=True)
        ]

    def _with_suggestion(self, resolved: Resolved, lines: Lines) -> Resolved:
        """Add to findings of missing files the file that has the identity known from the last sync."""
        line = lines.get(resolved.assembly.part_number or "", ())
        return suggest_by_identity(resolved, [(resolved, line)], self._files_with if self.base else None)

    def _files_with(self, identities: Iterable[str]) -> set[str]:
        """Return the files of the folder that have one of these identities. All were read; none is read
        again.
        """
        wanted = {identity.lower() for identity in identities}
        return {path for identity, path in self.plan.places | self.plan.spares if identity in wanted}

    def _lines(self, numbers: Sequence[str]) -> Lines:
        many = getattr(self.api, "get_boms", None)
        if self.stopped is not None or many is None or not numbers:
            return {}
        try:
            return {number: plain_lines(answer) for number, answer in many(numbers).items()}
        except SiloError as error:
            self._stop_for(error)
            return {}

    def _sync(self, resolved: Resolved, lines: Lines) -> Outcome:
        if self.stopped is not None:
            return Outcome(Status.FAILED, resolved, error=self.stopped)
        try:
            outcome = sync(
                resolved,
                self.api,
                sync_id=str(uuid4()),
                allow_missing=self.options.allow_missing
                and not any(
                    finding.code in (FindingCode.CYCLE, FindingCode.TOO_DEEP) for finding in resolved.findings
                ),
                dry_run=self.options.dry_run,
                describe=lambda: self._source(resolved),
                lines=lines.get(resolved.assembly.part_number or ""),
            )
        except SiloError as error:
            outcome = Outcome(Status.FAILED, resolved, error=error)
        if outcome.error is not None:
            self._stop_for(outcome.error)
        return outcome

    def _source(self, resolved: Resolved) -> SourceDocument:
        """Describe the file of a BOM that is about to be sent. DocumentError if it changed since it was
        read.
        """
        if not self.reading.index.untouched(resolved.assembly.doc_path):
            raise DocumentError(
                resolved.assembly.doc_path, "it was changed while the job ran; the next run takes it"
            )
        return source_document(resolved.assembly)

    def _stop_for(self, error: SiloError) -> None:
        """End the job for an error that concerns every request; the remaining assemblies get it as their
        error.
        """
        if self.stopped is None and ends_run(error, self.api):
            self.stopped = error


def _as_the_first(resolved: Resolved, first: Outcome) -> Outcome:
    """Make the outcome of a copy from that of the file that was sent for both."""
    status = Status.UNCHANGED if first.status is Status.MERGED else first.status
    return replace(first, resolved=resolved, status=status, result=None)
