# SPDX-License-Identifier: LGPL-2.1-or-later
"""A file is written whole or not at all: cancelled halfway, the old file stays, with nothing beside it."""

from __future__ import annotations

import os
from pathlib import Path

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.platform.whole_files import replacing


def write_whole(path: Path | str, data: bytes, *, like: Path | str | None = None) -> None:
    """Replace ``path`` by ``data`` in one step. If it is a symbolic link, its target is replaced.

    ``like``: take the mode of that file; else that of the old file, else what a new file gets here.
    InputError if the folder or the file cannot be written.
    """
    target = Path(os.path.realpath(path))
    try:
        if target.exists() and not target.is_file():
            # A pipe or a device cannot be replaced, and need not be: it is not read twice.
            target.write_bytes(data)
            return
        with replacing(target, mode=_mode(target if like is None else Path(like))) as file:
            file.write(data)
    except OSError as error:
        raise InputError(
            message("{path}: cannot be written ({error})", path=path, error=why_refused(error))
        ) from error


def _mode(path: Path) -> int:
    try:
        return path.stat().st_mode & 0o7777
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
