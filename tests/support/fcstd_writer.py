# SPDX-License-Identifier: LGPL-2.1-or-later
"""A small writer of FCStd files in FreeCAD's own layout, for tests and the benchmark.

``Doc("top").add("App::Link", "L1", LinkedObject=XLink("part.FCStd", "Box")).save(folder / "top.FCStd")``
"""

from __future__ import annotations

import io
import struct
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self
from xml.sax.saxutils import escape

_MORE = {'"': "&quot;", "'": "&apos;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
COMMENT = b"FreeCAD Document"


def text(value: str) -> str:
    """An attribute value as FreeCAD escapes it."""
    return escape(value, _MORE)


@dataclass(frozen=True)
class XLink:
    """A link to an object of another file ("": of the same)."""

    file: str
    name: str
    subs: tuple[str, ...] = ()
    stamp: str = "2026-11-21T05:43:38Z"


@dataclass(frozen=True)
class Local:
    """A link to an object of the same document."""

    name: str


@dataclass(frozen=True)
class Locals:
    """A list of links to objects of the same document."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class Vector:
    """A vector property."""

    x: float = 1.0
    y: float = 1.0
    z: float = 1.0


@dataclass(frozen=True)
class Raw:
    """A property of any other kind: its type, and the XML of its value."""

    kind: str
    xml: str


def locals_(*names: str) -> Locals:
    """The members of a group."""
    return Locals(names)


def _xlink(link: XLink) -> str:
    head = (
        f'<XLink file="{text(link.file)}" stamp="{link.stamp if link.file else ""}" name="{text(link.name)}"'
    )
    if not link.subs:
        return head + "/>"
    if len(link.subs) == 1:
        return f'{head} sub="{text(link.subs[0])}"/>'
    subs = "".join(f'\n                        <Sub value="{text(sub)}"/>' for sub in link.subs)
    return f'{head} count="{len(link.subs)}">{subs}\n                    </XLink>'


def _list(tag: str, attribute: str, lines: list[str]) -> str:
    inner = "".join(f"\n                        {line}" for line in lines)
    return f'<{tag} {attribute}="{len(lines)}">{inner}\n                    </{tag}>'


def value_xml(value: Any) -> tuple[str, str]:
    """Type and XML of a property value."""
    if isinstance(value, Raw):
        return value.kind, value.xml
    if isinstance(value, bool):
        return "App::PropertyBool", f'<Bool value="{str(value).lower()}"/>'
    if isinstance(value, int):
        return "App::PropertyInteger", f'<Integer value="{value}"/>'
    if isinstance(value, float):
        return "App::PropertyFloat", f'<Float value="{value:.16f}"/>'
    if isinstance(value, str):
        return "App::PropertyString", f'<String value="{text(value)}"/>'
    if isinstance(value, XLink):
        return "App::PropertyXLink", _xlink(value)
    if isinstance(value, Local):
        return "App::PropertyLink", f'<Link value="{text(value.name)}"/>'
    if isinstance(value, Locals):
        lines = [f'<Link value="{text(name)}"/>' for name in value.names]
        return "App::PropertyLinkList", _list("LinkList", "count", lines)
    if isinstance(value, Vector):
        axes = f'valueX="{value.x:.16f}" valueY="{value.y:.16f}" valueZ="{value.z:.16f}"'
        return "App::PropertyVector", f"<PropertyVector {axes}/>"
    if isinstance(value, dict):
        lines = [f'<Item key="{text(k)}" value="{text(v)}"/>' for k, v in sorted(value.items())]
        return "App::PropertyMap", _list("Map", "count", lines)
    raise TypeError(f"no property of {value!r}")


def property_xml(name: str, value: Any, indent: str) -> str:
    """A ``<Property>`` element."""
    kind, xml = value_xml(value)
    opening = f'{indent}    <Property name="{name}" type="{kind}" status="256">'
    return f"{opening}\n{indent}        {xml}\n{indent}    </Property>\n"


def properties_xml(values: dict[str, Any], indent: str, transient: tuple[str, ...] = ()) -> str:
    """A ``<Properties>`` element, in the order of the names as FreeCAD's map has it."""
    hidden = "".join(
        f'{indent}    <_Property name="{name}" type="App::PropertyString" status="50331649"/>\n'
        for name in transient
    )
    shown = "".join(property_xml(name, values[name], indent) for name in sorted(values))
    count = f'Count="{len(values)}" TransientCount="{len(transient)}"'
    return f"{indent}<Properties {count}>\n{hidden}{shown}{indent}</Properties>\n"


@dataclass
class Doc:
    """A document in the making."""

    label: str = "doc"
    program: str = "1.0R39319 (Git)"
    meta: dict[str, str] | None = field(default_factory=dict)
    extra: dict[str, Any] = field(default_factory=dict)
    dependencies: bool = True
    objects: dict[str, tuple[str, dict[str, Any]]] = field(default_factory=dict)
    entries: dict[str, bytes] = field(default_factory=dict)

    def add(self, kind: str, name: str, **values: Any) -> Self:
        """One more object."""
        self.objects[name] = (kind, {"Label": name, "Visibility": True, **values})
        return self

    def link(self, name: str, file: str, target: str, **values: Any) -> Self:
        """An ``App::Link`` with the properties that FreeCAD gives it."""
        unset = XLink("", "")
        usual = {
            "ElementCount": 0,
            "ElementList": locals_(),
            "LinkCopyOnChange": Raw("App::PropertyEnumeration", '<Integer value="0"/>'),
            "LinkCopyOnChangeSource": unset,
            "LinkedObject": XLink(file, target),
            "Scale": 1.0,
            "ScaleList": self.vectors(f"ScaleList{len(self.entries) or ''}", []),
            "ScaleVector": Vector(),
        }
        own = {**usual, **values}
        if isinstance(own["ElementCount"], int):
            count = f'<Integer value="{own["ElementCount"]}"/>'
            own["ElementCount"] = Raw("App::PropertyIntegerConstraint", count)
        return self.add("App::Link", name, **own)

    def shape(self, name: str, body: str, place: str = "") -> Raw:
        """A shape's entry as FreeCAD writes it: the places, the ``body``, and the place of the whole."""
        head = f"\nCASCADE Topology V1, (c) Matra-Datavision\nLocations {int(bool(place))}\n{place}"
        self.entries[f"{name}.brp"] = f"{head}Curve2ds 0\n{body}\n\n+1 {int(bool(place))} ".encode()
        return Raw("Part::PropertyPartShape", f'<Part file="{name}.brp"/>')

    def vectors(self, entry: str, vectors: list[tuple[float, float, float]]) -> Raw:
        """A vector list, which FreeCAD keeps in an entry of its own."""
        numbers = b"".join(struct.pack("<3d", *vector) for vector in vectors)
        self.entries[entry] = struct.pack("<I", len(vectors)) + numbers
        return Raw("App::PropertyVectorList", f'<VectorList file="{entry}"/>')

    def xml(self) -> str:
        """The text of Document.xml."""
        own: dict[str, Any] = {"Label": self.label, "Uid": _uuid(), "Comment": "", **self.extra}
        own.setdefault("LastModifiedDate", "2026-11-21T05:43:38Z")
        if self.meta is not None:
            own["Meta"] = self.meta
        deps = "".join(f'        <ObjectDeps Name="{name}" Count="0"/>\n' for name in self.objects)
        listed = "".join(
            f'        <Object type="{kind}" name="{name}" id="{1000 + i}" />\n'
            for i, (name, (kind, _)) in enumerate(self.objects.items())
        )
        data = "".join(
            f'        <Object name="{name}">\n{properties_xml(values, " " * 12)}        </Object>\n'
            for name, (_, values) in self.objects.items()
        )
        count = len(self.objects)
        dependencies = ' Dependencies="1"' if self.dependencies else ""
        return (
            "<?xml version='1.0' encoding='utf-8'?>\n"
            "<!--\n FreeCAD Document, see https://www.freecad.org for more information...\n-->\n"
            f'<Document SchemaVersion="4" ProgramVersion="{self.program}" FileVersion="1">\n'
            f"{properties_xml(own, '    ', ('FileName', 'Tip', 'TransientDir'))}"
            f'    <Objects Count="{count}"{dependencies}>\n'
            f"{deps if self.dependencies else ''}{listed}    </Objects>\n"
            f'    <ObjectData Count="{count}">\n{data}    </ObjectData>\n'
            "</Document>\n"
        )

    def bytes(self) -> bytes:
        """The container."""
        return container({"Document.xml": self.xml().encode(), **self.entries})

    def save(self, path: Path) -> Path:
        """Write the file, with its folders."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.bytes())
        return path


def _uuid() -> Raw:
    return Raw("App::PropertyUUID", '<Uuid value="3a4cb85d-6224-4a3f-bde2-ab5c5ce51855"/>')


def container(entries: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A zip container with FreeCAD's comment."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", method) as file:
        for name, content in entries.items():
            file.writestr(zipfile.ZipInfo(name, (2026, 11, 21, 5, 43, 38)), content, method)
        file.comment = COMMENT
    return target.getvalue()


def part(label: str = "part", name: str = "Box", *, uuid: str | None = None, **values: Any) -> Doc:
    """A document with one box."""
    doc = Doc(label, meta={} if uuid is None else {"SiloUUID": uuid})
    return doc.add("Part::Box", name, Height=10.0, **values)


def save_xml(path: Path, xml: str | bytes, **entries: bytes) -> Path:
    """A container around any text."""
    content = xml.encode() if isinstance(xml, str) else xml
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(container({"Document.xml": content, **entries}))
    return path
