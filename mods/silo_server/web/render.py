# SPDX-License-Identifier: LGPL-2.1-or-later
"""Templates, and what every page shows: who is logged in, the form secret, a notice of what was just done.

Tables that sort, filter and page. What is shown is in the address: a view can be sent, kept and reloaded.

All of it is done here, on the server, so that a page works without a script; with one (``view.js``) the same
address is fetched and only the table is replaced.

Languages: a template holds its texts in English, and is translated as a whole when it is compiled for a
language (:func:`translated`). ``_`` and ``plural`` translate what stands in Python, in scripts and in
expressions. The catalogues are ``silo_server/locale/*/LC_MESSAGES/silo_server.mo``. Sentences of the server,
errors and what is open, are English until a template says them (:func:`spoken`).
"""

from __future__ import annotations

import gettext
import json
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from datetime import UTC, datetime, tzinfo
from decimal import ROUND_HALF_EVEN, Context, Decimal
from functools import lru_cache
from operator import itemgetter
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar
from urllib.parse import unquote, urlencode
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from fastapi import Request
from jinja2 import Environment, PackageLoader, StrictUndefined
from jinja2.ext import Extension
from markupsafe import Markup, escape
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import HTMLResponse, Response

import silo
from silo.bom.items.part_address import part_segment
from silo.bom.numbers import whole_number
from silo.bom.quantities import as_decimal, decimal_text, quantity_of
from silo_server.actors import Actor, Role
from silo_server.db.state import mode_of
from silo_server.routes.call import Call, server_of
from silo_server.routes.masked_secret import masked
from silo_server.services.badge import badge
from silo_server.services.bom.waiting import waiting_count
from silo_server.services.releases import review_count
from silo_server.times import wire_time

# The key of a notice in the address of the page that shows it, and the cookies (one for each key) it is in.
NOTICE, NOTICE_COOKIE = "said", "silo_notice"

LANGUAGES = {"en": "English", "de": "Deutsch"}
LANGUAGE_COOKIE = "silo_language"
_CATALOGUES = {
    name: gettext.translation("silo_server", Path(__file__).parents[1] / "locale", [name], fallback=True)
    for name in LANGUAGES
}
# The language of the page that is answered; all that is no page is English.
LANGUAGE: ContextVar[str] = ContextVar("LANGUAGE", default="en")
# The reader's time zone, which the browser names in a cookie. Exports and the API are in UTC.
TIMEZONE: ContextVar[str] = ContextVar("TIMEZONE", default="UTC")
TIMEZONE_COOKIE = "silo_timezone"


def language_for(chosen: str, accepted: str) -> str:
    """Choose a page's language: the person's choice, else the best ``Accept-Language``, else English."""
    if chosen in LANGUAGES:
        return chosen
    best, weight = "en", 0.0
    for part in accepted.split(","):
        tag, _semicolon, rest = part.partition(";")
        name = tag.strip().partition("-")[0].lower()
        quality = re.fullmatch(r"\s*q\s*=\s*(0(?:\.\d{0,3})?|1(?:\.0{0,3})?)\s*", rest)
        worth = float(quality[1]) if quality else 0.0 if rest else 1.0
        if name in LANGUAGES and worth > weight:
            best, weight = name, worth
    return best


def _(text: str, **values: object) -> str:
    """Translate ``text`` into the language of the page, with ``values`` in place of ``%(name)s``."""
    translation = _CATALOGUES[LANGUAGE.get()].gettext(text) if text else ""
    return translation % values if values else translation


def plural(number: int, one: str, many: str = "", words: str = "") -> str:
    """Count as :func:`silo.bom.errors.counted` does, in the language of the page.

    ``words`` replaces the number, such as ``12 of 340``.
    """
    return f"{words or number} {_CATALOGUES[LANGUAGE.get()].ngettext(one, many or one + 's', number)}"


SCRIPTS = sorted(Path(__file__).with_name("static").glob("*.js"))
SCRIPTS += [Path(silo.__file__).with_name("viewer") / "viewer.js"]


def script_words() -> dict[str, str]:
    """Translate the texts of a page's scripts: text → translation."""
    return {text: _(text) for path in SCRIPTS for text in texts_of_script(path)}


def texts_of_script(path: Path) -> list[str]:
    """Find the texts of a script that are translated: ``_("Page %(n)s", { n })``."""
    return [json.loads(text) for text in re.findall(r'\b_\(("(?:[^"\\]|\\.)*")', path.read_text("utf-8"))]


