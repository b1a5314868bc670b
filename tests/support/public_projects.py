# SPDX-License-Identifier: LGPL-2.1-or-later
"""The folder of public FreeCAD projects beside the repository; tests that need a project skip without it."""

from pathlib import Path

# Without symlinks, for the walk names a document by its real path.
ASSEMBLIES = (Path(__file__).resolve().parents[3] / "shared").resolve() / "data" / "assemblies"
