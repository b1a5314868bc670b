# SPDX-License-Identifier: LGPL-2.1-or-later
"""A component's file as it lies on disk: identities, fingerprint, picture, and if it was saved since a look.

A file that is damaged or no archive gives no answer, and no error. All but the identities come from the
archive's directory and the first properties of the document.
"""

from __future__ import annotations

import hashlib
import os
import re
import zipfile

from silo.bom.entry import BomEntry
from silo.bom.errors import DocumentError
from silo.bom.walk.identity import document_identity, meta_key, own_identity
from silo.checksums import content_hash

# What reading an entry of a file raises, if the file is no archive, is damaged, or does not have the entry.
_NOT_IN_ZIP = (OSError, KeyError, zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError)

_SAVED_AT = re.compile(rb'name="LastModifiedDate"[^>]*>\s*<String value="([^"]{0,40})"')


def changed_since(entry: BomEntry, saved_at: str) -> bool:
    """Return True if the file is no longer the one that was opened: it was saved or registered elsewhere.

    saved_at
        the open document's own time stamp.
    """
    head, _ = _look_into(entry.doc_path)
    match = _SAVED_AT.search(head)
    if match and match[1].decode("ascii", "replace") != saved_at:
        return True
    # An identity that the command line has stamped into the file leaves FreeCAD's time stamp as it is.
    marks = (b'<Item key="%s" value="' % key.encode() for key in (meta_key(), meta_key(entry.object_name)))
    return not entry.silo_uuid and any(mark in head for mark in marks)


def fingerprint(path: str) -> str:
    """Return a text that changes whenever FreeCAD saves a file, but not when an identity is stamped; "" if
    unknown.
    """
    head, content = _look_into(path)
    match = _SAVED_AT.search(head)
    return hashlib.sha256(repr((match and match[1], content)).encode()).hexdigest()[:16] if head else ""


def _look_into(path: str) -> tuple[bytes, list[tuple[str, int]]]:
    """Read the document's own properties, which come first (a hostile file may never end), and list the other
    entries.
    """
    try:
        with zipfile.ZipFile(path) as file, file.open("Document.xml") as xml:
            beside = [
                (member.filename, member.CRC)
                for member in file.infolist()
                if member.filename != "Document.xml"
            ]
            return xml.read(1 << 18), sorted(beside)
    except _NOT_IN_ZIP:
        return b"", []


def picture_in(path: str) -> bytes:
    """Read the picture that FreeCAD keeps in a file (PNG); b"" if it has none."""
    try:
        with zipfile.ZipFile(path) as file, file.open("thumbnails/Thumbnail.png") as picture:
            return picture.read(1 << 20)
    except _NOT_IN_ZIP:
        return b""


def sha256_or_nothing(path: str) -> str:
    """Hash a file's content; "" if it cannot be read."""
    try:
        return content_hash(path)
    except OSError:
        return ""


def on_disk(entry: BomEntry, *, shares_file: bool = False) -> tuple[str, str]:
    """Read from disk FreeCAD's UUID of the component's document, and the component's identity; "" for none,
    and if the file cannot be read.
    """
    from silo.fcstd import Library

    if not os.path.isfile(entry.doc_path):
        return "", ""
    try:
        with Library() as library:
            document = library.open(entry.doc_path)
            obj = document.getObject(entry.object_name) if entry.object_name else None
            identity = own_identity(obj) if obj is not None else None
            return str(document.Uid), identity or ("" if shares_file else document_identity(document) or "")
    except DocumentError:
        return "", ""
