# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every text of the pane can be read, in light and dark themes, also when the theme changes meanwhile."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from freecad_cases.machines import WANTED
from gui_cases.window import window

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

# What WCAG asks of normal text (AA).
LEAST = 4.5


@pytest.fixture(name="said", scope="module", params=WANTED)
def _said(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, Any]]:
    with window(request.param, tmp_path_factory.mktemp("themes").resolve()) as freecad:
        freecad.prepare()
        yield freecad.run("themes.py")


@pytest.mark.parametrize("theme", ["light", "dark", "light again"])
def test_every_text_can_be_read(said: dict[str, Any], theme: str) -> None:
    """Titles, warnings, times and links."""
    contrasts = said[theme]
    assert {text: value for text, value in contrasts.items() if value < LEAST} == {}
    assert any(text.startswith("BOM Updated") for text in contrasts)
    assert "Register Parts…" in contrasts
