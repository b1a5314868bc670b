# SPDX-License-Identifier: LGPL-2.1-or-later
"""The sync on one page, against a Silo of a few lines."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo import bom_sync
from silo.api.wire import LastSync, MergeRequest, MergeResult
from silo.bom.compare.merge import apply_merge, plan_merge
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import UnreachableError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom_sync.resolved import blocking
from silo.bom_sync.steps import Status, merge_request


@dataclass
class SmallSilo:
    """Items by UUID, BOM lines by part number, and what was asked."""

    items: dict[str, dict[str, str]]
    lines: dict[str, list[dict[str, object]]] = field(default_factory=dict)
    merges: list[tuple[str, MergeRequest]] = field(default_factory=list)
    unreachable: set[str] = field(default_factory=set)

    def ready(self) -> None:
        """It answers: one item's failure is this item's."""

    def get_item_by_uuid(self, uuid: str) -> dict[str, str] | None:
        return self.items.get(uuid)

    def get_bom(self, part_number: str) -> list[dict[str, object]]:
        return self.lines.get(part_number, [])

    def merge_bom(self, part_number: str, request: MergeRequest) -> MergeResult:
        if part_number in self.unreachable:
            raise UnreachableError(f"{part_number}: the server does not answer")
        self.merges.append((part_number, request))
        entries = [entry.model_dump() for entry in request.entries]
        plan = plan_merge(entries, self.get_bom(part_number))
        self.lines[part_number] = apply_merge(self.get_bom(part_number), plan, "now")
        return MergeResult(sync_id=request.sync_id)


def part(name: str, quantity: int = 1, *, uuid: str | None = "", level: int = 1) -> BomEntry:
    return BomEntry(
        doc_path=f"/v/{name}.FCStd",
        object_name="Body",
        label=name,
        silo_uuid=f"u-{name}" if uuid == "" else uuid,
        quantity=quantity,
        level=level,
    )


def assembly(name: str, *children: BomEntry, quantity: int = 1) -> BomEntry:
    return BomEntry(
        doc_path=f"/v/{name}.FCStd",
        object_name="Assembly",
        label=name,
        silo_uuid=f"u-{name}",
        quantity=quantity,
        children=children,
        is_assembly=True,
    )


def silo_of(*names: str) -> SmallSilo:
    return SmallSilo({f"u-{name}": {"part_number": name.upper(), "name": f"the {name}"} for name in names})


def tree() -> Extraction:
    return Extraction(assembly("top"), (part("bolt", 12), assembly("gearbox", part("gear", 4), quantity=2)))


@pytest.fixture
def ids() -> itertools.count[int]:
    return itertools.count(1)


def test_a_new_bom_is_merged_with_its_direct_children_only() -> None:
    """The request of a parent holds no grandchildren, and quantities per one parent."""
    silo = silo_of("top", "bolt", "gearbox", "gear")
    outcome = bom_sync.sync(bom_sync.resolve(tree(), silo), silo, sync_id="s1")
    assert outcome.status is Status.MERGED
    [(number, request)] = silo.merges
    assert number == "TOP"
    assert [(e.child_part_number, e.quantity) for e in request.entries] == [("BOLT", 12), ("GEARBOX", 2)]
    assert request.sync_id == "s1"


def test_a_gone_component_is_sent_once_to_be_flagged_and_then_is_quiet() -> None:
    """An unreferenced line is a change while the server does not know it yet, and none afterwards. Only real
    changes are sent.
    """
    silo = silo_of("top", "bolt", "gearbox", "gear")
    for status in (Status.MERGED, Status.UNCHANGED):
        assert bom_sync.sync(bom_sync.resolve(tree(), silo), silo, sync_id="s1").status is status
    smaller = Extraction(assembly("top"), (part("bolt", 12),))
    resolved = bom_sync.resolve(smaller, silo)
    assert bom_sync.sync(resolved, silo, sync_id="s2").status is Status.MERGED
    assert bom_sync.sync(resolved, silo, sync_id="s3").status is Status.UNCHANGED
    assert [request.sync_id for _, request in silo.merges] == ["s1", "s2"]


def test_children_are_synced_before_parents_each_once(ids: itertools.count[int]) -> None:
    """A sub-assembly that hangs in two places is synced once, before both."""
    gearbox = assembly("gearbox", part("gear", 4))
    left, right = assembly("left", gearbox), assembly("right", gearbox)
    silo = silo_of("top", "left", "right", "gearbox", "gear")
    resolved = bom_sync.resolve(Extraction(assembly("top"), (left, right)), silo)
    outcomes = list(bom_sync.sync_tree(resolved, silo, sync_id=lambda: f"s{next(ids)}"))
    assert [o.assembly.part_number for o in outcomes] == ["GEARBOX", "LEFT", "RIGHT", "TOP"]
    assert len({request.sync_id for _, request in silo.merges}) == 4


def test_one_failure_does_not_stop_the_others(ids: itertools.count[int]) -> None:
    """A sub-assembly whose merge fails is reported; its parent is still synced."""
    silo = silo_of("top", "bolt", "gearbox", "gear")
    silo.unreachable.add("GEARBOX")
    outcomes = list(bom_sync.sync_tree(bom_sync.resolve(tree(), silo), silo, sync_id=lambda: "s"))
    assert [o.status for o in outcomes] == [Status.FAILED, Status.MERGED]
    assert "does not answer" in str(outcomes[0].error)


def broken(in_file: str) -> Finding:
    return Finding(FindingCode.MISSING_FILE, Severity.ERROR, "x.FCStd is missing", (Place(in_file, "Link"),))


def test_a_broken_link_blocks_the_bom_it_is_missing_from() -> None:
    """A missing file must never read as removed; the user may say that it may. A dry run shows what a sync
    would do, and that would be nothing.
    """
    silo = silo_of("top", "bolt", "gearbox", "gear")
    extraction = Extraction(assembly("top"), tree().entries, (broken("/v/top.FCStd"),))
    resolved = bom_sync.resolve(extraction, silo)
    for dry_run in (False, True):
        assert bom_sync.sync(resolved, silo, sync_id="s", dry_run=dry_run).status is Status.BLOCKED
    assert not silo.merges
    assert bom_sync.sync(resolved, silo, sync_id="s", allow_missing=True).status is Status.MERGED


def test_a_broken_link_in_a_sub_assembly_blocks_that_one_only() -> None:
    """Each assembly merges its direct children; the parent's are all there."""
    silo = silo_of("top", "bolt", "gearbox", "gear")
    extraction = Extraction(assembly("top"), tree().entries, (broken("/v/gearbox.FCStd"),))
    outcomes = list(bom_sync.sync_tree(bom_sync.resolve(extraction, silo), silo, sync_id=lambda: "s"))
    assert [o.status for o in outcomes] == [Status.BLOCKED, Status.MERGED]


