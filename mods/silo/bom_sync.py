# SPDX-License-Identifier: LGPL-2.1-or-later
"""The whole BOM sync on one page: extract → resolve → diff → merge (spec bom-sync, "Data Flow").

::

    document ── extract ──▶ Extraction ── resolve ──▶ Resolved ── compare ──▶ MergePlan ── merge ──▶ Outcome
    (FreeCAD,               (frozen)     (by UUID)   (frozen)     (server's   (frozen)     (one     (frozen)
     FCStd)                                                        lines)                  request)

What a run needs from the server is fetched before each pure step; nothing here knows where the document
came from or who shows the result. Nothing is ever deleted, and manual lines are never touched: that is the
server's rule too, so a faulty client cannot break it.

Standard parts have one item per designation and server, for all people and projects. Their identity is
derived from the designation, so no file is stamped. A server that lets us choose an item's UUID has it under
that one. Another server (or one where somebody made the item by hand) has an item whose description is
exactly the designation; its UUID is remembered in the user's folder.

:class:`ActivityText` is a merge in the words of the Activity pane (spec bom-sync §6): plain text, never
markup. The command line shows it in English, the pane in the user's language: it passes its ``translate``.
"""

from __future__ import annotations

import os.path
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Protocol, cast

from silo.api.wire import (
    Component,
    LastSync,
    LeftOutPart,
    MergeDiff,
    MergeEntry,
    MergeEvent,
    MergeRequest,
    MergeResult,
    MergeWarning,
    ProductSummary,
    Revision,
    SourceDocument,
)
from silo.bom.compare.difference import diff_bom
from silo.bom.compare.merge import MergePlan, plan_merge
from silo.bom.consolidation import consolidation_findings
from silo.bom.document import relative
from silo.bom.errors import SiloError, Translate, english
from silo.bom.findings import Finding, FindingCode, Severity
from silo.bom.items.lookup import ItemLookup, Known, look_up
from silo.bom.items.resolve import (
    numbered_findings,
    resolve_part_numbers,
    resolve_with,
    unregistered_findings,
)
from silo.bom.links import extract, extract_bom_links
from silo.bom.model import BomDiff, BomEntry, Extraction, walk_entries
from silo.bom.report import LeftOut, components_of, left_out_of
from silo.platform import cache_folder, data_folder, read_memory, write_memory

# Each costs a request, and only while nobody has registered the part.
MOST_LOOKED_UP = 200


class Memory:
    """Server → UUID derived from the designation → UUID of the item there. One small file."""

    def __init__(self, path: Path | None = None) -> None:
        self.path = path or data_folder() / "standard-items.json"

    def known(self, server: str) -> dict[str, str]:
        """Return what is remembered of a server; {} if the file cannot be read, which only costs a search."""
        return self._read().get(server, {})

    def remember(self, server: str, items: Mapping[str, str]) -> None:
        """Keep what was found or made. If it cannot be written, that costs a search."""
        servers = self._read()
        before = servers.get(server, {})
        if items.items() <= before.items():
            return
        write_memory(self.path, {**servers, server: {**before, **items}})

    def _read(self) -> dict[str, dict[str, str]]:
        return {server: items for server, items in read_memory(self.path).items() if isinstance(items, dict)}


def find_items(
    entries: Iterable[BomEntry], items_by_uuid: Mapping[str, Any], api: Any, memory: Memory | None = None
) -> dict[str, Mapping[str, Any]]:
    """Find the items of standard parts that the server does not know by their UUID: UUID → item.

    items_by_uuid
        what the server answered for the UUIDs of the whole tree.
    """
    wanted = {
        entry.silo_uuid: entry.standard
        for entry in walk_entries(entries)
        if entry.is_standard
        and entry.silo_uuid
        and entry.standard
        and items_by_uuid.get(entry.silo_uuid) is None
    }
    if not wanted:
        return {}
    memory = memory or Memory()
    items = dict(_remembered(wanted, api, memory))
    # A server that reports its last syncs keeps the UUIDs that it is given, so nothing more is asked.
    if any(item is not None and item.get("last_sync") is not None for item in items_by_uuid.values()):
        return items
    searched = {}
    for uuid, designation in [pair for pair in wanted.items() if pair[0] not in items][:MOST_LOOKED_UP]:
        if (item := by_description(designation, api)) is not None:
            searched[uuid] = item
    if searched:
        memory.remember(server_of(api), {uuid: str(item["id"]) for uuid, item in searched.items()})
    return items | searched


