# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a pull left alone, in sentences and as choices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from silo.workbench.colleagues.theirs import Theirs
from silo.workbench.words import filled, plain, translate

if TYPE_CHECKING:
    from silo.vault.pull import Pulled


def over_edits(pulled: Pulled) -> list[Theirs]:
    """Return the new versions of files whose edits are not in Silo."""
    return [
        Theirs(str(file.path), file.part_number, file.revision, newer={"revision_number": file.revision})
        for file in pulled.files
        if file.state.value == "edited"
    ]


def left_alone(pulled: Pulled) -> Sequence[str]:
    """Say what a pull did not do, in sentences."""
    from silo.vault.pull import PullState

    texts = {
        PullState.EDITED: translate("Silo", "{name} has edits that are not in Silo; it was left alone."),
        PullState.WAITING: translate("Silo", "{name} waits to be sent; it was left alone."),
        PullState.SET_BACK: translate(
            "Silo", "{name} is newer than the server, which was restored from a backup; it was left alone."
        ),
        PullState.OPEN: translate("Silo", "{name} is open in FreeCAD; it was left alone."),
    }
    lines = [
        texts[file.state].replace("{name}", file.path.name) for file in pulled.files if file.state in texts
    ]
    lost = translate("Silo", "{path}, which {name} links to, was not fetched: {reason}")
    for link in pulled.lost:
        text = filled(lost, path=link.path or "?", name=link.position, reason=link.reason)
        lines.append(plain(text, 300))
    return lines
