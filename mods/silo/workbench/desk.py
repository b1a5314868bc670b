# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the flows need of FreeCAD and of its user; :mod:`silo.workbench.live_desk` has it.

With a desk of a test's own the flows run without FreeCAD and Qt. All calls are made in the GUI thread.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from silo.workbench.documents.opened import DocumentOrigin
from silo.workbench.documents.snapshot import Snapshot

# Seconds of the GUI thread; what has not been compared with its file by then counts as edited.
MOST_S = 0.08


class Documents(Protocol):
    """What a commit needs of FreeCAD; :class:`silo.workbench.live_desk.LiveDocuments` has it."""

    def linked(self, doc: Any, /) -> Iterable[Any]: ...

    def is_partial(self, doc: Any, /) -> bool: ...

    def is_modified(self, doc: Any, /) -> bool: ...

    def is_edited(self, doc: Any, until: float, /) -> bool: ...

    def is_writable(self, path: str, /) -> bool: ...

    def lost_objects(self, doc: Any, /) -> list[str]: ...

    def is_damaged(self, doc: Any, /) -> bool: ...

    def save(self, doc: Any, /) -> None: ...

    def base(self, doc: Any, /) -> DocumentOrigin: ...


def is_edited(documents: Documents, doc: Any) -> bool:
    """Return True if a document differs from its file; False if FreeCAD only marked it."""
    return documents.is_modified(doc) and documents.is_edited(doc, time.thread_time() + MOST_S)


class Desk(Protocol):
    """FreeCAD's documents, and its user: what every flow asks of them."""

    @property
    def documents(self) -> Documents: ...

    def snapshot(self, doc: Any, /) -> Snapshot:
        """Take a snapshot of a live document."""

    def find(self, path: str, /) -> Any | None:
        """Return the open document of a file; None if it is not open."""

    def identity(self, doc: Any, /) -> str | None:
        """Return the item to which a document belongs, without looking at its components."""

    def open(self, path: str, /) -> Any:
        """Open the document of a file completely."""

    def close(self, doc: Any, /) -> None:
        """Close a document without saving it."""

    def warn(self, title: str, text: str, /) -> None:
        """Show a message that a user must see."""

    def later(self, call: Callable[[], None], /) -> None:
        """Run something in a turn of its own, once the present event is done."""
