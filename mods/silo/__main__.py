# SPDX-License-Identifier: LGPL-2.1-or-later
"""``python -m silo``: the command line, where no program ``silo-mod`` is on the PATH."""

from __future__ import annotations

import sys

from silo.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
