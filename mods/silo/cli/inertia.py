# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod inertia``, ``mass`` and ``links``: mass properties of an assembly, by link or as a whole.

What ``silo-mod inertia`` and ``silo-mod mass`` share: options, reading with progress, results, push.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo import spoken
from silo.bom.errors import ConfigError, Exit, InputError, counted, listed
from silo.cli.common import (
    add_each,
    add_options,
    client_of,
    job_count,
    json_text,
    only_with,
    read_tops,
    set_step,
)

if TYPE_CHECKING:
    from silo.bom.model import BomEntry
    from silo.inertia.assembly import Assembly
    from silo.inertia.bom.table import BomTable
    from silo.inertia.geometry import ReadOptions
    from silo.inertia.materials.table import MaterialTable
    from silo.inertia.push import PushPlan
    from silo.inertia.report import InertiaReport
    from silo.inertia.task import Task
    from silo.inertia.urdf import Urdf


def add_geometry_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for how files are read."""
    group = parser.add_argument_group("geometry")
    add_options(group, {"--mesh-unit UNIT": "length unit of meshes that state none (mm, cm, m, in)"})
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
            "--no-siblings": "do not look for the files of split assemblies",
        },
    )


def add_material_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for where densities come from."""
    group = parser.add_argument_group("materials")
    add_options(
        group,
        {
            "--materials FILE...": "your own densities (.csv or .toml)",
            "--no-freecad-materials": "do not look into an installed FreeCAD's cards",
        },
    )


def add_bom_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for how the BOM is read if it is detected wrongly."""
    group = parser.add_argument_group("BOM")
    add_options(
        group,
        {
            "--bom BOM": "CSV, XLSX, XLS or ODS; names, masses or materials",
            "--column ROLE=HEADER...": (
                "a renamed column; roles: name, part_number, description, material, mass, total_mass,"
                " mass_unit, quantity, item, level, find_number"
            ),
        },
    )
    group.add_argument("--encoding", help="of the BOM, for example cp1252")
    group.add_argument("--delimiter", help="of the BOM, one character")
    group.add_argument("--decimal", choices=(".", ","), help="decimal mark of the BOM")
    add_options(group, {"--mass-unit UNIT": "of masses without one (kg, g, lb, …)"})
    only_with(parser, "--bom", "--column", "--encoding", "--delimiter", "--decimal", "--mass-unit")


def add_result_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for where results go, and when a warning is a failure."""
    group = parser.add_argument_group("results")
    add_options(
        group,
        {
            "--preview FILE...": (
                "write a 3D scene (.glb) with centres of mass and inertia ellipsoids; may be repeated"
            ),
            "--strict": "exit 1 where there is any warning",
            "--allow CODE...": "with --strict: this warning is fine",
        },
    )
    only_with(parser, "--strict", "--allow")


def add_push_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for sending results to Silo."""
    group = parser.add_argument_group("back to Silo")
    add_options(
        group,
        {
            "--push": "write mass, volume and centre of mass into the items' properties",
            "--dry-run": "with --push: only show what would be written",
        },
    )
    only_with(parser, "--push", "--dry-run", "--item", "--server", "--token")


def need_inertia_extra() -> None:
    """Raise ConfigError if the extra is not installed."""
    missing = [name for name in ("numpy", "OCP", "trimesh", "yaml") if find_spec(name) is None]
    if missing:
        raise ConfigError(
            f"mass and inertia need the packages of the extra “inertia” ({', '.join(missing)} not found); "
            "install them with: pip install 'silo-mod[inertia]'"
        )


def bom_table(args: argparse.Namespace) -> BomTable | None:
    """Read the BOM that the user's options name; None if they name none."""
    from silo.inertia.bom.parser import BOMParser

    columns = _pairs(args.column, "--column", "ROLE=HEADER, for example mass=Gewicht")
    delimiter = "\t" if args.delimiter in ("\\t", "tab") else args.delimiter
    parser = BOMParser(
        columns=columns,
        encoding=args.encoding,
        delimiter=delimiter,
        decimal=args.decimal,
        mass_unit=args.mass_unit,
    )
    return parser.parse(args.bom) if args.bom else None


def _pairs(texts: Sequence[str], option: str, wanted: str) -> dict[str, str]:
    if bad := [text for text in texts if "=" not in text]:
        raise InputError(f"{option} wants {wanted}; got “{bad[0]}”")
    return {name.strip(): value.strip() for name, _, value in (text.partition("=") for text in texts)}


