# SPDX-License-Identifier: LGPL-2.1-or-later
"""Write the committed fixtures anew, with every FreeCAD of this machine::

    .venv/bin/python tests/freecad/regenerate.py

``tests/data/freecad/corpus-<version>.zip`` per FreeCAD, and the control cases as plain files in
``tests/data/control``, built by FreeCAD 1.0.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from freecad_cases import corpora, machines
from freecad_cases.truth import CONTROL

CONTROL_BUILDER = "1.0"


def main() -> int:
    found = machines.freecads()
    if missing := [version for version in machines.WANTED if version not in found]:
        print(f"not written anew, for want of FreeCAD {', '.join(missing)}", file=sys.stderr)
    corpora.ARCHIVES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        for version, freecad in found.items():
            corpus = corpora.build(freecad, Path(temporary) / version)
            archive = corpora.ARCHIVES / f"corpus-{version}.zip"
            corpora.pack(corpus.folder, archive)
            print(f"{archive}: {len(corpus.built)} cases, {archive.stat().st_size // 1024} KB")
            if version == CONTROL_BUILDER:
                write_control(corpus)
    return 1 if missing else 0


def write_control(corpus: corpora.Corpus) -> None:
    for key in corpus.built:
        name = key.partition("/")[2]
        if name[0] == "T" and name[1:3].isdigit():
            shutil.rmtree(CONTROL / name, ignore_errors=True)
            shutil.copytree(corpus.base(key), CONTROL / name)


if __name__ == "__main__":
    sys.exit(main())
