# SPDX-License-Identifier: LGPL-2.1-or-later
"""The facade: a geometry file and a BOM in, an :class:`InertiaReport` out. The spec's names stand here."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from silo.bom.errors import InputError
from silo.inertia.aggregate import chosen_frame, fill_links, tell_bom, tell_claims, tell_rows, tell_tensors
from silo.inertia.bom import BOMEntry, BOMParser, BomTable, as_table
from silo.inertia.bom.masses import parse_mass
from silo.inertia.codes import MassCode
from silo.inertia.core import Floats, InertialProperties
from silo.inertia.links import (
    ROOT_LINK,
    Claims,
    FrameChoice,
    LinkFrame,
    LinkMap,
    apart,
    as_link_map,
    claim,
    components,
    word_of,
)
from silo.inertia.masses import MassRule, Options
from silo.inertia.matching import Suggester, match
from silo.inertia.materials import MaterialHit, MaterialTable, load_materials
from silo.inertia.model import Assembly, Prototype, leaf_products, sub_assemblies
from silo.inertia.placed import place_all, weighed
from silo.inertia.report import InertiaReport

if TYPE_CHECKING:
    from silo.inertia.geometry import ReadOptions
    from silo.inertia.output.urdf import Urdf


@dataclass(frozen=True, eq=False)
class Task:
    """Everything a calculation depends on besides geometry and BOM.

    frame
        which frame the links' numbers are given in; a link map's own word wins.
    urdf
        what is to be filled: ours are named after its links, and its frames are used if ``frame`` is URDF,
        else compared with.
    loose_link
        a link that takes what no other claims; None: a map leaves such parts unclaimed.
    weights
        link or pattern of components → what one weighs, as a text with its unit; a link map's own come after.
    simulated
        the links go to a simulator: warn of those that it would refuse.
    """

    materials: MaterialTable = field(default_factory=load_materials)
    options: Options = field(default_factory=Options)
    links: LinkMap | Mapping[str, Any] | None = None
    frame: FrameChoice = FrameChoice.ASSEMBLY
    urdf: Urdf | None = None
    loose_link: str | None = None
    simulated: bool = True
    weights: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.frame is FrameChoice.URDF and self.urdf is not None and self.urdf.problem:
            raise InputError(self.urdf.problem)

    @property
    def urdf_frames(self) -> Mapping[str, Floats]:
        """Return link → (4, 4) placement in the assembly's frame, by the URDF."""
        return self.urdf.frames if self.urdf is not None else {}


def calculate(assembly: Assembly, table: BomTable | None, task: Task | None = None) -> InertiaReport:
    """Return the mass properties of every link of an assembly. Pure: nothing is read or written."""
    task = task or Task()
    urdf = task.urdf
    root = urdf.root if urdf is not None else ROOT_LINK
    claims = _gathered(claim(assembly, as_link_map(task.links), task.loose_link or root), task.loose_link)
    claims = _framed(_named_alike(claims, urdf.names if urdf is not None else ()), task)
    report = InertiaReport()
    _tell_frames(report, claims, task)
    report = _run(assembly, table, task, claims, report)
    _tell_far_frames(report, claims, task)
    if urdf is not None:
        _tell_lost_links(report, urdf)
    return report


def _tell_lost_links(report: InertiaReport, urdf: Urdf) -> None:
    """Warn of links whose mass goes nowhere, or whose frame nobody knows."""
    for name, link in report.links.items():
        if name not in urdf.names and link.props.mass > 0:
            words = f"the URDF has no link of this name; its {link.props.mass:.6g} kg go nowhere"
            report.add_warning(name, "", words, MassCode.LINK_NOT_IN_URDF)
        elif name in urdf.loose and not link.frame.chosen:
            words = (
                "no joints lead from it to the URDF's root: its frame is not known, and taken for the root's"
            )
            report.add_warning(name, "", words, MassCode.LINK_LOOSE)


