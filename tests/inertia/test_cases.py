# SPDX-License-Identifier: LGPL-2.1-or-later
"""All cases of inertia-facts §9, and a test that holds each; further tests name their case themselves.

Cases 3, 6, 8 and 11 use files of the public test data; 4, 5, 9, 10, 12 and 13 use files of the same trait
that the tests make, since the survey's own are not public; the others need no file.
"""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).parent
CASES = {
    1: "geometry/kernel/test_analytic.py: def test_a_body_is_exact(",
    2: "geometry/kernel/test_analytic.py: def test_an_off_axis_assembly_is_exact(",
    3: "geometry/step/test_real_step.py: def test_as1_has_eighteen_instances_of_five_parts(",
    4: "cases/test_stand_ins.py: def test_case_04_",
    5: "cases/test_stand_ins.py: def test_case_05_",
    6: "geometry/step/test_real_step.py: def test_dm1_agrees_with_the_volumes_that_it_states(",
    7: "cases/test_stand_ins.py: def test_case_07_",
    8: "geometry/step/test_real_step.py: def test_an_empty_product_and_a_body_of_the_assembly_itself(",
    9: "cases/test_stand_ins.py: def test_case_09_",
    10: "cases/test_stand_ins.py: def test_case_10_",
    11: "test_real_files.py: def test_case_11_",
    12: "cases/test_split_files.py: def test_case_12_",
    13: "cases/test_split_files.py: def test_case_13_",
    14: "geometry/step/test_step_products.py: def test_mirrored_and_scaled_placements_are_exact",
    15: "geometry/kernel/test_analytic.py: def test_a_part_baked_a_hundred_metres_away_keeps_its_tensor(",
    16: "output/test_output_cases.py: def test_case_16_",
    17: "geometry/test_isolation.py: def test_a_bad_file_is_a_plain_sentence(",
    18: "cases/test_full_size.py: def test_case_18_",
    19: "output/test_output_cases.py: def test_case_19_",
    20: "cases/test_full_size.py: def test_case_20_",
    21: "bom/test_masses.py: def test_mass_strings(",
    22: "bom/test_parser.py: def test_the_15_shapes(",
    **{number: f'test_mass_cases.py: "case {number}: ' for number in range(23, 33)},
    33: "test_names.py: def test_cases_33_and_34_names(",
    34: "test_names.py: def test_cases_33_and_34_names(",
    35: "test_names.py: def test_case_35_",
    **{number: f"test_aggregation_cases.py: def test_case_{number}_" for number in range(36, 41)},
    41: "output/test_output_cases.py: def test_case_41_",
    42: "test_real_files.py: def test_case_42_",
    43: "output/test_output_cases.py: def test_case_43_",
}  # fmt: skip


def test_every_case_is_listed() -> None:
    """1 to 43, none left out."""
    assert list(CASES) == list(range(1, 44))


@pytest.mark.parametrize("number", CASES)
def test_the_test_of_a_case_exists(number: int) -> None:
    """A test that was renamed or taken away is missed here."""
    file, _, words = CASES[number].partition(": ")
    assert words in (HERE / file).read_text("utf-8")
