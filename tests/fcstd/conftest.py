# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tests here write their files with ``fcstd_writer`` beside this file."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
