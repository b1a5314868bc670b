# SPDX-License-Identifier: LGPL-2.1-or-later
"""Questions about files, and how a worker answers them; the values travel between processes.

A question has a file and a kind: the whole BOM below its assembly, or that one assembly alone. It is answered
in a session of its own, so that the answer's trail is exactly what the session has read.
"""

from __future__ import annotations

import gc
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

from silo.bom.errors import DocumentError, InputError, SeveralAssembliesError
from silo.bom.findings import respelt_findings
from silo.bom.message import message
from silo.bom.snapshot import to_plain
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd.contents import Content, FileContents
from silo.fcstd.facts import facts_of
from silo.fcstd.library import Library
from silo.locator import FoundFile, Locator
from silo.vault.answers import StoredAnswer
from silo.vault.index import engine


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked of a file.

    assembly
        name or label of the one meant, where the file holds several; None for the likeliest.
    name_only
        ``assembly`` is the internal name of any object that may hold components.
    below
        the whole tree, or the one assembly alone (:func:`silo.bom.walk.links.extract`).
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
    words = ("bom" if below else "level") + ("" if hardware else message(" without hardware"))
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


class FirstReading(NamedTuple):
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
class KnownFiles:
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

    def read(self, question: Question) -> FirstReading:
        """Read the file of a question, and answer it if no other file is needed."""
        library = Library(contents=self.contents, locator=self.locator)
        try:
            return self._read(library, question)
        finally:
            library.dissolve()

    def _read(self, library: Library, question: Question) -> FirstReading:
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
            first = FirstReading(None, path, facts, None, document.folders, linked)
            if set(first.files) != {path} and isinstance(document.content, Content):
                return first._replace(content=document.content)
        return FirstReading(StoredAnswer.found_in(library, self._answer(library, question)), path, facts)

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

    found: list[FirstReading]
    reads: int
    seconds: float


_mine = threading.local()


def work(questions: Sequence[Question], known_files: KnownFiles | None, run: str) -> Done:
    """Read the files of questions, or answer them with the files that are known. Workers run this function.

    run
        names the run, since what a worker of a cluster keeps from another run may be out of date.
    """
    if getattr(_mine, "run", None) != run:
        _mine.run, _mine.session = run, WalkSession()
    return work_in(_mine.session, questions, known_files)


def work_in(session: WalkSession, questions: Sequence[Question], known_files: KnownFiles | None) -> Done:
    """Do what :func:`work` does, in this process."""
    reads, begin = session.contents.reads, time.thread_time()
    if known_files is None:
        firsts = [session.read(question) for question in questions]
    else:
        for path, content in known_files.contents.items():
            session.contents.add(path, content)
        for folders, locations in known_files.found:
            session.locator.learn(folders, locations)
        facts = known_files.facts
        firsts = [
            FirstReading(session.ask(question, lambda path: facts.get(path, ""))) for question in questions
        ]
    return Done(firsts, session.contents.reads - reads, time.thread_time() - begin)
