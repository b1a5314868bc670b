# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading many files: each question about a file once, from the index or by any executor.

A question has a file and a kind: the whole BOM below its assembly, or that one assembly alone. It is answered
in a session of its own, so that the answer's trail is exactly what the session has read; what files hold is
shared between the sessions of a worker. Work travels as chunks of neighbouring files, for files of one folder
use each other. Answers come back in the order of the questions, whoever found them.
"""

from __future__ import annotations

import json
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from multiprocessing import get_all_start_methods, get_context, parent_process
from typing import Any
from uuid import uuid4

from silo.bom.errors import DocumentError, InputError, SiloError
from silo.bom.findings import respelt_findings
from silo.bom.links import extract
from silo.bom.model import Extraction
from silo.bom.roots import choose_assembly
from silo.bom.snapshot import from_plain, to_plain
from silo.fcstd.library import Contents, Library
from silo.fcstd.locate import Locator
from silo.vault.index import Index, Known, engine

CHUNK = 64
# A worker process costs some 0.3 s to start; reading a file some milliseconds.
_WORTH_A_POOL = 128
_TRIES = 3
_WORKER_LOST = (BrokenProcessPool, CancelledError)


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked of a file.

    assembly
        name or label of the one meant, where the file holds several; None for the likeliest.
    name_only
        ``assembly`` is the internal name of any object that may hold components.
    below
        the whole tree, or the one assembly alone (:func:`silo.bom.links.extract`).
    """

    path: str
    assembly: str | None = None
    hardware: bool = True
    below: bool = False
    name_only: bool = False

    def __post_init__(self) -> None:
        # Another process, and another day, have other current folders.
        object.__setattr__(self, "path", os.path.abspath(self.path))

    @property
    def name(self) -> str:
        """For the index."""
        words = ("bom" if self.below else "level") + ("" if self.hardware else " without hardware")
        mark = "#" if self.name_only else "="
        return f"{engine()} {words} {'' if self.assembly is None else mark + self.assembly}"


@dataclass(frozen=True)
class Answer:
    """What was found out."""

    question: Question
    known: Known

    @cached_property
    def plain(self) -> dict[str, Any]:
        """As :mod:`silo.bom.snapshot` writes an extraction; or the one key of an error."""
        data: dict[str, Any] = json.loads(self.known.answer)
        return data

    @property
    def found(self) -> Extraction | SiloError:
        """The BOM, or why there is none."""
        if "document" in self.plain:
            return DocumentError(*self.plain["document"])
        if "input" in self.plain:
            return InputError(self.plain["input"])
        return from_plain(self.plain)


# --- in the worker --------------------------------------------------------------------------------------


class Session:
    """What a worker keeps between questions."""

    def __init__(self, contents: Contents | None = None) -> None:
        self.contents = contents or Contents()
        self.locator = Locator()

    def ask(self, question: Question) -> Known:
        """The answer with its trail."""
        library = Library(contents=self.contents, locator=self.locator)
        plain: dict[str, Any]
        try:
            document = library.open(question.path)
            top = document.getObject(question.assembly or "") if question.name_only else None
            top = choose_assembly(document, question.assembly) if top is None else top
            found = extract(top, hardware=question.hardware, below=question.below)
            told = respelt_findings(library.notes, document.FileName)
            plain = to_plain(replace(found, findings=(*found.findings, *told)))
        except DocumentError as error:
            plain = {"document": [error.path, error.reason]}
        except InputError as error:
            plain = {"input": str(error)}
        return Known.found_in(library, plain)


_mine = threading.local()


def ask_all(questions: Sequence[Question], run: str) -> tuple[list[Known], int]:
    """The answers in order, and how many files were read; this is what travels to workers.

    run
        names the run: what a worker of a cluster keeps from another one may be old.
    """
    if getattr(_mine, "run", None) != run:
        _mine.run, _mine.session = run, Session()
    session: Session = _mine.session
    before = session.contents.reads
    return [session.ask(question) for question in questions], session.contents.reads - before


# --- where the work is done -----------------------------------------------------------------------------


class Pool:
    """Makes executors for the work, and another one where that broke.

    alone
        makes one for a single question that may end its process.
    worth
        so many files are read here before others are called in: they take a moment to start.
    chunk
        questions that travel together.
    """

    def __init__(
        self,
        make: Callable[[], Executor],
        jobs: int,
        *,
        alone: Callable[[], Executor] | None = None,
        worth: int = _WORTH_A_POOL,
        chunk: int = CHUNK,
    ) -> None:
        self.jobs, self.worth, self.chunk = jobs, worth, chunk
        self.alone = alone or (lambda: _processes(1))
        self._make = make
        self._run = str(uuid4())
        self._executor: Executor | None = None

    def submit(self, questions: Sequence[Question]) -> Future[Any]:
        """Have questions answered."""
        if self._executor is None:
            self._executor = self._make()
        return self._executor.submit(ask_all, questions, self._run)

    def renew(self) -> None:
        """Give up an executor that lost its workers."""
        if self._executor is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)
            self._executor = None


