# SPDX-License-Identifier: LGPL-2.1-or-later
"""Warnings about a calculation as a whole: the links, their frames, the link map, the rows of the BOM."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from silo.bom.message import message
from silo.inertia.assembly import Assembly
from silo.inertia.bom.table import BomTable
from silo.inertia.codes import MassCode
from silo.inertia.links.claims import Claims, chosen_frame
from silo.inertia.links.frames import FrameChoice, apart
from silo.inertia.matching import Match, Matching
from silo.inertia.names import plain
from silo.inertia.products import Product
from silo.inertia.reconciliation import unused_kg
from silo.inertia.report import InertiaReport
from silo.inertia.rigid import TensorProblem, tensor_words
from silo.inertia.task import Task

if TYPE_CHECKING:
    from silo.inertia.urdf import Urdf


def check_links_of_urdf(report: InertiaReport, urdf: Urdf) -> None:
    """Warn of links whose mass goes nowhere, or whose frame is unknown."""
    for name, link in report.links.items():
        if name not in urdf.names and link.props.mass > 0:
            words = message(
                "the URDF has no link of this name; its {mass} kg go nowhere", mass=f"{link.props.mass:.6g}"
            )
            report.add_warning(name, "", words, MassCode.LINK_NOT_IN_URDF)
        elif name in urdf.loose and not link.frame.chosen:
            words = message(
                "no joints lead from it to the URDF's root: its frame is not known, and taken for the root's"
            )
            report.add_warning(name, "", words, MassCode.LINK_LOOSE)


def check_other_links(report: InertiaReport, urdf: Urdf) -> None:
    """Warn of links that are not ours, and that no simulator loads: the whole robot fails with them."""
    for name, words in urdf.impossible.items():
        if name not in report.links or report.links[name].props.mass <= 0:
            sentence = message(
                "The link {name} is not ours, and {problem}; it stays as the URDF has it, and simulators "
                "refuse the whole file",
                name=name,
                problem=words,
            )
            report.add_warning("", "", sentence, MassCode.URDF_IMPOSSIBLE)


def check_frames(report: InertiaReport, claims: Claims, task: Task) -> None:
    """Warn if a link map's frame or --frame wins: a URDF would get numbers of another frame."""
    for name in claims.members:
        if name not in task.urdf_frames:
            continue
        frame = chosen_frame(name, claims, task.frame)
        distance, angle = apart(frame.placement, task.urdf_frames[name])
        if distance > FRAME_DISTANCE or angle > FRAME_ANGLE:
            words = message(
                "the numbers are in another frame ({description}) than the link has by the "
                "URDF's joints, {distance} mm and {angle}° away from it",
                description=frame.description,
                distance=f"{distance * 1000.0:.4g}",
                angle=f"{math.degrees(angle):.3g}",
            )
            report.add_warning(name, "", words, MassCode.FRAME_DIFFERS)


def check_far_frames(report: InertiaReport, claims: Claims, task: Task) -> None:
    """Warn of frames that a user wrote, far outside of the assembly.

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
        words = message(
            "the frame of {names} lies {distance} m from the centre of mass, in an assembly of "
            "about {size} m: are its origins in mm? URDFs and link maps are in m",
            names=", ".join(far),
            distance=f"{max(far.values()):.4g}",
            size=f"{size:.3g}",
        )
        report.add_warning("", "", words, MassCode.FRAME_FAR)


FAR = 5.0
"""Sizes of the assembly between a link's frame and its centre of mass, from where a unit is doubted."""

FRAME_DISTANCE, FRAME_ANGLE = 1e-5, 1e-3
"""[m], [rad] up to which two frames are one; URDFs print few digits."""


def check_tensors(report: InertiaReport) -> None:
    """Warn about links that a simulator refuses, or accepts without a word and computes wrongly."""
    for link in report.links.values():
        if TensorProblem.ZERO_MASS in link.problems:
            words = message("the link has no mass; physics engines refuse a moving link without one")
            report.add_warning(link.name, "", words, MassCode.ZERO_MASS_LINK)
            continue
        for problem in link.problems:
            words = message("the link's inertia tensor {problem}", problem=tensor_words([problem]))
            report.add_warning(link.name, "", words, MassCode.BAD_TENSOR)


