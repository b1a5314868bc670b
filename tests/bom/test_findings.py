# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every finding there is can be met, says what and where in plain words, and means what it is called."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Any

import pytest
from fakes import Doc, edit

from silo.bom import BomEntry, Finding, FindingCode, Severity, choose_assembly, diff_bom, extract
from silo.bom.consolidation import consolidation_findings
from silo.bom.findings import respelt_findings
from silo.bom.items.resolve import unregistered_findings
from silo.bom.walk.document import LinkProblem
from silo.bom.walk.facts import Files
from silo.bom.walk.links import _Walker
from silo.bom.walk.roles import Reader
from silo.bom.walk.roots import as_it_is


class Scene:
    """A top document, a bolt in a file of its own, and a sub-assembly of two bolts."""

    def __init__(self) -> None:
        self.top = Doc("/v/top.FCStd")
        self.bolt = Doc("/v/bolt.FCStd").body(Label="Bolt")
        sub = Doc("/v/sub.FCStd")
        self.sub = sub.assembly(sub.link("S1", self.bolt), sub.link("S2", self.bolt))

    def walked(self, *members: Any) -> Iterable[Finding]:
        return extract(self.top.assembly(*members)).findings


def met_by_a_member(make: Callable[[Scene], Any]) -> Callable[[], Iterable[Finding]]:
    """The findings of an assembly that holds what ``make`` makes."""

    def walk() -> Iterable[Finding]:
        scene = Scene()
        return scene.walked(make(scene))

    return walk


def broken(code: FindingCode) -> Callable[[], Iterable[Finding]]:
    problem = LinkProblem(code, "parts/b.FCStd", "Box", "the reason")
    return met_by_a_member(lambda scene: scene.top.link("L", None, LinkProblem=problem))


def cycle() -> Iterable[Finding]:
    scene = Scene()
    asm = scene.top.assembly(scene.top.link("L", scene.sub))
    edit(scene.sub, Group=[scene.sub.Document.link("Back", asm)])
    return extract(asm).findings


def too_deep() -> Iterable[Finding]:
    below = Scene().bolt
    for number in range(100):
        doc = Doc(f"/v/{number}.FCStd")
        below = doc.assembly(doc.link("L", below))
    return extract(below).findings


def loose(beside: bool) -> Iterable[Finding]:
    scene = Scene()
    scene.top.link("Loose", scene.bolt)
    if beside:
        scene.top.assembly(scene.top.link("L", scene.bolt))
    return extract(choose_assembly(scene.top)).findings


def one_identity(*places: tuple[str, str]) -> Iterable[Finding]:
    docs: dict[str, Doc] = {}
    top = Doc("/v/top.FCStd")
    links = []
    for path, name in places:
        doc = docs.setdefault(path, Doc(path, meta={"SiloUUID": "u-1"}))
        links.append(top.link(f"L{name}", doc.body(name)))
    return extract(top.assembly(*links)).findings


def stale(scene: Scene) -> Any:
    return scene.top.assembly_link("AL", scene.sub, [scene.top.link("C", scene.sub.Group[0])])


def variant(scene: Scene) -> Any:
    return scene.top.link("V", scene.top.body("Copy"), LinkCopyOnChangeSource=scene.bolt)


def draft_array(scene: Scene) -> Any:
    base = scene.top.link("Base", scene.bolt)
    return scene.top.add("Part::FeaturePython", "Array", Base=base, Count=3)


def visible_original(scene: Scene) -> Any:
    base = scene.top.link("Base", scene.bolt)
    array = scene.top.add("Part::FeaturePython", "Array", Base=base, Count=3)
    return scene.top.folder("Both", base, array)


def modified_here(scene: Scene) -> Any:
    plate = scene.top.link("Plate", scene.bolt, Visibility=False)
    cut = scene.top.add("Part::Cut", "Cut", Base=plate, Tool=scene.top.body("Drill", Visibility=False))
    return scene.top.folder("Drilled", plate, cut)


def screw(doc: Doc, name: str = "Screw", **properties: Any) -> Any:
    values = {"Type": "ISO4762", "Diameter": "M4", "Length": "16", **properties}
    return doc.add("Part::FeaturePython", name, **values)


def counted_beside() -> Iterable[Finding]:
    scene = Scene()
    screw(scene.top)
    return scene.walked(scene.top.link("L", scene.bolt))


def consumed(scene: Scene) -> Any:
    tool = screw(scene.top)
    cut = scene.top.add("Part::Cut", "Cut", Base=scene.top.body("Plate"), Tool=tool)
    return scene.top.folder("Drilled", tool, cut)


def no_hardware() -> Iterable[Finding]:
    scene = Scene()
    return extract(scene.top.assembly(screw(scene.top)), hardware=False).findings


