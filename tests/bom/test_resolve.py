# SPDX-License-Identifier: LGPL-2.1-or-later
"""From UUIDs to part numbers (spec §2), lines with one number, and the warnings on the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pytest

from silo.bom import FindingCode, Severity, resolve_part_numbers
from silo.bom.consolidation import consolidation_findings, consolidation_message, one_hint_each
from silo.bom.entry import BomEntry
from silo.bom.findings import Finding
from silo.bom.items.resolve import merge_lines, numbered_findings, resolve_with, unregistered_findings
from silo.bom.walk.shared_identity import identity_findings


class Silo:
    """``api_client`` of the spec: one question at a time, and a list of what was asked."""

    def __init__(self, **numbers: str) -> None:
        self.items: dict[str, Mapping[str, Any]] = {
            uuid: {"part_number": number, "name": f"Name of {number}"} for uuid, number in numbers.items()
        }
        self.asked: list[Any] = []

    def get_item_by_uuid(self, uuid: str) -> Mapping[str, Any] | None:
        self.asked.append(uuid)
        return self.items.get(uuid)


class BatchSilo(Silo):
    """A server that answers many at once."""

    def get_items_by_uuid(self, uuids: Sequence[str]) -> Mapping[str, Mapping[str, Any]]:
        self.asked.append(list(uuids))
        return {uuid.lower(): self.items[uuid.lower()] for uuid in uuids if uuid.lower() in self.items}


def entry(name: str, *children: BomEntry, uuid: str | None = "", **more: Any) -> BomEntry:
    return BomEntry(
        f"/v/{name}.FCStd",
        name if uuid == "" else uuid,
        object_name="Body",
        label=name,
        children=children,
        is_assembly=bool(children),
        **more,
    )


def test_entries_get_their_number_and_name() -> None:
    """The spec's case: number and name from the server, nothing else changed."""
    bolt = entry("bolt", quantity=12)
    resolved, unresolved = resolve_part_numbers([bolt], Silo(bolt="F01-0001"))
    assert resolved == [replace(bolt, part_number="F01-0001", name="Name of F01-0001")]
    assert unresolved == []


def test_what_was_given_stays_as_it_was() -> None:
    """Values are frozen: resolving makes new ones."""
    bolt = entry("bolt")
    resolve_part_numbers([bolt], Silo(bolt="F01-0001"))
    assert bolt.part_number is None


@pytest.mark.parametrize(
    "item", [{"part_number": "P-1", "description": "Plate"}, {"part_number": "P-1", "name": "Plate", "x": 1}]
)
def test_a_server_with_descriptions_for_names(item: dict[str, Any]) -> None:
    """The real Silo has ``description`` where the spec says ``name``."""
    silo = Silo()
    silo.items["plate"] = item
    (resolved,), _ = resolve_part_numbers([entry("plate")], silo)
    assert resolved.name == "Plate"


@pytest.mark.parametrize("item", [{}, {"name": "x"}, {"part_number": None}, {"part_number": ""}])
def test_an_item_without_a_number_is_no_registration(item: dict[str, Any]) -> None:
    """Two of them must not become one line without a number."""
    silo = Silo()
    silo.items.update(a=item, b=item)
    resolved, unresolved = resolve_part_numbers([entry("a"), entry("b")], silo)
    assert resolved == []
    assert [e.doc_path for e in unresolved] == ["/v/a.FCStd", "/v/b.FCStd"]


def test_children_are_resolved_and_the_unresolved_of_all_levels_are_reported_once() -> None:
    """Resolved entries keep resolved children only; the rest is listed flat, each component once."""
    new, bolt = entry("new", uuid=None), entry("bolt")
    sub = entry("sub", bolt, new)
    resolved, unresolved = resolve_part_numbers([sub, new, entry("unknown")], Silo(sub="A-1", bolt="B-1"))
    assert [(e.part_number, [c.part_number for c in e.children]) for e in resolved] == [("A-1", ["B-1"])]
    assert [e.label for e in unresolved] == ["new", "unknown"]


def test_an_unresolved_sub_assembly_keeps_its_resolved_children() -> None:
    """It has no number; its own BOM can be synced once it has one; its unregistered parts are reported."""
    sub = entry("sub", entry("bolt"), entry("new", uuid=None), uuid=None)
    resolved, unresolved = resolve_part_numbers([sub], Silo(bolt="B-1"))
    assert resolved == []
    assert [e.label for e in unresolved] == ["sub", "new"]
    assert [c.part_number for c in unresolved[0].children] == ["B-1"]


