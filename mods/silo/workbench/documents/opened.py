# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which content of its file each open document has: what FreeCAD read or wrote last.

A document observer. A file is known by its content, so it is hashed when FreeCAD opens it, by a worker; the
stamp that is taken at once says later whether somebody else has replaced the file since. Each save is noted
with the content before it, so that the queue knows what a file was made from, by any program
(:meth:`silo.outbox.store.Store.origins`).
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from silo.platform.stamp import Stamp


def _stamp(path: str) -> Stamp | None:
    """Return a stamp that changes when the file is written; None if there is no file. Imports late, for
    FreeCAD's start.
    """
    from silo.platform.stamp import stamp_of

    return stamp_of(path)


class Origins(Protocol):
    """What is remembered of saved files; :class:`silo.outbox.store.Store` has it."""

    def derived(self, sha256: str, origin: str, /) -> None: ...

    def replaced(self, content: str, /) -> None: ...


class DocumentOrigin:
    """What one document was made from.

    stamp
        the file as this document read or wrote it last; None where there was none.
    content
        its SHA-256; "" while it was not looked at.
    since
        seconds of :func:`time.monotonic`: when it was opened, or committed last.
    """

    # No dataclass: to make one costs FreeCAD's start a millisecond.
    def __init__(self, path: str, stamp: Stamp | None, content: str = "", since: float | None = None) -> None:
        self.path, self.stamp, self.content = path, stamp, content
        self.since = time.monotonic() if since is None else since
        self._lock = threading.Lock()

    def settle(self) -> str:
        """Return the content, and determine it first if that was not done yet. From any thread; reads the
        file once.
        """
        with self._lock:
            if not self.content:
                from silo.outbox.entry import UNKNOWN

                self.content = _unchanged_hash(self.path, self.stamp) or UNKNOWN
            return self.content

    def saved(self, origins: Origins, stamp: Stamp | None, *, is_over: bool) -> None:
        """Note the content of a save, and the one before it. From any thread.

        is_over
            another program had written the file that was saved over.
        """
        with self._lock:
            if is_over:
                origins.replaced(self.content)
            if content := _unchanged_hash(self.path, stamp):
                origins.derived(content, self.content)
                self.content = content

    def committed(self, sha256: str) -> None:
        """Note that a commit of the document has this content; later states are made from it.

        ``sha256`` is "" if another program has copied and sent it: then the file's hash counts, unless it was
        written since.
        """
        if sha256 := sha256 or _unchanged_hash(self.path, self.stamp):
            with self._lock:
                self.content, self.since = sha256, time.monotonic()

    @property
    def replaced(self) -> bool:
        """Return True if another program has written the file since."""
        now = _stamp(self.path)
        return self.stamp is not None and now is not None and now != self.stamp


def _unchanged_hash(path: str, stamp: Stamp | None) -> str:
    from silo.checksums import content_hash

    try:
        content = content_hash(path)
    except OSError:
        return ""
    return content if stamp is not None and _stamp(path) == stamp else ""


class Opened:
    """A document observer: document → :class:`DocumentOrigin`.

    outbox
        gives the store; called by workers, and in the GUI thread where a document is saved at once.
    """

    def __init__(self, outbox: Callable[[], Origins]) -> None:
        self._outbox = outbox
        self._bases: dict[str, DocumentOrigin] = {}
        self._saved_over: set[str] = set()
        self._work: Callable[[Callable[[], object]], object] | None = None
        self._left: list[Callable[[], object]] = []

    def begin(self, work: Callable[[Callable[[], object]], object]) -> None:
        """Hand work to a worker from now on; none is started before FreeCAD's window is open."""
        self._work = work
        for call in self._left:
            work(call)
        self._left.clear()

    def of(self, doc: Any) -> DocumentOrigin:
        """Return the base of a document, even of one that was opened before we watched."""
        base = self._bases.get(doc.Name)
        if base is None:
            base = self._bases[doc.Name] = DocumentOrigin(doc.FileName, _stamp(doc.FileName))
        return base

    def forget(self, doc: Any) -> None:
        """Forget a document that is closed, or read again."""
        self._bases.pop(doc.Name, None)

    def _later(self, call: Callable[[], object]) -> None:
        if self._work is None:
            self._left.append(call)
        else:
            self._work(call)

    def _settle(self, base: DocumentOrigin) -> None:
        base.settle()

    # FreeCAD calls these; an exception in them would only be printed.

    def slotChangedDocument(self, doc: Any, prop: str) -> None:
        """Look at the file; FreeCAD sets its name before it reads it."""
        if prop != "FileName" or not doc.FileName:
            return
        base_now = self._bases.get(doc.Name)
        if base_now is not None:
            if base_now.path != doc.FileName:  # saved under another name; what it was made from stays
                self._settle(base_now)
                base_now.path, base_now.stamp = doc.FileName, None
            return
        stamp = _stamp(doc.FileName)
        # A document that has objects before it has a file was made here.
        made_here = stamp is None or bool(doc.Objects)
        base = self._bases[doc.Name] = DocumentOrigin(doc.FileName, None if made_here else stamp)
        if not made_here:
            self._later(lambda: self._settle(base))

    def slotDeletedDocument(self, doc: Any) -> None:
        """Forget the document; FreeCAD may reuse its name."""
        self.forget(doc)

    def slotStartSaveDocument(self, doc: Any, filename: str) -> None:
        """Look at the file that is about to be replaced, from which the document was made, if that was not
        done yet.
        """
        base = self._bases.get(doc.Name)
        if base is not None and base.path == filename and not base.content:
            self._settle(base)
        if base is not None and base.path == filename and base.replaced:
            self._saved_over.add(doc.Name)

    def slotFinishSaveDocument(self, doc: Any, filename: str) -> None:
        """Note that this FreeCAD wrote the file."""
        base = self._bases.get(doc.Name)
        if base is None or os.path.realpath(filename) != os.path.realpath(doc.FileName or ""):
            return
        base.path, base.stamp = doc.FileName, _stamp(doc.FileName)
        stamp = base.stamp
        is_over = doc.Name in self._saved_over
        self._saved_over.discard(doc.Name)
        self._later(lambda: base.saved(self._outbox(), stamp, is_over=is_over))
