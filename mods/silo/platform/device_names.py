# SPDX-License-Identifier: LGPL-2.1-or-later
"""Names that Windows takes for a device, refused on every platform, since files move between them."""

from __future__ import annotations

import re

# Windows opens a device under each of these names, in any folder and with any ending.
_DEVICE = re.compile(
    r"(?:CON|PRN|AUX|NUL|CLOCK\$|CONIN\$|CONOUT\$|(?:COM|LPT)[0-9¹²³])\s*(?:[.:].*)?\Z", re.I
)


def is_device_name(name: str) -> bool:
    """Return True if Windows takes this file name for a device. Ask on every platform, since files move
    between them.
    """
    return _DEVICE.match(name) is not None


def no_device_name(name: str) -> str:
    """Return ``name``, with a mark in front if Windows does not allow it."""
    return "_" * is_device_name(name) + name
