# SPDX-License-Identifier: LGPL-2.1-or-later
"""Attachments on the pages: the words of their kinds, and the form that changes a kind or removes one."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.responses import Response

from silo_server.routes.requests import NumberedRoute
from silo_server.services import attachments
from silo_server.services.items import normal_uuid
from silo_server.web.accounts import Writer
from silo_server.web.forms import Form, back, text
from silo_server.web.render import N_, _, isolate, segment

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

_KINDS = {
    "drawing": N_("Drawing"),
    "step": N_("STEP file"),
    "data_sheet": N_("Data sheet"),
    "picture": N_("Picture"),
    "certificate": N_("Certificate"),
    "other": N_("Other file"),
}


def kind_words() -> dict[str, str]:
    """Return the name of each kind in the reader's language, in the order in which kinds are shown."""
    return {kind: _(words) for kind, words in _KINDS.items()}


@router.post("/items/{part_number}/attachments/{uuid}")
def change(call: Writer, part_number: str, uuid: str, form: Form) -> Response:
    """Give an attachment another kind, or remove it."""
    path = f"/items/{segment(part_number)}#attachments"
    with call.write() as tx:
        if text(form, "remove"):
            _item, gone = attachments.remove(tx, normal_uuid(uuid))
            return back(path, _("%(file)s is removed; releases keep it.", file=isolate(gone.file_name)))
        after = attachments.change_kind(tx, normal_uuid(uuid), text(form, "kind", 20))
    kind = kind_words()[after.kind]
    return back(path, _("%(file)s: %(kind)s.", file=isolate(after.file_name), kind=kind))
