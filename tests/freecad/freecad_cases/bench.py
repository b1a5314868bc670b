# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a case is built, inside FreeCAD: parts, containers, links, and the way they are saved.

Every case is a function that gets a :class:`Bench` and builds ``top.FCStd`` with what it links to, in a
folder of its own. Its expected BOM stands in ``truth.py``, written by hand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import FreeCAD as App

ASSEMBLY, ASM4, LOOSE = "assembly", "asm4", "loose"
VERSION = tuple(int(part) for part in App.Version()[:2])


@dataclass(frozen=True)
class Case:
    """A case: what builds it, in which container styles, since which FreeCAD, and before which."""

    name: str
    build: Callable[[Bench], None]
    styles: tuple[str, ...]
    since: tuple[int, int]
    before: tuple[int, int] = (99, 0)


CASES: list[Case] = []


def case(
    *styles: str, since: tuple[int, int] = (0, 20), before: tuple[int, int] = (99, 0)
) -> Callable[[Callable[[Bench], None]], Any]:
    """Register a case; its name is the function's. Without styles: FreeCAD's own and Assembly4's."""

    def register(build: Callable[[Bench], None]) -> Callable[[Bench], None]:
        CASES.append(Case(build.__name__, build, styles or (ASSEMBLY, ASM4), since, before))
        return build

    return register


class Bench:
    """One case being built in one style."""

    def __init__(self, folder: Path, style: str) -> None:
        self.folder, self.style = folder, style
        folder.mkdir(parents=True, exist_ok=True)

    # --- documents --------------------------------------------------------------------------------------

    def document(self, path: str) -> Any:
        """A new document, saved at once: links across documents need files."""
        file = self.folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        doc = App.newDocument(file.stem)
        doc.saveAs(str(file))
        return doc

    def part(self, path: str, name: str = "Bolt", label: str | None = None) -> Any:
        """A document with one box."""
        return self.box(self.document(path), name, label)

    def box(self, doc: Any, name: str, label: str | None = None) -> Any:
        obj = doc.addObject("Part::Box", name)
        if label is not None:
            obj.Label = label
        return obj

    def container(self, path: str = "top.FCStd", name: str = "Top", style: str | None = None) -> Any:
        """A document with one container of the wanted style."""
        return self.add_container(self.document(path), name, style)

    def add_container(self, doc: Any, name: str, style: str | None = None) -> Any:
        style = style or self.style
        if style == ASSEMBLY:
            return doc.addObject("Assembly::AssemblyObject", name)
        part = doc.addObject("App::Part", name)
        part.Type = "Assembly"
        return part

    def sub_assembly(self, bolt: Any, plate: Any) -> Any:
        """sub.FCStd#Sub with two bolts and a plate."""
        sub = self.container("sub.FCStd", "Sub")
        self.link(sub, bolt, "Bolt1")
        self.link(sub, bolt, "Bolt2")
        self.link(sub, plate, "Plate")
        return sub

    # --- what lies in a container -----------------------------------------------------------------------

    def link(
        self,
        where: Any,
        target: Any,
        name: str = "Link",
        count: int = 0,
        show: bool = True,
        kind: str = "App::Link",
    ) -> Any:
        """A link in a container (``newObject``) or in a document (``addObject``)."""
        make = getattr(where, "newObject", None) or where.addObject
        link = make(kind, name)
        if target is not None:
            link.LinkedObject = target
        if count:
            link.ShowElement = show
            link.ElementCount = count
        return link

    def assembly_link(self, where: Any, target: Any, name: str) -> Any:
        link = where.newObject("Assembly::AssemblyLink", name)
        link.LinkedObject = target
        return link

    # --- saving -----------------------------------------------------------------------------------------

    def save(self) -> None:
        """Recompute and save all open documents."""
        for doc in list(App.listDocuments().values()):
            doc.recompute()
        for doc in list(App.listDocuments().values()):
            doc.save()

    def close(self) -> None:
        close_all()

    def reopen(self, path: str) -> Any:
        """Everything saved and closed, and one document opened again."""
        self.save()
        self.close()
        return App.openDocument(str(self.folder / path))


def close_all() -> None:
    for name in list(App.listDocuments()):
        if name in App.listDocuments():
            App.closeDocument(name)


def build(out: Path, wanted: Iterable[str] = ()) -> list[str]:
    """Build all cases that this FreeCAD can; ``<style>/<case>`` of each."""
    document = App.ParamGet("User parameter:BaseApp/Preferences/Document")
    document.SetBool("CreateBackupFiles", False)
    names = set(wanted)
    built = []
    for one in CASES:
        if one.since > VERSION or one.before <= VERSION or (names and one.name not in names):
            continue
        for style in one.styles:
            if style == ASSEMBLY and VERSION < (1, 0):
                continue
            bench = Bench(out / style / one.name, style)
            one.build(bench)
            bench.save()
            close_all()
            built.append(f"{style}/{one.name}")
    return built
