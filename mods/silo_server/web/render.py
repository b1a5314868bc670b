# SPDX-License-Identifier: LGPL-2.1-or-later
"""Templates, and what every page shows: who is logged in, the form secret, a notice of what was just done."""

from __future__ import annotations

import re
from typing import Any
from urllib.parse import quote, unquote

from fastapi import Request
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import HTMLResponse, Response

from silo_server.clock import wire
from silo_server.db.engine import mode_of
from silo_server.routes.context import server_of
from silo_server.values import Actor, Role

NOTICE_COOKIE = "silo_notice"

# For controls that change an item or a BOM: they are shown, switched off, with the reason.
SWITCHED_OFF = Markup(' disabled aria-describedby="closed" title="Not now: the server takes no changes"')


def quantity(value: float | None, unit: str | None = None) -> str:
    """``12``, ``2.5 m``; a dash where there is none."""
    if value is None:
        return "–"
    shown = str(int(value)) if value == int(value) and abs(value) < 1e15 else f"{value:.12g}"
    return f"{shown} {unit}" if unit else shown


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
    environment.filters.update(quantity=quantity, when=when, segment=segment, size=size)
    environment.globals.update(plural=plural)
    return environment


_TEMPLATES = _environment()
_LINK = re.compile(r'(\s(?:href|src|action|formaction|data-events)=")/(?!/)')


def _closed(request: Request) -> bool:
    """True while the server takes no changes. Without its database nobody knows; the page says that then."""
    try:
        with server_of(request).db.read() as tx:
            return mode_of(tx) != "normal"
    except SQLAlchemyError:
        return False


def page(
    request: Request, template: str, actor: Actor | None, *, status: int = 200, **values: Any
) -> Response:
    """A page. ``actor`` None: nobody is logged in. A notice that waits in its cookie is shown once.

    Looks into the database for the server's mode, so not to be called on the event loop.
    """
    closed = _closed(request)
    notice = unquote(request.cookies.get(NOTICE_COOKIE, ""))[:500]
    html = _TEMPLATES.get_template(template).render(
        actor=actor,
        may_edit=actor is not None and actor.role.covers(Role.EDITOR),
        is_admin=actor is not None and actor.role.covers(Role.ADMIN),
        closed=closed,
        off=SWITCHED_OFF if closed else "",
        csrf=(actor.csrf_token or "") if actor is not None else "",
        here=request.url.path,
        notice=notice,
        **values,
    )
    # The one place that puts links below the sub-path. What people typed has no bare quote, so is no link.
    root = server_of(request).settings.root_path
    response = HTMLResponse(_LINK.sub(rf"\g<1>{root}/", html) if root else html, status)
    if notice:
        response.delete_cookie(NOTICE_COOKIE)
    return response