_EXPRESSION = r"\{\{(?:\"[^\"]*\"|'[^']*'|\}(?!\})|[^\"'}])*\}\}"
_STATEMENT = r"\{%(?:\"[^\"]*\"|'[^']*'|%(?!\})|[^\"'%])*%\}"
_VALUE = rf"\"(?:{_EXPRESSION}|{_STATEMENT}|[^\"])*\""
_PIECE = re.compile(
    rf"(?P<comment>\{{\#.*?\#\}})|(?P<statement>{_STATEMENT})|(?P<expression>{_EXPRESSION})"
    rf"|(?P<tag></?(?P<name>!?[a-zA-Z][\w-]*)(?:{_EXPRESSION}|{_STATEMENT}|{_VALUE}|[^<>\"])*>)|(?P<text>[^<{{]+|.)",
    re.DOTALL,
)
_ATTRIBUTE = re.compile(
    rf"( (?:title|aria-label|placeholder|alt|data-label|data-question)=\")((?:{_EXPRESSION}|[^\"])*)(?=\")"
)
# What may stand within a sentence.
_WITHIN = frozenset(("a", "b", "code", "em", "small", "span", "strong"))
# Between sentences; a path such as "Items › F01 › BOM" is several of them.
_BETWEEN = re.compile(r"(\s*[›·]\s*)")
_WORD = re.compile(r"[^\W\d_]{2}|\b[aI]\b")


def translated(template: str, translate: Callable[[str], str]) -> str:
    """Translate a template by ``translate``: each text and each attribute that people read.

    A text is a sentence with the elements in it; its expressions and the tags with attributes are
    placeholders: ``Suppliers of %(part_number)s``. Statements and all other elements end it.
    """
    made: list[str] = []
    run: list[str] = []
    for match in _PIECE.finditer(template):
        source = match[0]
        if match["tag"]:
            source = _ATTRIBUTE.sub(lambda hit: hit[1] + _value(hit[2], translate), source)
        if match["text"] or match["expression"] or match["name"] in _WITHIN:
            run += _BETWEEN.split(source) if match["text"] else [source]
        else:
            made += [_sentence(run, translate), source]
            run = []
    return "".join([*made, _sentence(run, translate)])


def _value(source: str, translate: Callable[[str], str]) -> str:
    pieces = re.split(f"({_EXPRESSION})", source)
    return source if "{%" in source else _sentence(pieces, translate)


def _has_words(pieces: Sequence[str]) -> bool:
    return any(piece[:1] not in "<{" and _WORD.search(piece) for piece in pieces if piece)


def _is_apart(pieces: Sequence[str]) -> bool:
    """Return True for space, or an element with only a sign in it, at an end of a sentence."""
    element = len(pieces) > 1 and not _has_words(pieces) and not any(piece[:1] == "{" for piece in pieces)
    return element or (len(pieces) == 1 and not pieces[0].strip())


def _sentence(run: Sequence[str], translate: Callable[[str], str]) -> str:
    """Translate a run of texts, expressions and tags in the largest parts that are sentences."""
    if not _has_words(run):
        return "".join(run)
    ends: dict[int, int] = {}
    opened: list[int] = []
    breaks = []
    for number, piece in enumerate(run):
        if piece.startswith("</"):
            if opened:
                ends[opened.pop()] = number
            else:
                breaks.append(number)
        elif piece.startswith("<"):
            opened.append(number)
        elif _BETWEEN.fullmatch(piece) and not opened:
            breaks.append(number)
    if breaks := sorted([*breaks, *opened]):
        at = breaks[0]
        return _sentence(run[:at], translate) + run[at] + _sentence(run[at + 1 :], translate)
    begins = {end: begin for begin, end in ends.items()}
    first, last = 0, len(run)
    while _is_apart(run[first : ends.get(first, first) + 1]):
        first = ends.get(first, first) + 1
    while _is_apart(run[begins.get(last - 1, last - 1) : last]):
        last = begins.get(last - 1, last - 1)
    around, run = (run[:first], run[last:]), run[first:last]
    ends = {begin - first: end - first for begin, end in ends.items() if first <= begin < last}
    outer, number = [], 0
    while number < len(run):
        outer.append(number)
        number = ends.get(number, number) + 1
    if _has_words([run[number] for number in outer]):
        done = _message(run, translate)
    else:
        # No sentence holds the elements together: each is one. What stands in <code> is no language.
        done = "".join(
            run[number] + _sentence(run[number + 1 : ends[number]], translate) + run[ends[number]]
            if number in ends and not run[number].startswith("<code")
            else "".join(run[number : ends.get(number, number) + 1])
            for number in outer
        )
    return "".join([*around[0], done, *around[1]])