def material_table(args: argparse.Namespace) -> MaterialTable:
    """Load the material table that the user's options name."""
    from silo.inertia.materials.table import load_materials

    return load_materials(args.materials, freecad=not args.no_freecad_materials)


def check_options(args: argparse.Namespace, *, asks_server: bool) -> None:
    """Report bad numbers, output files and a missing server before minutes of reading, not after."""
    from silo.inertia.materials.densities import checked_density

    if args.default_density is not None:
        checked_density(args.default_density)
    if not (args.timeout >= 0 and math.isfinite(args.timeout)):
        raise InputError(f"--timeout: wanted seconds, 0 for no limit, got {args.timeout:g}")
    if asks_server:
        from silo.api.config import resolve_server

        resolve_server(args.server, args.token)
    check_outputs(args)


def check_outputs(args: argparse.Namespace) -> None:
    """Raise InputError for files that cannot be written, or must not be: an input file, or one file twice."""
    from silo.inertia.geometry.graph import is_model_name

    report: list[str] = getattr(args, "report", [])
    single = [getattr(args, name) for name in ("urdf_out", "out") if getattr(args, name, None)]
    written = [*report, *args.preview, *single]
    for name in single:
        if is_model_name(Path(name)) and os.path.lexists(name):
            raise InputError(f"{name} is there already and is named like a model; write to another file")
    if bad := [name for name in args.preview if Path(name).suffix.lower() != ".glb"]:
        raise InputError(f"--preview writes .glb, --report FILE.html a page to look at; got {', '.join(bad)}")
    read = [getattr(args, "top", args.assembly), *getattr(args, "materials", [])]
    read += filter(None, (getattr(args, name, None) for name in ("bom", "links", "urdf")))
    inputs = {os.path.realpath(name) for name in read}
    for name in written:
        if not Path(name).absolute().parent.is_dir():
            raise InputError(f"{name}: there is no folder {Path(name).parent}")
        if (real := os.path.realpath(name)) in inputs:
            raise InputError(f"{name} is read by this command, or written twice; write to another file")
        inputs.add(real)


def read_options(args: argparse.Namespace, **more: Any) -> ReadOptions:
    """Make the options for reading geometry from the arguments."""
    from silo.inertia.geometry import ReadOptions

    return ReadOptions(
        mesh_unit=args.mesh_unit,
        timeout_s=args.timeout,
        processes=args.geometry_jobs,
        siblings=not args.no_siblings,
        cache=not args.no_cache,
        **more,
    )


def read(path: str, args: argparse.Namespace, **more: Any) -> Assembly:
    """Read the geometry, and show the progress on standard error; Ctrl-C stops it at once."""
    from silo.inertia.calculator import read_geometry

    with _progress(Path(path).name) as progress:
        assembly = read_geometry(path, read_options(args, progress=progress, **more))
    set_step("calculating")
    return assembly


@contextmanager
def _progress(name: str) -> Iterator[Any]:
    if not sys.stderr.isatty():
        yield lambda progress: set_step(f"{name}: {progress}")
        return
    set_step("")  # the bar says it
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
    """Write every file that was asked for, and print the report; only its warnings if ``quiet``."""
    from silo.cli.show import console

    _write_files(args, report, assembly)
    if quiet:
        from silo.inertia.output import report_warnings

        console(sys.stderr).print(report_warnings(report, whole=not sys.stderr.isatty(), say=spoken))
        return
    if args.json:
        from silo.inertia.output import report_json

        # A pipe on Windows takes the country's code page: names must not turn into question marks there.
        sys.stdout.write(report_json(report, sys.stdout.encoding or "ascii"))
        return
    from silo.inertia.output import report_tables

    console().print(report_tables(report, whole=not sys.stdout.isatty(), say=spoken))


def _write_files(args: argparse.Namespace, report: InertiaReport, assembly: Assembly) -> None:
    from silo.inertia.output import write_whole

    for name in args.preview:
        from silo.drawing.page import views_of, write_glb

        write_whole(name, write_glb(assembly, views_of(report, assembly)))
    for name in args.report:
        from silo.drawing.page import report_html
        from silo.inertia.output import report_csv, report_json, report_markdown

        writers = {
            ".html": lambda inertia_report: report_html(inertia_report, assembly),
            ".json": report_json,
            ".csv": report_csv,
            ".md": report_markdown,
        }
        write_whole(name, writers[Path(name).suffix.lower()](report).encode("utf-8"))


