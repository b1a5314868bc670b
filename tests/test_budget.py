# SPDX-License-Identifier: LGPL-2.1-or-later
"""Budgets: each limit is reached one beyond it, with a sentence; JSON is counted before it is parsed."""

from __future__ import annotations

import json
import tracemalloc
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bounded_json import read_json
from silo.budget import Account, Budget, Limit, OverBudgetError

SMALL = Budget(bytes=2048, objects=5, cells=20, depth=3, text=4)
WIDE = Budget(bytes=1 << 30, objects=1 << 30, cells=1 << 30, depth=1 << 30, text=1 << 30)


@pytest.mark.parametrize(
    ("limit", "take", "sentence"),
    [
        (
            Limit.BYTES,
            lambda account, more: account.take_bytes(2048 + more),
            "unpacked, it is larger than 2 KiB",
        ),
        (Limit.OBJECTS, lambda account, more: account.take_objects(5 + more), "it holds more than 5 objects"),
        (Limit.CELLS, lambda account, more: account.take_cells(20 + more), "it holds more than 20 values"),
        (
            Limit.DEPTH,
            lambda account, more: account.check_depth(3 + more),
            "it is nested deeper than 3 levels",
        ),
        (Limit.TEXT, lambda account, more: account.check_text("x" * (4 + more)), "longer than 4 characters"),
    ],
)
def test_a_limit_is_reached_one_beyond_it(limit: Limit, take: Any, sentence: str) -> None:
    account = SMALL.account("offer.xlsx")
    take(account, 0)
    with pytest.raises(OverBudgetError, match=rf"^offer.xlsx: .*{sentence}$") as caught:
        take(SMALL.account("offer.xlsx"), 1)
    assert caught.value.limit is limit


def test_what_was_taken_adds_up() -> None:
    account: Account = SMALL.account("a.glb")
    for _ in range(5):
        account.take_objects()
    with pytest.raises(OverBudgetError):
        account.take_objects()


def _counted(value: Any) -> tuple[int, int]:
    """Count containers and values of parsed JSON, by walking."""
    if isinstance(value, dict):
        inner = [_counted(each) for each in value.values()]
        own = len(value)
    elif isinstance(value, list):
        inner, own = [_counted(each) for each in value], 0
    else:
        return 0, 1
    return 1 + sum(a for a, _ in inner), 1 + own + sum(b for _, b in inner)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(alphabet='a"\\{}[],: \n∢', max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(alphabet='k"{,', max_size=3), inner),
    max_leaves=12,
)


@given(VALUES, st.sampled_from(["utf-8", "utf-16", "utf-32-le"]), st.booleans())
def test_json_is_read_up_to_its_budget_whatever_its_texts_hold(
    value: Any, encoding: str, plain: bool
) -> None:
    containers, values = _counted(value)
    data = json.dumps(value, ensure_ascii=plain).encode(encoding)
    # Each value stands behind a sign, but for the first of a container that holds nothing else.
    exact = Budget(bytes=len(data), objects=containers, cells=values + 1, depth=99, text=0)
    assert read_json(data, exact, "a") == value
    if containers:
        with pytest.raises(OverBudgetError, match="more than"):
            read_json(data, Budget(len(data), containers - 1, values + 1, 99, 0), "a")
    with pytest.raises(OverBudgetError, match="larger than"):
        read_json(data, Budget(len(data) - 1, containers, values + 1, 99, 0), "a")


def test_what_is_beyond_the_budget_is_never_built() -> None:
    data = b"[" + b"{}," * 300_000 + b"{}]"
    tracemalloc.start()
    try:
        with pytest.raises(OverBudgetError, match="more than 1000 objects"):
            read_json(data, Budget(bytes=1 << 20, objects=1000, cells=1 << 30, depth=9, text=9), "an answer")
        held = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert held < 3 * len(data)  # 300 000 empty objects take 20 MB


@pytest.mark.parametrize("broken", [b"", b'{"a', b'["\\', b"[1,}", b"\xff\xfe\x00"])
def test_broken_json_is_an_error_of_value(broken: bytes) -> None:
    with pytest.raises(ValueError):
        read_json(broken, WIDE, "a")


def test_nesting_without_end_is_refused_with_a_sentence() -> None:
    with pytest.raises(OverBudgetError, match=r"^a: it is nested too deep$") as caught:
        read_json(b"[" * 200_000, WIDE, "a")
    assert caught.value.limit is Limit.DEPTH


@pytest.mark.parametrize("text", [b'"\\"', b'"', b"\\", b'""'])
def test_texts_without_an_end_are_read_once(text: bytes) -> None:
    account = Budget(bytes=1 << 30, objects=1, cells=1, depth=1, text=1).account("a")
    with pytest.raises(OverBudgetError):
        read_json(b"[[" + text * 500_000, account.budget, "a")
