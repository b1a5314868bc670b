# SPDX-License-Identifier: LGPL-2.1-or-later
"""The version, and what a wheel holds beside the packages: the example of the demo and the add-on's own files
(pyproject.toml has all the rest; MANIFEST.in has them for the source archive).
"""

import re
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
ADDON = ("Init.py", "InitGui.py", "package.xml", "LICENSE", "README.md")


class BuildWithFiles(build_py):
    """Copies them below ``silo/shipped``, where ``silo.shipped_files.shipped`` finds them."""

    def run(self) -> None:
        super().run()
        if self.editable_mode:  # the checkout itself is read then
            return
        example = sorted(path.relative_to(ROOT) for path in (ROOT / "examples" / "gearbox").rglob("*.FCStd"))
        docs = sorted(path.relative_to(ROOT) for path in (ROOT / "docs").glob("*.md"))
        for name in (*example, *docs, *map(Path, ADDON)):
            target = Path(self.build_lib) / "silo" / "shipped" / name
            self.mkpath(str(target.parent))
            self.copy_file(str(ROOT / name), str(target))


(VERSION,) = re.findall(r"<version>(.*?)<", (ROOT / "package.xml").read_text("utf-8"))
setup(version=VERSION, cmdclass={"build_py": BuildWithFiles})
