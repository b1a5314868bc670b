# SPDX-License-Identifier: LGPL-2.1-or-later
"""Addresses that a form or a link may lead on to: those of this server."""

from __future__ import annotations


def local_path(target: str) -> str:
    """Return ``target`` if it is a path of this server, else the start page: no browser is sent elsewhere."""
    plain = target.startswith("/") and not target.startswith(("//", "/\\"))
    return target if plain and target.isprintable() else "/"
