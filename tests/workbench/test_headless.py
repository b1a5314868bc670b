# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a batch inside freecadcmd is asked for; tests/freecad/test_headless.py runs it in FreeCAD."""

from __future__ import annotations

import pytest

from silo.bom.errors import InputError
from silo.workbench.headless import HeadlessJob


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "must be a JSON object"),
        ("nonsense", "must be a JSON object"),
        ("[]", "must be a JSON object"),
        ('{"tops": []}', '"tops" must be a list'),
        ('{"tops": "a"}', '"tops" must be a list'),
        ('{"tops": ["a"], "recursiv": true}', "unknown keys: recursiv"),
        ('{"tops": ["a"], "recursive": 1}', '"recursive" must be true or false'),
        ('{"tops": ["a"], "report": true}', '"report" must be a text'),
    ],
)
def test_wrong_arguments_are_told_in_plain_words(text: str | None, words: str) -> None:
    """What was wanted, for each way of getting it wrong."""
    with pytest.raises(InputError) as told:
        HeadlessJob.from_text(text)
    assert words in str(told.value)
