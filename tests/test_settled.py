# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tests in the browser measure a page through ``settled`` only, which waits until all of it is there."""

from __future__ import annotations

import re
from pathlib import Path

TESTS = Path(__file__).parent
# What looks at the page at once, styled or not, complete or not; ``expect`` tries again instead.
AT_ONCE = re.compile(r"\.(evaluate|bounding_box|screenshot|pdf|aria_snapshot|is_(visible|hidden|checked))\(")


def test_nothing_is_measured_before_the_page_is_there() -> None:
    """Neither a script nor a size nor a picture of its own."""
    found = [
        f"{file.relative_to(TESTS)}:{number}: {line.strip()}"
        for file in sorted((TESTS / "browser").glob("*.py"))
        for number, line in enumerate(file.read_text("utf-8").splitlines(), 1)
        if AT_ONCE.search(line)
    ]
    assert found == []
