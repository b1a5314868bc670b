# SPDX-License-Identifier: LGPL-2.1-or-later
"""Keeps Python's garbage collection out of our threads.

A collection runs in whatever thread happens to trigger it, and destroys what it finds: also windows that were
closed, ours or another add-on's. A window that is destroyed outside the GUI thread can end FreeCAD at once (a
crash of 0.20 with PySide2 was in such a collection). So nothing is collected while one of our threads runs
Python; the GUI thread looks after what is due meanwhile.
"""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_lock = threading.Lock()

_holding = 0

_was_on = False


@contextmanager
def collection_off() -> Iterator[None]:
    """Switch automatic collection off inside, in any thread. May be nested, and held by several threads at
    once.
    """
    global _holding, _was_on
    with _lock:
        if _holding == 0:
            _was_on = gc.isenabled()
            gc.disable()
        _holding += 1
    try:
        yield
    finally:
        with _lock:
            _holding -= 1
            if _holding == 0 and _was_on:
                gc.enable()


def collect_due() -> None:
    """Collect the garbage that was held back; call it in the GUI thread."""
    if not _holding or not _was_on:
        return
    due = [a > b > 0 for a, b in zip(gc.get_count()[:2], gc.get_threshold()[:2], strict=True)]
    # The oldest generation takes long and can wait until nothing is held back.
    if any(due):
        gc.collect(1 if due[1] else 0)
