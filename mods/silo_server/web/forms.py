# SPDX-License-Identifier: LGPL-2.1-or-later
"""Forms as they come from a browser, and the way back to a page with a notice."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated
from urllib.parse import quote

from fastapi import Depends, Request
from starlette.datastructures import FormData
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import RejectedError
from silo.bom.numbers import read_quantity
from silo_server.web.render import NOTICE_COOKIE

NOTICE_SECONDS = 60


async def _form(request: Request) -> AsyncIterator[FormData]:
    # The guard read the form for its secret already; Starlette keeps it.
    form = await request.form(max_files=1)
    try:
        yield form
    finally:
        await form.close()


Form = Annotated[FormData, Depends(_form)]


def text(form: FormData, name: str, most: int = 500) -> str:
    """A text field, trimmed; "" where it is absent or a file. RejectedError where it is longer."""
    value = form.get(name)
    if not isinstance(value, str):
        return ""
    trimmed = value.replace("\x00", "").strip()
    if len(trimmed) > most:
        raise RejectedError(f"{name}: wanted at most {most} characters, got {len(trimmed)}")
    return trimmed


def texts(form: FormData, name: str) -> list[str]:
    """All values of a repeated field."""
    return [value for value in form.getlist(name) if isinstance(value, str)]


def whole(form: FormData, name: str) -> int | None:
    """A whole number, None where there is none."""
    value = text(form, name)
    return int(value) if value.isascii() and value.isdigit() and len(value) < 16 else None


def amount(form: FormData, name: str) -> float:
    """A quantity as people type it (``silo.bom.numbers``); RejectedError says what is wrong with it."""
    reading = read_quantity(text(form, name))
    if reading.value is None:
        raise RejectedError(f"{name}: {reading.problem}")
    return float(reading.value)


def back(path: str, notice: str = "") -> Response:
    """Go and look at ``path`` (303); ``notice`` stands there on top, once.

    It travels in a cookie and not in the address, so that no link can put words into our mouth.
    """
    response = RedirectResponse(path, 303)
    if notice:
        response.set_cookie(
            NOTICE_COOKIE, quote(notice), max_age=NOTICE_SECONDS, httponly=True, samesite="lax"
        )
    return response
