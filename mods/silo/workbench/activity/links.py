# SPDX-License-Identifier: LGPL-2.1-or-later
"""Links of a box to pages of the server. Pure."""

from __future__ import annotations

from collections.abc import Callable

from silo.bom.errors import SiloError
from silo.workbench.activity.box import Action, Do
from silo.workbench.words import translate

# Makes an absolute address of a page such as `resolve_url`; raises SiloError for another server's.
Page = Callable[[str], str]


def view_actions(path: str, page: Page) -> tuple[Action, ...]:
    try:
        url = page(path)
    except SiloError:
        # Another server's page: a message must not lead people away from the server of the settings.
        return ()
    return (Action(Do.VIEW, translate("Silo", "View in Silo →"), target=url),)
