# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which tests stay in one process when several processes share them: those that share a running program.

pytest-xdist has groups of its own (``xdist_group``), but pytest 9.2 loses them; here the id decides.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pytest

# What takes longest begins first: at the end, one process would work on it alone.
_LONG = re.compile(r"tests/(browser/test_accessibility|freecad/test_(matrix|drawing|package|gui_))")
_VERSION = re.compile(r"[\[-](\d+\.\d+)(?=[\]-])")


def group_of(test_id: str) -> str:
    """The name of the group that a test belongs to; one of its own where it shares nothing dear.

    >>> group_of("tests/freecad/test_gui_story.py::test_one[upload-1.0]")
    'tests/freecad/test_gui_story.py 1.0'
    """
    file = test_id.partition("::")[0]
    if file == "tests/browser/test_accessibility.py":
        return test_id  # the longest ones of all, which are no shorter for sharing a server
    if file.startswith("tests/browser/") or file == "tests/freecad/test_matrix.py":
        return file  # a server, or what each FreeCAD built for all the others
    if file.startswith("tests/freecad/") and (version := _VERSION.search(test_id)):
        return f"{file} {version[1]}"  # a FreeCAD with its window
    return test_id


def scheduler(config: pytest.Config, log: Any) -> Any:
    """Hands whole groups to the processes, long ones and those of many tests first."""
    from xdist.scheduler import LoadScopeScheduling

    class ByGroup(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return group_of(nodeid)

        def _assign_work_unit(self, node: Any) -> None:
            first = min(self.workqueue, key=lambda group: _LONG.match(group) is None)
            self.workqueue.move_to_end(first, last=False)
            super()._assign_work_unit(node)

    return ByGroup(config, log)