def _remembered(
    wanted: Mapping[str, str], api: Any, memory: Memory
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    items = memory.known(server_of(api))
    for uuid, item_id in ((uuid, items[uuid]) for uuid in wanted if uuid in items):
        if (item := api.get_item_by_uuid(item_id)) is not None:
            yield uuid, item


def by_description(designation: str, api: Any) -> Mapping[str, Any] | None:
    """Find the one item whose description (or name) is exactly the designation; None if none or several have
    it.
    """
    search = getattr(api, "search_items", None)
    if not callable(search):
        return None
    try:
        items = {str(item["id"]): item for item in search(designation)}
    except SiloError:
        return None  # nothing is lost: the part reads as unregistered, and can be registered
    same = [
        item
        for item in items.values()
        if designation in (item.get("description"), item.get("name"))
        and str(item.get("item_type") or "part") != "assembly"
    ]
    return same[0] if len(same) == 1 else None


def server_of(api: Any) -> str:
    """Return the name by which a memory knows the server."""
    return str(getattr(api, "base_url", ""))


__all__ = [
    "BomDiff",
    "BomEntry",
    "Extraction",
    "Outcome",
    "Resolved",
    "Status",
    "compare",
    "diff_bom",
    "extract",
    "extract_bom_links",
    "plan_merge",
    "resolve",
    "resolve_part_numbers",
    "sync",
    "sync_tree",
]


class SyncApi(ItemLookup, Protocol):
    """What a sync needs of a Silo; :class:`silo.api.client.SiloClient` has it."""

    def get_bom(self, part_number: str, /) -> Sequence[Any]: ...

    def merge_bom(self, part_number: str, request: MergeRequest, /) -> MergeResult: ...


class Status(StrEnum):
    """How the sync of one assembly ended."""

    MERGED = "merged"  # the server's BOM took the changes
    UNCHANGED = "unchanged"  # nothing to change, nothing was sent
    DRY_RUN = "dry_run"  # this is what would change; nothing was sent
    BLOCKED = "blocked"  # a broken link: not sent, so that nothing reads as removed
    UNREGISTERED = "unregistered"  # the assembly itself has no part number yet
    FAILED = "failed"  # the server or the way to it


class _Findings(tuple[Finding, ...]):
    """The findings of a whole tree, whose assemblies each ask for what blocks them."""

    @cached_property
    def _by_file(self) -> Mapping[str, list[int]]:
        """Return the numbers of each file's errors; under "" those of the loops, which block every
        assembly.
        """
        numbers: dict[str, list[int]] = {}
        for number, finding in enumerate(self):
            if finding.severity is Severity.ERROR:
                loop = finding.code in (FindingCode.CYCLE, FindingCode.TOO_DEEP)
                for path in [""] if loop else dict.fromkeys(place.doc_path for place in finding.where):
                    numbers.setdefault(path, []).append(number)
        return numbers

    def blocking(self, path: str) -> tuple[Finding, ...]:
        by_file = self._by_file
        return tuple(self[number] for number in sorted({*by_file.get("", ()), *by_file.get(path, ())}))


@dataclass(frozen=True)
class Resolved:
    """One assembly with its direct children as the server knows them."""

    assembly: BomEntry
    entries: tuple[BomEntry, ...]
    unresolved: tuple[BomEntry, ...]
    findings: tuple[Finding, ...]
    # UUID of an assembly → what the server remembers of its last sync; a server that does not is not in it.
    last_syncs: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.findings, _Findings):
            object.__setattr__(self, "findings", _Findings(self.findings))

    @property
    def unregistered(self) -> tuple[BomEntry, ...]:
        """Return the components without an item, parts first; the assembly itself comes last."""
        head = () if self.assembly.part_number else (self.assembly,)
        return tuple(
            sorted((*self.unresolved, *head), key=lambda e: (e.is_assembly, e.is_standard, -e.level))
        )

    @property
    def folder(self) -> str:
        """Return the folder of the assembly's file; a merge names components relative to it."""
        return os.path.dirname(self.assembly.doc_path)

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """Return everything that a sync of this assembly cannot send."""
        errors = (finding for finding in blocking(self))
        return left_out_of(self.entries, self.assembly.unregistered, errors, self.folder)

    def diff(self, lines: Iterable[Mapping[str, Any]]) -> BomDiff:
        """Compare CAD with these lines of the server."""
        return diff_bom(self.entries, lines, self._missing())

    def plan(self, lines: Iterable[Mapping[str, Any]]) -> MergePlan:
        """Plan a merge into these lines of the server."""
        return plan_merge(self.entries, lines, self._missing())

    def is_news(self, plan: MergePlan, lines: Iterable[Mapping[str, Any]] = ()) -> bool:
        """Return True if the server learns anything from a merge into these lines: also if only that the BOM
        is complete or incomplete now, or that a component has another file.
        """
        if plan.news:
            return True
        last = self.last_syncs.get(self.assembly.silo_uuid or "")
        if last is None:
            return False
        last_sync = LastSync.model_validate(last) if isinstance(last, Mapping) else last
        if last_sync.at is None or _texts(last_sync.left_out) != _texts(_left_out(self)):
            return True
        before = {line["child_part_number"]: _places(line.get("components") or ()) for line in lines}
        now: dict[str, set[tuple[str, str]]] = {}
        for entry in self.entries:
            if (number := entry.part_number or "") in before and not entry.missing:
                now.setdefault(number, set()).update(_places(components_of(entry, self.folder)))
        for change in plan.diff.kept:
            now.pop(change.part_number, None)
        return any(before[number] != places for number, places in now.items())

    def _missing(self) -> list[tuple[str, str]]:
        return [(relative(e.doc_path, self.folder), e.object_name) for e in self.entries if e.missing]


