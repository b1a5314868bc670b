# SPDX-License-Identifier: LGPL-2.1-or-later
"""The public surface as somebody uses it who read the spec and nothing else: plain objects, lists, dicts."""

from __future__ import annotations

from types import SimpleNamespace as Plain
from typing import Any

import pytest

import silo.bom_sync
from silo.bom import BomDiff, BomEntry, diff_bom, extract_bom_links, resolve_part_numbers


def document(path: str, uuid: str | None = None) -> Any:
    """What the spec's listing asks of a document."""
    return Plain(FileName=path, getPropertyByName=lambda name: uuid if name == "SiloUUID" else None)


def link(target: Any, count: int = 0) -> Any:
    """What the listing asks of a member of a Group."""
    return Plain(isDerivedFrom=lambda name: name == "App::Link", LinkedObject=target, ElementCount=count)


def assembly(doc: Any, *members: Any) -> Any:
    """A container that says nothing but what it holds."""
    return Plain(Document=doc, Group=list(members), isDerivedFrom=lambda name: name == "App::Part")


def entry(**values: Any) -> BomEntry:
    """The dataclass of spec §3, all fields given."""
    given = {
        "doc_path": "/v/part.FCStd",
        "silo_uuid": None,
        "part_number": None,
        "name": None,
        "quantity": 1,
        "level": 1,
        "children": [],
        "consolidation_warning": False,
    }
    return BomEntry(**{**given, **values})


def test_a_walk_gives_the_entries_that_the_listing_builds() -> None:
    """Compared with entries made from the spec's fields alone, lists for children."""
    plate, gear = Plain(Document=document("/v/plate.FCStd", "u-p")), Plain(Document=document("/v/gear.FCStd"))
    box = assembly(document("/v/box.FCStd", "u-b"), link(gear, 4))
    top = document("/v/top.FCStd")
    asm = assembly(top, link(plate), link(plate, 3), link(box), link(None), link(Plain(Document=top)))
    assert extract_bom_links(asm) == [
        entry(doc_path="/v/plate.FCStd", silo_uuid="u-p", quantity=4, consolidation_warning=True),
        entry(
            doc_path="/v/box.FCStd",
            silo_uuid="u-b",
            children=[entry(doc_path="/v/gear.FCStd", quantity=4, level=2)],
        ),
    ]


def test_no_children_equal_an_empty_list() -> None:
    """``children == []`` and ``added == []`` are what the spec's listings lead to write."""
    assert entry().children == []
    assert [] == entry().children  # noqa: SIM300
    assert entry().children != [entry()]
    assert BomDiff().added == []
    assert BomDiff().added == ()
    assert hash(entry(children=[entry()])) == hash(entry(children=(entry(),)))


def test_documents_that_hold_their_objects_can_be_compared() -> None:
    """Plain objects compare by value; documents that know their objects would do so forever."""

    def known(path: str) -> Any:
        part = Plain(Name="Part")
        part.Document = Plain(Objects=[part], **vars(document(path)))
        return part

    asm = assembly(known("/v/top.FCStd").Document, link(known("/v/part.FCStd")))
    assert len(extract_bom_links(asm)) == 1


def test_links_made_one_by_one_to_one_file_are_one_line() -> None:
    """Each link with a document object and a part object of its own: the file says that they are the same."""
    asm = assembly(
        document("/v/top.FCStd"), *(link(Plain(Document=document("/v/bolt.FCStd"))) for _ in range(3))
    )
    [line] = extract_bom_links(asm)
    assert (line.quantity, line.consolidation_warning) == (3, True)


ITEMS = {"u-1": {"part_number": "PRT-1", "name": "Plate"}, "u-2": {"part_number": "ASM-1", "name": "Box"}}
BATCHES = {
    "found only": lambda uuids: {u: ITEMS[u] for u in uuids if u in ITEMS},
    "none for the others": lambda uuids: {u: ITEMS.get(u) for u in uuids},
    "items with id": lambda uuids: [{"id": u, **ITEMS[u]} for u in uuids if u in ITEMS],
    "items with uuid": lambda uuids: [{"uuid": u, **ITEMS[u]} for u in uuids if u in ITEMS],
}


@pytest.mark.parametrize("batch", [None, *BATCHES], ids=str)
def test_a_client_needs_one_method_and_may_have_the_other(batch: str | None) -> None:
    """Whatever form the answer of the batch has, the same entries get the same numbers."""
    client = Plain(get_item_by_uuid=ITEMS.get)
    if batch is not None:
        client.get_items_by_uuid = BATCHES[batch]
    below = [entry(silo_uuid="u-1", level=2), entry(doc_path="/v/new.FCStd", silo_uuid="u-9", level=2)]
    entries = [entry(doc_path="/v/box.FCStd", silo_uuid="u-2", children=below)]
    resolved, unresolved = resolve_part_numbers(entries, client)
    assert [(e.part_number, e.name) for e in resolved] == [("ASM-1", "Box")]
    assert [e.part_number for e in resolved[0].children] == ["PRT-1"]
    assert [e.doc_path for e in unresolved] == ["/v/new.FCStd"]
    assert below[0].part_number is None, "values are frozen; new ones are given"


def test_anything_with_a_number_and_a_quantity_can_be_compared() -> None:
    """Entries of a caller's own, and mappings."""
    remote = [{"child_part_number": "A", "quantity": 4}]
    for local in (Plain(part_number="A", quantity=4), {"child_part_number": "A", "quantity": 4}):
        assert diff_bom([local], remote).unchanged == [{"part_number": "A", "quantity": 4}]


def test_the_names_of_the_spec_are_where_the_spec_has_them() -> None:
    """``bom_sync`` is "assembly walker, quantity counter, UUID resolver" (spec §7)."""
    for name in ("BomEntry", "BomDiff", "extract_bom_links", "resolve_part_numbers", "diff_bom"):
        assert getattr(silo.bom_sync, name) is getattr(silo.bom, name)


def test_the_client_is_found_in_its_package() -> None:
    """Late, since importing it loads requests and pydantic."""
    from silo.api import SiloClient
    from silo.api.client import SiloClient as Same

    assert SiloClient is Same
    with pytest.raises(ImportError):
        from silo.api import NoSuchName  # type: ignore[attr-defined] # noqa: F401
