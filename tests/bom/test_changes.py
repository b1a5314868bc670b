# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two states of assemblies compared: the parts that came, went, moved and changed in number."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from silo.bom.compare.states import ComparedAssembly
from silo.bom.compare.three_states import compare_three
from silo.bom.compare.two_states import changes_json, compare_assemblies
from silo.bom.entry import BomEntry


def entry(path: str, quantity: int = 1, uuid: str | None = None, name: str = "Body") -> BomEntry:
    return BomEntry(doc_path=path, object_name=name, silo_uuid=uuid, quantity=quantity)


def assembly(path: str, *lines: BomEntry, uuid: str | None = None) -> ComparedAssembly:
    return ComparedAssembly(entry(path, uuid=uuid), lines)


def told(
    old: Sequence[ComparedAssembly], new: Sequence[ComparedAssembly]
) -> list[tuple[str, str, list[tuple[str, str]]]]:
    return [
        (change.head.doc_path, change.kind, [(line.entry.doc_path, line.kind) for line in change.lines])
        for change in compare_assemblies(old, new)
    ]


def test_added_removed_and_changed_quantities() -> None:
    old = [assembly("top", entry("bolt", 12), entry("cover"), entry("plate"))]
    new = [assembly("top", entry("bolt", 16), entry("plate"), entry("lid", 2))]
    lines = [("bolt", "quantity_changed"), ("lid", "added"), ("cover", "removed")]
    assert told(old, new) == [("top", "changed", lines)]
    data = changes_json(compare_assemblies(old, new))[0]["lines"]
    assert [(line["old_quantity"], line["new_quantity"]) for line in data] == [(12, 16), (None, 2), (1, None)]


def test_a_renamed_file_with_its_identity_is_moved_not_removed_and_added() -> None:
    old = [assembly("top", entry("a", uuid="U"), uuid="T")]
    new = [assembly("new/top", entry("b", uuid="U"), uuid="T")]
    assert told(old, new) == [("new/top", "changed", [("b", "moved")])]
    (change,) = changes_json(compare_assemblies(old, new))
    assert change["moved_from"] == {"doc_path": "top", "object": "Body"}
    assert change["lines"][0]["moved_from"] == {"doc_path": "a", "object": "Body"}


def test_an_assembly_that_only_moved_is_reported() -> None:
    old, new = [assembly("x", entry("a"), uuid="T")], [assembly("y", entry("a"), uuid="T")]
    assert told(old, new) == [("y", "moved", [])]


def test_registering_a_part_is_no_change_of_the_bom() -> None:
    assert told([assembly("top", entry("a"))], [assembly("top", entry("a", uuid="U"))]) == []


def test_a_file_that_another_part_took_over_is_another_part() -> None:
    old = [assembly("top", entry("a", uuid="U"))]
    new = [assembly("top", entry("a", uuid="V"))]
    assert told(old, new) == [("top", "changed", [("a", "added"), ("a", "removed")])]


def test_two_parts_that_swap_their_files_stay_what_they_are() -> None:
    old = [assembly("top", entry("a", 1, "U"), entry("b", 2, "V"))]
    new = [assembly("top", entry("b", 1, "U"), entry("a", 2, "V"))]
    assert told(old, new) == [("top", "changed", [("b", "moved"), ("a", "moved")])]


def test_an_identity_that_a_copy_shares_does_not_decide() -> None:
    old = [assembly("top", entry("a", 1, "U"), entry("b", 5, "U"))]
    new = [assembly("top", entry("a", 1, "U"), entry("b", 4, "U"))]
    assert told(old, new) == [("top", "changed", [("b", "quantity_changed")])]


def test_new_and_removed_assemblies_come_with_their_lines() -> None:
    one, other = assembly("one", entry("a")), assembly("other", entry("b"))
    assert told([one], [other]) == [
        ("other", "added", [("b", "added")]),
        ("one", "removed", [("a", "removed")]),
    ]


