# SPDX-License-Identifier: LGPL-2.1-or-later
"""The list of guards fits the code; `make mutants` plants them."""

from __future__ import annotations

import re
from pathlib import Path

import mutants
import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("guard", mutants.guards(), ids=lambda guard: guard.name)
def test_a_rule_stands_once_in_its_module_and_its_tests_are_there(guard: mutants.Guard) -> None:
    """A rule that moved, or a test that was renamed, is noticed in each run of the tests."""
    compile(guard.planted((ROOT / guard.file).read_text("utf-8")), guard.file, "exec")
    for test in guard.tests:
        path, _, name = test.partition("::")
        assert (ROOT / path).exists(), test
        assert not name or re.search(
            rf"^ *(async )?def {name.partition('[')[0]}\b", (ROOT / path).read_text("utf-8"), re.M
        ), test


def test_a_mutant_whose_rule_is_not_there_is_an_error() -> None:
    """The text stands twice, or not at all."""
    guard = mutants.Guard("a rule", "a.py", "x = 1", "x = 2", ())
    assert guard.planted("x = 1\n") == "x = 2\n"
    for source in ("", "x = 1\nx = 1\n"):
        with pytest.raises(ValueError, match=r"wanted the rule once in a\.py"):
            guard.planted(source)
