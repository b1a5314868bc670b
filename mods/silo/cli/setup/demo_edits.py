# SPDX-License-Identifier: LGPL-2.1-or-later
"""The designer's edits of the demo, in the files as FreeCAD would have saved them.

Only for files that this project wrote itself: it knows which of their objects belong together.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.platform.whole_files import replace_patiently

DOCUMENT_XML = "Document.xml"


def remove_from_assembly(path: Path, label: str) -> None:
    """Delete the link with this label from the file, as the Delete key in the tree does."""

    def edit(document: ElementTree.Element) -> None:
        name = _object_with_label(path, document, label)
        for members in document.iter("LinkList"):
            for member in [m for m in members if m.get("value") == name]:
                members.remove(member)
            members.set("count", str(len(members)))
        for part in ("Objects", "ObjectData"):
            listed = _only(path, document.find(part), part)
            for obj in [o for o in listed if (o.get("name") or o.get("Name")) == name]:
                listed.remove(obj)
            listed.set("Count", str(len(listed.findall("Object"))))

    _edit(path, edit)


def set_element_count(path: Path, label: str, added: int) -> tuple[int, int]:
    """Add elements to a link array; returns the count before and after."""
    counts: list[int] = []

    def edit(document: ElementTree.Element) -> None:
        name = _object_with_label(path, document, label)
        data = document.find(f"ObjectData/Object[@name='{name}']")
        value = _only(path, data, name).find(".//Property[@name='ElementCount']/Integer")
        number = _only(path, value, "ElementCount")
        counts.append(int(number.get("value", "0")))
        number.set("value", str(counts[0] + added))

    _edit(path, edit)
    return counts[0], counts[0] + added


def _object_with_label(path: Path, document: ElementTree.Element, label: str) -> str:
    for obj in document.iterfind("ObjectData/Object"):
        text = obj.find("Properties/Property[@name='Label']/String")
        if text is not None and text.get("value") == label:
            return obj.get("name", "")
    raise DocumentError(str(path), message("it holds no object labelled {label}", label=repr(label)))


def _only(path: Path, element: ElementTree.Element | None, what: str) -> ElementTree.Element:
    if element is None:
        raise DocumentError(str(path), message("it holds no {what}", what=what))
    return element


def _edit(path: Path, edit: Callable[[ElementTree.Element], None]) -> None:
    with zipfile.ZipFile(path) as archive:
        entries = {info: archive.read(info) for info in archive.infolist()}
        comment = archive.comment
    new = path.with_suffix(".new")
    with zipfile.ZipFile(new, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.comment = comment
        for info, content in entries.items():
            if info.filename == DOCUMENT_XML:
                document = ElementTree.fromstring(content)  # noqa: S314 - a file of our own example
                edit(document)
                content = ElementTree.tostring(document, encoding="utf-8", xml_declaration=True)
            archive.writestr(info, content)
    replace_patiently(new, path)
