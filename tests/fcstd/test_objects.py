# SPDX-License-Identifier: LGPL-2.1-or-later
"""Objects and documents look as FreeCAD's Python shows them (forms and values checked with FreeCAD 0.20)."""

from __future__ import annotations

import math
import os
import struct
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, Raw, Vector, XLink, container, locals_, part

from silo.bom.errors import DocumentError
from silo.bom.walk.document import DocumentLike, ObjectLike, document_property, own
from silo.bom.walk.targets import is_mirrored
from silo.fcstd import FcstdObject, Library, open_document
from silo.fcstd.type_tree import PARENTS, ancestors


def read(folder: Path, **values: Any) -> FcstdObject:
    """An object with these properties, beside a box."""
    doc = Doc().add("Part::Box", "Box").add("Part::Box", "Box2").add("App::FeaturePython", "F", **values)
    found = open_document(doc.save(folder / "doc.FCStd")).getObject("F")
    assert found is not None
    return found


BOX = '<XLink file="" stamp="" name="Box"/>'
FACES = '<XLink file="" stamp="" name="Box" count="2"><Sub value="Face1"/><Sub value="Face2"/></XLink>'
TEXTS = '<StringList count="2"><String value="a"/><String value="b"/></StringList>'
MAP = '<Map count="2"><Item key="" value="e"/><Item key="k" value="v"/></Map>'
ENUM = '<CustomEnumList count="2"><Enum value="one"/><Enum value="two"/></CustomEnumList>'
SUB = '<LinkSub value="Box" count="1"><Sub value="Face1"/></LinkSub>'
LINKS = '<LinkList count="3"><Link value="Box"/><Link value="Gone"/><Link value="F"/></LinkList>'
SUBS = '<Link obj="Box" sub="F1"/><Link obj="Box" sub="F2"/><Link obj="Box2" sub="E"/>'
PAIRS = (("Box", ("F1", "F2")), ("Box2", ("E",)))


@pytest.mark.parametrize(
    ("kind", "xml", "expected"),
    [
        ("String", '<String value="a&lt;b&gt;&amp;&quot;&apos;&#10;&#9;ü€"/>', "a<b>&\"'\n\tü€"),
        ("Integer", '<Integer value="-3"/>', -3),
        ("Bool", '<Bool value="true"/>', True),
        ("Float", '<Float value="1.5000000000000000"/>', 1.5),
        ("Length", '<Float value="inf"/>', math.inf),
        ("UUID", '<Uuid value="u-1"/>', "u-1"),
        ("Path", '<Path value="/x"/>', "/x"),
        ("StringList", TEXTS, ("a", "b")),
        ("IntegerList", '<IntegerList count="2"><I v="1"/><I v="2"/></IntegerList>', (1, 2)),
        ("BoolList", '<BoolList value="011"/>', (True, True, False)),
        ("BoolList", '<BoolList value=""/>', ()),
        ("Map", MAP, {"": "e", "k": "v"}),
        ("Vector", '<PropertyVector valueX="1" valueY="2" valueZ="3"/>', (1.0, 2.0, 3.0)),
        ("Enumeration", f'<Integer value="1" CustomEnum="true"/>{ENUM}', "two"),
        ("Enumeration", '<Integer value="3"/>', 3),
        ("Link", '<Link value="Box"/>', "Box"),
        ("Link", '<Link value=""/>', None),
        ("Link", '<Link value="Gone"/>', None),
        ("LinkSub", '<LinkSub value="Box" count="0"></LinkSub>', ("Box", [])),
        ("LinkSub", SUB, ("Box", ["Face1"])),
        ("LinkSub", '<LinkSub value="" count="0"></LinkSub>', None),
        ("LinkList", LINKS, ("Box", "F")),
        ("LinkSubList", f'<LinkSubList count="3">{SUBS}</LinkSubList>', PAIRS),
        ("XLink", BOX, "Box"),
        ("XLink", '<XLink file="" stamp="" name="Box" sub="Face1"/>', ("Box", "Face1")),
        ("XLink", FACES, ("Box", ["Face1", "Face2"])),
        ("XLinkSub", BOX, ("Box", [])),
        ("XLinkSub", FACES, ("Box", ["Face1", "Face2"])),
        ("XLinkList", f'<XLinkSubList count="1">{BOX}</XLinkSubList>', ("Box",)),
        ("XLinkSubList", f'<XLinkSubList count="1">{FACES}</XLinkSubList>', (("Box", ("Face1", "Face2")),)),
    ],
)
def test_values_are_those_of_freecad(tmp_path: Path, kind: str, xml: str, expected: Any) -> None:
    """Each kind of property gives what FreeCAD's Python gives (sequences as tuples, objects by name here)."""
    value = read(tmp_path, P=Raw(f"App::Property{kind}", xml)).P
    assert _named(value) == expected


