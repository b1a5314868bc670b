# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which tests stay in one process when several processes share them: those that share a running program.

pytest-xdist has groups of its own (``xdist_group``), but pytest 9.2 loses them; here the id decides.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pytest

_VERSION = re.compile(r"[\[-](\d+\.\d+)(?=[\]-])")


def group_of(test_id: str) -> str:
    """The name of the group that a test belongs to; one of its own where it shares nothing dear.

    >>> group_of("tests/freecad/test_gui_story.py::test_one[upload-1.0]")
    'tests/freecad/test_gui_story.py 1.0'
    """
    file = test_id.partition("::")[0]
    if file.startswith("tests/browser/") or file == "tests/freecad/test_matrix.py":
        return file  # a server, or what each FreeCAD built for all the others
    if file.startswith("tests/freecad/") and (version := _VERSION.search(test_id)):
        return f"{file} {version[1]}"  # a FreeCAD with its window
    return test_id


def scheduler(config: pytest.Config, log: Any) -> Any:
    """Hands whole groups to the processes, those of many tests first."""
    from xdist.scheduler import LoadScopeScheduling

    class ByGroup(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return group_of(nodeid)

    return ByGroup(config, log)
