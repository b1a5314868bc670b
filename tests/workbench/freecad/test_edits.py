# SPDX-License-Identifier: LGPL-2.1-or-later
"""What counts as an edit, on values as FreeCAD hands them out."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from silo.workbench.freecad.edits import EditWatch, same


@dataclass
class Owner:
    """A document, or an object of one."""

    Name: str
    values: dict[str, Any] = field(default_factory=dict)
    Document: Any = None
    Restoring: bool = False
    FileName: str = "/v/doc.FCStd"
    TypeId: str = "Part::Box"
    transient: tuple[str, ...] = ()
    objects: dict[str, Owner] = field(default_factory=dict)

    @property
    def PropertiesList(self) -> list[str]:
        return list(self.values)

    def getPropertyByName(self, name: str) -> Any:
        return self.values[name]

    def getTypeIdOfProperty(self, _name: str) -> str:
        return "App::PropertyFloat"

    def getTypeOfProperty(self, name: str) -> list[str]:
        return ["Transient"] if name in self.transient else []

    def getObject(self, name: str) -> Owner | None:
        return self.objects.get(name)


@pytest.fixture(name="watch")
def _watch() -> EditWatch:
    return EditWatch()


@pytest.fixture(name="box")
def _box(watch: EditWatch) -> Owner:
    doc = Document()
    watch.slotCreatedDocument(doc)
    return doc.objects["Box"]


def Document() -> Owner:
    doc = Owner("Doc")
    # An object of a document has no such thing, which distinguishes the two.
    doc.objects["Box"] = Owner("Box", {"Length": 1.0}, doc)
    doc.Document = doc
    return doc


def put(watch: EditWatch, obj: Owner, name: str, value: Any) -> None:
    watch.slotBeforeChangeObject(obj, name)
    obj.values[name] = value


def test_the_same_value_again_is_no_edit(watch: EditWatch, box: Owner) -> None:
    """And the first value counts, not the last but one."""
    put(watch, box, "Length", 1.0)
    assert not watch.is_edited(box.Document)
    put(watch, box, "Length", 2.0)
    put(watch, box, "Length", 2.0)
    assert list(watch.differences(box.Document)) == ["Box.Length"]
    put(watch, box, "Length", 1.0)
    assert not watch.is_edited(box.Document)


def test_opening_is_no_edit(watch: EditWatch, box: Owner) -> None:
    """What FreeCAD sets while it reads the file, also what came just before."""
    put(watch, box, "Length", 3.0)
    box.Document.Restoring = True
    put(watch, box, "Width", 4.0)
    box.Document.Restoring = False
    assert not watch.is_edited(box.Document)


def test_a_document_that_nobody_watched_counts_as_edited(box: Owner) -> None:
    """Better one file too many than an edit that is left out."""
    assert EditWatch().is_edited(box.Document)


def test_without_time_it_counts_as_edited(watch: EditWatch, box: Owner) -> None:
    """The window is not held up."""
    put(watch, box, "Length", 1.0)
    assert watch.is_edited(box.Document, until=0.0)


def test_objects_come_and_go(watch: EditWatch, box: Owner) -> None:
    """A new one that goes again is none; an array's elements may be made again."""
    made = Owner("More", {}, box.Document)
    watch.slotCreatedObject(made)
    assert watch.is_edited(box.Document)
    watch.slotDeletedObject(made)
    assert not watch.is_edited(box.Document)
    element = Owner("L_i0", {}, box.Document, TypeId="App::LinkElement")
    watch.slotDeletedObject(element)
    assert watch.is_edited(box.Document)
    watch.slotCreatedObject(element)
    assert not watch.is_edited(box.Document)


def test_saving_ends_it_and_a_copy_does_not(watch: EditWatch, box: Owner) -> None:
    """By the name of the file."""
    put(watch, box, "Length", 2.0)
    watch.slotFinishSaveDocument(box.Document, "/v/copy.FCStd")
    assert watch.is_edited(box.Document)
    watch.slotFinishSaveDocument(box.Document, "/v/doc.FCStd")
    assert not watch.is_edited(box.Document)


def test_what_is_not_saved_is_no_edit(watch: EditWatch, box: Owner) -> None:
    """A property that FreeCAD does not write; one that is new and written is an edit."""
    box.transient = ("Shown",)
    for name in ("Shown", "Finish"):
        watch.slotAppendDynamicProperty(box, name)
        box.values[name] = "x"
    # What a view has is no edit; the document of views has no name.
    view = SimpleNamespace(Document=SimpleNamespace(Document=box.Document))
    watch.slotAppendDynamicProperty(view, "Proxy")
    watch.slotRemoveDynamicProperty(view, "Proxy")
    assert list(watch.differences(box.Document)) == ["Box.Finish"]


def test_a_value_that_cannot_be_compared_is_an_edit(watch: EditWatch, box: Owner) -> None:
    """Whatever it raises."""

    class Odd:
        def __eq__(self, _other: object) -> bool:
            raise TypeError("no")

        __hash__ = None  # type: ignore[assignment]

    box.values["Length"] = Odd()
    put(watch, box, "Length", Odd())
    assert watch.is_edited(box.Document)


@pytest.mark.parametrize(
    ("old", "new", "equal"),
    [
        (1.0, 1.0 + 1e-12, True),
        (1.0, 1.001, False),
        (1, True, False),
        ("a", "a", True),
        ([1.0, "x"], [1.0, "x"], True),
        ([1.0], [1.0, 2.0], False),
        (None, [], False),
        (("a", 2), ("a", 3), False),
    ],
)
def test_plain_values(old: Any, new: Any, equal: bool) -> None:
    """Numbers within FreeCAD's own tolerance."""
    assert same(old, new) is equal
