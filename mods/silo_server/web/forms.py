# SPDX-License-Identifier: LGPL-2.1-or-later
"""Forms as they come from a browser, and the way back to a page with a notice."""

from __future__ import annotations

import json
import secrets
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Annotated
from urllib.parse import quote, unquote, urlsplit

from fastapi import Depends, Request
from starlette.datastructures import FormData
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import RejectedError, SiloError
from silo.bom.message import message
from silo.bom.numbers import parse_number, read_quantity, whole_number
from silo.bom.quantities import plain
from silo.bom.text import character_problem
from silo_server.routes.call import server_of
from silo_server.routes.requests import form_of
from silo_server.services.access.passwords import MAX_PASSWORD
from silo_server.web.render import NOTICE, NOTICE_COOKIE, _
from silo_server.web.unsent_form import unsent_form

NOTICE_SECONDS = 60
SECRET_COOKIE = "silo_shown_once"
# A browser takes no cookie beyond 4096 bytes, and a character may need twelve of them.
MOST_NOTICE = 200
MOST_CHANGES = 1500


async def _form(request: Request) -> AsyncIterator[FormData]:
    form = await form_of(request)
    # For a page that says why it was refused: a handler of errors may get a request without its body.
    request.state.kept = unsent_form(request.url.path, form)
    try:
        yield form
    finally:
        await form.close()


Form = Annotated[FormData, Depends(_form)]


def text(form: FormData, name: str, most: int = 500) -> str:
    """Read a text field, trimmed; "" if it is absent or a file. RejectedError above ``most`` characters."""
    value = form.get(name)
    if not isinstance(value, str):
        return ""
    if problem := character_problem(value):
        raise RejectedError(f"{name}: {problem}")
    trimmed = value.replace("\r\n", "\n").strip()
    if len(trimmed) > most:
        raise RejectedError(
            _(
                "%(name)s: wanted at most %(most)s characters, got %(count)s",
                name=name,
                most=most,
                count=len(trimmed),
            )
        )
    return trimmed


def texts(form: FormData, name: str) -> list[str]:
    """Read all values of a repeated field."""
    return [value for value in form.getlist(name) if isinstance(value, str)]


def password_of(form: FormData, name: str) -> str:
    """Read a password as it was typed: spaces at its ends belong to it."""
    value = form.get(name)
    return value[: MAX_PASSWORD + 1] if isinstance(value, str) else ""


def whole(form: FormData, name: str) -> int | None:
    """Read a whole number; None if there is none."""
    return whole_number(text(form, name))


def back_to(form: FormData, usual: str, below: str = "/items/") -> str:
    """Return the page that a form came from (``back``) if it is below ``below``, else the usual one."""
    path = text(form, "back", 2000)
    return path if path.startswith(below) else usual


def own_site(request: Request) -> bool | None:
    """Check if a form comes from our own pages; None if the browser does not say."""
    site = request.headers.get("sec-fetch-site")
    if site is not None:
        return site in ("same-origin", "none")
    origin = request.headers.get("origin")
    return None if origin is None else urlsplit(origin).netloc == request.headers.get("host")


class AmbiguousError(RejectedError):
    """A number that can be read two ways; ``readings`` are both, written so that each can be read one way."""

    def __init__(self, message: str, readings: Sequence[str]) -> None:
        super().__init__(message)
        self.readings = tuple(readings)


def amount(typed: str, name: str = "quantity") -> Decimal:
    """Read a quantity as people type it (``silo.bom.numbers``); RejectedError says what is wrong.

    Raises AmbiguousError for "1,000": the person is asked which of the two numbers was meant.
    """
    reading = read_quantity(typed)
    if reading.value is not None:
        return reading.value
    number = parse_number(typed)
    if number is not None and number.other is not None:
        readings = [str(plain(number.other)), str(plain(number.exact))]
        raise AmbiguousError(_of_field(name, reading.problem), readings)
    raise RejectedError(_of_field(name, reading.problem))


def _of_field(name: str, problem: str) -> str:
    if name == "quantity":
        return message("quantity: {problem}", problem=problem)
    return message("{part_number}: {problem}", part_number=name, problem=problem)


def problems_of(error: SiloError) -> Sequence[str]:
    """List what is wrong with a form: the problems of an error, or else its message."""
    return (error.problems if isinstance(error, RejectedError) else ()) or [str(error)]


