# SPDX-License-Identifier: LGPL-2.1-or-later
"""What each case must give, written by hand: never computed by the code under test.

``bom``: component → quantity per one parent, or (quantity, what it contains). A component is ``file#object``,
the file relative to the case's folder. ``findings``: code → where. ``uuids``: where there are some.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

CONTROL = Path(__file__).resolve().parents[2] / "data" / "control"

UUID_1 = "11111111-2222-4333-8444-555555555555"
UUID_2 = "22222222-3333-4444-8555-666666666666"
UUID_3 = "33333333-4444-4555-8666-777777777777"

BOLT, PLATE, WASHER = "bolt.FCStd#Bolt", "plate.FCStd#Plate", "washer.FCStd#Washer"
SUB = "sub.FCStd#Sub"
SCREW = "ISO 4762 M4×16"
LOST = "bad.FCStd#Bad (missing)"
SUB_CONTENT = {BOLT: 2, PLATE: 1}


@dataclass(frozen=True)
class Truth:
    """The expected answer for one case.

    consolidated
        components that several single links stand for.
    top
        the file that is read.
    live
        what live FreeCAD answers where it knows, by its nature, other things than the file says.
    live_0_20
        the same for FreeCAD 0.20 only.
    error
        there is no BOM, and this stands in the message.
    """

    bom: Mapping[str, Any]
    findings: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    consolidated: frozenset[str] = frozenset()
    uuids: Mapping[str, str] = field(default_factory=dict)
    top: str = "top.FCStd"
    live: Truth | None = None
    live_0_20: Truth | None = None
    error: str = ""

    def for_live(self, version: tuple[int, ...]) -> Truth:
        """What a FreeCAD of this version must answer."""
        if self.live_0_20 is not None and version < (0, 21):
            return self.live_0_20
        return self.live or self


def _is(
    bom: Mapping[str, Any],
    *,
    consolidated: tuple[str, ...] = (),
    uuids: Mapping[str, str] | None = None,
    top: str = "top.FCStd",
    live: Truth | None = None,
    live_0_20: Truth | None = None,
    **findings: tuple[str, ...],
) -> Truth:
    return Truth(bom, findings, frozenset(consolidated), uuids or {}, top, live, live_0_20)


def _control() -> dict[str, Truth]:
    """The control cases, from the file that is published with them."""
    cases = json.loads((CONTROL / "expected.json").read_text(encoding="utf-8"))
    consolidated = {
        "T01_flat": ("PA.FCStd#PA",),
        "T03_sub_assembly_twice": ("S1.FCStd#S1", "PA.FCStd#PA"),
        "T04_same_part_on_two_levels": ("PA.FCStd#PA",),
        "T05_one_mirrored": ("PA.FCStd#PA",),
        "T06_one_hidden": ("PA.FCStd#PA",),
        "T07_assembly_link": ("PA.FCStd#PA",),
        "T10_link_to_a_link": ("PA.FCStd#PA",),
    }
    return {
        name: Truth(
            {key: tuple(value) if isinstance(value, list) else value for key, value in one["bom"].items()},
            {code: tuple(where) for code, where in one.get("findings", {}).items()},
            frozenset(consolidated.get(name, ())),
        )
        for name, one in cases.items()
    }


TRUTH: dict[str, Truth] = {
    **_control(),
    # --- counting ---------------------------------------------------------------------------------------
    "plain_link": _is({BOLT: 1}),
    "same_part_three_times": _is({BOLT: 3}, consolidated=(BOLT,)),
    "array_shown_one_hidden": _is({BOLT: 4}),
    "array_counted_one_hidden": _is({BOLT: 4}),
    "array_one_deleted": _is({BOLT: 3}),
    "array_of_one": _is({BOLT: 1}),
    "links_and_array": _is({BOLT: 5}, consolidated=(BOLT,)),
    "link_chain": _is({BOLT: 2}, consolidated=(BOLT,)),
    "chain_across_files": _is({BOLT: 1}),
    "link_to_array": _is({BOLT: 3}),
    "array_of_array": _is({BOLT: 6}),
    "sub_object_link": _is({"frame.FCStd#Inner": 1}),
    "sub_element_link": _is({BOLT: 1}, sub_element_link=("top.FCStd#Reference",)),
    "link_in_folder": _is({BOLT: 2}, consolidated=(BOLT,)),
    "inline_part": _is({BOLT: 3}, consolidated=(BOLT,)),
    "inline_assembly": _is({BOLT: 3}, consolidated=(BOLT,)),
    "link_group": _is({BOLT: 1, PLATE: 1}),
    "link_to_group_in_file": _is({BOLT: 2}),
    "link_to_group_elsewhere": _is({"kit.FCStd#Bundle": (1, {BOLT: 2})}, consolidated=(BOLT,)),
    "link_to_assembly": _is({SUB: (1, SUB_CONTENT)}, consolidated=(BOLT,)),
    "same_part_on_two_levels": _is({BOLT: 3, SUB: (2, SUB_CONTENT)}, consolidated=(BOLT,)),
    "assembly_link_rigid": _is({SUB: (2, SUB_CONTENT)}, consolidated=(BOLT,)),
    "assembly_link_flexible": _is({SUB: (1, SUB_CONTENT)}, consolidated=(BOLT,)),
    "assembly_link_nested": _is(
        {"middle.FCStd#Middle": (1, {SUB: (2, SUB_CONTENT), BOLT: 1})}, consolidated=(BOLT,)
    ),
    "assembly_link_with_array": _is({SUB: (1, {BOLT: 4})}),
    "assembly_link_stale": _is(
        {SUB: (1, {BOLT: 1, PLATE: 1, WASHER: 1})}, stale_assembly_link=("top.FCStd#SubLink",)
    ),
    "assembly_link_never_recomputed": _is({SUB: (1, SUB_CONTENT)}, consolidated=(BOLT,)),
    "assembly_below_a_part": _is(
        {SUB: (1, {BOLT: 2}), BOLT: 1},
        live_0_20=_is({f"{SUB} (missing)": 1, BOLT: 1}, lost_assembly=("top.FCStd#SubLink",)),
    ),
    "joints_and_sheets": _is({BOLT: 2}),  # a joint holds one of the two
    "sheets_sketches_datums": _is({BOLT: 1}),
    "copy_on_change": _is({BOLT: 1}, variant=("top.FCStd#Variant",)),
    "draft_link_array": _is({BOLT: 6}, draft_array=("top.FCStd#Array",), coincident=("top.FCStd#Original",)),
    "boolean_operands": _is({BOLT: 1}, local_geometry=("top.FCStd#Top",)),
    "hidden_link": _is({BOLT: 2}, consolidated=(BOLT,), hidden=("top.FCStd#Hidden",)),
    "mirrored_link": _is({BOLT: 2}, consolidated=(BOLT,), mirrored=("top.FCStd#Mirrored",)),
    "mirrored_array_element": _is({BOLT: 2}, mirrored=("top.FCStd#Row",)),
    "excluded_link": _is({BOLT: 1}, excluded=("top.FCStd#LeftOut",)),
    "excluded_part": _is({BOLT: 1}, excluded=("top.FCStd#Fixture",)),
    "suppressed_link": _is(
        {BOLT: 1},
        suppressed=("top.FCStd#Off",),
        # FreeCAD 0.20 does not know the extension and drops its property.
        live_0_20=_is({BOLT: 2}, consolidated=(BOLT,)),
    ),
    "suppressed_by_property": _is({BOLT: 1}, suppressed=("top.FCStd#Off",)),
    "in_document_link": _is({BOLT: 1}, local_geometry=("top.FCStd#Top",)),
    "unset_link": _is({BOLT: 1}, unset_link=("top.FCStd#Empty",)),
    "loose_links": _is({BOLT: 2}, consolidated=(BOLT,), no_container=("top.FCStd",)),
    "spares_beside_the_model": _is({BOLT: 1}),
    "body_as_part": _is({"body.FCStd#Body": 1}),
    "empty_assembly": _is({}, empty_bom=("top.FCStd#Top",)),
    "link_python": _is({BOLT: 1}),
    "deep_mix": _is({BOLT: 7}, consolidated=(BOLT,)),
    "self_reference": _is({BOLT: 1}, in_document_link=("top.FCStd#Self",)),
    "link_to_assembly_link": _is({SUB: (1, SUB_CONTENT)}, consolidated=(BOLT,)),
    "link_to_array_element": _is({BOLT: 1}),
    "link_into_sub_assembly": _is({BOLT: 1}),
    "link_beside_the_assembly": _is({BOLT: 1}, beside_assembly=("top.FCStd#Loose",)),
    "link_to_a_sheet": _is({BOLT: 1}, no_component=("top.FCStd#SheetLink",)),
    "a2plus_part": _is({BOLT: 2}),
    "assembly3_container": _is({BOLT: 2}, consolidated=(BOLT,)),
    "two_models_in_one_file": Truth({}, error="holds 2 assemblies: Top (Top), Second (Second)"),
    # --- standard parts, declared parts, repetition -----------------------------------------------------
    "hardware_in_the_assembly": _is({BOLT: 1, SCREW: 3, f"{SCREW} LH": 1, "ISO 7089 M3": 1}),
    "hardware_in_both_spellings": _is({SCREW: 2, "ISO 7380-1 M5×8": 2}),
    "hardware_in_groups_and_parts": _is({SCREW: 3}),
    "hardware_linked_in_the_file": _is({SCREW: 10}),
    "hardware_source_outside": _is({BOLT: 1, SCREW: 3}),
    "hardware_in_draft_arrays": _is(
        {SCREW: 6, "ISO 4762 M4×20": 4},
        draft_array=("top.FCStd#Array", "top.FCStd#Array001"),
        coincident=("top.FCStd#First", "top.FCStd#Second"),
    ),
    "hardware_cloned": _is({SCREW: 2}),
    "hardware_in_a_fasteners_file": _is({SCREW: 5, "ISO 4032 M4": 1}),
    "hardware_in_a_part_file": _is(
        {"frame.FCStd#Frame": (3, {"IUT heat insert M3×4 ⌀4.55": 2})},
        local_geometry=("frame.FCStd#Frame",),
    ),
    "hardware_beside_the_assembly": _is(
        {BOLT: 1, SCREW: 2}, counted_beside=("top.FCStd#Loose", "top.FCStd#Sorted")
    ),
    "hardware_copied_as_geometry": _is({BOLT: 1}, local_geometry=("top.FCStd#Top",)),
    "hardware_used_up": _is(
        {SCREW: 2},
        # A and B go with the compound that cuts; C and D count where the other compound shows them.
        consumed=tuple(f"top.FCStd#{name}" for name in ("A", "B", "Cutters", "Operand", "Tool")),
        coincident=("top.FCStd#C", "top.FCStd#D"),
        local_geometry=("top.FCStd#Top",),
    ),
    "hardware_tools": _is({BOLT: 1}),
    "hardware_excluded": _is({SCREW: 1}, excluded=("top.FCStd#Drawn",)),
    "declared_part": _is(
        {"top.FCStd#Motor": 4}, uuids={"top.FCStd#Motor": UUID_1}, local_geometry=("top.FCStd#Top",)
    ),
    "declared_container": _is(
        {"top.FCStd#Module": (1, {BOLT: 2, SCREW: 1})}, uuids={"top.FCStd#Module": UUID_2}
    ),
    "array_over_an_inline_part": _is(
        {BOLT: 15}, draft_array=("top.FCStd#Array",), coincident=("top.FCStd#Second",)
    ),
    "draft_arrays_without_links": _is(
        {BOLT: 6, PLATE: 5, WASHER: 16},
        draft_array=("top.FCStd#Array", "top.FCStd#Array001", "top.FCStd#Array002"),
        coincident=("top.FCStd#Base0", "top.FCStd#Base1", "top.FCStd#Base2"),
    ),
    "link_to_a_draft_array_elsewhere": _is(
        {"kit.FCStd#Array": (2, {BOLT: 6})}, draft_array=("kit.FCStd#Array",)
    ),
    "link_in_two_link_groups": _is({BOLT: 2}),
    "array_elements_in_a_link_group": _is({BOLT: 3}, beside_assembly=("top.FCStd#Row",)),
    "container_beside_the_assembly": _is({BOLT: 1}, beside_assembly=("top.FCStd#Spare",)),
    "loose_parts_beside_a_part_of_references": _is(
        {BOLT: 4}, consolidated=(BOLT,), no_container=("top.FCStd",), local_geometry=("top.FCStd",)
    ),
    "mirrored_element_shown": _is({BOLT: 3}, mirrored=("top.FCStd#Row",)),
    "excluded_element": _is({BOLT: 3}, excluded=("top.FCStd#Row_i2",)),
    "own_part_in_a_flexible_assembly_link": _is({SUB: (1, SUB_CONTENT), WASHER: 1}, consolidated=(BOLT,)),
    # --- files ------------------------------------------------------------------------------------------
    "missing_file": _is(
        {BOLT: 1, "gone.FCStd#Gone (missing)": 2}, missing_file=("top.FCStd#Lost1", "top.FCStd#Lost2")
    ),
    "missing_file_below": _is(
        {SUB: (1, {BOLT: 2, f"{PLATE} (missing)": 1})},
        consolidated=(BOLT,),
        missing_file=("sub.FCStd#Plate",),
    ),
    "target_deleted": _is(
        {"kit.FCStd#Bolt (missing)": 1, "kit.FCStd#Plate": 1}, missing_object=("top.FCStd#Lost",)
    ),
    "sub_object_deleted": _is(
        {BOLT: 1, "frame.FCStd#Inner (missing)": 1}, missing_object=("top.FCStd#Lost",)
    ),
    "object_cycle": _is({BOLT: 1}, in_document_link=("top.FCStd#ToTwo", "top.FCStd#ToOne")),
    "document_cycle": _is({"other.FCStd#Other": (1, {BOLT: 1})}, cycle=("other.FCStd#ToTop",)),
    "awkward_names": _is(
        {"Größe & Söhne/Schraube <M8> & 'Co' №1.FCStd#Bolt": 1}, top="Baugruppe №2 & Rest.FCStd"
    ),
    "parent_path": _is({"parts/bolt.FCStd#Bolt": 1}, top="assemblies/deep/top.FCStd"),
    "symlinked_folder": _is({"real/bolt.FCStd#Bolt": 2}, consolidated=("real/bolt.FCStd#Bolt",)),
    "saved_elsewhere": _is(
        {"new/deeper/parts/bolt.FCStd#Bolt (missing)": 1, "new/deeper/parts/plate.FCStd#Plate (missing)": 1},
        top="new/deeper/top.FCStd",
        missing_file=("new/deeper/top.FCStd#Bolt", "new/deeper/top.FCStd#Plate"),
    ),
    "partial_part_document": _is({"kit.FCStd#Bolt": 1}, uuids={"kit.FCStd#Bolt": UUID_1}),
    "duplicate_labels": _is({"one.FCStd#Part": 2, "two.FCStd#Part": 1}, consolidated=("one.FCStd#Part",)),
    "two_parts_in_one_file": _is({"pair.FCStd#Left": 1, "pair.FCStd#Right": 2}),
    "expression_only": _is({BOLT: 1}),
    # FreeCAD (with its fix of CVE-2026-73235) ignores the declaration; our reader refuses such a file.
    "doctype": _is(
        {BOLT: 1, LOST: 1}, unreadable_file=("top.FCStd#BadLink",), live=_is({BOLT: 1, "bad.FCStd#Bad": 1})
    ),
    "truncated_zip": _is({BOLT: 1, LOST: 1}, unreadable_file=("top.FCStd#BadLink",)),
    "no_document_xml": _is({BOLT: 1, LOST: 1}, unreadable_file=("top.FCStd#BadLink",)),
    "lfs_pointer": _is({BOLT: 1, LOST: 1}, lfs_pointer=("top.FCStd#BadLink",)),
    "empty_file": _is({BOLT: 1, LOST: 1}, unreadable_file=("top.FCStd#BadLink",)),
    # --- identity ---------------------------------------------------------------------------------------
    "identity_in_meta": _is({BOLT: 1}, uuids={BOLT: UUID_1}),
    "identity_in_document_property": _is({BOLT: 1}, uuids={BOLT: UUID_1}),
    "identity_of_objects": _is(
        {"pair.FCStd#Left": 1, "pair.FCStd#Right": 1},
        uuids={"pair.FCStd#Left": UUID_3, "pair.FCStd#Right": UUID_2},
    ),
    "copied_identity": _is(
        {"one.FCStd#Part": 1, "two.FCStd#Part": 1},
        uuids={"one.FCStd#Part": UUID_1, "two.FCStd#Part": UUID_1},
        copied_identity=("one.FCStd#Part", "two.FCStd#Part"),
    ),
    "shared_identity": _is(
        {"pair.FCStd#Left": 1, "pair.FCStd#Right": 1},
        uuids={"pair.FCStd#Left": UUID_1, "pair.FCStd#Right": UUID_1},
        shared_identity=("pair.FCStd#Left", "pair.FCStd#Right"),
    ),
}
