# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of FreeCAD before 0.19: only the view says what is hidden, and PartDesign has no bodies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, Raw, save_xml

from silo.bom import FindingCode, choose_assembly, extract
from silo.bom.entry import Extraction
from silo.fcstd import Library
from silo.fcstd.old_view import visible_in


def view(**shown: bool) -> bytes:
    providers = "".join(
        f'<ViewProvider name="{name}" expanded="0"><Properties Count="2"><Property name="Transparency" '
        'type="App::PropertyPercent"><Integer value="0"/></Property><Property name="Visibility" '
        f'type="App::PropertyBool">\n <Bool value="{str(is_shown).lower()}"/></Property></Properties>'
        "</ViewProvider>"
        for name, is_shown in shown.items()
    )
    return f"<Document SchemaVersion='1'><ViewProviderData>{providers}</ViewProviderData></Document>".encode()


def read(path: Path) -> Extraction:
    with Library() as library:
        return extract(choose_assembly(library.open(path)))


def two_boxes(**more: Any) -> Doc:
    return Doc(label="old").add("Part::Box", "Shown", **more).add("Part::Box", "Hidden", **more)


def old(doc: Doc) -> str:
    """Take out of a document what only later versions write."""
    for _, values in doc.objects.values():
        del values["Visibility"]
    return doc.xml()


def own(found: Extraction) -> dict[str, int]:
    return {line.object_name: line.quantity for line in found.assembly.own}


def test_the_view_of_an_old_file_says_what_is_hidden(tmp_path: Path) -> None:
    doc = two_boxes().add("Part::Box", "Third")
    path = save_xml(
        tmp_path / "a.FCStd", old(doc), **{"GuiDocument.xml": view(Shown=True, Hidden=False, Third=True)}
    )
    found = read(path)
    assert own(found) == {"Shown": 1, "Third": 1}
    assert "Hidden" in found.findings_of(FindingCode.HIDDEN)[0].message


def test_a_later_file_says_it_itself(tmp_path: Path) -> None:
    """An add-on may have changed the file without its view."""
    doc = two_boxes(Visibility=True)
    path = save_xml(tmp_path / "a.FCStd", doc.xml(), **{"GuiDocument.xml": view(Shown=True, Hidden=False)})
    assert own(read(path)) == {"Shown": 1, "Hidden": 1}


def test_a_damaged_view_hides_nothing(tmp_path: Path) -> None:
    path = save_xml(tmp_path / "a.FCStd", old(two_boxes()), **{"GuiDocument.xml": b"<Docu\0ment"})
    assert own(read(path)) == {"Shown": 1, "Hidden": 1}


@pytest.mark.parametrize("has_view", [True, False])
def test_features_without_a_body_grow_from_one_another(tmp_path: Path, has_view: bool) -> None:
    doc = Doc(label="motor").add("PartDesign::Pad", "Pad")
    face = Raw("App::PropertyLinkSub", '<LinkSub value="Pad" count="1"><Sub value="Face1"/></LinkSub>')
    doc.add("Sketcher::SketchObject", "Sketch", Support=face)
    doc.add("PartDesign::Pocket", "Pocket", Sketch=Raw("App::PropertyLink", '<Link value="Sketch"/>'))
    doc.add("Part::Box", "Beside")
    shown = {"GuiDocument.xml": view(Pad=False, Pocket=True, Beside=True)} if has_view else {}
    found = read(save_xml(tmp_path / "a.FCStd", old(doc), **shown))
    assert own(found) == {"Pocket": 1, "Beside": 1}
    assert not found.findings_of(FindingCode.HIDDEN)


def test_what_is_no_view_shows_nothing() -> None:
    assert visible_in(b"") == {}
    assert visible_in(b'<ViewProvider name="A"><Property name="Visibility"/>') == {}
