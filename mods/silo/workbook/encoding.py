# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the first bytes of a file say: a workbook, or the Unicode encoding of a text."""

from __future__ import annotations

STARTS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""How XLSX and ODS files begin, and XLS files."""


def unicode_name(data: bytes) -> str | None:
    """Detect the Unicode encoding of a file by its mark or its zeros; None for UTF-8 without a mark, and for
    code pages.
    """
    if data.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    start = data[:64]
    if data.startswith(STARTS) or start.count(0) <= len(start) // 4:
        return None
    # UTF-16 without its mark: every second byte of ASCII text is zero.
    return "utf-16-le" if data[1:2] == b"\0" else "utf-16-be"