def _named_alike(claims: Claims, urdf_links: tuple[str, ...]) -> Claims:
    """Name links as the URDF does if both mean the same word, as in a starting map ("Arm", "arm link")."""
    free = {name: word_of(name) for name in urdf_links if name not in claims.members}
    ours = Counter(word_of(name) for name in claims.members if name not in urdf_links)
    new: dict[str, str] = {}
    for name in claims.members:
        same = [other for other, word in free.items() if word == word_of(name)]
        if name not in urdf_links and len(same) == 1 and ours[word_of(name)] == 1:
            new[name] = same[0]
    members = {new.get(name, name): ids for name, ids in claims.members.items()}
    frames = {new.get(name, name): frame for name, frame in (claims.frames or {}).items()}
    return replace(claims, members=members, frames=frames)


def _tell_frames(report: InertiaReport, claims: Claims, task: Task) -> None:
    """Warn if a link map's frame or --frame wins: a URDF would get numbers of another frame."""
    for name in claims.members:
        if name not in task.urdf_frames:
            continue
        frame = chosen_frame(name, claims, task.frame)
        distance, angle = apart(frame.placement, task.urdf_frames[name])
        if distance > FRAME_DISTANCE or angle > FRAME_ANGLE:
            words = (
                f"the numbers are in another frame ({frame.description}) than the link has by the URDF's "
                f"joints, {distance * 1e3:.4g} mm and {math.degrees(angle):.3g}° away from it"
            )
            report.add_warning(name, "", words, MassCode.FRAME_DIFFERS)


def _tell_far_frames(report: InertiaReport, claims: Claims, task: Task) -> None:
    """Warn of frames that a person wrote, far outside of the assembly.

    Millimetres where metres are wanted.
    """
    for words in task.urdf.doubts if task.urdf is not None else ():
        report.add_warning("", "", words, MassCode.FRAME_FAR)
    if report.total is None or report.total.mass <= 0:
        return
    size = 2 * math.sqrt(float(np.abs(report.total.inertia).max()) / report.total.mass)
    far = {}
    for name, link in report.links.items():
        written = link.frame.chosen or (task.frame is FrameChoice.URDF and name in task.urdf_frames)
        distance = float(np.linalg.norm(link.props.com))
        if written and link.props.mass > 0 and distance > FAR * size:
            far[name] = distance
    if far:
        words = (
            f"the frame of {', '.join(far)} lies {max(far.values()):.4g} m from the centre of mass, in an "
            f"assembly of about {size:.3g} m: are its origins in mm? URDFs and link maps are in m"
        )
        report.add_warning("", "", words, MassCode.FRAME_FAR)


FAR = 5.0
"""Sizes of the assembly between a link's frame and its centre of mass, from where a unit is doubted."""

FRAME_DISTANCE, FRAME_ANGLE = 1e-5, 1e-3
"""[m], [rad] up to which two frames are one; URDFs print few digits."""


def _run(
    assembly: Assembly, table: BomTable | None, task: Task, claims: Claims, report: InertiaReport
) -> InertiaReport:
    assembly = _with_stated_densities(assembly, task.materials)
    rows = table if table is not None else BomTable(())
    suggester = Suggester(row.name for row in rows.rows)
    rule = MassRule(task.materials, task.options, suggester, table is not None)

    def density(row: BOMEntry, product: object) -> float | None:
        found = rule.density_of(row.material)
        return found if found is not None else getattr(product, "density", None)

    leaves, groups = leaf_products(assembly), sub_assemblies(assembly)
    matching = match(leaves, groups, rows, density)
    placed, doubts = weighed(place_all(assembly, rule, matching), _weights(task, assembly, claims))
    report.assembly, report.source = assembly.name, assembly.source
    report.bom = rows.source
    report.default_density = task.options.default_density
    tell_bom(report, rows)
    for problem in assembly.problems:
        report.add_warning("", "", problem.message, problem.code)
    for doubt in doubts:
        report.add_warning("", "", doubt.message, doubt.code)
    fill_links(report, assembly, placed, claims, task.frame)
    if task.simulated:
        tell_tensors(report)
    tell_claims(report, assembly, claims)
    tell_rows(report, leaves, groups, matching)
    return report


