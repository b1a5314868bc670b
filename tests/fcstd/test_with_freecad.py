# SPDX-License-Identifier: LGPL-2.1-or-later
"""Against an installed FreeCAD (``freecadcmd`` of the PATH, or SILO_FREECADCMD).

It reads what we write, and we see in its files what it sees itself.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, locals_, part

from silo.fcstd import FcstdObject, Library, open_document, stamp
from silo.fcstd.type_tree import PARENTS, ancestors

FREECADCMD = os.environ.get("SILO_FREECADCMD") or shutil.which("freecadcmd") or shutil.which("FreeCADCmd")

pytestmark = [
    pytest.mark.freecad,
    pytest.mark.skipif(FREECADCMD is None, reason="no freecadcmd in the PATH and no SILO_FREECADCMD"),
]

Run = Callable[..., Any]

# FreeCAD prints its progress among everything else, so answers go through a file (facts §7.4).
PRELUDE = """
import json, os
import FreeCAD as App
args = json.loads(os.environ["SILO_ARGS"])
def answer(value):
    with open(args["answer"], "w") as file:
        json.dump(value, file)
"""


@pytest.fixture
def freecad(tmp_path: Path) -> Run:
    """Run a script in FreeCAD; gives what the script answers."""
    home = tmp_path / "freecad-home"
    home.mkdir()

    def run(script: str, **args: Any) -> Any:
        code, reply = tmp_path / "script.py", tmp_path / "answer.json"
        code.write_text(PRELUDE + script)
        environment = {
            **os.environ,
            "FREECAD_USER_HOME": str(home),
            "SILO_ARGS": json.dumps({**args, "answer": str(reply)}),
        }
        command = f"import runpy; runpy.run_path({str(code)!r}, run_name='__main__')"
        done = subprocess.run(
            [str(FREECADCMD), "-c", command],
            env=environment,
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(reply.read_text())

    return run


BUILD = """
folder = args["folder"]
os.makedirs(folder + "/parts")
d = App.newDocument("part")
box = d.addObject("Part::Box", "Box")
other = d.addObject("Part::Cylinder", "Cylinder")
d.recompute()
d.saveAs(folder + "/parts/Teil & <1> ü.FCStd")
t = App.newDocument("top")
t.saveAs(folder + "/top.FCStd")
part = t.addObject("App::Part", "Assembly")
one = t.addObject("App::Link", "One"); one.LinkedObject = box
chain = t.addObject("App::Link", "Chain"); chain.LinkedObject = one
face = t.addObject("App::Link", "Face"); face.LinkedObject = (box, "Face1")
shown = t.addObject("App::Link", "Shown"); shown.LinkedObject = box; shown.ElementCount = 2
array = t.addObject("App::Link", "Array"); array.LinkedObject = other; array.ShowElement = False
array.ElementCount = 3
array.ScaleList = [App.Vector(1, 1, 1), App.Vector(-1, 1, 1), App.Vector(2, 2, 2)]
unset = t.addObject("App::Link", "Unset")
mirrored = t.addObject("App::Link", "Mirrored"); mirrored.LinkedObject = box
mirrored.ScaleVector = App.Vector(-1, 1, 1)
variant = t.addObject("App::Link", "Variant"); variant.LinkedObject = box
variant.LinkCopyOnChange = "Owned"
group = t.addObject("App::LinkGroup", "Group"); group.ElementList = [mirrored]
folder_ = t.addObject("App::DocumentObjectGroup", "Folder")
for o in (one, chain, face, shown, array, unset, group, variant):
    part.addObject(o)
part.addObject(folder_)
f = t.addObject("App::FeaturePython", "F")
def add(kind, name, value):
    f.addProperty("App::Property" + kind, name)
    setattr(f, name, value)
