# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as text: tables for a terminal, Markdown, JSON, CSV, and ``<inertial>`` of URDF, SDF and MJCF.

In tables names are text, never markup. JSON is by the schema that `silo-mod schema inertia` prints, CSV has
one row per link and part. An ``<inertial>`` is about the centre of mass, in the axes of the link, without
rotation.

Numbers that go out have full precision and are checked after rounding, on eigenvalues. Most consumers check
nothing: PyBullet silently sets a bad inertia to zero, pinocchio computes NaN. So what no rigid body can
have is refused here, and noise in the last digits is cleared before anything is printed.

Files are written whole or not at all: cancelled halfway, the old one stays and nothing lies beside it.
"""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from silo.bom.errors import InputError, counted, listed
from silo.bom.headers import safe_cell
from silo.inertia.arrays import Floats
from silo.inertia.codes import Decided, Source
from silo.inertia.digits import number
from silo.inertia.report import InertiaReport, LinkResult, PartResult, PartWarning
from silo.inertia.rigid import CHECK_TOLERANCE, MassProps, TensorProblem, tensor_words
from silo.platform import replacing

# Says a finished sentence in the language of a person, as ``silo.spoken`` does.
Say = Callable[[str], str]

_MARGIN = 1e-14
"""Relative; above what printing fifteen digits may change, far below what matters."""


_NOISE = 1e-14
"""Relative: an element below this is the rest of a sum that cancelled."""


def settled(props: MassProps) -> MassProps:
    """Round ``props`` to the digits that are printed, symmetric, with principal moments that keep a + b >= c.

    A flat plate has a + b = c, and rounding may push c above by some 1e-16: MuJoCo refuses that. All moments
    are then raised by the missing amount, which is below 1e-9 of the largest one; a larger amount is no
    rounding, and stays for the check to find.
    """
    tensor = _printed(_quiet((props.inertia + props.inertia.T) / 2))
    for _ in range(4):
        low, mid, high = np.linalg.eigvalsh(tensor)
        missing = float(high - low - mid)
        if missing <= -_MARGIN / 2 * high or missing > CHECK_TOLERANCE * high:
            break
        tensor = _printed(tensor + (max(missing, 0.0) + _MARGIN * high) * np.eye(3))
    reach = np.abs(props.com).max() + np.sqrt(np.abs(tensor).max() / props.mass if props.mass > 0 else 0)
    return MassProps(float(number(props.mass)), _printed(_quiet(props.com, reach)), tensor)


def _quiet(values: Floats, size: float | None = None) -> Floats:
    """Write zero for rounding noise against ``size``: 1e-18 m beside 0.3 m is no position."""
    size = float(np.abs(values).max()) if size is None else size
    quiet: Floats = np.where(np.abs(values) <= _NOISE * size, 0.0, values)
    return quiet


def _printed(values: Floats) -> Floats:
    return np.array([float(number(value)) for value in values.flat]).reshape(values.shape)


def writable(links: Iterable[LinkResult]) -> dict[str, MassProps]:
    """Return link → properties that a simulator accepts. Links without mass are left out.

    Raises InputError with every link whose tensor no rigid body can have; then nothing may be written.
    """
    fit: dict[str, MassProps] = {}
    bad: list[str] = []
    for link in links:
        props = settled(link.props)
        problems = props.check()
        if TensorProblem.ZERO_MASS in problems:
            continue
        if problems:
            bad.append(f"{link.name} {tensor_words(problems)}")
        fit[link.name] = props
    if bad:
        raise InputError("not written, because no rigid body can have these inertias: " + "; ".join(bad))
    return fit


FORMAT = "silo-inertia/1"


def report_data(report: InertiaReport) -> dict[str, Any]:
    """Return the report as JSON values, in SI units. The order of links and parts is stable."""
    return {
        "format": FORMAT,
        "assembly": {"name": report.assembly, "source": report.source},
        "bom": report.bom or None,
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


CSV_COLUMNS: dict[str, str | Callable[[str, PartResult], object]] = {
    "Link": lambda link, part: link,
    "Part": "name",
    "Part number": "part_number",
    "Quantity": "quantity",
    "Mass (kg)": "mass",
    "Total mass (kg)": "total_mass",
    "Volume (m3)": "volume",
    "Density (kg/m3)": "density",
    "Source": "source",
    "Rule": "rule",
    "Decided by": "decided_by",
    "Material": "material",
    "BOM lines": lambda link, part: " ".join(map(str, part.lines)),
    "Path": lambda link, part: part.paths[0],
    "Warnings": lambda link, part: " ".join(dict.fromkeys(str(w.code) for w in part.warnings)),
}
"""What is in a column: an attribute of the part, or what a function makes of the link's name and the part."""


