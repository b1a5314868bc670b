# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whether a file is the one that an item's revisions came from. "Save As" copies the identity along."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from silo.api.wire import Revision


def other_name(path: str, revisions: Iterable[Revision]) -> str:
    """The name of the item's newest file, where this one is called otherwise; "" where it is not."""
    named = [revision for revision in revisions if revision.file_name]
    if not named:
        return ""
    newest = max(named, key=lambda revision: revision.revision_number)
    known = os.path.basename(str(newest.file_name))
    return known if known.casefold() != os.path.basename(path).casefold() else ""