def _places(components: Iterable[Mapping[str, Any]]) -> set[tuple[str, str]]:
    return {(component.get("file") or "", component.get("object") or "") for component in components}


def _left_out(resolved: Resolved) -> list[LeftOutPart]:
    return [LeftOutPart.model_validate(out.as_dict()) for out in resolved.left_out]


def _texts(parts: Iterable[LeftOutPart]) -> list[str]:
    return sorted(part.model_dump_json(exclude_defaults=True) for part in parts)


@dataclass(frozen=True)
class Outcome:
    """What became of one assembly's sync."""

    status: Status
    resolved: Resolved
    plan: MergePlan | None = None
    result: MergeResult | None = None
    error: SiloError | None = None
    names: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    @property
    def assembly(self) -> BomEntry:
        return self.resolved.assembly


def resolve(extraction: Extraction, api: ItemLookup) -> Resolved:
    """Give the assembly and all its components their part numbers, in one look-up for the whole tree."""
    uuids = [e.silo_uuid for e in walk_entries((extraction.assembly, *extraction.entries)) if e.silo_uuid]
    return resolve_known(extraction, known_items(uuids, extraction.entries, api))


def known_items(uuids: Iterable[str], entries: Iterable[BomEntry], api: ItemLookup) -> Known:
    """Look up the server's items of these identities, and those of the standard parts among the entries."""
    items = look_up(uuids, api)
    return {**items, **find_items(entries, items, api)}


def resolve_known(extraction: Extraction, items: Known) -> Resolved:
    """Do what :func:`resolve` does, with items that were fetched before; pure."""
    head = extraction.assembly
    entries, unresolved = resolve_with(extraction.entries, items)
    item = items.get(head.silo_uuid) if head.silo_uuid else None
    if item is not None:
        number = str(item["part_number"])
        head = replace(head, part_number=number, name=item.get("name") or item.get("description") or number)
    lacking = {entry.key for entry in unresolved}
    head = replace(head, unregistered=tuple(e for e in extraction.entries if e.key in lacking))
    return Resolved(
        assembly=head,
        entries=tuple(entries),
        unresolved=tuple(unresolved),
        findings=(
            *numbered_findings(extraction.findings, items),
            *consolidation_findings(entries),
            *unregistered_findings(unresolved),
        ),
        last_syncs={
            uuid: last for uuid, item in items.items() if item and (last := item.get("last_sync")) is not None
        },
    )


