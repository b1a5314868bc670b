# SPDX-License-Identifier: LGPL-2.1-or-later
"""Register Parts: what is modelled in the assembly's own file, from the offer to the identity and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, locals_

from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library, stamp, unstamp
from silo.registering.candidate import Candidate, ComponentState, OpenedFile
from silo.registering.carry_out import carry_out
from silo.registering.journal import Journal
from silo.registering.offer import offer
from silo.testing import FakeSilo
from silo.workbench.register.rows import APART, NEW, EditedRow, choose, heading
from silo.workbench.session.worker import Control


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Two equal motors, a jig and a screw in one file."""
    doc = Doc(label="machine")
    for name, body in (("Motor", "a motor"), ("Motor001", "a motor"), ("Jig", "a jig")):
        doc.add("Part::Feature", name, Shape=doc.shape(name, body))
    doc.add("Part::FeaturePython", "Screw", Type="ISO4762", Diameter="M4", Length="16", Thread=False)
    doc.add("App::Part", "Top", Group=locals_("Motor", "Motor001", "Jig", "Screw"), Type="Assembly")
    return doc.save(tmp_path / "machine.FCStd")


def offered(path: Path, silo: FakeSilo, state: ComponentState = ComponentState.READY) -> list[EditedRow]:
    with Library() as library:
        extraction = extract(choose_assembly(library.open(path)))
    seen = {str(path): OpenedFile(state)}
    found = offer(extraction, seen, silo, "kindred-rd", Control(lambda _text, _part: None))
    return [EditedRow.of(candidate) for candidate in found.candidates]


def order(row: EditedRow, silo: FakeSilo) -> list[Any]:
    done: list[Any] = []

    def write(candidate: Candidate, identity: str) -> None:
        assert candidate.article is not None
        for name in candidate.article.objects:
            stamp(candidate.entry.doc_path, identity, object_name=name, item_object=name)

    carry_out(
        [row.request()],
        silo,
        Journal(),
        write,
        schema="kindred-rd",
        control=Control(lambda _text, _part: None),
        done=lambda _order, result: done.append(result),
    )
    return done


def counted(path: Path) -> dict[str, int]:
    with Library() as library:
        found = extract(choose_assembly(library.open(path)))
    return {entry.object_name: entry.quantity for entry in found.entries if not entry.standard}


def test_sections_come_in_order_and_what_is_modelled_has_no_check_mark(path: Path) -> None:
    rows = offered(path, FakeSilo())
    assert [(row.component(), row.section, row.checked) for row in rows] == [
        ("machine.FCStd", "", True),
        ("Standard part: ISO 4762 M4×16", "standard", True),
        ("Motor (2 copies)", "modelled", False),
        ("Jig", "modelled", False),
    ]
    assert "would count 2 times" in rows[2].note()[0]
    assert "excluded from the BOM" in heading(rows, "machine", 0)


def test_one_press_declares_all_copies_and_another_takes_it_back(path: Path) -> None:
    silo = FakeSilo()
    (result,) = order(offered(path, silo)[2], silo)
    assert result.error is None
    assert counted(path) == {"Motor": 1, "Motor001": 1}
    rows = offered(path, silo)
    declared = [row for row in rows if row.section == "declared"]
    assert [(row.component(), row.can_undeclare, row.can_register) for row in declared] == [
        ("Motor (2 copies)", True, False),
    ]
    for row in declared:
        for name in row.candidate.article.objects if row.candidate.article else ():
            assert unstamp(path, name)
    assert counted(path) == {}


def test_different_parts_get_a_number_each(path: Path) -> None:
    silo = FakeSilo()
    row = offered(path, silo)[2]
    assert list(row.choices()) == [NEW, APART]
    choose([row], row, APART)
    (result,) = order(row, silo)
    assert len(set(result.part_number.split(", "))) == 2


def test_a_file_that_cannot_be_written_offers_nothing_of_it(path: Path) -> None:
    rows = offered(path, FakeSilo(), ComponentState.READ_ONLY)
    assert [row.section for row in rows] == ["", "standard"]


def test_no_part_is_a_section_of_its_own_and_can_be_taken_back(path: Path) -> None:
    """Without a question and without a number; the whole article, all copies."""
    silo = FakeSilo()
    for name in ("Motor", "Motor001"):
        assert unstamp(path, name, no_part=True)
        assert not unstamp(path, name, no_part=True)
    (row,) = [row for row in offered(path, silo) if row.section == "no part"]
    assert (row.component(), row.can_undeclare, row.can_register, row.can_be_no_part, row.checked) == (
        *("Motor (2 copies)", True),
        *(False, False, False),
    )
    assert (row.number_text({}, 0), row.note()[0]) == ("", "not a part: not listed again")
    for name in ("Motor", "Motor001"):
        assert unstamp(path, name)
    (row,) = [row for row in offered(path, silo) if row.component() == "Motor (2 copies)"]
    assert (row.section, row.can_be_no_part) == ("modelled", True)
