# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which system this is, for the few questions that nothing else answers."""

from __future__ import annotations

import os
import sys

NAME = sys.platform
WINDOWS = os.name == "nt"
# Modes say who may read a file; on Windows access lists do, which a mode does not show.
MODES_COUNT = os.name == "posix"
