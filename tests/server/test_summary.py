# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is kept of a product is what is counted again, whatever two people do to what is in it."""

from __future__ import annotations

import itertools
import random
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from datetime import timedelta
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest
from hunting import examples, over
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from server_testing import Databases, merge_body

from silo.bom.errors import BusyError, SiloError
from silo.cli.main import main
from silo_server.actors import Actor, Role
from silo_server.db.database import Database
from silo_server.db.tables import items, product_summaries
from silo_server.db.transaction import Tx
from silo_server.events import log
from silo_server.run import prepare
from silo_server.services.bom import history
from silo_server.services.bom.decisions import Decision, ReviewAction, resolve
from silo_server.services.bom.last_sync import record_refusal
from silo_server.services.bom.line_edit import add_line, change_line
from silo_server.services.bom.merge import merge_bom
from silo_server.services.bom.merge_request import read_merge_request
from silo_server.services.bom.restore import undo_change
from silo_server.services.items import (
    ItemChange,
    NewItem,
    archive_item,
    change_item,
    create_item,
    get_by_uuids,
    get_item,
    patch_properties,
    unarchive_item,
)
from silo_server.services.product import parts as product_parts
from silo_server.services.product.cost import bought_whole, prices_in
from silo_server.services.product.export import View, export
from silo_server.services.product.flat import flatten
from silo_server.services.product.graph import MAX_DEPTH, load_graph
from silo_server.services.product.parts import parts_of
from silo_server.services.product.rollup import roll_up_cost, roll_up_mass
from silo_server.services.product.summary import Summary
from silo_server.services.product.summary_keep import LONGEST_CHANGE, keep_all, keep_summaries
from silo_server.services.product.summary_make import MOST_NAMED
from silo_server.services.product.summary_read import (
    marks_of,
    product_cost,
    standing_alone,
    summaries,
    summary_of,
)
from silo_server.services.product.tree import expand
from silo_server.services.suppliers import SupplierPart, rates_of, set_supplier_parts
from silo_server.settings import Settings
from silo_server.values import LineState

pytestmark = over("sqlite")
ASSEMBLIES, PARTS = 4, 4
GAP = {"reason": "missing", "name": "Lid", "file": "Lid.FCStd", "object": "Body", "quantity": 1}


@pytest.fixture(scope="module")
def prepared(kind: str, databases: Databases) -> Any:
    """A database for all examples."""
    with tempfile.TemporaryDirectory() as folder:
        made = Database(Settings(database_url=databases.new(kind), files_dir=Path(folder)))
        prepare(made, "silo_test")
        yield made
        made.close()


def seed(db: Database) -> list[str]:
    """Assemblies and parts, none in any other."""
    with db.write() as tx:
        made = [create_item(tx, NewItem(category="A01", name=f"Assembly {n}"))[0] for n in range(ASSEMBLIES)]
        made += [create_item(tx, NewItem(category="F01", name=f"Part {n}"))[0] for n in range(PARTS)]
    return [item.part_number for item in made]


