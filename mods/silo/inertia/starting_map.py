# SPDX-License-Identifier: LGPL-2.1-or-later
"""A link map to start from: every instance in one link, for a person to move lines about.

By the links of a URDF where there is one (names of links and of their meshes), else by first-level
sub-assemblies, else, for exports without any, by where the parts are.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np
from numpy.typing import NDArray

from silo.inertia.core import Floats
from silo.inertia.links import PATH, PRODUCT, ROOT_LINK, LinkMap, claim, link_map
from silo.inertia.model import Assembly, Instance
from silo.inertia.names import bare
from silo.inertia.wording import counted

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
        link → mesh file names, as a URDF has them. Parts that are called like none go to ``root``.
    clusters
        how many links to make of a file without sub-assemblies; None: as many as fit the positions best.
    """
    if urdf_links:
        return _by_urdf(assembly, urdf_links, root)
    if clusters is None and any(len(instance.path) > 1 for instance in assembly.instances):
        how = f"each first-level sub-assembly is a link; parts beside them are in {root}"
        return StartingMap(claim(assembly, root=root).members, how)
    return _by_position(assembly, clusters)


def _by_urdf(assembly: Assembly, urdf_links: Mapping[str, Sequence[str]], root: str) -> StartingMap:
    owner_of: dict[str, str] = {}
    for said in (_said_by_links(urdf_links), _said_by_meshes(urdf_links)):
        for word, name in said.items():
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
    return _only({_word(name): name for name in urdf_links}, [_word(name) for name in urdf_links])


def _said_by_meshes(urdf_links: Mapping[str, Sequence[str]]) -> dict[str, str]:
    pairs = {
        (_word(PurePosixPath(mesh.replace("\\", "/")).stem), name)
        for name, meshes in urdf_links.items()
        for mesh in meshes
    }
    return _only(dict(pairs), [word for word, _ in pairs])


def _only(owners: dict[str, str], words: Sequence[str]) -> dict[str, str]:
    """Without words that two links have: a mesh of a wheel that four links share says nothing."""
    times = Counter(words)
    return {word: name for word, name in owners.items() if word and times[word] == 1}


def _word(name: str) -> str:
    """ "base_link", "Link base" and "base <1>" are the same word."""
    return re.sub(r"^link | link$", "", bare(name))


def _owner(instance: Instance, owner_of: Mapping[str, str]) -> str | None:
    """By the innermost level that is called like a link: a forearm inside an arm is the forearm."""
    for name, product in reversed([*zip(instance.path, instance.product_path, strict=False)]):
        for word in (_word(name), _word(product)):
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
    how = "the file has no sub-assemblies, so parts that lie together are together; a guess by position alone"
    if len(members) < 2:
        members = {assembly.name or ROOT_LINK: tuple(range(len(points)))} if len(points) else {}
        how = "the file has no sub-assemblies, and its parts lie together; --clusters N makes N links"
    return StartingMap(members, how)


def _centre(assembly: Assembly, instance: Instance) -> Floats:
    turn, shift = instance.transform[:3, :3], instance.transform[:3, 3]
    result: Floats = turn @ assembly.prototypes[instance.prototype].com_m + shift
    return result


def _clustered(points: Floats, count: int | None) -> Labels:
    """(n,) cluster of each point; the count with the best silhouette, where none is given."""
    different = len(np.unique(points.round(9), axis=0)) if len(points) else 0
    if count is not None:
        return _lloyd(points, max(1, min(count, different)))
    best: Labels = np.zeros(len(points), np.intp)
    best_score = 0.6
    for tried in range(2, min(MOST_CLUSTERS, different // 3) + 1):
        labels = _lloyd(points, tried)
        score = _silhouette(points, labels)
        # A link more must be worth it.
        if score > best_score + 0.02:
            best, best_score = labels, score
    return best


def _lloyd(points: Floats, count: int) -> Labels:
    """k-means from the points that lie farthest from each other; the same for the same points."""
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
    """-1 to 1, by distances to the centres of clusters: 1 is tight clusters far apart."""
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
    """The map as YAML, commented; :func:`silo.inertia.links.read_link_map` reads it."""
    lines = [
        f"# Link map for {_comment(assembly.source or assembly.name)}, made by `silo-mod links`.",
        f"# {_comment(start.how[:1].upper() + start.how[1:])}.",
        "# Each line is a part, or a sub-assembly with all below it. Move lines between links, rename links",
        "# as your robot calls them, then: silo-mod inertia FILE --links THIS_FILE",
        "# * is anything within one level, ** any number of levels, product:NAME all uses of a product.",
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
    """(path, instances below it), each as high up as everything below belongs to this one link."""
    owner = {index: name for name, indices in members.items() for index in indices}
    owners: dict[tuple[str, ...], set[str]] = {}
    below: dict[tuple[str, ...], list[int]] = {}
    for index, instance in enumerate(assembly.instances):
        for end in range(1, len(instance.path) + 1):
            owners.setdefault(instance.path[:end], set()).add(owner[index])
            below.setdefault(instance.path[:end], []).append(index)
    lines: dict[tuple[str, ...], list[int]] = {}
    for index in ids:
        path = assembly.instances[index].path
        end = next((n for n in range(1, len(path) + 1) if len(owners[path[:n]]) == 1), len(path))
        lines[path[:end]] = below[path[:end]]
    return list(lines.items())


def _pattern(path: tuple[str, ...]) -> str:
    text = "/".join(path)
    special = "*" in text or "?" in text or text.startswith((PRODUCT, PATH)) or text.strip("/") != text
    return PATH + text if special else text


def _content(assembly: Assembly, ids: Sequence[int]) -> str:
    names = Counter(assembly.prototypes[assembly.instances[index].prototype].name for index in ids)
    words = [f"{name} ×{count}" if count > 1 else name for name, count in names.most_common(4)]
    more = f" and {len(names) - 4} more" if len(names) > 4 else ""
    return ", ".join(words) + more


def _comment(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


def _quoted(text: str) -> str:
    # JSON writes characters above U+FFFF as two halves, which are two characters to YAML.
    return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08X}" for c in text) + '"'


def as_map(start: StartingMap, assembly: Assembly) -> LinkMap:
    """What the YAML says, without writing it."""
    return link_map(
        {
            "links": {
                name: [_pattern(path) for path, _ in _lines_of(assembly, start.members, ids)]
                for name, ids in start.members.items()
            }
        }
    )
