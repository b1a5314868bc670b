# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page that compares FreeCAD's own BOM with ours says what was measured, and what is still so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from freecad_cases import compared, machines


def test_the_page_tells_what_was_measured() -> None:
    """The table in the docs is made of the committed answers and of what our reader says today."""
    measured = json.loads(compared.MEASURED.read_text(encoding="utf-8"))
    page = compared.PAGE.read_text(encoding="utf-8")
    assert page == compared.page_with(page, compared.table(measured))


@pytest.mark.freecad
@pytest.mark.parametrize("version", ["1.0", "1.1"])
def test_freecads_own_bom_still_answers_so(version: str, tmp_path: Path) -> None:
    """Where a newer FreeCAD counts better, the page has to say so."""
    measured = json.loads(compared.MEASURED.read_text(encoding="utf-8"))
    assert compared.ask_freecad(machines.need(version), tmp_path) == measured[version]
