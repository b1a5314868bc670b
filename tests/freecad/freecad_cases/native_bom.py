# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD's own assembly BOM answers; runs inside FreeCAD 1.0 or newer.

``SILO_TOPS`` is a JSON object name → file (nothing is saved), ``SILO_OUT`` the
file for the answers: name → rows of (index, name, file, quantity), with all levels of detail switched on.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import FreeCAD as App

COLUMNS = ("Index", "Name", "File Name", "Quantity")


def native_bom(path: Path) -> list[list[str]]:
    doc = App.openDocument(str(path), True)
    assembly = next(obj for obj in doc.Objects if obj.isDerivedFrom("Assembly::AssemblyObject"))
    bom = assembly.newObject("Assembly::BomGroup", "Boms").newObject("Assembly::BomObject", "Bom")
    bom.columnsNames = list(COLUMNS)
    bom.detailSubAssemblies, bom.detailParts, bom.onlyParts = True, True, False
    bom.recompute()
    return rows(bom)


def rows(sheet: Any) -> list[list[str]]:
    found = []
    for number in range(2, 100):
        cells = [sheet.getContents(f"{column}{number}").lstrip("'") for column in "ABCD"]
        if not any(cells):
            break
        # The file's folder is this machine's.
        cells[2] = Path(cells[2]).name
        found.append(cells)
    return found


def close_all() -> None:
    for name in list(App.listDocuments()):
        if name in App.listDocuments():
            App.closeDocument(name)


def main() -> None:
    answers = {}
    for name, path in json.loads(os.environ["SILO_TOPS"]).items():
        answers[name] = native_bom(Path(path))
        close_all()
    Path(os.environ["SILO_OUT"]).write_text(json.dumps(answers))


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    main()
