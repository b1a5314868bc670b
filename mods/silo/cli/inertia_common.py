# SPDX-License-Identifier: LGPL-2.1-or-later
"""What ``silo-mod inertia`` and ``silo-mod mass`` share: options, reading with progress, results, push."""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from silo.bom.errors import ConfigError, Exit, InputError
from silo.cli import common
from silo.inertia.wording import counted

if TYPE_CHECKING:
    from silo.inertia.bom import BOMParser
    from silo.inertia.geometry import ReadOptions
    from silo.inertia.materials import MaterialTable
    from silo.inertia.model import Assembly
    from silo.inertia.output.push import PushPlan
    from silo.inertia.report import InertiaReport

REPORTS = (".json", ".csv", ".md")
PIPE_WIDTH = 160
"""Columns of a table that goes to a file or another program."""


def add_geometry_options(parser: argparse.ArgumentParser) -> None:
    """How files are read."""
    group = parser.add_argument_group("geometry")
    group.add_argument(
        "--mesh-unit", metavar="UNIT", help="length unit of meshes that state none (mm, cm, m, in)"
    )
    group.add_argument(
        "--timeout", type=float, default=600.0, metavar="S", help="give up reading after S seconds"
    )
    group.add_argument(
        "--jobs",
        type=common.job_count,
        dest="geometry_jobs",
        default=0,
        metavar="N",
        help="processes that read one large file or split assembly (default: the processors)",
    )
    group.add_argument(
        "--no-siblings", action="store_true", help="do not look for the files of split assemblies"
    )
    group.add_argument(
        "--no-cache", action="store_true", help="read afresh, and keep nothing for the next time"
    )


def add_material_options(parser: argparse.ArgumentParser) -> None:
    """Where densities come from."""
    group = parser.add_argument_group("materials")
    group.add_argument(
        "--materials", action="append", default=[], metavar="FILE", help="your own densities (.csv or .toml)"
    )
    group.add_argument(
        "--no-freecad-materials", action="store_true", help="do not look into an installed FreeCAD's cards"
    )


def add_bom_options(parser: argparse.ArgumentParser) -> None:
    """How the BOM is read, where what is found out from it is wrong."""
    group = parser.add_argument_group("BOM")
    group.add_argument("--bom", metavar="BOM", help="CSV, XLSX, XLS or ODS; names, masses or materials")
    group.add_argument(
        "--column",
        action="append",
        default=[],
        metavar="ROLE=HEADER",
        help="a renamed column; roles: name, part_number, description, material, mass, total_mass, "
        "mass_unit, quantity, item, level, find_number",
    )
    group.add_argument("--encoding", help="of the BOM, for example cp1252")
    group.add_argument("--delimiter", help="of the BOM, one character")
    group.add_argument("--decimal", choices=(".", ","), help="decimal mark of the BOM")
    group.add_argument("--mass-unit", metavar="UNIT", help="of masses without one (kg, g, lb, …)")
    common.only_with(parser, "--bom", "--column", "--encoding", "--delimiter", "--decimal", "--mass-unit")


def add_result_options(parser: argparse.ArgumentParser) -> None:
    """Where results go, and when a warning is a failure."""
    group = parser.add_argument_group("results")
    group.add_argument(
        "--report",
        action="append",
        default=[],
        metavar="OUT",
        help="write a report by suffix: .json, .csv, or .md with a picture beside it (OUT.md.png); "
        "may be repeated",
    )
    group.add_argument(
        "--preview",
        action="append",
        default=[],
        metavar="OUT",
        help="draw the links with centres of mass and inertia ellipsoids: .glb or .png; may be repeated",
    )
    group.add_argument(
        "--html",
        metavar="OUT",
        help="write one page to look at: a 3D view to turn, masses by source, warnings, tables",
    )
    common.add_json_option(parser)
    group.add_argument("--strict", action="store_true", help="exit 1 where there is any warning")
    group.add_argument(
        "--allow", action="append", default=[], metavar="CODE", help="with --strict: this warning is fine"
    )
    common.only_with(parser, "--strict", "--allow")


def add_push_options(parser: argparse.ArgumentParser) -> None:
    """Back to Silo."""
    group = parser.add_argument_group("back to Silo")
    group.add_argument(
        "--push", action="store_true", help="write mass, volume and centre of mass into the items' properties"
    )
    group.add_argument("--dry-run", action="store_true", help="with --push: only show what would be written")
    group.add_argument("--item", metavar="NUMBER", help="with --push: part number of the whole assembly")
    common.add_server_options(parser)
    common.only_with(parser, "--push", "--dry-run", "--item", "--server", "--token")


