# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as plain values: JSON by ``docs/inertia-schema.json``, and CSV with one row per link and part."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from typing import Any

from silo.bom.headers import safe_cell
from silo.inertia.core import MassProps
from silo.inertia.report import InertiaReport, LinkResult, PartResult, SubAssemblyResult

FORMAT = "silo-inertia/1"


def report_data(report: InertiaReport) -> dict[str, Any]:
    """The report as JSON values; SI units throughout, the order of links and parts is stable."""
    return {
        "format": FORMAT,
        "assembly": {"name": report.assembly, "source": report.source},
        "bom": report.bom or None,
        "default_density": report.default_density,
        "links": [_link(link) for link in report.links.values()],
        "unclaimed": [_part(part) for part in report.unclaimed],
        "sub_assemblies": [_sub_assembly(one) for one in report.sub_assemblies],
        "total": None if report.total is None else _props(report.total),
        "warnings": [
            {"link": w.link_name, "part": w.part_name, "code": str(w.code), "message": w.message}
            for w in report.warnings
        ],
    }


def report_json(report: InertiaReport, encoding: str = "utf-8") -> str:
    """:func:`report_data` as text; floats read back unchanged. What ``encoding`` cannot hold is escaped."""
    data = report_data(report)
    text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        text = json.dumps(data, indent=2, allow_nan=False)
    return text + "\n"


def _props(props: MassProps) -> dict[str, Any]:
    return {"mass": props.mass, "com": props.com.tolist(), "inertia": props.inertia.tolist()}


def _link(link: LinkResult) -> dict[str, Any]:
    return {
        "name": link.name,
        "frame": {"description": link.frame.description, "placement": link.frame.placement.tolist()},
        **_props(link.props),
        "principal_moments": link.props.principal()[0].tolist(),
        "problems": [str(problem) for problem in link.problems],
        "parts": [_part(part) for part in link.parts],
    }


def _part(part: PartResult) -> dict[str, Any]:
    return {
        "name": part.name,
        "part_number": part.part_number,
        "path": part.paths[0],
        "paths": list(part.paths),
        "quantity": part.quantity,
        "mass": part.mass,
        "total_mass": part.total_mass,
        "quantum": part.quantum,
        "volume": part.volume,
        "com": None if part.com is None else list(part.com),
        "density": part.density,
        "density_source": part.density_source,
        "source": str(part.source),
        "rule": str(part.rule),
        "decided_by": str(part.decided_by),
        "material": part.material,
        "material_name": part.material_name,
        "bom_lines": list(part.lines),
        "warnings": [{"code": str(w.code), "message": w.message} for w in part.warnings],
    }


def _sub_assembly(one: SubAssemblyResult) -> dict[str, Any]:
    return {
        "name": one.name,
        "part_number": one.part_number,
        "paths": list(one.paths),
        "mass": one.mass,
        "quantum": one.quantum,
        "agrees": one.agrees,
        "volume": one.volume,
        "com": None if one.com is None else list(one.com),
        "bom_line": one.line,
    }


CSV_COLUMNS: dict[str, Callable[[str, PartResult], object]] = {
    "Link": lambda link, part: link,
    "Part": lambda link, part: part.name,
    "Part number": lambda link, part: part.part_number,
    "Quantity": lambda link, part: part.quantity,
    "Mass (kg)": lambda link, part: part.mass,
    "Total mass (kg)": lambda link, part: part.total_mass,
    "Volume (m3)": lambda link, part: part.volume,
    "Density (kg/m3)": lambda link, part: part.density,
    "Source": lambda link, part: part.source,
    "Rule": lambda link, part: part.rule,
    "Decided by": lambda link, part: part.decided_by,
    "Material": lambda link, part: part.material,
    "BOM lines": lambda link, part: " ".join(map(str, part.lines)),
    "Path": lambda link, part: part.paths[0],
    "Warnings": lambda link, part: " ".join(dict.fromkeys(str(w.code) for w in part.warnings)),
}


def report_csv(report: InertiaReport) -> str:
    """One row per link and part (RFC 4180); text that a spreadsheet would take for a formula is quoted."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(CSV_COLUMNS)
    for link, part in report.parts():
        writer.writerow([safe_cell(cell(link, part)) for cell in CSV_COLUMNS.values()])
    return out.getvalue()
