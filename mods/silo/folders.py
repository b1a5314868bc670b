# SPDX-License-Identifier: LGPL-2.1-or-later
"""The user's folders for configuration, data and caches, by the platform's own rules.

Client and server ask here, so that what one wrote the other finds. The add-on inside FreeCAD may only need
three packages, so the few lines of ``platformdirs`` that matter are here: the XDG base directories,
``~/Library`` on macOS, ``%APPDATA%`` and ``%LOCALAPPDATA%`` on Windows. ``SILO_HOME`` names one folder for
all of them, on every platform. Standard library only.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from silo.platform import NAME

_FOLDER = "silo-mod"
_LOCAL, _ROAMING = ("LOCALAPPDATA", "AppData/Local"), ("APPDATA", "AppData/Roaming")


def _folder(
    env: Mapping[str, str], platform: str, xdg: str, unix: str, mac: str, windows: tuple[str, str]
) -> Path:
    if os.path.isabs(whole := env.get("SILO_HOME", "")):
        return Path(whole) / xdg[len("XDG_") : -len("_HOME")].lower()
    home = Path(env.get("HOME") or Path.home())
    if platform == "win32":
        variable, default = windows
        return Path(env.get(variable) or Path.home() / default) / _FOLDER
    # XDG says that a relative path is to be ignored.
    chosen = env.get(xdg, "")
    if chosen and os.path.isabs(chosen):
        return Path(chosen) / _FOLDER
    return home / (mac if platform == "darwin" else unix) / _FOLDER


def config_folder(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Path:
    """Where the configuration lives (not created here)."""
    return _folder(env, platform, "XDG_CONFIG_HOME", ".config", "Library/Application Support", _ROAMING)


def data_folder(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Path:
    """Where what must not be lost lives: the outbox, the journal of registrations, the embedded database.

    On Windows not in the roaming profile: a database that is copied between machines while it is open is soon
    a broken one.
    """
    return _folder(env, platform, "XDG_DATA_HOME", ".local/share", "Library/Application Support", _LOCAL)


def cache_folder(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Path:
    """Where what can be made again lives."""
    return _folder(env, platform, "XDG_CACHE_HOME", ".cache", "Library/Caches", _LOCAL)


def scratch_folder(prefix: str, parent: Path | str | None = None) -> tempfile.TemporaryDirectory[str]:
    """A temporary folder, as a context manager of its path; below ``parent``, else where the system has them.

    A file in it that another program still has open (Windows) stays, and is no error.
    """
    return tempfile.TemporaryDirectory(prefix=prefix, dir=parent, ignore_cleanup_errors=True)
