# SPDX-License-Identifier: LGPL-2.1-or-later
"""Change the Document.xml of an FCStd file, and nothing else of it.

All other entries keep their bytes, order and times. The file is replaced in one step, so a reader sees the
old one or the new one; what was written is read back first.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from collections.abc import Callable, Iterable
from typing import BinaryIO

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.fcstd.container import ContainerFile, FileStat, ZipEntry, document_xml
from silo.fcstd.errors import FcstdError
from silo.fcstd.limits import Limits
from silo.fcstd.repack import Piece
from silo.platform.file_swap import copy_rights, patiently, swap
from silo.platform.whole_files import remove_patiently, sync_folder

_REFERENCES = {'"': "&quot;", "'": "&apos;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}


def in_attribute(text: str) -> str:
    """Escape a text for the value of an XML attribute, to be put between quotes."""
    from xml.sax.saxutils import escape  # late, as it imports HTTP and TLS

    return escape(text, _REFERENCES)


_BLOCK = 1 << 20

# The text of Document.xml → its edited text; a ValueError says why it cannot be edited.
Edit = Callable[[bytes], bytes]


def changed(path: str) -> FcstdError:
    """Make the error that somebody else changed the file meanwhile."""
    return FcstdError(path, message("it was changed by somebody else meanwhile; nothing was written"))


def check_writable(path: str) -> None:
    """Raise DocumentError if the file may not be replaced."""
    # Asked of the mode: an administrator may write anything, and replacing a file needs no right to it at
    # all.
    if not os.stat(path).st_mode & stat.S_IWUSR or not os.access(path, os.W_OK):
        raise DocumentError(path, message("it is read-only; nothing was written"))
    if not os.access(os.path.dirname(path), os.W_OK):
        raise DocumentError(path, message("its folder is read-only; nothing was written"))
    names = os.stat(path).st_nlink
    if names > 1:
        raise DocumentError(
            path,
            message(
                "it has {names} names on this disk (hard links), and the others would keep the old "
                "content; nothing was written. Make it a file of its own: copy it, then put the copy in "
                "its place",
                names=names,
            ),
        )


def edited_xml(container: ContainerFile, edit: Edit, limits: Limits) -> tuple[ZipEntry, bytes]:
    """Return the entry Document.xml and its edited text. Raises DocumentError."""
    entry, text = document_xml(container, limits)
    try:
        return entry, edit(text)
    except ValueError as error:
        raise FcstdError(
            container.path, message("its Document.xml {error}; nothing was written", error=error)
        ) from error


def replace_file(path: str, state: FileStat, content: Iterable[Piece], check: Callable[[str], None]) -> None:
    """Replace the file, which must still be in ``state``, in one step. Raises DocumentError.

    check
        looks at the copy that was written, and raises DocumentError if it is not as it should be.
    """
    # The file is closed by now: Windows does not let an open one be replaced.
    try:
        _write(path, state, content, check)
    except OSError as error:
        raise DocumentError(
            path, message("it cannot be written: {error}", error=why_refused(error))
        ) from error


def _write(path: str, state: FileStat, content: Iterable[Piece], check: Callable[[str], None]) -> None:
    folder = os.path.dirname(path)
    descriptor, temporary = tempfile.mkstemp(prefix=".silo-", suffix=".tmp", dir=folder)
    try:
        with os.fdopen(descriptor, "wb") as file:
            _put(path, content, file)
            file.flush()
            copy_rights(path, temporary)
            os.fsync(file.fileno())
        check(temporary)
        if FileStat.now(path) != state:
            raise changed(path)
        patiently(lambda: swap(temporary, path))
    except BaseException:
        with contextlib.suppress(OSError):
            remove_patiently(temporary)
        raise
    sync_folder(folder)


def _put(path: str, content: Iterable[Piece], file: BinaryIO) -> None:
    with open(path, "rb") as old:
        for piece in content:
            if isinstance(piece, bytes):
                file.write(piece)
                continue
            old.seek(piece.offset)
            left = piece.length
            while left:
                block = old.read(min(left, _BLOCK))
                if not block:
                    raise changed(path)
                file.write(block)
                left -= len(block)
