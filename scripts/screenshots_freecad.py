# SPDX-License-Identifier: LGPL-2.1-or-later
"""Photograph the add-on in FreeCAD into ``docs/images/addon-*.png``: the example assembly, a real server.

Run: ``.venv/bin/python scripts/screenshots_freecad.py [FOLDER] [STYLE]``. It needs FreeCAD and Xvfb; the
newest of ``scripts/freecad-roots.sh --list`` is taken, or that of ``SILO_PICTURES_FREECAD`` (such as 1.0).
With ``--tour`` it makes the animated ``addon-tour.gif`` instead: a commit after a colleague's.
STYLE names a style sheet of FreeCAD, such as "FreeCAD Dark.qss", or a theme of FreeCAD 1.1, such as
"FreeCAD Dark", to look at the windows in it; ``SILO_PICTURES_SCALE=2`` is for a screen of double resolution,
and ``SILO_PICTURES_LANGUAGE=German`` for another language.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
import zipfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "freecad"), str(ROOT / "tests" / "support")]

from freecad_cases import machines  # noqa: E402
from gearbox_story import GearboxStory  # noqa: E402
from gui_cases.window import Window, window  # noqa: E402

from silo.api.client import SiloClient  # noqa: E402
from silo.api.wire import MergeEntry, MergeRequest  # noqa: E402
from silo.cli.reading import read_assembly  # noqa: E402
from silo.registering.closed_files import proposals_for, register_all  # noqa: E402

DOCS = ROOT / "docs" / "images"
# These have no part number yet when the designer comes.
LATER = ("Cover", "MotorMount")


def main() -> None:
    """Set the stage, then let FreeCAD photograph itself."""
    tour = "--tour" in sys.argv
    sys.argv = [word for word in sys.argv if word != "--tour"]
    folder = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else DOCS
    folder.mkdir(parents=True, exist_ok=True)
    version = os.environ.get("SILO_PICTURES_FREECAD") or max(
        machines.freecads(), key=lambda short: machines.freecads()[short].version
    )
    with (
        tempfile.TemporaryDirectory(prefix="silo-pictures-") as scratch,
        window(version, Path(scratch)) as freecad,
    ):
        scale = os.environ.get("SILO_PICTURES_SCALE", "1")
        freecad.pixels = f"{round(1600 * float(scale))}x{round(1000 * float(scale))}"
        with freecad.server.client() as client:
            top = prepare(freecad, client)
        freecad.answers["colleague commits"] = lambda: colleague_commits(freecad, *top)
        furnish(freecad.home / "user.cfg", sys.argv[2] if len(sys.argv) > 2 else "")
        env = {"SILO_PICTURES": str(folder), "QT_XCB_NO_MITSHM": "1", "QT_SCALE_FACTOR": scale}
        if tour:
            env["SILO_TOUR"] = "1"
        freecad.run("pictures.py", env=env)
    if tour:
        animate(folder)
    for picture in sorted(folder.glob("addon-*.png")):
        print(f"{picture}  {picture.stat().st_size / 1000:.0f} kB")


# A plain ground keeps the pictures small.
VIEW = (
    '<FCParamGroup Name="View"><FCBool Name="Simple" Value="1"/><FCBool Name="Gradient" Value="0"/>'
    '<FCUInt Name="BackgroundColor" Value="4109760511"/></FCParamGroup>'
)
STYLE = '<FCParamGroup Name="MainWindow"><FCText Name="StyleSheet">{}</FCText>{}</FCParamGroup>'
THEME = '<FCText Name="QtStyle">FreeCAD</FCText><FCText Name="Theme">{}</FCText>'


def furnish(config: Path, style: str) -> None:
    """FreeCAD's look, in its configuration file."""
    mod = '<FCParamGroup Name="Mod">'
    more = VIEW
    if style:
        is_sheet = style.endswith(".qss")
        more += STYLE.format(style, "") if is_sheet else STYLE.format("FreeCAD.qss", THEME.format(style))
    general = '<FCParamGroup Name="General">'
    language = (
        f'{general}<FCText Name="Language">{os.environ.get("SILO_PICTURES_LANGUAGE", "English")}</FCText>'
    )
    config.write_text(config.read_text().replace(mod, more + mod).replace(general, language))