@contextmanager
def pool_of(jobs: int, dask: str | None = None, *, worth: int = _WORTH_A_POOL) -> Iterator[Pool | None]:
    """Processes of this machine, or a Dask cluster at an address; None for one job."""
    if dask is not None:
        with _dask_client(dask) as client:
            workers = sum(client.nthreads().values())
            yield Pool(client.get_executor, max(1, workers), worth=worth)
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


# --- the job --------------------------------------------------------------------------------------------


@dataclass
class _Chunk:
    """Neighbouring questions: what the index knows, and who finds out the rest."""

    questions: Sequence[Question]
    known: dict[int, Known]
    asked: Future[Any] | None = None
    tries: int = 0

    @property
    def open(self) -> list[Question]:
        return [one for number, one in enumerate(self.questions) if number not in self.known]


class Reading:
    """Asks questions: the index first, then the files.

    pool
        where files are read when they are many; None: in this process.
    reads
        how many files were read so far, here and by others.
    """

    def __init__(self, index: Index, pool: Pool | None = None) -> None:
        self.index = index
        self.asked = 0
        self._elsewhere = 0
        self._pool = pool
        self._session = Session(index.contents)

    @property
    def reads(self) -> int:
        return self._session.contents.reads + self._elsewhere

    def ask(self, question: Question) -> Answer:
        """One question."""
        return Answer(question, self.index.recall(question.path, question.name) or self._find_out(question))

    def ask_many(self, questions: Iterable[Question]) -> Iterator[Answer]:
        """The answers in the order of the questions, as they come."""
        waiting: deque[_Chunk] = deque()
        for group in _grouped(questions, self._pool.chunk if self._pool is not None else CHUNK):
            waiting.append(self._begin(group))
            while waiting and (waiting[0].asked is None or len(waiting) > 3 * self._jobs):
                yield from self._end(waiting)
        while waiting:
            yield from self._end(waiting)

    @property
    def _jobs(self) -> int:
        return self._pool.jobs if self._pool is not None else 1

    def _begin(self, questions: Sequence[Question]) -> _Chunk:
        known = {}
        for number, question in enumerate(questions):
            if (found := self.index.recall(question.path, question.name)) is not None:
                known[number] = found
        chunk = _Chunk(questions, known)
        if chunk.open:
            self._submit(chunk)
        return chunk

    def _submit(self, chunk: _Chunk) -> None:
        if self._pool is not None and self.asked >= self._pool.worth:
            chunk.asked = self._pool.submit(chunk.open)
            return
        for number, question in enumerate(chunk.questions):
            if number not in chunk.known:
                chunk.known[number] = self._find_out(question)

    def _find_out(self, question: Question) -> Known:
        self.asked += 1
        known = self._session.ask(question)
        self.index.remember(question.path, question.name, known)
        return known

    def _end(self, waiting: deque[_Chunk]) -> Iterator[Answer]:
        """The answers of the first chunk that waits."""
        chunk = waiting[0]
        if chunk.asked is not None:
            self._collect(chunk, waiting)
        waiting.popleft()
        for number, question in enumerate(chunk.questions):
            yield Answer(question, chunk.known[number])

    def _collect(self, chunk: _Chunk, waiting: deque[_Chunk]) -> None:
        while chunk.asked is not None:
            try:
                found, reads = chunk.asked.result()
            except _WORKER_LOST:
                self._again(waiting)
                continue
            chunk.asked = None
            self._elsewhere += reads
            self._take(chunk, found)

    def _take(self, chunk: _Chunk, found: Sequence[Known]) -> None:
        missing = [number for number in range(len(chunk.questions)) if number not in chunk.known]
        self.asked += len(missing)
        for number, known in zip(missing, found, strict=True):
            question = chunk.questions[number]
            chunk.known[number] = known
            self.index.remember(question.path, question.name, known)

    def _again(self, waiting: Iterable[_Chunk]) -> None:
        """A worker died. What it had not finished is asked again; a file that kills twice is found alone."""
        assert self._pool is not None  # chunks are asked elsewhere only where there is one
        lost = [chunk for chunk in waiting if chunk.asked is not None and not _succeeded(chunk.asked)]
        self._pool.renew()
        for chunk in lost:
            chunk.tries += 1
            if chunk.tries < _TRIES:
                chunk.asked = self._pool.submit(chunk.open)
            else:
                chunk.asked = None
                self._take(chunk, [self._alone(question) for question in chunk.open])

    def _alone(self, question: Question) -> Known:
        """One question in a process of its own."""
        assert self._pool is not None  # as above
        with self._pool.alone() as executor:
            try:
                found, reads = executor.submit(ask_all, [question], str(uuid4())).result()
            except BrokenProcessPool:
                reason = "the process that read it died; the file may need more memory than there is"
                return Known(json.dumps({"document": [question.path, reason]}), "[{},[]]", lasting=False)
        self._elsewhere += reads
        known: Known = found[0]
        return known


def _succeeded(future: Future[Any]) -> bool:
    return future.done() and not future.cancelled() and future.exception() is None


def _grouped(questions: Iterable[Question], size: int) -> Iterator[list[Question]]:
    left = iter(questions)
    while group := list(islice(left, size)):
        yield group
