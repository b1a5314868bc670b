# SPDX-License-Identifier: LGPL-2.1-or-later
"""The client side of the wire. Importing this package loads neither requests nor pydantic; its names do."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.fake import FakeSilo

__all__ = ["FakeSilo", "SiloClient"]

_HOMES = {"FakeSilo": "silo.api.fake", "SiloClient": "silo.api.client"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
