# SPDX-License-Identifier: LGPL-2.1-or-later
"""What became of the files below a commit: one line for each, as Silo has it after sending. Pure."""

from __future__ import annotations

import os
import time
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from silo.workbench.activity.box import EntryLine, PaneEntry
from silo.workbench.colleagues.states import state_words
from silo.workbench.tone import Tone
from silo.workbench.words import counted, filled, spoken, translate

if TYPE_CHECKING:
    from silo.vault.project import FileStanding


def below_box(path: str, standings: Sequence[FileStanding], sent: Collection[str]) -> PaneEntry:
    """Make the box: what is not in Silo as it is here comes first.

    sent
        the files that this commit made a revision of.
    """
    lines = sorted((_line(one, sent) for one in standings), key=lambda line: _ORDER.index(line.tone))
    left = sum(line.tone is Tone.ERROR for line in lines)
    name = os.path.basename(path)
    if left:
        title = translate("Silo", "Not all files below it are in Silo: {name}", name=name)
    else:
        waiting = sum(line.tone is Tone.CHANGED for line in lines)
        one = translate("Silo", "{n} file of it is in Silo as it is here: {name}")
        many = translate("Silo", "{n} files of it are in Silo as they are here: {name}")
        if waiting:
            one = translate("Silo", "{n} file of it waits to be sent: {name}")
            many = translate("Silo", "{n} files of it wait to be sent: {name}")
        title = filled(counted(waiting or len(lines), one, many), name=name)
    tone = Tone.ERROR if left else Tone.GOOD
    return PaneEntry(
        f"below:{path}", title, time.time(), tone, lines=tuple(lines), rank=1, icon="silo-commit"
    )


_ORDER = (Tone.ERROR, Tone.CHANGED, Tone.GOOD, Tone.QUIET)


def _line(standing: FileStanding, sent: Collection[str]) -> EntryLine:
    """Write the line of a file: sent, the same, waiting, or left out and why."""
    file, state = standing.file, standing.state.name
    tone, words = Tone.ERROR, state_words(standing.state)
    if standing.held:
        words = translate("Silo", "its BOM is held: {why}", why=spoken(standing.held))
    elif state == "SAME":
        is_sent = file.path in sent
        tone = Tone.GOOD if is_sent else Tone.QUIET
        words = translate("Silo", "sent") if is_sent else translate("Silo", "the same")
    elif state == "WAITING":
        tone = Tone.CHANGED
    return EntryLine(f"{file.place}: {words}", tone)
