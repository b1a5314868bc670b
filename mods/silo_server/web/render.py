# SPDX-License-Identifier: LGPL-2.1-or-later
"""Templates, and what every page shows: who is logged in, the form secret, notices."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from urllib.parse import quote

from fastapi import Request
from jinja2 import Environment, PackageLoader, StrictUndefined
from starlette.responses import HTMLResponse, Response

from silo_server.values import Actor, Role


def quantity(value: float | None, unit: str | None = None) -> str:
    """``12``, ``2.5 m``; a dash where there is none."""
    if value is None:
        return "–"
    return f"{value:g} {unit}".strip() if unit else f"{value:g}"


def day(stamp: str | datetime | None) -> str:
    """``2026-02-08 22:15``, UTC as stored."""
    text = stamp.isoformat() if isinstance(stamp, datetime) else stamp or ""
    return text[:16].replace("T", " ")


def plural(count: int, one: str, many: str) -> str:
    """``1 item is``, ``3 items are``."""
    return f"{count} {one if count == 1 else many}"


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
    environment.filters.update(quantity=quantity, day=day, segment=segment)
    environment.globals.update(plural=plural)
    return environment


_TEMPLATES = _environment()


def page(
    request: Request, template: str, actor: Actor | None, *, status: int = 200, **values: Any
) -> Response:
    """A page. ``actor`` None: nobody is logged in."""
    html = _TEMPLATES.get_template(template).render(
        actor=actor,
        may_edit=actor is not None and actor.role.covers(Role.EDITOR),
        is_admin=actor is not None and actor.role.covers(Role.ADMIN),
        csrf=(actor.csrf_token or "") if actor is not None else "",
        here=request.url.path,
        notice=request.query_params.get("notice", "")[:300],
        **values,
    )
    return HTMLResponse(html, status)
