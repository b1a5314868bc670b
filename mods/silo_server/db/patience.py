# SPDX-License-Identifier: LGPL-2.1-or-later
"""A PostgreSQL connection that gives up: psycopg waits without end for a server that is stopped or frozen."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import Any

import psycopg


class _Connection(psycopg.Connection[Any]):
    seconds = 0.0

    def wait(self, gen: Generator[Any, Any, Any], *more: Any, **named: Any) -> Any:
        return super().wait(self._bounded(gen), *more, **named)

    def _bounded(self, gen: Generator[Any, Any, Any]) -> Generator[Any, Any, Any]:
        # psycopg resumes its generator several times a second, whether the server has said anything or not.
        end = time.monotonic() + self.seconds
        try:
            wanted = next(gen)
            while True:
                ready = yield wanted
                if not ready and time.monotonic() > end:
                    self.pgconn.finish()
                    raise psycopg.OperationalError(f"the database said nothing for {self.seconds:g} s")
                wanted = gen.send(ready)
        except StopIteration as done:
            return done.value


def connect(seconds: float, *args: Any, **named: Any) -> psycopg.Connection[Any]:
    """Connect; a statement that brings no answer within ``seconds`` is an OperationalError."""
    connection = _Connection.connect(*args, **named)
    connection.seconds = seconds
    return connection
