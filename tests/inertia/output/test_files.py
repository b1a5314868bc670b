# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from silo.bom.errors import InputError
from silo.inertia.output.whole_file import write_whole


@pytest.mark.usefixtures("needs_modes")
def test_a_new_file_gets_the_usual_mode_and_an_old_one_keeps_its_own(tmp_path: Path) -> None:
    """A report that only its writer can read is no report; a file that was private stays so."""
    usual = tmp_path / "usual"
    usual.touch()
    write_whole(tmp_path / "new", b"1")
    assert (tmp_path / "new").stat().st_mode == usual.stat().st_mode
    usual.chmod(0o600)
    write_whole(usual, b"2")
    assert usual.stat().st_mode & 0o777 == 0o600
    assert usual.read_bytes() == b"2"


def test_a_failure_leaves_the_old_file_and_nothing_beside_it(tmp_path: Path) -> None:
    """What cannot be written does not take away what was there."""
    old = tmp_path / "old"
    old.write_bytes(b"kept")
    with pytest.raises(TypeError):
        write_whole(old, "not bytes")  # type: ignore[arg-type]
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert old.read_bytes() == b"kept"


def test_a_folder_of_that_name_is_a_plain_error(tmp_path: Path) -> None:
    """A folder cannot be replaced by a file."""
    with pytest.raises(InputError, match="cannot be written"):
        write_whole(tmp_path, b"1")


def test_no_folder_is_a_plain_error(tmp_path: Path) -> None:
    """The name that was asked for, not that of a temporary file."""
    with pytest.raises(InputError, match=r"gone/x\.csv: cannot be written"):
        write_whole(tmp_path / "gone" / "x.csv", b"1")


@pytest.mark.usefixtures("needs_pipes")
def test_a_pipe_is_written_to_and_stays_a_pipe(tmp_path: Path) -> None:
    """``--report >(program)`` of a shell is a pipe: it cannot be replaced by a file."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write_whole(pipe, b"report")
    reader.join(timeout=60)
    assert read == [b"report"]
    assert pipe.is_fifo()