def verdict(args: argparse.Namespace, report: InertiaReport) -> int:
    """Return exit code 1, and print why, if a warning without --allow says that something could not be read;
    with --strict, if there is any warning without --allow.
    """
    from silo.inertia.notes import GeometryCode

    left = [
        w.code
        for w in report.warnings
        if w.code not in args.allow and (args.strict or w.code == GeometryCode.NOT_READ)
    ]
    if left:
        why = "--strict" if args.strict else "what cannot be read is in no mass"
        count, codes = counted(len(left), "warning"), ", ".join(sorted({*left}))
        print(f"silo-mod: {why}: {count} ({codes})", file=sys.stderr)
    return Exit.UNDONE if left else Exit.DONE


def push_report(
    args: argparse.Namespace, report: InertiaReport, part_numbers: Mapping[str, str] | None = None
) -> int:
    """Write the masses to the server, or show the plan; returns 1 if an item is unknown there."""
    from silo.inertia.push import plan_push, push

    plan = plan_push(report, part_numbers, args.item)
    if args.dry_run:
        _tell_plan(plan)
        return Exit.DONE
    with client_of(args) as client:
        set_step("writing masses")
        done = push(client, plan)
    written = counted(len(done.written), "item")
    _say(f"Silo: {written} written, {len(done.unchanged)} had these numbers already.")
    if done.by_hand:
        _say(f"Typed by hand or weighed, so it stays: {', '.join(done.by_hand)}")
    if done.unknown:
        _say(f"Unknown to the server: {', '.join(done.unknown)}")
    for number, error in done.failed:
        _say(f"Not written: {number}: {error}")
    _tell_skipped(plan)
    return Exit.REMOTE if done.failed else Exit.UNDONE if done.unknown else Exit.DONE


def _tell_plan(plan: PushPlan) -> None:
    from silo.inertia.push import describe

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


FRAMES = ("assembly", "own", "urdf")
SNIPPETS = ("urdf", "sdf", "mjcf")


def add_inertia(parser: argparse.ArgumentParser) -> None:
    add_each(
        parser,
        "assembly",
        "--report",
        "--preview",
        "--item",
        "--urdf-out",
        "--in-place",
        metavar="ASSEMBLY",
        help="a STEP, mesh or FCStd file",
    )
    group = parser.add_argument_group("links")
    add_options(
        group,
        {
            "--links MAP": "YAML map: link → instance path patterns (see docs/inertia.md)",
            "--loose LINK": "the link of what no other link claims (without a map: base_link, warned of)",
            "--mass NAME=MASS...": (
                "what a scale says of a link, or of each component of a pattern, for example "
                "arm=1.25kg; its parts are scaled to it; may be repeated"
            ),
        },
    )
    group.add_argument(
        "--frame",
        choices=FRAMES,
        help="frame of the numbers: the assembly's, each sub-assembly's own, or the URDF's link frames "
        "(default: urdf with --urdf, else assembly)",
    )
    add_options(
        group,
        {
            "--urdf FILE": "take names and frames of the links from this URDF, to fill it",
            "--urdf-out FILE": "write the URDF with its <inertial> here, the rest of it untouched",
            "--in-place": "write the <inertial> into the --urdf itself",
        },
    )
    group.add_argument(
        "--snippet",
        choices=SNIPPETS,
        help="print a file of the links with their <inertial> and nothing else; joints and shapes are yours",
    )
    add_bom_options(parser)
    add_material_options(parser)
    parser.add_argument(
        "--default-density",
        type=float,
        default=1000.0,
        metavar="RHO",
        help="kg/m³ of parts that the BOM lacks (default: 1000)",
    )
    add_options(parser, {"--density-from-step": "use densities in the file before the default one"})
    add_geometry_options(parser)
    add_result_options(parser)
    add_push_options(parser)
    only_with(parser, "--urdf", "--urdf-out", "--in-place")


