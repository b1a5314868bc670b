# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a commit saves, in which order, and what it leaves alone."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import DocumentError
from silo.workbench.commit.plan import CommitPlan, DocumentRow, DocumentState, plan
from silo.workbench.commit.take import CommittedDocument, take_each
from silo.workbench.documents.opened import DocumentOrigin
from silo.workbench.documents.order import leaves_first
from silo.workbench.documents.snapshot import Snapshot


class Doc:
    """A document with FreeCAD's names, and what a commit asks of it."""

    def __init__(self, name: str, *below: Doc, path: str | None = None, **marks: bool) -> None:
        self.Name = self.Label = name
        self.FileName = f"/v/{name}.FCStd" if path is None else path
        self.OutList = list(below)
        self.marks = marks


class Documents:
    """FreeCAD's documents: ``changed``, ``partial``, ``fixed`` (read-only) and ``newer`` are their marks."""

    def __init__(self) -> None:
        self.saved: list[str] = []

    def base(self, doc: Any, /) -> DocumentOrigin:
        return DocumentOrigin(doc.FileName, None)

    def linked(self, doc: Any, /) -> list[Any]:
        found, left = {doc.Name: doc}, [doc]
        while left:
            for below in left.pop().OutList:
                if below.Name not in found:
                    found[below.Name] = below
                    left.append(below)
        return list(found.values())

    def is_modified(self, doc: Any, /) -> bool:
        return bool(doc.marks.get("changed"))

    def is_edited(self, doc: Any, _until: float, /) -> bool:
        return not doc.marks.get("recomputed")

    def is_partial(self, doc: Any, /) -> bool:
        return bool(doc.marks.get("partial"))

    def is_writable(self, path: str, /) -> bool:
        return "fixed" not in path

    def lost_objects(self, doc: Any, /) -> list[str]:
        return ["Assembly"] if doc.marks.get("newer") else []

    def is_damaged(self, doc: Any, /) -> bool:
        return bool(doc.marks.get("damaged"))

    def save(self, doc: Any, /) -> None:
        if doc.marks.get("full_disk"):
            raise DocumentError(doc.FileName, "the disk is full")
        self.saved.append(doc.Name)
        doc.marks["changed"] = False


def names(planned: CommitPlan) -> list[str]:
    return [row.label for row in planned.rows]


def test_changed_documents_come_leaves_first_and_the_asked_one_last() -> None:
    """Spec, design decision 3: each parent refers to children that are committed already."""
    leaf = Doc("Leaf", changed=True)
    sub = Doc("Sub", leaf, changed=True)
    deep = Doc("Deep", changed=True)
    top = Doc("Top", Doc("Untouched", Doc("Lower", deep)), sub, leaf, changed=True)
    deep.OutList.append(top)  # a ring
    planned = plan(top, Documents())
    assert names(planned) == ["Deep", "Leaf", "Sub", "Top"]
    assert [row.is_top for row in planned.rows] == [False] * 3 + [True]


def test_what_was_only_recomputed_is_listed_and_not_wanted() -> None:
    """A recompute marks a whole project; what cannot be saved anyway is not even listed."""
    leaf = Doc("Leaf", changed=True, recomputed=True)
    edited = Doc("Edited", changed=True)
    half = Doc("Half", changed=True, recomputed=True, partial=True)
    planned = plan(Doc("Top", leaf, edited, half, changed=True, recomputed=True), Documents())
    assert names(planned) == ["Leaf", "Edited", "Top"]
    assert [row.label for row in planned.wanted] == ["Edited", "Top"]
    assert not planned.is_simple
    assert plan(Doc("Top", leaf), Documents()).is_simple


def test_an_unregistered_one_is_asked_about() -> None:
    """Whether to register it as well."""
    assert not plan(Doc("Top"), Documents(), unregistered=True).is_simple


