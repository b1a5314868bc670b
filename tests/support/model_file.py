# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small files that are models by their content, whatever bytes a test wants in them."""

from __future__ import annotations

_DOCUMENT = b"<Document/>"


def model_file(content: bytes = b"") -> bytes:
    """A FreeCAD document as far as a server looks into it, with these bytes behind."""
    size = len(_DOCUMENT).to_bytes(4, "little")
    head = b"PK\x03\x04" + b"\x14\0\0\0\0\0" + bytes(8) + size + size + b"\x0c\0\0\0"
    return head + b"Document.xml" + _DOCUMENT + content
