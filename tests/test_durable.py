# SPDX-License-Identifier: LGPL-2.1-or-later
"""A file is replaced whole or not at all."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

import pytest

from silo.platform.memory_file import read_memory, write_memory
from silo.platform.whole_files import private_file, private_folder, replacing


@pytest.mark.parametrize("before", [None, b"old"])
def test_the_new_content_is_there_in_one_step(tmp_path: Path, before: bytes | None) -> None:
    """While it is being written, the name has what it had."""
    path = tmp_path / "journal.json"
    if before is not None:
        path.write_bytes(before)
    with replacing(path) as file:
        file.write(b"new")
        file.flush()
        assert (path.read_bytes() if path.exists() else None) == before
    assert path.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["journal.json"]


def test_a_failure_leaves_the_old_content_and_nothing_else(tmp_path: Path) -> None:
    """Whatever the block raises, also a stop by the user."""
    path = tmp_path / "journal.json"
    path.write_bytes(b"old")

    def stopped_halfway() -> None:
        with replacing(path) as file:
            file.write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped_halfway()
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["journal.json"]


def test_a_folder_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    """It is not made: the caller knows whether it should be."""
    with pytest.raises(FileNotFoundError), replacing(tmp_path / "none" / "x"):
        pass


@pytest.mark.skipif(os.name != "posix", reason="modes of POSIX")
def test_it_belongs_to_its_owner_alone(tmp_path: Path) -> None:
    """What is kept by programs may hold a token."""
    with replacing(tmp_path / "x") as file:
        file.write(b"secret")
    assert (tmp_path / "x").stat().st_mode & 0o077 == 0


def test_a_name_of_any_length_can_be_replaced(tmp_path: Path) -> None:
    """The name of the temporary file does not become too long."""
    path = tmp_path / ("n" * 255)
    with replacing(path) as file:
        file.write(b"x")
    assert path.read_bytes() == b"x"


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps rights in lists, not in modes")
def test_what_is_private_is_closed_also_where_it_was_open(tmp_path: Path) -> None:
    """New or there already; what is in the file stays."""
    for folder in (tmp_path / "new", tmp_path / "old"):
        for file in (folder / "new.db", folder / "old.db"):
            if "old" in folder.name:
                folder.mkdir(mode=0o755, exist_ok=True)
                folder.chmod(0o755)
                if "old" in file.name:
                    file.write_text("kept")
                    file.chmod(0o644)
            private_folder(folder)
            private_file(file)
            assert (folder.stat().st_mode & 0o777, file.stat().st_mode & 0o777) == (0o700, 0o600)
    assert (tmp_path / "old" / "old.db").read_text() == "kept"


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[1]", b'"text"', b"[" * 100_000])
def test_a_damaged_memory_is_empty(tmp_path: Path, content: bytes) -> None:
    """Losing it costs a question, so it never keeps anybody from work; the next one is whole again."""
    path = tmp_path / "not there yet" / "memory.json"
    assert read_memory(path) == {}
    write_memory(path, {"a": 1})
    assert read_memory(path) == {"a": 1}
    path.write_bytes(content)
    assert read_memory(path) == {}
    write_memory(path, {"a": 2})
    assert read_memory(path) == {"a": 2}


def test_a_memory_that_cannot_be_written_keeps_what_it_was(tmp_path: Path) -> None:
    """The reason is given back, for those who report it."""
    (tmp_path / "a file").write_text("kept")
    assert isinstance(write_memory(tmp_path / "a file" / "memory.json", {}), OSError)
    assert (tmp_path / "a file").read_text() == "kept"


def test_content_and_name_are_on_disk_in_this_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """First the content, then the name, then the folder that holds the name: a power cut shows old or new."""
    done: list[str] = []
    fsync, replace = os.fsync, os.replace

    def synced(handle: int) -> None:
        done.append(
            "folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else f"{os.fstat(handle).st_size} bytes"
        )
        fsync(handle)

    def renamed(source: str, target: str) -> None:
        done.append("name")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", renamed)
    with replacing(tmp_path / "file") as file:
        file.write(b"four")
    assert done == ["4 bytes", "name", *([] if sys.platform == "win32" else ["folder"])]


@pytest.mark.usefixtures("needs_pipes")
def test_a_pipe_or_a_device_is_written_into_and_never_replaced(tmp_path: Path) -> None:
    """As root, a report to /dev/null would else leave a file in its place, for all programs."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        with replacing(pipe) as file:
            file.write(b"a report")
        assert os.read(reader, 100) == b"a report"
    finally:
        os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert [entry.name for entry in tmp_path.iterdir()] == ["pipe"]
