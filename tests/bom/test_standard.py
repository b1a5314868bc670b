# SPDX-License-Identifier: LGPL-2.1-or-later
"""Designations of standard parts: what makes the article, in trade form, whoever wrote the file."""

from __future__ import annotations

import uuid
from typing import Any

import pytest
from fakes import Doc

from silo.bom.walk.standard import NAMESPACE, designated, designation, same_articles, standard_uuid

LATER_USED_OF = {
    "type": "Type",
    "diameter": "Diameter",
    "length": "Length",
    "lengthCustom": "LengthCustom",
    "leftHanded": "LeftHanded",
}


def fastener(**properties: Any) -> Any:
    return Doc("/v/top.FCStd").add("Part::FeaturePython", "Screw", **properties)


TRADE = [
    (("ISO4762", {"Diameter": "M4", "Length": "16"}), "ISO 4762 M4×16"),
    (("ISO4762", {"Diameter": "M4", "Length": "16", "LeftHanded": True}), "ISO 4762 M4×16 LH"),
    (("ISO4762", {"Diameter": "M4", "Length": "Custom", "LengthCustom": 16.0}), "ISO 4762 M4×16"),
    (("ISO4762", {"Diameter": "M4", "Length": "Custom", "LengthCustom": 17.25}), "ISO 4762 M4×17.25"),
    (("ISO4762", {"Diameter": "M4", "Length": "16", "LengthCustom": 99.0}), "ISO 4762 M4×16"),
    (("ISO7089", {"Diameter": "M3"}), "ISO 7089 M3"),
    (("ISO4014", {"Diameter": "(M14)", "Length": "60"}), "ISO 4014 M14×60"),
    (("ISO7380", {"Diameter": "M5", "Length": "8"}), "ISO 7380-1 M5×8"),
    (("ISO7380-1", {"Diameter": "M5", "Length": "8"}), "ISO 7380-1 M5×8"),
    (("DIN1624", {"Diameter": "M6"}), "Tee nut 4PWTI M6"),
    (("4PWTI", {"Diameter": "M6"}), "Tee nut 4PWTI M6"),
    (("ASMEB18.3.1A", {"Diameter": "1/4in", "Length": "1 1/4in"}), "ASME B18.3.1A 1/4in×1 1/4in"),
    (("ASMEB18.3.1A", {"Diameter": "1/4in", "Length": "1 1/4″"}), "ASME B18.3.1A 1/4in×1 1/4in"),
    (
        ("ASMEB18.3.1A", {"Diameter": "#6", "Length": "Custom", "LengthCustom": 31.75}),
        "ASME B18.3.1A #6×1 1/4in",
    ),
    (
        ("ASMEB18.3.1A", {"Diameter": "#6", "Length": "Custom", "LengthCustom": 30.0}),
        "ASME B18.3.1A #6×30mm",
    ),
    (("GOST1144-1", {"Diameter": "3 mm", "Length": "20"}), "GOST 1144-1 3 mm×20"),
    (("NFE27-619", {"Diameter": "M5"}), "NF E27-619 M5"),
    (("SAEJ483a1", {"Diameter": "1/4in"}), "SAE J483a1 1/4in"),
    (
        ("ThreadedRod", {"Diameter": "Custom", "DiameterCustom": 7.5, "PitchCustom": 1.25, "Length": 100.0}),
        "Threaded rod M7.5×1.25×100",
    ),
    (("ThreadedRod", {"Diameter": "M6", "DiameterCustom": 7.5, "Length": 100.0}), "Threaded rod M6×100"),
    (
        ("IUTHeatInsert", {"Diameter": "M3.5", "Length": 7.14, "ExternalDiam": 5.33}),
        "IUT heat insert M3.5×7.14 ⌀5.33",
    ),
    (("PEMPressNut", {"Diameter": "M3", "Tcode": "1"}), "PEM press nut M3-1"),
    (("PEMStandoff", {"Diameter": "M3", "Length": "10", "Blind": True}), "PEM standoff M3×10 blind"),
    (
        ("PCBStandoff", {"Diameter": "M3", "Width": "5.5", "Length": "10", "ScrewLength": 6.0}),
        "PCB standoff M3×10 SW5.5 thread 6",
    ),
    (("DIN508", {"Diameter": "M8", "SlotWidth": "10"}), "DIN 508 M8×10"),
    (("GN505.4", {"Diameter": "M8", "SlotWidth": "10", "Length": "30"}), "GN 505.4 M8×10×30"),
    (("ISO2936", {"Diameter": "5", "KeySize": "Long"}), "ISO 2936 5 Long"),
]


@pytest.mark.parametrize(("article", "text"), TRADE, ids=[text for _, text in TRADE])
def test_the_designation_is_that_of_the_trade(article: tuple[str, dict[str, Any]], text: str) -> None:
    """From the properties that make the article, in the spelling of catalogues."""
    assert designated(*article) == text


