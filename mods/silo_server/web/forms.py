# SPDX-License-Identifier: LGPL-2.1-or-later
"""Forms as they come from a browser, and the way back to a page with a notice."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import urlencode

from fastapi import Depends, Request
from starlette.datastructures import FormData
from starlette.responses import RedirectResponse, Response


async def _form(request: Request) -> FormData:
    # The guard read the form for its secret already; Starlette keeps it.
    return await request.form()


Form = Annotated[FormData, Depends(_form)]


def text(form: FormData, name: str, most: int = 500) -> str:
    """A text field, trimmed; "" where it is absent or a file."""
    value = form.get(name)
    return value.strip()[:most] if isinstance(value, str) else ""


def texts(form: FormData, name: str) -> list[str]:
    """All values of a repeated field."""
    return [value for value in form.getlist(name) if isinstance(value, str)]


def whole(form: FormData, name: str) -> int | None:
    """A whole number, None where there is none."""
    value = text(form, name)
    return int(value) if value.isascii() and value.isdigit() and len(value) < 16 else None


def back(path: str, notice: str = "") -> Response:
    """Go and look at ``path`` (303), with a sentence on top."""
    return RedirectResponse(f"{path}?{urlencode({'notice': notice})}" if notice else path, 303)
