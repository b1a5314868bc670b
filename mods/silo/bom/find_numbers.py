# SPDX-License-Identifier: LGPL-2.1-or-later
"""Find numbers: the number that a line of a BOM has on drawings, in lists and on paper.

* A new line gets a number once: the next multiple of the site's step above all that were given.
* A proposal, as CAD makes one, is taken if no other line has the number; else the line gets the next.
* The number of a removed line stays taken until the next release. Only its own part gets it again.
* A number that a user sets is taken as it is, also if another line has it: alternates share a number.

The numbers of lines that are there never change by this. The server and the fake use this one answer.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from typing import Generic, NamedTuple, TypeVar

STEP = 10
MOST_STEP = 1000
# A larger number, which only a user sets, is a name: what comes after it would be as long.
_LARGEST = 999_999_999

Part = TypeVar("Part", bound=Hashable)


class NewLine(NamedTuple, Generic[Part]):
    """A line that has no number yet: of which part, the number it asks for, and if a user set that."""

    part: Part
    wanted: str | None = None
    by_hand: bool = False


def give_numbers(
    new: Sequence[NewLine[Part]], taken: Iterable[str], gone: Mapping[str, Part], step: int = STEP
) -> tuple[list[str], dict[str, Part]]:
    """Return the number of each new line, and what is left of the numbers of removed lines.

    taken
        the numbers of the lines that are there.
    gone
        number → part of the lines that were removed since the last release.
    """
    there, left = set(taken), dict(gone)
    own: dict[Part, list[str]] = {}
    for number, part in gone.items():
        own.setdefault(part, []).append(number)
    there.update(line.wanted for line in new if line.by_hand and line.wanted)
    largest = _largest({*there, *left, *(line.wanted for line in new if line.wanted)})
    numbers: list[str] = []
    for line in new:
        if line.by_hand and line.wanted:
            number = line.wanted
        else:
            known = (line.wanted, *own.get(line.part, ()))
            free = (one for one in known if one and _is_free(one, line.part, there, left))
            number = next(free, "")
        if not number:
            largest = largest - largest % step + step
            number = str(largest)
        there.add(number)
        left.pop(number, None)
        numbers.append(number)
    return numbers, left


def _is_free(number: str, part: Part, there: Collection[str], gone: Mapping[str, Part]) -> bool:
    return number not in there and (number not in gone or gone[number] == part)


def _largest(numbers: Iterable[str]) -> int:
    whole = (int(number) for number in numbers if number.isascii() and number.isdigit() and len(number) < 10)
    return max((number for number in whole if number <= _LARGEST), default=0)
