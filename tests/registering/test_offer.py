# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the Register Parts dialog offers: states, look-alikes on the server, copied identities."""

from __future__ import annotations

import hashlib
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import pytest

from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import ServerFaultError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.items.proposal import Proposal
from silo.bom.items.schema import Categories
from silo.registering.candidate import Candidate, ComponentState, OpenedFile
from silo.registering.offer import Offer, offer
from silo.testing import FakeSilo
from silo.workbench.register.rows import EditedRow
from silo.workbench.session.worker import Control

CONTROL = Control(lambda _detail, _fraction: None)


def part(folder: Path, name: str, content: bytes = b"", *, uuid: str | None = None) -> BomEntry:
    path = folder / f"{name}.FCStd"
    path.write_bytes(content or name.encode())
    return BomEntry(
        str(path), silo_uuid=uuid, object_name="Body", label=name, document_label=name, quantity=1
    )


def offered(
    silo: FakeSilo,
    folder: Path,
    *entries: BomEntry,
    findings: tuple[Finding, ...] = (),
    **states: ComponentState,
) -> dict[str, Candidate]:
    """Candidates by name; the assembly itself has its number already."""
    top = silo.create_item("kindred-rd", "A01", "Top", item_type="assembly")
    head = BomEntry(str(folder / "Top.FCStd"), silo_uuid=top.id, label="Top", is_assembly=True, level=0)
    seen = {e.doc_path: OpenedFile(states.get(e.label, ComponentState.READY)) for e in entries}
    found: Offer = offer(Extraction(head, entries, findings), seen, silo, "kindred-rd", CONTROL)
    return {Path(c.entry.doc_path).stem: c for c in found.candidates}


def test_an_item_that_has_this_very_file_is_found_whatever_its_name(tmp_path: Path) -> None:
    """The file was renamed before it came here; it is not checked to begin with."""
    silo = FakeSilo()
    known = silo.create_item("kindred-rd", "M01", "Motor bracket, cast")
    silo.upload_file(known.part_number, _file(tmp_path / "archive.FCStd", b"the same shape"))
    candidate = offered(silo, tmp_path, part(tmp_path, "Mount", b"the same shape"))["Mount"]
    assert [(s.part_number, s.same_file) for s in candidate.similar] == [(known.part_number, True)]
    assert not candidate.wanted


def test_an_item_registered_from_this_very_file_is_found(tmp_path: Path) -> None:
    """Its own file has an identity in it by now; the item remembers what it was registered from."""
    silo = FakeSilo()
    content = b"not yet registered"
    candidate = part(tmp_path, "Copy", content)
    digest = _sha256(content)
    known = silo.create_item("kindred-rd", "M01", "Original", properties={"file_sha256": digest})
    assert [s.part_number for s in offered(silo, tmp_path, candidate)["Copy"].similar] == [known.part_number]


def test_six_hundred_components_are_looked_up_in_two_questions(tmp_path: Path) -> None:
    """Not in one each: a vault has ten thousand; the last one is looked up like the first."""

    class Counting(FakeSilo):
        asked = 0

        def find_look_alikes(self, *args: Any, **more: Any) -> Any:
            self.asked += 1
            return super().find_look_alikes(*args, **more)

    silo = Counting()
    known = silo.create_item("kindred-rd", "M01", "Lid 599").part_number
    entries = tuple(
        BomEntry(str(tmp_path / f"{n}.FCStd"), object_name="Body", label=f"Lid {n}", quantity=1)
        for n in range(600)
    )
    head = BomEntry(str(tmp_path / "Top.FCStd"), label="Top", is_assembly=True, level=0)
    found = offer(Extraction(head, entries), {}, silo, "kindred-rd", CONTROL, most=None)
    alike = {c.proposal.name: [s.part_number for s in c.similar] for c in found.candidates if c.similar}
    assert (len(found.candidates), alike, silo.asked) == (601, {"Lid 599": [known]}, 2)


