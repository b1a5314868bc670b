# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one retry and error policy: each error of the tree has its verdict; what may be repeated, and when."""

from __future__ import annotations

import inspect
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.api.client import SiloClient
from silo.api.pause import LONGEST_TOLD, Pause
from silo.api.policy import Backoff, ErrorScope, Then, Verdict, judge, may_repeat, pause_after
from silo.api.replies import WebPageError
from silo.bom import errors
from silo.bom.errors import (
    BusyError,
    CycleError,
    DocumentError,
    NewerRevisionError,
    NotSentError,
    SiloError,
    UnreachableError,
)

ENTRY_PERSON, ALL_RETRY = (ErrorScope.ENTRY, Then.PERSON), (ErrorScope.ALL, Then.RETRY)
VERDICTS = {
    "SiloError": ENTRY_PERSON,
    "InputError": ENTRY_PERSON,
    "DocumentError": ENTRY_PERSON,
    "ConfigError": (ErrorScope.ALL, Then.PERSON),
    "PackageError": (ErrorScope.ALL, Then.PERSON),
    "RemoteError": ENTRY_PERSON,
    "UnreachableError": ALL_RETRY,
    "NotSentError": ALL_RETRY,
    "BusyError": ALL_RETRY,
    "AuthError": (ErrorScope.ALL, Then.PERSON),
    "ForbiddenError": (ErrorScope.KIND, Then.PERSON),
    "NotFoundError": (ErrorScope.ENTRY, Then.RETRY),
    "RouteMissingError": (ErrorScope.KIND, Then.RETRY),
    "RejectedError": ENTRY_PERSON,
    "ReadOnlyError": ALL_RETRY,
    "ServerFaultError": (ErrorScope.ENTRY, Then.RETRY),
    "SeveralAssembliesError": ENTRY_PERSON,
    "ConflictError": ENTRY_PERSON,
    "CycleError": ENTRY_PERSON,
    "VersionConflictError": ENTRY_PERSON,
    "MissingRevisionError": ENTRY_PERSON,
    "NewerRevisionError": ENTRY_PERSON,
    "CancelledError": ALL_RETRY,
}
TREE = [cls for _, cls in inspect.getmembers(errors, inspect.isclass) if issubclass(cls, SiloError)]


def made(kind: type[SiloError]) -> SiloError:
    """An error of this class."""
    if issubclass(kind, DocumentError):
        return kind("a.FCStd", "x")
    if issubclass(kind, NewerRevisionError):
        return kind("x", {"revision_number": 2})
    return kind(["A", "A"]) if issubclass(kind, CycleError) else kind("x")


@pytest.mark.parametrize("kind", TREE)
def test_every_error_has_its_verdict(kind: type[SiloError]) -> None:
    """A new class in the tree needs a decision here."""
    verdict = judge(made(kind))
    assert (verdict.scope, verdict.then) == VERDICTS[kind.__name__]


@pytest.mark.parametrize("kind", ["UnreachableError", "ServerFaultError", "WebPageError"])
def test_a_plain_question_distinguishes_one_entry_from_all(kind: str) -> None:
    """A 500, a cut answer or a proxy's page for one item: where the server answers, the others pass."""
    error = WebPageError("x") if kind == "WebPageError" else getattr(errors, kind)("x")

    def dead() -> None:
        raise UnreachableError("y")

    assert judge(error, lambda: None) == Verdict(ErrorScope.ENTRY, Then.RETRY)
    assert judge(error, dead) == Verdict(ErrorScope.ALL, Then.RETRY)


def test_nobody_is_asked_where_the_error_says_it_all() -> None:
    """A refused token or a busy server needs no second question."""

    def never() -> None:
        raise AssertionError("asked")

    for kind in (errors.AuthError, BusyError, errors.NotSentError, errors.RejectedError):
        judge(kind("x"), never)


def test_the_time_that_the_server_named_is_in_the_verdict() -> None:
    """Within bounds: a server may not put a commit off for a year."""
    for told, wait in ((40.0, 40.0), (1e9, LONGEST_TOLD)):
        for kind in (BusyError, errors.ReadOnlyError):
            error = kind("x")
            error.retry_after = told
            assert judge(error).wait == wait


@pytest.mark.parametrize("kind", TREE)
def test_a_change_is_repeated_only_where_it_was_not_processed(kind: type[SiloError]) -> None:
    """It never left, or the server put it off."""
    error = made(kind)
    assert may_repeat(error, harmless=False) == (kind.__name__ in ("NotSentError", "BusyError"))
    assert may_repeat(error, harmless=True) == isinstance(error, UnreachableError)


@given(
    attempt=st.integers(1, 10_000),
    chance=st.floats(0, 1, exclude_max=True),
    told=st.none() | st.floats(0, 1e6),
)
def test_pauses_are_bounded_and_never_shorter_than_asked(
    attempt: int, chance: float, told: float | None
) -> None:
    """Half of the full pause at least, the longest one at most, unless the server asks for more."""
    pause = Backoff(1.0, 60.0).pause(attempt, chance, told)
    assert pause >= (told or 0.0)
    assert 0.5 <= pause <= max(60.0, told or 0.0)
    if told is None:  # many clients do not come back in one moment
        assert pause == pytest.approx(min(60.0, 2.0 ** (min(attempt, 60) - 1)) * (1 - chance / 2))


@pytest.mark.parametrize(("status", "headers"), [(429, {}), (503, {"Retry-After": "7"})])
def test_a_change_that_was_put_off_is_sent_again(
    server: Any, client: SiloClient, answer: Any, pauses: list[float], status: int, headers: dict[str, str]
) -> None:
    """Neither lost nor doubled: the server said that it did not process it."""
    made_item = {"id": "11111111-1111-4111-8111-111111111111", "part_number": "F01-0001"}
    server.on("POST /api/items", answer(status, {"error": "slow down"}, headers), answer(201, made_item))
    assert client.create_item("kindred-rd", "F01", "Bolt").part_number == "F01-0001"
    assert pauses == ([7.0] if headers else [0.5])


@pytest.mark.parametrize(
    ("left", "told", "kept"), [(600.0, True, True), (math.inf, False, True), (2.0, True, False)]
)
def test_a_pause_that_was_promised_is_not_cut_short(left: float, told: bool, kept: bool) -> None:
    """By the live connection that breaks meanwhile, for one."""
    before = Pause(1000.0 + left, "put off", "busy", 3, told)
    after = pause_after(NotSentError("refused"), before, 1000.0, Backoff(first=5.0), 0.0)
    assert after == (before if kept else Pause(1040.0, "refused", "unreachable", 4, told=False))


def test_a_person_who_is_back_in_the_network_waits_a_minute_at_most() -> None:
    """However often it failed; a server in other trouble is left alone for longer."""
    before = Pause(1000.0, "refused", "unreachable", 20, told=False)
    for error, most in ((NotSentError("refused"), 60.0), (errors.ServerFaultError("500"), 900.0)):
        after = pause_after(error, before, 1000.0, Backoff(first=5.0, longest=900.0), 0.0)
        assert after.left(1000.0) == most
