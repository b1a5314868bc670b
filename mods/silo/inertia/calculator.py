# SPDX-License-Identifier: LGPL-2.1-or-later
"""The facade: a geometry file and a BOM in, an :class:`InertiaReport` out. The spec's names stand here.

Instances become links: sums in the link's frame, parts with their sources, all warnings. The sum over one
link is one vectorised expression; 10 000 instances take milliseconds.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from silo.bom.errors import InputError
from silo.inertia.arrays import Floats
from silo.inertia.assembly import Assembly, Prototype
from silo.inertia.bom.mass_cell import parse_mass
from silo.inertia.bom.parser import BOMParser
from silo.inertia.bom.table import BOMEntry, BomTable, as_table
from silo.inertia.links import (
    ASSEMBLY_FRAME,
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
from silo.inertia.masses import MassRule, Options, Placed, PlacedAssembly, place_all, weighed
from silo.inertia.matching import Matching, Suggester, match, plain
from silo.inertia.materials import MaterialHit, MaterialTable, load_materials
from silo.inertia.placements import is_rigid
from silo.inertia.products import Product, leaf_products, sub_assemblies
from silo.inertia.report import (
    InertiaReport,
    LinkResult,
    MassCode,
    PartResult,
    PartWarning,
    SubAssemblyResult,
)
from silo.inertia.rigid import MassProps, TensorProblem, combine_arrays, tensor_words
from silo.inertia.types import InertialProperties

if TYPE_CHECKING:
    from silo.inertia.geometry import ReadOptions
    from silo.inertia.urdf import Urdf


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
        """Return link → (4, 4) placement in the assembly's frame, as the URDF has it."""
        return self.urdf.frames if self.urdf is not None else {}


def calculate(assembly: Assembly, table: BomTable | None, task: Task | None = None) -> InertiaReport:
    """Calculate the mass properties of every link of an assembly. Pure: nothing is read or written."""
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
    """Warn of links whose mass goes nowhere, or whose frame is unknown."""
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
    """Name links as the URDF does if both names are the same word, as in a starting map ("Arm", "arm
    link").
    """
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

    The person probably wrote millimetres instead of metres.
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
        stated_density = rule.density_of(row.material)
        return stated_density if stated_density is not None else getattr(product, "density", None)

    leaves, groups = leaf_products(assembly), sub_assemblies(assembly)
    matching = match(leaves, groups, rows, density)
    placed, doubts = weighed(place_all(assembly, rule, matching), _weights(task, assembly, claims))
    report.assembly, report.source = assembly.name, assembly.source
    report.bom = rows.source
    report.default_density = task.options.default_density
    for warning in rows.warnings:
        report.add_warning("", warning.name, f"BOM {warning}", warning.code)
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
    """Return the weighed groups, components before the links that hold them. InputError for a text that is no
    mass.
    """
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
    """Look up the density of each material that the geometry file names without one."""

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
        """Calculate the whole file as one body at the default density, in the file's frame."""
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
        """Calculate the whole file as one link, with masses by the BOM. Adds results and warnings to
        ``report``.

        ``bom_entries``: a table of :class:`BOMParser` (then all rows are used), or any mapping name → entry.
        """
        assembly = read_geometry(step_path, self.read_options)
        claims = _everything(assembly, link_name)
        inertia_report = _run(assembly, as_table(bom_entries), self.task, claims, InertiaReport())
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


def sum_up(placed: Placed, indices: Sequence[int]) -> MassProps:
    """Combine the mass properties of these instances, in the assembly's frame."""
    index = np.asarray(indices, np.intp)
    return combine_arrays(placed.mass[index], placed.com[index], placed.inertia(index))


def fill_links(
    report: InertiaReport, assembly: Assembly, placed: Placed, claims: Claims, choice: FrameChoice
) -> None:
    """Put every link and the unclaimed parts into the report, warnings included."""
    for name, indices in claims.members.items():
        frame = chosen_frame(name, claims, choice)
        words = frame.description if frame is ASSEMBLY_FRAME else f"{frame.description} ({name})"
        props = sum_up(placed, indices).transformed(frame.inverse(), words)
        parts = tuple(_parts(assembly, placed, indices, name))
        link = LinkResult(name, props, frame, parts, props.check())
        report.links[name] = link
        report.link_properties[name] = props.to_inertial()
        _part_warnings(report, parts)
    report.unclaimed = tuple(_parts(assembly, placed, claims.unclaimed, ""))
    _part_warnings(report, report.unclaimed)
    report.sub_assemblies = tuple(_sub_assemblies(assembly, placed))
    total = sum_up(placed, range(len(assembly.instances)))
    report.total = replace(total, frame=ASSEMBLY_FRAME.description)


