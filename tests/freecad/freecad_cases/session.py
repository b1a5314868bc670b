# SPDX-License-Identifier: LGPL-2.1-or-later
"""A person's session, played inside FreeCAD: open, edit, close, and what the walker says at each step.

``SILO_CASES`` names an unpacked corpus of FreeCAD 0.20, ``SILO_OUT`` the file for the answers (JSON).
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import zipfile
from pathlib import Path
from typing import Any

sys.dont_write_bytecode = True
sys.path.insert(0, os.environ["SILO_MODS"])

import FreeCAD as App  # noqa: E402

from silo.bom.entry import Extraction  # noqa: E402
from silo.bom.errors import SiloError  # noqa: E402
from silo.bom.walk.links import extract  # noqa: E402
from silo.bom.walk.roots import choose_assembly  # noqa: E402
from silo.fcstd import Library  # noqa: E402
from silo.workbench.freecad import host, live, saving  # noqa: E402
from silo.workbench.freecad.opening import open_fully  # noqa: E402

CASES = Path(os.environ["SILO_CASES"]) / "asm4"


def told(found: Extraction) -> dict[str, Any]:
    return {
        "bom": {entry.object_name: entry.quantity for entry in found.entries},
        "findings": [finding.code.value for finding in found.findings],
        "blocked": found.blocked,
    }


def add_bolt(doc: Any, bolt: Any, name: str) -> None:
    doc.getObject("Top").newObject("App::Link", name).LinkedObject = bolt


def unsaved_edits() -> dict[str, Any]:
    doc = open_fully(str(CASES / "plain_link" / "top.FCStd"))
    add_bolt(doc, doc.getObject("Link").LinkedObject, "Second")
    return told(live.extract_live(doc))


def found_open_by_another_path() -> dict[str, Any]:
    folder = CASES / "array_of_one"
    doc = open_fully(str(folder / "top.FCStd"))
    add_bolt(doc, doc.getObject("Row").LinkedObject, "Second")
    other = folder.parent / "by_another_path"
    other.symlink_to(folder, target_is_directory=True)
    answer = told(live.read(str(other / "top.FCStd")))
    return {**answer, "documents": len(host.documents())}


def broken_document_is_not_reloaded() -> dict[str, Any]:
    path = str(CASES / "missing_file" / "top.FCStd")
    doc = open_fully(path)
    add_bolt(doc, doc.getObject("Link").LinkedObject, "Second")
    return told(live.read(path))


def part_document_is_completed() -> dict[str, Any]:
    top = open_fully(str(CASES / "partial_part_document" / "top.FCStd"))
    path = str(CASES / "partial_part_document" / "kit.FCStd")
    before = host.find_document(path)
    partial, objects = host.is_partial(before), len(before.Objects)
    after = open_fully(path)
    return {
        "partial": [partial, host.is_partial(after)],
        "more objects": len(after.Objects) > objects,
        "active": App.ActiveDocument.Name == top.Name,
        **told(live.extract_live(top)),
    }


def closed_part() -> dict[str, Any]:
    doc = open_fully(str(CASES / "plain_link" / "top.FCStd"))
    App.closeDocument(doc.getObject("Link").LinkedObject.Document.Name)
    found = live.extract_live(doc)
    return {**told(found), "message": found.findings[0].message}


def unsaved_document() -> dict[str, Any]:
    doc = App.newDocument("Never saved")
    doc.addObject("App::Part", "Top").Type = "Assembly"
    return told(live.extract_live(doc))


def hostile_file() -> str:
    try:
        live.read_checked(str(CASES / "doctype" / "bad.FCStd"))
    except SiloError as error:
        return str(error)
    return "opened"


def broken_file() -> str:
    try:
        live.read_checked(str(CASES / "truncated_zip" / "bad.FCStd"))
    except SiloError as error:
        return str(error)
    return "opened"


def _cut_behind_xml(path: Path) -> None:
    """A copy that broke off: FreeCAD reads from the beginning, and finds all but the shapes."""
    with zipfile.ZipFile(path) as whole:
        end = whole.infolist()[1].header_offset
    path.write_bytes(path.read_bytes()[:end])


def _without_directory(path: Path) -> None:
    with zipfile.ZipFile(path) as whole:
        end = whole.start_dir
    path.write_bytes(path.read_bytes()[: end + 20])


def _one_bit(path: Path) -> None:
    with zipfile.ZipFile(path) as whole:
        first, second = whole.infolist()[:2]
    content = bytearray(path.read_bytes())
    content[(first.header_offset + 3 * second.header_offset) // 4] ^= 0x10
    path.write_bytes(bytes(content))


def _short_xml(path: Path) -> None:
    with zipfile.ZipFile(path) as whole:
        entries = {name: whole.read(name) for name in whole.namelist()}
    text = entries["Document.xml"]
    entries["Document.xml"] = text[: text.rindex(b"<Object name=")]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as short:
        for name, content in entries.items():
            short.writestr(name, content)


def _from_file(path: Path) -> dict[str, Any]:
    try:
        return told(extract(choose_assembly(Library().open(path))))
    except SiloError as error:
        return {"refused": str(error).partition(": ")[2]}


def damaged_files() -> list[dict[str, Any]]:
    """Each damage of the part, then of the assembly: what FreeCAD's objects and the file's say."""
    answers = []
    for damage in (_cut_behind_xml, _without_directory, _one_bit, _short_xml):
        for name in ("bolt.FCStd", "top.FCStd"):
            folder = CASES / f"damaged_{damage.__name__}_{name}"
            shutil.copytree(CASES / "plain_link", folder)
            damage(folder / name)
            before = (folder / name).read_bytes()
            answer: dict[str, Any] = {"damage": damage.__name__, "file": name, "from file": None}
            answer["from file"] = _from_file(folder / "top.FCStd")
            try:
                doc = open_fully(str(folder / "top.FCStd"))
                found = live.extract_live(doc)
                answer["live"] = told(found)
                answer["messages"] = [finding.message for finding in found.findings]
                damaged = doc if name == "top.FCStd" else open_fully(str(folder / name))
                saving.save(damaged)
            except SiloError as error:
                answer["refused"] = str(error)
            answer["unchanged"] = (folder / name).read_bytes() == before
            answers.append(answer)
            host.close_all()
    return answers


def lost_original() -> dict[str, Any]:
    folder = CASES / "copy_on_change"
    (folder / "bolt.FCStd").unlink()
    found = live.extract_live(open_fully(str(folder / "top.FCStd")))
    return {**told(found), "message": found.findings[0].message}


def main() -> None:
    answers = {}
    for step in (
        unsaved_edits,
        found_open_by_another_path,
        broken_document_is_not_reloaded,
        part_document_is_completed,
        closed_part,
        unsaved_document,
        lost_original,
        hostile_file,
        broken_file,
        damaged_files,
    ):
        answers[step.__name__] = step()
        host.close_all()
    Path(os.environ["SILO_OUT"]).write_text(json.dumps(answers))


if __name__ == "__main__":
    main()
