# SPDX-License-Identifier: LGPL-2.1-or-later
"""The secret of a form, masked so that the size of a compressed page reveals nothing about it."""

from __future__ import annotations

import secrets


def masked(secret: str) -> str:
    """Mask a secret for a page: the text is different each time.

    So the size of a compressed page that also shows an attacker's text reveals nothing about the secret (the
    BREACH attack).
    """
    raw = secret.encode()
    mask = secrets.token_bytes(len(raw))
    return _MASKED + (mask + bytes(a ^ b for a, b in zip(mask, raw, strict=True))).hex()


def unmasked(sent: str) -> bytes:
    """Return the secret behind a text of :func:`masked`; any other text comes back as it is."""
    if not sent.startswith(_MASKED):
        return sent.encode()
    try:
        both = bytes.fromhex(sent.removeprefix(_MASKED))
    except ValueError:
        return b""
    half = len(both) // 2
    return bytes(a ^ b for a, b in zip(both[:half], both[half:], strict=False))


_MASKED = "m."