def test_an_assembly_without_a_number_is_not_synced_but_its_sub_assemblies_are() -> None:
    """Nothing is guessed: no number, no merge."""
    silo = silo_of("gearbox", "gear", "bolt")
    outcomes = list(bom_sync.sync_tree(bom_sync.resolve(tree(), silo), silo, sync_id=lambda: "s"))
    assert [o.status for o in outcomes] == [Status.MERGED, Status.UNREGISTERED]


def test_unregistered_components_are_left_out_and_reported() -> None:
    """Not silently dropped: they stay visible as unregistered (spec §2)."""
    silo = silo_of("top", "bolt")
    extraction = Extraction(assembly("top"), (part("bolt", 2), part("mount", uuid=None)))
    resolved = bom_sync.resolve(extraction, silo)
    bom_sync.sync(resolved, silo, sync_id="s")
    assert [e.child_part_number for e in silo.merges[0][1].entries] == ["BOLT"]
    assert [entry.label for entry in resolved.unresolved] == ["mount"]
    told = [f for f in resolved.findings if f.code is FindingCode.UNREGISTERED]
    assert len(told) == 1
    assert "mount" in told[0].message


def test_a_dry_run_reports_and_sends_nothing() -> None:
    """The preview has the same plan that a sync would carry out."""
    silo = silo_of("top", "bolt", "gearbox", "gear")
    outcome = bom_sync.sync(bom_sync.resolve(tree(), silo), silo, sync_id="s", dry_run=True)
    assert outcome.status is Status.DRY_RUN
    assert outcome.plan is not None
    assert [c.part_number for c in outcome.plan.diff.added] == ["BOLT", "GEARBOX"]
    assert not silo.merges