@pytest.mark.parametrize(
    ("doc", "state", "can_commit"),
    [
        (Doc("T", changed=True), DocumentState.CHANGED, True),
        (Doc("T"), DocumentState.SAVED, True),
        (Doc("T", path=""), DocumentState.UNNAMED, False),
        (Doc("T", changed=True, partial=True), DocumentState.PARTIAL, False),
        (Doc("T", partial=True), DocumentState.SAVED, True),
        (Doc("fixed", changed=True), DocumentState.READ_ONLY, False),
        (Doc("fixed"), DocumentState.SAVED, True),
        (Doc("T", changed=True, newer=True), DocumentState.LOST, False),
        (Doc("T", changed=True, recomputed=True), DocumentState.RECOMPUTED, True),
        (Doc("T", changed=True, recomputed=True, partial=True), DocumentState.SAVED, True),
        (Doc("fixed", changed=True, recomputed=True), DocumentState.SAVED, True),
        (Doc("T", newer=True), DocumentState.SAVED, True),
        (Doc("T", damaged=True), DocumentState.DAMAGED, False),
        (Doc("T", damaged=True, changed=True), DocumentState.DAMAGED, False),
    ],
    ids=lambda value: value.Name if isinstance(value, Doc) else str(value),
)
def test_states(doc: Doc, state: DocumentState, can_commit: bool) -> None:
    """What cannot be saved whole is never saved; what needs no saving is sent as it is."""
    (row,) = plan(doc, Documents()).rows
    assert (row.state, row.can_commit) == (state, can_commit)
    assert row.note


def test_what_saving_would_destroy_is_named() -> None:
    """A person has to know what is at stake, and where these edits can be made."""
    (row,) = plan(Doc("T", changed=True, newer=True), Documents()).rows
    assert "would destroy Assembly" in row.note
    assert "newer FreeCAD" in row.note


class Outbox:
    """Keeps nothing."""

    def hold(self, _path: str, key: str, /) -> Path | None:
        return Path("/held") / key

    def keep_aside(self, _path: str, /) -> Path | None:
        return None


def taken(rows: Iterable[DocumentRow], documents: Documents, *, unknown: str = "") -> list[CommittedDocument]:
    def take(doc: Any) -> Snapshot:
        return Snapshot(doc.FileName, doc.Label, None if doc.Name == unknown else f"{doc.Name}-id")

    return list(take_each(rows, documents, take, Outbox()))


def test_each_is_saved_then_taken() -> None:
    """In the order of the plan, also what was only recomputed; what is saved already is not saved again."""
    documents = Documents()
    top = Doc("Top", Doc("Sub", changed=True, recomputed=True), changed=True)
    sub, whole = taken(plan(top, documents).rows, documents)
    assert documents.saved == ["Sub", "Top"]
    assert [one.snapshot and one.snapshot.identity for one in (sub, whole)] == ["Sub-id", "Top-id"]
    assert [one.held for one in (sub, whole)] == [Path("/held") / sub.key, Path("/held") / whole.key]
    assert sub.key != whole.key
    taken(plan(Doc("Saved"), documents).rows, documents)
    assert documents.saved == ["Sub", "Top"]


def test_a_failure_does_not_stop_the_others() -> None:
    """And nothing of the failed one is sent."""
    documents = Documents()
    top = Doc("Top", Doc("Sub", changed=True, full_disk=True), changed=True)
    first, second = taken(plan(top, documents).rows, documents)
    assert isinstance(first.error, DocumentError)
    assert first.snapshot is None
    assert second.error is None
    assert documents.saved == ["Top"]


def test_a_document_that_was_saved_as_another_file_is_not_sent() -> None:
    """Its old file and its new BOM are two things; neither file is written nor sent."""
    documents, doc = Documents(), Doc("Top", changed=True)
    planned = plan(doc, documents)
    doc.FileName = "/v/Variant.FCStd"
    (one,) = taken(planned.rows, documents)
    assert "under another name" in str(one.error)
    assert (one.snapshot, documents.saved) == (None, [])


def test_a_document_without_identity_is_not_held() -> None:
    """There is nothing to send it to, so no copy is kept."""
    documents = Documents()
    (one,) = taken(plan(Doc("Top", changed=True), documents).rows, documents, unknown="Top")
    assert one.held is None
    assert documents.saved == ["Top"]


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=30))
def test_order_of_any_web_of_documents(links: list[tuple[int, int]]) -> None:
    """Each reachable document once, the top last; and below before above wherever there is no ring."""
    docs = [Doc(str(i)) for i in range(8)]
    for above, below in links:
        docs[above].OutList.append(docs[below])
    order = [doc.Name for doc in leaves_first(docs[0])]
    reach = {name: {doc.Name for doc in leaves_first(docs[int(name)])} for name in order}
    assert len(order) == len(set(order))
    assert set(order) == reach["0"]
    assert order[-1] == "0"
    for above in order:
        for below in (doc.Name for doc in docs[int(above)].OutList):
            if above not in reach[below]:
                assert order.index(below) < order.index(above)
