# SPDX-License-Identifier: LGPL-2.1-or-later
"""Write the committed fixtures again, with every FreeCAD of this machine::

    .venv/bin/python tests/freecad/regenerate.py

``tests/data/freecad/corpus-<version>.zip`` per FreeCAD, and the control cases as plain files in
``tests/data/control``, built by FreeCAD 1.0; what FreeCAD's own BOM answers on
these, and the page that shows it.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from freecad_cases import compared, corpora, machines
from freecad_cases.truth import CONTROL

CONTROL_BUILDER = "1.0"


def main() -> int:
    found = machines.freecads()
    if missing := [version for version in machines.WANTED if version not in found]:
        print(f"not written again, for want of FreeCAD {', '.join(missing)}", file=sys.stderr)
    corpora.ARCHIVES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        for version, freecad in found.items():
            corpus = corpora.build(freecad, Path(temporary) / version)
            archive = corpora.ARCHIVES / f"corpus-{version}.zip"
            corpora.pack(corpus.folder, archive)
            print(f"{archive}: {len(corpus.built)} cases, {archive.stat().st_size // 1024} KB")
            if version == CONTROL_BUILDER:
                write_control(corpus)
        newer = {version: freecad for version, freecad in found.items() if freecad.version >= (1, 0)}
        measured = {}
        for version, freecad in newer.items():
            folder = Path(temporary) / f"own-bom-{version}"
            folder.mkdir()
            measured[version] = compared.ask_freecad(freecad, folder)
        write_comparison(measured)
    return 1 if missing else 0


def write_comparison(measured: dict[str, compared.Answers]) -> None:
    lines = json.dumps(measured, indent=1, ensure_ascii=False, sort_keys=True)
    compared.MEASURED.write_text(lines + "\n", encoding="utf-8")
    page = compared.PAGE.read_text(encoding="utf-8")
    compared.PAGE.write_text(compared.page_with(page, compared.table(measured)), encoding="utf-8")


def write_control(corpus: corpora.Corpus) -> None:
    for key in corpus.built:
        name = key.partition("/")[2]
        if name[0] == "T" and name[1:3].isdigit():
            shutil.rmtree(CONTROL / name, ignore_errors=True)
            shutil.copytree(corpus.base(key), CONTROL / name)


if __name__ == "__main__":
    sys.exit(main())
