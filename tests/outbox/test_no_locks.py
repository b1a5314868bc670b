# SPDX-License-Identifier: LGPL-2.1-or-later
"""A home on a disk without file locks: commits are kept, programs of one computer take turns, words are true.

The disk is this one, in a process that gets ENOLCK for each lock below the folder, also from within SQLite.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "support" / "native" / "no_locks.c"
CC = shutil.which("cc") or shutil.which("gcc")

pytestmark = pytest.mark.skipif(
    not (sys.platform.startswith("linux") and CC), reason="needs Linux and a C compiler"
)

KEEP = """
import sys, time
from pathlib import Path
from silo.outbox.entry import Commit, new_key
from silo.outbox.store import Store

home = Path(sys.argv[1])
for number in range(4):
    file = home / f"{sys.argv[2]}{number}.FCStd"
    file.write_bytes(b"content")
    made = dict(path=str(file), label=file.name, identity="i", taken_at=time.time(), key=new_key())
    Store(home / "outbox.sqlite3").add(Commit(file=file, **made))
"""

SEND = """
import sys
from pathlib import Path
from silo.outbox.store import Store

store = Store(Path(sys.argv[1]) / "outbox.sqlite3")
with store.send_lock() as mine, Store(store.path).send_lock() as other:
    print(mine, other, len(store.entries()), {entry.state.value for entry in store.entries()})
"""


@pytest.fixture(name="library", scope="module")
def _library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("native") / "no_locks.so"
    subprocess.run([str(CC), "-shared", "-fPIC", "-o", str(made), str(SOURCE), "-ldl"], check=True)
    return made


def begin(code: str, home: Path, library: Path | None, *arguments: str) -> subprocess.Popen[str]:
    """Run code, on a disk without locks if a library is given."""
    environment = os.environ | {"XDG_CACHE_HOME": str(home / "cache"), "TMPDIR": str(home.parent / "local")}
    if library is not None:
        environment |= {"LD_PRELOAD": str(library), "NO_LOCKS_BELOW": str(home)}
    command = [sys.executable, "-c", code, str(home), *arguments]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def said(process: subprocess.Popen[str]) -> str:
    """Wait for its end, and return what it said."""
    with process:
        try:
            text, _ = process.communicate(timeout=300)
        except BaseException:
            process.kill()  # it is waited for, so that it does not end in the time of another test
            raise
    assert process.returncode == 0, text
    return text.strip()


@pytest.mark.parametrize("had_locks", [False, True])
def test_commits_are_kept_and_programs_take_turns(library: Path, tmp_path: Path, had_locks: bool) -> None:
    """Also where the disk had locks before, so that the database has a log that programs shared."""
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "local").mkdir()
    if had_locks:
        said(begin(KEEP, home, None, "before"))
    with begin(KEEP, home, library, "A") as one, begin(KEEP, home, library, "B") as other:
        assert (said(one), said(other)) == ("", "")
    count = 12 if had_locks else 8
    assert said(begin(SEND, home, library)) == f"True False {count} {{'waiting'}}"