def _message(run: Sequence[str], translate: Callable[[str], str]) -> str:
    places: dict[str, str] = {}
    words = ""
    for piece in run:
        if piece.startswith("{{") or re.match(r"<\w+ ", piece):
            name = wanted = _name_of(piece)
            while places.get(name, piece) != piece:
                name = f"{wanted}{len(places)}"
            places[name] = piece
            piece = f"%({name})s"
        words += piece
    core = " ".join(words.split())
    start, end = words[: len(words) - len(words.lstrip())], words[len(words.rstrip()) :]
    return start + re.sub(r"%\((\w+)\)s", lambda place: places[place[1]], translate(core)) + end


def _name_of(piece: str) -> str:
    """Name the placeholder of an expression or a tag.

    ``part_number`` for ``{{ item.part_number | bdi }}``, ``count`` for ``{{ plural(…) }}``, ``link``.
    """
    if piece.startswith("<"):
        tag = piece[1:].partition(" ")[0]
        return "link" if tag == "a" else tag
    if "plural(" in piece:
        return "count"
    plain = re.sub(r"\"[^\"]*\"|\|.*", "", piece[2:-2].strip("-() ").partition(" if ")[0])
    names = re.findall(r"[A-Za-z_]\w*", plain)
    return names[-1] if names else "value"


def N_(text: str) -> str:
    """Mark a text that is translated where it is shown."""
    return text


# For controls that change an item or a BOM: they are shown, switched off, with the reason.
SWITCHED_OFF = ' disabled aria-describedby="closed" title="{}"'


def quantity(value: float | Decimal | None, unit: str | None = None) -> str:
    """Write a quantity: ``12``, ``2.5 m``; a dash if there is none."""
    if value is None:
        return "–"
    shown = in_reader_form(decimal_text(quantity_of(value)))
    return f"{shown} {isolate(unit)}" if unit else shown


def number_text(value: Decimal) -> str:
    """Write a number as the reader of the page does, with all its digits and no zero behind the last one."""
    return in_reader_form(decimal_text(value))


def in_reader_form(number: str) -> str:
    """Write a number with the decimal mark of the page's language."""
    return number if LANGUAGE.get() == "en" else number.replace(".", ",")


def when(stamp: str | None) -> Markup | str:
    """Write a time: ``2026-02-08 22:15`` in the reader's zone, with its full form in UTC for machines.

    A dash if there is none.
    """
    return _when(stamp, TIMEZONE.get()) if stamp else "–"


@lru_cache(maxsize=4096)
def _when(stamp: str, zone: str) -> Markup:
    there = datetime.fromisoformat(stamp).astimezone(zone_of(zone))
    return Markup('<time datetime="{}">{}</time>').format(wire_time(stamp), f"{there:%Y-%m-%d %H:%M}")


@lru_cache(maxsize=256)
def zone_of(name: str) -> tzinfo:
    """Return the time zone of this name; UTC for one that this machine does not know."""
    if name != "UTC" and re.fullmatch(r"[A-Za-z0-9_+-]{1,32}(/[A-Za-z0-9_+-]{1,32}){0,3}", name):
        with suppress(ZoneInfoNotFoundError, ValueError, OSError):
            return ZoneInfo(name)
    return UTC


def zone_name() -> str:
    """Name the time zone of the page."""
    return str(zone_of(TIMEZONE.get()))


def size(count: int | None) -> str:
    """Write a number of bytes: ``812 bytes``, ``14 kB``, ``3.2 MB``, ``68.7 GB``; "" if there is none."""
    if count is None:
        return ""
    if count < 1000:
        return plural(count, "byte")
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
    """Enclose what somebody typed, so that its direction ends with it.

    In a bare ``<bdi>`` the direction would end at a U+2069 inside.
    """
    return Markup(f"<bdi>{escape(closed(str(text)))}</bdi>")


def isolate(text: str) -> str:
    """Isolate text as :func:`bdi` does, for sentences that are no HTML; text from left to right stays as it
    is.
    """
    plain = closed(text)
    if any(unicodedata.bidirectional(character) in _TURNED for character in plain):
        return f"\u2068{plain}\u2069"
    return plain


def closed(text: str) -> str:
    """Keep characters in ``text`` from turning what follows it: close isolates, remove all others."""
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
    """Write ``12 345.6``: groups of three digits with a narrow space that does not break; no exponent.

    With the decimal mark of the page's language.
    """
    return in_reader_form(f"{value:,f}".replace(",", "\u202f"))


