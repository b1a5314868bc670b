# SPDX-License-Identifier: LGPL-2.1-or-later
"""For tests, ours and those of scripts that use silo-mod: a Silo in memory. No other package imports it."""

from __future__ import annotations

from silo.testing.fake import FakeSilo

__all__ = ["FakeSilo"]
