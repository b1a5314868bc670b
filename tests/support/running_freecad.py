# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a running FreeCAD leaves in its cache while it has a file open: a folder, and a lock that is held."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

UID = "92908131-ab86-482d-a89e-136fb149a0da"
HOLD = """
import fcntl, sys
file = open(sys.argv[1], "w")
fcntl.lockf(file, fcntl.LOCK_EX)
print("held", flush=True)
sys.stdin.read()
"""


@contextmanager
def held(lock: Path) -> Iterator[None]:
    """Another process holds this lock, as a running FreeCAD does."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(lock)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        yield
        process.communicate()


@contextmanager
def opened(cache: Path, path: Path | str, number: int = 42) -> Iterator[None]:
    """A FreeCAD with this cache folder has this file open."""
    digest = hashlib.sha1(os.fsencode(path), usedforsecurity=False).hexdigest()[:6]
    (cache / f"FreeCAD_Doc_{UID}_{digest}_{number}").mkdir(parents=True)
    with held(cache / f"FreeCAD_{number}.lock"):
        yield
