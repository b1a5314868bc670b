# SPDX-License-Identifier: LGPL-2.1-or-later
"""Registering from the command to the server, without FreeCAD and Qt."""

from __future__ import annotations

from pathlib import Path

import pytest
from desk import Document, Office, RegisterWindow

from silo.bom.errors import ReadOnlyError, SiloError
from silo.registering.journal import Journal
from silo.registering.request import RegistrationRequest
from silo.workbench.activity.box import Action, Do, EntryLine, PaneEntry
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.register.flow import RegisterFlow
from silo.workbench.tone import Tone


@pytest.fixture(name="flow")
def _flow(office: Office) -> RegisterFlow:
    commits = CommitFlow(office.session, office.preferences, office.desk, path=office.folder / "same.json")
    journal = Journal(office.folder / "journal")
    return RegisterFlow(office.session, office.preferences, commits, office.desk, journal=journal)


@pytest.fixture(name="top")
def _top(office: Office) -> Document:
    """An assembly with a number, of two parts without."""
    top = office.document("Top")
    for name in ("Shaft", "Plate"):
        doc = office.document(name, name.encode(), registered=False)
        office.desk.documents.save(doc)
        top.parts[doc] = 2
    office.desk.documents.save(top)
    return top


def opened(office: Office, flow: RegisterFlow, doc: Document) -> RegisterWindow:
    """The dialog of a document, with its rows."""
    flow.start(doc)
    office.settle()
    (window,) = office.desk.registers
    return window


def register(office: Office, window: RegisterWindow) -> None:
    """Register all that is offered, as a part each."""
    window.register(
        [RegistrationRequest(c, c.proposal.name, "part", "M01") for c in window.offers[-1].candidates]
    )
    office.settle()


def test_from_the_offer_to_the_bom(office: Office, flow: RegisterFlow, top: Document) -> None:
    """Items, identities in the files, the files in Silo, and the assembly's BOM; older boxes do not ask any
    more about what is a part of its own now."""
    plate = next(part.FileName for part in top.parts if part.Label == "Plate")
    for key, file in (("asked", plate), ("other", "/v/b")):
        same = Action(Do.SAME, "Same part", "id", objects=(file, "/v/a"))
        office.session.add(PaneEntry(key, "x", 1.0, lines=(EntryLine("2 files", Tone.WARNING, (same,)),)))
    window = opened(office, flow, top)
    assert sorted(c.proposal.name for c in window.offers[0].candidates) == ["Plate", "Shaft"]
    register(office, window)
    assert [result.error for result in window.results] == [None, None]
    assert window.stops == 1
    assert office.files("Plate") == [b"Plate"]
    assert {line.child_name: line.quantity for line in office.silo.get_bom("M01-0001")} == {
        "Plate": 2,
        "Shaft": 2,
    }
    assert all(doc.identity for doc in top.parts)
    assert "M01" in window.numbers
    boxes = {box.key: box for box in office.session.shown.activity.entries}
    assert not boxes["asked"].lines[0].actions
    assert boxes["other"].lines[0].actions


def test_one_undo_takes_back_what_was_registered(office: Office, flow: RegisterFlow, top: Document) -> None:
    """New items are archived, the files forget them, and the assembly's BOM waits for nobody."""
    window = opened(office, flow, top)
    assert not flow.can_take_back(window.path)
    register(office, window)
    numbers = [result.part_number or "" for result in window.results]
    assert flow.can_take_back(window.path)
    flow.take_back(window.path)
    office.settle()
    assert [error for _, error in window.back] == [None, None]
    assert [doc.identity for doc in top.parts] == ["", ""]
    assert not {item.part_number for item in office.silo.search_items("")} & set(numbers)
    assert not flow.can_take_back(window.path)
    assert not flow._journal.item_ids()
    register(office, window)  # and they can be registered again
    assert [result.error for result in window.results] == [None] * 4
    assert len({result.item_id for result in window.results}) == 4


def test_what_waits_of_an_item_that_goes_is_discarded(
    office: Office, flow: RegisterFlow, top: Document
) -> None:
    """Its file would be refused for ever."""
    window = opened(office, flow, top)

    def refuse(name: str) -> None:
        if name == "upload_file":
            raise ReadOnlyError("maintenance")

    office.silo.before = refuse
    register(office, window)
    assert {Path(entry.path).stem for entry in office.session.shown.waiting} >= {"Plate", "Shaft"}
    flow.take_back(window.path)
    office.settle()
    assert not {Path(entry.path).stem for entry in office.session.shown.waiting} & {"Plate", "Shaft"}


def test_what_cannot_be_taken_back_is_said_and_stays(
    office: Office, flow: RegisterFlow, top: Document
) -> None:
    """A file that cannot be written keeps its item."""
    window = opened(office, flow, top)
    register(office, window)
    office.desk.refusal = SiloError("the disk is full")
    flow.take_back(window.path)
    office.settle()
    assert {str(error) for _, error in window.back} == {"the disk is full"}
    found = {item.part_number for item in office.silo.search_items("")}
    assert {result.part_number for result in window.results} <= found


def test_no_unsaved_edits_are_left(office: Office, flow: RegisterFlow, top: Document) -> None:
    """What FreeCAD marks because its parts were saved is saved too, after them; a person's edits are not."""
    edited = office.document("Edited")
    edited.parts.update(top.parts)
    register(office, opened(office, flow, top))
    assert not top.changed
    assert office.desk.documents.saved[-1] == "Top"
    assert edited.changed
    assert "Edited" not in office.desk.documents.saved


def test_a_server_that_refuses_leaves_the_files_alone(
    office: Office, flow: RegisterFlow, top: Document
) -> None:
    """And the dialog shows why, row by row."""
    window = opened(office, flow, top)

    def refuse(name: str) -> None:
        if name == "create_item":
            raise ReadOnlyError("maintenance")

    office.silo.before = refuse
    register(office, window)
    assert {type(result.error) for result in window.results} == {ReadOnlyError}
    assert [doc.identity for doc in top.parts] == ["", ""]
    assert [Path(doc.FileName).read_bytes() for doc in top.parts] == [b"Shaft", b"Plate"]


def test_a_dialog_that_was_closed_meanwhile_is_not_drawn(
    office: Office, flow: RegisterFlow, top: Document
) -> None:
    """What it had asked for is done anyway."""
    window = opened(office, flow, top)
    window.register(
        [RegistrationRequest(c, c.proposal.name, "part", "M01") for c in window.offers[-1].candidates]
    )
    window.flow.closed(window.path)
    office.settle()
    assert (window.results, window.stops) == ([], 0)
    assert all(doc.identity for doc in top.parts)


def test_what_cannot_be_read_is_said(office: Office, flow: RegisterFlow, top: Document) -> None:
    """No dialog comes up."""

    def fail(_doc: object) -> None:
        raise SiloError("several assemblies")

    office.desk.snapshot = fail  # type: ignore[method-assign, assignment]
    flow.start(top)
    assert (office.desk.warned, office.desk.registers) == (["several assemblies"], [])
