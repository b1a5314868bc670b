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

A map to start from has every instance in one link, for a person to move lines about: by the links of a URDF
if there is one (names of links and of their meshes), else by first-level sub-assemblies, else, for exports
without any, by where the parts are.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache
from itertools import count, islice
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.bom.errors import ConfigError, counted, listed
from silo.inertia.arrays import Floats
from silo.inertia.assembly import Assembly, Instance, placed_below
from silo.inertia.matching import bare


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
        """Return the matrix (4, 4) from the assembly's frame to this one."""
        turn = self.placement[:3, :3].T
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        matrix[:3, 3] = -turn @ self.placement[:3, 3]
        return matrix


def apart(left: Floats, right: Floats) -> tuple[float, float]:
    """Return the distance of two placements' origins [m] and the angle between their axes [rad]."""
    turn = left[:3, :3].T @ right[:3, :3]
    cosine = np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0)
    return float(np.linalg.norm(left[:3, 3] - right[:3, 3])), float(np.arccos(cosine))


ASSEMBLY_FRAME = LinkFrame(np.eye(4), "assembly frame")


def origin_frame(xyz: Sequence[float], rpy: Sequence[float]) -> Floats:
    """Return the placement (4, 4) of a URDF origin.

    ``xyz`` in m, ``rpy`` in rad about fixed axes (R = Rz(y) Ry(p) Rx(r)).
    """
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    matrix[:3, 3] = xyz
    return matrix


MOST_RAD = 6.3
"""Anybody's angle: a turn is 6.2832."""

PRODUCT, PATH = "product:", "path:"
ROOT_LINK = "base_link"
"""The usual name of a robot's first link (ROS REP 105)."""


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
        """Return the link's frame; the assembly's if none was set."""
        return (self.frames or {}).get(link, ASSEMBLY_FRAME)


def read_link_map(path: Path | str) -> LinkMap:
    """Read a link map in YAML. ConfigError names every problem of the file at once."""
    try:
        text = Path(path).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: the link map cannot be read ({error})") from error
    return link_map(_yaml(text, str(path)), str(path))


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
            twice.extend(f"“{key}” (line {lines[key]})" for key, n in count.items() if n > 1)
            return super().construct_mapping(node, deep)

    try:
        data = yaml.load(text, Loader)
    except (yaml.YAMLError, RecursionError) as error:
        raise ConfigError(f"{source}: this is not valid YAML ({' '.join(str(error).split())})") from error
    if twice:
        raise ConfigError(
            f"{source}: given twice: {', '.join(twice)}; write all parts of a link in one place"
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
        "links: wanted a link map, the path of its YAML file, or a dict of link → list of patterns; "
        f"got {type(links).__name__}"
    )


def link_map(data: Any, source: str = "the link map") -> LinkMap:
    """Do what :func:`read_link_map` does, from plain values."""
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
    for key in sorted(set(given) - {"parts", "frame", "origin", "mass"}, key=str):
        problems.append(f"{name}: unknown key “{key}”; known are parts, frame, origin, mass")
    if "frame" in given and "origin" in given:
        problems.append(f"{name}: has both a frame and an origin; give one of them")
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
    mass = given.get("mass")
    if mass is not None and not isinstance(mass, str | int | float):
        problems.append(f"{name}: mass: wanted a mass such as 1.25 kg, got {mass!r}")
    weight = None if mass is None else str(mass)
    return Link(str(name), tuple(patterns), None if frame is None else str(frame), origin, weight)


def _origin(value: Mapping[str, Any]) -> Floats:
    xyz = [float(v) for v in value.get("xyz", (0, 0, 0))]
    rpy = [float(v) for v in value.get("rpy", (0, 0, 0))]
    if len(xyz) != 3 or len(rpy) != 3 or not np.isfinite([*xyz, *rpy]).all():
        raise ValueError("three numbers each")
    if max(map(abs, rpy)) > MOST_RAD:
        raise ValueError("rpy turns by more than a whole turn; is it in degrees?")
    return origin_frame(xyz, rpy)


def claim(assembly: Assembly, links: LinkMap | None = None, root: str = ROOT_LINK) -> Claims:
    """Give every instance to a link, or list it as unclaimed. ``root``: the link of those that no other link
    has.
    """
    return _by_map(assembly, links) if links is not None else _by_first_level(assembly, root)