def newer() -> Iterable[Finding]:
    scene = Scene()
    edit(scene.top, ProgramVersion="7.2.1R1 (Git)")
    return scene.walked(scene.top.link("L", scene.bolt))


def no_role() -> Iterable[Finding]:
    """A container with a list that no FreeCAD gives it."""
    scene = Scene()
    odd = scene.top.part("Odd", ElementList=[screw(scene.top, "Lost")])
    return scene.walked(odd, scene.top.link("L", scene.bolt))


def unexplained() -> Iterable[Finding]:
    """Lines that lack what the assembly shows."""
    scene = Scene()
    body = scene.top.body("Lost")
    walker = _Walker(None, None, as_it_is, True, True)
    top = scene.top.assembly(body, scene.top.link("L", scene.bolt))
    walker.reader.contents(top)
    walker.look_for_unexplained(top, ())
    return walker.notes.findings()


def two_roles() -> Iterable[Finding]:
    """A screw of the assembly, taken for one that lies beside it."""
    scene = Scene()
    one = screw(scene.top)
    reader = Reader(None, Files(), beside=lambda _top: [one])
    reader.contents(scene.top.assembly(one))
    return reader.notes.findings()


SCENES: dict[FindingCode, Callable[[], Iterable[Finding]]] = {
    **{
        code: broken(code)
        for code in (
            FindingCode.MISSING_FILE,
            FindingCode.MISSING_OBJECT,
            FindingCode.UNREADABLE_FILE,
            FindingCode.LFS_POINTER,
            FindingCode.OUTSIDE_ROOT,
            FindingCode.BROKEN_LINK,
            FindingCode.LOST_ASSEMBLY,
            FindingCode.UNSET_LINK,
        )
    },
    FindingCode.CYCLE: cycle,
    FindingCode.TOO_DEEP: too_deep,
    FindingCode.IN_DOCUMENT_LINK: met_by_a_member(
        lambda s: s.top.link("L", s.top.add("Sketcher::SketchObject", "Layout"))
    ),
    FindingCode.SUB_ELEMENT_LINK: met_by_a_member(lambda s: s.top.link("L", (s.bolt, "Face1"))),
    FindingCode.NO_COMPONENT: met_by_a_member(
        lambda s: s.top.link("L", Doc("/v/master.FCStd").add("Spreadsheet::Sheet", "Sheet"))
    ),
    FindingCode.SUPPRESSED: met_by_a_member(lambda s: s.top.link("L", s.bolt, Suppressed=True)),
    FindingCode.EXCLUDED: met_by_a_member(lambda s: s.top.link("L", s.bolt, SiloBomExclude=True)),
    FindingCode.MIRRORED: met_by_a_member(lambda s: s.top.link("L", s.bolt, ScaleVector=(-1.0, 1.0, 1.0))),
    FindingCode.VARIANT: met_by_a_member(variant),
    FindingCode.SCALED: met_by_a_member(lambda s: s.top.link("L", s.bolt, ScaleVector=(2.0, 2.0, 2.0))),
    FindingCode.HIDDEN: met_by_a_member(lambda s: s.top.link("L", s.bolt, Visibility=False)),
    FindingCode.COINCIDENT: met_by_a_member(visible_original),
    FindingCode.MODIFIED_HERE: met_by_a_member(modified_here),
    FindingCode.DELETED_COPY: met_by_a_member(
        lambda s: s.top.link("L", None, LinkCopyOnChange="Enabled", LinkCopyOnChangeSource=s.bolt)
    ),
    FindingCode.DRAFT_ARRAY: met_by_a_member(draft_array),
    FindingCode.ARRAY_SIZE: met_by_a_member(
        lambda s: s.top.add("Part::FeaturePython", "Array", Base=s.top.link("Base", s.bolt), Count=0)
    ),
    FindingCode.CONSUMED: met_by_a_member(consumed),
    FindingCode.NO_HARDWARE: no_hardware,
    FindingCode.SAME_ARTICLE: met_by_a_member(
        lambda s: s.top.folder("F", screw(s.top, "A", Type="DIN933"), screw(s.top, "B", Type="ISO4017"))
    ),
    FindingCode.COUNTED_BESIDE: counted_beside,
    FindingCode.UNKNOWN_LINK_TYPE: met_by_a_member(
        lambda s: s.top.add("Part::LinkSpiral", "L", LinkedObject=s.bolt, ElementCount=3)
    ),
    FindingCode.NEWER_FREECAD: newer,
    FindingCode.LOCAL_GEOMETRY: met_by_a_member(lambda s: s.top.body("Local")),
    FindingCode.FOREIGN_COMPONENT: met_by_a_member(
        lambda s: s.top.add("Part::FeaturePython", "b_Bolt", sourceFile="", a2p_Version="0.4")
    ),
    FindingCode.NO_CONTAINER: lambda: loose(beside=False),
    FindingCode.BESIDE_ASSEMBLY: lambda: loose(beside=True),
    FindingCode.STALE_ASSEMBLY_LINK: met_by_a_member(stale),
    FindingCode.RESPELT: lambda: respelt_findings(
        ["/v/top.FCStd records A.FCStd; taken was a.FCStd"], "/v/top.FCStd"
    ),
    FindingCode.NO_ROLE: no_role,
    FindingCode.TWO_ROLES: two_roles,
    FindingCode.UNEXPLAINED: unexplained,
    FindingCode.EMPTY_BOM: lambda: extract(Doc("/v/top.FCStd").assembly()).findings,
    FindingCode.ONE_PART: lambda: extract(choose_assembly(Doc("/v/top.FCStd").body().Document)).findings,
    FindingCode.COPIED_IDENTITY: lambda: one_identity(("/v/a.FCStd", "A"), ("/v/b.FCStd", "B")),
    FindingCode.SHARED_IDENTITY: lambda: one_identity(("/v/a.FCStd", "A"), ("/v/a.FCStd", "B")),
    FindingCode.CONSOLIDATION: lambda: consolidation_findings(extract(Scene().sub).entries),
    FindingCode.UNREGISTERED: lambda: unregistered_findings(extract(Scene().sub).entries),
    FindingCode.UNREFERENCED: lambda: diff_bom([], [{"child_part_number": "P", "quantity": 1}]).findings_at(
        BomEntry("/v/top.FCStd", object_name="A")
    ),
    FindingCode.CONFLICT: lambda: diff_bom(
        [{"child_part_number": "P", "quantity": 2}],
        [{"child_part_number": "P", "quantity": 1, "source": "manual"}],
    ).findings_at(BomEntry("/v/top.FCStd", object_name="A")),
}

