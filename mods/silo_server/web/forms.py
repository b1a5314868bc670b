# SPDX-License-Identifier: LGPL-2.1-or-later
"""Forms as they come from a browser, and the way back to a page with a notice."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated
from urllib.parse import quote

from fastapi import Depends, Request
from starlette.datastructures import FormData
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import RejectedError
from silo.bom.numbers import parse_number, plain, read_quantity
from silo_server.web.render import NOTICE_COOKIE

NOTICE_SECONDS = 60
# A browser takes no cookie beyond 4096 bytes, and a character may need twelve of them.
MOST_NOTICE = 300


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
    trimmed = value.replace("\x00", "").replace("\r\n", "\n").strip()
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


class AmbiguousError(RejectedError):
    """A number that can be read two ways; ``readings`` are both, written so that each can be read one way."""

    def __init__(self, message: str, readings: Sequence[str]) -> None:
        super().__init__(message)
        self.readings = tuple(readings)


def amount(typed: str, name: str = "quantity") -> float:
    """A quantity as people type it (``silo.bom.numbers``); RejectedError says what is wrong with it.

    Raises AmbiguousError for "1,000": the person is asked which of the two numbers was meant.
    """
    reading = read_quantity(typed)
    if reading.value is not None:
        return float(reading.value)
    number = parse_number(typed)
    if number is not None and number.other is not None:
        readings = [str(plain(number.other)), str(plain(number.exact))]
        raise AmbiguousError(f"{name}: {reading.problem}", readings)
    raise RejectedError(f"{name}: {reading.problem}")


@dataclass(frozen=True, slots=True)
class Edit:
    """What a form changes, where others may have changed the same thing since it was shown.

    mine
        what this person changed, and nobody else: to be written.
    clashes
        fields that this person and somebody else changed, each to something else: the person chooses.
    theirs
        fields that only others changed: they stay.
    """

    mine: Mapping[str, str]
    clashes: Sequence[str]
    theirs: Sequence[str]


def compared(
    now: Mapping[str, str],
    seen: Mapping[str, str],
    typed: Mapping[str, str],
    *,
    together: Sequence[Sequence[str]] = (),
    same: Callable[[str, str, str], bool] = lambda _name, a, b: a == b,
) -> Edit:
    """Three texts of each field: as it is now, as the form showed it, as it came back. Pure.

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


def back(path: str, notice: str = "", *, undo: int = 0) -> Response:
    """Go and look at ``path`` (303); ``notice`` stands there on top, once.

    It travels in a cookie and not in the address, so that no link can put words into our mouth.

    undo
        the change of a BOM that was just made, which a button beside the notice takes back; 0 for none.
    """
    response = RedirectResponse(path, 303)
    if notice:
        response.set_cookie(
            NOTICE_COOKIE,
            quote(f"{undo} {notice[:MOST_NOTICE]}"),
            max_age=NOTICE_SECONDS,
            httponly=True,
            samesite="lax",
        )
    return response