def _by_first_level(assembly: Assembly, root: str) -> Claims:
    """Make each first-level sub-assembly a link; parts beside them belong to the root link.

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
            floats = _frame_of(assembly, link.frame_of)
            if floats is None:
                problems.append(f"{link.name}: there is no placed sub-assembly or part “{link.frame_of}”")
            else:
                frames[link.name] = LinkFrame(floats, f"frame of “{link.frame_of}”", chosen=True)
    if problems:
        raise ConfigError(f"{links.source}: " + "; ".join(problems))
    return frames


def _frame_of(assembly: Assembly, name: str) -> Floats | None:
    path = tuple(name.split("/"))
    if path in assembly.frames:
        return assembly.frames[path]
    return next((i.transform for i in assembly.instances if i.path == path), None)


def matches(pattern: str, instance: Instance) -> bool:
    """Return True if a pattern matches this instance or a sub-assembly above it."""
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


def components(pattern: str, instances: Sequence[Instance]) -> list[list[int]]:
    """Find the instances of each placed part or sub-assembly that a pattern matches, highest level first."""
    rows_by_path: dict[tuple[str, ...], list[int]] = {}
    for index, instance in enumerate(instances):
        levels = (
            replace(instance, path=instance.path[:n], product_path=instance.product_path[:n])
            for n in count(1)
        )
        for level in islice(levels, len(instance.path)):
            if matches(pattern, level):
                rows_by_path.setdefault(level.path, []).append(index)
                break
    return list(rows_by_path.values())


@lru_cache(maxsize=1024)
def _regex(pattern: str) -> re.Pattern[str]:
    text = "/".join(_level(level) for level in pattern.strip("/").split("/"))
    return re.compile(
        text.replace(_ANY + "/", "(?:.*/)?").replace("/" + _ANY, "(?:/.*)?").replace(_ANY, ".*"), re.DOTALL
    )


_ANY = "\x00"


def _level(level: str) -> str:
    """Translate one level into a regular expression: ``*`` and ``?`` never cross a slash."""
    if level == "**":
        return _ANY
    first, *others = (
        re.escape(piece).replace(r"\?", "[^/]").replace(_ANY, r"\x00") for piece in re.split(r"\*+", level)
    )
    # The first place that fits a piece is as good as any later one, so no ``*`` is tried twice.
    between = "".join(f"(?>[^/]*?{piece})" for piece in others[:-1])
    return first + between + "".join(f"[^/]*{piece}" for piece in others[-1:])


Labels = NDArray[np.intp]

MOST_CLUSTERS = 8
"""As many links are tried for an export without sub-assemblies, unless the user says how many."""


@dataclass(frozen=True)
class StartingMap:
    """Links in order, each with the indices of its instances; links of a URDF that nothing is called like.

    how
        in words, how the instances were given to links.
    """

    members: Mapping[str, tuple[int, ...]]
    how: str
    empty: tuple[str, ...] = ()


def starting_map(
    assembly: Assembly,
    urdf_links: Mapping[str, Sequence[str]] | None = None,
    *,
    root: str = ROOT_LINK,
    clusters: int | None = None,
) -> StartingMap:
    """Give every instance to a link.

    urdf_links
        link → mesh file names, as a URDF has them. Parts without a link of the same name go to ``root``.
    clusters
        how many links to make of a file without sub-assemblies; None: the number that fits the positions
        best.
    """
    if urdf_links:
        return _by_urdf(assembly, urdf_links, root)
    if clusters is None and any(len(instance.path) > 1 for instance in assembly.instances):
        how = f"each first-level sub-assembly is a link; parts beside them are in {root}"
        return StartingMap(claim(assembly, root=root).members, how)
    return _by_position(assembly, clusters)


def _by_urdf(assembly: Assembly, urdf_links: Mapping[str, Sequence[str]], root: str) -> StartingMap:
    owner_of: dict[str, str] = {}
    for owners in (_said_by_links(urdf_links), _said_by_meshes(urdf_links)):
        for word, name in owners.items():
            owner_of.setdefault(word, name)
    members: dict[str, list[int]] = {name: [] for name in urdf_links}
    members.setdefault(root, [])
    named = 0
    for index, instance in enumerate(assembly.instances):
        owner = _owner(instance, owner_of)
        named += owner is not None
        members[owner or root].append(index)
    how = f"{named} of {counted(len(assembly.instances), 'part')} by names of the URDF's links and meshes" + (
        f"; the others are in {root}" if named < len(assembly.instances) else ""
    )
    empty = tuple(name for name, ids in members.items() if not ids)
    return StartingMap({name: tuple(ids) for name, ids in members.items() if ids}, how, empty)


def _said_by_links(urdf_links: Mapping[str, Sequence[str]]) -> dict[str, str]:
    return _only({word_of(name): name for name in urdf_links}, [word_of(name) for name in urdf_links])


def _said_by_meshes(urdf_links: Mapping[str, Sequence[str]]) -> dict[str, str]:
    pairs = {
        (word_of(PurePosixPath(mesh.replace("\\", "/")).stem), name)
        for name, meshes in urdf_links.items()
        for mesh in meshes
    }
    return _only(dict(pairs), [word for word, _ in pairs])


def _only(owners: dict[str, str], words: Sequence[str]) -> dict[str, str]:
    """Leave out words that two links have: a mesh of a wheel that four links share shows no link."""
    times = Counter(words)
    return {word: name for word, name in owners.items() if word and times[word] == 1}


def word_of(name: str) -> str:
    """Return the word that "base_link", "Link base" and "base <1>" have in common."""
    return re.sub(r"^link | link$", "", bare(name))


def _owner(instance: Instance, owner_of: Mapping[str, str]) -> str | None:
    """Find the owner by the innermost level named like a link: a forearm inside an arm is the forearm."""
    for name, product in reversed([*zip(instance.path, instance.product_path, strict=False)]):
        for word in (word_of(name), word_of(product)):
            if word in owner_of:
                return owner_of[word]
    return None


def _by_position(assembly: Assembly, clusters: int | None) -> StartingMap:
    points = np.array([_centre(assembly, instance) for instance in assembly.instances]).reshape(-1, 3)
    labels = _clustered(points, clusters)
    order = sorted(
        set(labels.tolist()), key=lambda n: float(np.linalg.norm(points[labels == n].mean(axis=0)))
    )
    names = {number: f"link_{place}" for place, number in enumerate(order, start=1)}
    members = {names[n]: tuple(np.flatnonzero(labels == n).tolist()) for n in order}
    why = f"--clusters {clusters}" if clusters else "the file has no sub-assemblies"
    how = f"{why}, so parts that lie together are together; a guess by position alone"
    if len(members) < 2:
        members = {assembly.name or ROOT_LINK: tuple(range(len(points)))} if len(points) else {}
        how = "the file has no sub-assemblies, and its parts lie together; --clusters N makes N links"
    return StartingMap(members, how)


def _centre(assembly: Assembly, instance: Instance) -> Floats:
    turn, shift = instance.transform[:3, :3], instance.transform[:3, 3]
    centre: Floats = turn @ assembly.prototypes[instance.prototype].com_m + shift
    return centre


def _clustered(points: Floats, count: int | None) -> Labels:
    """Return the cluster (n,) of each point; if no count is given, with the count that has the best
    silhouette.
    """
    different = len(np.unique(points.round(9), axis=0)) if len(points) else 0
    if count is not None:
        return _lloyd(points, max(1, min(count, different)))
    best: Labels = np.zeros(len(points), np.intp)
    best_score = 0.6
    for tried in range(2, min(MOST_CLUSTERS, different // 3) + 1):
        labels = _lloyd(points, tried)
        score = _silhouette(points, labels)
        # One more link must be clearly better.
        if score > best_score + 0.02:
            best, best_score = labels, score
    return best


def _lloyd(points: Floats, count: int) -> Labels:
    """Run k-means, starting from the points that are farthest apart; equal points give equal clusters."""
    if not len(points):
        return np.zeros(0, np.intp)
    start = int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())
    centres = [points[start]]
    for _ in range(count - 1):
        near = np.min([np.linalg.norm(points - centre, axis=1) for centre in centres], axis=0)
        centres.append(points[int(near.argmax())])
    labels: Labels = np.full(len(points), -1, np.intp)
    for _ in range(100):
        distance = np.array([np.linalg.norm(points - centre, axis=1) for centre in centres])
        new: Labels = distance.argmin(axis=0)
        if np.array_equal(new, labels):
            break
        labels = new
        centres = [
            points[labels == n].mean(axis=0) if (labels == n).any() else centres[n] for n in range(count)
        ]
    return labels


def _silhouette(points: Floats, labels: Labels) -> float:
    """Rate clusters from -1 to 1 by the distances to their centres; 1 means tight clusters that are far
    apart.
    """
    numbers = np.unique(labels)
    if len(numbers) < 2:
        return -1.0
    centres = np.array([points[labels == n].mean(axis=0) for n in numbers])
    distance = np.linalg.norm(points[:, None] - centres[None], axis=2)
    own = distance[np.arange(len(points)), np.searchsorted(numbers, labels)]
    distance[np.arange(len(points)), np.searchsorted(numbers, labels)] = np.inf
    other = distance.min(axis=1)
    return float(np.mean((other - own) / np.maximum(np.maximum(other, own), 1e-12)))


def as_yaml(start: StartingMap, assembly: Assembly) -> str:
    """Write the map as YAML with comments; :func:`silo.inertia.links.read_link_map` reads it."""
    lines = [
        "---",  # several maps in one stream are several documents
        f"# Link map for {_comment(assembly.source or assembly.name)}, made by `silo-mod links`.",
        f"# {_comment(start.how[:1].upper() + start.how[1:])}.",
        "# Each line is a part, or a sub-assembly with all below it. Move lines between links, rename links",
        "# as your robot calls them, then: silo-mod inertia FILE --links THIS_FILE",
        "# * is anything within one level, ** any number of levels, product:NAME all uses of a product.",
        "# `silo-mod links FILE --clusters N` makes N links of parts that lie together; on the page of",
        "# `silo-mod inertia FILE --report PAGE.html` clicks give parts to links, and it saves the map.",
        "links:",
    ]
    for name, ids in start.members.items():
        lines += [f"  {_quoted(name)}:", "    parts:"]
        for path, below in _lines_of(assembly, start.members, ids):
            lines.append(f"      - {_quoted(_pattern(path))}  # {_comment(_content(assembly, below))}")
        frame = ids and assembly.instances[ids[0]].path[:1]
        if frame and frame in assembly.frames and frame[0] == name:
            lines.append(f"    # frame: {_quoted(name)}  # numbers in this sub-assembly's own axes")
    if start.empty:
        lines.append("# Links of the URDF that nothing in the file is called like; move parts to them:")
        lines += [f"#  {_quoted(name)}:\n#    parts: []" for name in start.empty]
    return "\n".join(lines) + "\n"


def _lines_of(
    assembly: Assembly, members: Mapping[str, Sequence[int]], ids: Sequence[int]
) -> list[tuple[tuple[str, ...], list[int]]]:
    """Return (path, instances below it), at the highest level at which this link has all instances."""
    owner = {index: name for name, indices in members.items() for index in indices}
    below = placed_below(assembly) | {
        instance.path: [index] for index, instance in enumerate(assembly.instances)
    }
    whole = {path for path, inside in below.items() if len({owner[index] for index in inside}) == 1}
    paths = (assembly.instances[index].path for index in ids)
    highest = (next(path[:n] for n in range(1, len(path) + 1) if path[:n] in whole) for path in paths)
    return [(path, below[path]) for path in dict.fromkeys(highest)]


def _pattern(path: tuple[str, ...]) -> str:
    text = "/".join(path)
    special = "*" in text or "?" in text or text.startswith((PRODUCT, PATH)) or text.strip("/") != text
    return PATH + text if special else text


def _content(assembly: Assembly, ids: Sequence[int]) -> str:
    names = Counter(assembly.prototypes[assembly.instances[index].prototype].name for index in ids)
    return listed([f"{name} ×{count}" if count > 1 else name for name, count in names.most_common()], 4)


def _comment(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


def _quoted(text: str) -> str:
    # JSON writes characters above U+FFFF as two halves, which are two characters to YAML.
    return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08X}" for c in text) + '"'


def as_map(start: StartingMap, assembly: Assembly) -> LinkMap:
    """Return the map that the YAML describes, without writing it."""
    return link_map(
        {
            "links": {
                name: [_pattern(path) for path, _ in _lines_of(assembly, start.members, ids)]
                for name, ids in start.members.items()
            }
        }
    )