def server_lines(resolved: Resolved, api: SyncApi) -> tuple[Mapping[str, Any], ...]:
    """Return the server's present lines of this assembly; () while it has no part number."""
    number = resolved.assembly.part_number
    if number is None:
        return ()
    return plain_lines(api.get_bom(number))


def plain_lines(lines: Iterable[Any]) -> tuple[Mapping[str, Any], ...]:
    """Return the lines as mappings; a client may have made models of them."""
    return tuple(line if isinstance(line, Mapping) else line.model_dump() for line in lines)


def compare(resolved: Resolved, api: SyncApi) -> MergePlan:
    """Plan a merge into the server's present lines."""
    return resolved.plan(server_lines(resolved, api))


def names_of(resolved: Resolved, lines: Iterable[Mapping[str, Any]] = ()) -> dict[str, str]:
    """Return part number → name, of all resolved components and of the server's own lines; for display."""
    names = {
        line["child_part_number"]: line.get("child_description") or line.get("child_name") or ""
        for line in lines
    }
    entries = walk_entries((resolved.assembly, *resolved.entries, *resolved.unresolved))
    return names | {entry.part_number: entry.name or "" for entry in entries if entry.part_number}


def decide(
    resolved: Resolved, lines: Sequence[Mapping[str, Any]], *, allow_missing: bool = False, server: str = ""
) -> Outcome:
    """Decide what happens to an assembly: it is unregistered, blocked, unchanged, or merged.

    lines
        the server's lines of the assembly.
    allow_missing
        sync although links are broken: lines that stood for a missing component in the last sync stay as they
        are; what the server does not know stays out, and the server records that the BOM is incomplete.
    server
        the address of the server; a server that does not show which lines are unreferenced gets each of them
        once.
    """
    if resolved.assembly.part_number is None:
        return Outcome(Status.UNREGISTERED, resolved)
    plan, names = resolved.plan(lines), names_of(resolved, lines)
    if blocking(resolved) and not allow_missing:
        return Outcome(Status.BLOCKED, resolved, plan, names=names)
    is_news = resolved.is_news(plan, lines) and not _is_told(resolved, plan, server)
    return Outcome(Status.MERGED if is_news else Status.UNCHANGED, resolved, plan, names=names)


def _reported_lines() -> Memory:
    """Open the memory of reported lines: server → part number of an assembly → its unreferenced lines."""
    return Memory(cache_folder() / "unreferenced.json")


def _is_told(resolved: Resolved, plan: MergePlan, server: str) -> bool:
    if not server or resolved.assembly.silo_uuid in resolved.last_syncs or replace(plan, flag=()).news:
        return False
    answer = _reported_lines().known(server).get(resolved.assembly.part_number or "", "")
    return bool(plan.flag) and set(plan.flag) <= set(answer.split("\n"))


def merged(resolved: Resolved, plan: MergePlan, server: str) -> None:
    """Remember which unreferenced lines a merge has reported to a server that does not show them."""
    if plan.flag and server and resolved.assembly.silo_uuid not in resolved.last_syncs:
        _reported_lines().remember(server, {resolved.assembly.part_number or "": "\n".join(plan.flag)})