def test_each_uuid_is_asked_once() -> None:
    """A thousand bolts of one kind at two levels are one question."""
    bolt = entry("bolt")
    silo = Silo(bolt="B-1", sub="A-1")
    resolve_part_numbers([bolt, entry("sub", bolt), entry("other", bolt, uuid="sub")], silo)
    assert sorted(silo.asked) == ["bolt", "sub"]


def test_a_server_with_a_batch_look_up_is_asked_once_in_all() -> None:
    """All UUIDs of the tree in one request, whatever case the server answers in."""
    silo = BatchSilo(bolt="B-1", sub="A-1")
    resolved, _ = resolve_part_numbers([entry("sub", entry("bolt", uuid="BOLT"))], silo)
    assert silo.asked == [["sub", "BOLT"]]
    assert resolved[0].children[0].part_number == "B-1"


def test_nothing_to_ask_is_not_asked() -> None:
    """No identities, no request."""
    silo = BatchSilo()
    resolve_part_numbers([entry("new", uuid=None)], silo)
    assert silo.asked == []


# --- lines with one number --------------------------------------------------------------------------------


def test_entries_with_one_number_become_one_line() -> None:
    """Two files of one item (a copied identity) count together under its number."""
    one, two = entry("one", quantity=2, instances=("L1", "L2")), entry("two", quantity=3, instances=("L3",))
    (line,), _ = resolve_part_numbers([one, two], Silo(one="P-1", two="P-1"))
    assert (line.quantity, line.doc_path, line.instances) == (5, "/v/one.FCStd", ("L1", "L2", "L3"))


def test_lines_are_merged_at_every_level() -> None:
    """Also the children of a sub-assembly."""
    sub = entry("sub", entry("one"), entry("two", quantity=4))
    (line,), _ = resolve_part_numbers([sub], Silo(sub="A-1", one="P-1", two="P-1"))
    assert [(c.part_number, c.quantity) for c in line.children] == [("P-1", 5)]


def test_merged_lines_keep_what_either_has() -> None:
    """A part and an assembly of one number: the line has the assembly's children, whichever came first."""
    part, sub = entry("part"), entry("sub", entry("bolt"))
    for order in ([part, sub], [sub, part]):
        (line,), _ = resolve_part_numbers(order, Silo(part="P-1", sub="P-1", bolt="B-1"))
        assert line.is_assembly
        assert [c.part_number for c in line.children] == ["B-1"]


def test_merged_lines_add_up_their_links() -> None:
    """The consolidation warning counts the links of both; two single links to two files are no reason."""
    one = entry("one", consolidation_warning=True, individual_links=2, link_objects=2, part_number="P")
    two = entry("two", individual_links=1, link_objects=1, part_number="P")
    (line,) = merge_lines([one, two])
    assert (line.consolidation_warning, line.individual_links, line.link_objects) == (True, 3, 3)
    (line,) = merge_lines([two, replace(two, doc_path="/v/three.FCStd")])
    assert line.consolidation_warning is False


# --- consolidation ----------------------------------------------------------------------------------------


def test_the_consolidation_warning_reads_as_in_the_spec() -> None:
    """Spec §6, word by word."""
    line = entry("plate", part_number="PRT-100", individual_links=4, link_objects=4)
    assert consolidation_message(line) == (
        "[Silo BOM] PRT-100 has 4 individual links. Consider using a link array (ElementCount) for cleaner "
        "assembly management."
    )


@pytest.mark.parametrize(
    ("individual", "links", "words"),
    [
        (8, 9, "has 8 individual links."),
        (1, 2, "has 1 individual link beside a link array."),
        (0, 2, "has 2 link arrays."),
    ],
)
def test_the_count_is_that_of_individual_links(individual: int, links: int, words: str) -> None:
    """Arrays are not individual links; where there are none, nobody says zero."""
    line = entry("plate", part_number="PRT-100", individual_links=individual, link_objects=links)
    assert words in consolidation_message(line)


def test_without_a_number_the_label_names_the_component() -> None:
    """Before registration there is only the label."""
    assert consolidation_message(entry("plate", individual_links=2)).startswith("[Silo BOM] plate has 2")


