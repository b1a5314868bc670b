# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where files are read when they are many: processes of this machine, or a Dask cluster."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_all_start_methods, get_context, parent_process
from typing import Any
from uuid import uuid4

from silo.bom.errors import InputError
from silo.vault.session import CHUNK, Done, Question, Supplies, collect_seldom, work

# A worker process costs some 0.3 s to start; reading a file some milliseconds.
_WORTH_A_POOL = 128


def _end_processes(executor: Executor) -> None:
    # Python would wait for them at the end anyway, and at times trips over it then.
    executor.shutdown(wait=True, cancel_futures=True)


class Pool:
    """Makes executors for the work, and another one where that broke.

    alone
        makes one for a single question that may end its process.
    worth
        so many files are read here before others are called in: they take a moment to start.
    chunk
        questions that travel together.
    end
        gives up an executor: what was not begun is dropped.
    """

    def __init__(
        self,
        make: Callable[[], Executor],
        jobs: int,
        *,
        alone: Callable[[], Executor] | None = None,
        worth: int = _WORTH_A_POOL,
        chunk: int = CHUNK,
        end: Callable[[Executor], None] = _end_processes,
    ) -> None:
        self.jobs, self.worth, self.chunk = jobs, worth, chunk
        self.alone = alone or (lambda: _processes(1))
        self._make, self._end = make, end
        self._run = str(uuid4())
        self._executor: Executor | None = None

    def submit(self, questions: Sequence[Question], supplies: Supplies | None) -> Future[Done]:
        """Have questions worked on."""
        if self._executor is None:
            self._executor = self._make()
        return self._executor.submit(work, questions, supplies, self._run)

    def renew(self) -> None:
        """Give up an executor that lost its workers, or that is no longer needed."""
        if self._executor is not None:
            self._end(self._executor)
            self._executor = None


@contextmanager
def pool_of(jobs: int, dask: str | None = None, *, worth: int = _WORTH_A_POOL) -> Iterator[Pool | None]:
    """Processes of this machine, or a Dask cluster at an address; None for one job."""
    if dask is not None:
        with _dask_client(dask) as client:
            workers = sum(client.nthreads().values())
            # Dask cancels where nobody waits, also what was begun.
            yield Pool(
                client.get_executor, max(1, workers), worth=worth, end=lambda one: one.shutdown(wait=False)
            )
        return
    pool = Pool(lambda: _processes(jobs), jobs, worth=worth) if jobs > 1 else None
    try:
        yield pool
    finally:
        if pool is not None:
            pool.renew()


def _processes(jobs: int) -> ProcessPoolExecutor:
    # Never by fork: a library may have threads that hold locks.
    context = get_context("forkserver" if "forkserver" in get_all_start_methods() else "spawn")
    return ProcessPoolExecutor(jobs, context, initializer=_begin_worker)


def _begin_worker() -> None:
    """Ctrl-C is the parent's affair; and no worker outlives a parent that was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    collect_seldom()
    if (parent := parent_process()) is not None:

        def watch() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()


def _dask_client(address: str) -> Any:
    try:
        from dask.distributed import Client
    except ImportError as error:
        raise InputError("--dask needs the extra: pip install 'silo-mod[dask]'") from error
    try:
        return Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(f"no Dask scheduler answers at {address}: {error}") from error