FILES = st.sampled_from(["/v/a.FCStd", "/v/b.FCStd", "/v/c.FCStd"])
FINDINGS = st.builds(
    lambda code, severity, files: Finding(code, severity, "m", tuple(map(Place, files))),
    st.sampled_from([FindingCode.CYCLE, FindingCode.TOO_DEEP, FindingCode.MISSING_FILE]),
    st.sampled_from(Severity),
    st.lists(FILES, max_size=3),
)


@given(st.lists(FINDINGS, max_size=8), FILES)
def test_what_blocks_an_assembly_is_an_error_in_its_file_or_a_loop_anywhere(
    findings: list[Finding], path: str
) -> None:
    """In the order of the walk, each once; the same for a copy with another assembly or other findings."""
    one = bom_sync.Resolved(BomEntry("/v/other.FCStd", object_name="A"), (), (), tuple(findings))
    blocking(one)
    other = replace(one, assembly=replace(one.assembly, doc_path=path))
    loops = (FindingCode.CYCLE, FindingCode.TOO_DEEP)
    wanted = [
        finding
        for finding in findings
        if finding.severity is Severity.ERROR
        and (finding.code in loops or any(place.doc_path == path for place in finding.where))
    ]
    assert list(blocking(other)) == wanted
    assert blocking(replace(other, findings=())) == ()


def synced(*entries: BomEntry, lines: list[dict[str, object]], at: str | None) -> bool:
    """Whether a server that remembers its syncs learns anything from this assembly."""
    silo = silo_of("top", "bolt", "lid")
    top: dict[str, Any] = silo.items["u-top"]
    top["last_sync"] = {"at": at, "left_out": []}
    resolved = bom_sync.resolve(Extraction(assembly("top"), entries), silo)
    plan = resolved.plan(lines)
    assert not plan.news
    top["last_sync"]["left_out"] = [one.as_dict() for one in resolved.left_out]
    return bom_sync.resolve(Extraction(assembly("top"), entries), silo).is_news(plan, lines)


def test_the_first_sync_is_news_though_there_is_nothing_to_write() -> None:
    """An empty assembly that was never synced: "complete" and "not known" are two things."""
    assert synced(lines=[], at=None)
    assert not synced(lines=[], at="2026-01-01T00:00:00Z")


def test_a_line_that_is_kept_for_a_missing_file_is_no_news() -> None:
    """The file that is there gives the line one of its two components; the other one is missing, not gone."""
    there, missing = part("bolt"), replace(part("bolt2", uuid=None), missing=True)
    line: dict[str, object] = {
        "child_part_number": "BOLT",
        "quantity": 1,
        "components": [{"file": "bolt.FCStd", "object": "Body"}, {"file": "bolt2.FCStd", "object": "Body"}],
    }
    assert not synced(there, missing, lines=[line], at="2026-01-01T00:00:00Z")
    gone = [{**line, "components": [{"file": "other.FCStd", "object": "Body"}]}]
    assert synced(there, lines=gone, at="2026-01-01T00:00:00Z")


def test_a_proposed_find_number_goes_to_a_server_that_knows_it() -> None:
    """A server that remembers its syncs gives them; any other gets exactly the request of the spec."""
    silo = silo_of("top", "bolt", "gearbox", "gear")
    extraction = tree()
    bolt, gearbox = extraction.entries
    resolved = bom_sync.resolve(replace(extraction, entries=(replace(bolt, find_number="20"), gearbox)), silo)
    remembering = replace(resolved, last_syncs={"u-top": LastSync()})
    numbers = [
        [entry.find_number for entry in merge_request(each, "s1").entries] for each in (remembering, resolved)
    ]
    assert numbers == [["20", None], [None, None]]