BLOCKING = {
    FindingCode.MISSING_FILE,
    FindingCode.MISSING_OBJECT,
    FindingCode.UNREADABLE_FILE,
    FindingCode.LFS_POINTER,
    FindingCode.OUTSIDE_ROOT,
    FindingCode.BROKEN_LINK,
    FindingCode.DELETED_COPY,
    FindingCode.LOST_ASSEMBLY,
    FindingCode.CYCLE,
    FindingCode.TOO_DEEP,
    FindingCode.ARRAY_SIZE,
    FindingCode.NO_ROLE,
    FindingCode.TWO_ROLES,
}


def test_there_is_a_scene_for_every_code() -> None:
    """A code that nothing can produce is a promise that nobody keeps."""
    assert set(SCENES) == set(FindingCode)


@pytest.mark.parametrize("code", FindingCode)
def test_every_code_is_met_and_reported_in_plain_words(code: FindingCode) -> None:
    """One sentence or two, with an end, a place, and none of Python's own words; what is missing blocks."""
    finding = next(finding for finding in SCENES[code]() if finding.code is code)
    assert finding.blocks is (code in BLOCKING)
    assert re.fullmatch(r"[a-z]+(_[a-z]+)*", code.value)
    assert code.meaning
    assert code.remedy
    assert finding.where
    assert finding.where[0].doc_path.startswith("/v/")
    assert finding.message.strip() == finding.message != ""
    assert finding.message.endswith((".", "?"))
    assert not re.search(r"\bNone\b|<|object at|\{|\}|Traceback", finding.message)
    assert len(finding.message) < 400


@pytest.mark.parametrize("label", ["<b>Bolt</b>", "{users}", "{0}", "%s", "a\nb", "\x1b[31m", "💥"])
def test_labels_are_text(label: str) -> None:
    """A label with braces, markup or control characters is repeated as it is, and breaks nothing."""
    top = Doc("/v/top.FCStd")
    problem = LinkProblem(FindingCode.MISSING_FILE, "{file}.FCStd", "{obj}", "{detail}")
    found = extract(top.assembly(top.link("L", None, Label=label, LinkProblem=problem)))
    assert label in found.findings[0].message
    assert "/v/{file}.FCStd" in found.findings[0].message


def test_severities_are_ordered_words() -> None:
    """What machines read in JSON."""
    assert [severity.value for severity in Severity] == ["info", "warning", "error"]


@pytest.mark.parametrize(
    ("program", "noted"),
    [("1.1R1 (Git)", False), ("1.2.0", True), ("0.21R33694", False), ("2022.1129.28613 +5 (Git)", False)],
)
def test_the_numbers_of_realthunders_branch_are_no_newer_freecad(program: str, noted: bool) -> None:
    """They are dates: 2022.1129 is not after 1.1."""
    scene = Scene()
    edit(scene.top, ProgramVersion=program)
    found = scene.walked(scene.top.link("L", scene.bolt))
    assert any(one.code is FindingCode.NEWER_FREECAD for one in found) is noted
