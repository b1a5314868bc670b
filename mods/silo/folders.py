# SPDX-License-Identifier: LGPL-2.1-or-later
"""The user's folders for configuration, data and caches, by the platform's own rules.

The add-on inside FreeCAD may only need three packages, so the few lines of ``platformdirs`` that matter are
here: the XDG base directories, ``~/Library`` on macOS, ``%APPDATA%`` and ``%LOCALAPPDATA%`` on Windows.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

_NAME = "silo-mod"


def _folder(env: Mapping[str, str], xdg: str, unix: str, mac: str, windows: str) -> Path:
    home = Path(env.get("HOME") or Path.home())
    if sys.platform == "win32":
        return Path(env.get(windows) or home) / _NAME
    # XDG says that a relative path is to be ignored.
    chosen = env.get(xdg, "")
    if chosen and os.path.isabs(chosen):
        return Path(chosen) / _NAME
    return home / (mac if sys.platform == "darwin" else unix) / _NAME


def config_folder(env: Mapping[str, str] = os.environ) -> Path:
    """Where the configuration lives (not created here)."""
    return _folder(env, "XDG_CONFIG_HOME", ".config", "Library/Application Support", "APPDATA")


def data_folder(env: Mapping[str, str] = os.environ) -> Path:
    """Where what must not be lost lives: the outbox, the journal of registrations, the embedded database."""
    return _folder(env, "XDG_DATA_HOME", ".local/share", "Library/Application Support", "APPDATA")


def cache_folder(env: Mapping[str, str] = os.environ) -> Path:
    """Where what can be made again lives."""
    return _folder(env, "XDG_CACHE_HOME", ".cache", "Library/Caches", "LOCALAPPDATA")
