# SPDX-License-Identifier: LGPL-2.1-or-later
"""Draw ``docs/images/demo.svg``: what the demo prints, as a picture.

Run: ``.venv/bin/python scripts/picture_demo.py``
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from rich.console import Console
from rich.text import Text

WIDTH = 104
OUT = Path(__file__).resolve().parents[1] / "docs" / "images" / "demo.svg"


def main() -> None:
    """Run the demo, keep its first part and its last, and write the picture."""
    env = {**os.environ, "FORCE_COLOR": "1", "COLUMNS": str(WIDTH), "TERM": "xterm-256color"}
    run = subprocess.run(
        [sys.executable, "-m", "silo.cli.main", "demo"], env=env, capture_output=True, text=True, check=True
    )
    # The port and the folder differ from run to run; the picture should not.
    output = re.sub(r"127\.0\.0\.1:\d+", "127.0.0.1:8080", run.stdout)
    console = Console(record=True, width=WIDTH, file=open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
    console.print(Text.from_ansi(shorten(output.splitlines())))
    OUT.parent.mkdir(parents=True, exist_ok=True)
    svg = console.export_svg(title="make demo")
    # Fonts are the reader's own: a picture in a README loads nothing from elsewhere.
    svg = re.sub(r"@font-face \{.*?\}\s*", "", svg, flags=re.DOTALL)
    OUT.write_text(svg, encoding="utf-8")


def shorten(lines: list[str]) -> str:
    """The steps that show the work: reading, and the sync after the edit."""
    starts = [n for n, line in enumerate(lines) if re.search(r"(^|m)\d  ", line)]
    if len(starts) < 5:
        return "\n".join(lines)
    return "\n".join([*lines[: starts[1]], *lines[starts[-2] :]])


if __name__ == "__main__":
    main()
