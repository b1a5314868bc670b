# SPDX-License-Identifier: LGPL-2.1-or-later
"""Damage behind a sound beginning: each place is reported, the rest is counted, the BOM is blocked."""

from __future__ import annotations

from pathlib import Path

import pytest
from fcstd_writer import Doc, Raw, XLink, locals_, part, save_xml

from silo.bom.entry import Extraction
from silo.bom.errors import DocumentError
from silo.bom.findings import Finding, FindingCode, Place
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import open_document

UNCLOSED = "<Unclosed>"


def sub_assembly() -> Doc:
    """Three links to a part in an assembly."""
    doc = Doc("sub")
    for name in ("L1", "L2", "L3"):
        doc.link(name, "part.FCStd", "Box")
    return doc.add("App::Part", "Sub", Group=locals_("L1", "L2", "L3"), Type="Assembly")


def walk(folder: Path, sub_xml: str) -> Extraction:
    """A top with the sub-assembly twice and a plate; the sub-assembly's text is as given."""
    part().save(folder / "part.FCStd")
    part().save(folder / "plate.FCStd")
    save_xml(folder / "sub.FCStd", sub_xml)
    top = Doc("top").link("One", "sub.FCStd", "Sub").link("Two", "sub.FCStd", "Sub")
    top.link("Plate", "plate.FCStd", "Box")
    top.add("App::Part", "Top", Group=locals_("One", "Two", "Plate"), Type="Assembly")
    return extract(choose_assembly(open_document(top.save(folder / "top.FCStd"))))


def damaged(xml: str, obj: str, prop: str) -> str:
    """The text with an element that is never closed in one property of one object ("": of the document)."""
    begin = xml.index(f'<Object name="{obj}">') if obj else 0
    at = xml.index("</Property>", xml.index(f'<Property name="{prop}"', begin))
    return xml[:at] + UNCLOSED + xml[at:]


def quantities(found: Extraction) -> dict[str, int]:
    return {Path(entry.doc_path).name: entry.quantity for entry in found.entries}


def the_only(found: Extraction) -> Finding:
    assert found.blocked
    (finding,) = (f for f in found.findings if f.code is FindingCode.UNREADABLE_FILE)
    return finding


def test_a_damaged_link_of_a_subassembly_is_reported_and_the_rest_is_read(tmp_path: Path) -> None:
    """The other links of the sub-assembly are counted, and all of the top."""
    xml = damaged(sub_assembly().xml(), "L2", "LinkedObject")
    found = walk(tmp_path, xml)
    finding = the_only(found)
    assert finding.where == (Place(str(tmp_path / "sub.FCStd"), "L2"),)
    assert quantities(found) == {"sub.FCStd": 2, "plate.FCStd": 1}
    (inner,) = found.entries[0].children
    assert inner.quantity == 2
    assert inner.instances == ("L1", "L3")
    line = xml[: xml.index(UNCLOSED)].count("\n") + 1
    assert f"no well-formed XML: mismatched tag, line {line}" in finding.message


def test_damaged_members_of_a_subassembly_do_not_read_as_an_empty_one(tmp_path: Path) -> None:
    """Nothing in it can be counted; the assembly itself is, and it stays an assembly."""
    found = walk(tmp_path, damaged(sub_assembly().xml(), "Sub", "Group"))
    finding = the_only(found)
    assert finding.where == (Place(str(tmp_path / "sub.FCStd"), "Sub"),)
    assert quantities(found) == {"sub.FCStd": 2, "plate.FCStd": 1}
    assert found.entries[0].is_assembly
    assert found.entries[0].children == ()


@pytest.mark.parametrize(("obj", "prop"), [("Sub", "Label"), ("Sub", "Type"), ("", "Meta")])
def test_a_target_that_cannot_say_what_it_is_is_the_problem_of_its_links(
    tmp_path: Path, obj: str, prop: str
) -> None:
    """Name, kind and identity are tried when a link is followed; no guess is made from what is left."""
    found = walk(tmp_path, damaged(sub_assembly().xml(), obj, prop))
    finding = the_only(found)
    assert finding.where == tuple(Place(str(tmp_path / "top.FCStd"), name) for name in ("One", "Two"))
    assert quantities(found) == {"sub.FCStd": 2, "plate.FCStd": 1}
    assert [entry.missing for entry in found.entries] == [True, False]
    assert found.entries[0].children == ()


