# SPDX-License-Identifier: LGPL-2.1-or-later
"""The objects that joints or constraints hold, each at its own place."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from silo.bom.walk.document import derived, object_name, own
from silo.bom.walk.kinds import is_assembly3, members

_JOINED = ("Reference1", "Reference2", "ObjectToGround", "Part1", "Part2")


def held_by_joints(holders: Iterable[Any]) -> set[str]:
    """Return the names of the objects that joints or constraints in these containers hold, each at its own
    place.

    FreeCAD's joints name a part, or the assembly and a path to a part. Assembly3's constraints lead through
    elements; if there are any, all parts are held. Assembly4's links say so (:func:`is_attached`).
    """
    names = set[str]()
    for holder in holders:
        if is_assembly3(holder) and any(own(member, "Group") for member in list(holder.Group)[:1]):
            names.update(map(object_name, members(holder)))
        for joint in own(holder, "Group") or () if derived(holder, "Assembly::JointGroup") else ():
            for value in (own(joint, name) for name in _JOINED):
                target, subs = value if isinstance(value, tuple) else (value, ())
                names.update(() if target is None else (object_name(target),))
                names.update(step for sub in subs for step in str(sub).split(".")[:-1])
    return names


def is_attached(link: object) -> bool:
    """Return True for a link that Assembly4 holds at its own place."""
    return bool(own(link, "AttachedTo"))
