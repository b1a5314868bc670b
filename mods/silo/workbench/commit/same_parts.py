# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the user decided once and is not asked again: files that are the same part on purpose.

One small JSON file in the user's data folder. Losing it costs a repeated question, no more.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from silo.bom.entry import Extraction, walk_entries
from silo.bom.findings import Finding, FindingCode
from silo.platform.memory_file import read_memory, write_memory
from silo.platform.user_folders import data_folder


class Decisions:
    """Identities that may occur in several files: identity → the files."""

    def __init__(self, path: Path | None = None) -> None:
        self._path = path or data_folder() / "same-parts.json"

    def accept(self, identity: str, files: Iterable[str]) -> None:
        """Accept that these files are the same part."""
        accepted = self._read()
        accepted[identity.lower()] = sorted({*accepted.get(identity.lower(), ()), *files})
        write_memory(self._path, accepted)

    def without_accepted(self, extraction: Extraction) -> Extraction:
        """Remove the copied-identity findings that a user has accepted."""
        if not any(f.code is FindingCode.COPIED_IDENTITY for f in extraction.findings):
            return extraction
        accepted_now = self._read()
        identities = {
            entry.key: (entry.silo_uuid or "").lower()
            for entry in walk_entries((extraction.assembly, *extraction.entries))
        }

        def accepted(finding: Finding) -> bool:
            if finding.code is not FindingCode.COPIED_IDENTITY or not finding.where:
                return False
            first = finding.where[0]
            files = {place.doc_path for place in finding.where}
            return files <= set(accepted_now.get(identities.get((first.doc_path, first.obj), ""), ()))

        kept = tuple(f for f in extraction.findings if not accepted(f))
        return replace(extraction, findings=kept)

    def _read(self) -> dict[str, list[str]]:
        memory = read_memory(self._path)
        return {
            key: [str(file) for file in files] for key, files in memory.items() if isinstance(files, list)
        }
