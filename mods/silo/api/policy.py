# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one retry and error policy: for single requests, the queue, the event listener, timers and batches.

Three questions about an error have their answer here and nowhere else:

* :func:`may_repeat`: may this very request be sent again at once?
* :func:`judge`: whom does the error concern, and who can repair it?
* :class:`Backoff`: how long is the pause before the next attempt? A :class:`~silo.api.pause.Pause` is that of
  one server.

=========================================  =============  ==================================================
error                                      concerns       then
=========================================  =============  ==================================================
no answer, 5xx, a proxy's web page         one or all (1) retry
429, 503 with Retry-After, read-only       all            retry, not before the time that the server named
401, an unusable configuration             all            a user: token, settings
cancelled                                  all            retry when a user wants it
403, a request that the server lacks       one kind (2)   a user (403); retry (a newer server may have it)
404                                        one            retry (the server may be another one for a while)
409, 412, other 4xx, bad input             one            a user
=========================================  =============  ==================================================

1. ``alive`` finds out: where the server answers a plain question, only this entry has trouble.
2. A run that sends one kind of request stops. A queue continues: rights may differ between items.
"""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

from silo.api.pause import LONGEST_TOLD, Pause
from silo.api.replies import WebPageError
from silo.bom.errors import (
    AuthError,
    BusyError,
    CancelledError,
    ConfigError,
    ForbiddenError,
    NotFoundError,
    NotSentError,
    ReadOnlyError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)


class ErrorScope(StrEnum):
    """What an error concerns."""

    ENTRY = "entry"  # this item or entry; others may succeed
    KIND = "kind"  # every request of this kind
    ALL = "all"  # everything for this server


class Then(StrEnum):
    """Who can repair it."""

    RETRY = "retry"  # nothing needs to be done: try again later
    PERSON = "person"  # the answer stays the same until a user changes something


@dataclass(frozen=True)
class Verdict:
    """What to do after an error. ``wait``: seconds that the server asked for; None where it named none."""

    scope: ErrorScope
    then: Then
    wait: float | None = None


def judge(error: SiloError, alive: Callable[[], object] | None = None) -> Verdict:
    """Decide whom ``error`` concerns, and what helps.

    alive
        a plain question to the server, such as ``client.ready``; raises SiloError if it gets no answer. Asked
        only if the error itself does not show whether it concerns one entry or all.
    """
    wait = told_wait(error)
    if isinstance(error, (BusyError, ReadOnlyError, CancelledError)):
        return Verdict(ErrorScope.ALL, Then.RETRY, wait)
    if isinstance(error, ForbiddenError):
        return Verdict(ErrorScope.KIND, Then.PERSON)
    if isinstance(error, (AuthError, ConfigError)):
        return Verdict(ErrorScope.ALL, Then.PERSON)
    if isinstance(error, NotSentError):
        return Verdict(ErrorScope.ALL, Then.RETRY)
    if isinstance(error, (UnreachableError, ServerFaultError, WebPageError)):
        scope = ErrorScope.ALL if alive is None and isinstance(error, UnreachableError) else ErrorScope.ENTRY
        try:
            if alive is not None:
                alive()
        except SiloError:
            scope = ErrorScope.ALL
        return Verdict(scope, Then.RETRY, wait)
    if isinstance(error, RouteMissingError):
        return Verdict(ErrorScope.KIND, Then.RETRY)
    if isinstance(error, NotFoundError):
        return Verdict(ErrorScope.ENTRY, Then.RETRY, wait)
    return Verdict(ErrorScope.ENTRY, Then.PERSON)


def is_certain(error: SiloError) -> bool:
    """Return True if the server certainly did not do what was asked, and the error concerns only that: the
    rest may be sent.
    """
    if isinstance(error, ReadOnlyError):
        return not error.named
    if isinstance(error, UnreachableError):
        return error.refused
    lost = isinstance(error, ServerFaultError | WebPageError)
    return not lost and judge(error, lambda: None).scope is not ErrorScope.ALL


def ends_run(error: SiloError, api: object = None) -> bool:
    """Return True if a run that sends one kind of request for many items must not try the next item.

    api
        the server's client; its ``ready`` shows if only this item had trouble.
    """
    return judge(error, getattr(api, "ready", None)).scope is not ErrorScope.ENTRY


def told_wait(error: SiloError) -> float | None:
    """Return the pause that the server named with this error, in seconds, within bounds."""
    value = getattr(error, "retry_after", None)
    return None if value is None else min(float(value), LONGEST_TOLD)


def may_repeat(error: SiloError, *, harmless: bool) -> bool:
    """Return True if the same request may be sent again without a user.

    harmless
        the request may arrive twice: a question, or a change that names itself.

    Any other change is repeated only if the server certainly did not process it: it never left this computer,
    or the server asked to wait (429, 503 with Retry-After).
    """
    return isinstance(error, (NotSentError, BusyError)) or (harmless and isinstance(error, UnreachableError))


@dataclass(frozen=True)
class Backoff:
    """Growing pauses, in seconds: each is twice as long as the last."""

    first: float = 1.0
    longest: float = 60.0

    def pause(self, attempt: int, chance: float, wanted_s: float | None = None) -> float:
        """Return the pause [s] after failed attempt ``attempt`` (from 1).

        ``chance`` in [0, 1) takes off up to half, so that many clients do not return in one moment.
        ``wanted_s`` is the server's own wish: the pause is never shorter.
        """
        full = min(self.longest, self.first * 2.0 ** min(attempt - 1, 60))
        return max(full * (1.0 - chance / 2.0), wanted_s or 0.0)


# Of the queue of commits.
QUEUE_PAUSES = Backoff(first=5.0, longest=900.0)


REFUSED_PAUSES = Backoff(first=600.0, longest=900.0)
"""After a refused token: 5 to 15 minutes, unless a user acts before."""


def pause_after(
    error: SiloError, before: Pause | None, now: float, backoff: Backoff, chance: float, failures: int = 0
) -> Pause:
    """Make the pause after an error; ``failures`` counts the errors in a row before it, as ``before`` does.

    The known pause ``before`` is kept if it ends later, because another request was promised that time.
    """
    failures = max(failures, before.failures if before is not None else 0) + 1
    wait = told_wait(error)
    if isinstance(error, AuthError):  # a token may be refused for a while: the proxy, a restore, a rotation
        backoff = REFUSED_PAUSES
    if isinstance(error, UnreachableError):  # a user who is back in the network wants to see it soon
        backoff = replace(backoff, longest=max(backoff.first, min(backoff.longest, 60.0)))
    until = math.inf if isinstance(error, ConfigError) else now + backoff.pause(failures, chance, wait)
    if before is not None and before.until > until:
        return before
    return Pause(until, str(error), error.code, failures, wait is not None)


@dataclass(frozen=True)
class Retries:
    """How often one request is tried in all, the first pause and the longest one (seconds).

    ``busy_tries``: the same for a server that puts us off (429, 503 with Retry-After); None: ``tries``.
    ``chance`` gives numbers in [0, 1) that spread many clients out; ``sleep`` waits; ``tell`` gets the
    seconds of each pause and its error before.
    """

    tries: int = 3
    first: float = 0.25
    longest: float = 10.0
    chance: Callable[[], float] = random.random
    sleep: Callable[[float], object] = time.sleep
    busy_tries: int | None = None
    tell: Callable[[float, SiloError], object] = lambda _seconds, _error: None

    def pause(self, attempt: int, error: SiloError, *, harmless: bool) -> float | None:
        """Return how many seconds to wait after failed attempt ``attempt`` (from 1); None: give up and report
        the error.
        """
        value = getattr(error, "retry_after", None)
        tries = self.busy_tries if self.busy_tries and isinstance(error, BusyError) else self.tries
        if attempt >= tries or not may_repeat(error, harmless=harmless):
            return None
        if value is not None:
            return float(value) if value <= self.longest else None
        return Backoff(self.first, self.longest).pause(attempt, self.chance())


# A job at night waits for a server that is busy.
NIGHT = Retries(busy_tries=12, longest=120.0)
