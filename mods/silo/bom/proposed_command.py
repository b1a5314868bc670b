# SPDX-License-Identifier: LGPL-2.1-or-later
"""A command that a message proposes: it works as it is pasted, wherever the reader stands.

* A file or folder is named with its whole path, since the message may be read in a mail.
* Each word is quoted for the shell of this system.
* Nobody shortens a path inside a proposed command (:func:`outside_commands`).
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path

# In backticks; a backtick inside a quoted word does not end the command.
COMMAND = re.compile(r"`(silo-mod (?:[^`'\"]|'[^']*'|\"[^\"]*\")*)`")


def proposed(*words: str | Path) -> str:
    """Write the command of silo-mod in backticks; a word that is a ``Path`` is a file or folder."""
    texts = [os.path.abspath(word) if isinstance(word, Path) else word for word in words]
    quoted = subprocess.list2cmdline(texts) if os.name == "nt" else shlex.join(texts)
    return f"`silo-mod {quoted}`"


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
