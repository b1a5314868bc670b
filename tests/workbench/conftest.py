# SPDX-License-Identifier: LGPL-2.1-or-later
"""The vault of the tests of sending, and the FreeCAD of values of the tests of the flows."""

from __future__ import annotations

from desk import office

from vault import vault

__all__ = ["office", "vault"]
