# SPDX-License-Identifier: LGPL-2.1-or-later
"""The files that a run writes: which of them may be written, decided before the run begins.

An output is never written over

* a file with the name of a model, whether it exists or not: a forgotten value of an option takes the next
  word, and that is the first model of ``*.FCStd``;
* a file that the same run reads, under whatever name it is found;
* another output of the same run;
* a file that is not of the output's own form, recognised by its content. A report of last night is replaced.

An empty file, a pipe and a device may be written. All problems of a run are reported together.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from silo.bom.errors import InputError
from silo.bom.message import message

# The names that CAD programs give to models; FreeCAD calls backups Part.FCStd1 and Part.1.FCBak.
_MODEL_NAME = re.compile(
    r"\.(fcstd\d*|fcbak|kc|stp|step|p21|stpz|stpx|igs|iges|brep|brp|stl|obj|ply|glb|gltf|3mf|amf|dxf|dwg"
    r"|sldprt|sldasm|slddrw|ipt|iam|idw|prt|asm|catpart|catproduct|par|psm|f3d|f3z|x_t|x_b|xmt_txt|sat|sab|jt|3dm"
    r"|ifc|blend|skp|scad)$",
    re.IGNORECASE,
)

_HEAD_BYTES = 100_000
_HEAD_ROWS = 100


@dataclass(frozen=True)
class OutputForm:
    """What an output is.

    name
        in a sentence: "a workbook".
    recognises
        returns True for an existing file of this form that silo-mod wrote.
    suffix
        an ending of a model's name that is right for this form.
    """

    name: str
    recognises: Callable[[Path], bool]
    suffix: str = ""


class Output(NamedTuple):
    """A file that an option names for writing."""

    option: str
    path: str
    form: OutputForm


def beginning(name: str, pattern: str, *, suffix: str = "") -> OutputForm:
    """Return the form of a text whose beginning has ``pattern``."""

    def recognises(path: Path) -> bool:
        head = _head(path)
        return b"\0" not in head and re.search(pattern, head.decode("utf-8-sig", "replace")) is not None

    return OutputForm(name, recognises, suffix)


def scene(name: str = "a 3D scene") -> OutputForm:
    """Return the form of a GLB that silo-mod made; others may be models of somebody."""

    def recognises(path: Path) -> bool:
        head = _head(path)
        return head.startswith(b"glTF") and b'"generator":"silo-mod"' in head[:300]

    return OutputForm(name, recognises, ".glb")


def csv_table(*headings: str) -> OutputForm:
    """Return the form of a CSV table with these headings, perhaps beside others."""

    def recognises(path: Path) -> bool:
        head = _head(path)
        if b"\0" in head:
            return False
        try:
            rows = list(csv.reader(io.StringIO(head.decode("utf-8-sig", "replace"), newline="")))
        except csv.Error:
            return False
        return _has_headings(rows, headings)

    return OutputForm(message("a CSV table"), recognises)


def workbook(*headings: str) -> OutputForm:
    """Return the form of a workbook with these headings, perhaps beside others."""

    def recognises(path: Path) -> bool:
        from silo.workbook.read import read_workbook

        if not _head(path).startswith(b"PK"):
            return False
        try:
            grids = read_workbook(path.read_bytes(), str(path))
        except (InputError, OSError):
            return False
        return any(_has_headings([row.cells for row in grid.rows()], headings) for grid in grids)

    return OutputForm(message("a workbook"), recognises)


# silo.vault.index looks closer at a database.
INDEX = OutputForm(message("an index"), lambda path: _head(path).startswith(b"SQLite format 3\0"))

# An output for which each existing file is somebody's work.
NEW = OutputForm(message("a new file"), lambda _path: False)


_JSON_OBJECT = r'^\s*\{{\s*"{first}"'

# The reports of silo-mod, by what they are of and by the ending of their names.
REPORTS = {
    "sync": {
        ".md": beginning(message("a report"), r"^# BOM sync\r?\n"),
        ".html": beginning(message("a report"), r"<title>BOM sync</title>"),
        ".json": beginning(message("a report"), _JSON_OBJECT.format(first="results")),
        ".xml": beginning(message("a report"), r'<testsuite name="silo-mod sync"'),
    },
    "bom-diff": {
        ".md": beginning(message("a report"), r"^## BOM changes\r?\n"),
        ".json": beginning(message("a report"), _JSON_OBJECT.format(first="changes")),
    },
    "mass": {
        ".html": beginning(message("a report"), r"<title>Mass properties</title>"),
        ".json": beginning(message("a report"), _JSON_OBJECT.format(first="format")),
        ".csv": beginning(message("a report"), r"^Link,Part,Part number,"),
        ".md": beginning(message("a report"), message("^# Mass properties of ")),
    },
}


def check_outputs(outputs: Iterable[Output], inputs: Sequence[str] = ()) -> None:
    """Raise InputError with all outputs that must not or cannot be written; ``inputs``: what is read."""
    problems: list[str] = []
    before: list[Output] = []
    for output in outputs:
        twin = next((other for other in before if _same(other.path, output.path)), None)
        problem = (
            _cannot_be_written(output)
            or _is_taken(output, inputs)
            or (twin and _written_twice(output, twin))
            or ""
        )
        if problem:
            problems.append(problem)
        before.append(output)
    if len(problems) == 1:
        raise InputError(problems[0])
    if problems:
        raise InputError(message("these files are not written, and nothing was done"), problems)


def check_new(option: str, path: str) -> None:
    """Raise InputError if the path is taken: each existing file there is somebody's work."""
    check_outputs([Output(option, path, NEW)])


