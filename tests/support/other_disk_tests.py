# SPDX-License-Identifier: LGPL-2.1-or-later
"""The temporary folders of all tests on a disk that ignores case: ``pytest -p other_disk_tests``."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path

import pytest
from other_disk import other_disk


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Mount it before pytest decides where temporary folders go; its workers get theirs from that one."""
    if hasattr(config, "workerinput"):
        return
    stack = ExitStack()
    config.add_cleanup(stack.close)
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="silo-disk-")))
    config.option.basetemp = str(stack.enter_context(other_disk(folder)) / "tests")
