# SPDX-License-Identifier: LGPL-2.1-or-later
"""The copies in an AssemblyLink's own Group: never counted, reported when they are old (facts §1.4)."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc, edit

from silo.bom import FindingCode, extract
from silo.bom.findings import Finding


class Scene:
    """A sub-assembly of a bolt, an array of four and a body of its own, and a top that instances it."""

    def __init__(self) -> None:
        self.top, self.sub = Doc("/v/top.FCStd"), Doc("/v/sub.FCStd")
        self.bolt = Doc("/v/bolt.FCStd").body()
        self.link, self.array = self.sub.link("Bolt", self.bolt), self.sub.array("Row", self.bolt, 4)
        self.body, self.inline = self.sub.body("Local"), self.sub.part("Inline")
        self.asm = self.sub.assembly(self.link, self.array, self.body, self.inline)

    def copy(self, name: str, original: Any, **properties: Any) -> Any:
        return self.top.link(name, original, **properties)

    def copies(self) -> list[Any]:
        """What FreeCAD 1.0 makes of it: one link per link, body and part."""
        return [self.copy(f"C{n}", original) for n, original in enumerate(self.asm.Group)]

    def stale(self, copies: list[Any]) -> tuple[Finding, ...]:
        asm = self.top.assembly(self.top.assembly_link("Instance", self.asm, copies))
        found = extract(asm)
        (entry,) = found.entries
        assert [(child.key, child.quantity) for child in entry.children] == [(("/v/bolt.FCStd", "Body"), 5)]
        return found.findings_of(FindingCode.STALE_ASSEMBLY_LINK)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_fresh_copies_are_no_news(scene: Scene) -> None:
    """Copies of links, arrays, bodies and inline parts, as FreeCAD 1.0 makes them."""
    assert scene.stale(scene.copies()) == ()


def test_fresh_copies_of_freecad_1_1_are_no_news(scene: Scene) -> None:
    """FreeCAD 1.1 copies an array as an array of the part itself, not as a link to the array (measured)."""
    copies = scene.copies()
    copies[1] = scene.top.array("C1", scene.bolt, 4)
    assert scene.stale(copies) == ()


def test_an_instance_that_was_never_recomputed_is_no_news(scene: Scene) -> None:
    """It shows nothing yet, so it shows nothing wrong."""
    assert scene.stale([]) == ()


def test_a_removed_component_that_is_still_shown(scene: Scene) -> None:
    """The original is there, but no longer in the assembly."""
    removed = scene.sub.link("Removed", scene.bolt)
    (finding,) = scene.stale([*scene.copies(), scene.copy("Old", removed)])
    assert "no longer there: Old" in finding.message
    assert finding.where[0].obj == "Instance"


def test_a_deleted_component_that_is_still_shown(scene: Scene) -> None:
    """The original is gone; its copy is a broken link, and the only finding is that the copies are old."""
    asm = scene.top.assembly(
        scene.top.assembly_link("Instance", scene.asm, [*scene.copies(), scene.copy("Old", None)])
    )
    found = extract(asm)
    assert [finding.code for finding in found.findings if finding.where[0].obj == "Instance"] == [
        FindingCode.STALE_ASSEMBLY_LINK
    ]
    assert not found.blocked


def test_a_new_component_that_is_not_shown(scene: Scene) -> None:
    """The assembly was given a link since."""
    (finding,) = scene.stale(scene.copies()[1:])
    assert "not shown: Bolt" in finding.message


def test_an_array_of_another_length(scene: Scene) -> None:
    """FreeCAD 1.1's copy of an array has its own count, and may be behind."""
    copies = scene.copies()
    copies[1] = scene.top.array("C1", scene.bolt, 3)
    (finding,) = scene.stale(copies)
    assert "not shown: Row" in finding.message


def test_new_bodies_need_no_word(scene: Scene) -> None:
    """A copy of a body is no component; that one is lacking changes no BOM."""
    assert scene.stale([copy for copy in scene.copies() if copy.LinkedObject is not scene.body]) == ()


def test_copies_of_equal_names_in_other_files_are_kept_apart(scene: Scene) -> None:
    """A name alone is no identity: the copy shows the bolt of another file."""
    other = Doc("/v/other.FCStd")
    copies = scene.copies()
    copies[0] = scene.copy("C0", other.link("Bolt", scene.bolt))
    (finding,) = scene.stale(copies)
    assert "no longer there: C0" in finding.message
    assert "not shown: Bolt" in finding.message


def test_an_instance_of_an_instance_is_compared_with_the_copies_it_shows(scene: Scene) -> None:
    """Nested: the copies stand for the copies in the middle document."""
    mid = Doc("/v/mid.FCStd")
    middle = mid.assembly_link(
        "Mid", scene.asm, [mid.link(f"M{n}", o) for n, o in enumerate(scene.asm.Group)]
    )
    copies = [scene.copy(f"C{n}", copy) for n, copy in enumerate(middle.Group)]
    assert (
        extract(scene.top.assembly(scene.top.assembly_link("I", middle, copies))).findings_of(
            FindingCode.STALE_ASSEMBLY_LINK
        )
        == ()
    )
    edit(middle, Group=middle.Group[:1])
    assert extract(scene.top.assembly(scene.top.assembly_link("I", middle, copies))).findings_of(
        FindingCode.STALE_ASSEMBLY_LINK
    )


def test_two_equal_arrays_are_two(scene: Scene) -> None:
    """Each copy stands for one of them; a single copy lacks the other."""
    sub, top = Doc("/v/rows.FCStd"), Doc("/v/top.FCStd")
    asm = sub.assembly(sub.array("One", scene.bolt, 4), sub.array("Two", scene.bolt, 4))
    copies = [top.array(name, scene.bolt, 4) for name in ("C1", "C2")]
    both = extract(top.assembly(top.assembly_link("Instance", asm, copies)))
    assert both.findings_of(FindingCode.STALE_ASSEMBLY_LINK) == ()
    one = extract(top.assembly(top.assembly_link("Half", asm, copies[:1]), name="Other"))
    assert one.findings_of(FindingCode.STALE_ASSEMBLY_LINK)


def test_an_array_by_way_of_another_link_is_known_by_its_part(scene: Scene) -> None:
    """FreeCAD 1.1 copies it as an array of the part at the end of the chain."""
    sub, top = Doc("/v/rows.FCStd"), Doc("/v/top.FCStd")
    between = Doc("/v/between.FCStd").link("Between", scene.bolt)
    asm = sub.assembly(sub.array("Row", between, 4))
    found = extract(top.assembly(top.assembly_link("Instance", asm, [top.array("C", scene.bolt, 4)])))
    assert found.findings_of(FindingCode.STALE_ASSEMBLY_LINK) == ()


def test_an_old_copy_of_a_sub_assembly_is_no_part_of_ones_own(scene: Scene) -> None:
    """What it stands for has left the assembly; it is reported, not counted."""
    gone = scene.sub.assembly_link("Gone", Doc("/v/deep.FCStd").assembly())
    (finding,) = scene.stale([*scene.copies(), scene.copy("Old", gone)])
    assert "no longer there: Old" in finding.message
