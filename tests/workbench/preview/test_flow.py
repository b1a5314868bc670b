# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview from the command to the sync, without FreeCAD and Qt."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

import pytest
from desk import Document, Office, PreviewWindow

from silo.bom.errors import DocumentError, InputError, UnreachableError
from silo.bom.findings import Finding, FindingCode, Severity
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.preview.flow import PreviewFlow
from silo.workbench.preview.rows import PreviewRow, rows


@pytest.fixture(name="shown")
def _shown() -> list[tuple[str, tuple[str, ...]]]:
    """What was selected in the 3D view."""
    return []


@pytest.fixture(name="flow")
def _flow(office: Office, shown: list[tuple[str, tuple[str, ...]]]) -> PreviewFlow:
    commits = CommitFlow(office.session, office.preferences, office.desk, path=office.folder / "same.json")
    return PreviewFlow(
        office.session,
        commits,
        office.desk,
        register=lambda _path: None,
        show=lambda path, names: shown.append((path, names)),
        view=lambda _url: None,
    )


@pytest.fixture(name="top")
def _top(office: Office) -> Document:
    top = office.document("Top")
    top.parts[office.document("Plate")] = 3
    return top


def opened(office: Office, flow: PreviewFlow, doc: Document) -> PreviewWindow:
    """The window of a document, with its comparison."""
    flow.start(doc)
    office.settle()
    (window,) = office.desk.previews
    return window


def sync(office: Office, window: PreviewWindow) -> None:
    """Press the button."""
    window.flow.sync(window.filled[-1], False, False)
    office.settle()


def test_compare_sync_and_compare_again(office: Office, flow: PreviewFlow, top: Document) -> None:
    """What would be added is added; the file is not sent."""
    window = opened(office, flow, top)
    assert [line.part_number for line in window.filled[0].top.diff.added] == ["M01-0002"]
    sync(office, window)
    assert [line.quantity for line in office.silo.get_bom("M01-0001")] == [3]
    assert office.files("Top") == []
    flow.again(top.FileName)
    office.settle()
    assert not window.filled[1].top.diff.drifted


def test_a_sync_does_not_undo_a_colleagues_newer_file(
    office: Office, flow: PreviewFlow, top: Document
) -> None:
    """Neither with edits nor without: the window shows the document as it is, made from an older revision."""
    number = "M01-0001"
    Path(top.FileName).write_bytes(b"three plates")
    office.silo.upload_file(number, top.FileName, "mine")
    office.desk.documents.base(top).content = sha256(b"three plates").hexdigest()
    window = opened(office, flow, top)
    sync(office, window)
    theirs = office.folder / "theirs.FCStd"
    theirs.write_bytes(b"without plates")
    office.silo.user = "alice"
    office.silo.upload_file(number, theirs, "less")
    for edited in (False, True):
        top.changed = edited
        top.parts = dict.fromkeys(top.parts, 5)
        flow.again(top.FileName)
        office.settle()
        sync(office, window)
        assert [line.quantity for line in office.silo.get_bom(number)] == [3], edited
        assert "alice has committed revision 2 since" in office.sent[-1].entry.remark


def test_bom_and_file_of_a_sync_are_of_one_state(office: Office, flow: PreviewFlow, top: Document) -> None:
    """A document that was edited since the comparison is shown as it is, and synced at the second press."""
    number = "M01-0001"
    Path(top.FileName).write_bytes(b"three plates")
    office.silo.upload_file(number, top.FileName, "mine")
    top.changed = False
    window = opened(office, flow, top)
    sub = office.document("Sub")
    for edit in (lambda: top.parts.update(dict.fromkeys(top.parts, 5)), lambda: top.parts.update({sub: 1})):
        edit()
        top.content = b"as edited: %d" % len(top.parts)
        office.desk.documents.save(top)
        before = office.silo.get_bom(number)
        sync(office, window)
        assert (office.silo.get_bom(number), office.sent) == (before, [])
        assert "was edited since the comparison" in window.filled[-1].note
        assert "was edited since the comparison" not in window.filled[0].note
    office.silo.upload_file(number, top.FileName, "mine")
    sync(office, window)
    assert [line.quantity for line in office.silo.get_bom(number)] == [5, 1]
    assert len(office.sent) == 1
    top.parts[sub] = 2
    window.flow.closed(window.path)
    sync(office, window)
    assert (len(office.sent), office.bugs) == (1, [])


def test_a_closed_document_is_reported_in_its_window(
    office: Office, flow: PreviewFlow, top: Document
) -> None:
    """Comparing again, with Silo and with the 3D view, needs it, and so does a sync: its file may be another
    one by now."""
    window = opened(office, flow, top)
    office.desk.open.remove(top)
    window.flow.again(window.path)
    window.flow.verify(window.filled[0])
    sync(office, window)
    assert [str(error) for error in window.failed] == [
        "Top.FCStd is not open any more. Open it, then compare again."
    ] * 3
    assert office.sent == []


