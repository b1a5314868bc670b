# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the pane shows, as values."""

from __future__ import annotations

from activities import activity_of, entry_text
from hypothesis import given
from hypothesis import strategies as st

from silo.workbench.activity.box import MOST_LINES, Action, Do, EntryBatch, EntryLine, PaneEntry
from silo.workbench.activity.feed import MOST_ENTRIES, Activity, gathered
from silo.workbench.tone import Tone


def entry(key: str, when: float = 0.0, title: str = "x", rank: int = 0, also: str = "") -> PaneEntry:
    return PaneEntry(key=key, title=title, when=when, rank=rank, also=(also,) if also else ())


def keys(activity: Activity) -> list[str]:
    return [one.key for one in activity.entries]


def test_newest_first_also_when_reported_late() -> None:
    """An event that arrives late is put where its time belongs."""
    activity = activity_of([entry("a", 1), entry("c", 3), entry("b", 2)])
    assert keys(activity) == ["c", "b", "a"]


def test_of_equal_time_the_later_one_stands_first() -> None:
    """What was reported last is what a person looks for."""
    assert keys(activity_of([entry("a", 1), entry("b", 1)])) == ["b", "a"]


def test_the_same_key_replaces() -> None:
    """One box per sync."""
    activity = activity_of([entry("a", 1, "old"), entry("a", 2, "new")])
    assert [one.title for one in activity.entries] == ["new"]


def test_the_servers_event_does_not_replace_our_own_richer_box() -> None:
    """Whichever of the two comes first, our own stays."""
    ours, event = entry("sync:1", 1, "ours", rank=1), entry("sync:1", 2, "event")
    assert [e.title for e in activity_of([ours, event]).entries] == ["ours"]
    assert [e.title for e in activity_of([event, ours]).entries] == ["ours"]


def test_a_box_that_includes_another_takes_its_place() -> None:
    """The upload's event is part of our own commit's box."""
    ours, event = entry("sync:1", 1, "ours", rank=1, also="revision:A:2"), entry("revision:A:2", 2, "event")
    assert keys(activity_of([ours, event])) == ["sync:1"]
    assert keys(activity_of([event, ours])) == ["sync:1"]


def test_only_so_many_are_kept() -> None:
    """The oldest go."""
    activity = activity_of(entry(str(i), i) for i in range(MOST_ENTRIES + 50))
    assert len(activity.entries) == MOST_ENTRIES
    assert activity.entries[-1].key == "50"


def test_a_box_is_never_longer_than_can_be_read() -> None:
    """Ten thousand findings are some lines, the last of which counts the rest."""
    lines = tuple(EntryLine(f"finding {i}") for i in range(10_000))
    made = PaneEntry("k", "t", 0.0, lines=lines)
    assert len(made.lines) == MOST_LINES
    assert made.lines[-1].text == f"… and {10_001 - MOST_LINES} more lines; the preview shows all"


def test_text_in_boxes_is_harmless() -> None:
    """Titles, names and lines pass through the same cleaning."""
    made = PaneEntry("k", "\x1b[2J<b>", 0.0, who="a\nb", lines=(EntryLine("x\u202ey"),))
    assert (made.title, made.who, made.lines[0].text) == ("[2J<b>", "a b", "x y")


def test_a_box_as_plain_text() -> None:
    """The spec's box (§6)."""
    register = Action(Do.REGISTER, "Register Parts…")
    box = PaneEntry(
        "k",
        "BOM Updated: ASM-001",
        0.0,
        badges=(
            EntryLine("+1 added", Tone.GOOD),
            EntryLine("~1 qty changed", Tone.CHANGED),
            EntryLine("⚠1 unreferenced", Tone.WARNING),
        ),
        lines=(EntryLine("2 components have no Silo part number", Tone.WARNING, (register,)),),
        actions=(Action(Do.VIEW, "View in Silo →"),),
    )
    assert entry_text(box) == (
        "BOM Updated: ASM-001\n"
        "+1 added  ~1 qty changed  ⚠1 unreferenced\n"
        "2 components have no Silo part number [Register Parts…]\n"
        "[View in Silo →]"
    )


entries = st.builds(
    entry,
    key=st.sampled_from("abcdef"),
    when=st.floats(min_value=0, max_value=9, allow_nan=False),
    rank=st.integers(min_value=0, max_value=1),
)