def animate(folder: Path) -> None:
    """The frames of the tour as one animated picture."""
    frames = sorted(folder.glob("tour-*.png"), key=lambda path: int(path.stem.removeprefix("tour-")))
    images = [Image.open(path).convert("RGB").resize((990, 600), Image.Resampling.LANCZOS) for path in frames]
    few = [image.quantize(96, dither=Image.Dither.NONE) for image in images]
    few[0].save(
        folder / "addon-tour.gif", save_all=True, append_images=few[1:], duration=2200, loop=0, optimize=True
    )
    for path in frames:
        path.unlink()


def colleague_commits(freecad: Window, number: str, top: Path) -> str:
    """Somebody else commits the assembly with another number of bolts, from a copy of it."""
    copy = freecad.folder / "colleague" / top.name
    copy.parent.mkdir()
    with zipfile.ZipFile(top) as source, zipfile.ZipFile(copy, "w", zipfile.ZIP_DEFLATED) as target:
        for entry in source.infolist():
            content = source.read(entry)
            if entry.filename == "Document.xml":
                content = re.sub(rb'(name="ElementCount"[^>]*>\s*<Integer value=")4"', rb'\g<1>5"', content)
            target.writestr(entry, content)
    with freecad.server.client() as client:
        client.upload_file(number, copy, comment="One bolt more for the cover")
    return number


def prepare(freecad: Window, client: SiloClient) -> tuple[str, Path]:
    """A server that knows the assembly from before, and on which people have worked since."""
    story = GearboxStory(freecad.folder, client)
    if freecad.freecad.version < (1, 0):
        for file in (story.top, story.top.parent / "Gearbox.FCStd"):
            as_before_1_0(file)
    extraction = read_assembly(str(story.top))
    early = [
        proposal
        for proposal in proposals_for(extraction, client, "kindred-rd")
        if Path(proposal.entry.doc_path).stem not in LATER
    ]
    for done in register_all(early, client, schema="kindred-rd"):
        if done.error is not None:
            raise done.error
    story.upload()
    story.sync()
    people_worked(story, client)
    return story.number_of("TopAssembly"), story.top


def as_before_1_0(file: Path) -> None:
    """The assembly of a file as FreeCAD 0.20 has one: a part with links in it."""
    with zipfile.ZipFile(file) as source:
        entries = {entry.filename: source.read(entry) for entry in source.infolist()}
    document = entries["Document.xml"].replace(b'ProgramVersion="1.0R"', b'ProgramVersion="0.20R"')
    for new, old in (
        (b"Assembly::AssemblyObject", b"App::Part"),
        (b"Assembly::AssemblyLink", b"App::Link"),
        (b"Assembly::JointGroup", b"App::DocumentObjectGroup"),
    ):
        document = document.replace(new, old)
    entries["Document.xml"] = document
    entries.pop("GuiDocument.xml", None)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as target:
        for name, content in entries.items():
            target.writestr(name, content)


def people_worked(story: GearboxStory, client: SiloClient) -> None:
    top = story.number_of("TopAssembly")
    oil = client.create_item("kindred-rd", "C01", "Gear oil ISO VG 220", item_type="consumable")
    client.add_bom_line(top, oil.part_number, quantity=0.4, unit="l", notes="fill to the upper mark")
    # A line that an earlier state of the assembly had.
    plug = client.create_item("kindred-rd", "F01", "Drain plug M14", item_type="part")
    lines = client.get_bom(top)
    entries = [
        MergeEntry(child_part_number=line.child_part_number, quantity=line.quantity)
        for line in lines
        if line.source != "manual"
    ]
    entries.append(MergeEntry(child_part_number=plug.part_number, quantity=1))
    client.merge_bom(top, MergeRequest(entries=entries))
    client.update_bom_line(top, story.number_of("BasePlate"), quantity=3)
    # Probable duplicates: an item of that name, and one that has the very file.
    client.create_item("kindred-rd", "S06", "Sensor Bracket")
    cover = client.create_item("kindred-rd", "S06", "Cover")
    client.upload_file(
        cover.part_number, story.top.parent / "parts" / "Cover.FCStd", comment="from the archive"
    )


if __name__ == "__main__":
    main()