def _named(value: Any) -> Any:
    if isinstance(value, FcstdObject):
        return value.Name
    if isinstance(value, tuple | list):
        return type(value)(map(_named, value)) if type(value) in (tuple, list) else value
    return value


@pytest.mark.parametrize(
    "xml",
    [
        '<Integer value="99999999999999999999999"/>',
        '<Integer value="x"/>',
        '<Float value="?"/>',
        '<Bool value="perhaps"/>',
        '<BoolList value="01x"/>',
        '<PropertyVector valueX="1"/>',
        '<PropertyPlacement Px="0"/>',
        "<String/>",
        '<Unheard of="it"/>',
        "",
    ],
)
def test_what_has_no_plain_value_is_absent(tmp_path: Path, xml: str) -> None:
    """A value that cannot be read is never a guess: the attribute is not there, though the name is listed."""
    obj = read(tmp_path, P=Raw("App::PropertyX", xml))
    assert "P" in obj.PropertiesList
    assert not hasattr(obj, "P")
    assert own(obj, "P", "default") == "default"


@pytest.mark.parametrize("name", ["Group", "LinkedObject", "ElementCount", "ElementList", "ScaleVector"])
def test_freecads_own_properties_have_their_kind(tmp_path: Path, name: str) -> None:
    """A text where a link should be is no link; FreeCAD does not restore it either."""
    assert not hasattr(read(tmp_path, **{name: "text"}), name)
    assert read(tmp_path, Label=7).Label == "F"


def test_an_object_has_freecads_attributes(tmp_path: Path) -> None:
    """Name, label, type, document, properties."""
    obj = read(tmp_path, Zeta=1, Alpha=2, Label="a label")
    assert isinstance(obj, ObjectLike)
    assert (obj.Name, obj.Label, obj.TypeId) == ("F", "a label", "App::FeaturePython")
    assert obj.PropertiesList == ("Alpha", "Label", "Visibility", "Zeta")
    assert obj.Document.getObject("F") is obj
    assert obj.getPropertyByName("Zeta") == 1
    with pytest.raises(AttributeError):
        obj.getPropertyByName("Name")
    with pytest.raises(AttributeError):
        _ = obj.Nothing


def test_without_a_label_the_name_is_the_label(tmp_path: Path) -> None:
    """A file that lost a label still shows its objects."""
    xml = part().xml().replace('<Property name="Label"', '<Property name="Lost"')
    path = tmp_path / "x.FCStd"
    path.write_bytes(container({"Document.xml": xml.encode()}))
    document = open_document(path)
    assert document.Objects[0].Label == "Box"


def test_nothing_is_forwarded_to_a_links_target(tmp_path: Path) -> None:
    """A live link answers for its target; these do not, so nothing is read twice by mistake."""
    part(PN="F01-0001").save(tmp_path / "part.FCStd")
    link = open_document(Doc().link("L", "part.FCStd", "Box").save(tmp_path / "top.FCStd")).Objects[0]
    assert link.LinkedObject.PN == "F01-0001"
    assert not hasattr(link, "PN")
    assert not link.isDerivedFrom("Part::Box")


class _Shown:
    """An object that has only attributes to show, as FreeCAD's."""

    def __init__(self, obj: Any) -> None:
        self._obj = obj

    def __getattr__(self, name: str) -> Any:
        return getattr(self._obj, name)


def test_an_object_knows_its_own_properties_as_its_attributes_show_them(tmp_path: Path) -> None:
    """Also what is not plain, what is empty, what is no property, and what is not there."""
    doc = Doc("doc").add("Part::Box", "Box", Length=2.0, Empty="", Zero=0, SiloItemId="u", Suppressed=False)
    doc.add("App::Part", "Part", Group=locals_("Box"), Shape=Raw("Part::PropertyPartShape", "<Part/>"))
    path = doc.link("Link", "gone.FCStd", "Box", ElementCount=0).save(tmp_path / "doc.FCStd")
    for obj, again in zip(open_document(path).Objects, open_document(path).Objects, strict=True):
        for name in (*again.PropertiesList, "Name", "Document", "ancestry", "Gone", "Group", "Suppressed"):
            for default in (None, 0, "other"):
                found, wanted = own(obj, name, default), own(_Shown(again), name, default)
                assert repr(found) == repr(wanted), (obj, name)


