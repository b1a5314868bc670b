# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pages of the documentation with steps in the browser, followed as a new user does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [path for path in sorted(ROOT.glob("docs/**/*.md")) if "<!-- browser:" in path.read_text("utf-8")]


@pytest.mark.slow
@pytest.mark.usefixtures("chromium")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_can_be_followed(page: Path) -> None:
    """Its commands and its steps in the browser, in their order. Playwright runs once in a process."""
    words = (sys.executable, ROOT / "scripts" / "page_commands.py", page)
    run = subprocess.run(words, capture_output=True, text=True, encoding="utf-8", check=False)
    assert run.returncode == 0, run.stdout + run.stderr
