# SPDX-License-Identifier: LGPL-2.1-or-later
"""Many files in one run: each once, no result lost, and an end where going on is useless."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from silo.batch import Options, TopResult, stopped_by, sync_top
from silo.bom.errors import AuthError, DocumentError, NotFoundError, SiloError
from silo.bom.model import BomEntry, Extraction
from silo.bom_sync import Status
from silo.files import documents_in
from silo.testing import FakeSilo


def test_a_file_named_twice_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the spelling that came first."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "x.FCStd"
    path.touch()
    assert documents_in(["x.FCStd", "./x.FCStd", str(path), "."]) == ["x.FCStd"]


def test_a_folder_is_its_documents_without_backups_and_what_is_ignored(tmp_path: Path) -> None:
    """In the syntax of .gitignore: folders, patterns, exceptions, comments."""
    names = ["a.FCStd", "b.fcstd", "a.FCStd1", "a.20260101-101010.FCBak", "old/c.FCStd", "x/old/d.FCStd"]
    names += ["x/trial e.FCStd", "x/keep trial.FCStd", ".git/f.FCStd", "deep/er/g.FCStd"]
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "folder.FCStd").mkdir()

    def found() -> list[str]:
        return [str(Path(one).relative_to(tmp_path)) for one in documents_in([str(tmp_path)])]

    everything = ["a.FCStd", "b.fcstd", "deep/er/g.FCStd", "old/c.FCStd"]
    everything += ["x/keep trial.FCStd", "x/old/d.FCStd", "x/trial e.FCStd"]
    assert found() == everything
    (tmp_path / ".siloignore").write_text("# what nobody orders\n/old/\n*trial*\n!keep*\ndeep/**\n")
    assert found() == ["a.FCStd", "b.fcstd", "x/keep trial.FCStd", "x/old/d.FCStd"]


def extraction(silo: FakeSilo, folder: Path, *, gone: str = "") -> Extraction:
    """A top with a sub-assembly with a part; the file named ``gone`` is not there any more."""
    entries: dict[str, BomEntry] = {}
    for name, category in (("part", "M01"), ("sub", "A01"), ("top", "A01")):
        path = folder / f"{name}.FCStd"
        if name != gone:
            path.write_bytes(b"x")
        item = silo.create_item("kindred-rd", category, name)
        children = tuple(entries.values())[-1:]
        is_assembly = name != "part"
        entries[name] = BomEntry(
            doc_path=str(path),
            object_name="Asm",
            silo_uuid=item.id,
            children=children,
            is_assembly=is_assembly,
            quantity=2,
        )
    return Extraction(entries["top"], entries["top"].children)


def test_a_file_that_cannot_be_hashed_costs_its_own_outcome_only(tmp_path: Path) -> None:
    """What was synced before it stays reported."""
    silo = FakeSilo()
    found = extraction(silo, tmp_path, gone="top")
    result = sync_top(str(tmp_path / "top.FCStd"), found, silo, Options(recursive=True))
    assert [outcome.status for outcome in result.outcomes] == [Status.MERGED, Status.FAILED]
    assert isinstance(result.outcomes[1].error, DocumentError)
    assert stopped_by(result) is None


@pytest.mark.parametrize(("error", "asked"), [(AuthError("no"), 1), (NotFoundError("no"), 2)])
def test_a_refused_token_is_not_tried_on_every_assembly(tmp_path: Path, error: SiloError, asked: int) -> None:
    """An item that is missing says nothing of the next one."""
    silo, calls = FakeSilo(), []
    found = extraction(silo, tmp_path)

    def refuse(name: str) -> None:
        if name == "merge_bom":
            calls.append(name)
            raise error

    silo.before = refuse
    result = sync_top("top.FCStd", found, silo, Options(recursive=True))
    assert len(calls) == asked
    assert all(outcome.error is error for outcome in result.outcomes)
    assert (stopped_by(result) is error) == (asked == 1)


def test_an_error_of_the_file_itself_does_not_stop_the_run() -> None:
    """The next file may be whole."""
    assert stopped_by(TopResult("a", error=DocumentError("a", "x"))) is None
    assert isinstance(stopped_by(TopResult("a", error=AuthError("x"))), AuthError)


def test_no_token_is_shown_in_a_repr() -> None:
    """A log or a traceback shows objects."""
    from silo.workbench.settings.page_work import Wanted
    from silo.workbench.settings.server import Known, Server

    values: list[Any] = [Known("u", "silo_x"), Server("u", "silo_x"), Wanted("u", "silo_x", True)]
    assert all("silo_x" not in repr(value) for value in values)