paths = st.sampled_from("abcdef")
lines_of = st.dictionaries(paths, st.tuples(st.integers(1, 5), st.sampled_from([None, "U", "V", "W"])))
states = st.dictionaries(paths, lines_of, max_size=4).map(
    lambda found: [
        assembly("asm/" + top, *(entry(path, n, uuid) for path, (n, uuid) in lines.items()))
        for top, lines in found.items()
    ]
)


@given(states)
def test_a_state_does_not_differ_from_itself(state: list[ComparedAssembly]) -> None:
    assert compare_assemblies(state, state) == ()


@given(states, states)
def test_the_changes_turn_the_old_state_into_the_new_one(
    old: list[ComparedAssembly], new: list[ComparedAssembly]
) -> None:
    """Every line of both states is either untouched or named once by a change, with its own quantity."""
    state = {a.head.key: {line.key: line.quantity for line in a.lines} for a in old}
    changes = compare_assemblies(old, new)
    for change in changes:
        lines = state.pop(change.old.head.key) if change.old else {}
        for line in change.lines:
            if line.old:
                assert lines.pop(line.old.key) == line.old.quantity
        for line in change.lines:
            if line.new:
                assert line.new.key not in lines
                lines[line.new.key] = line.new.quantity
        if change.new:
            state[change.new.head.key] = lines
        else:
            assert lines == {}
    assert state == {a.head.key: {line.key: line.quantity for line in a.lines} for a in new}


# --- three states ----------------------------------------------------------------------------------------


def three(
    base: ComparedAssembly | None, theirs: ComparedAssembly, mine: ComparedAssembly
) -> dict[str, tuple[float, float, float]]:
    return {row.entry.doc_path: row.quantities for row in compare_three(base, theirs, mine)}


def test_what_two_people_did_to_one_assembly() -> None:
    """What mine would undo comes first; what nobody changed is not in it."""
    base = assembly("top", entry("a", 4), entry("b"), entry("c"), entry("same"))
    theirs = assembly("top", entry("b"), entry("c", 2), entry("same"), entry("new"))
    mine = assembly("top", entry("a", 4), entry("c", 3), entry("same"))
    rows = compare_three(base, theirs, mine)
    assert three(base, theirs, mine) == {"a": (4, 0, 4), "c": (1, 2, 3), "new": (0, 1, 0), "b": (1, 1, 0)}
    assert [(row.entry.doc_path, row.undoes) for row in rows][-1] == ("b", False)
    assert all(row.undoes for row in rows[:-1])


def test_a_part_that_both_added_or_moved_is_one_line() -> None:
    """By its identity, wherever its file is."""
    base = assembly("top", entry("a", uuid="A"))
    theirs = assembly("top", entry("x/a", uuid="A"), entry("n", 2, uuid="N"))
    mine = assembly("top", entry("a", uuid="A"), entry("m", 3, uuid="N"))
    assert three(base, theirs, mine) == {"m": (0, 2, 3)}


def test_without_a_base_it_is_what_the_two_differ_in() -> None:
    """Who changed it is not known."""
    theirs, mine = assembly("top", entry("a"), entry("b")), assembly("top", entry("a"), entry("c", 2))
    assert three(None, theirs, mine) == {"b": (0, 1, 0), "c": (0, 0, 2)}


QUANTITIES = st.dictionaries(st.sampled_from("abcd"), st.integers(1, 3))


@given(QUANTITIES, QUANTITIES, QUANTITIES)
def test_every_change_of_theirs_that_mine_does_not_have_is_named(
    base: dict[str, int], theirs: dict[str, int], mine: dict[str, int]
) -> None:
    """A law: the lines that would be undone are exactly those that they changed and mine has otherwise."""

    def state(lines: dict[str, int]) -> ComparedAssembly:
        return assembly("top", *(entry(name, quantity) for name, quantity in lines.items()))

    rows = compare_three(state(base), state(theirs), state(mine))
    undone = {row.entry.doc_path for row in rows if row.undoes}
    names = {*base, *theirs, *mine}
    assert undone == {n for n in names if theirs.get(n) != base.get(n) and theirs.get(n) != mine.get(n)}
    assert {row.entry.doc_path for row in rows} == {
        n for n in names if not base.get(n) == theirs.get(n) == mine.get(n)
    }