def mass(kilograms: float | Decimal | None) -> str:
    """Write a mass: ``20.7 t``, ``3 kg``, ``12.5 g``, with four digits or all before the point; or a dash."""
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
    """Write an amount: ``12 345.60 EUR``; a dash if there is none.

    Parts of a cent keep their digits (``0.0042 EUR``).
    """
    if amount is None:
        return "–"
    exact = as_decimal(amount)
    cents = exact.quantize(Decimal("0.01"), ROUND_HALF_EVEN)
    small = 0 < abs(exact) < Decimal("0.1") and cents != exact
    return f"{grouped(_rounded(exact) if small else cents)} {currency or ''}".rstrip()


def _rounded(value: Decimal) -> Decimal:
    """Round to four digits, but never to less than all of the whole ones; without zeros at the end."""
    whole = value.quantize(Decimal(1), ROUND_HALF_EVEN)
    short = whole if abs(whole) >= 1000 else _FOUR_DIGITS.plus(value).normalize()
    return short.quantize(Decimal(1)) if short == short.to_integral_value() else short


def spoken(text: str) -> str:
    """Say a finished sentence of the server, an error or what is open, in the language of the page."""
    return silo.spoken(text, LANGUAGE.get())


def sentence(text: str) -> str:
    """Write a message as a sentence: a capital first, and a full stop if it has no end."""
    text = spoken(text)
    if re.match(r"[^\W\d_]+[ :,]", text):  # a word, no part number
        text = text[:1].upper() + text[1:]
    return f"{text}{'' if not text or text.endswith(('.', '?', '!')) else '.'}"


def segment(text: str) -> str:
    """Write a part number, a label or a name as one segment of a path."""
    return part_segment(text)


class _Translated(Extension):
    def preprocess(self, source: str, name: str | None, filename: str | None = None) -> str:
        return translated(source, _)


