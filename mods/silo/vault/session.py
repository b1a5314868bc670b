# SPDX-License-Identifier: LGPL-2.1-or-later
"""Questions about files, and what a worker does to answer them; its values travel between processes.

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

from silo.bom.errors import DocumentError, InputError
from silo.bom.findings import respelt_findings
from silo.bom.links import extract
from silo.bom.report import to_plain
from silo.bom.roots import choose_assembly
from silo.fcstd.facts import facts_of
from silo.fcstd.library import Content, Contents, Library
from silo.fcstd.locate import Found, Locator
from silo.vault.answers import Known, engine

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
        # Another process, and another day, have other current folders.
        object.__setattr__(self, "path", os.path.abspath(self.path))

    @property
    def name(self) -> str:
        """For the index."""
        return _name(self.assembly, self.hardware, self.below, self.name_only)


@lru_cache(maxsize=256)
def _name(assembly: str | None, hardware: bool, below: bool, name_only: bool) -> str:
    words = ("bom" if below else "level") + ("" if hardware else " without hardware")
    mark = "#" if name_only else "="
    return f"{engine()} {words} {'' if assembly is None else mark + assembly}"


def collect_seldom() -> None:
    """Let Python search for rings of objects seldom.

    A session takes its own rings apart. Each search goes through all that is remembered of a vault, so that
    a document of a large vault would cost more than one of a small vault.
    """
    gc.set_threshold(100_000, *gc.get_threshold()[1:])


@contextmanager
def collecting_seldom() -> Iterator[None]:
    """:func:`collect_seldom`, for a while."""
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

    known: Known | None
    path: str = ""
    facts: str = ""
    content: Content | None = None
    folders: tuple[str, ...] = ()
    linked: Mapping[str, Found] = {}

    @property
    def files(self) -> list[str]:
        """The file, and those that it links to."""
        return [self.path, *(found.real for found in self.linked.values())]


@dataclass(frozen=True, slots=True)
class Supplies:
    """What is known already of the files that some questions need.

    found
        (folders in which links' paths begin, where the paths lead), for each file.
    """

    contents: Mapping[str, Content] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    found: Sequence[tuple[tuple[str, ...], Mapping[str, Found]]] = ()


class Session:
    """What a worker keeps between questions."""

    def __init__(self, contents: Contents | None = None) -> None:
        self.contents = contents or Contents()
        self.locator = Locator(remembers_files=True)

    def ask(self, question: Question, facts: Callable[[str], str] = lambda _path: "") -> Known:
        """The answer with its trail."""
        library = Library(contents=self.contents, locator=self.locator, facts=facts)
        try:
            return Known.found_in(library, self._answer(library, question))
        finally:
            library.dissolve()

    def read(self, question: Question) -> First:
        """The file of a question, and the answer where no other file is needed for it."""
        library = Library(contents=self.contents, locator=self.locator)
        try:
            return self._read(library, question)
        finally:
            library.dissolve()

    def _read(self, library: Library, question: Question) -> First:
        path, facts, linked = "", "", dict[str, Found]()
        try:
            document = library.open(question.path)
            path, facts = document.FileName, facts_of(document)
            for recorded in document.linked():
                if isinstance(found := self.locator.find(recorded, document.folders), Found):
                    linked[recorded] = found
        except DocumentError:
            pass  # which is the answer
        else:
            first = First(None, path, facts, None, document.folders, linked)
            if set(first.files) != {path} and isinstance(document.content, Content):
                return first._replace(content=document.content)
        return First(Known.found_in(library, self._answer(library, question)), path, facts)

    def _answer(self, library: Library, question: Question) -> dict[str, Any]:
        try:
            document = library.open(question.path)
            top = document.getObject(question.assembly or "") if question.name_only else None
            top = choose_assembly(document, question.assembly) if top is None else top
            found = extract(top, hardware=question.hardware, below=question.below)
            told = respelt_findings(library.notes, document.FileName)
            return to_plain(replace(found, findings=(*found.findings, *told)))
        except DocumentError as error:
            return {"document": [error.path, error.reason]}
        except InputError as error:
            return {"input": str(error)}


class Done(NamedTuple):
    """Some questions worked on: what they gave in order, how many files were read, seconds of processor."""

    found: list[First]
    reads: int
    seconds: float


_mine = threading.local()


def work(questions: Sequence[Question], supplies: Supplies | None, run: str) -> Done:
    """Read the files of questions, or with supplies answer them; this is what travels to workers.

    run
        names the run: what a worker of a cluster keeps from another one may be old.
    """
    if getattr(_mine, "run", None) != run:
        _mine.run, _mine.session = run, Session()
    return work_in(_mine.session, questions, supplies)


def work_in(session: Session, questions: Sequence[Question], supplies: Supplies | None) -> Done:
    """:func:`work` in this process."""
    reads, begin = session.contents.reads, time.thread_time()
    if supplies is None:
        firsts = [session.read(question) for question in questions]
    else:
        for path, content in supplies.contents.items():
            session.contents.add(path, content)
        for folders, found in supplies.found:
            session.locator.learn(folders, found)
        facts = supplies.facts
        firsts = [First(session.ask(question, lambda path: facts.get(path, ""))) for question in questions]
    return Done(firsts, session.contents.reads - reads, time.thread_time() - begin)
