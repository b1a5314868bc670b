# SPDX-License-Identifier: LGPL-2.1-or-later
"""Let the links of a file lead to another file than they record, and change nothing else of it.

FreeCAD has no way to mend a link whose target has moved but to make it anew, which loses placements and
joints. Here only the recorded path changes: object, sub-names and the rest of the file stay as they are.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from silo.bom.errors import DocumentError, InputError
from silo.fcstd.careful import Malformed, as_utf8, start_tags
from silo.fcstd.container import ContainerFile
from silo.fcstd.edit import check_writable, document_xml, edited_xml, replace_file
from silo.fcstd.library import Library
from silo.fcstd.limits import Limits
from silo.fcstd.linked import TAGS
from silo.fcstd.rewrite import replaced_entry

_FILE = re.compile(rb"""(\sfile\s*=\s*)("[^"]*"|'[^']*')""")


@dataclass(frozen=True)
class Relinked:
    """A file whose links were mended, or would be: its path, how many links, and to which objects."""

    path: str
    links: int
    objects: tuple[str, ...]


class _Record(NamedTuple):
    at: int
    name: str


def relink(
    paths: Iterable[Path | str],
    old: Path | str,
    new: Path | str,
    *,
    dry_run: bool = False,
    check: Callable[[str], None] = lambda _path: None,
) -> list[Relinked]:
    """Mend the links of these files that record ``old``, to lead to ``new``.

    Returns the files that hold such links. Raises InputError where ``new`` does not hold the objects that
    they want, DocumentError where a file cannot be read or written; both before anything is changed.

    check
        raises DocumentError for a file that must not be written now.
    """
    old, target = os.path.abspath(old), os.path.realpath(new)
    limits = Limits()
    found = [one for path in dict.fromkeys(map(os.path.realpath, paths)) if (one := _look(path, old, limits))]
    _check_target(found, old, target, limits)
    for one in found:
        check_writable(one.path)
        if not dry_run:
            check(one.path)
    if not dry_run:
        for one in found:
            _mend(one, old, target, limits)
    return found


def _look(path: str, old: str, limits: Limits) -> Relinked | None:
    with ContainerFile(path, limits) as container:
        _, text = document_xml(container, limits)
    try:
        records = list(_records(text, path, old, limits))
    except Malformed as error:
        raise DocumentError(path, f"its Document.xml {error}") from error
    if not records:
        return None
    return Relinked(path, len(records), tuple(sorted({record.name for record in records if record.name})))


def _records(text: bytes, path: str, file: str, limits: Limits) -> Iterator[_Record]:
    """The elements that record ``file``, as seen from the document at ``path``."""
    if as_utf8(text) is not text:
        raise Malformed("is not in UTF-8")
    folder, wanted = os.path.dirname(path), {file, os.path.realpath(file)}
    for at, attributes in start_tags(text, limits.depth, TAGS):
        recorded = attributes.get("file", "")
        if recorded and not wanted.isdisjoint(_meant(recorded, folder)):
            yield _Record(at, attributes.get("name", ""))


def _meant(recorded: str, folder: str) -> Iterator[str]:
    for spelling in {recorded, recorded.replace("\\", "/")}:
        yield os.path.normpath(os.path.join(folder, spelling))


def _check_target(found: list[Relinked], old: str, target: str, limits: Limits) -> None:
    with Library(limits=limits) as library:
        document = library.open(target)
        wanted = sorted({name for one in found for name in one.objects})
        lacking = [name for name in wanted if document.getObject(name) is None]
    if lacking:
        raise InputError(
            f"{target} does not hold what the links to {old} want: {', '.join(lacking[:8])}"
            + (f" and {len(lacking) - 8} more" if len(lacking) > 8 else "")
            + "; nothing was changed"
        )
    if any(one.path == target for one in found):
        raise InputError(f"{target} would link to itself; nothing was changed")


def _mend(one: Relinked, old: str, target: str, limits: Limits) -> None:
    recorded = os.path.relpath(target, os.path.dirname(one.path)).replace(os.sep, "/")

    def edit(text: bytes) -> bytes:
        parts, begin = [], 0
        for record in _records(text, one.path, old, limits):
            attribute = _FILE.search(text, record.at)
            if attribute is None:
                raise Malformed("has a link that cannot be edited")
            parts += [text[begin : attribute.end(1)], quoteattr(recorded).encode()]
            begin = attribute.end()
        return b"".join((*parts, text[begin:]))

    with ContainerFile(one.path, limits) as container:
        state = container.state
        content = replaced_entry(container, *edited_xml(container, edit, limits))
        _, text = document_xml(container, limits)
    before = sum(1 for _ in _records(text, one.path, target, limits))

    replace_file(one.path, state, content, lambda copy: read_back(one, copy, old, target, before))


def read_back(one: Relinked, copy: str, old: str, target: str, before: int) -> None:
    """Raise DocumentError unless the mended copy can be read and holds the links as they are to be.

    before
        how many links led to the target already.
    """
    limits = Limits()
    with Library(limits=limits) as library:
        library.open(copy)
    with ContainerFile(copy, limits) as container:
        _, text = document_xml(container, limits)
    left = sum(1 for _ in _records(text, copy, old, limits))
    now = sum(1 for _ in _records(text, copy, target, limits))
    if left or now != before + one.links:
        raise DocumentError(one.path, "the mended copy does not hold the new links; nothing was written")
