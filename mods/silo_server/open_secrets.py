# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which secrets of a server lie open: what other users of its machine can read, what everybody can guess."""

from __future__ import annotations

import stat
from pathlib import Path

from sqlalchemy import make_url

from silo.platform.system import MODES_COUNT
from silo_server.settings import Settings

# Of the examples, and of those who were in a hurry.
GUESSED = frozenset({"", "password", "silo", "postgres", "secret", "changeme"})


def open_secrets(settings: Settings) -> list[str]:
    """List the codes of what lies open: ``admin_password``, ``database_password``, ``readable: PATH``."""
    url = make_url(settings.sqlalchemy_url)
    # Without a password PostgreSQL knows the server by its socket, or by a file of the server's own.
    found = {
        "admin_password": settings.admin_password is not None,
        "database_password": url.password is not None and str(url.password) in {*GUESSED, url.username},
    }
    paths = [settings.storage, *([settings.sqlite_path] if settings.sqlite_path else [])]
    return [
        *(code for code, lies_open in found.items() if lies_open),
        *("readable: " + str(path) for path in paths if _others_read(path)),
    ]


def _others_read(path: Path) -> bool:
    """Check if other users of the machine can read this, through all the folders above it."""
    if not MODES_COUNT:
        return False
    try:
        whole = path.resolve(strict=True)
        above = all(folder.stat().st_mode & stat.S_IXOTH for folder in whole.parents)
        return above and bool(whole.stat().st_mode & stat.S_IROTH)
    except OSError:
        return False
