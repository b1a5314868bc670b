# SPDX-License-Identifier: LGPL-2.1-or-later
"""The order of linked documents: each after those to which it links."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any


def leaves_first(top: Any) -> Iterable[Any]:
    """Return a document and all documents to which it links, each once, after those to which it links itself.

    Documents that link to each other in a ring are in the order in which they are found.
    """
    sort = getattr(top, "getDependentDocuments", None)
    if sort is None:
        return _walked(top)
    try:
        # One look at all links; ``OutList`` takes one for each document: seconds in large assemblies.
        return list(sort(True))
    except RuntimeError:
        return _walked(top)


def _walked(top: Any) -> Iterator[Any]:
    seen: set[str] = set()
    stack: list[tuple[Any, Iterator[Any]]] = []

    def enter(doc: Any) -> None:
        seen.add(doc.Name)
        stack.append((doc, iter(tuple(getattr(doc, "OutList", ()) or ()))))

    enter(top)
    while stack:
        doc, below = stack[-1]
        following = next((d for d in below if d.Name not in seen), None)
        if following is not None:
            enter(following)
        else:
            stack.pop()
            yield doc
