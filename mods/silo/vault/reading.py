# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading many files: each question about a file once, from the index or by any executor.

Many questions are answered in two steps, each spread over the executor. First every file is read, once: that
gives its facts, and the answer where it links to no other. Then the assemblies are walked, with the facts of
what they link to in place of the files. Answers come back in the order of the questions.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar
from uuid import uuid4

from silo.bom.entry import Extraction
from silo.bom.errors import DocumentError, InputError, SeveralAssembliesError, SiloError
from silo.bom.message import message
from silo.bom.snapshot import from_plain
from silo.fcstd.contents import Content
from silo.vault.answers import StoredAnswer
from silo.vault.index import Index
from silo.vault.pool import CHUNK, Pool
from silo.vault.questions import Done, FirstReading, KnownFiles, Question, WalkSession, work, work_in

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
    known_files: KnownFiles | None
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

    def ask_many(
        self, questions: Iterable[Question], progress: Callable[[str], None] = lambda _path: None
    ) -> Iterator[WalkAnswer]:
        """Yield the answers in the order of the questions; ``progress`` hears of each file that is read."""
        asked = list(questions)
        waiting: dict[int, StoredAnswer] = {}
        left: list[int] = []
        for number, answer in self._recalled(asked, range(len(asked))):
            if answer is None:
                left.append(number)
                continue
            progress(asked[number].path)
            if len(waiting) < self._waiting:
                waiting[number] = answer
        self.asked += len(left)
        pool = self._pool if self._pool is not None and len(left) >= self._pool.worth else None
        jobs, size = (1, CHUNK) if pool is None else (pool.jobs, pool.chunk)
        contents, linked, held = dict[str, Content](), dict[int, FirstReading](), 0
        chunks = (_Chunk([asked[number] for number in group], None) for group in tapered(left, size, jobs))
        for number, first in zip(left, self._worked_on(chunks, pool), strict=True):
            progress(asked[number].path)
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
                assert stored_answer is not None  # since the files it needs were given
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
        linked: Mapping[int, FirstReading],
        contents: dict[str, Content],
    ) -> _Chunk:
        own = dict.fromkeys(linked[number].path for number in group)
        given = {path: contents.pop(path) for path in own if path in contents}
        files = dict.fromkeys(file for number in group for file in linked[number].files)
        folders_and_links = [(linked[number].folders, linked[number].linked) for number in group]
        return _Chunk(
            [asked[number] for number in group],
            KnownFiles(given, self.index.facts([*files]), folders_and_links),
        )

    def _remember(self, question: Question, answer: StoredAnswer) -> None:
        self.index.remember(question.path, question.name, answer)

    def _worked_on(self, chunks: Iterable[_Chunk], pool: Pool | None) -> Iterator[FirstReading]:
        """Yield the results of the chunks, in their order."""
        waiting: deque[_Chunk] = deque()
        for chunk in chunks:
            if pool is None:
                yield from work_in(self._session, chunk.questions, chunk.known_files).found
                continue
            chunk.asked = pool.submit(chunk.questions, chunk.known_files)
            waiting.append(chunk)
            while len(waiting) > 3 * pool.jobs:
                yield from self._collect(waiting, pool)
        while pool is not None and waiting:
            yield from self._collect(waiting, pool)

    def _collect(self, waiting: deque[_Chunk], pool: Pool) -> list[FirstReading]:
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
        return [self._alone(question, chunk.known_files, pool) for question in chunk.questions]

    def _counted(self, done: Done) -> list[FirstReading]:
        self._elsewhere += done.reads
        self.seconds += done.seconds
        return done.found

    def _again(self, waiting: Iterable[_Chunk], pool: Pool) -> None:
        """Ask again what a dead worker had not finished; a file that kills two workers is asked alone."""
        lost = [chunk for chunk in waiting if chunk.asked is not None and not _succeeded(chunk.asked)]
        pool.renew()
        for chunk in lost:
            chunk.tries += 1
            chunk.asked = pool.submit(chunk.questions, chunk.known_files) if chunk.tries < _TRIES else None

    def _alone(self, question: Question, known_files: KnownFiles | None, pool: Pool) -> FirstReading:
        """Answer one question in a process of its own."""
        with pool.alone() as executor:
            try:
                return self._counted(executor.submit(work, [question], known_files, str(uuid4())).result())[0]
            except BrokenExecutor:
                reason = message("the process that read it died; the file may need more memory than there is")
                return FirstReading(
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
