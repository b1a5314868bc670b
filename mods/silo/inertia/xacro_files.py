# SPDX-License-Identifier: LGPL-2.1-or-later
"""Xacro: a URDF with macros, expanded by the package ``xacro`` before it is read.

A macro may stand for several links, and a link's name may be ``${prefix}arm``. So nothing is written into a
xacro file: the expanded URDF gets the inertia, whole, and the xacro stays as it is.
"""

from __future__ import annotations

import re
from pathlib import Path

from silo.bom.errors import ConfigError, InputError
from silo.bom.message import message

HEAD = 64 * 1024
"""Bytes in which the root element of a robot is looked for."""

_XACRO = re.compile(rb"<robot\b[^>]{0,4000}\bxmlns:xacro\s{0,100}=")


def is_xacro(data: bytes) -> bool:
    """Return True if a robot's root element names the namespace of xacro, and anything in it is of xacro.

    Expanded files often keep the namespace.
    """
    used = any(mark in data for mark in (b"<xacro:", b"${", b"$("))
    return used and _XACRO.search(data[:HEAD]) is not None


def expanded(path: Path) -> bytes:
    """Expand the macros of a file. Raises ConfigError without the package, InputError if xacro refuses."""
    try:
        import xacro
    except ImportError as error:
        raise ConfigError(
            message(
                "{file} is a xacro file, which the package xacro expands; it is not installed: "
                "pip install xacro",
                file=str(path),
            )
        ) from error
    try:
        text: str = xacro.process_file(str(path)).toprettyxml(indent="  ")
    except Exception as error:
        raise InputError(
            message("{file}: xacro cannot expand it: {error}", file=str(path), error=str(error))
        ) from error
    return text.encode("utf-8")


def refuse_writing(path: Path) -> None:
    """Raise InputError for a xacro file: its macros would be lost, or filled by half."""
    try:
        data = path.read_bytes() if path.is_file() else b""
    except OSError:
        return
    if is_xacro(data):
        raise InputError(
            message(
                "{file} is a xacro file, and nothing is written into it: one macro may stand for several "
                "links; --urdf-out FILE.urdf writes the expanded URDF with the inertia",
                file=str(path),
            )
        )
