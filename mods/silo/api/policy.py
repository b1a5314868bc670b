# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one retry and error policy: for single requests, the queue, the event listener, timers and batches.

Three questions about an error have their answer here and nowhere else:

* :func:`may_repeat`: may this very request be sent again at once?
* :func:`judge`: whom does the error concern, and who can mend it?
* :class:`Backoff`: how long is the pause before the next attempt?

=========================================  =============  ==================================================
error                                      concerns       then
=========================================  =============  ==================================================
no answer, 5xx, a proxy's web page         one or all (1) retry
429, 503 with Retry-After, read-only       all            retry, not before the time that the server named
401, an unusable configuration             all            a person: token, settings
cancelled                                  all            retry when a person wants it
403, a request that the server lacks       one kind (2)   a person (403); retry (a newer server may have it)
404, 409, 412, other 4xx, bad input        one            a person
=========================================  =============  ==================================================

1. ``alive`` finds out: where the server answers a plain question, only this entry has trouble.
2. A run that sends one kind of request stops. A queue continues: rights may differ between items.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from silo.api.replies import WebPageError
from silo.bom.errors import (
    AuthError,
    BusyError,
    CancelledError,
    ConfigError,
    ForbiddenError,
    NotSentError,
    ReadOnlyError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)

LONGEST_TOLD = 3600.0
"""Seconds: a server that names a longer pause is asked again after this one."""


class Scope(StrEnum):
    """What an error concerns."""

    ENTRY = "entry"  # this item or entry; the others may fare better
    KIND = "kind"  # every request of this kind
    ALL = "all"  # everything for this server


class Then(StrEnum):
    """Who can mend it."""

    RETRY = "retry"  # nobody need do anything: try again later
    PERSON = "person"  # the answer stays the same until a person changes something


@dataclass(frozen=True)
class Verdict:
    """What to do after an error. ``wait``: seconds that the server asked for; None where it named none."""

    scope: Scope
    then: Then
    wait: float | None = None


def judge(error: SiloError, alive: Callable[[], object] | None = None) -> Verdict:
    """Whom ``error`` concerns, and what helps.

    alive
        a plain question to the server, such as ``client.ready``; raises SiloError where it gets no answer.
        Asked only where the error itself does not say whether it concerns one entry or all.
    """
    wait = told_wait(error)
    if isinstance(error, (BusyError, ReadOnlyError, CancelledError)):
        return Verdict(Scope.ALL, Then.RETRY, wait)
    if isinstance(error, ForbiddenError):
        return Verdict(Scope.KIND, Then.PERSON)
    if isinstance(error, (AuthError, ConfigError)):
        return Verdict(Scope.ALL, Then.PERSON)
    if isinstance(error, NotSentError):
        return Verdict(Scope.ALL, Then.RETRY)
    if isinstance(error, (UnreachableError, ServerFaultError, WebPageError)):
        return Verdict(_scope(error, alive), Then.RETRY, wait)
    if isinstance(error, RouteMissingError):
        return Verdict(Scope.KIND, Then.RETRY)
    return Verdict(Scope.ENTRY, Then.PERSON)


def _scope(error: SiloError, alive: Callable[[], object] | None) -> Scope:
    if alive is None:
        return Scope.ALL if isinstance(error, UnreachableError) else Scope.ENTRY
    try:
        alive()
    except SiloError:
        return Scope.ALL
    return Scope.ENTRY


def ends_run(error: SiloError, api: object = None) -> bool:
    """True where a run over many items that sends one kind of request must not try the next one.

    api
        the server's client; its ``ready`` says whether only this item had trouble.
    """
    return judge(error, getattr(api, "ready", None)).scope is not Scope.ENTRY


def told_wait(error: SiloError) -> float | None:
    """The pause that the server named with this error, in seconds, within bounds."""
    told = getattr(error, "retry_after", None)
    return None if told is None else min(float(told), LONGEST_TOLD)


def may_repeat(error: SiloError, *, harmless: bool) -> bool:
    """True where the same request may be sent again by itself.

    harmless
        the request may arrive twice: a question, or a change that names itself.

    Any other change is repeated only where the server certainly did not process it: it never left this
    computer, or the server put it off (429, 503 with Retry-After).
    """
    if isinstance(error, ReadOnlyError):
        return False  # until a person changes that; waiting here would help nobody
    return isinstance(error, (NotSentError, BusyError)) or (harmless and isinstance(error, UnreachableError))


@dataclass(frozen=True)
class Backoff:
    """Growing pauses, in seconds."""

    first: float = 1.0
    factor: float = 2.0
    longest: float = 60.0

    def pause(self, attempt: int, chance: float, told: float | None = None) -> float:
        """The pause after failed attempt ``attempt`` (from 1).

        ``chance`` in [0, 1) takes off up to half, so that many clients do not return in one moment. ``told``
        is the server's own wish: the pause is never shorter.
        """
        full = min(self.longest, self.first * self.factor ** min(attempt - 1, 60))
        return max(full * (1.0 - chance / 2.0), told or 0.0)


@dataclass(frozen=True)
class Retries:
    """How often one request is tried in all, the first pause and the longest one (seconds).

    ``busy_tries``: the same for a server that puts us off (429, 503 with Retry-After); None: ``tries``.
    ``chance`` gives numbers in [0, 1) that spread many clients out; ``sleep`` waits.
    """

    tries: int = 3
    first: float = 0.25
    longest: float = 10.0
    chance: Callable[[], float] = random.random
    sleep: Callable[[float], object] = time.sleep
    busy_tries: int | None = None

    def pause(self, attempt: int, error: SiloError, *, harmless: bool) -> float | None:
        """Seconds to wait after failed attempt ``attempt`` (from 1); None: give up and report the error."""
        told = getattr(error, "retry_after", None)
        tries = self.busy_tries if self.busy_tries and isinstance(error, BusyError) else self.tries
        if attempt >= tries or not may_repeat(error, harmless=harmless):
            return None
        if told is not None:
            return float(told) if told <= self.longest else None
        return Backoff(self.first, 2.0, self.longest).pause(attempt, self.chance())
