# SPDX-License-Identifier: LGPL-2.1-or-later
"""Templates, and what every page shows: who is logged in, the form secret, a notice of what was just done."""

from __future__ import annotations

import re
import unicodedata
from decimal import ROUND_HALF_EVEN, Context, Decimal
from typing import Any
from urllib.parse import quote, unquote

from fastapi import Request
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import HTMLResponse, Response

from silo.bom.numbers import as_decimal, whole_number
from silo_server.clock import wire
from silo_server.db.engine import mode_of
from silo_server.routes.context import Call, masked, server_of
from silo_server.services.bom.review import waiting_count
from silo_server.values import Actor, Role

NOTICE_COOKIE = "silo_notice"

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


def plural(count: int, one: str, many: str) -> str:
    """``1 item is``, ``3 items are``."""
    return f"{count} {one if count == 1 else many}"


def size(count: int | None) -> str:
    """``812 bytes``, ``14 kB``, ``3.2 MB``."""
    if count is None:
        return ""
    if count < 1000:
        return f"{count} bytes"
    return f"{count / 1e3:.0f} kB" if count < 1e6 else f"{count / 1e6:.1f} MB"


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
    environment.globals.update(plural=plural)
    return environment


_TEMPLATES = _environment()
_LINK = re.compile(r'(\s(?:href|src|action|formaction|data-events)=")/(?!/)')


def _state(request: Request) -> tuple[bool, int]:
    """Whether the server takes no changes, and how many BOMs wait for a person.

    Without its database both are unknown; the page says so.
    """
    try:
        with server_of(request).db.read() as tx:
            return mode_of(tx) != "normal", waiting_count(tx)
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
    closed, waiting = _state(request)
    undo, _, notice = unquote(request.cookies.get(NOTICE_COOKIE, ""))[:800].partition(" ")
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
        undo=whole_number(undo) or 0,
        **values,
    )
    # The one place that puts links below the sub-path. What people typed has no bare quote, so is no link.
    root = server_of(request).settings.root_path
    response = HTMLResponse(_LINK.sub(rf"\g<1>{root}/", html) if root else html, status)
    if notice:
        response.delete_cookie(NOTICE_COOKIE)
    return response
