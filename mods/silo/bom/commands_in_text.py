# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands of silo-mod that stand in a text: in backticks, and never shortened or changed."""

from __future__ import annotations

import re
from collections.abc import Callable

# In backticks; a backtick inside a quoted word does not end the command.
COMMAND = re.compile(r"`(silo-mod (?:[^`'\"]|'[^']*'|\"[^\"]*\")*)`")


def commands_in(text: str) -> list[str]:
    """List the commands that a text proposes, without their backticks."""
    return COMMAND.findall(text)


def outside_commands(change: Callable[[str], str], text: str) -> str:
    """Change the parts of a text that are no proposed command."""
    pieces, begin = [], 0
    for command in COMMAND.finditer(text):
        pieces += [change(text[begin : command.start()]), command[0]]
        begin = command.end()
    return "".join([*pieces, change(text[begin:])])
