# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which instance belongs to which link: by a link map, else by the first-level sub-assemblies.

The first link that matches an instance has it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from silo.bom.errors import ConfigError, InputError
from silo.bom.message import message
from silo.inertia.arrays import Floats
from silo.inertia.assembly import Assembly
from silo.inertia.links.frames import ASSEMBLY_FRAME, FrameChoice, LinkFrame
from silo.inertia.links.link_map import LinkMap
from silo.inertia.links.patterns import matches
from silo.inertia.placements import is_rigid

ROOT_LINK = "base_link"
"""The usual name of a robot's first link (ROS REP 105)."""


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
        name: LinkFrame(assembly.frames[(name,)], message("sub-assembly “{name}”", name=name))
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
            frames[link.name] = LinkFrame(link.origin, message("origin in the link map"), chosen=True)
        elif link.frame_of is not None:
            floats = _frame_of(assembly, link.frame_of)
            if floats is None:
                problems.append(
                    message(
                        "{name}: there is no placed sub-assembly or part “{frame_of}”",
                        name=link.name,
                        frame_of=link.frame_of,
                    )
                )
            else:
                frames[link.name] = LinkFrame(
                    floats, message("frame of “{frame_of}”", frame_of=link.frame_of), chosen=True
                )
    if problems:
        raise ConfigError(message("{source}: ", source=links.source) + "; ".join(problems))
    return frames


def _frame_of(assembly: Assembly, name: str) -> Floats | None:
    path = tuple(name.split("/"))
    if path in assembly.frames:
        return assembly.frames[path]
    return next((i.transform for i in assembly.instances if i.path == path), None)


def chosen_frame(name: str, claims: Claims, choice: FrameChoice) -> LinkFrame:
    """Return the frame in which a link's numbers are given: that of the map, else the run's choice."""
    frame = claims.frame(name)
    if not frame.chosen and choice is FrameChoice.ASSEMBLY:
        return ASSEMBLY_FRAME
    turn = frame.placement[:3, :3]
    if not is_rigid(frame.placement) or np.linalg.det(turn) < 0:
        raise InputError(
            message(
                "link {name}: its frame ({description}) is mirrored or scaled; choose another one",
                name=name,
                description=frame.description,
            )
        )
    return frame
