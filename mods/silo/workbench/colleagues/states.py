# SPDX-License-Identifier: LGPL-2.1-or-later
"""The state of a file in words, for the project view and for what a commit left out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.file_state import FileState


def state_words(state: FileState) -> str:
    """Describe how a file stands to Silo."""
    texts = {
        "SAME": translate("Silo", "in Silo"),
        "NEW": translate("Silo", "not in Silo"),
        "EDITED": translate("Silo", "edited since its commit"),
        "NEWER": translate("Silo", "newer in Silo"),
        "BOTH": translate("Silo", "edited, and newer in Silo"),
        "WAITING": translate("Silo", "waits to be sent"),
        "HELD": translate("Silo", "held for your choice"),
        "SET_BACK": translate("Silo", "the server was restored from a backup: it has an older one"),
        "UNKNOWN": translate("Silo", "its item is not on this server"),
    }
    return texts[state.name]
