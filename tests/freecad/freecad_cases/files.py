# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases of files: paths, broken links, cycles, damaged files."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import FreeCAD as App
from freecad_cases.bench import Bench, case


@case()
def missing_file(b: Bench) -> None:
    bolt, gone, top = b.part("bolt.FCStd"), b.part("gone.FCStd", "Gone"), b.container()
    b.link(top, bolt)
    b.link(top, gone, "Lost1")
    b.link(top, gone, "Lost2")
    b.save()
    b.close()
    (b.folder / "gone.FCStd").unlink()


@case()
def missing_file_below(b: Bench) -> None:
    """The broken link is the sub-assembly's, so that is where it is reported."""
    sub = b.sub_assembly(b.part("bolt.FCStd"), b.part("plate.FCStd", "Plate"))
    b.link(b.container(), sub)
    b.save()
    b.close()
    (b.folder / "plate.FCStd").unlink()


@case()
def target_deleted(b: Bench) -> None:
    part, top = b.part("kit.FCStd", "Bolt"), b.container()
    other = b.box(part.Document, "Plate")
    b.link(top, part, "Lost")
    b.link(top, other, "Plate")
    del part, top, other
    b.reopen("kit.FCStd").removeObject("Bolt")


@case()
def sub_object_deleted(b: Bench) -> None:
    frame_doc, bolt = b.document("frame.FCStd"), b.part("bolt.FCStd")
    frame = frame_doc.addObject("App::Part", "Frame")
    frame.newObject("Part::Box", "Inner")
    top = b.container()
    b.link(top, bolt)
    b.link(top, (frame, "Inner."), "Lost")
    del frame, frame_doc, bolt, top
    b.reopen("frame.FCStd").removeObject("Inner")


@case()
def object_cycle(b: Bench) -> None:
    """Two parts of one file that hold links to each other, beside a real component."""
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt)
    one = top.newObject("App::Part", "One")
    two = top.newObject("App::Part", "Two")
    b.link(one, two, "ToTwo")
    b.link(two, one, "ToOne")


@case()
def document_cycle(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container("top.FCStd", "Top")
    other = b.container("other.FCStd", "Other")
    b.save()
    b.link(top, other, "ToOther")
    b.link(other, top, "ToTop")
    b.link(other, bolt, "Bolt")


@case()
def awkward_names(b: Bench) -> None:
    bolt = b.part("Größe & Söhne/Schraube <M8> & 'Co' №1.FCStd", "Bolt", label='Schraube <M8> & "Co"')
    b.link(b.container("Baugruppe №2 & Rest.FCStd"), bolt, "Link")


@case()
def parent_path(b: Bench) -> None:
    bolt = b.part("parts/bolt.FCStd")
    b.link(b.container("assemblies/deep/top.FCStd"), bolt)


@case()
def symlinked_folder(b: Bench) -> None:
    """The same file by two paths gives two documents in FreeCAD; it is one part anyway."""
    (b.folder / "real").mkdir(exist_ok=True)
    link = b.folder / "linked"
    if not link.is_symlink():
        link.symlink_to("real", target_is_directory=True)
    bolt, top = b.part("real/bolt.FCStd"), b.container()
    b.link(top, bolt, "Direct")
    b.save()
    again = App.openDocument(os.fspath(b.folder / "linked" / "bolt.FCStd"))
    b.link(top, again.getObject("Bolt"), "ByLink")
    top.Document.recompute()
    top.Document.save()
    b.close()


@case()
def saved_elsewhere(b: Bench) -> None:
    """Save As into another folder keeps the old relative paths, so the next opening finds nothing."""
    bolt, plate = b.part("parts/bolt.FCStd"), b.part("parts/plate.FCStd", "Plate")
    top = b.container("top.FCStd")
    b.link(top, bolt, "Bolt")
    b.link(top, plate, "Plate")
    b.save()
    moved = b.folder / "new" / "deeper"
    moved.mkdir(parents=True, exist_ok=True)
    top.Document.saveAs(os.fspath(moved / "top.FCStd"))
    b.close()
    (b.folder / "top.FCStd").unlink()


@case()
def partial_part_document(b: Bench) -> None:
    bolt, top = b.part("kit.FCStd"), b.container()
    for number in range(3):
        b.box(bolt.Document, f"Other{number}")
    bolt.Document.Meta = {"SiloUUID": "11111111-2222-4333-8444-555555555555"}
    b.link(top, bolt)


@case()
def duplicate_labels(b: Bench) -> None:
    """FreeCAD counts labels up: the link of one part gets the label of another."""
    one = b.part("one.FCStd", "Part", label="F01-0001")
    two = b.part("two.FCStd", "Part", label="F01-0002")
    top = b.container()
    for number, target in enumerate((one, one, two)):
        b.link(top, target, f"Link{number}").Label = "F01-0001"


@case()
def two_parts_in_one_file(b: Bench) -> None:
    left, top = b.part("pair.FCStd", "Left"), b.container()
    right = b.box(left.Document, "Right")
    b.link(top, left, "LeftLink")
    b.link(top, right, "RightLink", count=2)


@case()
def expression_only(b: Bench) -> None:
    """A document that is reached by an expression alone holds no component."""
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.part("master.FCStd", "Master")
    b.link(top, bolt)
    box = b.box(top.Document, "Driven")
    b.save()
    box.setExpression("Length", "master#Master.Length")


# --- damaged files: made from good ones, after FreeCAD is done with them -----------------------------------


def _with_bad_part(b: Bench) -> Path:
    bolt, bad, top = b.part("bolt.FCStd"), b.part("bad.FCStd", "Bad"), b.container()
    b.link(top, bolt)
    b.link(top, bad, "BadLink")
    b.save()
    b.close()
    return b.folder / "bad.FCStd"


@case()
def doctype(b: Bench) -> None:
    path = _with_bad_part(b)
    with zipfile.ZipFile(path) as good:
        entries = {name: good.read(name) for name in good.namelist()}
    declared = b'<!DOCTYPE Document [<!ENTITY who SYSTEM "file:///nonexistent/secret">]>\n<Document '
    entries["Document.xml"] = entries["Document.xml"].replace(b"<Document ", declared, 1)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as bad:
        for name, data in entries.items():
            bad.writestr(name, data)


@case()
def truncated_zip(b: Bench) -> None:
    path = _with_bad_part(b)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])


@case()
def no_document_xml(b: Bench) -> None:
    path = _with_bad_part(b)
    with zipfile.ZipFile(path, "w") as bad:
        bad.writestr("Other.xml", "<Other/>")


@case()
def lfs_pointer(b: Bench) -> None:
    _with_bad_part(b).write_text(
        "version https://git-lfs.github.com/spec/v1\n"
        "oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n"
    )


@case()
def empty_file(b: Bench) -> None:
    _with_bad_part(b).write_bytes(b"")