def sync(
    resolved: Resolved,
    api: SyncApi,
    *,
    sync_id: str,
    allow_missing: bool = False,
    dry_run: bool = False,
    describe: Callable[[], SourceDocument | None] = lambda: None,
    lines: Sequence[Mapping[str, Any]] | None = None,
) -> Outcome:
    """Bring one assembly's direct children to the server.

    sync_id
        names this attempt; the same id sent again gives the same answer and changes nothing twice.
    dry_run
        compare, and send nothing.
    describe
        finds the file of the BOM, if there is something to send.
    lines
        the server's lines of the assembly; None asks for them.
    """
    number = resolved.assembly.part_number
    try:
        lines = server_lines(resolved, api) if lines is None else lines
        server = server_of(api)
        outcome = decide(resolved, lines, allow_missing=allow_missing, server=server)
        if dry_run and outcome.status in (Status.MERGED, Status.UNCHANGED):
            return replace(outcome, status=Status.DRY_RUN)
        if outcome.status is not Status.MERGED or number is None:
            return outcome
        request = merge_request(resolved, sync_id, describe())
        outcome = replace(outcome, result=api.merge_bom(number, request))
        merged(resolved, resolved.plan(lines), server)
        return outcome
    except SiloError as error:
        return Outcome(Status.FAILED, resolved, error=error)


def merge_request(resolved: Resolved, sync_id: str, document: SourceDocument | None = None) -> MergeRequest:
    """Make the request of spec §5, with the direct children only.

    A server that remembers its syncs also gets the components of each line in the CAD model, and what is left
    out. Any other server gets exactly the request of the spec.
    """
    remembers = resolved.assembly.silo_uuid in resolved.last_syncs
    entries = [
        MergeEntry(
            child_part_number=entry.part_number,
            quantity=entry.quantity,
            components=[Component(**component) for component in components_of(entry, resolved.folder)]
            if remembers
            else None,
        )
        for entry in resolved.entries
        if entry.part_number is not None
    ]
    left_out = _left_out(resolved) if remembers else None
    return MergeRequest(entries=entries, sync_id=sync_id, document=document, left_out=left_out)


def blocking(resolved: Resolved) -> tuple[Finding, ...]:
    """Return the findings that keep this assembly from being synced: those in its own file, and all loops."""
    return cast(_Findings, resolved.findings).blocking(resolved.assembly.doc_path)


def assemblies(resolved: Resolved) -> Iterator[Resolved]:
    """Yield the assembly and its sub-assemblies, each once, children before parents."""
    seen: set[tuple[str, str]] = set()

    def below(entries: Sequence[BomEntry]) -> Iterator[BomEntry]:
        for entry in entries:
            if entry.is_assembly and entry.key not in seen:
                seen.add(entry.key)
                yield from below(entry.children)
                yield entry

    # Sub-assemblies without a number hang in `unresolved`; their own sub-assemblies are synced anyway.
    for entry in below((*resolved.unresolved, *resolved.entries)):
        yield replace(resolved, assembly=entry, entries=entry.children)
    yield resolved


def sync_tree(
    resolved: Resolved,
    api: SyncApi,
    *,
    sync_id: Callable[[], str],
    allow_missing: bool = False,
    dry_run: bool = False,
    describe: Callable[[BomEntry], SourceDocument | None] = lambda _entry: None,
    recursive: bool = True,
) -> Iterator[Outcome]:
    """Sync an assembly with all its sub-assemblies, leaves first; one failure does not stop the others.

    A failure that concerns all of them does (:func:`silo.api.policy.ends_run`): the remaining ones get it as
    their error.
    """
    from silo.api.policy import ends_run  # loads the network's packages

    stopped: SiloError | None = None
    for assembly in assemblies(resolved) if recursive else (resolved,):
        if stopped is not None:
            yield Outcome(Status.FAILED, assembly, error=stopped)
            continue
        outcome = sync(
            assembly,
            api,
            sync_id=sync_id(),
            allow_missing=allow_missing,
            dry_run=dry_run,
            describe=partial(describe, assembly.assembly),
        )
        stopped = outcome.error if outcome.error is not None and ends_run(outcome.error, api) else None
        yield outcome


@dataclass(frozen=True)
class ActivityText:
    """What one merge shows: a headline, the counts, and where a person decides."""

    headline: str
    counts: str
    resolve_url: str
    unregistered: str = ""

    def lines(self) -> tuple[str, ...]:
        """Return all texts of the box, a line each."""
        link = "View in Silo →" if self.resolve_url else ""
        return tuple(line for line in (self.headline, self.counts, link, self.unregistered) if line)


