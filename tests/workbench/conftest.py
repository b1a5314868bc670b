# SPDX-License-Identifier: LGPL-2.1-or-later
"""The vault of the tests of sending."""

from __future__ import annotations

from vault import vault

__all__ = ["vault"]
