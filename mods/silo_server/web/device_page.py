# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page on which a user lets a program in: types its code, sees what asks, allows or refuses."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from starlette.responses import Response

from silo.bom.errors import NotFoundError
from silo_server.routes.device_logins import PAGE
from silo_server.services.access import device_logins
from silo_server.services.access.device_logins import PROGRAM_DAYS
from silo_server.web.accounts import Reader
from silo_server.web.forms import Form, back, text
from silo_server.web.render import _, page

router = APIRouter(include_in_schema=False)

Code = Annotated[str, Query(max_length=40)]


@router.get(PAGE)
def ask(call: Reader, code: Code = "") -> Response:
    """Ask for the code; for a code that waits, show the program and ask if it may come in."""
    login, problem = None, ""
    if code:
        try:
            with call.read() as tx:
                login = device_logins.waiting_login(tx, code)
        except NotFoundError as error:
            problem = str(error)
    status = 404 if problem else 200
    return page(
        call, "device.html", status=status, login=login, problem=problem, days=PROGRAM_DAYS, typed=code
    )


@router.post(PAGE)
def answer(call: Reader, form: Form) -> Response:
    """Let the program in, or send it away."""
    code = text(form, "code", 40)
    with call.write(even_when_read_only=True) as tx:
        if text(form, "answer") == "allow":
            device_logins.allow(tx, code)
            notice = _("The program is logged in. You may close this page.")
        else:
            device_logins.refuse(tx, code)
            notice = _("The program was not let in.")
    return back("/account", notice)