@dataclass(frozen=True, slots=True)
class Edit:
    """What a form changes; others may have changed the same thing since it was shown.

    mine
        what this person changed, and no one else: to be written.
    clashes
        fields that this person and somebody else changed, each to something else: the person chooses.
    theirs
        fields that only others changed: they stay.
    """

    mine: Mapping[str, str]
    clashes: Sequence[str]
    theirs: Sequence[str]


def same_text(a: str, b: str, *, lines: bool = False) -> bool:
    """Check if a form sends both texts back alike: without spaces at the ends, and without line breaks.

    Programs store texts with them; if only the browser took them away, the text was not changed.

    lines
        the field has several lines, and keeps their breaks, each as one line feed.
    """

    def sent(text: str) -> str:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        return (text if lines else text.replace("\n", "")).strip()

    return sent(a) == sent(b)


def compared(
    now: Mapping[str, str],
    seen: Mapping[str, str],
    typed: Mapping[str, str],
    *,
    together: Sequence[Sequence[str]] = (),
    same: Callable[[str, str, str], bool] = lambda _name, a, b: a == b,
) -> Edit:
    """Compare three texts of each field: as it is now, as the form showed it, as it came back. Pure.

    A field that the form did not show or did not send is one that the person did not change.

    together
        fields that mean something only together, such as a quantity and its unit.
    same
        (field, text, text) → whether both say the same.
    """
    grouped = {name for group in together for name in group}
    groups = [*together, *((name,) for name in now if name not in grouped)]
    mine: dict[str, str] = {}
    clashes: list[str] = []
    theirs: list[str] = []
    for group in groups:
        before = {name: seen.get(name, now[name]) for name in group}
        wanted = {name: typed.get(name, before[name]) for name in group}
        changed = [name for name in group if not same(name, wanted[name], before[name])]
        moved = [name for name in group if not same(name, now[name], before[name])]
        if changed and moved and not all(same(name, wanted[name], now[name]) for name in group):
            clashes.extend(group)
        elif changed and not moved:
            mine.update({name: wanted[name] for name in changed})
        else:
            theirs.extend(name for name in moved if name not in changed)
    return Edit(mine, clashes, theirs)


def back(path: str, notice: str = "", *, undo: Sequence[int] = ()) -> Response:
    """Redirect to ``path`` (303); ``notice`` is shown on top of that page, once.

    It travels in a cookie and not in the address, so that no link can put words into our mouth. The address
    has the cookie's key: no other tab, nor a script that fetches a page there, takes the notice.

    undo
        the changes of BOMs that were just made, which a button beside the notice takes back; 0 for none.
    """
    key = secrets.token_hex(4) if notice else ""
    page, mark, place = path.partition("#")
    query = f"{'&' if '?' in page else '?'}{NOTICE}={key}" if key else ""
    response = RedirectResponse(f"{page}{query}{mark}{place}", 303)
    if notice:
        changes = ",".join(str(change) for change in undo if change)
        response.set_cookie(
            f"{NOTICE_COOKIE}_{key}",
            quote(f"{changes if len(changes) <= MOST_CHANGES else ''} {notice[:MOST_NOTICE]}"),
            max_age=NOTICE_SECONDS,
            httponly=True,
            samesite="lax",
        )
    return response


def back_with_secret(request: Request, path: str, name: str, secret: str) -> Response:
    """Redirect to ``path`` (303), which shows a new secret once: to load that page again makes no second.

    The secret travels in a cookie for that page alone, which :func:`secret_of` reads and the page takes away.
    """
    server = server_of(request)
    response = RedirectResponse(path, 303)
    response.set_cookie(
        SECRET_COOKIE,
        quote(json.dumps([name, secret])),
        max_age=NOTICE_SECONDS,
        path=server.settings.root_path + path,
        httponly=True,
        samesite="strict",
        secure=server.settings.secure_cookies or request.url.scheme == "https",
    )
    return response


def secret_of(request: Request) -> tuple[str, str] | None:
    """Read (name, secret) that waits to be shown on this page; None if there is none."""
    try:
        name, secret = json.loads(unquote(request.cookies.get(SECRET_COOKIE, "")))
    except (ValueError, TypeError):
        return None
    return str(name), str(secret)


def take_away_secret(request: Request, response: Response, path: str) -> Response:
    """Delete the cookie of :func:`back_with_secret`, now that its secret was shown."""
    response.delete_cookie(SECRET_COOKIE, path=server_of(request).settings.root_path + path)
    return response