def need_inertia_extra(via: str = "files") -> None:
    """One plain sentence where the extra is not installed; FreeCAD brings a geometry kernel of its own."""
    wanted = ("numpy", "PIL") if via == "freecad" else ("numpy", "OCP", "trimesh", "PIL", "yaml")
    missing = [name for name in wanted if find_spec(name) is None]
    if missing:
        raise ConfigError(
            f"mass and inertia need the packages of the extra “inertia” ({', '.join(missing)} not found); "
            "install them with: pip install 'silo-mod[inertia]'"
        )


def bom_parser(args: argparse.Namespace) -> BOMParser:
    """The parser by the user's options."""
    from silo.inertia.bom import BOMParser

    columns: dict[str, str] = {}
    for text in args.column:
        role, equals, header = text.partition("=")
        if not equals:
            raise InputError(f"--column wants ROLE=HEADER, for example mass=Gewicht; got “{text}”")
        columns[role.strip()] = header.strip()
    delimiter = "\t" if args.delimiter in ("\\t", "tab") else args.delimiter
    return BOMParser(
        columns=columns,
        encoding=args.encoding,
        delimiter=delimiter,
        decimal=args.decimal,
        mass_unit=args.mass_unit,
    )


def material_table(args: argparse.Namespace) -> MaterialTable:
    """The table by the user's options."""
    from silo.inertia.materials import load_materials

    return load_materials(args.materials, freecad=not args.no_freecad_materials)


def check_options(args: argparse.Namespace, *, asks_server: bool) -> None:
    """Bad numbers, output files and a missing server are reported before minutes of reading, not after."""
    from silo.inertia.materials.density import checked_density

    if args.default_density is not None:
        checked_density(args.default_density)
    if not (args.timeout >= 0 and math.isfinite(args.timeout)):
        raise InputError(f"--timeout: wanted seconds, 0 for no limit, got {args.timeout:g}")
    if asks_server:
        from silo.api.config import resolve_server

        resolve_server(args.server, args.token)
    check_outputs(args)


def check_outputs(args: argparse.Namespace) -> None:
    """InputError for files that cannot be written, or that must not: what is read, and one file twice."""
    from silo.inertia.geometry.detect import is_model_name

    report: list[str] = getattr(args, "report", [])
    single = [getattr(args, name) for name in ("urdf_out", "html", "out") if getattr(args, name, None)]
    written = [*report, *map(str, _pictures(args)), *single]
    for name in single:
        if is_model_name(Path(name)) and os.path.lexists(name):
            raise InputError(f"{name} is there already and is named like a model; write to another file")
    if bad := [name for name in report if Path(name).suffix.lower() not in REPORTS]:
        raise InputError(f"--report writes {', '.join(REPORTS)}; got {', '.join(bad)}")
    if bad := [name for name in args.preview if Path(name).suffix.lower() not in (".glb", ".png")]:
        raise InputError(f"--preview writes .glb and .png; got {', '.join(bad)}")
    read = [getattr(args, "top", args.assembly), *getattr(args, "materials", [])]
    read += filter(None, (getattr(args, name, None) for name in ("bom", "links", "urdf")))
    known = {os.path.realpath(name) for name in read}
    for name in written:
        if not Path(name).absolute().parent.is_dir():
            raise InputError(f"{name}: there is no folder {Path(name).parent}")
        if (real := os.path.realpath(name)) in known:
            raise InputError(f"{name} is read by this command, or written twice; write to another file")
        known.add(real)


def read_options(args: argparse.Namespace, **more: Any) -> ReadOptions:
    """What the arguments say about reading geometry."""
    from silo.inertia.geometry import ReadOptions

    return ReadOptions(
        mesh_unit=args.mesh_unit,
        timeout_s=args.timeout,
        processes=args.geometry_jobs,
        siblings=not args.no_siblings,
        cache=not args.no_cache,
        **more,
    )


def read(path: str, args: argparse.Namespace, *, via: str = "files", **more: Any) -> Assembly:
    """The geometry, with progress on a terminal; Ctrl-C stops it at once. ``via``: who opens the file."""
    from dataclasses import replace

    reader: Callable[[str, ReadOptions], Assembly]
    if via == "freecad":
        from silo.freecadcmd.mass import read_in_freecad as reader
    else:
        from silo.inertia.calculator import read_geometry as reader

    options = read_options(args, **more)
    with _progress(Path(path).name) as told:
        return reader(path, replace(options, progress=told))


