# SPDX-License-Identifier: LGPL-2.1-or-later
"""The view that a FreeCAD before 0.19 saved: only GuiDocument.xml says there what is hidden.

Later files say it of each object in Document.xml as well. A FreeCAD without a window reads no view.
"""

from __future__ import annotations

import re

_NAME = re.compile(rb'\Aname="([^"]{1,400})"')
_SHOWN = re.compile(rb'<Property name="Visibility"[^<>]{0,200}>\s{0,80}<Bool value="(true|false)"')


def visible_in(view: bytes) -> dict[str, bool]:
    """Return for each object of a GuiDocument.xml if it is visible."""
    found = {}
    for piece in view.split(b"<ViewProvider ")[1:]:
        name, shown = _NAME.match(piece), _SHOWN.search(piece)
        if name and shown:
            found[name[1].decode("utf-8", "replace")] = shown[1] == b"true"
    return found