@given(st.lists(entries, max_size=40))
def test_always_sorted_unique_and_never_poorer(told: list[PaneEntry]) -> None:
    """Whatever comes in whatever order: newest first, one per key, the highest rank of each key wins."""
    activity = activity_of(told)
    whens = [one.when for one in activity.entries]
    assert whens == sorted(whens, reverse=True)
    assert sorted(keys(activity)) == sorted({one.key for one in told})
    for one in activity.entries:
        assert one.rank == max(other.rank for other in told if other.key == one.key)


def news(
    number: int, when: float, part_of: EntryBatch | None = EntryBatch.CREATED, who: str = "ann"
) -> PaneEntry:
    return PaneEntry(f"e{number}", f"New item: M01-{number:04}", when, who=who, part_of=part_of)


def test_a_batch_is_one_box() -> None:
    """54 registered parts bury nothing: the BOM that came between them stands by itself."""
    bom = entry("bom", 20.5, "BOM Updated: A01-0001")
    shown = gathered(activity_of([*(news(n, n) for n in range(54)), bom]).entries)
    assert [one.title for one in shown] == ["54 new items", "BOM Updated: A01-0001"]
    assert shown[0].when == 53
    assert shown[0].lines[0].text.startswith("M01-0000, M01-0001, ")
    assert shown[0].lines[0].text.endswith(", …")


def test_two_are_no_batch_nor_is_what_lies_apart() -> None:
    """Nor what two people did, nor what has something of its own to say."""
    two = [news(1, 1), news(2, 2)]
    apart = [news(1, 0), news(2, 100), news(3, 200)]
    people = [news(n, n, who=who) for n, who in enumerate(("ann", "bob", "ann", "bob"))]
    own = [news(n, n, None) for n in range(9)]
    for entries in (two, apart, people, own):
        listed = activity_of(entries).entries
        assert gathered(listed) == listed


@given(st.lists(st.tuples(st.integers(0, 500), st.sampled_from([None, *EntryBatch]))))
def test_gathering_loses_nothing(told: list[tuple[int, EntryBatch | None]]) -> None:
    """Newest first, and every box is shown or counted."""
    entries = [news(n, when, part_of) for n, (when, part_of) in enumerate(told)]
    shown = gathered(activity_of(entries).entries)
    assert [one.when for one in shown] == sorted((one.when for one in shown), reverse=True)
    counts = [int(one.title.split()[0]) if one.key.startswith("batch:") else 1 for one in shown]
    assert sum(counts) == len(entries)


def asking(key: str, when: float, *files: str, document: str = "/v/Top.FCStd") -> PaneEntry:
    question = EntryLine(
        "2 files carry the same Silo identity",
        Tone.WARNING,
        (Action(Do.SAME, "Same part", "ID", document, files), Action(Do.DECIDE, "New part…")),
    )
    other = EntryLine("a link is broken", Tone.ERROR, (Action(Do.SHOW, "Show"),))
    return PaneEntry(key, "x", when, lines=(question, other), document=document)


def buttons(activity: Activity, key: str) -> list[str]:
    (box,) = (one for one in activity.entries if one.key == key)
    return [action.text for line in box.lines for action in line.actions]


def test_only_the_newest_box_of_an_assembly_asks() -> None:
    """It has all questions that are open; boxes of other assemblies, and newer ones, keep theirs."""
    other = asking("other", 1, "/v/a", document="/v/Other.FCStd")
    activity = activity_of([asking("old", 1, "/v/a", "/v/b"), other, asking("late", 9, "/v/a")])
    activity = activity.add(PaneEntry("new", "x", 2, document="/v/Top.FCStd"))
    assert buttons(activity, "old") == ["Show"]
    assert buttons(activity, "other") == buttons(activity, "late") == ["Same part", "New part…", "Show"]
    # A colleague's event says nothing of this computer's files.
    assert buttons(activity.add(entry("event", 10)), "late") == ["Same part", "New part…", "Show"]


def test_an_answer_takes_the_buttons_of_its_question_alone() -> None:
    """Of each box that asks it."""
    activity = activity_of([asking("one", 1, "/v/a", "/v/b"), asking("two", 2, "/v/c", document="/v/X")])
    done = activity.answered(lambda asked: "/v/a" in asked.objects)
    assert buttons(done, "one") == ["Show"]
    assert buttons(done, "two") == ["Same part", "New part…", "Show"]