def test_a_server_without_categories_is_asked_for_no_items(tmp_path: Path) -> None:
    """Another program answers at that address; each item would be refused for its empty category."""

    class Other(FakeSilo):
        def categories(self, *_: object) -> Categories:
            return Categories({})

    head = part(tmp_path, "Base Part")
    with pytest.raises(ServerFaultError, match="has no categories"):
        offer(Extraction(head, ()), {}, Other(), "kindred-rd", CONTROL)


def test_where_the_server_cannot_be_searched_the_offer_says_so(tmp_path: Path) -> None:
    """Registering works; but "no duplicates" would be more than anybody knows."""

    class Deaf(FakeSilo):
        def find_look_alikes(self, *_: object, **__: object) -> NoReturn:
            raise ServerFaultError("the index is broken")

    head = part(tmp_path, "Base Part")
    seen = {head.doc_path: OpenedFile(ComponentState.READY)}
    found = offer(Extraction(head, ()), seen, Deaf(), "kindred-rd", CONTROL)
    assert len(found.candidates) == 1
    assert found.unsearched == "the index is broken"


def test_an_item_with_the_same_name_is_reported_and_stays_a_suggestion(tmp_path: Path) -> None:
    """One that only begins so is another part."""
    silo = FakeSilo()
    same = silo.create_item("kindred-rd", "M01", "base part")
    silo.create_item("kindred-rd", "M01", "Base Part Long")
    candidate = offered(silo, tmp_path, part(tmp_path, "Base Part"))["Base Part"]
    assert [(s.part_number, s.same_file) for s in candidate.similar] == [(same.part_number, False)]
    assert candidate.wanted


def test_states_that_need_a_person_are_not_checked(tmp_path: Path) -> None:
    """Each row has its state, and the others are not touched by it."""
    entries = [part(tmp_path, f"{name} part") for name in ("Ready", "Fixed", "Half", "Open")]
    found = offered(
        FakeSilo(),
        tmp_path,
        *entries,
        **{
            "Fixed part": ComponentState.READ_ONLY,
            "Half part": ComponentState.PARTIAL,
            "Open part": ComponentState.ELSEWHERE,
        },
    )
    assert {name: c.wanted for name, c in found.items()} == {
        "Ready part": True,
        "Fixed part": False,
        "Half part": False,
        "Open part": False,
    }
    assert {name: c.state.usable for name, c in found.items()} == {
        "Ready part": True,
        "Fixed part": False,
        "Half part": False,
        "Open part": True,
    }


def test_a_guessed_category_is_not_checked(tmp_path: Path) -> None:
    """A person looks at it first; the others of the assembly are offered as they were."""
    found = offered(FakeSilo(), tmp_path, part(tmp_path, "Thing"), part(tmp_path, "Milled part"))
    assert {name: c.wanted for name, c in found.items()} == {"Thing": False, "Milled part": True}
    row = EditedRow.of(found["Thing"])
    assert row.guesses
    row.checked = True
    assert not row.guesses


def test_two_files_of_one_content_are_reported_together(tmp_path: Path) -> None:
    """Nobody wants two numbers for one part by accident."""
    found = offered(FakeSilo(), tmp_path, part(tmp_path, "A", b"x"), part(tmp_path, "B", b"x"))
    assert (found["A"].twin, found["B"].twin) == ("B", "A")


def test_a_copied_identity_is_offered_for_each_of_its_files(tmp_path: Path) -> None:
    """With the number that both carry; its own item is no look-alike."""
    silo = FakeSilo()
    item = silo.create_item("kindred-rd", "M01", "Plate")
    entries = [part(tmp_path, name, uuid=item.id) for name in ("Plate", "PlateLong")]
    places = tuple(Place(e.doc_path, e.object_name) for e in entries)
    finding = Finding(FindingCode.COPIED_IDENTITY, Severity.WARNING, "copied", places)
    found = offered(silo, tmp_path, *entries, findings=(finding,))
    assert {name: c.same_as for name, c in found.items()} == dict.fromkeys(
        ("Plate", "PlateLong"), item.part_number
    )
    assert [c.similar for c in found.values()] == [(), ()]


