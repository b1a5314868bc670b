# SPDX-License-Identifier: LGPL-2.1-or-later
"""The end of somebody else's commit is seen, whichever way it was started, and seen once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from silo.workbench.freecad.hooks import CommitHook


class Signal:
    """Qt's signal, as far as it is needed."""

    def __init__(self) -> None:
        self.slots: list[Callable[..., None]] = []

    def connect(self, slot: Callable[..., None]) -> None:
        self.slots.append(slot)

    def emit(self) -> None:
        for slot in self.slots:
            slot(False)


class Action:
    def __init__(self) -> None:
        self.triggered = Signal()


class Doc:
    def __init__(self, name: str) -> None:
        self.Name, self.FileName = name, f"/v/{name}.FCStd"


class Origin:
    """A fork's origin, in Python."""

    def __init__(self, answer: Any = True) -> None:
        self.answer = answer
        self.committed: list[str] = []

    def commitDocument(self, doc: Doc) -> Any:
        self.committed.append(doc.Name)
        return self.answer


class Fork:
    """A FreeCAD with a commit of its own; ``run`` lets the time pass that the hook waits."""

    def __init__(self) -> None:
        self.docs = [Doc("Top"), Doc("Part")]
        self.active: Doc | None = self.docs[0]
        self.actions: list[Action] = []
        self.origin: Any = None
        self.observers: list[Any] = []
        self.ended: list[str] = []
        self.known = {"Top"}
        self._waiting: list[Callable[[], None]] = []
        self.hook = CommitHook(
            self,
            ended=lambda doc: self.ended.append(doc.Name),
            has_identity=lambda doc: doc.Name in self.known,
            later=lambda _ms, call: self._waiting.append(call),
        )
        self.hook.watch("Origin_Commit")
        self.hook.connect()

    def run(self) -> list[str]:
        while self._waiting:
            self._waiting.pop(0)()
        return self.ended

    def save(self, name: str, filename: str = "") -> None:
        doc = next(doc for doc in self.docs if doc.Name == name)
        for observer in self.observers:
            observer.slotFinishSaveDocument(doc, filename or doc.FileName)

    def command_actions(self, _name: str, /) -> list[Action]:
        return self.actions

    def active_document(self) -> Doc | None:
        return self.active

    def documents(self) -> list[Doc]:
        return self.docs

    def origin_of(self, _doc: Any, /) -> Any:
        return self.origin

    def add_document_observer(self, observer: Any, /) -> None:
        self.observers.append(observer)


@pytest.fixture(name="fork")
def _fork() -> Fork:
    return Fork()


def test_a_menu_is_seen_although_freecad_makes_its_action_late(fork: Fork) -> None:
    """The action is there once a workbench shows the command; connecting twice does not double anything."""
    fork.actions = [Action()]
    fork.hook.connect()
    fork.hook.connect("PartWorkbench")
    assert len(fork.actions[0].triggered.slots) == 1
    fork.actions[0].triggered.emit()
    assert fork.run() == ["Top"]


def test_without_a_document_there_is_nothing_to_see(fork: Fork) -> None:
    """The command may be pressed anyway."""
    fork.actions = [Action()]
    fork.hook.connect()
    fork.active = None
    fork.actions[0].triggered.emit()
    assert fork.run() == []


def test_a_save_counts_for_documents_of_silo(fork: Fork) -> None:
    """A macro commits without an action; people save much that is not Silo's."""
    fork.save("Top")
    fork.save("Part")
    assert fork.run() == ["Top"]


def test_a_saved_copy_is_no_commit(fork: Fork) -> None:
    """FreeCAD reports the same, with another file's name."""
    fork.save("Top", "/backup/Top.FCStd")
    assert fork.run() == []


def test_action_save_and_origin_are_one_commit(fork: Fork) -> None:
    """A commit by the menu saves, and asks the origin as well."""
    fork.actions, fork.origin = [Action()], Origin()
    fork.hook.connect()
    fork.save("Top")
    fork.origin.commitDocument(fork.docs[0])
    fork.actions[0].triggered.emit()
    assert fork.run() == ["Top"]


def test_an_origin_is_reported_and_not_changed(fork: Fork) -> None:
    """It gets what it was asked, its answer is given back, and it is wrapped once."""
    fork.origin = origin = Origin(answer="done")
    fork.hook.connect()
    wrapped = origin.commitDocument
    fork.hook.connect()
    assert origin.commitDocument is wrapped
    assert origin.commitDocument(fork.docs[1]) == "done"
    assert origin.committed == ["Part"]
    assert fork.run() == ["Part"]


def test_a_commit_that_the_origin_refuses_is_none(fork: Fork) -> None:
    """False means that nothing was committed."""
    fork.origin = Origin(answer=False)
    fork.hook.connect()
    fork.origin.commitDocument(fork.docs[1])
    assert fork.run() == []


def test_an_origin_that_comes_with_a_later_document_is_found(fork: Fork) -> None:
    """Without a change of the workbench."""
    fork.origin = Origin()
    for observer in fork.observers:
        observer.slotActivateDocument(fork.docs[1])
    fork.run()
    fork.origin.commitDocument(fork.docs[1])
    assert fork.run() == ["Part"]


def test_an_origin_that_takes_no_attributes_is_left_alone(fork: Fork) -> None:
    """One of C++; its command shows it."""

    class Fixed:
        __slots__ = ()

        def commitDocument(self, _doc: Any) -> bool:
            return True

    fork.origin = Fixed()
    fork.hook.connect()
    assert fork.origin.commitDocument(fork.docs[0])
    assert fork.run() == []


def test_a_document_that_is_closed_meanwhile_is_forgotten(fork: Fork) -> None:
    """Nothing dead is touched."""
    fork.save("Top")
    fork.docs.pop(0)
    assert fork.run() == []