def _written_twice(output: Output, other: Output) -> str:
    return message(
        "{path}: {other} writes this file too; give {option} a name of its own",
        option=output.option,
        path=output.path,
        other=other.option,
    )


def _cannot_be_written(output: Output) -> str:
    path = output.path
    folder = os.path.dirname(path) or "."
    if not os.path.isdir(folder):
        return message("{path} cannot be written: there is no folder {folder}", path=path, folder=folder)
    if os.path.isdir(path):
        return message("{path} cannot be written: it is a folder; name a file in it", path=path)
    if not os.access(path if os.path.exists(path) else folder, os.W_OK):
        return message("{path} cannot be written: this user has no right to change it", path=path)
    return ""


def _is_taken(output: Output, inputs: Sequence[str]) -> str:
    option, path, form = output
    for name in (path, os.path.realpath(path)):  # a link may lead to a model
        if (ending := _MODEL_NAME.search(name)) and ending[0].lower() != form.suffix:
            return message(
                "{option} takes the name of the file to write, {form}, and {path} is the name of a model; "
                "give {option} a name of its own",
                option=option,
                form=form.name,
                path=path,
            )
    if any(_same(path, read) for read in inputs):
        return message(
            "{path} is read by this command; {option} needs another file", path=path, option=option
        )
    if not os.path.exists(path) or (os.path.isfile(path) and not os.path.getsize(path)):
        return ""
    if form is NEW:
        return message("{path} is there already, and may hold edits; name another file", path=path)
    if not os.path.isfile(path):  # a terminal, a pipe
        return ""
    try:
        own = form.recognises(Path(path))
    except OSError:
        own = False
    if own:
        return ""
    return message(
        "{path} is there already, and is not {form} that this command writes; remove it, or give {option} "
        "another name",
        path=path,
        form=form.name,
        option=option,
    )


def _same(one: str, other: str) -> bool:
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False


def _head(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(_HEAD_BYTES)


def _has_headings(rows: Sequence[Sequence[str]], headings: Sequence[str]) -> bool:
    return any(set(headings) <= set(row) for row in rows[:_HEAD_ROWS])
