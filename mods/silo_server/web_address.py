# SPDX-License-Identifier: LGPL-2.1-or-later
"""What may stand in a field for a web address, wherever it is: a page makes a link of it."""

from __future__ import annotations

import re

from silo.bom.message import message
from silo.bom.text import character_problem

LONGEST = 2000
_ADDRESS = re.compile(r"https?://[^\s/]\S*+")


def address_problem(text: str) -> str:
    """Describe why a text is no web address that is kept; "" if it is."""
    if problem := character_problem(text):
        return problem
    if len(text) > LONGEST:
        return message("wanted at most {most} characters, got {length}", most=LONGEST, length=len(text))
    return (
        ""
        if _ADDRESS.fullmatch(text)
        else message("wanted a web address (https://…), got {got}", got=repr(text[:40]))
    )
