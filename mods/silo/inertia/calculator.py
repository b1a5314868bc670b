# SPDX-License-Identifier: LGPL-2.1-or-later
"""The facade with the spec's names: a geometry file and a BOM in, an :class:`InertiaReport` out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.inertia.assembly import Assembly
from silo.inertia.bom.parser import BOMParser
from silo.inertia.bom.table import BOMEntry, as_table
from silo.inertia.calculation import calculate, calculate_claims
from silo.inertia.links.claims import Claims
from silo.inertia.links.frames import FrameChoice
from silo.inertia.links.link_map import LinkMap, as_link_map
from silo.inertia.masses import Options
from silo.inertia.materials.files import plain_densities
from silo.inertia.materials.table import MaterialTable, load_materials
from silo.inertia.report import InertiaReport
from silo.inertia.task import Task
from silo.inertia.types import InertialProperties

if TYPE_CHECKING:
    from silo.inertia.geometry import ReadOptions


MATERIAL_DENSITIES: Mapping[str, float] = plain_densities()
"""The package's table of materials as plain values [kg/m^3] (spec bom-inertia, Task 3)."""


@dataclass(eq=False)
class InertiaCalculator:
    """Mass properties of STEP (and mesh, and FCStd) files; spec bom-inertia, Task 4.

    default_density
        [kg/m^3] of parts that the BOM does not have.
    materials
        the density table; the package's own by default.
    step_density
        use densities that the geometry file states before the default.
    """

    default_density: float = 1000.0
    _: KW_ONLY
    materials: MaterialTable = field(default_factory=load_materials)
    step_density: bool = False
    read_options: ReadOptions | None = None

    @property
    def task(self) -> Task:
        """Return the calculator's choices as a :class:`Task`."""
        return Task(self.materials, Options(self.default_density, self.step_density))

    def compute_from_step(self, step_path: Path | str) -> InertialProperties:
        """Calculate the whole file as one body at the default density, in the file's frame."""
        assembly = read_geometry(step_path, self.read_options)
        name = assembly.name or "assembly"
        report = calculate_claims(assembly, None, self.task, _everything(assembly, name), InertiaReport())
        return report.link_properties[name]

    def compute_from_step_with_bom(
        self,
        step_path: Path | str,
        bom_entries: Mapping[str, BOMEntry],
        link_name: str,
        report: InertiaReport,
    ) -> InertialProperties:
        """Calculate the whole file as one link, with masses by the BOM. Adds results and warnings to
        ``report``.

        ``bom_entries``: a table of :class:`BOMParser` (then all rows are used), or any mapping name → entry.
        """
        assembly = read_geometry(step_path, self.read_options)
        claims = _everything(assembly, link_name)
        inertia_report = calculate_claims(assembly, as_table(bom_entries), self.task, claims, InertiaReport())
        report.links.update(inertia_report.links)
        report.link_properties.update(inertia_report.link_properties)
        for w in inertia_report.warnings:
            report.add_warning(w.link_name or link_name, w.part_name, w.message, w.code)
        return inertia_report.link_properties[link_name]


EnhancedInertiaCalculator = InertiaCalculator
"""The name that the spec has for it (bom-inertia, "Architecture")."""


def compute_link_inertials(
    step_path: Path | str,
    bom_path: Path | str | Mapping[str, BOMEntry] | None = None,
    *,
    links: LinkMap | Mapping[str, Any] | Path | str | None = None,
    density: float = 1000.0,
    materials: MaterialTable | None = None,
    step_density: bool = False,
    frame: FrameChoice | str = FrameChoice.ASSEMBLY,
    read_options: ReadOptions | None = None,
) -> InertiaReport:
    """Calculate every link of an assembly file (spec bom-inertia, Task 5).

    bom_path
        a file, or the table that :class:`BOMParser` read.
    links
        a link map, its file, or a dict of link → patterns; None: each first-level sub-assembly is a link.
    density
        [kg/m^3] of parts that the BOM does not list.

    Numbers are in the assembly's frame unless ``frame`` or the link map says otherwise.
    """
    table = None
    if bom_path is not None:
        table = as_table(bom_path) if isinstance(bom_path, Mapping) else BOMParser().parse(bom_path)
    task = Task(
        materials if materials is not None else load_materials(),
        Options(density, step_density),
        as_link_map(links),
        FrameChoice(frame),
    )
    return calculate(read_geometry(step_path, read_options), table, task)


def read_geometry(path: Path | str, options: ReadOptions | None = None) -> Assembly:
    """Read the geometry of a STEP, mesh or FCStd file. The kernel is imported only here."""
    from silo.inertia import geometry

    return geometry.read(path) if options is None else geometry.read(path, options=options)


def _everything(assembly: Assembly, name: str) -> Claims:
    return Claims({name: tuple(range(len(assembly.instances)))})
