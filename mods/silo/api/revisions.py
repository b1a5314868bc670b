# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an item's revisions say about a file of ours. Pure."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING

from silo.api.arrived import checksum_of

if TYPE_CHECKING:
    from silo.api.wire import Revision


def newest_number(revisions: Iterable[Revision]) -> int:
    """The number of the newest revision; 0 where there is none."""
    return max((revision.revision_number for revision in revisions), default=0)


def is_newest(sha256: str, revisions: Iterable[Revision]) -> bool:
    """True where the newest revision is this very file. An older one does not count: a person may go back."""
    newest = max(revisions, key=lambda revision: revision.revision_number, default=None)
    return newest is not None and checksum_of(newest) == sha256


def other_name(path: str, revisions: Iterable[Revision]) -> str:
    """The name of the item's newest file, where this one is called otherwise; "" where it is not.

    "Save As" copies the identity along.
    """
    named = [revision for revision in revisions if revision.file_name]
    if not named:
        return ""
    newest = max(named, key=lambda revision: revision.revision_number)
    known = os.path.basename(str(newest.file_name))
    return known if known.casefold() != os.path.basename(path).casefold() else ""
