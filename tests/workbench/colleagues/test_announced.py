# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whose commit is it that the server announces? Our own ones are no news."""

from __future__ import annotations

import random

from hypothesis import given
from hypothesis import strategies as st

from silo.workbench.colleagues.announced import Colleagues, Newer

ITEM = "5f0c"


def newer(revision: int) -> Newer:
    return Newer("M01-0001", revision, "somebody", 1.0)


def test_a_colleagues_commit_during_our_own_is_shown_after_it() -> None:
    """Ours is held, for it would undo theirs."""
    known = Colleagues()
    known.sending(ITEM)
    known.heard(ITEM, newer(3))
    known.sent([])
    assert known.newer == {ITEM: newer(3)}


def test_what_is_announced_after_the_server_was_asked_stays() -> None:
    """Its answer says nothing of that."""
    known = Colleagues()
    known.heard(ITEM, newer(4))
    seen = known.newer
    known.heard(ITEM, newer(2))
    known.gone(seen, [ITEM])
    assert known.newer == {ITEM: newer(2)}
    known.gone(known.newer, [ITEM.upper(), "another"])
    assert known.newer == {}


STEPS = st.lists(st.sampled_from(["mine", "theirs", "run ends"]), max_size=12)


@given(STEPS, st.randoms(use_true_random=False))
def test_whoever_commits_and_however_late_the_events_are(steps: list[str], chance: random.Random) -> None:
    """In the end a colleague's commit is shown if it is the newest, and nothing else is."""
    known, announced, newest = Colleagues(), [], ""
    for number, step in enumerate(steps, 1):
        if step == "run ends":
            known.sent([])
            continue
        newest = step
        if step == "mine":
            known.sending(ITEM.upper())
        announced.append(newer(number))
        # Events come in order, some before the answer and some after it.
        while announced and chance.random() < 0.6:
            known.heard(ITEM, announced.pop(0))
        if step == "mine":
            assert number not in [shown.revision for shown in known.newer.values()]
            known.arrived(ITEM, number)
    for late in announced:
        known.heard(ITEM, late)
    known.sent([])
    if newest == "mine":
        assert known.newer == {}
    elif newest == "theirs":
        assert list(known.newer) == [ITEM]
