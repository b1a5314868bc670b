# SPDX-License-Identifier: LGPL-2.1-or-later
"""Configured copies: a line for each set of values, counted under the original's number or one of its own."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc

from silo.bom import FindingCode, extract
from silo.bom.entry import BomEntry, Extraction
from silo.bom.items.resolve import resolve_with, unregistered_findings
from silo.bom_sync.resolved import Resolved, assemblies, assemblies_of_file

BASE, OWN = "00000000-0000-4000-8000-00000000000a", "00000000-0000-4000-8000-00000000000b"
ITEMS = {
    BASE: {"part_number": "P-1", "name": "Profile"},
    OWN: {"part_number": "P-2", "name": "Long profile"},
}


class Shop:
    """An assembly with configured copies of a profile, which has an identity, as its copies then have."""

    def __init__(self, identity: str | None = BASE) -> None:
        marks = {"SiloItemId": identity} if identity else {}
        self.top = Doc("/v/top.FCStd")
        self.profile = Doc("/v/profile.FCStd").body(Label="Profile", L=100.0, **marks)
        self.copies: list[Any] = []
        self.links: list[Any] = []
        self.marks = marks

    def link(self, length: float, base: Any = None, **properties: Any) -> Any:
        base = base or self.profile
        number = len(self.links)
        copy = self.top.body(f"Copy{number}", Label="Profile", L=length, Visibility=False, **self.marks)
        self.copies.append(copy)
        given = {"L": length, "LinkCopyOnChange": "Owned", "LinkCopyOnChangeSource": base, **properties}
        self.links.append(self.top.link(f"Link{number}", copy, **given))
        return self.links[-1]

    def plain(self) -> Any:
        self.links.append(self.top.link(f"Link{len(self.links)}", self.profile))
        return self.links[-1]

    def found(self) -> Extraction:
        self.top.link_group("CopyOnChangeGroup", *self.copies, Visibility=False)
        return extract(self.top.assembly(*self.links))


def lines(entries: tuple[BomEntry, ...] | list[BomEntry]) -> dict[tuple[str | None, str], int]:
    return {(entry.part_number, entry.variant): entry.quantity for entry in entries}


def test_each_set_of_values_is_a_line_until_the_numbers_are_known() -> None:
    shop = Shop()
    shop.plain()
    for length in (300.0, 300.0, 400.0):
        shop.link(length)
    found = shop.found()
    assert lines(found.entries) == {(None, ""): 1, (None, "L = 300"): 2, (None, "L = 400"): 1}
    resolved, missing = resolve_with(found.entries, ITEMS)
    assert [(one.part_number, one.quantity) for one in resolved] == [("P-1", 4)]
    assert missing == []
    said = [finding.where[0].obj for finding in found.findings_of(FindingCode.VARIANT)]
    assert said == ["Link1", "Link2", "Link3"]


def test_the_line_of_an_original_without_pieces_has_all_values() -> None:
    shop = Shop()
    shop.link(300.0)
    shop.link(400.0)
    (line,) = resolve_with(shop.found().entries, ITEMS)[0]
    assert (line.part_number, line.quantity, line.variant) == ("P-1", 2, "L = 300; L = 400")


@pytest.mark.parametrize("which", [0, 1])
def test_a_variant_with_a_number_of_its_own_is_a_line_of_it(which: int) -> None:
    """One of its links says it for all with these values, whichever that is."""
    shop = Shop()
    shop.plain()
    for number in range(2):
        shop.link(300.0, **({"SiloItemId": OWN} if number == which else {}))
    found = shop.found()
    assert len(found.findings_of(FindingCode.VARIANT)) == which  # nothing to do where a number is known
    resolved, _ = resolve_with(found.entries, ITEMS)
    assert lines(resolved) == {("P-1", ""): 1, ("P-2", "L = 300"): 2}


def test_an_unregistered_original_is_asked_for_once_and_by_its_own_name() -> None:
    shop = Shop(identity=None)
    shop.link(300.0)
    shop.plain()
    _, missing = resolve_with(shop.found().entries, {})
    assert [(one.doc_path, one.variant, one.label) for one in missing] == [
        ("/v/profile.FCStd", "", "Profile")
    ]
    only_copies = Shop(identity=None)
    only_copies.link(300.0)
    (finding,) = unregistered_findings(resolve_with(only_copies.found().entries, {})[1])
    assert finding.message.startswith("Profile has no")


def test_a_variant_of_another_server_is_not_taken_for_its_original() -> None:
    shop = Shop()
    shop.plain()
    shop.link(300.0, SiloItemId=OWN)
    resolved, missing = resolve_with(shop.found().entries, {BASE: ITEMS[BASE]})
    assert lines(resolved) == {("P-1", ""): 1}
    assert [(one.silo_uuid, one.is_own_item) for one in missing] == [(OWN, True)]


def test_two_sets_of_values_with_one_identity_are_reported() -> None:
    """A link was registered, and configured anew."""
    shop = Shop()
    shop.link(300.0, SiloItemId=OWN)
    shop.link(400.0, SiloItemId=OWN)
    (finding,) = shop.found().findings_of(FindingCode.SHARED_IDENTITY)
    assert {place.obj for place in finding.where} == {"Copy0", "Copy1"}


def test_what_a_variant_holds_is_sent_only_under_a_number_of_its_own() -> None:
    bolt = Doc("/v/bolt.FCStd").body()
    for marks, sent in (({}, []), ({"SiloItemId": OWN}, ["P-2"])):
        top, unit = Doc("/v/top.FCStd"), Doc("/v/unit.FCStd")
        base = unit.part("Unit", unit.link("B", bolt), N=1, SiloItemId=BASE)
        copy = top.part("Copy", top.link("C", bolt), N=2, SiloItemId=BASE)
        link = top.link("Link", copy, N=2, LinkCopyOnChangeSource=base, **marks)
        found = extract(top.assembly(link))
        entries, missing = resolve_with(found.entries, ITEMS)
        resolved = Resolved(found.assembly, tuple(entries), tuple(missing), found.findings, {})
        for walk in (assemblies, assemblies_of_file):  # in a run over a folder no other file has the copy
            numbers = [one.assembly.part_number for one in walk(resolved)]
            assert [number for number in numbers if number] == sent


def test_copies_of_a_part_of_the_same_file_are_lines_of_their_values() -> None:
    top = Doc("/v/top.FCStd")
    base = top.body("Profile", L=100.0)
    copies = [top.body(f"Copy{number}", L=300.0) for number in range(2)]
    links = [
        top.link(f"Link{number}", copy, L=300.0, LinkCopyOnChangeSource=base)
        for number, copy in enumerate(copies)
    ]
    found = extract(top.assembly(base, *links))
    assert {(line.object_name, line.variant): line.quantity for line in found.assembly.own} == {
        ("Profile", ""): 1,
        ("Profile", "L = 300"): 2,
    }


def test_copies_of_a_declared_part_of_the_same_file_are_counted_as_it_is() -> None:
    top = Doc("/v/top.FCStd")
    base = top.body("Profile", L=100.0, SiloItemId=BASE)
    copy = top.body("Copy", L=300.0, SiloItemId=BASE)
    for marks, numbers in (({}, {"P-1": 2}), ({"SiloItemId": OWN}, {"P-1": 1, "P-2": 1})):
        link = top.link(f"Link{len(marks)}", copy, L=300.0, LinkCopyOnChangeSource=base, **marks)
        resolved, _ = resolve_with(extract(top.assembly(base, link)).entries, ITEMS)
        assert {one.part_number: one.quantity for one in resolved} == numbers
