# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page about mass and inertia names what the program has."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from silo.cli.parser import build_parser
from silo.inertia.bom.table import BomCode
from silo.inertia.codes import Decided, MassCode, Rule, Source
from silo.inertia.notes import GeometryCode

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "inertia.md").read_text("utf-8")


@pytest.mark.parametrize("code", [*MassCode, *BomCode, *GeometryCode, *Source, *Rule], ids=str)
def test_every_code_is_documented(code: str) -> None:
    """A warning that nobody can look up helps nobody."""
    if code == Rule.NONE:
        return
    assert f"`{code}`" in PAGE


def test_every_option_of_the_page_exists() -> None:
    """Options named in the text are those of the commands."""
    known: set[str] = set()
    for command in ("inertia", "links", "mass"):
        (commands,) = (a for a in build_parser([command])._actions if isinstance(a.choices, dict))
        known.update(commands.choices[command]._option_string_actions)
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", PAGE))
    assert named <= known, named - known
    assert Decided.ORDER in PAGE


def test_links_of_the_page_lead_somewhere() -> None:
    """Relative links point at files."""
    for target in re.findall(r"\]\(([^)#]+)\)", PAGE):
        if "://" not in target:
            assert (DOCS / target).exists(), target


def test_the_python_example_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What the page shows is what the library does."""
    arm = DOCS.parent / "examples" / "arm"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.step").write_bytes((arm / "arm.step").read_bytes())
    (tmp_path / "link.step").write_bytes((arm / "arm.step").read_bytes())
    (tmp_path / "bom.csv").write_bytes((arm / "bom.csv").read_bytes())
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 2
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "docs/inertia.md", "exec"), names)
    report = names["report"]
    assert report.link_properties["upper_arm"].mass > 1  # type: ignore[attr-defined]
