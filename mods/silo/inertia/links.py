# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which instance belongs to which link: first-level sub-assemblies, or a map of instance path patterns.

A map is a small YAML file::

    links:
      base: [base, "cover*"]                 # patterns; a matched sub-assembly brings all below it
      upper_arm:
        parts: ["arm_1/**", "product:M4 bolt*"]
        frame: arm_1                         # axes and origin of that placed sub-assembly, or
        origin: {xyz: [0, 0, 0.1], rpy: [0, 0, 0]}   # given in the assembly's frame, m and rad

``*`` stands for anything within one level, ``?`` for one character, ``**`` for any number of levels. A
pattern is about instance names; after ``product:`` about product names; after ``path:`` it has no
wildcards. The first link that matches an instance has it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from silo.bom.errors import ConfigError
from silo.inertia.core import Floats
from silo.inertia.model import Assembly, Instance


class FrameChoice(StrEnum):
    """Which frame a run gives its numbers in."""

    ASSEMBLY = "assembly"  # that of the whole file
    OWN = "own"  # each sub-assembly's own, as placed in the file
    URDF = "urdf"  # the link's frame by the joints of a URDF, at position zero


@dataclass(frozen=True, eq=False)
class LinkFrame:
    """A frame: (4, 4) placement in the assembly's frame [m], in words, and whether the map chose it."""

    placement: Floats
    description: str
    chosen: bool = False

    def inverse(self) -> Floats:
        """(4, 4): assembly's frame → this frame."""
        turn = self.placement[:3, :3].T
        result = np.eye(4)
        result[:3, :3] = turn
        result[:3, 3] = -turn @ self.placement[:3, 3]
        return result


def apart(left: Floats, right: Floats) -> tuple[float, float]:
    """Distance of two placements' origins [m] and the angle between their axes [rad]."""
    turn = left[:3, :3].T @ right[:3, :3]
    cosine = np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0)
    return float(np.linalg.norm(left[:3, 3] - right[:3, 3])), float(np.arccos(cosine))


ASSEMBLY_FRAME = LinkFrame(np.eye(4), "assembly frame")


def origin_frame(xyz: Sequence[float], rpy: Sequence[float]) -> Floats:
    """(4, 4) placement of a URDF origin: xyz [m], rpy [rad] about fixed axes (R = Rz(y) Ry(p) Rx(r))."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    result = np.eye(4)
    result[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    result[:3, 3] = xyz
    return result


MOST_RAD = 6.3
"""Anybody's angle: a turn is 6.2832."""

PRODUCT, PATH = "product:", "path:"
ROOT_LINK = "base_link"
"""The usual name of a robot's first link (ROS REP 105)."""


@dataclass(frozen=True, eq=False)
class Link:
    """One link of a map: its patterns, and its frame as the map asks for it (None: the run's choice)."""

    name: str
    patterns: tuple[str, ...]
    frame_of: str | None = None
    origin: Floats | None = None


@dataclass(frozen=True, eq=False)
class LinkMap:
    """Links in the file's order. ``source`` names the file."""

    links: tuple[Link, ...]
    source: str = ""


@dataclass(frozen=True, eq=False)
class Claims:
    """Who has what.

    members
        link name → instance indices, in the map's order; links without parts are kept, empty.
    unclaimed
        indices that no link has.
    frames
        link name → its frame.
    twice
        (link that has it, link that wanted it too, instance index).
    unused
        (link, pattern) that matched nothing.
    rooted
        without a map: indices of parts in no sub-assembly, which the root link has.
    """

    members: Mapping[str, tuple[int, ...]]
    unclaimed: tuple[int, ...] = ()
    frames: Mapping[str, LinkFrame] | None = None
    twice: tuple[tuple[str, str, int], ...] = ()
    unused: tuple[tuple[str, str], ...] = ()
    rooted: tuple[int, ...] = ()

    def frame(self, link: str) -> LinkFrame:
        """The link's frame; the assembly's where none was set."""
        return (self.frames or {}).get(link, ASSEMBLY_FRAME)


def read_link_map(path: Path | str) -> LinkMap:
    """A YAML map. ConfigError with every problem of the file at once."""
    try:
        text = Path(path).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: the link map cannot be read ({error})") from error
    return link_map(_yaml(text, str(path)), str(path))


