# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases of identity: where a Silo UUID stands, and what it means to find one twice."""

from __future__ import annotations

from freecad_cases.bench import Bench, case

UUID_1 = "11111111-2222-4333-8444-555555555555"
UUID_2 = "22222222-3333-4444-8555-666666666666"
UUID_3 = "33333333-4444-4555-8666-777777777777"


@case()
def identity_in_meta(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    bolt.Document.Meta = {"SiloUUID": UUID_1, "Author": "designer"}
    b.link(top, bolt)


@case(since=(0, 21))
def identity_in_document_property(b: Bench) -> None:
    """FreeCAD 0.20 cannot write such a property, but reads it from a newer file."""
    bolt, top = b.part("bolt.FCStd"), b.container()
    bolt.Document.addProperty("App::PropertyString", "SiloUUID", "Silo", "")
    bolt.Document.SiloUUID = UUID_1
    b.link(top, bolt)


@case()
def identity_of_objects(b: Bench) -> None:
    """An object's own identity comes before its document's; the link's own is not its target's."""
    left, top = b.part("pair.FCStd", "Left"), b.container()
    right = b.box(left.Document, "Right")
    left.Document.Meta = {"SiloUUID": UUID_1, "SiloUUID/Right": UUID_2}
    left.addProperty("App::PropertyString", "SiloItemId", "Silo")
    left.SiloItemId = UUID_3
    link = b.link(top, left, "LeftLink")
    link.addProperty("App::PropertyString", "SiloUUID", "Silo")
    link.SiloUUID = "99999999-9999-4999-8999-999999999999"
    b.link(top, right, "RightLink")


@case()
def copied_identity(b: Bench) -> None:
    top = b.container()
    for name in ("one", "two"):
        part = b.part(f"{name}.FCStd", "Part")
        part.Document.Meta = {"SiloUUID": UUID_1}
        b.link(top, part, name.title())


@case()
def shared_identity(b: Bench) -> None:
    left, top = b.part("pair.FCStd", "Left"), b.container()
    right = b.box(left.Document, "Right")
    left.Document.Meta = {"SiloUUID": UUID_1}
    b.link(top, left, "LeftLink")
    b.link(top, right, "RightLink")
