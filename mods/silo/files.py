# SPDX-License-Identifier: LGPL-2.1-or-later
"""The files that a run names to read: which are meant, and whether they exist."""

from __future__ import annotations

import glob
import os
from codecs import BOM_UTF8
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path

from silo.bom.errors import ConfigError, InputError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.platform.spelling import Spelling

IGNORE_FILE = ".siloignore"

Check = Callable[[str], bool | None]


def documents_in(tops: Iterable[str]) -> list[str]:
    """List the files that are meant, each once: a folder stands for all FCStd files below it.

    Left out are backups, hidden files and folders, recycle bins, and what a ``.siloignore`` in the folder or
    below it names (in the syntax of ``.gitignore``). A folder that cannot be listed is in the result itself,
    so that the reader of the files reports it. A pattern (``*.FCStd``) stands for the files that match it,
    since the shells of Windows pass patterns on unchanged. InputError names everything that is missing.
    """
    meant = list(chain.from_iterable(map(_documents_of, tops)))
    must_exist(*meant)
    spelling = Spelling()
    once: dict[str, str] = {}
    for top in meant:
        real = spelling.real(top)  # a file may be named in several ways
        if not os.path.isdir(top):
            once.setdefault(real, top)
            continue
        begin = len(os.path.join(top, ""))
        for path in sorted(_below(top)):
            once.setdefault(os.path.join(real, path[begin:]), path)
    return list(once.values())


def must_exist(*paths: str) -> None:
    """Raise InputError that names all missing files and folders, before anything is done."""
    lost = [path for path in paths if not os.path.exists(path)]
    if len(lost) == 1:
        raise InputError(message("{lost}: there is no such file or folder", lost=_quoted(lost[0])))
    if lost:
        raise InputError(
            message(
                "{count} of {total} files are not there; nothing was done",
                count=len(lost),
                total=len(paths),
            ),
            lost,
        )


def _quoted(path: str) -> str:
    return path if path.strip() else repr(path)


# What file systems and file managers keep beside the files of people: what was deleted, and older states.
_NOT_OURS = ("#recycle", "#snapshot", "$recycle.bin", "@recycle", "@recently-snapshot", "~snapshot")


def _below(folder: str, rules: tuple[tuple[int, Check], ...] = (), inner: str = "") -> Iterator[str]:
    """Yield the FCStd files below a folder. A folder that cannot be listed is yielded itself, so that reading
    it fails.

    rules
        for each folder above: the position in ``inner`` at which paths below it begin, and its patterns.
    inner
        the folder as seen from the first one; "" or ending in ``/``.
    """
    try:
        with os.scandir(folder) as listing:
            entries = sorted(listing, key=lambda entry: entry.name)
    except OSError:
        yield folder
        return
    own = os.path.join(folder, IGNORE_FILE)
    if os.path.isfile(own):
        rules = (*rules, (len(inner), _patterns(own)))
    for entry in entries:
        if entry.name.startswith(".") or entry.name.lower() in _NOT_OURS:
            continue
        if entry.is_dir(follow_symlinks=False):
            name = f"{inner}{entry.name}/"
            if not _ignored(name, rules):
                yield from _below(entry.path, rules, name)
        elif entry.name.lower().endswith(".fcstd") and not _ignored(inner + entry.name, rules):
            path = entry.path
            # A link to nothing is reported.
            if entry.is_file(follow_symlinks=False) or os.path.isfile(path) or not os.path.exists(path):
                yield path


def _ignored(name: str, rules: Sequence[tuple[int, Check]]) -> bool:
    """Decide as git does: the last matching pattern of the innermost file counts."""
    for begin, check in reversed(rules):
        if (decided := check(name[begin:])) is not None:
            return decided
    return False


def _patterns(path: str) -> Check:
    """Read a file of patterns as a function of a name: True: leave it out, False: keep it, None: no pattern
    matches.
    """
    try:
        from pathspec import GitIgnoreSpec
    except ImportError as error:  # inside FreeCAD
        raise ConfigError(
            message("{path} is there, but the Python package pathspec, which reads it, is not", path=path)
        ) from error
    try:
        # Names need not be valid Unicode, and a pattern with a form feed is one pattern.
        text = os.fsdecode(Path(path).read_bytes().removeprefix(BOM_UTF8))
        lines = [line.removesuffix("\r") for line in text.split("\n")]
        spec = GitIgnoreSpec.from_lines(lines)
    except (OSError, ValueError) as error:
        raise InputError(
            message("{path} cannot be read: {error}", path=path, error=why_refused(error))
        ) from error
    return lambda name: spec.check_file(name).include


def _documents_of(top: str) -> list[str]:
    if glob.has_magic(top) and not os.path.lexists(top):
        return sorted(glob.glob(top)) or [top]
    return [top]
