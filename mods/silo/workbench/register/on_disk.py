# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a component's file says on disk while FreeCAD has it open. Belongs into the worker."""

from __future__ import annotations

import re
import zipfile

from silo.bom.identity import meta_key
from silo.bom.model import BomEntry
from silo.files import content_hash

_SAVED_AT = re.compile(rb'name="LastModifiedDate"[^>]*>\s*<String value="([^"]{0,40})"')


def changed_since(entry: BomEntry, saved_at: str) -> bool:
    """True where the file is not the one that was opened: saved by somebody else, or registered meanwhile.

    saved_at
        the open document's own time stamp.
    """
    head = _head(entry.doc_path)
    found = _SAVED_AT.search(head)
    if found and found[1].decode("ascii", "replace") != saved_at:
        return True
    # An identity that the command line has stamped into the file leaves FreeCAD's time stamp as it is.
    marks = (b'<Item key="%s" value="' % key.encode() for key in (meta_key(), meta_key(entry.object_name)))
    return not entry.silo_uuid and any(mark in head for mark in marks)


def _head(path: str) -> bytes:
    """The document's own properties, which come first; a hostile file may never end."""
    try:
        with zipfile.ZipFile(path) as file, file.open("Document.xml") as xml:
            return xml.read(1 << 18)
    except (OSError, KeyError, zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError):
        return b""


def sha256_or_nothing(path: str) -> str:
    """The hash of a file's content; "" where it cannot be read."""
    try:
        return content_hash(path)
    except OSError:
        return ""
