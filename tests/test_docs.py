# SPDX-License-Identifier: LGPL-2.1-or-later
"""The documentation names what there is: commands, options, files, findings, exit codes, make targets."""

from __future__ import annotations

import argparse
import re
from functools import cache
from pathlib import Path

import docs_hooks
import page_commands
import pytest
from warm_reader import stand_in

from silo.bom.findings import FindingCode
from silo.cli.parser import build_parser
from silo.workbench.settings.preferences import DEFAULTS

ROOT = Path(__file__).resolve().parents[1]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted((ROOT / "examples").rglob("*.md")),
]
# Other programs have options too; what stands behind these words is theirs.
_OTHERS = re.compile(
    r"^\s*(?:\$ )?(?:sudo )?(docker|podman|pip|python3?|curl|git|psql|make|freecadcmd|apt)\b"
)


TREES = ("mods", "tests", "scripts", "benchmarks", "examples")
# Of the Fasteners workbench; and what a translator makes.
THEIRS = ("FastenersBillOfMaterials.py", "FSutils.py")
# Between processes of ours, or names of values.
INSIDE = {f"SILO_{name}" for name in ("ASK_DATA", "ASK_NAMES", "OUT", "SCRIPT")}
INSIDE |= {f"FREECAD_{name}" for name in ("PACKAGES", "USER_HOME", "USER_TEMP")}
MADE = ("mods/silo/workbench/resources/translations/silo_de.ts",)


@cache
def commands() -> dict[str, argparse.ArgumentParser]:
    """The sub-commands of ``silo-mod``."""
    actions = build_parser()._subparsers._group_actions  # type: ignore[union-attr]
    return dict(actions[0].choices)  # type: ignore[arg-type]


def told_lines(text: str) -> list[tuple[str, str]]:
    """(command, the words behind it) of each ``silo-mod …`` in code."""
    text = text.replace("\\\n", " ")
    code = re.findall(r"```[^\n]*\n(.*?)```", text, re.DOTALL) + re.findall(r"`([^`\n]+)`", text)
    lines = [line for block in code for line in block.split("\n") if not _OTHERS.match(line)]
    found = [re.search(r"\bsilo-mod ([a-z][a-z-]*)\b([^|;#>]*)", line) for line in lines]
    return [(match[1], match[2]) for match in found if match]


def test_every_command_and_option_exists() -> None:
    """A line that is copied from a page is understood."""
    for page in PAGES:
        known = commands()
        for command, words in told_lines(page.read_text("utf-8")):
            assert command in known, f"{page.name}: silo-mod {command}"
            options = known[command]._option_string_actions
            for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", words):
                assert option in options, f"{page.name}: silo-mod {command} {option}"


def test_every_link_leads_somewhere() -> None:
    """Relative links and pictures point at files of the repository."""
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text("utf-8")):
            if not re.match(r"[a-z]+:", target):
                assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_every_module_and_target_exists() -> None:
    """``silo.x.y`` and ``make x`` are there."""
    for page in PAGES:
        text = page.read_text("utf-8")
        for name in re.findall(r"`(silo(?:_server)?(?:\.[a-z_]+)+)`", text):
            # The last word may be a name in a module.
            homes = [name.replace(".", "/"), name.rpartition(".")[0].replace(".", "/")]
            found = [(ROOT / "mods" / f"{home}{end}").exists() for home in homes for end in ("", ".py")]
            assert any(found), f"{page.name}: {name}"
        targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
        for target in re.findall(r"(?:^|`)make ([a-z-]+)", text, re.MULTILINE):
            assert target in targets, f"{page.name}: make {target}"


def test_every_path_exists() -> None:
    """A program (`api/policy.py`), or a path below a folder of the project (`tests/data/control`)."""
    for page in PAGES:
        folders = {part.name for part in ROOT.iterdir() if part.is_dir()}
        for name in re.findall(r"`([\w.-]+(?:/[\w.-]+)*/?)`", page.read_text("utf-8")):
            program = name.endswith((".py", ".sh")) and name not in THEIRS
            if program or (name.partition("/")[0] in folders and name not in MADE):
                found = f"/{name.rstrip('/')}\n" in all_paths() or (ROOT / name).exists()
                assert found, f"{page.name}: {name}"


@cache
def all_paths() -> str:
    """Each file and folder below ``TREES`` on a line."""
    return "".join(f"{path.as_posix()}\n" for home in TREES for path in (ROOT / home).rglob("*"))


def test_every_command_is_in_the_readme_or_a_page() -> None:
    """Nobody finds a command that no page names."""
    named = {command for page in PAGES for command, _ in told_lines(page.read_text("utf-8"))}
    assert set(commands()) <= named | {"demo"}


def test_every_remedy_is_a_command_that_there_is() -> None:
    """The reference names options too."""
    for code in FindingCode:
        for command, words in told_lines(code.remedy):
            options = commands()[command]._option_string_actions
            assert all(option in options for option in re.findall(r"--[a-z-]+", words)), code


def test_the_reference_has_all_that_there_is() -> None:
    """Commands, findings, requests and command lines, as the site shows them."""
    pages = {
        name: getattr(docs_hooks, name)() for name in ("commands", "findings", "api", "executed", "schemas")
    }
    assert all(f"### {name}\n" in pages["commands"] for name in commands())
    assert all(f"| `{code}` |" in pages["findings"] for code in FindingCode)
    assert "### `POST /api/items/{part_number}/bom/merge`" in pages["api"]
    linked = set(re.findall(r"\]\(#(\w+)\)", pages["api"]))
    assert linked <= {name.lower() for name in re.findall(r"^### (\w+)$", pages["api"], re.MULTILINE)}
    assert "silo-mod sync vault/ --report night.html" in pages["executed"]
    assert "Not run: needs FreeCAD" in pages["executed"]