def report_csv(report: InertiaReport) -> str:
    """Write one row for each link and part (RFC 4180).

    Text that a spreadsheet would take for a formula is quoted.
    """
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(CSV_COLUMNS)
    for link, part in report.parts():
        cells = (
            getattr(part, column) if isinstance(column, str) else column(link, part)
            for column in CSV_COLUMNS.values()
        )
        writer.writerow(map(safe_cell, cells))
    return out.getvalue()


_SNIPPETS = {
    "urdf": (
        "link",
        """<inertial>
  <origin xyz="{com}" rpy="0 0 0"/>
  <mass value="{mass}"/>
  <inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>
</inertial>""",
    ),
    "sdf": (
        "link",
        """<inertial>
  <pose>{com} 0 0 0</pose>
  <mass>{mass}</mass>
  <inertia>
    <ixx>{ixx}</ixx>
    <ixy>{ixy}</ixy>
    <ixz>{ixz}</ixz>
    <iyy>{iyy}</iyy>
    <iyz>{iyz}</iyz>
    <izz>{izz}</izz>
  </inertia>
</inertial>""",
    ),
    "mjcf": (
        "body",
        '<inertial pos="{com}" mass="{mass}" fullinertia="{ixx} {iyy} {izz} {ixy} {ixz} {iyz}"/>',
    ),
}
"""Format → its element for a link, and ``<inertial>`` in it: http://wiki.ros.org/urdf/XML/link,
http://sdformat.org/spec, https://mujoco.readthedocs.io."""
SNIPPETS = tuple(_SNIPPETS)


def inertial(props: MassProps, kind: str = "urdf") -> str:
    """Write a link's ``<inertial>``. ``kind``: one of :data:`SNIPPETS`."""
    values = vars(props.to_inertial())
    com = " ".join(map(number, values.pop("com")))
    return _SNIPPETS[kind][1].format(com=com, **{name: number(value) for name, value in values.items()})


# The text around all links that makes the file loadable; {} is the model's name.
_AROUND = {
    "urdf": ("<robot name={}>", "</robot>"),
    "sdf": ('<sdf version="1.9">\n<model name={}>', "</model>\n</sdf>"),
    "mjcf": ("<mujoco model={}>\n<worldbody>", "</worldbody>\n</mujoco>"),
}
_XML = re.compile("[\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]+")
# Names that a format keeps for itself.
_RESERVED = {"mjcf": {"world"}, "sdf": {"world"}}


def snippets(links: Mapping[str, MassProps], kind: str) -> str:
    """Write all links to copy from, each in its ``<link>`` or ``<body>``.

    ``kind``: one of :data:`SNIPPETS`.
    """
    element = _SNIPPETS[kind][0]
    bodies = {name: inertial(props, kind).replace("\n", "\n  ") for name, props in links.items()}
    return "".join(
        f"<{element} name={quoteattr(name)}>\n  {body}\n</{element}>\n" for name, body in bodies.items()
    )


