# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside a FreeCAD into which ``silo-mod install-addon`` put the add-on: the first commit."""

from __future__ import annotations

from inside import commit, committed, part, ready, register, run, tell


def story() -> None:
    import silo

    ready()
    doc = part("Lever").Document
    register(doc)
    commit(doc)
    tell(**{"from": silo.__path__[0]}, committed=committed())


run(story)
