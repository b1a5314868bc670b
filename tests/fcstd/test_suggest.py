# SPDX-License-Identifier: LGPL-2.1-or-later
"""Did you mean: which file a broken link meant, and when nobody can tell."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from fcstd_writer import Doc, XLink, locals_

from silo.bom.walk.links import extract
from silo.fcstd import open_document
from silo.fcstd.suggest import with_suggestions


def part(*names: str, **properties: Any) -> Doc:
    doc = Doc(**properties)
    for name in names:
        doc.add("Part::Box", name)
    return doc


def top_of(folder: Path, *links: tuple[str, str]) -> Path:
    doc = Doc()
    for number, (file, name) in enumerate(links):
        doc.add("App::Link", f"L{number}", LinkedObject=XLink(file, name))
    doc.add("App::Part", "A", Group=locals_(*(f"L{number}" for number in range(len(links)))))
    return doc.save(folder / "top.FCStd")


def meant(top: Path, identities: dict[tuple[str, str], str] | None = None) -> list[str]:
    found = with_suggestions(extract(open_document(top).getObject("A")), identities)
    told = [f.did_you_mean for f in found.findings if f.file]
    return [os.path.relpath(path, top.parent) if path else "" for path in told]


def save(doc: Doc, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    doc.save(path)


def test_a_file_of_the_same_name_in_another_folder(tmp_path: Path) -> None:
    """Also where case and normalisation differ; it must hold all that is wanted."""
    save(part("Bolt", "Nut"), tmp_path / "deep/er/SCREWS.fcstd")
    save(part("Bolt"), tmp_path / "elsewhere/screws.FCStd")
    top = top_of(tmp_path, ("parts/Screws.FCStd", "Bolt"), ("parts/Screws.FCStd", "Nut"))
    assert meant(top) == ["deep/er/SCREWS.fcstd"]


def test_a_file_with_another_name_is_not_guessed(tmp_path: Path) -> None:
    """Every part of a project may hold a Body; two files of the name are a question as well."""
    save(part("Body"), tmp_path / "other.FCStd")
    top = top_of(tmp_path, ("gone.FCStd", "Body"), ("other.FCStd", "Body"))
    assert meant(top) == [""]
    save(part("Body"), tmp_path / "x/gone.FCStd")
    assert meant(top) == ["x/gone.FCStd"]
    save(part("Body"), tmp_path / "y/gone.FCStd")
    assert meant(top) == [""]


def test_the_identity_of_the_last_sync_goes_before_all(tmp_path: Path) -> None:
    """What the server knows the component by stands in the file, wherever it lies now."""
    doc = part("Body")
    doc.meta = {"SiloUUID": "11111111-2222-4333-8444-555555555555"}
    save(doc, tmp_path / "renamed.FCStd")
    save(part("Body"), tmp_path / "old/gone.FCStd")
    top = top_of(tmp_path, ("gone.FCStd", "Body"))
    known = {(str(tmp_path / "gone.FCStd"), "Body"): "11111111-2222-4333-8444-555555555555"}
    assert meant(top) == ["old/gone.FCStd"]
    assert meant(top, known) == ["renamed.FCStd"]


def test_damaged_files_of_the_project_are_passed_over(tmp_path: Path) -> None:
    """They are no answer, and no error either."""
    (tmp_path / "gone2.FCStd").write_bytes(b"no zip")
    save(part("Bolt"), tmp_path / "x/gone.FCStd")
    assert meant(top_of(tmp_path, ("gone.FCStd", "Bolt"))) == ["x/gone.FCStd"]
