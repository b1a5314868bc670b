# SPDX-License-Identifier: LGPL-2.1-or-later
"""The folder of a file as it is shown: short, and the same on every machine."""

from __future__ import annotations

import os.path
from types import ModuleType

from silo.bom.commands_in_text import outside_commands
from silo.bom.entry import Extraction
from silo.bom.message import altered
from silo.bom.walk.document import relative


def project_folder(path: str, top: str = "", rules: ModuleType = os.path) -> str:
    """Return a file's folder as people call it, the same on every machine: ``robot``, ``robot/arm``.

    It begins with the folder of ``top``, the assembly of the whole run; for a file outside of that folder it
    is the file's own folder.
    """
    base = rules.dirname(top or path)
    inner = relative(rules.dirname(path), base, rules)
    name = rules.basename(base)
    if inner in ("", ".") or not base:
        return str(name)
    if inner.startswith("..") or rules.isabs(inner):
        return str(rules.basename(rules.dirname(path)))
    return f"{name}/{inner}" if name else inner


def base_folder(extraction: Extraction) -> str:
    """Return the folder to which printed paths are relative: that of the top file."""
    return os.path.dirname(extraction.assembly.doc_path)


def shorten(message: str, base: str) -> str:
    """Cut the folder ``base`` from the paths in a message, but for commands that it proposes."""
    folder = base.rstrip("/\\")
    # The root of the disk cannot be left out: all separators would go.
    if not folder:
        return message
    return altered(
        message, lambda text: outside_commands(lambda part: part.replace(folder + os.sep, ""), text)
    )
