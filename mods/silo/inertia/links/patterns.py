# SPDX-License-Identifier: LGPL-2.1-or-later
"""The patterns of a link map: which instances and sub-assemblies a pattern matches.

``*`` stands for anything within one level, ``?`` for one character, ``**`` for any number of levels. A
pattern is about instance names; after ``product:`` about product names; after ``path:`` it has no
wildcards.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import count, islice

from silo.inertia.assembly import Instance
from silo.inertia.links.link_map import PATH, PRODUCT


def matches(pattern: str, instance: Instance) -> bool:
    """Return True if a pattern matches this instance or a sub-assembly above it."""
    if pattern.startswith(PATH):
        exact = pattern.removeprefix(PATH)
        return any("/".join(instance.path[:end]) == exact for end in range(1, len(instance.path) + 1))
    by_product = pattern.startswith(PRODUCT)
    names: Sequence[str] = instance.product_path if by_product else instance.path
    regex = _regex(pattern.removeprefix(PRODUCT) if by_product else pattern)
    if by_product:
        # A product pattern may begin at any level: a product is the same wherever it stands.
        return any(
            regex.fullmatch("/".join(names[start:end]))
            for start in range(len(names))
            for end in range(start + 1, len(names) + 1)
        )
    return any(regex.fullmatch("/".join(names[:end])) for end in range(1, len(names) + 1))


def components(pattern: str, instances: Sequence[Instance]) -> list[list[int]]:
    """Find the instances of each placed part or sub-assembly that a pattern matches, highest level first."""
    rows_by_path: dict[tuple[str, ...], list[int]] = {}
    for index, instance in enumerate(instances):
        levels = (
            replace(instance, path=instance.path[:n], product_path=instance.product_path[:n])
            for n in count(1)
        )
        for level in islice(levels, len(instance.path)):
            if matches(pattern, level):
                rows_by_path.setdefault(level.path, []).append(index)
                break
    return list(rows_by_path.values())


@lru_cache(maxsize=1024)
def _regex(pattern: str) -> re.Pattern[str]:
    text = "/".join(_level(level) for level in pattern.strip("/").split("/"))
    return re.compile(
        text.replace(_ANY + "/", "(?:.*/)?").replace("/" + _ANY, "(?:/.*)?").replace(_ANY, ".*"), re.DOTALL
    )


_ANY = "\x00"


def _level(level: str) -> str:
    """Translate one level into a regular expression: ``*`` and ``?`` never cross a slash."""
    if level == "**":
        return _ANY
    first, *others = (
        re.escape(piece).replace(r"\?", "[^/]").replace(_ANY, r"\x00") for piece in re.split(r"\*+", level)
    )
    # The first place that fits a piece is as good as any later one, so no ``*`` is tried twice.
    between = "".join(f"(?>[^/]*?{piece})" for piece in others[:-1])
    return first + between + "".join(f"[^/]*{piece}" for piece in others[-1:])
