# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as JSON, by the schema that `silo-mod schema inertia` prints."""

from __future__ import annotations

import json
from typing import Any

from silo.inertia.reconciliation import Difference, Reconciliation
from silo.inertia.report import InertiaReport, LinkResult, PartResult
from silo.inertia.rigid import MassProps

FORMAT = "silo-inertia/1"


def report_data(report: InertiaReport) -> dict[str, Any]:
    """Return the report as JSON values, in SI units. The order of links and parts is stable."""
    return {
        "format": FORMAT,
        "assembly": {"name": report.assembly, "source": report.source},
        "bom": report.bom or None,
        "reconciliation": _reconciliation(report.reconciliation),
        "default_density": report.default_density,
        "links": [_link(link) for link in report.links.values()],
        "unclaimed": [_part(part) for part in report.unclaimed],
        "sub_assemblies": [
            {**_values(assembly, _SUB_ASSEMBLY), "bom_line": assembly.line}
            for assembly in report.sub_assemblies
        ],
        "total": None if report.total is None else _props(report.total),
        "warnings": [
            {"link": w.link_name, "part": w.part_name, "code": str(w.code), "message": w.message}
            for w in report.warnings
        ],
    }


def _reconciliation(found: Reconciliation | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "bom": found.bom,
        "counted": found.counted,
        "estimated": found.estimated,
        "not_counted": [_difference(one) for one in found.not_counted],
        "double": [_difference(one) for one in found.double],
        "message": found.sentence,
    }


def _difference(one: Difference) -> dict[str, Any]:
    return {"name": one.name, "mass": one.kg, "reason": one.reason}


def report_json(report: InertiaReport, encoding: str = "utf-8") -> str:
    """Write :func:`report_data` as text; its floats read back unchanged.

    Characters that ``encoding`` lacks are escaped.
    """
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


_PART = """name part_number paths quantity mass total_mass quantum volume com density density_source source
rule decided_by material material_name"""

_SUB_ASSEMBLY = "name part_number paths mass quantum agrees volume com"


def _values(of: object, names: str) -> dict[str, Any]:
    values = {name: getattr(of, name) for name in names.split()}
    return {name: list(v) if isinstance(v, tuple) else v for name, v in values.items()}


def _part(part: PartResult) -> dict[str, Any]:
    return {
        **_values(part, _PART),
        "path": part.paths[0],
        "bom_lines": list(part.lines),
        "warnings": [{"code": str(w.code), "message": w.message} for w in part.warnings],
    }