def test_a_document_has_freecads_attributes(tmp_path: Path) -> None:
    """File, label, names, dates, texts; an unknown property is an AttributeError as in FreeCAD."""
    doc = Doc("the label", meta={"SiloUUID": "u-1"}, extra={"SiloUUID": "u-2"})
    document = open_document(doc.save(tmp_path / "2 nd ü.FCStd"))
    assert isinstance(document, DocumentLike)
    assert document.FileName == os.path.realpath(tmp_path / "2 nd ü.FCStd")
    assert (document.Label, document.Name) == ("2 nd ü", "_2_nd__")
    assert document.Meta == {"SiloUUID": "u-1"}
    assert document.SiloUUID == document.getPropertyByName("SiloUUID") == "u-2"
    assert document.Uid == "3a4cb85d-6224-4a3f-bde2-ab5c5ce51855"
    assert document_property(document, "Nothing") is None
    with pytest.raises(AttributeError):
        _ = document.Nothing
    assert document.getObject("Nothing") is None


def test_a_document_without_meta_has_an_empty_one(tmp_path: Path) -> None:
    """``Meta`` is never missing."""
    assert open_document(Doc(meta=None).save(tmp_path / "old.FCStd")).Meta == {}


def test_hidden_elements_are_kept_apart_from_shown_ones(tmp_path: Path) -> None:
    """``VisibilityList`` is written last element first (facts §3.2)."""
    bits = Raw("App::PropertyBoolList", '<BoolList value="1101"/>')
    doc = Doc().link("L", "", "L", ElementCount=4, VisibilityList=bits)
    link = open_document(doc.save(tmp_path / "top.FCStd")).Objects[0]
    assert link.VisibilityList == (True, False, True, True)


def test_scales_of_elements_come_from_their_entry(tmp_path: Path) -> None:
    """A link array keeps its scales beside Document.xml, as doubles."""
    doc = Doc()
    scales = doc.vectors("ScaleList7", [(1, 1, 1), (-1, 1, 2)])
    doc.link("L", "", "L", ElementCount=2, ScaleList=scales, ScaleVector=Vector(1, -1, 1))
    link = open_document(doc.save(tmp_path / "top.FCStd")).Objects[0]
    assert link.ScaleList == ((1.0, 1.0, 1.0), (-1.0, 1.0, 2.0))
    assert link.ScaleList[1].x == -1.0
    assert link.ScaleVector.y == -1.0


def test_scales_of_very_old_files_are_floats(tmp_path: Path) -> None:
    """FileVersion 0 kept single precision."""
    doc = Doc()
    doc.link("L", "", "L", ElementCount=1, ScaleList=doc.vectors("S", []))
    entries = {
        "Document.xml": doc.xml().replace('FileVersion="1"', 'FileVersion="0"').encode(),
        "S": struct.pack("<I3f", 1, 1, 2, -0.5),
    }
    path = tmp_path / "old.FCStd"
    path.write_bytes(container(entries))
    assert open_document(path).Objects[0].ScaleList == ((1.0, 2.0, -0.5),)


def test_a_plain_link_needs_no_scale_entry(tmp_path: Path) -> None:
    """1000 links have 1000 empty entries; none of them is looked at."""
    doc = Doc().link("L", "", "L")
    doc.entries.clear()
    assert not is_mirrored(open_document(doc.save(tmp_path / "top.FCStd")).Objects[0])


@pytest.mark.parametrize("content", [None, b"\xff\xff\xff\xff", b"\2\0\0\0" + b"\0" * 24, b"\0\0"])
def test_damaged_scales_are_an_error(tmp_path: Path, content: bytes | None) -> None:
    """A count is never believed; what is missing is not "not mirrored"."""
    doc = Doc()
    doc.link("L", "", "L", ElementCount=2, ScaleList=doc.vectors("S", []))
    doc.entries.clear()
    if content is not None:
        doc.entries["S"] = content + b"\0" * 8
    link = open_document(doc.save(tmp_path / "top.FCStd")).Objects[0]
    with pytest.raises(DocumentError, match="its S is"):
        _ = link.ScaleList