def _sub_assemblies(assembly: Assembly, placed: Placed) -> Iterator[SubAssemblyResult]:
    """Yield the masses of placed sub-assemblies, one for each BOM row, in the order of the rows."""
    by_row: dict[int, list[PlacedAssembly]] = {}
    for occurrence in placed.groups:
        by_row.setdefault(id(occurrence.match.row), []).append(occurrence)
    for occurrences in sorted(by_row.values(), key=lambda of_row: of_row[0].match.row.line):
        row = occurrences[0].match.row
        shapes = [_shape(assembly, placed, occurrence) for occurrence in occurrences]
        volume, com = shapes[0]
        same = all(np.allclose(volume, v, rtol=1e-9, atol=0) for v, _ in shapes)
        same_com = com is not None and all(
            c is not None and np.allclose(com, c, atol=1e-9) for _, c in shapes
        )
        yield SubAssemblyResult(
            name=row.name,
            part_number=row.part_number,
            paths=tuple("/".join(occurrence.path) for occurrence in occurrences),
            mass=row.mass_kg or 0.0,
            quantum=row.quantum_kg,
            agrees=all(occurrence.agrees for occurrence in occurrences),
            line=row.line,
            doubtful=row.unsure or any(bool(o.match.doubt) or o.implausible for o in occurrences),
            volume=volume if same and volume > 0 else None,
            com=tuple(com.tolist()) if same and same_com and com is not None else None,
        )


def _shape(assembly: Assembly, placed: Placed, occurrence: PlacedAssembly) -> tuple[float, Floats | None]:
    """Return the volume [m^3] of a placed sub-assembly, and its centre of mass (3,) [m] in its own axes."""
    volume = float(placed.volume[list(occurrence.below)].sum())
    frame = assembly.frames.get(occurrence.path)
    props = sum_up(placed, occurrence.below)
    if frame is None or not is_rigid(frame) or np.linalg.det(frame[:3, :3]) < 0 or props.mass <= 0:
        return volume, None
    return volume, props.transformed(LinkFrame(frame, "").inverse()).com


def chosen_frame(name: str, claims: Claims, choice: FrameChoice) -> LinkFrame:
    """Return the frame in which a link's numbers are given: that of the map, else the run's choice."""
    frame = claims.frame(name)
    if not frame.chosen and choice is FrameChoice.ASSEMBLY:
        return ASSEMBLY_FRAME
    turn = frame.placement[:3, :3]
    if not is_rigid(frame.placement) or np.linalg.det(turn) < 0:
        raise InputError(
            f"link {name}: its frame ({frame.description}) is mirrored or scaled; choose another one"
        )
    return frame


def _parts(assembly: Assembly, placed: Placed, indices: Iterable[int], link: str) -> Iterator[PartResult]:
    """Group the pieces with the same name, size, mass and source of mass, even if they are different
    products.

    In many files, the fourteen balls of a bearing are fourteen products; a person wants to see one line.
    """
    groups: dict[tuple[object, ...], list[int]] = {}
    for index in indices:
        if placed.counted[index]:
            product = assembly.prototypes[assembly.instances[index].prototype]
            size = (f"{placed.volume[index]:.9g}", f"{placed.mass[index]:.9g}")
            key = (product.name, product.part_number, product.problems, placed.decisions[index], *size)
            groups.setdefault(key, []).append(index)
    for members in groups.values():
        yield _part(assembly, placed, members, link)


def _part(assembly: Assembly, placed: Placed, members: Sequence[int], link: str) -> PartResult:
    instances = [assembly.instances[index] for index in members]
    products = [assembly.prototypes[key] for key in dict.fromkeys(i.prototype for i in instances)]
    product, decision = products[0], placed.decisions[members[0]]
    mass, volume = float(placed.mass[members[0]]), float(placed.volume[members[0]])
    same_axes = all(np.allclose(p.com_m, product.com_m, rtol=1e-9, atol=1e-9) for p in products)
    implied = mass / volume if volume > 0 else None
    notes = (*decision.notes, *product.problems)
    return PartResult(
        name=product.name,
        paths=tuple(instance.name for instance in instances),
        mass=mass,
        volume=volume,
        com=tuple(product.com_m.tolist()) if same_axes else None,
        source=decision.source,
        rule=decision.rule,
        decided_by=decision.decided,
        material=decision.material,
        material_name=decision.material_name,
        density=decision.density if decision.density is not None else implied,
        density_source=decision.density_source,
        quantum=decision.quantum_kg,
        part_number=decision.part_number or product.part_number or "",
        lines=decision.lines,
        products=tuple(p.key for p in products),
        warnings=tuple(PartWarning(link, product.name, note.message, note.code) for note in notes),
    )


