# SPDX-License-Identifier: LGPL-2.1-or-later
"""A command that a message proposes: it works as it is pasted, wherever the reader stands.

* A file or folder is named with its whole path, since the message may be read in a mail.
* Each word is quoted for the shell of this system.
* Nothing shortens a path inside a proposed command (:func:`silo.bom.commands_in_text.outside_commands`).
"""

from __future__ import annotations

import os
import shlex
import subprocess
from pathlib import Path

from silo.platform.system import WINDOWS


def proposed(*words: str | Path) -> str:
    """Write the command of silo-mod in backticks; a word that is a ``Path`` is a file or folder."""
    texts = [os.path.abspath(word) if isinstance(word, Path) else word for word in words]
    quoted = subprocess.list2cmdline(texts) if WINDOWS else shlex.join(texts)
    return f"`silo-mod {quoted}`"
