# SPDX-License-Identifier: LGPL-2.1-or-later
"""A part number as the beginning of a file's name: a name on every system, for a number that need be none."""

from __future__ import annotations

import re

from silo.platform.device_names import no_device_name

_UNSAFE = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')


def part_file_stem(part_number: str) -> str:
    """Replace what a file's name cannot hold: ``4711/02`` becomes ``4711_02``."""
    return no_device_name(_UNSAFE.sub("_", part_number).strip(". ") or "_")
