# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a geometry reader notices: a sentence with a machine name."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class GeometryCode(StrEnum):
    """The machine names of what a geometry reader noticed."""

    NEGATIVE_VOLUME = "negative_volume"  # an inside-out solid; its sign was turned
    INVALID_SHAPE = "invalid_shape"  # the kernel's own check fails
    MESH_MISMATCH = "mesh_mismatch"  # |V_mesh - V_brep| above 2 %
    NOT_CONVERGENT = "not_convergent"  # the integration did not reach its tolerance
    FACE_REBUILT = "face_rebuilt"  # the kernel misread a face; another reading was right
    FACE_DIFFERS = "face_differs"  # a face does not lie between its edges as the file has them
    STATED_VOLUME = "stated_volume"  # the file states another volume (above 1e-3)
    STATED_CENTROID = "stated_centroid"
    OPEN_SHELL = "open_shell"  # a solid whose faces do not close: its volume is no fact
    SHELL_VOLUME = "shell_volume"  # surfaces that close, and are no solid in the file: taken for one
    COINCIDENT_SOLIDS = "coincident_solids"  # a solid that lies exactly on another one: counted once
    OVERLAPPING_SOLIDS = "overlapping_solids"  # solids of one product that share space
    COINCIDENT_PARTS = "coincident_parts"  # a part that is placed twice at one place: both are counted
    BODY_MISSING = "body_missing"  # the file names a body that could not be read as a solid
    NOT_COUNTED = "not_counted"  # in the file, and not the part: supports, modifiers, what is not built
    HIDDEN = "hidden"  # the file does not show a body, and it is counted
    NO_SOLID = "no_solid"  # surfaces or wires only
    NO_GEOMETRY = "no_geometry"  # nothing at all: an unresolved external file, an empty product
    NOT_READ = "not_read"  # a file or a shape that is missing or damaged: what it holds is in no mass
    EXTERNAL_FILE = "external_file"  # a split assembly was completed from its other files
    NOT_WATERTIGHT = "not_watertight"
    WINDING = "winding"
    UNITS = "units"  # the unit was not stated, or is implausible
    SCALED = "scaled"  # a placement that scales
    BAKED = "baked"  # geometry far away from its own origin
    MATERIAL = "material"  # the material that a part states cannot be found or read
    NAME = "name"  # lost characters, an unnamed product named by climbing
    READER = "reader"  # what the kernel complained about while reading


DOUBTFUL = (
    GeometryCode.BODY_MISSING,
    GeometryCode.FACE_DIFFERS,
    GeometryCode.INVALID_SHAPE,
    GeometryCode.MESH_MISMATCH,
    GeometryCode.OPEN_SHELL,
    GeometryCode.OVERLAPPING_SOLIDS,
    GeometryCode.NOT_WATERTIGHT,
    GeometryCode.WINDING,
)
"""Under these a mass is no fact."""


@dataclass(frozen=True)
class Note:
    """One thing that was noticed: a sentence, and one of :class:`GeometryCode`, of the other codes, or a
    reader's own word.

    kg
        by how much the mass of one piece may be wrong [kg], to six digits: the notes of pieces that are
        alike up to the last bit are equal, so the pieces stay one part of the report. None: by all of it.
    """

    code: str
    message: str
    kg: float | None = None

    def __post_init__(self) -> None:
        """Round ``kg``."""
        if self.kg is not None:
            object.__setattr__(self, "kg", float(f"{self.kg:.6g}"))