def check_claims(report: InertiaReport, assembly: Assembly, claims: Claims) -> None:
    """Warn about what the link map left open: unclaimed parts, overlaps, patterns without effect."""
    for part in report.unclaimed:
        many = message("{quantity} pieces, ", quantity=part.quantity) if part.quantity > 1 else ""
        report.add_warning(
            "",
            part.name,
            message(
                "no link claims it ({many}{total_mass} kg, {paths}); it is in no link's mass",
                many=many,
                total_mass=f"{part.total_mass:.6g}",
                paths=part.paths[0],
            ),
            MassCode.UNCLAIMED,
        )
    _check_rooted(report, assembly, claims)
    twice: dict[tuple[str, str, str], list[str]] = {}
    for owner, other, index in claims.twice:
        instance = assembly.instances[index]
        name = assembly.prototypes[instance.prototype].name
        twice.setdefault((owner, other, name), []).append(instance.name)
    for (owner, other, name), paths in twice.items():
        pieces = (
            message("{paths} and {count} more of it", paths=paths[0], count=len(paths) - 1)
            if len(paths) > 1
            else paths[0]
        )
        words = message(
            "{pieces}: {owner} has them by the link map, and {other} claims them as well",
            pieces=pieces,
            owner=owner,
            other=other,
        )
        report.add_warning(other, name, words, MassCode.CLAIMED_TWICE)
    for link, pattern in claims.unused:
        report.add_warning(
            link,
            "",
            message("the pattern “{pattern}” matches nothing", pattern=pattern),
            MassCode.PATTERN_UNUSED,
        )


def _check_rooted(report: InertiaReport, assembly: Assembly, claims: Claims) -> None:
    """Warn of parts that the root link got because no sub-assembly holds them: one warning per product."""
    if not claims.rooted:
        return
    root = next(name for name, ids in claims.members.items() if claims.rooted[0] in ids)
    alone = {assembly.instances[index].name for index in claims.rooted}
    for part in report.links[root].parts:
        paths = [path for path in part.paths if path in alone]
        if paths:
            many = message("{count} pieces, ", count=len(paths)) if len(paths) > 1 else ""
            words = message(
                "no first-level sub-assembly holds it ({many}{kg} kg); it is in the root link "
                "{root}. --loose or --links can say otherwise",
                many=many,
                kg=f"{part.mass * len(paths):.6g}",
                root=root,
            )
            report.add_warning(root, part.name, words, MassCode.IN_ROOT_LINK)


def pieces_of_rows(
    leaves: Sequence[Product], groups: Sequence[Product], matching: Matching
) -> dict[int, int]:
    """Count the pieces that the geometry has of each matched row, by the row's identity."""
    counted: dict[int, int] = {}
    for product, found in _matched(leaves, groups, matching):
        if found is not None:
            counted[id(found.row)] = counted.get(id(found.row), 0) + product.count
    return counted


def _matched(
    leaves: Sequence[Product], groups: Sequence[Product], matching: Matching
) -> list[tuple[Product, Match | None]]:
    return [
        *((product, matching.parts.get(product.key)) for product in leaves),
        *((product, matching.groups.get(product.key)) for product in groups),
    ]


def check_rows(
    report: InertiaReport,
    leaves: Sequence[Product],
    groups: Sequence[Product],
    matching: Matching,
    table: BomTable,
) -> None:
    """Warn of BOM rows that no part uses, and rows whose quantity is not the number of parts."""
    names = {plain(product.name) for product in (*leaves, *groups)}
    for row in matching.unused:
        quantity = (
            message(", quantity {quantity}", quantity=f"{row.quantity:g}") if row.quantity is not None else ""
        )
        why = message("no part in the geometry has this name")
        if plain(row.name) in names:
            why = message("all parts of this name belong to other rows")
        report.add_warning(
            "",
            row.name,
            message(
                "BOM line {line}{quantity}: {why}; its mass is not counted",
                line=row.line,
                quantity=quantity,
                why=why,
            ),
            MassCode.ROW_UNUSED,
            unused_kg(table, row),
        )
    counted = pieces_of_rows(leaves, groups, matching)
    products = _matched(leaves, groups, matching)
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
                message(
                    "the BOM has {said} of it (line {line}), the geometry {count}; the geometry's "
                    "pieces were counted",
                    said=said,
                    line=rows.row.line,
                    count=count,
                ),
                MassCode.COUNT_DIFFERS,
                min(abs(quantity - count) for quantity in wanted) * (rows.row.mass_kg or 0.0) or None,
            )
