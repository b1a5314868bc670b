# SPDX-License-Identifier: LGPL-2.1-or-later
"""Lead the links of FreeCAD files, and the imports of A2plus, to a file that has moved.

FreeCAD has no way to repair a link whose target has moved but to make it again, which loses placements and
joints. Here only the recorded path changes: object, sub-names and the rest of the file stay as they are.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from silo.bom.errors import DocumentError, InputError, listed
from silo.bom.message import message
from silo.fcstd.container import ContainerFile, document_xml
from silo.fcstd.edit import check_writable, edited_xml, in_attribute, replace_file
from silo.fcstd.expat_reader import Malformed, as_utf8, start_tags
from silo.fcstd.library import Library
from silo.fcstd.limits import Limits
from silo.fcstd.linked import TAGS
from silo.fcstd.repack import replaced_entry

_FILE = re.compile(rb"""(\sfile\s*=\s*)("[^"]*"|'[^']*')""")
_VALUE = re.compile(rb"""(\svalue\s*=\s*)("[^"]*"|'[^']*')""")
# A property of A2plus records the file of an import as a text.
_IMPORTED = "sourceFile"


@dataclass(frozen=True)
class Relinked:
    """A file whose links were repaired, or would be: its path, how many links, and to which objects."""

    path: str
    links: int
    objects: tuple[str, ...]


class _Record(NamedTuple):
    at: int
    name: str
    attribute: re.Pattern[bytes] = _FILE


def relink(
    paths: Iterable[Path | str],
    old: Path | str,
    new: Path | str,
    *,
    dry_run: bool = False,
    check: Callable[[str], None] = lambda _path: None,
) -> list[Relinked]:
    """Repair the links of these files that record ``old``, to lead to ``new``.

    Returns the files that hold such links. Raises InputError if ``new`` does not hold the objects that they
    want, DocumentError if a file cannot be read or written; both before anything is changed.

    check
        raises DocumentError for a file that must not be written now.
    """
    old, target = os.path.abspath(old), os.path.realpath(new)
    limits = Limits()
    relinked = [
        link for path in dict.fromkeys(map(os.path.realpath, paths)) if (link := _look(path, old, limits))
    ]
    _check_target(relinked, old, target, limits)
    for link in relinked:
        check_writable(link.path)
        if not dry_run:
            check(link.path)
    if not dry_run:
        for link in relinked:
            _mend(link, old, target, limits)
    return relinked


def _look(path: str, old: str, limits: Limits) -> Relinked | None:
    with ContainerFile(path, limits) as container:
        _, text = document_xml(container, limits)
    try:
        records = list(_records(text, path, old, limits))
    except Malformed as error:
        raise DocumentError(path, message("its Document.xml {error}", error=error)) from error
    if not records:
        return None
    return Relinked(path, len(records), tuple(sorted({record.name for record in records if record.name})))


def _records(text: bytes, path: str, file: str, limits: Limits) -> Iterator[_Record]:
    """Yield the elements that record a link to ``file``, as seen from the document at ``path``."""
    if as_utf8(text) is not text:
        raise Malformed(message("is not in UTF-8"))
    folder, wanted = os.path.dirname(path), {file, os.path.realpath(file)}
    named = ""
    for at, attributes in start_tags(text, limits.depth, {*TAGS, "Property", "String"}):
        if "type" in attributes:  # a property, with its value after it
            named = attributes.get("name", "")
            continue
        is_import = named == _IMPORTED and "value" in attributes
        recorded = attributes.get("value" if is_import else "file", "")
        if recorded and not wanted.isdisjoint(_spellings(recorded, folder)):
            yield _Record(at, "", _VALUE) if is_import else _Record(at, attributes.get("name", ""))


def _spellings(recorded: str, folder: str) -> Iterator[str]:
    for spelling in {recorded, recorded.replace("\\", "/")}:
        yield os.path.normpath(os.path.join(folder, spelling))


def _check_target(relinked_files: list[Relinked], old: str, target: str, limits: Limits) -> None:
    with Library(limits=limits) as library:
        document = library.open(target)
        wanted = sorted({name for file in relinked_files for name in file.objects})
        lacking = [name for name in wanted if document.getObject(name) is None]
    if lacking:
        raise InputError(
            message(
                "{target} does not hold what the links to {old} want: {lacking}; nothing was changed",
                target=target,
                old=old,
                lacking=listed(lacking),
            )
        )
    if any(file.path == target for file in relinked_files):
        raise InputError(message("{target} would link to itself; nothing was changed", target=target))


def _mend(relinked: Relinked, old: str, target: str, limits: Limits) -> None:
    recorded = os.path.relpath(target, os.path.dirname(relinked.path)).replace(os.sep, "/")

    def edit(text: bytes) -> bytes:
        parts, begin = [], 0
        for record in _records(text, relinked.path, old, limits):
            attribute = record.attribute.search(text, record.at)
            if attribute is None:
                raise Malformed(message("has a link that cannot be edited"))
            parts += [text[begin : attribute.end(1)], b'"%b"' % in_attribute(recorded).encode()]
            begin = attribute.end()
        return b"".join((*parts, text[begin:]))

    with ContainerFile(relinked.path, limits) as container:
        state = container.state
        content = replaced_entry(container, *edited_xml(container, edit, limits))
        _, text = document_xml(container, limits)
    before = sum(1 for _ in _records(text, relinked.path, target, limits))

    replace_file(relinked.path, state, content, lambda copy: read_back(relinked, copy, old, target, before))


def read_back(relinked: Relinked, copy: str, old: str, target: str, before: int) -> None:
    """Raise DocumentError unless the repaired copy can be read and its links are as they should be.

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
    if left or now != before + relinked.links:
        raise DocumentError(
            relinked.path, message("the mended copy does not hold the new links; nothing was written")
        )