class MergeCount(StrEnum):
    """What a merge counts, in the order in which it is shown."""

    ADDED = "added"
    CHANGED = "changed"
    UNREFERENCED = "unreferenced"
    IN_CONFLICT = "in conflict"


def headline(item: str, translate: Translate = english) -> str:
    """Write ``BOM Updated: ASM-001``."""
    return translate("Silo", "BOM Updated: {number}").replace("{number}", item)


def count_texts(
    diff: MergeDiff, warnings: Iterable[MergeWarning] = (), translate: Translate = english
) -> dict[MergeCount, str]:
    """Write each count of a merge that is not zero in words, such as ``+1 added``."""
    conflicts = sum(1 for warning in warnings if warning.type == "conflict")
    counted = (
        (MergeCount.ADDED, len(diff.added), translate("Silo", "+{n} added")),
        (MergeCount.CHANGED, len(diff.quantity_changed), translate("Silo", "~{n} qty changed")),
        (MergeCount.UNREFERENCED, len(diff.removed), translate("Silo", "⚠{n} unreferenced")),
        (MergeCount.IN_CONFLICT, conflicts, translate("Silo", "⚡{n} in conflict")),
    )
    return {kind: text.replace("{n}", str(count)) for kind, count, text in counted if count}


def no_changes(translate: Translate = english) -> str:
    """Return the text that replaces the counts if all are zero."""
    return translate("Silo", "no changes")


def counts_text(diff: MergeDiff, warnings: Iterable[MergeWarning] = ()) -> str:
    """Write ``+1 added ~1 qty changed ⚠1 unreferenced``, without counts that are zero."""
    return "  ".join(count_texts(diff, warnings).values()) or no_changes()


def unregistered_text(count: int, translate: Translate = english) -> str:
    """Write ``2 components have no Silo part number``; "" for none."""
    text = translate("Silo", "{n} component has no Silo part number")
    many = translate("Silo", "{n} components have no Silo part number")
    return (text if count == 1 else many).replace("{n}", str(count)) if count else ""


def draft_text(result: MergeResult | Revision | None, translate: Translate = english) -> str:
    """Say which draft a change of a released product is part of; "" if it is not part of one."""
    draft = result.draft if result is not None else None
    if draft is None:
        return ""
    text = translate("Silo", "This is part of draft {draft}. Revision {released} stays released as it is.")
    return text.replace("{draft}", draft.label).replace("{released}", draft.released)


def summary_texts(summary: ProductSummary, translate: Translate = english) -> tuple[list[str], list[str]]:
    """Say what is open in each BOM of a product, and what the product weighs and costs, as the server
    has it.
    """
    texts = [f"{number}: {words}" for number, words in (*summary.open.items(), *summary.incomplete.items())]
    mass = f"{summary.total_mass_kg:g} kg" if summary.total_mass_kg else ""
    costs = ", ".join(f"{total.total_cost:.2f} {total.currency}" for total in summary.totals)
    values = []
    for value, lacking in ((mass, summary.mass_missing), (costs, summary.cost_missing)):
        text = translate("Silo", "{value} for {n} of {all} parts") if lacking.count else "{value}"
        text = text.replace("{n}", str(summary.parts - lacking.count)).replace("{all}", str(summary.parts))
        values += [text.replace("{value}", value)] if value else []
    return texts, values


def rules_text(problem: str, translate: Translate = english) -> str:
    """Say which mistake the site's category rules have; "" if they have none."""
    text = translate("Silo", "The category rules of this Silo are not used until they are mended: {problem}")
    return text.replace("{problem}", problem) if problem else ""


def activity_text(
    item: str, merge: MergeEvent | MergeResult, *, resolve_url: str = "", unregistered: int = 0
) -> ActivityText:
    """Make the box of one merge; ``resolve_url`` (made absolute by the caller) overrides the event's."""
    without = unregistered_text(unregistered)
    return ActivityText(
        headline=headline(item),
        counts=counts_text(merge.diff, tuple(merge.warnings)),
        resolve_url=resolve_url or merge.resolve_url,
        unregistered=f"⚠ {without}" if without else "",
    )
