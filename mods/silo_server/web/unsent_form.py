# SPDX-License-Identifier: LGPL-2.1-or-later
"""A form that was not carried out: what its page shows of it, and how it travels over a login.

* What travels is signed by this server, and small. Nothing is read that is not signed.
* A larger form is not kept; the login page says so.
* A password goes only where it was typed for.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass

from starlette.datastructures import FormData

from silo.budget import KIB
from silo_server.web.local_path import local_path
from silo_server.web.render import _

_PASSWORDS = frozenset({"password", "again", "current"})
# Fields that no user typed.
_MACHINE = re.compile(
    r"csrf_token|at|back|target|view|mark|asked|bulk|version|packed|child_id|change_id|next|from|id|key|base_revision"
    r"|was[_.].*"
)
# Longer than any form that is typed by hand; a decision about thousands of lines is longer.
MOST_KEPT = 16 * KIB


@dataclass(frozen=True, slots=True)
class UnsentForm:
    """A form that was not carried out, to be sent again by the user who filled it in.

    files
        (field, name) of the files in it, which have to be chosen again.
    """

    path: str
    fields: Sequence[tuple[str, str]]
    files: Sequence[tuple[str, str]] = ()

    @property
    def typed(self) -> list[tuple[str, str]]:
        """List (label, text) of what a user typed or chose."""
        typed_fields = [
            (name, value) for name, value in self.fields if value and not _MACHINE.fullmatch(name)
        ]
        lines = [value for name, value in typed_fields if name == "chosen"]
        shown = [(_label(name), value) for name, value in typed_fields if name != "chosen"]
        return shown + ([(_("Chosen lines"), str(len(lines)))] if lines else [])

    def signed(self, key: bytes) -> str:
        """Write the form as one signed text, which travels in the login form; "" if it is too large."""
        written = json.dumps([self.path, self.fields, self.files]).encode("utf-8", "surrogatepass")
        if len(written) > MOST_KEPT:
            return ""
        return f"{_signature(written, key)}.{base64.b64encode(written).decode('ascii')}"


def read_signed(text: str, key: bytes) -> UnsentForm | None:
    """Read a text of :meth:`UnsentForm.signed`; None if this server did not sign it."""
    if len(text) > 2 * MOST_KEPT:
        return None
    signature, _dot, packed = text.partition(".")
    try:
        written = base64.b64decode(packed, validate=True)
    except (binascii.Error, ValueError):
        return None
    if not hmac.compare_digest(signature.encode("utf-8", "replace"), _signature(written, key).encode()):
        return None
    path, fields, files = json.loads(written.decode("utf-8", "surrogatepass"))
    return UnsentForm(
        local_path(path), [(name, value) for name, value in fields], [(name, file) for name, file in files]
    )


def _signature(written: bytes, key: bytes) -> str:
    return hmac.new(key, b"unsent form " + written, hashlib.sha256).hexdigest()


def _label(name: str) -> str:
    labels = {"child": _("Part number"), "why": _("Reason for the change")}
    # "p.mass_kg", and "o.1.name" with "o.1.value", are properties in the form of an item.
    plain = re.sub(r"^p\.|^o\.\d+\.(?=value$)", "", re.sub(r"^o\.\d+\.name$", "property", name))
    return labels.get(name, _(plain.replace("_", " ").capitalize()))


def unsent_form(path: str, form: FormData) -> UnsentForm | None:
    """Copy what a form holds, without its secret; None if it holds a password."""
    if _PASSWORDS & form.keys():
        return None
    pairs = form.multi_items()
    fields = [(name, value) for name, value in pairs if isinstance(value, str) and name != "csrf_token"]
    files = [(name, file.filename) for name, file in pairs if not isinstance(file, str) and file.filename]
    return UnsentForm(path, fields, files)
