# SPDX-License-Identifier: LGPL-2.1-or-later
"""Laws of comparing, merging and resolving that hold for any BOM (issue: "Laws with hypothesis")."""

from __future__ import annotations

from collections import Counter
from decimal import Decimal
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from silo.bom import BomEntry, apply_merge, diff_bom, plan_merge, resolve_part_numbers
from silo.bom.compare.answer import summary
from silo.bom.items.resolve import merge_lines
from silo.bom.quantities import same_quantity

NUMBERS = ("PRT-100", "ASM-200", "F01-0001", "F01-0002", "glue", "Ü-1")

numbers = st.sampled_from(NUMBERS)
counts = st.integers(1, 10**6)
amounts = counts | st.floats(1e-6, 1e9, allow_nan=False) | st.decimals(1, 1000, places=3)
# The same amounts as servers write them.
told = amounts | counts.map(str) | counts.map(float) | amounts.map(lambda q: Decimal(str(q)))


def entry(number: str, quantity: int) -> BomEntry:
    return BomEntry(f"/v/{number}.FCStd", f"u-{number}", number, number, quantity)


entries = st.lists(st.builds(entry, numbers, counts), max_size=8)
requests = st.lists(
    st.builds(lambda n, q: {"child_part_number": n, "quantity": q}, numbers, amounts), max_size=8
)


@st.composite
def bom_lines(
    draw: st.DrawFn, sources: tuple[Any, ...] = (None, "assembly", "manual", "erp")
) -> list[dict[str, Any]]:
    """A parent's lines: any sources, relations, flags and notes; one line per number, relation and owner."""
    lines = []
    keys = st.tuples(
        numbers, st.sampled_from(["component", "alternate", "reference", None]), st.sampled_from(sources)
    )
    for number, rel_type, source in draw(
        st.lists(
            keys, max_size=8, unique_by=lambda k: (k[0], k[1] or "component", k[2] in (None, "assembly"))
        )
    ):
        line: dict[str, Any] = {"child_part_number": number, "quantity": draw(told | st.none())}
        line["notes"] = draw(st.text(max_size=5))
        line["unit"] = draw(st.sampled_from([None, None, "", "pcs", "m", "box"]))
        if rel_type is not None:
            line["rel_type"] = rel_type
        if source is not None:
            line["source"] = source
        if draw(st.booleans()):
            line["unreferenced_since"] = draw(st.sampled_from([None, "2025-01-01T00:00:00Z"]))
        lines.append(line)
    return lines


def belongs_to_people(line: dict[str, Any]) -> bool:
    """The rule, written a second time: an assembly owns pieces of a component, with its own name or none."""
    by_hand = line.get("rel_type") in ("alternate", "reference") or line.get("source") in ("manual", "erp")
    return by_hand or line.get("unit") in ("m", "box")


def merge(wanted: Any, lines: list[dict[str, Any]], when: str = "now") -> list[dict[str, Any]]:
    return apply_merge(lines, plan_merge(wanted, lines), when)


@given(entries)
def test_a_bom_does_not_differ_from_itself(mine: list[BomEntry]) -> None:
    """``diff(a, a)`` is empty: nothing added, removed, changed or in conflict."""
    remote = [
        {"child_part_number": e.part_number, "quantity": e.quantity, "source": "assembly"}
        for e in merge_lines(mine)
    ]
    diff = diff_bom(mine, remote)
    assert not diff.drifted
    assert len(diff.unchanged) == len(remote)


@given(requests, bom_lines())
def test_after_a_merge_only_unreferenced_manual_and_conflicts_are_left(
    wanted: list[dict[str, Any]], lines: list[dict[str, Any]]
) -> None:
    """Merging again changes nothing, to the last byte; comparing leaves nothing that a merge would write."""
    after = merge(wanted, lines, "first")
    assert merge(wanted, after, "second") == after
    diff = diff_bom(wanted, after)
    assert not diff.added
    assert not diff.quantity_changed
    assert {change.part_number for change in diff.removed} == {
        line["child_part_number"]
        for line in after
        if line.get("unreferenced_since") and not belongs_to_people(line)
    }
    assert not plan_merge(wanted, after).writes


@given(st.lists(requests, min_size=1, max_size=5), bom_lines())
def test_what_belongs_to_people_never_changes(
    merges: list[list[dict[str, Any]]], lines: list[dict[str, Any]]
) -> None:
    """Under any sequence of merges, lines of people stay as they were, and nothing is ever deleted."""
    before = [dict(line) for line in lines]
    after = lines
    for number, wanted in enumerate(merges):
        after = merge(wanted, after, str(number))
    assert after[: len(before)] != [] or not before
    for was, now in zip(before, after, strict=False):
        if belongs_to_people(was):
            assert now == was
        else:
            assert {k: v for k, v in now.items() if k not in ("quantity", "unreferenced_since")} == {
                k: v for k, v in was.items() if k not in ("quantity", "unreferenced_since")
            }