add("String", "Text", "a<b>&\\"'\\n\\tü€")
add("Integer", "Whole", -3)
add("Float", "Number", 1.5)
add("Bool", "Flag", True)
add("StringList", "Texts", ["a", "<&>"])
add("IntegerList", "Wholes", [1, 2])
add("BoolList", "Flags", [True, True, False])
add("Map", "Mapping", {"": "e", "k": "v&"})
add("Vector", "Where", App.Vector(1, 2, 3))
add("Link", "To", part)
add("LinkList", "ToMany", [one, chain])
add("LinkSub", "ToSub", (one, ["Face1", "Face2"]))
add("LinkSubList", "ToSubs", [(one, "Face1"), (chain, "Face2"), (chain, "Face3")])
add("XLink", "Far", box)
add("XLink", "FarFace", (box, "Face1"))
add("XLink", "FarFaces", (box, ["Face1", "Face2"]))
add("XLink", "Nowhere", None)
add("XLinkSub", "FarSub", (box, ["Face1"]))
add("XLinkSub", "FarWhole", box)
add("XLinkList", "FarMany", [box, other])
add("XLinkSubList", "FarSubs", [(box, ["Face1"]), (other, ["Face2", "Face3"])])
f.addProperty("App::PropertyEnumeration", "Choice")
f.Choice = ["one", "two"]
f.Choice = "two"
t.Meta = {"SiloUUID": "u-1", "<&>": "ü"}
t.recompute()
t.save()
answer([App.Version()[:2]])
"""

TELL = """
def plain(value):
    if isinstance(value, App.DocumentObject):
        return "#" + os.path.basename(value.Document.FileName) + "#" + value.Name
    if isinstance(value, App.Vector):
        return [value.x, value.y, value.z]
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    return value if isinstance(value, (str, int, float, bool, dict, type(None))) else "?"
d = App.openDocument(args["path"])
out = {o.Name: [o.TypeId, o.Label, {n: plain(getattr(o, n)) for n in o.PropertiesList}] for o in d.Objects}
answer({"label": d.Label, "meta": d.Meta, "uid": d.Uid, "objects": out})
"""


def plain(value: Any) -> Any:
    """As the script's ``plain``."""
    if isinstance(value, FcstdObject):
        return f"#{os.path.basename(value.Document.FileName)}#{value.Name}"
    return [plain(v) for v in value] if isinstance(value, list | tuple) else value


def test_the_same_attributes_as_in_freecad(freecad: Run, tmp_path: Path) -> None:
    """A file of FreeCAD's own, attribute by attribute: what we read is what FreeCAD's Python gives."""
    freecad(BUILD, folder=str(tmp_path / "a"))
    path = tmp_path / "a" / "top.FCStd"
    told = freecad(TELL, path=str(path))
    document = open_document(path)
    assert not document._xml.is_careful
    assert (document.Label, document.Meta, document.Uid) == (told["label"], told["meta"], told["uid"])
    assert [obj.Name for obj in document.Objects] == list(told["objects"])
    compared, unlike = 0, []
    for name, (type_id, label, values) in told["objects"].items():
        obj = document.getObject(name)
        assert obj is not None
        assert (obj.TypeId, obj.Label) == (type_id, label)
        for key in obj.PropertiesList:
            # FreeCAD turns "Owned" into "Enabled" on opening, where there is no copy.
            if key != "LinkCopyOnChange" and hasattr(obj, key) and values.get(key, "?") != "?":
                compared += 1
                if plain(getattr(obj, key)) != values[key]:
                    unlike.append((name, key, getattr(obj, key), values[key]))
    assert unlike == []
    assert compared > 150


def test_types_are_derived_as_in_this_freecad(freecad: Run, tmp_path: Path) -> None:
    """The table of types, asked of the FreeCAD at hand for every type that it can make."""
    script = """
for module in ("Part", "PartDesign", "Sketcher", "Spreadsheet", "Mesh", "Points", "Assembly"):
    try:
        __import__(module)
    except ImportError:
        pass
d = App.newDocument("x")
out = {}
for t in args["types"]:
    if t in d.supportedTypes():
        try:
            o = d.addObject(t, "O")
        except Exception:
            continue
        out[t] = [u for u in args["types"] if o.isDerivedFrom(u)]
answer(out)
"""
    modules = ("App", "Part", "PartDesign", "Sketcher", "Spreadsheet", "Mesh", "Points", "Assembly")
    types = [name for name in PARENTS if name.partition("::")[0] in modules]
    told = freecad(script, types=types)
    assert len(told) > 100
    for name, derived in told.items():
        assert set(derived) <= ancestors(name), name
        # Classes that 1.1 put in between are in the table, and older FreeCADs lack them.
        later = {"App::DatumElement", "App::LocalCoordinateSystem", "App::GeoFeature", "App::OriginFeature"}
        assert ancestors(name) & set(types) - set(derived) <= later, name


def test_freecad_reads_our_fixtures(freecad: Run, tmp_path: Path) -> None:
    """The files that the other tests are made of are documents to FreeCAD as well."""
    part().save(tmp_path / "part.FCStd")
    doc = Doc("top", meta={"k": "v"}).link("L", "part.FCStd", "Box").add("App::Part", "A", Group=locals_("L"))
    scales = doc.vectors("Scales", [(1, 1, 1), (-1, 1, 1), (1, 1, 1)])
    doc.link("M", "part.FCStd", "Box", ElementCount=3, ScaleList=scales, ShowElement=False)
    told = freecad(TELL, path=str(doc.save(tmp_path / "top.FCStd")))
    assert told["meta"] == {"k": "v"}
    assert told["objects"]["L"][2]["LinkedObject"] == "#part.FCStd#Box"
    assert told["objects"]["M"][2]["ElementCount"] == 3
    assert told["objects"]["M"][2]["ScaleList"][1] == [-1.0, 1.0, 1.0]
    assert told["objects"]["A"][2]["Group"] == ["#top.FCStd#L"]


SHAPES = """
def volume(o):
    shape = getattr(o, "Shape", None)
    return 0 if shape is None or shape.isNull() else round(shape.Volume, 6)
d = App.openDocument(args["path"])
answer({"meta": d.Meta, "objects": [[o.Name, o.TypeId, volume(o)] for o in d.Objects]})
"""


def test_freecad_reads_the_stamp_and_everything_else(freecad: Run, tmp_path: Path) -> None:
    """For the document and for one object; all shapes are there; what FreeCAD saves keeps the stamp."""
    freecad(BUILD, folder=str(tmp_path / "a"))
    path = tmp_path / "a" / "parts" / "Teil & <1> ü.FCStd"
    before = freecad(SHAPES, path=str(path))
    assert stamp(path, "5e1f-&-1")
    assert stamp(path, "5e1f-2", object_name="Cylinder")
    after = freecad(SHAPES, path=str(path))
    assert after["meta"] == {"SiloUUID": "5e1f-&-1", "SiloUUID/Cylinder": "5e1f-2"}
    assert after["objects"] == before["objects"]
    assert any(volume > 0 for _, _, volume in after["objects"])
    freecad("d = App.openDocument(args['path']); d.save(); answer(0)", path=str(path))
    assert open_document(path).Meta == after["meta"]


def test_freecad_reads_a_stamp_where_meta_was_missing(freecad: Run, tmp_path: Path) -> None:
    """The map that we add is one that FreeCAD restores."""
    path = Doc(meta=None).add("Part::Box", "Box").save(tmp_path / "p.FCStd")
    assert stamp(path, "u-1")
    assert freecad(SHAPES, path=str(path))["meta"] == {"SiloUUID": "u-1"}


@pytest.mark.usefixtures("needs_symlinks")
def test_links_by_symlinks_as_freecad(freecad: Run, tmp_path: Path) -> None:
    """Relative paths are joined as FreeCAD 0.20 and 1.0 join them: as text, from the folder as it was opened.

    FreeCAD 1.1 joins them from where the owning file really lies; a link that leads to a file in that way
    only is found by us too.
    """
    part(uuid="elsewhere").save(tmp_path / "elsewhere" / "parts" / "p.FCStd")
    part(uuid="project").save(tmp_path / "project" / "parts" / "p.FCStd")
    Doc().link("L", "../parts/p.FCStd", "Box").save(tmp_path / "elsewhere" / "asm" / "top.FCStd")
    (tmp_path / "project" / "asm").symlink_to("../elsewhere/asm")
    path = tmp_path / "project" / "asm" / "top.FCStd"
    script = """
d = App.openDocument(args["path"])
answer([[int(n) for n in App.Version()[:2]], d.L.LinkedObject.Document.Meta["SiloUUID"]])
"""

    def ours() -> str:
        with Library() as library:
            meta: dict[str, str] = library.open(path).Objects[0].LinkedObject.Document.Meta
            return meta["SiloUUID"]

    version, told = freecad(script, path=str(path))
    assert told == ("project" if version < [1, 1] else "elsewhere")
    assert ours() == "project"
    (tmp_path / "project" / "parts" / "p.FCStd").unlink()
    assert ours() == "elsewhere"