def _part_warnings(report: InertiaReport, parts: Iterable[PartResult]) -> None:
    for part in parts:
        for warning in part.warnings:
            report.add_warning(warning.link_name, warning.part_name, warning.message, warning.code)


def tell_tensors(report: InertiaReport) -> None:
    """Warn about links that a simulator refuses, or accepts without a word and computes wrongly."""
    for link in report.links.values():
        if TensorProblem.ZERO_MASS in link.problems:
            words = "the link has no mass; physics engines refuse a moving link without one"
            report.add_warning(link.name, "", words, MassCode.ZERO_MASS_LINK)
            continue
        for problem in link.problems:
            words = f"the link's inertia tensor {tensor_words([problem])}"
            report.add_warning(link.name, "", words, MassCode.BAD_TENSOR)


def tell_claims(report: InertiaReport, assembly: Assembly, claims: Claims) -> None:
    """Warn about what the link map left open: unclaimed parts, overlaps, patterns without effect."""
    for part in report.unclaimed:
        many = f"{part.quantity} pieces, " if part.quantity > 1 else ""
        report.add_warning(
            "",
            part.name,
            f"no link claims it ({many}{part.total_mass:.6g} kg, {part.paths[0]}); it is in no link's mass",
            MassCode.UNCLAIMED,
        )
    _tell_rooted(report, assembly, claims)
    twice: dict[tuple[str, str, str], list[str]] = {}
    for owner, other, index in claims.twice:
        instance = assembly.instances[index]
        name = assembly.prototypes[instance.prototype].name
        twice.setdefault((owner, other, name), []).append(instance.name)
    for (owner, other, name), paths in twice.items():
        pieces = f"{paths[0]} and {len(paths) - 1} more of it" if len(paths) > 1 else paths[0]
        words = f"{pieces}: {owner} has them by the link map, and {other} claims them as well"
        report.add_warning(other, name, words, MassCode.CLAIMED_TWICE)
    for link, pattern in claims.unused:
        report.add_warning(link, "", f"the pattern “{pattern}” matches nothing", MassCode.PATTERN_UNUSED)


def _tell_rooted(report: InertiaReport, assembly: Assembly, claims: Claims) -> None:
    """Warn of parts that the root link got because no sub-assembly holds them: one warning per product."""
    if not claims.rooted:
        return
    root = next(name for name, ids in claims.members.items() if claims.rooted[0] in ids)
    alone = {assembly.instances[index].name for index in claims.rooted}
    for part in report.links[root].parts:
        paths = [path for path in part.paths if path in alone]
        if paths:
            many = f"{len(paths)} pieces, " if len(paths) > 1 else ""
            words = (
                f"no first-level sub-assembly holds it ({many}{part.mass * len(paths):.6g} kg); it is in the "
                f"root link {root}. --loose or --links can say otherwise"
            )
            report.add_warning(root, part.name, words, MassCode.IN_ROOT_LINK)


def tell_rows(
    report: InertiaReport, leaves: Sequence[Product], groups: Sequence[Product], matching: Matching
) -> None:
    """Warn of BOM rows that no part uses, and rows whose quantity is not the number of parts."""
    names = {plain(product.name) for product in (*leaves, *groups)}
    for row in matching.unused:
        quantity = f", quantity {row.quantity:g}" if row.quantity is not None else ""
        why = "no part in the geometry has this name"
        if plain(row.name) in names:
            why = "all parts of this name belong to other rows"
        report.add_warning(
            "",
            row.name,
            f"BOM line {row.line}{quantity}: {why}; its mass is not counted",
            MassCode.ROW_UNUSED,
        )
    counted: dict[int, int] = {}
    products = [
        *((product, matching.parts.get(product.key)) for product in leaves),
        *((product, matching.groups.get(product.key)) for product in groups),
    ]
    for product, rows in products:
        if rows is not None:
            counted[id(rows.row)] = counted.get(id(rows.row), 0) + product.count
    shown_rows: set[int] = set()
    for product, rows in products:
        if rows is None or id(rows.row) in shown_rows:
            continue
        shown_rows.add(id(rows.row))
        count, wanted = counted[id(rows.row)], rows.bundle.quantities
        if wanted and count not in wanted:
            said = " or ".join(f"{quantity:g}" for quantity in sorted(wanted))
            report.add_warning(
                "",
                product.name,
                f"the BOM has {said} of it (line {rows.row.line}), the geometry {count}; "
                "the geometry's pieces were counted",
                MassCode.COUNT_DIFFERS,
            )
