# SPDX-License-Identifier: LGPL-2.1-or-later
"""Choices of earlier registrations, proposed again for parts of the same words in the same folder.

One small file in the user's data folder. If it is lost, the user is asked again.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from silo.bom.entry import BomEntry
from silo.bom.items.stems import stems
from silo.platform.memory_file import read_memory, write_memory
from silo.platform.spelling import one_path
from silo.platform.user_folders import data_folder

# Of a folder, the newest choices.
MOST_LEARNT = 200


@dataclass(frozen=True)
class LearntChoice:
    """What the user chose for a part, so for parts of the same words in the same folder."""

    words: tuple[str, ...]
    category: str
    sourcing: str = ""
    supplier: str = ""


class Learnt:
    """What users chose, by the folder of the part: one small file. Losing it costs questions."""

    def __init__(self, path: Path | None = None) -> None:
        self._path = path or data_folder() / "learnt-choices.json"
        self._folders = read_memory(self._path)

    def of(self, entry: BomEntry, name: str) -> LearntChoice | None:
        """Find the learnt choice for a part whose words are all in this name; the longest, and of those the
        newest.
        """
        words = set(stems(name))
        fitting = [
            choice
            for choice in self._choices_in(_folder(entry))
            if choice.words and words.issuperset(choice.words)
        ]
        return max(reversed(fitting), key=lambda choice: len(choice.words), default=None)

    @property
    def recent(self) -> tuple[str, ...]:
        """Return the categories that were chosen last, the newest first."""
        folder = self._folders.get("")
        return tuple(map(str, folder)) if isinstance(folder, list) else ()

    def learn(self, choices: Iterable[tuple[BomEntry, str, LearntChoice]]) -> None:
        """Remember what was chosen for parts of these names."""
        for entry, name, choice in choices:
            self._folders[""] = [choice.category, *(code for code in self.recent if code != choice.category)][
                :8
            ]
            if not (words := tuple(sorted(set(stems(name))))):
                continue
            choice, folder = replace(choice, words=words), _folder(entry)
            kept = [older for older in self._choices_in(folder) if older.words != words][-MOST_LEARNT + 1 :]
            self._folders[folder] = [asdict(learnt) for learnt in (*kept, choice)]
        write_memory(self._path, self._folders)

    def _choices_in(self, folder: str) -> list[LearntChoice]:
        choices = self._folders.get(folder)
        try:
            return [LearntChoice(**{**choice, "words": tuple(choice["words"])}) for choice in choices or ()]
        except (TypeError, KeyError):  # written by another program
            return []


def _folder(entry: BomEntry) -> str:
    return os.path.dirname(one_path(entry.doc_path)) if entry.doc_path else ""
