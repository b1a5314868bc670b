# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading many files: each question about a file once, from the index or by any executor.

Many questions are answered in two steps, each spread over the executor. First every file is read, once: that
gives its facts, and the answer where it links to no other. Then the assemblies are walked, with the facts of
what they link to in place of the files. Answers come back in the order of the questions.

Questions about files, and what a worker does to answer them; its values travel between processes.

A question has a file and a kind: the whole BOM below its assembly, or that one assembly alone. It is answered
in a session of its own, so that the answer's trail is exactly what the session has read.

Where files are read when they are many: processes of this machine, or a Dask cluster.
"""

from __future__ import annotations

import gc
import json
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import islice
from typing import Any, NamedTuple, TypeVar
from uuid import uuid4

from silo.bom.entry import Extraction
from silo.bom.errors import DocumentError, InputError, SeveralAssembliesError, SiloError
from silo.bom.findings import respelt_findings
from silo.bom.links import extract
from silo.bom.roots import choose_assembly
from silo.bom.snapshot import from_plain, to_plain
from silo.fcstd.contents import Content, FileContents
from silo.fcstd.facts import facts_of
from silo.fcstd.library import Library
from silo.locator import FoundFile, Locator
from silo.platform import workers
from silo.vault.index import Index, StoredAnswer, engine

CHUNK = 64


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
        # Another process, or another run, has another current folder.
        object.__setattr__(self, "path", os.path.abspath(self.path))

    @property
    def name(self) -> str:
        """Return the key for the index."""
        return _name(self.assembly, self.hardware, self.below, self.name_only)


@lru_cache(maxsize=256)
def _name(assembly: str | None, hardware: bool, below: bool, name_only: bool) -> str:
    words = ("bom" if below else "level") + ("" if hardware else " without hardware")
    mark = "#" if name_only else "="
    return f"{engine()} {words} {'' if assembly is None else mark + assembly}"


def collect_seldom() -> None:
    """Make Python search for reference cycles less often.

    A session takes its own cycles apart. Each search goes through everything that is remembered of a vault,
    so a document of a large vault would cost more than one of a small vault.
    """
    gc.set_threshold(100_000, *gc.get_threshold()[1:])


@contextmanager
def collecting_seldom() -> Iterator[None]:
    """Do :func:`collect_seldom` during the block."""
    before = gc.get_threshold()
    collect_seldom()
    try:
        yield
    finally:
        gc.set_threshold(*before)


class First(NamedTuple):
    """What reading one file gave.

    known
        the answer; None where that needs other files.
    path, facts
        the file without symlinks, and its facts, "" where there are none.
    content, folders, linked
        where there is no answer yet: the file itself, where its links' paths begin, and where they lead.
    """

    known: StoredAnswer | None
    path: str = ""
    facts: str = ""
    content: Content | None = None
    folders: tuple[str, ...] = ()
    linked: Mapping[str, FoundFile] = {}

    @property
    def files(self) -> list[str]:
        """Return the file, and the files to which it links."""
        return [self.path, *(location.real for location in self.linked.values())]


@dataclass(frozen=True, slots=True)
class Supplies:
    """What is known already of the files that some questions need.

    found
        (folders in which links' paths begin, where the paths lead), for each file.
    """

    contents: Mapping[str, Content] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    found: Sequence[tuple[tuple[str, ...], Mapping[str, FoundFile]]] = ()


class WalkSession:
    """What a worker keeps between questions."""

    def __init__(self, contents: FileContents | None = None) -> None:
        self.contents = contents or FileContents()
        self.locator = Locator(remembers_files=True)

    def ask(self, question: Question, facts: Callable[[str], str] = lambda _path: "") -> StoredAnswer:
        """Answer a question by reading files; the answer comes with its trail."""
        library = Library(contents=self.contents, locator=self.locator, facts=facts)
        try:
            return StoredAnswer.found_in(library, self._answer(library, question))
        finally:
            library.dissolve()

    def read(self, question: Question) -> First:
        """Read the file of a question, and answer it if no other file is needed."""
        library = Library(contents=self.contents, locator=self.locator)
        try:
            return self._read(library, question)
        finally:
            library.dissolve()

    def _read(self, library: Library, question: Question) -> First:
        path, facts, linked = "", "", dict[str, FoundFile]()
        try:
            document = library.open(question.path)
            path, facts = document.FileName, facts_of(document)
            for recorded in document.linked():
                if isinstance(location := self.locator.find(recorded, document.folders), FoundFile):
                    linked[recorded] = location
        except DocumentError:
            pass  # which is the answer
        else:
            first = First(None, path, facts, None, document.folders, linked)
            if set(first.files) != {path} and isinstance(document.content, Content):
                return first._replace(content=document.content)
        return First(StoredAnswer.found_in(library, self._answer(library, question)), path, facts)

    def _answer(self, library: Library, question: Question) -> dict[str, Any]:
        try:
            document = library.open(question.path)
            top = document.getObject(question.assembly or "") if question.name_only else None
            top = choose_assembly(document, question.assembly) if top is None else top
            extraction = extract(top, hardware=question.hardware, below=question.below)
            findings = respelt_findings(library.notes, document.FileName)
            return to_plain(replace(extraction, findings=(*extraction.findings, *findings)))
        except DocumentError as error:
            return {"document": [error.path, error.reason]}
        except SeveralAssembliesError as error:
            return {"several": [str(error), error.path, error.names]}
        except InputError as error:
            return {"input": str(error)}


class Done(NamedTuple):
    """Some questions worked on: what they gave in order, how many files were read, seconds of processor."""

    found: list[First]
    reads: int
    seconds: float


_mine = threading.local()


def work(questions: Sequence[Question], supplies: Supplies | None, run: str) -> Done:
    """Read the files of questions, or with supplies answer them. Workers run this function.

    run
        names the run, since what a worker of a cluster keeps from another run may be out of date.
    """
    if getattr(_mine, "run", None) != run:
        _mine.run, _mine.session = run, WalkSession()
    return work_in(_mine.session, questions, supplies)


def work_in(session: WalkSession, questions: Sequence[Question], supplies: Supplies | None) -> Done:
    """Do what :func:`work` does, in this process."""
    reads, begin = session.contents.reads, time.thread_time()
    if supplies is None:
        firsts = [session.read(question) for question in questions]
    else:
        for path, content in supplies.contents.items():
            session.contents.add(path, content)
        for folders, locations in supplies.found:
            session.locator.learn(folders, locations)
        facts = supplies.facts
        firsts = [First(session.ask(question, lambda path: facts.get(path, ""))) for question in questions]
    return Done(firsts, session.contents.reads - reads, time.thread_time() - begin)


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

    def submit(self, questions: Sequence[Question], supplies: Supplies | None) -> Future[Done]:
        """Give questions to a worker."""
        if self._executor is None:
            self._executor = self._make()
        return self._executor.submit(work, questions, supplies, self._run)

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
            # Dask cancels tasks for which nobody waits, even those that have begun.
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
        raise InputError("--dask needs the extra: pip install 'silo-mod[dask]'") from error
    try:
        return Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(f"no Dask scheduler answers at {address}: {error}") from error


T = TypeVar("T")
_RECALLED = 256  # answers that are held on the way from the index
# Bytes of assemblies' files that are kept from the first step to the second.
_HELD = 48 << 20
_TRIES = 3
_LEAST = 8  # questions that travel together, also at the end
_WORKER_LOST = (BrokenExecutor, CancelledError)


class WalkAnswer:
    """What is known of it."""

    __slots__ = ("_plain", "known", "question")

    def __init__(self, question: Question, known: StoredAnswer) -> None:
        self.question, self.known = question, known
        self._plain: dict[str, Any] | None = None

    @property
    def plain(self) -> dict[str, Any]:
        """Return what :mod:`silo.bom.snapshot` wrote of an extraction; or an error, as its only key."""
        if self._plain is None:
            self._plain = json.loads(self.known.answer)
        return self._plain

    @property
    def found(self) -> Extraction | SiloError:
        """Return the BOM, or the error that explains why there is none."""
        if "document" in self.plain:
            return DocumentError(*self.plain["document"])
        if "several" in self.plain:
            return SeveralAssembliesError(*self.plain["several"])
        if "input" in self.plain:
            return InputError(self.plain["input"])
        return from_plain(self.plain)


@dataclass
class _Chunk:
    """Neighbouring questions, and who works on them."""

    questions: Sequence[Question]
    supplies: Supplies | None
    asked: Future[Done] | None = None
    tries: int = 0


class VaultReader:
    """Asks questions: the index first, then the files.

    pool
        where files are read when they are many; None: in this process.
    waiting
        answers that are held until their turn; more are asked of the index once more.
    asked, reads, seconds
        questions that the index did not answer, files read for them, seconds of processor of workers.
    """

    def __init__(self, index: Index, pool: Pool | None = None, *, waiting: int = 20_000) -> None:
        self.index = index
        self._waiting = waiting
        self.asked = 0
        self.seconds = 0.0
        self._elsewhere = 0
        self._pool = pool
        self._session = WalkSession(index.contents)

    @property
    def reads(self) -> int:
        return self._session.contents.reads + self._elsewhere

    def ask(self, question: Question) -> WalkAnswer:
        """Answer a question from the index, or by reading files."""
        answer = self.index.recall(question.path, question.name)
        if answer is None:
            self.asked += 1
            answer = self._session.ask(question, lambda path: self.index.facts([path]).get(path, ""))
            self.index.remember(question.path, question.name, answer)
        return WalkAnswer(question, answer)

    def ask_many(self, questions: Iterable[Question]) -> Iterator[WalkAnswer]:
        """Yield the answers in the order of the questions."""
        asked = list(questions)
        waiting: dict[int, StoredAnswer] = {}
        left: list[int] = []
        for number, answer in self._recalled(asked, range(len(asked))):
            if answer is None:
                left.append(number)
            elif len(waiting) < self._waiting:
                waiting[number] = answer
        self.asked += len(left)
        pool = self._pool if self._pool is not None and len(left) >= self._pool.worth else None
        jobs, size = (1, CHUNK) if pool is None else (pool.jobs, pool.chunk)
        contents, linked, held = dict[str, Content](), dict[int, First](), 0
        chunks = (_Chunk([asked[number] for number in group], None) for group in tapered(left, size, jobs))
        for number, first in zip(left, self._worked_on(chunks, pool), strict=True):
            if first.facts:
                self.index.remember_facts(first.path, first.facts)
            if first.known is not None:
                self._remember(asked[number], first.known)
                if len(waiting) < self._waiting or not first.known.lasting:
                    waiting[number] = first.known
            else:
                linked[number] = first._replace(facts="", content=None)
                if first.content is not None and held < _HELD:  # else it is read again
                    contents[first.path] = first.content
                    held += first.content.size
        walks = (self._walk(asked, group, linked, contents) for group in tapered([*linked], size, jobs))
        walked = self._worked_on(walks, pool)
        rest = [number for number in range(len(asked)) if number not in linked and number not in waiting]
        again = self._recalled(asked, rest)
        for number, question in enumerate(asked):
            if number in linked:
                stored_answer = next(walked).known
                assert stored_answer is not None  # since supplies were given
                self._remember(question, stored_answer)
            elif number in waiting:
                stored_answer = waiting.pop(number)
            else:
                stored_answer = next(again)[1] or self.ask(question).known
            yield WalkAnswer(question, stored_answer)

    def _recalled(
        self, asked: Sequence[Question], numbers: Iterable[int]
    ) -> Iterator[tuple[int, StoredAnswer | None]]:
        """Yield what the index has for each question."""
        for group in grouped(numbers, _RECALLED):
            yield from zip(
                group,
                self.index.recall_all([(asked[number].path, asked[number].name) for number in group]),
                strict=True,
            )

    def _walk(
        self,
        asked: Sequence[Question],
        group: Sequence[int],
        linked: Mapping[int, First],
        contents: dict[str, Content],
    ) -> _Chunk:
        own = dict.fromkeys(linked[number].path for number in group)
        given = {path: contents.pop(path) for path in own if path in contents}
        files = dict.fromkeys(file for number in group for file in linked[number].files)
        folders_and_links = [(linked[number].folders, linked[number].linked) for number in group]
        return _Chunk(
            [asked[number] for number in group],
            Supplies(given, self.index.facts([*files]), folders_and_links),
        )

    def _remember(self, question: Question, answer: StoredAnswer) -> None:
        self.index.remember(question.path, question.name, answer)

    def _worked_on(self, chunks: Iterable[_Chunk], pool: Pool | None) -> Iterator[First]:
        """Yield the results of the chunks, in their order."""
        waiting: deque[_Chunk] = deque()
        for chunk in chunks:
            if pool is None:
                yield from work_in(self._session, chunk.questions, chunk.supplies).found
                continue
            chunk.asked = pool.submit(chunk.questions, chunk.supplies)
            waiting.append(chunk)
            while len(waiting) > 3 * pool.jobs:
                yield from self._collect(waiting, pool)
        while pool is not None and waiting:
            yield from self._collect(waiting, pool)

    def _collect(self, waiting: deque[_Chunk], pool: Pool) -> list[First]:
        """Wait for the first waiting chunk, and return its results."""
        chunk = waiting[0]
        while chunk.asked is not None:
            try:
                done = chunk.asked.result()
            except _WORKER_LOST:
                self._again(waiting, pool)
                continue
            waiting.popleft()
            return self._counted(done)
        waiting.popleft()
        return [self._alone(question, chunk.supplies, pool) for question in chunk.questions]

    def _counted(self, done: Done) -> list[First]:
        self._elsewhere += done.reads
        self.seconds += done.seconds
        return done.found

    def _again(self, waiting: Iterable[_Chunk], pool: Pool) -> None:
        """Ask again what a dead worker had not finished; a file that kills two workers is asked alone."""
        lost = [chunk for chunk in waiting if chunk.asked is not None and not _succeeded(chunk.asked)]
        pool.renew()
        for chunk in lost:
            chunk.tries += 1
            chunk.asked = pool.submit(chunk.questions, chunk.supplies) if chunk.tries < _TRIES else None

    def _alone(self, question: Question, supplies: Supplies | None, pool: Pool) -> First:
        """Answer one question in a process of its own."""
        with pool.alone() as executor:
            try:
                return self._counted(executor.submit(work, [question], supplies, str(uuid4())).result())[0]
            except BrokenExecutor:
                reason = "the process that read it died; the file may need more memory than there is"
                return First(
                    StoredAnswer(json.dumps({"document": [question.path, reason]}), "[{},[]]", lasting=False)
                )


def _succeeded(future: Future[Any]) -> bool:
    return future.done() and not future.cancelled() and future.exception() is None


def grouped(several: Iterable[T], size: int) -> Iterator[list[T]]:
    """Yield lists of ``size`` items; the last one may be shorter."""
    rest = iter(several)
    while group := list(islice(rest, size)):
        yield group


def tapered(several: Sequence[T], size: int, jobs: int) -> Iterator[Sequence[T]]:
    """Yield lists of ``size`` items, and smaller ones towards the end, so that no worker has much left
    to do.
    """
    at = 0
    while at < len(several):
        count = min(size, max(_LEAST, (len(several) - at) // (3 * jobs)))
        yield several[at : at + count]
        at += count