def test_one_window_per_document(office: Office, flow: PreviewFlow, top: Document) -> None:
    """It comes to the front; closed, a new one is opened."""
    flow.start(top)
    window = opened(office, flow, top)
    assert window.raised == 1
    window.flow.closed(window.path)
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


@dataclass(frozen=True)
class Account:
    """What FreeCAD shows of one assembly."""

    doc_path: str
    agrees: bool
    unexplained: tuple[str, ...] = ()

    def sentence(self) -> str:
        return "125 of 125" if self.agrees else "126 of 125"


def test_the_view_is_compared_and_what_no_line_explains_is_selected(
    office: Office, flow: PreviewFlow, top: Document, shown: list[tuple[str, tuple[str, ...]]]
) -> None:
    """The first assembly that differs, wherever it lies."""
    window = opened(office, flow, top)
    office.desk.witnessed = [Account(top.FileName, True), Account("/sub", True)]
    window.flow.verify(window.filled[0])
    assert (window.seen, shown) == ([("125 of 125", True)], [])
    office.desk.witnessed = [Account(top.FileName, True), Account("/sub", False, ("Loose",))]
    window.flow.verify(window.filled[0])
    assert (window.seen[-1], shown) == (("126 of 125", False), [("/sub", ("Loose",))])
    office.desk.refusal = DocumentError("/sub", "is gone")
    window.flow.verify(window.filled[0])
    assert "is gone" in office.desk.warned[-1]


def test_broken_links_are_mended_where_one_file_fits(
    office: Office, flow: PreviewFlow, top: Document
) -> None:
    """And the comparison is made again; a refusal is shown."""
    window = opened(office, flow, top)
    broken = tuple(
        Finding(FindingCode.MISSING_FILE, Severity.ERROR, "gone", did_you_mean=meant)
        for meant in ("", "/new")
    )
    preview = replace(window.filled[0], broken=broken)
    window.flow.relink(preview)
    office.settle()
    assert (office.desk.relinked, len(window.filled)) == (["/new"], 2)
    office.desk.refusal = DocumentError("/new", "holds no object")
    window.flow.relink(preview)
    office.settle()
    assert "holds no object" in office.desk.warned[-1]
    assert len(window.filled) == 2


def test_the_pane_s_button_mends_once(
    office: Office, flow: PreviewFlow, top: Document, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The links are mended when the comparison is there; a later comparison leaves them alone."""
    mended: list[str] = []
    monkeypatch.setattr(flow, "relink", lambda preview: mended.append(preview.snapshot.path))
    flow.start(top, mend=True)
    office.settle()
    flow.again(top.FileName)
    office.settle()
    assert mended == [top.FileName]


def test_a_line_says_why_it_counts_so_many(office: Office, flow: PreviewFlow, top: Document) -> None:
    """By the keys of the line, in the assembly that holds it; also of a line without a part number."""
    top.parts[office.document("Loose", registered=False)] = 2
    window = opened(office, flow, top)
    lines = [row for row in _flat(rows(window.filled[0])) if row.parts]
    assert [Path(row.parts[0][0]).stem for row in lines] == ["Plate", "Loose"]
    flow.why(top.FileName, lines[0].document, lines[0].assembly, [("", str(n)) for n in range(20)])
    text, agrees = window.seen[-1]
    assert (text.split("\n")[0], text.count("\n"), agrees) == ("2 in Top", 12, None)
    assert text.endswith("… and 9 more")
    office.desk.refusal = InputError("gone")
    flow.why(top.FileName, lines[0].document, "", lines[0].parts)
    assert window.seen[-1] == ("gone", None)
    office.desk.open.clear()
    flow.why(top.FileName, lines[0].document, "", lines[0].parts)
    assert "not open any more" in str(window.failed[-1])


def _flat(table: Iterable[PreviewRow]) -> Iterator[PreviewRow]:
    for row in table:
        yield row
        yield from _flat(row.children)


def test_an_answer_about_what_is_hidden_is_kept_and_compared_again(
    office: Office, flow: PreviewFlow, top: Document
) -> None:
    window = opened(office, flow, top)
    window.flow.decide(top.FileName, top.FileName, ("Body", "Lid"), counts=True)
    office.settle()
    window.flow.decide(top.FileName, top.FileName, ("Ref",), counts=False)
    office.settle()
    assert office.desk.answers == [(("Body", "Lid"), True), (("Ref",), False)]
    assert len(window.filled) == 3
    assert [text.partition(":")[0] for text, _ in window.seen] == [
        "Counted from now on",
        "References from now on, not counted",
    ]
    office.desk.refusal = DocumentError("/new", "holds no object")
    window.flow.decide(top.FileName, top.FileName, ("Ref",), counts=True)
    assert "holds no object" in office.desk.warned[-1]
