# SPDX-License-Identifier: LGPL-2.1-or-later
"""Carrying out what a person ordered for parts that are modelled in the assembly's own file."""

from __future__ import annotations

from pathlib import Path

from fcstd_writer import part

from silo.api.wire import Item
from silo.bom.entry import BomEntry
from silo.bom.errors import RejectedError
from silo.bom.items.proposal import propose
from silo.registering.candidate import Candidate, ComponentState
from silo.registering.carry_out import carry_out, take_back
from silo.registering.items import Registration
from silo.registering.journal import Journal
from silo.registering.learnt import Learnt, LearntChoice
from silo.registering.modelled import Modelled
from silo.registering.request import RegistrationRequest
from silo.testing import FakeSilo
from silo.workbench.session.worker import Control


def carried_out(
    silo: FakeSilo, folder: Path, *, apart: bool = False, source: str = ""
) -> tuple[list[Registration], dict[tuple[str, ...], str]]:
    """What became of a request for two equal motors, and which objects got which identity."""
    entry = BomEntry(str(folder / "machine.FCStd"), object_name="Motor", label="Motor", quantity=2)
    article = Modelled(entry, ("Motor", "Motor001"), "shape", source)
    proposal = propose(entry, {"M01": "Machined part"}, shares_file=True)
    candidate = Candidate(proposal, ComponentState.READY, article=article)
    request = RegistrationRequest(candidate, "Motor", "part", "M01", apart=apart)
    done: list[Registration] = []
    written: dict[tuple[str, ...], str] = {}

    def write(one: Candidate, identity: str) -> None:
        assert one.article is not None
        written[one.article.objects] = identity

    carry_out(
        [request],
        silo,
        Journal(folder / "journal"),
        write,
        schema="kindred-rd",
        control=Control(lambda _detail, _fraction: None),
        done=lambda _request, result: done.append(result),
    )
    return done, written


def test_copies_that_a_person_takes_apart_get_an_item_each(tmp_path: Path) -> None:
    silo = FakeSilo()
    (result,), written = carried_out(silo, tmp_path, apart=True)
    assert list(written) == [("Motor",), ("Motor001",)]
    numbers = [getattr(silo.get_item_by_uuid(one), "part_number", None) for one in written.values()]
    assert len(set(numbers)) == 2
    assert result.part_number == ", ".join(map(str, numbers))


def test_no_second_item_is_made_where_nobody_knows_whether_there_is_one(tmp_path: Path) -> None:
    """A2plus imported it from a registered file, and the server does not say which item that is."""

    known = "00000000-0000-4000-8000-000000000000"

    class Refusing(FakeSilo):
        def get_item_by_uuid(self, uuid: str, /) -> Item | None:
            if uuid == known:
                raise RejectedError("not today")
            return super().get_item_by_uuid(uuid)

    silo, source = Refusing(), tmp_path / "motor.FCStd"
    part("motor", "Motor", uuid=known).save(source)
    (result,), written = carried_out(silo, tmp_path, source=str(source))
    assert "not today" in str(result.error)
    assert (written, list(silo.search_items(""))) == ({}, [])


def test_a_choice_is_learnt_for_the_same_words_in_the_same_folder(tmp_path: Path) -> None:
    """The choice with the most words counts, then the newest; other folders and other words learn nothing."""
    learnt = Learnt(tmp_path / "learnt.json")

    def entry(folder: str, name: str) -> BomEntry:
        return BomEntry(str(tmp_path / folder / f"{name}.FCStd"), label=name)

    def choose(folder: str, name: str, category: str) -> None:
        learnt.learn([(entry(folder, name), name, LearntChoice((), category, "purchased", "Misumi"))])

    choose("a", "Widget 7", "R27")
    choose("a", "Widget cover", "M03")
    choose("b", "Gizmo", "E03")
    choose("a", "Widget 8", "R25")
    choose("a", "Widget left", "M05")
    choose("a", "42", "X99")  # no word to know it by
    again = Learnt(tmp_path / "learnt.json")
    asked = [("a", "Widget 99"), ("a", "Left widget cover"), ("b", "Widget"), ("a", "Gizmo"), ("a", "42")]
    found = [again.of(entry(folder, name), name) for folder, name in asked]
    assert [one and one.category for one in found] == ["R25", "M05", None, None, None]
    assert again.recent == ("X99", "M05", "R25", "E03", "M03", "R27")
    (tmp_path / "learnt.json").write_text('{"%s": [{"words": 3}], "": 5}' % (tmp_path / "a"))
    broken = Learnt(tmp_path / "learnt.json")
    assert (broken.of(entry("a", "Widget"), "Widget"), broken.recent) == (None, ())


def test_undo_leaves_what_others_use(tmp_path: Path) -> None:
    """Items of standard parts, of identities that the files had before, and those that were joined."""
    silo = FakeSilo()
    done = []
    for entry, found in (
        (BomEntry("", silo_uuid="bolt", standard="ISO 4762 M4x16"), False),
        (BomEntry("/v/foreign.FCStd", silo_uuid="other"), False),
        (BomEntry("/v/joined.FCStd"), True),
        (BomEntry("/v/new.FCStd"), False),
    ):
        request = RegistrationRequest.of(
            Candidate(propose(entry, {"M01": "Machined part"}), ComponentState.READY)
        )
        item = silo.create_item("kindred-rd", "M01", entry.doc_path)
        done.append((request, Registration(request.proposal, item.part_number, item.id, found=found)))
    restored: list[str] = []
    take_back(
        done,
        silo,
        Journal(tmp_path / "journal"),
        lambda candidate: restored.append(candidate.entry.doc_path),
        control=Control(lambda _detail, _fraction: None),
        back=lambda _request, _error: None,
    )
    assert restored == ["/v/new.FCStd", "/v/joined.FCStd"]
    left = {
        request.candidate.entry.doc_path
        for request, result in done
        if silo.get_item_by_uuid(str(result.item_id)) is not None
    }
    assert left == {"", "/v/foreign.FCStd", "/v/joined.FCStd"}
