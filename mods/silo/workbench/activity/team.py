# SPDX-License-Identifier: LGPL-2.1-or-later
"""The box that says that the team works with another FreeCAD. Pure."""

from __future__ import annotations

from silo.bom.walk.document import saved_by
from silo.workbench.activity.box import PaneEntry, own_box
from silo.workbench.tone import Tone
from silo.workbench.words import translate


def of_team(wanted: str, here: tuple[int, int]) -> PaneEntry | None:
    """Make the box that says that the team works with another FreeCAD; None if it does not, or if the server
    does not say.

    wanted
        the team's version, such as "1.0".
    """
    team = saved_by(wanted)
    if not team or team == here:
        return None
    if here > team:
        text = translate(
            "Silo",
            "A file that is saved here may hold objects that the FreeCAD of your colleagues does not know "
            "and does not load.",
        )
    else:
        text = translate(
            "Silo",
            "Files of your colleagues may hold objects that this FreeCAD does not know. You are asked before "
            "a save removes such objects from a file.",
        )
    shown = translate(
        "Silo", "Your team works with FreeCAD {team}; this is {here}", team=wanted, here="{}.{}".format(*here)
    )
    return own_box("team-freecad", shown, text, tone=Tone.WARNING)
