# SPDX-License-Identifier: LGPL-2.1-or-later
"""A tuple that equals a list: the spec's values hold lists, and frozen values cannot."""

from __future__ import annotations

from typing import TypeVar

T = TypeVar("T")


class Frozen(tuple[T, ...]):
    """A tuple that also equals a list of equal items: the spec's values hold lists, ours cannot change."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return tuple.__eq__(self, tuple(other) if isinstance(other, list) else other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = tuple.__hash__


def freeze(value: object, *names: str) -> None:
    """Turn these fields into tuples: a caller may give any iterable, but a frozen value holds a tuple."""
    for name in names:
        if type(given := getattr(value, name)) is not Frozen:
            object.__setattr__(value, name, Frozen(given))
