# SPDX-License-Identifier: LGPL-2.1-or-later
"""The options that ``silo-mod inertia``, ``mass`` and ``links`` share, and the tables that they name.

Bad numbers and files are refused before the geometry is read, which may take minutes.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from silo.bom.errors import ConfigError, InputError, did_you_mean
from silo.bom.message import message
from silo.cli.options import add_options, job_count, only_with
from silo.cli.outputs import add_preview

if TYPE_CHECKING:
    from silo.inertia.bom.table import BomTable
    from silo.inertia.materials.table import MaterialTable


def add_geometry_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for how files are read."""
    group = parser.add_argument_group("geometry")
    add_options(group, {"--mesh-unit UNIT": message("length unit of meshes that state none (mm, cm, m, in)")})
    add_options(
        group,
        {
            "--step-encoding NAME": message(
                "of names in STEP files that are no UTF-8, for example shift_jis (default: --encoding)"
            )
        },
    )
    group.add_argument(
        "--timeout", type=float, default=600.0, metavar="S", help="give up reading after S seconds"
    )
    group.add_argument(
        "--jobs",
        type=job_count,
        dest="geometry_jobs",
        default=0,
        metavar="N",
        help="processes that read one large file or split assembly (default: the processors)",
    )
    add_options(
        group,
        {
            "--no-siblings": message("do not look for the files of split assemblies"),
        },
    )


def add_material_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for where densities come from."""
    group = parser.add_argument_group("materials")
    add_options(
        group,
        {
            "--materials FILE...": message("your own densities (.csv or .toml)"),
            "--no-freecad-materials": message("do not look into an installed FreeCAD's cards"),
        },
    )


def add_bom_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for how the BOM is read if it is detected wrongly."""
    group = parser.add_argument_group("BOM")
    add_options(
        group,
        {
            "--bom BOM": message("CSV, XLSX, XLS or ODS; names, masses or materials"),
            "--column ROLE=HEADER...": (
                message(
                    "a renamed column; roles: name, part_number, description, material, mass, "
                    "total_mass, mass_unit, quantity, item, level, find_number"
                )
            ),
        },
    )
    group.add_argument("--encoding", help="of the BOM, for example cp1252")
    group.add_argument("--delimiter", help="of the BOM, one character")
    group.add_argument("--decimal", choices=(".", ","), help="decimal mark of the BOM")
    add_options(group, {"--mass-unit UNIT": message("of masses without one (kg, g, lb, …)")})
    only_with(parser, "--bom", "--column", "--encoding", "--delimiter", "--decimal", "--mass-unit")


def add_result_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for where results go, and when a warning is a failure."""
    group = parser.add_argument_group("results")
    text = message("write a 3D scene (.glb) with centres of mass and inertia ellipsoids; may be repeated")
    add_preview(parser, text, group)
    add_options(
        group,
        {
            "--strict": message("exit 1 where there is any warning"),
            "--allow CODE...": message("with --strict: this warning is fine"),
        },
    )
    only_with(parser, "--strict", "--allow")


def add_push_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for sending results to Silo."""
    group = parser.add_argument_group("back to Silo")
    add_options(
        group,
        {
            "--push": message("write mass, volume and centre of mass into the items' properties"),
            "--dry-run": message("with --push: only show what would be written"),
        },
    )
    only_with(parser, "--push", "--dry-run", "--item", "--server", "--token")


def need_inertia_extra() -> None:
    """Raise ConfigError if the extra is not installed."""
    missing = [name for name in ("numpy", "OCP", "trimesh", "yaml") if find_spec(name) is None]
    if missing:
        raise ConfigError(
            message(
                "mass and inertia need the packages of the extra “inertia” ({missing} not "
                "found); install them with: pip install 'silo-mod[inertia]'",
                missing=", ".join(missing),
            )
        )


def bom_table(args: argparse.Namespace) -> BomTable | None:
    """Read the BOM that the user's options name; None if they name none."""
    from silo.inertia.bom.parser import BOMParser

    columns = named_values(args.column, "--column", message("ROLE=HEADER, for example mass=Gewicht"))
    delimiter = "\t" if args.delimiter in ("\\t", "tab") else args.delimiter
    parser = BOMParser(
        columns=columns,
        encoding=args.encoding,
        delimiter=delimiter,
        decimal=args.decimal,
        mass_unit=args.mass_unit,
    )
    return parser.parse(args.bom) if args.bom else None


def named_values(texts: Sequence[str], option: str, wanted: str) -> dict[str, str]:
    if bad := [text for text in texts if "=" not in text]:
        raise InputError(
            message("{option} wants {wanted}; got “{bad}”", option=option, wanted=wanted, bad=bad[0])
        )
    return {name.strip(): value.strip() for name, _, value in (text.partition("=") for text in texts)}


def material_table(args: argparse.Namespace) -> MaterialTable:
    """Load the material table that the user's options name."""
    from silo.inertia.materials.table import load_materials

    return load_materials(args.materials, freecad=not args.no_freecad_materials)


def check_options(args: argparse.Namespace, *, asks_server: bool) -> None:
    """Report bad numbers, scenes and a missing server before minutes of reading, not after."""
    from silo.inertia.bom.table import BomCode
    from silo.inertia.codes import MassCode
    from silo.inertia.geometry.options import MESH_UNITS
    from silo.inertia.materials.densities import checked_density
    from silo.inertia.notes import GeometryCode
    from silo.inertia.rigid import TensorProblem

    known = [str(code) for codes in (MassCode, GeometryCode, BomCode, TensorProblem) for code in codes]
    for code in args.allow:
        if code not in known:
            unknown = message("--allow: there is no warning {code}", code=code)
            raise InputError(unknown + did_you_mean(code, known))
    if args.mesh_unit is not None and args.mesh_unit not in MESH_UNITS:
        text = "--mesh-unit: wanted one of {known}, got {unit}"
        raise InputError(message(text, known=", ".join(MESH_UNITS), unit=args.mesh_unit))
    if args.default_density is not None:
        checked_density(args.default_density)
    if not (args.timeout >= 0 and math.isfinite(args.timeout)):
        raise InputError(
            message("--timeout: wanted seconds, 0 for no limit, got {timeout}", timeout=f"{args.timeout:g}")
        )
    if asks_server:
        from silo.api.config import resolve_server

        resolve_server(args.server, args.token)
    check_scenes(args)


def check_scenes(args: argparse.Namespace) -> None:
    """Raise InputError for scenes whose names do not end in .glb."""
    if bad := [name for name in args.preview if Path(name).suffix.lower() != ".glb"]:
        raise InputError(
            message(
                "--preview writes .glb, --report FILE.html a page to look at; got {bad}", bad=", ".join(bad)
            )
        )
