# SPDX-License-Identifier: LGPL-2.1-or-later
"""The target that a live link has stored, also if FreeCAD did not find it.

``LinkedObject`` is None for a missing file, a missing object and an unset link alike. The link's stored form
knows (``dumpPropertyContent``), also while the document has unsaved edits.
"""

from __future__ import annotations

import io
import re
import zipfile
from typing import Any
from xml.sax.saxutils import unescape

# <XLink file="parts/b.FCStd" stamp="…" name="Box" …>, written by FreeCAD itself into memory just now.
_XLINK = re.compile(r"<XLink\b([^>]*)>")

_ATTRIBUTE = re.compile(r'\b(\w++)="([^"]*+)"')

_ENTITIES = {"&quot;": '"', "&apos;": "'", "&#10;": "\n", "&#13;": "\r", "&#9;": "\t"}


def stored_target(link: Any, name: str = "LinkedObject") -> tuple[str, str] | None:
    """Return the file and the object ``Name`` that a link has stored; ("", "") if it was never set, None if
    unknown.
    """
    stored = _stored(link, name)
    return None if stored is None else (stored.get("file", ""), stored.get("name", ""))


def stored_sub_name(link: Any) -> str:
    """Return the sub-name that a link has stored with its target."""
    return (_stored(link, "LinkedObject") or {}).get("sub", "")


def _stored(link: Any, name: str) -> dict[str, str] | None:
    try:
        packed = link.dumpPropertyContent(name, Compression=0)
        with zipfile.ZipFile(io.BytesIO(bytes(packed))) as content:
            text = content.read("Persistence.xml").decode("utf-8", "replace")
    except (AttributeError, NameError, RuntimeError, KeyError, zipfile.BadZipFile):
        return None
    element = _XLINK.search(text)
    if element is None:
        return None
    return {name: unescape(value, _ENTITIES) for name, value in _ATTRIBUTE.findall(element[1])}
