# SPDX-License-Identifier: LGPL-2.1-or-later
"""The whole BOM of a large assembly: ours, a null parse of its XML, and FreeCAD, measured in one run.

    python benchmarks/extract.py [--links 1000] [--parts 200] [--repeats 7] [--data FOLDER]

Data: a top file with links to part files, written by ``freecadcmd`` (PATH, or SILO_FREECADCMD), else by the
tests' own writer. Two kinds of parts: one box (6 kB of XML, the least there is), and a body with 20 features
(98 kB; the part files of public projects have 20 to 800 kB). Every measurement is a process of its own, in
turn, so that none runs in another's warm memory; the time is taken inside, after the imports. Shown are
medians.

With the kind ``screws`` the top holds as many standard parts as the others hold links, of 50 designations,
and no part file is there: what a fastener costs, against a link.

bom        open the top file, choose the assembly, walk it: counts, identities, findings
null       unpack every Document.xml involved with zipfile, and let expat parse it with no handler at all
freecad    openDocument and the same walk, inside freecadcmd (its start-up not counted)
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FREECADCMD = os.environ.get("SILO_FREECADCMD") or shutil.which("freecadcmd") or shutil.which("FreeCADCmd")

BOM = """
import gc, json, resource, sys, time
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
times = []
for _ in range(int(sys.argv[2])):
    gc.collect()
    begin = time.perf_counter()
    with Library() as library:
        found = extract(choose_assembly(library.open(sys.argv[1])))
    times.append(time.perf_counter() - begin)
    entries = found.entries
    seen = [len(entries), sum(e.quantity for e in entries), sum(e.silo_uuid is not None for e in entries)]
    del found, library
