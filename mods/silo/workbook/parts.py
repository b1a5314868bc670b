# SPDX-License-Identifier: LGPL-2.1-or-later
"""The parts of a zipped workbook, and the style of a cell in either format."""

from __future__ import annotations

from collections.abc import Callable
from xml.etree.ElementTree import Element

ReadPart = Callable[[str], Element]
"""Reads a part of the workbook, by its path."""

CellStyle = tuple[str, bool]
"""The number format of a cell, and True if its text is struck out."""
