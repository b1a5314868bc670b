# SPDX-License-Identifier: LGPL-2.1-or-later
"""All cases of inertia-facts §9: which data each one uses, and which tests hold it.

"real" is a file of the public test data; "stand-in" is generated with the same trait, where the survey's own
file is not public; "made" needs no file of others.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Case:
    """What a case is about, its data, and its tests: ``file`` or ``file::function``."""

    what: str
    data: str
    tests: tuple[str, ...]


ANALYTIC = "geometry/kernel/test_analytic.py::"
PRODUCTS = "geometry/step/test_step_products.py::"
REAL = "geometry/step/test_real_step.py::"
STAND_IN = "cases/test_stand_ins.py::"
SPLIT = "cases/test_split_files.py::"
MATCHING = "test_matching_cases.py::"
NAMES = "test_name_cases.py::"
OUTPUT = "output/test_output_cases.py::"
LAWS = "property/test_core_laws.py::"

CASES: dict[int, Case] = {
    1: Case(
        "cube, cylinder, sphere, torus, cone, turned box", "made",
        tuple(ANALYTIC + f"test_a_{name}" for name in (
            "box_is_exact", "cylinder_is_exact", "sphere_is_exact", "torus_is_exact", "cone_is_exact",
            "turned_box_has_a_turned_tensor",
        )),
    ),
    2: Case("off-axis assembly", "made", (ANALYTIC + "test_an_off_axis_assembly_is_exact",)),
    3: Case(
        "nested, 18 instances of 5 parts", "real: as1-oc-214.stp",
        (REAL + "test_as1_has_eighteen_instances_of_five_parts",
         "test_real_files.py::test_a_complete_bom_gives_exactly_its_sum"),
    ),
    4: Case(
        "inches, SOLID and wire COMPOUND leaves", "stand-in for as1_pe_203",
        (STAND_IN + "test_case_04_solid_and_wire_leaves_in_inches",
         PRODUCTS + "test_solid_and_wire_of_one_product_are_one_product",
         "test_source_cases.py::test_a_wire_beside_its_solid_is_one_part"),
    ),
    5: Case(
        "instance names differ from the product", "stand-in for openplm_test2",
        (STAND_IN + "test_case_05_instances_are_called_otherwise_than_their_products",
         PRODUCTS + "test_instance_names_are_kept_beside_product_names"),
    ),
    6: Case(
        "B-splines, inches, lb/in³", "real: dm1-id-214.stp",
        (REAL + "test_dm1_agrees_with_the_volumes_that_it_states",
         REAL + "test_dm1_densities_are_read_in_pounds_per_cubic_inch",
         "test_real_files.py::test_densities_of_the_file_are_used_when_asked"),
    ),
    7: Case(
        "three solids, a void, the next part", "made",
        (STAND_IN + "test_case_07_three_solids_a_void_and_the_next_part",
         ANALYTIC + "test_a_product_of_three_solids_is_one_product", ANALYTIC + "test_a_void_is_empty"),
    ),
    8: Case(
        "surface product, unnamed solid of the assembly", "real: so101_wrist_roll_pitch.step",
        (REAL + "test_an_empty_product_and_a_body_of_the_assembly_itself",
         PRODUCTS + "test_a_product_of_surfaces_has_no_volume_and_says_so"),
    ),
    9: Case(
        "negative part, lost characters, thirteen of one name", "stand-in for onshape_quadruped",
        (STAND_IN + "test_case_09_a_part_that_is_inside_out",
         STAND_IN + "test_case_09_thirteen_parts_of_one_name"),
    ),
    10: Case(
        "invalid, integration not convergent", "stand-in for Thor Art1GearMotor and Art2MotorGear",
        (STAND_IN + "test_case_10_an_invalid_gear_is_never_taken_in_silence",
         STAND_IN + "test_case_10_an_integration_that_does_not_settle_is_reported",
         PRODUCTS + "test_an_open_solid_is_invalid_and_its_mesh_disagrees"),
    ),
    11: Case(
        "sixteen products, fourteen of one name", "real: asm4_bearing.stp",
        ("test_real_files.py::test_case_11_fourteen_balls_share_one_row",
         REAL + "test_a_bearing_has_sixteen_products_and_fourteen_of_one_name"),
    ),
    12: Case(
        "split files, nested", "stand-in for the koch arms and s1-c5-214",
        (SPLIT + "test_case_12_a_split_assembly_is_completed",
         "geometry/step/test_split_assembly.py::test_a_sibling_may_be_split_itself"),
    ),
    13: Case(
        "the same without siblings", "stand-in, and real: so101_wrist_roll_pitch.step",
        (SPLIT + "test_case_13_without_its_siblings_nothing_is_made_up",
         SPLIT + "test_case_13_one_file_is_missing",
         "test_real_files.py::test_case_13_geometry_that_is_elsewhere"),
    ),
    14: Case(
        "mirrored and scaled placements", "made",
        (PRODUCTS + "test_mirrored_and_scaled_placements_are_exact_or_refused_aloud",
         "test_core.py::test_mirror_is_rigid_and_turns_products"),
    ),
    15: Case(
        "a part baked 100 m away", "made",
        (ANALYTIC + "test_a_part_baked_a_hundred_metres_away_keeps_its_tensor",),
    ),
    16: Case(
        "flat plate, a + b = c after rounding", "made",
        (ANALYTIC + "test_a_flat_plate_keeps_a_plus_b_at_least_c",
         OUTPUT + "test_case_16_flat_plate_survives_printing"),
    ),
    17: Case(
        "truncated, empty, no STEP file", "made",
        ("geometry/test_isolation.py::test_a_bad_file_is_a_plain_sentence",
         "geometry/test_isolation.py::test_a_truncated_file_is_refused_not_read_in_part",
         "cli/test_inertia_command.py::test_bad_geometry_is_one_plain_sentence"),
    ),
    18: Case(
        "file in metres", "made",
        ("cases/test_full_size.py::test_case_18_the_unit_of_the_file_is_the_unit_of_the_mass",
         ANALYTIC + "test_the_file_s_unit_does_not_change_the_part"),
    ),
    19: Case("link without mass", "made",
             (OUTPUT + "test_case_19_a_link_without_mass_is_left_out_and_reported",)),
    20: Case(
        "10 000 instances of 20 parts", "made",
        ("cases/test_full_size.py::test_case_20_ten_thousand_instances_of_twenty_parts",),
    ),
    21: Case(
        "the 22 mass strings and 4 empty forms", "made",
        ("bom/test_masses.py::test_mass_strings", "bom/test_masses.py::test_the_four_empty_forms"),
    ),
    22: Case("the 15 file shapes", "made", ("bom/test_parser.py::test_the_15_shapes",)),
    23: Case("duplicates, distinct quantities", "made",
             (MATCHING + "test_case_23_duplicates_kept_apart_by_quantity",)),
    24: Case("duplicates, masses and materials decide", "made",
             (MATCHING + "test_case_24_duplicates_kept_apart_by_mass",)),
    25: Case("duplicates that nothing decides", "made",
             (MATCHING + "test_case_25_undecidable_duplicates_are_ambiguous",)),
    26: Case("1.1.2 with sub-assembly masses", "made",
             (MATCHING + "test_case_26_structured_bom_never_adds_a_mass_twice",)),
    27: Case("quantity differs from the count", "made",
             (MATCHING + "test_case_27_quantity_differs_from_count",)),
    28: Case("row without geometry", "made", (MATCHING + "test_case_28_row_without_geometry",)),
    29: Case("part absent from the BOM", "made", (MATCHING + "test_case_29_part_absent_from_the_bom",)),
    30: Case(
        "0 kg, and nothing in its many forms", "made",
        (MATCHING + "test_case_30_no_value_is_zero_with_a_warning",
         MATCHING + "test_case_30_zero_kg_is_reported",
         "bom/test_masses.py::test_localised_empty_forms"),
    ),
    31: Case("mass and material disagree", "made",
             (MATCHING + "test_case_31_mass_and_material_that_disagree",)),
    32: Case(
        "row total instead of unit mass", "made",
        (MATCHING + "test_case_32_row_total_instead_of_unit_mass",
         "test_silent_mistakes.py::test_a_column_of_row_totals_makes_all_doubtful"),
    ),
    33: Case("odd names", "made", (NAMES + "test_case_33_names",)),
    34: Case(
        "names inside names", "made",
        (NAMES + "test_case_34_never_by_substring",
         NAMES + "test_case_34_bracket_and_bracket_2_side_by_side"),
    ),
    35: Case(
        "material texts, FreeCAD's 1 kg/m³", "made",
        (NAMES + "test_case_35_materials_in_a_report",
         "materials/test_table.py::test_texts_that_name_a_material",
         "materials/test_table.py::test_texts_that_only_look_like_one", "materials/test_cards.py"),
    ),
    36: Case(
        "order does not matter", "made",
        ("test_aggregation_cases.py::test_case_36_order_of_parts_does_not_matter",
         LAWS + "test_order_does_not_matter"),
    ),
    37: Case(
        "a rigid move of the whole", "made",
        ("test_aggregation_cases.py::test_case_37_moving_everything",
         LAWS + "test_moving_all_is_moving_the_sum"),
    ),
    38: Case("one part alone", "made", ("test_aggregation_cases.py::test_case_38_one_part_alone",)),
    39: Case(
        "links sum up to the assembly", "made",
        ("test_aggregation_cases.py::test_case_39_links_sum_up_to_the_assembly",),
    ),
    40: Case(
        "trimesh's Scene as oracle", "made",
        ("test_aggregation_cases.py::test_case_40_trimesh_scene_is_an_independent_oracle",),
    ),
    41: Case("URDF, SDF, MJCF read back", "made", (OUTPUT + "test_case_41_snippets_read_back",)),
    42: Case(
        "MuJoCo", "made, and every real file",
        (OUTPUT + "test_case_42_mujoco_loads_every_link", OUTPUT + "test_case_42_mujoco_loads_our_urdf",
         "test_real_files.py::test_case_42_mujoco_loads_every_link"),
    ),
    43: Case(
        "report: schema, order, codes", "made",
        (OUTPUT + "test_case_43_json_fits_its_schema",
         OUTPUT + "test_case_43_order_is_stable_and_warnings_complete"),
    ),
}  # fmt: skip


def test_every_case_has_its_tests() -> None:
    """1 to 43, none left out."""
    assert list(CASES) == list(range(1, 44))
    assert all(case.tests and case.what for case in CASES.values())


@pytest.mark.parametrize("number", CASES)
def test_the_tests_of_a_case_exist(number: int) -> None:
    """A test that was renamed or taken away is missed here."""
    for name in CASES[number].tests:
        file, _, function = name.partition("::")
        assert (HERE / file).is_file(), name
        assert not function or function in functions_of(HERE / file), name


@pytest.mark.parametrize("number", CASES)
def test_real_files_are_named_where_they_are_used(number: int, step_files: Path) -> None:
    """A case that says "real" has its file in the public test data."""
    for word in CASES[number].data.split():
        if word.endswith((".stp", ".step")):
            assert (step_files / word).is_file(), word


@cache
def functions_of(path: Path) -> frozenset[str]:
    """Names of the test functions of a file."""
    tree = ast.parse(path.read_text("utf-8"))
    return frozenset(node.name for node in tree.body if isinstance(node, ast.FunctionDef))
