# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where an identity is read, in which order, and identities that are found twice."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import BareDocument, BarePart, Doc, ForwardingLink

from silo.bom import FindingCode, Severity, extract
from silo.bom.entry import BomEntry, walk_entries
from silo.bom.walk.identity import identity_of
from silo.bom.walk.shared_identity import identity_findings

PLACES = ("object SiloItemId", "object SiloUUID", "Meta per object", "document SiloUUID", "Meta")


def part_with(*places: str) -> Any:
    """A part that has an identity, named after its place, in each of these places."""
    meta = {
        key: place
        for key, place in {"SiloUUID/Body": "Meta per object", "SiloUUID": "Meta"}.items()
        if place in places
    }
    of_document = {"SiloUUID": "document SiloUUID"} if "document SiloUUID" in places else {}
    own = {
        name: place
        for name, place in {"SiloItemId": "object SiloItemId", "SiloUUID": "object SiloUUID"}.items()
        if place in places
    }
    return Doc("/v/part.FCStd", meta=meta, **of_document).body("Body", **own)


@pytest.mark.parametrize("first", range(len(PLACES)))
def test_the_first_place_that_has_an_identity_wins(first: int) -> None:
    """Object before document, property before Meta, the object's own key before the document's."""
    assert identity_of(part_with(*PLACES[first:])) == PLACES[first]


def test_no_place_no_identity() -> None:
    """A part that was never registered."""
    assert identity_of(part_with()) is None


@pytest.mark.parametrize("empty", ["", "  ", None, 0, 17, ["u"]])
def test_empty_and_odd_values_are_no_identity(empty: Any) -> None:
    """A property that was added and left empty does not hide the next place."""
    doc = Doc("/v/part.FCStd", meta={"SiloUUID": " u-meta\n"}, SiloUUID=empty)
    assert identity_of(doc.body("Body", SiloItemId=empty)) == "u-meta"


def test_a_document_without_properties_or_meta() -> None:
    """FreeCAD 0.20 has no document properties; a reader may have no Meta."""
    assert identity_of(BarePart(BareDocument("/v/p.FCStd"))) is None
    assert identity_of(BarePart(BareDocument("/v/p.FCStd", "u-1"))) == "u-1"


def test_a_document_with_plain_attributes() -> None:
    """Without ``getPropertyByName``, the attribute decides."""

    class PlainDocument:
        FileName = "/v/p.FCStd"
        SiloUUID = "u-plain"

    assert identity_of(BarePart(PlainDocument())) == "u-plain"  # type: ignore[arg-type]


def test_a_links_own_identity_is_its_own() -> None:
    """Asked for a link, only what the link itself has counts; its target's is forwarded, not its own."""
    top = Doc("/v/top.FCStd")
    assert identity_of(ForwardingLink(top, "L", part_with("object SiloItemId"))) is None


def test_identity_is_the_targets() -> None:
    """The real part's identity, whatever stands on the link or in the assembly's document."""
    top = Doc("/v/top.FCStd", meta={"SiloUUID": "u-top"})
    found = extract(top.assembly(top.link("L", part_with("document SiloUUID"), SiloUUID="u-link")))
    assert found.entries[0].silo_uuid == "document SiloUUID"
    assert found.assembly.silo_uuid == "u-top"


def test_labels_and_names_are_never_identities() -> None:
    """``F01-0001`` as a label means nothing: FreeCAD makes ``F01-0002`` of the next."""
    top = Doc("/v/top.FCStd")
    part = Doc("/v/F01-0001.FCStd").body("F01_0001", Label="F01-0001")
    (entry,) = extract(top.assembly(top.link("L", part))).entries
    assert (entry.silo_uuid, entry.part_number) == (None, None)


# --- one identity twice -----------------------------------------------------------------------------------


def test_one_identity_in_two_files_is_a_copied_identity() -> None:
    """Save As keeps it; the finding names both files, and nothing is merged in silence."""
    top = Doc("/v/top.FCStd")
    parts = [Doc(f"/v/{name}.FCStd", meta={"SiloUUID": "u-1"}).body() for name in ("part", "copy")]
    found = extract(top.assembly(*(top.link(f"L{n}", part) for n, part in enumerate(parts))))
    assert len(found.entries) == 2
    (finding,) = found.findings_of(FindingCode.COPIED_IDENTITY)
    assert finding.severity is Severity.WARNING
    assert [str(place) for place in finding.where] == ["/v/copy.FCStd#Body", "/v/part.FCStd#Body"]
    assert "/v/part.FCStd" in finding.message
    assert "/v/copy.FCStd" in finding.message


def test_a_copied_identity_is_found_across_levels_and_in_the_assembly_itself() -> None:
    """A sub-assembly saved as a new one, three levels apart, still carries the old identity."""
    top = Doc("/v/top.FCStd", meta={"SiloUUID": "U-1"})
    sub, deep = Doc("/v/sub.FCStd"), Doc("/v/deep.FCStd", meta={"SiloUUID": "u-1"})
    inner = sub.assembly(sub.link("D", deep.body()))
    found = extract(top.assembly(top.link("S", inner)))
    (finding,) = found.findings_of(FindingCode.COPIED_IDENTITY)
    assert [place.doc_path for place in finding.where] == ["/v/deep.FCStd", "/v/top.FCStd"]


def test_identities_per_object_of_one_file_are_not_shared() -> None:
    """``Meta["SiloUUID/<Name>"]`` keeps them apart."""
    top = Doc("/v/top.FCStd")
    shop = Doc("/v/shop.FCStd", meta={"SiloUUID/Screw": "u-1", "SiloUUID/Nut": "u-2"})
    asm = top.assembly(top.link("L1", shop.body("Screw")), top.link("L2", shop.body("Nut")))
    found = extract(asm)
    assert [entry.silo_uuid for entry in found.entries] == ["u-1", "u-2"]
    assert found.findings == ()


def test_one_component_in_many_places_is_no_copy() -> None:
    """The same file used in three assemblies carries its identity once."""
    bolt = BomEntry("/v/bolt.FCStd", "u-1", object_name="Body")
    subs = [BomEntry(f"/v/s{n}.FCStd", f"u-s{n}", children=(bolt,), object_name="A") for n in range(3)]
    assert identity_findings([bolt, *subs]) == ()


def test_walking_entries_visits_each_component_once() -> None:
    """Parents before children, each (file, object) once."""
    bolt = BomEntry("/v/bolt.FCStd", object_name="Body")
    sub = BomEntry("/v/sub.FCStd", object_name="A", children=(bolt,))
    assert [e.doc_path for e in walk_entries([sub, bolt, sub])] == ["/v/sub.FCStd", "/v/bolt.FCStd"]
