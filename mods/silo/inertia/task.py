# SPDX-License-Identifier: LGPL-2.1-or-later
"""The task of a calculation: the user's choices, besides geometry and BOM."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from silo.bom.errors import InputError
from silo.inertia.arrays import Floats
from silo.inertia.links.frames import FrameChoice
from silo.inertia.links.link_map import LinkMap
from silo.inertia.masses import Options
from silo.inertia.materials.table import MaterialTable, load_materials

if TYPE_CHECKING:
    from silo.inertia.urdf import Urdf


@dataclass(frozen=True, eq=False)
class Task:
    """Everything a calculation depends on besides geometry and BOM.

    frame
        which frame the links' numbers are given in; a link map's own word wins.
    urdf
        what is to be filled: ours are named after its links, and its frames are used if ``frame`` is URDF,
        else compared with.
    loose_link
        a link that takes what no other claims; None: a map leaves such parts unclaimed.
    weights
        link or pattern of components → what one weighs, as a text with its unit; a link map's own come after.
    simulated
        the links go to a simulator: warn of those that it would refuse.
    """

    materials: MaterialTable = field(default_factory=load_materials)
    options: Options = field(default_factory=Options)
    links: LinkMap | Mapping[str, Any] | None = None
    frame: FrameChoice = FrameChoice.ASSEMBLY
    urdf: Urdf | None = None
    loose_link: str | None = None
    simulated: bool = True
    weights: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.frame is FrameChoice.URDF and self.urdf is not None and self.urdf.problem:
            raise InputError(self.urdf.problem)

    @property
    def urdf_frames(self) -> Mapping[str, Floats]:
        """Return link → (4, 4) placement in the assembly's frame, as the URDF has it."""
        return self.urdf.frames if self.urdf is not None else {}