@pytest.mark.parametrize("spelling", ["of today", "of before 0.4"])
def test_both_spellings_are_one_article(spelling: str) -> None:
    """The add-on renamed its properties in 2022; both are in real files."""
    values = {"type": "ISO4762", "diameter": "M4", "length": "Custom", "lengthCustom": 16.0, "thread": True}
    if spelling == "of today":
        values = {LATER_USED_OF.get(name, name.title()): value for name, value in values.items()}
    assert designation(fastener(**values)) == "ISO 4762 M4×16"


@pytest.mark.parametrize(
    "drawn",
    [{"Thread": True}, {"MatchOuter": True}, {"Invert": True}, {"Offset": 3.0}, {"OffsetAngle": 10.0}],
    ids=lambda drawn: next(iter(drawn)),
)
def test_how_it_is_drawn_and_attached_does_not_matter(drawn: dict[str, Any]) -> None:
    """A screw with a real thread is the same screw."""
    plain = {"Type": "ISO4762", "Diameter": "M4", "Length": "16", "LeftHanded": False}
    assert designation(fastener(**plain, **drawn)) == designation(fastener(**plain)) == "ISO 4762 M4×16"


class Quantity:
    """As FreeCAD shows a length."""

    Value = 7.14


def test_lengths_are_quantities_in_a_live_document() -> None:
    """Of which the value counts, in mm."""
    assert designation(fastener(Type="ThreadedRod", Diameter="M6", Length=Quantity())) == (
        "Threaded rod M6×7.14"
    )


@pytest.mark.parametrize("kind", ["ScrewTap", "ScrewDie", "ScrewTapInch", "ScrewDieInch", "ScrewTapBSPP"])
def test_taps_and_dies_are_tools(kind: str) -> None:
    """They cut threads; nobody buys them with the product."""
    assert designation(fastener(Type=kind, Diameter="M6", Length=20.0)) == ""


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("FSScrewRodObject", ""),
        ("FSScrewDieObject", ""),
        ("FSThreadedRodObject", "Threaded rod M6×20"),
    ],
)
def test_old_objects_without_a_type_are_known_by_their_class(name: str, text: str) -> None:
    """As the FCStd reader shows a Python object's class."""
    old = fastener(diameter="M6", length=20.0, invert=False, Proxy=("FastenersCmd", name))
    assert designation(old) == text


@pytest.mark.parametrize(
    ("properties", "text"),
    [
        ({"diameter": "M3", "tcode": "1"}, "PEM press nut M3-1"),
        ({"diameter": "M3", "blind": False, "length": "10"}, "PEM standoff M3×10"),
        ({"diameter": "M3", "length": "10"}, "PEM stud M3×10"),
        ({"diameter": "M3", "width": "5.5", "length": "10"}, "PCB spacer M3×10 SW5.5"),
        (
            {"diameter": "M3", "width": "5.5", "length": "10", "lengthCustom": 10.0},
            "PCB standoff M3×10 SW5.5",
        ),
    ],
)
def test_old_inserts_are_known_by_their_properties_without_the_add_on(
    properties: dict[str, Any], text: str
) -> None:
    """FreeCAD drops the proxy where the add-on is not there; properties stay."""
    assert designation(fastener(**properties, invert=False, baseObject=None, offset=0.0)) == text


@pytest.mark.parametrize(
    "properties",
    [
        {"Type": "Rebar", "Diameter": 12.0, "Length": 300.0},
        {"Type": "Countersunk", "Diameter": ("M3", "M4")},
        {"Type": "", "Diameter": "M3"},
        {"Diameter": "M3", "Length": "8"},
        {"Type": "SpurGear", "Diameter": "20 mm"},
        {"Type": "ISO4762"},
    ],
    ids=str,
)
def test_what_is_no_fastener(properties: dict[str, Any]) -> None:
    """Other add-ons have types and diameters too."""
    assert designation(fastener(**properties)) == ""


def test_only_python_features_are_fasteners() -> None:
    """A box with such properties is a box."""
    doc = Doc("/v/top.FCStd")
    values = {"Type": "ISO4762", "Diameter": "M4", "Length": "16"}
    assert designation(doc.add("Part::Box", "Box", **values)) == ""
    assert designation(doc.add("PartDesign::FeaturePython", "Screw", **values)) == "ISO 4762 M4×16"


def test_the_identity_follows_from_the_designation() -> None:
    """UUID version 5 in the documented namespace: the same in every project, forever."""
    assert str(NAMESPACE) == "5d8d3a1e-6f0b-5c7a-9a54-2f1d7c0e4b36"
    text = "ISO 4762 M4×16"
    assert standard_uuid(text) == str(uuid.uuid5(NAMESPACE, text))
    assert uuid.UUID(standard_uuid(text)).version == 5
    assert standard_uuid(text) != standard_uuid("ISO 4762 M4×20")


def test_one_article_under_two_standards() -> None:
    """Only of one size."""
    assert same_articles(["DIN 934 M4", "ISO 4032 M4", "ISO 4032 M5", "DIN 933 M4×16"]) == [
        ("DIN 934 M4", "ISO 4032 M4")
    ]