@given(requests, requests, bom_lines())
def test_the_last_merge_decides(
    first: list[dict[str, Any]], second: list[dict[str, Any]], lines: list[dict[str, Any]]
) -> None:
    """After two merges the quantities are those of the second; the first leaves only unreferenced lines."""
    after = merge(second, merge(first, lines))
    wanted = {change.part_number: change.quantity for change in diff_bom(second, []).added}
    owned = {line["child_part_number"]: line for line in after if not belongs_to_people(line)}
    for number, line in owned.items():
        if number in wanted:
            assert same_quantity(line["quantity"], wanted[number])
            assert not line.get("unreferenced_since")
        else:
            assert line.get("unreferenced_since")


@given(requests, bom_lines(), st.randoms(use_true_random=False))
def test_comparing_is_order_free(
    wanted: list[dict[str, Any]], lines: list[dict[str, Any]], random: Any
) -> None:
    """Neither the order of the request nor that of the server's lines matters."""
    mixed, shuffled = wanted[:], lines[:]
    random.shuffle(mixed)
    random.shuffle(shuffled)
    one, two = diff_bom(wanted, lines), diff_bom(mixed, shuffled)
    for kind in ("added", "removed", "quantity_changed", "unchanged", "manual", "conflicts"):
        left, right = ({row["part_number"]: row for row in getattr(diff, kind)} for diff in (one, two))
        assert left.keys() == right.keys()
    assert summary(one) == summary(two)


@given(requests, bom_lines())
def test_every_line_of_either_side_is_reported(
    wanted: list[dict[str, Any]], lines: list[dict[str, Any]]
) -> None:
    """A number that either side has stands somewhere, and one of ours in one place only."""
    diff = diff_bom(wanted, lines)
    kinds = [diff.added, diff.removed, diff.quantity_changed, diff.unchanged, diff.manual, diff.conflicts]
    told_numbers = {row["part_number"] for kind in kinds for row in kind}
    assert told_numbers == {row["child_part_number"] for row in (*wanted, *lines)}
    ours = Counter(
        row["part_number"]
        for kind in (diff.added, diff.removed, diff.quantity_changed, diff.unchanged)
        for row in kind
    )
    assert all(count == 1 for count in ours.values())


# --- resolving --------------------------------------------------------------------------------------------

uuids = st.sampled_from(["u1", "u2", "u3", "u4", None])


def trees(depth: int = 2) -> st.SearchStrategy[BomEntry]:
    children = st.lists(trees(depth - 1), max_size=3) if depth else st.just([])
    return st.builds(
        lambda uuid, quantity, below, name: BomEntry(
            f"/v/{name}-{uuid}.FCStd", uuid, quantity=quantity, children=tuple(below), object_name="Body"
        ),
        uuids,
        counts,
        children,
        st.sampled_from("abcdef"),
    )


class Server:
    def __init__(self, known: dict[str, str]) -> None:
        self.known = known

    def get_item_by_uuid(self, uuid: str) -> dict[str, str] | None:
        return {"part_number": self.known[uuid], "name": "x"} if uuid in self.known else None


@given(
    st.lists(trees(), max_size=5),
    st.dictionaries(st.sampled_from(["u1", "u2", "u3", "u4"]), st.sampled_from(["P-1", "P-2"])),
)
def test_resolving_loses_and_invents_nothing(tree: list[BomEntry], known: dict[str, str]) -> None:
    """Per number, the lines' quantities are the sum of the entries'; what has no number is unresolved."""
    resolved, unresolved = resolve_part_numbers(tree, Server(known))
    wanted: Counter[str] = Counter()
    for e in tree:
        if e.silo_uuid in known:
            wanted[known[e.silo_uuid]] += e.quantity
    assert {e.part_number: e.quantity for e in resolved} == wanted
    assert len({e.part_number for e in resolved}) == len(resolved)

    def nameless(group: tuple[BomEntry, ...] | list[BomEntry]) -> set[tuple[str, str]]:
        own = {e.key for e in group if e.silo_uuid not in known}
        return own.union(*(nameless(e.children) for e in group)) if group else own

    assert {e.key for e in unresolved} == nameless(tree)
    assert len(unresolved) == len(nameless(tree))
