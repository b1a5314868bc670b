# SPDX-License-Identifier: LGPL-2.1-or-later
"""Settings for all tests."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from sharing import scheduler

# Time is measured in benchmarks; a test on a busy machine is not wrong for being slow.
settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """``-n 2 --dist loadscope`` keeps tests together by what they share, and not by their files."""
    return scheduler(config, log) if config.getoption("dist") == "loadscope" else None