def document(links: Mapping[str, MassProps], kind: str, name: str) -> str:
    """Write a file of all links that the format's own reader loads; the user adds the joints.

    InputError if a link has a name that the format does not allow.
    """
    taken = _RESERVED.get(kind, set())
    unwritable = [ascii(link) for link in links if not _XML.fullmatch(link)]
    if unwritable:
        raise InputError(
            f"XML cannot hold the characters of the link {', '.join(unwritable)}; a link map can rename it"
        )
    bad = [link for link in links if link in taken or (kind == "sdf" and ("::" in link or _is_dunder(link)))]
    if bad:
        raise InputError(
            f"{kind.upper()} does not allow a link with the name {', '.join(bad)}; a link map can rename it"
        )
    title = "".join(c if _XML.fullmatch(c) else " " for c in name)
    title = title.replace("::", " ") if kind == "sdf" else title
    start, end = _AROUND[kind]
    head = "" if kind == "mjcf" else '<?xml version="1.0"?>\n'
    return f"{head}{start.format(quoteattr(title or 'assembly'))}\n{snippets(links, kind)}{end}\n"


def _is_dunder(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")


MAX_PART_ROWS = 60
"""Rows of parts in a terminal; a pipe, JSON, CSV and Markdown have them all."""

NOISE = 1e-9
"""Relative: what is rounding in a table for people. Files have every digit."""

MAX_PLACES = 6
"""Links and parts that one warning names in a terminal and in Markdown; a pipe has all of them."""

SOURCE_WORDS = {
    Source.BOM_MASS: "BOM mass",
    Source.MATERIAL: "material × volume",
    Source.TARGET_MASS: "share of what was weighed",
    Source.SUB_ASSEMBLY_MASS: "share of the sub-assembly's BOM mass",
    Source.STEP_DENSITY: "density in the file × volume",
    Source.DEFAULT_DENSITY: "default density × volume",
    Source.ZERO: "zero",
}


def how(part: PartResult) -> str:
    """Say how a part found its row: "normalised, by quantity"."""
    words = part.rule.replace("_", " ")
    return words if part.decided_by in (Decided.ONLY, Decided.SAME_DATA) else f"{words}, by {part.decided_by}"


def material_of(part: PartResult) -> str:
    """Return the BOM's material, followed by its name in the table if that differs."""
    text = part.material or ""
    name = part.material_name or ""
    if not name or name.casefold() == text.casefold():
        return text or name
    return f"{text} → {name}" if text else name


def report_tables(report: InertiaReport, *, whole: bool = False, say: Say = str) -> RenderableType:
    """Write links, parts and warnings for a terminal, in the words of ``say``.

    ``whole``: all rows, each on one line, for a pipe.
    """
    tables = (_links_table(report, say, whole=whole), _parts_table(report, say, whole=whole))
    return Group(tables[0], Text(), tables[1], Text(), report_warnings(report, whole=whole, say=say))


def _table(title: str, headings: Iterable[str], say: Say) -> Table:
    """Lay out a table; ``headings`` of columns that are flush right begin with ">"."""
    table = Table(title=_plain(say(title)), title_justify="left")
    for heading in headings:
        table.add_column(say(heading.lstrip(">")), justify="right" if heading[0] == ">" else "left")
    return table


def _links_table(report: InertiaReport, say: Say, *, whole: bool) -> Table:
    tensor = ">Ixx Iyy Izz / Ixy Ixz Iyz  kg m²"
    headings = ("Link", ">Mass kg", ">Centre of mass m", tensor, ">Parts", ">Warnings")
    table = _table(f"{report.assembly or 'assembly'}: mass properties", headings, say)
    for link in report.links.values():
        name, mass, com, moments, products, parts = _link_cells(link)
        warnings = str(sum(w.link_name == link.name for w in report.warnings))
        tensor = f"{moments}{' / ' if whole else chr(10)}{products}"
        table.add_row(*map(_plain, (name, mass, com, tensor, parts, warnings)))
    if report.total is not None and not _is_one_body(report):
        table.add_section()
        cells = (
            say("whole assembly"),
            _short(report.total.mass),
            _vector(report.total.com, 1.0),
            say(f"in no link: {_short(_loose(report))} kg") if report.unclaimed else "",
            str(sum(part.quantity for _, part in report.parts())),
            str(len(report.warnings)),
        )
        table.add_row(*map(_plain, cells))
    return table


def _link_cells(link: LinkResult) -> tuple[str, str, str, str, str, str]:
    """Write the cells of a link: name, mass, centre, moments, products, number of parts."""
    t = link.props.inertia
    size = float(abs(t).max())
    return (
        link.name,
        _short(link.props.mass),
        _vector(link.props.com, 1.0),
        _vector((t[0, 0], t[1, 1], t[2, 2]), size),
        _vector((t[0, 1], t[0, 2], t[1, 2]), size),
        str(sum(part.quantity for part in link.parts)),
    )


def _loose(report: InertiaReport) -> float:
    return sum(part.total_mass for part in report.unclaimed)


_PART_HEADINGS = ("Link", "Part", ">Qty", ">Volume cm³", ">Mass kg", "Source", "Matched", "Material")


def _part_cells(link: str, part: PartResult, say: Say = str) -> tuple[str, ...]:
    return (
        link or say("(no link)"),
        part.name,
        str(part.quantity),
        f"{part.volume * 1e6:.5g}",
        _short(part.mass),
        say(SOURCE_WORDS[part.source]),
        say(how(part)),
        material_of(part),
    )


def _parts_table(report: InertiaReport, say: Say, *, whole: bool) -> RenderableType:
    skip = int(_is_one_body(report))  # the link's name
    table = _table("Parts and where their masses come from", _PART_HEADINGS[skip:], say)
    rows = report.parts()
    most = len(rows) if whole else MAX_PART_ROWS
    for link, part in rows[:most]:
        table.add_row(
            *map(_plain, _part_cells(link, part, say)[skip:]), style="yellow" if part.warnings else ""
        )
    if len(rows) > most:
        table.caption = say(f"… and {len(rows) - most} more; --report parts.csv has them all")
    return table


def _is_one_body(report: InertiaReport) -> bool:
    return len(report.links) == 1 and not report.unclaimed


def report_warnings(report: InertiaReport, *, whole: bool = False, say: Say = str) -> Text:
    """Write the warnings for a terminal, a line for each cause: mass at stake, parts, the first message.

    ``whole``: with all places; ``say`` says them in the language of a person.
    """
    if not report.warnings:
        return Text(say("No warnings."), style="green")
    text = Text(f"{say(counted(len(report.warnings), 'warning'))}\n", style="yellow")
    for cause in report.causes():
        groups = _grouped(cause.warnings, with_links=not _is_one_body(report))
        where = list(dict.fromkeys(place for places in groups.values() for place in places))
        mass = f"{_short(cause.mass)} kg in " if cause.mass > 0 else ""
        places = ", ".join(where) if whole else listed(where, MAX_PLACES)
        text.append(f"  {mass}{places}: " if where else "  ", style="bold")
        text.append(_clean(say(next(iter(groups))[0])))
        more = f"; {len(groups) - 1} more like it, each in --json and in a report" if len(groups) > 1 else ""
        text.append(f"{say(more)}  [{cause.code}]\n", style="dim")
    return text


def _grouped(warnings: Iterable[PartWarning], *, with_links: bool = True) -> dict[tuple[str, str], list[str]]:
    """Group warnings by message and code → where; a warning about twenty parts is one line."""
    groups: dict[tuple[str, str], list[str]] = {}
    for warning in warnings:
        where = groups.setdefault((warning.message, str(warning.code)), [])
        link = warning.link_name if with_links or not warning.part_name else ""
        names = " / ".join(_clean(word) for word in (link, warning.part_name) if word)
        if names:
            where.append(names)
    return groups


def report_markdown(report: InertiaReport) -> str:
    """Write the report as Markdown."""
    out = [f"# Mass properties of {_cell(report.assembly or 'the assembly')}", ""]
    out += [f"Geometry: {_cell(report.source)}  ", f"BOM: {_cell(report.bom) or 'none'}", ""]
    out += ["## Links", "", *_link_rows(report), "", *_frames(report), ""]
    out += ["## Parts", "", *_part_rows(report), ""]
    if report.unclaimed:
        out += [
            f"Parts without a link sum up to {_short(_loose(report))} kg; they are in no link's mass.",
            "",
        ]
    out += ["## Warnings", ""]
    out += [_warning_row(*group, where) for group, where in _grouped(report.warnings).items()] or ["None."]
    return "\n".join(out) + "\n"


def _link_rows(report: InertiaReport) -> Iterable[str]:
    yield "| Link | Mass kg | Centre of mass m | Ixx, Iyy, Izz kg m² | Ixy, Ixz, Iyz kg m² | Parts |"
    yield "|---|--:|--:|--:|--:|--:|"
    for link in report.links.values():
        yield _row(_link_cells(link))
    if report.total is not None:
        total = report.total
        yield f"| **whole assembly** | **{_short(total.mass)}** | {_vector(total.com, 1.0)} | | | |"


def _frames(report: InertiaReport) -> Iterable[str]:
    frames = {link.frame.description for link in report.links.values()}
    if len(frames) == 1:
        frame = _cell(frames.pop())
        yield f"Inertia is about each centre of mass. Frame: {frame}; of the whole assembly: its own."
        return
    yield "Inertia is about each centre of mass. Frames:"
    yield ""
    for link in report.links.values():
        yield f"- {_cell(link.name)}: {_cell(link.frame.description)}"


def _part_rows(report: InertiaReport) -> Iterable[str]:
    yield _row(heading.lstrip(">") for heading in _PART_HEADINGS)
    yield _row("--:" if heading[0] == ">" else "---" for heading in _PART_HEADINGS)
    for link, part in report.parts():
        yield _row(_part_cells(link, part))


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(map(_cell, cells))} |"