@contextmanager
def _progress(name: str) -> Iterator[Any]:
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    bar = Progress(
        TextColumn("{task.fields[file]}: {task.description}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}"),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    with bar:
        task = bar.add_task("reading", total=None, file=name)

        def told(progress: Any) -> None:
            bar.update(
                task, description=progress.stage, completed=progress.done, total=progress.total or None
            )

        yield told


def show(args: argparse.Namespace, report: InertiaReport, assembly: Assembly, *, quiet: bool = False) -> None:
    """Write every file that was asked for, and print the report; only its warnings where ``quiet``."""
    _write_files(args, report, assembly)
    if quiet:
        from silo.inertia.output.text import report_warnings

        console(sys.stderr).print(report_warnings(report))
        return
    if args.json:
        from silo.inertia.output.data import report_json

        # A pipe on Windows takes the country's code page: names must not turn into question marks there.
        sys.stdout.write(report_json(report, sys.stdout.encoding or "ascii"))
        return
    from silo.inertia.output.text import report_tables

    console().print(report_tables(report))


def console(stream: TextIO | None = None) -> Any:
    """The terminal; wide where the output is a file or a pipe. ``stream``: standard output by default."""
    from rich.console import Console

    stream = stream or sys.stdout
    return Console(file=stream, highlight=False, width=None if stream.isatty() else PIPE_WIDTH)


def _write_files(args: argparse.Namespace, report: InertiaReport, assembly: Assembly) -> None:
    from silo.inertia.output.files import write_whole

    pictures = _pictures(args)
    for path in pictures:
        from silo.inertia.preview.picture import write_preview

        write_preview(report, assembly, path)
    if args.html:
        from silo.inertia.preview.page import report_html

        write_whole(args.html, report_html(report, assembly).encode("utf-8"))
    drawn = next((path for path in pictures if path.suffix.lower() == ".png"), None)
    for name in args.report:
        write_whole(name, _report_text(Path(name), report, drawn).encode("utf-8"))


def _pictures(args: argparse.Namespace) -> list[Path]:
    """What is drawn. A report to read has a picture beside it, with a name that is the report's own."""
    pictures = [Path(name) for name in args.preview]
    page = next((name for name in getattr(args, "report", ()) if name.lower().endswith(".md")), None)
    if page and not any(path.suffix.lower() == ".png" for path in pictures):
        pictures.append(Path(f"{page}.png"))
    return pictures


def _report_text(path: Path, report: InertiaReport, picture: Path | None) -> str:
    from silo.inertia.output.data import report_csv, report_json
    from silo.inertia.output.text import report_markdown

    suffix = path.suffix.lower()
    if suffix == ".json":
        return report_json(report)
    if suffix == ".csv":
        return report_csv(report)
    link = None
    if picture is not None:
        link = Path(os.path.relpath(picture, path.parent)).as_posix()
    return report_markdown(report, link)


def verdict(args: argparse.Namespace, report: InertiaReport) -> int:
    """The exit code: with --strict, 1 where a warning is not allowed."""
    if not args.strict:
        return Exit.DONE
    left = [w for w in report.warnings if str(w.code) not in args.allow]
    if left:
        codes = sorted({str(w.code) for w in left})
        count = counted(len(left), "warning")
        print(f"silo-mod: --strict: {count} ({', '.join(codes)})", file=sys.stderr)
    return Exit.UNDONE if left else Exit.DONE


def push_report(
    args: argparse.Namespace, report: InertiaReport, part_numbers: Mapping[str, str] | None = None
) -> int:
    """Write the masses to the server, or show the plan; 1 where an item is unknown there."""
    from silo.inertia.output.push import plan_push, push

    plan = plan_push(report, part_numbers, args.item)
    if args.dry_run:
        _tell_plan(plan)
        return Exit.DONE
    with common.client_of(args) as client:
        done = push(client, plan)
    written = counted(len(done.written), "item")
    _say(f"Silo: {written} written, {len(done.unchanged)} had these numbers already.")
    if done.unknown:
        _say(f"Unknown to the server: {', '.join(done.unknown)}")
    for number, error in done.failed:
        _say(f"Not written: {number}: {error}")
    _tell_skipped(plan)
    return Exit.REMOTE if done.failed else Exit.UNDONE if done.unknown else Exit.DONE


def _tell_plan(plan: PushPlan) -> None:
    from silo.inertia.output.push import describe

    _say(f"Would write {counted(len(plan.items), 'item')} ({plan.comment}):")
    for item in plan.items:
        _say(f"  {describe(item)}")
    _tell_skipped(plan)


def _tell_skipped(plan: PushPlan) -> None:
    for skipped in plan.skipped:
        _say(f"Not written: {skipped.name}: {skipped.reason}")


def _say(text: str) -> None:
    # Standard output may be JSON; what a push did is for people.
    from silo.cli.show import plain

    print(plain(text), file=sys.stderr)


def names_of(values: Sequence[str], limit: int = 8) -> str:
    """Some names, and how many more."""
    more = f" and {len(values) - limit} more" if len(values) > limit else ""
    return ", ".join(values[:limit]) + more