def run_inertia(args: argparse.Namespace) -> int:
    """Calculate and show; returns 1 for warnings with --strict, or items that a push did not find."""
    need_inertia_extra()
    check_options(args, asks_server=args.push and not args.dry_run)
    if args.urdf_out and args.in_place:
        raise InputError("--urdf-out and --in-place name two places for one URDF; give one of them")
    if args.snippet and args.json:
        raise InputError("--snippet and --json both go to standard output; use --report FILE.json")
    from silo.inertia.calculation import calculate

    # The small files first: a mistake in them should not cost the reading of the geometry.
    table = bom_table(args)
    task = _task(args)
    assembly = read(args.assembly, args)
    report = calculate(assembly, table, task)
    # What was found is shown first: where a link is refused, that is what explains it.
    show(args, report, assembly, quiet=bool(args.snippet))
    if args.snippet:
        _print_snippet(args.snippet, report)
    if task.urdf is not None:
        _write_urdf(args, report, task.urdf)
    pushed = push_report(args, report) if args.push else 0
    return max(pushed, verdict(args, report))


def _task(args: argparse.Namespace) -> Task:
    from silo.inertia.links.frames import FrameChoice
    from silo.inertia.links.link_map import read_link_map
    from silo.inertia.masses import Options
    from silo.inertia.task import Task
    from silo.inertia.urdf import read_urdf

    frame = FrameChoice(args.frame or ("urdf" if args.urdf else "assembly"))
    if frame is FrameChoice.URDF and not args.urdf:
        raise InputError("--frame urdf needs --urdf FILE, whose joints say where the link frames are")
    return Task(
        material_table(args),
        Options(args.default_density, args.density_from_step),
        read_link_map(args.links) if args.links else None,
        frame,
        read_urdf(args.urdf) if args.urdf else None,
        args.loose,
        weights=_pairs(args.mass, "--mass", "NAME=MASS, for example arm=1.25kg"),
    )


def _write_urdf(args: argparse.Namespace, report: InertiaReport, urdf: Urdf) -> None:
    from silo.inertia.output import writable
    from silo.inertia.urdf import write_urdf

    links = writable(report.links.values())
    target = args.urdf if args.in_place else args.urdf_out
    filled = write_urdf(urdf, links, target)
    if not filled.written:
        raise InputError(
            f"{args.urdf}: none of its links ({listed(filled.untouched, 8)}) is one of ours "
            f"({listed(tuple(report.links), 8)}); a link map with --links gives them the URDF's names"
        )
    if target is None:
        print(f"{args.urdf}: not written; --urdf-out FILE or --in-place says where to", file=sys.stderr)
        return
    print(f"{target}: wrote the inertia of {listed(filled.written, 8)}.", file=sys.stderr)
    left = [name for name in filled.untouched if name not in report.links]
    if left:
        print(f"{target}: left as they were, no link of ours: {listed(left, 8)}.", file=sys.stderr)
    massless = [name for name in report.links if name not in links]
    if massless:
        print(f"{target}: not written, without mass: {listed(massless, 8)}.", file=sys.stderr)


def _print_snippet(kind: str, report: InertiaReport) -> None:
    from silo.cli.show import plain
    from silo.inertia.output import document, writable

    text = document(writable(report.links.values()), kind, report.assembly)
    # A file that says nothing of its encoding is UTF-8; a pipe of another code page gets ASCII.
    utf8 = (sys.stdout.encoding or "ascii").lower().replace("-", "") == "utf8"
    sys.stdout.write(text if utf8 else text.encode("ascii", "xmlcharrefreplace").decode())
    # The elements do not say it themselves, and in another frame than the link's they are wrong.
    for name, link in report.links.items():
        print(f"{plain(name)}: frame of the numbers: {plain(link.frame.description)}", file=sys.stderr)


def add_links(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "assembly", "--out", "--preview", metavar="ASSEMBLY", help="a STEP, mesh or FCStd file")
    add_options(parser, {"--urdf FILE": "give parts to links by the names in this URDF"})
    parser.add_argument(
        "--clusters",
        type=int,
        metavar="N",
        help="make N links of parts that lie together, whatever their names",
    )
    add_options(
        parser,
        {
            "--preview FILE...": "write the links as a 3D scene (.glb), one colour each; may be repeated",
            "--out MAP": "write the map here, not to standard output",
        },
    )
    add_geometry_options(parser)


