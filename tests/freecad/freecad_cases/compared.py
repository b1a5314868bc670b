# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD's own BOM beside ours, on the control cases and the example: measured, and shown as a table."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from freecad_cases.machines import REPOSITORY, FreeCAD
from freecad_cases.truth import CONTROL

from silo.bom.entry import BomEntry, Extraction
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library

EXAMPLE = REPOSITORY / "examples" / "gearbox"
MEASURED = CONTROL / "freecad-bom.json"
PAGE = REPOSITORY / "docs" / "freecad-bom-compared.md"
BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"

Rows = list[list[str]]
Answers = dict[str, Rows]


def tops() -> dict[str, Path]:
    """What is compared, by name."""
    found = {path.name: path / "top.FCStd" for path in sorted(CONTROL.iterdir()) if path.is_dir()}
    return {**found, "gearbox example": EXAMPLE / "TopAssembly.FCStd"}


def ask_freecad(freecad: FreeCAD, folder: Path) -> Answers:
    """Have a FreeCAD make its own BOMs of copies of everything."""
    copies = {}
    for number, (name, top) in enumerate(tops().items()):
        copy = folder / str(number)
        shutil.copytree(top.parent, copy, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
        copies[name] = str(copy / top.name)
    out = folder / "answers.json"
    env = {
        **freecad.profile(folder / "profile"),
        "SILO_TOPS": json.dumps(copies),
        "SILO_OUT": str(out),
    }
    freecad.must_run(Path(__file__).with_name("native_bom.py"), env, cwd=folder)
    answers: Answers = json.loads(out.read_text())
    return answers


def ours(top: Path) -> Extraction:
    with Library() as library:
        return extract(choose_assembly(library.open(top)))


def our_rows(entries: Iterable[BomEntry], index: str = "") -> Iterator[list[str]]:
    """Our BOM in the same shape as FreeCAD's."""
    for number, entry in enumerate(entries, start=1):
        here = f"{index}{number}"
        name = f"{entry.label} (missing)" if entry.missing else entry.label
        yield [here, name, os.path.basename(entry.doc_path), str(entry.quantity)]
        yield from our_rows(entry.children, f"{here}.")


def same(one: Rows, two: Rows) -> bool:
    """Equal but for the order of lines."""
    return sorted(_paths(one)) == sorted(_paths(two))


def _paths(rows: Rows) -> Iterator[tuple[str, ...]]:
    names: dict[str, str] = {}
    for index, name, file, quantity in rows:
        names[index] = f"{file}:{name}"
        parents = index.split(".")
        yield (*(names[".".join(parents[:n])] for n in range(1, len(parents) + 1)), quantity)


def in_words(rows: Rows) -> str:
    """``PA 3, S1 2 (PA 2, PB 1)``."""
    below = [row for row in rows if "." not in row[0]]
    return ", ".join(_words(row, rows) for row in below) or "nothing"


def _words(row: list[str], rows: Rows) -> str:
    index, name, _, quantity = row
    depth = index.count(".") + 1
    children = [r for r in rows if r[0].startswith(f"{index}.") and r[0].count(".") == depth]
    inside = f" ({', '.join(_words(child, rows) for child in children)})" if children else ""
    return f"{name} {quantity}{inside}"


def table(measured: Mapping[str, Answers]) -> str:
    """The table of the page, in Markdown."""
    versions = sorted(measured)
    expected: dict[str, Any] = json.loads((CONTROL / "expected.json").read_text(encoding="utf-8"))
    head = ["case", *(f"FreeCAD {version}" for version in versions), "silo-mod"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for name, top in tops().items():
        found = ours(top)
        right = list(our_rows(found.entries))
        what = expected[name]["what"] if name in expected else "the assembly of the specification's §3"
        told = ", ".join(sorted({f"`{finding.code.value}`" for finding in found.findings}))
        cells = [f"**{name.split('_')[0]}** {what}"]
        for version in versions:
            rows = measured[version][name]
            cells.append(in_words(rows) if same(rows, right) else f"✗ {in_words(rows)}")
        cells.append(in_words(right) + (f"; reported: {told}" if told else ""))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def page_with(text: str, new_table: str) -> str:
    """The page with its table replaced."""
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    return f"{before}{BEGIN}\n{new_table}\n{END}{after}"