def test_a_damaged_inner_group_leaves_the_other_members(tmp_path: Path) -> None:
    """A link group that cannot be listed blocks; the assembly around it is named as the place."""
    doc = Doc("sub").link("L1", "part.FCStd", "Box").link("L2", "part.FCStd", "Box")
    doc.add("App::LinkGroup", "Bundle", ElementList=locals_("L2"))
    doc.add("App::Part", "Sub", Group=locals_("L1", "Bundle"), Type="Assembly")
    found = walk(tmp_path, damaged(doc.xml(), "Bundle", "ElementList"))
    assert the_only(found).where[0].doc_path == str(tmp_path / "sub.FCStd")
    assert quantities(found) == {"sub.FCStd": 2, "plate.FCStd": 1}


def test_a_damaged_label_of_a_link_does_not_hide_what_is_wrong_with_it(tmp_path: Path) -> None:
    """A label is for people; where it cannot be read, the name stands in a message."""
    xml = damaged(sub_assembly().link("L4", "gone.FCStd", "Box").xml(), "L4", "Label")
    xml = xml.replace('<Link value="L3"/>', '<Link value="L3"/><Link value="L4"/>')
    xml = xml.replace('<LinkList count="3">', '<LinkList count="4">')
    found = walk(tmp_path, xml)
    (missing,) = (f for f in found.findings if f.code is FindingCode.MISSING_FILE)
    assert "L4" in missing.message


def test_what_is_sound_xml_but_no_document_is_reported_with_its_object(tmp_path: Path) -> None:
    """A property twice is well-formed; the message names the object, for there is no line to point at."""
    xml = sub_assembly().xml()
    begin = xml.index('<Property name="ElementCount"', xml.index('<Object name="L2">'))
    end = xml.index("</Property>", begin) + len("</Property>")
    found = walk(tmp_path, xml[:end] + xml[begin:end] + xml[end:])
    finding = the_only(found)
    assert finding.where == (Place(str(tmp_path / "sub.FCStd"), "L2"),)
    assert "'ElementCount' twice" in finding.message


def test_the_asked_document_itself_must_be_readable(tmp_path: Path) -> None:
    """Without its members there is no BOM at all: an error, not an empty answer."""
    part().save(tmp_path / "part.FCStd")
    path = save_xml(tmp_path / "sub.FCStd", damaged(sub_assembly().xml(), "Sub", "Group"))
    with pytest.raises(DocumentError, match="no well-formed XML"):
        extract(choose_assembly(open_document(path)))


def test_a_lost_original_of_a_changed_copy_names_its_file(tmp_path: Path) -> None:
    """What a link shows is a copy; its original's file is what a person has to bring back."""
    doc = Doc("top").add("Part::Box", "Copy")
    owned = Raw("App::PropertyEnumeration", '<Integer value="2"/>')
    source = XLink("lib/bolt.FCStd", "Box")
    doc.link("L", "", "Copy", LinkCopyOnChange=owned, LinkCopyOnChangeSource=source)
    doc.add("App::Part", "Top", Group=locals_("L"), Type="Assembly")
    document = open_document(doc.save(tmp_path / "top.FCStd"))
    problem = document.Objects[1].LinkProblem
    assert problem is not None
    assert (problem.code, problem.file, problem.obj) == (
        FindingCode.MISSING_FILE,
        "lib/bolt.FCStd",
        "Box",
    )
    found = extract(choose_assembly(document))
    assert found.blocked
    (finding,) = (f for f in found.findings if f.code is FindingCode.MISSING_FILE)
    assert str(tmp_path / "lib" / "bolt.FCStd") in finding.message
    assert "the original of a changed copy" in finding.message
    assert finding.where == (Place(str(tmp_path / "top.FCStd"), "L"),)
