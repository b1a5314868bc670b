# SPDX-License-Identifier: LGPL-2.1-or-later
"""One plan for many files: which assemblies there are, each once, and in which order they are synced.

Every file is asked for its assembly, then for the sub-assemblies that others use and that were not asked for
yet. The plan keeps how the assemblies hang together, not what they hold; that is asked for again, from the
index, when an assembly's turn comes. So memory grows with the number of files, and little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from typing import Any

from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import SeveralAssembliesError, SiloError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.message import message
from silo.bom.snapshot import whole_row
from silo.bom.walk.links import MAX_LEVELS, Rings
from silo.bom.walk.shared_identity import copied_identity
from silo.bom.walk.standard import standard_uuid
from silo.fcstd.suggest import with_suggestions
from silo.vault.questions import Question, collecting_seldom
from silo.vault.reading import VaultReader, WalkAnswer

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
        findings that need the whole plan: by assembly, and general.
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
            replace(entry, is_assembly=self._assemblies.get(_part(entry), entry.is_assembly))
            for entry in found.entries
        )
        findings = dict.fromkeys(self._with_suggestion.get(finding, finding) for finding in found.findings)
        for key in (node.key, *map(_part, entries)):
            findings.update(dict.fromkeys(self.findings.get(key, ())))
        return replace(found, entries=entries, findings=tuple(findings))


def _part(entry: BomEntry) -> Key:
    """Return the key of the part that an entry shows: of a variant, its original."""
    return (entry.doc_path, entry.object_name) if entry.variant else entry.key


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
    answers = reading.ask_many((Question(top, assembly, hardware) for top in tops), progress)
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
            text = message(
                "The assembly is nested more than {max_levels} levels deep, so it is not synced.",
                max_levels=MAX_LEVELS,
            )
            _tell(plan, node.key, FindingCode.TOO_DEEP, text, [node.key])


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
            text = message(
                "{count} assemblies carry the same Silo identity {uuid}: {files}. They hold "
                "different components, so none of them is synced. Give the new one a number of "
                "its own.",
                count=len(nodes),
                uuid=uuid,
                files=files,
            )
            for key in keys:
                _tell(plan, key, FindingCode.COPIED_IDENTITY, text, keys)
    paths: dict[str, set[str]] = {}
    for uuid, path in plan.places:
        paths.setdefault(uuid, set()).add(path)
    for uuid, several in paths.items():
        if len(several) > 1 and uuid not in users:
            plan.shared.append(copied_identity(uuid, tuple(map(Place, sorted(several)))))


def _tell(plan: Plan, key: Key, code: FindingCode, text: str, where: Iterable[Key]) -> None:
    places = tuple(sorted({Place(*place) for place in where}))
    plan.findings.setdefault(key, []).append(Finding(code, Severity.ERROR, text, places))


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
