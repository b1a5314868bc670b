# SPDX-License-Identifier: LGPL-2.1-or-later
"""The user's folders for configuration, data and caches, by the platform's own rules.

Client and server ask here, so that what one wrote the other finds. The add-on inside FreeCAD may only need
three packages, so the few lines of ``platformdirs`` that matter are here: the XDG base directories,
``~/Library`` on macOS, ``%APPDATA%`` and ``%LOCALAPPDATA%`` on Windows. ``SILO_HOME`` names one folder for
all of them, on every platform."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from silo.platform.system import NAME

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
    """Return the folder of the configuration (it is not created here)."""
    return _folder(env, platform, "XDG_CONFIG_HOME", ".config", "Library/Application Support", _ROAMING)


def data_folder(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Path:
    """Return the folder of data that must not be lost: the outbox, the journal of registrations, the embedded
    database.

    On Windows it is not in the roaming profile, because a database that is copied between machines while it
    is open soon breaks.
    """
    return _folder(env, platform, "XDG_DATA_HOME", ".local/share", "Library/Application Support", _LOCAL)


def cache_folder(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Path:
    """Return the folder of data that can be made again."""
    return _folder(env, platform, "XDG_CACHE_HOME", ".cache", "Library/Caches", _LOCAL)