def test_every_setting_is_on_the_page_about_them() -> None:
    """Environment variables of the client, and the preferences of the add-on with their defaults."""
    page = (ROOT / "docs" / "configuration.md").read_text("utf-8")
    server = (ROOT / "docs" / "server-settings.md").read_text("utf-8")
    source = "".join(path.read_text("utf-8") for path in (ROOT / "mods").rglob("*.py"))
    for name in set(re.findall(r"\b(?:SILO|FREECAD)_[A-Z_]*[A-Z]\b", source)) - INSIDE:
        assert f"`{name}`" in page or f"`{name}`" in server, name
    for name, default in DEFAULTS.items():
        shown = {"": "empty", True: "yes", False: "no"}.get(default, f"`{default}`")
        assert re.search(rf"^\| `{name}` \| {shown} \|", page, re.MULTILINE), name


def test_every_finding_is_explained() -> None:
    """Each code that a BOM may show stands on the pages about counting."""
    page = "".join((ROOT / "docs" / name).read_text("utf-8") for name in ("counting.md", "counting-rules.md"))
    missing = [code for code in FindingCode if f"`{code}`" not in page and f"*{code}*" not in page]
    assert missing == []


def test_the_exit_codes_are_the_same_everywhere() -> None:
    """``--help`` and the README say what ``silo.cli.main`` returns."""
    codes = "0 done, 1 differences or something left undone, 2 bad input, 3 server, 130 cancelled"
    assert codes in build_parser().format_help().replace("\n", " ")
    assert codes in (ROOT / "README.md").read_text("utf-8").replace("\n", " ").replace("codes: ", "")


def test_readme_works_as_it_is_seen() -> None:
    """No command stands where no reader sees it; the page is short, and its first picture is FreeCAD."""
    text = (ROOT / "README.md").read_text("utf-8")
    assert "before" not in {step.kind for step in page_commands.steps(text)}
    assert text.count("\n") < 90
    assert re.findall(r"!\[([^]]*)\]", text)[0].startswith("FreeCAD")
    visible = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    lines = [words for step in page_commands.steps(visible) for words in step.commands() if step.kind == "sh"]
    circle = ("serve", "login", "bom", "register", "commit", "status", "pull", "diff", "sync", "order")
    found = [name for line in lines for name in re.findall(r"^silo-mod ([a-z-]+)", line)]
    assert [name for name in found if name in circle] == list(circle)
    assert "inertia" in found
    for number, line in enumerate(lines):  # a terminal begins without the environment
        if line.startswith("silo-mod serve"):
            assert lines[number + 1] == ". .venv/bin/activate"


LANGUAGES = {"before", "browser", "sh", "text", "python", "json", "toml", "yaml", "csv", "sql"}


def test_every_block_says_what_it_is() -> None:
    """No command line hides in a block that is taken for a picture. A reason names tests that there are."""
    for page in PAGES:
        for step in page_commands.steps(page.read_text("utf-8")):
            assert step.kind in LANGUAGES, f"{page.name}: a block of {step.kind or 'nothing'}: {step.text}"
            for path in re.findall(r"[\w./]+/[\w./]+", step.reason):
                assert (ROOT / path).exists(), f"{page.name}: {path}"


@pytest.fixture
def quick(tmp_path: Path, _warm_reader: str) -> list[Path]:
    """Folders with a ``silo-mod`` that loads nothing; none if this machine cannot have it."""
    if not _warm_reader:
        return []
    program = tmp_path / "silo-mod"
    program.write_text(stand_in(_warm_reader))
    program.chmod(0o755)
    return [tmp_path]


FOLLOWED = [
    pytest.param(page, id=str(page.relative_to(ROOT)))
    for page in PAGES
    for kinds in [{step.kind for step in page_commands.steps(page.read_text("utf-8")) if not step.reason}]
    if "sh" in kinds and "browser" not in kinds  # tests/browser/test_first_hour.py follows the others
]


@pytest.mark.slow
@pytest.mark.usefixtures("needs_git", "needs_signals")
@pytest.mark.parametrize("page", FOLLOWED)
def test_the_commands_of_a_page_work_in_their_order(page: Path, quick: list[Path]) -> None:
    """As a new user copies them, with an empty home; what is printed is what the page says."""
    assert page_commands.follow(page, *quick) == ""


def test_a_page_that_is_wrong_is_noticed(tmp_path: Path) -> None:
    """Another exit code, or another text, than the page says."""
    page = tmp_path / "page.md"
    for text, problem in (
        ("```sh\nfalse\n```", "false\nended with 1"),
        ("```sh\nfalse # exit code 1\n```", ""),
        (
            "```sh\nexport A=b\nmkdir c && cd c\n```\n```sh\necho $A; basename $PWD\n```\n```text\nb c\n```",
            "",
        ),
        ("```sh\necho a\n```\n```text\nb\n```", "The page says 'b'. Printed was:\na"),
        ("<!-- not run: it fails -->\n```sh\nfalse\n```", ""),
    ):
        page.write_text(text, encoding="utf-8")
        assert page_commands.follow(page).startswith(problem), text
        assert problem or not page_commands.follow(page)
