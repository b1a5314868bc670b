# SPDX-License-Identifier: LGPL-2.1-or-later
"""The files that come with the package: the example, and what FreeCAD loads of the add-on."""

from __future__ import annotations

from pathlib import Path


def shipped() -> Path:
    """Return the folder with the example and the add-on's own files: the checkout, or the wheel's copy
    of it.
    """
    wheel = Path(__file__).parent / "shipped"
    return wheel if wheel.is_dir() else Path(__file__).resolve().parents[2]
