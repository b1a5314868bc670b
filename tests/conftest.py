# SPDX-License-Identifier: LGPL-2.1-or-later
"""Settings for all tests."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

# Time is measured in benchmarks; a test on a busy machine is not wrong for being slow.
settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")