def environment(language: str) -> Environment:
    """Make the environment that compiles the templates of a language."""
    made = Environment(
        loader=PackageLoader("silo_server.web", "templates"),
        extensions=[] if language == "en" else [_Translated],
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters.update(
        quantity=quantity, when=when, segment=segment, size=size, bdi=bdi, mass=mass, money=money
    )
    made.filters.update(spoken=spoken, sentence=sentence)
    made.globals.update(
        plural=plural, _=_, languages=LANGUAGES, script_words=script_words, zone_name=zone_name
    )
    return made


_TEMPLATES = {language: environment(language) for language in LANGUAGES}
_LINK = re.compile(r'(\s(?:href|src|action|formaction|data-events)=")/(?!/)')


def _state(request: Request, waiting: int | None, actor: Actor | None) -> tuple[bool, int, int]:
    """Read what each page shows: if no changes are taken, how many BOMs and reviews wait, how much for this
    user.

    ``waiting``: how many wait, if the page has counted them. Without the database all of this
    is unknown; the page says so.
    """
    try:
        with server_of(request).db.read() as tx:
            count = waiting_count(tx) + review_count(tx) if waiting is None else waiting
            return mode_of(tx) != "normal", count, badge(tx, actor) if actor else 0
    except SQLAlchemyError:
        return False, 0, 0


def page(call: Call, template: str, *, status: int = 200, **values: Any) -> Response:
    """Make a page for somebody who is logged in; see :func:`page_for`."""
    return page_for(call.request, call.actor, template, status=status, **values)


def page_for(
    request: Request, actor: Actor | None, template: str, *, status: int = 200, **values: Any
) -> Response:
    """Make a page. ``actor`` None: no one is logged in. A notice that waits in its cookie is shown once.

    Do not call it on the event loop: it reads the server's mode from the database.
    """
    closed, waiting, for_me = _state(request, values.pop("waiting", None), actor)
    cookie = f"{NOTICE_COOKIE}_{request.query_params.get(NOTICE, '')}"
    undo, _space, notice = unquote(request.cookies.get(cookie, "")).partition(" ")
    language = LANGUAGE.get()
    html = (
        _TEMPLATES[language]
        .get_template(template)
        .render(
            language=language,
            actor=actor,
            may_edit=actor is not None and actor.role.covers(Role.EDITOR),
            is_admin=actor is not None and actor.role.covers(Role.ADMIN),
            closed=closed,
            waiting=waiting,
            for_me=for_me,
            off=Markup(SWITCHED_OFF).format(_("Not now: the server takes no changes")) if closed else "",
            csrf=masked(actor.csrf_token) if actor is not None and actor.csrf_token else "",
            here=request.url.path,
            address_here=f"{request.url.path}?{request.url.query}",
            notice=notice,
            undo=[change for part in undo.split(",") if (change := whole_number(part, 18))],
            **values,
        )
    )
    # The one place that puts links below the sub-path. What people typed has no bare quote, so is no link.
    root = server_of(request).settings.root_path
    response = HTMLResponse(_LINK.sub(rf"\g<1>{root}/", html) if root else html, status)
    response.headers["Content-Language"] = language
    response.headers["Vary"] = "Accept-Language, Cookie"
    if notice:
        response.delete_cookie(cookie)
    return response


T = TypeVar("T")

# A browser shows a table of so many rows at once.
PAGE_ROWS = 500


@dataclass(frozen=True, slots=True)
class Address:
    """A page with its view. ``params`` are the parts of the view that are not as usual."""

    path: str
    params: Mapping[str, str] = field(default_factory=dict)

    def url(self, **changes: object) -> str:
        """Return the address with these changes; None, "" and False remove a part."""
        changed = {**self.params, **{name: "" if value is None else value for name, value in changes.items()}}
        kept = {name: str(value) for name, value in changed.items() if value not in ("", False)}
        return f"{self.path}?{urlencode(kept)}" if kept else self.path

    def query(self, **changes: object) -> str:
        """Return the query alone, with its question mark; "" if all is as usual."""
        return self.url(**changes)[len(self.path) :]

    def but(self, *names: str) -> Mapping[str, str]:
        """Return the view without these parts: what a form must carry beside its own fields."""
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
        """Count the pages; the last page has this number."""
        return max(1, -(-self.found // self.size))

    @property
    def start(self) -> int:
        """Count the rows before this page."""
        return (self.number - 1) * self.size

    @property
    def words(self) -> str:
        """Describe the page in numbers: ``12 of 340``, ``1 to 100 of 340``."""
        if self.found > self.size:
            first, last = self.start + 1, self.start + len(self.rows)
            shown = _("%(first)s to %(last)s of %(found)s", first=first, last=last, found=self.found)
            among = _("%(shown)s found among %(total)s", shown=shown, total=self.total)
            return shown if self.found == self.total else among
        part = _("%(found)s of %(total)s", found=self.found, total=self.total)
        return f"{self.found}" if self.found == self.total else part


def page_of(rows: Sequence[T], total: int, number: int, size: int = PAGE_ROWS) -> Page[T]:
    """Take the page with this number from the rows; the last one if there are fewer."""
    last = max(1, -(-len(rows) // size))
    number = min(max(number, 1), last)
    return Page(rows[(number - 1) * size : number * size], total, len(rows), number, size)


def arranged(rows: Sequence[T], sort: str, keys: Mapping[str, Callable[[T], Any]]) -> Sequence[T]:
    """Sort the rows by the column that ``sort`` names (``-mass``: the largest mass first).

    Equal rows stay in their order; rows without a value come last either way. Numbers in texts count as such:
    M3×6 comes before M3×10.
    """
    key = keys.get(sort.removeprefix("-"))
    if key is None:
        return rows
    with_value, without = [], []
    for row in rows:
        value = key(row)
        # A decimal looks twice into the tree of numbers before it says that it is no text.
        if value is None or (isinstance(value, str) and not value):
            without.append(row)
        else:
            with_value.append((_natural(value), row))
    with_value.sort(key=itemgetter(0), reverse=sort.startswith("-"))
    return [*(row for _key, row in with_value), *without]


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
class ListPart(Generic[N]):
    """A part of a list that is newest first; the ids to page on from, None at its ends."""

    rows: Sequence[N]
    older: int | None
    newer: int | None


def part_of(
    read: Callable[[int, int | None, int | None], Sequence[N]],
    size: int,
    before: int | None,
    after: int | None,
) -> ListPart[N]:
    """Read the part before an id, or the nearest one after an id; the newest if neither is given.

    read
        (limit, before, after) → rows, newest first.
    """
    if after is not None and (rows_read := read(size + 1, None, after)):
        rows = rows_read[-size:]
        return ListPart(rows, rows[-1].id, rows[0].id if len(rows_read) > size else None)
    rows_read = read(size + 1, before if after is None else None, None)
    rows = rows_read[:size]
    newer = rows[0].id if before is not None and after is None and rows else None
    return ListPart(rows, rows[-1].id if len(rows_read) > size else None, newer)