def _yaml(text: str, source: str) -> Any:
    """Plain values: texts, lists and dicts, for a link may be called ``on`` or ``1.10``.

    YAML lets the last of two equal keys win, which would lose a link's parts in silence.
    """
    import yaml

    twice: list[str] = []

    class Loader(yaml.BaseLoader):
        def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
            lines = {k.value: k.start_mark.line + 1 for k, _ in node.value if isinstance(k, yaml.ScalarNode)}
            count = Counter(k.value for k, _ in node.value if isinstance(k, yaml.ScalarNode))
            twice.extend(f"“{key}” (line {lines[key]})" for key, n in count.items() if n > 1)
            return super().construct_mapping(node, deep)

    try:
        data = yaml.load(text, Loader)
    except (yaml.YAMLError, RecursionError) as error:
        raise ConfigError(f"{source}: this is no YAML ({' '.join(str(error).split())})") from error
    if twice:
        raise ConfigError(
            f"{source}: given twice: {', '.join(twice)}; write all parts of a link in one place"
        )
    return data


def as_link_map(links: LinkMap | Mapping[str, Any] | Path | str | None) -> LinkMap | None:
    """What a caller may give for links: a map, its file, or plain values, with or without ``links:`` around.

    ``{"base": ["base*", "plate"]}`` is link → patterns. ConfigError says what was wanted otherwise.
    """
    if links is None or isinstance(links, LinkMap):
        return links
    if isinstance(links, (str, Path)):
        return read_link_map(links)
    if isinstance(links, Mapping):
        whole = isinstance(links.get("links"), Mapping) and len(links) == 1
        return link_map({"links": {**(links["links"] if whole else links)}})
    raise ConfigError(
        "links: wanted a link map, the path of its YAML file, or a dict of link → list of patterns; "
        f"got {type(links).__name__}"
    )


def link_map(data: Any, source: str = "the link map") -> LinkMap:
    """As :func:`read_link_map`, from plain values."""
    links = data.get("links") if isinstance(data, dict) else None
    if not isinstance(links, dict) or not links:
        raise ConfigError(f"{source}: wanted “links:” with a list of patterns for each link")
    problems: list[str] = []
    made = tuple(_link(name, value, problems) for name, value in links.items())
    if problems:
        raise ConfigError(f"{source}: " + "; ".join(problems))
    return LinkMap(made, source)


def _link(name: Any, value: Any, problems: list[str]) -> Link:
    if not isinstance(name, str) or not name:
        problems.append(f"a link's name is a text, got {name!r}")
    given: dict[Any, Any] = value if isinstance(value, dict) else {"parts": value}
    parts = given.get("parts", [])
    patterns = [parts] if isinstance(parts, str) else parts
    if (
        not isinstance(patterns, list | tuple)
        or not patterns
        or not all(p and isinstance(p, str) for p in patterns)
    ):
        problems.append(f"{name}: wanted a list of patterns, got {parts!r}")
        patterns = []
    for key in sorted(set(given) - {"parts", "frame", "origin"}, key=str):
        problems.append(f"{name}: unknown key “{key}”; known are parts, frame, origin")
    if "frame" in given and "origin" in given:
        problems.append(f"{name}: has both a frame and an origin; one of them")
    origin: Floats | None = None
    if "origin" in given:
        try:
            origin = _origin(given["origin"])
        except (AttributeError, TypeError, ValueError) as error:
            problems.append(
                f"{name}: origin: wanted {{xyz: [x, y, z], rpy: [r, p, y]}} in m and rad ({error})"
            )
    frame = given.get("frame")
    if frame is not None and not isinstance(frame, str):
        problems.append(f"{name}: frame: wanted the name of a part or sub-assembly, got {frame!r}")
    return Link(str(name), tuple(patterns), None if frame is None else str(frame), origin)


def _origin(value: Mapping[str, Any]) -> Floats:
    xyz = [float(v) for v in value.get("xyz", (0, 0, 0))]
    rpy = [float(v) for v in value.get("rpy", (0, 0, 0))]
    if len(xyz) != 3 or len(rpy) != 3 or not np.isfinite([*xyz, *rpy]).all():
        raise ValueError("three numbers each")
    if max(map(abs, rpy)) > MOST_RAD:
        raise ValueError("rpy turns by more than a whole turn; is it in degrees?")
    return origin_frame(xyz, rpy)


def claim(assembly: Assembly, links: LinkMap | None = None, root: str = ROOT_LINK) -> Claims:
    """Give every instance to a link, or list it as unclaimed. ``root``: the link of what no other has."""
    return _by_map(assembly, links) if links is not None else _by_first_level(assembly, root)