def merge(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    parent = dice.randrange(ASSEMBLIES)
    inside = dice.sample(numbers[parent + 1 :], k=dice.randrange(4))
    body = merge_body({number: dice.choice([1, 2, 0.5]) for number in inside})
    gaps = [GAP] if dice.random() < 0.2 else []
    merge_bom(tx, numbers[parent], read_merge_request({**body, "left_out": gaps}, 100), None)


def refuse(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    record_refusal(tx, get_item(tx, dice.choice(numbers[:ASSEMBLIES]), lock=True), "no such part")


def add(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    kind = dice.choice(["component", "component", "reference"])
    state = LineState(dice.choice([1.0, 3.0]), "manual", kind, child_revision=dice.choice([None, 0]))
    add_line(tx, dice.choice(numbers[:ASSEMBLIES]), dice.choice(numbers), state)


def edit(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    units: list[dict[str, Any]] = [{"unit": unit} for unit in ("mm", "m", "box", "pcs", "", None)]
    change = dice.choice([{"quantity": 9.0}, {"child_revision": 0}, {"rel_type": "alternate"}, *units])
    change_line(tx, dice.choice(numbers[:ASSEMBLIES]), dice.choice(numbers), change)


def decide(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    action = dice.choice(list(ReviewAction))
    decision = Decision(dice.choice(numbers), action)
    resolve(tx, dice.choice(numbers[:ASSEMBLIES]), [decision])


def state(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    values = {
        dice.choice(["mass_kg", "standard_cost"]): dice.choice([None, 0.1, 2]),
        "currency": dice.choice([None, "USD"]),
    }
    patch_properties(tx, dice.choice(numbers), values)


def sell(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    prices = dice.choice([(), ((1, 3),), ((1, 3), (4, 2)), ((6, 1),)])
    breaks = tuple((Decimal(least), Decimal(price)) for least, price in prices)
    sold = [SupplierPart(name, prices=breaks) for name in dice.choice(["", "A", "AB"])]
    set_supplier_parts(tx, dice.choice(numbers), sold)


def measure(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    change_item(tx, dice.choice(numbers), ItemChange(texts={"unit": dice.choice(["m", "pcs", "box", ""])}))


def rename(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    place = dice.randrange(len(numbers))
    change_item(tx, numbers[place], ItemChange(part_number=f"N-{dice.randrange(10**12)}"))
    # The list is shared by the steps of an example.
    numbers[place] = "changed"


def archive(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    archive_item(tx, dice.choice(numbers))


def bring_back(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    unarchive_item(tx, dice.choice(numbers))


def undo(tx: Tx, numbers: list[str], dice: random.Random) -> None:
    number = dice.choice(numbers[:ASSEMBLIES])
    newest = history.list_changes(tx, get_item(tx, number), 1)
    if newest:
        undo_change(tx, number, newest[0].id, None)


STEPS: list[Callable[[Tx, list[str], random.Random], None]] = [
    *(
        merge,
        merge,
        merge,
        refuse,
        add,
        edit,
        decide,
        state,
        state,
        archive,
        bring_back,
        undo,
        rename,
        measure,
        measure,
        sell,
        sell,
    )
]


def all_of(db: Database, uuids: list[str]) -> dict[str, Summary]:
    """What a read says of all items, kept or not."""
    with db.read() as tx:
        found = {item.uuid: item for item in get_by_uuids(tx, uuids, include_archived=True)}
        told = summaries(tx, [item.id for item in found.values()])
        for uuid in uuids:
            check_by_rows(tx, found[uuid], told[found[uuid].id])
        return {uuid: told[found[uuid].id] for uuid in uuids}


def check_by_rows(tx: Tx, item: Any, told: Summary) -> None:
    """Totals, counts and levels are those of the lists of all parts."""
    graph = load_graph(tx, item)
    parts = parts_of(tx, graph)
    alone = standing_alone(tx, graph)
    flat_list = flatten(graph, bought_whole(graph, parts))
    cost = roll_up_cost(flat_list, parts, prices_in(graph, parts, rates_of(tx)))
    asked = product_cost(tx, told)
    mass = roll_up_mass(flatten(graph, alone), parts, alone)
    flat = {row.line.child_part_number for row in flatten(graph)}
    rows = list(expand(graph, MAX_DEPTH, 10**6))
    assert told.parts == len(flat)
    assert list(told.levels) == [
        sum(row.depth == level for row in rows)
        for level in range(1, max((row.depth for row in rows), default=0) + 1)
    ]
    if graph.components(item.id):
        assert float(told.worth.mass or 0) == pytest.approx(mass.total)
        assert (told.no_mass, asked.unknown) == (len(set(mass.missing)), len(set(cost.missing)))
        assert (list(told.mass_missing), list(asked.missing)) == (
            sorted(set(mass.missing)),
            sorted(set(cost.missing)),
        )
        assert dict(asked.totals) == dict(cost.totals)


@settings(
    max_examples=examples(2), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(seed_of=st.integers(0, 2**32))
def test_what_is_kept_is_what_is_counted_anew(prepared: Database, seed_of: int) -> None:
    """Random changes of two people, looks at random products between them, keeping at any moment."""
    dice, db = random.Random(seed_of), prepared
    with db.write() as tx:
        tx.conn.execute(product_summaries.delete())
    numbers = seed(db)
    with db.read() as tx:
        uuids = [get_item(tx, number).uuid for number in numbers]
    for _ in range(25):
        with suppress(SiloError), db.write(Actor(dice.choice(["ann", "bob"]), Role.EDITOR)) as tx:
            dice.choice(STEPS)(tx, numbers, dice)
        with db.read() as tx:
            row = {str(r.uuid): str(r.part_number) for r in tx.conn.execute(items.select())}
        numbers = [row[uuid] for uuid in uuids]
        if dice.random() < 0.5:
            with suppress(SiloError), db.read() as tx:
                summary_of(tx, get_item(tx, dice.choice(numbers)))
        if dice.random() < 0.5:
            keep_summaries(db)
        if dice.random() < 0.3:
            kept = all_of(db, uuids)
            with db.write() as tx:
                tx.conn.execute(product_summaries.delete())
            db.built.clear()
            assert kept == all_of(db, uuids)


def test_a_look_changes_nothing_and_is_kept(db: Database) -> None:
    """The second look finds what the first made; a change below ends it for all above, and no other."""
    numbers = seed(db)
    top, sub, other, _, part, *_ = numbers
    with db.write() as tx:
        for parent, child in ((sub, part), (top, sub), (other, numbers[-1])):
            merge_bom(tx, parent, read_merge_request(merge_body({child: 2}), 100), None)
    with db.read() as tx:
        ids = {number: get_item(tx, number).id for number in numbers}
        summaries(tx, [ids[top], ids[other]])
    keep_summaries(db)
    assert kept_ids(db) == {ids[top], ids[sub], ids[other]}
    with db.write() as tx:
        patch_properties(tx, part, {"mass_kg": 2})
    assert kept_ids(db) == {ids[other]}
    assert keep_all(db) == ASSEMBLIES
    assert kept_ids(db) == {ids[number] for number in numbers[:ASSEMBLIES]}


def kept_ids(db: Database) -> set[int]:
    """The items whose summary is kept."""
    with db.read() as tx:
        return set(tx.conn.scalars(product_summaries.select()))


def test_what_changed_meanwhile_is_not_kept(db: Database) -> None:
    """A change between the look and the keeping, deep below something that was kept before, wins."""
    numbers = seed(db)
    top, sub, *_ = numbers
    part = numbers[-1]
    with db.write() as tx:
        merge_bom(tx, sub, read_merge_request(merge_body({part: 2}), 100), None)
        merge_bom(tx, top, read_merge_request(merge_body({sub: 2}), 100), None)
    with db.read() as tx:
        summary_of(tx, get_item(tx, sub))
    keep_summaries(db)
    with db.read() as tx:
        assert summary_of(tx, get_item(tx, top)).worth.mass is None
    with db.write() as tx:
        patch_properties(tx, part, {"mass_kg": 2})
    keep_summaries(db)
    assert kept_ids(db) == set()
    with db.read() as tx:
        assert summary_of(tx, get_item(tx, top)).worth.mass == 8


def test_an_assembly_that_states_its_mass_stands_for_parts_without(db: Database) -> None:
    """Its number counts above it, and nothing below it is missing there; in itself the part is missing."""
    numbers = seed(db)
    top, sub, part = numbers[0], numbers[1], numbers[-1]
    with db.write() as tx:
        merge_bom(tx, sub, read_merge_request(merge_body({part: 2}), 100), None)
        merge_bom(tx, top, read_merge_request(merge_body({sub: 3}), 100), None)
        patch_properties(tx, sub, {"mass_kg": 1.5})
    with db.read() as tx:
        above, itself = (summary_of(tx, get_item(tx, number)) for number in (top, sub))
    assert (above.worth.mass, above.no_mass, above.no_cost) == (Decimal("4.5"), 0, 1)
    assert (itself.worth.mass, itself.no_mass, list(itself.mass_missing)) == (None, 1, [part])


def test_the_command_sums_all_up(db: Database, capsys: pytest.CaptureFixture[str]) -> None:
    """All assemblies, on the database of the server; how many is said."""
    top, *_, part = seed(db)
    with db.write() as tx:
        merge_bom(tx, top, read_merge_request(merge_body({part: 2}), 100), None)
    assert main(["summaries", "--database", db.settings.database_url, "--json"]) == 0
    assert capsys.readouterr().out == f'{{"assemblies": {ASSEMBLIES}}}\n'
    assert len(kept_ids(db)) == ASSEMBLIES


def test_a_product_that_no_read_can_sum_up_is_made_in_parts(db: Database) -> None:
    """The read that finds it says that it is made, and how to go on; then it is there, as if read at once."""
    numbers = seed(db)
    top, sub, other, *_, part = numbers
    with db.write() as tx:
        for parent, children in ((sub, numbers[5:]), (other, numbers[5:]), (top, [sub, other, part])):
            merge_bom(tx, parent, read_merge_request(merge_body(dict.fromkeys(children, 2)), 100), None)
    small = Database(replace(db.settings, max_expanded_rows=4))
    with pytest.raises(BusyError, match=r"more than 4 .* ask again in a minute"), small.read() as tx:
        summary_of(tx, get_item(tx, top))
    assert kept_ids(db) == set()
    keep_summaries(small, lambda: True)
    assert kept_ids(db) == set()
    with suppress(BusyError), small.read() as tx:
        summary_of(tx, get_item(tx, top))
    keep_summaries(small)
    with db.read() as tx:
        ids = {get_item(tx, number).id for number in (top, sub, other)}
    assert kept_ids(db) == ids
    with small.read() as tx:
        told = summary_of(tx, get_item(tx, top))
    small.close()
    with db.write() as tx:
        tx.conn.execute(product_summaries.delete())
    with db.read() as tx:
        assert told == summary_of(tx, get_item(tx, top))


def test_a_list_marks_what_is_open_in_products(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the summary, so all levels; what is too large for a list has its mark once it is summed up."""
    numbers = seed(db)
    top, sub, _, _, *parts = numbers
    with db.write() as tx:
        body = {**merge_body(dict.fromkeys(parts, 2)), "left_out": [GAP]}
        merge_bom(tx, sub, read_merge_request(body, 100), None)
        merge_bom(tx, top, read_merge_request(merge_body({sub: 1}), 100), None)
        welded = create_item(tx, NewItem(category="F01", name="A part with a BOM"))[0].part_number
        merge_bom(tx, welded, read_merge_request(body, 100), None)
        numbers.append(welded)

    def marks() -> dict[str, list[str]]:
        with db.read() as tx:
            listed = [get_item(tx, number) for number in numbers]
            found = marks_of(tx, listed)
        return {item.part_number: found[item.id] for item in listed if item.id in found}

    told = marks()
    assert told[top] == ["open in 1 BOM below"]
    assert told[sub] == told[welded] == ["incomplete: 1 missing"]
    assert told[numbers[2]] == ["never synced"]
    assert parts[0] not in told
    db.built.clear()
    monkeypatch.setattr("silo_server.services.product.summary_read.MOST_FOR_A_LIST", 2)
    assert marks() == {}
    keep_summaries(db)
    assert marks() == told


def one_level(db: Database) -> tuple[str, str]:
    """An assembly with two of a part; a look at it is not kept yet."""
    top, *_, part = seed(db)
    with db.write() as tx:
        merge_bom(tx, top, read_merge_request(merge_body({part: 2}), 100), None)
    with db.read() as tx:
        summary_of(tx, get_item(tx, top))
    return top, part


def test_a_refusal_that_began_before_the_look_is_not_forgotten(db: Database) -> None:
    """It has no event, and its time is that of its beginning; the look may be from in between."""
    top, _ = one_level(db)
    with db.write() as tx:
        tx.at -= timedelta(seconds=LONGEST_CHANGE - 10)
        record_refusal(tx, get_item(tx, top), "no such part")
    keep_summaries(db)
    assert kept_ids(db) == set()


def test_what_changed_behind_a_trimmed_log_is_not_kept(db: Database) -> None:
    """If the log no longer goes back to the look, nobody knows what changed since."""
    _, part = one_level(db)
    with db.write() as tx:
        patch_properties(tx, part, {"mass_kg": 2})
    with db.write() as tx:
        log.trim(tx, 0)
    keep_summaries(db)
    assert kept_ids(db) == set()


def test_who_made_the_bom_what_it_is_is_named(db: Database) -> None:
    """A sync that changes nothing is no change of the product."""
    top, part = one_level(db)
    for name, quantity in (("ann", 3), ("bob", 3)):
        with db.write(Actor(name, Role.EDITOR)) as tx:
            merge_bom(tx, top, read_merge_request(merge_body({part: quantity}), 100), None)
    with db.read() as tx:
        assert summary_of(tx, get_item(tx, top)).changed[1:] == ("ann", top)


def test_a_deep_product_with_many_unknown_masses(db: Database) -> None:
    """So many levels as a tree shows, all its parts, and the first names of those without a mass."""
    with db.write() as tx:
        depth, many = MAX_DEPTH + 3, MOST_NAMED + 3
        chain = [create_item(tx, NewItem(category="A01", name="a"))[0].part_number for _ in range(depth)]
        parts = [create_item(tx, NewItem(category="F01", name="p"))[0].part_number for _ in range(many)]
        for above, below_it in itertools.pairwise(chain):
            merge_bom(tx, above, read_merge_request(merge_body({below_it: 1}), 100), None)
        merge_bom(tx, chain[-1], read_merge_request(merge_body(dict.fromkeys(parts, 1)), 100), None)
    assert keep_all(db) == depth
    with db.read() as tx:
        told = summary_of(tx, get_item(tx, chain[0]))
    assert (len(told.levels), told.parts, told.no_mass) == (MAX_DEPTH, many, many)
    assert list(told.mass_missing) == sorted(parts)[:MOST_NAMED]


@pytest.mark.parametrize("view", list(View))
def test_an_export_reads_its_parts_some_at_a_time(
    db: Database, monkeypatch: pytest.MonkeyPatch, view: View
) -> None:
    """However many at a time, the rows are the same: with a filter, and with what the syncs left out."""
    top, sub, *_, first, second = seed(db)
    with db.write() as tx:
        body = {**merge_body({first: 2, second: 3}), "left_out": [GAP]}
        merge_bom(tx, sub, read_merge_request(body, 100), None)
        merge_bom(tx, top, read_merge_request(merge_body({sub: 2, second: 1}), 100), None)
        patch_properties(tx, first, {"mass_kg": 0.5, "supplier": "Misumi"})

    def rows(words: str) -> list[dict[str, Any]]:
        with db.read() as tx:
            return list(export(tx, top, view, 2, words).rows)

    whole, found = rows(""), rows("misumi")
    numbers = [row.get("Part number") for row in whole]
    deep = {
        View.SINGLE: [sub, second],
        View.INDENTED: [sub, first, second, second, None],
        View.FLAT: [second, first, None],
    }
    assert numbers == deep[view]
    assert [row["Part number"] for row in found] == {
        View.SINGLE: [sub],
        View.INDENTED: [sub, first],
        View.FLAT: [first],
    }[view]
    monkeypatch.setattr(product_parts, "PORTION", 1)
    assert (rows(""), rows("misumi")) == (whole, found)
