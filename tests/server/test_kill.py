# SPDX-License-Identifier: LGPL-2.1-or-later
"""``kill -9`` of the server in the middle of merges (benchmarks/server_faults.py does hundreds)."""

from __future__ import annotations

from pathlib import Path

import pytest
from server_testing.kill import kill_rounds


@pytest.mark.slow
def test_a_killed_server_leaves_the_old_or_the_new_bom(url: str, tmp_path: Path) -> None:
    """Never something between; the history adds up to it; the client's retry gives the right answer."""
    report = kill_rounds(url, tmp_path, kills=4, seed=20260208)
    assert report.old + report.new == 4
