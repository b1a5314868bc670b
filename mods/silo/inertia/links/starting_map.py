# SPDX-License-Identifier: LGPL-2.1-or-later
"""A link map to start from: every instance in one link, for the user to move lines about.

By the links of a URDF if there is one (names of links and of their meshes), else by first-level
sub-assemblies, else, for exports without any, by where the parts are.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np

from silo.bom.errors import counted, listed
from silo.bom.message import message
from silo.inertia.arrays import Floats
from silo.inertia.assembly import Assembly, Instance, placed_below
from silo.inertia.links.claims import ROOT_LINK, claim
from silo.inertia.links.clusters import clustered
from silo.inertia.links.link_map import PATH, PRODUCT, LinkMap, link_map
from silo.inertia.names import bare


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
        how = message("each first-level sub-assembly is a link; parts beside them are in {root}", root=root)
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
    how = message(
        "{named} of {instances} by names of the URDF's links and meshes",
        named=named,
        instances=counted(len(assembly.instances), "part"),
    ) + (message("; the others are in {root}", root=root) if named < len(assembly.instances) else "")
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
    labels = clustered(points, clusters)
    order = sorted(
        set(labels.tolist()), key=lambda n: float(np.linalg.norm(points[labels == n].mean(axis=0)))
    )
    names = {number: f"link_{place}" for place, number in enumerate(order, start=1)}
    members = {names[n]: tuple(np.flatnonzero(labels == n).tolist()) for n in order}
    why = (
        message("--clusters {clusters}", clusters=clusters)
        if clusters
        else message("the file has no sub-assemblies")
    )
    how = message("{why}, so parts that lie together are together; a guess by position alone", why=why)
    if len(members) < 2:
        members = {assembly.name or ROOT_LINK: tuple(range(len(points)))} if len(points) else {}
        how = message(
            "the file has no sub-assemblies, and its parts lie together; --clusters N makes N links"
        )
    return StartingMap(members, how)


def _centre(assembly: Assembly, instance: Instance) -> Floats:
    turn, shift = instance.transform[:3, :3], instance.transform[:3, 3]
    centre: Floats = turn @ assembly.prototypes[instance.prototype].com_m + shift
    return centre


def as_yaml(start: StartingMap, assembly: Assembly) -> str:
    """Write the map as YAML with comments; :func:`silo.inertia.links.link_map.read_link_map` reads it."""
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
