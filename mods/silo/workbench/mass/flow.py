# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the command to the mass window: measure the open assembly, with progress and cancel. GUI thread.

Shapes are measured where they are, in FreeCAD's main thread, face by face; in between the window lives, so
that Cancel works. A modal window keeps the user from changing what is being measured.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from silo.bom.errors import CancelledError, SiloError
from silo.workbench.freecad import host
from silo.workbench.gui import widgets
from silo.workbench.mass.dialog import MassDialog
from silo.workbench.mass.waiting import WaitingWindow
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    pass


class MassFlow:
    """Opens mass windows.

    hardware
        False leaves standard parts out, as the settings say.
    """

    def __init__(self, hardware: bool = True) -> None:
        self._hardware = hardware

    def start(self, doc: Any) -> Any:
        """Measure a document's assembly and show its masses; returns the window, None if there is nothing to
        show.
        """
        title = translate("Silo", "Mass of the assembly")
        try:
            import numpy  # noqa: F401
        except ImportError:
            text = translate("Silo", "This FreeCAD's Python has no numpy, which masses need.")
            widgets.warn(host.main_window(), title, text)
            return None
        try:
            content = self._measured(doc)
        except CancelledError:
            return None
        except SiloError as error:
            widgets.warn(host.main_window(), title, str(error))
            return None
        dialog = MassDialog(content, host.main_window())
        dialog.show()
        return dialog

    def _measured(self, doc: Any) -> Any:
        from silo.inertia.calculation import calculate
        from silo.inertia.geometry.options import ReadOptions
        from silo.inertia.links.link_map import Link, LinkMap
        from silo.inertia.masses import Options
        from silo.inertia.materials.table import load_materials
        from silo.inertia.task import Task
        from silo.workbench.freecad import shapes
        from silo.workbench.mass.rows import shown

        with WaitingWindow(plain(doc.Label, 60)) as waiting:
            assembly = shapes.read_live(doc, ReadOptions(hardware=self._hardware), waiting.report)
        rule = Options(step_density=True, unknown_is_zero=True, own_bom=True)
        # Without anything placed there is nothing for a pattern to match, which would be reported as a fault.
        everything = Link(assembly.name or "assembly", ("**",))
        whole = LinkMap((everything,)) if assembly.instances else None
        task = Task(load_materials(freecad=False), rule, whole, simulated=False)
        return shown(calculate(assembly, None, task))
