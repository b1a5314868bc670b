# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as one HTML page that needs nothing else: a 3D view, masses by source, warnings, tables.

The page holds three.js, the GLB, and a PNG for browsers without WebGL. It loads nothing from anywhere, and
its content security policy says so.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterable, Sequence
from functools import cache
from importlib import resources
from typing import Any

from silo.inertia.codes import Source
from silo.inertia.model import Assembly
from silo.inertia.output.text import NOISE, SOURCE_WORDS, how, material_of
from silo.inertia.preview.glb import write_glb
from silo.inertia.preview.picture import write_picture
from silo.inertia.preview.scene import UNCLAIMED, Colour, LinkView, colour_of, meshes_of, views_of
from silo.inertia.report import InertiaReport, LinkResult, PartResult, PartWarning
from silo.inertia.wording import counted

_SOURCE_COLOURS = {
    Source.BOM_MASS: "#2f7d4f",
    Source.MATERIAL: "#3d7ac0",
    Source.SUB_ASSEMBLY_MASS: "#7fb7d6",
    Source.STEP_DENSITY: "#8b79c9",
    Source.DEFAULT_DENSITY: "#d9982f",
    Source.ZERO: "#b42318",
}


def report_html(report: InertiaReport, assembly: Assembly) -> str:
    """The page, as text."""
    views = views_of(report, assembly)
    shapes = bool(meshes_of(assembly, views))
    glb = base64.b64encode(write_glb(assembly, views)).decode() if shapes else ""
    png = base64.b64encode(write_picture(assembly, views)).decode() if shapes else ""
    page = _file("report.html")
    for mark, text in (
        ("/*THREE*/", _file("three.min.js") if shapes else ""),
        ("/*VIEWER*/", _file("report.js")),
        ("/*GLB*/", glb),
        ("/*PNG*/", png),
        # Last: what a file says must not be searched for marks.
        ("/*DATA*/", _json(_data(report, views, shapes))),
    ):
        head, _, tail = page.partition(mark)
        page = head + text + tail
    return page


@cache
def _file(name: str) -> str:
    return (resources.files("silo.inertia.preview") / "viewer" / name).read_text("utf-8")


def _json(data: Any) -> str:
    """JSON that cannot end the element it stands in."""
    return json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _data(report: InertiaReport, views: Sequence[LinkView], shapes: bool) -> dict[str, Any]:
    parts = report.parts()
    return {
        "name": report.assembly or "the assembly",
        "facts": list(_facts(report)),
        "shapes": shapes,
        "views": [
            {
                "name": view.name,
                "colour": _hex(UNCLAIMED if view.props is None and not view.name else colour_of(number)),
                "mass": None if view.props is None else _finite(view.props.mass),
            }
            for number, view in enumerate(views)
        ],
        "sources": _sources([part for _, part in parts]),
        "warnings": _warnings(report),
        "links": [_link(link) for link in report.links.values()],
        "parts": [_part(link, part) for link, part in parts],
    }


def _facts(report: InertiaReport) -> Iterable[str]:
    if report.total is not None:
        yield f"{report.total.mass:.6g} kg"
    yield counted(len(report.links), "link")
    yield counted(sum(part.quantity for _, part in report.parts()), "part")
    yield f"geometry: {report.source or 'unknown'}"
    yield f"BOM: {report.bom or 'none'}"
    if report.unclaimed:
        loose = sum(part.total_mass for part in report.unclaimed)
        yield f"in no link: {loose:.6g} kg"


def _sources(parts: Sequence[PartResult]) -> list[dict[str, Any]]:
    rows = []
    for source in Source:
        of_it = [part for part in parts if part.source is source]
        if of_it:
            rows.append(
                {
                    "name": SOURCE_WORDS[source],
                    "colour": _SOURCE_COLOURS[source],
                    "mass": _finite(sum(part.total_mass for part in of_it)),
                    "pieces": sum(part.quantity for part in of_it),
                }
            )
    return rows


def _warnings(report: InertiaReport) -> list[dict[str, Any]]:
    """By code; those that concern the most mass first."""
    masses: dict[tuple[str, str], float] = {}
    for link, part in report.parts():
        masses[link, part.name] = masses.get((link, part.name), 0.0) + part.total_mass
    groups: dict[str, list[PartWarning]] = {}
    for warning in report.warnings:
        groups.setdefault(str(warning.code), []).append(warning)
    rows = []
    for code, warnings in groups.items():
        places = {(w.link_name, w.part_name) for w in warnings}
        rows.append(
            {
                "title": code.replace("_", " "),
                "mass": _finite(sum(masses.get(place, 0.0) for place in places)),
                "items": [
                    {
                        "where": " / ".join(w for w in (one.link_name, one.part_name) if w),
                        "message": one.message,
                    }
                    for one in warnings
                ],
            }
        )
    return sorted(rows, key=lambda row: -(row["mass"] or 0.0))


def _link(link: LinkResult) -> dict[str, Any]:
    t = link.props.inertia
    size = float(abs(t).max())
    return {
        "name": link.name,
        "mass": _finite(link.props.mass),
        "com": _vector(link.props.com, 1.0),
        "moments": _vector((t[0, 0], t[1, 1], t[2, 2]), size),
        "products": _vector((t[0, 1], t[0, 2], t[1, 2]), size),
        "pieces": sum(part.quantity for part in link.parts),
        "frame": link.frame.description,
        "problems": ", ".join(problem.replace("_", " ") for problem in link.problems),
        "doubt": bool(link.problems),
    }


def _part(link: str, part: PartResult) -> dict[str, Any]:
    return {
        "link": link or "(no link)",
        "name": part.name,
        "number": part.part_number,
        "quantity": part.quantity,
        "mass": _finite(part.mass),
        "total": _finite(part.total_mass),
        "volume": _finite(part.volume * 1e6) if part.volume else None,
        "density": None if part.density is None else _finite(part.density),
        "material": material_of(part),
        "source": SOURCE_WORDS[part.source],
        "matched": how(part),
        "warnings": len(part.warnings) or None,
        "doubt": bool(part.warnings),
    }


def _vector(values: Iterable[float], size: float) -> list[float | None]:
    """What is noise against ``size`` is 0, as in the other reports."""
    return [0.0 if abs(value) <= NOISE * size else _finite(value) for value in values]


def _finite(value: float) -> float | None:
    """JSON has no NaN; the page shows such a value as one that is not finite."""
    number = float(value)
    return number if math.isfinite(number) else None


def _hex(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in colour)
