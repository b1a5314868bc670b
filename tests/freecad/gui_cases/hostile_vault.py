# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writes documents that are made to harm whoever shows them.

An assembly of thousands of links, and parts with markup, line ends, turned text and endless words in labels
and file names, with properties of wrong types, in broken files, above each other in a ring.

They are written byte by byte, as somebody with bad intentions would; FreeCAD itself refuses some of this.
"""

from __future__ import annotations

import re
from itertools import cycle, islice
from pathlib import Path
from typing import Any

from fcstd_writer import Doc, Local, Raw, XLink, container, locals_, part

from silo.api.client import SiloClient

MARKUP = '<b>bold</b><img src="http://127.0.0.1:9/x.png"><a href="http://127.0.0.1:9/">here</a>'
LABELS = {
    "Markup": MARKUP,
    "Lines": "first\nsecond\r\nthird\ttab\u2028end",
    "Turned": "\u202egnp.exe\u202c\u2066inner\u2069\ufeff",
    "Endless": "M8x20" * 20_000,
    "Braces": "{n} {name} {number} %s %n %1 &amp; &File [*]",
    "Rich": "[bold red]rich[/bold red] \\[x]",
}
FILES = ('<i>Bolt<br> & "co"\'s', "\u202etxt.tloB", "two\nlines", "w" * 200)
MANY, DEEP = 150, 14
# Those that are items of the server: the many, the two copies of one, and the deep assembly.
REGISTERED = MANY + 2


WRONG: tuple[dict[str, Any], ...] = (
    {"SiloItemId": 7, "SiloBomExclude": 0},
    {"SiloItemId": Raw("App::PropertyStringList", '<StringList count="1"><String value="a"/></StringList>')},
    {"SiloItemId": "../../items?x=1#<b>", "SiloBomExclude": "no"},
    {"SiloItemId": "f" * 100_000},
    {"SiloUUID": float("nan"), "Suppressed": float("inf")},
    {"SiloUUID": True, "Type": False},
    {"SiloItemId": Local("Box"), "SiloUUID": Local("Nobody")},
)


def write(folder: Path, client: SiloClient, links: int) -> None:
    """The vault, with ``Top.FCStd``; some of its parts, and the top itself, are items of the server."""

    def item(name: str, kind: str = "part") -> str:
        category = "A01" if kind == "assembly" else "M01"
        return str(client.create_item("kindred-rd", category, name, item_type=kind).id)

    deep = [item(f"<i>Deep</i> {level}", "assembly") for level in range(DEEP)]
    targets = [*_strange(folder), *_wrong(folder), *_broken(folder), *_rings(folder), _deep(folder, deep)]
    one_identity = item("Copied")
    for name in ("Copied", "Copied2"):
        targets.append(_save(part(name, uuid=one_identity), folder / f"{name}.FCStd"))
    half = part("Half").add("Part::Cylinder", "Other")
    targets.append(_save(half, folder / "Half.FCStd"))
    for number in range(MANY):
        made = part(f"<h1>Many {number}</h1>", uuid=item(f"<h1>Many</h1> {number}"))
        targets += [_save(made, folder / f"Many{number}.FCStd")] * 2
    _top(folder, targets, links, item("Top <script>alert(1)</script>", "assembly"))


Target = tuple[str, str]


def _save(doc: Doc, path: Path) -> Target:
    path.parent.mkdir(parents=True, exist_ok=True)
    # Only with a group does FreeCAD read a property that its type does not have.
    mine = re.compile(r'(<Property name="(?:Silo\w+|Suppressed)" [^>]*)>')
    xml = mine.sub(r'\1 group="Silo" doc="" attr="0" ro="0" hide="0">', doc.xml())
    path.write_bytes(container({"Document.xml": xml.encode(), **doc.entries}))
    return path.name, next(iter(doc.objects))


def _strange(folder: Path) -> list[Target]:
    found = [_save(part(label, Label=label), folder / f"{name}.FCStd") for name, label in LABELS.items()]
    return found + [_save(part(name), folder / f"{name}.FCStd") for name in FILES]


def _wrong(folder: Path) -> list[Target]:
    return [
        _save(part(f"Wrong{number}", uuid="<u>" * 3, **values), folder / f"Wrong{number}.FCStd")
        for number, values in enumerate(WRONG)
    ]


def _broken(folder: Path) -> list[Target]:
    """Files that are not there, or are something else, and objects that are not in theirs."""
    (folder / "Pointer.FCStd").write_text(
        "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"
    )
    (folder / "Half-way.FCStd").write_bytes(part("Half-way").bytes()[:200])
    # No XML may hold this character, so FreeCAD cannot read what it wrote itself.
    (folder / "Escape.FCStd").write_bytes(part("\x1b[31mred\x1b[0m\x07").bytes())
    missing = [(f"no<b>where</b>/\u202eGone{number}.FCStd", "Box") for number in range(30)]
    named = [(name, "Box") for name in ("Pointer.FCStd", "Half-way.FCStd", "Escape.FCStd")]
    return [*missing, *named, ("Many0.FCStd", "Nobody"), ("Many1.FCStd", "\u202e<b>Nobody</b>")]


def _rings(folder: Path) -> list[Target]:
    """Two assemblies, each in the other."""
    for mine, other in (("RingA", "RingB"), ("RingB", "RingA")):
        _save(_assembly(mine, [(f"{other}.FCStd", "Assembly")]), folder / f"{mine}.FCStd")
    return [("RingA.FCStd", "Assembly")]


def _deep(folder: Path, ids: list[str]) -> Target:
    """Each level holds the next one twice: few files, very many occurrences."""
    below = _save(part("Leaf"), folder / "Leaf.FCStd")
    for level, identity in enumerate(ids):
        doc = _assembly(f"<i>Deep</i> {level}", [below, below], uuid=identity, hidden=True)
        below = _save(doc, folder / f"Deep{level}.FCStd")
    return below


def _assembly(label: str, targets: list[Target], *, uuid: str = "", hidden: bool = False) -> Doc:
    names = [f"L{number}" for number in range(len(targets))]
    doc = Doc(label, meta={"SiloUUID": uuid} if uuid else {})
    doc.add("App::Part", "Assembly", Type="Assembly", Label=label, Group=locals_(*names))
    for name, (file, target) in zip(names, targets, strict=True):
        doc.link(name, file, target, Visibility=not hidden)
    return doc


def _top(folder: Path, targets: list[Target], links: int, uuid: str) -> None:
    doc = _assembly(MARKUP + LABELS["Lines"], list(islice(cycle(targets), links)), uuid=uuid)
    doc.objects["L1"][1]["Label"] = LABELS["Endless"]
    doc.objects["L2"][1]["SiloBomExclude"] = "<b>maybe</b>"
    doc.objects["L3"][1]["Suppressed"] = "\u202eyes"
    for number in range(5, links, 400):
        values = doc.objects[f"L{number}"][1]
        values["ElementCount"] = Raw("App::PropertyIntegerConstraint", '<Integer value="3"/>')
        values["ShowElement"] = False
    for number in range(7, links, 50):
        doc.objects[f"L{number}"][1]["LinkedObject"] = XLink("", "")
    # In groups: for ten thousand links that lie in the assembly itself, FreeCAD's window needs minutes.
    groups = []
    names = doc.objects["Assembly"][1]["Group"].names
    for begin in range(0, links, 100):
        groups.append(f"G{begin}")
        doc.add("App::LinkGroup", groups[-1], Label="<li>", ElementList=locals_(*names[begin : begin + 100]))
    doc.objects["Assembly"][1]["Group"] = locals_(*groups)
    _save(doc, folder / "Top.FCStd")
