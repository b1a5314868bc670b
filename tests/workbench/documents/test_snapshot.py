# SPDX-License-Identifier: LGPL-2.1-or-later
"""Snapshots of documents, and their way through JSON."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc, edit

from silo.bom.findings import FindingCode
from silo.bom.walk.identity import sole_identity
from silo.bom.walk.links import file_item
from silo.workbench.documents.snapshot import Snapshot, take


def gearbox() -> tuple[Doc, Doc, Doc]:
    """Top with two bolts and a sub-assembly that has a bolt as well."""
    bolt = Doc("/v/Bolt.FCStd", meta={"SiloUUID": "bolt-id"})
    body = bolt.body()
    sub = Doc("/v/Sub.FCStd", meta={"SiloUUID": "sub-id"})
    inner = sub.assembly(sub.link("B", body))
    top = Doc("/v/Top.FCStd", meta={"SiloUUID": "top-id"})
    top.assembly(top.link("B1", body), top.link("B2", body), top.link("S", inner))
    return top, sub, bolt


def test_an_assembly_is_taken_with_its_bom() -> None:
    """Identity, label and the whole tree."""
    taken = take(gearbox()[0])
    assert (taken.path, taken.label, taken.identity) == ("/v/Top.FCStd", "Top", "top-id")
    assert taken.is_assembly
    assert taken.extraction is not None
    assert {e.silo_uuid: e.quantity for e in taken.extraction.entries} == {"bolt-id": 2, "sub-id": 1}


def test_a_part_has_no_bom() -> None:
    """Only its file is committed."""
    taken = take(gearbox()[2])
    assert taken == Snapshot("/v/Bolt.FCStd", "Bolt", "bolt-id")
    assert not taken.is_assembly


def test_an_empty_assembly_is_an_assembly() -> None:
    """Its BOM became empty, which is worth telling."""
    doc = Doc("/v/A.FCStd")
    doc.assembly()
    assert take(doc).is_assembly


def test_a_part_with_a_broken_link_is_no_part() -> None:
    """A missing file must never read as "no BOM"."""
    doc = Doc("/v/A.FCStd")
    doc.part("Model", doc.link("L", None))
    from silo.bom.walk.document import LinkProblem
    from silo.bom.walk.links import extract

    problem = LinkProblem(FindingCode.MISSING_FILE, "b.FCStd")
    taken = take(doc, walk=lambda obj: extract(obj, inspect=lambda obj: problem if obj.Name == "L" else None))
    assert taken.is_assembly
    assert taken.extraction is not None
    assert taken.extraction.blocked


def two_assemblies() -> tuple[Doc, Any]:
    bolt = Doc("/v/Bolt.FCStd")
    body = bolt.body()
    doc = Doc("/v/Two.FCStd", meta={"SiloUUID": "two-id"})
    doc.assembly(doc.link("L1", body), name="One")
    second = doc.assembly(doc.link("L2", body), doc.link("L3", body), name="Two")
    return doc, second


def test_several_assemblies_and_no_hint_is_reported_not_guessed() -> None:
    """The file can be committed; its BOM needs a choice."""
    taken = take(two_assemblies()[0])
    assert not taken.is_assembly
    assert taken.identity == "two-id"
    assert "2 assemblies" in taken.problem
    # What to do is reported in the words of the window, not of the command line.
    assert "--assembly" not in taken.problem
    assert taken.problem.endswith("Make the right assembly active: double-click it in the tree.")


def test_the_active_assembly_decides_between_several() -> None:
    """What the person works in is what is meant."""
    doc, second = two_assemblies()
    taken = take(doc, assembly=second)
    assert taken.extraction is not None
    assert [entry.quantity for entry in taken.extraction.entries] == [2]


def test_the_hint_does_not_override_the_only_assembly() -> None:
    """A sub-part that happens to be active is not the assembly."""
    top, _, _ = gearbox()
    other = top.part("Helper")
    taken = take(top, assembly=other)
    assert taken.extraction is not None
    assert len(taken.extraction.entries) == 2


@pytest.mark.parametrize(
    ("doc", "identity"),
    [
        (Doc("/v/A.FCStd"), None),
        (Doc("/v/A.FCStd", meta={"SiloUUID": " m "}), "m"),
        (Doc("/v/A.FCStd", SiloUUID="p", meta={"SiloUUID": "m"}), "p"),
    ],
    ids=["none", "meta", "property before meta"],
)
def test_identity_of_a_file(doc: Doc, identity: str | None) -> None:
    """The document's own."""
    assert sole_identity(doc) == identity


def test_identity_of_the_only_marked_object() -> None:
    """The real Silo marks objects; two different marks in one file say nothing of the file."""
    doc = Doc("/v/A.FCStd")
    one, other = doc.body("One"), doc.body("Other")
    edit(one, SiloItemId="i")
    assert sole_identity(doc) == "i"
    assert not take(doc).several
    edit(other, SiloItemId="j")
    assert sole_identity(doc) is None
    assert take(doc).several


def test_a_document_is_registered_where_a_commit_of_it_has_an_item() -> None:
    """Whatever carries the identity: the document, the assembly in it, its only part."""
    top, sub, bolt = gearbox()
    two, second = two_assemblies()
    marked = Doc("/v/Marked.FCStd")
    box = marked.assembly(marked.link("L", bolt.Objects[0]), name="Box")
    several = Doc("/v/Several.FCStd")
    for name in ("One", "Other"):
        edit(several.body(name), SiloItemId=name)
    docs = (top, sub, bolt, two, marked, several)
    told = [bool(file_item(doc)) for doc in docs]
    assert told == [bool(take(doc).identity) for doc in docs] == [True, True, True, True, False, False]
    edit(box, SiloItemId="box")
    assert file_item(marked)
    assert file_item(two, second)
