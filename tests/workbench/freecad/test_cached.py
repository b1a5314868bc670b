# SPDX-License-Identifier: LGPL-2.1-or-later
"""Documents through the cache: the same BOM, with each fact asked of FreeCAD once."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc, ForwardingLink, Obj

from silo.bom.walk.links import extract
from silo.workbench.freecad.cached import CachedDocument, FactCache


class Asked(Obj):
    """An object that counts what is read from it."""

    def __getattribute__(self, name: str) -> Any:
        if not name.startswith("__") and name != "Document":
            counts = object.__getattribute__(self, "__dict__").setdefault("_counts", {})
            counts[name] = counts.get(name, 0) + 1
        return object.__getattribute__(self, name)


def cached_document(document: Doc) -> CachedDocument:
    return FactCache(lambda value: isinstance(value, Obj)).document(document)


def gearbox() -> Doc:
    """Links that forward to their targets as live ones do, an array, and a link by sub-name."""
    bolt = Doc("/v/Bolt.FCStd", meta={"SiloUUID": "bolt-id"})
    body = bolt.body(SiloUUID="body-id")
    sub = Doc("/v/Sub.FCStd", meta={"SiloUUID": "sub-id"})
    inner = sub.assembly(sub.array("B", body, 4))
    top = Doc("/v/Top.FCStd", meta={"SiloUUID": "top-id"})
    links = [ForwardingLink(top, f"L{number}", body) for number in range(3)]
    pair = top.link("P", (inner, "B.1."))
    top.assembly(*links, ForwardingLink(top, "S", inner), pair)
    return top


def test_the_bom_is_the_same() -> None:
    """Entries, counts, places and findings, whichever way they are read."""
    top = gearbox()
    straight = extract(top.getObject("Assembly"))
    cached = extract(cached_document(top).getObject("Assembly"))
    assert cached == straight
    assert {e.silo_uuid: e.quantity for e in cached.entries} == {"body-id": 4, "sub-id": 1}


def test_a_fact_is_asked_once() -> None:
    """Also where a walk asks again and again."""
    top = Doc("/v/Top.FCStd")
    real = Asked(top, "PartDesign::Body", "Body")
    cached = cached_document(top).getObject("Body")
    assert cached is not None
    before = dict(real._counts)
    assert [cached.Label for _ in range(5)] == ["Body"] * 5
    assert real._counts["Label"] - before.get("Label", 0) == 1


def test_what_a_link_lacks_is_not_its_targets() -> None:
    """A live link would answer with the target's attribute; from the cache it has none."""
    top = gearbox()
    assert top.getObject("L0").SiloUUID == "body-id"
    cached = cached_document(top).getObject("L0")
    with pytest.raises(AttributeError, match="SiloUUID"):
        _ = cached.SiloUUID  # type: ignore[union-attr]


def test_the_same_object_is_the_same_view() -> None:
    """Whether it is found by name, in a list or as a target: walkers compare by identity."""
    cached = cached_document(gearbox())
    group = cached.getObject("Assembly").Group  # type: ignore[union-attr]
    assert group[0] is cached.getObject("L0")
    assert group[0].LinkedObject is group[1].LinkedObject
    assert group[-1].LinkedObject[0] is group[-2].LinkedObject
    assert group[0].Document is cached
