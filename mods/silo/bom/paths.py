# SPDX-License-Identifier: LGPL-2.1-or-later
"""Paths and sub-names as FreeCAD writes them. Text only; no file is looked at."""

from __future__ import annotations

import os.path
import re
from contextlib import suppress
from types import ModuleType
from typing import Any

# FreeCAD's names of geometry; ";" and "?" begin mapped and missing names (src/App/ElementNamingUtils.h).
_ELEMENT = re.compile(r"(?:Face|Edge|Vertex|Wire|Shell|Solid|CompSolid|Compound)\d+")
_MAPPED = (";", "?")

_ABSOLUTE = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://|[A-Za-z]:[\\/]|\\\\|//")


def located(recorded: str, owner: str) -> str:
    """The path that a link records, relative to its owner's folder, in full; one spelling per file.

    Paths that stand for themselves (absolute ones, ``https://…``), and those of unsaved documents, stay.
    """
    if _ABSOLUTE.match(recorded) or not owner:
        return recorded
    return os.path.normpath(os.path.join(os.path.dirname(owner), recorded))


def relative(path: str, base: str, rules: ModuleType = os.path) -> str:
    """``path`` as seen from the folder ``base``, with ``/``; whole where it lies on another Windows drive.

    ``rules``: ``ntpath`` or ``posixpath``, whatever the platform.
    """
    if not path or not base:
        return path
    with suppress(ValueError):  # there is no way from one drive to another
        path = rules.relpath(path, base)
    return path.replace(rules.sep, "/")


def is_element_name(name: str) -> bool:
    """True for geometry (``Face1``), false for what may be an object's name."""
    return bool(_ELEMENT.fullmatch(name)) or name.startswith(_MAPPED)


def split_sub_name(sub: Any) -> tuple[list[str], str]:
    """The objects that a sub-name passes through, and the geometry it ends at ("" for the whole object).

    Object names end in a dot, geometry names do not: ``"Sub.Bolt."``, ``"Inner.Face1"``. Of several sub-names
    the first counts; FreeCAD links one object only, so all of them share the way to it.
    """
    first = sub if isinstance(sub, str) else next((str(part) for part in sub or ()), "")
    parts = first.split(".")
    for position, part in enumerate(parts):
        if part.startswith(_MAPPED):  # mapped names have dots of their own
            return [step for step in parts[:position] if step], ".".join(parts[position:])
    *steps, last = parts
    return [step for step in steps if step], last
