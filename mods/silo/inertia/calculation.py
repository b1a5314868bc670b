# SPDX-License-Identifier: LGPL-2.1-or-later
"""A calculation: an assembly, a BOM and a task in, a report out. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from silo.bom.errors import InputError
from silo.bom.message import Message, message
from silo.inertia.assembly import Assembly, Prototype
from silo.inertia.bom.mass_cell import parse_mass
from silo.inertia.bom.table import BOMEntry, BomTable
from silo.inertia.checks import (
    check_claims,
    check_far_frames,
    check_frames,
    check_links_of_urdf,
    check_other_links,
    check_rows,
    check_tensors,
    pieces_of_rows,
)
from silo.inertia.links.claims import ROOT_LINK, Claims, claim
from silo.inertia.links.frames import FrameChoice, LinkFrame
from silo.inertia.links.link_map import as_link_map
from silo.inertia.links.patterns import components
from silo.inertia.links.starting_map import word_of
from silo.inertia.masses import MassRule, place_all, weighed
from silo.inertia.matching import Matching, match
from silo.inertia.materials.material import MaterialHit
from silo.inertia.materials.table import MaterialTable
from silo.inertia.names import Suggester
from silo.inertia.notes import GeometryCode
from silo.inertia.products import leaf_products, sub_assemblies
from silo.inertia.reconciliation import reconciled
from silo.inertia.report import InertiaReport
from silo.inertia.results import fill_links
from silo.inertia.task import Task
from silo.inertia.unit_doubts import meant_unit


def calculate(assembly: Assembly, table: BomTable | None, task: Task | None = None) -> InertiaReport:
    """Calculate the mass properties of every link of an assembly. Pure: nothing is read or written."""
    task = task or Task()
    urdf = task.urdf
    root = urdf.root if urdf is not None else ROOT_LINK
    claims = _gathered(claim(assembly, as_link_map(task.links), task.loose_link or root), task.loose_link)
    claims = _framed(_named_alike(claims, urdf.names if urdf is not None else ()), task)
    report = InertiaReport()
    check_frames(report, claims, task)
    report = calculate_claims(assembly, table, task, claims, report)
    check_far_frames(report, claims, task)
    if urdf is not None:
        check_links_of_urdf(report, urdf)
        check_other_links(report, urdf)
    return report


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


def calculate_claims(
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
        report.add_warning("", warning.name, message("BOM {warning}", warning=warning), warning.code)
    for problem in assembly.problems:
        report.add_warning("", "", problem.message, problem.code)
    for doubt in doubts:
        report.add_warning("", "", doubt.message, doubt.code)
    if (unit := _meant_unit(assembly, rule, matching)) is not None:
        report.add_warning("", "", unit, GeometryCode.UNITS)
    fill_links(report, assembly, placed, claims, task.frame)
    if table is not None:
        pieces = pieces_of_rows(leaves, groups, matching)
        report.reconciliation = reconciled(assembly, table, matching, placed, pieces)
    if task.simulated:
        check_tensors(report)
    check_claims(report, assembly, claims)
    check_rows(report, leaves, groups, matching, rows)
    return report


def _meant_unit(assembly: Assembly, rule: MassRule, matching: Matching) -> Message | None:
    masses = []
    for key, found in matching.parts.items():
        prototype = assembly.prototypes.get(key)
        if prototype is not None and found.row.mass_kg is not None:
            stated = rule.density_of(found.row.material)
            density = stated if stated is not None else prototype.step_density
            masses.append((found.row.mass_kg, prototype.volume_m3, density))
    return meant_unit(assembly.prototypes, masses)


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
            bad.append(
                message(
                    "{name}: wanted a mass above zero such as 1.25 kg, got “{text}”", name=name, text=text
                )
            )
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
            frames[name] = LinkFrame(placement, message("link frame of the URDF at joint position zero"))
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
