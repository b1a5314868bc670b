# SPDX-License-Identifier: LGPL-2.1-or-later
"""The client side of the wire. Importing this package loads neither requests nor pydantic; its names do."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from silo.api.client import SiloClient

__all__ = ["SiloClient"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module("silo.api.client").SiloClient
