# SPDX-License-Identifier: LGPL-2.1-or-later
"""A link map: the links of a robot with patterns of the parts in them, read from a small YAML file.

::

    links:
      base: [base, "cover*"]                 # patterns; a matched sub-assembly brings all below it
      upper_arm:
        parts: ["arm_1/**", "product:M4 bolt*"]
        frame: arm_1                         # axes and origin of that placed sub-assembly, or
        origin: {xyz: [0, 0, 0.1], rpy: [0, 0, 0]}   # given in the assembly's frame, m and rad
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from silo.bom.errors import ConfigError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.inertia.arrays import Floats
from silo.inertia.links.frames import MOST_RAD, origin_frame

PRODUCT, PATH = "product:", "path:"


@dataclass(frozen=True, eq=False)
class Link:
    """One link of a map: its patterns, its frame as the map asks for it (None: the run's), its weight."""

    name: str
    patterns: tuple[str, ...]
    frame_of: str | None = None
    origin: Floats | None = None
    mass: str | None = None


@dataclass(frozen=True, eq=False)
class LinkMap:
    """Links in the file's order. ``source`` names the file."""

    links: tuple[Link, ...]
    source: str = ""


def read_link_map(path: Path | str) -> LinkMap:
    """Read a link map in YAML. ConfigError names every problem of the file at once."""
    try:
        text = Path(path).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            message("{path}: the link map cannot be read ({error})", path=path, error=why_refused(error))
        ) from error
    return link_map(_yaml(text, str(path)), str(path))


def _where(error: Exception) -> str:
    """Say in which line a YAML text is wrong; the parser's own words are about its tokens."""
    mark = getattr(error, "problem_mark", None)
    if mark is None:
        return message("lists in lists without an end")
    return message("line {line}, column {column}", line=mark.line + 1, column=mark.column + 1)


def _yaml(text: str, source: str) -> Any:
    """Parse YAML into plain values (texts, lists and dicts), since a link may be called ``on`` or ``1.10``.

    In YAML the last of two equal keys wins, which would lose a link's parts without a message; so equal keys
    are an error.
    """
    import yaml

    twice: list[str] = []

    class Loader(yaml.BaseLoader):
        def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
            lines = {k.value: k.start_mark.line + 1 for k, _ in node.value if isinstance(k, yaml.ScalarNode)}
            count = Counter(k.value for k, _ in node.value if isinstance(k, yaml.ScalarNode))
            twice.extend(
                message("“{key}” (line {line})", key=key, line=lines[key])
                for key, n in count.items()
                if n > 1
            )
            return super().construct_mapping(node, deep)

    try:
        data = yaml.load(text, Loader)
    except (yaml.YAMLError, RecursionError) as error:
        raise ConfigError(
            message("{source}: this is not valid YAML ({where})", source=source, where=_where(error))
        ) from error
    if twice:
        raise ConfigError(
            message(
                "{source}: given twice: {twice}; write all parts of a link in one place",
                source=source,
                twice=", ".join(twice),
            )
        )
    return data


def as_link_map(links: LinkMap | Mapping[str, Any] | Path | str | None) -> LinkMap | None:
    """Make a link map of what a caller may give: a map, its file, or plain values, with or without ``links:``
    around.

    ``{"base": ["base*", "plate"]}`` is link → patterns. For anything else, ConfigError says what is allowed.
    """
    if links is None or isinstance(links, LinkMap):
        return links
    if isinstance(links, (str, Path)):
        return read_link_map(links)
    if isinstance(links, Mapping):
        whole = isinstance(links.get("links"), Mapping) and len(links) == 1
        return link_map({"links": {**(links["links"] if whole else links)}})
    raise ConfigError(
        message(
            "links: wanted a link map, the path of its YAML file, or a dict of link → list "
            "of patterns; got {name}",
            name=type(links).__name__,
        )
    )


def link_map(data: Any, source: str = "the link map") -> LinkMap:
    """Do what :func:`read_link_map` does, from plain values."""
    links = data.get("links") if isinstance(data, dict) else None
    if not isinstance(links, dict) or not links:
        raise ConfigError(
            message("{source}: wanted “links:” with a list of patterns for each link", source=source)
        )
    problems: list[str] = []
    made = tuple(_link(name, value, problems) for name, value in links.items())
    if problems:
        raise ConfigError(message("{source}: ", source=source) + "; ".join(problems))
    return LinkMap(made, source)


def _link(name: Any, value: Any, problems: list[str]) -> Link:
    if not isinstance(name, str) or not name:
        problems.append(message("a link's name is a text, got {name}", name=repr(name)))
    given: dict[Any, Any] = value if isinstance(value, dict) else {"parts": value}
    parts = given.get("parts", [])
    patterns = [parts] if isinstance(parts, str) else parts
    if (
        not isinstance(patterns, list | tuple)
        or not patterns
        or not all(p and isinstance(p, str) for p in patterns)
    ):
        problems.append(
            message("{name}: wanted a list of patterns, got {parts}", name=name, parts=repr(parts))
        )
        patterns = []
    for key in sorted(set(given) - {"parts", "frame", "origin", "mass"}, key=str):
        problems.append(
            message("{name}: unknown key “{key}”; known are parts, frame, origin, mass", name=name, key=key)
        )
    if "frame" in given and "origin" in given:
        problems.append(message("{name}: has both a frame and an origin; give one of them", name=name))
    origin: Floats | None = None
    if "origin" in given:
        try:
            origin = _origin(given["origin"])
        except (AttributeError, TypeError, ValueError) as error:
            problems.append(
                message(
                    "{name}: origin: wanted {xyz: [x, y, z], rpy: [r, p, y]} in m and rad ({error})",
                    name=name,
                    error=error,
                )
            )
    frame = given.get("frame")
    if frame is not None and not isinstance(frame, str):
        problems.append(
            message(
                "{name}: frame: wanted the name of a part or sub-assembly, got {frame}",
                name=name,
                frame=repr(frame),
            )
        )
    mass = given.get("mass")
    if mass is not None and not isinstance(mass, str | int | float):
        problems.append(
            message("{name}: mass: wanted a mass such as 1.25 kg, got {mass}", name=name, mass=repr(mass))
        )
    weight = None if mass is None else str(mass)
    return Link(str(name), tuple(patterns), None if frame is None else str(frame), origin, weight)


def _origin(value: Mapping[str, Any]) -> Floats:
    xyz = [float(v) for v in value.get("xyz", (0, 0, 0))]
    rpy = [float(v) for v in value.get("rpy", (0, 0, 0))]
    if len(xyz) != 3 or len(rpy) != 3 or not np.isfinite([*xyz, *rpy]).all():
        raise ValueError(message("three numbers each"))
    if max(map(abs, rpy)) > MOST_RAD:
        raise ValueError(message("rpy turns by more than a whole turn; is it in degrees?"))
    return origin_frame(xyz, rpy)
