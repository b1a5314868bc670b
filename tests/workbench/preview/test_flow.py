# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview from the command to the sync, without FreeCAD and Qt."""

from __future__ import annotations

import pytest
from desk import Document, Office

from silo.bom.errors import UnreachableError
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.preview.flow import PreviewFlow


@pytest.fixture(name="flow")
def _flow(office: Office) -> PreviewFlow:
    commits = CommitFlow(office.session, office.preferences, office.desk, path=office.folder / "same.json")
    return PreviewFlow(
        office.session,
        commits,
        office.desk,
        register=lambda _path: None,
        show=lambda _path, _names: None,
        view=lambda _url: None,
    )


@pytest.fixture(name="top")
def _top(office: Office) -> Document:
    top = office.document("Top")
    top.parts[office.document("Plate")] = 3
    return top


def test_compare_sync_and_compare_again(office: Office, flow: PreviewFlow, top: Document) -> None:
    """What would be added is added; the file is not sent."""
    flow.start(top)
    office.settle()
    (window,) = office.desk.previews
    assert [line.part_number for line in window.filled[0].top.diff.added] == ["M01-0002"]
    window.wishes.sync(window.filled[0], False, False)
    office.settle()
    assert [line.quantity for line in office.silo.get_bom("M01-0001")] == [3]
    assert office.files("Top") == []
    flow.again(top.FileName)
    office.settle()
    assert not window.filled[1].top.diff.drifted


def test_one_window_per_document(office: Office, flow: PreviewFlow, top: Document) -> None:
    """It comes to the front; closed, a new one is opened."""
    flow.start(top)
    flow.start(top)
    office.settle()
    (window,) = office.desk.previews
    assert window.raised == 1
    window.wishes.closed()
    flow.start(top)
    office.settle()
    assert len(office.desk.previews) == 2


def test_a_part_has_no_bom(office: Office, flow: PreviewFlow) -> None:
    """A message, and no window."""
    flow.start(office.document("Plate"))
    assert office.desk.warned == ["Plate holds no assembly, so it has no BOM."]
    assert office.desk.previews == []


def test_without_a_server_the_window_says_so(office: Office, flow: PreviewFlow, top: Document) -> None:
    """And stays open for another try."""
    error = UnreachableError("nobody there")

    def gone(*_arguments: object, **_more: object) -> None:
        raise error

    office.silo.get_items_by_uuid = gone  # type: ignore[method-assign, assignment]
    flow.start(top)
    office.settle()
    assert office.desk.previews[0].failed == [error]
