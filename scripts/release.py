#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""What must be true of a release: ``release.py version`` and ``release.py contents WHEEL``."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LARGEST = 700_000  # bytes of one file: the viewer of three.js


def version() -> list[str]:
    """Return what is wrong with the version of package.xml, which setup.py takes."""
    addon, changes = ((ROOT / name).read_text("utf-8") for name in ("package.xml", "CHANGELOG.md"))
    number, date = (re.findall(rf"<{tag}>(.*?)<", addon)[0] for tag in ("version", "date"))
    wanted = f"## {number} ({date})"
    first = next((line for line in changes.splitlines() if line.startswith("## ")), "nothing")
    return [] if first == wanted else [f"CHANGELOG.md begins with {first!r}, package.xml wants {wanted!r}"]


def contents(wheel: str) -> list[str]:
    """Return what a wheel lacks of the packages, or has beside them."""
    git = subprocess.run(["git", "ls-files", "mods"], cwd=ROOT, capture_output=True, text=True, check=True)
    tracked = {line.removeprefix("mods/") for line in git.stdout.splitlines()}
    wanted = {name for name in tracked if not name.endswith((".ts", ".po"))}
    with zipfile.ZipFile(wheel) as archive:
        sizes = {one.filename: one.file_size for one in archive.infolist()}
    sizes = {name: size for name, size in sizes.items() if ".dist-info/" not in name}
    found = {name for name in sizes if not name.startswith("silo/shipped/")}
    shipped = {name.removeprefix("silo/shipped/") for name in set(sizes) - found}
    strange = {f"shipped/{name}" for name in shipped if not (ROOT / name).is_file()} | found - wanted
    return [
        *(f"{name} is missing" for name in sorted(wanted - found)),
        *(f"{name} does not belong there" for name in sorted(strange)),
        *(f"{name} has {size} bytes" for name, size in sizes.items() if size > LARGEST),
    ]


if __name__ == "__main__":
    problems = {"version": version, "contents": contents}[sys.argv[1]](*sys.argv[2:])
    sys.exit("\n".join(problems) or 0)