def _weights(task: Task, assembly: Assembly, claims: Claims) -> list[tuple[str, Sequence[int], float]]:
    """What was weighed, components before the links around them. InputError for what is no mass."""
    links = as_link_map(task.links)
    given = {link.name: link.mass for link in (links.links if links else ()) if link.mass} | dict(
        task.weights
    )
    of_links, of_parts, bad = [], [], []
    for name, text in given.items():
        cell = parse_mass(text, unit="kg")
        if cell.kg is None or not cell.kg > 0:
            bad.append(f"{name}: wanted a mass above zero such as 1.25 kg, got “{text}”")
        elif name in claims.members:
            of_links.append((name, claims.members[name], cell.kg))
        else:
            groups = components(name, assembly.instances) or [[]]
            of_parts += [(name, group, cell.kg) for group in groups]
    if bad:
        raise InputError("; ".join(bad))
    return [*sorted(of_parts, key=lambda group: len(group[1])), *of_links]


def _gathered(claims: Claims, loose: str | None) -> Claims:
    if loose is None:
        return claims
    if not claims.unclaimed:
        return replace(claims, rooted=())  # the caller named the link: nothing to warn of
    members = dict(claims.members)
    members[loose] = tuple(sorted((*members.get(loose, ()), *claims.unclaimed)))
    return replace(claims, members=members, unclaimed=())


def _framed(claims: Claims, task: Task) -> Claims:
    if task.frame is not FrameChoice.URDF:
        return claims
    frames = dict(claims.frames or {})
    for name in claims.members:
        if name in task.urdf_frames and not claims.frame(name).chosen:
            placement = task.urdf_frames[name]
            frames[name] = LinkFrame(placement, "link frame of the URDF at joint position zero")
    return replace(claims, frames=frames)


def _with_stated_densities(assembly: Assembly, materials: MaterialTable) -> Assembly:
    """Give a material that the geometry file names without a density that of the table."""

    def complete(prototype: Prototype) -> Prototype:
        if prototype.step_density is not None or not prototype.step_material:
            return prototype
        answer = materials.find(prototype.step_material)
        if isinstance(answer, MaterialHit) and not answer.doubt:
            return replace(prototype, step_density=answer.material.density)
        return prototype

    return replace(assembly, prototypes={key: complete(p) for key, p in assembly.prototypes.items()})


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
        """Return the whole file as one body at the default density, in the file's frame."""
        assembly = read_geometry(step_path, self.read_options)
        name = assembly.name or "assembly"
        report = _run(assembly, None, self.task, _everything(assembly, name), InertiaReport())
        return report.link_properties[name]

    def compute_from_step_with_bom(
        self,
        step_path: Path | str,
        bom_entries: Mapping[str, BOMEntry],
        link_name: str,
        report: InertiaReport,
    ) -> InertialProperties:
        """Return the whole file as one link, masses by BOM; results and warnings go into ``report`` as well.

        ``bom_entries``: what :class:`BOMParser` gives (all rows are used then), or any mapping name → entry.
        """
        assembly = read_geometry(step_path, self.read_options)
        claims = _everything(assembly, link_name)
        one = _run(assembly, as_table(bom_entries), self.task, claims, InertiaReport())
        report.links.update(one.links)
        report.link_properties.update(one.link_properties)
        for w in one.warnings:
            report.add_warning(w.link_name or link_name, w.part_name, w.message, w.code)
        return one.link_properties[link_name]


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
    """Return every link of an assembly file (spec bom-inertia, Task 5).

    bom_path
        a file, or what :class:`BOMParser` made of one.
    links
        a link map, its file, or a dict of link → patterns; None: each first-level sub-assembly is a link.
    density
        [kg/m^3] of parts that the BOM does not have.

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
    """Return the geometry of a STEP, mesh or FCStd file; the kernel is imported only now."""
    from silo.inertia import geometry

    return geometry.read(path) if options is None else geometry.read(path, options=options)


def _everything(assembly: Assembly, name: str) -> Claims:
    return Claims({name: tuple(range(len(assembly.instances)))})
