# SPDX-License-Identifier: LGPL-2.1-or-later
"""An upload whose answer was lost is not sent a second time, whatever the server keeps of it."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import pytest

from silo.api.arrived import MayHaveArrivedError, SentFile, find_arrived, is_there
from silo.api.wire import Revision
from silo.bom.errors import NotFoundError, UnreachableError
from silo.outbox.entry import Commit, State
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.testing import FakeSilo

OURS = b"our file"
SENT = SentFile("a.FCStd", hashlib.sha256(OURS).hexdigest(), len(OURS), base=1)


class Files:
    """Revisions' contents; what is missing cannot be read."""

    def __init__(self, **contents: bytes) -> None:
        self.contents = contents
        self.asked: list[int] = []

    def download_file(
        self, part_number: str, path: Path | str, revision: int | None = None, *, cancelled: Any = None
    ) -> str:
        self.asked.append(revision or 0)
        if f"r{revision}" not in self.contents:
            raise NotFoundError("no file")
        Path(path).write_bytes(self.contents[f"r{revision}"])
        return hashlib.sha256(self.contents[f"r{revision}"]).hexdigest()


def rev(number: int, **values: Any) -> Revision:
    return Revision(revision_number=number, **values)


def test_a_checksum_says_it_all() -> None:
    """In any spelling; nothing is downloaded."""
    files = Files()
    known = [rev(3, file_checksum="SHA256:" + SENT.sha256.upper()), rev(2, file_checksum="0" * 64)]
    found = find_arrived(files, "A", SENT, known)
    assert (found.revision_number if found else None, files.asked) == (3, [])
    assert find_arrived(files, "A", SENT, known[1:]) is None


def test_revisions_from_before_are_not_ours() -> None:
    """A file that equals an older revision may be sent again on purpose."""
    assert find_arrived(Files(r1=OURS), "A", SENT, [rev(1, file_checksum=SENT.sha256)]) is None


def test_without_a_checksum_the_size_and_then_the_content_decide() -> None:
    """Another size needs no download."""
    files = Files(r2=OURS, r3=b"our fill")
    assert find_arrived(files, "A", SENT, [rev(2, file_size=99)]) is None
    assert files.asked == []
    assert find_arrived(files, "A", SENT, [rev(3, file_size=8)]) is None
    for size in (8, None):
        found = find_arrived(files, "A", SENT, [rev(2, file_size=size)])
        assert found is not None
        assert found.revision_number == 2


def test_a_revision_without_a_file_is_none_of_ours() -> None:
    """A change of properties."""
    assert find_arrived(Files(), "A", SENT, [rev(2)]) is None


@pytest.mark.parametrize(
    ("name", "revision", "content"),
    [
        ("a.FCStd", rev(2, file_key="items/A/rev2.fcstd"), {}),
        ("a.FCStd", rev(2, file_size=8), {}),
        ("a.kc", rev(2, file_size=123), {"r2": b"packed again"}),
    ],
)
def test_where_nothing_decides_a_person_looks(
    name: str, revision: Revision, content: dict[str, bytes]
) -> None:
    """The file cannot be read, or the server packs it again."""
    sent = SentFile(name, SENT.sha256, SENT.size, 1)
    with pytest.raises(MayHaveArrivedError, match="revision 2") as caught:
        find_arrived(Files(**content), "A", sent, [revision])
    assert caught.value.newest == 2


def test_retry_after_a_look_sends_the_file(tmp_path: Path) -> None:
    """Once: what the person has looked at is not asked about again."""
    silo, path = FakeSilo(), tmp_path / "a.FCStd"
    number = silo.create_item("kindred-rd", "M01", "Part").part_number
    path.write_bytes(OURS)
    outbox = Store(tmp_path / "outbox.sqlite3")
    entry = outbox.add(Commit(str(path), 1.0, part_number=number, file=path))

    def lose(name: str) -> None:
        raise UnreachableError("the answer was lost")

    silo.after = lose
    send_all(outbox, silo, force=True)
    silo.after = lambda _name: None
    stored = silo.items[number.casefold()]
    stored.revisions[0] = rev(1, file_key="x")
    stored.files.clear()
    silo.answers.clear()  # this server keeps neither checksums nor keys of requests
    assert send_all(outbox, silo, force=True).held
    assert outbox.entries()[0].state is State.HELD
    outbox.retry(entry.id)
    assert send_all(outbox, silo, force=True).sent
    assert (outbox.entries(), len(stored.revisions)) == ((), 2)


@pytest.mark.parametrize(
    ("file_name", "number", "checksum", "there"),
    [
        ("Top.FCStd", 2, "aa", True),
        ("Top.FCStd", 7, "aa", True),  # the very file, by another number
        ("Top.FCStd", 2, "bb", False),  # the number is another file's by now
        ("Top.FCStd", 2, None, True),
        ("Top.FCStd", 3, None, False),
        ("Top.kc", 2, "bb", True),  # the server packs it again
        ("Top.kc", 3, "bb", False),
    ],
)
def test_a_file_that_was_sent_is_still_there(
    file_name: str, number: int, checksum: str | None, there: bool
) -> None:
    """A server that was restored from a backup may have lost it. It was revision 2 with the SHA-256 "aa"."""
    known = [Revision(revision_number=number, file_name=file_name, file_checksum=checksum)]
    assert is_there(known, file_name, "aa", 2) is there


def test_a_server_that_says_nothing_of_files_is_believed_by_the_number() -> None:
    """Else each retry of a BOM would make a revision. Where it names files, one without a file is no file."""
    bare = Revision(revision_number=2)
    assert is_there([bare], "Top.FCStd", "aa", 2)
    assert not is_there([Revision(revision_number=1, file_name="Top.FCStd"), bare], "Top.FCStd", "aa", 2)
