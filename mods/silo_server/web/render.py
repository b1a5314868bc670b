# SPDX-License-Identifier: LGPL-2.1-or-later
"""Templates, and what every page shows: who is logged in, the form secret, a notice of what was just done.

Tables that sort, filter and page. What is shown is in the address: a view can be sent, kept and reloaded.

All of it is done here, on the server, so that a page works without a script; with one (``view.js``) the same
address is fetched and only the table is replaced.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import ROUND_HALF_EVEN, Context, Decimal
from typing import Any, Generic, Protocol, TypeVar
from urllib.parse import quote, unquote, urlencode

from fastapi import Request
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import HTMLResponse, Response

from silo.bom.errors import counted
from silo.bom.numbers import as_decimal, whole_number
from silo_server.db.engine import mode_of
from silo_server.routes.context import Call, masked, server_of
from silo_server.services.bom.review import waiting_count
from silo_server.settings import wire
from silo_server.values import Actor, Role

# The key of a notice in the address of the page that shows it, and the cookies (one for each key) it is in.
NOTICE, NOTICE_COOKIE = "said", "silo_notice"

# For controls that change an item or a BOM: they are shown, switched off, with the reason.
SWITCHED_OFF = Markup(' disabled aria-describedby="closed" title="Not now: the server takes no changes"')


def quantity(value: float | None, unit: str | None = None) -> str:
    """``12``, ``2.5 m``; a dash where there is none."""
    if value is None:
        return "–"
    shown = str(int(value)) if value == int(value) and abs(value) < 1e15 else f"{value:.12g}"
    return f"{shown} {isolate(unit)}" if unit else shown


def when(stamp: str | None) -> Markup | str:
    """``2026-02-08 22:15`` (UTC, as stored) with its full form for machines; a dash where there is none."""
    if not stamp:
        return "–"
    return Markup('<time datetime="{}">{}</time>').format(wire(stamp), stamp[:16].replace("T", " "))


def size(count: int | None) -> str:
    """``812 bytes``, ``14 kB``, ``3.2 MB``, ``68.7 GB``."""
    if count is None:
        return ""
    if count < 1000:
        return f"{count} bytes"
    if count < 1e6:
        return f"{count / 1e3:.0f} kB"
    return f"{count / 1e6:.1f} MB" if count < 1e9 else f"{count / 1e9:.1f} GB"


# The characters that turn the direction of the text around them, up to where they are closed.
TURNING = re.compile("[\u202a-\u202e\u2066-\u2069]")
_TURNED = frozenset(("R", "AL", "AN", "LRI", "RLI", "FSI", "PDI"))
_OPENING, _CLOSING = "\u2066\u2067\u2068", "\u2069"
_FOUR_DIGITS = Context(prec=4, rounding=ROUND_HALF_EVEN)
_GRAMS = Decimal("0.001")


def bdi(text: object) -> Markup:
    """What somebody typed, as text whose direction ends with it. A bare ``<bdi>`` ends at a U+2069 inside."""
    return Markup(f"<bdi>{escape(closed(str(text)))}</bdi>")


def isolate(text: str) -> str:
    """As :func:`bdi`, for sentences that are no HTML; text from left to right stays as it is."""
    plain = closed(text)
    if any(unicodedata.bidirectional(character) in _TURNED for character in plain):
        return f"\u2068{plain}\u2069"
    return plain


def closed(text: str) -> str:
    """``text`` without characters that turn what follows it: isolates are closed, all others left out."""
    if TURNING.search(text) is None:
        return text
    kept: list[str] = []
    depth = 0
    for character in text:
        if character in _OPENING:
            depth += 1
        elif character == _CLOSING and depth:
            depth -= 1
        elif TURNING.match(character):
            continue
        kept.append(character)
    return "".join(kept) + _CLOSING * depth


def grouped(value: Decimal) -> str:
    """``12 345.6``: groups of three digits with a narrow space that does not break; no exponent."""
    return f"{value:,f}".replace(",", "\u202f")


def mass(kilograms: float | Decimal | None) -> str:
    """``20.7 t``, ``3 kg``, ``12.5 g``: four digits at most; a dash where there is none."""
    if kilograms is None:
        return "–"
    exact = _rounded(as_decimal(kilograms))
    size, unit = Decimal(1), "kg"
    if abs(exact) >= 1000:
        size, unit = Decimal(1000), "t"
    elif 0 < abs(exact) < 1:
        size, unit = _GRAMS, "g"
    return f"{grouped(_rounded(exact / size))} {unit}"


def money(amount: float | Decimal | None, currency: str | None = None) -> str:
    """``12 345.60 EUR``; parts of a cent keep their digits (``0.0042 EUR``). A dash where there is none."""
    if amount is None:
        return "–"
    exact = as_decimal(amount)
    cents = exact.quantize(Decimal("0.01"), ROUND_HALF_EVEN)
    small = 0 < abs(exact) < Decimal("0.1") and cents != exact
    return f"{grouped(_rounded(exact) if small else cents)} {currency or ''}".rstrip()


def _rounded(value: Decimal) -> Decimal:
    """To four digits, but never less than all of the whole ones; without zeros at the end."""
    whole = value.quantize(Decimal(1), ROUND_HALF_EVEN)
    short = whole if abs(whole) >= 1000 else _FOUR_DIGITS.plus(value).normalize()
    return short.quantize(Decimal(1)) if short == short.to_integral_value() else short


def sentence(text: str) -> str:
    """A message as a sentence: a capital first, and a full stop where it has no end."""
    return f"{text[:1].upper()}{text[1:]}{'' if not text or text.endswith(('.', '?', '!')) else '.'}"


def segment(text: str) -> str:
    """A part number as one segment of a path."""
    return quote(text, safe="")


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("silo_server.web", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(
        quantity=quantity, when=when, segment=segment, size=size, bdi=bdi, mass=mass, money=money
    )
    environment.globals.update(plural=counted)
    return environment


_TEMPLATES = _environment()
_LINK = re.compile(r'(\s(?:href|src|action|formaction|data-events)=")/(?!/)')


def _state(request: Request, waiting: int | None) -> tuple[bool, int]:
    """Whether the server takes no changes, and how many BOMs wait for a person, if the page does not say.

    Without its database both are unknown; the page says so.
    """
    try:
        with server_of(request).db.read() as tx:
            return mode_of(tx) != "normal", waiting_count(tx) if waiting is None else waiting
    except SQLAlchemyError:
        return False, 0


def page(call: Call, template: str, *, status: int = 200, **values: Any) -> Response:
    """A page for somebody who is logged in; see :func:`page_for`."""
    return page_for(call.request, call.actor, template, status=status, **values)


def page_for(
    request: Request, actor: Actor | None, template: str, *, status: int = 200, **values: Any
) -> Response:
    """A page. ``actor`` None: nobody is logged in. A notice that waits in its cookie is shown once.

    Looks into the database for the server's mode, so not to be called on the event loop.
    """
    closed, waiting = _state(request, values.pop("waiting", None))
    cookie = f"{NOTICE_COOKIE}_{request.query_params.get(NOTICE, '')}"
    undo, _, notice = unquote(request.cookies.get(cookie, "")).partition(" ")
    html = _TEMPLATES.get_template(template).render(
        actor=actor,
        may_edit=actor is not None and actor.role.covers(Role.EDITOR),
        is_admin=actor is not None and actor.role.covers(Role.ADMIN),
        closed=closed,
        waiting=waiting,
        off=SWITCHED_OFF if closed else "",
        csrf=masked(actor.csrf_token) if actor is not None and actor.csrf_token else "",
        here=request.url.path,
        notice=notice,
        undo=[change for one in undo.split(",") if (change := whole_number(one, 18))],
        **values,
    )
    # The one place that puts links below the sub-path. What people typed has no bare quote, so is no link.
    root = server_of(request).settings.root_path
    response = HTMLResponse(_LINK.sub(rf"\g<1>{root}/", html) if root else html, status)
    if notice:
        response.delete_cookie(cookie)
    return response


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

    Equal rows stay in their order; rows without a value come last either way. Numbers in texts count as such:
    M3×6 comes before M3×10.
    """
    key = keys.get(sort.removeprefix("-"))
    if key is None:
        return rows
    known = [(value, row) for row in rows if (value := key(row)) not in (None, "")]
    unknown = [row for row in rows if key(row) in (None, "")]
    known.sort(key=lambda pair: _natural(pair[0]), reverse=sort.startswith("-"))
    return [*(row for _, row in known), *unknown]


def _natural(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    parts = re.split("([0-9]+)", value)  # at odd places the digits, of any length
    parts[1::2] = [f"{len(digits):09}{digits}" for part in parts[1::2] for digits in [part.lstrip("0")]]
    return parts


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
