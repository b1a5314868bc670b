# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables that sort, filter and page. What is shown is in the address: a view can be sent, kept and reloaded.

All of it is done here, on the server, so that a page works without a script; with one (``view.js``) the same
address is fetched and only the table is replaced.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar
from urllib.parse import urlencode

from silo_server.services.search import words_of

T = TypeVar("T")

# A browser shows a table of so many rows at once.
PAGE_ROWS = 1000


@dataclass(frozen=True, slots=True)
class Address:
    """A page with its view. ``params`` are the parts of the view that are not as usual."""

    path: str
    params: Mapping[str, str] = field(default_factory=dict)

    def url(self, **changes: object) -> str:
        """The address with these changes; None, "" and False leave a part out."""
        changed = {**self.params, **{name: "" if value is None else value for name, value in changes.items()}}
        kept = {name: str(value) for name, value in changed.items() if value not in ("", False)}
        return f"{self.path}?{urlencode(kept)}" if kept else self.path

    def query(self, **changes: object) -> str:
        """The view alone, with its question mark; "" where all is as usual."""
        return self.url(**changes)[len(self.path) :]

    def but(self, *names: str) -> Mapping[str, str]:
        """The view without these parts: what a form must carry on beside its own fields."""
        return {name: value for name, value in self.params.items() if name not in names and value}


@dataclass(frozen=True, slots=True)
class Page(Generic[T]):
    """One page of a table's rows. ``total``: rows before the filter, ``found``: behind it."""

    rows: Sequence[T]
    total: int
    found: int
    number: int = 1
    size: int = PAGE_ROWS

    @property
    def last(self) -> int:
        """The number of the last page."""
        return max(1, -(-self.found // self.size))

    @property
    def start(self) -> int:
        """How many rows stand before this page."""
        return (self.number - 1) * self.size

    @property
    def words(self) -> str:
        """``12 of 340 lines`` in numbers only: ``12 of 340``, ``1 to 100 of 340``."""
        if self.found > self.size:
            shown = f"{self.start + 1} to {self.start + len(self.rows)} of {self.found}"
            return shown if self.found == self.total else f"{shown} found among {self.total}"
        return f"{self.found}" if self.found == self.total else f"{self.found} of {self.total}"


def page_of(rows: Sequence[T], total: int, number: int, size: int = PAGE_ROWS) -> Page[T]:
    """The page with this number; the last one where there are fewer."""
    last = max(1, -(-len(rows) // size))
    number = min(max(number, 1), last)
    return Page(rows[(number - 1) * size : number * size], total, len(rows), number, size)


def arranged(rows: Sequence[T], sort: str, keys: Mapping[str, Callable[[T], Any]]) -> Sequence[T]:
    """The rows by the column that ``sort`` names (``mass``, ``-mass`` for the largest first).

    Equal rows stay in their order; rows without a value come last either way.
    """
    key = keys.get(sort.removeprefix("-"))
    if key is None:
        return rows
    known = [(value, row) for row in rows if (value := key(row)) not in (None, "")]
    unknown = [row for row in rows if key(row) in (None, "")]
    known.sort(key=lambda pair: pair[0], reverse=sort.startswith("-"))
    return [*(row for _, row in known), *unknown]


def fits(asked: str) -> Callable[..., bool]:
    """A test of texts: true where every word of ``asked`` is in one of them, without case and accents."""
    wanted = words_of(asked)

    def test(*texts: str | None) -> bool:
        if not wanted:
            return True
        written = " ".join(words_of(" ".join(text for text in texts if text)))
        joined = written.replace(" ", "")
        return all(word in written or word in joined for word in wanted)

    return test


class Numbered(Protocol):
    """A row with the id that its list is paged by."""

    @property
    def id(self) -> int: ...


N = TypeVar("N", bound=Numbered)


@dataclass(frozen=True, slots=True)
class Part(Generic[N]):
    """A part of a list that is newest first; the ids to page on from, None at its ends."""

    rows: Sequence[N]
    older: int | None
    newer: int | None


def part_of(
    read: Callable[[int, int | None, int | None], Sequence[N]],
    size: int,
    before: int | None,
    after: int | None,
) -> Part[N]:
    """The part before an id, or the nearest one after an id; the newest where neither is given.

    read
        (limit, before, after) → rows, newest first.
    """
    if after is not None and (found := read(size + 1, None, after)):
        rows = found[-size:]
        return Part(rows, rows[-1].id, rows[0].id if len(found) > size else None)
    found = read(size + 1, before if after is None else None, None)
    rows = found[:size]
    newer = rows[0].id if before is not None and after is None and rows else None
    return Part(rows, rows[-1].id if len(found) > size else None, newer)
