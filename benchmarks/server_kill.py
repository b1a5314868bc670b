# SPDX-License-Identifier: LGPL-2.1-or-later
"""``kill -9`` of the server in the middle of merges, a hundred times on each database.

    python benchmarks/server_kill.py [sqlite] [postgres] [--kills N] [--seed N]

Ends with an error where a BOM was between old and new, the history did not add up, or a retry got a wrong
answer (``server_testing.kill`` says what is done).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from server_testing import Databases
from server_testing.kill import kill_rounds


def main() -> None:
    """Kill, and say how it went."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", default=["sqlite", "postgres"])
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        databases = Databases(Path(folder))
        try:
            for kind in args.kinds:
                report = kill_rounds(databases.new(kind), Path(folder) / kind, args.kills, args.seed)
                print(
                    f"{kind}: {report.kills} kills; the BOM was the old one {report.old} times, the new one "
                    f"{report.new} times, never between; {report.answered} answers had come before the kill; "
                    "every retry got the right answer"
                )
        finally:
            databases.close()


if __name__ == "__main__":
    main()
