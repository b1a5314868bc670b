# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on's preferences: one table of names and defaults; an unknown name is an error.

They live in FreeCAD's parameter group ``BaseApp/Preferences/Mod/KindredSilo``, under the names that the
Kindred workbench uses where it has the same setting, so an existing set-up is found. Imported at FreeCAD's
start, so it imports next to nothing itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

GROUP = "User parameter:BaseApp/Preferences/Mod/KindredSilo"

HOLD, ALLOW = "hold", "allow"

DEFAULTS: Mapping[str, str | bool] = {
    "ApiUrl": "",
    "ApiToken": "",
    "SslVerify": True,
    "SslCertPath": "",
    "Schema": "kindred-rd",
    # The folder that the project view shows.
    "ProjectFolder": "",
    # The BOM sync after a commit; the file revision is uploaded in any case.
    "SyncBom": True,
    # HOLD: a BOM with a broken link waits until the link is repaired. ALLOW: it is synced without it.
    "MissingLinks": HOLD,
    # Standard parts of the Fasteners workbench are components.
    "CountHardware": True,
    "AskComment": True,
    "AskRegister": True,
    "LiveActivity": True,
    "ShowEverywhere": True,
}


class Parameters(Protocol):
    """FreeCAD's ``ParamGet(…)`` object, as far as it is needed here."""

    def GetString(self, name: str, default: str = "", /) -> str: ...

    def SetString(self, name: str, value: str, /) -> None: ...

    def GetBool(self, name: str, default: bool = False, /) -> bool: ...

    def SetBool(self, name: str, value: bool, /) -> None: ...


class Preferences:
    """Typed access to the parameter group."""

    def __init__(self, group: Parameters) -> None:
        self._group = group

    def text(self, name: str) -> str:
        """Return a text setting."""
        return self._group.GetString(name, str(_default(name, str)))

    def flag(self, name: str) -> bool:
        """Return a yes/no setting."""
        return self._group.GetBool(name, bool(_default(name, bool)))

    def set(self, name: str, value: str | bool) -> None:
        """Change a setting."""
        _default(name, type(value))
        if isinstance(value, bool):
            self._group.SetBool(name, value)
        else:
            self._group.SetString(name, value)


def _default(name: str, kind: type) -> str | bool:
    default = DEFAULTS.get(name)
    if default is None or type(default) is not kind:
        raise KeyError(f"{name}: no such preference of this kind; there are {', '.join(DEFAULTS)}")
    return default