def test_only_marked_entries_are_reported() -> None:
    """One link, or one array, needs no advice."""
    marked = entry("bolt", consolidation_warning=True, individual_links=3, link_objects=3)
    (finding,) = consolidation_findings([entry("plate"), marked])
    assert (finding.code, finding.severity) == (FindingCode.CONSOLIDATION, Severity.WARNING)
    assert finding.where[0].doc_path == "/v/bolt.FCStd"


def test_a_clean_use_elsewhere_does_not_hide_the_advice() -> None:
    """The part is linked once in a sub-assembly that comes first, and three times at the top."""
    clean = entry("bolt", individual_links=1, link_objects=1)
    marked = replace(clean, consolidation_warning=True, individual_links=3, link_objects=3)
    (finding,) = consolidation_findings([entry("sub", clean), marked])
    assert "3 individual links" in finding.message


def test_the_advice_is_given_per_assembly() -> None:
    """Two assemblies link the part several times each; a sub-assembly used twice says it once."""
    marked = entry("bolt", consolidation_warning=True, individual_links=3, link_objects=3)
    sub = entry("sub", replace(marked, individual_links=2, link_objects=2))
    found = consolidation_findings([sub, marked, entry("other", sub)])
    assert ["3 individual" in f.message for f in found] == [True, False]
    assert [place.doc_path for place in found[1].where] == ["/v/bolt.FCStd", "/v/sub.FCStd"]


def test_unregistered_components_are_reported() -> None:
    """Left out of the BOM, never in silence."""
    (finding,) = unregistered_findings([entry("new", uuid=None)])
    assert (finding.code, finding.severity) == (FindingCode.UNREGISTERED, Severity.WARNING)
    assert "new has no Silo part number" in finding.message


def test_an_identity_is_reported_by_the_number_that_people_know() -> None:
    """A UUID says nothing to anybody who has to decide between two files."""
    two = [entry(name, uuid="U-1") for name in "ab"]
    shared = [BomEntry("/v/c.FCStd", "u-2", object_name=name, label=name) for name in "cd"]
    other = Finding(FindingCode.MIRRORED, Severity.WARNING, "identity (u-1): not this one")
    items = {"U-1": {"part_number": "M01-0001"}, "u-2": {"part_number": "M01-0002"}, "u-3": None}
    copied, same, unchanged = numbered_findings((*identity_findings([*two, *shared]), other), items)
    assert copied.message.startswith(
        "2 files carry the same Silo identity (M01-0001): /v/a.FCStd, /v/b.FCStd. Is it"
    )
    assert same.message.startswith(
        "2 components of /v/c.FCStd share the Silo identity (M01-0002): c, d. They will"
    )
    assert unchanged == other


def test_missing_components_stay_in_place_without_a_number() -> None:
    """Nobody can look them up, and nobody can register what is not there; two of them stay two lines."""
    lost = [BomEntry(f"/v/{name}.FCStd", object_name="Body", quantity=2, missing=True) for name in "ab"]
    held = BomEntry("/v/sub.FCStd", silo_uuid="u-sub", children=(lost[0],))
    known = {"u-sub": {"part_number": "S-1"}}
    resolved, unresolved = resolve_with([held, *lost], known)
    assert [(entry.part_number, entry.missing, entry.quantity) for entry in resolved] == [
        ("S-1", False, 1),
        (None, True, 2),
        (None, True, 2),
    ]
    assert resolved[0].children == (lost[0],)
    assert unresolved == []
    assert unregistered_findings(unresolved) == ()


def test_a_list_for_people_has_one_hint_for_each_bom() -> None:
    """The parts of one assembly are one sentence; another assembly and other findings stay as they are."""
    parts = [
        entry(name, consolidation_warning=True, individual_links=2, link_objects=2)
        for name in ("bolt", "nut")
    ]
    sub = entry("sub", *parts[:1])
    other = Finding(FindingCode.UNREGISTERED, Severity.WARNING, "w", ())
    found = one_hint_each((*consolidation_findings([*parts, sub]), other, replace(other)))
    assert [one.message.partition(". ")[0] for one in found] == [
        *("[Silo BOM] bolt has 2 individual links, nut has 2 individual links",),
        *("[Silo BOM] bolt has 2 individual links", "w", "w"),
    ]
    assert found[0].message.count("Consider using a link array") == 1
