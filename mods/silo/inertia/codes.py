# SPDX-License-Identifier: LGPL-2.1-or-later
"""The machine names in a report: what was noticed, where a mass comes from, how a part found its row.

They are stable: part of the report's schema. Other warnings carry those of
:class:`~silo.inertia.notes.GeometryCode` and :class:`~silo.inertia.bom.table.BomCode`.
"""

from __future__ import annotations

from enum import StrEnum


class MassCode(StrEnum):
    """What was noticed while masses were found."""

    # a mass by rule, with a gap in the data
    NO_MASS_NO_MATERIAL = "no_mass_no_material"  # in the BOM with neither: zero
    NOT_IN_BOM = "not_in_bom"  # default density
    NO_BOM = "no_bom"  # no BOM was given: default density throughout
    UNKNOWN_MATERIAL = "unknown_material"  # default density
    GUESSED_MATERIAL = "material_guessed"  # a word in the material's name is not understood
    DENSITY_VARIES = "density_varies"  # foam, wood, rubber: the density depends on the kind
    ZERO_MASS = "bom_zero_mass"  # the BOM says 0 kg; the material's mass is used if it is known
    NO_VOLUME = "no_volume"  # a material, but no solid to take a volume from: zero
    POINT_MASS = "point_mass"  # a BOM mass without a solid: mass at one point, no inertia
    # a mass that other data contradict
    ROUNDED = "mass_rounded"  # the BOM's digits leave more than 2 % open
    DIFFERS = "mass_differs"  # BOM mass against material times volume
    ROW_TOTAL = "row_total"  # the BOM mass looks like that of the whole row
    IMPLAUSIBLE = "mass_implausible"  # denser than any metal, or lighter than any solid
    STEP_DENSITY = "step_density_differs"
    TARGET_DIFFERS = "target_mass_differs"  # what was weighed contradicts what else was weighed
    SUB_ASSEMBLY = "sub_assembly_mass_differs"
    SUB_ASSEMBLY_SHARED = "sub_assembly_mass_shared"  # a sub-assembly's mass spread over its parts by volume
    # matching
    AMBIGUOUS = "ambiguous"  # same name, and nothing but the order to go by
    COUNT_DIFFERS = "count_differs"
    ROW_UNUSED = "row_unused"
    # links
    UNCLAIMED = "unclaimed"
    IN_ROOT_LINK = "in_root_link"  # in no first-level sub-assembly: the root link has it
    CLAIMED_TWICE = "claimed_twice"
    PATTERN_UNUSED = "pattern_unused"
    FRAME_FAR = "frame_far"  # far outside of the assembly, or turned by 90 rad: another unit was meant
    FRAME_DIFFERS = "frame_differs"  # the numbers' frame is not that of the URDF's link
    LINK_NOT_IN_URDF = "link_not_in_urdf"  # a link of ours that the URDF does not have: its mass goes nowhere
    LINK_LOOSE = "link_loose"  # no joints lead from it to the URDF's root: its frame is not known
    ZERO_MASS_LINK = "zero_mass_link"
    URDF_IMPOSSIBLE = "urdf_impossible"  # a link of the URDF that is not ours has an inertia no body can have
    BAD_TENSOR = "bad_tensor"


class Source(StrEnum):
    """Where a part's mass comes from, best first (spec bom-inertia, "Solution")."""

    TARGET_MASS = "target_mass"  # a share of what the user weighed
    BOM_MASS = "bom_mass"
    MATERIAL = "material"
    SUB_ASSEMBLY_MASS = "sub_assembly_mass"  # the BOM has a mass for the sub-assembly around it only
    STEP_DENSITY = "step_density"  # only if the user asks for it
    DEFAULT_DENSITY = "default_density"
    ZERO = "zero"


class Rule(StrEnum):
    """How a part found its BOM row."""

    EXACT = "exact"
    NORMALISED = "normalised"
    WILDCARD = "wildcard"
    PART_NUMBER = "part_number"
    SUB_ASSEMBLY = "sub_assembly"  # by the row of the sub-assembly around it
    NONE = "none"


class Decided(StrEnum):
    """What decided between several parts or rows of one name."""

    ONLY = "only"  # nothing to decide
    SAME_DATA = "same_data"  # several rows that say the same
    PARENT = "parent"  # the sub-assembly around it
    QUANTITY = "quantity"
    MASS = "mass"  # density times volume fits one row's mass only
    REMAINING = "remaining"  # the last part and the last row
    ORDER = "order"  # nothing but the order; reported as ambiguous