def run_links(args: argparse.Namespace) -> int:
    """Read the geometry, group it into links, and write the map."""
    need_inertia_extra()
    if args.clusters is not None and args.clusters < 1:
        raise InputError(f"--clusters: wanted a number of links above 0, got {args.clusters}")
    if args.clusters is not None and args.urdf:
        raise InputError("--clusters groups by position and --urdf by names; give one of them")
    check_outputs(args)
    from silo.inertia.links.claims import ROOT_LINK, claim
    from silo.inertia.links.starting_map import as_map, as_yaml, starting_map
    from silo.inertia.output import write_whole
    from silo.inertia.urdf import read_urdf

    urdf = read_urdf(args.urdf) if args.urdf else None
    links, root = (urdf.meshes, urdf.root) if urdf is not None else (None, ROOT_LINK)
    assembly = read(args.assembly, args)
    if not assembly.instances:
        raise InputError(f"{args.assembly}: holds no part, so there is nothing to give to links")
    start = starting_map(assembly, links, root=root, clusters=args.clusters)
    made = as_map(start, assembly)
    if args.json:
        patterns = {link.name: {"parts": list(link.patterns)} for link in made.links}
        text = json_text({"links": patterns}, indent=2) + "\n"
    else:
        text = as_yaml(start, assembly)
    if claim(assembly, made).members != start.members:
        print(
            f"silo-mod: {args.assembly}: the names of some parts make their lines match other parts as well; "
            "look at the scene (--preview) before you use the map",
            file=sys.stderr,
        )
    for name in args.preview:
        from silo.drawing.page import LinkView, write_glb

        views = [
            LinkView(link, tuple(assembly.instances[index] for index in ids))
            for link, ids in start.members.items()
        ]
        write_whole(name, write_glb(assembly, views))
    if args.out:
        write_whole(args.out, text.encode("utf-8"))
    else:
        sys.stdout.write(text)
    print(f"{args.out or 'map'}: {start.how}.", file=sys.stderr)
    return Exit.DONE


def add_mass(parser: argparse.ArgumentParser) -> None:
    add_each(
        parser, "top", "--report", "--preview", "--item", metavar="TOP.FCStd", help="the assembly's file"
    )
    add_bom_options(parser)
    add_material_options(parser)
    parser.add_argument(
        "--default-density",
        type=float,
        metavar="RHO",
        help="kg/m³ of parts without a material (default: they count as zero, and are listed)",
    )
    add_geometry_options(parser)
    add_result_options(parser)
    add_push_options(parser)
    # The index is asked only for part numbers.
    only_with(parser, "--push", "--index")


def run_mass(args: argparse.Namespace) -> int:
    """Calculate and show; returns 1 for warnings with --strict, or items that a push did not find."""
    need_inertia_extra()
    # The documents hold identities; their part numbers are the server's, for a preview as well.
    check_options(args, asks_server=args.push)
    from silo.inertia.calculation import calculate
    from silo.inertia.links.link_map import Link, LinkMap
    from silo.inertia.masses import Options
    from silo.inertia.notes import GeometryCode
    from silo.inertia.task import Task

    table = bom_table(args)
    materials = material_table(args)
    assembly = read(args.top, args, object_name=args.assembly, hardware=not args.no_hardware)
    name = assembly.name or "assembly"
    # A FreeCAD document is its own BOM: where it states no material, nobody does.
    options = Options(
        args.default_density or 1000.0,
        step_density=True,
        unknown_is_zero=args.default_density is None,
        own_bom=True,
    )
    whole = LinkMap((Link(name, ("**",)),)) if assembly.instances else None
    report = calculate(assembly, table, Task(materials, options, whole, simulated=False))
    if not assembly.instances:
        words = "the document holds no part with a shape: there is nothing to weigh"
        report.add_warning("", "", words, GeometryCode.NO_GEOMETRY)
    show(args, report, assembly)
    pushed = _push(args, report) if args.push else 0
    return max(pushed, verdict(args, report))


def _push(args: argparse.Namespace, report: InertiaReport) -> int:
    """Push the masses to the items with the part numbers of the documents' identities; --item replaces that
    of the top assembly.
    """
    from silo.bom.report import base_of
    from silo.bom_sync import resolve
    from silo.inertia.geometry.freecad import product_key

    extraction = read_tops(args)[0]
    base = base_of(extraction)
    with client_of(args) as client:
        resolved = resolve(extraction, client)
    numbers = {
        product_key(
            entry.doc_path, entry.object_name, (entry.standard or "") if entry.is_standard else "", base
        ): entry.part_number
        for entry in _all((*resolved.entries, resolved.assembly))
        if entry.part_number
    }
    args.item = args.item or resolved.assembly.part_number
    return push_report(args, report, numbers)


def _all(entries: Sequence[BomEntry]) -> Iterator[BomEntry]:
    for entry in entries:
        yield entry
        yield from _all(entry.children)
