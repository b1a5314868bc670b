# SPDX-License-Identifier: LGPL-2.1-or-later
"""Carrying out what a person ordered for parts that are modelled in the assembly's own file."""

from __future__ import annotations

from pathlib import Path

from fcstd_writer import part

from silo.api.wire import Item
from silo.bom.errors import RejectedError
from silo.bom.model import BomEntry
from silo.bom.resolve import propose
from silo.registering.items import Registration
from silo.registering.journal import Journal
from silo.registering.modelled import Modelled
from silo.registering.offer import Candidate, State
from silo.registering.orders import Order, carry_out
from silo.testing import FakeSilo
from silo.workbench.session.jobs import Control


def carried_out(
    silo: FakeSilo, folder: Path, *, apart: bool = False, source: str = ""
) -> tuple[list[Registration], dict[tuple[str, ...], str]]:
    """What became of an order for two equal motors, and which objects got which identity."""
    entry = BomEntry(str(folder / "machine.FCStd"), object_name="Motor", label="Motor", quantity=2)
    article = Modelled(entry, ("Motor", "Motor001"), "shape", source)
    proposal = propose(entry, {"M01": "Machined part"}, shares_file=True)
    candidate = Candidate(proposal, State.READY, article=article)
    order = Order(candidate, "Motor", "part", "M01", apart=apart)
    done: list[Registration] = []
    written: dict[tuple[str, ...], str] = {}

    def write(one: Candidate, identity: str) -> None:
        assert one.article is not None
        written[one.article.objects] = identity

    carry_out(
        [order],
        silo,
        Journal(folder / "journal"),
        write,
        schema="kindred-rd",
        control=Control(lambda _detail, _fraction: None),
        done=lambda _order, result: done.append(result),
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