def _by_first_level(assembly: Assembly, root: str) -> Claims:
    """Each first-level sub-assembly is a link; parts that lie beside them belong to the root link.

    Without any sub-assembly the whole is one link, named after the assembly.
    """
    if all(len(instance.path) < 2 for instance in assembly.instances):
        name = assembly.name or "assembly"
        return Claims({name: tuple(range(len(assembly.instances)))})
    members: dict[str, list[int]] = {}
    rooted = [index for index, instance in enumerate(assembly.instances) if len(instance.path) < 2]
    if rooted and all(instance.path[0] != root for instance in assembly.instances):
        members[root] = []
    for index, instance in enumerate(assembly.instances):
        members.setdefault(instance.path[0] if len(instance.path) > 1 else root, []).append(index)
    frames = {
        name: LinkFrame(assembly.frames[(name,)], f"sub-assembly “{name}”")
        for name in members
        if (name,) in assembly.frames
    }
    return Claims({name: tuple(ids) for name, ids in members.items()}, (), frames, rooted=tuple(rooted))


def _by_map(assembly: Assembly, links: LinkMap) -> Claims:
    members: dict[str, list[int]] = {link.name: [] for link in links.links}
    used: set[tuple[str, str]] = set()
    twice: list[tuple[str, str, int]] = []
    unclaimed: list[int] = []
    for index, instance in enumerate(assembly.instances):
        owner: str | None = None
        for link in links.links:
            hits = [pattern for pattern in link.patterns if matches(pattern, instance)]
            used.update((link.name, pattern) for pattern in hits)
            if hits and owner is None:
                owner = link.name
                members[owner].append(index)
            elif hits and owner is not None:
                twice.append((owner, link.name, index))
        if owner is None:
            unclaimed.append(index)
    unused = [(k.name, p) for k in links.links for p in k.patterns if (k.name, p) not in used]
    return Claims(
        {name: tuple(ids) for name, ids in members.items()},
        tuple(unclaimed),
        _map_frames(assembly, links),
        tuple(twice),
        tuple(unused),
    )


def _map_frames(assembly: Assembly, links: LinkMap) -> dict[str, LinkFrame]:
    frames: dict[str, LinkFrame] = {}
    problems: list[str] = []
    for link in links.links:
        if link.origin is not None:
            frames[link.name] = LinkFrame(link.origin, "origin in the link map", chosen=True)
        elif link.frame_of is not None:
            found = _frame_of(assembly, link.frame_of)
            if found is None:
                problems.append(f"{link.name}: there is no placed sub-assembly or part “{link.frame_of}”")
            else:
                frames[link.name] = LinkFrame(found, f"frame of “{link.frame_of}”", chosen=True)
    if problems:
        raise ConfigError(f"{links.source}: " + "; ".join(problems))
    return frames


def _frame_of(assembly: Assembly, name: str) -> Floats | None:
    path = tuple(name.split("/"))
    if path in assembly.frames:
        return assembly.frames[path]
    return next((i.transform for i in assembly.instances if i.path == path), None)


def matches(pattern: str, instance: Instance) -> bool:
    """True where a pattern means this instance or a sub-assembly above it."""
    if pattern.startswith(PATH):
        exact = pattern.removeprefix(PATH)
        return any("/".join(instance.path[:end]) == exact for end in range(1, len(instance.path) + 1))
    by_product = pattern.startswith(PRODUCT)
    names: Sequence[str] = instance.product_path if by_product else instance.path
    regex = _regex(pattern.removeprefix(PRODUCT) if by_product else pattern)
    if by_product:
        # A product pattern may begin at any level: a product is the same wherever it stands.
        return any(
            regex.fullmatch("/".join(names[start:end]))
            for start in range(len(names))
            for end in range(start + 1, len(names) + 1)
        )
    return any(regex.fullmatch("/".join(names[:end])) for end in range(1, len(names) + 1))


@lru_cache(maxsize=1024)
def _regex(pattern: str) -> re.Pattern[str]:
    text = "/".join(_level(level) for level in pattern.strip("/").split("/"))
    return re.compile(
        text.replace(_ANY + "/", "(?:.*/)?").replace("/" + _ANY, "(?:/.*)?").replace(_ANY, ".*"), re.DOTALL
    )


_ANY = "\x00"


def _level(level: str) -> str:
    """One level as a regular expression: ``*`` and ``?`` never cross a slash."""
    if level == "**":
        return _ANY
    first, *others = (
        re.escape(piece).replace(r"\?", "[^/]").replace(_ANY, r"\x00") for piece in re.split(r"\*+", level)
    )
    # The first place that fits a piece is as good as any later one, so no ``*`` is tried twice.
    between = "".join(f"(?>[^/]*?{piece})" for piece in others[:-1])
    return first + between + "".join(f"[^/]*{piece}" for piece in others[-1:])