def test_a_file_that_changed_since_is_not_mixed_with_its_past(tmp_path: Path) -> None:
    """Scales are read later than the text; from another state of the file they would be wrong."""
    doc = Doc()
    path = doc.link("L", "", "L", ElementCount=1, ScaleList=doc.vectors("S", [(1, 1, 1)])).save(
        tmp_path / "t.FCStd"
    )
    link = open_document(path).Objects[0]
    path.write_bytes(doc.bytes() + b"\0")
    with pytest.raises(DocumentError, match="changed while it was being read"):
        _ = link.ScaleList


@pytest.mark.parametrize(
    ("kind", "yes", "no"),
    [
        ("App::Link", ["App::Link", "App::DocumentObject"], ["App::Part", "Nothing::Known"]),
        ("App::LinkPython", ["App::Link"], ["App::LinkGroup"]),
        ("App::LinkElement", ["App::LinkElement"], ["App::Link"]),
        ("App::LinkGroup", ["App::LinkGroup"], ["App::Link", "App::DocumentObjectGroup"]),
        ("Assembly::AssemblyObject", ["App::Part", "App::GeoFeature"], ["Assembly::AssemblyLink"]),
        ("Assembly::AssemblyLink", ["App::Part"], ["App::Link", "Assembly::AssemblyObject"]),
        ("Assembly::JointGroup", ["App::DocumentObjectGroup"], ["App::Part"]),
        ("Assembly::BomObject", ["Spreadsheet::Sheet"], ["Part::Feature"]),
        ("Assembly::BomObjectPython", ["Spreadsheet::Sheet"], ["Part::Feature"]),
        ("PartDesign::Body", ["Part::Feature"], ["App::Part", "PartDesign::Feature"]),
        ("PartDesign::Unheard", ["PartDesign::Feature", "Part::Feature"], ["App::Part"]),
        ("Part::FeaturePython", ["Part::Feature"], ["App::FeaturePython"]),
        ("Part::DatumPlane", ["App::DatumElement", "App::GeoFeature"], ["Part::Feature"]),
        ("My::Own", ["My::Own", "App::DocumentObject"], ["App::GeoFeature"]),
    ],
)
def test_types_are_derived_as_in_freecad(kind: str, yes: list[str], no: list[str]) -> None:
    """What a walker asks with ``isDerivedFrom``."""
    assert ancestors(kind).issuperset(yes)
    assert ancestors(kind).isdisjoint(no)


def test_the_table_of_types_has_one_root() -> None:
    """Every type is a document object, and no type is its own ancestor by another way."""
    for kind in PARENTS:
        assert "App::DocumentObject" in ancestors(kind)
        assert all(kind not in ancestors(parent) for parent in ancestors(kind) - {kind})


@pytest.mark.usefixtures("needs_symlinks")
def test_the_same_file_is_the_same_document(tmp_path: Path) -> None:
    """One file, one document object, whatever the path; so ``is`` distinguishes parts."""
    part().save(tmp_path / "lib" / "part.FCStd")
    (tmp_path / "alias").symlink_to("lib")
    (tmp_path / "alias.FCStd").symlink_to("lib/part.FCStd")
    doc = Doc().link("A", "lib/part.FCStd", "Box").link("B", "alias/part.FCStd", "Box")
    doc.link("C", "lib/../alias.FCStd", "Box")
    path = doc.save(tmp_path / "top.FCStd")
    with Library() as library:
        links = library.open(path).Objects
        assert len({link.LinkedObject for link in links}) == 1
        assert library.open(tmp_path / "alias.FCStd") is links[0].LinkedObject.Document


def test_links_chains_and_groups(tmp_path: Path) -> None:
    """The forms that the facts' table lists (§3.2)."""
    part().add("App::Part", "P", Group=locals_("Box")).save(tmp_path / "part.FCStd")
    doc = Doc().link("L1", "part.FCStd", "P").link("L2", "", "L1").add("App::LinkGroup", "G")
    doc.link("S", "part.FCStd", "P", LinkedObject=XLink("part.FCStd", "P", ("Box.",)))
    document = open_document(doc.save(tmp_path / "top.FCStd"))
    first, second, _, sub = document.Objects
    assert second.LinkedObject is first
    assert sub.LinkedObject == (first.LinkedObject, "Box.")
    assert first.LinkedObject.Group[0].Name == "Box"
