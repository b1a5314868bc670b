# SPDX-License-Identifier: LGPL-2.1-or-later
"""How much a reader of foreign bytes may take: the limits as one value, and the account that a reader keeps.

* What is counted is what was read, never what a file claims of itself.
* A limit is reached with a sentence that names it; nothing is cut off in silence.
* A reader counts before it keeps. So a file beyond a limit costs no more than a file at the limit.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

from silo.bom.errors import InputError
from silo.bom.message import Message, message

KIB, MIB = 1024, 1024 * 1024


class Limit(StrEnum):
    """The limits of a budget, by the names of its fields."""

    BYTES = "bytes"
    OBJECTS = "objects"
    CELLS = "cells"
    DEPTH = "depth"
    TEXT = "text"


class OverBudgetError(InputError):
    """The bytes ask for more than their reader may take. ``limit`` names which limit was reached."""

    status_hint: ClassVar[int] = 413
    code: ClassVar[str] = "too_large"

    def __init__(self, sentence: str, limit: Limit) -> None:
        super().__init__(sentence)
        self.limit = limit


@dataclass(frozen=True, slots=True)
class Budget:
    """The limits for one piece of foreign bytes.

    bytes
        after unpacking.
    objects
        things that the reader keeps: elements, containers, rows, nodes, shapes.
    cells
        values in them: cells of a sheet, scalars of JSON, numbers of a mesh.
    depth
        levels of nesting.
    text
        characters of one text, such as a cell or a heading.
    """

    bytes: int
    objects: int
    cells: int
    depth: int
    text: int

    def account(self, source: str) -> Account:
        """Open an account for one piece of bytes; ``source`` names it in sentences."""
        return Account(self, source)


class Account:
    """What a reader took so far. Each method raises :class:`OverBudgetError` at the limit."""

    __slots__ = ("budget", "bytes", "cells", "objects", "source")

    def __init__(self, budget: Budget, source: str) -> None:
        self.budget = budget
        self.source = source
        self.bytes = self.objects = self.cells = 0

    def take_bytes(self, count: int) -> None:
        """Count unpacked bytes."""
        self.bytes += count
        if self.bytes > self.budget.bytes:
            raise self._over(Limit.BYTES)

    def take_objects(self, count: int = 1) -> None:
        """Count things that are kept."""
        self.objects += count
        if self.objects > self.budget.objects:
            raise self._over(Limit.OBJECTS)

    def take_cells(self, count: int = 1) -> None:
        """Count values that are kept."""
        self.cells += count
        if self.cells > self.budget.cells:
            raise self._over(Limit.CELLS)

    def check_depth(self, levels: int) -> None:
        """Check how deep the reader is."""
        if levels > self.budget.depth:
            raise self._over(Limit.DEPTH)

    def check_text(self, text: str) -> str:
        """Check the length of one text, and return the text."""
        if len(text) > self.budget.text:
            raise self._over(Limit.TEXT)
        return text

    def bytes_left(self) -> int:
        """Return how many bytes may still be unpacked."""
        return self.budget.bytes - self.bytes

    def _over(self, limit: Limit) -> OverBudgetError:
        return OverBudgetError(_sentence(self.source, self.budget, limit), limit)


def _sentence(source: str, budget: Budget, limit: Limit) -> Message:
    match limit:
        case Limit.BYTES:
            return message(
                "{source}: unpacked, it is larger than {most}", source=source, most=size(budget.bytes)
            )
        case Limit.OBJECTS:
            return message("{source}: it holds more than {most} objects", source=source, most=budget.objects)
        case Limit.CELLS:
            return message("{source}: it holds more than {most} values", source=source, most=budget.cells)
        case Limit.DEPTH:
            return message(
                "{source}: it is nested deeper than {most} levels", source=source, most=budget.depth
            )
        case Limit.TEXT:
            return message(
                "{source}: a text in it is longer than {most} characters", source=source, most=budget.text
            )


def size(count: int) -> str:
    """Write a number of bytes for people: 64 KiB, 16 MiB."""
    return (
        message("{mib} MiB", mib=f"{count / MIB:g}")
        if count >= MIB
        else message("{kib} KiB", kib=f"{count / KIB:g}")
    )