print(json.dumps([times, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, seen]))
"""

NULL = """
import gc, json, pathlib, resource, sys, time, zipfile
from xml.parsers import expat
top = pathlib.Path(sys.argv[1])
files = [top, *sorted((top.parent / "parts").glob("*.FCStd"))]
times, size = [], 0
for _ in range(int(sys.argv[2])):
    gc.collect()
    begin = time.perf_counter()
    for file in files:
        with zipfile.ZipFile(file) as container:
            text = container.read("Document.xml")
        expat.ParserCreate().Parse(text, True)
        size += len(text)
    times.append(time.perf_counter() - begin)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps([times, peak, [len(files), size // len(times)]]))
"""

WALK = """
import json, os, resource, sys, time
import FreeCAD
top, out, mods = json.loads(os.environ["SILO_ARGS"])
sys.path.insert(0, mods)
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
begin = time.perf_counter()
document = FreeCAD.openDocument(top)
opened = time.perf_counter()
found = extract(choose_assembly(document), canonical=os.path.realpath)
walked = time.perf_counter()
entries = found.entries
seen = [len(entries), sum(e.quantity for e in entries), sum(e.silo_uuid is not None for e in entries)]
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
with open(out, "w") as file:
    json.dump([[walked - begin, opened - begin], peak, seen], file)
"""

BUILD = """
import json, os
import FreeCAD
folder, kind, parts, links = json.loads(os.environ["SILO_ARGS"])
os.makedirs(folder + "/parts")
made = []
for number in range(0 if kind == "screws" else parts):
    if kind == "box" or number == 0:
        document = FreeCAD.newDocument(f"part{number}")
        if kind == "box":
            part = document.addObject("Part::Box", "Box")
        else:
            part = document.addObject("PartDesign::Body", "Body")
            for size in range(20):
                feature = document.addObject("PartDesign::AdditiveBox", "Box")
                part.addObject(feature)
                feature.Length = 10 + size
        document.recompute()
    document.Meta = {"SiloUUID": "00000000-0000-4000-8000-%012d" % number}
    document.saveAs(f"{folder}/parts/part{number:03d}.FCStd")
    if kind == "box":
        made.append(part)
if kind == "body":
    FreeCAD.closeDocument(document.Name)
    made = [FreeCAD.openDocument(f"{folder}/parts/part{n:03d}.FCStd").getObject("Body") for n in range(parts)]
top = FreeCAD.newDocument("top")
top.saveAs(folder + "/top.FCStd")
assembly = top.addObject("App::Part", "Assembly")
for number in range(links):
    if kind == "screws":
        link = top.addObject("Part::FeaturePython", f"Screw{number:04d}")
        lengths = list(map(str, range(6, 56)))
        for name, values in (("Type", ["ISO4762"]), ("Diameter", ["M4"]), ("Length", lengths)):
            link.addProperty("App::PropertyEnumeration", name)
            setattr(link, name, values)
        link.Length = str(6 + number % 50)
        for name in ("Thread", "LeftHanded", "MatchOuter", "Invert"):
            link.addProperty("App::PropertyBool", name)
        for name in ("Offset", "LengthCustom"):
            link.addProperty("App::PropertyLength", name)
    else:
        link = top.addObject("App::Link", f"Link{number:04d}")
        link.LinkedObject = made[number % parts]
    assembly.addObject(link)
top.recompute()
top.save()
"""


def freecad(script: str, *args: Any) -> None:
    """Run a script in FreeCAD (``-c`` with ``runpy`` gives the right exit code)."""
    with tempfile.NamedTemporaryFile("w", suffix=".py") as file:
        file.write(script)
        file.flush()
        command = f"import runpy; runpy.run_path({file.name!r}, run_name='__main__')"
        environment = {**os.environ, "SILO_ARGS": json.dumps(args)}
        subprocess.run(
            [str(FREECADCMD), "-c", command],
            env=environment,
            check=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )


def build(folder: Path, kind: str, parts: int, links: int) -> str:
    """Write the data; gives the name of the writer."""
    if FREECADCMD:
        freecad(BUILD, str(folder), kind, parts, links)
        return "FreeCAD"
    sys.path.insert(0, str(ROOT / "tests" / "support"))
    from fcstd_writer import Doc, locals_, part

    if kind == "screws":
        top = Doc("top")
        names = [f"Screw{number:04d}" for number in range(links)]
        for number, screw in enumerate(names):
            made = {"Type": "ISO4762", "Diameter": "M4", "Length": str(6 + number % 50)}
            top.add("Part::FeaturePython", screw, Thread=False, LeftHanded=False, Invert=False, **made)
        top.add("App::Part", "Assembly", Group=locals_(*names)).save(folder / "top.FCStd")
        return "the tests' writer"
    name = "Box" if kind == "box" else "Body"
    for number in range(parts):
        doc = part(name=name, uuid=f"00000000-0000-4000-8000-{number:012d}")
        for feature in range(0 if kind == "box" else 60):
            doc.add("PartDesign::AdditiveBox", f"Box{feature:03d}", Note="x" * 1000)
        doc.save(folder / "parts" / f"part{number:03d}.FCStd")
    top = Doc("top")
    names = [f"Link{number:04d}" for number in range(links)]
    for number, link in enumerate(names):
        top.link(link, f"parts/part{number % parts:03d}.FCStd", name)
    top.add("App::Part", "Assembly", Group=locals_(*names)).save(folder / "top.FCStd")
    return "the tests' writer"


def run_python(code: str, top: Path, times: int) -> Any:
    """One measurement in a fresh interpreter."""
    done = subprocess.run(
        [sys.executable, "-c", code, str(top), str(times)],
        check=True,
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    return json.loads(done.stdout)


def run_freecad(top: Path) -> Any:
    """One measurement in FreeCAD."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.json"
        freecad(WALK, str(top), str(out), str(ROOT / "mods"))
        return json.loads(out.read_text())


def median_ms(values: list[float]) -> float:
    """Milliseconds."""
    return statistics.median(values) * 1000


def measure(top: Path, repeats: int) -> dict[str, dict[str, Any]]:
    """All contestants in turn, so that a slow minute of the machine hits them alike."""
    runs: dict[str, list[Any]] = {"bom": [], "null": [], "freecad": []}
    for number in range(repeats):
        runs["bom"].append(run_python(BOM, top, 6))
        runs["null"].append(run_python(NULL, top, 6))
        if FREECADCMD and number < 3:
            runs["freecad"].append(run_freecad(top))
    return {name: summary(name, found) for name, found in runs.items() if found}


def summary(name: str, found: list[Any]) -> dict[str, Any]:
    """Medians over the processes: the first run in a process, and the later ones."""
    later = [time for times, _, _ in found for time in times[1:]]
    return {
        "first": median_ms([times[0] for times, _, _ in found]),
        "again": None if name == "freecad" else median_ms(later),
        "open": median_ms([times[1] for times, _, _ in found]) if name == "freecad" else None,
        "peak_mb": max(peak for _, peak, _ in found) / 1024,
        "seen": found[0][2],
    }


def show(kind: str, writer: str, found: dict[str, dict[str, Any]]) -> None:
    """One table."""
    bom, null = found["bom"], found["null"]
    files, size = null["seen"]
    lines, pieces, known = bom["seen"]
    print(f"\n{kind} parts, written by {writer}: {files} files, {size / 1e6:.1f} MB of XML")
    print(f"  BOM: {lines} lines, {pieces} pieces, {known} identities")
    print(f"  {'':10}{'first run':>12}{'again':>10}{'peak':>10}")
    for name, row in found.items():
        again = "" if row["again"] is None else f"{row['again']:8.1f} ms"
        print(f"  {name:10}{row['first']:9.1f} ms{again:>10}{row['peak_mb']:7.0f} MB")
    print(
        f"  bom : null     {bom['first'] / null['first']:.2f} first, {bom['again'] / null['again']:.2f} again"
    )
    if "freecad" in found:
        live = found["freecad"]
        assert live["seen"] == bom["seen"], "FreeCAD and the reader disagree"
        ratio = f"{live['first'] / bom['first']:.1f} first, {live['first'] / bom['again']:.1f} again"
        print(f"  freecad : bom  {ratio} (FreeCAD: {live['open']:.0f} ms of it to open)")


def main() -> None:
    """Build, measure, show."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--links", type=int, default=1000)
    parser.add_argument("--parts", type=int, default=200)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument(
        "--kinds", nargs="+", default=["box", "body", "screws"], choices=["box", "body", "screws"]
    )
    parser.add_argument("--data", type=Path, help="keep the data there, and use it again")
    args = parser.parse_args()
    first: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as temporary:
        for kind in args.kinds:
            folder = (args.data or Path(temporary)) / f"{kind}-{args.parts}-{args.links}"
            writer = "an earlier run" if folder.exists() else build(folder, kind, args.parts, args.links)
            found = measure(folder / "top.FCStd", args.repeats)
            show(kind, writer, found)
            first[kind] = found["bom"]["first"]
    if {"box", "screws"} <= first.keys():
        print(f"\na standard part costs {first['screws'] / first['box']:.2f} of a link to a part file")


if __name__ == "__main__":
    main()
