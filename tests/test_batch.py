# SPDX-License-Identifier: LGPL-2.1-or-later
"""Many files in one run: each once, no result lost, and an end where going on is useless."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from hunting import examples
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from silo.batch import JUnit, Markdown, RunSummary, SyncOptions, TopResult, cell, stopped_by, sync_top
from silo.bom.compare.bom_diff import BomChange, BomDiff, QuantityChange
from silo.bom.compare.merge import MergePlan
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import AuthError, DocumentError, InputError, NotFoundError, SiloError
from silo.bom.view.diff_rows import diff_rows
from silo.bom_sync.resolved import Resolved
from silo.bom_sync.steps import Outcome, Status
from silo.fcstd import Library
from silo.files import documents_in
from silo.platform.whole_files import scratch_folder
from silo.testing import FakeSilo


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


NAMES = ("a", "b", "old", "a b", "x[1]", "T.FCStd", "u.fcstd", "T .FCStd", "#q.FCStd", "!n.FCStd", "B.FCStd")
PATTERNS = (
    *(
        "a",
        "a/",
        "/a",
        "b/*",
        "!b/T.FCStd",
        "*.FCStd",
        "!T.FCStd",
        "**/old",
        "old/**",
        "a/**/T.FCStd",
        "T.FCStd ",
    ),
    *(
        "T\\ .FCStd",
        "T .FCStd",
        "\\#q.FCStd",
        "#q.FCStd",
        "\\!n.FCStd",
        "!n.FCStd",
        "x[1]",
        "x[[]1]",
        "?.FCStd",
    ),
    *("[a-b]", "", "   ", "/", "//", "a//b", "*", "/*", "!*/", "!/a", "[", "**", "!a/", "*/T.FCStd", "a\\ b"),
    *("*.[Ff][cC]std", "a**", "!old", "{a,b}", "a/.", "./a", "a/../b", "\x0cT.FCStd", "T.FCStd\r", "\ufeffa"),
)


@pytest.mark.usefixtures("needs_git")
@pytest.mark.usefixtures("needs_case")
@pytest.mark.filterwarnings("ignore::FutureWarning")
@settings(max_examples=examples(8))
@given(
    folders=st.lists(st.lists(st.sampled_from(NAMES[:5]), max_size=3), min_size=1, max_size=5),
    names=st.lists(st.sampled_from(NAMES[5:]), min_size=1, max_size=6),
    rules=st.lists(st.lists(st.sampled_from(PATTERNS), min_size=1, max_size=4), min_size=1, max_size=3),
)
@example(folders=[[], ["a"]], names=["T.FCStd", "u.fcstd"], rules=[["T.FCStd"], ["!T.FCStd", "u.fcstd"]])
def test_what_is_ignored_is_what_git_would_ignore(
    folders: list[list[str]], names: list[str], rules: list[list[str]]
) -> None:
    """Files of patterns in several folders; the oracle is git with the same files under its own name."""
    with scratch_folder("silo-ignore-") as scratch:
        base = Path(scratch)
        subprocess.run(["git", "init", "-q", base], check=True)
        for number, steps in enumerate(folders):
            folder = base.joinpath(*steps)
            folder.mkdir(parents=True, exist_ok=True)
            for name in names:
                (folder / name).touch()
            if number < len(rules):
                for file in (".gitignore", ".siloignore"):
                    (folder / file).write_bytes("\n".join(rules[number]).encode())
        command = ["git", "-C", base, "ls-files", "-oz", "--exclude-per-directory=.gitignore"]
        listed = subprocess.run(command, capture_output=True, check=True).stdout.split(b"\0")
        wanted = {os.fsdecode(name) for name in listed if name.lower().endswith(b".fcstd")}
        assert {Path(one).relative_to(base).as_posix() for one in documents_in([scratch])} == wanted


def test_patterns_that_nobody_can_read_are_an_error(tmp_path: Path) -> None:
    """Git would leave them out without a word; a comment in another encoding is none of them."""
    (tmp_path / "a.FCStd").touch()
    (tmp_path / ".siloignore").write_bytes(b"# f\xfcr Gro\xdfe\n\xfc.FCStd\n")
    assert len(documents_in([str(tmp_path)])) == 1
    (tmp_path / ".siloignore").write_text("old/\n!\n")
    with pytest.raises(InputError, match=r"\.siloignore cannot be read"):
        documents_in([str(tmp_path)])


def test_what_was_deleted_or_belongs_to_the_system_is_left_out(tmp_path: Path) -> None:
    """A deleted assembly in a recycle bin has the identity of the one that took its place."""
    bins = (".Trash-1000/files", "#recycle", "$RECYCLE.BIN/S-1", ".snapshot/daily", "sub/@Recycle")
    for name in ("T.FCStd", *(f"{folder}/T.FCStd" for folder in bins), "._T.FCStd", ".#T.FCStd"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert documents_in([str(tmp_path)]) == [str(tmp_path / "T.FCStd")]
    hidden = tmp_path / ".Trash-1000"
    assert documents_in([str(hidden)]) == [str(hidden / "files/T.FCStd")], "asked for by name"


@pytest.mark.usefixtures("needs_symlinks")
def test_what_cannot_be_listed_or_followed_is_not_left_out(tmp_path: Path) -> None:
    """A folder without its files, or a link to a file that was not fetched, must not read as in order."""
    (tmp_path / "link.FCStd").symlink_to("annex/not-here")
    (tmp_path / "loop.FCStd").symlink_to("loop.FCStd")
    name = "n" * 200
    try:
        deep = os.open(tmp_path, os.O_RDONLY)
        for _ in range(25):  # deeper than a path may be long
            os.mkdir(name, dir_fd=deep)
            inner = os.open(name, os.O_RDONLY, dir_fd=deep)
            os.close(deep)
            deep = inner
        os.close(deep)
    except (OSError, NotImplementedError):
        pytest.skip("this system makes no folders that deep")
    found = documents_in([str(tmp_path)])
    assert found[:2] == [str(tmp_path / "link.FCStd"), str(tmp_path / "loop.FCStd")]
    (lost,) = found[2:]
    assert lost.endswith(name)
    for path in found:
        with pytest.raises(DocumentError):
            Library().open(path)
    shutil.rmtree(tmp_path / name)


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
    result = sync_top(str(tmp_path / "top.FCStd"), found, silo, SyncOptions(recursive=True))
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
    result = sync_top("top.FCStd", found, silo, SyncOptions(recursive=True))
    assert len(calls) == asked
    assert all(outcome.error is error for outcome in result.outcomes)
    assert (stopped_by(result) is error) == (asked == 1)


def test_an_error_of_the_file_itself_does_not_stop_the_run() -> None:
    """The next file may be whole."""
    assert stopped_by(TopResult("a", error=DocumentError("a", "x"))) is None
    assert isinstance(stopped_by(TopResult("a", error=AuthError("x"))), AuthError)


def test_no_token_is_shown_in_a_repr() -> None:
    """A log or a traceback shows objects."""
    from silo.workbench.settings.server import ServerChoice, ServerPreferences

    values: list[Any] = [ServerPreferences("u", "silo_x"), ServerChoice("u", "silo_x")]
    assert all("silo_x" not in repr(value) for value in values)


@given(st.text(st.sampled_from("ab1 |`*_[]()<>#@&;~$\\-+.!\n\t\x00\u202e\ud800é:"), max_size=30))
@settings(max_examples=examples(60))
def test_text_of_others_is_shown_in_markdown_and_does_nothing(text: str) -> None:
    """In a table, a list and a heading; the oracle is a reader of Markdown. Nobody is notified by a name."""
    shown = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    assume(shown)
    for before, kind in (("| | x |\n|---|---|\n| y | ", "table"), ("- ", "list_item"), ("### ", "heading")):
        written = f"{before}{cell(text)}{' |' if kind == 'table' else ''}\n"
        assert written.count("\n") == before.count("\n") + 1
        tokens = MarkdownIt("commonmark").enable(["table", "strikethrough"]).parse(written)
        opened = ("table_open", "list_item_open", "heading_open", "code_block", "hr")
        assert [token.type for token in tokens if token.type in opened] == [f"{kind}_open"]
        said = [token for token in tokens if token.type == "inline"][-1].children or []
        assert {token.type for token in said} <= {"text", "text_special"}
        words = "".join(token.content for token in said)
        assert not re.search(r"[@#]\w", words)
        assert " ".join(words.replace("\u200b", "").split()) == shown


def test_a_sentence_of_the_report_is_followed_by_the_files_that_it_does_not_name() -> None:
    """With a space between them."""
    summary = RunSummary(warnings={"One bolt is too many.": ["asm/T.FCStd"], "b.FCStd is odd.": ["b.FCStd"]})
    lines = Markdown().head(summary).splitlines()
    assert {"- One bolt is too many. (asm/T.FCStd)", "- b.FCStd is odd."} <= set(lines)


@given(st.lists(st.one_of(st.none(), st.lists(st.sampled_from(Status), max_size=3)), max_size=5))
def test_the_counts_of_a_ci_report_are_those_of_its_cases(files: list[list[Status] | None]) -> None:
    """An assembly that failed was counted twice, a file beside two blocked assemblies not at all.

    files
        the assemblies of each; None for a file that cannot be read.
    """
    form, summary, cases = JUnit(), RunSummary(), ""
    for number, statuses in enumerate(files):
        top = f"{number}.FCStd"
        one = Resolved(BomEntry(top, object_name="Top"), (), (), ())
        outcomes = tuple(Outcome(status, one) for status in statuses or ())
        error = DocumentError(top, "it is no FreeCAD document") if statuses is None else None
        result = TopResult(top, outcomes=outcomes, error=error)
        summary.add(result)
        cases += form.one(result, number)
    suite = ElementTree.fromstring(form.head(summary) + cases + form.end(summary)).find("testsuite")  # noqa: S314
    assert suite is not None
    told = [int(suite.get(name, "")) for name in ("tests", "failures", "errors")]
    assert told == [len(suite.findall(f".//{name}")) for name in ("testcase", "failure", "error")]


@pytest.mark.parametrize("status", [Status.MERGED, Status.BLOCKED])
def test_a_report_has_what_changed_and_not_what_people_own(status: Status) -> None:
    """A comparison has both, a line in doubt once. Nothing changed in a BOM that was not sent."""
    diff = BomDiff(
        added=(BomChange("P-ADDED", 1.0),),
        removed=(BomChange("P-REMOVED", 2.0),),
        quantity_changed=(QuantityChange("P-CHANGED", 3.0, None),),
        unchanged=(BomChange("P-SAME", 4.0),),
        manual=(BomChange("P-MANUAL", 5.0), BomChange("P-DOUBT", 6.0)),
        conflicts=(QuantityChange("P-DOUBT", 7.0, 6.0),),
        kept=(BomChange("P-KEPT", None),),
    )
    assert list(diff_rows(diff)) == [
        ("added", "P-ADDED", "1"),
        ("quantity_changed", "P-CHANGED", "? → 3"),
        ("conflicts", "P-DOUBT", "CAD 7, Silo 6"),
        ("removed", "P-REMOVED", "2"),
        ("kept", "P-KEPT", "?"),
        ("manual", "P-MANUAL", "5"),
    ]
    one = Resolved(BomEntry("top.FCStd", object_name="Top"), (), (), ())
    result = TopResult("top.FCStd", outcomes=(Outcome(status, one, MergePlan(diff)),))
    written = Markdown().one(result, 0)
    rows = [row.strip("| ").split(" | ") for row in written.splitlines() if "P-" in row]
    assert [(row[0], row[-1]) for row in rows] == (
        []
        if status is Status.BLOCKED
        else [
            ("added", "1"),
            ("quantity", "? → 3"),
            ("a reviewer decides", "CAD 7, Silo 6"),
            ("not in the assembly", "2"),
        ]
    )
