# SPDX-License-Identifier: LGPL-2.1-or-later
"""Write a Silo identity into an FCStd file, and nothing else.

The identity goes into the document's ``Meta`` map, which every FreeCAD keeps, also in partial loads (FreeCAD
0.20 has no document properties of its own). Only ``Document.xml`` is packed anew; all other entries keep
their bytes, order and times. The file is replaced in one step, so a reader sees the old one or the new one.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
import unicodedata
from pathlib import Path

from silo.bom.errors import DocumentError
from silo.bom.identity import META_KEY, meta_key
from silo.durable import replace_patiently, sync_folder
from silo.fcstd.container import DOCUMENT_XML, ContainerFile, Entry, FileState
from silo.fcstd.inflate import Inflater
from silo.fcstd.library import Library
from silo.fcstd.limits import Limits
from silo.fcstd.meta import with_meta
from silo.fcstd.problem import FcstdError
from silo.fcstd.rewrite import replaced_entry

_LONGEST = 200


def stamp(
    path: Path | str,
    identity: str,
    *,
    object_name: str | None = None,
    replace: bool = False,
    limits: Limits | None = None,
) -> bool:
    """Write ``identity`` into the file; True where it was written, False where the file had it already.

    object_name
        the object that the identity is for, where one file gives several parts: ``Meta["SiloUUID/<Name>"]``;
        None: the whole document, ``Meta["SiloUUID"]``.
    replace
        write over another identity of the same key.

    Raises DocumentError: the file cannot be read or written, is read-only, was changed meanwhile, carries
    another identity, or has no such object. The file is then as it was.
    """
    real = os.path.realpath(path)
    _check_identity(real, identity)
    limits = limits or Limits()
    key = meta_key(object_name or "")
    with ContainerFile(real, limits) as container:
        state = container.state
        if _present(real, state, identity, object_name, replace, limits):
            return False
        _check_writable(real)
        content = replaced_entry(container, *_stamped_xml(container, key, identity))
    # The file is closed by now: Windows lets nobody replace an open one.
    try:
        _write(real, state, content, key, identity)
    except OSError as error:
        raise DocumentError(real, f"it cannot be written: {error.strerror or error}") from error
    return True


def check_stampable(
    path: Path | str, *, object_name: str | None = None, limits: Limits | None = None
) -> None:
    """Raise the DocumentError that :func:`stamp` would raise for a new identity; changes nothing.

    Asked before an item is made on the server: a file that cannot name its item shall get none.
    """
    real = os.path.realpath(path)
    limits = limits or Limits()
    with ContainerFile(real, limits) as container:
        _present(real, container.state, "", object_name, False, limits)
        _check_writable(real)
        _stamped_xml(container, meta_key(object_name or ""), "0" * 36)


def _check_identity(path: str, identity: str) -> None:
    odd = any(unicodedata.category(c) in ("Cc", "Cs", "Cn") or c in "\ufffe\uffff" for c in identity)
    if not identity.strip() or identity != identity.strip() or len(identity) > _LONGEST or odd:
        raise DocumentError(
            path, f"{identity!r} is no identity: wanted is one line of 1 to {_LONGEST} characters"
        )


def _present(
    path: str, state: FileState, identity: str, object_name: str | None, replace: bool, limits: Limits
) -> bool:
    """True where the file carries the identity already. Raises DocumentError where it carries another."""
    with Library(limits=limits) as library:
        document = library.open(path)
        if document.state != state:
            raise _changed(path)
        obj = None if object_name is None else document.getObject(object_name)
        if object_name is not None and obj is None:
            raise DocumentError(path, f"it holds no object named {object_name!r}")
        owner = document if obj is None else obj
        for name in ("SiloUUID",) if obj is None else ("SiloItemId", "SiloUUID"):
            # A property of its own goes before Meta, so Meta would have no effect beside another one.
            own = _property(owner, name)
            if own and own.lower() != identity.lower():
                raise DocumentError(path, f"its own property {name} is another identity already: {own}")
        present = document.Meta.get(meta_key(object_name or ""), "").strip()
    same = present.lower() == identity.lower()
    if present and not same and not replace:
        what = META_KEY if object_name is None else f"{META_KEY} of {object_name}"
        raise DocumentError(path, f"it carries another identity already ({what}): {present}")
    return same


def _property(owner: object, name: str) -> str:
    value = getattr(owner, name, None)
    return value.strip() if isinstance(value, str) else ""


def _changed(path: str) -> FcstdError:
    return FcstdError(path, "it was changed by somebody else meanwhile; nothing was written")


def _check_writable(path: str) -> None:
    # Asked of the mode: an administrator may write anything, and replacing a file needs no right to it at
    # all.
    if not os.stat(path).st_mode & stat.S_IWUSR or not os.access(path, os.W_OK):
        raise DocumentError(path, "it is read-only; nothing was written")
    if not os.access(os.path.dirname(path), os.W_OK):
        raise DocumentError(path, "its folder is read-only; nothing was written")


def _stamped_xml(container: ContainerFile, key: str, identity: str) -> tuple[Entry, bytes]:
    """The entry Document.xml, and its content as it is to become."""
    path, limits = container.path, container.limits
    entry = container.entry(DOCUMENT_XML)
    if entry is None:
        raise FcstdError(path, "it is no FreeCAD document (there is no Document.xml in it)")
    packed = container.packed(entry, limits.packed)
    text = Inflater(path, entry, packed, limits.document_xml, limits).whole()
    try:
        return entry, with_meta(text, key, identity, limits.depth)
    except ValueError as error:
        raise FcstdError(path, f"its Document.xml {error}; nothing was written") from error


def _write(path: str, state: FileState, content: bytes, key: str, identity: str) -> None:
    """Replace the file, which must still be in ``state``, in one step."""
    folder = os.path.dirname(path)
    descriptor, temporary = tempfile.mkstemp(prefix=".silo-", suffix=".tmp", dir=folder)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            _keep_rights(path, file.fileno())
            os.fsync(file.fileno())
        _read_back(path, temporary, key, identity)
        if _state(path) != state:
            raise _changed(path)
        replace_patiently(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
    sync_folder(folder)


def _read_back(path: str, temporary: str, key: str, identity: str) -> None:
    try:
        with Library() as library:
            read = library.open(temporary).Meta.get(key)
    except DocumentError as error:
        reason = f"the stamped copy cannot be read ({error.reason}); the file is unchanged"
        raise DocumentError(path, reason) from error
    if read != identity:
        raise DocumentError(path, "the stamped copy does not hold the identity; the file is unchanged")


def _keep_rights(path: str, descriptor: int) -> None:
    status = os.stat(path)
    if hasattr(os, "fchown"):
        with contextlib.suppress(OSError):  # only an administrator may give files away
            os.fchown(descriptor, status.st_uid, status.st_gid)
    if hasattr(os, "fchmod"):
        os.fchmod(descriptor, stat.S_IMODE(status.st_mode))
    if hasattr(os, "listxattr"):
        for name in os.listxattr(path):
            with contextlib.suppress(OSError):  # some belong to the system
                os.setxattr(descriptor, name, os.getxattr(path, name))


def _state(path: str) -> FileState | None:
    try:
        return FileState.of(os.stat(path))
    except OSError:
        return None
