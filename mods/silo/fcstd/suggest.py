# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which file was meant, where one is missing: files move, and are renamed.

The rules of this module, the surest first; each names a file only where exactly one fits:

* it carries the Silo identity of the missing component, where the caller knows that (from the last sync);
* it has the same name (but for case and normalisation) in another folder.

In every case it must hold all the objects that the links want.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from silo.bom.entry import Extraction, walk_entries
from silo.bom.errors import DocumentError
from silo.bom.findings import Finding, FindingCode
from silo.bom.message import Message, message, template
from silo.bom.walk.identity import identity_of
from silo.fcstd.document import FcstdDocument
from silo.fcstd.library import Library
from silo.platform.spelling import folded
from silo.proposed_command import proposed

# A project has some hundreds of files; a home folder taken for one would have many more.
_MOST_FILES = 2000
_MOST_FOLDERS = 5000
_SUGGESTION = template("{found} Did you mean {file} ({why})? {command} mends the links.")
_CODES = (FindingCode.MISSING_FILE, FindingCode.MISSING_OBJECT)

# (file, object) → the Silo UUID that it had in the last sync.
Identities = Mapping[tuple[str, str], str]


@dataclass
class _Lost:
    file: str
    objects: set[str] = field(default_factory=set)


def with_suggestions(
    extraction: Extraction, identities: Identities | None = None, files: Iterable[str] | None = None
) -> Extraction:
    """Add to the findings of missing files the file that was probably meant.

    Reads the project's files, or those of ``files``; costs nothing if no file is missing.
    """
    lost = _lost(extraction)
    if not lost or (files is not None and not (files := list(files))):
        return extraction
    with Library() as library:
        files = _project_files(extraction) if files is None else files
        project = _Project(library, list(files), identities or {})
        meant = {file: path for file, lost_link in lost.items() if (path := project.meant(lost_link))}
    findings = tuple(_with_suggestion(finding, meant, extraction) for finding in extraction.findings)
    return replace(extraction, findings=findings)


def _with_suggestion(
    finding: Finding, meant: Mapping[str, tuple[str, str]], extraction: Extraction
) -> Finding:
    if finding.code not in _CODES or finding.file not in meant:
        return finding
    file, why = meant[finding.file]
    holder = finding.where[0].doc_path if finding.where else extraction.assembly.doc_path
    command = proposed("relink", Path(holder), "--from", Path(finding.file), "--to", Path(file))
    found = finding.message
    if isinstance(found, Message) and found.template == _SUGGESTION:
        found = found.values["found"]
    text = Message(_SUGGESTION, {"found": found, "file": file, "why": why, "command": command})
    return replace(finding, message=text, did_you_mean=file)


def _lost(extraction: Extraction) -> dict[str, _Lost]:
    files = {finding.file for finding in extraction.findings if finding.code in _CODES and finding.file}
    lost: dict[str, _Lost] = {}
    for entry in walk_entries(extraction.entries):
        if entry.missing and entry.doc_path in files:
            lost.setdefault(entry.doc_path, _Lost(entry.doc_path)).objects.add(entry.object_name)
    return lost


def _project_files(extraction: Extraction) -> Iterator[str]:
    """Yield the FreeCAD files in the folder that holds all files of the tree."""
    paths = [entry.doc_path for entry in walk_entries((extraction.assembly, *extraction.entries))]
    folders = [os.path.dirname(path) for path in paths if path]
    top = os.path.dirname(extraction.assembly.doc_path)
    try:
        root = os.path.commonpath(folders)
    except ValueError:  # another Windows drive
        root = top
    # The root of the disk, or the home folder, is no project.
    if root in (os.path.abspath(os.sep), os.path.expanduser("~")) or len(Path(root).parts) < 3:
        root = top
    left, folders_left = _MOST_FILES, _MOST_FOLDERS
    for folder, inner, names in os.walk(root):
        inner[:] = sorted(name for name in inner if not name.startswith("."))
        folders_left -= 1
        for name in sorted(names):
            if name.lower().endswith(".fcstd") and not name.startswith(".") and left > 0:
                left -= 1
                yield os.path.join(folder, name)
        if left <= 0 or folders_left <= 0:
            return


class _Project:
    """The files that may have been meant."""

    def __init__(self, library: Library, files: Sequence[str], identities: Identities) -> None:
        self._library, self._files, self._identities = library, files, identities
        self._opened: dict[str, FcstdDocument | None] = {}

    def meant(self, lost: _Lost) -> tuple[str, str] | None:
        """Find the file that was meant, and why; None unless exactly one file fits."""
        holding = [path for path in self._files if path != lost.file and self._holds(path, lost.objects)]
        rules: list[tuple[str, list[str]]] = [
            (
                message("it carries the Silo identity"),
                [path for path in holding if self._identified(path, lost)],
            ),
            (message("a file of this name"), [path for path in holding if _same_name(path, lost.file)]),
        ]
        for why, fitting in rules:
            # Copies of one file share its identity; their names may still distinguish them.
            exact = [path for path in fitting if _same_name(path, lost.file)] or fitting
            if len(exact) == 1:
                return exact[0], why
        return None

    def _document(self, path: str) -> FcstdDocument | None:
        if path not in self._opened:
            try:
                self._opened[path] = self._library.open(path)
            except DocumentError:
                self._opened[path] = None
        return self._opened[path]

    def _holds(self, path: str, objects: Iterable[str]) -> bool:
        document = self._document(path)
        return document is not None and all(document.getObject(name) is not None for name in objects if name)

    def _identified(self, path: str, lost: _Lost) -> bool:
        document = self._document(path)
        wanted = {name: self._identities.get((lost.file, name)) for name in lost.objects}
        if document is None or not all(wanted.values()):
            return False
        return all(
            (identity_of(document.getObject(name)) or "").lower() == (uuid or "").lower()
            for name, uuid in wanted.items()
        )


def _same_name(name: str, other: str) -> bool:
    return folded(os.path.basename(name)) == folded(os.path.basename(other.replace("\\", "/")))