@pytest.mark.parametrize(("name", "asked"), [("PlateLong", True), ("plate", False)])
def test_a_document_whose_item_has_a_file_of_another_name_is_asked_about(
    tmp_path: Path, name: str, asked: bool
) -> None:
    """Opened alone, a copy by Save As has no other file beside it that would give it away."""
    silo = FakeSilo()
    item = silo.create_item("kindred-rd", "M01", "Plate")
    silo.upload_file(item.part_number, _file(tmp_path / "Plate.FCStd", b"short"))
    top = part(tmp_path, name, uuid=item.id)
    seen = {top.doc_path: OpenedFile(ComponentState.READY)}
    found = offer(Extraction(top, ()), seen, silo, "kindred-rd", CONTROL)
    assert [c.same_as for c in found.candidates] == ([item.part_number] if asked else [])


def fcstd(folder: Path, name: str, meta: str = "", saved: str = "2026-11-21T10:00:00Z") -> BomEntry:
    """A part whose file says when it was saved, and what is in its Meta."""
    entry = part(folder, name)
    properties = f"""<Properties Count="2">
        <Property name="LastModifiedDate" type="App::PropertyString"><String value="{saved}"/></Property>
        <Property name="Meta" type="App::PropertyMap"><Map count="1">{meta}</Map></Property></Properties>"""
    with zipfile.ZipFile(entry.doc_path, "w") as file:
        file.writestr("Document.xml", f"<Document SchemaVersion='4'>{properties}</Document>")
    return entry


MARK = '<Item key="SiloUUID{}" value="0b5e7a8c-8a53-4b4c-9a56-9f1f3c1c1d11"/>'


@pytest.mark.parametrize(
    ("meta", "saved", "state"),
    [
        ("", "2026-11-21T10:00:00Z", ComponentState.READY),
        ("", "2026-11-21T10:00:05Z", ComponentState.NEWER),
        (MARK.format(""), "2026-11-21T10:00:00Z", ComponentState.NEWER),
        (MARK.format("/Body"), "2026-11-21T10:00:00Z", ComponentState.NEWER),
        (MARK.format("/Other"), "2026-11-21T10:00:00Z", ComponentState.READY),
    ],
)
def test_a_file_that_changed_since_it_was_opened_is_not_overwritten(
    tmp_path: Path, meta: str, saved: str, state: ComponentState
) -> None:
    """Saved by somebody else, or registered from the command line: the open document knows neither."""
    entry = fcstd(tmp_path, "Part", meta, saved)
    seen = {entry.doc_path: OpenedFile(ComponentState.READY, "2026-11-21T10:00:00Z")}
    silo = FakeSilo()
    head = BomEntry(str(tmp_path / "Top.FCStd"), label="Top", is_assembly=True, level=0)
    found = offer(Extraction(head, (entry,)), seen, silo, "kindred-rd", CONTROL)
    assert found.candidates[0].state is state


def _file(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def test_a_part_of_another_server_is_not_checked_to_begin_with() -> None:
    """A person says that the identity comes along."""
    entry = BomEntry("/v/bracket.FCStd", object_name="Body", label="Bracket", document_label="Bracket")
    known = replace(entry, silo_uuid="aaaaaaaa-2222-4333-8444-555555555555")
    here, elsewhere = (
        Candidate(Proposal(one, "Bracket", "part", "M01"), ComponentState.READY) for one in (entry, known)
    )
    assert (here.foreign, here.wanted, elsewhere.foreign, elsewhere.wanted) == (False, True, True, False)
    assert not replace(elsewhere, same_as="M01-0001").foreign
