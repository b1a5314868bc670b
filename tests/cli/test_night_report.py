# SPDX-License-Identifier: LGPL-2.1-or-later
"""The report of a night for a person: counts, what is new, causes; the exit code is the worst of the run."""

from __future__ import annotations

import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from fault_proxy import Fault, fault_proxy
from fcstd_writer import Doc, locals_, part
from hypothesis import given
from hypothesis import strategies as st

from silo.batch import Html, RunSummary, TopResult
from silo.bom.errors import DocumentError, Exit, SiloError, UnreachableError

TAGS = set("html head meta title style body h1 h2 h3 p ul li table tr th td".split())  # noqa: SIM905


class Visible(HTMLParser):
    """The text that a page shows."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.text: list[str] = []
        self.tags: set[str] = set()
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.add(tag)

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def pointer(path: Path) -> None:
    path.write_text(f"version https://git-lfs.github.com/spec/v1\noid sha256:{'0' * 64}\nsize 12345\n")


@pytest.fixture
def night(run: Any, registered: Path, silo: Any, gearbox: Path, tmp_path: Path) -> Any:
    """Run a night; return its exit code and its report in each form."""

    def _night(*words: str) -> tuple[int, dict[str, str]]:
        paths = [tmp_path / f"night.{form}" for form in ("md", "html", "json", "xml")]
        options = [word for path in paths for word in ("--report", path)]
        code = run("sync", gearbox.parent, *options, *words).code
        return code, {path.suffix[1:]: path.read_text("utf-8") for path in paths}

    return _night


def test_the_second_night_says_what_is_new(night: Any, gearbox: Path) -> None:
    """What was there before stands below, and a hint about the model only in the first report."""
    _, first = night()
    assert "New since the last run" not in first["md"]
    assert "8 individual links" in first["md"]
    pointer(gearbox.parent / "new.FCStd")
    _, second = night()
    new = second["md"].split("## New since the last run\n")[1].split("##")[0]
    assert "new.FCStd" in new
    assert "individual links" not in second["md"].replace("Hints that were there before", "")
    assert "Hints that were there before: 1" in second["md"]
    assert [line for line in json.loads(second["json"])["summary"]["new"] if "new.FCStd" in line]
    assert "new: " in second["xml"]
    _, third = night("--dry-run")
    for form in ("md", "html"):
        assert "New since the last run" in third[form]
        assert "nothing" in third[form].split("Errors")[0]
    assert "new.FCStd" in third["md"]


def test_the_mail_of_a_night_fits_on_one_screen(
    run: Any, registered: Path, silo: Any, gearbox: Path, tmp_path: Path
) -> None:
    """A line for each cause with three files at fault, however many say so; the page has the rest."""
    vault = gearbox.parent
    for number in range(40):
        shutil.copy(gearbox, vault / f"Top{number}.FCStd")
    parts = sorted((vault / "parts").glob("*.FCStd"))[:4]
    for part_file in parts:
        pointer(part_file)
    for number in range(16):
        pointer(vault / f"p{number}.FCStd")
    names = [tmp_path / "night.md", tmp_path / "night.html"]
    words = ("sync", vault, "--report", names[0], "--report", names[1])
    terminal = run(*words).out
    mail = names[0].read_text("utf-8")
    assert len(mail.splitlines()) < 40
    assert len(mail.encode()) < 4000
    (pointers,) = [line for line in mail.splitlines() if "LFS pointer" in line]
    assert pointers.startswith("- 20 × ")
    assert pointers.count(".FCStd") == 3
    assert f"All of it: `{names[1]}`" in mail
    for line in filter(None, mail.splitlines()[2:]):
        assert line.lstrip("# -").replace("\\", "").split("Time:")[0] in terminal
    assert len(terminal.splitlines()) < 40
    page = " ".join(Visible(names[1].read_text("utf-8")).text)
    assert all(f"p{number}.FCStd" in page for number in range(16))
    assert all(f"Top{number}.FCStd" in page for number in range(40))
    again = run(*words).out
    assert again.split("New since the last run\n")[1].split("\n")[0].strip() == "nothing"
    assert len(run(*words, "--verbose").out.splitlines()) > 40


def test_all_forms_say_the_same(night: Any, gearbox: Path) -> None:
    """The counts on top, every sentence, every change; files with one cause are one line: one thing to do.

    Files that cannot be read are reported first, and the others are synced; parts are passed over.
    """
    for number in range(15):
        pointer(gearbox.parent / f"p{number}.FCStd")
    code, told = night()
    assert code == Exit.UNDONE
    assert re.search(r"^- 15 × it is a Git LFS pointer", told["md"], re.MULTILINE)
    assert told["md"].count("git lfs pull") == 1
    assert "15 × it is a Git LFS pointer" in told["html"]
    places = [told["md"].index(words) for words in ("## Errors", "p0.FCStd", "TopAssembly.FCStd")]
    assert places == sorted(places)
    assert "| added |" in told["md"]
    data = json.loads(told["json"])
    summary = data["summary"]
    assert (data["ended"], len(data["results"])) == (True, 17)
    assert (summary["files"], summary["in_order"], summary["parts"]) == (24, 9, 7)
    causes = [one["cause"] for one in summary["errors"]]
    assert (len(causes), len(set(causes))) == (15, 1)
    page = Visible(told["html"])
    shown = " ".join(page.text)
    assert told["md"].splitlines()[2].startswith(told["html"].split("<p>")[1].split(" files")[0])
    for words in (one["message"] for one in summary["warnings"]):
        assert words in shown
    assert "M8x20 Bolt" in shown
    assert page.tags <= TAGS
    suite = ElementTree.fromstring(told["xml"]).find("testsuite")  # noqa: S314
    assert suite is not None
    assert [suite.get("tests"), suite.get("errors")] == ["17", "15"]


@given(st.text(st.sampled_from("ab<>&\"'\n\x00\x1b\u202e\ud800"), max_size=20))
def test_text_of_others_does_nothing_in_html(text: str) -> None:
    summary = RunSummary(warnings={text: []}, notes=[text])
    page = Visible(Html().head(summary) + Html().end(summary))
    assert page.tags <= TAGS
    assert not re.search("[\x00\x1b\u202e]", "".join(page.text))


def test_a_file_with_two_assemblies_is_no_error(run: Any, silo: Any, tmp_path: Path) -> None:
    """Of a folder both are meant, and both are synced."""
    folder = tmp_path / "vault"
    folder.mkdir()
    part("part", "Box").save(folder / "part.FCStd")
    both = Doc(label="both").link("L1", "part.FCStd", "Box").link("L2", "part.FCStd", "Box")
    both.add("App::Part", "Left", Label="Left", Group=locals_("L1"), Type="Assembly")
    both.add("App::Part", "Right", Label="Right", Group=locals_("L2"), Type="Assembly")
    both.save(folder / "both.FCStd")
    names = [one["assembly"]["object"] for one in run("bom", folder, "--json").json()["assemblies"]]
    assert sorted(names) == ["Left", "Right"]
    assert run("bom", folder).code == Exit.DONE
    assert run("register", folder, "--yes").code == Exit.DONE
    done = run("sync", folder, "--json")
    assert done.code == Exit.DONE
    (result,) = (one for one in done.json()["results"] if one["assemblies"])
    assert [one["status"] for one in result["assemblies"]] == ["merged", "merged"]
    both = folder / "both.FCStd"
    assert run("bom", both).code == Exit.BAD_INPUT, "a person names the one that is meant"
    assert run("sync", both).code == Exit.UNDONE
    told = run("bom", both, "--assembly", "all", "--json").json()
    assert [one["assembly"]["object"] for one in told["assemblies"]] == ["Left", "Right"]
    assert run("bom", both, "--assembly", "all").out.count("1 × Box") == 2
    assert run("bom", both, "--assembly", "all", "--flat").code == Exit.BAD_INPUT
    (result,) = run("sync", both, "--assembly", "all", "--json").json()["results"]
    assert [one["status"] for one in result["assemblies"]] == ["unchanged", "unchanged"]


def test_own_parts_that_are_no_items_leave_a_file_undone(run: Any, silo: Any, tmp_path: Path) -> None:
    """An assembly of bodies of its own file: bom, sync and a night say so, until a person has answered."""
    folder = tmp_path / "vault"
    folder.mkdir()
    top = folder / "top.FCStd"
    doc = Doc(label="top").add("Part::Box", "Skeleton", Visibility=True)
    doc.add("Assembly::AssemblyObject", "Top", Group=locals_("Skeleton"), Type="Assembly").save(top)
    assert run("bom", top).code == run("bom", folder).code == Exit.UNDONE
    assert run("register", folder, "--yes").code == Exit.DONE
    assert run("sync", top).code == Exit.UNDONE
    night = run("sync", folder)
    assert night.code == Exit.UNDONE
    assert "1 own part is no item yet" in night.out


@pytest.mark.usefixtures("registered")
def test_a_dead_server_wins_over_bad_files(
    run: Any, silo: Any, gearbox: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the first line says how many assemblies were not sent, and why."""
    pointer(gearbox.parent / "p.FCStd")
    report = tmp_path / "night.md"
    with fault_proxy(silo.client.base_url) as proxy:
        monkeypatch.setenv("SILO_API_URL", proxy.url)
        proxy.item, proxy.fault = "/merge", Fault(502, b"<html>bad gateway</html>", "text/html")
        ran = run("sync", gearbox.parent, "--report", report, "--json")
    assert ran.code == Exit.REMOTE
    assert ran.json()["summary"]["not_sent"] >= 1
    monkeypatch.setenv("SILO_API_URL", "http://127.0.0.1:9")
    ran = run("sync", gearbox.parent, "--report", report)
    assert ran.code == Exit.REMOTE
    first = report.read_text("utf-8").splitlines()[2]
    assert re.match(r"2 assemblies not sent: .*127.* files in order", first)
    assert "2 assemblies not sent" in ran.out


CAUSES: list[SiloError | None] = [
    None,
    DocumentError("a.FCStd", "it is damaged"),
    UnreachableError("no answer"),
]


@given(st.lists(st.tuples(st.sampled_from(CAUSES), st.integers(1, 5))))
def test_the_exit_code_is_the_worst_of_the_run(files: list[tuple[SiloError | None, int]]) -> None:
    summary = RunSummary()
    for number, (error, left) in enumerate(files):
        summary.add(TopResult(f"{number}.FCStd", error=error, left=left))
    worst = {None: Exit.DONE, DocumentError: Exit.UNDONE, UnreachableError: Exit.REMOTE}
    kinds = [None if error is None else type(error) for error, _ in files]
    assert summary.exit_code == max((worst[kind] for kind in kinds), default=Exit.DONE)
    assert summary.unsent.total() == sum(left for error, left in files if isinstance(error, UnreachableError))
    assert ("not sent" in summary.sentence()) is bool(summary.unsent)
