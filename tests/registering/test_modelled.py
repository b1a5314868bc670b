# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is modelled in a file and could be declared a component there."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc

from silo.bom import choose_assembly, extract
from silo.registering.modelled import label_stem, modelled_in


def shapes(**known: str) -> Any:
    return lambda obj: known.get(obj.Name, "")


def rows(top: Any, **known: str) -> list[tuple[tuple[str, ...], int, str]]:
    return [(one.objects, one.entry.quantity, one.alike) for one in modelled_in(top, shapes(**known))]


def dumb(doc: Doc, name: str, label: str = "", **properties: Any) -> Any:
    return doc.add("Part::Feature", name, Label=label or name, **properties)


def test_copies_of_one_shape_or_one_label_are_one_article() -> None:
    """FreeCAD's own labels and numbers do not make two things alike."""
    doc = Doc("/v/top.FCStd")
    copies = [
        dumb(doc, "A", "M3x8"),
        dumb(doc, "B", "M3x8001"),
        dumb(doc, "C", "Motor"),
        dumb(doc, "D", "Gear"),
    ]
    bodies = [doc.body("Body"), doc.body("Body001")]
    top = doc.assembly(*copies, *bodies)
    assert rows(top, C="same", D="same") == [
        (("A", "B"), 2, "label"),
        (("C", "D"), 2, "shape"),
        (("Body",), 1, ""),
        (("Body001",), 1, ""),
    ]


@pytest.mark.parametrize(
    ("label", "stem"),
    [("M3x8001", "M3x8"), ("608ZZ", "608ZZ"), ("Body001", ""), ("ISO 4762", "ISO 4762"), ("Body", "")],
)
def test_the_stem_of_a_label(label: str, stem: str) -> None:
    """Without the number by which FreeCAD distinguishes copies."""
    assert label_stem(label, {"M3x8", "Body", label}) == stem


def test_links_and_arrays_in_the_file_count_its_copies() -> None:
    """As the BOM would count it, were it declared."""
    doc = Doc("/v/top.FCStd")
    motor = dumb(doc, "Motor")
    top = doc.assembly(motor, doc.link("L", motor), doc.array("Four", motor, 4))
    assert rows(top) == [(("Motor",), 6, "")]


def test_a_tree_of_geometry_is_one_thing_and_what_is_used_up_is_none() -> None:
    """An imported STEP assembly is bought as a whole; a part with components in it is not."""
    doc = Doc("/v/top.FCStd")
    bolt = doc.link("Bolt", Doc("/v/bolt.FCStd").body())
    plate = dumb(doc, "Plate")
    top = doc.assembly(
        doc.part("0371-E0W", doc.part("Inner", dumb(doc, "Housing")), dumb(doc, "Shaft")),
        doc.part("Mixed", bolt, dumb(doc, "Spacer")),
        doc.add("Part::Cut", "Cut", Base=plate, Tool=None),
        plate,
    )
    assert rows(top) == [(("0371-E0W",), 1, ""), (("Spacer",), 1, ""), (("Cut",), 1, "")]


def test_a_file_without_any_link_has_an_answer() -> None:
    """Most hobby projects: bodies in one file."""
    doc = Doc("/v/box.FCStd")
    doc.body("Lid", Label="Lid")
    doc.body("Base", Label="Base")
    assert [one.entry.label for one in modelled_in(choose_assembly(doc), shapes())] == ["Lid", "Base"]


def test_what_a2plus_imported_names_its_file() -> None:
    doc = Doc("/v/top.FCStd")
    made = {"sourceFile": "./parts/bearing.FCStd", "a2p_Version": "V0.4"}
    (one,) = modelled_in(doc.assembly(doc.add("Part::FeaturePython", "Imported", **made)), shapes())
    assert one.source == "/v/parts/bearing.FCStd"


def test_a_declared_part_is_listed_as_such_and_counts() -> None:
    """So that a person can take it back."""
    doc = Doc("/v/top.FCStd")
    top = doc.assembly(dumb(doc, "Motor", SiloItemId="m"), dumb(doc, "Jig"))
    assert [(one.objects, one.declared) for one in modelled_in(top, shapes())] == [
        (("Jig",), False),
        (("Motor",), True),
    ]
    assert [entry.object_name for entry in extract(top).entries] == ["Motor"]


def test_copies_can_be_taken_apart() -> None:
    doc = Doc("/v/top.FCStd")
    (one,) = modelled_in(doc.assembly(dumb(doc, "A", "Rail"), dumb(doc, "B", "Rail001")), shapes())
    assert [each.objects for each in one.apart()] == [("A",), ("B",)]


def test_a_configured_copy_is_offered_by_its_links() -> None:
    """It counts already; registering gives it a number of its own, on each link with its values."""
    doc = Doc("/v/top.FCStd")
    base = Doc("/v/profile.FCStd").body(Label="Profile", L=100.0, SiloItemId="one")
    links = [
        doc.link(
            f"L{number}",
            doc.body(f"Copy{number}", L=length, SiloItemId="one"),
            L=length,
            LinkCopyOnChangeSource=base,
        )
        for number, length in enumerate((300.0, 300.0, 100.0))
    ]
    top = doc.assembly(*links)
    (article,) = modelled_in(top, shapes())
    assert (article.objects, article.entry.quantity) == (("L0", "L1"), 2)
    assert (article.entry.label, article.variant_of) == ("Profile, L = 300", "Profile")
    assert article.entry.doc_path == "/v/top.FCStd"
    assert not article.decided
    assert article.apart() == (article,)


def test_a_configured_copy_with_a_number_of_its_own_is_declared() -> None:
    doc = Doc("/v/top.FCStd")
    base = Doc("/v/profile.FCStd").body(L=100.0, SiloItemId="one")
    copy = doc.body("Copy", L=300.0, SiloItemId="one")
    link = doc.link("L", copy, L=300.0, LinkCopyOnChangeSource=base, SiloItemId="two")
    (article,) = modelled_in(doc.assembly(link), shapes())
    assert (article.declared, article.entry.silo_uuid) == (True, "two")
