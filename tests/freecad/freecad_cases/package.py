# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: what FreeCAD itself and its Addon Manager read in our package.xml."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import FreeCAD as App

FILE = os.environ["SILO_TEST_PACKAGE"]


def as_freecad_reads_it() -> dict[str, Any]:
    found = App.Metadata(FILE)
    (workbench,) = found.Content["workbench"]
    return {
        "name": found.Name,
        "version": found.Version,
        "license": found.License[0]["name"],
        "icon": found.Icon,
        "date": getattr(found, "Date", None),
        "urls": [one["location"] for one in found.Urls],
        "freecad_min": found.FreeCADMin,
        "supports": found.supportsCurrentFreeCAD(),
        "depend": sorted(one["package"] for one in found.Depend if not one.get("optional")),
        "optional": sorted(one["package"] for one in found.Depend if one.get("optional")),
        "people": [one["name"] for one in (*found.Maintainer, *found.Author)],
        "workbench": [workbench.Name, workbench.Classname, workbench.Subdirectory, workbench.Icon],
        "tags": sorted(workbench.Tag),
    }


def as_the_addon_manager_reads_it() -> dict[str, Any]:
    for base in (App.getHomePath(), App.getResourceDir()):
        sys.path.insert(0, os.path.join(base, "Mod", "AddonManager"))
    from Addon import Addon

    try:
        addon = Addon("Silo", "", Addon.Status.NOT_INSTALLED, "")
    except AttributeError:
        addon = Addon("Silo")
    addon.load_metadata_file(FILE)
    needed = Addon.Dependencies()
    addon.walk_dependency_tree({}, needed)
    # The manager of 0.20 has another word for it.
    python = getattr(needed, "python_requires", None) or getattr(needed, "python_required", ())
    return {
        "name": addon.display_name,
        "workbench": bool(addon.contains_workbench()),
        "python": sorted(python),
        "others": sorted(map(str, (*needed.required_external_addons, *needed.blockers))),
    }


Path(os.environ["SILO_TEST_OUT"]).write_text(
    json.dumps({"freecad": as_freecad_reads_it(), "manager": as_the_addon_manager_reads_it()})
)
