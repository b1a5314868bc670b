# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where files are read when they are many: processes of this machine, or a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from typing import Any
from uuid import uuid4

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.platform.processes import workers
from silo.vault.questions import Done, KnownFiles, Question, collect_seldom, work

CHUNK = 64

# A worker process costs some 0.3 s to start; reading a file some milliseconds.
_WORTH_A_POOL = 128


def _end_processes(executor: Executor) -> None:
    # Python would wait for them at its end anyway, and sometimes fails then.
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

    def submit(self, questions: Sequence[Question], known_files: KnownFiles | None) -> Future[Done]:
        """Give questions to a worker. A future that failed if the workers are lost already."""
        if self._executor is None:
            self._executor = self._make()
        try:
            return self._executor.submit(work, questions, known_files, self._run)
        except BrokenExecutor as error:  # a worker died on earlier questions: all are asked again
            lost: Future[Done] = Future()
            lost.set_exception(error)
            return lost

    def renew(self) -> None:
        """Shut down an executor that lost its workers, or that is no longer needed."""
        if self._executor is not None:
            self._end(self._executor)
            self._executor = None


@contextmanager
def pool_of(jobs: int, dask: str | None = None, *, worth: int = _WORTH_A_POOL) -> Iterator[Pool | None]:
    """Yield a pool of processes on this machine, or of a Dask cluster at an address; None for one job."""
    if dask is not None:
        with _dask_client(dask) as client:
            workers = sum(client.nthreads().values())
            # Dask cancels tasks that are not waited for, even those that have begun.
            yield Pool(
                client.get_executor,
                max(1, workers),
                worth=worth,
                end=lambda executor: executor.shutdown(wait=False),
            )
        return
    pool = Pool(lambda: _processes(jobs), jobs, worth=worth) if jobs > 1 else None
    try:
        yield pool
    finally:
        if pool is not None:
            pool.renew()


def _processes(jobs: int) -> Executor:
    return workers(jobs, collect_seldom)


def _dask_client(address: str) -> Any:
    try:
        from dask.distributed import Client
    except ImportError as error:
        raise InputError(message("--dask needs the extra: pip install 'silo-mod[dask]'")) from error
    try:
        return Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            message("no Dask scheduler answers at {address}: {error}", address=address, error=error)
        ) from error
