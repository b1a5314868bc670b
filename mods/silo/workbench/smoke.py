# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD's own test runner finds of the add-on: that it works in this FreeCAD (``--run-test``)."""

from __future__ import annotations

import importlib
import unittest
from typing import Any

from silo import FREECAD_PACKAGES
from silo.bom.walk.links import extract
from silo.workbench.freecad import host

APP: Any = vars(host)["FreeCAD"]


class Smoke(unittest.TestCase):
    """A BOM of documents in memory, and the packages that a server needs."""

    def test_the_packages_can_be_imported(self) -> None:
        for name in FREECAD_PACKAGES:
            importlib.import_module(name)

    def test_a_linked_part_is_counted(self) -> None:
        document = APP.newDocument("SiloSmoke", "Silo smoke", True)
        try:
            part = document.addObject("App::Part", "Bolt")
            top = document.addObject("App::Part", "Top")
            links = [document.addObject("App::Link", f"Link{number}") for number in range(2)]
            for link in links:
                link.LinkedObject = part
            top.Group = links
            assert extract(top).assembly.object_name == "Top"
        finally:
            APP.closeDocument(document.Name)