def _warning_row(message: str, code: str, where: Sequence[str]) -> str:
    return f"- {f'**{_cell(listed(where, MAX_PLACES))}**: ' if where else ''}{_cell(message)} (`{code}`)"


def _cell(text: str) -> str:
    return re.sub(r"([\\`*_{}\[\]<>|])", r"\\\1", _clean(text))


def _plain(text: str) -> Text:
    return Text("\n".join(_clean(line) for line in text.split("\n")))


def _clean(text: str) -> str:
    """Put a text on one line without control characters, since a part's name must not steer a terminal."""
    return " ".join(re.sub(r"[\x00-\x1f\x7f-\x9f]", " ", text).split())


def _short(value: float) -> str:
    return f"{value:.6g}"


def _vector(values: Iterable[float], size: float = 0.0) -> str:
    """Write each value with five digits; noise against ``size`` becomes 0."""
    return "  ".join(f"{value:.5g}" if abs(value) > NOISE * size else "0" for value in values)


def write_whole(path: Path | str, data: bytes, *, like: Path | str | None = None) -> None:
    """Replace ``path`` by ``data`` in one step. If it is a symbolic link, its target is replaced.

    ``like``: take the mode of that file; else that of the old file, else what a new file gets here.
    InputError if the folder or the file cannot be written.
    """
    target = Path(os.path.realpath(path))
    try:
        if target.exists() and not target.is_file():
            # A pipe or a device cannot be replaced, and need not be: nobody reads it twice.
            target.write_bytes(data)
            return
        with replacing(target, mode=_mode(target if like is None else Path(like))) as file:
            file.write(data)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from error


def _mode(path: Path) -> int:
    try:
        return path.stat().st_mode & 0o7777
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
